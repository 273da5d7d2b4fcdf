"""The smallest low-order model that is proven to meet a tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexura.deadline import checkpoint
from flexura.errors import OptionError, SolverError
from flexura.linalg import Eigenpairs, Enclosures, count_below, enclose, lowest
from flexura.reduction.assembler import LowOrderAssembler
from flexura.reduction.certificate import HERTZ, Certificate, cluster_end, from_enclosures, shift_beyond
from flexura.reduction.condensation import condense
from flexura.reduction.craig_bampton import CraigBampton
from flexura.reduction.low_order import Coordinates
from flexura.reduction.model import LowOrderModel, assembled
from flexura.structure.plan import Geometry

Array = NDArray[np.float64]

START = 1.5
"""Fixed-interface modes below so many times the highest frequency asked for are kept from the start."""

GROWTH = 1.3
"""Modes below so many times the frequency of the first one left out are added together."""

SHARE = 0.1
"""A substructure is refined when it holds at least this part of the largest share of the residual."""

GUESS = 12
"""Eigenpairs computed at first."""


class _Refinement:
    """Craig-Bampton models of one design with more and more fixed-interface modes, checked against the full order."""

    def __init__(
        self, assembler: LowOrderAssembler, values: Array, geometry: Geometry, up_to: float, exact_at: tuple[str, ...]
    ) -> None:
        self.assembler, self.values, self.geometry, self.exact_at = assembler, values, geometry, exact_at
        self.limit = (HERTZ * up_to) ** 2
        self.up_to = up_to
        self.K, self.M = assembler.plan.full_order(values, geometry)
        matrices = assembler.plan.matrices(values, geometry)
        self.modes: dict[str, CraigBampton] = {
            name: reducer.craig_bampton(matrices[name], geometry) for name, reducer in assembler.reducers.items()
        }
        self.counts = {name: modes.count_below(START * up_to) for name, modes in self.modes.items()}

    def model(self) -> LowOrderModel:
        """The low-order model with the modes kept so far."""
        parts = {name: modes.reduced(self.counts[name]) for name, modes in self.modes.items()}
        return assembled(self.assembler, self.values, self.geometry, parts, self.exact_at)

    def below(self, low: LowOrderModel) -> tuple[Eigenpairs, int]:
        """The lowest eigenpairs of a model and how many of them count: all up to the limit, and what is repeated."""
        wanted = GUESS
        while True:
            pairs = lowest(low.K, low.M, min(wanted, low.order))
            finite = np.isfinite(pairs.values)
            pairs = Eigenpairs(pairs.values[finite], pairs.vectors[:, finite])
            n = int((pairs.values <= self.limit).sum())
            if n + 2 <= len(pairs.values) or wanted >= low.order:
                return pairs, cluster_end(pairs.values, n) if n else 0
            wanted *= 2

    def shares(self, remainder: Array) -> dict[str, float]:
        """Share of residuals (n, k) in the interior of each prototype, all its copies together (theory eq. C6)."""
        density = np.append(np.einsum("ik,ik->i", remainder, self.M @ remainder), 0.0)
        topology = self.assembler.plan.topology
        found = {}
        for name, reducer in self.assembler.reducers.items():
            number = np.array(topology.placed[name].offset, dtype=np.intp)[:, None] + reducer.part.interior
            found[name] = abs(float(density[topology.dof[number].ravel()].sum()))
        return found

    def refine(self, remainder: Array | None) -> list[str]:
        """Keep more modes of the prototypes that hold most of the residual, of all where nothing is known.

        Returns the names of those that have grown; raises SolverError when none can.
        """
        shares = dict.fromkeys(self.modes, 1.0) if remainder is None else self.shares(remainder)
        open_ = {name: share for name, share in shares.items() if self.counts[name] < len(self.modes[name].interior)}
        if not open_:
            raise SolverError("the tolerance is out of reach: every fixed-interface mode is kept, round-off remains")
        largest = max(open_.values())
        grown = [name for name, share in open_.items() if share >= SHARE * largest]
        for name in grown:
            modes, count = self.modes[name], self.counts[name]
            found = modes.normal_modes(count + 1).values
            following = np.sqrt(found[-1]) / HERTZ if len(found) > count else np.inf
            below = modes.count_below(GROWTH * following) if np.isfinite(following) else len(modes.interior)
            self.counts[name] = max(below, count + 1)
        return grown


def reduce_to_tolerance(
    assembler: LowOrderAssembler,
    values: Array,
    geometry: Geometry,
    exact_at: tuple[str, ...],
    tolerance: float,
    up_to: float,
    coordinates: Coordinates,
) -> LowOrderModel:
    """The smallest model of which every frequency up to `up_to` Hz is proven to be within `tolerance`, relative.

    Raises OptionError for impossible options, or when there is no frequency up to up_to, and SolverError when the
    tolerance is beyond round-off.
    """
    _refuse_impossible(tolerance, up_to, coordinates)
    work = _Refinement(assembler, values, geometry, up_to, exact_at)
    grown: list[str] = []
    while True:
        checkpoint()
        low = work.model()
        pairs, n = work.below(low)
        if not n:
            _refuse_empty(work)
            grown += work.refine(None)
            continue
        vectors = low.recover(pairs.vectors[:, :n])
        enclosures = enclose(work.K, work.M, vectors, shift_beyond(pairs.values, n, up_to))
        proof = from_enclosures(pairs.values[:n], enclosures)
        failing = (proof.error_bound > tolerance) & (pairs.values[:n] > 0)
        if proof.is_complete and not failing.any():
            return _in_coordinates(replace(low, certificate=proof), pairs, n, _reason(work, grown, proof), coordinates)
        grown += work.refine(_failing(enclosures, failing if proof.is_complete else np.ones(n, dtype=bool)))


def _failing(enclosures: Enclosures, failing: NDArray[np.bool_]) -> Array:
    return enclosures.remainder[:, failing]


def _refuse_impossible(tolerance: float, up_to: float, coordinates: str) -> None:
    if not (np.isfinite(tolerance) and 0 < tolerance < 1):
        raise OptionError(f"tolerance is a relative error between 0 and 1, such as 1e-3, not {tolerance}")
    if not (np.isfinite(up_to) and up_to > 0):
        raise OptionError(f"up_to is a positive frequency in Hz, not {up_to}")
    if coordinates not in ("modal", "physical", "substructures"):
        raise OptionError(f"coordinates are modal, physical or substructures, not {coordinates!r}")


def _refuse_empty(work: _Refinement) -> None:
    if count_below(work.K, work.M, work.limit) == 0:
        first = np.sqrt(lowest(work.K, work.M, 1).values[0]) / HERTZ
        raise OptionError(f"no natural frequency lies below {work.up_to:g} Hz: the lowest is {first:.5g} Hz")


def _reason(work: _Refinement, grown: list[str], proof: Certificate) -> str:
    kept = {name: count for name, count in work.counts.items() if count}
    words = [f"{name or 'mechanism'} {count}" for name, count in kept.items()]
    modes = f"fixed-interface modes kept: {', '.join(words)}" if words else "constraint modes suffice"
    refined = f" (refined for the tolerance: {', '.join(sorted({g or 'mechanism' for g in grown}))})" if grown else ""
    worst = float(proof.error_bound[proof.frequency_hz > 0].max(initial=0.0))
    return f"{modes}{refined}; {proof.count} frequencies below {proof.below_hz:.5g} Hz, proven within {worst:.1g}"


def _in_coordinates(
    low: LowOrderModel, pairs: Eigenpairs, n: int, reason: str, coordinates: Coordinates
) -> LowOrderModel:
    """The model in the coordinates asked for; no model with fewer than n of them has n frequencies."""
    low = replace(low, steps=(*low.steps, reason))
    if coordinates == "substructures":
        return low
    step = f"order {n}: no smaller model has the {n} frequencies that the inertia count proves"
    if coordinates == "modal":
        small = low.projected(pairs.vectors[:, :n], [f"mode {k + 1}" for k in range(n)], f"modal coordinates; {step}")
    else:
        small = condense(low, n, "serep")
        small = replace(small, steps=(*small.steps, step))
    return replace(small, certificate=low.certificate)
