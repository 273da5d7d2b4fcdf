"""How everything expands and softens, and the states of temperature that are described, laid out once."""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.duals import plain
from flexura.errors import ModelError, OptionError, Problem
from flexura.mechanism import GROUND, UNIFORM, Flexure, Layered, Layout, Link, Material, Mechanism, Warmer
from flexura.structure.heat import Evaluated, HeatNetwork
from flexura.structure.topology import Topology
from flexura.structure.values import ValueTable


class _Thing(NamedTuple):
    """What a thing is, and the entries of its coefficients of expansion and of the change of its moduli, 1/K; NaN there
    where none is known."""

    kind: str
    expansion: int
    softening: int


class _State(NamedTuple):
    """What one text of a state says: entries of temperature and gradient (4,), of a place and of a power."""

    text: str
    field: list[int] | None
    about: list[int] | None
    power: int | None


class Warmth(NamedTuple):
    """How much warmer a thing is, K, at `about` (3,), m, None for its own middle, with a gradient (3,), K/m, global
    axes; and its coefficients, 1/K, NaN where none is known. A member through which heat flows has one temperature in
    each of its `elements` (e,) instead."""

    kind: str
    temperature: Array
    gradient: Array
    about: Array | None
    expansion: Array
    softening: Array
    elements: Array | None = None

    def at(self, points: Array, middle: Array) -> Array:
        """Temperatures (...), K, at points (..., 3) of a thing with a middle (3,); points are one in each element where
        these have temperatures."""
        if self.elements is not None:
            return self.elements if points.ndim > 1 else self.elements.mean()
        return self.temperature + (points - (middle if self.about is None else self.about)) @ self.gradient


class Temperatures:
    """The keys `temperatures`, `thermal_contacts` and `ground_material` of a mechanism, and the coefficients of all
    that is in it."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        mechanism = layout.mechanism
        none, zero, one = (table.add(value) for value in (np.nan, 0.0, 1.0))

        def thing(kind: str, expansion: object, softening: object) -> _Thing:
            entries = [none if own is None else table.add(own) for own in (expansion, softening)]  # type: ignore[arg-type]
            return _Thing(kind, *entries)

        def made_of(kind: str, material: Material, expansion: object = None) -> _Thing:
            return thing(kind, material.expansion if expansion is None else expansion, material.softening)

        self._things: dict[str, dict[str, _Thing]] = {}
        for name, prototype in layout.prototypes.items():
            own = self._things[name] = dict[str, _Thing]()
            for _, key, member in prototype.members():
                layers = _layers(member, mechanism)
                unknown = any(layer.expansion is None for layer in layers)
                material = mechanism.material(member.material)
                own[key] = made_of("layered" if layers else "member", material, np.nan if unknown else None)
            for key, body in prototype.bodies.items():
                if body.solid is None:
                    own[key] = thing("body", body.expansion, None)
                else:
                    own[key] = made_of("body", mechanism.material(body.solid.material), body.expansion)
            for key, part in prototype.superelements.items():
                own[key] = thing("part", part.expansion, part.softening)
            for key, diaphragm in prototype.diaphragms.items():
                own[key] = made_of("diaphragm", mechanism.material(diaphragm.material))
        ground = mechanism.ground_material
        self._ground = thing(GROUND, 0.0, 0.0) if ground is None else made_of(GROUND, mechanism.material(ground))
        self._states: dict[str, list[_State]] = {
            name: [_state(text, warmer, table, zero) for text, warmer in state.items()]
            for name, state in mechanism.temperatures.items()
        }
        everything = [_State(text, [one, zero, zero, zero], None, None) for text in ("*", GROUND)]
        self._states.setdefault(UNIFORM, everything)
        self.network: HeatNetwork = HeatNetwork(layout, table)

    @property
    def names(self) -> list[str]:
        """Names of all states, the uniform one last."""
        return list(self._states)

    @property
    def described(self) -> list[str]:
        """Names of those that are described."""
        return [name for name in self._states if name != UNIFORM]

    def flows(self, state: str) -> bool:
        """Whether heat flows in a state, which makes its temperatures."""
        return any(own.power is not None for own in self._states[state])

    def of(self, state: str, design: Evaluated) -> dict[str, Warmth]:
        """All that is warmer in a state of one design, by name as placed.

        Raises ModelError for names of nothing, and OptionError for what has no coefficient of expansion, or where heat
        flows for what it is not known.
        """
        things, values = dict(self._placed(design.plan.topology)), design.values
        told = self._described_by(state, things)
        found = dict[str, Warmth]()
        if self.flows(state):
            heat = {name: values[own.power] for name, own in told.items() if own.power is not None}
            held = {name: values[own.field[0]] for name, own in told.items() if own.field is not None}
            still = np.zeros(3)
            for name, own in self.network.steady(design, heat, held).items():
                if name in things:
                    thing = things[name]
                    elements = None if own.ndim == 0 else own
                    mean = own if elements is None else own.mean()
                    coefficients = values[thing.expansion], values[thing.softening]
                    found[name] = Warmth(thing.kind, mean, still, None, *coefficients, elements)
        for name, own in told.items():
            if own.field is not None:
                thing, warm = things[name], values[own.field]
                about = None if own.about is None else values[own.about]
                coefficients = values[thing.expansion], values[thing.softening]
                found[name] = Warmth(thing.kind, warm[0], warm[1:], about, *coefficients)
        unknown = [name for name, own in found.items() if np.isnan(plain(own.expansion)) and _is_warm(own)]
        if unknown:
            raise OptionError(
                f"{', '.join(unknown[:5])}{' and others' if len(unknown) > 5 else ''}: no coefficient of expansion is"
                " known; give `expansion` in the material, of a body of mass and inertia alone, or of a part"
            )
        return {name: own for name, own in found.items() if _is_warm(own)}

    def _described_by(self, state: str, things: dict[str, _Thing]) -> dict[str, _State]:
        """What is said of things by name; what is said later goes before. Raises ModelError for names of nothing."""
        told = dict[str, _State]()
        for own in self._states[state]:
            matches = [name for name in things if _matches(own.text, name)]
            if not matches and own.text != "*":
                rule = "there is no such member, body, part or instance"
                raise ModelError([Problem(("temperatures", state, own.text), own.text, rule, f"or `{GROUND}`")])
            told |= dict.fromkeys(matches, own)
        return told

    def _placed(self, topology: Topology) -> Iterator[tuple[str, _Thing]]:
        yield GROUND, self._ground
        for copies in topology.copies.values():
            for path in copies.paths:
                for key, thing in self._things[copies.part.name].items():
                    yield ".".join((*path, key)), thing


def _layers(member: Link | Flexure, mechanism: Mechanism) -> list[Material]:
    """The materials of the layers of a member; none where it has no layers."""
    profile = member.profile if isinstance(member, Flexure) else None
    layers = profile.layers if isinstance(profile, Layered) else ()
    return [mechanism.material(layer.material or member.material) for layer in layers]


def _is_warm(own: Warmth) -> bool:
    return any(np.any(plain(x)) for x in (own.temperature, own.gradient, own.elements) if x is not None)


def _matches(text: str, name: str) -> bool:
    """Whether a text names a thing, or what it is in. The ground is named by its name alone."""
    if GROUND in (text, name):
        return text == name
    steps = name.split(".")
    return any(fnmatchcase(".".join(steps[: k + 1]), text) for k in range(len(steps)))


def _state(text: str, warmer: Warmer, table: ValueTable, zero: int) -> _State:
    if warmer.power is not None:
        return _State(text, None, None, table.add(warmer.power))
    mean = zero if warmer.temperature is None else table.add(warmer.temperature)
    about = None if warmer.about is None else table.add_all(warmer.about)
    return _State(text, [mean, *table.add_all(warmer.gradient)], about, None)
