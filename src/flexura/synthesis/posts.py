"""What the feet of a limb stand on: blocks of the base, as boxes whose places and edges follow the sizes of the limb.

A foot that leads down stands on a post. One that leads sideways is at a wall, which stands on a deeper block where it
would be tall; one that leads back towards its head is under a bracket, beside which a post stands. Feet that slant are
at blocks that are held behind, and so are those that lead sideways where the base has a frame around the envelope.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array
from flexura.synthesis.limbs import BAR, LEAF, NECK, NOTCH, ROD, ROUND, STOUT, WIRE, Kind, Terms, unit_sizes
from flexura.synthesis.limbs import POST as LINK

POST = 0.1
"""How much thicker a post is than what ends in it, and how deep beside a limb, over the smallest edge of the
envelope."""

BEHIND = 0.05
"""Depth of a wall behind a foot, over the same."""

HELD = 0.02
"""Depth of a block that is held behind its foot, and how much thicker it is on either side, over the same."""

MARGIN = 0.02
"""How far posts reach beyond the edges of leaves, over the same."""

UNDER = 0.15
"""How far the block below a wall reaches under its limb, over the same."""

GAP = 0.03
"""Clearance of posts from what moves beside and above them, over the same."""

BRACKET = 0.7
"""Thickness of a bracket over the room between foot and head."""

ALONG = 1e-6

MOST_POINTS = 40
"""Points along an edge of a post, which is as long as many times the thickness of a thin layer."""

BELOW = "_below"
"""What the names of deeper blocks below walls end in, which may be parts of their own."""

Form = Mapping[str | None, float]
"""A coordinate, m: a number (None), and so many times each size."""

Borne = Sequence[tuple[str | None, Array]]
"""A point: a fixed part and, by size, directions (3,)."""

SECTIONS: dict[str, tuple[Form, Form]] = {
    LEAF: ({"thickness": 0.5}, {"width": 0.5}),
    WIRE: ({"diameter": 0.5}, {"diameter": 0.5}),
    NECK: ({"diameter": 1.5}, {"diameter": 1.5}),
    NOTCH: ({"radius": 1.0, "web": 0.5}, {"width": 0.5}),
    ROUND: ({"radius": 1.0, "web": 0.5}, {"radius": 1.0, "web": 0.5}),
    ROD: ({"diameter": 1.5}, {"diameter": 1.5}),
    BAR: ({"radius": STOUT / 2, "web": 0.5}, {"width": 0.5}),
    LINK: ({"radius": STOUT / 2, "web": 0.5}, {"radius": STOUT / 2, "web": 0.5}),
}
"""Half of the thickness and of the width of the end of a member, by its profile, as sums of sizes."""


@dataclass(frozen=True)
class Post:
    """A block of the base: a box along `axes` (3, 3), columns, from `low` to `high` along each. It carries feet, or
    another block, and is held at a face unless it is carried."""

    name: str
    axes: Array
    low: tuple[Form, ...]
    high: tuple[Form, ...]
    carries: tuple[str, ...]
    held: str | None

    def ends(self, sizes: Mapping[str, float]) -> tuple[Array, Array]:
        """Where it begins and ends along its axes, (3,) each, m."""
        low, high = (np.array([value_of(form, sizes) for form in ends]) for ends in (self.low, self.high))
        return low, high

    def away(self, points: Array, sizes: Mapping[str, float]) -> Array:
        """How far points (n, 3) are away from it (n,), m."""
        low, high = self.ends(sizes)
        x = points @ self.axes
        return np.linalg.norm(np.maximum(np.maximum(low - x, x - high), 0.0), axis=1)

    def points(self, sizes: Mapping[str, float], spacing: float) -> Array:
        """Points (n, 3) of it, no farther apart than so much, m, along its axes, or as many as there are at most."""
        low, high = self.ends(sizes)
        counts = np.minimum(np.ceil(np.abs(high - low) / spacing).astype(int) + 1, MOST_POINTS)
        grid = np.meshgrid(*(np.linspace(a, b, n) for a, b, n in zip(low, high, counts, strict=True)), indexing="ij")
        return np.stack([own.ravel() for own in grid], axis=-1) @ self.axes.T


def value_of(form: Form, sizes: Mapping[str, float]) -> float:
    """A form in numbers."""
    return sum(c * (1.0 if name is None else sizes[name]) for name, c in form.items())


def with_fixed(form: Form, name: str, value: float) -> Form:
    """A form with a size that does not vary."""
    return plus({None: form.get(name, 0.0) * value}, {own: c for own, c in form.items() if own != name})


def plus(*forms: Form, by: float = 1.0) -> Form:
    """The sum of forms, of all but the first so many times."""
    total = dict(forms[0])
    for form in forms[1:]:
        for name, c in form.items():
            total[name] = total.get(name, 0.0) + by * c
    return {name: c for name, c in total.items() if name is None or abs(c) > ALONG}


@dataclass(frozen=True)
class Ground:
    """Where posts stand: the unit normal `up` (3,) of the base, the plane at `level` along it and the `top` of the
    envelope, m, and the `shelf` up to which blocks may be deep; the smallest edge of the envelope, m. Walls stand
    on deep blocks where they are `deep`, or are of a `frame`. Posts that are `stout` are so many times as broad as
    they have to be, and where feet lead on along limbs they reach as far as `end` from the heads, m. They are wider
    than leaves by as much as `beside` at either edge, m."""

    up: Array
    level: float
    top: float
    shelf: float
    size: float
    deep: bool
    frame: bool
    stout: float
    end: float
    beside: float


def posts_of(kind: Kind, head: Borne, axes: Array, ground: Ground) -> list[Post]:
    """The posts of a limb with its head at a point and axes (m, e, d) as columns (3, 3); none where one of them would
    have to cross what moves to stand on the base."""
    groups: dict[tuple[float, ...], list[str]] = {}
    unit = kind.points(unit_sizes(kind, 1.0))
    for foot in kind.feet:  # side by side along d they share a post, and those that cross
        way, _ = _leading(kind, foot, unit)
        shared = [*unit[foot][:2], 0.0] if abs(way[2]) < ALONG else [0.0, 0.0, unit[foot][2]]
        shared = shared if abs(way[2]) < ALONG or way[2] > 0 else unit[foot]
        groups.setdefault(tuple(np.round([*way, *shared], 6).tolist()), []).append(foot)
    found = list[Post]()
    for n, feet in enumerate(groups.values(), 1):
        made = _Feet(f"base{n}" if len(groups) > 1 else "base", kind, tuple(feet), head, axes, ground).posts()
        if not made:
            return []
        found += made
    return found


def _leading(kind: Kind, foot: str, unit: Mapping[str, Array]) -> tuple[Array, str]:
    """The direction (3,) in which a foot leads on, in the axes of the limb, and the profile of what ends there; along d
    where it slants."""
    a, b, profile = next(own for own in kind.members.values() if foot in own[:2])
    way = unit[foot] - unit[a if b == foot else b]
    slants = np.count_nonzero(np.abs(way) > ALONG) > 1
    return (np.sign(way[2]) * np.eye(3)[2] if slants else way / np.linalg.norm(way)), profile


def leads_on(kind: Kind) -> bool:
    """Whether a foot leads on along d, so that its post is behind the end of the limb."""
    return any(way > ALONG for way in _leading_along(kind))


def leads_back(kind: Kind) -> bool:
    """Whether a foot leads back along d, so that its post is beside the limb."""
    return any(way < -ALONG for way in _leading_along(kind))


def _leading_along(kind: Kind) -> list[float]:
    unit = kind.points(unit_sizes(kind, 1.0))
    return [float(_leading(kind, foot, unit)[0][2]) for foot in kind.feet]


class _Feet:
    """Feet on one post, and the box behind them: along its x axis they are thick, along y wide, and z leads on."""

    def __init__(self, name: str, kind: Kind, feet: tuple[str, ...], head: Borne, axes: Array, ground: Ground) -> None:
        unit = kind.points(unit_sizes(kind, 1.0))
        self.name, self.feet, self.ground = name, feet, ground
        self.way, profile = _leading(kind, feet[0], unit)
        u, e = axes @ self.way, axes[:, 1]
        self.B: Array = np.array([np.cross(e, u), e, u]).T
        rise = self.B.T @ ground.up
        self.k: int = int(np.argmax(np.abs(rise)))
        self.up: float = float(np.sign(rise[self.k])) if np.abs(rise).max() > 1 - ALONG else 0.0
        self.is_back: bool = self.way[2] < -ALONG
        self.is_held_behind: bool = not self.up or (ground.frame and self.k != 2 and not self.is_back)
        thick, wide = SECTIONS[profile]
        around = (HELD if self.is_held_behind else POST / 2 * max(ground.stout, 1.0)) * ground.size
        beside = ground.beside if "width" in wide else around
        half = plus({None: around}, thick), plus({None: beside}, wide)
        places = np.array([axes @ unit[foot] for foot in feet]) @ self.B
        first, last = (places.argmin(axis=0), places.argmax(axis=0))
        at = [[_along(head, axes, kind.nodes[foot], self.B[:, k]) for foot in feet] for k in range(3)]
        self.at: Form = at[0][0]
        behind = plus(at[2][0], {None: (HELD if self.is_held_behind else BEHIND) * ground.size})
        if ground.stout and self.way[2] > ALONG and not self.is_held_behind:  # as deep as there is room
            behind = plus(_along(head, axes, {}, u), {None: ground.end})
        self.low: list[Form] = [plus(at[k][first[k]], half[k], by=-1.0) for k in (0, 1)] + [at[2][0]]
        self.high: list[Form] = [plus(at[k][last[k]], half[k]) for k in (0, 1)] + [behind]
        self.outside: float = float(np.sign(places[0, 0]))
        self.back: Form = {size: BRACKET * c[2] for size, c in kind.nodes[feet[0]].items() if abs(c[2]) > ALONG}
        if (
            self.k != 2 and self.up and set(at[self.k][0]) == {None}
        ):  # none of it is below the base or above the envelope
            least, most = sorted((self.up * ground.level, self.up * ground.top))
            if self.low[self.k][None] < least:
                self.low[self.k] = {None: least}
            if self.high[self.k][None] > most:
                self.high[self.k] = {None: most}
        self.is_high: bool = all(
            set(form) == {None} and self.up * form[None] > ground.shelf + GAP * ground.size for form in at[self.k]
        )

    def posts(self) -> list[Post]:
        """What they stand on; nothing where that would cross what moves."""
        if self.is_held_behind:
            return [self._block(self.low, self.high, self.feet, "z+")]
        if self.k == 2 and self.up < 0:
            return [self._standing(self.low, self.high, self.feet)]
        if self.is_back:
            return self._under_bracket()
        return self._wall() if self.k != 2 else []

    def _block(
        self, low: Sequence[Form], high: Sequence[Form], carries: tuple[str, ...], held: str | None, name: str = ""
    ) -> Post:
        return Post(self.name + name, self.B, tuple(low), tuple(high), carries, held)

    def _standing(self, low: Sequence[Form], high: Sequence[Form], carries: tuple[str, ...], name: str = "") -> Post:
        """The block from there down to the base."""
        level: Form = {None: self.up * self.ground.level}
        low, high = self._down_to(level, low, high)
        return self._block(low, high, carries, "xyz"[self.k] + ("-" if self.up > 0 else "+"), name)

    def _down_to(self, level: Form, low: Sequence[Form], high: Sequence[Form]) -> tuple[list[Form], list[Form]]:
        low, high = list(low), list(high)
        (low if self.up > 0 else high)[self.k] = level
        return low, high

    def _wall(self) -> list[Post]:
        """A wall behind feet that lead sideways, on a deeper block where it would be tall."""
        ground = self.ground
        if not ground.deep or not self.is_high or ground.shelf - ground.level < 2 * POST * ground.size:
            return [self._standing(self.low, self.high, self.feet)]
        shelf: Form = {None: self.up * ground.shelf}
        low, high = self._down_to(shelf, self.low, self.high)
        wall = self._block(low, high, self.feet, None)
        low, high = list(self.low), list(self.high)
        (high if self.up > 0 else low)[self.k] = shelf
        low[2] = plus(low[2], {None: -UNDER * ground.size})
        return [wall, self._standing(low, high, (self.name,), BELOW)]

    def _under_bracket(self) -> list[Post]:
        """A bracket over a foot that leads back towards its head, and the post beside the limb that bears it, or the
        frame; nothing is in the way of one that stands along the width."""
        if self.k == 0 and self.outside * self.up > 0:
            return []
        size, out = self.ground.size, self.outside
        inner = plus(self.at, {None: out * GAP * size, "thickness": 4 * out})
        outer = plus(inner, {None: out * POST * size})
        near = plus(self.at, {None: -out * MARGIN * size, "thickness": -0.5 * out})
        low, high = list(self.low), list(self.high)
        high[2] = plus(low[2], self.back)
        low[0], high[0] = (near, inner) if out > 0 else (inner, near)
        if self.ground.frame and self.k == 1:
            return [self._block(low, high, self.feet, "x+" if out > 0 else "x-")]
        if self.k == 1:
            edge = plus(self.at, {None: out * POST * size / 2, "thickness": 0.5 * out})
            low[0], high[0] = (near, edge) if out > 0 else (edge, near)
            return [self._standing(low, high, self.feet)]
        bracket = self._block(low, high, self.feet, None)
        low[0], high[0] = (inner, outer) if out > 0 else (outer, inner)
        low[2] = plus(low[2], {None: -POST * size})
        return [bracket, self._standing(low, high, (self.name,), "_side")]


def _times(name: str | None, factor: float) -> Form:
    return {name: factor}


def _along(head: Borne, axes: Array, node: Terms, axis: Array) -> Form:
    """The coordinate of a node along an axis."""
    return plus(
        {None: 0.0},
        *(_times(name, float(v @ axis)) for name, v in head),
        *(_times(size, float(axes @ np.array(c) @ axis)) for size, c in node.items()),
    )
