"""Assembly of a mechanism over the ends of its chains, many designs at once, with a bound on what is left out.

The coordinates are the displacements of every node that no chain passes through, held ones left out, and the kept
motions of the chains' interiors: those inside branches in the axes of these, and those of the core.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.linalg import GUARD, Eigenpairs, lowest, scaled, unit_scale
from flexura.records import Latest
from flexura.reduction.assembly import low_order, refuse_impossible
from flexura.reduction.branches import (
    Arrow,
    Block,
    BranchLayout,
    Copy,
    EndMatrices,
    find_branches,
    interface_maps,
    part_transforms,
)
from flexura.reduction.chain_moments import interior_modes, moments, stiffness_and_mass
from flexura.reduction.parts import PartReducer
from flexura.reduction.placing import Part, Places, Targets, bordered, copies_in_a_row, placed_sums, stacked
from flexura.reduction.pole_frame import PoleFrame
from flexura.structure import Design, DiscreteElement, Plan, block_diagonal, joined_along

STIFFER_BRANCHES = 0.2
"""Largest ratio of the highest squared frequency asked for to the lowest of a branch by itself, its interface held, at
which branches are eliminated."""

CORE_MASS = 1e-8
"""Least part of the core's mass, scaled, in any of its directions with which frequencies follow from it."""

ChainKind = tuple[str, int]
"""A group of chains of equal length: its prototype, and its position among that prototype's groups."""


@dataclass(frozen=True)
class _Placed:
    """Where copies of a part stand: the `copies` (k,) themselves, the instance in whose axes each is placed, the
    coordinates (k, nodes, 6) of the nodes used, -1 where held, and which of these meet the core."""

    copies: list[int]
    base: list[int]
    place: Index
    meets: NDArray[np.bool_]


@dataclass(frozen=True)
class _Maps:
    """What depends on geometry alone: sets of chains and where they go, where the discrete elements go, and T of every
    block."""

    chains: list[tuple[PoleFrame, Places]]
    discrete_elements: list[Places]
    T: list[Array]


class ChainAssembler:
    """Numbers the ends of all chains of a plan and assembles their moments, springs, bodies and superelements.

    Chains of equal length and equally many kept motions are worked out together, whatever their prototypes.
    """

    def __init__(self, plan: Plan, reducers: dict[str, PartReducer]) -> None:
        self.plan = plan
        self.reducers = reducers
        sizes = np.cumsum([0, *(len(part.connectivity) for part in plan.parts.values())]).tolist()
        self._first = dict(zip(plan.parts, sizes, strict=False))
        self.branches: BranchLayout = find_branches(
            plan, {name: reducer.remaining for name, reducer in reducers.items()}
        )
        self._is_of_boundaries: bool = all(
            len(reducer.remaining) == len(reducer.part.boundary) for reducer in reducers.values()
        )
        self._row = {name: {int(n): k for k, n in enumerate(own.remaining)} for name, own in reducers.items()}
        kinds = [(name, g) for name, reducer in reducers.items() for g in range(len(reducer.chains))]
        self.forces: dict[ChainKind, Array] = {
            (name, g): np.zeros((*reducers[name].chains[g].elements.shape, 12, 0)) for name, g in kinds
        }
        """Forces to which the kept motions of every kind of chain are the response."""
        self._number()

    def _rows(self, name: str, nodes: Index | list[int]) -> Index:
        return np.array([self._row[name][int(n)] for n in np.ravel(nodes)], dtype=np.intp)

    def _number(self) -> None:
        """Number the coordinates for the kept motions that there are: blocks of branches, then the core."""
        self._latest: Latest[_Maps] = Latest()
        self._frames: dict[tuple[ChainKind, ...], Latest[PoleFrame]] = {}
        self._starts: dict[int, Eigenpairs] = {}
        self._arrows: dict[int, bool] = {}
        topology, branches = self.plan.topology, self.branches
        self._sets: dict[tuple[int, int], list[ChainKind]] = {}
        for kind, forces in self.forces.items():
            self._sets.setdefault((forces.shape[1], forces.shape[-1]), []).append(kind)
        shapes: dict[tuple[int, int], list[int]] = {}
        for number, kind in enumerate(branches.kinds):
            shapes.setdefault((kind.inside + self._kept(kind.copies), 6 * kind.nodes.shape[1]), []).append(number)
        self._blocks = [(inside, inside + ends, kinds) for (inside, ends), kinds in shapes.items()]
        self.n_core: int = branches.n_core + self._kept(branches.core_copies)
        placed: dict[str, list[tuple[int, int, Index, NDArray[np.bool_]]]] = {name: [] for name in self.reducers}
        self._modal: dict[tuple[ChainKind, int], Index] = {}
        vectors, entries = 0, 0
        zones: dict[Copy, tuple[int, int, int]] = {}
        for inside, n, kinds in self._blocks:
            for number in kinds:
                kind = branches.kinds[number]
                first = kind.inside
                for copy, place, meets in zip(kind.copies, kind.place, kind.meets, strict=True):
                    shifted = np.where(place >= kind.inside, place + inside - kind.inside, place)
                    placed[copy[0]].append((copy[1], kind.instances[0], shifted, meets))
                    zones[copy] = (vectors, entries, n)
                    first = self._number_modes(copy, first)
                vectors, entries = vectors + n, entries + n * n
        first = branches.n_core
        for copy in branches.core_copies:
            name, k = copy
            nodes = topology.copies[name].offset[k] + self.reducers[name].remaining
            place = branches.core[topology.root[nodes]]
            placed[name].append((k, 0, place, np.zeros(len(nodes), dtype=bool)))
            zones[copy] = (vectors, entries, self.n_core)
            first = self._number_modes(copy, first)
        self._size = vectors + self.n_core, entries + self.n_core**2
        self._placed: dict[str, _Placed] = {}
        for name, entries_of in placed.items():
            copies, base, place, meets = zip(*entries_of, strict=True)
            self._placed[name] = _Placed(list(copies), list(base), np.stack(place), np.stack(meets))
        self.order: int = self.n_core + sum(
            inside * len(branches.kinds[number].instances) for inside, _, kinds in self._blocks for number in kinds
        )
        self._zones = zones
        self._index()

    def _kept(self, copies: list[Copy]) -> int:
        """Kept motions of the chains of some copies."""
        return sum(
            forces.shape[0] * forces.shape[-1] * sum(name == prototype for prototype, _ in copies)
            for (name, _), forces in self.forces.items()
        )

    def _number_modes(self, copy: Copy, first: int) -> int:
        for (name, g), forces in self.forces.items():
            if name == copy[0]:
                c, kept = forces.shape[0], forces.shape[-1]
                self._modal[(name, g), copy[1]] = first + np.arange(c * kept).reshape(c, kept)
                first += c * kept
        return first

    def _index(self) -> None:
        """Where rows and entries of all that is placed go in the vectors and matrices of blocks and core."""
        rows, entries = [], []
        for kinds in self._sets.values():
            for kind in kinds:
                name, g = kind
                place = self._placed[name].place[:, self._rows(name, self.reducers[name].chains[g].nodes[:, [0, -1]])]
                ends = place.reshape(len(place), -1, 12)
                modal = np.stack([self._modal[kind, k] for k in self._placed[name].copies])
                self._add(rows, entries, name, np.concatenate([ends, modal], axis=-1))
        for name, reducer in self.reducers.items():
            for nodes, _, _ in reducer.part.discrete_nodes():
                place = self._placed[name].place[:, self._rows(name, nodes)]
                self._add(rows, entries, name, place.reshape(len(place), 1, -1))
        self._targets = Targets(entries, rows, (self._size[1] + 1, self._size[0] + 1))

    def _add(self, rows: list[Index], entries: list[Index], name: str, place: Index) -> None:
        """Targets of matrices at coordinates (copies, c, n); those of held ones lie one past the end."""
        for k, at in zip(self._placed[name].copies, place, strict=True):
            vector, entry, n = self._zones[name, k]
            rows.append(np.where(at < 0, self._size[0], vector + at))
            both = (at[:, :, None] >= 0) & (at[:, None, :] >= 0)
            entries.append(np.where(both, entry + at[:, :, None] * n + at[:, None, :], self._size[1]))

    def keep(self, counts: Mapping[ChainKind, int], design: Design) -> None:
        """Keep so many fixed-interface modes of each kind of chain, those of a stack of one design."""
        for kind, count in counts.items():
            frame, _ = self._frame([kind], design)
            self.forces[kind] = interior_modes(frame, design.elements, count)
        self._number()

    def _frame(self, kinds: list[ChainKind], design: Design) -> tuple[PoleFrame, list[Array]]:
        """The chains of some kinds in the geometry of a design, and the maps to their coordinates from displacements of
        their ends."""
        groups = [self.reducers[name].chains[g] for name, g in kinds]
        kin = [self.reducers[name].kinematics(design.geometry)[g] for name, g in kinds]

        def found() -> PoleFrame:
            numbers = [g.elements + self._first[name] for (name, _), g in zip(kinds, groups, strict=True)]
            reverse = np.concatenate([group.reverse for group in groups])
            X, inverse = joined_along([k.Xd for k in kin], -4), joined_along([k.Xj_inverse for k in kin], -4)
            return PoleFrame(np.concatenate(numbers), reverse, X, inverse)

        latest: Latest[PoleFrame] = self._frames.setdefault(tuple(kinds), Latest())
        return latest.get(tuple(kin), found), [k.B for k in kin]

    def _maps(self, design: Design) -> _Maps:
        def found() -> _Maps:
            chains, discrete_elements = [], []
            for (_, kept), kinds in self._sets.items():
                frame, ends = self._frame(kinds, design)
                which, L, size, first = [], [], [], 0
                for (name, g), B in zip(kinds, ends, strict=True):
                    nodes = self.reducers[name].chains[g].nodes[:, [0, -1]]
                    G = self._transforms(design, name, nodes)
                    T = block_diagonal(G.reshape(*G.shape[:-3], len(nodes), 2, 6, 6))
                    L.append(copies_in_a_row(B[..., None, :, :, :] @ T))
                    size.append(copies_in_a_row(abs(B)[..., None, :, :, :] @ abs(T)))
                    which.append(np.tile(first + np.arange(len(nodes)), len(self._placed[name].copies)))
                    first += len(nodes)
                whole = [bordered(joined_along(maps, -3), kept) for maps in (L, size)]
                chains.append((frame, Places(np.concatenate(which), *whole)))
            for name, reducer in self.reducers.items():
                for nodes, _, _ in reducer.part.discrete_nodes():
                    T = block_diagonal(self._transforms(design, name, np.array(nodes)))
                    discrete_elements.append(Places(np.zeros(T.shape[-3], dtype=np.intp), T, abs(T)))
            return _Maps(chains, discrete_elements, [self._interface(design, kinds) for _, _, kinds in self._blocks])

        return self._latest.get(design.geometry, found)

    def _transforms(self, design: Design, name: str, nodes: Index) -> Array:
        placed = self._placed[name]
        flat = np.ravel(nodes)
        meets = placed.meets[:, self._rows(name, flat)]
        return part_transforms(design, name, placed.copies, flat, base=placed.base, meets=meets)

    def _interface(self, design: Design, kinds: list[int]) -> Array:
        """T (..., q, r, i, c) of a block."""
        maps = [interface_maps(design, self.branches.kinds[k], self.branches) for k in kinds]
        most = max(T.shape[-3] for T in maps)
        out = np.zeros((*maps[0].shape[:-3], len(maps), most, maps[0].shape[-2], self.n_core))
        for q, T in enumerate(maps):
            out[..., q, : T.shape[-3], :, : T.shape[-1]] = T
        return out

    def unproven(self, design: Design) -> Arrow:
        """A stack of designs with constraint modes alone and no bounds: R and slack are empty.

        Raises ImpossibleDesignError.
        """
        discrete, maps = self._checked(design)
        parts = []
        for frame, places in maps.chains:
            parts.append(Part(stiffness_and_mass(frame, design.elements), places))
        for element, places in zip(discrete, maps.discrete_elements, strict=True):
            parts.append(Part(stacked(element, len(design.values))[:2], places))
        none = np.zeros((0, len(design.values)))
        return self._arranged(parts, maps.T, none, none)

    def __call__(self, design: Design) -> Arrow:
        """Assemble a stack of designs. Raises ImpossibleDesignError."""
        designs = len(design.values)
        discrete, maps = self._checked(design)
        parts = []
        slowness, loss, slow = np.zeros(designs), np.zeros(designs), {}
        for kinds, (frame, places) in zip(self._sets.values(), maps.chains, strict=True):
            chains = moments(frame, design.elements, np.concatenate([self.forces[kind] for kind in kinds]))
            parts.append(Part(chains.A, places))
            slowness = np.maximum(slowness, chains.slowness.max(axis=-1))
            loss = np.maximum(loss, chains.loss.max(axis=-1))
            first = np.cumsum([0, *(len(self.forces[kind]) for kind in kinds)])
            slow |= {
                kind: float(chains.slowness[:, a:b].max()) for kind, (a, b) in zip(kinds, pairwise(first), strict=True)
            }
        for element, places in zip(discrete, maps.discrete_elements, strict=True):
            parts.append(Part(stacked(element, designs), places))
        return self._arranged(parts, maps.T, slowness * (1 + 1e-6), loss, slow=slow)

    def _checked(self, design: Design) -> tuple[list[DiscreteElement], _Maps]:
        elements = design.discrete_elements
        discrete = [element for name in self.reducers for element in elements[name]]
        refuse_impossible(design.elements, discrete, len(design.values))
        return discrete, self._maps(design)

    def _arranged(
        self,
        parts: list[Part],
        T: list[Array],
        slowness: Array,
        loss: Array,
        *,
        slow: Mapping[ChainKind, float] | None = None,
    ) -> Arrow:
        """Blocks and core of parts at their places; of R and slack there are none where there is no `slow`."""
        r, designs = (len(parts[0].A) if parts else 3), slowness.shape[-1]
        A, d = placed_sums(parts, self._targets, (r, designs), with_spreads=slow is not None)
        blocks, row, entry = [], 0, 0
        for (inside, n, kinds), interface in zip(self._blocks, T, strict=True):
            q = len(kinds)
            rows, entries = slice(row, row + q * n), slice(entry, entry + q * n * n)
            shaped = np.ascontiguousarray(A[..., entries]).reshape(r, designs, q, n, n)
            slack = np.ascontiguousarray(d[..., rows]).reshape(*d.shape[:2], q, n)
            blocks.append(Block(shaped, slack, inside, interface))
            row, entry = rows.stop, entries.stop
        c = self.n_core
        core_A, slack = np.ascontiguousarray(A[..., entry:-1]), np.ascontiguousarray(d[..., row:-1])
        core = EndMatrices(core_A.reshape(r, designs, c, c), slack, slowness, loss)
        return Arrow(tuple(blocks), core, dict(slow or {}))

    def in_core(self, nodes: Index) -> bool:
        """Whether global nodes follow roots in the core."""
        return bool((self.branches.core[self.plan.topology.root[nodes]] >= 0).any(axis=1).all())

    @property
    def core_coordinates(self) -> tuple[Index, Index]:
        """Coordinates of the whole that are translations of roots in the core, and those that are rotations."""
        positioned = self.branches.core[self.plan.topology.has_position]
        first = self.order - self.n_core
        translations, rotations = positioned[:, :3], positioned[:, 3:]
        return first + translations[translations >= 0], first + rotations[rotations >= 0]

    def node_rows(self, design: Design, nodes: Index) -> Array:
        """B (..., k, 6, n): displacements, global frame, of global nodes (k,) that follow the core."""
        D, _ = design.node_arms(nodes)
        place = self.branches.core[self.plan.topology.root[nodes]]
        place = np.where(place < 0, self.order, self.order - self.n_core + place)
        out = np.zeros((*D.shape[:-2], 6, self.order + 1))
        out[..., np.arange(len(nodes))[:, None, None], np.arange(6)[:, None], place[:, None, :]] = D
        return out[..., :-1]

    def start(self, count: int) -> Eigenpairs:
        """Eigenpairs of the default design from which the search for `count` frequencies of others starts."""
        if count not in self._starts:
            default = self(Design.of(self.plan).stacked()).dense
            pairs = lowest(default.K[0], default.M[0], count + GUARD)
            if rigid := int((pairs.values == 0).sum()):
                pairs = lowest(default.K[0], default.M[0], count + GUARD + min(rigid, 6))
            self._starts[count] = pairs
        return self._starts[count]

    def is_arrow(self, count: int) -> bool:
        """Whether branches by themselves are so much stiffer than the `count` lowest modes that these follow from the
        core, as in the default design."""
        if not self._blocks or count > self.n_core:
            return False
        if count not in self._arrows:
            default = self(Design.of(self.plan).stacked())
            top = float(self.start(count).values[count - 1])
            fastest = [
                np.linalg.eigvals(block.inverse @ block.A[1, ..., : block.inside, : block.inside])
                for block in default.blocks
            ]
            slowest = max(float(abs(values).max()) for values in fastest)
            mass = default.followed[1]
            massive = np.linalg.eigvalsh(scaled(mass, unit_scale(mass)))
            self._arrows[count] = 0 < top * slowest < STIFFER_BRANCHES and bool(
                massive.min() > CORE_MASS * massive.max()
            )
        return self._arrows[count]

    def is_paper(self, count: int) -> bool:
        """Whether `unproven` has the coordinates of constraint modes of whole substructures, and the `count` lowest
        modes follow from the core."""
        return self._is_of_boundaries and self.is_arrow(count)

    def most(self, kind: ChainKind) -> int:
        """How many modes a kind of chain has: as many as its interior has displacements, unless some lack mass."""
        name, g = kind
        return 6 * (self.reducers[name].chains[g].elements.shape[1] - 1)

    def order_with(self, counts: Mapping[ChainKind, int]) -> int:
        """Number of coordinates with so many kept modes."""
        placed = self.plan.topology.copies
        kept = {(name, g): len(forces) * len(placed[name].offset) for (name, g), forces in self.forces.items()}
        now = sum(kept[kind] * forces.shape[-1] for kind, forces in self.forces.items())
        return self.order - now + sum(kept[kind] * count for kind, count in counts.items())


def chain_assembler(plan: Plan, counts: Mapping[ChainKind, int] | None = None) -> ChainAssembler:
    """The prepared assembly of a plan with so many kept modes of its default design."""
    kept = tuple((counts or {}).values())

    def made() -> ChainAssembler:
        assembler = ChainAssembler(plan, low_order(plan).reducers)
        if counts:
            assembler.keep(counts, Design.of(plan).stacked())
        return assembler

    return plan.prepared.once(("chains", kept if any(kept) else ()), made)
