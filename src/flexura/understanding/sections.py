"""Sections of a planar part across a straight axis: its thickness along the axis, and where that begins and ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Bools, Index
from flexura.outlines import Segment

INSIDE = 1e-8
"""How far beside a joint of segments sections are taken, over the length between two joints."""

ENDS = 1e-12
"""How far beyond its ends a segment is crossed, over its length, so that joints are not missed."""

JUMP = 0.02
"""Relative change of thickness from one side of a joint to the other from which it is a step."""

FLAT = 2e-3
"""Relative change of thickness along two lines up to which they are parallel."""

SLOWER = 0.5
"""Slope of the thickness behind a joint over that before it, below which a notch has ended there."""

ROUGH, LEVEL = 1e-4, 0.02
"""Relative change of thickness, and slope of it, that are none."""

CHUNK = 2_000_000
"""Pairs of rays and segments that are looked at together."""


class Boundary:
    """Segments of an outline as arrays: start, end, centre (m, 2), bulge, radius (m,)."""

    def __init__(self, segments: Sequence[Segment]) -> None:
        self.segments: Sequence[Segment] = segments
        self.start: Array = np.array([own.start for own in segments])
        self.end: Array = np.array([own.end for own in segments])
        self.bulge: Array = np.array([own.bulge for own in segments])
        self.is_line: Bools = self.bulge == 0.0
        self.radius: Array = np.array([own.radius for own in segments])
        self.centre: Array = np.array([own.start if own.is_line else own.centre for own in segments])

    def distance(self, points: Array, towards: Array) -> tuple[Array, Index]:
        """How far it is (n,) from points (n, 2) along unit vectors (n, 2) to the next segment, and which that is (n,);
        infinite where there is none."""
        step = max(1, CHUNK // len(self.segments))
        parts = [self._distance(points[k : k + step], towards[k : k + step]) for k in range(0, len(points), step)]
        return np.concatenate([d for d, _ in parts]), np.concatenate([k for _, k in parts])

    def _distance(self, points: Array, towards: Array) -> tuple[Array, Index]:
        """By the axes of each ray: where segments cross it."""
        right = np.stack([towards[:, 1], -towards[:, 0]], axis=1)
        axes = np.stack([right, towards], axis=1)
        y = self._crossed(axes, points)
        near = 1e-9 * float(np.ptp(self.start, axis=0).max())
        y = np.where(y > near, y, np.inf).min(axis=2)
        nearest = y.argmin(axis=1)
        return y[np.arange(len(y)), nearest], nearest

    def _crossed(self, axes: Array, origins: Array) -> Array:
        """Places (n, m, 2) along the second of axes (n, 2, 2), as rows, at which lines through origins (n, 2) cross
        segments, NaN where they do not."""
        s, e, c = (
            np.einsum("nij,nmj->nmi", axes, at[None] - origins[:, None]) for at in (self.start, self.end, self.centre)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            share = -s[..., 0] / (e[..., 0] - s[..., 0])
            line = np.where((share >= -ENDS) & (share <= 1 + ENDS), s[..., 1] + share * (e[..., 1] - s[..., 1]), np.nan)
            half = np.sqrt(np.where(self.is_line, np.nan, self.radius) ** 2 - c[..., 0] ** 2)
        arcs = np.stack([c[..., 1] - half, c[..., 1] + half], axis=-1)
        chord = e - s
        # an arc that turns left lies to the right of its chord
        side = chord[..., 0:1] * (arcs - s[..., 1:2]) - chord[..., 1:2] * (0.0 - s[..., 0:1])
        most = ENDS * (chord**2).sum(axis=-1)[..., None]
        arcs = np.where(side * np.sign(self.bulge)[None, :, None] <= most, arcs, np.nan)
        return np.where(self.is_line[None, :, None], line[..., None], arcs)


class Walk(NamedTuple):
    """What is met along an axis from a thin place: how far it is straight (`flat`), to where it grows (`grown`) to what
    thickness (`thick`), how far it goes on from there unchanged (`on`), all m, and how it ends there: `wall`,
    `narrows`, `widens` or `outside`. `step` is the thickness there over that before it."""

    flat: float
    grown: float
    thick: float
    on: float
    ends: str
    step: float
    thin: float


@dataclass(frozen=True)
class Axis:
    """A straight axis inside a part: `origin` (2,), m, and its unit vector `along` (2,)."""

    boundary: Boundary
    origin: Array
    along: Array

    @property
    def across(self) -> Array:
        """Its left."""
        return np.array([-self.along[1], self.along[0]])

    def at(self, x: float, y: float = 0.0) -> Array:
        """A point (2,) along and across, m."""
        return self.origin + x * self.along + y * self.across

    def faces(self, x: Array) -> tuple[Array, Array, Index, Index]:
        """The faces (n,), below and above, m, of sections at x (n,), and which segments these are on; NaN outside."""
        axes = np.broadcast_to(np.stack([self.along, self.across]), (len(x), 2, 2))
        origins = self.origin + x[:, None] * self.along
        y = self.boundary._crossed(axes, origins)
        above = np.where(y > 0, y, np.inf).min(axis=2)
        below = np.where(y < 0, y, -np.inf).max(axis=2)
        rows = np.arange(len(x))
        up, down = above.argmin(axis=1), below.argmax(axis=1)
        return below[rows, down], above[rows, up], down, up

    def thickness(self, x: Array) -> Array:
        """Thickness (n,), m, of sections at x (n,)."""
        low, high, _, _ = self.faces(x)
        return high - low

    @cached_property
    def _joints(self) -> Array:
        """Where segments end, or run across, along the axis."""
        own = self.boundary
        ends = np.concatenate([own.start, own.end])
        arcs = own.centre[~own.is_line]
        far = [arcs + sign * own.radius[~own.is_line, None] * self.along for sign in (-1, 1)]
        return np.unique((np.concatenate([ends, *far]) - self.origin) @ self.along)

    def walk(self, sense: int) -> Walk:
        """What is met from the origin towards one end of the axis, of sense 1 or -1."""
        size = float(np.ptp(self.boundary.start, axis=0).max())
        x = np.sort(sense * self._joints)
        x = np.concatenate([[0.0], x[x > 1e-7 * size]])
        x = x[np.concatenate([[True], np.diff(x) > 1e-7 * size])]
        flat = grown = on = thin = before = thick = slope = step = 0.0
        state, ends = "flat", "outside"
        for b, h, is_line, first, last in self._intervals(sense, x):
            h0, h1 = float(h[0]), float(h[4])
            if not np.isfinite([h0, h1]).all():
                break
            if before == 0.0:
                thin = thick = before = h0
            if abs(h0 - before) > JUMP * before:
                ends, step = ("wall" if h0 > before else "narrows"), h0 / before
                break
            is_flat = is_line and abs(h1 - h0) <= FLAT * h0
            shrinks = JUMP if state == "flat" else ROUGH
            if state == "flat" and is_flat:
                flat = grown = on = b
            elif state != "on" and h1 > h0 * (1 - shrinks) and first >= SLOWER * slope - LEVEL:
                state, grown, on, thick, slope = "grows", b, b, h1, last
            elif is_flat:
                state, on = "on", b
            else:
                ends, step = ("narrows" if h[2] < h0 else "widens"), 1.0
                break
            before = h1
        return Walk(flat, grown, thick, on, ends, step, thin)

    def _intervals(self, sense: int, x: Array) -> Iterator[tuple[float, Array, bool, float, float]]:
        """Between joints at x: where each ends, thickness (5,) along it, whether both faces are lines, and the slope of
        the thickness at its beginning and its end."""
        count = max(16, CHUNK // (10 * len(self.boundary.segments)))
        for k in range(0, len(x) - 1, count):
            a, b = x[k : k + count], x[k + 1 : k + count + 1]
            a = a[: len(b)]
            d = b - a
            places = np.stack([a + INSIDE * d, a + 1e-3 * d, (a + b) / 2, b - 1e-3 * d, b - INSIDE * d])
            low, high, down, up = self.faces(sense * places.ravel())
            h = np.where(np.isfinite(high - low), high - low, np.nan).reshape(places.shape)
            is_line = (self.boundary.is_line[down] & self.boundary.is_line[up]).reshape(places.shape)[2]
            first, last = (h[1] - h[0]) / (1e-3 * d), (h[4] - h[3]) / (1e-3 * d)
            for j in range(len(d)):
                yield float(b[j]), h[:, j], bool(is_line[j]), float(first[j]), float(last[j])
