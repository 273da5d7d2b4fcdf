"""How far designs of a topology reach beyond the envelope, or what moves comes too near to what stands: both follow the
sizes linearly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from flexura.arrays import Array
from flexura.mechanism import Mechanism
from flexura.structure import FullOrderModel, solids_of
from flexura.synthesis.amplifiers import hull_of
from flexura.synthesis.drafts import radius_name
from flexura.synthesis.fitting import corners_of, posts_at, too_near
from flexura.synthesis.patterns import ALONG
from flexura.synthesis.topologies import Topology
from flexura.synthesis.wish import Room

ROUNDED = 1e-3
"""How far designs may reach beyond the envelope, as their sizes have four digits, over its smallest edge."""

DIGITS = 1e-4
"""What the last digits of sizes may add, over the same."""

THIN = 0.01
"""Least edge of posts, over the same."""

_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True)
class Extents:
    """Where a topology reaches beyond the envelope, is too near to itself, or has posts that are too thin: `constants`
    (k,) and `slopes` (k, p) times its sizes by `names`, m, are to be zero at most. What is so for all sizes within
    their limits is left out."""

    names: tuple[str, ...]
    constants: Array
    slopes: Array
    digits: float
    """What the last digits of sizes may add, m."""

    def within(self, inside: Array, values: Array) -> Array:
        """Sizes (n, p), each of them led towards some that are inside (p,) until it is within the envelope, but for
        what their last digits add, and no farther beyond it than these."""
        own, others = (self.constants + v @ self.slopes.T for v in (inside, values))
        own, others = (x - np.maximum(own, 0.0) - self.digits for x in (own, others))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(others > 0, np.clip(own / (own - others), 0.0, 1.0), 1.0).min(axis=1, initial=1.0)
        return inside + share[:, None] * (values - inside)

    def limits(self) -> list[str]:
        """The same as requirements."""
        found = []
        for c, own in zip(self.constants, self.slopes, strict=True):
            terms = " + ".join(f"({s:.9g})*{name}" for s, name in zip(own, self.names, strict=True) if s)
            found.append(f"{terms} <= {-c:.9g} m" if c <= 0 else f"{terms} + {c:.9g} m <= 0 m")
        return found


def extents_of(topology: Topology, room: Room, mechanism: Mechanism) -> Extents:
    """Where a topology, of which this is the draft, reaches beyond the envelope."""
    parameters = mechanism.parameters
    first, low, high = (
        np.array([float(getattr(own, end)) for own in parameters.values()]) for end in ("value", "minimum", "maximum")
    )
    step = np.maximum(high - low, ALONG * room.size)

    def beyond(values: Array) -> Array:
        points, others = _drawn(topology, room, dict(zip(parameters, values.tolist(), strict=True)))
        x = points - [0.0, 0.0, room.half[2]]
        return np.concatenate([(x - room.half).ravel(), (-x - room.half).ravel(), others])

    at = beyond(first)
    slopes = np.array([(beyond(first + own) - at) / own.max() for own in np.diag(step)]).reshape(len(step), -1).T
    constants = at - slopes @ first - ALONG * room.size
    most = constants + (np.maximum(slopes, 0.0) @ high + np.minimum(slopes, 0.0) @ low)
    rows = np.concatenate([constants[:, None], slopes], axis=1)[most > ALONG * room.size]
    rows = rows[np.unique(np.round(rows, 9), axis=0, return_index=True)[1]]
    rows = rows[_needed(rows, low, high)]
    return Extents(tuple(parameters), rows[:, 0], rows[:, 1:], DIGITS * room.size)


def _needed(rows: Array, low: Array, high: Array) -> list[int]:
    """Rows that no other one is nowhere less than."""
    kept = list(range(len(rows)))
    for n in range(len(rows)):
        others = rows[[k for k in kept if k != n]] - rows[n]
        least = others[:, 0] + np.maximum(others[:, 1:], 0.0) @ low + np.minimum(others[:, 1:], 0.0) @ high
        if (least >= 0).any():
            kept.remove(n)
    return kept


def _drawn(topology: Topology, room: Room, values: Mapping[str, float]) -> tuple[Array, Array]:
    """Corners (n, 3) of limbs and drives in the room, m, by how much what moves comes too near to what stands, and
    posts are too thin (k,), m."""
    corners, others = list[Array](), list[float]()
    for letter, pattern in zip("abc", topology.patterns, strict=False):
        radius, site = radius_name(letter, pattern), pattern.site
        own = replace(pattern, site=site._replace(out=values[radius] / site.reach)) if radius else pattern
        sizes = {name: values.get(f"{letter}_{name}", own.held) for name in own.kind.sizes}
        posts = posts_at(pattern, room, np.eye(3), [])
        corners.append(corners_of(own, posts, room, sizes))
        others += too_near(own, room, sizes)
        for low, high in (post.ends(sizes) for post in posts):
            others += (THIN * room.size - (high - low)).tolist()
    if (drive := topology.drive) is not None:
        sizes = {name: values[f"drive_{name}"] for name in drive.sizes}
        middles, halves = hull_of(drive.amplifier.parts(drive.stack, "", drive.sizes, drive.top), sizes)
        local = (middles[:, None] + _SIGNS * halves[:, None]).reshape(-1, 3)
        corners.append((local @ drive.frames.transpose(0, 2, 1) + drive.heads[:, None]).reshape(-1, 3))
    return np.concatenate(corners), np.array(others)


def beyond_envelope(model: FullOrderModel, room: Room) -> tuple[str, ...]:
    """Solids of a model that reach beyond the envelope, in words."""
    found = []
    for solids in solids_of(model):
        for n, name in enumerate(solids.names):
            points = solids.pieces(n).reshape(-1, 3) @ room.turn
            far = float(room.outside(points).max())
            if far > ROUNDED * room.size:
                found.append(f"{name} reaches {1e3 * far:.3g} mm beyond the envelope")
    return tuple(found)
