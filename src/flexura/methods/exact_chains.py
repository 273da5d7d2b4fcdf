"""Serial chains of uniform beams, each joined to one exact dynamic stiffness between its end nodes.

For the search of natural frequencies the chains of all prototypes are cut into branches, none of which has an
eigenvalue with its ends held below a limit: up to it nothing that is eliminated has a pole. All branches are joined at
once, for many frequencies (theory eqs. D6-D7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Index
from flexura.beam import (
    SERIES_RADIANS,
    BeamSeries,
    DynamicBeam,
    Joint,
    UniformBeam,
    at_pole,
    block_rotation,
    dynamic_beam,
    join,
    radians,
    rigid_arm,
    rooted,
    turned,
)
from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.reduction import ChainGroup, PartReducer, kinematics
from flexura.structure import Cut, ElementSlice, FullOrderModel, Geometry, Part

Array = NDArray[Any]

MOST_PIECES = 2**20
"""Most pieces of one element."""


def beams_at(beams: DynamicBeam, index: Any) -> DynamicBeam:
    """The beams at an index of the leading axes."""
    return DynamicBeam(*(field[index] for field in beams))


def starts(X: Array) -> Array:
    """Where pieces start (..., 3), from the pole of X (..., 6, 6), which takes twists there to those of the pieces."""
    skew = -np.swapaxes(X[..., :3, :3], -1, -2) @ X[..., :3, 3:]
    return np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


def remaining_numbers(reducer: PartReducer) -> Index:
    """For every node of a part its position among the nodes that remain without the chains, -1 for the others."""
    number = np.full(reducer.part.n_nodes, -1)
    number[reducer.remaining] = np.arange(len(reducer.remaining))
    return number


@dataclass(frozen=True)
class ExactChains:
    """Chains (c,) of a part that have the same number of uniform pieces (s,), in walking order.

    They are the `members` (c,) of a group; `beam` are all different pieces of the part, `kind` (c, s) says which of
    them each is, and `reverse` (c, s) marks those walked from end to start. `X` (c, s, 6, 6) takes twists at the
    chain's pole, its first node, to those at the start of the piece in its own axes. `B` (c, 12, 12) takes the
    displacements of the two end nodes to [t, e], and `nodes` (c, e + 1), with `arms` (c, e + 1, 3) from the pole, are
    the nodes passed, after `passed` (e + 1,) pieces. `root` (c, s, 2) says which of the flexibilities
    `roots` (k, 6, 6) are elastic roots at the ends of a piece, -1 for none, and `is_rooted` (c, s) marks all pieces of
    elements that have any.
    """

    members: Index
    beam: UniformBeam
    kind: Index
    reverse: NDArray[np.bool_]
    X: Array
    B: Array
    nodes: Index
    arms: Array
    passed: Index
    root: Index
    roots: Array
    is_rooted: NDArray[np.bool_]

    def pieces(self, lam: float | complex) -> DynamicBeam:
        """All pieces (c, s), twists at the poles of their chains."""
        placed = at_pole(self._with_roots(beams_at(dynamic_beam(self.beam, lam), self.kind)), self.X)
        if not self.reverse.any():
            return placed
        back = turned(placed)
        pick = self.reverse[..., None, None]
        return DynamicBeam(np.where(pick, back.K, placed.K), np.where(pick, back.slope, placed.slope), placed.J0)

    def _with_roots(self, pieces: DynamicBeam) -> DynamicBeam:
        """Pieces (c, s), in their own axes, with the roots at their ends."""
        if not len(self.roots):
            return pieces
        shape = pieces.J0.shape
        flat = DynamicBeam(*(field.reshape(-1, *field.shape[2:]) for field in pieces))
        joined = rooted(flat, self.root.reshape(-1, 2), self.roots, self.beam.length[self.kind].ravel())
        return DynamicBeam(*(field.reshape(*shape, *field.shape[1:]) for field in joined))

    def joined(self, lam: float | complex) -> tuple[DynamicBeam, list[Joint]]:
        """The chains (c,), and the joints of every level, each (c, pairs), lowest first."""
        return in_series(self.pieces(lam))


def in_series(level: DynamicBeam) -> tuple[DynamicBeam, list[Joint]]:
    """Beams (c, s) joined along the last axis to (c,), and the joints of every level."""
    levels = []
    while level.J0.shape[-1] > 1:
        pairs = level.J0.shape[-1] // 2
        joint = join(beams_at(level, np.s_[:, : 2 * pairs : 2]), beams_at(level, np.s_[:, 1 : 2 * pairs : 2]))
        levels.append(joint)
        rest = beams_at(level, np.s_[:, 2 * pairs :])
        level = DynamicBeam(*(np.concatenate(f, axis=1) for f in zip(joint.beam, rest, strict=True)))
    return beams_at(level, np.s_[:, 0]), levels


def twists_inside(levels: list[Joint], motion: Array) -> Array:
    """Twists (c, s + 1, 6, k) of all ends of beams in series from [t, e] (c, 12, k) of the whole, and the joints that
    `in_series` made at the same frequency."""
    motion = motion[:, None]
    for joint in reversed(levels):
        pairs = joint.P.shape[1]
        t, e = motion[:, :pairs, :6], motion[:, :pairs, 6:]
        first = joint.P @ motion[:, :pairs]
        below = np.empty((len(motion), 2 * pairs, *motion.shape[2:]), dtype=motion.dtype)
        below[:, ::2] = np.concatenate([t, first], axis=2)
        below[:, 1::2] = np.concatenate([t + first, e - first], axis=2)
        motion = np.concatenate([below, motion[:, pairs:]], axis=1)
    return np.concatenate([motion[:, :1, :6], motion[:, :, :6] + motion[:, :, 6:]], axis=1)


def exact_chains(part: Part, group: ChainGroup, geometry: Geometry, cut: Cut) -> list[ExactChains]:
    """The chains of a group cut into uniform pieces, those of equal numbers of pieces together."""
    kin = kinematics(part, group, geometry.parts[part.name])
    first = np.concatenate([[0], np.cumsum(cut.counts)])
    per_chain = cut.counts[group.elements]
    positions = geometry.parts[part.name].positions
    alike: dict[tuple[int, ...], list[int]] = {}
    for c, counts in enumerate(per_chain.tolist()):
        alike.setdefault(tuple(counts), []).append(c)
    chains = []
    for counts, members in alike.items():
        elements, back = group.elements[members], group.reverse[members]
        e = np.repeat(np.arange(len(counts)), counts)
        place = np.concatenate([np.arange(n) for n in counts])
        # pieces of an element that is walked backwards come in the opposite order
        place = np.where(back[:, e], np.array(counts)[e] - 1 - place, place)
        kind = cut.kind[first[elements[:, e]] + place]
        along = np.zeros((*kind.shape, 3))
        along[..., 0] = place * cut.beam.length[kind]
        X = rigid_arm(along) @ kin.X[np.array(members)[:, None], e, :6]
        nodes = group.nodes[members]
        arms = positions[nodes] - positions[nodes[:, :1]]
        passed = np.concatenate([[0], np.cumsum(counts)])
        element_root = cut.root[elements[:, e]]
        at_ends = np.stack([place == 0, place == np.array(counts)[e] - 1], axis=-1)
        chains.append(
            ExactChains(
                members=np.array(members),
                beam=cut.beam,
                kind=kind,
                reverse=back[:, e],
                X=X,
                B=kin.B[members],
                nodes=nodes,
                arms=arms,
                passed=passed,
                root=np.where(at_ends, element_root, -1),
                roots=cut.roots,
                is_rooted=np.asarray((element_root >= 0).any(axis=-1)),
            )
        )
    return chains


@dataclass(frozen=True)
class ExactBranch:
    """A run of pieces of a chain: pieces `first` to `last` of chain number `row` of an `ExactChains`, from junction to
    junction (numbers in the part: chain ends and cuts), `pole` and `end` (3,) from the chain's pole, m. Twists are in
    the axes of the first piece, in which stretch does not mix with bending, which may be softer by many decades."""

    chains: ExactChains
    row: int
    first: int
    last: int
    junctions: tuple[int, int]
    pole: Array
    end: Array

    @property
    def size(self) -> int:
        """Number of pieces."""
        return self.last - self.first

    @property
    def X(self) -> Array:
        """(s, 6, 6): from twists of the branch to those at the start of every piece in its own axes."""
        return self.chains.X[self.row, self.first : self.last] @ rigid_arm(-self.pole) @ self.axes.T

    @property
    def axes(self) -> Array:
        """(6, 6): from the part's axes to those of the branch."""
        return block_rotation(self.chains.X[self.row, self.first, :3, :3])

    @property
    def B(self) -> Array:
        """(12, 12): [t, e] from the displacements of both junctions."""
        B = np.eye(12)
        B[6:, :6] = -np.eye(6)
        B[6:, 6:] = rigid_arm(self.pole - self.end)
        return np.kron(np.eye(2), self.axes) @ B

    def nodes(self) -> tuple[Index, Index, Array]:
        """The part's nodes inside: their numbers (k,), the number of pieces of the branch before each, and their
        displacements from the twists there (k, 6, 6)."""
        passed = self.chains.passed
        inside = np.flatnonzero((passed > self.first) & (passed < self.last))
        numbers, arms = self.chains.nodes[self.row, inside], self.chains.arms[self.row, inside]
        return numbers, passed[inside] - self.first, rigid_arm(arms - self.pole) @ self.axes.T


@dataclass
class PartBranches:
    """The branches of one prototype; junctions are the nodes that remain when chains are taken out, then the cuts, at
    `cut_nodes` (k,), -1 where a cut is between nodes."""

    reducer: PartReducer
    branches: list[ExactBranch]
    cut_nodes: list[int]

    @property
    def n_junctions(self) -> int:
        """Number of junctions."""
        return len(self.reducer.remaining) + len(self.cut_nodes)


class ExactBranches:
    """The branches of all prototypes and their exact matrices over [t, e]."""

    def __init__(self, series: BeamSeries, parts: dict[str, PartBranches], roots: Array, length: Array) -> None:
        self.parts = parts
        self._series, self._roots = series, roots
        self.all: list[ExactBranch] = [branch for part in parts.values() for branch in part.branches]
        ends = np.cumsum([0, *(len(part.branches) for part in parts.values())])
        self.span: dict[str, slice] = {
            name: slice(int(a), int(b)) for name, (a, b) in zip(parts, pairwise(ends), strict=True)
        }
        kind, reverse, root = (
            [getattr(b.chains, key)[b.row, b.first : b.last] for b in self.all] for key in ("kind", "reverse", "root")
        )
        self._kind = np.concatenate([np.empty(0, dtype=np.intp), *kind])
        self._root = np.concatenate([np.empty((0, 2), dtype=np.intp), *root])
        self._length = length[self._kind]
        self._X = np.concatenate([np.empty((0, 6, 6)), *(b.X for b in self.all)])[:, None]
        self._reverse = np.flatnonzero(np.concatenate([np.empty(0, dtype=bool), *reverse]))
        self._levels, self._order = _levels([b.size for b in self.all])
        self.B = np.array([b.B for b in self.all]).reshape(-1, 12, 12)

    def __call__(self, lam: NDArray[np.float64], count: bool = False) -> tuple[DynamicBeam, list[Joint]]:
        """The branches (n, l, 12, 12) at squared angular frequencies lam (l,), and the joints of every level."""
        level = rooted(beams_at(self._series(lam, count), self._kind), self._root, self._roots, self._length)
        level = at_pole(level, self._X)
        if len(self._reverse):
            back = turned(beams_at(level, self._reverse))
            for field, other in zip(level, back, strict=True):
                field[self._reverse] = other
        joints = []
        for first, second, rest in self._levels:
            joint = join(beams_at(level, first), beams_at(level, second), count)
            joints.append(joint)
            level = DynamicBeam(*(np.concatenate([f, g[rest]]) for f, g in zip(joint.beam, level, strict=True)))
        return beams_at(level, self._order), joints

    def twists(self, joints: list[Joint], motion: Array) -> list[Array]:
        """Twists (s + 1, l, c, 6) of all piece ends of every branch at its pole, from [t, e] (n, l, c, 12)."""
        below = np.empty_like(motion)
        below[self._order] = motion
        for (first, second, rest), joint in zip(reversed(self._levels), reversed(joints), strict=True):
            pairs = len(first)
            t, e = below[:pairs, ..., :6], below[:pairs, ..., 6:]
            middle = below[:pairs] @ np.swapaxes(joint.P, -1, -2)
            above = np.empty((2 * pairs + len(rest), *below.shape[1:]), dtype=below.dtype)
            above[first] = np.concatenate([t, middle], axis=-1)
            above[second] = np.concatenate([t + middle, e - middle], axis=-1)
            above[rest] = below[pairs:]
            below = above
        ends = np.cumsum([0, *(b.size for b in self.all)])
        pieces = [below[a:b] for a, b in pairwise(ends)]
        return [np.concatenate([p[:1, ..., :6], p[..., :6] + p[..., 6:]]) for p in pieces]


def _levels(sizes: list[int]) -> tuple[list[tuple[Index, Index, Index]], Index]:
    """How pieces, in order of branches, are joined two by two: at every level the first and the second of each pair,
    and those that wait; then the place of every branch. Joined pairs come before those that wait."""
    starts = np.cumsum([0, *sizes])
    places = [list(range(a, b)) for a, b in pairwise(starts)]
    levels = []
    while max(map(len, places), default=0) > 1:
        first, second, rest = [], [], []
        for pieces in places:
            first += pieces[: len(pieces) // 2 * 2 : 2]
            second += pieces[1::2]
            rest += pieces[len(pieces) // 2 * 2 :]
        joined = {k: i for i, k in enumerate(first)} | {k: len(first) + i for i, k in enumerate(rest)}
        places = [[joined[k] for k in pieces[::2]] for pieces in places]
        levels.append(tuple(np.array(at, dtype=np.intp) for at in (first, second, rest)))
    return levels, np.array([pieces[0] for pieces in places], dtype=np.intp)


def branches_below(
    model: FullOrderModel, reducers: dict[str, PartReducer], limit: float, pieces: int, tapered_pieces: int
) -> ExactBranches:
    """Cut the chains of all prototypes so that no branch has an eigenvalue with its ends held below `limit`, rad^2/s^2.

    Tapered elements are at most `tapered_pieces` uniform beams; every uniform beam is cut into at least `pieces`, which
    changes nothing. Raises SolverError when an element would need more than `MOST_PIECES`.
    """
    beams: list[UniformBeam] = []
    parts: dict[str, PartBranches] = {}
    first, n_roots, roots = 0, 0, [np.empty((0, 6, 6))]
    for name, reducer in reducers.items():
        parts[name] = PartBranches(reducer, [], [])
        elements = model.matrices[name].elements
        if not len(reducer.part.connectivity):
            continue
        assert isinstance(elements, ElementSlice)
        cut = _refined(elements.cut(1, tapered_pieces), pieces, limit)
        beams.append(cut.beam)
        number = remaining_numbers(reducer)
        for group in reducer.chains:
            for local in exact_chains(reducer.part, group, model.geometry, cut):
                root = np.where(local.root >= 0, local.root + n_roots, -1)
                chains = replace(local, kind=local.kind + first, root=root)
                for row, ends in enumerate(number[chains.nodes[:, [0, -1]]].tolist()):
                    branch = ExactBranch(
                        chains, row, 0, chains.kind.shape[1], tuple(ends), np.zeros(3), chains.arms[row, -1]
                    )
                    parts[name].branches.append(branch)
        first += len(cut.beam.length)
        n_roots += len(cut.roots)
        roots.append(cut.roots)
    fields = zip(*beams, strict=True) if beams else (np.empty((1, 0)) for _ in UniformBeam._fields)
    beam = UniformBeam(*(np.concatenate(tuple(field)) for field in fields))
    series = BeamSeries(beam, limit)
    while True:
        checkpoint()
        branches = ExactBranches(series, parts, np.concatenate(roots), beam.length)
        J0 = branches(np.array([limit]), count=True)[0].J0[:, 0]
        if not J0.any():
            return branches
        parts = {name: _halved(part, J0[branches.span[name]] > 0, beam) for name, part in parts.items()}


def _refined(cut: Cut, least: int, limit: float) -> Cut:
    """Pieces so short that none has an eigenvalue with its ends held below the limit; those of an element are alike."""
    element = np.repeat(np.arange(len(cut.counts)), cut.counts)
    pieces = np.full(len(cut.counts), least, dtype=np.intp)
    # an end on an elastic root is freer than one that is held: pinned beams have half the eigenvalue, guided ones a
    # sixteenth
    beyond = 16 * limit if len(cut.roots) else limit
    while True:
        checkpoint()
        each = np.ones(len(cut.beam.length), dtype=np.intp)
        each[cut.kind] = pieces[element]
        beam = cut.beam._replace(length=cut.beam.length / each)
        J0 = np.zeros(len(each), dtype=np.intp)
        long = np.flatnonzero(radians(beam, beyond) > SERIES_RADIANS)
        J0[long] = BeamSeries(beam.take(long), beyond)(np.array([beyond])).J0[:, 0]
        coarse = np.unique(element[J0[cut.kind] > 0])
        if not len(coarse):
            return cut._replace(beam=beam, kind=np.repeat(cut.kind, each[cut.kind]), counts=cut.counts * pieces)
        pieces[coarse] *= 2
        if pieces.max() > MOST_PIECES:
            raise SolverError("members have too many modes of their own below the frequencies asked for")


def _halved(part: PartBranches, split: NDArray[np.bool_], beam: UniformBeam) -> PartBranches:
    """The same branches with those marked cut in two in the middle."""
    halved = PartBranches(part.reducer, [], list(part.cut_nodes))
    for branch, is_split in zip(part.branches, split, strict=True):
        if not is_split:
            halved.branches.append(branch)
            continue
        chains, row, middle = branch.chains, branch.row, (branch.first + branch.last) // 2
        at = np.flatnonzero(chains.passed == middle)
        where = _start(chains, row, middle, beam)
        junction = halved.n_junctions
        halved.cut_nodes.append(int(chains.nodes[row, at[0]]) if len(at) else -1)
        halved.branches += [
            replace(branch, last=middle, junctions=(branch.junctions[0], junction), end=where),
            replace(branch, first=middle, junctions=(junction, branch.junctions[1]), pole=where),
        ]
    return halved


def _start(chains: ExactChains, row: int, piece: int, beam: UniformBeam) -> Array:
    """Where a piece begins in walking order (3,), from the chain's pole, m; at a node of the part that node."""
    at = np.flatnonzero(chains.passed == piece)
    if len(at):
        return chains.arms[row, at[0]]
    X = chains.X[row, piece]
    return starts(X) + chains.reverse[row, piece] * X[0, :3] * beam.length[chains.kind[row, piece]]
