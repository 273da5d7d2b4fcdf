"""All serial chains of a mechanism's prototypes as branches between junctions, each joined to one exact stiffness.

Branches are cut so that none has an eigenvalue with its ends held below a limit: up to it nothing that is eliminated
has a pole. All are joined at once, for many frequencies (theory eqs. D6-D7).
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
    join,
    radians,
    rigid_arm,
    rooted,
    turned,
)
from flexura.deadline import checkpoint
from flexura.errors import SolverError
from flexura.methods.exact_chains import ExactChains, exact_chains
from flexura.reduction import PartReducer
from flexura.structure import Cut, ElementSlice, FullOrderModel

Array = NDArray[Any]

FINEST = 2**20
"""Most pieces of one element."""


@dataclass(frozen=True)
class Branch:
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
    branches: list[Branch]
    cut_nodes: list[int]

    @property
    def n_junctions(self) -> int:
        """Number of junctions."""
        return len(self.reducer.remaining) + len(self.cut_nodes)


class Branches:
    """The branches of all prototypes and their exact matrices over [t, e]."""

    def __init__(self, series: BeamSeries, parts: dict[str, PartBranches], roots: Array, length: Array) -> None:
        self.parts = parts
        self._series, self._roots = series, roots
        self.all: list[Branch] = [branch for part in parts.values() for branch in part.branches]
        ends = np.cumsum([0, *(len(part.branches) for part in parts.values())])
        self.span: dict[str, slice] = {
            name: slice(int(a), int(b)) for name, (a, b) in zip(parts, pairwise(ends), strict=True)
        }
        own = [(b.chains.kind[b.row, b.first : b.last], b.chains.reverse[b.row, b.first : b.last]) for b in self.all]
        self._kind = np.concatenate([np.empty(0, dtype=np.intp), *(k for k, _ in own)])
        ends = [np.empty((0, 2), dtype=np.intp), *(b.chains.root[b.row, b.first : b.last] for b in self.all)]
        self._root, self._length = np.concatenate(ends), length[self._kind]
        self._X = np.concatenate([np.empty((0, 6, 6)), *(b.X for b in self.all)])[:, None]
        self._reverse = np.flatnonzero(np.concatenate([np.empty(0, dtype=bool), *(r for _, r in own)]))
        self._levels, self._order = _levels([b.size for b in self.all])
        self.B = np.array([b.B for b in self.all]).reshape(-1, 12, 12)

    def __call__(self, lam: NDArray[np.float64], count: bool = False) -> tuple[DynamicBeam, list[Joint]]:
        """The branches (n, l, 12, 12) at squared angular frequencies lam (l,), and the joints of every level."""
        own = self._series(lam, count)
        level = rooted(DynamicBeam(*(field[self._kind] for field in own)), self._root, self._roots, self._length)
        level = at_pole(level, self._X)
        if len(self._reverse):
            back = turned(DynamicBeam(*(field[self._reverse] for field in level)))
            for field, other in zip(level, back, strict=True):
                field[self._reverse] = other
        joints = []
        for first, second, rest in self._levels:
            a, b = (DynamicBeam(*(f[at] for f in level)) for at in (first, second))
            joint = join(a, b, count)
            joints.append(joint)
            level = DynamicBeam(*(np.concatenate([f, g[rest]]) for f, g in zip(joint.beam, level, strict=True)))
        return DynamicBeam(*(f[self._order] for f in level)), joints

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
        for own in places:
            first += own[: len(own) // 2 * 2 : 2]
            second += own[1::2]
            rest += own[len(own) // 2 * 2 :]
        joined = {k: i for i, k in enumerate(first)} | {k: len(first) + i for i, k in enumerate(rest)}
        places = [[joined[k] for k in own[::2]] for own in places]
        levels.append(tuple(np.array(at, dtype=np.intp) for at in (first, second, rest)))
    return levels, np.array([own[0] for own in places], dtype=np.intp)


def branches_below(
    model: FullOrderModel, reducers: dict[str, PartReducer], limit: float, pieces: int, tapered_pieces: int
) -> Branches:
    """Cut the chains of all prototypes so that no branch has an eigenvalue with its ends held below `limit`, rad^2/s^2.

    Tapered elements are at most `tapered_pieces` uniform beams; every uniform beam is cut into at least `pieces`, which
    changes nothing. Raises SolverError when an element would need more than `FINEST`.
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
        number = np.full(reducer.part.n_nodes, -1)
        number[reducer.remaining] = np.arange(len(reducer.remaining))
        for group in reducer.chains:
            for local in exact_chains(reducer.part, group, model.geometry, cut):
                root = np.where(local.root >= 0, local.root + n_roots, -1)
                chains = replace(local, kind=local.kind + first, root=root)
                parts[name].branches += [_whole(chains, row, number) for row in range(len(chains.kind))]
        first += len(cut.beam.length)
        n_roots += len(cut.roots)
        roots.append(cut.roots)
    fields = zip(*beams, strict=True) if beams else (np.empty((1, 0)) for _ in UniformBeam._fields)
    beam = UniformBeam(*(np.concatenate(tuple(field)) for field in fields))
    series = BeamSeries(beam, limit)
    while True:
        checkpoint()
        found = Branches(series, parts, np.concatenate(roots), beam.length)
        J0 = found(np.array([limit]), count=True)[0].J0[:, 0]
        if not J0.any():
            return found
        parts = {name: _halved(part, J0[found.span[name]] > 0, beam) for name, part in parts.items()}


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
        if pieces.max() > FINEST:
            raise SolverError("members have too many modes of their own below the frequencies asked for")


def _whole(chains: ExactChains, row: int, number: Index) -> Branch:
    """A chain as one branch."""
    ends = chains.nodes[row, [0, -1]]
    junctions = (int(number[ends[0]]), int(number[ends[1]]))
    return Branch(chains, row, 0, chains.kind.shape[1], junctions, np.zeros(3), chains.arms[row, -1])


def _halved(part: PartBranches, split: NDArray[np.bool_], beam: UniformBeam) -> PartBranches:
    """The same branches with those marked cut in two in the middle."""
    found = PartBranches(part.reducer, [], list(part.cut_nodes))
    for branch, is_split in zip(part.branches, split, strict=True):
        if not is_split:
            found.branches.append(branch)
            continue
        chains, row, middle = branch.chains, branch.row, (branch.first + branch.last) // 2
        at = np.flatnonzero(chains.passed == middle)
        where = _start(chains, row, middle, beam)
        junction = found.n_junctions
        found.cut_nodes.append(int(chains.nodes[row, at[0]]) if len(at) else -1)
        found.branches += [
            replace(branch, last=middle, junctions=(branch.junctions[0], junction), end=where),
            replace(branch, first=middle, junctions=(junction, branch.junctions[1]), pole=where),
        ]
    return found


def _start(chains: ExactChains, row: int, piece: int, beam: UniformBeam) -> Array:
    """Where a piece begins in walking order (3,), from the chain's pole, m; at a node of the part that node."""
    at = np.flatnonzero(chains.passed == piece)
    if len(at):
        return chains.arms[row, at[0]]
    R, S = chains.X[row, piece, :3, :3], chains.X[row, piece, :3, 3:]
    skew = -R.T @ S
    start = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return start + chains.reverse[row, piece] * R[0] * beam.length[chains.kind[row, piece]]
