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
from flexura.structure.topology import Topology
from flexura.structure.values import ValueTable


class Expands(NamedTuple):
    """What a thing is and what it does when it is warmer: its kind, and the entries of its coefficient of expansion and
    of the relative change of its moduli, 1/K; NaN there where none is known."""

    kind: str
    expansion: int
    softening: int


class Warmth(NamedTuple):
    """How much warmer a thing is, K, at `about` (3,), m, None for its own middle, with a gradient (3,), K/m, global
    axes; and its coefficients, 1/K, NaN where none is known."""

    kind: str
    temperature: Array
    gradient: Array
    about: Array | None
    expansion: Array
    softening: Array

    def at(self, points: Array, middle: Array) -> Array:
        """Temperatures (...), K, at points (..., 3) of a thing with a middle (3,)."""
        return self.temperature + (points - (middle if self.about is None else self.about)) @ self.gradient


class Temperatures:
    """The keys `temperatures` and `ground_material` of a mechanism, and the coefficients of all that is in it."""

    def __init__(self, layout: Layout, table: ValueTable) -> None:
        self._mechanism = mechanism = layout.mechanism
        none = table.add(np.nan)

        def of(kind: str, expansion: object, softening: object) -> Expands:
            entries = [none if own is None else table.add(own) for own in (expansion, softening)]  # type: ignore[arg-type]
            return Expands(kind, *entries)

        def made_of(kind: str, material: Material, expansion: object = None) -> Expands:
            return of(kind, material.expansion if expansion is None else expansion, material.softening)

        self._things: dict[str, dict[str, Expands]] = {}
        for name, prototype in layout.prototypes.items():
            own = self._things[name] = dict[str, Expands]()
            for key, member in (*prototype.links.items(), *prototype.flexures.items()):
                layers = _layers(member, mechanism)
                unknown = any(layer.expansion is None for layer in layers)
                material = mechanism.material(member.material)
                own[key] = made_of("layered" if layers else "member", material, np.nan if unknown else None)
            for key, body in prototype.bodies.items():
                if body.solid is None:
                    own[key] = of("body", body.expansion, None)
                else:
                    own[key] = made_of("body", mechanism.material(body.solid.material), body.expansion)
            for key, part in prototype.superelements.items():
                own[key] = of("part", part.expansion, part.softening)
            for key, diaphragm in prototype.diaphragms.items():
                own[key] = made_of("diaphragm", mechanism.material(diaphragm.material))
        ground = mechanism.ground_material
        self._ground = of(GROUND, 0.0, 0.0) if ground is None else made_of(GROUND, mechanism.material(ground))
        zero = table.add(0.0)
        self._states: dict[str, list[tuple[str, tuple[int, ...], tuple[int, ...] | None]]] = {
            name: [(text, *_entries(warmer, table)) for text, warmer in state.items()]
            for name, state in mechanism.temperatures.items()
        }
        everything = [(text, (table.add(1.0), zero, zero, zero), None) for text in ("*", GROUND)]
        self._states.setdefault(UNIFORM, everything)

    @property
    def names(self) -> list[str]:
        """Names of all states, the uniform one last."""
        return list(self._states)

    def of(self, state: str, topology: Topology, values: Array) -> dict[str, Warmth]:
        """All that is warmer in a state, by name as placed, at values (s,).

        Raises ModelError for names of nothing, and OptionError for what has no coefficient of expansion.
        """
        things = dict(self._placed(topology))
        found: dict[str, Warmth] = {}
        for text, numbers, about in self._states[state]:
            matches = [name for name in things if _matches(text, name)]
            if not matches and text != "*":
                path = ("temperatures", state, text)
                raise ModelError([Problem(path, text, "there is no such member, body, part or instance", "")])
            for name in matches:
                thing = things[name]
                place = None if about is None else values[list(about)]
                warm = values[list(numbers)]
                coefficients = values[thing.expansion], values[thing.softening]
                found[name] = Warmth(thing.kind, warm[0], warm[1:], place, *coefficients)
        unknown = [name for name, own in found.items() if np.isnan(plain(own.expansion)) and _is_warm(own)]
        if unknown:
            raise OptionError(
                f"{', '.join(unknown[:5])}{' and others' if len(unknown) > 5 else ''}: no coefficient of expansion is"
                " known; give `expansion` in the material, of a body of mass and inertia alone, or of a part"
            )
        return {name: own for name, own in found.items() if _is_warm(own)}

    def _placed(self, topology: Topology) -> Iterator[tuple[str, Expands]]:
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
    return bool(plain(own.temperature) or np.any(plain(own.gradient)))


def _matches(text: str, name: str) -> bool:
    """Whether a text names a thing, or what it is in. The ground is named by its name alone."""
    if GROUND in (text, name):
        return text == name
    steps = name.split(".")
    return any(fnmatchcase(".".join(steps[: k + 1]), text) for k in range(len(steps)))


def _entries(warmer: Warmer, table: ValueTable) -> tuple[tuple[int, ...], tuple[int, ...] | None]:
    numbers = tuple(table.add_all((warmer.temperature, *warmer.gradient)))
    return numbers, None if warmer.about is None else tuple(table.add_all(warmer.about))
