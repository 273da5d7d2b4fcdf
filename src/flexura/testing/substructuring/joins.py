"""What is joined to what: names of channels and points of parts, resolved to interface displacements and forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

import numpy as np

from flexura.errors import OptionError, did_you_mean
from flexura.mechanism import DOF_NAMES
from flexura.structure import DERIVATIVE, Channel
from flexura.testing.measurement import FORCES
from flexura.testing.substructuring.coupling import Interface
from flexura.testing.substructuring.parts import Part, is_turning

GROUND = "ground"
"""What a part is joined to where it is held."""

ALIGNED = 0.999
"""Cosine of directions from which two channels are along one line."""

NEAR = 1e-6
"""Distance, m, within which a force acts where a motion is read."""


Given = float | Mapping[str, float] | None
"""Stiffness or damping of a joint: of a single channel, by DOF, or none."""


@dataclass(frozen=True)
class Join:
    """What is joined: two channels `PART.CHANNEL`, or all DOFs of two points `PART.POINT`; `second` may be `ground`.

    Rigid, or with a spring and a dashpot in between: `stiffness`, N/m or N m/rad, and `damping`, N s/m or N m s/rad,
    numbers for a single channel, or by DOF (`{"tx": 1e6}`); DOFs that are not named are rigid.
    """

    first: str
    second: str
    stiffness: Given = None
    damping: Given = None


Joins = Sequence[Join | tuple[str, str]]


class End(NamedTuple):
    """An interface DOF of a part: its output and its input among those of the part, and the sign of the input."""

    part: int
    output: int
    input: int
    sign: float


class Connection(NamedTuple):
    """Two ends that are one, or one end at the ground, the sign of the second, and what is between: N/m, N s/m."""

    text: str
    first: End
    second: End | None
    sign: float
    stiffness: float | None
    damping: float | None

    @property
    def is_rigid(self) -> bool:
        """Whether both ends are one."""
        return self.stiffness is None and not self.damping


def connections_of(parts: Sequence[Part], joins: Joins, prefixed: bool) -> list[Connection]:
    """The DOFs that are joined, each with its two ends; names begin with that of the part where they are `prefixed`,
    else the first of a pair is of the first part and the second of the second.

    Raises OptionError for names that are none, channels that are not read or not excited, motions that differ, points
    with other DOFs, impossible joints, and what is joined to itself.
    """
    found: list[Connection] = []
    for join in joins:
        own = join if isinstance(join, Join) else Join(*join)
        text = f"join {own.first} = {own.second}"
        first = _named(parts, own.first, text, None if prefixed else 0)
        second = None if own.second == GROUND else _named(parts, own.second, text, None if prefixed else 1)
        _refuse_other_dofs(text, own, first, second)
        others = dict.fromkeys(first) if second is None else second
        found += [_connection(parts, own, dof, end, others[dof]) for dof, end in first.items()]
    if not found:
        raise OptionError("joins: nothing is joined; name pairs of channels or points, e.g. ('A.tip', 'B.root')")
    return found


def _connection(parts: Sequence[Part], join: Join, dof: str, first: End, second: End | None) -> Connection:
    """One DOF of a join."""
    at = f".{dof}" if dof else ""
    text = f"{join.first}{at}={join.second}{'' if second is None else at}"
    a, b = (None if end is None else parts[end.part].outputs[end.output] for end in (first, second))
    if second is not None and first[:2] == second[:2]:
        raise OptionError(f"join {text}: both are one channel, {join.first}")
    sign = 1.0 if a is None or b is None else _aligned(f"join {text}", a, b)
    between = [_between(f"join {text}", what, value, dof) for what, value in joint_of(join)]
    return Connection(text, first, second, sign, *between)


def interface_of(parts: Sequence[Part], connections: Sequence[Connection], sign: float) -> Interface:
    """Signs and compliances of what is joined (theory eqs. H16, H18); `sign` is -1 where joints are taken away."""
    rows = np.cumsum([0, *(len(part.outputs) for part in parts)])
    columns = np.cumsum([0, *(len(part.inputs) for part in parts)])
    Bu, Bf = np.zeros((len(connections), rows[-1])), np.zeros((len(connections), columns[-1]))
    s = parts[0].s
    compliance = np.zeros((len(s), len(connections)), dtype=complex)
    for k, c in enumerate(connections):
        for end, along in ((c.first, 1.0), (c.second, -c.sign)):
            if end is not None:
                Bu[k, rows[end.part] + end.output] = along
                Bf[k, columns[end.part] + end.input] = along * end.sign
        if not c.is_rigid:
            compliance[:, k] = sign / ((c.stiffness or 0.0) + s * (c.damping or 0.0))
    return Interface(Bu, Bf, compliance)


def joint_of(join: Join) -> tuple[tuple[str, Given], tuple[str, Given]]:
    """What is between the two sides, by what it is."""
    return ("stiffness", join.stiffness), ("damping", join.damping)


def base_name(name: str) -> str:
    """A name without what its motion is read as."""
    return name.removesuffix(":velocity").removesuffix(":acceleration")


def _named(parts: Sequence[Part], name: str, text: str, at: int | None) -> dict[str, End]:
    """The ends that a name stands for, by DOF of a point, or one without a DOF."""
    known = [part.name for part in parts]
    rest = name
    if at is None:
        owner, dot, rest = name.partition(".")
        if not dot or owner not in known:
            hint = did_you_mean(owner, known, f"parts: {', '.join(known)}")
            raise OptionError(f"{text}: {name!r} begins with no name of a part, as in {known[0]}.tip; {hint}")
        at = known.index(owner)
    part = parts[at]
    outputs = {base_name(c.name): i for i, c in reversed(list(enumerate(part.outputs)))}
    outputs |= {c.name: i for i, c in enumerate(part.outputs)}
    if rest in outputs:
        return {"": _end(part, at, outputs[rest], text)}
    dofs = {dof: outputs[f"{rest}.{dof}"] for dof in DOF_NAMES if f"{rest}.{dof}" in outputs}
    if not dofs:
        names = [c.name for c in part.outputs]
        points = {base_name(n).rpartition(".")[0] for n in names} - {""}
        hint = did_you_mean(rest, [*points, *names], f"outputs: {', '.join(names)}")
        raise OptionError(f"{text}: {part.name} has no output {rest!r}, and no point of this name; {hint}")
    return {dof: _end(part, at, i, text) for dof, i in dofs.items()}


def _end(part: Part, at: int, i: int, text: str) -> End:
    """An output with the input that acts on it: that of its name, or the one at its place along its line."""
    out = part.outputs[i]
    if out.quantity not in DERIVATIVE:
        raise OptionError(f"{text}: {part.name} reads {out.name} as {out.quantity}; motions are joined")
    turns = is_turning(out.quantity)
    loads = {j: c for j, c in enumerate(part.inputs) if c.quantity == FORCES[turns]}
    named = [j for j, c in loads.items() if c.name == base_name(out.name)]
    there = [j for j, c in loads.items() if _along(out, c) and _is_there(out, c)]
    if not named and not there:
        acting = ", ".join(c.name for c in part.inputs)
        raise OptionError(
            f"{text}: no {FORCES[turns]} acts on {out.name} of {part.name}, as a join needs beside its motion: an"
            f" input of this name, or one at its place along its line; inputs: {acting or 'none'}"
        )
    j = (named or there)[0]
    return End(at, i, j, _along(out, loads[j]) or _aligned(text, out, loads[j]))


def _along(a: Channel, b: Channel) -> float:
    """1 or -1 where two channels are along one line, 0 where they are not or it is not known."""
    if a.direction is None or b.direction is None:
        return 0.0
    cosine = float(np.dot(a.direction, b.direction))
    return float(np.sign(cosine)) if abs(cosine) >= ALIGNED else 0.0


def _is_there(a: Channel, b: Channel) -> bool:
    """Whether two channels are at one place."""
    if a.position is not None and b.position is not None:
        return float(np.linalg.norm(np.subtract(a.position, b.position))) <= NEAR
    return a.node is not None and a.node == b.node


def _aligned(text: str, a: Channel, b: Channel) -> float:
    """The sign of the second of two channels that are one. Raises OptionError for other motions and other lines."""
    sign = 1.0 if a.direction is None or b.direction is None else _along(a, b)
    turns = [is_turning(c.quantity) for c in (a, b)]
    if turns[0] != turns[1]:
        raise OptionError(f"{text}: {a.name} is {a.quantity}, {b.name} is {b.quantity}: they cannot be one")
    if not sign:
        along = [f"{c.name} along {tuple(round(x, 4) + 0.0 for x in c.direction or ())}" for c in (a, b)]
        raise OptionError(f"{text}: {' and '.join(along)} are not on one line: give parts axes that agree")
    return sign


def _refuse_other_dofs(text: str, own: Join, first: Mapping[str, End], second: Mapping[str, End] | None) -> None:
    """Raise OptionError for points with other DOFs, and for joints at DOFs that are not there."""
    for what, value in joint_of(own):
        unknown = [dof for dof in value if dof not in first] if isinstance(value, Mapping) else []
        if unknown:
            raise OptionError(f"{text}: {what} of {unknown[0]!r}, which is not joined; joined: {', '.join(first)}")
    if second is None or first.keys() == second.keys():
        return
    if "" in first or "" in second:
        raise OptionError(f"{text}: one is a channel, the other a point; join two of a kind")
    lacking = [f"{own.second}.{dof}" for dof in first if dof not in second]
    lacking += [f"{own.first}.{dof}" for dof in second if dof not in first]
    raise OptionError(f"{text}: there is no {', '.join(lacking)}; join DOFs one by one to leave the others free")


def _between(text: str, what: str, value: Given, dof: str) -> float | None:
    """Stiffness or damping of the joint at a DOF; None where it is rigid. Raises OptionError for what is none."""
    if isinstance(value, Mapping):
        value = value.get(dof)
    elif value is not None and dof:
        raise OptionError(f"{text}: {what} of several DOFs is given by DOF, e.g. {{'{dof}': {value:g}}}")
    if value is not None and not (isfinite(value) and (value > 0 or (what == "damping" and value == 0))):
        raise OptionError(f"{text}: {what} is positive and finite, not {value:g}")
    return value
