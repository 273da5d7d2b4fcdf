"""Kinds of limbs: how each is drawn between platform and base, and what it therefore bears.

A limb begins at its head, a point of the platform, and leads along d. Its flexures are as wide as they are along e, and
the thickness of leaves is along m = e x d. Points of a limb are sums of its sizes times these axes. It is made of rows
of members, flexures and links, which lead from the platform, or from a block, to another block or to the base.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array

Terms = dict[str, tuple[float, float, float]]
"""A point of a limb, or a way: by size, so many times along (m, e, d)."""

Sizes = dict[str, float]

M, E, D = np.eye(3)

SAME = 1e-9
"""Singular value of twists of unit size, lengths in m, up to which there is none."""


@dataclass(frozen=True)
class Limit:
    """From where to where a size may go: over the room that the limb has along its axis, or across it along m, the
    smallest edge of the envelope, how wide it may be, or the thinnest web; and at most so much of the room along its
    axis, where the thinnest web allows that."""

    least: float
    most: float
    of: str
    share: float = np.inf


class Profile(NamedTuple):
    """What a member is: which displacements and rotations along (m, e, d) of one end against the other it leaves free
    in its middle, by number, the size that it is thin by, and how it can be made. Links leave none free."""

    free: tuple[int, ...]
    thin: str
    processes: tuple[str, ...]

    @property
    def borne(self) -> list[int]:
        """What it bears, by number."""
        return [k for k in range(6) if k not in self.free]


LEAF, WIRE, NECK, NOTCH, ROUND = "leaf", "wire", "neck", "notch", "round"
ROD, BAR, POST = "rod", "bar", "post"

_EVERY = ("wire-cut", "milled", "printed", "assembled")

PROFILES: dict[str, Profile] = {
    LEAF: Profile((0, 4, 5), "thickness", _EVERY),
    WIRE: Profile((0, 1, 3, 4, 5), "diameter", ("printed", "assembled")),
    NECK: Profile((3, 4, 5), "diameter", ("milled", "printed")),
    NOTCH: Profile((4,), "web", ("wire-cut", "milled", "printed")),
    ROUND: Profile((3, 4, 5), "web", ("milled", "printed")),
    ROD: Profile((), "diameter", _EVERY),
    BAR: Profile((), "web", _EVERY),
    POST: Profile((), "web", _EVERY),
}
STOUT = 4.0
"""Radii of a notch by which a link is thicker than its web."""

WIDE = (LEAF, NOTCH, BAR)
"""Profiles that are as wide as the limb."""


class Row(NamedTuple):
    """Members one after another, each a profile and its way, from a point of one rigid part to another part."""

    start: Terms
    steps: tuple[tuple[str, Terms], ...]
    begins: str = "platform"
    ends: str = "base"


class Member(NamedTuple):
    """A member between two nodes."""

    a: str
    b: str
    profile: str


@dataclass(frozen=True)
class Kind:
    """A kind of limb: its `sizes`, which vary within limits, its `rows` of members, and `blocks` by two opposite
    corners of each. Where a size is `pinned`, it is what it must be for the limb to turn about an axis that is wished:
    its `centre` is then on that. What moves with the platform and what stands beside it are so far `apart`, along m."""

    name: str
    sizes: dict[str, Limit]
    rows: tuple[Row, ...]
    blocks: dict[str, tuple[Terms, Terms]] = field(default_factory=dict)
    pinned: str = ""
    centre: Terms = field(default_factory=dict)
    apart: Terms = field(default_factory=dict)

    def __reduce__(self) -> tuple[Callable[[str], Kind], tuple[str]]:
        return kind_of, (self.name,)

    @cached_property
    def _named(self) -> list[list[str]]:
        """Nodes of each row by name."""
        found = []
        for k, row in enumerate(self.rows):
            n = f"_{k + 1}" if len(self.rows) > 1 else ""
            first = f"head{n}" if row.begins == "platform" else f"root{n}"
            last = f"foot{n}" if row.ends == "base" else f"end{n}"
            found.append([first, *(f"joint{n}_{i}" for i in range(1, len(row.steps))), last])
        return found

    @cached_property
    def nodes(self) -> dict[str, Terms]:
        """Its points."""
        found: dict[str, Terms] = {}
        for names, row in zip(self._named, self.rows, strict=True):
            at = row.start
            found[names[0]] = at
            for name, (_, way) in zip(names[1:], row.steps, strict=True):
                found[name] = at = plus(at, way)
        return found

    @cached_property
    def members(self) -> dict[str, Member]:
        """Its flexures and links by name."""
        every = [
            Member(a, b, profile)
            for names, row in zip(self._named, self.rows, strict=True)
            for a, b, (profile, _) in zip(names, names[1:], row.steps, strict=False)
        ]
        profiles = [own.profile for own in every]
        numbers = [profiles[: k + 1].count(name) for k, name in enumerate(profiles)]
        return {
            own.profile if profiles.count(own.profile) == 1 else f"{own.profile}_{n}": own
            for n, own in zip(numbers, every, strict=True)
        }

    @cached_property
    def parts(self) -> dict[str, str]:
        """The rigid part of each node: platform, base, a block, or the node alone."""
        found = {name: name for name in self.nodes}
        for names, row in zip(self._named, self.rows, strict=True):
            found |= {names[0]: row.begins, names[-1]: row.ends}
        return found

    def at(self, part: str) -> tuple[str, ...]:
        """Nodes of a rigid part."""
        return tuple(name for name, own in self.parts.items() if own == part)

    @property
    def heads(self) -> tuple[str, ...]:
        """Nodes at the platform."""
        return self.at("platform")

    @property
    def feet(self) -> tuple[str, ...]:
        """Nodes at the base."""
        return self.at("base")

    @cached_property
    def spread(self) -> Terms:
        """How far its heads are apart along (m, e, d), by size."""
        ends = [self.nodes[name] for name in self.heads]
        names = {size for own in ends for size in own}
        return {
            size: tuple(np.ptp([own.get(size, (0.0, 0.0, 0.0)) for own in ends], axis=0).tolist())
            for size in sorted(names)
        }

    @cached_property
    def face(self) -> Terms:
        """How large it is along (m, e) where it begins, by size: its heads apart, as wide and thick as it is there."""
        own = plus(self.spread, {"width": (0, 1, 0)}) if self.width else self.spread
        return plus(own, {"radius": (STOUT, 0, 0), "web": (1, 0, 0)}) if self.has_thick_beginning else own

    @cached_property
    def has_thick_beginning(self) -> bool:
        """Whether links lead on where it begins at the platform."""
        return any(profile == BAR for row in self.rows if row.begins == "platform" for profile, _ in row.steps)

    @property
    def width(self) -> bool:
        """Whether it has a width along e."""
        return "width" in self.sizes

    @property
    def is_broad(self) -> bool:
        """Whether it has a size along m."""
        return any(limit.of == "across" for limit in self.sizes.values())

    @property
    def is_side_by_side(self) -> bool:
        """Whether it is equal rows from the platform to the base, each of which is a limb."""
        return len(self.rows) > 1 and len({str(row._replace(start={})) for row in self.rows}) == 1

    @property
    def is_one_sided(self) -> bool:
        """Whether its foot is to one side of its head along m."""
        return "arm" in self.sizes

    @cached_property
    def is_round(self) -> bool:
        """Whether no direction across d is its own."""
        straight = all(own[0] == own[1] == 0 for terms in self.nodes.values() for own in terms.values())
        return straight and not {own.profile for own in self.members.values()} & set(WIDE)

    @cached_property
    def processes(self) -> tuple[str, ...]:
        """How it can be made; along e it can be cut where all of it is in one plane."""
        planar = all(own[1] == 0 for terms in self.nodes.values() for own in terms.values())
        return tuple(
            name
            for name in _EVERY
            if all(name in PROFILES[own.profile].processes for own in self.members.values())
            and (name != "wire-cut" or (planar and all(own.profile in WIDE for own in self.members.values())))
        )

    @property
    def n_flexures(self) -> int:
        """How many of its members bend."""
        return sum(bool(PROFILES[own.profile].free) for own in self.members.values())

    @property
    def n_borne(self) -> int:
        """How many wrenches its members bear, each counted by itself."""
        return sum(len(PROFILES[own.profile].borne) for own in self.members.values())

    def points(self, sizes: Sizes) -> dict[str, Array]:
        """Its nodes (3,), m, in axes (m, e, d)."""
        return {name: place(terms, sizes) for name, terms in self.nodes.items()}

    def bears(self, sizes: Sizes) -> Array:
        """Wrenches (6, n) that it bears, orthonormal, about its head, in axes (m, e, d), lengths in m.

        What each member bears does no work on the twist of its ends against each other (Waldron 1966); those twists of
        the platform are free for which there are twists of the blocks, and of the nodes between members, that keep to
        this, and all that does no work on them is borne.
        """
        free = self._free(sizes)
        U, s, _ = np.linalg.svd(free)
        return U[:, int((s > SAME).sum()) :]

    def _free(self, sizes: Sizes) -> Array:
        """Twists of the platform (6, n) in n motions that no member resists, which span them all."""
        parts = ["platform", *sorted(set(self.parts.values()) - {"platform", "base"})]
        rows = []
        points = self.points(sizes)
        for a, b, profile in self.members.values():
            twist = np.zeros((6, 6 * (len(parts) + 1)))
            for node, sign in ((a, 1.0), (b, -1.0)):
                k = parts.index(self.parts[node]) if self.parts[node] != "base" else len(parts)
                twist[:, 6 * k : 6 * k + 6] += sign * np.eye(6)
            rows.append((seen_from(points[a], points[b]) @ twist)[PROFILES[profile].borne, :-6])
        return la.null_space(np.concatenate(rows), SAME)[:6]


def place(terms: Terms, sizes: Sizes) -> Array:
    """A point (3,), m, of a limb of some sizes, in its axes (m, e, d)."""
    return sum((sizes[own] * np.array(axes) for own, axes in terms.items()), np.zeros(3))


def plus(at: Terms, way: Terms, times: float = 1.0) -> Terms:
    """A point so many times a way away."""
    zero = (0.0, 0.0, 0.0)
    ends = {size: np.add(at.get(size, zero), times * np.array(way.get(size, zero))) for size in {**at, **way}}
    return {size: (float(m), float(e), float(d)) for size, (m, e, d) in ends.items()}


def seen_from(a: Array, b: Array) -> Array:
    """The displacement and rotation (..., 6, 6) along a member's own (m, e, d) of the point halfway between its ends
    (..., 3), of a twist about the head: it is along d there, in the plane of m and d."""
    way = b - a
    d = way / np.sqrt((way**2).sum(axis=-1, keepdims=True))
    e = np.broadcast_to(E, d.shape)
    Q = np.stack([np.cross(e, d).astype(float), e, d], axis=-2)
    zero = np.zeros_like(Q)
    arm: Array = np.asarray(
        np.cross(((a + b) / 2)[..., None, :], np.eye(3)), dtype=float
    )  # rows: c x i; rotation by i displaces by i x c
    rows = [np.concatenate(own, axis=-1) for own in ((Q, -Q @ arm.swapaxes(-1, -2)), (zero, Q))]
    return np.asarray(np.concatenate(rows, axis=-2), dtype=np.float64)


LENGTH = Limit(0.15, 0.995, "room")
LINK = Limit(0.15, 0.6, "room")
ARM = Limit(0.1, 0.9, "across")
ELBOW = Limit(0.15, 0.9, "across")
BROAD = Limit(0.1, 0.4, "across")
SPREAD = Limit(0.1, 0.4, "size")
WIDTH = Limit(0.1, 1.0, "width")
THICKNESS = Limit(1.0, 4.0, "thinnest", 1 / 8)
DIAMETER = Limit(1.0, 6.0, "thinnest", 1 / 8)
WEB = Limit(1.0, 4.0, "thinnest")
RADIUS = Limit(2.0, 12.0, "thinnest")
SMALL = Limit(2.0, 12.0, "thinnest", 0.1)
"""Radius of one of several notches."""

_ALONG: Terms = {"length": (0, 0, 1)}
_ASIDE: Terms = {"arm": (1, 0, 0)}
_HINGE: Terms = {"radius": (0, 0, 2)}
_CLEAR = 0.08
"""How far feet of a folded guide are clear of what its heads are at, over the length of its leaves."""
_HUB = 0.08
"""Edges of the hub of a cartwheel, over those of the rectangle that it has its spokes in."""
_BLOCK = 0.08
"""How thick the block of a folded guide is, over the length of the guide."""
_ROD = tuple((profile, {"length": (0.0, 0.0, share)}) for profile, share in ((NECK, 0.12), (ROD, 0.76), (NECK, 0.12)))
_CORNER: Terms = {"radius": (0, 0, STOUT / 2 + 0.1), "web": (0, 0, 0.5)}
"""How far the middle of a link that leads away along m is beyond a notch."""


def _row(*steps: tuple[str, Terms]) -> tuple[Row, ...]:
    return (Row({}, steps),)


def _pair(apart: Terms, row: Row) -> tuple[Row, ...]:
    """Two rows side by side."""
    return tuple(row._replace(start=plus(row.start, apart, s)) for s in (-0.5, 0.5))


def _on_post(joint: str, profile: str, link: str, **sizes: Limit) -> Kind:
    """A stiff post on a joint, which is where the wished axes meet."""
    up: Terms = {"post": (0, 0, 1), "radius": (0, 0, -1)}
    sizes = {"post": Limit(0.065, 0.9, "room"), "radius": SMALL, **sizes, "web": WEB}
    return Kind(f"post on a {joint}", sizes, _row((link, up), (profile, _HINGE)), {}, "post", {"post": (0, 0, 1)})


def _kinds() -> Iterator[Kind]:
    blade = {"length": LENGTH, "width": WIDTH, "thickness": THICKNESS}
    yield Kind("wire", {"length": LENGTH, "diameter": DIAMETER}, _row((WIRE, _ALONG)))
    yield Kind("necked rod", {"length": LENGTH, "diameter": DIAMETER}, _row(*_ROD))
    yield Kind("leaf", blade, _row((LEAF, _ALONG)))
    folded = {"length": LENGTH, "arm": ARM, "width": WIDTH, "thickness": THICKNESS}
    yield Kind("folded leaf", folded, _row((LEAF, _ALONG), (LEAF, _ASIDE)))
    rows = _row((LEAF, _ALONG), (LEAF, _ASIDE))
    yield Kind("leaf folded on the axis", folded, rows, {}, "length", _ALONG)
    apart = {"length": LENGTH, "spacing": Limit(0.05, 0.4, "across"), "span": Limit(0.5, 0.9, "across")}
    outward: Terms = {"span": (0.5, 0, 0), "spacing": (-0.5, 0, 0)}
    yield Kind(
        "folded leaf pair",
        {**apart, "width": WIDTH, "thickness": THICKNESS},
        tuple(Row({"spacing": (s / 2, 0, 0)}, ((LEAF, _ALONG), (LEAF, plus({}, outward, s)))) for s in (1.0, -1.0)),
    )
    yield Kind("notch", {"radius": RADIUS, "width": WIDTH, "web": WEB}, _row((NOTCH, _HINGE)))
    yield Kind("round neck", {"radius": RADIUS, "web": WEB}, _row((ROUND, _HINGE)))
    yield _on_post("notch", NOTCH, BAR, width=WIDTH)
    yield _on_post("round neck", ROUND, POST)
    link = {"length": LINK, "radius": SMALL, "width": WIDTH, "web": WEB}
    yield Kind("notched link", link, _row((NOTCH, _HINGE), (BAR, _ALONG), (NOTCH, _HINGE)))
    aside: Terms = {"radius": (2, 0, 0)}
    knee = ((NOTCH, _HINGE), (BAR, _ALONG), (NOTCH, _HINGE), (BAR, _CORNER), (BAR, _ASIDE), (NOTCH, aside))
    yield Kind(
        "three-notch chain", {"length": LINK, "arm": ELBOW, "radius": SMALL, "width": WIDTH, "web": WEB}, _row(*knee)
    )
    across: Terms = {"spacing": (1, 0, 0)}
    beside: Terms = {"width": (0, 1.2, 0)}
    yield Kind(
        "crossed pivot",
        {
            "length": Limit(0.15, 0.9, "room"),
            "spacing": BROAD,
            "width": Limit(0.05, 0.4, "width"),
            "thickness": THICKNESS,
        },
        tuple(
            Row(plus(plus({}, across, -s / 2), beside, s / 2), ((LEAF, plus(_ALONG, across, s)),)) for s in (1.0, -1.0)
        ),
        {},
        "length",
        {"length": (0, 0, 0.5)},
    )
    spoke: Terms = {"length": (0, 0, (1 - _HUB) / 2)}
    rim: Terms = {"length": (0, 0, (1 + _HUB) / 2)}
    yield Kind(
        "cartwheel",
        {
            "length": Limit(0.15, 0.995, "room"),
            "spacing": Limit(0.1, 0.5, "across"),
            "width": WIDTH,
            "thickness": THICKNESS,
        },
        tuple(
            row
            for s in (1.0, -1.0)
            for way in [((LEAF, plus(spoke, across, s * (1 - _HUB) / 2)),)]
            for row in (
                Row(plus({}, across, -s / 2), way, ends="hub"),
                Row(plus(rim, across, s * _HUB / 2), way, begins="hub"),
            )
        ),
        {
            "hub": (
                {"spacing": (-_HUB / 2, 0, 0), "width": (0, -0.5, 0), "length": (0, 0, 0.5 - _HUB / 2)},
                {"spacing": (_HUB / 2, 0, 0), "width": (0, 0.5, 0), "length": (0, 0, 0.5 + _HUB / 2)},
            )
        },
        "length",
        {"length": (0, 0, 0.5)},
    )
    yield Kind("leaf pair", {**blade, "spacing": Limit(0.1, 0.9, "across")}, _pair(across, Row({}, ((LEAF, _ALONG),))))
    inner: Terms = {"inner": (1, 0, 0)}
    outer: Terms = {"outer": (1, 0, 0)}
    to_block: Terms = {"length": (0, 0, 1 - _BLOCK)}
    back: Terms = {"length": (0, 0, (_CLEAR - 1) * (1 - _BLOCK))}
    yield Kind(
        "folded guide",
        {
            "length": Limit(0.2, 0.99, "room"),
            "inner": Limit(0.1, 0.6, "across"),
            "outer": Limit(0.7, 0.97, "across"),
            "width": WIDTH,
            "thickness": THICKNESS,
        },
        _pair(inner, Row({}, ((LEAF, to_block),), ends="block"))
        + _pair(outer, Row(to_block, ((LEAF, back),), begins="block")),
        {
            "block": (
                plus(to_block, {"outer": (-0.5, 0, 0), "thickness": (-2, 0, 0), "width": (0, -0.5, 0)}),
                {"outer": (0.5, 0, 0), "thickness": (2, 0, 0), "width": (0, 0.5, 0), "length": (0, 0, 1)},
            )
        },
        apart={"outer": (0.5, 0, 0), "inner": (-0.5, 0, 0), "thickness": (-1, 0, 0)},
    )
    to_block = {"length": (0, 0, 1)}
    root = plus(to_block, {"spacing": (0.5, 0, 0), "depth": (0, 0, 0.5), "thickness": (2, 0, 0)})
    yield Kind(
        "crossed guides",
        {
            "spacing": Limit(0.1, 0.9, "across"),
            "depth": Limit(0.1, 0.7, "room"),
            "length": Limit(0.15, 0.8, "room"),
            "arm": ARM,
            "width": WIDTH,
            "thickness": THICKNESS,
        },
        _pair(across, Row({}, ((LEAF, to_block),), ends="block"))
        + _pair({"depth": (0, 0, 0.9)}, Row(root, ((LEAF, _ASIDE),), begins="block")),
        {
            "block": (
                plus(to_block, {"spacing": (-0.5, 0, 0), "thickness": (-2, 0, 0), "width": (0, -0.5, 0)}),
                plus(
                    to_block, {"spacing": (0.5, 0, 0), "depth": (0, 0, 1), "thickness": (2, 0, 0), "width": (0, 0.5, 0)}
                ),
            )
        },
    )
    wide: Terms = {"spacing": (0, 1, 0)}
    end: Terms = {"length": (0, 0, 1), "diameter": (2, 0, 3)}
    yield Kind(
        "delta arm",
        {
            "length": LINK,
            "diameter": DIAMETER,
            "spacing": SPREAD,
            "arm": ARM,
            "radius": SMALL,
            "width": WIDTH,
            "web": WEB,
        },
        (
            *_pair(wide, Row({}, _ROD, ends="block")),
            Row(end, ((BAR, _ASIDE), (NOTCH, aside)), begins="block"),
        ),
        {
            "block": (
                {"spacing": (0, -0.5, 0), "diameter": (-2, -2, 0), "length": (0, 0, 1)},
                {"spacing": (0, 0.5, 0), "diameter": (2, 2, 6), "length": (0, 0, 1)},
            )
        },
    )
    side: Terms = {"length": (0, 0, 1), "diameter": (2, 0, 0), "gap": (0, 0, 0.5)}
    yield Kind(
        "linear delta arm",
        {
            "length": LINK,
            "diameter": DIAMETER,
            "spacing": SPREAD,
            "arm": ARM,
            "gap": Limit(0.1, 0.3, "room"),
            "width": WIDTH,
            "thickness": THICKNESS,
        },
        _pair(wide, Row({}, ((WIRE, _ALONG),), ends="block"))
        + _pair({"gap": (0, 0, 0.8)}, Row(side, ((LEAF, _ASIDE),), begins="block")),
        {
            "block": (
                {"spacing": (0, -0.5, 0), "diameter": (-2, -2, 0), "length": (0, 0, 1)},
                {"spacing": (0, 0.5, 0), "diameter": (2, 2, 0), "length": (0, 0, 1), "gap": (0, 0, 1)},
            )
        },
    )


KINDS: dict[str, Kind] = {kind.name: kind for kind in _kinds()}
"""All kinds by name, the plainest first."""


def kind_of(name: str) -> Kind:
    """A kind by its name."""
    return KINDS[name]


def unit_sizes(kind: Kind, scale: float) -> Sizes:
    """Sizes for what does not depend on them, each another multiple of a length, m."""
    return {name: scale * (0.31 + 0.17 * k) for k, name in enumerate(kind.sizes)}


def describe_member(profile: str, m: Any, names: Mapping[str, str]) -> dict[str, Any]:
    """What a member is whose thickness is along m, by the names of its sizes."""
    thin = names[PROFILES[profile].thin]
    if profile == ROD:
        return {"section": {"shape": "circle", "diameter": f"3*{thin}"}}
    if profile == POST:
        return {"section": {"shape": "circle", "diameter": f"{STOUT:g}*{names['radius']} + {thin}"}}
    if profile == BAR:
        height = f"{STOUT:g}*{names['radius']} + {thin}"
        return {"reference": m, "section": {"shape": "rectangle", "width": names["width"], "thickness": height}}
    if profile == LEAF:
        return {"reference": m, "profile": {"type": "leaf", "width": names["width"], "thickness": thin}}
    if profile == WIRE:
        return {"profile": {"type": "round", "contour": {"shape": "straight", "web": thin}}}
    if profile == NECK:
        contour = {"shape": "elliptical", "depth": thin, "web": thin}
        return {"profile": {"type": "round", "contour": contour}, "integration": "tapered"}
    contour = {"shape": "circular", "radius": names["radius"], "web": thin}
    if profile == NOTCH:
        return {"reference": m, "profile": {"type": "notch", "width": names["width"], "contour": contour}}
    return {"profile": {"type": "round", "contour": contour}, "integration": "tapered"}
