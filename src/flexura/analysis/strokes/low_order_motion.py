"""Large motion at low order: substructures as fine as the motion asks for, and how far the result is off."""

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

TOLERANCE = 1e-3
"""Error of motions and forces above which substructures are made finer, and of which results warn."""

FREQUENCIES = 5e-3
"""Difference of frequencies at rest from those of the full order, likewise."""

ROUGH = 0.05
"""Difference of frequencies at the ends above which substructures are made finer."""

ROUNDS = 6
"""Times that substructures are made finer at most."""

MODES = 24
"""Modes of kinds of substructures that are kept at most."""

LEADING = 0.3
"""Share of the largest error from which a kind of substructures is made finer."""

RIGID = 1e-3
"""Frequency over the largest one, below which something moves freely."""

SHOWN = 3
"""Names that are told."""


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
        more = " and others" if len(self.finer) > SHOWN else ""
        finer = f"; made finer for this: {', '.join(self.finer[:SHOWN])}{more}" if self.finer else ""
        return (
            f"corotational reduced model, {self.coordinates} coordinates instead of {self.full}: off by"
            f" {self.error:.1g} in displacements and forces of drives, by the step to equilibrium that is left to the"
            f" full order, and by {self.frequency_error:.1g} in frequencies, undeformed and at the ends{finer}"
        )

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Where it is not as close to the full order as it should be."""
        found = []
        for value, limit, what in (
            (self.error, TOLERANCE, "displacements or forces of drives"),
            (self.frequency_error, FREQUENCIES, "frequencies"),
        ):
            if not value <= limit:
                text = f"the low order is off by {value:.2g} in {what}: take the full order"
                found.append(Diagnostic("reduction", "", value, limit, "1", text))
        return tuple(found)


class Settled(NamedTuple):
    """The number of the walk, the equations of its low order, its states on the full one, and what is to be said."""

    walk: int
    equations: Equations
    compared: Comparison
    said: LowOrderMotion


def low_order_motion(
    full: Equations, nodes: Iterable[int], walk: Callable[[Equations], list[Equilibrium]], n: int
) -> Settled:
    """The low order on which a motion is as near to the full one as is asked for, or as it gets.

    `walk` finds the states of the motion. The frames of `nodes`, by number, are kept, and `n` frequencies compared.
    Where it finds none, all substructures are made finer. Raises SolverError for what `walk` does then, too, and for
    substructures without equilibrium at rest.
    """
    kept = kept_frames(full.model)
    kept[full.model.root[list(nodes)]] = True
    kept[[drive.root for drive in full.drives]] = True
    turning, off = _quick_enough(full, TurningModel.of(full.model, kept), n)
    best: Settled | None = None
    number = 0
    for left in reversed(range(ROUNDS)):
        equations = Equations(turning.low, full.drives)
        try:
            states = walk(equations)
        except SolverError:
            finer = turning.finer(range(len(turning.kinds))) if left else None
            if finer is None and best is None:
                raise
            if finer is None:
                break
            turning = finer
            continue
        compared = against_full(turning, equations, full, states)
        error = float(compared.error.max(initial=0.0))
        ends = [(states[k], compared.states[k]) for k in {0, len(states) - 1} if states]
        now = max([off, *(_off(Pose(equations, own), Pose(full, there), n) for own, there in ends)])
        said = LowOrderMotion(turning.low.n_dof, full.model.n_dof, error, now, turning.made_finer)
        if best is None or max(error, now) < max(best.said.error, best.said.frequency_error):
            best = Settled(number, equations, compared, said)
        number += 1
        coarse = compared.share if error > TOLERANCE else compared.stiffness if now > ROUGH else None
        finer = None if coarse is None else turning.finer(_worst(coarse))
        if finer is None:
            break
        turning = finer
    assert best is not None
    return best


def _worst(of_kinds: Mapping[int, Array]) -> list[int]:
    """The kinds that are furthest off."""
    most = {kind: float(np.nan_to_num(own, nan=np.inf).max(initial=0.0)) for kind, own in of_kinds.items()}
    return [kind for kind, own in most.items() if own >= LEADING * max(most.values())]


def _quick_enough(full: Equations, turning: TurningModel, n: int) -> tuple[TurningModel, float]:
    """A low order whose n lowest frequencies at rest are those of the full one, and by how much they differ.

    Modes of substructures by themselves are kept, from the slowest on.
    """
    zero = np.zeros(len(full.drives))
    exact = Pose(full, full.solve(full.model.rest, targets=zero))
    for _ in range(MODES):
        equations = Equations(turning.low, full.drives)
        error = _off(Pose(equations, equations.solve(full.model.rest, targets=zero)), exact, n)
        quicker = turning.quicker() if error > FREQUENCIES else None
        if quicker is None:
            break
        turning = quicker
    return turning, error


def _off(own: Pose, exact: Pose, n: int) -> float:
    """The largest relative difference of n frequencies, actuators free and locked."""
    found = 0.0
    for held in (False, True):
        f, g = (_frequencies(pose, n, held) for pose in (own, exact))
        if len(f) < len(g):
            return np.inf
        found = max(found, float((np.abs(f - g) / np.maximum(np.abs(g), RIGID * np.abs(g).max())).max()))
    return found


def _frequencies(pose: Pose, n: int, held: bool) -> Array:
    """The n lowest natural frequencies (n,), rad/s, negative ones of a state that is unstable."""
    values = pose.held_values(n) if held else pose.modes(n).values
    return np.sign(values) * np.sqrt(np.abs(values))
