"""The dynamic stiffness method: exact frequency-dependent beams, and frequencies none of which can be missed.

Members are solved exactly (Kolousek 1941; for compliant mechanisms Ling, Howell, Cao and Chen 2020, Applied Mechanics
Reviews 72, 030802), tapered ones as many uniform pieces. Natural frequencies follow from the count of Wittrick and
Williams (1971): below a frequency lie as many as K(omega) has negative eigenvalues, plus those that its eliminated
parts have with their ends held (theory eqs. D9-D12).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.beam import rigid_arm
from flexura.beam.dynamic import Array, Joint, dynamic_beam
from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, lowest, shifted_factors
from flexura.methods.exact_chains import ExactChains, exact_chains
from flexura.methods.solution import Solution
from flexura.reduction.assembler import LowOrderAssembler, low_order
from flexura.reduction.parts import PartReducer
from flexura.structure.full_order import FullOrderModel
from flexura.structure.members import ElementSlice
from flexura.structure.part import Lump
from flexura.structure.segments import segments

HERTZ = 2 * np.pi

TAPERED_PIECES = 16
"""Uniform pieces for every tapered element."""

CONVERGED = 1e-13
"""Relative change of a squared frequency at which it is accepted."""

BRACKETED = 1e-11
"""Relative width of bounds at which a frequency between them is accepted: one of a member with both ends held."""

REPEATED = 1e-10
"""Relative distance of squared frequencies that count as one."""

NEAR = 1e-8
"""Relative size of an eigenvalue of K(omega) that counts as zero when a shape is taken from it."""

VERIFIED = 1e-8
"""Relative distance on both sides of a squared frequency at which counts confirm its number."""

STEPS = 100

NUDGES = (1e-12, -1e-12, 1e-10, -1e-10)
"""Relative moves of a squared frequency at which a member has an eigenvalue of its own, where K is infinite."""


@dataclass(frozen=True)
class _PartAt:
    """One prototype at one frequency: K and slope over its boundary DOFs, J0 of what was eliminated, and what recovers
    the rest: P (r, b) of the remaining nodes and the joints of every group of chains."""

    K: Array
    slope: Array
    J0: int
    P: Array
    levels: list[list[Joint]]


class _ExactPart:
    """One prototype's own part, its members in exact form."""

    def __init__(self, model: FullOrderModel, reducer: PartReducer, pieces: int) -> None:
        self.reducer = reducer
        matrices = model.matrices[reducer.part.name]
        assert isinstance(matrices.elements, ElementSlice)
        self.lumps: list[Lump] = matrices.lumps
        self.chains: list[ExactChains] = []
        self.groups: list[list[int]] = []
        if len(reducer.part.connectivity):
            cut = matrices.elements.cut(pieces, TAPERED_PIECES)
            for group in reducer.chains:
                own = exact_chains(reducer.part, group, model.geometry, cut)
                self.groups.append([len(self.chains) + k for k in range(len(own))])
                self.chains += own

    def at(self, lam: float | complex) -> _PartAt:
        """Everything at one squared angular frequency."""
        K: list[Array] = []
        slope: list[Array] = []
        levels, J0 = [], 0
        for numbers, group in zip(self.groups, self.reducer.chains, strict=True):
            of_K, of_slope = (np.empty((len(group.nodes), 12, 12), dtype=np.asarray(lam).dtype) for _ in range(2))
            for number in numbers:
                chains = self.chains[number]
                own, joints = chains.joined(lam)
                Bt = np.swapaxes(chains.B, -1, -2)
                at = chains.members
                of_K[at], of_slope[at] = Bt @ own.K @ chains.B, Bt @ own.slope @ chains.B
                J0 += int(own.J0.sum())
                levels.append(joints)
            K.append(of_K)
            slope.append(of_slope)
        return self._eliminated(lam, K, slope, J0, levels)

    def _eliminated(
        self, lam: float | complex, K: list[Array], slope: list[Array], J0: int, levels: list[list[Joint]]
    ) -> _PartAt:
        """Assemble chains and lumps over the remaining nodes and eliminate those behind the boundary."""
        whole, rate = self.reducer.assembled_chains(K, slope, lam, self.lumps)
        b = len(self.reducer.boundary_dofs)
        if whole.shape[0] == b:
            return _PartAt(whole, rate, J0, np.zeros((0, b)), levels)
        H = whole[b:, b:]
        d = 1 / np.sqrt(np.abs(np.diagonal(H)))
        H = H * d[:, None] * d
        P = -d[:, None] * np.linalg.solve(H, d[:, None] * whole[b:, :b])
        T = np.concatenate([np.eye(b), P])
        if not np.iscomplexobj(H):
            J0 += int((la.eigvalsh((H + H.T) / 2) < 0).sum())
        return _PartAt(T.T @ whole @ T, T.T @ rate @ T, J0, P, levels)

    def inside(self, own: _PartAt, q: Array) -> Array:
        """Displacements (copies, nodes, 6, k) of all nodes of the part's copies from those of its boundary (copies, b,
        k), in the part's axes."""
        k = q.shape[-1]
        nodes = np.zeros((len(q), self.reducer.part.n_nodes, 6, k), dtype=q.dtype)
        nodes[:, self.reducer.remaining] = np.concatenate([q, own.P @ q], axis=1).reshape(len(q), -1, 6, k)
        for chains, joints in zip(self.chains, own.levels, strict=True):
            ends = nodes[:, chains.nodes[:, [0, -1]]].reshape(len(q), len(chains.nodes), 12, k)
            for copy in range(len(q)):
                twists = chains.twists(joints, ends[copy])[:, chains.passed]
                nodes[copy][chains.nodes] = rigid_arm(chains.arms) @ twists
        return nodes


class DynamicStiffness:
    """The exact dynamic stiffness of a mechanism over the nodes that its substructures keep.

    Elements are cut into `pieces` uniform beams (which changes nothing, being exact, but where a natural frequency is
    one of a member with both ends held). Raises OptionError when there is nothing that moves.
    """

    def __init__(self, model: FullOrderModel, pieces: int = 1) -> None:
        self.model = model
        self.assembler: LowOrderAssembler = low_order(model.plan)
        if not len(self.assembler.physical):
            raise OptionError("every node that the substructures keep is held: cut a member in two to see it move")
        self.parts = {name: _ExactPart(model, reducer, pieces) for name, reducer in self.assembler.reducers.items()}
        self.copies = [len(model.plan.topology.placed[name].paths) for name in self.parts]

    def at(self, omega: float | complex) -> tuple[Array, Array, int]:
        """K (n, n), -dK/d(omega^2) (n, n) and J0 at an angular frequency, rad/s, over the kept nodes' DOFs."""
        K, M, J0, _ = self._at(omega**2)
        return K, M, J0

    def _at(self, lam: float | complex) -> tuple[Array, Array, int, dict[str, _PartAt]]:
        try:
            parts = {name: part.at(lam) for name, part in self.parts.items()}
        except np.linalg.LinAlgError:
            raise SolverError("a member has an eigenvalue of its own at exactly this frequency") from None
        transforms = self.assembler.transforms(self.model.geometry)
        K, M = [], []
        for name, own in parts.items():
            T = transforms[name]
            Tt = np.swapaxes(T, -1, -2)
            K.append(Tt @ own.K @ T)
            M.append(-(Tt @ own.slope @ T))
        scatter = self.assembler.scatter((0,) * len(parts))
        J0 = sum(own.J0 * copies for own, copies in zip(parts.values(), self.copies, strict=True))
        return scatter.dense(K), scatter.dense(M), J0, parts

    def count_below(self, hz: float) -> int:
        """Number of natural frequencies below `hz` (Wittrick and Williams 1971; theory eq. D9)."""
        K, _, J0, _ = self._at((HERTZ * hz) ** 2)
        return J0 + _negative(K)

    def shapes(self, omega: float, vectors: Array) -> Array:
        """Displacements (n_nodes, 6, k) of all nodes, global frame, from those of the kept DOFs (n, k) at omega."""
        _, _, _, parts = self._at(omega**2)
        asm = self.assembler
        topology = asm.plan.topology
        found = np.zeros((topology.n_dof, vectors.shape[1]), dtype=vectors.dtype)
        found[topology.dof.ravel()[asm.physical]] = vectors
        padded = np.vstack([vectors, np.zeros((1, vectors.shape[1]))])
        transforms = asm.transforms(self.model.geometry)
        for name, own in parts.items():
            part = asm.reducers[name].part
            if len(part.interior):
                q = transforms[name] @ padded[asm.coordinates(name, 0, 0)]
                nodes = self.parts[name].inside(own, q)[:, part.interior]
                number = np.array(topology.placed[name].offset, dtype=np.intp)[:, None] + part.interior
                G = asm.plan.node_transforms(name, part.interior, self.model.geometry)
                found[topology.dof[number]] = np.swapaxes(G, -1, -2) @ nodes
        return self.model.node_displacements(found)

    @cached_property
    def estimates(self) -> _Estimates:
        """Where frequencies are looked for first."""
        return _Estimates(self.model)


class _Estimates:
    """Modes of the finite element model: starting points, of no influence on the result."""

    def __init__(self, model: FullOrderModel) -> None:
        self._model = model
        self._found = Eigenpairs(np.empty(0), np.empty((model.order, 0)))

    def _ensure(self, count: int) -> None:
        if count > len(self._found.values):
            pairs = lowest(self._model.K, self._model.M, min(count + 4, self._model.order))
            finite = np.isfinite(pairs.values)
            self._found = Eigenpairs(pairs.values[finite], pairs.vectors[:, finite])

    def values(self, count: int) -> NDArray[np.float64]:
        """At most the `count` lowest squared angular frequencies."""
        self._ensure(count)
        return self._found.values[:count]

    def vectors(self, count: int) -> Array:
        """Their DOF vectors (n, count)."""
        self._ensure(count)
        return self._found.vectors[:, :count]


class _Search:
    """The natural frequency of one number, from 0: Newton's method on the eigenvalue of that number, within bounds from
    counts."""

    def __init__(self, method: DynamicStiffness, number: int) -> None:
        self.method, self.number = method, number
        self.lower, self.upper = 0.0, np.inf

    def look(self, lam: float) -> tuple[NDArray[np.float64], int]:
        """Distances (copies,) from lam to this squared frequency and those after it by the linearised problem, empty
        where that says nothing, and the number of frequencies below lam; narrows the bounds."""
        K, M, J0 = self._evaluate(lam)
        try:
            delta, _ = _pencil(K, M)
        except SolverError:  # next to a pole M is all but of rank one
            delta = np.empty(0)
        below = J0 + _negative(K)
        if below > self.number:
            self.upper = min(self.upper, lam)
        else:
            self.lower = max(self.lower, lam)
        return (delta[self.number - J0 :] if self.number >= J0 else np.empty(0)), below

    def _evaluate(self, lam: float) -> tuple[Array, Array, int]:
        for nudge in (0.0, *NUDGES):
            try:
                K, M, J0, _ = self.method._at(lam * (1 + nudge))
            except SolverError:
                continue
            if np.isfinite(K).all() and np.isfinite(M).all():
                return K, M, J0
        raise SolverError(f"no stable evaluation near {np.sqrt(lam) / HERTZ:.6g} Hz")

    def find(self, start: float) -> list[float]:
        """The squared angular frequency of this number, and all its copies."""
        lam, last = start, np.inf
        for _ in range(STEPS):
            if not self.lower < lam < self.upper:
                lam = (self.lower + self.upper) / 2 if np.isfinite(self.upper) else 2 * max(self.lower, start)
            delta, _ = self.look(lam)
            step = float(delta[0]) if len(delta) else np.nan
            if abs(step) <= CONVERGED * lam:
                copies = self._confirmed(lam + step)
                if copies:
                    return [lam + step, *(lam + delta[1:copies]).tolist()]
            if self.upper - self.lower <= BRACKETED * lam:
                return [(self.upper + self.lower) / 2]
            shrinks = CONVERGED * lam < abs(step) < 0.5 * last
            last = abs(step) if np.isfinite(step) else np.inf
            lam = lam + step if shrinks else np.nan
        raise SolverError(f"natural frequency {self.number + 1} was not found in {STEPS} steps")

    def _confirmed(self, lam: float) -> int:
        """How many frequencies from this number on the counts on both sides of lam show there: at a pole, where
        Newton's method stands still, none."""
        _, below = self.look(lam * (1 - VERIFIED))
        _, above = self.look(lam * (1 + VERIFIED))
        return above - self.number if below <= self.number < above else 0


def dynamic_stiffness(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies by the dynamic stiffness method, and their shapes (theory eqs. D9-D12).

    None is missed: each is found by its number. Raises OptionError when nothing can move, SolverError when a frequency
    is not found.
    """
    method = DynamicStiffness(model)
    start = method.estimates.values(count)
    count = len(start)
    found = [0.0] * int((start == 0).sum())
    top = float(start[-1]) if count and start[-1] > 0 else 1.0
    while len(found) < count:
        k = len(found)
        found += _Search(method, k).find(float(start[k]) if start[k] > 0 else top)
    values = np.sort(found[:count])
    shapes = _shapes(method, values)
    note = "exact for uniform members; none missed (Wittrick and Williams)"
    return Solution("dynamic stiffness", None, np.sqrt(values) / HERTZ, shapes, note)


def _shapes(method: DynamicStiffness, values: NDArray[np.float64]) -> Array:
    """Shapes (n_nodes, 6, k); those of one repeated frequency together."""
    found = []
    k = 0
    while k < len(values):
        lam = float(values[k])
        n = int((np.abs(values[k:] - lam) <= REPEATED * max(lam, 1e-300)).sum())
        found.append(_shape(method, lam, k, n))
        k += n
    return np.concatenate(found, axis=-1)


def _shape(method: DynamicStiffness, lam: float, k: int, n: int) -> Array:
    """The n shapes of one frequency, number k: from the kept nodes where these move, else by inverse iteration on the
    exact stiffness over all nodes."""
    try:
        K, M, _, _ = method._at(lam)
        delta, x = _pencil(K, M)
        nearest = np.argsort(np.abs(delta))[:n]
        if len(nearest) == n and np.abs(delta[nearest]).max() <= NEAR * max(lam, 1.0):
            return method.shapes(float(np.sqrt(lam)), x[:, nearest])
    except (SolverError, ValueError):
        pass
    model = method.model
    cut = segments(model)
    own = dynamic_beam(cut.beam, lam)
    T = _to_twists(cut.beam.length)
    stiff = (np.swapaxes(T, -1, -2) @ own.K @ T)[cut.kind]
    X = cut.transforms
    K = cut.scatter().sparse([np.swapaxes(X, -1, -2) @ stiff @ X]) + cut.K - lam * cut.M
    start = method.estimates.vectors(k + n)[:, k : k + n]
    y = np.vstack([start, np.zeros((cut.n - model.order, n))])
    solve = shifted_factors(K, sp.identity(cut.n, format="csc"), 0.0).solve
    for _ in range(3):
        y = solve(y)
        y /= np.abs(y).max(axis=0)
    return model.node_displacements(y[: model.order])


def _to_twists(length: Array) -> Array:
    """From displacements of both ends, in segment axes, to [t, e] at the first end (..., 12, 12)."""
    arm = np.zeros((*length.shape, 3))
    arm[..., 0] = -length
    T = np.zeros((*length.shape, 12, 12))
    T[..., :6, :6], T[..., 6:, :6] = np.eye(6), -np.eye(6)
    T[..., 6:, 6:] = rigid_arm(arm)
    return T


def _pencil(K: Array, M: Array) -> tuple[NDArray[np.float64], Array]:
    """Eigenvalues, ascending, and vectors of K x = delta M x, M = -dK/d(omega^2) positive definite (theory eq. D10)."""
    d = 1 / np.sqrt(np.diagonal(M))
    try:
        delta, y = la.eigh(K * d[:, None] * d, M * d[:, None] * d)
    except la.LinAlgError:
        raise SolverError("a kept node has no inertia at all: attach a member or a mass to it") from None
    return delta, d[:, None] * y


def _negative(K: Array) -> int:
    d = 1 / np.sqrt(np.abs(np.diagonal(K)))
    return int((la.eigvalsh(K * d[:, None] * d) < 0).sum())
