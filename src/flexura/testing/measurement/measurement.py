"""Measured data: time records, frequency responses estimated from them, and modes identified from these.

What readers of files hold them against, and what they make of responses that a file gives more than once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.mechanism import CONTROL, LONGEST_TITLE
from flexura.results import Result, Tabular
from flexura.structure import response_columns, unit_of_response
from flexura.tables import Facts, Item, Table, counted, ends, in_hz, number, percent, quantity, scale_for, significant
from flexura.testing.measurement.channels import MeasuredChannel, Trace


@dataclass(frozen=True)
class ModeEvidence:
    """The confidence in one identified mode.

    `confidence` is between 0 and 1 (theory eq. I14). `frequency_scatter` and `damping_scatter` are relative standard
    deviations over the model orders (and setups) in which the pole was found. `modal_phase_collinearity` (MPC) is one
    and `mean_phase_deviation_deg` (MPD) zero for a real shape (theory eqs. I16, I17). `frequency_sigma` and
    `damping_sigma` are relative standard deviations by the misfit of the non-linear fit (theory eq. I13), zero where it
    was not made. `share` is the share of model orders that have the mode, `setups` the number of setups that do.
    `setup_shift` is the part of the scatter of frequency over setups, relative, that these do not explain: it is there
    in a repeated test, as sensors' masses in other places are (theory eq. I21). `frequency_bias` and `damping_bias` are
    how far both may be off by what is no noise, relative: leakage, modes that were not found, lines wider than the mode
    (theory eqs. I25, I26).
    """

    confidence: float
    frequency_scatter: float
    damping_scatter: float
    modal_phase_collinearity: float
    mean_phase_deviation_deg: float
    frequency_sigma: float = 0.0
    damping_sigma: float = 0.0
    share: float = 1.0
    setups: int = 1
    setup_shift: float = 0.0
    frequency_bias: float = 0.0
    damping_bias: float = 0.0

    @property
    def frequency_spread(self) -> float:
        """How far the frequency may be off, relative: the largest of scatter, noise and bias."""
        return max(self.frequency_scatter, self.frequency_sigma, self.frequency_bias)

    @property
    def damping_spread(self) -> float:
        """How far the damping ratio may be off, relative: the largest of scatter, noise and bias."""
        return max(self.damping_scatter, self.damping_sigma, self.damping_bias)


@dataclass(frozen=True)
class Poles:
    """All poles of a stabilisation diagram: model order, frequency, Hz, damping ratio, and how stable each is.

    `stable` holds the bits 1 frequency, 2 damping, 4 shape or participation.
    """

    order: NDArray[np.intp]
    frequency_hz: Array
    damping_ratio: Array
    stable: NDArray[np.intp]


@dataclass(frozen=True, repr=False)
class IdentifiedModes(Tabular):
    """Modes of a test: `poles` (n,), rad/s, ascending in frequency, with `shapes` (p, n) and `participation` (m, n).

    The residue of mode r from input j to output i is shapes[i, r] participation[j, r]. Shapes are displacements.
    `real_shapes` (p, n) are the real ones nearest to them, the largest entry positive. `scaling` says of each mode
    whether its shape has unit modal mass, which takes a driving point, or unit participation. `lower` and `upper`
    (p, m) are what modes below and above the band add, over s^2 and constant. `synthesis_error` is the relative error
    of the frequency responses that the fit gives back in the `band`, Hz. `decay`, 1/s, was taken out of the poles.
    With several setups, `setups` has the modes of each, whose frequencies differ as their sensors' masses do, and
    `poles` are weighted means. `output_only` modes are of outputs alone: shapes have no scale but the largest entry,
    which is one, `inputs` are the outputs that all are correlated with, and residues those of half spectra. `traces`
    are lines of the part, to draw shapes on.
    """

    _shown = ("name", "setup", "frequency_hz", "outputs")
    _told = (
        *("name", "setup", "frequency_hz", "angular_frequency", "damping_ratio", "shapes", "real_shapes"),
        *("participation", "scaling", "inputs", "outputs", "evidence", "synthesis_error", "setups"),
        "output_only",
    )

    name: str
    poles: Complex
    shapes: Complex
    real_shapes: Array
    participation: Complex
    inputs: tuple[MeasuredChannel, ...]
    outputs: tuple[MeasuredChannel, ...]
    evidence: tuple[ModeEvidence, ...]
    diagram: tuple[Poles, ...]
    synthesis_error: float
    notes: tuple[str, ...] = ()
    scaling: tuple[str, ...] = ()
    lower: Array | None = None
    upper: Array | None = None
    decay: float = 0.0
    band: tuple[float, float] | None = None
    setup: str = ""
    setups: tuple[IdentifiedModes, ...] = ()
    output_only: bool = False
    traces: tuple[Trace, ...] = ()

    @property
    def frequency_hz(self) -> Array:
        """Undamped natural frequencies |s| / (2 pi) (n,), Hz."""
        return self.angular_frequency / (2 * np.pi)

    @property
    def angular_frequency(self) -> Array:
        """The same in rad/s, |s| (n,)."""
        return np.abs(self.poles)

    @property
    def damping_ratio(self) -> Array:
        """Damping ratios -Re s / |s| (n,)."""
        return -self.poles.real / np.abs(self.poles)

    @property
    def confidence(self) -> Array:
        """Confidence in every mode (n,), 0 to 1."""
        return np.array([e.confidence for e in self.evidence])

    def receptance(self, frequency_hz: ArrayLike) -> Complex:
        """Displacements per unit input (f, p, m) of modes and residuals, at frequencies, Hz (theory eq. I1).

        No exponential window is in it. Raises OptionError for modes of outputs alone, which have none.
        """
        if self.output_only:
            raise OptionError("modes of outputs alone have no receptance: the inputs were not measured")
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float))
        return responses(s, self.poles, self.shapes, self.participation, self.lower, self.upper)

    def _title(self) -> str:
        p, m = counted(len(self.outputs), "output"), counted(len(self.inputs), "input")
        return f"{counted(len(self.poles), 'mode')} from {p} {'alone' if self.output_only else f'and {m}'}"

    def presentation(self) -> Iterator[Item]:
        """The modes with their evidence, and those of every setup side by side."""
        evidence, scale = self.evidence, scale_for(self.frequency_hz, "Hz")
        hz = [f / scale.size for f in self.frequency_hz.tolist()]
        off = [e.frequency_spread * f for e, f in zip(evidence, hz, strict=True)]
        columns: dict[str, list[Any]] = {
            "mode": list(range(1, len(hz) + 1)),
            scale.heading("frequency"): [significant(f, spread) for f, spread in zip(hz, off, strict=True)],
            scale.heading("±"): [f"{spread:.1g}" for spread in off],
            "damping": [
                f"{significant(100 * zeta, 100 * zeta * e.damping_spread, 4)} %"
                for zeta, e in zip(self.damping_ratio.tolist(), evidence, strict=True)
            ],
            "± damping": [percent(e.damping_spread, 2) if e.damping_spread < 0.995 else "all of it" for e in evidence],
            "confidence": [f"{e.confidence:.2f}" for e in evidence],
            "MPC": [f"{e.modal_phase_collinearity:.3f}" for e in evidence],
            "MPD": [f"{e.mean_phase_deviation_deg:.2g}°" for e in evidence],
        }
        if len(self.setups) > 1:
            columns["setups"] = [f"{e.setups} of {len(self.setups)}" for e in evidence]
        yield Table(columns, "modes")
        if len(self.setups) > 1:
            each = [", ".join(number(f / scale.size) for f in setup.frequency_hz) for setup in self.setups]
            yield Table({"setup": [setup.name for setup in self.setups], scale.heading("modes"): each}, "setups")
        yield Facts({"synthesis error": percent(self.synthesis_error, 2)})

    def _columns(self) -> dict[str, Any]:
        return {
            "mode": np.arange(1, len(self.poles) + 1),
            "frequency [Hz]": self.frequency_hz,
            "damping ratio": self.damping_ratio,
            "confidence": self.confidence,
            "frequency spread": [e.frequency_spread for e in self.evidence],
            "damping spread": [e.damping_spread for e in self.evidence],
            "modal phase collinearity": [e.modal_phase_collinearity for e in self.evidence],
            "mean phase deviation [deg]": [e.mean_phase_deviation_deg for e in self.evidence],
        }


def fraction(s: Complex, poles: Complex, step: float) -> Complex:
    """1 / (s - pole) (f, n), or with a step, s, what it becomes of samples but for a constant (theory eq. I29)."""
    away = s[:, None] - poles
    return np.asarray(1 / away if step == 0 else step / 2 / np.tanh(step / 2 * away), dtype=np.complex128)


def responses(
    s: Complex,
    poles: Complex,
    shapes: Complex,
    participation: Complex,
    lower: Array | None = None,
    upper: Array | None = None,
    step: float = 0.0,
) -> Complex:
    """Displacements per unit input (f, p, m) at s (f,), 1/s, from modes and residuals (theory eq. I1).

    With a `step`, s, they are those of what is sampled (theory eq. I29).
    """
    q = np.concatenate([fraction(s, poles, step), fraction(s, poles.conj(), step)], axis=1)
    left, right = (np.concatenate([x, x.conj()], axis=1) for x in (shapes, participation))
    H = np.einsum("fr,pr,mr->fpm", q, left, right, optimize=True)
    if upper is not None:
        H = H + upper
    return H if lower is None else H + lower / s[:, None, None] ** 2


SAME_MODE_OF_SETUPS = 0.1
"""Frequencies of one mode differ by less between setups, relative."""

Setups = tuple[tuple[str, tuple[MeasuredChannel, ...]], ...]


def setups_of(data: IdentifiedModes) -> Setups:
    """Names and outputs of the setups in which modes were measured."""
    return tuple((one.setup, one.outputs) for one in data.setups or (data,))


@dataclass(frozen=True, repr=False)
class Recording(Tabular):
    """One time record, such as one hit: `samples` (c, N) of the channels at `sample_rate`, Hz.

    `inputs` are the positions of the channels that excite, such as the hammer. `setup` tells placements of sensors
    apart, each of which has its sensors' mass in other places.
    """

    sample_rate: float
    samples: Array
    channels: tuple[MeasuredChannel, ...]
    inputs: tuple[int, ...] = (0,)
    setup: str = ""
    name: str = ""

    def presentation(self) -> Iterator[Item]:
        duration = quantity(self.samples.shape[1] / self.sample_rate, "s")
        yield Facts({"duration": duration, "sample rate": in_hz(self.sample_rate), "setup": self.setup})
        rows = list(zip(self.channels, self.samples, strict=True))
        columns = {
            "channel": [c.name for c in self.channels],
            "": ["input" if k in self.inputs else "output" for k in range(len(self.channels))],
            "largest": [quantity(float(np.abs(x).max()), c.unit, 4) for c, x in rows],
            "rms": [quantity(float(np.sqrt(np.mean(x**2))), c.unit, 4) for c, x in rows],
        }
        yield Table(columns, "channels")

    def _data(self) -> dict[str, Any]:
        data = dict(super()._data())
        rate = data.pop("sample_rate")
        return {**data, "sample_rate_hz": rate}

    def _columns(self) -> dict[str, Any]:
        time = {"time [s]": np.arange(self.samples.shape[1]) / self.sample_rate}
        return time | {str(c): x for c, x in zip(self.channels, self.samples, strict=True)}


@dataclass(frozen=True, repr=False)
class MeasuredFRF(Tabular):
    """H (f, p, m) at `frequency_hz` (f,): response of each output to a unit of each input, e^(+i omega t).

    `coherence` (f, p, m) from `averages` records, where known. `decay`, 1/s, is what an exponential window has added to
    the decay rate of every mode. `estimator`: H1, H2, Hv or joint. `partial_coherence` (f, p, m) is that with one input
    once the others are taken out, where several excite at once. `sigma` (f, p, m) are standard deviations of the
    complex values, in their unit, of which real and imaginary part have a half of the variance each; None where
    coherence and averages tell the noise, or nothing does.
    """

    frequency_hz: Array
    response: Complex
    inputs: tuple[MeasuredChannel, ...]
    outputs: tuple[MeasuredChannel, ...]
    coherence: Array | None = None
    averages: int | None = None
    estimator: str = ""
    decay: float = 0.0
    setup: str = ""
    notes: tuple[str, ...] = ()
    partial_coherence: Array | None = None
    sigma: Array | None = None

    def _title(self) -> str:
        lines = counted(len(self.frequency_hz), "line")
        return f"{lines} from {ends((self.frequency_hz[0], self.frequency_hz[-1]), 'Hz', 5)}"

    def presentation(self) -> Iterator[Item]:
        facts = {"setup": self.setup, "estimator": self.estimator, "records": self.averages}
        yield Facts({**facts, "exponential window [1/s]": self.decay or None})
        pairs = list(np.ndindex(self.response.shape[1:]))
        units = [unit_of_response(self.outputs[i], self.inputs[j]) for i, j in pairs]
        sizes = [np.abs(self.response[:, i, j]) for i, j in pairs]
        columns: dict[str, Any] = {
            "output": [self.outputs[i].name for i, _ in pairs],
            "input": [self.inputs[j].name for _, j in pairs],
            "peak": [quantity(float(H.max()), unit, 4) for H, unit in zip(sizes, units, strict=True)],
            "peak at [Hz]": [float(self.frequency_hz[H.argmax()]) for H in sizes],
        }
        if self.coherence is not None:
            columns["median coherence"] = [f"{_median(self.coherence[:, i, j]):.3f}" for i, j in pairs]
        if self.partial_coherence is not None:
            columns["partial"] = [f"{_median(self.partial_coherence[:, i, j]):.3f}" for i, j in pairs]
        if self.sigma is not None:
            peaks = zip(pairs, sizes, strict=True)
            columns["scatter"] = [percent(_median(self.sigma[:, i, j]) / _median(H)) for (i, j), H in peaks]
        yield Table(columns, "pairs")

    def _data(self) -> dict[str, Any]:
        numbers = {"frequency_hz": self.frequency_hz, "real": self.response.real, "imaginary": self.response.imag}
        ends = {"inputs": self.inputs, "outputs": self.outputs}
        shares = {"coherence": self.coherence, "partial_coherence": self.partial_coherence}
        own = {"sigma": self.sigma, "estimator": self.estimator}
        return {**self._summary(), **ends, **numbers, **shares, **own}

    def _summary(self) -> dict[str, Any]:
        """What the responses are of, without them."""
        return {
            "setup": self.setup,
            "inputs": [c.name for c in self.inputs],
            "outputs": [c.name for c in self.outputs],
            "lines": len(self.frequency_hz),
            "from_hz": self.frequency_hz[0],
            "to_hz": self.frequency_hz[-1],
            "averages": self.averages,
            "median_coherence": None if self.coherence is None else _median(self.coherence),
            "decay": self.decay,
            "notes": self.notes,
        }

    def _columns(self) -> dict[str, Any]:
        """Frequency, then magnitude and phase of every pair."""
        return response_columns(self.frequency_hz, self.response, self.inputs, self.outputs)


@dataclass(frozen=True, repr=False)
class Measurement(Result):
    """All that one test has given: time records, frequency responses, or both; SI.

    `modes` are those that a file of the test came with.
    """

    name: str
    recordings: tuple[Recording, ...] = ()
    frfs: tuple[MeasuredFRF, ...] = ()
    notes: tuple[str, ...] = field(default=())
    modes: IdentifiedModes | None = None
    traces: tuple[Trace, ...] = ()

    def presentation(self) -> Iterator[Item]:
        setups = dict.fromkeys(data.setup for data in (*self.recordings, *self.frfs))
        counts = {"records": len(self.recordings), "setups": ", ".join(setups)}
        yield Facts({**counts, "modes in the file": "" if self.modes is None else len(self.modes.poles)})
        coherences = [frf.coherence for frf in self.frfs]
        columns = {
            "responses of": [frf.setup or str(k + 1) for k, frf in enumerate(self.frfs)],
            "inputs": [", ".join(c.name for c in frf.inputs) for frf in self.frfs],
            "outputs": [", ".join(c.name for c in frf.outputs) for frf in self.frfs],
            "lines": [len(frf.frequency_hz) for frf in self.frfs],
            "band": [ends((frf.frequency_hz[0], frf.frequency_hz[-1]), "Hz", 5) for frf in self.frfs],
            "averages": [frf.averages for frf in self.frfs],
            "coherence": ["" if gamma is None else f"{_median(gamma):.3f}" for gamma in coherences],
        }
        yield Table(columns, "sets of responses")

    def _data(self) -> dict[str, Any]:
        """Everything but samples and responses, which their own `to_dict` gives."""
        return {
            "name": self.name,
            "recordings": [
                {
                    "name": record.name,
                    "setup": record.setup,
                    "channels": [c.name for c in record.channels],
                    "inputs": record.inputs,
                    "sample_rate_hz": record.sample_rate,
                    "samples": record.samples.shape[1],
                }
                for record in self.recordings
            ],
            "responses": [frf._summary() for frf in self.frfs],
            "modes": self.modes,
        }


def _median(values: Array) -> float:
    """The upper median, one of the values."""
    return float(np.sort(values, axis=None)[values.size // 2])


HIGHEST_HZ = 1e12
"""Highest frequency and sample rate, Hz: squares and powers of far higher ones overflow."""

LARGEST_VALUE = 1e100
"""Largest value of a sample or a response."""


def refuse_implausible(measurement: Measurement, where: str) -> None:
    """Raise OptionError for numbers beyond all bounds, and for arrays of different sizes.

    Names and setups are short and printable: they become parts of tables, pictures and messages.
    """
    records, frfs = measurement.recordings, measurement.frfs
    channels = [*(c for r in records for c in r.channels), *(c for f in frfs for c in (*f.inputs, *f.outputs))]
    names = [measurement.name, *(name for c in channels for name in (c.name, c.node or ""))]
    names += [*(name for r in records for name in (r.name, r.setup)), *(f.setup for f in frfs)]
    for name in names:
        if len(name) > LONGEST_TITLE or CONTROL.search(name):
            shown = repr(name if len(name) <= 40 else f"{name[:37]}...")
            raise OptionError(
                f"{where}: a name has at most {LONGEST_TITLE} characters and no control characters, not {shown}"
            )
    for r in records:
        place = f"{where}: {r.name or 'record'}"
        if not 0 < r.sample_rate <= HIGHEST_HZ:
            raise OptionError(
                f"{place}: a sample rate is positive and at most {HIGHEST_HZ:g} Hz, not {r.sample_rate:g}"
            )
        if not r.samples.shape[-1]:
            raise OptionError(f"{place}: there are no samples")
        _refuse_large(r.samples, place)
    for frf in frfs:
        _refuse_response(frf, f"{where}: responses of setup {frf.setup!r}" if frf.setup else f"{where}: responses")


def _refuse_response(frf: MeasuredFRF, where: str) -> None:
    hz = frf.frequency_hz
    if not len(hz):
        raise OptionError(f"{where}: there are no frequencies")
    if not (np.isfinite(hz).all() and hz.min() >= 0 and hz.max() <= HIGHEST_HZ):
        span = f"{hz.min():g} to {hz.max():g}"
        raise OptionError(f"{where}: frequencies lie between 0 and {HIGHEST_HZ:g} Hz, these from {span}")
    if (np.diff(hz) <= 0).any():
        at = int(np.argmax(np.diff(hz) <= 0))
        raise OptionError(
            f"{where}: frequencies ascend, each is given once; {hz[at]:g} Hz comes before {hz[at + 1]:g} Hz"
        )
    if not (np.isfinite(frf.decay) and 0 <= frf.decay <= HIGHEST_HZ):
        raise OptionError(f"{where}: the decay of a window is a rate in 1/s, not {frf.decay:g}")
    _refuse_large(frf.response, where)
    for gamma in (frf.coherence, frf.partial_coherence):
        if gamma is not None and gamma.shape != frf.response.shape:
            raise OptionError(f"{where}: coherence is {gamma.shape}, responses are {frf.response.shape}")
        if gamma is not None:
            _refuse_large(gamma, f"{where}: coherence")
    if frf.sigma is not None and (frf.sigma.shape != frf.response.shape or not (frf.sigma >= 0).all()):
        raise OptionError(f"{where}: sigma is a standard deviation, at least 0, of every response")


def _refuse_large(values: np.ndarray, where: str) -> None:
    """Values that are no numbers are judged elsewhere."""
    size = np.abs(values)
    beyond = np.isfinite(size) & (size > LARGEST_VALUE)
    if beyond.any():
        raise OptionError(f"{where}: a value of {size[beyond][0]:.3g}; at most {LARGEST_VALUE:g} is expected")


Repeated = Literal["average", "first", "last"]
"""What to make of them: their mean, or the one that comes first or last."""

MOST_PAIRS = 3
"""Pairs that are named in a note."""

T = TypeVar("T")


def checked(how: str | None) -> None:
    """Raise OptionError for what is no way of merging; None is to refuse them."""
    if how is not None and how not in get_args(Repeated):
        raise OptionError(f"repeated is one of {', '.join(get_args(Repeated))}, not {how!r}")


def merged(values: Sequence[NDArray[Any]], how: Repeated) -> NDArray[Any]:
    """One of several arrays of a shape: their mean, the first or the last."""
    return np.mean(values, axis=0) if how == "average" else values[0 if how == "first" else -1]


def repeated_note(again: Sequence[tuple[str, int]], how: Repeated) -> str:
    """A note on pairs, each with how often it is given."""
    named = ", ".join(f"{pair} ({count} times)" for pair, count in again[:MOST_PAIRS])
    more = f" and {len(again) - MOST_PAIRS} more" if len(again) > MOST_PAIRS else ""
    done = {"average": "averaged", "first": "the first one is used", "last": "the last one is used"}[how]
    return f"given more than once, {done}: {named}{more}"


def grouped(items: Sequence[T], key: Callable[[T], Any]) -> dict[Any, list[T]]:
    """Items of one key together, in their order."""
    groups: dict[Any, list[T]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups
