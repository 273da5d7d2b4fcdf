"""The modes of one setup: from poles of every order to those that are returned, with evidence and remarks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Complex, Index
from flexura.tables import in_hz
from flexura.testing.identification.evidence import (
    ALIKE_RESIDUES,
    bias,
    close_pairs,
    evidence_of,
    finished,
    is_carried,
    lone_peak,
    residue_mac,
)
from flexura.testing.identification.outputs_alone import at_least_known, judged, motions
from flexura.testing.identification.residues import Fit, fit_modes, fit_shapes
from flexura.testing.identification.stabilisation import (
    PICKED_WITHIN,
    OrderPoles,
    Pick,
    Track,
    chosen,
    diagram,
    picked,
    poles_by_order,
    stability,
    start_values,
    tracks,
)
from flexura.testing.identification.subspaces import SHARE_OF_ORDERS, Subspaces
from flexura.testing.measurement import Correlations, IdentifiedModes, ModeEvidence, Poles, ResponseMatrix

MOST_ORDER = 60
"""Order of the largest model when none is given."""

MOST_SIZE = 160
"""Order times number of references when none is given."""

LINES_PER_ORDER = 4
"""Spectral lines per order at least, when none is given."""

UNSURE = "left out for want of confidence"
"""How a note on such modes begins."""

UNSURE_FREQUENCY, UNSURE_DAMPING = 0.01, 0.3
"""A pole with larger standard deviations of these, relative, is no mode unless it is picked."""

REPEATED_SIGMAS = 3.0
"""Poles that differ by less than so many standard deviations cannot be distinguished: the modes are repeated."""

EQUAL_POLES = 1e-3
"""Nor can poles that differ by so little of their decay rate."""

TWIN_AWAY, TWIN_GAIN = 2.0, 0.5
"""Distance of a peak that is left from a pole, over its decay, up to which a second mode there is tried, and the part
of the misfit up to which it is kept."""

LEFT_OVER, LEFT_SHARE, SMOOTHED = 4.0, 0.1, 5
"""A mode may be missing where what is left, smoothed over lines, exceeds its median and this share of the response."""

TWINS = 0.5
"""Modes nearer than so many half-power half-widths are one if their residues are alike too."""


@dataclass(frozen=True)
class Options:
    """How modes are taken from poles, the same in every setup."""

    picks: Sequence[Pick] | None
    refine: bool
    most_damped: float
    least_confidence: float


@dataclass(frozen=True)
class SetupPoles:
    """Poles of one setup at every order, with their bits of stability, before any are taken for modes.

    The side with fewer channels participates: with more inputs than outputs the `matrix` is fitted transposed.
    `correlations` are those of half spectra of outputs alone, and `subspaces` of these.
    """

    matrix: ResponseMatrix
    correlations: Correlations | None
    subspaces: Subspaces | None
    orders: Sequence[OrderPoles]
    bits: Sequence[NDArray[np.intp]]

    @classmethod
    def of(
        cls,
        matrix: ResponseMatrix,
        correlations: Correlations | None,
        order: int | None,
        most_damped: float,
        by_subspaces: bool,
    ) -> SetupPoles:
        """Those up to an order. Raises OptionError and SolverError for an order that is too high for the data."""
        work = _fitted_matrix(matrix)
        subspaces = Subspaces.of(correlations, work) if correlations is not None and by_subspaces else None
        if subspaces is None:
            orders = poles_by_order(work, order or default_order(work), most_damped)
        else:
            orders = subspaces.orders(order, most_damped)
        return cls(matrix, correlations, subspaces, orders, stability(orders))

    @property
    def diagram(self) -> Poles:
        """The same as a stabilisation diagram shows them."""
        return diagram(self.orders, self.bits)


def _fitted_matrix(matrix: ResponseMatrix) -> ResponseMatrix:
    p, m = matrix.response.shape[1:]
    return matrix.transposed if m > p else matrix


def modes_of(name: str, setup: SetupPoles, options: Options) -> tuple[IdentifiedModes, dict[Pick, str]]:
    """Modes of one setup, and the picks that are not in it, each with why."""
    matrix, correlations, subspaces, orders = setup.matrix, setup.correlations, setup.subspaces, setup.orders
    p, m = matrix.response.shape[1:]
    work = _fitted_matrix(matrix)
    duration = np.inf if correlations is None else correlations.duration
    every = tracks(orders, setup.bits)
    stable = chosen(every, len(orders)) if subspaces is None else chosen(every, len(orders), SHARE_OF_ORDERS)
    wanted, lost = (None, {}) if options.picks is None else picked(every, options.picks, orders)
    fitted = stable if wanted is None else [*wanted, *(t for t in stable if not any(t is w for w in wanted))]
    peak = None if fitted or work.step else lone_peak(work)
    away = {p: why for p, why in lost.items() if peak is None or abs(p.hz - peak.hz) > PICKED_WITHIN * p.hz}
    if peak is not None and (wanted is None or len(away) < len(lost)):
        fit, lost = fit_shapes(work, np.array([peak.pole]), peak.participation), away
        evidence, kept, remarks = [peak.evidence], np.arange(1), [peak.note]
    else:
        fit, fitted = _fitted(work, fitted, orders, options, wanted, subspaces, duration)
        if wanted is None and options.refine:
            fit, fitted = _with_twins(work, fit, fitted, options)
        evidence = [_evidence(track, len(orders), work, fit, k) for k, track in enumerate(fitted)]
        remarks = []
        if correlations is not None:
            evidence, remarks = judged(evidence, fit, work, correlations)
        is_picked = None
        if wanted is not None:
            is_picked = [t.picked is not None and _is_there(work, fit, k, t.picked) for k, t in enumerate(fitted)]
            given = zip(fitted, is_picked, strict=True)
            lost |= {t.picked: _not_there(t.picked) for t, kept in given if t.picked is not None and not kept}
        kept, others = _kept(fit, evidence, is_picked, options.least_confidence)
        remarks += others
    if by_order := [t.picked for t in wanted or () if t.picked is not None and t.picked.order is not None]:
        remarks.append(f"picked, as frequency@order: {', '.join(map(str, by_order))} Hz")
    remarks += _left_over(work, fit)
    fit = fit.at(kept)
    poles, repeated = _equal_poles(fit)
    remarks += close_pairs(work, fit, repeated)
    where = f"setup {matrix.setup!r}: " if matrix.setup else ""
    shapes, participation = fit.shapes * work.row_scale[:, None], fit.participation * work.column_scale[:, None]
    size = work.row_scale[:, None] * work.column_scale
    lower, upper = fit.lower * size, fit.upper * size
    if m > p:
        shapes, participation, lower, upper = participation, shapes, lower.T, upper.T
    if correlations is not None:
        shapes = shapes / motions(matrix.outputs, poles)
    modes = IdentifiedModes(
        name,
        poles,
        shapes,
        shapes.real,
        participation,
        matrix.inputs,
        matrix.outputs,
        tuple(evidence[k] for k in kept),
        (setup.diagram,),
        fit.error,
        (*matrix.notes, *(where + remark for remark in remarks)),
        lower=lower,
        upper=upper,
        decay=float(matrix.s.real[0]),
        band=(float(matrix.frequency_hz[0]), float(matrix.frequency_hz[-1])),
        setup=matrix.setup,
        output_only=correlations is not None,
    )
    return finished(modes, repeated), lost


def _not_there(pick: Pick) -> str:
    """Why a pick is no mode although there is a pole."""
    if pick.order is None:
        return f"there is no pole near {pick} Hz that adds more to the responses than noise does"
    return f"the pole picked as {pick} Hz adds no more than noise does: it follows noise, or is one mode with another"


def _is_there(matrix: ResponseMatrix, fit: Fit, k: int, pick: Pick) -> bool:
    """Whether a mode that was picked is near its frequency, and in the data."""
    mode_hz = float(np.abs(fit.poles[k])) / (2 * np.pi)
    return abs(mode_hz - pick.hz) < PICKED_WITHIN * pick.hz and is_carried(matrix, fit, k)


def default_order(matrix: ResponseMatrix) -> int:
    """Order of the largest model for the lines and references that there are."""
    lines, _, m = matrix.response.shape
    return int(max(4, min(MOST_ORDER, MOST_SIZE // m, lines // LINES_PER_ORDER)))


def _fitted(
    matrix: ResponseMatrix,
    modes: list[Track],
    orders: Sequence[OrderPoles],
    options: Options,
    wanted: Sequence[Track] | None,
    subspaces: Subspaces | None,
    duration: float,
) -> tuple[Fit, list[Track]]:
    """The fit of the tracks that are modes; those that the data do not determine are dropped unless they are wanted."""
    while True:
        poles, participation = start_values(modes, orders)
        participation = participation.reshape(matrix.response.shape[2], -1)
        if subspaces is not None and not options.refine:
            poles, shapes, sigma = subspaces.best(modes, orders)
            fit = fit_shapes(matrix, poles, participation)
            size = np.linalg.norm(shapes, axis=0)
            along = (shapes.conj() * fit.shapes).sum(axis=0) / np.where(size > 0, size, 1.0) ** 2
            fit = replace(fit, shapes=shapes * along, pole_sigma=sigma)
        else:
            fit = (fit_modes if options.refine and modes else fit_shapes)(matrix, poles, participation)
        fit = replace(fit, pole_sigma=at_least_known(fit, duration))
        free = np.array([not any(t is w for w in wanted or ()) for t in modes], dtype=bool)
        drop = _undetermined(fit, modes, free, options.most_damped)
        if drop is None:
            order = np.argsort(np.abs(fit.poles))
            return fit.at(order), [modes[k] for k in order]
        modes = [t for k, t in enumerate(modes) if k != drop]


def _kept(
    fit: Fit, evidence: Sequence[ModeEvidence], is_picked: Sequence[bool] | None, least: float
) -> tuple[Index, list[str]]:
    """Positions of the modes to return, those picked or else those sure enough; notes on the others in the fit."""
    kept = np.array([e.confidence >= least for e in evidence] if is_picked is None else is_picked, dtype=bool)
    hz, others = np.abs(fit.poles) / (2 * np.pi), np.flatnonzero(~kept).tolist()
    if not others:
        return np.flatnonzero(kept), []
    note = f"poles at {', '.join(f'{hz[k]:.5g}' for k in others)} Hz took part in the fit and were not picked"
    if is_picked is None:
        listed = ", ".join(f"{in_hz(hz[k])} ({evidence[k].confidence:.2g})" for k in others)
        note = f"{UNSURE}: {listed}; they took part in the fit, and can be picked"
    return np.flatnonzero(kept), [note]


def _with_twins(matrix: ResponseMatrix, fit: Fit, modes: list[Track], options: Options) -> tuple[Fit, list[Track]]:
    """The fit with modes twice where the responses have a peak that they do not give back, and a second mode of the
    same pole does: orders that are equal but for round-off may show a repeated pole once."""
    while (peak := _peak_left(matrix, fit)) is not None and len(fit.poles):
        away = np.abs(fit.poles.imag - 2 * np.pi * matrix.frequency_hz[peak])
        k = int(np.argmin(away))
        if away[k] > TWIN_AWAY * -fit.poles[k].real:
            break
        _, _, right = np.linalg.svd((matrix.scaled - fit.synthesis)[peak])
        poles = np.append(fit.poles, fit.poles[k])
        more = fit_modes(matrix, poles, np.concatenate([fit.participation, right[:1].T], axis=1))
        tracks = [*modes, modes[k]]
        is_known = _undetermined(more, tracks, np.ones(len(tracks), dtype=bool), options.most_damped) is None
        if not (is_known and more.error < TWIN_GAIN * fit.error):
            break
        order = np.argsort(np.abs(more.poles))
        fit, modes = more.at(order), [tracks[k] for k in order]
    return fit, modes


def _peak_left(matrix: ResponseMatrix, fit: Fit) -> int | None:
    """The line at which the responses have a peak that the modes do not give back; None without any."""
    window = np.ones(SMOOTHED) / SMOOTHED
    left, whole = (
        np.convolve((np.abs(H) ** 2).sum(axis=(1, 2)), window, mode="same")
        for H in (matrix.scaled - fit.synthesis, matrix.scaled)
    )
    k = int(np.argmax(left))
    if left[k] < LEFT_OVER * np.median(left) or left[k] < LEFT_SHARE**2 * whole[k]:
        return None
    return k


def _left_over(matrix: ResponseMatrix, fit: Fit) -> list[str]:
    """A remark on such a peak."""
    k = _peak_left(matrix, fit)
    if k is None:
        return []
    hz = f"{matrix.frequency_hz[k]:.5g}"
    return [f"what the modes leave over peaks at {hz} Hz: a mode may be missing there, or one more beside another"]


def _undetermined(fit: Fit, modes: Sequence[Track], free: NDArray[np.bool_], most_damped: float) -> int | None:
    """The free mode to drop: too damped, not determined in frequency, or twin of a mode on a longer track."""
    size, decay = np.abs(fit.poles), -fit.poles.real
    sigma = fit.pole_sigma.max(axis=1, initial=0.0)
    spread = np.maximum(sigma / size / UNSURE_FREQUENCY, sigma / np.abs(decay) / UNSURE_DAMPING)
    spread = np.where(free, np.where(decay > most_damped * size, np.inf, spread), 0.0)
    if spread.max(initial=0.0) > 1:
        return int(np.argmax(spread))
    near = np.abs(fit.poles[:, None] - fit.poles) < TWINS * np.minimum(decay[:, None], decay)
    twins = np.argwhere(np.triu(near & (residue_mac(fit) > ALIKE_RESIDUES) & (free | free[:, None]), 1))
    if not len(twins):
        return None
    return min(twins[0].tolist(), key=lambda k: (not free[k], len(modes[k].at)))


def _equal_poles(fit: Fit) -> tuple[Complex, list[list[int]]]:
    """Poles, those that cannot be distinguished replaced by their mean, and the groups of these."""
    poles, groups = fit.poles.copy(), []
    if not len(poles):
        return poles, groups
    spread = np.hypot(*(np.linalg.norm(s, axis=1) for s in (fit.pole_sigma[1:], fit.pole_sigma[:-1])))
    tolerance = REPEATED_SIGMAS * np.where(np.isfinite(spread), spread, 0.0)
    same = np.abs(np.diff(poles)) < np.maximum(tolerance, EQUAL_POLES * np.abs(poles[1:].real))
    for part in np.split(np.arange(len(poles)), np.flatnonzero(~same) + 1):
        if 1 < len(part) <= min(len(fit.participation), len(fit.shapes)):
            poles[part] = poles[part].mean()
            groups.append(part.tolist())
    return poles, groups


def _evidence(track: Track, orders: int, matrix: ResponseMatrix, fit: Fit, k: int) -> ModeEvidence:
    """Evidence of one mode, its shape apart, by the standard deviations of its pole's real and imaginary part."""
    pole, (real, imaginary) = complex(fit.poles[k]), fit.pole_sigma[k]
    size = abs(pole)
    frequency = float(np.hypot(pole.real * real, pole.imag * imaginary) / size**2)
    damping = float(np.hypot(pole.imag * real, pole.real * imaginary) * abs(pole.imag / pole.real) / size**2)
    return evidence_of(
        track.share(orders),
        scatter=(track.frequency_scatter, track.damping_scatter),
        sigma=(frequency, damping),
        bias=bias(matrix, fit, k),
    )
