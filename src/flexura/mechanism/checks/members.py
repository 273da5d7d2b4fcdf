"""Checks of the geometry of links and flexures at the default parameters."""

from __future__ import annotations

import math

from flexura.errors import Path
from flexura.mechanism.checks.survey import Survey, prefix, shown
from flexura.mechanism.corrections import CORRECTIONS
from flexura.mechanism.layout import TOP
from flexura.mechanism.member import Flexure, Link, possible_corrections
from flexura.mechanism.positions import Point
from flexura.mechanism.profile import (
    CircularContour,
    Contour,
    CornerFilletedContour,
    Leaf,
    RoundNotch,
    TabulatedContour,
    TwoAxisNotch,
    VShapedContour,
)
from flexura.mechanism.section import ROUND_SECTIONS, Rectangle
from flexura.mechanism.substructure import solid_members

RELATIVE = 1e-9
ROUND_OFF = 1e-12
"""A member is without length when its ends are apart by no more than this beside their own coordinates."""
PARALLEL = 1e-6
"""Sine of the angle below which two directions count as parallel."""


def check_members(survey: Survey) -> None:
    """Report members without length, without orientation, or with a profile that does not fit."""
    if not survey.partial:
        _mesh_sizes(survey)
    for name, prototype in survey.layout.prototypes.items():
        positions = survey.positions[name]
        for kind in ("links", "flexures"):
            for key, member in getattr(prototype, kind).items():
                _member(survey, (*prefix(name), kind, key), member, positions)


def _member(survey: Survey, path: Path, member: Link | Flexure, positions: dict[str, Point]) -> None:
    _corrections(survey, path, member)
    if not _is_round(survey, member) and member.reference is None:
        hint = "reference: a direction across the member, in the plane of its axis and its thickness"
        survey.report((*path, "reference"), "", "required for a section that is not round, but missing", hint)
    if member.nodes[0] == member.nodes[1] or not all(node in positions for node in member.nodes):
        return
    ends = [positions[node] for node in member.nodes]
    start, end = _sum(ends[0], member.start_offset), _sum(ends[1], member.end_offset)
    axis = [b - a for a, b in zip(start, end, strict=True)]
    length = math.hypot(*axis)
    if not math.isfinite(length):
        return
    far = max(math.hypot(*point) for point in (start, end, *ends))
    if length <= ROUND_OFF * (1 + far):
        survey.report((*path, "nodes"), ", ".join(member.nodes), "the member has no length", _NO_LENGTH)
        return
    if member.reference is not None:
        _reference(survey, path, member, axis)
    _fillets(survey, path, member, length)
    if isinstance(member, Flexure):
        _profile(survey, path, member, length)


def _fillets(survey: Survey, path: Path, member: Link | Flexure, length: float) -> None:
    """Report fillets where none can be, and those that are too large."""
    form = member.section if isinstance(member, Link) else member.profile
    form = survey.layout.mechanism.sections.get(form) if isinstance(form, str) else form
    for end, (radius, root) in enumerate(zip(member.fillet, member.root, strict=True)):
        if not float(radius):  # type: ignore[arg-type]
            continue
        own = (*path, "fillet", end)
        if form is not None and not isinstance(form, Leaf | Rectangle):
            hint = "leave it out, or take a corner_filleted contour"
            survey.report(own, _mm(radius), "fillets are known of leaves and rectangles", hint)
        elif root == "rigid":
            survey.report(own, _mm(radius), "an end with a rigid root has no fillet", "root: elastic, or no fillet")
        elif float(radius) > length / 2 * (1 + RELATIVE):  # type: ignore[arg-type]
            rule = f"a fillet is no longer than half the member, {_mm(length / 2)}"
            survey.report(own, _mm(radius), rule, "a smaller radius, or a part of the shape that it is")


_NO_LENGTH = "its ends are at one place; see the positions of its nodes and its offsets"


def _sum(position: Point, offset: tuple) -> Point:
    return (position[0] + offset[0], position[1] + offset[1], position[2] + offset[2])


def _is_round(survey: Survey, member: Link | Flexure) -> bool:
    if isinstance(member, Flexure):
        return isinstance(member.profile, RoundNotch)
    section = member.section
    if isinstance(section, str):
        section = survey.layout.mechanism.sections.get(section)
    return section is None or isinstance(section, ROUND_SECTIONS)


def _mesh_sizes(survey: Survey) -> None:
    """Report sizes of meshes where nothing is meshed."""
    mechanism = survey.layout.mechanism
    solid = {name: solid_members(mechanism, name) for name in survey.layout.prototypes}
    hint = "add fidelity: solid, or leave mesh_size out"
    for name, prototype in survey.layout.prototypes.items():
        meshed = solid[name] if name != TOP else any(solid.values())
        if prototype.mesh_size is not None and not meshed:
            rule = "none of the members that it is for has fidelity: solid, so that there is no mesh"
            survey.report((*prefix(name), "mesh_size"), f"{prototype.mesh_size:g}", rule, hint)
        for kind in ("links", "flexures"):
            for key, member in getattr(prototype, kind).items():
                if member.mesh_size is not None and key not in solid[name]:
                    rule = "the member is a beam, which has no mesh"
                    survey.report((*prefix(name), kind, key, "mesh_size"), f"{member.mesh_size:g}", rule, hint)


def _corrections(survey: Survey, path: Path, member: Link | Flexure) -> None:
    """Report corrections named for a member to which they mean nothing."""
    mechanism = survey.layout.mechanism
    form = member.section if isinstance(member, Link) else member.profile
    if isinstance(form, str):
        form = mechanism.sections.get(form)
    if form is None or not isinstance(member.corrections, tuple):
        return
    theory = member.theory or mechanism.theory
    possible = possible_corrections(form, theory)
    for name in member.corrections:
        if name not in possible:
            rule, hint = _MEANINGLESS[name]
            offered = ", ".join(c for c in CORRECTIONS if c in possible) or "none"
            survey.report((*path, "corrections"), name, rule, f"{hint}; possible here: {offered}")


_MEANINGLESS = {
    "plate": ("only a strip can be wide: a rectangle, a leaf or a one-axis notch", "leave it out"),
    "warping": ("warping is known for a rectangle, a leaf or a one-axis notch", "leave it out"),
    "root": ("roots are known of rectangles, leaves, notches and rods", "leave it out"),
    "notch": ("only a flexure with a contour has a notch", "leave it out"),
    "shear": ("the theory euler_bernoulli is without shear", "theory: rayleigh or timoshenko"),
}
"""Why a correction cannot apply, and what to do."""


def _reference(survey: Survey, path: Path, member: Link | Flexure, axis: list[float]) -> None:
    x, y, z = (float(c) for c in member.reference or ())  # type: ignore[arg-type]
    a, b, c = axis
    across = math.hypot(b * z - c * y, c * x - a * z, a * y - b * x)
    if across < PARALLEL * math.hypot(a, b, c) * math.hypot(x, y, z):
        rule = "the reference is parallel to the axis of the member"
        survey.report((*path, "reference"), f"{x:g}, {y:g}, {z:g}", rule, "choose a direction across the member")


def _profile(survey: Survey, path: Path, member: Flexure, length: float) -> None:
    profile = member.profile
    path = (*path, "profile")
    if isinstance(profile, Leaf):
        return
    if isinstance(profile, TwoAxisNotch):
        shift = float(profile.shift)  # type: ignore[arg-type]
        if abs(shift) >= length:
            rule = f"the shift of the two notches is less than the member's length {_mm(length)}"
            survey.report((*path, "shift"), _mm(shift), rule)
            return
        length -= abs(shift)
        _contour(survey, (*path, "y_contour"), profile.y_contour, length)
        _contour(survey, (*path, "z_contour"), profile.z_contour, length)
    else:
        _contour(survey, (*path, "contour"), profile.contour, length)


def _contour(survey: Survey, path: Path, contour: Contour, length: float) -> None:
    """`length` is that of the notch."""
    half = length / 2
    match contour:
        case CircularContour() if float(contour.radius) < half * (1 - RELATIVE):  # type: ignore[arg-type]
            rule = f"the radius is at least half the length of the notch, {_mm(half)}"
            hint = "split the member, or use a corner_filleted contour"
            survey.report((*path, "radius"), _mm(contour.radius), rule, hint)
        case CornerFilletedContour() if float(contour.fillet_radius) > half * (1 + RELATIVE):  # type: ignore[arg-type]
            rule = f"two fillets fit into the notch when their radius is at most half its length, {_mm(half)}"
            survey.report((*path, "fillet_radius"), _mm(contour.fillet_radius), rule)
        case VShapedContour() if float(contour.angle) >= math.pi / 2:  # type: ignore[arg-type]
            rule = "the flanks make an angle of less than 90 deg with the member axis"
            survey.report((*path, "angle"), f"{math.degrees(contour.angle):g} deg", rule)  # type: ignore[arg-type]
        case TabulatedContour():
            first, last = contour.positions[0], contour.positions[-1]
            if abs(first) > RELATIVE * length or abs(last - length) > RELATIVE * length:  # type: ignore[operator]
                rule = f"the positions of a table run from 0 to the length of the notch, {_mm(length)}"
                survey.report((*path, "positions"), f"{_mm(first)} to {_mm(last)}", rule)


def _mm(value: object) -> str:
    return f"{shown(float(value) * 1e3)} mm"  # type: ignore[arg-type]
