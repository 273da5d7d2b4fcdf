"""Which deformations of members are stiff and which are soft, and how motions of bodies deform them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Bools, Index
from flexura.beam import block_rotation, member_frame, rigid_arm
from flexura.mechanism import DOF_NAMES
from flexura.methods import members_as_chains, rigid_bodies
from flexura.reduction import SegmentChains, element_chains, inverse_factor
from flexura.structure import FullOrderModel, PiezoElement, SpringElement, block_diagonal
from flexura.thresholds import ROUND_OFF, SAME_PLACE

GROUND = "ground"

LEAST_GAP = 10.0
"""Least ratio of the softest stiff deformation of a member to its stiffest soft one."""

CLEAR_GAP = 30.0
"""Ratio from which a member is divided by itself alone."""

TWO_PLANES = 2.0
"""Ratio of the bending stiffnesses of a member in its two planes from which one is said to be its own."""

SUPPORT = 1e3
"""How many times stiffer than the stiffest deformation supports of single DOFs are taken to be."""

GOES_ON = 2**-0.5
"""Cosine of the angle at a node up to which two members that meet there are pieces of one flexure."""

NO_STIFFNESS = 1e-14
"""Stiffness beside the largest of the same member that is none."""


class Division(NamedTuple):
    """The k deformations of a member that have a stiffness, stiff ones first.

    `rows` (k, m): each the square root of its stiffness times the deformation, by the m relative displacements of its
    nodes. `coordinate` (k,) is the relative displacement that each is nearest, `level` (k,), N/m, the stiffness of
    each where rotations are counted at `length`, m. The first `count` are stiff, the least of them `gap` times as much
    as the others.
    """

    rows: Array
    coordinate: Index
    level: Array
    count: int
    gap: float
    length: float


@dataclass(frozen=True)
class Elastic:
    """Something elastic between bodies, by its name as placed.

    `bodies` (b,) number those at its nodes, `relative` (m, 6 b) are displacements of its nodes from each other, m and
    rad, by those of the bodies about their points, and `stiffness` (m, m) is against them. `labels` (m,) name them,
    `turns` (m,) says which are rotations, and `directions` (m, 3) are unit vectors along them, global axes.
    """

    name: str
    kind: str
    bodies: tuple[int, ...]
    relative: Array
    stiffness: Array
    labels: tuple[str, ...]
    turns: Bools
    directions: Array
    centre: Array
    ends: Array | None = None
    """Where a member begins and ends (2, 3), m."""

    @property
    def elastic_length(self) -> float:
        """The length, m, at which it is as compliant in translation as in rotation, l / sqrt(12) of a straight leaf;
        nan where there is none."""
        size = np.sqrt(np.diagonal(self.stiffness))
        if not (size > 0).all() or len({*self.turns.tolist()}) < 2:
            return np.nan
        scaled = self.stiffness / np.outer(size, size)
        if la.eigvalsh(scaled)[0] < NO_STIFFNESS:
            return np.nan
        C = la.inv(scaled) / np.outer(size, size)
        moves, rotates = (la.eigvalsh(C[np.ix_(at, at)])[-1] for at in (~self.turns, self.turns))
        return float(np.sqrt(moves / rotates))

    def divided(self, length: float, first: bool = False, least: float = np.inf) -> Division:
        """Its deformations, rotations counted as what they move at a length, m, cut at the largest gap, or at the
        `first` one above the softest that is large enough; those stiffer than `least`, N/m, are stiff as well."""
        scale = np.where(self.turns, length, 1.0)
        k, V = la.eigh(self.stiffness / np.outer(scale, scale))
        has = k > NO_STIFFNESS * k[-1]
        k, V = k[has], V[:, has]
        ratio = k[1:] / k[:-1]
        cut, gap = _cut(ratio, first, missing=not has.all())
        stiff = np.flatnonzero(k > least)
        if len(stiff) and (stiff[0] < cut or not cut):
            cut, gap = int(stiff[0]), float(ratio[stiff[0] - 1]) if stiff[0] else np.inf
        parts = [_aligned(k[at], V[:, at]) for at in (slice(cut, None), slice(0, cut)) if len(k[at])]
        coordinate = np.concatenate([own for own, _ in parts])
        factors = np.concatenate([own for _, own in parts])
        level = np.square(factors).sum(axis=1)
        return Division(factors * scale, coordinate, level, len(k) - cut, gap, length)

    def all_stiff(self, length: float) -> Division:
        """All its deformations as stiff."""
        return self.divided(length, least=0.0)._replace(gap=np.inf)

    def all_soft(self, length: float) -> Division:
        """All its deformations as soft."""
        return self.divided(length)._replace(count=0, gap=np.inf)


def _cut(ratio: Array, first: bool, missing: bool) -> tuple[int, float]:
    """How many of the deformations are soft, and the gap above them; `ratio` (k - 1,) are of stiffnesses that follow
    each other, ascending. All are stiff where there is no gap and others have no stiffness at all."""
    large = np.flatnonzero(ratio >= LEAST_GAP)
    if not len(ratio) or (missing and not len(large)):
        return 0, np.inf
    at = int(large[0]) if first and len(large) else int(np.argmax(ratio))
    return at + 1, float(ratio[at])


def _aligned(k: Array, V: Array) -> tuple[Index, Array]:
    """Coordinates (n,) that orthonormal deformations V (m, n) of stiffness k (n,) are nearest, and factors f (n, m),
    one along each, with f' f = V k V'."""
    at = np.sort(np.argsort(-np.einsum("ij,ij->i", V, V), kind="stable")[: len(k)])
    U, _, Wt = la.svd(V[at])
    Q = U @ Wt  # nearest to the rows of these coordinates
    return at, np.asarray((Q * np.sqrt(k)) @ V.T)


@dataclass(frozen=True)
class Skeleton:
    """Rigid bodies and what is elastic between them.

    `names` of the bodies and their `points` (b, 3), m, about which they rotate; `ground` is the number of what is held,
    if anything is, and `described` are the numbers of described bodies that are not; `size`, m, is the radius of
    gyration of the middles of all that is elastic. `notes` say what has been taken to be rigid or soft.
    """

    names: tuple[str, ...]
    points: Array
    ground: int | None
    described: tuple[int, ...]
    elastic: tuple[Elastic, ...]
    divisions: tuple[Division, ...]
    size: float
    of_node: Index
    """Number of the body (n_nodes,) that each node belongs to, -1 of those within members."""
    notes: tuple[str, ...]


def skeleton(model: FullOrderModel) -> Skeleton:
    """Bodies and what is elastic between them, divided into stiff and soft deformations (theory eqs. Y4-Y6).

    Links are rigid, but for those that turn more easily under a moment than the stiffest flexure does; without flexures
    all links are elastic.
    """
    found = _Found(model)
    elastic = [*found.flexures(), *found.discrete(), *found.supports()]
    used = sorted({b for own in elastic for b in own.bodies} | {*found.described, found.ground})
    if not found.is_held and not any(found.ground in own.bodies for own in elastic):
        used.remove(found.ground)
    new = {b: k for k, b in enumerate(used)}
    elastic = [replace(own, bodies=tuple(new[b] for b in own.bodies)) for own in elastic]
    middles = np.array([own.centre for own in elastic]).reshape(-1, 3)
    size = float(np.sqrt(np.square(middles - middles.mean(axis=0)).sum(axis=1).mean())) if len(middles) else 0.0
    if not size:
        size = next((own.elastic_length for own in elastic if np.isfinite(own.elastic_length)), 1.0)
    return Skeleton(
        tuple(found.names[b] for b in used),
        found.points[used],
        new.get(found.ground),
        tuple(new[b] for b in found.described),
        tuple(elastic),
        tuple(_divisions(elastic, size)),
        size,
        np.array([new.get(b, -1) for b in found.number[found.topology.root].tolist()]),
        tuple(found.notes(elastic)),
    )


class _Found:
    """The bodies of a model: the `number` (n_nodes,) of that of every node that is a root, `points` (b, 3), m, `names`,
    and the numbers of the `ground` and of the `described` ones that move."""

    def __init__(self, model: FullOrderModel) -> None:
        self.model, self.topology = model, model.plan.topology
        self.springs, self.keys, self.links = _chains(model)
        self.bodies = rigid_bodies(model, self.springs, self.links)
        self.number: Index = self._pieces()
        self.ground = len(self.bodies.reference)
        held = np.unique(self.number[self.topology.held.all(axis=1) & (self.number >= 0)])
        self.is_held = len(held) > 0
        self.number[np.isin(self.number, held)] = self.ground
        x = model.geometry.positions
        self.points: Array = np.concatenate([x[self.bodies.reference], x.mean(axis=0)[None]])
        self.names = {self.ground: GROUND}
        at_body = model.plan.topology.numbers(model.plan.body_names)
        for name, node in zip(model.plan.body_names, at_body, strict=True):
            self.names.setdefault(int(self.number[self.topology.root[node]]), name)
        self.described = [b for b in self.names if b != self.ground]
        for node, name in enumerate(self.topology.node_names):
            self.names.setdefault(int(self.number[self.topology.root[node]]), name)

    def _pieces(self) -> Index:
        """Number of the body (n_nodes,) of every root, -1 for others; a body that bends and what it carries are one."""
        body, piece = self.bodies.body.copy(), self.topology.piece
        at = np.flatnonzero(body >= 0)
        first = np.unique(piece[at], return_index=True, return_inverse=True)
        pairs = body[at], body[at[first[1]][first[2]]]
        count = len(self.bodies.reference)
        label = connected_components(coo_array((np.ones(len(at)), pairs), shape=(count, count)), directed=False)[1]
        body[at] = np.unique(label, return_index=True)[1][label][body[at]]
        return body

    def notes(self, elastic: Sequence[Elastic]) -> Iterator[str]:
        """What has been taken to be rigid or soft, in words."""
        rigid = sum(len(own.nodes) * len(own.numbers(self.model)) for own in self.links)
        bent = sum(map(len, (part.elastic for part in self.model.plan.parts.values())))
        stacks = sum(own.kind == "stack" for own in elastic)
        springs = sum(own.kind == "spring" for own in elastic)
        parts = sum(own.kind == "part" for own in elastic)
        if not self.is_held and not any(self.ground in own.bodies for own in elastic):
            yield "nothing is held: motions are relative to one of the bodies"
        if rigid:
            yield f"{rigid} links are taken as rigid: none turns more easily under a moment than the stiffest flexure"
        if bent:
            yield "bodies are taken as rigid, those too that bend"
        if stacks:
            yield f"{stacks} piezo stacks hold their length, as if locked"
        if springs:
            yield f"{springs} springs count as soft, however stiff they are"
        if parts:
            yield f"{parts} parts and diaphragms count as one member each, whatever is within them"

    def members(self) -> Iterator[Elastic]:
        """Members between bodies, at their centres of compliance and in their own axes."""
        x, geometry = self.model.geometry.positions, self.model.geometry
        for chains, keys in zip(self.springs, self.keys, strict=True):
            root = self.topology.root[chains.numbers(self.model)[:, :, [0, -1]]]
            at = self.number[root]
            relative = chains.ends[:, 6:] @ chains.transforms(self.model)
            relative = relative @ block_diagonal(rigid_arm(x[root] - self.points[at]))
            placed = self.topology.copies[chains.name]
            for c, key in enumerate(keys):
                C, shift = _at_centre(chains.running[c, -1])
                f, R = inverse_factor(C), chains.axes[c, :3, :3]
                K = f.T @ f
                start = chains.nodes[c, 0]
                labels = _member_labels(K)
                for copy, name in enumerate(placed.names(key)):
                    if at[copy, c, 0] == at[copy, c, 1]:
                        continue
                    turned = R @ geometry.Q[placed.number[copy]].T
                    centre = x[placed.offset[copy] + start] + shift @ turned
                    yield Elastic(
                        name,
                        "member",
                        tuple(at[copy, c].tolist()),
                        rigid_arm(shift) @ relative[copy, c],
                        K,
                        labels,
                        np.repeat([False, True], 3),
                        np.concatenate([turned, turned]),
                        centre,
                        x[placed.offset[copy] + chains.nodes[c, [0, -1]]],
                    )

    def flexures(self) -> list[Elastic]:
        """Members, those that go on from each other at a node of their own as one."""
        members = list(self.members())
        at: dict[int, list[int]] = {}
        for k, own in enumerate(members):
            for body in own.bodies:
                at.setdefault(body, []).append(k)
        others = {b for own in (*self.discrete(), *self.supports()) for b in own.bodies} | {*self.described}
        size = np.bincount(self.number[self.number >= 0], minlength=len(self.points))
        joints = {
            body: (pair[0], pair[1])
            for body, pair in at.items()
            if body not in others and len(pair) == 2 and size[body] == 1 and body != self.ground
            and _goes_on(members[pair[0]], members[pair[1]], body)
        }  # fmt: skip
        pairs = np.array(list(joints.values()), dtype=np.intp).reshape(-1, 2)
        graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(members), len(members)))
        label = connected_components(graph, directed=False)[1]
        flexures = []
        for own in range(label.max(initial=-1) + 1):
            pieces = [members[k] for k in np.flatnonzero(label == own)]
            ends = [b for b, n in Counter(b for piece in pieces for b in piece.bodies).items() if n == 1]
            flexures += [self.joined(pieces, ends)] if len(pieces) > 1 and len(ends) == 2 else pieces
        return flexures

    def joined(self, pieces: Sequence[Elastic], bodies: Sequence[int]) -> Elastic:
        """Members in series between two bodies as one, whose flexibilities add up, in axes of the line between its
        ends and, of those across, as near to those of its first piece as may be."""
        first, last = (next(own for own in pieces if b in own.bodies) for b in bodies)
        ends = np.array([_end(own, b) for own, b in ((first, bodies[0]), (last, bodies[1]))])
        p = ends.mean(axis=0)
        C = np.zeros((6, 6))
        for own in pieces:
            X = rigid_arm(p - own.centre) @ block_rotation(own.directions[:3].T)
            C += X @ la.inv(own.stiffness) @ X.T
        chord = ends[1] - ends[0]
        R = first.directions[:3]
        if np.linalg.norm(chord) > 0:
            R = member_frame(chord[None], first.directions[2][None])[0]
        turn = block_rotation(R)
        C, shift = _at_centre(turn @ C @ turn.T)
        f = inverse_factor(C)
        K = f.T @ f
        arms = [rigid_arm(p - self.points[b]) for b in bodies]
        names = [own.name for own in pieces]
        return Elastic(
            f"{first.name} to {last.name.rsplit('.', 1)[-1]}" if len(set(names)) > 1 else first.name,
            "member",
            tuple(bodies),
            rigid_arm(shift) @ turn @ np.concatenate([-arms[0], arms[1]], axis=1),
            K,
            _member_labels(K),
            first.turns,
            np.concatenate([R, R]),
            p + shift @ R,
            ends,
        )

    def discrete(self) -> Iterator[Elastic]:
        """Springs, stacks, diaphragms and superelements."""
        model, x = self.model, self.model.geometry.positions
        for name, matrices in model.matrices.items():
            placed, part = self.topology.copies[name], model.plan.parts[name]
            local = model.geometry.parts[name].positions
            for element, (key, _, own) in zip(matrices.discrete_elements, part.discrete, strict=True):
                if element.K is None:
                    continue
                nodes = np.array([n for n in element.nodes if n < part.n_positioned], dtype=np.intp)
                resisted = own.resisted(model.values, local[element.nodes])
                k, B = resisted or _between_nodes(element.K, local[nodes])
                k = np.diag(k) if k.ndim == 1 else k
                labels, turns = _labels(len(k), part.node_names, nodes)
                G = model.design.node_transforms(name, nodes)
                for copy, full in enumerate(placed.names(key)):
                    placed_nodes = placed.offset[copy] + nodes
                    root = self.topology.root[placed_nodes]
                    at, grounded = self.number[root], [self.ground] * (len(nodes) == 1)
                    if len({*at.tolist(), *grounded}) == 1:
                        continue
                    ends = [(n, b, 1.0) for n, b in enumerate(at)] + [(0, b, -1.0) for b in grounded]
                    blocks = [
                        sign * B[:, 6 * n : 6 * n + 6] @ G[copy, n] @ rigid_arm(x[root[n]] - self.points[b])
                        for n, b, sign in ends
                    ]
                    yield Elastic(
                        full,
                        _kind(own),
                        (*at.tolist(), *grounded),
                        np.concatenate(blocks, axis=1),
                        (k + k.T) / 2,
                        labels,
                        turns,
                        _directions(blocks, turns),
                        x[placed_nodes].mean(axis=0),
                    )

    def supports(self) -> Iterator[Elastic]:
        """Nodes that are held in some of their DOFs, each DOF by itself."""
        held, x = self.topology.held, self.model.geometry.positions
        names = self.topology.node_names
        for node in np.flatnonzero(held.any(axis=1) & ~held.all(axis=1) & (self.number >= 0)):
            mask, body = held[node], int(self.number[node])
            if body == self.ground:
                continue
            ends = [rigid_arm(x[node] - self.points[b])[mask] for b in (body, self.ground)]
            labels = tuple(np.array(DOF_NAMES)[mask])
            directions = np.concatenate([np.eye(3), np.eye(3)])[mask]
            turns = np.repeat([False, True], 3)[mask]
            relative = np.concatenate([ends[0], -ends[1]], axis=1)
            K = np.eye(int(mask.sum()))
            yield Elastic(names[node], "support", (body, self.ground), relative, K, labels, turns, directions, x[node])


def _chains(model: FullOrderModel) -> tuple[list[SegmentChains], list[list[str]], list[SegmentChains]]:
    """Members that are elastic, each a chain of its elements, with their names, and those that are rigid."""
    found: list[tuple[SegmentChains, Index, bool]] = []
    for name in model.matrices:
        part, flexures = model.plan.parts[name], model.plan.layout.prototypes[name].flexures
        is_flexure = np.array([member in flexures for member in part.members], dtype=bool)
        for flag in (True, False):
            at = np.flatnonzero(is_flexure == flag)
            members = [at[part.counts[at] == n] for n in np.unique(part.counts[at])]
            chains = element_chains(model, name, members_as_chains(part, at))
            found += [(own, of, flag) for own, of in zip(chains, members, strict=True)]
    stiffest = min((float(own.turning.min()) for own, _, flag in found if flag), default=0.0)
    springs, keys, links = [], [], []
    for own, members, flag in found:
        names = list(model.plan.parts[own.name].members)
        turns = own.turning >= (0.0 if flag else stiffest)
        if turns.any():
            springs.append(own.take(turns))
            keys.append([names[m] for m in members[turns]])
        if not turns.all():
            links.append(own.take(~turns))
    return springs, keys, links


def _end(member: Elastic, body: int) -> Array:
    """Where a member is at a body (3,), m."""
    assert member.ends is not None
    return member.ends[member.bodies.index(body)]


def _goes_on(one: Elastic, other: Elastic, body: int) -> bool:
    """Whether the second member goes on from the first at a body, in nearly its direction."""
    assert one.ends is not None and other.ends is not None
    there = _end(one, body) - one.ends[1 - one.bodies.index(body)]
    onward = other.ends[1 - other.bodies.index(body)] - _end(other, body)
    cosine = there @ onward / (np.linalg.norm(there) * np.linalg.norm(onward))
    return bool(cosine > GOES_ON) and set(one.bodies) != set(other.bodies)


def _at_centre(C: Array) -> tuple[Array, Array]:
    """Flexibility (6, 6) at the centre of compliance, where it couples translation and rotation as little as it may
    (Loncaric 1987), and the way there (3,), m."""
    D, skew = C[3:, 3:], (C[:3, 3:] - C[:3, 3:].T) / 2
    r = la.lstsq(np.trace(D) * np.eye(3) - D, 2 * np.array([skew[2, 1], skew[0, 2], skew[1, 0]]))[0]
    r[np.abs(r) < ROUND_OFF * np.abs(r).max()] = 0.0
    X = rigid_arm(r)
    return X @ C @ X.T, r


def _member_labels(K: Array) -> tuple[str, ...]:
    """What the six deformations of a member are called, by its stiffness in its own axes."""
    about_y, about_z = K[4, 4], K[5, 5]
    if max(about_y, about_z) < TWO_PLANES * min(about_y, about_z):
        return (
            "stretch",
            "shear along its y",
            "shear along its z",
            "twist",
            "bending about its y",
            "bending about its z",
        )
    planes = ("in its plane", "out of its plane")
    xy, xz = planes if about_z > about_y else planes[::-1]
    return ("stretch", f"shear {xy}", f"shear {xz}", "twist", f"bending {xz}", f"bending {xy}")


def _kind(own: object) -> str:
    if isinstance(own, SpringElement):
        return "spring"
    return "stack" if isinstance(own, PiezoElement) else "part"


def _labels(count: int, names: Sequence[str], nodes: Index) -> tuple[tuple[str, ...], Bools]:
    """Names (m,) of relative displacements of nodes, and which of them are rotations."""
    if count == 1:
        return ("stretch",), np.zeros(1, dtype=bool)
    of = [""] if count == 6 else [f"{names[n]} " for n in nodes[1:]]
    return tuple(f"{node}{dof}" for node in of for dof in DOF_NAMES), np.tile(np.repeat([False, True], 3), len(of))


def _directions(blocks: Sequence[Array], turns: Bools) -> Array:
    """Unit vectors (m, 3), global axes, along relative displacements by those of bodies (m, 6)."""
    along = np.where(turns[:, None], blocks[-1][:, 3:], blocks[-1][:, :3])
    size = np.linalg.norm(along, axis=1, keepdims=True)
    return np.divide(along, size, out=np.zeros_like(along), where=size > 0)


def _between_nodes(K: Array, x: Array) -> tuple[Array, Array]:
    """Stiffness (6n - 6, 6n - 6) against displacements of n nodes at x (n, 3) from where the first one carries them,
    and these (6n - 6, 6n) by displacements of all. Amplitudes behind those of the nodes take what they will."""
    n = 6 * len(x)
    if len(K) > n:
        K = K[:n, :n] - K[:n, n:] @ la.solve(K[n:, n:], K[n:, :n], assume_a="sym")
    B = np.zeros((n - 6, n))
    B[:, 6:] = np.eye(n - 6)
    B[:, :6] = -np.concatenate([rigid_arm(own - x[0]) for own in x[1:]])
    if n > 12:
        return K[6:, 6:], B
    _, r = _at_centre(la.inv(K[6:, 6:]))
    back = rigid_arm(-r)
    return back.T @ K[6:, 6:] @ back, rigid_arm(r) @ B


def _divisions(elastic: Sequence[Elastic], size: float) -> list[Division]:
    """The division of each (theory eq. Y5).

    By itself where the first gap above its softest deformation is clear at its own length; else rotations may also be
    counted at the radius of gyration of what holds its bodies, whichever gives the larger gap. Where that is not clear
    either, what is stiffer than the least stiff constraint of those that are clear counts as stiff.
    """
    around = _sizes(elastic, size)
    found: list[Division] = []
    for own, length in zip(elastic, around, strict=True):
        if own.kind in ("support", "stack"):
            found.append(own.all_stiff(length))
        else:
            found.append(own.all_soft(length) if own.kind == "spring" else _by_itself(own, length))
    is_clear = [d.gap >= CLEAR_GAP for d in found]
    levels = [
        d.level[: d.count].min()
        for d, own, clear in zip(found, elastic, is_clear, strict=True)
        if clear and d.count and own.kind in ("member", "part")
    ]
    least = min(levels, default=np.inf)
    return [
        d if clear else own.divided(d.length, least=least)
        for d, own, clear in zip(found, elastic, is_clear, strict=True)
    ]


def _by_itself(own: Elastic, around: float) -> Division:
    """The clearer of its divisions at its own length and at that of what is around it."""
    at_own = own.elastic_length
    if not np.isfinite(at_own):
        return own.divided(around)
    alone = own.divided(at_own, first=True)
    if alone.gap >= CLEAR_GAP and alone.count:
        return alone
    beside = own.divided(max(around, at_own))
    return beside if beside.gap > alone.gap or not alone.count else alone


def _sizes(elastic: Sequence[Elastic], size: float) -> list[float]:
    """For each the length, m, of what is around it: the least radius of gyration of the middles of all that holds one
    of its bodies, of bodies that several hold; else that of all."""
    holders: dict[int, list[Array]] = {}
    for own in elastic:
        for body in own.bodies:
            holders.setdefault(body, []).append(own.centre)
    radius = {
        body: float(np.sqrt(np.square(np.array(at) - np.mean(at, axis=0)).sum(axis=1).mean()))
        for body, at in holders.items()
    }
    sizes = []
    for own in elastic:
        around = [r for r in (radius[body] for body in own.bodies) if r > SAME_PLACE * size]
        sizes.append(min(around, default=size))
    return sizes
