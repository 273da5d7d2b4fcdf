"""Calibration: the parameters of a mechanism found from measured frequencies, shapes and frequency responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.mechanism import Mechanism
from flexura.sensitivity import ModelOrder
from flexura.structure import Plan, one_design
from flexura.testing.updating.calibrated import CalibratedMode, CalibratedParameter, Calibration, Method
from flexura.testing.updating.posterior import (
    LEAST_REDUCTION,
    QUANTILE,
    UNLIKELY,
    Direction,
    Misfit,
    covariance,
    directions,
    misfits,
    widening,
)
from flexura.testing.updating.problem import (
    CalibrationProblem,
    Configuration,
    Prior,
    Unknowns,
    configurations,
    unknowns,
)
from flexura.testing.updating.targets import ModalTarget, Target, targets_of

Pairing = Literal["tracked", "in_order"]

ROUNDS = 4
"""Times that the ends which corrections hold clamped are settled anew at the sizes found."""

AT_BOUND = 1e-3
"""Distance in prior standard deviations within which a parameter counts as at its bound."""


@verb
def calibrate(
    model: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    data: Any,
    free: Sequence[str],
    also: Sequence[tuple[Mechanism | Plan, Any]] = (),
    method: Method = "map",
    sigma: float = 0.01,
    shape_sigma: float = 0.1,
    response_sigma: float = 0.1,
    damping: float = 0.01,
    priors: Mapping[str, Prior] | None = None,
    order: ModelOrder = "full",
    keep: int | Mapping[str, int] = 0,
    pairing: Pairing = "tracked",
    max_steps: int = 60,
) -> Calibration:
    """Find the parameters `free` with which a mechanism meets a measurement (theory eqs. K13-K18).

    `data`: frequencies in Hz, `MeasuredFrequencies`, `IdentifiedModes`, `MeasuredFRF`, a `Measurement`, or a list of
    these. Frequencies are compared by their logarithm with the relative standard deviation `sigma` where the data bring
    none or less, shapes by what no scaling of the model's explains with `shape_sigma` of their length, frequency
    responses by the logarithm of their ratio with `response_sigma`, modes having the ratio `damping`.

    `also` are further mechanisms with data of their own, as of the same design with other sensors or other loads: a
    parameter is one unknown for all that have one of its name, with one start and one range. `parameters` replaces
    values in each mechanism that has them.

    `method`: map weighs the data against priors, which are given (a relative standard deviation, or mean and standard
    deviation, by name), or follow from each parameter's bounds and `source`; least_squares has bounds alone. The search
    makes Gauss-Newton steps within a trust region (Branch, Coleman and Li 1999) with analytic sensitivities. `order`
    and `keep` as in `mode_sensitivities`. The standard deviations have to cover what the model leaves out, too.

    Modes with measured shapes are paired by these. Frequencies alone belong to the start's modes of the same number,
    which are tracked by their shapes while parameters move (`pairing="tracked"`), or to whichever modes have that
    number (`in_order`).

    Raises ModelError for a description that cannot be used, OptionError for impossible arguments and SolverError when
    the start cannot be solved.
    """
    if method not in get_args(Method):
        raise OptionError(f"method is map or least_squares, not {method!r}")
    for name, x in (("sigma", sigma), ("shape_sigma", shape_sigma), ("response_sigma", response_sigma)):
        if not 0 < x < np.inf:
            raise OptionError(f"{name} is positive and finite, not {x}")
    if pairing not in get_args(Pairing):
        raise OptionError(f"pairing is tracked or in_order, not {pairing!r}")
    if not 0 < damping < 1:
        raise OptionError(f"damping is a ratio between 0 and 1, not {damping}")
    at = one_design(parameters)
    pairs = [
        (own, targets_of(measured, sigma, shape_sigma, response_sigma, damping))
        for own, measured in ((model, data), *also)
    ]
    together = configurations(pairs, free, at)
    own = unknowns(together, at, priors)
    if method == "least_squares":
        _refuse_undetermined([t for c in together for t in c.targets], own.names)
    return _solved(together, own, method, order, keep, max_steps, pairing == "tracked")


def _refuse_undetermined(targets: Sequence[Target], chosen: Sequence[str]) -> None:
    count = sum(
        len(t.frequency_hz) * (1 if t.shapes is None else len(t.channels)) if isinstance(t, ModalTarget) else 10**6
        for t in targets
    )
    if count < len(chosen):
        raise OptionError(
            f"{count} data cannot determine {len(chosen)} parameters by least squares: free fewer, or use method map"
        )


def _solved(
    together: tuple[Configuration, ...],
    own: Unknowns,
    method: Method,
    order: ModelOrder,
    keep: int | Mapping[str, int],
    max_steps: int,
    tracked: bool,
) -> Calibration:
    first = CalibrationProblem(together, own, order, keep, tracked=tracked)
    z = own.z(own.start)
    before = first.residual(z)
    if first.refused is not None:
        raise SolverError(f"the start cannot be compared with the data: {first.refused}")
    start_modes = _compared(first, z)
    problem, evaluations, converged = first, 0, False
    mechanisms = [c.bounded.mechanism for c in together]
    notes: list[str] = []
    for turn in range(ROUNDS):
        z, converged = _minimum(problem, z, method, max_steps)
        evaluations += problem.evaluations
        mechanisms = [_with_values(c, own, z, first.targets) for c in together]
        if not any(part.table.corrections.wanted.any() for c in together for part in c.plan.parts.values()):
            break
        anew = [c.settled(mechanism) for c, mechanism in zip(together, mechanisms, strict=True)]
        settled = CalibrationProblem(anew, own, order, keep, problem.references, tracked)
        moved = float(np.abs(settled.residual(z) - problem.residual(z)).max(initial=0.0))
        problem = settled
        if moved < 1e-6:
            break
        if turn == ROUNDS - 1:
            notes.append("which ends count as clamped depends on the sizes: the residuals jump there")
    values = dict(zip(own.names, map(float, own.values(z)), strict=True))
    for c in together:
        c.bounded.verify(c.point(values))
    J = problem.jacobian(z)
    after = problem.residual(z)
    return _outcome(problem, first, mechanisms, method, z, J, before, after, start_modes, evaluations, converged, notes)


def _minimum(problem: CalibrationProblem, z: Array, method: Method, max_steps: int) -> tuple[Array, bool]:
    """The minimum of |r|^2, plus |z|^2 with a prior, within the bounds, and whether it was reached."""
    with_prior = method == "map"
    low, high = problem.unknown.z_bounds
    room = 1e-9 * np.where(np.isfinite(high - low), high - low, 1.0)
    start = np.clip(z, low + room, high - room)

    def residual(z: Array) -> Array:
        r = problem.residual(z)
        return np.concatenate([r, z]) if with_prior else r

    def jacobian(z: Array) -> Array:
        J = problem.jacobian(z)
        return np.concatenate([J, np.eye(len(z))]) if with_prior else J

    found = least_squares(
        residual, start, jacobian, bounds=(low, high), xtol=1e-9, ftol=1e-10, gtol=1e-9, max_nfev=max_steps
    )
    return np.clip(found.x, low, high), found.status > 0


def _with_values(configuration: Configuration, own: Unknowns, z: Array, targets: Sequence[Target]) -> Mechanism:
    """A mechanism with calibrated values as its own, their sources saying so."""
    described = configuration.bounded.mechanism
    parameters = dict(described.parameters)
    what = _said(targets)
    values = dict(zip(own.names, map(float, own.values(z)), strict=True))
    for name in configuration.free:
        known = parameters[name].source
        source = f"calibrated to {what}" + (f"; before: {known}" if known else "")
        parameters[name] = parameters[name].model_copy(update={"value": values[name], "source": source})
    for name, value in configuration.fixed.items():
        parameters[name] = parameters[name].model_copy(update={"value": value})
    return described.model_copy(update={"parameters": parameters})


def _said(targets: Sequence[Target]) -> str:
    frequencies = sum(len(t.frequency_hz) for t in targets if isinstance(t, ModalTarget))
    shapes = any(isinstance(t, ModalTarget) and t.shapes is not None for t in targets)
    responses = sum(not isinstance(t, ModalTarget) for t in targets)
    parts = [f"{frequencies} measured frequencies" + (" and shapes" if shapes else "")] if frequencies else []
    parts += [f"{responses} sets of frequency responses"] if responses else []
    names = ", ".join(dict.fromkeys(t.name for t in targets if isinstance(t, ModalTarget) and t.name))
    return " and ".join(parts) + (f" of {names}" if names else "")


def _compared(problem: CalibrationProblem, z: Array) -> list[tuple[Array, NDArray[np.intp], list[float | None]]]:
    """For every modal target the model's frequencies, mode numbers and MAC."""
    found = []
    for target, state, rows in problem.compared(z):
        if isinstance(target, ModalTarget):
            partner = target.partner(state, rows)
            found.append((state.frequency_hz[partner], partner, target.mac(state, rows)))
    return found


def _outcome(
    problem: CalibrationProblem,
    first: CalibrationProblem,
    mechanisms: Sequence[Mechanism],
    method: Method,
    z: Array,
    J: Array,
    before: Array,
    after: Array,
    start_modes: list[tuple[Array, NDArray[np.intp], list[float | None]]],
    evaluations: int,
    converged: bool,
    notes: list[str],
) -> Calibration:
    own = problem.unknown
    missed = misfits(problem.targets, after, J, method == "map")
    cov = covariance(J, method == "map") + widening(missed, J, method == "map")
    deviation = np.sqrt(np.diagonal(cov))
    low, high = own.z_bounds
    at_bound = (z - low < AT_BOUND) | (high - z < AT_BOUND)
    informed = np.diagonal(covariance(J, True) + widening(missed, J, True))
    intervals = [_interval(own, z, deviation), _interval(own, np.zeros_like(z), np.ones_like(z))]
    values = own.values(z)
    parameters = tuple(
        CalibratedParameter(
            name,
            next(c.known[name].unit for c in problem.configurations if name in c.free),
            float(own.start[k]),
            float(values[k]),
            intervals[0][k],
            intervals[1][k],
            own.reason[k],
            float(np.clip(1 - informed[k], 0.0, 1.0)),
            bool(at_bound[k]),
        )
        for k, name in enumerate(own.names)
    )
    modes = _modes(problem, z, start_modes)
    warnings = _warnings(missed, None if converged else evaluations)
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = np.nan_to_num(cov / np.outer(deviation, deviation), nan=0.0)
    np.fill_diagonal(correlation, 1.0)
    ways = directions(J, own.names)
    chi, count = float(after @ after), int((np.abs(J).sum(axis=1) > 0).sum())
    notes += _notes(problem, first, parameters, ways, modes, missed)
    return Calibration(
        mechanisms[0],
        method,
        parameters,
        modes,
        ways,
        correlation,
        chi,
        float(before @ before),
        count,
        evaluations + problem.evaluations,
        converged,
        problem,
        z,
        cov,
        tuple(mechanisms[1:]),
        missed,
        tuple(notes),
        tuple(warnings),
    )


def _interval(own: Unknowns, z: Array, deviation: Array) -> list[tuple[float, float]]:
    """95 % intervals in SI, cut at the bounds."""
    low, high = own.z_bounds
    with np.errstate(over="ignore"):
        ends = [own.values(np.clip(z + side * QUANTILE * deviation, low, high)) for side in (-1, 1)]
    return [(float(a), float(b)) for a, b in zip(*ends, strict=True)]


def _modes(
    problem: CalibrationProblem, z: Array, start: list[tuple[Array, NDArray[np.intp], list[float | None]]]
) -> tuple[CalibratedMode, ...]:
    found = []
    several = len(problem.configurations) > 1
    labels = [c.label if several else "" for c in problem.configurations for t in c.targets]
    modal = [(t, own) for t, own in zip(problem.targets, labels, strict=True) if isinstance(t, ModalTarget)]
    for (target, label), before, after in zip(modal, start, _compared(problem, z), strict=True):
        for k, hz in enumerate(target.frequency_hz):
            found.append(
                CalibratedMode(
                    target.numbers[k],
                    float(hz),
                    float(target.sigma[k]),
                    float(before[0][k]),
                    float(after[0][k]),
                    int(after[1][k]) + 1,
                    before[2][k],
                    after[2][k],
                    label,
                )
            )
    return tuple(found)


def _warnings(missed: Sequence[Misfit], stopped: int | None) -> list[Diagnostic]:
    """What the data contradict, and that the search `stopped` after so many steps where it did not converge."""
    found = []
    if stopped is not None:
        text = "the search stopped before it converged: allow more steps, or start nearer"
        found.append(Diagnostic("convergence", "", float(stopped), float(stopped), "1", text))
    for own in missed:
        if own.is_unlikely:
            text = (
                f"the model misses the data: {own.kind} by {own.ratio:.2g} standard deviations where {own.spare:.2g} of"
                f" {own.data} are to spare (probability {own.probability:.1g}): it lacks something that the freed"
                " parameters cannot make up, or sigma is too small; intervals are widened for an error of that size,"
                " not for one that the parameters have taken up"
            )
            found.append(Diagnostic("misfit", own.kind, own.probability, UNLIKELY, "1", text))
    return found


def _notes(
    problem: CalibrationProblem,
    first: CalibrationProblem,
    parameters: Sequence[CalibratedParameter],
    ways: Sequence[Direction],
    modes: Sequence[CalibratedMode],
    missed: Sequence[Misfit],
) -> list[str]:
    notes = []
    held = [p.name for p in parameters if p.at_bound]
    if held:
        notes.append(f"at a bound, where there is no interval: {', '.join(held)}")
    unresolved = [d for d in ways if d.variance_reduction < LEAST_REDUCTION]
    if unresolved:
        notes.append(f"{len(unresolved)} of {len(ways)} combinations of parameters are left to the prior")
    for own in missed:
        if not own.is_testable:
            notes.append(
                f"the parameters take up all {own.data} {own.kind}: nothing is left to check the model by, and"
                " intervals hold if sigma covers what it leaves out"
            )
        elif own.ratio > 1 and not own.is_unlikely:
            notes.append(
                f"{own.kind} are met to {own.ratio:.2g} standard deviations: intervals are widened as if the model were"
                " off by the rest"
            )
    weakest = min(problem.weakest, first.weakest)
    if weakest < 0.5:
        notes.append(f"modes changed a lot from one step to the next (MAC {weakest:.2f}): check which is which")
    swapped = [
        m.number
        for k, m in enumerate(modes)
        if k and m.number > modes[k - 1].number and m.model_mode < modes[k - 1].model_mode
    ]
    if swapped:
        notes.append(f"the model has measured mode {swapped[0]} below the one before it")
    return notes
