"""Solids that overlap, touch, or do not reach what they carry, as a person would see in a drawing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.convex import crossed, overlapping_bounds, separations, shared
from flexura.structure import ROUND, Bars, Bodies, FullOrderModel
from flexura.tables import quantity
from flexura.thresholds import SAME_PLACE

SHALLOW = 1e-3
"""Depth of an overlap over the smaller part's least size up to which the parts touch rather than overlap."""

TWICE = 0.01
"""Share of the smaller of two bodies on one rigid cluster that may lie in the other."""

REACH = 1.2
"""Members that meet at an angle may overlap so many times as far along their axes as their outlines ask for."""

LEAST_TRIM = 0.005
"""Share of a member's length, at least, that is left out where it is joined."""

PARALLEL = 0.17
"""Sine of the angle between two members below which they lie side by side: less of each is left out where they meet."""

MOST_PAIRS, MOST_NEAR, MOST_PIECES, MOST_CLASHES = 40_000_000, 300_000, 100_000, 200
"""Pairs of parts side by side, of those with bounds that meet, and of convex pieces of these, that are looked at, and
clashes after which no more are looked for."""


@dataclass(frozen=True)
class Clash:
    """Two parts that cannot be where they are: kind `clash`, `deep`, `touch` or `gap`.

    first, second: their names; volume, m^3, that they share, or the gap between them, m; at: where, m; text: what is
    said of the first; copies: of the same two parts in other instances, that clash alike.
    """

    kind: str
    first: str
    second: str
    volume: float
    gap: float
    at: tuple[float, float, float]
    text: str
    copies: tuple[tuple[str, str], ...] = ()

    @property
    def parts(self) -> set[str]:
        """Names of all parts that clash so."""
        return {self.first, self.second, *(name for pair in self.copies for name in pair)}


class _Tests(NamedTuple):
    """What is to be told apart of a kind: pairs (t, 2) of parts, members by number and bodies behind these, and of
    members the fractions (t, 2, 2) of their length, or their axes alone."""

    pairs: Index
    spans: Array
    kind: int
    axis_only: bool = False


_APART, _MEETING, _CARRIED, _RIGID = range(4)
"""Parts that nothing joins; members that meet; a member and the body on which it ends; bodies of one cluster."""


def clashes(model: FullOrderModel, bars: Bars, bodies: Bodies) -> tuple[list[Clash], str]:
    """Every pair of members and bodies that share space, and members that end outside the body that carries them.

    Members that meet may overlap where they do: along each axis, from the joined end, by REACH times what their
    outlines ask for at the angle between them, and the smaller depth, but never over more than three quarters of its
    length, or 45 % where they are parallel. A member may lie in the body on which it ends by its own least depth there,
    along its axis, and, where the section pokes into a surface that it meets at an angle, by the larger half size more.
    All else that overlaps is said, and touching parts that nothing joins, or members that meet. Second, words on what
    was not looked at, empty when all was.
    """
    n = len(bars.names)
    if n + len(bodies.names) == 0:
        return [], ""
    every = np.arange(n)
    whole = np.broadcast_to([0.0, 1.0], (n, 2))
    hulls = np.concatenate([bars.boxes(every, whole, bars.half), bodies.boxes(np.arange(len(bodies.names)))])
    low, high = hulls.min(axis=1), hulls.max(axis=1)
    margin = 1e-6 * np.minimum(high - low, 1.0).max(axis=1, keepdims=True)
    pairs = overlapping_bounds(low - margin, high + margin, MOST_PAIRS)
    gaps = _gaps(model, bars, bodies)
    if pairs is None or len(pairs) > MOST_NEAR:
        return _alike(gaps), "so many parts lie side by side that overlaps were not looked for"
    overlaps, left = _Looker(bars, bodies, hulls, [*_tests(bars, bodies, pairs)]).clashes()
    unseen = f"{left} more pairs of parts, whose bounds overlap, were not looked at" if left else ""
    return _alike([*overlaps, *gaps]), unseen


def _tests(bars: Bars, bodies: Bodies, pairs: Index) -> Iterator[_Tests]:
    """The tests that pairs of parts (p, 2), members first, call for."""

    def whole(pairs: Index) -> Array:
        return np.broadcast_to([0.0, 1.0], (len(pairs), 2, 2))

    n = len(bars.names)
    is_body = pairs >= n
    members = pairs[~is_body.any(axis=1)]
    joined = bars.clusters[members[:, 0], :, None] == bars.clusters[members[:, 1], None, :]
    meets = joined.any(axis=(1, 2))
    yield _Tests(members[~meets], whole(members[~meets]), _APART)
    yield _Tests(members[meets], _spans(bars, members[meets], joined[meets]), _MEETING)
    mixed = pairs[is_body.sum(axis=1) == 1]
    ends = bars.clusters[mixed[:, 0]] == bodies.clusters[mixed[:, 1] - n, None]
    carried = ends.any(axis=1)
    yield _Tests(mixed[~carried], whole(mixed[~carried]), _APART)
    resting, is_joined = mixed[carried], ends[carried]
    half = bars.end_half[resting[:, 0]]
    for depth, axis_only in ((2 * half.min(axis=1), True), (2 * half.min(axis=1) + half.max(axis=1), False)):
        trim = np.maximum(depth / bars.length[resting[:, 0], None], LEAST_TRIM)
        spans = whole(resting).copy()
        spans[:, 0] = _trimmed(np.where(is_joined, trim, 0.0))
        yield _Tests(resting, spans, _CARRIED, axis_only)
    rigid = pairs[is_body.all(axis=1)]
    one = bodies.clusters[rigid[:, 0] - n] == bodies.clusters[rigid[:, 1] - n]
    yield _Tests(rigid[~one], whole(rigid[~one]), _APART)
    yield _Tests(rigid[one], whole(rigid[one]), _RIGID)


def _trimmed(trim: Array, most: Array | float = 0.5) -> Array:
    """Spans (p, 2) of members without so much, fractions (p, 2), at each end, but never more than `most`, (p,)."""
    return np.minimum(trim, np.reshape(most, (-1, 1))) * [1.0, -1.0] + [0.0, 1.0]


def _spans(bars: Bars, pairs: Index, joined: NDArray[np.bool_]) -> Array:
    """Spans (p, 2, 2) of members that meet, without the neighbourhoods of the ends that are `joined` (p, 2, 2)."""
    ends = np.stack([bars.end(0), bars.end(1)], axis=1)
    axes = bars.axes[pairs]
    x = axes[:, :, 0]
    normal = np.cross(x[:, 0], x[:, 1])
    sine = np.linalg.norm(normal, axis=1)
    cosine = np.abs(np.einsum("pi,pi->p", x[:, 0], x[:, 1]))
    trims = np.zeros((len(pairs), 2, 2))
    for one in (0, 1):
        for other in (0, 1):
            at = joined[:, one, other]
            half = np.stack([bars.end_half[pairs[:, 0], :, one], bars.end_half[pairs[:, 1], :, other]], axis=1)
            apart = np.linalg.norm(ends[pairs[:, 0], one] - ends[pairs[:, 1], other], axis=1)
            depth = 2 * half.min(axis=(1, 2))
            outline = _in_plane(axes, normal, half)
            wanted = (outline[:, ::-1] + outline * cosine[:, None]) / np.maximum(sine, 1e-6)[:, None]
            near = apart <= outline.sum(axis=1)
            overlap = np.where(near[:, None], REACH * wanted, 0.0) + depth[:, None]
            share = np.where(at[:, None], np.maximum(overlap / bars.length[pairs], LEAST_TRIM), 0.0)
            trims[:, 0, one] = np.maximum(trims[:, 0, one], share[:, 0])
            trims[:, 1, other] = np.maximum(trims[:, 1, other], share[:, 1])
    most = np.where(sine > PARALLEL, 0.75, 0.45)
    return np.stack([_trimmed(trims[:, 0], most), _trimmed(trims[:, 1], most)], axis=1)


def _in_plane(axes: Array, normal: Array, half: Array) -> Array:
    """Half sizes (p, 2), m, of two sections, half (p, 2, 2), across their axes in the plane of both axes."""
    across = np.cross(normal[:, None], axes[:, :, 0])
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    across = np.divide(across, length, out=np.zeros_like(across), where=length > 1e-9)
    return np.einsum("pmk,pmk->pm", np.abs(np.einsum("pmki,pmi->pmk", axes[:, :, 1:], across)), half)


class _Looker:
    """Looks at pairs of parts, first at the boxes around them and then at their convex pieces."""

    def __init__(self, bars: Bars, bodies: Bodies, hulls: Array, tests: Sequence[_Tests]) -> None:
        self._bars, self._bodies, self._hulls, self._n = bars, bodies, hulls, len(bars.names)
        self._pairs = np.concatenate([own.pairs for own in tests])
        self._spans = np.concatenate([own.spans for own in tests])
        counts = [len(own.pairs) for own in tests]
        self._kinds = np.repeat([own.kind for own in tests], counts)
        self._axis_only = np.repeat([own.axis_only for own in tests], counts)
        self._looked = 0
        self._size = np.concatenate([2 * bars.half.min(axis=1), 2 * bodies.half.min(axis=1)])
        self._names, self._labels = [*bars.names, *bodies.names], [*bars.labels, *bodies.labels]

    def clashes(self) -> tuple[list[Clash], int]:
        """What clashes, and how many pairs were left out for the budget of pieces."""
        flush = SAME_PLACE * self._size[self._pairs].min(axis=1)
        solid = (self._spans[:, :, 1] > self._spans[:, :, 0]).all(axis=1)
        near = np.flatnonzero(solid)
        near = near[separations(self._boxes(near, 0), self._boxes(near, 1), are_boxes=True) <= flush[near]]
        found: dict[tuple[int, int], Clash] = {}
        left = 0
        for t in near:
            if self._looked >= MOST_PIECES or len(found) >= MOST_CLASHES:
                left += 1
                continue
            clash = self._clash(t, self._pieces(t, 0), self._pieces(t, 1), flush[t])
            i, j = self._pairs[t]
            if clash is not None and (i, j) not in found:
                found[i, j] = clash
        return list(found.values()), left

    def _scale(self, part: int) -> float:
        """What a volume that a part shares is larger by than that of its polygons."""
        bars, n = self._bars, self._n
        is_round = bars.lofts[bars.group[part]].is_round if part < n else self._bodies.is_round[part - n]
        return ROUND if is_round else 1.0

    def _boxes(self, tests: Index, which: int) -> Array:
        part, bars = self._pairs[tests, which], self._bars
        corners = self._hulls[part]
        member = part < self._n
        bar = part[member]
        half = np.where(self._axis_only[tests[member], None], 1e-3 * bars.half[bar], bars.half[bar])
        corners[member] = bars.boxes(bar, self._spans[tests[member], which], half)
        return corners

    def _pieces(self, t: int, which: int) -> Array:
        part = int(self._pairs[t, which])
        if part >= self._n:
            return self._bodies.pieces(part - self._n)
        if self._axis_only[t]:
            return self._boxes(np.array([t]), which)
        return self._bars.pieces(part, *map(float, self._spans[t, which]))

    def _clash(self, t: int, first: Array, second: Array, flush: float) -> Clash | None:
        low = [piece.min(axis=1) - flush for piece in (first, second)]
        high = [piece.max(axis=1) + flush for piece in (first, second)]
        meets = (low[0][:, None] <= high[1]) & (low[1] <= high[0][:, None])
        a, b = np.nonzero(meets.all(axis=-1))
        self._looked += len(a)
        gaps = separations(first[a], second[b])
        if not len(gaps) or gaps.min() > flush:
            return None
        kind, (i, j) = int(self._kinds[t]), map(int, self._pairs[t])
        touching = -gaps.min() <= (flush if self._axis_only[t] else SHALLOW * self._size[[i, j]].min())
        if touching and kind in (_CARRIED, _RIGID):
            return None
        near = gaps <= flush
        volumes, middles = shared(first[a[near]], second[b[near]])
        volume = self._scale(i) * self._scale(j) * float(volumes.sum())
        at = middles[np.argmin(gaps[near])] if volume == 0 else volumes @ middles / volumes.sum()
        x, y, z = map(float, at)
        blank = Clash("touch", self._names[i], self._names[j], 0.0, 0.0, (x, y, z), "")
        if kind == _CARRIED:
            return self._deep(blank, i, j - self._n)
        if touching:
            return replace(blank, text=f"touches {blank.second} at {_place(at)}: what moves there rubs; leave a gap")
        if kind == _RIGID:
            if volume < TWICE * min(self._bodies.volume(k - self._n) for k in (i, j)):
                return None
            text = f"shares {_volume(volume)} with {blank.second}, to which it is fixed: their mass counts twice"
        else:
            where, hint = "where nothing joins them", "move them apart, or join them"
            if kind == _MEETING:
                where, hint = "away from their joint", "let one pass beside the other, or join them there"
            text = f"shares {_volume(volume)} with {blank.second} at {_place(at)}, {where}: {hint}"
        return replace(blank, kind="clash", volume=volume, text=text)

    def _deep(self, blank: Clash, i: int, body: int) -> Clash | None:
        """A member that runs inside the body on which it ends."""
        first, second = self._bars.pieces(i), self._bodies.pieces(body)
        pairs = np.indices((len(first), len(second))).reshape(2, -1)
        a, b = pairs[:, separations(first[pairs[0]], second[pairs[1]]) < 0]
        scale = self._scale(i) * self._scale(body + self._n)
        volume = scale * float(shared(first[a], second[b])[0].sum())
        start, end = self._bars.end(0)[i], self._bars.end(1)[i]
        spans = crossed(second, start, end)
        spans = spans[spans[:, 1] > spans[:, 0]]
        run = float(spans[:, 1].max() - spans[:, 0].min()) * self._bars.length[i] if len(spans) else 0.0
        along = f"runs {_length(run)} inside" if run > 2 * self._bars.end_half[i].min() else "lies in"
        text = (
            f"{along} {blank.second}, on which it ends, and shares {_volume(volume)} with it: what is inside a rigid"
            " body cannot bend; let it end at the surface, with its node there or by start_offset or end_offset"
        )
        return replace(blank, kind="deep", volume=volume, text=text)


def _gaps(model: FullOrderModel, bars: Bars, bodies: Bodies) -> list[Clash]:
    """Members that end on a rigid cluster, and reach no solid of it."""
    piece, names = model.plan.topology.piece, model.plan.topology.node_names
    of_body: dict[int, list[int]] = {}
    for k, node in enumerate(bodies.nodes):
        of_body.setdefault(int(piece[node]), []).append(k)
    gaps: list[Clash] = []
    for end in (0, 1):
        tips, half = bars.end(end), bars.end_half[:, :, end]
        for i, node in enumerate(bars.nodes[:, end]):
            carriers = of_body.get(int(piece[node]), [])
            if not carriers or int(piece[node]) in bodies.unknown:
                continue
            to_solids = np.concatenate([bodies.nearest(k, tips[i : i + 1]) for k in carriers])
            nearest = int(np.argmin(np.linalg.norm(to_solids, axis=1)))
            to_solid = to_solids[nearest]
            distance = float(np.linalg.norm(to_solid))
            gap = distance - (np.abs(bars.axes[i, 1:] @ to_solid) @ half[i] / distance if distance > 0 else 0.0)
            if gap <= max(0.1 * 2 * half[i].min(), 1e-3 * bars.length[i]):
                continue
            x, y, z = map(float, tips[i] + to_solid / 2)
            body, member = bodies.names[carriers[nearest]], bars.names[i]
            text = (
                f"carried node {names[node]} is {_length(distance)} from its solid: {member} ends in the air, and what"
                " leads there is taken as rigid and without mass; draw it as a body of its own that is carried too, or"
                " move the node"
            )
            gaps.append(Clash("gap", body, member, 0.0, distance, (x, y, z), text))
    return gaps


def nodes_in_the_air(found: Iterable[Clash], bars: Bars) -> set[int]:
    """The nodes of the members that end outside the solids of their bodies, copies too."""
    members = {name for c in found if c.kind == "gap" for _, name in ((c.first, c.second), *c.copies)}
    return {int(n) for name, nodes in zip(bars.names, bars.nodes, strict=True) if name in members for n in nodes}


def _alike(found: list[Clash]) -> list[Clash]:
    """One for all that are alike in equal instances, in the order of their names without numbers of copies."""
    groups: dict[tuple[str, ...], list[Clash]] = {}
    for clash in found:
        plain = ["".join(c for c in name if not c.isdigit()) for name in (clash.first, clash.second)]
        key = (clash.kind, *plain, f"{clash.volume:.2e}", f"{clash.gap:.2e}")
        groups.setdefault(key, []).append(clash)
    kept = []
    for first, *rest in groups.values():
        more = f" (and {len(rest)} more alike)" if rest else ""
        kept.append(replace(first, text=first.text + more, copies=tuple((c.first, c.second) for c in rest)))
    return kept


def _place(at: Array) -> str:
    return f"({', '.join(f'{round(1e3 * x, 3) + 0.0:.4g}' for x in at)}) mm"


def _volume(volume: float) -> str:
    return quantity(volume, "m^3", 3)


def _length(length: float) -> str:
    return quantity(length, "m", 3)
