"""Who is who in a description, and where: prototypes, instances, node references, poses, positions of nodes.

The mechanism itself is the prototype with the empty name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from itertools import groupby

import numpy as np

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.expressions import Expression
from flexura.mechanism.base import Vector
from flexura.mechanism.channels import Actuator
from flexura.mechanism.description import Mechanism, Substructure
from flexura.mechanism.evaluation import evaluated
from flexura.mechanism.instances import TOP, Specialised
from flexura.mechanism.loads import DISPLACEMENTS, FORCES, Prescribed, command_of
from flexura.mechanism.placement import Affine, Reflect, Step, Turn, copies, reflect, turn
from flexura.mechanism.quantity import Scalar
from flexura.mechanism.temperatures import Warming, warmings


@dataclass(frozen=True)
class Child:
    """One placed copy of a prototype inside another."""

    name: str
    prototype: str
    steps: tuple[Step, ...]


@dataclass
class Layout:
    """Prototypes of a mechanism that are in use, children before parents, and what each exposes.

    A prototype is a substructure, or one with the values that an instance has of its own (`origin_of`); copies with
    equal values share one. `mechanism` holds these beside what is described, and the parameters and materials that are
    theirs.

    Raises KeyError when a prototype is not defined and RecursionError when one contains itself; a description that
    passed its checks does neither.
    """

    mechanism: Mechanism
    prototypes: dict[str, Substructure] = field(init=False, default_factory=dict)
    children: dict[str, list[Child]] = field(init=False, default_factory=dict)
    specialised: Specialised = field(init=False)

    def __post_init__(self) -> None:
        self.specialised = Specialised(self.mechanism)
        self.include(TOP)

    def include(self, name: str) -> None:
        """Add a prototype and those inside it, whether or not the mechanism uses it."""
        self._include(name, ())
        self.mechanism = self.specialised.whole

    def _include(self, name: str, above: tuple[str, ...]) -> None:
        if name in above:
            raise RecursionError(f"substructure {name} contains itself")
        if name in self.prototypes:
            return
        prototype = self.specialised.prototype(name)
        found = []
        for key, instance in prototype.instances.items():
            for copy, steps in copies(key, instance):
                of = self.specialised.of_copy(name, key, copy)
                self._include(of, (*above, name))
                found.append(Child(copy, of, steps))
        self.children[name] = found
        self.prototypes[name] = prototype

    def evaluate(self, values: Mapping[str, float]) -> None:
        """Put numbers in the place of all expressions of the prototypes, which belong to one design from then on."""
        self.mechanism = evaluated(self.mechanism, values)
        self.prototypes = {name: evaluated(part, values) for name, part in self.prototypes.items()}

    def own_nodes(self, name: str) -> list[str]:
        """Nodes declared in a prototype, and its bodies, which are nodes too."""
        prototype = self.prototypes[name]
        return [*prototype.nodes, *prototype.bodies]

    def exposed(self, name: str) -> list[str]:
        """Nodes that a prototype's own parts may refer to: its own and the interfaces of its instances."""
        of_children = [
            f"{child.name}.{node}"
            for child in self.children[name]
            for node in self.prototypes[child.prototype].interface
        ]
        return self.own_nodes(name) + of_children

    def commanded(self, text: str) -> dict[str, Actuator | Warming]:
        """What a text commands, by name: the actuators as placed that it stands for, or the state of temperature of
        that name, for which no wildcard stands."""
        actuators, states = self.actuators(), warmings(self.mechanism.temperatures)
        found: dict[str, Actuator | Warming] = {name: actuators[name] for name in matching(text, actuators)}
        return found or ({text: states[text]} if text in states else {})

    def actuators(self) -> dict[str, Actuator]:
        """Actuators as placed, by `NAME` or `INSTANCE.NAME`."""
        return {
            ".".join((*path, key)): actuator
            for path, name in self.instances()
            for key, actuator in self.prototypes[name].actuators.items()
        }

    def instances(self) -> Iterator[tuple[tuple[str, ...], str]]:
        """Every placed prototype as (path, prototype), parents before children; the mechanism has the empty path."""
        stack: list[tuple[tuple[str, ...], str]] = [((), TOP)]
        while stack:
            path, name = stack.pop()
            yield path, name
            stack.extend(((*path, c.name), c.prototype) for c in reversed(self.children[name]))


def is_pattern(text: str) -> bool:
    """True when a node reference holds wildcards."""
    return re.search(r"[*?]", text) is not None


def matching(text: str, names: Iterable[str]) -> list[str]:
    """Names that a reference stands for, in natural order of appearance."""
    if not is_pattern(text):
        return [name for name in names if name == text]
    return [name for name in names if fnmatchcase(name, text)]


Point = tuple[float, float, float]


def node_positions(layout: Layout, values: Mapping[str, float]) -> dict[str, dict[str, Point]]:
    """Positions (x, y, z) in m of all exposed nodes of every prototype, each in the prototype's own frame.

    `values` are those of the parameters. Interface nodes that do not exist are left out.
    Raises ExpressionError when a parameter is missing.
    """
    found: dict[str, dict[str, Point]] = {}
    for name, prototype in layout.prototypes.items():
        here = {node: _point(at, values) for node, at in prototype.nodes.items()}
        here |= {key: _point(body.centre, values) for key, body in prototype.bodies.items()}
        for (of, _), group in groupby(layout.children[name], key=_alike):
            children = list(group)
            nodes = [node for node in layout.prototypes[of].interface if node in found[of]]
            if nodes:
                points = _placed(children, values).points(np.array([found[of][node] for node in nodes]))
                for child, placed in zip(children, points.tolist(), strict=True):
                    here |= {f"{child.name}.{n}": (p[0], p[1], p[2]) for n, p in zip(nodes, placed, strict=True)}
        found[name] = here
    return found


def _alike(child: Child) -> tuple[str, tuple[type, ...]]:
    return child.prototype, tuple(type(step) for step in child.steps)


def _placed(children: list[Child], values: Mapping[str, float]) -> Affine:
    """Placements (n, ...) of children whose steps are alike."""
    result = Affine(np.broadcast_to(np.eye(3), (len(children), 3, 3)), np.zeros((len(children), 3)))
    for steps in zip(*(child.steps for child in children), strict=True):
        result = result.then(_stacked(steps, values))
    return result


def _stacked(steps: tuple[Step, ...], values: Mapping[str, float]) -> Affine:
    fields = [np.array([_numbers(field, values) for field in column]) for column in zip(*steps, strict=True)]
    if isinstance(steps[0], Turn):
        return turn(fields[0], fields[1][:, 0], fields[2])
    if isinstance(steps[0], Reflect):
        return reflect(fields[0], fields[1])
    return Affine(np.broadcast_to(np.eye(3), (len(steps), 3, 3)), fields[0])


def _numbers(field: Scalar | Iterable[Scalar], values: Mapping[str, float]) -> list[float]:
    scalars = field if isinstance(field, tuple) else (field,)
    return [float(s.evaluate(values)) if isinstance(s, Expression) else float(s) for s in scalars]  # type: ignore[arg-type]


def _point(vector: Vector, values: Mapping[str, float]) -> Point:
    x, y, z = _numbers(vector, values)
    return x, y, z


@verb
def at(mechanism: Mechanism, move: Mapping[str, float]) -> Mechanism:
    """The mechanism described at a pose, about which everything linear then is.

    `move` prescribes displacements from rest by name, as `{"carriage.y": 5e-3}`, m, components of rotation vectors,
    `platform.rz`, rad, dead forces and moments, `carriage.Fy`, N and N m, and commands of actuators, `*.piezo`, in the
    units of their inputs (wildcards allowed). An empty one leads back to rest.

    Raises OptionError for what is neither; nodes that are not there and what is held are named by whatever uses the
    mechanism.
    """
    layout = Layout(mechanism)
    found: dict[str, dict[str, float]] = {}
    for name, value in move.items():
        if isinstance(value, str | bool) or np.ndim(value) != 0 or not np.isfinite(value):
            raise OptionError(f"{name}: {value!r} is refused; a pose takes finite numbers in SI")
        driven = layout.commanded(name)
        node, _, axis = name.rpartition(".")
        if driven:
            for actuator, own in driven.items():
                command = command_of(own)
                if command is None:
                    rule = "it accelerates the base, which is at rest there; leave it out"
                    raise OptionError(f"{actuator} has no place in a pose: {rule}")
                found[actuator] = {command: float(value)}
        elif node and axis in (*DISPLACEMENTS, *FORCES):
            found.setdefault(node, {})[axis] = float(value)
        else:
            actuators = ", ".join(layout.actuators())
            known = f", or one of the actuators {actuators}" if actuators else ""
            raise OptionError(
                f"{name!r} is no displacement: write NODE.AXIS, an axis of {', '.join(DISPLACEMENTS)}, or a force of"
                f" {', '.join(FORCES)}{known}"
            )
    return mechanism.replaced({"at": {name: Prescribed(**given) for name, given in found.items()}})
