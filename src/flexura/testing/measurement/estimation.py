"""Frequency responses estimated from hits: windows, rejection, averaged spectra, estimators, coherence."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.tables import in_hz
from flexura.testing.measurement.channels import MeasuredChannel
from flexura.testing.measurement.hits import LEAKAGE, accepted, inspect, leakage, pulses, trigger
from flexura.testing.measurement.measurement import MeasuredFRF, Measurement, Recording

LEVEL = 0.05
"""Share of lines above its 95 % quantile that unrelated signals have."""

RELATED = 2 * LEVEL
"""Share of such lines from which signals are related."""


@dataclass(frozen=True)
class Spectra:
    """Sums over `averages` records: `ff` (f, m, m) and `xf` (f, p, m), cross-spectra, and `xx` (f, p), auto-spectra."""

    ff: Complex
    xf: Complex
    xx: Array
    averages: int

    @classmethod
    def of(cls, F: Complex, X: Complex) -> Spectra:
        """From transforms of inputs (n, f, m) and outputs (n, f, p) (theory eq. H1)."""
        ff = np.einsum("nfi,nfj->fij", F, F.conj())
        xf = np.einsum("nfi,nfj->fij", X, F.conj())
        return cls(ff, xf, np.sum(np.abs(X) ** 2, axis=0), len(F))

    def at(self, lines: NDArray[np.intp]) -> Spectra:
        """The same at some lines."""
        return Spectra(self.ff[lines], self.xf[lines], self.xx[lines], self.averages)


def transfer(S: Spectra, estimator: str) -> Complex:
    """Frequency responses (f, p, m) by H1, H2 or Hv (theory eqs. H2-H4).

    Raises OptionError for H2 with several inputs, and when inputs are fewer than records or go together at a line.
    """
    m = S.ff.shape[1]
    if S.averages < m:
        raise OptionError(f"{m} inputs at once need at least {m} records; there are {S.averages}")
    if estimator == "H2":
        if m > 1:
            raise OptionError("H2 is for one input at a time; take H1 or Hv")
        return S.xx[:, :, None] / _nonzero(S.xf.conj())
    if estimator == "Hv":
        return _total_least_squares(S)
    if m == 1:
        return S.xf / _nonzero(S.ff)
    try:
        H: Any = np.linalg.solve(S.ff.transpose(0, 2, 1), S.xf.transpose(0, 2, 1)).transpose(0, 2, 1)
        return H
    except np.linalg.LinAlgError:
        raise OptionError("the inputs go together at some lines, so that they cannot be distinguished") from None


def _total_least_squares(S: Spectra) -> Complex:
    """Smallest principal component of inputs and one output, each scaled by its own power (theory eq. H4)."""
    f, p, m = S.xf.shape
    G = np.empty((f, p, m + 1, m + 1), dtype=complex)
    G[..., :m, :m] = S.ff[:, None]
    G[..., m, :m] = S.xf
    G[..., :m, m] = S.xf.conj()
    G[..., m, m] = S.xx
    d = 1 / np.sqrt(_nonzero(np.einsum("fpii->fpi", G).real))
    _, vectors = np.linalg.eigh(d[..., :, None] * G * d[..., None, :])
    a = vectors[..., :, 0].conj() * d
    return -a[..., :m] / _nonzero(a[..., m:])


def coherence(S: Spectra) -> Array | None:
    """Coherence (f, p, m) of every output with its input, or with all inputs at once (theory eq. H5).

    None when there are no more records than inputs, where it is 1 of anything.
    """
    m = S.ff.shape[1]
    if S.averages <= m:
        return None
    H = transfer(S, "H1")
    explained = np.einsum("fpm,fpm->fp", H, S.xf.conj()).real
    gamma = np.clip(explained / _nonzero(S.xx), 0.0, 1.0)
    return np.repeat(gamma[:, :, None], m, axis=2)


def unrelated(gamma: Array, averages: int, inputs: int = 1) -> bool:
    """True when coherence (f,) is distributed as that of signals that have nothing to do with each other.

    Of n independent records of one input it exceeds x with probability (1 - x)^(n - 1) (Carter, Knapp and Nuttall
    1973; theory eq. H6); with m inputs the least of them has it with n - m.
    """
    free = averages - inputs
    if free < 1 or len(gamma) < 20:
        return False
    quantile = 1 - LEVEL ** (1 / free)
    if inputs > 1:
        from scipy.stats import beta

        quantile = float(beta.ppf(1 - LEVEL, inputs, free))
    return bool(np.mean(gamma > quantile) < RELATED)


def _nonzero(values: Any) -> Any:
    """Zeros replaced by the smallest number, so that quotients stay finite."""
    return np.where(values == 0, np.finfo(float).tiny, values)


Estimator = Literal["H1", "H2", "Hv"]

EXCITED = 1e-4
"""Lines are kept until the power of the excitation first falls below so much of its largest."""

USEFUL = 1e-2
"""Coherence is judged where the power of the excitation is at least so much of its largest."""

QUIET = 16
"""Samples before a hit from which offset and noise are known."""


NOTICEABLE = 0.005
"""Share of the motion left at the end of a record from which a note says so."""


@dataclass(frozen=True)
class _How:
    estimator: str
    force_window: float | None
    exponential: float | None
    delays: Mapping[str, float]
    full_scale: Mapping[str, float]
    accept: frozenset[str]


@dataclass(frozen=True)
class _Group:
    """Records of one setup with the same inputs: what they give."""

    inputs: tuple[MeasuredChannel, ...]
    outputs: tuple[MeasuredChannel, ...]
    hz: Array
    spectra: Spectra
    decay: float
    notes: tuple[str, ...]


@verb
def estimate_frf(
    data: Measurement | Recording | Sequence[Recording],
    *,
    estimator: Estimator = "H1",
    force_window: float | None = None,
    exponential: float | None = None,
    band: tuple[float, float] | None = None,
    duration: float | None = None,
    delays: Mapping[str, float] | None = None,
    full_scale: Mapping[str, float] | None = None,
    accept: Collection[str] = (),
) -> tuple[MeasuredFRF, ...]:
    """Frequency responses from time records, one for every setup (theory eqs. H1-H8).

    Records of one setup that are hit at the same channel are averaged; different hits are columns of one response.
    Records with several inputs each are solved together.

    `estimator`: H1 (noise in the outputs), H2 (noise in the input, one input only) or Hv (equal shares).
    `force_window`, s: the force counts until so long after the beginning of the pulse, with a cosine taper of a quarter
    of that. `exponential`: value at the end of the record, between 0 and 1, of an exponential window on all channels;
    the decay rate that it adds stands in `decay` of the result, for identification to take out. `band`, Hz, keeps the
    lines in it, else they are kept until the force is 40 dB below its largest; 0 Hz is left out. `duration`, s, cuts
    records. `delays`, s, by channel name, say how much too late a channel reads; `full_scale`, SI, by channel name,
    how much it can read.

    Records that are overloaded, clipped, hit twice, not at rest before the hit, or still moving at their end are left
    out, and outputs left out that are not coherent with any input; notes name them. `accept` lists kinds of defects
    that are to be used nonetheless.

    Raises OptionError when nothing is left, for channels, rates and lengths that differ within a setup, and for
    arguments that make no sense.
    """
    recordings = _recordings(data)
    if estimator not in get_args(Estimator):
        raise OptionError(f"estimator is H1, H2 or Hv, not {estimator!r}")
    for name, value, top in (("force_window", force_window, np.inf), ("exponential", exponential, 1.0)):
        if value is not None and not 0 < value <= top:
            raise OptionError(f"{name} is {'a positive time in s' if top > 1 else 'between 0 and 1'}, not {value:g}")
    how = _How(estimator, force_window, exponential, dict(delays or {}), dict(full_scale or {}), accepted(accept))
    known = {c.name for r in recordings for c in r.channels}
    for name in (*how.delays, *how.full_scale):
        if name not in known:
            raise OptionError(f"there is no channel {name!r}; known: {', '.join(sorted(known))}")
    cut = [r if duration is None else _cut(r, duration) for r in recordings]
    found: list[MeasuredFRF] = []
    unusable: list[str] = []
    for setup in dict.fromkeys(r.setup for r in cut):
        own = [r for r in cut if r.setup == setup]
        _refuse_uneven(own)
        together: dict[tuple[MeasuredChannel, ...], dict[tuple[MeasuredChannel, ...], list[Recording]]] = {}
        for r in own:
            ins = tuple(r.channels[k] for k in r.inputs)
            outs = tuple(c for k, c in enumerate(r.channels) if k not in r.inputs)
            together.setdefault(outs, {}).setdefault(ins, []).append(r)
        _refuse_missing(setup, together)
        for outs, by_input in together.items():
            made = [_group(records, ins, outs, how) for ins, records in by_input.items()]
            unusable += [own for own in made if isinstance(own, str)]
            groups = [own for own in made if not isinstance(own, str)]
            if not unusable:
                found.append(_combined(setup, groups, how, band))
    if unusable:
        raise OptionError("\n".join(unusable))
    return tuple(found)


def _recordings(data: Measurement | Recording | Sequence[Recording]) -> list[Recording]:
    listed = (
        data.recordings if isinstance(data, Measurement) else (data,) if isinstance(data, Recording) else tuple(data)
    )
    if not all(isinstance(r, Recording) for r in listed):
        raise OptionError("frequency responses are estimated from recordings, or from a measurement that has some")
    if not listed:
        raise OptionError("there are no time records to estimate frequency responses from")
    for k, r in enumerate(listed):
        if not r.inputs:
            raise OptionError(
                f"{_label(r, k)}: none of its channels is a force: of output-only data no frequency response can be"
                " estimated. If a channel is the excitation, a file of channels says so, with its unit: NAME: {unit: N,"
                " input: true}; frequencies found elsewhere can be compared as a list"
            )
        if not set(r.inputs) < set(range(len(r.channels))):
            raise OptionError(
                f"{_label(r, k)}: of its {len(r.channels)} channels at least one is an input and one an output"
            )
        motions = [r.channels[i] for i in r.inputs if r.channels[i].quantity not in ("force", "moment")]
        forces = [c for i, c in enumerate(r.channels) if i not in r.inputs and c.quantity in ("force", "moment")]
        if motions and forces:
            raise OptionError(
                f"{_label(r, k)}: {motions[0]} is declared the excitation and {forces[0]} the response: exchange them"
            )
    return list(listed)


def _label(record: Recording, k: int) -> str:
    return record.name or f"record {k + 1}"


def _cut(record: Recording, duration: float) -> Recording:
    samples = round(duration * record.sample_rate)
    if not 16 <= samples <= record.samples.shape[1]:
        longest = record.samples.shape[1] / record.sample_rate
        raise OptionError(f"duration is a time up to the {longest:g} s that were recorded, not {duration:g} s")
    return Recording(
        record.sample_rate, record.samples[:, :samples], record.channels, record.inputs, record.setup, record.name
    )


def _refuse_uneven(records: list[Recording]) -> None:
    where = f" of setup {records[0].setup}" if records[0].setup else ""
    rates = sorted({r.sample_rate for r in records})
    if rates[-1] - rates[0] > 1e-5 * rates[0]:
        raise OptionError(f"records{where} are sampled at {rates[0]:g} and {rates[-1]:g} Hz: resample, or split setups")
    lengths = sorted({r.samples.shape[1] for r in records})
    if len(lengths) > 1:
        shortest = lengths[0] / records[0].sample_rate
        raise OptionError(f"records{where} have {lengths[0]} to {lengths[-1]} samples: give duration={shortest:g}")


def _refuse_missing(setup: str, together: Mapping[tuple[MeasuredChannel, ...], Mapping]) -> None:
    """Raises OptionError when a record lacks outputs that others of the same setup have."""
    largest = max(together, key=len)
    for outs, by_input in together.items():
        names, all_names = {c.name for c in outs}, [c.name for c in largest]
        if outs is not largest and names < set(all_names):
            first = next(iter(by_input.values()))[0]
            missing = ", ".join(n for n in all_names if n not in names)
            where = f" of setup {setup}" if setup else ""
            raise OptionError(f"{_label(first, 0)}{where} has no channel {missing}, which other records have")


def _group(
    records: list[Recording], inputs: tuple[MeasuredChannel, ...], outputs: tuple[MeasuredChannel, ...], how: _How
) -> _Group | str:
    """Spectra of the records that can be used; why none can, where none can."""
    kept: list[tuple[Complex, Complex]] = []
    left_out: list[str] = []
    notes: list[str] = []
    N, fs = records[0].samples.shape[1], records[0].sample_rate
    decay = 0.0 if how.exponential is None else -float(np.log(how.exponential)) * fs / N
    hz: Array = np.arange(N // 2 + 1) * (fs / N)
    left = 0.0
    for k, record in enumerate(records):
        own = {n: v for n, v in how.full_scale.items() if n in {c.name for c in record.channels}}
        defects = [d for d in inspect(record, own) if d.kind not in how.accept]
        if defects:
            left_out.append(f"{_label(record, k)}: {'; '.join(map(str, defects))}")
            continue
        samples, worst, channel = _windowed(record, how, decay)
        if worst > LEAKAGE and "leakage" not in how.accept:
            left_out.append(
                f"{_label(record, k)}: {channel}: still at {worst:.0%} of its loudest at the end of {N / fs:g} s: "
                "record longer, or give an exponential window"
            )
            continue
        left = max(left, worst)
        kept.append(_transforms(record, samples, how, decay, hz))
    at = ", ".join(c.name for c in inputs)
    if not kept:
        listed = "\n  ".join(left_out[:8])
        more = f"\n  and {len(left_out) - 8} more" if len(left_out) > 8 else ""
        return f"none of the {len(records)} records with {at} can be used:\n  {listed}{more}"
    if left_out:
        notes.append(f"{at}: left out {len(left_out)} of {len(records)} records: {' | '.join(left_out)}")
    if left > NOTICEABLE:
        notes.append(f"{at}: {left:.0%} of the motion is left at the end of records: peaks are wrong by about as much")
    F, X = (np.array(part) for part in zip(*kept, strict=True))
    return _Group(inputs, outputs, hz, Spectra.of(F, X), decay, tuple(notes))


def _transforms(record: Recording, samples: Array, how: _How, decay: float, hz: Array) -> tuple[Complex, Complex]:
    """Transforms (f, m) of the inputs and (f, p) of the outputs, channels that are late put right (theory eq. H8)."""
    spectrum = np.fft.rfft(samples, axis=1)
    for k, channel in enumerate(record.channels):
        late = how.delays.get(channel.name, 0.0)
        if late:
            spectrum[k] *= np.exp((decay + 2j * np.pi * hz) * late)
    outs = [k for k in range(len(record.channels)) if k not in record.inputs]
    return spectrum[list(record.inputs)].T, spectrum[outs].T


def _windowed(record: Recording, how: _How, decay: float) -> tuple[Array, float, str]:
    """Samples without offset and with windows, and the largest leakage with its channel."""
    x = np.array(record.samples, dtype=float)
    N = x.shape[1]
    time = np.arange(N) / record.sample_rate
    still = 0
    if len(record.inputs) == 1:
        at = record.inputs[0]
        start, still = trigger(x[at])
        still = still if still >= QUIET else 0
        if still:
            x -= x[:, :still].mean(axis=1, keepdims=True)
        else:
            x[at] -= _rest(x[at])
        if how.force_window is not None:
            x[at] *= _tapered(time - time[start], how.force_window)
    x *= np.exp(-decay * time)
    worst, channel = 0.0, ""
    if len(record.inputs) == 1:
        for k, c in enumerate(record.channels):
            if k not in record.inputs:
                quiet = x[k, :still]
                faded = quiet * np.exp(-decay * (time[-1] - time[: len(quiet)]))
                share = leakage(x[k], faded)
                if share > worst:
                    worst, channel = share, c.name
    return x, worst, channel


def _rest(force: Array) -> float:
    """What a force (N,) reads when nothing is hit: median outside its pulses, where these leave most of the record."""
    outside = np.ones(len(force), dtype=bool)
    for first, last in pulses(force):
        outside[max(first - 2 * (last - first), 0) : last + 2 * (last - first) + 1] = False
    return float(np.median(force[outside])) if 2 * outside.sum() > len(force) else 0.0


def _tapered(time: Array, width: float) -> Array:
    """1 until `width`, then a quarter of it as half a cosine, then 0."""
    phase = np.clip((time - width) / (width / 4), 0.0, 1.0)
    return 0.5 * (1 + np.cos(np.pi * phase))


def _combined(setup: str, groups: list[_Group], how: _How, band: tuple[float, float] | None) -> MeasuredFRF:
    """The responses of all inputs of a setup side by side, on the lines that are excited."""
    hz = groups[0].hz
    powers = [np.einsum("fmm->f", g.spectra.ff).real for g in groups]
    keep = _lines(hz, powers, band)
    H, gamma, notes = [], [], []
    for g, power in zip(groups, powers, strict=True):
        S = g.spectra.at(keep)
        H.append(transfer(S, how.estimator))
        own = coherence(S)
        gamma.append(own)
        notes += g.notes
        P = power[keep]
        low = np.flatnonzero(P.max() * USEFUL > P)
        if len(low) and low[-1] > np.argmax(P):
            edge = hz[keep][low[low > np.argmax(P)][0]]
            notes.append(f"{', '.join(c.name for c in g.inputs)}: the excitation is 20 dB down at {in_hz(edge, 4)}")
    known = None
    outputs = groups[0].outputs
    used = np.arange(len(outputs))
    if all(g is not None for g in gamma):
        known = np.concatenate([g for g in gamma if g is not None], axis=2)
        if "incoherent" not in how.accept:
            used, said = _coherent(groups, [p[keep] for p in powers], known, hz[keep])
            notes += said
    else:
        notes.append("single records: no coherence is known")
    if how.exponential is not None:
        notes.append(f"an exponential window has added {groups[0].decay:.4g} 1/s to every decay rate")
    return MeasuredFRF(
        hz[keep],
        np.concatenate(H, axis=2)[:, used],
        tuple(c for g in groups for c in g.inputs),
        tuple(outputs[k] for k in used),
        None if known is None else known[:, used],
        min(g.spectra.averages for g in groups),
        how.estimator,
        groups[0].decay,
        setup,
        tuple(notes),
    )


def _lines(hz: Array, powers: list[Array], band: tuple[float, float] | None) -> NDArray[np.intp]:
    """Positions of the lines to keep."""
    if band is not None:
        low, high = (float(f) for f in band)
        kept = np.flatnonzero((hz > 0) & (hz >= low) & (hz <= high))
        if not low < high or len(kept) < 2:
            raise OptionError(
                f"band: there are no two lines between {low:g} and {high:g} Hz; they are {hz[1]:g} Hz apart"
            )
        return kept
    stop = len(hz)
    for P in powers:
        peak = int(np.argmax(P[1:])) + 1
        weak = np.flatnonzero(P[peak:] < EXCITED * P[peak])
        stop = min(stop, peak + int(weak[0]) if len(weak) else stop)
    return np.arange(1, max(stop, 3))


def _coherent(groups: list[_Group], powers: list[Array], gamma: Array, hz: Array) -> tuple[NDArray[np.intp], list[str]]:
    """Outputs that are coherent with an input, and notes on the pairs that are not (theory eq. H6).

    Raises OptionError when no output is.
    """
    outputs = groups[0].outputs
    bad = np.zeros(gamma.shape[1:], dtype=bool)
    column = 0
    for g, P in zip(groups, powers, strict=True):
        useful = P.max() * USEFUL <= P
        for i in range(len(outputs)):
            bad[i, column : column + len(g.inputs)] = unrelated(
                gamma[useful, i, column], g.spectra.averages, len(g.inputs)
            )
        column += len(g.inputs)
    inputs = [c.name for g in groups for c in g.inputs]
    used = np.flatnonzero(~bad.all(axis=1))
    if not len(used):
        raise OptionError(
            f"coherence of {', '.join(c.name for c in outputs)} with {', '.join(inputs)} is that of unrelated signals, "
            f"median {np.median(gamma):.2g} up to {in_hz(hz[-1], 4)}: look at cables, channels and units"
        )
    notes = [f"{outputs[i].name} left out: not coherent with any input" for i in np.flatnonzero(bad.all(axis=1))]
    for i in used:
        quiet = [inputs[j] for j in np.flatnonzero(bad[i])]
        if quiet:
            notes.append(f"{outputs[i].name} is not coherent with {', '.join(quiet)}")
    return used, notes
