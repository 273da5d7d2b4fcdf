"""Checks of geometry at the default parameters: members, profiles, inertia tensors, spring matrices, joints."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexura.errors import ModelError, Path
from flexura.mechanism.checks.survey import Survey, prefix, shown
from flexura.mechanism.description import Substructure, sheets, solid_members
from flexura.mechanism.diaphragm import Slit
from flexura.mechanism.flat_spring import FlatSpring
from flexura.mechanism.layout import TOP, Point
from flexura.mechanism.member import CORRECTIONS, Flexure, Link, possible_corrections
from flexura.mechanism.planar import edges_of
from flexura.mechanism.quantity import Scalar
from flexura.mechanism.section import (
    Circle,
    CircularContour,
    Contour,
    CornerFilletedContour,
    Layered,
    Leaf,
    Profile,
    Rectangle,
    RoundNotch,
    Section,
    TabulatedContour,
    Tube,
    TwoAxisNotch,
    VShapedContour,
)
from flexura.thresholds import SAME_PLACE, SAME_SIZE

NO_LENGTH = 1e-12
"""A member is without length when its ends are apart by no more than this beside their own coordinates."""
PARALLEL = 1e-6
"""Sine of the angle below which two directions count as parallel."""
SINGULAR = 1e-12
"""A moment of inertia is none that is no larger than this beside the largest."""
EDGE_POINTS = 25
"""Points along an arc of an outline."""

SLIT_POINTS = 400
"""Points along a slit, of which some may meet others."""

JOINT_DISTANCE = 1e-9
"""Distance in m within which joined nodes are at one place, besides `SAME_PLACE` of the size of the mechanism."""


def check_members(survey: Survey) -> None:
    """Report members without length, without orientation, or with a profile that does not fit."""
    if not survey.partial:
        _mesh_sizes(survey)
    for name, prototype in survey.layout.prototypes.items():
        for kind, key, member in prototype.members():
            _member(survey, (*prefix(name), kind, key), member, survey.positions[name])


def check_diaphragms(survey: Survey) -> None:
    """Report diaphragms without a ring between hub and rim."""
    for name, prototype in survey.layout.prototypes.items():
        for key, diaphragm in prototype.diaphragms.items():
            rim, hub = _number(diaphragm.rim_diameter), _number(diaphragm.hub_diameter)
            if hub >= rim:
                rule = f"the hub of a diaphragm is smaller than its rim of {_mm(rim)}"
                survey.report((*prefix(name), "diaphragms", key, "hub_diameter"), _mm(hub), rule, "swap the two?")
            for i, own in enumerate(diaphragm.slits):
                _slit(survey, (*prefix(name), "diaphragms", key, "slits", i), own, (hub / 2, rim / 2))


def check_flat_springs(survey: Survey) -> None:
    """Report outlines that cross themselves, holes off the sheet, and pads along what there is not."""
    for name, prototype in survey.layout.prototypes.items():
        for key, spring in prototype.flat_springs.items():
            path = (*prefix(name), "flat_springs", key)
            counts = {"edges": len(spring.outline), "holes": len(spring.holes)}
            for node, pad in spring.pads.items():
                for kind, count in counts.items():
                    for i, number in enumerate(getattr(pad, kind)):
                        if number > count:
                            rule = f"the sheet has {count} {kind}" if count else f"the sheet has no {kind}"
                            survey.report((*path, "pads", node, kind, i), str(number), rule)
            _outline(survey, path, spring)


def _outline(survey: Survey, path: Path, spring: FlatSpring) -> None:
    """Report an outline that crosses itself, by its edges, and holes that are not inside it."""
    try:
        edges = edges_of(spring.outline)
    except ModelError as error:
        for own in error.problems:
            survey.report((*path, "outline", *own.path), own.value, own.rule, own.hint)
        return
    runs: list[NDArray[np.complex128]] = []
    for k, (a, through, b, _) in enumerate(edges):
        if a == b or through in (a, b):
            there = (k + 1) % len(edges)
            survey.report((*path, "outline", there), "", f"edge {k + 1} has no length: its ends are at one place")
            return
        runs.append(edge_points(complex(*a), complex(*b), None if through is None else complex(*through)))
    crossing = _crossing(runs)
    if crossing is not None:
        one, other, at = crossing
        hint = f"near ({_mm(at.real)}, {_mm(at.imag)})"
        survey.report(
            (*path, "outline"), "", f"the outline crosses itself: edge {one + 1} meets edge {other + 1}", hint
        )
        return
    around = np.concatenate([run[:-1] for run in runs])
    for i, hole in enumerate(spring.holes):
        rim = _complex(hole.centre) + _number(hole.diameter) / 2 * np.exp(2j * np.pi * np.arange(24) / 24)
        turns = np.angle((np.roll(around, -1) - rim[:, None]) / (around - rim[:, None])).sum(axis=1)
        if (np.abs(turns) < np.pi).any():
            survey.report((*path, "holes", i), _mm(_number(hole.diameter)), "a hole lies inside the outline")


def _complex(point: tuple[Scalar, Scalar]) -> complex:
    return complex(_number(point[0]), _number(point[1]))


def edge_points(a: complex, b: complex, through: complex | None) -> NDArray[np.complex128]:
    """Points along an edge: both ends of a line, more of an arc, which is a line after inversion about its first."""
    if through is None or abs(((through - a) * (b - a).conjugate()).imag) < NO_LENGTH * abs(b - a) ** 2:
        return np.array([a, b])
    u, v = 1 / (through - a), 1 / (b - a)
    beyond = np.tan(np.pi / 2 * np.linspace(1.0, 0.0, EDGE_POINTS)[1:-1])
    return np.concatenate([[a], a + 1 / (v + (u - v) * beyond), [b]])


def _crossing(runs: list[NDArray[np.complex128]]) -> tuple[int, int, complex] | None:
    """The first two edges that meet elsewhere than at the corner that they share, and where."""
    a, b = (np.concatenate([run[cut] for run in runs]) for cut in (slice(None, -1), slice(1, None)))
    edge = np.concatenate([np.full(len(run) - 1, k) for k, run in enumerate(runs)])

    def side(p: NDArray[np.complex128], q: NDArray[np.complex128], r: NDArray[np.complex128]) -> NDArray[np.float64]:
        return ((q - p).conjugate() * (r - p)).imag

    first, last, count = a[:, None], b[:, None], len(a)
    apart = (side(first, last, a) * side(first, last, b) <= 0) & (side(a, b, first) * side(a, b, last) <= 0)
    gap = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    found = np.argwhere(np.triu(apart & (gap > 1) & (gap < count - 1)))
    if not len(found):
        return None
    i, j = found[0]
    return int(edge[i]), int(edge[j]), complex((a[i] + b[i]) / 2)


def _slit(survey: Survey, path: Path, slit: Slit, between: tuple[float, float]) -> None:
    """Report a slit that leaves the ring, or meets itself."""
    (r, angle), (to_r, to_angle) = ([_number(x) for x in end] for end in (slit.from_, slit.to))
    for end, radius in (("from", r), ("to", to_r)):
        if not between[0] <= radius <= between[1]:
            rule = f"a slit lies between hub and rim, at radii of {_mm(between[0])} to {_mm(between[1])}"
            survey.report((*path, end), _mm(radius), rule)
    if (r, angle) == (to_r, to_angle):
        survey.report((*path, "to"), _mm(to_r), "a slit goes from one point to another one", "this is where it begins")
        return
    share = np.linspace(0.0, 1.0, SLIT_POINTS)
    at = (r + (to_r - r) * share) * np.exp(1j * (angle + (to_angle - angle) * share))
    far = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(at)))])
    width = _number(slit.width)
    meets = (np.abs(far[:, None] - far) > np.pi * width) & (np.abs(at[:, None] - at) < 1.05 * width)
    if meets.any():
        rule = f"a slit of {_mm(width)} does not come back to itself"
        survey.report(path, f"{math.degrees(abs(to_angle - angle)):g} deg", rule, "a shorter or a narrower one")


def _mesh_sizes(survey: Survey) -> None:
    """Report sizes of meshes where nothing is meshed."""
    mechanism = survey.layout.mechanism
    solid = {name: {**solid_members(mechanism, name), **sheets(mechanism, name)} for name in survey.layout.prototypes}
    hint = "add fidelity: solid, or leave mesh_size out"
    for name, prototype in survey.layout.prototypes.items():
        meshed = solid[name] if name != TOP else any(solid.values())
        if prototype.mesh_size is not None and not meshed:
            rule = "none of the members that it is for has fidelity: solid, so that there is no mesh"
            survey.report((*prefix(name), "mesh_size"), f"{prototype.mesh_size:g}", rule, hint)
        for kind, key, member in prototype.members():
            if member.mesh_size is not None and key not in solid[name]:
                rule = "the member is a beam, which has no mesh"
                survey.report((*prefix(name), kind, key, "mesh_size"), f"{member.mesh_size:g}", rule, hint)
        for key, diaphragm in prototype.diaphragms.items():
            if diaphragm.mesh_size is not None and key not in solid[name]:
                rule = "the diaphragm is a plate, which has no mesh"
                place = (*prefix(name), "diaphragms", key, "mesh_size")
                survey.report(place, f"{diaphragm.mesh_size:g}", rule, hint)


def _member(survey: Survey, path: Path, member: Link | Flexure, positions: dict[str, Point]) -> None:
    form = _form(survey, member)
    if form is not None:
        _corrections(survey, path, member, form)
    if member.reference is None and not (form is None or isinstance(form, Circle | Tube | RoundNotch)):
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
    if length <= NO_LENGTH * (1 + far):
        hint = "its ends are at one place; see the positions of its nodes and its offsets"
        survey.report((*path, "nodes"), ", ".join(member.nodes), "the member has no length", hint)
        return
    if member.reference is not None:
        x, y, z = map(_number, member.reference)
        a, b, c = axis
        across = math.hypot(b * z - c * y, c * x - a * z, a * y - b * x)
        if across < PARALLEL * math.hypot(a, b, c) * math.hypot(x, y, z):
            rule = "the reference is parallel to the axis of the member"
            survey.report((*path, "reference"), f"{x:g}, {y:g}, {z:g}", rule, "choose a direction across the member")
    _fillets(survey, path, member, form, length)
    if isinstance(member, Flexure):
        _profile(survey, (*path, "profile"), member.profile, length)


def _form(survey: Survey, member: Link | Flexure) -> Section | Profile | None:
    """The section of a link, or the profile of a flexure; None where a section is not defined."""
    form = member.section if isinstance(member, Link) else member.profile
    return survey.layout.mechanism.sections.get(form) if isinstance(form, str) else form


def _sum(position: Point, offset: tuple) -> Point:
    return (position[0] + offset[0], position[1] + offset[1], position[2] + offset[2])


def _corrections(survey: Survey, path: Path, member: Link | Flexure, form: Section | Profile) -> None:
    """Report corrections named for a member to which they mean nothing."""
    if not isinstance(member.corrections, tuple):
        return
    possible = possible_corrections(form, member.theory or survey.layout.mechanism.theory)
    for name in member.corrections:
        if name not in possible:
            rule, hint = _MEANINGLESS[name]
            offered = ", ".join(c for c in CORRECTIONS if c in possible) or "none"
            survey.report((*path, "corrections"), name, rule, f"{hint}; possible here: {offered}")


_MEANINGLESS = {
    "plate": ("only a strip can be wide: a rectangle, a leaf or a one-axis notch", "leave it out"),
    "warping": ("warping is known for a rectangle, leaves or a one-axis notch", "leave it out"),
    "root": ("roots are known of rectangles, leaves, notches and rods", "leave it out"),
    "notch": ("only a contour, or a leaf that tapers, has flanks", "leave it out"),
    "shear": ("the theory euler_bernoulli is without shear", "theory: rayleigh or timoshenko"),
}
"""Why a correction cannot apply, and what to do."""


def _fillets(survey: Survey, path: Path, member: Link | Flexure, form: Section | Profile | None, length: float) -> None:
    """Report fillets where none can be, and those that are too large."""
    for end, (fillet, root) in enumerate(zip(member.fillet, member.root, strict=True)):
        radius = _number(fillet)
        if not radius:
            continue
        if form is not None and not isinstance(form, Leaf | Rectangle):
            rule, hint = "fillets are known of leaves and rectangles", "leave it out, or take a corner_filleted contour"
        elif root == "rigid":
            rule, hint = "an end with a rigid root has no fillet", "root: elastic, or no fillet"
        elif radius > length / 2 * (1 + SAME_SIZE):
            rule = f"a fillet is no longer than half the member, {_mm(length / 2)}"
            hint = "a smaller radius, or a part of the shape that it is"
        else:
            continue
        survey.report((*path, "fillet", end), _mm(radius), rule, hint)


def _profile(survey: Survey, path: Path, profile: Profile, length: float) -> None:
    if isinstance(profile, TwoAxisNotch):
        shift = abs(_number(profile.shift))
        if shift >= length:
            rule = f"the shift of the two notches is less than the member's length {_mm(length)}"
            survey.report((*path, "shift"), _mm(_number(profile.shift)), rule)
        else:
            _contour(survey, (*path, "y_contour"), profile.y_contour, length - shift)
            _contour(survey, (*path, "z_contour"), profile.z_contour, length - shift)
    elif not isinstance(profile, Leaf | Layered):
        _contour(survey, (*path, "contour"), profile.contour, length)


def _contour(survey: Survey, path: Path, contour: Contour, length: float) -> None:
    """`length` is that of the notch."""
    half = length / 2
    match contour:
        case CircularContour() if (radius := _number(contour.radius)) < half * (1 - SAME_SIZE):
            rule = f"the radius is at least half the length of the notch, {_mm(half)}"
            hint = "split the member, or use a corner_filleted contour"
            survey.report((*path, "radius"), _mm(radius), rule, hint)
        case CornerFilletedContour() if (radius := _number(contour.fillet_radius)) > half * (1 + SAME_SIZE):
            rule = f"two fillets fit into the notch when their radius is at most half its length, {_mm(half)}"
            survey.report((*path, "fillet_radius"), _mm(radius), rule)
        case VShapedContour() if (angle := _number(contour.angle)) >= math.pi / 2:
            rule = "the flanks make an angle of less than 90 deg with the member axis"
            survey.report((*path, "angle"), f"{math.degrees(angle):g} deg", rule)
        case TabulatedContour():
            first, last = _number(contour.positions[0]), _number(contour.positions[-1])
            if abs(first) > SAME_SIZE * length or abs(last - length) > SAME_SIZE * length:
                rule = f"the positions of a table run from 0 to the length of the notch, {_mm(length)}"
                survey.report((*path, "positions"), f"{_mm(first)} to {_mm(last)}", rule)


def _number(value: Scalar) -> float:
    """A value of a description that has numbers in the place of its expressions."""
    return float(value)  # type: ignore[arg-type]


def _mm(value: float) -> str:
    return f"{shown(value * 1e3)} mm"


def check_bodies(survey: Survey) -> None:
    """Report inertia tensors and spring matrices that are impossible, and joints that gape."""
    for name, prototype in survey.layout.prototypes.items():
        path = prefix(name)
        for kind in ("bodies", "masses"):
            for key, part in getattr(prototype, kind).items():
                if part.inertia is not None:
                    _inertia(survey, (*path, kind, key, "inertia"), part.inertia)
        for key, spring in prototype.springs.items():
            if spring.matrix is not None:
                _stiffness(survey, (*path, "springs", key, "matrix"), np.array(spring.matrix))
        _joints(survey, name, prototype)


def _inertia(survey: Survey, path: Path, entries: tuple[float, ...]) -> None:
    if not np.isfinite(entries).all():
        return
    largest = max(map(abs, entries)) or 1.0
    xx, yy, zz, xy, xz, yz = (entry / largest for entry in (*entries, 0.0, 0.0, 0.0)[:6])
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    low, middle, high = (largest * np.linalg.eigvalsh(tensor)).tolist()
    moments = f"principal moments {shown(low)}, {shown(middle)}, {shown(high)} kg*m^2"
    if low <= SINGULAR * abs(high):
        survey.report(path, moments, "an inertia tensor is positive definite", _ORDER)
    elif low + middle < high * (1 - SAME_SIZE):
        rule = "no principal moment of inertia is larger than the sum of the other two"
        survey.report(path, moments, rule, _ORDER)


_ORDER = "the entries are Ixx, Iyy, Izz and then the tensor's Ixy, Ixz, Iyz (minus the products of inertia)"


def _stiffness(survey: Survey, path: Path, K: NDArray[np.float64]) -> None:
    if not np.isfinite(K).all():
        return
    scale = np.sqrt(np.abs(np.diag(K)))
    unit = np.outer(scale, scale)
    i, j = np.unravel_index(np.argmax(np.abs(K - K.T) - SAME_SIZE * unit), K.shape)
    if abs(K[i, j] - K[j, i]) > SAME_SIZE * max(unit[i, j], abs(K[i, j])):
        rule = f"the matrix of a spring is symmetric; entries ({i + 1}, {j + 1}) and ({j + 1}, {i + 1}) differ"
        survey.report(path, f"{K[i, j]:g} and {K[j, i]:g}", rule)
        return
    scaled = np.divide(K, unit, out=np.zeros((6, 6)), where=unit > 0)
    impossible = np.diag(K).min() < 0 or K[unit == 0].any()
    if impossible or np.linalg.eigvalsh(scaled).min() < -SAME_SIZE:
        hint = "no motion of the spring may release energy"
        survey.report(path, "", "the matrix of a spring has no negative eigenvalue", hint)


def _joints(survey: Survey, name: str, prototype: Substructure) -> None:
    positions = survey.positions[name]
    for i, (a, b) in enumerate(prototype.joints):
        if a in positions and b in positions:
            distance = math.dist(positions[a], positions[b])
            if distance > JOINT_DISTANCE + SAME_PLACE * survey.size:
                survey.report(
                    (*prefix(name), "joints", i),
                    f"{a}, {b}",
                    f"joined nodes are at one place; these are {shown(distance * 1e3)} mm apart",
                    "a rigid body carries nodes on arms: let one carry both",
                )
