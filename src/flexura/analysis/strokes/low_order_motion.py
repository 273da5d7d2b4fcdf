"""Large motion at low order: substructures as fine as the motion needs, and how far the result is off."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import Diagnostic, SolverError
from flexura.motion import (
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

REFINEMENTS = 6
"""Times that substructures are made finer at most."""

MOST_KEPT_MODES = 24
"""Modes of kinds of substructures that are kept at most."""

LEADING_SHARE = 0.3
"""Share of the largest error from which a kind of substructures is made finer."""

RIGID_FREQUENCY = 1e-3
"""Frequency over the largest one, below which something moves freely."""

NAMED_SUBSTRUCTURES = 3
"""Substructures made finer that are named."""


@dataclass(frozen=True, repr=False)
class LowOrderMotion(Record):
    """What represents the full order of `full` displacements: how many `coordinates`, its largest relative `error` over
    all states in displacements and forces of drives, that of the undeformed frequencies and those at the ends,
    actuators free and locked, and which substructures were made `finer` for these."""

    coordinates: int
    full: int
    error: float
    frequency_error: float
    finer: tuple[str, ...]

    @property
    def note(self) -> str:
        """How it was found."""
        more = " and others" if len(self.finer) > NAMED_SUBSTRUCTURES else ""
        finer = f"; made finer for this: {', '.join(self.finer[:NAMED_SUBSTRUCTURES])}{more}" if self.finer else ""
        return (
            f"corotational reduced model, {self.coordinates} coordinates instead of {self.full}: off by"
            f" {self.error:.1g} in displacements and forces of drives, by the step to equilibrium that is left to the"
            f" full order, and by {self.frequency_error:.1g} in frequencies, undeformed and at the ends{finer}"
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
    full: Equations, nodes: Iterable[int], run: Callable[[Equations], list[Equilibrium]], n: int
) -> Converged:
    """The low order on which a motion is as near to the full one as is wanted, or as it gets.

    `run` finds the states of the motion. The frames of `nodes`, by number, are kept, and `n` frequencies compared.
    Where it finds none, all substructures are made finer. Raises SolverError for what `run` does then, too, and for
    substructures without equilibrium when undeformed.
    """
    kept = kept_frames(full.model)
    kept[full.model.root[list(nodes)]] = True
    kept[[drive.root for drive in full.drives]] = True
    turning, undeformed_error = _with_modes(full, TurningModel.of(full.model, kept), n)
    best: Converged | None = None
    number = 0
    for remaining in reversed(range(REFINEMENTS)):
        equations = Equations(turning.low, full.drives)
        try:
            states = run(equations)
        except SolverError:
            finer = turning.finer(range(len(turning.kinds))) if remaining else None
            if finer is None and best is None:
                raise
        else:
            compared = against_full(turning, equations, full, states)
            error = float(compared.error.max(initial=0.0))
            ends = [(states[k], compared.states[k]) for k in {0, len(states) - 1} if states]
            poses = [(Pose(equations, low), Pose(full, there)) for low, there in ends]
            frequency_error = max([undeformed_error, *(_frequency_error(*pair, n) for pair in poses)])
            motion = LowOrderMotion(turning.low.n_dof, full.model.n_dof, error, frequency_error, turning.made_finer)
            if best is None or max(error, frequency_error) < max(best.motion.error, best.motion.frequency_error):
                best = Converged(number, compared.states, motion)
            number += 1
            is_rough = frequency_error > ROUGH_FREQUENCIES
            errors = compared.share if error > FORCE_TOLERANCE else compared.stiffness if is_rough else None
            finer = None if errors is None else turning.finer(_leading(errors))
        if finer is None:
            break
        turning = finer
    assert best is not None
    return best


def _leading(errors: Mapping[int, Array]) -> list[int]:
    """The kinds of substructures that are furthest off."""
    largest = {kind: float(np.nan_to_num(error, nan=np.inf).max(initial=0.0)) for kind, error in errors.items()}
    return [kind for kind, error in largest.items() if error >= LEADING_SHARE * max(largest.values())]


def _with_modes(full: Equations, turning: TurningModel, n: int) -> tuple[TurningModel, float]:
    """A low order whose n lowest frequencies when undeformed are those of the full one, and by how much they differ.

    Modes of substructures by themselves are kept, from the slowest on.
    """
    zero = np.zeros(len(full.drives))
    exact = Pose(full, full.solve(full.model.rest, targets=zero))
    for _ in range(MOST_KEPT_MODES):
        equations = Equations(turning.low, full.drives)
        error = _frequency_error(Pose(equations, equations.solve(full.model.rest, targets=zero)), exact, n)
        quicker = turning.quicker() if error > FREQUENCY_TOLERANCE else None
        if quicker is None:
            break
        turning = quicker
    return turning, error


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
