"""Sixty descriptions of ordinary monoliths: of the gallery, of monoliths that were solved before, and random ones.

Each is drawn as a person would describe it: what is thicker than the members that end on it is a body with a solid,
arms are links, and what is bolted down is a body that carries a clamped node on its bolted face. Random sizes come from
a seed of their own for every mechanism, so that one can be changed without the others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import StringIO
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

import flexura as fx
from flexura.describe import (
    Box,
    Circle,
    CircularContour,
    CornerFilletedContour,
    Flexure,
    Leaf,
    Link,
    Notch,
    Rectangle,
    RigidBody,
    RoundNotch,
    Support,
)

Array = np.ndarray
MM = 1e-3
SEED = 60
METALS = ("Al-7075-T6", "17-4PH", "Ti-6Al-4V")
GALLERY = Path(fx.__file__).parent / "gallery"
X, Y, Z = np.eye(3)


@dataclass
class Drawing:
    """A mechanism while it is drawn, lengths in mm: members by their ends, boxes by their corners."""

    material: str
    words: str = ""
    nodes: dict[str, tuple[float, ...]] = field(default_factory=dict)
    members: dict[str, dict[str, Any]] = field(default_factory=lambda: {"flexures": {}, "links": {}})
    boxes: dict[str, tuple[Array, Array, str]] = field(default_factory=dict)
    ground: dict[str, Support] = field(default_factory=dict)

    def node(self, at: Sequence[float] | Array) -> str:
        """The node at a place, which is new unless there is one."""
        place = tuple(round(float(x), 9) for x in at)
        for name, known in self.nodes.items():
            if np.allclose(known, place, atol=1e-6):
                return name
        name = f"n{len(self.nodes) + 1}"
        self.nodes[name] = place
        return name

    def member(
        self, start: Array, end: Array, thin: Array | None, nodes: Sequence[Array | None] = (None, None), **own: Any
    ) -> None:
        """A member from `start` to `end`, on rigid arms from `nodes` where these are given."""
        ends = [np.asarray(p, float) for p in (start, end)]
        places = [p if q is None else np.asarray(q, float) for p, q in zip(ends, nodes, strict=True)]
        offsets = [tuple((MM * (p - q)).tolist()) for p, q in zip(ends, places, strict=True)]
        kind = "links" if "section" in own else "flexures"
        own |= {"nodes": tuple(self.node(q) for q in places), "material": self.material}
        if thin is not None:
            own["reference"] = tuple(map(float, thin))
        for key, offset in zip(("start_offset", "end_offset"), offsets, strict=True):
            if np.abs(offset).max() > 1e-12:
                own[key] = offset
        number = 1 + sum(len(group) for group in self.members.values())
        self.members[kind][f"{kind[:-1]}{number}"] = (Link if kind == "links" else Flexure)(**own)

    def leaf(
        self, start: Array, end: Array, b: float, t: float, thin: Array, nodes: Sequence[Any] = (None, None)
    ) -> None:
        """A leaf `b` wide and `t` thick along `thin`."""
        self.member(start, end, thin, nodes, profile=Leaf(width=MM * b, thickness=MM * t))

    def notch(self, start: Array, end: Array, b: float, t: float, thin: Array, fillet: float = 0.0) -> None:
        """A right-circular notch, or a leaf with fillets in its corners."""
        length = float(np.linalg.norm(np.subtract(end, start)))
        contour = (
            CornerFilletedContour(fillet_radius=MM * fillet, web=MM * t)
            if fillet
            else CircularContour(radius=MM * length / 2, web=MM * t)
        )
        self.member(start, end, thin, profile=Notch(width=MM * b, contour=contour), elements=20)

    def bar(self, start: Array, end: Array, b: float, t: float, thin: Array) -> None:
        """A link of rectangular section."""
        self.member(start, end, thin, section=Rectangle(width=MM * b, thickness=MM * t))

    def box(
        self, name: str, low: Sequence[float], high: Sequence[float], bolted: Array | None = None, on: str = ""
    ) -> None:
        """A body between two corners, bolted on the face towards `bolted`, or fixed to the body `on`."""
        low, high = np.asarray(low, float), np.asarray(high, float)
        self.boxes[name] = (low, high, on)
        if bolted is not None:
            node = self.node((low + high) / 2 + np.asarray(bolted) * (high - low) / 2)
            self.ground[node] = Support(fixed=fx.describe.DOF_NAMES)

    def mechanism(self, name: str) -> fx.Mechanism:
        """The mechanism: bodies carry the nodes on their faces."""
        carries: dict[str, list[str]] = {box: [] for box in self.boxes}
        for node, at in self.nodes.items():
            for box, (low, high, _) in self.boxes.items():
                if ((at > low - 1e-6) & (at < high + 1e-6)).all():
                    carries[box].append(node)
                    break
        for box, (_, _, on) in self.boxes.items():
            if on:
                carries[on].append(box)
        bodies = {
            box: RigidBody(
                centre=tuple((MM * (low + high) / 2).tolist()),
                solid=Box(size=tuple((MM * (high - low)).tolist()), material=self.material),
                carries=tuple(carries[box]),
            )
            for box, (low, high, _) in self.boxes.items()
        }
        nodes = {node: tuple(MM * x for x in at) for node, at in self.nodes.items()}
        return fx.Mechanism(
            name=name, description=self.words, nodes=nodes, bodies=bodies, ground=self.ground, **self.members
        )


def spread(rng: np.random.Generator, low: float, high: float) -> float:
    """A size between two, evenly in its logarithm, with two digits."""
    return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.2g}")


def metal(rng: np.random.Generator) -> Drawing:
    """An empty drawing of one of the metals."""
    return Drawing(str(rng.choice(METALS, p=(0.6, 0.25, 0.15))))


def leaf_sizes(
    rng: np.random.Generator, slender: tuple[float, float], broad: tuple[float, float]
) -> tuple[float, float, float]:
    """Length, width and thickness of a leaf by the ranges of L/t and b/t, mm, that a machine can make."""
    while True:
        t = spread(rng, 0.2, 1.2)
        L, b = t * spread(rng, *slender), t * spread(rng, *broad)
        if 3 <= L <= 80 and 2 <= b <= 30:
            return round(L, 2), round(b, 2), t


def thick(rng: np.random.Generator, t: float, span: float) -> float:
    """Thickness of a block: some leaf thicknesses, or a share of what it spans."""
    return round(t * rng.uniform(3, 10) if rng.random() < 0.5 else max(span * rng.uniform(0.2, 0.5), 3 * t), 2)


def beside(rng: np.random.Generator, t: float) -> float:
    """How far a block reaches beyond the leaf at its edge: not at all, or some thicknesses."""
    return 0.0 if rng.random() < 0.4 else round(t * spread(rng, 0.5, 8), 2)


def leaf_guide(rng: np.random.Generator, k: int) -> Drawing:
    """Two parallel leaves between a bolted block and a table; every fourth has its table drawn as a link."""
    d = metal(rng)
    ranges = ((5, 10), (10, 30), (30, 100))[k % 3]
    L, b, t = leaf_sizes(rng, ranges, ((3, 12), (12, 40))[k % 2])
    half = round(max(L * spread(rng, 0.15, 0.8), 4 * t), 2)
    base, table, edge = thick(rng, t, 2 * half), thick(rng, t, 2 * half), beside(rng, t)
    deeper = 0.0 if k % 4 else round(0.25 * b, 2)
    if k == 0:  # monolith B
        d, L, b, t, half, base, table, edge, deeper = Drawing(METALS[0]), 20.0, 12.0, 0.5, 12.75, 8.0, 8.0, 2.0, 0.0
    y, z = half + t / 2 + edge, b / 2 + deeper
    d.box("base", (-base, -y, -z), (0, y, z), bolted=-X)
    if k % 4 == 3:
        x = L + table / 2
        for s in (-1, 1):
            d.leaf((0, s * half, 0), (L, s * half, 0), b, t, Y, (None, (x, s * half, 0)))
            d.bar((x, s * half, 0), (x, s * (half + t / 2 + max(edge, t / 2)), 0), b, table, X)
        d.bar((x, -half, 0), (x, half, 0), b, table, X)
    else:
        d.box("table", (L, -y, -z), (L + table, y, z))
        for s in (-1, 1):
            d.leaf((0, s * half, 0), (L, s * half, 0), b, t, Y)
    d.words = f"L/t {L / t:.0f}, b/t {b / t:.0f}, table {table / t:.0f} t, block beyond {edge / t:.1f} t"
    return d


def notch_guide(rng: np.random.Generator, k: int, fillet: bool = False) -> Drawing:
    """Two arms, each with two notches, between a bolted block and a table."""
    d = metal(rng)
    t = spread(rng, 0.15, 0.8)
    R = min(max(t * spread(rng, 2, 30), 0.8), 8.0)
    b, stub, edge = spread(rng, 3, 20), (0.0, 3.0)[k % 2], beside(rng, t)
    length, r = 2 * R, 0.0
    if fillet:
        length, r = round(t * spread(rng, 5, 15), 2), round(t * spread(rng, 0.5, 2), 2)
    arm = t + 2 * (r if fillet else R)
    span = round(2 * (stub + length) + arm * spread(rng, 0.8, 6), 2)
    half = round(arm / 2 + max(1.0, span * rng.uniform(0.1, 0.5)), 2)
    base, table = thick(rng, arm / 2, 2 * half), thick(rng, arm / 3, 2 * half)
    if k == 0 and not fillet:  # monolith A
        d, t, R, b, stub, edge = Drawing(METALS[0]), 0.3, 3.0, 10.0, 3.0, 0.0
        length, arm, span, half, base, table = 6.0, 6.3, 40.0, 16.85, 10.0, 10.0
    y = half + arm / 2 + edge
    d.box("base", (-base, -y, -b / 2), (0, y, b / 2), bolted=-X)
    d.box("table", (span, -y, -b / 2), (span + table, y, b / 2))
    for s in (-1, 1):
        ends = (stub, stub + length, span - stub - length, span - stub)
        p = [np.array([x, s * half, 0.0]) for x in (0.0, *ends, span)]
        if stub:
            d.bar(p[0], p[1], b, arm, Y)
            d.bar(p[4], p[5], b, arm, Y)
        d.notch(p[1], p[2], b, t, Y, r)
        d.bar(p[2], p[3], b, arm, Y)
        d.notch(p[3], p[4], b, t, Y, r)
    own = f"L/t {length / t:.0f}, r/t {r / t:.1f}" if fillet else f"R/t {R / t:.0f}"
    d.words = f"{own}, b/t {b / t:.0f}, table {table / arm:.1f} arms thick, arm {span - 2 * stub - 2 * length:.0f} mm"
    return d


def filleted_guide(rng: np.random.Generator, k: int) -> Drawing:
    """Notches with fillets at the ends of arms, or leaves with fillets all the way."""
    if k % 2:
        return notch_guide(rng, k, fillet=True)
    d = metal(rng)
    L, b, t = leaf_sizes(rng, (10, 60), (5, 30))
    half, r = round(max(L * spread(rng, 0.2, 0.8), 5 * t), 2), round(t * spread(rng, 0.5, 2), 2)
    base, table, edge = thick(rng, t, 2 * half), thick(rng, t, 2 * half), beside(rng, t)
    y = half + t / 2 + r + edge
    d.box("base", (-base, -y, -b / 2), (0, y, b / 2), bolted=-X)
    d.box("table", (L, -y, -b / 2), (L + table, y, b / 2))
    for s in (-1, 1):
        d.notch((0, s * half, 0), (L, s * half, 0), b, t, Y, r)
    d.words = f"L/t {L / t:.0f}, b/t {b / t:.0f}, r/t {r / t:.1f}, table {table / t:.0f} t"
    return d


def folded_guide(rng: np.random.Generator, k: int) -> Drawing:
    """Leaves from bolted blocks to a truss and back to a stage, on one side or, every second, on both."""
    d = metal(rng)
    L, b, t = leaf_sizes(rng, ((8, 40), (30, 100))[k % 2], (4, 30))
    inner = round(max(L * spread(rng, 0.15, 0.5), 5 * t + 1), 2)
    outer = round(inner + max(8 * t, 2.5, inner * rng.uniform(0.3, 1)), 2)
    gap, edge = 0.4 * (outer - inner - t), beside(rng, t)
    truss, stage = thick(rng, t, 2 * outer), thick(rng, t, 2 * inner)
    both = bool(k % 2)
    stage = max(stage, 4.0) if both else stage
    side, reach = inner + t / 2 + min(edge, gap), outer + max(4 * t, 3.0)
    z = b / 2
    d.box("stage", (-stage, -side, -z), (0, side, z))
    for s, name in ((1, "upper"), (-1, "lower")):
        low, high = sorted((s * (outer - t / 2 - min(edge, 0.3 * gap)), s * reach))
        d.box(f"{name}_block", (-stage, low, -z), (0, high, z), bolted=s * Y)
    for sign, at in ((1, 0.0), (-1, -stage))[: 1 + both]:
        end = at + sign * L
        low, high = sorted((end, end + sign * truss))
        d.box("truss" if sign > 0 else "other_truss", (low, -outer - t / 2 - edge, -z), (high, outer + t / 2 + edge, z))
        for y in (inner, -inner, outer, -outer):
            d.leaf((at, y, 0), (end, y, 0), b, t, Y)
    d.words = f"L/t {L / t:.0f}, b/t {b / t:.0f}, truss {truss / t:.0f} t, {'both sides' if both else 'one side'}"
    return d


def cross_pivot(rng: np.random.Generator, k: int) -> Drawing:
    """Leaves that cross beside each other, two or, every second, three."""
    d = metal(rng)
    L, b, t = leaf_sizes(rng, ((8, 25), (25, 80))[k // 2 % 2], (4, 15))
    angle, gap = np.radians(rng.uniform(25, 50)), 1.0
    run, rise = L / 2 * np.sin(angle), L * np.cos(angle)
    layers = (
        [(b / 2 + gap + b / 4, b / 2, 1), (-b / 2 - gap - b / 4, b / 2, 1), (0.0, b, -1)]
        if k % 2
        else [((b + gap) / 2, b, 1), (-(b + gap) / 2, b, -1)]
    )
    z = max(abs(at) + width / 2 for at, width, _ in layers)
    x, base, table = run + t / np.cos(angle) + rng.uniform(0, 3), thick(rng, t, 2 * run), thick(rng, t, 2 * run)
    d.box("base", (-x, -base, -z), (x, 0, z), bolted=-Y)
    d.box("table", (-x, rise, -z), (x, rise + table, z))
    for at, width, s in layers:
        d.leaf((-s * run, 0, at), (s * run, rise, at), width, t, Y)
    d.words = f"L/t {L / t:.0f}, b/t {b / t:.0f}, {len(layers)} leaves, table {table / t:.0f} t"
    return d


def angle_pivot(rng: np.random.Generator, _: int) -> Drawing:
    """Two leaves that lean towards each other, of one plane."""
    d = metal(rng)
    L, b, t = leaf_sizes(rng, (8, 60), (5, 30))
    angle = np.radians(rng.uniform(12, 35))
    run, rise = L * np.sin(angle), L * np.cos(angle)
    near = max(run * rng.uniform(0.2, 1), 3 * t)
    base, table = thick(rng, t, 2 * (near + run)), thick(rng, t, 2 * near)
    wide = t / np.cos(angle) + rng.uniform(0, 3)
    d.box("base", (-near - run - wide, -base, -b / 2), (near + run + wide, 0, b / 2), bolted=-Y)
    d.box("table", (-near - wide, rise, -b / 2), (near + wide, rise + table, b / 2))
    for s in (-1, 1):
        d.leaf((s * (near + run), 0, 0), (s * near, rise, 0), b, t, Y)
    d.words = f"L/t {L / t:.0f}, b/t {b / t:.0f}, {np.degrees(angle):.0f} deg, table {table / t:.0f} t"
    return d


def lever(rng: np.random.Generator, k: int) -> Drawing:
    """A lever on two notches: its fulcrum, and one from a cap that every second has guided by two leaves."""
    d = metal(rng)
    t = spread(rng, 0.3, 0.9)
    R = min(max(t * spread(rng, 2, 12), 1.0), 4.0)
    b, high, wide = spread(rng, 4, 15), spread(rng, 4, 12), 2 * R + t
    arm = round(wide + 1.5 + rng.uniform(0, 4), 2)
    out, cap = round(arm * spread(rng, 2.5, 6), 2), 10.0
    tall = spread(rng, 6, 30)
    d.box("frame", (-wide / 2 - 2, -tall, -b / 2), (wide / 2 + 0.5, 0, b / 2), bolted=-Y)
    d.box("cap", (arm - wide / 2, -cap, -b / 2), (arm + wide / 2, 0, b / 2))
    d.box("heel", (-wide / 2, 2 * R, -b / 2), (arm + wide / 2, 2 * R + high, b / 2))
    d.notch((0, 0, 0), (0, 2 * R, 0), b, t, X)
    d.notch((arm, 0, 0), (arm, 2 * R, 0), b, t, X)
    middle = 2 * R + high / 2
    d.bar((arm + wide / 2, middle, 0), (out, middle, 0), b, high if k % 3 else high / 2, Y)
    if k % 3 == 2:
        d.box("tip", (out, middle - high, -b / 2), (out + 6, middle + high, b / 2))
    guide = ""
    if k % 2:
        leaf = spread(rng, 0.3, 0.6)
        length = round(leaf * rng.uniform(12, 40), 2)
        x = arm + wide / 2
        d.box("side", (x + length, -cap, -b / 2), (x + length + 5, 0, b / 2), bolted=X)
        for y in (-1.5, -cap + 1.5):
            d.leaf((x, y, 0), (x + length, y, 0), b, leaf, Y)
        guide = f", guided by leaves of L/t {length / leaf:.0f}"
    d.words = f"R/t {R / t:.0f}, b/t {b / t:.0f}, ratio {out / arm:.1f}{guide}"
    return d


def quarters() -> Iterator[Callable[[float, float], Array]]:
    """Places of four mirror images in the plane."""
    for sx, sy in product((1, -1), repeat=2):
        yield lambda x, y, sx=sx, sy=sy: np.array([sx * x, sy * y, 0.0])


def bridge(rng: np.random.Generator, k: int) -> Drawing:
    """A bridge of arms between leaves at two heights; its base is bolted, its other blocks are free."""
    d = metal(rng)
    L, b, t = leaf_sizes(rng, ((5, 9), (9, 20))[k % 2], (6, 25))
    arm, height = spread(rng, 5, 25), round(t * rng.uniform(4, 8), 2)
    offset = round(rng.uniform(0.3, 1) * (height - t), 2)
    half, middle = spread(rng, 3, 6), round(height / 2 + rng.uniform(3, 7), 2)
    end, block, edge = thick(rng, t, 2 * middle), thick(rng, t, 2 * half), beside(rng, t)
    a, c = half + L, half + L + arm
    span = c + L
    inner, outer = middle + offset / 2, middle - offset / 2
    for s, name in ((1, "output"), (-1, "base")):
        low, high = sorted((s * (inner - t / 2 - edge), s * (inner + t / 2 + block)))
        d.box(name, (-half, low, -b / 2), (half, high, b / 2), bolted=-Y if s < 0 else None)
    for s, name in ((1, "right"), (-1, "left")):
        low, high = sorted((s * span, s * (span + end)))
        d.box(name, (low, -outer - t / 2 - edge, -b / 2), (high, outer + t / 2 + edge, b / 2))
    for at in quarters():
        d.leaf(at(half, inner), at(a, inner), b, t, Y, (None, at(a, middle)))
        d.bar(at(a, middle), at(c, middle), b, height, Y)
        d.leaf(at(c, outer), at(span, outer), b, t, Y, (at(c, middle), None))
    d.words = (
        f"L/t {L / t:.0f}, b/t {b / t:.0f}, arms {height / t:.0f} t, offset {offset / t:.1f} t, blocks {end / t:.0f} t"
    )
    return d


def rhombic(rng: np.random.Generator, k: int) -> Drawing:
    """A frame of four inclined arms that bend along their length."""
    d = metal(rng)
    L, b, t = leaf_sizes(rng, ((10, 20), (20, 50))[k % 2], (5, 25))
    angle = np.radians(rng.uniform(5, 15))
    half, low = spread(rng, 3, 8), round(rng.uniform(2, 5), 2)
    high, span = low + L * np.sin(angle), half + L * np.cos(angle)
    end, block = thick(rng, t, 2 * low), thick(rng, t, 2 * half)
    lip = round(2 * t, 2)
    for s, name in ((1, "output"), (-1, "base")):
        bottom, top = sorted((s * (high - lip), s * (high + lip + block)))
        d.box(name, (-half, bottom, -b / 2), (half, top, b / 2), bolted=-Y if s < 0 else None)
    for s, name in ((1, "right"), (-1, "left")):
        near, far = sorted((s * span, s * (span + end)))
        d.box(name, (near, -low - lip, -b / 2), (far, low + lip, b / 2))
    for at in quarters():
        d.leaf(at(half, high), at(span, low), b, t, Y)
    d.words = f"L/t {L / t:.0f}, b/t {b / t:.0f}, {np.degrees(angle):.0f} deg, blocks {end / t:.0f} t"
    return d


def four_bar(rng: np.random.Generator, k: int) -> Drawing:
    """A coupler on two cranks of unlike length: notches at the ends of bars, or leaves."""
    d = metal(rng)
    t = spread(rng, 0.3, 0.8)
    R = min(max(t * spread(rng, 2, 12), 1.0), 4.0)
    b, wide = spread(rng, 5, 15), 2 * R + t
    first = round(4 * R + spread(rng, 5, 30), 2)
    second = round(4 * R + (first - 4 * R) * rng.uniform(0.3, 0.7), 2)
    apart, step = round(wide + 2 + rng.uniform(2, 30), 2), first - second
    base, coupler = thick(rng, wide / 3, apart), thick(rng, wide / 3, apart)
    d.box("base", (-wide / 2 - 1, -base, -b / 2), (apart + wide / 2 + 1, 0, b / 2), bolted=-Y)
    d.box("step", (apart - wide / 2 - 0.5, 0, -b / 2), (apart + wide / 2 + 1, step, b / 2), on="base")
    d.box("coupler", (-wide / 2 - 1, first, -b / 2), (apart + wide / 2 + 1, first + coupler, b / 2))
    for x, low in ((0.0, 0.0), (apart, step)):
        if k % 3 == 2:
            d.leaf((x, low, 0), (x, first, 0), b, t, X)
            continue
        p = [np.array([x, y, 0.0]) for y in (low, low + 2 * R, first - 2 * R, first)]
        d.notch(p[0], p[1], b, t, X)
        d.bar(p[1], p[2], b, wide, X)
        d.notch(p[2], p[3], b, t, X)
    own = f"leaves of L/t {second / t:.0f} and {first / t:.0f}" if k % 3 == 2 else f"R/t {R / t:.0f}"
    d.words = f"{own}, b/t {b / t:.0f}, cranks {second:.0f} and {first:.0f} mm, coupler {coupler:.1f} mm"
    return d


def hexapod(rng: np.random.Generator, k: int) -> Drawing:
    """A plate on six struts: rods, rods with necks at their ends, leaves."""
    d = metal(rng)
    size = spread(rng, 0.8, 2.5)
    L = round(size * spread(rng, 12, 30), 1)
    base, top = round(L * rng.uniform(0.5, 0.8), 1), round(L * rng.uniform(0.4, 0.6), 1)
    ways = np.radians([[20, 40], [100, 80], [140, 160], [220, 200], [260, 280], [340, 320]])
    feet, heads = (
        radius * np.stack([np.cos(a), np.sin(a)], axis=-1) for radius, a in zip((base, top), ways.T, strict=True)
    )
    high = float(np.sqrt(L**2 - ((heads - feet) ** 2).sum(axis=1).max()))
    plate = round(size * rng.uniform(3, 6), 1)
    for name, own, low in (("base", base, -plate), ("table", top, high)):
        half = own + 2 * size
        d.box(name, (-half, -half, low), (half, half, low + plate), bolted=-Z if name == "base" else None)
    for a, c in zip(feet, heads, strict=True):
        p, q = np.array([*a, 0.0]), np.array([*c, high])
        if k == 2:
            d.leaf(p, q, 4 * size / 2, size / 2, np.array([*a, 0.0]))
            continue
        if k == 1:
            neck = (q - p) / np.linalg.norm(q - p) * size
            contour = CircularContour(radius=MM * size / 2, web=MM * 0.4 * size)
            for start, end in ((p, p + neck), (q - neck, q)):
                d.member(start, end, None, profile=RoundNotch(contour=contour), elements=20)
            p, q = p + neck, q - neck
        thickness = 1.8 * size if k == 1 else size
        d.member(p, q, None, section=Circle(diameter=MM * thickness), elements=8)
    own = ("rods", "rods with necks", "leaves")[k]
    d.words = f"{own}, L/d {L / (size / 2 if k == 2 else size):.0f}, plate {plate / size:.1f} d"
    return d


def three_leaves(rng: np.random.Generator, k: int) -> Drawing:
    """A plate that tips, tilts and goes up and down on three leaves in its plane, radial or tangential."""
    d = metal(rng)
    L, b, t = leaf_sizes(rng, (20, 80), (4, 20))
    half, plate = round(max(0.7 * b, 5, L * rng.uniform(0.3, 0.7)), 2), round(t * rng.uniform(4, 12), 2)
    lift = 0.0 if k % 2 else round((plate - t) / 2, 2)
    z = plate / 2
    d.box("plate", (-half, -half, -z - lift), (half, half, z - lift))
    block = round(max(plate, 3.0), 2)
    for n, (out, along) in enumerate(((X, Y), (Y, -X), (-Y, X))):
        if k % 2 == 0:
            p, q = half * out, (half + L) * out
            across = np.abs(along) * b / 2
            ends = [q - across, q + block * out + across]
            hold = out
        else:
            lug = half * out + (b / 2 + 0.5) * out - half * along
            corners = [half * out - half * along, (half + b + 1) * out - half * along + 4 * along]
            d.box(f"lug{n + 1}", np.min(corners, axis=0) - z * Z, np.max(corners, axis=0) + z * Z, on="plate")
            p, q = lug, lug - L * along
            across = np.abs(out) * (b / 2 + 0.5)
            ends = [q - across, q - block * along + across]
            hold = -along
        low, high = np.min(ends, axis=0) - block / 2 * Z, np.max(ends, axis=0) + block / 2 * Z
        d.box(f"block{n + 1}", low, high, bolted=hold)
        d.leaf(p, q, b, t, Z)
    d.words = f"L/t {L / t:.0f}, b/t {b / t:.0f}, plate {plate / t:.0f} t, {('radial', 'tangential')[k % 2]}"
    return d


FAMILIES: dict[str, tuple[Callable[[np.random.Generator, int], Drawing], int]] = {
    "leaf guide": (leaf_guide, 8),
    "notch guide": (notch_guide, 6),
    "filleted guide": (filleted_guide, 4),
    "folded guide": (folded_guide, 4),
    "cross pivot": (cross_pivot, 4),
    "angle pivot": (angle_pivot, 3),
    "notch lever": (lever, 4),
    "bridge": (bridge, 4),
    "rhombic": (rhombic, 3),
    "four-bar": (four_bar, 3),
    "hexapod": (hexapod, 3),
    "three leaves": (three_leaves, 2),
}
"""What draws each family, and how many of it there are."""

BOLTED: Mapping[str, str] = {
    "bridge": """
        nodes: {bolts: [0, 0, -half_height - 5 mm]}
        bodies: {base: {carries: [quarter3.output, quarter4.output, bolts]}}
    """,
    "bridge_lever": """
        nodes: {bolts: [0, 0, -input_arm - 6 mm]}
        bodies: {frame: {carries: ["side*.fulcrum.near", bolts]}}
    """,
    "rhombic": """
        nodes: {bolts: [0, 0, -top - 4 mm]}
        bodies: {base: {carries: [quarter3.output, quarter4.output, bolts]}}
    """,
    "lever": """
        nodes: {bolts: [-1 mm, 0, 0], stack_foot: null}
        bodies: {frame: {carries: [fulcrum.bottom, bolts]}}
    """,
    "gripper": """
        nodes: {bolts: [0, 0, -10 mm]}
        bodies: {frame: {carries: [stack_foot, right_post, left_post, bolts]}}
    """,
    "parallelogram": """
        nodes: {bolts: [0, 0, -height]}
        bodies:
          base: {centre: [0, 0, -height/2], carries: ["leaf*.foot", bolts],
                 solid: {shape: box, size: [distance + 10 mm, width, height], material: Al-6061-T6}}
    """,
    "double_parallelogram": """
        nodes: {bolts: [-outer/2, 0, -height], more_bolts: [outer/2, 0, -height]}
        bodies:
          left: {centre: [-outer/2, 0, -height/2], carries: [of_ground1.low, bolts],
                 solid: &block {shape: box, size: [12 mm, width, height], material: Al-7075-T6}}
          right: {centre: [outer/2, 0, -height/2], carries: [of_ground2.low, more_bolts], solid: *block}
    """,
    "folded_parallelogram": """
        nodes: {bolts: [outer/2 + 6 mm, 0, 0], more_bolts: [-outer/2 - 6 mm, 0, 0]}
        bodies:
          right: {centre: [outer/2 + 2 mm, 0, 0], carries: ["side*.outer_leaf1.low", bolts],
                  solid: &block {shape: box, size: [8 mm, width, shuttle], material: Ti-6Al-4V}}
          left: {centre: [-outer/2 - 2 mm, 0, 0], carries: ["side*.outer_leaf2.low", more_bolts], solid: *block}
    """,
    "cross_spring": """
        nodes: {bolts: [0, 0, -rise - 10 mm]}
        bodies:
          block: {centre: [0, gap/2, rise + 5 mm],
                  solid: {shape: box, size: [2*run + 10 mm, pack + gap, 10 mm], material: 17-4PH}}
          table: {centre: [0, pack/2 + gap + 4 mm, 0]}
          base: {centre: [0, 0, -rise - 5 mm], carries: ["*.foot", bolts],
                 solid: {shape: box, size: [2*run + 10 mm, pack, 10 mm], material: 17-4PH}}
    """,
    "xy_parallel": """
        corrections: auto
        substructures:
          side:
            nodes: {bolts: [table/2 + length + block/2, block/2 + length + 10 mm, 0]}
            bodies:
              fixed: {centre: [table/2 + length + block/2, block/2 + length + 5 mm, 0],
                      solid: {shape: box, size: [block, 10 mm, width], material: Al-7075-T6},
                      carries: [outer.tip_low, outer.tip_high, bolts]}
            interface: [inner.root_low, inner.root_high, bolts, block]
        ground: {"side*.bolts": clamped}
    """,
    "z_stage": """
        substructures:
          leaf:
            nodes: {bolts: [radius, -length - 5 mm, half_height]}
            bodies:
              lug: {centre: [radius - 1 mm, 2 mm, half_height],
                    solid: {shape: box, size: [width + 3 mm, 4 mm, 4 mm], material: Al-6061-T6}}
              fixed: {centre: [radius, -length - 2.5 mm, half_height], carries: [foot, bolts],
                      solid: {shape: box, size: [width + 1 mm, 5 mm, 4 mm], material: spring-steel}}
            interface: [bolts, lug]
        ground: {"leaf*.bolts": clamped}
    """,
    "tip_tilt": """
        substructures:
          wire:
            nodes: {bolts: [radius, -wire_length - 4 mm, 0]}
            bodies:
              lug: {centre: [radius - 1 mm, 2 mm, plate/2 - 1 mm],
                    solid: {shape: box, size: [6 mm, 4 mm, plate], material: Al-6061-T6}}
              fixed: {centre: [radius, -wire_length - 2 mm, 0], carries: [foot, bolts],
                      solid: {shape: box, size: [4 mm, 4 mm, 4 mm], material: spring-steel}}
            interface: [bolts, lug]
        nodes: {bolts: [0, 0, -rod_length - 5 mm]}
        bodies:
          fixed: {centre: [0, 0, -rod_length - 2.5 mm], carries: [foot, bolts],
                  solid: {shape: box, size: [10 mm, 10 mm, 5 mm], material: spring-steel}}
        ground: {bolts: clamped, "wire*.bolts": clamped}
    """,
}
"""What is laid over files of the gallery: what they are bolted to, drawn."""

NO_SOLID = ("actuators", "sensors", "motion", "studies", "published", "damping", "masses")


def of_gallery(name: str) -> fx.Mechanism:
    """A mechanism of the gallery without its stack, on a block that is bolted down."""
    yaml = YAML(typ="safe")
    text = yaml.load(GALLERY / f"{name}.yaml")
    for key in NO_SOLID:
        text.pop(key, None)
    over = yaml.load(BOLTED[name])
    held = {node: "clamped" for node in over.get("nodes", {}) if node.endswith("bolts")}
    text["ground"] = over.pop("ground", held)
    lay_over(text, over)
    into = StringIO()
    yaml.dump(text, into)
    return fx.loads(into.getvalue())


def lay_over(text: dict[str, Any], over: Mapping[str, Any]) -> None:
    """Put entries into a mapping, level by level; null takes one out."""
    for key, value in over.items():
        if value is None:
            del text[key]
        elif isinstance(value, Mapping) and isinstance(text.get(key), dict):
            lay_over(text[key], value)
        else:
            text[key] = value


def mechanisms() -> dict[str, tuple[str, Callable[[], fx.Mechanism]]]:
    """Family and maker of every mechanism, by name."""
    found: dict[str, tuple[str, Callable[[], fx.Mechanism]]] = {}
    for name in BOLTED:
        found[name] = ("gallery", lambda name=name: of_gallery(name))
    for number, (family, (draw, count)) in enumerate(FAMILIES.items()):
        for k in range(count):
            name = f"{family.replace(' ', '_').replace('-', '_')}_{k + 1}"

            def make(draw: Any = draw, number: int = number, k: int = k, name: str = name) -> fx.Mechanism:
                return draw(np.random.default_rng([SEED, number, k]), k).mechanism(name)

            found[name] = (family, make)
    return found
