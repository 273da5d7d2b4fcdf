"""Stacks with what makes their stroke longer, each as the substructure of a mechanism file.

In its own frame a drive pushes and pulls along z at its tip, the origin, and all else is below: a necked rod that bears
nothing but forces along it, and a stack upright under it (`none`), a bridge, a rhombus or a lever. Where the platform
is free along this line alone a bridge or a rhombus may do without the rod: its arms begin at the platform, which it
then holds.

The ratio of a lever is that of its arms. That of a bridge is o (l + a) / (o^2 + g^2), of leaves of length l and
thickness t that bend as wide strips, arms of length a that are five times as thick, and inner leaves that are higher
than outer ones by o; g^2 = t^2/(3 (1 - nu^2)) (1 + a/(10 l)) is what they stretch. Without it the ratio is the
cotangent of the angle of the arms (Lobontiu and Garcia 2003; Ling, Cao, Zeng, Lin and Inman 2016). That of a rhombus,
whose arms of length l bend all along at an angle b to the stack, is (1 - q) sin b cos b / (sin^2 b + q cos^2 b), q =
t^2/(l^2 (1 - nu^2)), as of beams that are guided at both ends (any beam table).
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
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

THICKEST_NECK = 0.5
"""Diameter of necks over the edge of the stack, at most."""

NECK_SHARE = 0.15
"""Length of the necks of a rod, over that of the rod."""

STRIP = 0.91
"""1 - nu^2 of metals."""

STOUT = 5.0
"""Thickness of the arms of a bridge over that of its leaves."""

CLEAR = 0.6
"""Height of the underside of arms over the axis of the stack, over its edge, at least."""


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


class Top(NamedTuple):
    """Where arms begin at the platform, whose lower face the tip is in: `half` the width of what they begin at, m,
    the platform itself at its sides, which is `tall`, or, with a height of zero, a block below it. There is room
    for a depth of `deep` m, `below` m down to the base, and `beside` m along the stack from the middle on, of which
    the blocks at its ends take `block`."""

    half: float
    tall: float
    deep: float
    below: float
    beside: float
    block: float


@dataclass
class Parts:
    """What a drive consists of: `hull` are boxes that hold it, each two opposite corners, `held` nodes that the ground
    holds, `tips` what the platform carries, `sign` whether that rises (1) or sinks (-1) where the stack gets longer."""

    sign: float
    nodes: dict[str, Point] = field(default_factory=dict)
    flexures: dict[str, Any] = field(default_factory=dict)
    links: dict[str, Any] = field(default_factory=dict)
    bodies: dict[str, Any] = field(default_factory=dict)
    instances: dict[str, Any] = field(default_factory=dict)
    stack: tuple[str, str] = ("stack_foot", "stack_head")
    held: tuple[str, ...] = ("stack_foot",)
    tips: tuple[str, ...] = ("tip",)
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


def _none(stack: Stack, material: str, *_: Any) -> Parts:
    """A stack under the rod, with a cap between."""
    own = Parts(1.0)
    top, e = _rod(own, material), stack.edge
    half, cap = ZERO + e / 2, top - e / 2
    own.nodes |= {"stack_head": _point(z=cap), "stack_foot": _point(z=cap - stack.length)}
    own.box("cap", (-half, -half, cap), (half, half, top), ["end", "stack_head"], material)
    own.hull.append(((-half, -half, cap - stack.length), (half, half, top)))
    return own


def _frame(stack: Stack, material: str, sizes: Container[str], top: Top | None = None) -> Parts:
    """A frame of two pairs of arms around a stack that lies along x, under a rod or at the platform; what it rises by
    is the way of both pairs. Without leaves arms bend all along. The stack is between the blocks that join the arms, or
    on seats of these."""
    own, e, is_straight = Parts(-1.0, stack=("stack_left", "stack_right"), held=()), stack.edge, "leaf" not in sizes
    web, offset, depth = map(_size, ("web", "offset", "depth"))
    seat = _size("seat") if "seat" in sizes else ZERO
    block = ZERO + (BRIDGE_BLOCK * e if top is None else top.block)
    wide = ZERO + _half_of(stack, top)
    at_sides = top is not None and top.tall > 0
    high = _rod(own, material) if top is None else ZERO
    root = _size("rise") if at_sides else high - web * 8  # of the upper arms, and of the lower ones
    if top is None:
        arms = web * (0.5 if is_straight else STOUT / 2) + offset * 0.5 + CLEAR * e  # height over the stack
        bottom = root - arms * 2 - offset - web * 8
    else:
        arms = (root - _size("foot") - offset + top.below) * 0.5
        bottom = ZERO - top.below
    centre, span, half = root - arms - offset * 0.5, seat + stack.length / 2, depth * 0.5
    bar = _size("bar") if "bar" in sizes else web * STOUT
    own.other["drive_quarter"] = _quarter(wide, arms, span, material, None if is_straight else bar)
    mirrors = [{"type": "mirror", "normal": "x"}, {"type": "mirror", "normal": "z", "point": [0, 0, str(centre)]}]
    own.instances["quarter"] = {"of": "drive_quarter", "at": [0, 0, str(centre)], "pattern": mirrors}
    ends = stack.length / 2
    own.nodes |= {"stack_left": _point(-ends, centre), "stack_right": _point(ends, centre)}
    outputs = ["quarter1.output", "quarter2.output"]
    own.tips = ("tip",) if top is None else tuple(outputs) if at_sides else ("output",)
    if not at_sides:
        carried = [*outputs, *(["end"] if top is None else [])]
        own.box("output", (-wide, -half, root - web * 2), (wide, half, high), carried, material)
    lower = centre - arms - offset * 0.5 + web * 2
    own.box("base", (-wide, -half, bottom), (wide, half, lower), ["quarter3.output", "quarter4.output"], material)
    own.bodies["base"]["held"] = {"face": "z-"}
    tall, thick = arms - offset * 0.5 + web * (4 if top is None else 2), ZERO + e / 2
    for name, sign, quarters in (("right", 1.0, (1, 3)), ("left", -1.0, (2, 4))):
        low, far = sorted((span * sign, (span + block) * sign), key=lambda own: sum(own.terms.values()) + own.fixed)
        carries = [f"quarter{k}.input" for k in quarters] + [f"stack_{name}"] * ("seat" not in sizes)
        own.box(name, (low, -half, centre - tall), (far, half, centre + tall), carries, material)
        if "seat" not in sizes:
            continue
        low, far = sorted((ZERO + sign * ends, span * sign), key=lambda own: sum(own.terms.values()))
        seat_of = (low, -thick, centre - thick), (far, thick, centre + thick)
        own.box(f"{name}_seat", *seat_of, [f"stack_{name}", name], material)
    own.hull.append(((-span - block, -half, bottom), (span + block, half, high)))
    if at_sides:
        own.hull += [
            ((wide, -half, ZERO), (span + block, half, root)),
            ((-span - block, -half, ZERO), (-wide, half, root)),
        ]
    return own


def _quarter(wide: Form, arms: Form, span: Form, material: str, bar: Form | None) -> dict[str, Any]:
    """A quarter of a frame of arms, from half the width of the output to half that of the stack and its seats; between
    leaves they are as thick as a bar."""
    leaf, offset = _size("leaf"), _size("offset")
    nodes = {"output": _point(wide, arms + offset * 0.5), "input": _point(span, arms - offset * 0.5)}
    own: dict[str, Any] = {}
    if bar is None:
        own["flexures"] = {"arm": _leaf(["output", "input"], material)}
    else:
        nodes |= {"inner": _point(leaf + wide, arms), "outer": _point(span - leaf, arms)}
        own["flexures"] = {
            "inner_leaf": {**_leaf(["output", "inner"], material), "end_offset": [0, 0, str(offset * 0.5)]},
            "outer_leaf": {**_leaf(["outer", "input"], material), "start_offset": [0, 0, str(offset * -0.5)]},
        }
        section = {"shape": "rectangle", "width": "drive_depth", "thickness": str(bar)}
        own["links"] = {
            "arm": {"nodes": ["inner", "outer"], "material": material, "reference": "z", "section": section}
        }
    placed = {name: list(map(str, point)) for name, point in nodes.items()}
    return {"nodes": placed, **own, "interface": ["output", "input"]}


def _lever(stack: Stack, material: str, *_: Any) -> Parts:
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
    return {"rod": _own(rod, 0.6, 1.2), "neck": Size(neck, thinnest, max(2.5 * neck, THICKEST_NECK * stack.edge))}


def _half_of(stack: Stack, top: Top | None) -> float:
    """Half the width of what arms begin at, m."""
    return BRIDGE_WIDTH * stack.edge / 2 if top is None else top.half


def bridge_ratio(sizes: Mapping[str, float], stack: Stack, top: Top | None = None) -> float:
    """How many times as far the output of a bridge moves as its stack gets longer."""
    run = stack.length / 2 + sizes.get("seat", 0.0) - _half_of(stack, top)
    web = sizes["web"]
    arms, thick = _reach_of(sizes["leaf"], run, web, sizes.get("bar", STOUT * web))
    return sizes["offset"] * arms / (sizes["offset"] ** 2 + thick**2)


def _reach_of(leaf: float, run: float, web: float, bar: float) -> tuple[float, float]:
    """l + a and g, m, of a bridge whose leaves and arms go so far."""
    arm = run - 2 * leaf
    return leaf + arm, float(web * np.sqrt((1 + web * arm / (2 * bar * leaf)) / (3 * STRIP)))


def rhombus_ratio(sizes: Mapping[str, float], stack: Stack, top: Top | None = None) -> float:
    """How many times as far the output of a rhombus moves as its stack gets longer."""
    run, rise = stack.length / 2 + sizes.get("seat", 0.0) - _half_of(stack, top), sizes["offset"]
    q = sizes["web"] ** 2 / (STRIP * (run**2 + rise**2))
    return (1 - q) * run * rise / (rise**2 + q * run**2)


def lever_ratio(sizes: Mapping[str, float], _: Stack, __: Top | None = None) -> float:
    """How many times as far the tip of a lever moves as its stack gets longer."""
    return sizes["out"] / sizes["in"]


def _none_sizes(
    stack: Stack, thinnest: float, rod: float, needed: float, _: Top | None = None
) -> Iterator[dict[str, Size]]:
    if needed <= 1.0:
        yield _common(stack, thinnest, rod)


SEATS = (0.0, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Of a stack between arms, over its edge."""


def _bridge_sizes(
    stack: Stack, thinnest: float, rod: float, needed: float, top: Top | None = None
) -> Iterator[dict[str, Size]]:
    """Bridges of the ratio that is wanted, the shortest first, and then shorter ones that still reach."""
    return _frame_sizes(stack, thinnest, rod, needed, top, is_straight=False)


def _rhombus_sizes(
    stack: Stack, thinnest: float, rod: float, needed: float, top: Top | None = None
) -> Iterator[dict[str, Size]]:
    """The same of arms that bend all along."""
    return _frame_sizes(stack, thinnest, rod, needed, top, is_straight=True)


def _frame_sizes(
    stack: Stack, thinnest: float, rod: float, needed: float, top: Top | None, is_straight: bool
) -> Iterator[dict[str, Size]]:
    e, wanted, half = stack.edge, SPARE * needed, _half_of(stack, top)
    web = max(1.2 * thinnest, 0.06 * e)
    found: list[tuple[float, dict[str, Size]]] = []
    for seat in e * np.array(SEATS):
        run = float(stack.length / 2 + seat - half)
        if top is None:
            most = min(0.6 * e, (0.4 * stack.length + 0.2 * e - half) / 2)
            leaf = Size(0.6 * most, 0.45 * most, most)
        else:
            leaf = Size(0.25 * run, 0.12 * run, 0.4 * run)
        if is_straight:
            arms, thick = run, web / np.sqrt(STRIP)
        else:
            arms, thick = _reach_of(leaf.value, run, web, STOUT * web)
        ratio = min(wanted, arms / (2 * thick))
        if ratio < needed:
            continue
        offset = float((arms + np.sqrt(max(arms**2 - 4 * (ratio * thick) ** 2, 0.0))) / (2 * ratio))
        deepest = max(1.25 * e, min(1.6 * e, leaf.least / SHORTEST_LEAF))
        sizes = {
            "web": Size(web, thinnest, 3 * web),
            "leaf": leaf,
            "offset": _own(offset, 0.4, 2.0),
            "depth": Size(1.2 * e, 1.05 * e, deepest),
        }
        if seat:
            sizes["seat"] = Size(float(seat), 0.5 * e, 1.5 * float(seat))
        sizes = _common(stack, thinnest, rod) | sizes if top is None else _at_platform(sizes, stack, top, is_straight)
        if is_straight:
            sizes.pop("leaf", None)
        if sizes:
            found.append((ratio, sizes))
            if ratio == wanted:
                break
    yield from (sizes for _, sizes in reversed(found))


def _at_platform(sizes: dict[str, Size], stack: Stack, top: Top, is_straight: bool) -> dict[str, Size]:
    """Sizes of arms that begin at the platform, so that whatever they are between their limits they are clear of the
    stack and in the room that there is; none where there is no room."""
    e, offset, web, seat = stack.edge, sizes["offset"], sizes["web"], sizes.get("seat", Size(0.0, 0.0, 0.0))
    if seat.value + top.block > top.beside - stack.length / 2:
        return {}
    for times, bar in product((3.0, 2.0, 1.5, 1.25), (0.0,) if is_straight else (5.0, 4.0, 3.0)):
        thick = times * web.value
        rise = 0.12 * top.tall if top.tall else -8 * thick
        over = max(thick, 1.25 * bar * web.value) / 2 + CLEAR * e
        most = (top.below + rise - 2 * thick) / 2 - over
        if most >= 1.2 * offset.value:
            break
    else:
        return {}
    most = min((most + 1.2 * offset.value) / 2, offset.most)
    highest = top.below + rise - 2 * (most + over)  # of the lower root
    lowest = max(2 * thick, highest - 2 * e)
    deepest = min(top.deep, 3 * e if is_straight else max(1.25 * e, sizes["leaf"].least / SHORTEST_LEAF))
    shallowest = min(1.05 * e, 0.9 * deepest)
    found = sizes | {
        "web": Size(web.value, web.least, thick),
        "offset": Size(offset.value, offset.least, most),
        "depth": Size((shallowest + deepest) / 2, shallowest, deepest),
        "foot": Size((lowest + highest) / 2, lowest, highest),
    }
    if bar:
        found["bar"] = Size(bar * web.value, min(2.0, bar) * web.value, 1.25 * bar * web.value)
    if seat.value:
        found["seat"] = Size(seat.value, seat.least, min(seat.most, top.beside - stack.length / 2 - top.block))
    if top.tall:
        found["rise"] = Size(
            0.3 * top.tall, rise, max(0.4 * top.tall, min(0.7 * top.tall, top.tall - over + CLEAR * e))
        )
    return found


def _lever_sizes(
    stack: Stack, thinnest: float, rod: float, needed: float, _: Top | None = None
) -> Iterator[dict[str, Size]]:
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
    parts: Callable[[Stack, str, Container[str], Top | None], Parts]
    sizes: Callable[[Stack, float, float, float, Top | None], Iterator[dict[str, Size]]]
    ratio: Callable[[Mapping[str, float], Stack, Top | None], float]
    is_mirrored: bool = True
    """Whether it is the same turned by half a turn about its axis."""
    holds: bool = False
    """Whether it may do without a rod and hold the platform."""


AMPLIFIERS = (
    Amplifier("none", _none, _none_sizes, lambda *_: 1.0),
    Amplifier("bridge", _frame, _bridge_sizes, bridge_ratio, holds=True),
    Amplifier("rhombus", _frame, _rhombus_sizes, rhombus_ratio, holds=True),
    Amplifier("lever", _lever, _lever_sizes, lever_ratio, is_mirrored=False),
)


def hull_of(parts: Parts, sizes: Mapping[str, float]) -> tuple[Array, Array]:
    """Boxes that hold a drive, m: middles (b, 3) and half edges (b, 3) in its frame."""
    ends = np.array([[[own.at(sizes) for own in corner] for corner in box] for box in parts.hull])
    return ends.mean(axis=1), np.ptp(ends, axis=1) / 2


def substructures(parts: Parts, stack: Stack, tips: Sequence[str]) -> dict[str, Any]:
    """A drive as the substructure `drive`, and those that it consists of; the platform carries its tips, or a lug."""
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
        "interface": [*tips, *parts.held],
    }
    return {**parts.other, "drive": {key: value for key, value in own.items() if value}}


@dataclass(frozen=True)
class Drive:
    """Equal stacks with amplifiers of one `kind` and their first `sizes`, in the room of a wish.

    Their tips are at `heads` (n, 3), m; columns of `frames` (n, 3, 3) are the axes in which they are drawn. They push
    at the platform, or at a `lug` of it, two opposite corners (3,) in these axes. All is in `boxes`, middles and half
    edges (b, 3) in these axes, the last one of which is the lug. From half their free stroke on they get longer by
    `shares` (n, f), m, for the wished strokes along `names`; all of these together take all that they have. `needed` is
    the ratio that this needs by kinematics. Where arms begin at the platform that is said by its `top`.
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
    top: Top | None = None

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
        return self.amplifier.ratio(self.drawn_first, self.stack, self.top)

    @property
    def without_force(self) -> Drive:
        """The same of stacks that give way: what of it holds the platform."""
        return replace(self, stack=self.stack._replace(stiffness=SLACK))

    @property
    def name(self) -> str:
        """In words, such as `3 piezo stacks with bridges`."""
        n = len(self.heads)
        several, whose = "s" * (n > 1), " that hold it" if n > 1 else " that holds it"
        added = "" if self.kind == "none" else f" with {_PLURALS[self.kind]}" if n > 1 else f" with a {self.kind}"
        return f"{n} piezo stack{several}{added}{'' if self.top is None else whose}"

    @property
    def name_alone(self) -> str:
        """In words where it holds the platform by itself, such as `1 bridge around a piezo stack`."""
        n = len(self.heads)
        return f"1 {self.kind} around a piezo stack" if n == 1 else f"{n} {_PLURALS[self.kind]} around piezo stacks"

    def away(self, points: Array, copies: Sequence[int] | None = None) -> float:
        """How near points (n, 3) come to the drives, or some of them, m; 0 within."""
        middles, halves = self.boxes
        of = np.arange(len(self.heads)) if copies is None else copies
        local = (points - self.heads[of, None]) @ self.frames[of]
        beyond = np.maximum(np.abs(local[:, :, None] - middles) - halves, 0.0)
        return float(np.sqrt((beyond**2).sum(axis=-1).min()))


SLACK = 1.0
"""Stiffness, N/m, of stacks that hold nothing."""

_PLURALS = {"bridge": "bridges", "rhombus": "rhombi", "lever": "levers"}
