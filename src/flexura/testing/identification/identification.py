"""Identify modes from the frequency responses of a test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flexura.analysis import FrequencyResponse
from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.mechanism import DOF_NAMES
from flexura.systems import Channel
from flexura.tables import in_hz
from flexura.testing.identification.evidence import assembled, bias, close_pairs, confidence_of, is_carried, lone_peak
from flexura.testing.identification.multi_setup import merged
from flexura.testing.identification.residues import Fit, fit_modes, fit_shapes
from flexura.testing.identification.stabilisation import (
    REACH,
    OrderPoles,
    Track,
    chosen,
    diagram,
    picked,
    poles_by_order,
    stability,
    start_values,
    tracks,
)
from flexura.testing.measurement import (
    IdentifiedModes,
    MeasuredChannel,
    MeasuredFRF,
    Measurement,
    ModeEvidence,
    ResponseMatrix,
    estimate_frf,
    response_matrices,
)

Data = Measurement | MeasuredFRF | FrequencyResponse | Sequence[MeasuredFRF]
Setups = Literal["each", "together"]

MOST_ORDER = 60
"""Order of the largest model when none is given."""

MOST_SIZE = 160
"""Order times number of references when none is given."""

LINES_PER_ORDER = 4
"""Spectral lines per order at least, when none is given."""

LEAST_CONFIDENCE = 0.3
"""Confidence below which a mode is not taken unless it is picked: no true mode in noise of 20 dB had so little."""

UNSURE = "left out for want of confidence"
"""How a note on such modes begins."""

UNSURE_FREQUENCY, UNSURE_DAMPING = 0.01, 0.3
"""A pole with larger standard deviations of these, relative, is no mode unless it is picked."""

REPEATED = 3.0
"""Poles that differ by less than so many standard deviations cannot be distinguished: the modes are repeated."""

EQUAL = 1e-3
"""Nor can poles that differ by so little of their decay rate."""

LEFT_OVER, LEFT_SHARE, SMOOTHED = 4.0, 0.1, 5
"""A mode may be missing where what is left, smoothed over lines, exceeds its median and this share of the response."""

TWINS = 0.5
"""Modes nearer than so many half-power half-widths are one if their residues are alike too."""

ALIKE = 0.9
"""Modal assurance criterion of residues that are alike."""


@dataclass(frozen=True)
class _Options:
    """Those of `identify` that every setup has."""

    order: int | None
    select: Sequence[float] | None
    refine: bool
    most_damped: float
    least_confidence: float


@verb
def identify(
    data: Data,
    *,
    band: tuple[float, float] | None = None,
    order: int | None = None,
    select: Sequence[float] | None = None,
    setups: Setups = "each",
    refine: bool = True,
    most_damped: float = 0.2,
    least_confidence: float = LEAST_CONFIDENCE,
) -> IdentifiedModes:
    """Poles, damping, shapes and participation of the modes in a band (from, to), Hz (theory eqs. I1-I18).

    Poly-reference least squares of every order up to `order`, modes chosen where poles are stable over the orders, or
    nearest to the frequencies `select`, Hz, which then are all that is returned, though other stable poles still take
    part in the fit; a frequency given twice asks for two modes. `refine` then fits poles, participation and shapes
    together to the responses. `setups`: each is identified by itself, since sensors in other places shift frequencies,
    and shapes are merged by the inputs (or else the outputs) that all setups share; or all are taken together as one
    matrix. Damping that an exponential window has added is not in the result. Poles with a damping ratio above
    `most_damped` are no modes. Those with less than `least_confidence` are left out and named, unless they are picked.

    Where no pole is stable at all and a peak stands 30 dB above the median, it is returned, with its width as the most
    of its damping, without confidence, and with a note.

    Repeated modes take as many inputs (or outputs) as there are of them. Raises OptionError for bad options, bad or
    incomplete data, and when there is no mode; SolverError when there are too few lines for the order.
    """
    if setups not in get_args(Setups):
        raise OptionError(f"setups is each or together, not {setups!r}")
    if not 0 <= least_confidence < 1:
        raise OptionError(f"least_confidence is at least 0 and below 1, not {least_confidence:g}")
    if not 0 < most_damped < 1:
        raise OptionError(f"most_damped is a damping ratio between 0 and 1, not {most_damped:g}")
    if order is not None and not 2 <= order <= 500:
        raise OptionError(f"an order is between 2 and 500, not {order}")
    how = _Options(order, select, refine, most_damped, least_confidence)
    name, frfs, notes = frfs_of(data)
    matrices = response_matrices(frfs, band, together=setups == "together")
    found: list[IdentifiedModes] = []
    missing: list[set[float]] = []
    for matrix in matrices:
        own, lost = _one_setup(name, matrix, how)
        found.append(own)
        missing.append(set(lost))
    nowhere = set.intersection(*missing)
    if nowhere:
        listed = ", ".join(f"{f:g}" for f in sorted(nowhere))
        raise OptionError(
            f"there is no pole near {listed} Hz that adds more to the responses than noise does; see the stabilisation"
            " diagram"
        )
    if not any(len(own.poles) for own in found):
        unsure = "".join(f"; {note}" for own in found for note in own.notes if UNSURE in note)
        raise OptionError(
            "no mode is stable over the orders: leave lines that are noise out of the band, raise the order, or pick"
            f" frequencies where the responses have peaks{unsure}"
        )
    if len(found) == 1:
        return replace(found[0], notes=(*notes, *found[0].notes))
    return merged(name, found, matrices, notes)


def frfs_of(data: Data) -> tuple[str, Sequence[MeasuredFRF], tuple[str, ...]]:
    """Name, frequency responses and notes of data; those of a measurement that has only records are estimated (H1)."""
    if isinstance(data, Measurement):
        frfs = data.frfs if data.frfs or not data.recordings else estimate_frf(data)
        return data.name, frfs, (*data.notes, *(note for frf in frfs for note in frf.notes))
    if isinstance(data, FrequencyResponse):
        inputs, outputs = (tuple(_placed(c) for c in channels) for channels in (data.inputs, data.outputs))
        return data.name, (MeasuredFRF(data.frequency_hz, data.response, inputs, outputs),), ()
    if isinstance(data, MeasuredFRF):
        return data.setup or "measurement", (data,), data.notes
    return "measurement", tuple(data), tuple(note for frf in data for note in frf.notes)


def _placed(channel: Channel) -> MeasuredChannel:
    """A channel of a computed response; one that is a DOF has a node and a direction."""
    if channel.node is not None and channel.against is None:
        return MeasuredChannel(channel.name, channel.quantity, channel.node, channel.direction)
    node, dot, dof = channel.name.partition(":")[0].rpartition(".")
    if not dot or dof not in DOF_NAMES:
        return MeasuredChannel(channel.name, channel.quantity)
    x, y, z = np.eye(3)[DOF_NAMES.index(dof) % 3].tolist()
    return MeasuredChannel(channel.name, channel.quantity, node, (x, y, z))


def _one_setup(name: str, matrix: ResponseMatrix, how: _Options) -> tuple[IdentifiedModes, list[float]]:
    """Modes of one setup, and the frequencies picked, Hz, that it does not have."""
    p, m = matrix.response.shape[1:]
    turned = m > p
    work = matrix.transposed if turned else matrix
    orders = poles_by_order(work, how.order or default_order(work), how.most_damped)
    bits = stability(orders)
    every = tracks(orders, bits)
    stable = chosen(every, len(orders))
    wanted, lost = (None, []) if how.select is None else picked(every, how.select, orders)
    own = stable if wanted is None else [*wanted, *(t for t in stable if not any(t is w for w in wanted))]
    peak = None if own else lone_peak(work)
    away = [f for f in lost if peak is None or abs(f - peak.hz) > REACH * f]
    if peak is not None and (wanted is None or len(away) < len(lost)):
        fit, lost = fit_shapes(work, np.array([peak.pole]), peak.participation), away
        evidence, good, said = [peak.evidence], np.arange(1), [peak.note]
    else:
        fit, kept = _fitted(work, own, orders, how, wanted)
        spread = zip(kept, fit.pole_sigma, fit.poles, strict=True)
        evidence = [
            _mode_evidence(track, len(orders), sigma, pole, bias(work, fit, k))
            for k, (track, sigma, pole) in enumerate(spread)
        ]
        asked = None
        if wanted is not None:
            empty = [k for k, t in enumerate(kept) if t.asked and not _is_there(work, fit, k, t.asked)]
            lost = [*lost, *(kept[k].asked for k in empty)]
            asked = [bool(t.asked) and k not in empty for k, t in enumerate(kept)]
        good, said = _good(fit, evidence, asked, how.least_confidence)
    where = f"setup {matrix.setup!r}: " if matrix.setup else ""
    leaves = _left_over(work, fit)
    fit, evidence = _taken(fit, good), [evidence[k] for k in good]
    poles, repeated = _equal_poles(fit)
    notes = [*matrix.notes, *(where + note for note in (*said, *leaves, *close_pairs(work, fit, repeated)))]
    shapes, participation = fit.shapes * work.row_scale[:, None], fit.participation * work.column_scale[:, None]
    size = work.row_scale[:, None] * work.column_scale
    lower, upper = fit.lower * size, fit.upper * size
    if turned:
        shapes, participation, lower, upper = participation, shapes, lower.T, upper.T
    modes = assembled(
        name,
        (poles, shapes, participation),
        (matrix.inputs, matrix.outputs),
        evidence,
        (diagram(orders, bits),),
        fit.error,
        tuple(notes),
        repeated,
    )
    ends = (float(matrix.frequency_hz[0]), float(matrix.frequency_hz[-1]))
    more = {"decay": float(matrix.s.real[0]), "band": ends, "setup": matrix.setup}
    return replace(modes, lower=lower, upper=upper, **more), lost


def _is_there(matrix: ResponseMatrix, fit: Fit, k: int, asked: float) -> bool:
    """Whether a mode that was picked is near that frequency, Hz, and in the data."""
    hz = float(np.abs(fit.poles[k])) / (2 * np.pi)
    return abs(hz - asked) < REACH * asked and is_carried(matrix, fit, k)


def default_order(matrix: ResponseMatrix) -> int:
    """Order of the largest model for the lines and references that there are."""
    lines, _, m = matrix.response.shape
    return int(max(4, min(MOST_ORDER, MOST_SIZE // m, lines // LINES_PER_ORDER)))


def _fitted(
    matrix: ResponseMatrix,
    own: list[Track],
    orders: Sequence[OrderPoles],
    how: _Options,
    wanted: Sequence[Track] | None,
) -> tuple[Fit, list[Track]]:
    """The fit of the tracks that are modes; those that the data do not determine are dropped unless they are wanted."""
    while True:
        poles, participation = start_values(own, orders)
        participation = participation.reshape(matrix.response.shape[2], -1)
        fit = (fit_modes if how.refine and own else fit_shapes)(matrix, poles, participation)
        at = np.argsort(np.abs(fit.poles))
        free = np.array([not any(t is w for w in wanted or ()) for t in own], dtype=bool)
        drop = _doubtful(fit, own, free, how.most_damped)
        if drop is None:
            return _taken(fit, at), [own[k] for k in at]
        own = [t for k, t in enumerate(own) if k != drop]


def _good(
    fit: Fit, evidence: Sequence[ModeEvidence], asked: Sequence[bool] | None, least: float
) -> tuple[NDArray[np.intp], list[str]]:
    """Positions of the modes to return, those picked or else those sure enough; notes on the others in the fit."""
    own = np.array([e.confidence >= least for e in evidence] if asked is None else asked, dtype=bool)
    hz = np.abs(fit.poles) / (2 * np.pi)
    others = [(f"{hz[k]:.5g}", f"{in_hz(hz[k])} ({evidence[k].confidence:.2g})") for k in np.flatnonzero(~own).tolist()]
    if not others:
        return np.flatnonzero(own), []
    note = f"poles at {', '.join(f for f, _ in others)} Hz took part in the fit and were not picked"
    if asked is None:
        note = f"{UNSURE}: {', '.join(said for _, said in others)}; they took part in the fit, and can be picked"
    return np.flatnonzero(own), [note]


def _left_over(matrix: ResponseMatrix, fit: Fit) -> list[str]:
    """Where the responses have a peak that the modes do not give back."""
    window = np.ones(SMOOTHED) / SMOOTHED
    left, whole = (
        np.convolve((np.abs(H) ** 2).sum(axis=(1, 2)), window, mode="same")
        for H in (matrix.scaled - fit.synthesis, matrix.scaled)
    )
    k = int(np.argmax(left))
    if left[k] < LEFT_OVER * np.median(left) or left[k] < LEFT_SHARE**2 * whole[k]:
        return []
    hz = f"{matrix.frequency_hz[k]:.5g}"
    return [f"what the modes leave over peaks at {hz} Hz: a mode may be missing there, or one more beside another"]


def _taken(fit: Fit, at: NDArray[np.intp]) -> Fit:
    """Some modes of a fit."""
    return replace(
        fit,
        poles=fit.poles[at],
        shapes=fit.shapes[:, at],
        participation=fit.participation[:, at],
        pole_sigma=fit.pole_sigma[at],
    )


def _doubtful(fit: Fit, own: Sequence[Track], free: NDArray[np.bool_], most_damped: float) -> int | None:
    """The free mode to drop: too damped, not determined in frequency, or twin of a mode on a longer track."""
    size, decay = np.abs(fit.poles), -fit.poles.real
    sigma = fit.pole_sigma.max(axis=1, initial=0.0)
    spread = np.maximum(sigma / size / UNSURE_FREQUENCY, sigma / np.abs(decay) / UNSURE_DAMPING)
    spread = np.where(free, np.where(decay > most_damped * size, np.inf, spread), 0.0)
    if spread.max(initial=0.0) > 1:
        return int(np.argmax(spread))
    left, right = (x / np.linalg.norm(x, axis=0) for x in (fit.shapes, fit.participation))
    alike = np.abs(left.conj().T @ left) ** 2 * np.abs(right.conj().T @ right) ** 2
    near = np.abs(fit.poles[:, None] - fit.poles) < TWINS * np.minimum(decay[:, None], decay)
    twins = np.argwhere(np.triu(near & (alike > ALIKE) & (free | free[:, None]), 1))
    if not len(twins):
        return None
    first, second = (int(k) for k in twins[0])
    return min(first, second, key=lambda k: (not free[k], len(own[k].at)))


def _equal_poles(fit: Fit) -> tuple[Complex, list[list[int]]]:
    """Poles, those that cannot be distinguished replaced by their mean, and the groups of these."""
    poles, groups = fit.poles.copy(), []
    if not len(poles):
        return poles, groups
    apart = np.abs(np.diff(poles))
    spread = np.hypot(*(np.linalg.norm(s, axis=1) for s in (fit.pole_sigma[1:], fit.pole_sigma[:-1])))
    same = apart < np.maximum(REPEATED * np.where(np.isfinite(spread), spread, 0.0), EQUAL * np.abs(poles[1:].real))
    for part in np.split(np.arange(len(poles)), np.flatnonzero(~same) + 1):
        if 1 < len(part) <= min(len(fit.participation), len(fit.shapes)):
            poles[part] = poles[part].mean()
            groups.append(part.tolist())
    return poles, groups


def _mode_evidence(track: Track, orders: int, sigma: Array, pole: complex, off: tuple[float, float]) -> ModeEvidence:
    """Evidence of one mode, its shape apart; sigma (2,) is that of the pole's real and imaginary part, `off` its bias
    in frequency and damping."""
    size = abs(pole)
    frequency = float(np.hypot(pole.real * sigma[0], pole.imag * sigma[1]) / size**2)
    damping = float(np.hypot(pole.imag * sigma[0], pole.real * sigma[1]) * abs(pole.imag / pole.real) / size**2)
    spread = (track.frequency_scatter, track.damping_scatter, frequency, damping)
    share = track.share(orders)
    return ModeEvidence(
        confidence_of(share, *spread),
        *spread[:2],
        1.0,
        0.0,
        frequency,
        damping,
        share,
        frequency_bias=off[0],
        damping_bias=off[1],
    )


def mode_indicators(matrix: ResponseMatrix) -> Array:
    """Complex mode indicator functions (f, min(p, m)): singular values of the responses, scaled to comparable size.

    Each mode is a peak of the first; where a second one peaks at the same place, modes are repeated (theory eq. I23;
    Shih, Tsuei, Allemang and Brown 1988, Mechanical Systems and Signal Processing 2).
    """
    return np.asarray(np.linalg.svd(matrix.scaled, compute_uv=False), dtype=np.float64)
