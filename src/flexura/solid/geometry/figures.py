"""Groups of fused members that are one plane figure swept through a common width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from flexura.arrays import Array
from flexura.solid.geometry.contours import Outline
from flexura.solid.geometry.members import MemberSolid

GROWTH = 0.4
"""How fast cells grow away from a thin member."""
ASPECT = (3.0, np.inf)
"""Most length of tetrahedra and hexahedra over the thickness: long tetrahedra are too stiff in bending and torsion."""


@dataclass(frozen=True)
class Profile:
    """A member in the plane of its group: `start` (2,), `along` (2,), its outline and its half size across, x by x."""

    outline: Outline
    half: Array
    start: Array
    along: Array

    def placed(self, x: Array) -> Array:
        """Plane coordinates (n, 2) of points along and across the member."""
        return self.start + x[:, :1] * self.along + x[:, 1:] * np.array([-self.along[1], self.along[0]])

    def size(self, points: Array, size: float) -> Array:
        """Wanted size of triangles, m, at plane points (n, 2)."""
        local = points - self.start
        x, z = local @ self.along, local @ np.array([-self.along[1], self.along[0]])
        half = np.interp(x, self.outline.x, self.half)
        L = self.outline.length
        away = np.hypot(np.maximum(np.maximum(-x, x - L), 0.0), np.maximum(np.abs(z) - half, 0.0))
        own = np.minimum(1.2 * half, L / 8) if not self.outline.is_straight else np.minimum(half, L / 4)
        return size * own + GROWTH * away

    def steps(self, width: float, size: float, aspect: float) -> tuple[float, float]:
        """Lengths of cells along and across a straight member, m; `aspect` bounds the first over the thickness."""
        t, L = 2 * float(self.half[0]), self.outline.length
        along = size * min(max(1.5 * t, min(L / 8, width / 4)), L / 2, aspect * t)
        return along, size * (t if t < width / 4 or t < L / 8 else t / 2)

    def cuts(self, size: float) -> list[tuple[Array, Array]]:
        """Runs of x and half size (n,), m, between which a contour is cut into single cells."""
        found = []
        for a, b in pairwise(self.outline.breaks):
            x, half = self.outline.x[a : b + 1], self.half[a : b + 1]
            if len(x) == 2:
                count = count_of(float(np.hypot(*np.diff([x, half])[:, 0]) / self._step(half, size).max()))
                ends = np.linspace(0, 1, count + 1)
                found += [(x[0] + np.array(e) * np.ptp(x), np.interp(e, [0, 1], half)) for e in pairwise(ends)]
                continue
            k = np.arange(len(x))
            along, across = CubicSpline(k, x), CubicSpline(k, half)
            fine = np.linspace(0, len(x) - 1, 400)
            number = _cumulative(np.hypot(along(fine, 1), across(fine, 1)) / self._step(across(fine), size), fine)
            ends = np.interp(np.linspace(0, number[-1], count_of(number[-1]) + 1), number, fine)
            for e in pairwise(ends):
                at = np.linspace(*e, 7)
                found.append((along(at), across(at)))
        return found

    def _step(self, half: Array, size: float) -> Array:
        return size * np.minimum(1.2 * half, self.outline.length / 8)


@dataclass(frozen=True)
class Swept:
    """Members of one width: `frame` (3, 3) holds the two axes of their plane and the direction of the sweep as rows."""

    profiles: tuple[Profile, ...]
    origin: Array
    frame: Array
    width: float

    def heights(self, size: float, aspect: float) -> Array:
        """Positions from 0 to the width between layers of cells, m, closer at the free edges of wide thin figures.

        `aspect` bounds the thickness of layers over the least thickness of the figure.
        """
        w, thinnest = self.width, min(2 * float(p.half.min()) for p in self.profiles)
        step = size * min(max(w / 6, thinnest), aspect * thinnest)
        graded = 12 * thinnest < w and step > 2 * thinnest and any(p.outline.is_straight for p in self.profiles)
        edge = np.array([0.0, thinnest, 3 * thinnest]) if graded else np.zeros(1)
        inner = np.linspace(edge[-1], w - edge[-1], max(2, count_of((w - 2 * edge[-1]) / step)) + 1)
        return np.concatenate([edge[:-1], inner, w - edge[:-1][::-1]])

    def estimate(self, size: float, hexahedra: bool) -> float:
        """About how many points a mesh will have."""
        points, aspect = 0.0, ASPECT[hexahedra]
        for profile in self.profiles:
            if profile.outline.is_straight:
                along, across = profile.steps(self.width, size, aspect)
                columns, rows = profile.outline.length / along, 2 * float(profile.half[0]) / across
                thinner = sum(other.half.min() < profile.half[0] / 2 for other in self.profiles)
                rows += 7.0 * min(thinner, 2)
                columns += 6.0
            else:
                columns, rows = len(profile.cuts(size)), 2 / size
            points += (2 * np.ceil(columns) + 1) * (2 * np.ceil(rows) + 1)
        return points * (2 * len(self.heights(size, aspect)) - 1)


def _cumulative(rate: Array, at: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(at))])


def count_of(number: float) -> int:
    """A number of cells, rounded up, at least one."""
    return max(1, int(np.ceil(number - 1e-6)))


def swept(members: Sequence[MemberSolid]) -> Swept | None:
    """The members as one plane figure swept through one width; None when they are not that."""
    outlines = [member.outline.blunted() for member in members]
    for k in _directions(outlines[0]):
        direction, half = members[0].axes[k], _size(outlines[0], k)
        chosen = [k]
        for member, outline in zip(members[1:], outlines[1:], strict=True):
            off = abs((member.start - members[0].start) @ direction)
            fits = [
                j
                for j in _directions(outline)
                if abs(member.axes[j] @ direction) > 1 - 1e-9
                and abs(_size(outline, j) - half) < 1e-6 * half
                and off < 1e-6 * half
            ]
            if not fits:
                break
            chosen.append(fits[0])
        else:
            frame = np.stack([members[0].axes[0], np.cross(direction, members[0].axes[0]), direction])
            origin = members[0].start - half * direction
            profiles = tuple(
                Profile(s, s.z if j == 1 else s.y, frame[:2] @ (m.start - origin), frame[:2] @ m.axes[0])
                for m, s, j in zip(members, outlines, chosen, strict=True)
            )
            return Swept(profiles, origin, frame, 2 * half)
    return None


def _directions(outline: Outline) -> list[int]:
    """Local axes along which a member is as wide everywhere, the widest first."""
    match outline.family:
        case "rectangle":
            return [1, 2] if outline.y[0] >= outline.z[0] else [2, 1]
        case "notch":
            return [1]
    return []


def _size(outline: Outline, axis: int) -> float:
    return float((outline.y if axis == 1 else outline.z)[0])
