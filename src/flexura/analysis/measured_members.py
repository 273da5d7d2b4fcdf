"""How far beams were measured to be off: stiffness of single members against solids.

`member_errors.csv` has the errors, which benchmarks/member_errors.py measures and adds to: members of constant or
notched form between rigid faces, by ratios of their sizes, Poisson's ratio 0.3 and at some of them others.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.mechanism import CircularContour, Flexure, Leaf, Link, Notch, Rectangle, StraightContour

Array = NDArray[np.float64]

ERRORS = ("stretch", "twist", "y moment", "y parallel", "z moment", "z parallel")
"""Stiffnesses that are measured: those of bending about local y and z by moments and between parallel ends."""

DIRECTIONS = ("stretch", "twist", "thickness bending", "width bending")
"""Kinds of deformation that have errors, in their order."""

KINDS_OF_MEMBERS: dict[str, tuple[str, ...]] = {
    "leaf": ("larger side over smaller side", "length over larger side"),
    "right-circular notch": ("radius over web", "width over length"),
}
"""Ratios of the sizes of every kind of member, in the order of the columns of the table."""

BEAMS: dict[str, dict[str, Any]] = {
    "auto": {"corrections": "auto"},
    "shear": {"corrections": "none", "theory": "timoshenko"},
    "none": {"corrections": "none"},
}
"""What a mechanism says of the beams that are measured."""


@dataclass(frozen=True)
class MemberErrors:
    """How far the stiffness of a member is off: the part's is the model's over 1 + e, with e between `low` and `high`.

    Both are (4,), in the order of DIRECTIONS; bending takes in bending by moments and between parallel ends. `reason`
    says why the evidence does not cover the member: then the errors are those of the nearest one that was measured, or
    NaN where none is of its kind. It is empty where the member is covered.
    """

    low: Array
    high: Array
    reason: str = ""

    @property
    def is_known(self) -> bool:
        """Whether there are errors at all, of this member or of one near it."""
        return not bool(np.isnan(self.low).any())


class _Grid(NamedTuple):
    """Logarithms of the stiffness over the solid's (..., 6) and their uncertainty for the mesh (..., 1), over the
    logarithms of ratios, and by how much they change with Poisson's ratio at most (6,)."""

    axes: tuple[Array, ...]
    stiffness: Array
    mesh: Array
    by_nu: Array

    def at(self, ratios: tuple[float, ...], nu: float) -> tuple[Array, Array]:
        """Logarithms (6,) and their uncertainty (6,): linear between rows, as uncertain as the curvature of the rows
        around makes that."""
        weights = [
            np.array([np.interp(np.log(x), axis, own) for own in np.eye(len(axis))])
            for x, axis in zip(ratios, self.axes, strict=True)
        ]
        uncertain = _mean(self.mesh, weights) + self.by_nu * abs(nu - NU)
        for k, (axis, own) in enumerate(zip(self.axes, weights, strict=True)):
            chosen = np.flatnonzero(own)
            if len(chosen) == 2:
                bound = _curvature(axis, np.moveaxis(self.stiffness, k, 0))[chosen].max(axis=0)
                left = bound * own[chosen].prod() * np.diff(axis[chosen]) ** 2 / 2
                uncertain = uncertain + _mean(left, weights[:k] + weights[k + 1 :])
        return _mean(self.stiffness, weights), uncertain


def _mean(values: Array, weights: list[Array]) -> Array:
    """Values over a grid, averaged by the weights of its axes, the first ones of the array."""
    for own in weights:
        values = np.tensordot(own, values, axes=1)
    return values


def _curvature(axis: Array, values: Array) -> Array:
    """Size of the second derivative along the first axis at its points, of two by all of their difference."""
    steps = np.diff(axis).reshape(-1, *[1] * (values.ndim - 1))
    slopes = np.diff(values, axis=0) / steps
    if len(axis) == 2:
        return np.repeat(2 * np.abs(slopes) / steps, 2, axis=0)
    inner = 2 * np.abs(np.diff(slopes, axis=0)) / (steps[1:] + steps[:-1])
    return np.concatenate([inner[:1], inner, inner[-1:]])


NU = 0.3
"""Poisson's ratio of most rows."""

NUS = (0.1, 0.45)
"""Least and largest Poisson's ratio that is covered."""


@cache
def _measured() -> dict[tuple[str, str], _Grid]:
    """The table, by kind and beam."""
    rows: dict[tuple[str, str], dict[float, dict[tuple[float, ...], Array]]] = defaultdict(lambda: defaultdict(dict))
    with files("flexura.analysis").joinpath("member_errors.csv").open() as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            ratios = tuple(float(row[name]) for name in ("first", "second", "third") if row[name])
            values = np.array([*(np.log1p(float(row[name])) for name in ERRORS), float(row["mesh"])])
            rows[row["kind"], row["beam"]][float(row["nu"])][ratios] = values
    found = {}
    for key, by_nu in rows.items():
        own = by_nu.pop(NU)
        axes = [sorted({ratios[k] for ratios in own}) for k in range(len(next(iter(own))))]
        shape = tuple(map(len, axes))
        table = np.full((*shape, 7), np.nan)
        for at in np.ndindex(shape):
            table[at] = own[tuple(axis[k] for axis, k in zip(axes, at, strict=True))]
        slopes = [np.abs(by_nu[nu][at] - own[at])[:6] / abs(nu - NU) for nu in by_nu for at in by_nu[nu]]
        found[key] = _Grid(tuple(map(np.log, axes)), table[..., :6], table[..., 6:], np.max(slopes, axis=0))
    return found


def ratios_of(form: Any, length: float) -> tuple[str, tuple[float, ...]]:
    """The kind of a section or profile, a key of KINDS_OF_MEMBERS, or what else it is, in words, without ratios."""
    if sides := _sides(form):
        return "leaf", (max(sides) / min(sides), length / max(sides))
    match form:
        case Notch(width=float(b), contour=CircularContour(radius=float(R), web=float(t))):
            if abs(2 * R - length) < 1e-6 * R:
                return "right-circular notch", (R / t, b / (2 * R))
            return "circular notch that is not right-circular", ()
        case Notch(contour=contour):
            return f"{contour.shape.replace('_', '-')} notch", ()
    words = {"two_axis": "two-axis notch", "round": "round notch", "constants": "section given by constants"}
    name = getattr(form, "type", getattr(form, "shape", ""))
    return words.get(name, f"{name} section"), ()


def _sides(form: Any) -> tuple[float, float] | None:
    """Width and thickness where a member is as a leaf all along."""
    match form:
        case Leaf(width=float(b), thickness=float(t)) | Rectangle(width=float(b), thickness=float(t)):
            return b, t
        case Notch(width=float(b), contour=StraightContour(web=float(t))):
            return b, t
    return None


def stiffness_errors(
    member: Link | Flexure, length: float, is_corrected: bool, *, shears: bool | None = None, nu: float = NU
) -> MemberErrors:
    """How far the stiffness of a beam between rigid faces is off, interpolated between solids that were measured.

    member: with its sizes as numbers and, if it is a link, its own section; length: m; is_corrected: by all of
    `corrections: auto`, or by none; shears: whether an uncorrected one is a Timoshenko beam. Nothing is extrapolated:
    outside of what was measured the errors are those of the nearest ratios, and the reason says so.
    """
    form = member.section if isinstance(member, Link) else member.profile
    name = "auto" if is_corrected else "shear" if shears else "none"
    kind, ratios = ratios_of(form, length)
    grid = _measured().get((kind, name))
    if not ratios or grid is None:
        return MemberErrors(np.full(4, np.nan), np.full(4, np.nan), f"no {kind} was measured")
    stiffness, uncertain = grid.at(ratios, nu)
    if (sides := _sides(form)) and sides[0] < sides[1]:
        stiffness, uncertain = (own[[0, 1, 4, 5, 2, 3]] for own in (stiffness, uncertain))
    low = np.expm1(_hull(stiffness - uncertain).min(axis=1))
    high = np.expm1(_hull(stiffness + uncertain).max(axis=1))
    return MemberErrors(low, high, _outside(kind, ratios, grid, nu))


def _hull(values: Array) -> Array:
    """Two values (4, 2) of each direction, of those of six stiffnesses (6,)."""
    return values[[[0, 0], [1, 1], [2, 3], [4, 5]]]


def _outside(kind: str, ratios: tuple[float, ...], grid: _Grid, nu: float) -> str:
    """What of a member lies outside of what was measured, in words; empty where nothing does."""
    names = (*KINDS_OF_MEMBERS[kind], "Poisson's ratio")
    ends = [*((np.exp(axis[0]), np.exp(axis[-1])) for axis in grid.axes), NUS]
    said = []
    for name, x, (least, largest) in zip(names, (*ratios, nu), ends, strict=True):
        if x < least * (1 - 1e-9):
            said.append(f"{name} {x:.3g}, measured from {least:.3g}")
        elif x > largest * (1 + 1e-9):
            said.append(f"{name} {x:.3g}, measured to {largest:.3g}")
    return f"{kind} of {' and of '.join(said)}" if said else ""
