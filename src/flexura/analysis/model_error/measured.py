"""How far beams and their roots were measured to be off: stiffness of members, flexibility of joints, against solids.

`member_errors.csv` has the errors of members, which benchmarks/member_errors.py measures and adds to: members of
constant or notched form between rigid faces, those of `BETWEEN_BLOCKS` between blocks as high as their ends, by ratios
of their sizes, Poisson's ratio 0.3 and at some of them others.
`root_errors.csv` has those of elastic roots (benchmarks/roots.py --errors): of roots between the rows that are
interpolated, of blocks wider and narrower than the leaf, and of ratios outside of the table.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam import RATIOS, THINNEST, WIDTHS, rigid_arm
from flexura.full_order import assemble
from flexura.mechanism import (
    Circle,
    CircularContour,
    CornerFilletedContour,
    EllipticalContour,
    Flexure,
    HyperbolicContour,
    Integration,
    Layered,
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
from flexura.thresholds import SAME_SIZE

ERRORS = ("stretch", "twist", "y moment", "y parallel", "z moment", "z parallel")
"""Stiffnesses that are measured: those of bending about local y and z by moments and between parallel ends."""

_CONTOUR = ("half length over depth", "depth over web", "width over length")

KINDS_OF_MEMBERS: dict[str, tuple[str, ...]] = {
    "leaf": ("larger side over smaller side", "length over larger side"),
    "tapered leaf": (
        "larger side over smaller side",
        "length over larger side",
        "larger side at its narrow end over that at the other",
        "smaller side at that end over that at the other",
    ),
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

BETWEEN_BLOCKS = ("right-circular notch", "circular notch", "elliptical notch")
"""Kinds that are measured between blocks as high and as long as their ends are high."""

OTHER_BLOCKS, OTHER_TWIST = 0.02, 0.01
"""By how much, in logarithms, their stiffness is unsure between other blocks, half or twice as long or three times as
high; and what the square of width over length times that adds to twist."""

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

    def at(self, ratios: tuple[float, ...]) -> tuple[Array, Array]:
        """Values (n,), linear between rows and those of the last row beyond, and what that leaves (n,), as far as
        values bend at the rows around."""
        weights = [
            np.array([np.interp(np.log(x), axis, row) for row in np.eye(len(axis))])
            for x, axis in zip(ratios, self.axes, strict=True)
        ]
        left = np.zeros(self.values.shape[-1])
        for k, (axis, weight) in enumerate(zip(self.axes, weights, strict=True)):
            around = np.flatnonzero(weight)
            if len(around) == 2:
                bend = _curvature(axis, np.moveaxis(self.values, k, 0))[around].max(axis=0)
                most = bend * weight[around].prod() * np.diff(axis[around]) ** 2 / 2
                left = left + _mean(most, weights[:k] + weights[k + 1 :])
        return _mean(self.values, weights), left


class _Kind(NamedTuple):
    """Logarithms of the stiffness of a beam over the solid's and their uncertainty for the mesh, seven values, and by
    how much the former change with Poisson's ratio, six."""

    known: _Grid
    by_nu: _Grid

    def at(self, ratios: tuple[float, ...], nu: float) -> tuple[Array, Array]:
        """Logarithms (6,) and their uncertainty (6,): half of what another Poisson's ratio changes is not trusted."""
        known, left = self.known.at(ratios)
        change = self.by_nu.at(ratios)[0] * (nu - NU)
        return known[:6] + change, left[:6] + known[6] + np.abs(change) / 2


def _mean(values: Array, weights: list[Array]) -> Array:
    """Values over a grid, averaged by the weights of its axes, the first ones of the array."""
    for weight in weights:
        values = np.tensordot(weight, values, axes=1)
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

ASYMPTOTIC = (
    "larger side over smaller side",
    "length over larger side",
    "length over diameter",
    "length over outer diameter",
)
"""Ratios of which beams and thin plates are the limit, so that beyond the largest its errors hold."""

NUS = (0.1, 0.45)
"""Least and largest Poisson's ratio that is covered."""


def _table(name: str) -> Iterator[dict[str, str]]:
    """The rows of a table beside this module, by column."""
    with files("flexura.analysis.model_error").joinpath(name).open() as file:
        yield from csv.DictReader(line for line in file if not line.startswith("#"))


@cache
def _measured_members() -> dict[str, _Kind]:
    """The rows of corrected beams, by kind: errors of plain ones follow from how much stiffer or softer these are."""
    rows: dict[str, dict[float, dict[tuple[float, ...], Array]]] = defaultdict(lambda: defaultdict(dict))
    for row in _table("member_errors.csv"):
        if row["beam"] == "auto":
            ratios = tuple(float(row[name]) for name in RATIOS_OF if row[name])
            values = np.array([*(np.log1p(float(row[name])) for name in ERRORS), float(row["mesh"])])
            rows[row["kind"]][float(row["nu"])][ratios] = values
    kinds = {}
    for kind, by_nu in rows.items():
        usual = by_nu.pop(NU)
        changes = {at: (e - usual[at])[:6] / (nu - NU) for nu, other in by_nu.items() for at, e in other.items()}
        known, changed = _Grid.of(usual), _Grid.of(changes)
        if known and changed:
            kinds[kind] = _Kind(known, changed)
    return kinds


def ratios_of(form: Any, length: float) -> tuple[str, tuple[float, ...]]:
    """The kind of a section or profile, a key of KINDS_OF_MEMBERS, with its ratios, or what else it is, in words."""
    if sides := _sides(form):
        ratios = (max(sides) / min(sides), length / max(sides))
        return ("tapered leaf", (*ratios, *_tapers(form))) if _is_tapered(form) else ("leaf", ratios)
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
        case Layered():
            return "layered leaf", ()
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


def _is_tapered(form: Any) -> bool:
    """Whether the form is a leaf that tapers."""
    return isinstance(form, Leaf) and form.tapers


def _tapers(form: Any) -> tuple[float, float]:
    """Sizes of the larger and of the smaller side of a leaf at the end where the larger is narrower over those at the
    other."""
    mean_width, mean_thickness = _sides(form) or (0.0, 0.0)
    larger, smaller = (float(np.divide(*np.broadcast_to(size, 2)[::-1])) for size in (form.width, form.thickness))
    if mean_width < mean_thickness:
        larger, smaller = smaller, larger
    return (1 / larger, 1 / smaller) if larger > 1 else (larger, smaller)


def _sides(form: Any) -> tuple[float, float] | None:
    """Width and thickness where a member is as a leaf all along, means of one that tapers."""
    if _is_tapered(form):
        width, thickness = (float(np.mean(size)) for size in (form.width, form.thickness))
        return width, width if abs(thickness - width) < SAME_SIZE * width else thickness
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
    form: Any, length: float, nu: float, beam: str, elements: int, integration: Integration | None
) -> Mechanism:
    """A member along x between rigid faces at nodes a, which is clamped, and b, its Young's modulus 1 Pa.

    form: a section or profile; length: m; nu: Poisson's ratio; beam: a key of BEAMS.
    """
    about: dict[str, Any] = {"nodes": ("a", "b"), "material": "own", "reference": "z", "elements": elements}
    about |= {"ends": ("clamped", "clamped"), "root": "rigid"}
    if isinstance(form, Rectangle | Circle | Tube | SectionConstants):
        described: dict[str, Any] = {"links": {"member": Link(section=form, **about)}}
    else:
        described = {"flexures": {"member": Flexure(profile=form, integration=integration, **about)}}
    described["ground"] = {"a": "clamped"}
    return Mechanism(
        materials={"own": Material(E=1.0, nu=nu, rho=1.0)},
        nodes={"a": (0.0, 0.0, 0.0), "b": (length, 0.0, 0.0)},
        **described,
        **BEAMS[beam],
    )


def beam_stiffness(
    form: Any, length: float, nu: float, beam: str, elements: int, integration: Integration | None
) -> Array:
    """Stiffness (6,), N/m and N m, of `member_between_faces` in the order of ERRORS."""
    model = assemble(member_between_faces(form, length, nu, beam, elements, integration))
    (flexibility,) = (m.elements.member_C for m in model.matrices.values() if len(m.elements.member_C))
    # flexibilities of its elements add up; a matrix of many stiff ones and a thin web has lost this
    middle = np.zeros((len(flexibility), 3))
    middle[:, 0] = length / 2 - np.arange(1, len(flexibility) + 1) * length / len(flexibility)
    arm = rigid_arm(middle)
    C = (arm @ flexibility @ np.swapaxes(arm, -1, -2)).sum(axis=0)
    stretch, shift_y, shift_z, twist, turn_y, turn_z = C.diagonal()
    parallel = shift_z - C[2, 4] ** 2 / turn_y, shift_y - C[1, 5] ** 2 / turn_z
    return 1 / np.array([stretch, twist, turn_y, parallel[0], turn_z, parallel[1]])


EXACT: tuple[int, Integration] = (100, "tapered")
"""Elements and integration of the beams that are measured."""


@lru_cache(maxsize=1000)
def _stiffness(form: Any, length: float, nu: float, beam: str, elements: int, integration: Integration | None) -> Array:
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
    kind, ratios = ratios_of(form, length)
    measured, sides = _measured_members().get(kind), _sides(form)
    beam = form, length, nu, "auto" if is_corrected else "shear" if shears else "none"
    described = member.elements, member.integration if isinstance(member, Flexure) else None
    is_uniform = isinstance(form, SectionConstants | Layered) or (sides is not None and not _is_tapered(form))
    few = np.zeros(6) if is_uniform else _stiffness(*beam, *described) - _stiffness(*beam, *EXACT)
    if not ratios or measured is None:
        unknown = np.full(6, np.nan)
        return MemberErrors(unknown, unknown, f"no {kind} was measured", np.expm1(few))
    stiffness, uncertain = measured.at(ratios, nu)
    if kind in BETWEEN_BLOCKS:
        broad = ratios[KINDS_OF_MEMBERS[kind].index("width over length")]
        uncertain = uncertain + OTHER_BLOCKS + np.array([0, OTHER_TWIST * broad**2, 0, 0, 0, 0])
    if sides and sides[0] < sides[1]:
        stiffness, uncertain = (values[[0, 1, 4, 5, 2, 3]] for values in (stiffness, uncertain))
    stiffness = stiffness + _stiffness(*beam, *described) - _stiffness(*beam[:3], "auto", *EXACT)
    reason = _outside(kind, ratios, measured.known, nu)
    return MemberErrors(np.expm1(stiffness - uncertain), np.expm1(stiffness + uncertain), reason, np.expm1(few))


def _outside(kind: str, ratios: tuple[float, ...], grid: _Grid, nu: float) -> str:
    """What of a member lies outside of what was measured, in words; empty where nothing does."""
    names = (*KINDS_OF_MEMBERS[kind], "Poisson's ratio")
    ends = [*((np.exp(axis[0]), np.exp(axis[-1])) for axis in grid.axes), NUS]
    beyond = []
    for name, x, (least, largest) in zip(names, (*ratios, nu), ends, strict=True):
        if x < least * (1 - 1e-9):
            beyond.append(f"{name} {x:.3g}, measured from {least:.3g}")
        elif x > largest * (1 + 1e-9) and name not in ASYMPTOTIC:
            beyond.append(f"{name} {x:.3g}, measured to {largest:.3g}")
    return f"{kind} of {' and of '.join(beyond)}" if beyond else ""


MOST_ALIKE = 3
"""Rows of most like joints of which the worst error is taken."""

SIDE, EDGE = 0.7, 0.1
"""Block beside the faces over the thickness, and beside the sides over the width, in the middle of their scales."""

STEEP = 8.0
"""Weight of Poisson's ratio, and of how far a member reaches beyond its block, beside the scales."""

ROOT_ERRORS = ("u_u", "rx_rx", "ry_ry", "rz_rz")
"""Columns with the errors in stretch, twist, thickness bending and width bending."""


def root_shares(ratios: Array) -> Array:
    """What is to be added, least and most (k, 4, 2), to the flexibility of roots in stretch, twist, thickness bending
    and width bending, relative: the worst errors of the MOST_ALIKE rows.

    ratios: (k, 5), Poisson's ratio, width, larger and smaller distance from the faces of the member to those of the
    block, and how far the block reaches beyond its sides, sizes over the thickness.
    """
    measured, errors = _measured_roots()
    squares = ((_scaled(ratios)[:, None] - measured) ** 2).sum(axis=-1)
    added = (1 / (1 + errors) - 1)[np.argsort(squares, axis=1, kind="stable")[:, :MOST_ALIKE]]
    return np.stack([added.min(axis=1), added.max(axis=1)], axis=-1)


def unlike(ratios: Array) -> list[str]:
    """What is unlike the joints in the table (k,), in words, for ratios as above: empty where nothing is. All of one
    sort are told alike, by the ratio that is farthest out."""
    nu, width, larger, _, wider = ratios.T
    held = 1 + 2 * np.minimum(wider, 0.0) / width
    reaches = f"that reaches down to {{:.2g}} thicknesses beyond the member, where {THINNEST:g} is known"
    sorts = (
        (held < 1 - 1e-6, held, "narrower than the member: {:.0%} of its width at least"),
        (width > WIDTHS[1], -width, f"of a member up to {{:.3g}} times as wide as thick, where {WIDTHS[1]:g} is known"),
        (width < WIDTHS[0], width, f"of a member only {{:.3g}} times as wide as thick, where {WIDTHS[0]:g} is known"),
        (nu > RATIOS[1], -nu, f"of a Poisson's ratio up to {{:.3g}}, where {RATIOS[1]:g} is known"),
        (nu < RATIOS[0], nu, f"of a Poisson's ratio down to {{:.3g}}, where {RATIOS[0]:g} is known"),
        (larger < THINNEST, larger, reaches),
    )
    texts = [text.format(abs(out[is_so].min())) if is_so.any() else "" for is_so, out, text in sorts]
    return np.select([is_so for is_so, *_ in sorts], texts, "").tolist()


def _scaled(ratios: Array) -> Array:
    """Ratios (k, 5) on scales on which a step of one is a joint of another kind."""
    nu, width, larger, smaller, wider = ratios.T
    beside, over = np.maximum(wider, 0.0) / width, np.minimum(wider, 0.0) / width
    faces = [1 - 1 / (1 + np.maximum(size, 0.0) / SIDE) for size in (larger, smaller)]
    return np.stack([STEEP * nu, np.log(width) / 2, *faces, 1 - 1 / (1 + beside / EDGE), STEEP * over], axis=-1)


@cache
def _measured_roots() -> tuple[Array, Array]:
    """Scaled ratios (n, 6) of all rows, and their errors (n, 4) in ROOT_ERRORS."""
    rows = list(_table("root_errors.csv"))
    ratios = np.array([[float(row[key]) for key in ("nu", "width", "up", "down", "wider")] for row in rows])
    return _scaled(ratios), np.array([[float(row[key]) for key in ROOT_ERRORS] for row in rows])
