"""How far beams were measured to be off: stiffness of single members against solids.

`member_errors.csv` has the errors, which benchmarks/member_errors.py measures and adds to: members of constant or
notched form between rigid faces, by ratios of their sizes, Poisson's ratio 0.3 and at some of them others.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.mechanism import (
    Circle,
    CircularContour,
    CornerFilletedContour,
    EllipticalContour,
    Flexure,
    HyperbolicContour,
    Integration,
    Leaf,
    Link,
    Material,
    Mechanism,
    Notch,
    ParabolicContour,
    Rectangle,
    RoundNotch,
    SectionConstants,
    StraightContour,
    Tube,
    TwoAxisNotch,
    VShapedContour,
)
from flexura.structure import assemble

ERRORS = ("stretch", "twist", "y moment", "y parallel", "z moment", "z parallel")
"""Stiffnesses that are measured: those of bending about local y and z by moments and between parallel ends."""

DIRECTIONS = ("stretch", "twist", "thickness bending", "width bending")
"""Kinds of deformation that have errors, in their order."""

_CONTOUR = ("half length over depth", "depth over web", "width over length")

KINDS_OF_MEMBERS: dict[str, tuple[str, ...]] = {
    "leaf": ("larger side over smaller side", "length over larger side"),
    "rod": ("length over diameter",),
    "tube": ("inner over outer diameter", "length over outer diameter"),
    "right-circular notch": ("radius over web", "width over length"),
    "circular notch": ("radius over web", "width over length", "length over diameter of the arcs"),
    "elliptical notch": _CONTOUR,
    "parabolic notch": _CONTOUR,
    "hyperbolic notch": _CONTOUR,
    "corner-filleted notch": ("fillet radius over web", "length over web", "width over web"),
    "v-shaped notch": ("angle in degrees", "root radius over web", "length over web", "width over length"),
    "round right-circular notch": ("radius over web",),
    "round corner-filleted notch": ("fillet radius over web", "length over web"),
    "two-axis right-circular notch": ("radius over web",),
}
"""Ratios of the sizes of every kind of member, in the order of the columns of the table."""

RATIOS_OF = ("first", "second", "third", "fourth")
"""Columns of the table that hold them."""

BEAMS: dict[str, dict[str, Any]] = {
    "auto": {"corrections": "auto"},
    "shear": {"corrections": "none", "theory": "timoshenko"},
    "none": {"corrections": "none"},
}
"""What a mechanism says of the beams that are measured."""


@dataclass(frozen=True)
class MemberErrors:
    """How far the stiffness of a member is off: the part's is the model's over 1 + e.

    `least` and `most` (6,) bound e of every stiffness, in the order of ERRORS. `reason` says why the evidence does not
    cover the member: then the errors are those of the nearest one that was measured, or NaN where none is of its kind.
    It is empty where the member is covered. `elements` (6,) is the part of e that more elements would take away.
    """

    least: Array
    most: Array
    reason: str = ""
    elements: Array = field(default_factory=lambda: np.zeros(6))

    @property
    def low(self) -> Array:
        """Lower bound (4,) of e, in the order of DIRECTIONS: of bending by moments and between parallel ends."""
        return self.least[_PAIRS].min(axis=1)

    @property
    def high(self) -> Array:
        """Upper bound (4,) of e, likewise."""
        return self.most[_PAIRS].max(axis=1)

    @property
    def is_known(self) -> bool:
        """Whether there are errors at all, of this member or of one near it."""
        return not bool(np.isnan(self.least).any())


_PAIRS = [[0, 0], [1, 1], [2, 3], [4, 5]]
"""Stiffnesses of every direction."""


class _Grid(NamedTuple):
    """Values (..., n) over the logarithms of ratios."""

    axes: tuple[Array, ...]
    values: Array

    @classmethod
    def of(cls, rows: Mapping[tuple[float, ...], Array]) -> _Grid | None:
        """Of values by ratios; None where not all of the grid is there."""
        axes = [sorted(set(own)) for own in zip(*rows, strict=True)]
        shape = tuple(map(len, axes))
        if not rows or len(rows) < np.prod(shape):
            return None
        return cls(tuple(map(np.log, axes)), np.reshape([rows[at] for at in sorted(rows)], (*shape, -1)))

    def _weights(self, ratios: tuple[float, ...]) -> list[Array]:
        """Of the rows of every axis, those at its ends where ratios lie outside."""
        return [
            np.array([np.interp(np.log(x), axis, own) for own in np.eye(len(axis))])
            for x, axis in zip(ratios, self.axes, strict=True)
        ]

    def at(self, ratios: tuple[float, ...]) -> Array:
        """Values (n,), linear between rows."""
        return _mean(self.values, self._weights(ratios))

    def left(self, ratios: tuple[float, ...]) -> Array:
        """What that leaves (n,), as far as values bend at the rows around."""
        weights, left = self._weights(ratios), np.zeros(self.values.shape[-1])
        for k, (axis, own) in enumerate(zip(self.axes, weights, strict=True)):
            chosen = np.flatnonzero(own)
            if len(chosen) == 2:
                bend = _curvature(axis, np.moveaxis(self.values, k, 0))[chosen].max(axis=0)
                most = bend * own[chosen].prod() * np.diff(axis[chosen]) ** 2 / 2
                left = left + _mean(most, weights[:k] + weights[k + 1 :])
        return left


class _Kind(NamedTuple):
    """Logarithms of the stiffness of a beam over the solid's and their uncertainty for the mesh, seven values, and by
    how much the former change with Poisson's ratio, six."""

    known: _Grid
    by_nu: _Grid

    def at(self, ratios: tuple[float, ...], nu: float) -> tuple[Array, Array]:
        """Logarithms (6,) and their uncertainty (6,): half of what another Poisson's ratio changes is not trusted."""
        known, change = self.known.at(ratios), self.by_nu.at(ratios) * (nu - NU)
        return known[:6] + change, self.known.left(ratios)[:6] + known[6] + np.abs(change) / 2


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

SLENDER = (
    "larger side over smaller side",
    "length over larger side",
    "length over diameter",
    "length over outer diameter",
)
"""Ratios of which beams and thin plates are the limit, so that beyond the largest its errors hold."""

NUS = (0.1, 0.45)
"""Least and largest Poisson's ratio that is covered."""


@cache
def _measured() -> dict[str, _Kind]:
    """The rows of corrected beams, by kind: errors of plain ones follow from how much stiffer or softer these are."""
    rows: dict[str, dict[float, dict[tuple[float, ...], Array]]] = defaultdict(lambda: defaultdict(dict))
    with files("flexura.analysis.model_error").joinpath("member_errors.csv").open() as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            ratios = tuple(float(row[name]) for name in RATIOS_OF if row[name])
            values = np.array([*(np.log1p(float(row[name])) for name in ERRORS), float(row["mesh"])])
            if row["beam"] == "auto":
                rows[row["kind"]][float(row["nu"])][ratios] = values
    found = {}
    for kind, by_nu in rows.items():
        own = by_nu.pop(NU)
        changes = {at: (e - own[at])[:6] / (nu - NU) for nu, other in by_nu.items() for at, e in other.items()}
        known, changed = _Grid.of(own), _Grid.of(changes)
        if known and changed:
            found[kind] = _Kind(known, changed)
    return found


def ratios_of(form: Any, length: float) -> tuple[str, tuple[float, ...]]:
    """The kind of a section or profile, a key of KINDS_OF_MEMBERS, with its ratios, or what else it is, in words."""
    if sides := _sides(form):
        return "leaf", (max(sides) / min(sides), length / max(sides))
    match form:
        case Circle(diameter=float(d)):
            return "rod", (length / d,)
        case Tube(outer_diameter=float(d), inner_diameter=float(bore)) if bore > 0:
            return "tube", (bore / d, length / d)
        case Notch(width=float(b), contour=contour):
            return _notch(b, contour, length)
        case RoundNotch(contour=CircularContour(radius=float(R), web=float(t))) if _is_right(R, length):
            return "round right-circular notch", (R / t,)
        case RoundNotch(contour=CornerFilletedContour(fillet_radius=float(r), web=float(t))) if r > 0:
            return "round corner-filleted notch", (r / t, length / t)
        case TwoAxisNotch(y_contour=CircularContour(radius=float(R), web=float(t)), shift=0.0) if (
            form.y_contour == form.z_contour and _is_right(R, length)
        ):
            return "two-axis right-circular notch", (R / t,)
        case RoundNotch(contour=contour):
            return f"round notch of {contour.shape.replace('_', '-')} contour", ()
        case TwoAxisNotch():
            return "two-axis notch of other contours", ()
    return "section given by constants" if isinstance(form, SectionConstants) else "section", ()


def _notch(b: float, contour: Any, length: float) -> tuple[str, tuple[float, ...]]:
    """As `ratios_of` for a one-axis notch of a width, m, whose thickness is not the same all along."""
    match contour:
        case CircularContour(radius=float(R), web=float(t)):
            if _is_right(R, length):
                return "right-circular notch", (R / t, b / length)
            return "circular notch", (R / t, b / length, length / (2 * R))
        case CornerFilletedContour(fillet_radius=float(r), web=float(t)):
            return "corner-filleted notch", (r / t, length / t, b / t)
        case VShapedContour(angle=float(a), root_radius=float(r), web=float(t)) if r > 0:
            return "v-shaped notch", (float(np.degrees(a)), r / t, length / t, b / length)
        case (
            EllipticalContour(depth=float(d), web=float(t))
            | ParabolicContour(depth=float(d), web=float(t))
            | HyperbolicContour(depth=float(d), web=float(t))
        ):
            return f"{contour.shape} notch", (length / (2 * d), d / t, b / length)
    return {"table": "tabulated notch", "v_shaped": "sharp V-shaped notch"}.get(contour.shape, "notch"), ()


def _is_right(radius: float, length: float) -> bool:
    """Whether arcs span the length of a notch."""
    return abs(2 * radius - length) < 1e-6 * radius


def _sides(form: Any) -> tuple[float, float] | None:
    """Width and thickness where a member is as a leaf all along."""
    match form:
        case Leaf(width=float(b), thickness=float(t)) | Rectangle(width=float(b), thickness=float(t)):
            return b, t
        case Notch(
            width=float(b),
            contour=StraightContour(web=float(t))
            | CornerFilletedContour(fillet_radius=0.0, web=float(t))
            | EllipticalContour(depth=0.0, web=float(t))
            | ParabolicContour(depth=0.0, web=float(t))
            | HyperbolicContour(depth=0.0, web=float(t)),
        ):
            return b, t
    return None


def member_between_faces(
    form: Any, length: float, nu: float, beam: str, elements: int, integration: Integration
) -> Mechanism:
    """A member along x between rigid faces at nodes a, which is clamped, and b, its Young's modulus 1 Pa.

    form: a section or profile; length: m; nu: Poisson's ratio; beam: a key of BEAMS.
    """
    own: dict[str, Any] = {"nodes": ("a", "b"), "material": "own", "reference": "z", "elements": elements}
    own |= {"ends": ("clamped", "clamped"), "root": "rigid"}
    described: dict[str, Any] = {"nodes": {"a": (0.0, 0.0, 0.0), "b": (length, 0.0, 0.0)}, "ground": {"a": "clamped"}}
    described |= BEAMS[beam]
    if isinstance(form, Rectangle | Circle | Tube | SectionConstants):
        described["links"] = {"member": Link(section=form, **own)}
    else:
        described["flexures"] = {"member": Flexure(profile=form, integration=integration, **own)}
    return Mechanism(materials={"own": Material(E=1.0, nu=nu, rho=1.0)}, **described)


def beam_stiffness(form: Any, length: float, nu: float, beam: str, elements: int, integration: Integration) -> Array:
    """Stiffness (6,), N/m and N m, of `member_between_faces` in the order of ERRORS: about the middle of a symmetric
    member its six motions part."""
    model = assemble(member_between_faces(form, length, nu, beam, elements, integration))
    (own,) = (own.elements.member_C for own in model.matrices.values() if len(own.elements.member_C))
    # flexibilities of its elements add up; a matrix of many stiff ones and a thin web has lost this
    middle = np.zeros((len(own), 3))
    middle[:, 0] = length / 2 - np.arange(1, len(own) + 1) * length / len(own)
    arm = rigid_arm(middle)
    C = (arm @ own @ np.swapaxes(arm, -1, -2)).sum(axis=0)
    return 1 / C.diagonal()[[0, 3, 4, 2, 5, 1]]


EXACT: tuple[int, Integration] = (100, "tapered")
"""Elements and integration of the beams that are measured."""


@lru_cache(maxsize=1000)
def _stiffness(form: Any, length: float, nu: float, beam: str, elements: int, integration: Integration) -> Array:
    """Logarithms (6,) of the stiffness of a beam."""
    return np.log(beam_stiffness(form, length, nu, beam, elements, integration))


def stiffness_errors(
    member: Link | Flexure, length: float, is_corrected: bool, *, shears: bool | None = None, nu: float = NU
) -> MemberErrors:
    """How far the stiffness of a beam between rigid faces is off, interpolated between solids that were measured.

    member: with its sizes as numbers and, if it is a link, its own section; length: m; is_corrected: by all of
    `corrections: auto`, or by none; shears: whether an uncorrected one is a Timoshenko beam; nu: Poisson's ratio. What
    few elements make of a notch counts, too. Nothing is extrapolated: outside of what was measured the errors are those
    of the nearest ratios, and the reason says so.
    """
    form: Any = member.section if isinstance(member, Link) else member.profile
    name = "auto" if is_corrected else "shear" if shears else "none"
    kind, ratios = ratios_of(form, length)
    measured = _measured().get(kind)
    integration = member.integration if isinstance(member, Flexure) else "stepped"
    own = form, length, nu, name, member.elements, integration
    few = (
        np.zeros(6)
        if isinstance(form, SectionConstants) or _sides(form)
        else _stiffness(*own) - _stiffness(*own[:4], *EXACT)
    )
    if not ratios or measured is None:
        unknown = np.full(6, np.nan)
        return MemberErrors(unknown, unknown, f"no {kind} was measured", np.expm1(few))
    stiffness, uncertain = measured.at(ratios, nu)
    if (sides := _sides(form)) and sides[0] < sides[1]:
        stiffness, uncertain = (own[[0, 1, 4, 5, 2, 3]] for own in (stiffness, uncertain))
    stiffness = stiffness + _stiffness(*own) - _stiffness(*own[:3], "auto", *EXACT)
    reason = _outside(kind, ratios, measured.known, nu)
    return MemberErrors(np.expm1(stiffness - uncertain), np.expm1(stiffness + uncertain), reason, np.expm1(few))


def _outside(kind: str, ratios: tuple[float, ...], grid: _Grid, nu: float) -> str:
    """What of a member lies outside of what was measured, in words; empty where nothing does."""
    names = (*KINDS_OF_MEMBERS[kind], "Poisson's ratio")
    ends = [*((np.exp(axis[0]), np.exp(axis[-1])) for axis in grid.axes), NUS]
    said = []
    for name, x, (least, largest) in zip(names, (*ratios, nu), ends, strict=True):
        if x < least * (1 - 1e-9):
            said.append(f"{name} {x:.3g}, measured from {least:.3g}")
        elif x > largest * (1 + 1e-9) and name not in SLENDER:
            said.append(f"{name} {x:.3g}, measured to {largest:.3g}")
    return f"{kind} of {' and of '.join(said)}" if said else ""
