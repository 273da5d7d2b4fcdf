"""The dynamic stiffness method: exact frequency-dependent beams, and frequencies none of which can be missed.

Members are solved exactly (Kolousek 1941; for compliant mechanisms Ling, Howell, Cao and Chen 2020, Applied Mechanics
Reviews 72, 030802), tapered ones as many uniform pieces. Natural frequencies follow from the count of Wittrick and
Williams (1971): below a frequency lie as many as K(omega) has negative eigenvalues, plus those that its eliminated
parts have with their ends held (theory eqs. D9-D12).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.arrays import Index
from flexura.beam import radians
from flexura.deadline import checkpoint
from flexura.errors import OptionError, SolverError
from flexura.linalg import scaled, unit_scale
from flexura.methods.exact_chains import ExactChains, exact_chains, remaining_numbers
from flexura.methods.exact_condensation import ExactCondensation, refuse_large_parts
from flexura.methods.solution import Solution
from flexura.reduction import LowOrderAssembler, PartReducer, exact_order, full_order_modes
from flexura.structure import ElementSlice, FullOrderModel, PartMatrices, node_dofs
from flexura.tables import in_hz

Array = NDArray[Any]

Floats = NDArray[np.float64]

HERTZ = 2 * np.pi

BEYOND = 1.3
"""The condensation reaches so many times the highest squared frequency expected."""

CLEAR = 1.02
"""Least ratio of that limit to the highest squared frequency found."""

SPARE = 30
"""The limit is lowered when it lies above more than twice the frequencies asked for and so many more."""

WINDOW = 1e-5
"""Squared frequencies below so much of the limit of a condensation are worked out from another one."""

CONVERGED = 1e-8
"""Relative step of a squared frequency after which the next, by its square, is below round-off."""

APART = 1e-8
"""Relative distance on both sides of squared frequencies at which counts confirm their numbers; those not three times
as far apart count as one."""

NO_MASS = 1e14
"""Ratio of squared frequencies beyond which the higher is there by round-off in M alone."""

MOST_STEPS = 60


class PartAt(NamedTuple):
    """One prototype at one frequency: K and slope over its boundary DOFs, J0 of what was eliminated."""

    K: Array
    slope: Array
    J0: int


class ExactPart:
    """One prototype's own part, its members in exact form: `chains` in sets of equal numbers of pieces, with the DOFs
    (c, 12) of their `ends` among the remaining nodes, and the number of its placed `copies`."""

    def __init__(self, model: FullOrderModel, reducer: PartReducer, pieces: int) -> None:
        self.reducer = reducer
        self.copies: int = len(model.plan.topology.copies[reducer.part.name].paths)
        matrices = model.matrices[reducer.part.name]
        assert isinstance(matrices.elements, ElementSlice)
        self.matrices: PartMatrices = matrices
        cut = matrices.elements.cut(pieces) if len(reducer.part.connectivity) else None
        self._groups: list[list[ExactChains]] = [
            exact_chains(reducer.part, group, model.geometry, cut) for group in reducer.chains if cut is not None
        ]
        self.chains: list[ExactChains] = [chains for group in self._groups for chains in group]
        number = remaining_numbers(reducer)
        self.ends: list[Index] = [node_dofs(number[chains.nodes[:, [0, -1]]]) for chains in self.chains]

    def at(self, lam: float | complex) -> PartAt:
        """Chains and discrete elements over the remaining nodes at one squared angular frequency, those behind the
        boundary eliminated."""
        K: list[Array] = []
        slope: list[Array] = []
        J0 = 0
        for group, of_group in zip(self.reducer.chains, self._groups, strict=False):
            of_K, of_slope = np.empty((2, len(group.nodes), 12, 12), dtype=np.asarray(lam).dtype)
            for chains in of_group:
                joined, _ = chains.joined(lam)
                Bt = np.swapaxes(chains.B, -1, -2)
                of_K[chains.members], of_slope[chains.members] = Bt @ joined.K @ chains.B, Bt @ joined.slope @ chains.B
                J0 += int(joined.J0.sum())
            K.append(of_K)
            slope.append(of_slope)
        whole, rate = self.reducer.assembled_chains(K, slope, lam, self.matrices)
        b = len(self.reducer.boundary_dofs)
        if whole.shape[0] == b:
            return PartAt(whole, rate, J0)
        H = whole[b:, b:]
        d = unit_scale(H)
        H = scaled(H, d)
        T = np.concatenate([np.eye(b), -d[:, None] * np.linalg.solve(H, d[:, None] * whole[b:, :b])])
        if not np.iscomplexobj(H):
            J0 += int((la.eigvalsh((H + H.T) / 2) < 0).sum())
        return PartAt(T.T @ whole @ T, T.T @ rate @ T, J0)


class DynamicStiffness:
    """The exact dynamic stiffness of a mechanism over the nodes that its substructures keep, at any real or complex
    frequency.

    Elements are cut into `pieces` uniform beams, which changes nothing. Digits are lost next to frequencies of
    eliminated parts with their ends held, where K has poles. Raises OptionError when there is nothing that moves,
    SolverError where the equations are too many.
    """

    def __init__(self, model: FullOrderModel, pieces: int = 1) -> None:
        self.model = model
        self.assembler: LowOrderAssembler = exact_order(model.plan)
        if not len(self.assembler.physical):
            raise OptionError("every node that the substructures keep is held: cut a member in two to see it move")
        refuse_large_parts(self.assembler)
        self.parts: dict[str, ExactPart] = {
            name: ExactPart(model, reducer, pieces) for name, reducer in self.assembler.reducers.items()
        }

    def over_kept(self, rows: Array) -> Array | None:
        """Rows (m, all DOFs) over the kept DOFs; None where they reach others."""
        kept = self.model.plan.topology.dof.ravel()[self.assembler.physical]
        others = np.delete(rows, kept, axis=1)
        return None if others.any() else rows[:, kept]

    def at(self, omega: float | complex) -> tuple[Array, Array, int]:
        """K (n, n), -dK/d(omega^2) (n, n) and J0 at an angular frequency, rad/s, over the kept nodes' DOFs.

        Raises SolverError at a pole.
        """
        lam = omega**2
        try:
            parts = {name: part.at(lam) for name, part in self.parts.items()}
        except np.linalg.LinAlgError:
            raise SolverError("a member has an eigenvalue of its own at exactly this frequency") from None
        transforms = self.assembler.transforms(self.model.design)
        K, M = [], []
        for name, part in parts.items():
            T = transforms[name]
            Tt = np.swapaxes(T, -1, -2)
            K.append(Tt @ part.K @ T)
            M.append(-(Tt @ part.slope @ T))
        scatter = self.assembler.scatter((0,) * len(parts))
        J0 = sum(part.J0 * self.parts[name].copies for name, part in parts.items())
        return scatter.dense(K), scatter.dense(M), J0

    def count_below(self, hz: float) -> int:
        """Number of natural frequencies below `hz` (Wittrick and Williams 1971; theory eq. D9); not to be relied on
        within some 1e-5 of a pole, where `count_below` of the module is."""
        K, _, J0 = self.at(HERTZ * hz)
        return J0 + int((la.eigvalsh(scaled(K, unit_scale(K))) < 0).sum())


def count_below(model: FullOrderModel, hz: float) -> int:
    """Number of natural frequencies below `hz` (Wittrick and Williams 1971; theory eq. D9), zeros among them."""
    lam = (HERTZ * hz) ** 2
    return int(ExactCondensation(model, BEYOND * lam).count_below(np.array([lam]))[0]) if lam > 0 else 0


def dynamic_stiffness(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies by the dynamic stiffness method, and their shapes (theory eqs. D9-D12).

    None is missed: counts on both sides of every frequency confirm its number. Shapes are those of the exact motion,
    with unit modal mass. Raises OptionError when nothing can move, SolverError when counts and frequencies disagree or
    the equations are too many.
    """
    refuse_large_parts(exact_order(model.plan))
    guesses = _guesses(model, count)
    if not any(len(part.elements.length) for part in model.matrices.values()):
        count = len(guesses)  # without members there are no more frequencies
    if not count:
        raise OptionError("nothing with a mass can move in this mechanism")
    values, shapes = np.empty(count), []
    for condensed, numbers, squares in _windows(model, guesses, count):
        values[numbers] = squares
        clusters = _clusters(squares)
        _confirm(condensed, numbers[0], squares, clusters)
        lam = np.concatenate([np.full(len(at), squares[at[0]]) for at in clusters])
        _, vectors = condensed.pencils(lam).solve()
        shapes.insert(0, condensed.node_displacements(lam, vectors[np.arange(len(squares)), :, numbers]))
    note = "exact for uniform members; none missed (Wittrick and Williams)"
    return Solution("dynamic stiffness", None, np.sqrt(values) / HERTZ, np.concatenate(shapes, axis=-1), note)


def _guesses(model: FullOrderModel, count: int) -> Floats:
    """At most `count` squared frequencies of the finite element model, where the search begins; zeros are exact, and
    those that only round-off in M makes finite are left out."""
    if model.order == 0:
        return np.empty(0)
    values = full_order_modes(model, min(count, model.order)).values
    return values[values <= NO_MASS * np.min(values[values > 0], initial=np.inf)] if values.any() else values


def _windows(model: FullOrderModel, guesses: Floats, count: int) -> Iterator[tuple[ExactCondensation, Index, Floats]]:
    """Condensations, highest limit first, each with the numbers of the frequencies taken from it and their squares:
    those that are not too small beside its limit to keep their digits."""
    zero = int((guesses == 0).sum())
    while True:
        condensed, values = _search(model, guesses, count, zero)
        low = np.flatnonzero(values < WINDOW * condensed.limit)
        if len(low) == zero:
            low = low[:0]
        yield condensed, np.arange(len(low), count), values[len(low) :]
        if not len(low):
            return
        guesses, count = values[low], len(low)


def _search(model: FullOrderModel, guesses: Floats, count: int, zero: int) -> tuple[ExactCondensation, Floats]:
    """The mechanism condensed for a limit beyond the lowest `count` squared frequencies, and these; `zero` of them are
    zero."""
    limit = BEYOND * float(guesses[-1]) if len(guesses) >= count and guesses[-1] > 0 else _short_waves(model)
    for _ in range(MOST_STEPS):
        checkpoint()
        condensed = ExactCondensation(model, limit)
        if condensed.count < count:
            limit *= 2
            continue
        if condensed.count > 2 * count + SPARE:
            lam = limit * np.geomspace(1e-3, 1.0, 25)[:-1]
            enough = lam[condensed.count_below(lam) >= count]
            if len(enough) and BEYOND * enough[0] < 0.7 * limit:
                limit = float(BEYOND * enough[0])
                continue
        start = np.full(count, limit)
        start[: len(guesses)] = guesses
        values = _refined(condensed, start, zero)
        if CLEAR * values[-1] <= limit:
            return condensed, values
        limit = BEYOND * float(values[-1])
    raise SolverError(f"no condensation reaches {count} natural frequencies")


def _short_waves(model: FullOrderModel) -> float:
    """A squared frequency at which the longest uniform element is about one radian long."""
    lam = 1.0
    for _ in range(MOST_STEPS):
        waves = max(
            float(np.max(radians(part.elements.cut(1).beam, lam), initial=0.0))
            for part in model.matrices.values()
            if isinstance(part.elements, ElementSlice)
        )
        if 0.5 < waves < 2:
            break
        lam /= waves**2
    return lam


def _refined(condensed: ExactCondensation, start: Floats, zero: int) -> Floats:
    """Squared frequencies from starting values, the first of them zero, all at once: Newton's method on the eigenvalue
    of each number, which comes from above after one step (theory eq. D11). Those below the window are rough."""
    values = np.minimum(start, condensed.limit / CLEAR)
    left, floor = np.arange(zero, len(values)), WINDOW * condensed.limit
    for _ in range(MOST_STEPS):
        if not len(left):
            return np.maximum.accumulate(values)
        lam, place = np.unique(values[left], return_inverse=True)
        delta, _ = condensed.pencils(lam).solve()
        step = delta[place, left]
        values[left] = np.clip(lam[place] + step, 1e-3 * floor, condensed.limit)
        left = left[(np.abs(step) > CONVERGED * values[left]) & (values[left] >= floor)]
    raise SolverError(f"natural frequency {left[0] + 1} was not found in {MOST_STEPS} steps")


def _clusters(values: Floats) -> list[Index]:
    """Positions of squared frequencies that are one repeated frequency."""
    return np.split(np.arange(len(values)), np.flatnonzero(np.diff(values) > 3 * APART * values[1:]) + 1)


def _confirm(condensed: ExactCondensation, first: int, values: Floats, clusters: list[Index]) -> None:
    """Raise SolverError unless counts on both sides of every repeated frequency say that it has its number; that of the
    first of all is `first`."""
    elastic = [at for at in clusters if values[at[0]] > 0]
    if not elastic:
        return
    edges = np.array([values[at[[0, -1]]] * (1 - APART, 1 + APART) for at in elastic])
    below = condensed.count_below(edges.ravel()).reshape(-1, 2)
    number = first + np.array([(at[0], at[-1] + 1) for at in elastic])
    wrong = below != number
    wrong[-1, 1] = below[-1, 1] < number[-1, 1]  # of the last one there may be more copies than were asked for
    if wrong.any():
        hz = np.sqrt(values[elastic[int(np.argmax(wrong.any(axis=1)))][0]]) / HERTZ
        raise SolverError(f"counts do not confirm the number of the natural frequency {in_hz(hz, 9)}")
