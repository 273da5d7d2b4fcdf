"""Kinds of limbs: what each bears between platform and base, and how it is drawn.

A limb begins at its head, a point of the platform, and leads along d. Its flexures are as wide as they are along e, and
the thickness of leaves is along m = e x d. Points of a limb are sums of its sizes times these axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.screws import ScrewSpace, sum_of

Terms = dict[str, tuple[float, float, float]]
"""A point of a limb: by size, so many times along (m, e, d) from the head."""

Sizes = dict[str, float]

LEAF, WIRE = "leaf", "wire"

FORCE, COUPLE = np.eye(6)[:, :3], np.eye(6)[:, 3:]


@dataclass(frozen=True)
class Limit:
    """From where to where a size may go: over the room that the limb has along its axis, or over the thinnest web."""

    least: float
    most: float
    of: str


LENGTH = Limit(0.15, 0.95, "room")
THICKNESS = Limit(1.0, 4.0, "thinnest")
DIAMETER = Limit(1.0, 6.0, "thinnest")


@dataclass(frozen=True)
class Kind:
    """A kind of limb.

    `bears(sizes)` are its wrenches about the head, in axes (m, e, d), of unit sizes; `sizes` are what may vary. `nodes`
    are its points, `members` by name the two nodes of each with its profile, and `blocks` bodies by the nodes that they
    carry, with two opposite corners of each. `heads` and `feet` are nodes at the platform and at the base. `is_planar`
    says that it can be cut along e; `is_round` that no direction across d is its own, and `width` whether it has one
    along e.
    """

    name: str
    sizes: dict[str, Limit]
    bears: Callable[[Sizes], Array]
    nodes: dict[str, Terms]
    members: dict[str, tuple[str, str, str]]
    heads: tuple[str, ...] = ("head",)
    feet: tuple[str, ...] = ("foot",)
    blocks: dict[str, tuple[tuple[str, ...], Terms, Terms]] | None = None
    is_planar: bool = False
    is_round: bool = False
    width: bool = False
    processes: tuple[str, ...] = ("milled", "printed", "assembled")

    @property
    def is_one_sided(self) -> bool:
        """Whether its foot is to one side of its head along m."""
        return "arm" in self.sizes

    def __reduce__(self) -> tuple[Callable[[str], Kind], tuple[str]]:
        return kind_of, (self.name,)

    def points(self, sizes: Sizes) -> dict[str, Array]:
        """Its nodes (3,), m, in axes (m, e, d)."""
        return {name: place(terms, sizes) for name, terms in self.nodes.items()}


def place(terms: Terms, sizes: Sizes) -> Array:
    """A point (3,), m, of a limb of some sizes, in its axes (m, e, d)."""
    return sum((sizes[own] * np.array(axes) for own, axes in terms.items()), np.zeros(3))


M, E, D = np.eye(3)


def _at(point: Array, wrenches: Array) -> Array:
    """Wrenches (6, n) about a point, about the head instead."""
    moved = wrenches.copy()
    moved[3:] += np.cross(point, wrenches[:3], axis=0)
    return moved


def _joint(point: Array, rotations: tuple[Array, ...] = (), translations: tuple[Array, ...] = ()) -> ScrewSpace:
    """The freedoms of a joint at a point."""
    twists = [[*np.cross(point, d), *d] for d in rotations] + [[*d, 0.0, 0.0, 0.0] for d in translations]
    return ScrewSpace.of("twists", np.array(twists).T)


def _chain(*joints: ScrewSpace) -> Array:
    """What joints in a row bear: what does no work on any of their freedoms (Waldron 1966)."""
    return sum_of(joints).reciprocal().basis


def _leaf(_: Sizes) -> Array:
    return np.stack([FORCE[:, 2], FORCE[:, 1], COUPLE[:, 0]], axis=1)


_HEAD: dict[str, Terms] = {"head": {}, "foot": {"length": (0, 0, 1)}}
_NECK = 0.12
_CLEAR = 0.1
"""How far feet of a folded guide are clear of what its heads are at, over the length of its leaves."""

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind(
            "wire",
            {"length": LENGTH, "diameter": DIAMETER},
            lambda _: FORCE[:, 2:],
            _HEAD,
            {"wire": ("head", "foot", WIRE)},
            is_round=True,
            processes=("printed", "assembled"),
        ),
        Kind(
            "necked rod",
            {"length": LENGTH, "diameter": DIAMETER},
            lambda _: FORCE[:, 2:],
            {
                "head": {},
                "upper": {"length": (0, 0, _NECK)},
                "lower": {"length": (0, 0, 1 - _NECK)},
                "foot": {"length": (0, 0, 1)},
            },
            {"neck": ("head", "upper", "neck"), "rod": ("upper", "lower", "rod"), "root": ("lower", "foot", "neck")},
            is_round=True,
            processes=("milled", "printed"),
        ),
        Kind(
            "leaf",
            {"length": LENGTH, "width": Limit(0.1, 1.0, "width"), "thickness": THICKNESS},
            _leaf,
            _HEAD,
            {"blade": ("head", "foot", LEAF)},
            is_planar=True,
            width=True,
            processes=("wire-cut", "milled", "printed", "assembled"),
        ),
        Kind(
            "folded leaf",
            {
                "length": LENGTH,
                "arm": Limit(0.1, 0.4, "size"),
                "width": Limit(0.1, 1.0, "width"),
                "thickness": THICKNESS,
            },
            lambda s: _at(s["length"] * D, FORCE[:, 1:2]),
            {"head": {}, "corner": {"length": (0, 0, 1)}, "foot": {"length": (0, 0, 1), "arm": (1, 0, 0)}},
            {"first": ("head", "corner", LEAF), "second": ("corner", "foot", LEAF)},
            is_planar=True,
            width=True,
            processes=("wire-cut", "milled", "printed", "assembled"),
        ),
        Kind(
            "notch",
            {"radius": Limit(2.0, 12.0, "thinnest"), "width": Limit(0.1, 1.0, "width"), "web": THICKNESS},
            lambda s: _chain(_joint(s["radius"] * D, (E,))),
            {"head": {}, "foot": {"radius": (0, 0, 2)}},
            {"hinge": ("head", "foot", "notch")},
            is_planar=True,
            width=True,
            processes=("wire-cut", "milled", "printed"),
        ),
        Kind(
            "two-axis neck",
            {"radius": Limit(2.0, 12.0, "thinnest"), "web": THICKNESS},
            lambda s: _chain(_joint(s["radius"] * D, (M, E))),
            {"head": {}, "foot": {"radius": (0, 0, 2)}},
            {"neck": ("head", "foot", "two_axis")},
            processes=("milled", "printed"),
        ),
        Kind(
            "round neck",
            {"radius": Limit(2.0, 12.0, "thinnest"), "web": THICKNESS},
            lambda s: _chain(_joint(s["radius"] * D, (M, E, D))),
            {"head": {}, "foot": {"radius": (0, 0, 2)}},
            {"neck": ("head", "foot", "round")},
            is_round=True,
            processes=("milled", "printed"),
        ),
        Kind(
            "folded guide",
            {
                "length": LENGTH,
                "inner": Limit(0.1, 0.4, "size"),
                "outer": Limit(0.5, 0.9, "size"),
                "width": Limit(0.1, 1.0, "width"),
                "thickness": THICKNESS,
            },
            lambda _: _chain(_joint(np.zeros(3), (), (M,))),
            {
                "head_low": {"inner": (-0.5, 0, 0)},
                "head_high": {"inner": (0.5, 0, 0)},
                "inner_low": {"inner": (-0.5, 0, 0), "length": (0, 0, 1)},
                "inner_high": {"inner": (0.5, 0, 0), "length": (0, 0, 1)},
                "outer_low": {"outer": (-0.5, 0, 0), "length": (0, 0, 1)},
                "outer_high": {"outer": (0.5, 0, 0), "length": (0, 0, 1)},
                "foot_low": {"outer": (-0.5, 0, 0), "length": (0, 0, _CLEAR)},
                "foot_high": {"outer": (0.5, 0, 0), "length": (0, 0, _CLEAR)},
            },
            {
                "inner_1": ("head_low", "inner_low", LEAF),
                "inner_2": ("head_high", "inner_high", LEAF),
                "outer_1": ("outer_low", "foot_low", LEAF),
                "outer_2": ("outer_high", "foot_high", LEAF),
            },
            heads=("head_low", "head_high"),
            feet=("foot_low", "foot_high"),
            blocks={
                "block": (
                    ("inner_low", "inner_high", "outer_low", "outer_high"),
                    {"outer": (-0.5, 0, 0), "thickness": (-2, 0, 0), "width": (0, -0.5, 0), "length": (0, 0, 1)},
                    {"outer": (0.5, 0, 0), "thickness": (2, 0, 6), "width": (0, 0.5, 0), "length": (0, 0, 1)},
                )
            },
            is_planar=True,
            width=True,
            processes=("wire-cut", "milled", "printed", "assembled"),
        ),
        Kind(
            "crossed guides",
            {
                "length": Limit(0.15, 0.6, "room"),
                "spacing": Limit(0.1, 0.4, "room"),
                "arm": Limit(0.1, 0.4, "size"),
                "width": Limit(0.1, 1.0, "width"),
                "thickness": THICKNESS,
            },
            lambda _: _chain(_joint(np.zeros(3), (), (M, D))),
            {
                "head_low": {"spacing": (-0.5, 0, 0)},
                "head_high": {"spacing": (0.5, 0, 0)},
                "end_low": {"spacing": (-0.5, 0, 0), "length": (0, 0, 1)},
                "end_high": {"spacing": (0.5, 0, 0), "length": (0, 0, 1)},
                "root_near": {"spacing": (0.5, 0, 0.1), "length": (0, 0, 1), "thickness": (2, 0, 0)},
                "root_far": {"spacing": (0.5, 0, 0.9), "length": (0, 0, 1), "thickness": (2, 0, 0)},
                "foot_near": {"spacing": (0.5, 0, 0.1), "length": (0, 0, 1), "arm": (1, 0, 0), "thickness": (2, 0, 0)},
                "foot_far": {"spacing": (0.5, 0, 0.9), "length": (0, 0, 1), "arm": (1, 0, 0), "thickness": (2, 0, 0)},
            },
            {
                "inner_1": ("head_low", "end_low", LEAF),
                "inner_2": ("head_high", "end_high", LEAF),
                "outer_1": ("root_near", "foot_near", LEAF),
                "outer_2": ("root_far", "foot_far", LEAF),
            },
            heads=("head_low", "head_high"),
            feet=("foot_near", "foot_far"),
            blocks={
                "block": (
                    ("end_low", "end_high", "root_near", "root_far"),
                    {"spacing": (-0.5, 0, 0), "thickness": (-2, 0, 0), "width": (0, -0.5, 0), "length": (0, 0, 1)},
                    {"spacing": (0.5, 0, 0.9), "thickness": (2, 0, 2), "width": (0, 0.5, 0), "length": (0, 0, 1)},
                )
            },
            is_planar=True,
            width=True,
            processes=("wire-cut", "milled", "printed", "assembled"),
        ),
    )
}
"""All kinds by name, the plainest first."""


def kind_of(name: str) -> Kind:
    """A kind by its name."""
    return KINDS[name]


def unit_sizes(kind: Kind, scale: float) -> Sizes:
    """Sizes for what does not depend on them, each another multiple of a length, m."""
    return {name: scale * (0.31 + 0.17 * k) for k, name in enumerate(kind.sizes)}


def describe_member(profile: str, m: Any, width: str, thin: str, radius: str) -> dict[str, Any]:
    """Profile of a flexure whose thickness is along m, by the names of its sizes."""
    if profile == LEAF:
        return {"reference": m, "profile": {"type": "leaf", "width": width, "thickness": thin}}
    if profile == WIRE:
        return {"profile": {"type": "round", "contour": {"shape": "straight", "web": thin}}}
    if profile == "neck":
        contour = {"shape": "elliptical", "depth": thin, "web": thin}
        return {"profile": {"type": "round", "contour": contour}, "integration": "tapered"}
    contour = {"shape": "circular", "radius": radius, "web": thin}
    if profile == "notch":
        return {"reference": m, "profile": {"type": "notch", "width": width, "contour": contour}}
    if profile == "two_axis":
        return {"reference": m, "profile": {"type": "two_axis", "y_contour": contour, "z_contour": contour}}
    return {"profile": {"type": "round", "contour": contour}, "integration": "tapered"}
