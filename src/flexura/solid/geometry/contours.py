"""Shapes of members: their exact contours without dimension, and outlines sampled from these."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from flexura.arrays import Array
from flexura.structure import SectionGroup

Values = tuple[float, ...]

STATIONS = 33
"""Stations of an outline along every smooth piece of a curved contour."""
MESHED, MODELLED = 70.0, 84.0
"""Slopes of a contour, degrees, beyond which a tip is too thin to be meshed, or to be intersected with another."""
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
            own = np.atleast_1d(values[np.array(entries[row])]) / (1.0 if name.endswith("angle") else length)
            sizes.append((name, tuple(float(f"{x:.{DIGITS - 1}e}") for x in own)))
        return cls(group.kind, tuple(sorted(sizes)))

    @cached_property
    def _group(self) -> tuple[SectionGroup, Array]:
        group, numbers = SectionGroup(self.kind, [0]), []
        for name, values in self.sizes:
            entries = list(range(len(numbers), len(numbers) + len(values)))
            is_table = name.endswith(("positions", "thicknesses"))
            group.entries[name] = [entries if is_table else entries[0]]
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
        return self.kind[0] not in ("notch", "round", "two_axis")

    @property
    def bore(self) -> float:
        """Inner over outer diameter of a tube."""
        sizes = dict(self.sizes)
        return sizes["inner_diameter"][0] / sizes["outer_diameter"][0] if self.family == "tube" else 0.0

    @property
    def ends_in_edges(self) -> bool:
        """Whether flanks stand upright at an end, where the solid runs out in edges without thickness."""
        beside = np.array([0.0, EDGE, 1 - EDGE, 1.0])
        return any(max(abs(s[1] - s[0]), abs(s[3] - s[2])) > 100 * EDGE for s in self.at(beside))

    @cached_property
    def breaks(self) -> Array:
        """Fractions at which the contour has a kink or its curvature jumps, ends included."""
        sizes = dict(self.sizes)
        if self.kind[0] == "two_axis":
            shift = sizes["shift"][0]
            half = (1 - abs(shift)) / 2
            found = [
                x - sign * shift / 2
                for shape, axis, sign in zip(self.kind[1:], "yz", (1, -1), strict=True)
                for x in [-half, half, *_corners(shape, {n[2:]: v for n, v in sizes.items() if n[:1] == axis}, half)]
            ]
        else:
            found = _corners(self.kind[-1], sizes, 0.5)
        inner = sorted(x + 0.5 for x in found if 1e-6 < x + 0.5 < 1 - 1e-6)
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
        count = 2 if self.is_straight else STATIONS
        own = (1 - np.cos(np.pi * np.linspace(0, 1, count))) / 2
        pieces = [a + (b - a) * own for a, b in pairwise(self.breaks)]
        x = np.concatenate([[0.0], *(piece[1:] for piece in pieces)])
        y, z = (length * size / 2 for size in self.at(x))
        family = {"leaf": "rectangle"}.get(self.kind[0], self.kind[0])
        return Outline(family, length * x, y, z, self.bore * float(y[0]), tuple(range(0, len(x), count - 1)))


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

    def holds(self, points: Array, tolerance: float) -> NDArray[np.bool_]:
        """Whether local points (..., 3) lie inside or within `tolerance` of the surface."""
        x, y, z = np.moveaxis(points, -1, 0)
        half_y, half_z = self.half(x)
        along = (x >= -tolerance) & (x <= self.length + tolerance)
        if self.is_round:
            radius = np.hypot(y, z)
            return along & (radius <= half_y + tolerance) & (radius >= self.inner - tolerance)
        return along & (np.abs(y) <= half_y + tolerance) & (np.abs(z) <= half_z + tolerance)

    def blunted(self, steepest: float = MESHED) -> Outline:
        """The outline with tips of a slope beyond `steepest` degrees cut to flatter ones that keep the volume.

        A contour with a vertical tangent at its end, such as that of a right-circular notch, leaves tips of no angle.
        """
        outline = self
        for end in (0, 1):
            outline = outline._blunted_end(end, np.tan(np.deg2rad(steepest)))
        return outline

    def _blunted_end(self, end: int, steepest: float) -> Outline:
        x, sizes = self.x, [self.y, self.z]
        if end:
            x, sizes = self.length - x[::-1], [size[::-1] for size in sizes]
        first = 0
        for size in sizes:
            slope = -np.diff(size) / np.diff(x)
            steep = slope > steepest
            first = max(first, (int(np.argmin(steep)) if not steep.all() else len(steep)) if steep[0] else 0)
        smooth = len(x) - 1 - self.breaks[-2] if end else self.breaks[1]
        first = min(first, smooth)
        if first == 0:
            return self
        x_cut, new = x[first], []
        power = 2 if all(np.ptp(size[: first + 1]) > 0 for size in sizes) else 1
        for size in sizes:
            at, moment = size[first], _moment(x[: smooth + 1], size[: smooth + 1], first, power)
            tip = 2 * moment / x_cut - at
            if power == 2:
                tip = (-at + np.sqrt(max(12 * moment / x_cut - 3 * at**2, at**2))) / 2
            new.append(np.concatenate([[tip], size[first:]]))
        x = np.concatenate([[0.0], x[first:]])
        last = len(self.x) - 1
        breaks = [last - b for b in self.breaks] if end else list(self.breaks)
        breaks = sorted({0, 1} | {b - first + 1 for b in breaks if b > first})
        if end:
            breaks = [len(x) - 1 - b for b in reversed(breaks)]
            x, new = self.length - x[::-1], [size[::-1] for size in new]
        return replace(self, x=x, y=new[0], z=new[1], breaks=tuple(breaks))


def _moment(x: Array, size: Array, last: int, power: int) -> float:
    """The integral of a power of a size over x (s,) up to station `last`, both interpolated smoothly."""
    k = np.arange(len(x))
    points, weights = np.polynomial.legendre.leggauss(24)
    at = last * (points + 1) / 2
    return float((weights * last / 2 * CubicSpline(k, x)(at, 1) * CubicSpline(k, size)(at) ** power).sum())
