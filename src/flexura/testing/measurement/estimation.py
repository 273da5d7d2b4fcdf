"""Frequency responses estimated from hits: windows, rejection, averaged spectra, estimators, coherence."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Complex, Index
from flexura.errors import OptionError
from flexura.tables import in_hz, quantity
from flexura.testing.measurement.channels import FORCES, MeasuredChannel
from flexura.testing.measurement.closed_loop import by_reference, plant
from flexura.testing.measurement.force_noise import ForceNoise
from flexura.testing.measurement.hits import LEAKAGE, QUIET, accepted, inspect, leakage, pulses, trigger
from flexura.testing.measurement.measurement import MeasuredFRF, Measurement, Recording, grouped
from flexura.testing.measurement.reciprocity import fill_reciprocal
from flexura.testing.measurement.spectra import (
    Spectra,
    coherence,
    nonzero,
    partial_coherence,
    transfer,
    unrelated,
)

Estimator = Literal["H1", "H2", "Hv"]

EXCITED_POWER = 1e-4
"""Lines are kept until the power of the excitation first falls below so much of its largest."""

JUDGED_POWER = 1e-2
"""Coherence is judged where the power of the excitation is at least so much of its largest."""

FEWEST_SAMPLES = 16
"""Samples of a record at least."""

SAME_RATE = 1e-5
"""Sample rates of one setup that differ by no more, relative, are the same."""

NOTICEABLE_LEAKAGE = 0.005
"""Share of the motion left at the end of a record from which a note says so."""

LEAST_INDEPENDENT = 0.01
"""Inputs of power one go together where the smallest eigenvalue of their spectral matrix is below, as of two with a
coherence of 0.98."""

MOST_LINES_TOGETHER = 0.5
"""They are refused where they go together at more of the lines."""

MOST_LISTED = 8
"""Records named where none can be used."""


@dataclass(frozen=True)
class _Options:
    """Those of `estimate_frf` that every record has."""

    estimator: str
    force_window: float | None
    exponential: float | None
    stretch: float | None
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
    noise: ForceNoise | None = None

    @property
    def power(self) -> Array:
        """That of the excitation (f,), summed over the inputs."""
        return np.einsum("fmm->f", self.spectra.ff).real


@verb
def estimate_frf(
    data: Measurement | Recording | Sequence[Recording],
    *,
    estimator: Estimator = "H1",
    force_window: float | None = None,
    exponential: float | None = None,
    stretch: float | None = None,
    band: tuple[float, float] | None = None,
    duration: float | None = None,
    delays: Mapping[str, float] | None = None,
    full_scale: Mapping[str, float] | None = None,
    accept: Collection[str] = (),
    reciprocal: bool = False,
    references: Collection[str] = (),
) -> tuple[MeasuredFRF, ...]:
    """Frequency responses from time records, one for every setup (theory eqs. H1-H8).

    Records of one setup that are hit at the same channel are averaged; different hits are columns of one response.
    Records with several inputs each are solved together; `coherence` is then multiple coherence, and
    `partial_coherence` that with one input once the others are taken out.

    `estimator`: H1 (noise in the outputs), H2 (noise in the inputs; several of them take as many outputs, whose lines
    where they go together are named) or Hv (equal shares).
    `force_window`, s: the force counts until so long after the beginning of the pulse, with a cosine taper of a quarter
    of that. `exponential`: value at the end of the record, between 0 and 1, of an exponential window on all channels;
    the decay rate that it adds stands in `decay` of the result, for identification to take out. `stretch`, s: records
    are of lasting excitation by shakers, random or slow sweeps, and are cut into stretches of this length that overlap
    by half, under Hann's window; bursts that have died out at the end of a record need none. `band`, Hz, keeps the
    lines in it, else they are kept until the force is 40 dB below its largest; 0 Hz is left out. `duration`, s, cuts
    records. `delays`, s, by channel name, say how much too late a channel reads; `full_scale`, SI, by channel name,
    how much it can read.

    Records that are overloaded, clipped, hit twice, not at rest before the hit, or still moving at their end are left
    out, and outputs left out that are not coherent with any input; notes name them. `accept` lists kinds of defects
    that are to be used nonetheless. `reciprocal`: records of a setup may have different outputs, and responses that are
    not measured are those from the other end, H_ji for H_ij; notes name them. `references`: names of channels that
    excite a loop from outside, at least as many as the plant in it has inputs; responses are then those of the plant by
    the joint input-output method, without the bias that feedback of noise gives H1, and `coherence` is that of the
    outputs with the references.

    Where a force is down by 6 dB and more, as at resonances, and part of it is noise of its channel, a note names the
    lines, how much H1 is low, and what to take.

    Inputs that go together cannot be told apart: where their spectral matrix is ill-conditioned at most lines, they are
    refused, and where it is at some, a note says at which.

    Raises OptionError when nothing is left, for channels, rates and lengths that differ within a setup, and for
    arguments that make no sense.
    """
    recordings = _recordings(data)
    _refuse_windows(force_window, exponential, stretch)
    if estimator not in get_args(Estimator):
        raise OptionError(f"estimator is H1, H2 or Hv, not {estimator!r}")
    if references and (estimator != "H1" or reciprocal):
        raise OptionError("references have an estimator of their own, and no reciprocal")
    options = _Options(
        "joint" if references else estimator,
        force_window,
        exponential,
        stretch,
        dict(delays or {}),
        dict(full_scale or {}),
        accepted(accept),
    )
    known = {c.name for r in recordings for c in r.channels}
    for name in (*options.delays, *options.full_scale):
        if name not in known:
            raise OptionError(f"there is no channel {name!r}; known: {', '.join(sorted(known))}")
    if duration is not None:
        recordings = [_cut(r, duration) for r in recordings]
    inputs: list[str] = []
    if references:
        recordings, inputs = by_reference(recordings, tuple(references))
    frfs: list[MeasuredFRF] = []
    unusable: list[str] = []
    for setup, records in grouped(recordings, lambda r: r.setup).items():
        of_setup: list[MeasuredFRF] = []
        for by_input in _columns(records, reciprocal):
            groups = [_group(column, options) for column in by_input]
            unusable += [reason for reason in groups if isinstance(reason, str)]
            if not unusable:
                of_setup.append(_combined(setup, [g for g in groups if isinstance(g, _Group)], options, band))
        of_setup = [plant(frf, inputs) for frf in of_setup] if references else of_setup
        frfs += fill_reciprocal(of_setup) if reciprocal and of_setup else of_setup
    if unusable:
        raise OptionError("\n".join(unusable))
    return tuple(frfs)


def _refuse_windows(force_window: float | None, exponential: float | None, stretch: float | None) -> None:
    if force_window is not None and not force_window > 0:
        raise OptionError(f"force_window is a positive time in s, not {force_window:g}")
    if exponential is not None and not 0 < exponential <= 1:
        raise OptionError(f"exponential is between 0 and 1, not {exponential:g}")
    if stretch is not None and not (
        force_window is None and exponential is None and np.isfinite(stretch) and stretch > 0
    ):
        raise OptionError(f"stretch is a positive time in s and has a window of its own, not {stretch:g} with another")


def _recordings(data: Measurement | Recording | Sequence[Recording]) -> Sequence[Recording]:
    """The records of data. Raises OptionError for none, and where inputs and outputs make no sense."""
    if isinstance(data, Measurement):
        data = data.recordings
    recordings = (data,) if isinstance(data, Recording) else tuple(data)
    if not all(isinstance(r, Recording) for r in recordings):
        raise OptionError("frequency responses are estimated from recordings, or from a measurement that has some")
    if not recordings:
        raise OptionError("there are no time records to estimate frequency responses from")
    for k, r in enumerate(recordings):
        if not r.inputs:
            raise OptionError(
                f"{_label(r, k)}: none of its channels is a force: of output-only data no frequency response can be"
                " estimated. If a channel is the excitation, a file of channels says so, with its unit: NAME: {unit: N,"
                " input: true}; identify finds modes in outputs alone"
            )
        if not set(r.inputs) < set(range(len(r.channels))):
            raise OptionError(
                f"{_label(r, k)}: of its {len(r.channels)} channels at least one is an input and one an output"
            )
        inputs, outputs = _sides(r)
        motions = [c for c in inputs if c.quantity not in FORCES]
        forces = [c for c in outputs if c.quantity in FORCES]
        if motions and forces:
            raise OptionError(
                f"{_label(r, k)}: {motions[0]} is declared the excitation and {forces[0]} the response: exchange them"
            )
    return recordings


def _label(record: Recording, k: int) -> str:
    return record.name or f"record {k + 1}"


def _sides(record: Recording) -> tuple[tuple[MeasuredChannel, ...], tuple[MeasuredChannel, ...]]:
    """Inputs and outputs of a record."""
    outputs = (c for k, c in enumerate(record.channels) if k not in record.inputs)
    return tuple(record.channels[k] for k in record.inputs), tuple(outputs)


def _cut(record: Recording, duration: float) -> Recording:
    samples, recorded = round(duration * record.sample_rate), record.samples.shape[1]
    if not FEWEST_SAMPLES <= samples <= recorded:
        longest = recorded / record.sample_rate
        raise OptionError(f"duration is a time up to the {longest:g} s that were recorded, not {duration:g} s")
    return replace(record, samples=record.samples[:, :samples])


def _columns(records: Sequence[Recording], incomplete: bool = False) -> list[list[list[Recording]]]:
    """Records of one setup, for each set of outputs, by their inputs: the columns of a response.

    Raises OptionError for rates and lengths that differ, and when a record lacks outputs that others have and may not.
    """
    where = f" of setup {records[0].setup}" if records[0].setup else ""
    rates = sorted({r.sample_rate for r in records})
    if rates[-1] - rates[0] > SAME_RATE * rates[0]:
        raise OptionError(f"records{where} are sampled at {rates[0]:g} and {rates[-1]:g} Hz: resample, or split setups")
    lengths = sorted({r.samples.shape[1] for r in records})
    if len(lengths) > 1:
        shortest = lengths[0] / records[0].sample_rate
        raise OptionError(f"records{where} have {lengths[0]} to {lengths[-1]} samples: give duration={shortest:g}")
    columns: dict[tuple[MeasuredChannel, ...], dict[tuple[MeasuredChannel, ...], list[Recording]]] = {}
    for r in records:
        inputs, outputs = _sides(r)
        columns.setdefault(outputs, {}).setdefault(inputs, []).append(r)
    largest = max(columns, key=len)
    for outputs, by_input in columns.items():
        names = {c.name for c in outputs}
        missing = [c.name for c in largest if c.name not in names]
        if missing and not incomplete and names < {c.name for c in largest}:
            first = _label(next(iter(by_input.values()))[0], 0)
            raise OptionError(f"{first}{where} has no channel {', '.join(missing)}, which other records have")
    return [list(by_input.values()) for by_input in columns.values()]


def _group(records: Sequence[Recording], options: _Options) -> _Group | str:
    """Spectra of the records that can be used; why none can, where none can."""
    inputs, outputs = _sides(records[0])
    N, rate = _length(records[0], options.stretch), records[0].sample_rate
    decay = 0.0 if options.exponential is None else -float(np.log(options.exponential)) * rate / N
    hz = np.asarray(np.arange(N // 2 + 1) * (rate / N), dtype=np.float64)
    transforms: list[tuple[Complex, Complex]] = []
    left_out: list[str] = []
    largest_leakage = 0.0
    for k, record in enumerate(records):
        names = {c.name for c in record.channels}
        scales = {name: scale for name, scale in options.full_scale.items() if name in names}
        judged = record if options.stretch is None else replace(record, inputs=())  # it is no hit
        defects = [d for d in inspect(judged, scales) if d.kind not in options.accept]
        if defects:
            left_out.append(f"{_label(record, k)}: {'; '.join(map(str, defects))}")
            continue
        if options.stretch is not None:
            transforms += [_transforms(record, part, options.delays, decay, hz) for part in _stretches(record, N)]
            continue
        samples, leaked, channel = _windowed(record, options.force_window, decay)
        if leaked > LEAKAGE and "leakage" not in options.accept:
            left_out.append(
                f"{_label(record, k)}: {channel}: still at {leaked:.0%} of its loudest at the end of {N / rate:g} s: "
                "record longer, or give an exponential window; where the excitation lasts, a stretch"
            )
            continue
        largest_leakage = max(largest_leakage, leaked)
        transforms.append(_transforms(record, samples, options.delays, decay, hz))
    at = ", ".join(c.name for c in inputs)
    if not transforms:
        listed = "\n  ".join(left_out[:MOST_LISTED])
        more = f"\n  and {len(left_out) - MOST_LISTED} more" if len(left_out) > MOST_LISTED else ""
        return f"none of the {len(records)} records with {at} can be used:\n  {listed}{more}"
    notes: list[str] = []
    if left_out:
        notes.append(f"{at}: left out {len(left_out)} of {len(records)} records: {' | '.join(left_out)}")
    if largest_leakage > NOTICEABLE_LEAKAGE:
        notes.append(
            f"{at}: {largest_leakage:.0%} of the motion is left at the end of records: peaks are wrong by about as much"
        )
    F, X = (np.array(part) for part in zip(*transforms, strict=True))
    spectra = Spectra.of(F, X, among=options.estimator == "H2" and len(inputs) > 1)
    alike = _going_together(spectra, hz)
    if alike.mean() > MOST_LINES_TOGETHER:
        return (
            f"the inputs {at} go together at {alike.mean():.0%} of the lines, so that they cannot be distinguished:"
            " drive shakers by signals that have nothing to do with each other, or give one of them as an output"
        )
    if alike.any():
        where = f"{in_hz(hz[alike][0], 4)} to {in_hz(hz[alike][-1], 4)}"
        notes.append(
            f"{at} go together at {alike.mean():.0%} of the lines, from {where}: responses there are not known"
        )
    return _Group(inputs, outputs, hz, spectra, decay, tuple(notes), ForceNoise.of(F, X, spectra))


def _length(record: Recording, stretch: float | None) -> int:
    """Samples of a transform. Raises OptionError for a stretch that the record does not hold."""
    recorded = record.samples.shape[1]
    samples = recorded if stretch is None else round(stretch * record.sample_rate)
    if stretch is not None and not FEWEST_SAMPLES <= samples <= recorded:
        longest = quantity(recorded / record.sample_rate, "s")
        raise OptionError(f"a stretch is a time up to the {longest} that were recorded, not {stretch:g} s")
    return samples


def _stretches(record: Recording, N: int) -> list[Array]:
    """Stretches of N samples that overlap by half, without their mean, under Hann's window."""
    window: Array = np.asarray(np.sin(np.pi * (np.arange(N) + 0.5) / N) ** 2, dtype=np.float64)
    starts = range(0, record.samples.shape[1] - N + 1, max(N // 2, 1))
    parts = (record.samples[:, at : at + N] for at in starts)
    return [(x - x.mean(axis=1, keepdims=True)) * window for x in parts]


def _going_together(S: Spectra, hz: Array) -> NDArray[np.bool_]:
    """Lines (f,) above 0 Hz that are excited and at which inputs, each of power one, are nearly dependent.

    None of one input, and of records too few for the inputs, which is another fault.
    """
    m = S.ff.shape[1]
    if m == 1 or S.averages < m:
        return np.zeros(len(hz), dtype=np.bool_)
    power = np.einsum("fii->fi", S.ff).real
    size = np.sqrt(nonzero(power))
    least = np.linalg.eigvalsh(S.ff / size[:, :, None] / size[:, None, :])[:, 0]
    excited = (power >= EXCITED_POWER * power.max(axis=0)).all(axis=1)
    return np.asarray(excited & (hz > 0) & (least < LEAST_INDEPENDENT), dtype=np.bool_)


def _transforms(
    record: Recording, samples: Array, delays: Mapping[str, float], decay: float, hz: Array
) -> tuple[Complex, Complex]:
    """Transforms (f, m) of the inputs and (f, p) of the outputs, channels that are late put right (theory eq. H8)."""
    spectrum = np.fft.rfft(samples, axis=1)
    for k, channel in enumerate(record.channels):
        if late := delays.get(channel.name, 0.0):
            spectrum[k] *= np.exp((decay + 2j * np.pi * hz) * late)
    return spectrum[list(record.inputs)].T, np.delete(spectrum, record.inputs, axis=0).T


def _windowed(record: Recording, force_window: float | None, decay: float) -> tuple[Array, float, str]:
    """Samples without offset and with windows, and the largest leakage with its channel."""
    x = np.array(record.samples, dtype=float)
    time = np.arange(x.shape[1]) / record.sample_rate
    still = 0
    if len(record.inputs) == 1:
        at = record.inputs[0]
        start, quiet = trigger(x[at])
        still = quiet if quiet >= QUIET else 0
        if still:
            x -= x[:, :still].mean(axis=1, keepdims=True)
        else:
            x[at] -= _rest(x[at])
        if force_window is not None:
            phase = np.clip((time - time[start] - force_window) / (force_window / 4), 0.0, 1.0)
            x[at] *= 0.5 * (1 + np.cos(np.pi * phase))
    x *= np.exp(-decay * time)
    largest, channel = 0.0, ""
    for k, c in enumerate(record.channels):
        if k not in record.inputs:
            faded = x[k, :still] * np.exp(-decay * (time[-1] - time[:still]))
            share = leakage(x[k], faded)
            if share > largest:
                largest, channel = share, c.name
    return x, largest, channel


def _rest(force: Array) -> float:
    """What a force (N,) reads when nothing is hit: median outside its pulses, where these leave most of the record."""
    outside = np.ones(len(force), dtype=bool)
    for first, last in pulses(force):
        outside[max(first - 2 * (last - first), 0) : last + 2 * (last - first) + 1] = False
    return float(np.median(force[outside])) if 2 * outside.sum() > len(force) else 0.0


def _combined(setup: str, groups: Sequence[_Group], options: _Options, band: tuple[float, float] | None) -> MeasuredFRF:
    """The responses of all inputs of a setup side by side, on the lines that are excited."""
    outputs = groups[0].outputs
    lines = _lines(groups[0].hz, [g.power for g in groups], band)
    hz = groups[0].hz[lines]
    notes: list[str] = []
    for g in groups:
        notes += g.notes
        if g.noise is not None:
            notes += g.noise.notes([c.name for c in g.inputs], g.hz, lines, options.estimator)
        power = g.power[lines]
        peak = int(np.argmax(power))
        low = np.flatnonzero(power.max() * JUDGED_POWER > power)
        if len(low) and low[-1] > peak:
            edge = hz[low[low > peak][0]]
            notes.append(f"{', '.join(c.name for c in g.inputs)}: the excitation is 20 dB down at {in_hz(edge, 4)}")
    spectra = [g.spectra.at(lines) for g in groups]
    H = np.concatenate([transfer(S, options.estimator) for S in spectra], axis=2)
    gammas = [gamma for S in spectra if (gamma := coherence(S)) is not None]
    known = np.concatenate(gammas, axis=2) if len(gammas) == len(groups) else None
    partial = _partial(spectra, gammas) if known is not None else None
    used = np.arange(len(outputs))
    if known is None:
        notes.append("single records: no coherence is known")
    elif "incoherent" not in options.accept:
        used, remarks = _coherent(groups, lines, known)
        notes += remarks
    if options.estimator == "H2":
        notes += [note for g, S in zip(groups, spectra, strict=True) for note in _lone_outputs(g, S, hz)]
    decay = groups[0].decay
    if options.exponential is not None:
        notes.append(f"an exponential window has added {decay:.4g} 1/s to every decay rate")
    return MeasuredFRF(
        hz,
        H[:, used],
        tuple(c for g in groups for c in g.inputs),
        tuple(outputs[k] for k in used),
        None if known is None else known[:, used],
        min(g.spectra.averages for g in groups),
        options.estimator,
        decay,
        setup,
        tuple(notes),
        None if partial is None else partial[:, used],
    )


def _partial(spectra: Sequence[Spectra], gammas: Sequence[Array]) -> Array | None:
    """Partial coherence (f, p, m), of single inputs their coherence; None where all are single."""
    each = [partial_coherence(S) for S in spectra]
    if all(one is None for one in each):
        return None
    return np.concatenate([gamma if one is None else one for one, gamma in zip(each, gammas, strict=True)], axis=2)


def _lone_outputs(group: _Group, S: Spectra, hz: Array) -> list[str]:
    """A note on lines at which outputs go together, as near a single mode, so that H2 cannot tell several inputs."""
    m = len(group.inputs)
    if m == 1:
        return []
    seen = S.xf / np.sqrt(nonzero(S.xx))[:, :, None] / np.sqrt(nonzero(np.einsum("fii->fi", S.ff).real))[:, None, :]
    sizes = np.linalg.svd(seen, compute_uv=False)
    alike = sizes[:, -1] ** 2 < LEAST_INDEPENDENT * sizes[:, 0] ** 2
    if not alike.any():
        return []
    names = ", ".join(c.name for c in group.inputs)
    return [
        f"the outputs go together at {alike.mean():.0%} of the lines, from {in_hz(hz[alike][0], 4)} to"
        f" {in_hz(hz[alike][-1], 4)}, as near a single mode: H2 of {names} is uncertain there; compare with Hv"
    ]


def _lines(hz: Array, powers: Sequence[Array], band: tuple[float, float] | None) -> Index:
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
    for power in powers:
        peak = int(np.argmax(power[1:])) + 1
        weak = np.flatnonzero(power[peak:] < EXCITED_POWER * power[peak])
        stop = min(stop, peak + int(weak[0]) if len(weak) else stop)
    return np.arange(1, max(stop, 3))


def _coherent(groups: Sequence[_Group], lines: Index, gamma: Array) -> tuple[Index, list[str]]:
    """Outputs that are coherent with an input, and notes on the pairs that are not (theory eq. H6).

    Raises OptionError when no output is.
    """
    outputs, inputs = groups[0].outputs, [c.name for g in groups for c in g.inputs]
    bad = np.zeros(gamma.shape[1:], dtype=bool)
    column = 0
    for g in groups:
        power, m = g.power[lines], len(g.inputs)
        judged = power.max() * JUDGED_POWER <= power
        for i in range(len(outputs)):
            bad[i, column : column + m] = unrelated(gamma[judged, i, column], g.spectra.averages, m)
        column += m
    is_lost = bad.all(axis=1)
    if is_lost.all():
        raise OptionError(
            f"coherence of {', '.join(c.name for c in outputs)} with {', '.join(inputs)} is that of unrelated signals, "
            f"median {np.median(gamma):.2g} up to {in_hz(groups[0].hz[lines[-1]], 4)}: look at cables, channels and"
            " units"
        )
    notes = [f"{outputs[i].name} left out: not coherent with any input" for i in np.flatnonzero(is_lost)]
    used = np.flatnonzero(~is_lost)
    for i in used:
        if quiet := [inputs[j] for j in np.flatnonzero(bad[i])]:
            notes.append(f"{outputs[i].name} is not coherent with {', '.join(quiet)}")
    return used, notes
