"""Members as solids in the global frame: numbers only, for solid modellers and meshers.

A member is its section swept from its first to its second end, with an exact contour without dimension, and an outline
sampled from that. Left-handed (mirrored) axes are turned right-handed by reversing local y, about which every section
is symmetric. Members that meet at nodes may be fused to one piece.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.mechanism import evaluated
from flexura.structure import FullOrderModel, MeshedSolid, Pieces, SectionGroup, solids_of

Values = tuple[float, ...]

ENDS = ("start", "end")
MILLIMETRE = 1e-3
STATIONS = 33
"""Stations of an outline along every smooth piece of a curved contour."""
MESHED = 70.0
"""Slope of a contour, degrees, beyond which a tip is too thin to be meshed."""
EDGE = 1e-8
"""Fraction of the length over which the slope of an end is taken."""
DIGITS = 12
"""Significant digits to which shapes are told apart."""


@dataclass(frozen=True)
class MemberShape:
    """The shape of a member of unit length: `kind` as in `SectionGroup`, and its sizes by name over the length.

    Angles stay as they are. Equal shapes compare equal.
    """

    kind: tuple[str, ...]
    sizes: tuple[tuple[str, Values], ...]

    @classmethod
    def of(cls, group: SectionGroup, row: int, values: Array, length: float) -> MemberShape:
        """The shape of one member of a group, from the values of all entries (v,) and its length, m."""
        sizes = []
        for name, entries in group.entries.items():
            relative = np.atleast_1d(values[np.array(entries[row])]) / (1.0 if name.endswith("angle") else length)
            sizes.append((name, tuple(_digits(x) for x in relative)))
        return cls(group.kind, tuple(sorted(sizes)))

    @cached_property
    def _group(self) -> tuple[SectionGroup, Array]:
        group, numbers = SectionGroup(self.kind, [0]), []
        for name, values in self.sizes:
            entries = list(range(len(numbers), len(numbers) + len(values)))
            group.entries[name] = [entries if len(entries) > 1 else entries[0]]
            numbers += values
        group.freeze()
        return group, np.array(numbers)

    def at(self, fractions: Array) -> tuple[Array, Array]:
        """Sizes along y and z (stations,) over the length at fractions (stations,) of it; twice the diameter when
        round."""
        group, numbers = self._group
        sizes = [
            np.broadcast_to(np.ravel(size), fractions.shape) for size in group.sizes(numbers, np.ones(1), fractions)
        ]
        return sizes[0], sizes[-1 if self.family == "rectangle" else 0]

    @property
    def family(self) -> str:
        """`rectangle`, `circle` or `tube`."""
        return self._group[0].family

    @property
    def is_straight(self) -> bool:
        """Whether the section is the same all along."""
        return self.kind[0] in ("rectangle", "leaf", "circle", "tube")

    @property
    def bore(self) -> float:
        """Inner over outer diameter of a tube."""
        sizes = dict(self.sizes)
        return sizes["inner_diameter"][0] / sizes["outer_diameter"][0] if self.family == "tube" else 0.0

    @property
    def ends_in_edges(self) -> bool:
        """Whether flanks stand upright at an end, where the solid runs out in edges without thickness."""
        near_ends = np.array([0.0, EDGE, 1 - EDGE, 1.0])
        return any(max(abs(s[1] - s[0]), abs(s[3] - s[2])) > 100 * EDGE for s in self.at(near_ends))

    @cached_property
    def breaks(self) -> Array:
        """Fractions at which the contour has a kink or its curvature jumps, ends included."""
        sizes = dict(self.sizes)
        if self.kind[0] == "two_axis":
            shift = sizes["shift"][0]
            half = (1 - abs(shift)) / 2
            corners = [
                x - sign * shift / 2
                for shape, axis, sign in zip(self.kind[1:], "yz", (1, -1), strict=True)
                for x in [-half, half, *_corners(shape, {n[2:]: v for n, v in sizes.items() if n[:1] == axis}, half)]
            ]
        else:
            corners = _corners(self.kind[-1], sizes, 0.5)
        inner = sorted(x + 0.5 for x in corners if 1e-6 < x + 0.5 < 1 - 1e-6)
        kept = [x for x, before in zip(inner, [0.0, *inner], strict=False) if x - before > 1e-6]
        return np.array([0.0, *kept, 1.0])

    @cached_property
    def volume(self) -> float:
        """Volume over the cube of the length: Gauss quadrature between breaks, in a coordinate in which upright flanks
        are smooth."""
        g, w = np.polynomial.legendre.leggauss(200)
        angle, total = np.pi * (g + 1) / 2, 0.0
        for first, last in pairwise(self.breaks):
            y, z = self.at(first + (last - first) * (1 - np.cos(angle)) / 2)
            total += float((y * z * np.sin(angle) * w).sum()) * (last - first) * np.pi / 4
        return total if self.family == "rectangle" else total * np.pi / 4 * (1 - self.bore**2)

    def outline(self, length: float) -> Outline:
        """The contour of a member of some length, m, sampled closer towards the ends of its smooth pieces."""
        count = 2 if self.is_straight or self.kind[0] == "tapered" else STATIONS
        spacing = (1 - np.cos(np.pi * np.linspace(0, 1, count))) / 2
        pieces = [a + (b - a) * spacing for a, b in pairwise(self.breaks)]
        x = np.concatenate([[0.0], *(piece[1:] for piece in pieces)])
        y, z = (length * size / 2 for size in self.at(x))
        family = {"leaf": "rectangle"}.get(self.kind[0], self.kind[0])
        return Outline(family, length * x, y, z, self.bore * float(y[0]), tuple(range(0, len(x), count - 1)))


def _digits(value: float) -> float:
    return float(f"{value:.{DIGITS - 1}e}")


def _corners(shape: str, sizes: Mapping[str, Values], half: float) -> list[float]:
    """Distances from the middle of a notch at which its contour is not smooth."""
    match shape:
        case "corner_filleted":
            x = half - sizes["fillet_radius"][0]
        case "v_shaped":
            x = float(sizes["root_radius"][0] * np.sin(sizes["angle"][0]))
        case "table":
            return [p - half for p in sizes["positions"]]
        case _:
            return []
    return [-x, x]


@dataclass(frozen=True)
class Outline:
    """Half sizes of a section along local x, m: stations x (s,), y and z (s,) there, and the inner radius.

    Round families (`circle`, `tube`, `round`) have the radius in both y and z. `breaks` (p + 1,) are the stations
    between which the contour is smooth.
    """

    family: str
    x: Array
    y: Array
    z: Array
    inner: float
    breaks: tuple[int, ...]

    @property
    def length(self) -> float:
        """Length, m."""
        return float(self.x[-1])

    @property
    def is_round(self) -> bool:
        """Whether the section is a circle or a ring."""
        return self.family in ("circle", "tube", "round")

    @property
    def is_straight(self) -> bool:
        """Whether the section is the same all along."""
        return self.family in ("rectangle", "circle", "tube")

    def half(self, x: Array) -> tuple[Array, Array]:
        """Half sizes along y and z at positions x, held beyond the ends."""
        return np.interp(x, self.x, self.y), np.interp(x, self.x, self.z)

    def web(self, x: Array) -> Array:
        """Least thickness of the section at positions x, m: the wall of a tube."""
        y, z = self.half(x)
        return 2 * np.minimum(y, z) if self.inner == 0 else y - self.inner

    def runs(self, half: Array) -> list[Array]:
        """The outline in a plane as runs of points (n, 2), m, that join: along x at +half, back at -half, and both end
        lines."""
        there = [np.stack([self.x[a : b + 1], half[a : b + 1]], axis=-1) for a, b in pairwise(self.breaks)]
        back = [(run * [1.0, -1.0])[::-1] for run in reversed(there)]
        last, first = there[-1][-1], there[0][0]
        return [*there, np.array([last, last * [1.0, -1.0]]), *back, np.array([first * [1.0, -1.0], first])]

    def meridian(self) -> list[Array]:
        """The upper half of a round outline as such runs: there, down to the axis, back along it, and up again."""
        upper = [np.stack([self.x[a : b + 1], self.z[a : b + 1]], axis=-1) for a, b in pairwise(self.breaks)]
        end, start = upper[-1][-1], upper[0][0]
        below = np.array([end[0], 0]), np.array([start[0], 0])
        return [*upper, np.array([end, below[0]]), np.array(below), np.array([below[1], start])]

    def beyond(self, points: Array) -> Array:
        """How far (...) local points (..., 3) lie outside, m, along x or across; negative inside."""
        x, y, z = np.moveaxis(points, -1, 0)
        half_y, half_z = self.half(x)
        along = np.maximum(-x, x - self.length)
        if self.is_round:
            radius = np.hypot(y, z)
            return np.maximum(along, np.maximum(radius - half_y, self.inner - radius))
        return np.maximum(along, np.maximum(np.abs(y) - half_y, np.abs(z) - half_z))

    def blunted(self, steepest: float = MESHED) -> Outline:
        """The outline with tips of a slope beyond `steepest` degrees cut to flatter ones that keep the volume.

        A contour with a vertical tangent at its end, such as that of a right-circular notch, leaves tips of no angle.
        """
        slope = float(np.tan(np.deg2rad(steepest)))
        blunted = self._blunted_start(slope)
        turned = blunted._turned()
        other = turned._blunted_start(slope)
        return blunted if other is turned else other._turned()

    def _turned(self) -> Outline:
        """The outline from its end to its start."""
        breaks = tuple(len(self.x) - 1 - b for b in reversed(self.breaks))
        return replace(self, x=self.length - self.x[::-1], y=self.y[::-1], z=self.z[::-1], breaks=breaks)

    def _blunted_start(self, steepest: float) -> Outline:
        x, sizes, smooth = self.x, (self.y, self.z), self.breaks[1]
        first = 0
        for size in sizes:
            steep = -np.diff(size) / np.diff(x) > steepest
            first = max(first, (int(np.argmin(steep)) if not steep.all() else len(steep)) if steep[0] else 0)
        first = min(first, smooth)
        if first == 0:
            return self
        x_cut, cut = x[first], []
        power = 2 if all(np.ptp(size[: first + 1]) > 0 for size in sizes) else 1
        for size in sizes:
            at, moment = size[first], _moment(x[: smooth + 1], size[: smooth + 1], first, power)
            tip = 2 * moment / x_cut - at
            if power == 2:
                tip = (-at + np.sqrt(max(12 * moment / x_cut - 3 * at**2, at**2))) / 2
            cut.append(np.concatenate([[tip], size[first:]]))
        breaks = sorted({0, 1} | {b - first + 1 for b in self.breaks if b > first})
        return replace(self, x=np.concatenate([[0.0], x[first:]]), y=cut[0], z=cut[1], breaks=tuple(breaks))


def _moment(x: Array, size: Array, last: int, power: int) -> float:
    """The integral of a power of a size over x (s,) up to station `last`, both interpolated smoothly."""
    from scipy.interpolate import CubicSpline  # slow to import

    k = np.arange(len(x))
    points, weights = np.polynomial.legendre.leggauss(24)
    at = last * (points + 1) / 2
    return float((weights * last / 2 * CubicSpline(k, x)(at, 1) * CubicSpline(k, size)(at) ** power).sum())


@dataclass(frozen=True)
class SolidMaterial:
    """An isotropic material: E, Pa; nu; rho, kg/m^3."""

    name: str
    E: float
    nu: float
    rho: float


@dataclass(frozen=True)
class MemberSolid:
    """A placed member: `axes` (3, 3) are its right-handed local axes as rows, `start` (3,) its first end, `length`, m.

    `nodes` are the global numbers of its end nodes and `roots` of what these follow. `fillets` are the radii, m, of
    those at its ends, along z and against it, which `filleted` draws; outlines are without them.
    """

    name: str
    shape: MemberShape
    length: float
    material: SolidMaterial
    start: Array
    axes: Array
    nodes: tuple[int, int]
    roots: tuple[int, int]
    fillets: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))

    @property
    def key(self) -> Hashable:
        """What tells normalised members apart but for their names: shape, size, place and material."""
        E, nu, rho = self.material.E, self.material.nu, self.material.rho
        return self.shape, self.length, E, nu, rho, *self.start.tolist(), *self.axes.ravel().tolist()

    @cached_property
    def outline(self) -> Outline:
        """The contour, sampled, m."""
        return self.shape.outline(self.length)

    @property
    def volume(self) -> float:
        """Volume, m^3, of sections along the length."""
        corners = (1 - np.pi / 4) * sum(r**2 for pair in self.fillets for r in pair)
        return self.shape.volume * self.length**3 + corners * 2 * float(self.outline.y[0])

    def profile(self) -> list[Array]:
        """The profile along x and z, with its fillets where it has one section and some, as runs of points (n, 2), m,
        that join."""
        if not any(map(any, self.fillets)):
            return list(self.outline.runs(self.outline.z))
        h, angle = float(self.outline.z[0]), np.linspace(0.0, np.pi / 2, 9)
        runs: list[Array] = []
        for side in (0, 1):
            away = 1 - 2 * side
            for end in (side, 1 - side):
                r = self.fillets[end][side]
                rise = r * np.stack([1 - np.cos(angle), 1 - np.sin(angle)], axis=-1)
                rise = rise if end == side else rise[::-1]
                at = np.array([self.length * end, away * h]) + rise * [1 - 2 * end, away]
                if runs:
                    runs.append(np.array([runs[-1][-1], at[0]]))
                runs.append(at if r else at[[0, -1]])
        runs.append(np.array([runs[-1][-1], runs[0][0]]))
        return [run for run in runs if np.ptp(run, axis=0).any()]

    def local(self, points: Array) -> Array:
        """Local coordinates (..., 3) of global points."""
        return (points - self.start) @ self.axes.T

    def placed(self, points: Array) -> Array:
        """Global coordinates (..., 3) of local points."""
        return points @ self.axes + self.start

    @cached_property
    def corners(self) -> Array:
        """Corners (8, 3) of the box around it in its axes, m, global frame."""
        y, z = self.outline.y.max(), self.outline.z.max()
        corners = [[x, s * y, t * z] for x in (0.0, self.length) for s in (-1, 1) for t in (-1, 1)]
        return self.placed(np.array(corners))

    @cached_property
    def box(self) -> Array:
        """Lower and upper corner (2, 3) of its bounding box, m."""
        return np.stack([self.corners.min(axis=0), self.corners.max(axis=0)])

    def end_point(self, end: int) -> Array:
        """The middle (3,) of an end face, global frame."""
        return self.placed(np.array([self.length * end, 0.0, 0.0]))

    @cached_property
    def thickness(self) -> float:
        """Least thickness, m: of a tube that of its wall."""
        return float(self.outline.web(self.outline.x).min())

    def beyond(self, points: Array) -> Array:
        """How far (...) global points (..., 3) lie outside, m; negative inside."""
        return self.outline.beyond(self.local(points))

    def holds(self, points: Array, tolerance: float) -> NDArray[np.bool_]:
        """Whether global points (..., 3) lie inside or within `tolerance` of the surface."""
        return self.beyond(points) <= tolerance

    def end_samples(self, end: int, inset: float, count: int = 12) -> Array:
        """Points (n, 3) spread evenly over an end face, `inset` inside it, global frame."""
        shape = self.outline
        y, z, x = shape.y[-end], shape.z[-end], self.length - inset if end else inset
        middle = (np.arange(count) + 0.5) / count
        if shape.is_round:
            r = np.sqrt(shape.inner**2 + (y**2 - shape.inner**2) * middle)[:, None]
            angle = 2 * np.pi * middle
            across = [r * np.cos(angle), r * np.sin(angle)]
        else:
            across = np.meshgrid(y * (2 * middle - 1), z * (2 * middle - 1))
        return self.placed(np.stack([np.full(count**2, x), *(np.ravel(c) for c in across)], axis=-1))

    def samples(self, count: int = 10) -> Array:
        """Points (n, 3) spread over the solid, global frame."""
        middle = (np.arange(count) + 0.5) / count
        x, v, w = (a.ravel() for a in np.meshgrid(middle * self.length, 2 * middle - 1, 2 * middle - 1, indexing="ij"))
        y, z = self.outline.half(x)
        points = np.stack([x, v * y, w * z], axis=-1)
        return self.placed(points[self.outline.beyond(points) <= 0.0])

    def on_end(self, end: int, points: Array, tolerance: float) -> NDArray[np.bool_]:
        """Which global points (n, 3) lie on an end face."""
        local = self.local(points)
        at = self.length if end else 0.0
        flat = np.abs(local[:, 0] - at) <= tolerance
        local[:, 0] = at
        return flat & (self.outline.beyond(local) <= tolerance)


def normalised(members: Sequence[MemberSolid]) -> tuple[MemberSolid, ...]:
    """Members in the axes of the first one, with lengths over its length and E and rho over its own.

    Rounded to 12 digits, nodes aside, so that copies of any place, size and metal give equal numbers.
    """
    first, normal = members[0], []
    for member in members:
        E, rho = (getattr(member.material, key) / getattr(first.material, key) for key in ("E", "rho"))
        material = replace(member.material, E=float(_rounded(E)), rho=float(_rounded(rho)))
        length = float(_rounded(member.length / first.length))
        start, axes = _rounded(first.local(member.start) / first.length), _rounded(member.axes @ first.axes.T)
        normal.append(replace(member, length=length, material=material, start=start, axes=axes))
    return tuple(normal)


def _rounded(values: Array | float) -> Array:
    return np.round(values, DIGITS) + 0.0


def solids(model: FullOrderModel, only: str | Collection[str] | None = None) -> tuple[MemberSolid, ...]:
    """All placed members as solids, or those of the instance or member with the path `only`, or with names in it.

    Raises OptionError for sections given by constants, which have no solid, and when `only` names nothing.
    """
    plan, geometry, values = model.plan, model.geometry, model.values
    members: list[MemberSolid] = []
    for name, part in plan.parts.items():
        placed = plan.topology.copies[name]
        wanted = [
            (copy, k, ".".join((*path, member)))
            for copy, path in enumerate(placed.paths)
            for k, member in enumerate(part.members)
        ]
        if isinstance(only, str):
            wanted = [w for w in wanted if w[2] == only or w[2].startswith(f"{only}.")]
        elif only is not None:
            wanted = [w for w in wanted if w[2] in only]
        if not wanted:
            continue
        local = geometry.parts[name]
        E, rho, nu, _ = part.table.moduli(values)
        shapes = _shapes(part.table.groups, values, local.length, {k: path for _, k, path in wanted})
        for copy, k, path in wanted:
            Q, t = geometry.Q[placed.number[copy]], geometry.t[placed.number[copy]]
            axes = local.R[k] @ Q.T
            if np.linalg.det(axes) < 0:
                axes = axes * np.array([[1.0], [-1.0], [1.0]])
            start = Q @ (local.positions[part.ends[k, 0]] + local.offsets[k, 0]) + t
            nodes = (placed.offset[copy] + int(part.ends[k, 0]), placed.offset[copy] + int(part.ends[k, 1]))
            roots = (int(plan.topology.root[nodes[0]]), int(plan.topology.root[nodes[1]]))
            prototype = list(part.members.values())[k]
            material = SolidMaterial(prototype.material, float(E[k]), float(nu[k]), float(rho[k]))
            members.append(MemberSolid(path, shapes[k], float(local.length[k]), material, start, axes, nodes, roots))
    if not members:
        what = "there are no members" if only is None else f"no placed member is named {only!r} or lies in it"
        raise OptionError(f"{what}; solids are made of members, written INSTANCE.MEMBER")
    return tuple(members)


def filleted(model: FullOrderModel, members: Sequence[MemberSolid]) -> tuple[MemberSolid, ...]:
    """Members with the fillets that the model takes their ends to have; of copies of a substructure their mean."""
    plan, values = model.plan, model.values
    found = plan.roots.fillets(values, model.geometry)
    if found is None:
        return tuple(members)
    numbers = {
        ".".join((*path, member)): plan.roots.first[name] + k
        for name, part in plan.parts.items()
        for path in plan.topology.copies[name].paths
        for k, member in enumerate(part.members)
    }
    radii = np.zeros((max(numbers.values()) + 1, 2, 2))
    radii[found[0], found[1]] = found[2]
    made = []
    for member in members:
        (a, b), (c, d) = (radii[numbers[member.name]] * 2 * float(member.outline.z[0])).tolist()
        made.append(replace(member, fillets=((a, b), (c, d))))
    return tuple(made)


_WITHOUT_SOLID = {
    "constants": "a section given by constants has no solid; give it a shape",
    "layered": "layers are not meshed as solids yet; verify and solid members take members of one material",
}
"""What is said of members of a kind that have no solid."""


def _shapes(
    groups: Sequence[tuple[SectionGroup, int, bool]], values: Array, length: Array, wanted: dict[int, str]
) -> dict[int, MemberShape]:
    """Shapes of the members wanted, by their position in the part; `wanted` holds their names."""
    shapes: dict[int, MemberShape] = {}
    for group, _, _ in groups:
        for row, k in enumerate(group.index.tolist()):
            if k in wanted:
                if group.kind[0] in _WITHOUT_SOLID:
                    raise OptionError(f"{wanted[k]}: {_WITHOUT_SOLID[group.kind[0]]}")
                shapes[k] = MemberShape.of(group, row, values, float(length[k]))
    return shapes


@dataclass(frozen=True)
class BodySolid:
    """A placed rigid body with a form: a box, or a cylinder about its first axis, of half sizes (3,), m, about a centre
    (3,), with right-handed axes (3, 3) as rows, global frame; `node` is its own."""

    name: str
    node: int
    centre: Array
    axes: Array
    half: Array
    is_round: bool
    material: SolidMaterial
    pieces: Pieces | None = None
    """Of a composite, global frame; the box is that around it."""
    mesh: MeshedSolid | None = None
    """Of a composite, in axes of its own."""

    @property
    def thickness(self) -> float:
        """Its least size, m, the mean one of a composite."""
        return 2 * float(self.half.min()) if self.mesh is None else self.mesh.thickness

    @property
    def volume(self) -> float:
        """Volume, m^3."""
        if self.mesh is not None:
            return self.mesh.volume
        return float(np.prod(2 * self.half)) * (np.pi / 4 if self.is_round else 1.0)


def body_solids(model: FullOrderModel, only: str | None = None) -> tuple[BodySolid, ...]:
    """All placed bodies that have a form, or those of the instance or body with the path `only`."""
    plan, bodies = model.plan, solids_of(model)[1]
    scoped = plan.scoped_values(model.parameters)
    materials = {
        ".".join((*path, key)): body.solid.material
        for name, placed in plan.topology.copies.items()
        for key, body in plan.layout.prototypes[name].bodies.items()
        for path in placed.paths
        if body.solid is not None
    }
    result = []
    for k, name in enumerate(bodies.names):
        if only is None or name == only or name.startswith(f"{only}."):
            metal: Any = evaluated(plan.layout.mechanism.material(materials[name]), scoped)
            E, rho = float(metal.E), float(metal.rho)
            nu = float(metal.nu) if metal.nu is not None else E / (2 * float(metal.G)) - 1
            axes = bodies.axes[k] * np.array([[1.0], [1.0], [np.linalg.det(bodies.axes[k])]])
            material, node = SolidMaterial(materials[name], E, nu, rho), int(bodies.nodes[k])
            is_round = bool(bodies.is_round[k])
            pieces = mesh = None
            if k in bodies.meshes:
                mesh, away = bodies.meshes[k]
                turn = bodies.axes[k].T
                pieces = mesh.pieces.moved(turn, bodies.origin[k] + turn @ away)
            form = bodies.half[k], is_round, material, pieces, mesh
            result.append(BodySolid(name, node, bodies.origin[k], axes, *form))
    return tuple(result)


@dataclass(frozen=True)
class Joints:
    """Which members are one piece, and which end faces are tied to their nodes.

    `groups` are positions of fused members; `tied` (m, 2) marks end faces that follow their nodes rigidly, `fused`
    (m, 2) those that meet a fused member.
    """

    groups: tuple[tuple[int, ...], ...]
    tied: NDArray[np.bool_]
    fused: NDArray[np.bool_]


def joints(model: FullOrderModel, members: Sequence[MemberSolid]) -> Joints:
    """Find which members are fused where they meet.

    Two members that meet at a free node of their own are fused when one's end face lies wholly on the other or both
    overlap there; an end that another touches in part only is not. A node at which all members are one piece and that
    carries nothing else has no need of a tie: its end faces are free inside the piece.
    """
    topology = model.plan.topology
    discrete_elements = _discrete_roots(model)
    at: dict[int, list[tuple[int, int]]] = {}
    for k, member in enumerate(members):
        for end, root in enumerate(member.roots):
            at.setdefault(root, []).append((k, end))
    group = np.arange(len(members))
    fused = np.zeros((len(members), 2), dtype=bool)
    tied = np.zeros((len(members), 2), dtype=bool)
    degrees = _degrees(model)
    for root, ends in at.items():
        rigid = bool(topology.is_rigid[root] or topology.held[root].any())
        cluster = {k: k for k, _ in ends}
        for i, (a, end_a) in enumerate(ends):
            for b, end_b in ends[i + 1 :]:
                if not rigid and a != b and _meet(members[a], end_a, members[b], end_b):
                    fused[a, end_a] = fused[b, end_b] = True
                    cluster = {k: cluster[a] if c == cluster[b] else c for k, c in cluster.items()}
                    group[group == group[b]] = group[a]
        if rigid or root in discrete_elements or len(set(cluster.values())) > 1 or len(ends) < max(degrees[root], 2):
            for k, end in ends:
                tied[k, end] = True
    groups = tuple(tuple(np.flatnonzero(group == g).tolist()) for g in dict.fromkeys(group.tolist()))
    return Joints(groups, tied, fused)


def closed(members: Sequence[MemberSolid], fusions: Joints) -> tuple[MemberSolid, ...]:
    """The members, those of one section reaching so far into what they are fused with that their whole end face is in
    it: across an oblique end face there would be a gap beside the line in which both meet.
    """
    result = list(members)
    for group in fusions.groups:
        for k, other in permutations(group, 2):
            for end in np.flatnonzero(fusions.fused[k] & ~fusions.tied[k]).tolist():
                if members[k].shape.is_straight and members[k].roots[end] in members[other].roots:
                    result[k] = _reaching(result[k], end, members[other])
    return tuple(result)


def _reaching(member: MemberSolid, end: int, other: MemberSolid) -> MemberSolid:
    """The member with an end moved on until its face is in the other one, if it is so within half its thickness."""
    thin = 2 * float(min(member.outline.y[-end], member.outline.z[-end]))
    reaches = (
        float(by)
        for by in np.linspace(0.0, thin / 2, 26)
        if other.holds(member.end_samples(end, -float(by)), 1e-5 * thin).all()
    )
    by = next(reaches, 0.0)
    if not by:
        return member
    length = member.length + by
    sizes = tuple(
        (name, tuple(_digits(x * member.length / length) for x in relative)) for name, relative in member.shape.sizes
    )
    start = member.start if end else member.start - by * member.axes[0]
    return replace(member, shape=replace(member.shape, sizes=sizes), length=length, start=start)


def _meet(a: MemberSolid, end_a: int, b: MemberSolid, end_b: int) -> bool:
    """Whether one end face lies on the other member or both members overlap at their ends."""
    for one, end, other in ((a, end_a, b), (b, end_b, a)):
        scale = min(one.length, other.length, float(one.outline.z[-end]), float(other.outline.z[0]))
        near = 1e-5 * scale
        covered = other.holds(one.end_samples(end, 0.0), near)
        inside = other.holds(one.end_samples(end, 1e-2 * scale), -near)
        if covered.mean() > 0.99 or inside.mean() > 0.05:
            return True
    return False


def _discrete_roots(model: FullOrderModel) -> set[int]:
    """Roots of all nodes at which bodies, masses, springs, superelements or piezo stacks act."""
    topology = model.plan.topology
    nodes = [
        offset + node
        for placed in topology.copies.values()
        for numbers, _, _ in placed.part.discrete_nodes()
        for node in numbers
        for offset in placed.offset
    ]
    return set(topology.root[np.array(nodes, dtype=np.intp)].tolist())


def _degrees(model: FullOrderModel) -> Index:
    """Number of member ends at every root, placed members that are not looked at included."""
    topology = model.plan.topology
    ends = [topology.root[np.add.outer(p.offset, p.part.ends).ravel()] for p in topology.copies.values()]
    return np.bincount(np.concatenate(ends).astype(np.intp), minlength=topology.n_nodes)
