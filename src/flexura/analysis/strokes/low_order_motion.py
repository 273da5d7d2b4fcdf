"""Large motion at low order: substructures as fine as the motion needs, and how far the result is off."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import Diagnostic, SolverError
from flexura.motion import (
    Comparison,
    Equations,
    Equilibrium,
    Pose,
    TurningModel,
    against_full,
    kept_frames,
)
from flexura.records import Record

FORCE_TOLERANCE = 1e-3
"""Error of motions and forces above which substructures are made finer, and of which results warn."""

FREQUENCY_TOLERANCE = 5e-3
"""Difference of frequencies of the undeformed mechanism from those of the full order, likewise."""

ROUGH_FREQUENCIES = 0.05
"""Difference of frequencies at the ends above which substructures are made finer."""

ROUGH_LEAVES = 0.01
"""Likewise for leaves, of which more elements cost little."""

REFINEMENTS = 8
"""Times that substructures are made finer at most."""

MOST_KEPT_MODES = 24
"""Modes of kinds of substructures that are kept at most."""

LEADING_SHARE = 0.3
"""Share of the largest error from which a kind of substructures is made finer."""

STILL = 1e-3
"""Difference of frequencies of the undeformed mechanism up to which amplitudes of bodies stand still."""

RIGID_FREQUENCY = 1e-3
"""Frequency over the largest one, below which something moves freely."""

NAMED_SUBSTRUCTURES = 3
"""Substructures made finer that are named."""


@dataclass(frozen=True, repr=False)
class LowOrderMotion(Record):
    """What represents the full order of `full` displacements: how many `coordinates`, its largest relative `error` over
    all states in displacements and forces of drives, that of the undeformed frequencies and those at the ends,
    actuators free and locked, which substructures were made `finer` for these, and of how many elements `leaves` are,
    one of all that are equal by name, which series of their energy do not reach."""

    coordinates: int
    full: int
    error: float
    frequency_error: float
    finer: tuple[str, ...]
    leaves: Mapping[str, int]

    @property
    def note(self) -> str:
        """How it was found."""
        more = " and others" if len(self.finer) > NAMED_SUBSTRUCTURES else ""
        finer = f"; made finer for this: {', '.join(self.finer[:NAMED_SUBSTRUCTURES])}{more}" if self.finer else ""
        counts = ", ".join(f"{name} {count}" for name, count in list(self.leaves.items())[:NAMED_SUBSTRUCTURES])
        leaves = f"; elements of leaves, for each that is not equal to others: {counts}" if counts else ""
        return (
            f"corotational reduced model, {self.coordinates} coordinates instead of {self.full}: off by"
            f" {self.error:.1g} in displacements and forces of drives, by the step to equilibrium that is left to the"
            f" full order, and by {self.frequency_error:.1g} in frequencies, undeformed and at the ends{finer}{leaves}"
        )

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Where it is not as close to the full order as it should be."""
        warnings = []
        for error, limit, what in (
            (self.error, FORCE_TOLERANCE, "displacements or forces of drives"),
            (self.frequency_error, FREQUENCY_TOLERANCE, "frequencies"),
        ):
            if not error <= limit:
                text = f"the low order is off by {error:.2g} in {what}: take the full order"
                warnings.append(Diagnostic("reduction", "", error, limit, "1", text))
        return tuple(warnings)


class Converged(NamedTuple):
    """The number of the run on the best low order, its states on the full one, and how far it is off."""

    run: int
    states: list[Equilibrium]
    motion: LowOrderMotion


def low_order_motion(
    full: Equations,
    nodes: Iterable[int],
    run: Callable[[Equations], list[Equilibrium]],
    n: int,
    probe: Callable[[Equations], list[Equilibrium]] | None = None,
) -> Converged:
    """The low order on which a motion is as near to the full one as is wanted, or as it gets.

    `run` finds the states of the motion, `probe` a few states of equilibrium like them, which cost less and are made
    good first; frequencies are compared there, else at the ends of the motion. The
    frames of `nodes`, by number, are kept, and `n` frequencies compared. Where no state is found, leaves are made
    finer, and all substructures where there are none. Raises SolverError for what `run` does then, too, and for
    substructures without equilibrium when undeformed.
    """
    kept = kept_frames(full.model)
    kept[full.model.root[list(nodes)]] = True
    kept[[drive.root for drive in full.drives]] = True
    exact = Pose(full, full.solve(full.model.rest, targets=np.zeros(len(full.drives))))
    turning = _without_amplitudes(_with_modes(TurningModel.of(full.model, kept), exact, n), exact, n)
    if probe is None:
        return _Search(full, exact, n, run).best(turning, REFINEMENTS).converged
    found = _Search(full, exact, n, probe).best(turning, REFINEMENTS)
    known = found.converged.motion.frequency_error
    return _Search(full, exact, n, run, known).best(found.turning, REFINEMENTS).converged


class _Candidate(NamedTuple):
    """A low order and what it led to."""

    turning: TurningModel
    converged: Converged

    @property
    def error(self) -> float:
        """The larger one of its errors, over what is wanted."""
        motion = self.converged.motion
        return max(motion.error / FORCE_TOLERANCE, motion.frequency_error / ROUGH_LEAVES)


class _Search(NamedTuple):
    """Looks for the low order for a `run`, whose n frequencies are those of the `exact` pose when undeformed; states
    that are none of equilibrium have no frequencies, and their error is `known`."""

    full: Equations
    exact: Pose
    n: int
    run: Callable[[Equations], list[Equilibrium]]
    known: float | None = None

    def best(self, turning: TurningModel, attempts: int) -> _Candidate:
        """The best low order from one that is tried first."""
        best: _Candidate | None = None
        number = 0
        for remaining in reversed(range(attempts)):
            try:
                found = self._tried(turning, number)
            except SolverError:
                leaves = [kind for kind, own in enumerate(turning.kinds) if turning.is_leaf(own[0])]
                finer = turning.finer(leaves or range(len(turning.kinds))) if remaining else None
                if finer is None and best is None:
                    raise
            else:
                if best is None or found[0].error < best.error:
                    best = found[0]
                number += 1
                finer = self._finer(*found)
            if finer is None:
                break
            turning = finer
        assert best is not None
        return best

    def _tried(self, turning: TurningModel, number: int) -> tuple[_Candidate, Comparison]:
        """A low order, by the number of its run, beside the full one."""
        equations = Equations(turning.low, self.full.drives)
        states = self.run(equations)
        compared = against_full(turning, equations, self.full, states)
        error = float(compared.error.max(initial=0.0))
        frequency_error = self.known
        if frequency_error is None:
            ends = [(states[k], compared.states[k]) for k in {0, len(states) - 1} if states]
            poses = [(Pose(equations, low), Pose(self.full, self._settled(there))) for low, there in ends]
            poses.append((_undeformed(equations), self.exact))
            frequency_error = max(_frequency_error(*pair, self.n) for pair in poses)
        leaves = {own[0].of.name: len(own[0].elements.node) for own in turning.leaves.values()}
        motion = LowOrderMotion(
            turning.low.n_dof, self.full.model.n_dof, error, frequency_error, turning.made_finer, leaves
        )
        return _Candidate(turning, Converged(number, compared.states, motion)), compared

    def _settled(self, state: Equilibrium) -> Equilibrium:
        """The state of equilibrium of the full order next to one where only what is inside has settled: forces along
        leaves are those of a small part of their thickness, and make much of frequencies."""
        try:
            return self.full.solve(state.frames, state.loads, self.full.travelled(state.frames))
        except SolverError:
            return state

    def _finer(self, found: _Candidate, compared: Comparison) -> TurningModel | None:
        """A finer low order where one is wanted."""
        turning, motion = found.turning, found.converged.motion
        if motion.error > FORCE_TOLERANCE:
            return turning.finer(_leading(compared.share), motion.error / FORCE_TOLERANCE)
        if motion.frequency_error > ROUGH_FREQUENCIES:
            return turning.finer(_leading(compared.stiffness), motion.frequency_error / ROUGH_FREQUENCIES)
        leaves = {kind: compared.stiffness[kind] for kind in turning.leaves}
        if motion.frequency_error > ROUGH_LEAVES and leaves:
            return turning.finer(_leading(leaves), motion.frequency_error / ROUGH_LEAVES)
        return None


def _leading(errors: Mapping[int, Array]) -> list[int]:
    """The kinds of substructures that are furthest off."""
    largest = {kind: float(np.nan_to_num(error, nan=np.inf).max(initial=0.0)) for kind, error in errors.items()}
    return [kind for kind, error in largest.items() if error >= LEADING_SHARE * max(largest.values())]


def _with_modes(turning: TurningModel, exact: Pose, n: int) -> TurningModel:
    """A low order whose n lowest frequencies when undeformed are those of the full one.

    Modes of substructures by themselves are kept, from the slowest on.
    """
    for _ in range(MOST_KEPT_MODES):
        error = _frequency_error(_undeformed(Equations(turning.low, exact.equations.drives)), exact, n)
        quicker = turning.quicker() if error > FREQUENCY_TOLERANCE else None
        if quicker is None:
            break
        turning = quicker
    return turning


def _without_amplitudes(turning: TurningModel, exact: Pose, n: int) -> TurningModel:
    """The low order with amplitudes of bodies that stand still, where they are too quick to matter."""
    if turning.full.rest.placed.all():
        return turning
    fewer = turning.without_amplitudes()
    error, had = (
        _frequency_error(_undeformed(Equations(own.low, exact.equations.drives)), exact, n) for own in (fewer, turning)
    )
    return fewer if error <= max(had, STILL) else turning


def _undeformed(equations: Equations) -> Pose:
    """The pose at rest."""
    return Pose(equations, equations.solve(equations.model.rest, targets=np.zeros(len(equations.drives))))


def _frequency_error(low: Pose, exact: Pose, n: int) -> float:
    """The largest relative difference of n frequencies, actuators free and locked."""
    error = 0.0
    for held in (False, True):
        f, g = (_frequencies(pose, n, held) for pose in (low, exact))
        if len(f) < len(g):
            return np.inf
        error = max(error, float((np.abs(f - g) / np.maximum(np.abs(g), RIGID_FREQUENCY * np.abs(g).max())).max()))
    return error


def _frequencies(pose: Pose, n: int, held: bool) -> Array:
    """The n lowest natural frequencies (n,), rad/s, negative ones of a state that is unstable."""
    values = pose.held_values(n) if held else pose.modes(n).values
    return np.sign(values) * np.sqrt(np.abs(values))
