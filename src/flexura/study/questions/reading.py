"""What is asked of one mechanism: names looked up in it, with what it has where they are not there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from flexura.errors import OptionError
from flexura.expressions import LENGTH, NUMBER
from flexura.mechanism import DOF_NAMES, suggestion
from flexura.structure import Plan
from flexura.study.questions.catalogue import FREQUENCY, KINDS, SIGNS, Argument, Kind, Quantity, unknown_name
from flexura.study.questions.grammar import STROKE, Asked, Place
from flexura.units import format_quantity

AXES = ("x", "y", "z", "rx", "ry", "rz")
"""Axes of displacements as they are shown; those of DOFs are read as well."""

MOST_MODES = 10_000

_NUMBERED = re.compile(r"f([1-9]\d{0,8})")
_SPELLING: dict[str, str] = dict(zip((*DOF_NAMES, *AXES), (*AXES, *AXES), strict=True))


class Freedom(NamedTuple):
    """A displacement that is asked of: its node, by name, and its component, 0 to 5."""

    node: str
    component: int

    @property
    def name(self) -> str:
        """E.g. `platform.x`."""
        return f"{self.node}.{AXES[self.component]}"

    @property
    def turns(self) -> bool:
        """Whether it is a rotation."""
        return self.component >= 3


def pose_text(pose: Sequence[tuple[str, float]]) -> str:
    """A pose as it is written."""
    turns = [_SPELLING[name.rpartition(".")[2]][0] == "r" for name, _ in pose]
    return ", ".join(
        f"{name} = {format_quantity(value, NUMBER if turn else LENGTH, angle=turn)}"
        for (name, value), turn in zip(pose, turns, strict=True)
    )


class Reader:
    """Reads what is asked of the mechanism of a plan. Raises OptionError for what it has not."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    def quantity(self, asked: Asked) -> Quantity:
        """What an asked name stands for."""
        pose = self.pose(asked.at)
        if pose:
            raise OptionError(f"{asked.name} is not known at a pose; leave `at` out")
        tail = f" at {pose_text(pose)}" if pose else ""
        if (numbered := _NUMBERED.fullmatch(asked.name)) is not None:
            if asked.arguments:
                raise OptionError(f"{asked.name} takes no arguments; f(NODE.DOF) is the mode in which that moves most")
            number = int(numbered[1])
            most = min(self.plan.topology.n_dof, MOST_MODES)
            if number > most:
                raise OptionError(f"{asked.name}: there are frequencies from f1 to f{most}")
            return Quantity(asked.name + tail, "Hz", FREQUENCY, (number,), pose)
        kind = KINDS.get(asked.name)
        if kind is None:
            raise OptionError(unknown_name(asked.name))
        read = self.arguments(kind, asked.arguments)
        shown = ", ".join(str(own.name if isinstance(own, Freedom) else own) for own in read)
        text = f"{kind.name}({shown})" if read else kind.name
        return Quantity(text + tail, self.unit(kind, read), kind.name, read, pose)

    def arguments(self, kind: Kind, texts: Sequence[str]) -> tuple[object, ...]:
        """What the arguments of a name stand for."""
        least, most = len(kind.arguments) - kind.optional, len(kind.arguments)
        if not least <= len(texts) <= most or not all(texts):
            raise OptionError(f"{kind.name} is asked as {kind.written}, not with ({', '.join(texts)})")
        return tuple(self.argument(kind.name, own, text) for own, text in zip(kind.arguments, texts, strict=False))

    def argument(self, name: str, kind: Argument, text: str) -> object:
        """What one argument stands for."""
        if kind == "dof":
            return self.freedom(text, name)
        if text not in self.plan.body_names:
            raise OptionError(
                f"{name}({SIGNS[kind]}): there is no body {text!r}; {suggestion(text, self.plan.body_names, 'bodies')}"
            )
        return text

    def unit(self, kind: Kind, _: Sequence[object]) -> str:
        """SI unit of what is asked."""
        return "Hz" if kind.name == FREQUENCY else "kg"

    def freedom(self, text: str, name: str = "at") -> Freedom:
        """The displacement of a name such as `platform.rz`, or `rz` where there is one body."""
        node, _, axis = text.rpartition(".")
        if axis not in _SPELLING:
            raise OptionError(f"{name}: {text!r} is no displacement: write NODE.DOF, a DOF of {', '.join(AXES)}")
        if not node:
            bodies = self.plan.body_names
            if len(bodies) != 1:
                raise OptionError(f"{name}: {text!r} of which node? {suggestion('', bodies, 'bodies')}")
            node = bodies[0]
        topology = self.plan.topology
        try:
            number = int(topology.numbers([node])[0])
        except OptionError:
            known = [*self.plan.body_names, *(own for own in topology.node_names if "[" not in own)]
            raise OptionError(f"{name}: there is no node {node!r}; {suggestion(node, known, 'nodes')}") from None
        component = AXES.index(_SPELLING[axis])
        if topology.held[topology.root[number]].all():
            raise OptionError(f"{name}: {text} cannot move: it is held by the ground")
        return Freedom(node, component)

    def pose(self, places: Sequence[Place]) -> tuple[tuple[str, float], ...]:
        """The displacements of a pose, m and rad."""
        found: dict[str, float] = {}
        for place in places:
            name = self.stroke() if place.name == STROKE else place.name
            own = self.freedom(name)
            if place.dimension != (NUMBER if own.turns else LENGTH) and (place.value or place.dimension is not None):
                expected = "an angle is expected, in deg or rad" if own.turns else "a length is expected, e.g. in mm"
                given = "has no unit" if place.dimension is None else f"is in {place.dimension.unit() or 'rad'}"
                raise OptionError(f"at {place.name}: {expected}; {place.value:g} {given}")
            if own.name in found:
                raise OptionError(f"at {own.name}: a displacement is given twice in one pose")
            found[own.name] = place.value
        return tuple(found.items())

    def stroke(self) -> str:
        """Name of the only displacement of the described motion."""
        moved = list(self.plan.motion.moved(self.plan.values()))
        if len(moved) != 1:
            what = f"there are {len(moved)}: {', '.join(moved)}" if moved else "none is described"
            raise OptionError(f"`at stroke` is along the one displacement of `motion`; {what}; write at NODE.DOF = ...")
        return moved[0]
