"""Stacks with what makes their stroke longer, each as the substructure of a mechanism file.

In its own frame a drive pushes and pulls along z at its tip, the origin, and all else is below: a necked rod that bears
nothing but forces along it, and a stack upright under it (`none`), a bridge or a lever.

The ratio of a lever is that of its arms. That of a bridge is o (l + a) / (o^2 + g^2), of leaves of length l and
thickness t that bend as wide strips, arms of length a that are five times as thick, and inner leaves that are higher
than outer ones by o; g^2 = t^2/(3 (1 - nu^2)) (1 + a/(10 l)) is what they stretch. Without it the ratio is the
cotangent of the angle of the arms (Lobontiu and Garcia 2003; Ling, Cao, Zeng, Lin and Inman 2016).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.synthesis.limbs import LEAF, NECK, NOTCH, ROD, describe_member
from flexura.synthesis.wish import Stack

SPARE = 1.4
"""Ratio of an amplifier as drawn first, over what its kinematics need: limbs and leaves take the rest."""

LEAST_RATIO = 2.0
"""Of a lever: below there is no room between its hinges and its tip."""

SHORTEST_LEAF = 0.16
"""Length of the leaves of a bridge over their width, where the stack leaves room: shorter ones were not measured."""

NECK_SHARE = 0.15
"""Length of the necks of a rod, over that of the rod."""

STRIP = 0.91
"""1 - nu^2 of metals."""

STOUT = 5.0
"""Thickness of the arms of a bridge over that of its leaves."""


@dataclass(frozen=True)
class Form:
    """A length that is a sum of sizes times numbers and of a fixed length, m."""

    terms: Mapping[str, float]
    fixed: float = 0.0

    def __add__(self, other: Form | float) -> Form:
        if not isinstance(other, Form):
            return Form(self.terms, self.fixed + other)
        terms = {name: self.terms.get(name, 0.0) + other.terms.get(name, 0.0) for name in {**self.terms, **other.terms}}
        return Form(terms, self.fixed + other.fixed)

    __radd__ = __add__

    def __mul__(self, by: float) -> Form:
        return Form({name: by * c for name, c in self.terms.items()}, by * self.fixed)

    __rmul__ = __mul__

    def __neg__(self) -> Form:
        return self * -1.0

    def __sub__(self, other: Form | float) -> Form:
        return self + -other

    def at(self, sizes: Mapping[str, float]) -> float:
        """Its length, m."""
        return self.fixed + sum(c * sizes[name] for name, c in self.terms.items())

    def __str__(self) -> str:
        texts = [f"{1e3 * self.fixed:+.6g} mm"] if abs(self.fixed) > 1e-12 else []
        for name, c in self.terms.items():
            if abs(c) > 1e-12:
                times = "" if abs(abs(c) - 1) < 1e-12 else f"{abs(c):.6g}*"
                texts.append(f"{'-' if c < 0 else '+'}{times}drive_{name}")
        first, *others = texts or ["+0 mm"]
        return " ".join([first.removeprefix("+"), *(f"{text[0]} {text[1:]}" for text in others)])


Point = tuple[Form, Form, Form]
ZERO = Form({})


def _point(x: Form | float = 0.0, z: Form | float = 0.0) -> Point:
    return ZERO + x, ZERO, ZERO + z


class Size(NamedTuple):
    """A size as drawn first and its limits, m."""

    value: float
    least: float
    most: float


@dataclass
class Parts:
    """What a drive consists of: `hull` are boxes that hold it, each two opposite corners, `held` nodes that the ground
    holds, `sign` whether its tip rises (1) or sinks (-1) where the stack gets longer."""

    sign: float
    nodes: dict[str, Point] = field(default_factory=dict)
    flexures: dict[str, Any] = field(default_factory=dict)
    links: dict[str, Any] = field(default_factory=dict)
    bodies: dict[str, Any] = field(default_factory=dict)
    instances: dict[str, Any] = field(default_factory=dict)
    stack: tuple[str, str] = ("stack_foot", "stack_head")
    held: tuple[str, ...] = ("stack_foot",)
    hull: list[tuple[Point, Point]] = field(default_factory=list)
    other: dict[str, Any] = field(default_factory=dict)
    """Substructures of its own, by name."""

    def box(self, name: str, low: Sequence[Form], high: Sequence[Form], carries: list[str], material: str) -> None:
        """Add a body that is a box."""
        self.bodies[name] = {
            "centre": [str((a + b) * 0.5) for a, b in zip(low, high, strict=True)],
            "solid": {
                "shape": "box",
                "size": [str(b - a) for a, b in zip(low, high, strict=True)],
                "material": material,
            },
            "carries": carries,
        }


def _leaf(nodes: list[str], material: str) -> dict[str, Any]:
    more = describe_member(LEAF, "z", {"width": "drive_depth", "thickness": "drive_web"})
    return {"nodes": nodes, "material": material, **more}


def _notch(nodes: list[str], material: str) -> dict[str, Any]:
    more = describe_member(NOTCH, "x", {"width": "drive_depth", "web": "drive_web", "radius": "drive_radius"})
    return {"nodes": nodes, "material": material, **more}


def _size(name: str) -> Form:
    return Form({name: 1.0})


def _rod(parts: Parts, material: str) -> Form:
    """Add the rod; the height of its lower end."""
    rod, half = _size("rod"), _size("neck") * 1.5
    parts.nodes |= {
        "tip": _point(),
        "rod_high": _point(z=rod * -NECK_SHARE),
        "rod_low": _point(z=rod * (NECK_SHARE - 1)),
        "end": _point(z=-rod),
    }
    own, named = {"material": material}, {"diameter": "drive_neck"}
    for name, nodes in (("high_neck", ["tip", "rod_high"]), ("low_neck", ["rod_low", "end"])):
        parts.flexures[name] = {"nodes": nodes, **own, **describe_member(NECK, "", named)}
    parts.links["rod"] = {"nodes": ["rod_high", "rod_low"], **own, **describe_member(ROD, "", named)}
    parts.hull.append(((-half, -half, -rod), (half, half, ZERO)))
    return -rod


def _none(stack: Stack, material: str) -> Parts:
    """A stack under the rod, with a cap between."""
    own = Parts(1.0)
    top, e = _rod(own, material), stack.edge
    half, cap = ZERO + e / 2, top - e / 2
    own.nodes |= {"stack_head": _point(z=cap), "stack_foot": _point(z=cap - stack.length)}
    own.box("cap", (-half, -half, cap), (half, half, top), ["end", "stack_head"], material)
    own.hull.append(((-half, -half, cap - stack.length), (half, half, top)))
    return own


def _bridge(stack: Stack, material: str) -> Parts:
    """Two pairs of arms around a stack that lies along x; what it rises by is the way of both pairs."""
    own, e = Parts(-1.0, stack=("stack_left", "stack_right"), held=()), stack.edge
    top = _rod(own, material)
    web, leaf, offset, seat, depth = map(_size, ("web", "leaf", "offset", "seat", "depth"))
    width, block = BRIDGE_WIDTH * e, BRIDGE_BLOCK * e
    arms = web * (STOUT / 2) + offset * 0.5 + 0.6 * e  # height of the arms over the stack
    face, centre = arms + offset * 0.5 + web * 8, top - arms - offset * 0.5 - web * 8
    span, half = seat + stack.length / 2, depth * 0.5
    quarter = {
        "nodes": {
            "output": _point(width / 2, arms + offset * 0.5),
            "inner": _point(leaf + width / 2, arms),
            "outer": _point(span - leaf, arms),
            "input": _point(span, arms - offset * 0.5),
        },
        "flexures": {
            "inner_leaf": {**_leaf(["output", "inner"], material), "end_offset": [0, 0, str(offset * 0.5)]},
            "outer_leaf": {**_leaf(["outer", "input"], material), "start_offset": [0, 0, str(offset * -0.5)]},
        },
        "links": {
            "arm": {
                "nodes": ["inner", "outer"],
                "material": material,
                "reference": "z",
                "section": {"shape": "rectangle", "width": "drive_depth", "thickness": str(web * STOUT)},
            }
        },
        "interface": ["output", "input"],
    }
    quarter["nodes"] = {name: list(map(str, point)) for name, point in quarter["nodes"].items()}
    own.other["drive_quarter"] = quarter
    mirrors = [{"type": "mirror", "normal": "x"}, {"type": "mirror", "normal": "z", "point": [0, 0, str(centre)]}]
    own.instances["quarter"] = {"of": "drive_quarter", "at": [0, 0, str(centre)], "pattern": mirrors}
    ends = stack.length / 2
    own.nodes |= {"stack_left": _point(-ends, centre), "stack_right": _point(ends, centre)}
    wide, inside = ZERO + width / 2, arms + offset * 0.5 - web * 2
    own.box(
        "output",
        (-wide, -half, centre + inside),
        (wide, half, top),
        ["quarter1.output", "quarter2.output", "end"],
        material,
    )
    own.box(
        "base",
        (-wide, -half, centre - face),
        (wide, half, centre - inside),
        ["quarter3.output", "quarter4.output"],
        material,
    )
    own.bodies["base"]["held"] = {"face": "z-"}
    tall, thick = arms - offset * 0.5 + web * 4, ZERO + e / 2
    for name, sign, quarters in (("right", 1.0, (1, 3)), ("left", -1.0, (2, 4))):
        low, high = sorted((span * sign, (span + block) * sign), key=lambda own: own.fixed)
        carries = [f"quarter{k}.input" for k in quarters]
        own.box(name, (low, -half, centre - tall), (high, half, centre + tall), carries, material)
        low, high = sorted((ZERO + sign * ends, span * sign), key=lambda own: sum(own.terms.values()))
        seat_of = (low, -thick, centre - thick), (high, thick, centre + thick)
        own.box(f"{name}_seat", *seat_of, [f"stack_{name}", name], material)
    own.hull.append(((-span - block, -half, centre - face), (span + block, half, top)))
    return own


def _lever(stack: Stack, material: str) -> Parts:
    """A lever along -x from the rod, on a notch, with another one on the head of a stack upright between."""
    own = Parts(1.0, held=("fulcrum_foot", "stack_foot"))
    top, e = _rod(own, material), stack.edge
    web, radius, height, depth = map(_size, ("web", "radius", "height", "depth"))
    inner, outer, half = _size("in"), _size("out"), depth * 0.5
    tip, axis, bottom = ZERO + e / 2, top - height * 0.5, top - height
    hinge = bottom - radius * 2
    cap, heel, wide = hinge - e / 2, -outer + inner + radius + web, ZERO + e / 2
    at = -outer + inner
    own.nodes |= {
        "fulcrum": _point(-outer, bottom),
        "fulcrum_foot": _point(-outer, hinge),
        "pushed": _point(at, bottom),
        "push": _point(at, hinge),
        "heel_face": _point(heel, axis),
        "tip_face": _point(-tip, axis),
        "stack_head": _point(at, cap),
        "stack_foot": _point(at, cap - stack.length),
    }
    own.flexures |= {
        "fulcrum_notch": _notch(["fulcrum_foot", "fulcrum"], material),
        "push_notch": _notch(["push", "pushed"], material),
    }
    section = {"shape": "rectangle", "width": "drive_depth", "thickness": "drive_height"}
    own.links["lever"] = {
        "nodes": ["heel_face", "tip_face"],
        "material": material,
        "reference": "z",
        "section": section,
    }
    low = -outer - radius - web
    own.box("heel", (low, -half, bottom), (heel, half, top), ["fulcrum", "pushed", "heel_face"], material)
    own.box("nose", (-tip, -half, bottom), (tip, half, top), ["tip_face", "end"], material)
    own.box("cap", (at - wide, -wide, cap), (at + wide, wide, hinge), ["push", "stack_head"], material)
    own.hull.append(((low, -half, bottom), (tip, half, top)))
    own.hull.append(((low, -half, cap - stack.length), (at + wide, half, bottom)))
    return own


BRIDGE_WIDTH, BRIDGE_BLOCK = 0.8, 1.0
"""Width of the output of a bridge, and thickness of the blocks at its ends, over the edge of the stack."""


def _own(value: float, least: float, most: float) -> Size:
    return Size(value, least * value, most * value)


def _common(stack: Stack, thinnest: float, rod: float) -> dict[str, Size]:
    neck = max(1.2 * thinnest, 0.12 * stack.edge)
    return {"rod": _own(rod, 0.6, 1.2), "neck": Size(neck, thinnest, 2.5 * neck)}


def bridge_ratio(sizes: Mapping[str, float], stack: Stack) -> float:
    """How many times as far the output of a bridge moves as its stack gets longer."""
    arms, thick = _reach_of(sizes["leaf"], sizes["seat"], sizes["web"], stack)
    return sizes["offset"] * arms / (sizes["offset"] ** 2 + thick**2)


def _reach_of(leaf: float, seat: float, web: float, stack: Stack) -> tuple[float, float]:
    """l + a and g of a bridge, m."""
    arm = stack.length / 2 + seat - BRIDGE_WIDTH * stack.edge / 2 - 2 * leaf
    return leaf + arm, float(web * np.sqrt((1 + arm / (2 * STOUT * leaf)) / (3 * STRIP)))


def lever_ratio(sizes: Mapping[str, float], _: Stack) -> float:
    """How many times as far the tip of a lever moves as its stack gets longer."""
    return sizes["out"] / sizes["in"]


def _none_sizes(stack: Stack, thinnest: float, rod: float, needed: float) -> Iterator[dict[str, Size]]:
    if needed <= 1.0:
        yield _common(stack, thinnest, rod)


def _bridge_sizes(stack: Stack, thinnest: float, rod: float, needed: float) -> Iterator[dict[str, Size]]:
    """Bridges of the ratio that is wanted, the shortest first, and then shorter ones that still reach."""
    e, wanted = stack.edge, SPARE * needed
    web = max(1.2 * thinnest, 0.06 * e)
    most = min(0.6 * e, (0.4 * stack.length + 0.2 * e - BRIDGE_WIDTH * e / 2) / 2)
    leaf = Size(0.6 * most, 0.45 * most, most)
    deepest = max(1.25 * e, min(1.6 * e, leaf.least / SHORTEST_LEAF))
    found: list[tuple[float, dict[str, Size]]] = []
    for seat in e * np.array([0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0]):
        arms, thick = _reach_of(leaf.value, float(seat), web, stack)
        ratio = min(wanted, arms / (2 * thick))
        if ratio < needed:
            continue
        offset = (arms + np.sqrt(max(arms**2 - 4 * (ratio * thick) ** 2, 0.0))) / (2 * ratio)
        sizes = _common(stack, thinnest, rod) | {
            "web": Size(web, thinnest, 3 * web),
            "leaf": leaf,
            "offset": _own(float(offset), 0.4, 2.0),
            "seat": Size(float(seat), 0.2 * e, 1.5 * float(seat)),
            "depth": Size(1.2 * e, 1.05 * e, deepest),
        }
        found.append((ratio, sizes))
        if ratio == wanted:
            break
    yield from (sizes for _, sizes in reversed(found))


def _lever_sizes(stack: Stack, thinnest: float, rod: float, needed: float) -> Iterator[dict[str, Size]]:
    e = stack.edge
    radius, web = _own(0.3 * e, 0.7, 1.5), max(1.2 * thinnest, 0.08 * e)
    inner = Size(0.6 * e + radius.value + 1.5 * web, 0.6 * e + radius.least + web, 1.0 * e + radius.most + 3 * web)
    least = inner.most + radius.most + 3 * web + e
    for spare in (SPARE, 1.2, 1.05):
        out = max(max(spare * needed, LEAST_RATIO) * inner.value, 1.1 * least)
        yield _common(stack, thinnest, rod) | {
            "in": inner,
            "out": Size(out, max(least, 0.6 * out), 1.4 * out),
            "height": _own(max(1.2 * e, out / 6), 0.6, 1.6),
            "depth": Size(1.2 * e, 1.05 * e, 2.5 * e),
            "radius": radius,
            "web": Size(web, thinnest, 3 * web),
        }


class Amplifier(NamedTuple):
    """A way to make a stroke longer: how it is drawn, first sizes that reach a ratio, the shortest first, and what its
    ratio is by them."""

    name: str
    parts: Callable[[Stack, str], Parts]
    sizes: Callable[[Stack, float, float, float], Iterator[dict[str, Size]]]
    ratio: Callable[[Mapping[str, float], Stack], float]
    is_mirrored: bool = True
    """Whether it is the same turned by half a turn about its axis."""


AMPLIFIERS = (
    Amplifier("none", _none, _none_sizes, lambda *_: 1.0),
    Amplifier("bridge", _bridge, _bridge_sizes, bridge_ratio),
    Amplifier("lever", _lever, _lever_sizes, lever_ratio, is_mirrored=False),
)


def hull_of(parts: Parts, sizes: Mapping[str, float]) -> tuple[Array, Array]:
    """Boxes that hold a drive, m: middles (b, 3) and half edges (b, 3) in its frame."""
    ends = np.array([[[own.at(sizes) for own in corner] for corner in box] for box in parts.hull])
    return ends.mean(axis=1), np.ptp(ends, axis=1) / 2


def substructures(parts: Parts, stack: Stack, tip: str) -> dict[str, Any]:
    """A drive as the substructure `drive`, and those that it consists of; the platform carries its tip, or a lug."""
    k, edge = stack.stiffness, f"{1e3 * stack.edge:.6g} mm"
    own: dict[str, Any] = {
        "nodes": {name: list(map(str, point)) for name, point in parts.nodes.items()},
        "flexures": parts.flexures,
        "links": parts.links,
        "bodies": parts.bodies,
        "instances": parts.instances,
        "actuators": {
            "stack": {
                "type": "piezo",
                "nodes": list(parts.stack),
                "stiffness": f"{1e-6 * k:.6g} N/um",
                "free_stroke": f"{1e6 * stack.free_stroke:.6g} um",
                "mass": f"{1e3 * stack.mass:.6g} g",
                "section": {"shape": "rectangle", "width": edge, "thickness": edge},
            }
        },
        "interface": [tip, *parts.held],
    }
    return {**parts.other, "drive": {key: value for key, value in own.items() if value}}


@dataclass(frozen=True)
class Drive:
    """Equal stacks with amplifiers of one `kind` and their first `sizes`, in the room of a wish.

    Their tips are at `heads` (n, 3), m; columns of `frames` (n, 3, 3) are the axes in which they are drawn. They push
    at the platform, or at a `lug` of it, two opposite corners (3,) in these axes. All is in `boxes`, middles and half
    edges (b, 3) in these axes, the last one of which is the lug. From half their free stroke on they get longer by
    `shares` (n, f), m, for the wished strokes along `names`; all of these together take all that they have. `needed` is
    the ratio that this needs by kinematics.
    """

    kind: str
    stack: Stack
    sizes: Mapping[str, Size]
    heads: Array
    frames: Array
    lug: tuple[Array, Array] | None
    boxes: tuple[Array, Array]
    names: tuple[str, ...]
    shares: Array
    needed: float

    @property
    def amplifier(self) -> Amplifier:
        """How it is drawn."""
        return next(own for own in AMPLIFIERS if own.name == self.kind)

    @property
    def drawn_first(self) -> dict[str, float]:
        """Sizes as drawn first, m."""
        return {name: own.value for name, own in self.sizes.items()}

    @property
    def ratio(self) -> float:
        """Its ratio as drawn first, by kinematics."""
        return self.amplifier.ratio(self.drawn_first, self.stack)

    @property
    def name(self) -> str:
        """In words, such as `3 piezo stacks with bridges`."""
        several = "s" if len(self.heads) > 1 else ""
        added = "" if self.kind == "none" else f" with {self.kind}s" if several else f" with a {self.kind}"
        return f"{len(self.heads)} piezo stack{several}{added}"

    def away(self, points: Array, copies: Sequence[int] | None = None) -> float:
        """How near points (n, 3) come to the drives, or some of them, m; 0 within."""
        middles, halves = self.boxes
        of = np.arange(len(self.heads)) if copies is None else copies
        local = (points - self.heads[of, None]) @ self.frames[of]
        beyond = np.maximum(np.abs(local[:, :, None] - middles) - halves, 0.0)
        return float(np.sqrt((beyond**2).sum(axis=-1).min()))
