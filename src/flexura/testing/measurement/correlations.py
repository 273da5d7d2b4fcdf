"""Correlations and half spectra of records of outputs alone, by parts of the records, and tones in these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.errors import OptionError
from flexura.tables import in_hz, quantity
from flexura.testing.measurement.channels import FORCES, MeasuredChannel
from flexura.testing.measurement.hits import inspect
from flexura.testing.measurement.measurement import Recording, grouped
from flexura.testing.measurement.response_matrices import ResponseMatrix, balanced

MOST_LAGS, FEWEST_LAGS = 512, 64
"""Lags of a correlation."""

PART_IN_LAGS = 1
"""Parts of records are so many times as long as the correlations at least."""

MOST_PARTS, FEWEST_PARTS = 60, 20
"""Parts by which the scatter of correlations is known."""

MOST_REFERENCES = 6
"""Channels that correlations are with: those that tell most."""

WINDOW_END = 1e-3
"""Value of the exponential window on correlations at their last lag."""

USED_BAND = 0.8
"""The band ends at most at this share of half the sample rate."""

SLOWEST = 4
"""Spectral lines below the band."""

TONE = -0.5
"""Spectral kurtosis below which a line is a tone: noise has 0, a steady sine -1."""

TONE_BY_CHANCE = 8.0
"""Over the number of stretches, what is added to that: one line of noise in 100 000 then looks like a tone."""

MOST_TONES = 20
"""Tones that are taken out of records at most."""

LEFT_OF_NOISE, LEFT_OF_TONE = 3.0, 0.02
"""A tone wanders where so many times the noise that its kurtosis shows is left, and this share of its power."""

DRIFT = 0.5
"""Share of the power of a channel below the band from which it drifts."""


class Tone(NamedTuple):
    """A line of constant amplitude: its frequency, Hz, and spectral kurtosis."""

    hz: float
    kurtosis: float


@dataclass(frozen=True)
class Correlations:
    """Correlations (b, L + 1, p, m) of p outputs with the references among them, at lags of `step`, s, by parts.

    `spectra` (n, f, p) are transforms of n stretches, at `spectra_hz` (f,). `tones` were taken out of the records.
    """

    setup: str
    step: float
    parts: Array
    outputs: tuple[MeasuredChannel, ...]
    references: Index
    band: tuple[float, float]
    duration: float
    spectra: Complex
    spectra_hz: Array
    tones: tuple[Tone, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def mean(self) -> Array:
        """Correlations of the whole (L + 1, p, m)."""
        return self.parts.mean(axis=0)

    def kurtosis(self, hz: float, shape: Complex) -> float:
        """Spectral kurtosis at a frequency, Hz, of the outputs weighted by a shape (p,) (theory eq. I32)."""
        line = int(np.argmin(np.abs(self.spectra_hz - hz)))
        size = np.sqrt(np.mean(np.abs(self.spectra[:, line]) ** 2, axis=0))
        weight = shape.conj() / np.maximum(size, 1e-300) ** 2
        return float(_kurtosis(self.spectra[:, line] @ weight))


def correlations_of(
    recordings: Sequence[Recording], band: tuple[float, float] | None = None, together: bool = False
) -> list[Correlations]:
    """Correlations of the outputs of every setup, or of all records as one, in a band (from, to), Hz.

    Trends are taken off, what is slower than the band is filtered out, and samples are thinned to what the band needs.
    Channels with defects are left out; tones are taken out of the records; notes name both. Raises OptionError for
    channels and rates that differ within a setup, an impossible band, records that are too short, and where no channel
    is left.
    """
    groups = grouped(recordings, lambda r: "" if together else r.setup)
    return [_of_setup(setup, records, band) for setup, records in groups.items()]


@dataclass(frozen=True)
class _Thinned:
    """Samples (p, N) of each record at intervals of `step`, s, in the band, lags of correlations, and what is said."""

    records: list[Array]
    step: float
    lags: int
    band: tuple[float, float]
    notes: list[str]

    @property
    def samples(self) -> int:
        return sum(x.shape[1] for x in self.records)


def _of_setup(setup: str, records: Sequence[Recording], band: tuple[float, float] | None) -> Correlations:
    where = f"setup {setup!r}: " if setup else ""
    outputs, samples, notes = _outputs(records, where)
    thinned = _thinned(samples, records[0].sample_rate, band, outputs, where)
    hz: Array = np.arange(thinned.lags // 2 + 1) / (thinned.lags * thinned.step)
    tones, cleaned = _without_tones(thinned, hz)
    if tones:
        listed = ", ".join(f"{in_hz(t.hz, 6)} (kurtosis {t.kurtosis:.2f})" for t in tones)
        notes.append(
            f"{where}tones of constant amplitude, as of machines, were taken out of the records: {listed};"
            " a mode there is known less well"
        )
    spectra = _spectra(cleaned, thinned.lags)
    if wandering := [in_hz(t.hz, 4) for t in tones if _is_left(t, thinned, spectra, hz)]:
        notes.append(
            f"{where}a tone near {', '.join(wandering)} wanders and could not be taken out whole: it hides modes, and"
            " what is found there may be none; leave it out of the band, or record at a steady speed"
        )
    references = _references(spectra[:, (hz >= thinned.band[0]) & (hz <= thinned.band[1])])
    parts = np.concatenate([_parts(x, references, thinned) for x in cleaned])
    return Correlations(
        setup,
        thinned.step,
        parts,
        outputs,
        references,
        thinned.band,
        thinned.samples * thinned.step,
        spectra,
        hz,
        tuple(tones),
        (*notes, *thinned.notes),
    )


def _outputs(records: Sequence[Recording], where: str) -> tuple[tuple[MeasuredChannel, ...], list[Array], list[str]]:
    """Channels that can be used, their samples (p, N) in every record, and notes on the others."""
    first = records[0]
    for r in records[1:]:
        if r.channels != first.channels:
            raise OptionError(f"{where}records of outputs have different channels: give setups names")
        if r.sample_rate != first.sample_rate:
            rates = f"{first.sample_rate:g} and {r.sample_rate:g} Hz"
            raise OptionError(f"{where}records are sampled at {rates}: resample, or split setups")
    bad = {c.name: "a force is no output" for c in first.channels if c.quantity in FORCES}
    for r in records:
        for _ in range(2):  # numbers that are not finite hide what else is wrong
            rest = [k for k, c in enumerate(r.channels) if c.name not in bad]
            shown = replace(r, samples=r.samples[rest], channels=tuple(r.channels[k] for k in rest), inputs=())
            bad |= {d.channel: d.text for d in inspect(shown)}
    kept = [k for k, c in enumerate(first.channels) if c.name not in bad]
    notes = [f"{where}{name} is left out: {why}" for name, why in bad.items()]
    if not kept:
        raise OptionError("\n".join([f"{where}no channel is an output that can be used", *notes]))
    return tuple(first.channels[k] for k in kept), [np.asarray(r.samples[kept], dtype=float) for r in records], notes


def _thinned(
    samples: Sequence[Array],
    rate: float,
    band: tuple[float, float] | None,
    outputs: Sequence[MeasuredChannel],
    where: str,
) -> _Thinned:
    """Samples without what is outside the band. Raises OptionError for an impossible band and for short records."""
    from scipy.signal import butter, detrend, resample_poly, sosfilt  # slow to import

    low, high = (0.0, np.inf) if band is None else (float(f) for f in band)
    if not (0 <= low < high and low < USED_BAND * rate / 2):
        raise OptionError(
            f"{where}a band is two frequencies in Hz below {USED_BAND * rate / 2:g}, not {low:g}, {high:g}"
        )
    notes = []
    if band is not None and high > USED_BAND * rate / 2:
        notes.append(f"{where}the band ends at {in_hz(USED_BAND * rate / 2, 4)}, as the sample rate has it")
    high = min(high, USED_BAND * rate / 2)
    factor = max(int(USED_BAND * rate / 2 / high), 1)
    step = factor / rate
    whole = sum(x.shape[1] for x in samples) // factor
    lags = min(MOST_LAGS, whole // (PART_IN_LAGS * FEWEST_PARTS) // 2 * 2)
    if lags < FEWEST_LAGS:
        least = quantity(PART_IN_LAGS * FEWEST_PARTS * FEWEST_LAGS * step, "s")
        raise OptionError(
            f"{where}{quantity(whole * step, 's')} of records are too short for a band up to {in_hz(high, 4)}:"
            f" it takes {least} at least, and a thousand periods of a mode to know its damping"
        )
    slowest = SLOWEST / (lags * step)
    low = max(low, 1 / (lags * step)) if low else slowest
    if not low < high:
        raise OptionError(f"{where}there is no band above {in_hz(low, 4)}, the least that the records resolve")
    pass_band = butter(4, low / 2, "highpass", fs=1 / step, output="sos")
    records, slow = [], np.zeros(len(outputs))
    for x in samples:
        if x.shape[1] // factor < 3 * lags:
            notes.append(f"{where}a record of {quantity(x.shape[1] / rate, 's')} is left out: it is too short")
            continue
        thin = resample_poly(detrend(x, axis=1), 1, factor, axis=1) if factor > 1 else detrend(x, axis=1)
        records.append(sosfilt(pass_band, thin, axis=1))
        slow = np.maximum(slow, 1 - records[-1].var(axis=1) / np.maximum(thin.var(axis=1), 1e-300))
    if not records:
        raise OptionError(f"{where}every record is shorter than {quantity(3 * lags * step, 's')}: record longer")
    drifting = [c.name for c, share in zip(outputs, slow, strict=True) if share > DRIFT]
    if drifting:
        notes.append(f"{where}most of {', '.join(drifting)} is drift below {in_hz(low / 2, 3)}, which was filtered out")
    return _Thinned(records, step, lags, (low, high), notes)


def _spectra(records: Sequence[Array], length: int) -> Complex:
    """Transforms (n, f, p) of stretches of some length, under Hann's window."""
    window = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    stretches = [x[:, : x.shape[1] // length * length].reshape(len(x), -1, length) for x in records]
    return np.fft.rfft(np.concatenate(stretches, axis=1) * window, axis=2).transpose(1, 2, 0)


def _kurtosis(z: Complex) -> Array:
    """Spectral kurtosis over the first axis of transforms: 0 of noise, -1 of a tone (Antoni 2006, theory eq. I32)."""
    power = np.abs(z) ** 2
    return np.mean(power**2, axis=0) / np.maximum(np.mean(power, axis=0) ** 2, 1e-300) - 2


def _along(spectra: Complex) -> tuple[Array, Array]:
    """Kurtosis (f,) of the strongest motion at each line of transforms (n, f, p), and its power."""
    size = np.sqrt(np.mean(np.abs(spectra) ** 2, axis=(0, 1)))
    first, strength, _ = np.linalg.svd((spectra / np.maximum(size, 1e-300)).transpose(1, 0, 2), full_matrices=False)
    return _kurtosis(first[:, :, 0].T), strength[:, 0] ** 2


def is_tone(kurtosis: float, stretches: int) -> bool:
    """Whether a spectral kurtosis over so many stretches is that of a tone, and hardly that of noise."""
    return kurtosis < TONE - TONE_BY_CHANCE / stretches


def _without_tones(thinned: _Thinned, hz: Array) -> tuple[list[Tone], list[Array]]:
    """Tones of the records, and these without them."""
    spectra = _spectra(thinned.records, thinned.lags)
    kurtosis, power = _along(spectra)
    tones = []
    for k in range(2, len(hz) - 2):
        is_peak = power[k] == power[k - 2 : k + 3].max()
        if is_tone(kurtosis[k], len(spectra)) and is_peak and thinned.band[0] <= hz[k] <= thinned.band[1]:
            tones.append(Tone(float(hz[k]), float(kurtosis[k])))
    tones = sorted(tones, key=lambda t: t.kurtosis)[:MOST_TONES]
    cleaned, exact = [], [t.hz for t in tones]
    for x in thinned.records:
        left = x
        for j, tone in enumerate(tones):
            left, exact[j] = _without(left, tone.hz, float(hz[1]), thinned.step)
        cleaned.append(left)
    return sorted(Tone(f, t.kurtosis) for f, t in zip(exact, tones, strict=True)), cleaned


def _is_left(tone: Tone, thinned: _Thinned, spectra: Complex, hz: Array) -> bool:
    """Whether more of a tone is left in the spectra of cleaned records than the noise beside it (theory eq. I32)."""
    k = int(np.argmin(np.abs(hz - tone.hz)))
    before, after = (float((np.abs(X[:, k]) ** 2).sum()) for X in (_spectra(thinned.records, thinned.lags), spectra))
    return after > before * (LEFT_OF_NOISE * (1 - np.sqrt(min(-tone.kurtosis, 1.0))) + LEFT_OF_TONE)


def _without(x: Array, hz: float, within: float, step: float) -> tuple[Array, float]:
    """Samples (p, N) without the tone of one frequency nearest to another, Hz; and that frequency."""
    N = x.shape[1]
    window = np.sin(np.pi * (np.arange(N) + 0.5) / N) ** 2
    lines = np.arange(N // 2 + 1) / (N * step)
    near = np.flatnonzero(np.abs(lines - hz) < within)
    power = (np.abs(np.fft.rfft(x * window, axis=1)[:, near]) ** 2 / x.var(axis=1, keepdims=True)).sum(axis=0)
    k = int(np.clip(np.argmax(power), 1, len(near) - 2))
    a, b, c = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    exact = float(lines[near[k]] + (a - c) / (2 * (a - 2 * b + c)) / (N * step))
    angle = 2 * np.pi * exact * step * np.arange(N)
    basis = np.array([np.cos(angle), np.sin(angle)]).T
    return x - (basis @ np.linalg.lstsq(basis, x.T)[0]).T, exact


def _references(spectra: Complex) -> Index:
    """Channels that tell most of the others, by pivots, every line counting alike."""
    p = spectra.shape[2]
    if p <= MOST_REFERENCES:
        return np.arange(p)
    from scipy.linalg import qr

    scaled = spectra / np.maximum(np.sqrt(np.mean(np.abs(spectra) ** 2, axis=(0, 1))), 1e-300)
    scaled = scaled / np.maximum(np.sqrt(np.mean(np.abs(scaled) ** 2, axis=(0, 2)))[:, None], 1e-300)
    _, pivots = qr(scaled.reshape(-1, p), mode="r", pivoting=True)
    return np.sort(pivots[:MOST_REFERENCES]).astype(np.intp)


def _parts(x: Array, references: Index, thinned: _Thinned) -> Array:
    """Correlations (b, L + 1, p, m) of the parts of a record, lags beyond the end of a part included."""
    L = thinned.lags
    length = max(PART_IN_LAGS * L, thinned.samples // MOST_PARTS)
    size = 1 << int(np.ceil(np.log2(length + 2 * L)))
    parts = []
    for at in range(0, x.shape[1] - L - length + 1, length):
        late = np.fft.rfft(x[:, at : at + length + L], size)
        early = np.fft.rfft(x[references, at : at + length], size)
        R = np.fft.irfft(late[:, None] * early.conj(), size)[..., : L + 1]
        parts.append(R.transpose(2, 0, 1) / length)
    return np.array(parts)


def half_spectra(C: Correlations) -> ResponseMatrix:
    """Half spectra of correlations under an exponential window, which have the form of responses (theory eq. I28)."""
    L, step = C.parts.shape[1] - 1, C.step
    decay = -float(np.log(WINDOW_END)) / (L * step)
    lags = np.arange(1, L + 1)
    faded = np.empty_like(C.parts[:, 1:])
    faded[:, lags % L] = C.parts[:, 1:] * np.exp(-decay * step * lags)[:, None, None]
    hz: Array = np.arange(L // 2 + 1) / (L * step)
    lines = np.flatnonzero((hz >= C.band[0]) & (hz <= C.band[1]))
    parts = step * np.fft.rfft(faded, axis=1)[:, lines]
    H = parts.mean(axis=0)
    return ResponseMatrix(
        C.setup,
        hz[lines],
        np.asarray(2j * np.pi * hz[lines] + decay, dtype=np.complex128),
        H,
        0,
        np.ones(len(lines)),
        *balanced(H),
        tuple(C.outputs[k] for k in C.references),
        C.outputs,
        C.notes,
        step,
        parts,
    )
