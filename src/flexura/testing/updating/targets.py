"""What a calibration is to meet: frequencies, shapes and responses, as weighted residuals with derivatives.

Among them natural frequencies as a plain list, from YAML or CSV.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.derivatives import Change, Cluster, Reader, clusters, modal_response
from flexura.errors import ModelError, OptionError
from flexura.files import read_text
from flexura.linalg import Eigenpairs
from flexura.modal import pair_modes
from flexura.modelfile import parse_any
from flexura.results import Tabular
from flexura.structure import DERIVATIVE
from flexura.tables import Item, Table, percent
from flexura.testing.measurement import IdentifiedModes, MeasuredChannel, MeasuredFRF, Measurement, Setups, setups_of

UNITS = {"Hz": 1.0, "kHz": 1e3, "rad/s": 1 / (2 * np.pi), "rpm": 1 / 60}
"""Hz in units of frequency."""

NOT_MEASURED = ("", "-", "\N{EN DASH}", "\N{EM DASH}")
"""What stands for the frequency of a mode that was not measured."""

_NUMBER = re.compile(r"\s*([-+]?\d*\.?\d+(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*")


@dataclass(frozen=True, repr=False)
class MeasuredFrequencies(Tabular):
    """Natural frequencies `frequency_hz` (n,), ascending, and their relative standard deviations `sigma` (n,).

    Nan in `sigma`: not known. `number` (n,) counts modes from 1; a number that is not there was not measured. `setups`
    have the names and outputs of the setups of a test in which they were measured.
    """

    name: str
    frequency_hz: Array
    sigma: Array
    setups: tuple[tuple[str, tuple[MeasuredChannel, ...]], ...] = ()
    number: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def __post_init__(self) -> None:
        if not len(self.number):
            object.__setattr__(self, "number", np.arange(1, len(self.frequency_hz) + 1))

    def presentation(self) -> Iterator[Item]:
        known = [percent(float(s)) for s in self.sigma]
        yield Table({"mode": self.number, "measured [Hz]": self.frequency_hz, "standard deviation": known}, "modes")

    def _columns(self) -> dict[str, Any]:
        frequencies = {"frequency [Hz]": self.frequency_hz, "relative standard deviation": self.sigma}
        return {"mode": self.number, **frequencies}

    @property
    def by_number(self) -> dict[int, float]:
        """Frequencies, Hz, by the number of the mode."""
        return dict(zip(self.number.tolist(), self.frequency_hz.tolist(), strict=True))

    @classmethod
    def of(
        cls, frequency_hz: ArrayLike | Sequence[float | None], sigma: ArrayLike | None = None, name: str = ""
    ) -> MeasuredFrequencies:
        """From numbers in Hz, None for modes that were not measured.

        Raises OptionError for what is not positive and finite, and where modes were not measured for a list that does
        not ascend.
        """
        place = f"{name}: " if name else ""
        listed = list(frequency_hz) if isinstance(frequency_hz, list | tuple) else None
        gaps = [] if listed is None else [k for k, x in enumerate(listed) if x is None]
        try:
            hz = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
            relative = np.broadcast_to(np.asarray(np.nan if sigma is None else sigma, dtype=float), hz.shape)
        except (TypeError, ValueError):
            raise OptionError(f"{place}a list of frequencies in Hz is expected") from None
        if hz.ndim != 1 or len(hz) == len(gaps):
            raise OptionError(f"{place}at least one frequency is expected")
        number = np.delete(np.arange(1, len(hz) + 1), gaps)
        hz, relative = hz[number - 1], relative[number - 1]
        bad = hz[~(np.isfinite(hz) & (hz > 0))]
        if len(bad):
            raise OptionError(f"{place}a natural frequency is positive and finite, not {bad[0]:g}")
        if (relative <= 0).any() or np.isinf(relative).any():
            raise OptionError(f"{place}a standard deviation is positive and finite")
        if gaps and (np.diff(hz) < 0).any():
            raise OptionError(
                f"{place}with modes that were not measured the others are listed ascending: they are counted"
            )
        order = np.argsort(hz, kind="stable")
        return cls(name, hz[order], relative[order].copy(), (), number)


@verb
def read_frequencies(path: str | Path) -> MeasuredFrequencies:
    """Frequencies of a YAML or CSV file.

    CSV: a header `frequency,unit,sigma`, of which the last two columns may be absent. YAML: a list, or a mapping with
    the key `frequencies` that holds one, of entries such as `46.861 rad/s` or `{frequency: 46.861 rad/s, sigma: 1 %}`.
    Units are Hz, kHz, rad/s and rpm; sigma is in per cent, or in the unit of the frequency. Raises OptionError, with
    the entry, for anything else.

    A mode that was not measured has no frequency: `-`, nothing between the commas of a row, or null in YAML. The modes
    behind it keep their numbers.
    """
    file = Path(path)
    text = read_text(path, "model_bytes")
    rows = _csv_rows(text, file.name) if file.suffix.lower() == ".csv" else _yaml_rows(text, file.name)
    entries = [_entry(row, f"{file.name}, entry {k + 1}") for k, row in enumerate(rows)]
    if all(hz is None for hz, _ in entries):
        raise OptionError(f"{file.name} holds no frequencies")
    return MeasuredFrequencies.of([hz for hz, _ in entries], [sigma for _, sigma in entries], file.stem)


def _csv_rows(text: str, name: str) -> list[Any]:
    reader = csv.DictReader(io.StringIO(text, newline=None), skipinitialspace=True)
    try:
        listed, headings = list(reader), reader.fieldnames
    except csv.Error as error:
        raise OptionError(f"{name}: not a table: {error}") from None
    if "frequency" not in (headings or ()):
        raise OptionError(f"{name}: the header is frequency,unit,sigma")
    lines = text.rstrip().splitlines()
    blank = [n for n, line in enumerate(lines, 1) if not line.strip()]
    if blank:
        raise OptionError(f"{name}, line {blank[0]} is empty: write - for a mode that was not measured")
    return [{k: v for k, v in row.items() if k == "frequency" or (k and v not in (None, ""))} for row in listed]


def _yaml_rows(text: str, name: str) -> list[Any]:
    try:
        data = parse_any(text, name).plain()
    except ModelError as error:
        problem = error.problems[0]
        raise OptionError(f"{problem.where}: {problem.rule}") from None
    rows = data.get("frequencies") if isinstance(data, Mapping) else data
    if not isinstance(rows, Sequence) or isinstance(rows, str):
        raise OptionError(f"{name}: a list of frequencies is expected, e.g. frequencies: [46.9 rad/s, 53.5 rad/s]")
    return list(rows)


def _entry(row: Any, place: str) -> tuple[float | None, float]:
    """Frequency, Hz, None where it was not measured, and relative standard deviation, nan where it is not given."""
    if not isinstance(row, Mapping):
        row = {"frequency": row}
    unknown = set(row) - {"frequency", "unit", "sigma"}
    if unknown or "frequency" not in row:
        raise OptionError(f"{place}: keys are frequency, unit and sigma; found {', '.join(map(str, row))}")
    if row["frequency"] is None or str(row["frequency"]).strip() in NOT_MEASURED:
        return None, np.nan
    value, unit = _quantity(row["frequency"], place)
    unit = str(row["unit"]).strip() if row.get("unit") is not None else unit
    if unit not in UNITS:
        raise OptionError(f"{place}: a frequency carries a unit, one of {', '.join(UNITS)}; found {unit or 'none'}")
    hz = value * UNITS[unit]
    if row.get("sigma") is None:
        return hz, np.nan
    sigma, sigma_unit = _quantity(row["sigma"], place)
    if sigma_unit == "%":
        return hz, sigma / 100
    if sigma_unit and sigma_unit not in UNITS:
        raise OptionError(f"{place}: sigma is in % or a unit of frequency, not {sigma_unit}")
    return hz, sigma * UNITS[sigma_unit or unit] / hz if value else np.nan


def _quantity(raw: Any, place: str) -> tuple[float, str]:
    match = _NUMBER.fullmatch(str(raw))
    if match is None or isinstance(raw, bool):
        raise OptionError(f"{place}: {raw!r} is not a number with a unit")
    return float(match[1]), match[2] or ""


COHERENT_POINT = 0.5
"""Points of a frequency response with less coherence are left out."""

SILENT_RESPONSE = 1e-3
"""Responses that stay below so much of the largest of their row and column are noise: symmetry makes them zero."""

MOST_POINTS = 240
"""Points of one frequency response that are compared, evenly chosen."""


@dataclass
class State:
    """The model at one design: modes, what the channels read of them (o, n), and derivatives where asked for.

    `moved` are the clusters of repeated frequencies, `changes` those of the vectors and of the static ones G after
    them.
    """

    family: Reader
    at: dict[str, float]
    pairs: Eigenpairs
    Y: Array
    tracked: NDArray[np.intp]
    G: Array
    moved: Sequence[Cluster]
    changes: Sequence[Change]

    @property
    def frequency_hz(self) -> Array:
        """Natural frequencies (n,), Hz."""
        return np.sqrt(np.maximum(self.pairs.values, 0.0)) / (2 * np.pi)


@dataclass(frozen=True)
class ModalTarget:
    """Frequencies (k,), Hz, with relative standard deviations `sigma` (k,), and shapes (p, k) at channels or None.

    `setups` have the names and the outputs of the setups in which they were measured; `number` (k,) counts modes
    without shapes from 1.
    """

    frequency_hz: Array
    sigma: Array
    shapes: Array | None
    channels: tuple[MeasuredChannel, ...]
    shape_sigma: float
    name: str = ""
    setups: Setups = ()
    number: tuple[int, ...] = ()

    @property
    def parts(self) -> tuple[tuple[str, int], ...]:
        """Kinds of residuals, and how many there are of each."""
        count = len(self.frequency_hz)
        return ("frequencies", count), ("shapes", count * len(self.channels))

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers (k,) of the modes."""
        return self.number or tuple(range(1, len(self.frequency_hz) + 1))

    def partner(self, state: State, rows: slice) -> NDArray[np.intp]:
        """The model's mode (k,) for every measured one: by shape where there are shapes, else as tracked."""
        tracked = state.tracked[np.array(self.numbers) - 1]
        if self.shapes is None:
            return tracked
        hz, Y = state.frequency_hz, state.Y[rows]
        by_shape = pair_modes(self.frequency_hz, self.shapes, model_hz=hz, model_shapes=Y).partner
        return np.where(by_shape >= 0, by_shape, tracked)

    def residual(self, state: State, rows: slice) -> Array:
        """ln(f/f_measured)/sigma, and what is left of every shape (theory eqs. K13-K14)."""
        partner = self.partner(state, rows)
        parts = [np.log(np.maximum(state.frequency_hz[partner], 1e-12) / self.frequency_hz) / self.sigma]
        if self.shapes is not None:
            parts += [self._left(state, rows, k, m)[0] for k, m in enumerate(partner)]
        return np.concatenate(parts)

    def jacobian(self, state: State, rows: slice) -> Array:
        """Derivatives (r, P) of the residual."""
        partner, P = self.partner(state, rows), len(state.changes)
        slope = np.zeros((len(partner), P))
        for cluster in state.moved:
            for k, mode in enumerate(partner):
                if mode in cluster.at:
                    j = cluster.at.index(mode)
                    slope[k] = cluster.slope[:, j, j] / (2 * max(cluster.value, 1e-300) * self.sigma[k])
        parts = [slope]
        if self.shapes is not None:
            parts += [self._left_slope(state, rows, k, m) for k, m in enumerate(partner)]
        return np.concatenate(parts)

    def _left(self, state: State, rows: slice, k: int, mode: int) -> tuple[Array, Array, Array, Array]:
        """(psi - Y Y+ psi)/(|psi| sigma) (p,) of a shape in the space of a mode's cluster; and Y, Y+, psi."""
        assert self.shapes is not None
        at = next(g for g in clusters(state.pairs.values) if mode in g)
        psi = self.shapes[:, k] / float(np.linalg.norm(self.shapes[:, k]))
        Y = state.Y[rows][:, at]
        inverse: Array = np.asarray(np.linalg.pinv(Y), dtype=np.float64)
        return (psi - Y @ (inverse @ psi)) / self.shape_sigma, Y, inverse, psi

    def _left_slope(self, state: State, rows: slice, k: int, mode: int) -> Array:
        left, Y, inverse, psi = self._left(state, rows, k, mode)
        cluster = next(c for c in state.moved if mode in c.at)
        slope = np.empty((len(left), len(state.changes)))
        for q, change in enumerate(state.changes):
            dY = change.Y[rows][:, cluster.at] + state.family.readings(state.at, cluster.outer[q])[rows]
            across = dY @ (inverse @ psi)
            across = across - Y @ (inverse @ across) + inverse.T @ (dY.T @ (left * self.shape_sigma))
            slope[:, q] = -across / self.shape_sigma
        return slope

    def mac(self, state: State, rows: slice) -> list[float | None]:
        """Modal assurance criterion (k,) with the model's mode, or space of repeated ones."""
        if self.shapes is None:
            return [None] * len(self.frequency_hz)
        partner = self.partner(state, rows)
        left = [self._left(state, rows, k, m)[0] * self.shape_sigma for k, m in enumerate(partner)]
        return [float(1 - r @ r) for r in left]


@dataclass(frozen=True)
class ResponseTarget:
    """Measured frequency responses at some frequencies `hz` (f,), H (f, p, m), with standard deviations `sigma`
    (f, p, m) of ln H, infinite where they say nothing, and damping ratio and window decay, 1/s, in some setup."""

    hz: Array
    H: Complex
    sigma: Array
    outputs: tuple[MeasuredChannel, ...]
    inputs: tuple[MeasuredChannel, ...]
    damping: float
    decay: float
    setups: Setups = ()

    @property
    def parts(self) -> tuple[tuple[str, int], ...]:
        """Kinds of residuals, and how many there are of each."""
        return (("responses", 2 * self.sigma.size),)

    @property
    def channels(self) -> tuple[MeasuredChannel, ...]:
        """Outputs, then inputs."""
        return (*self.outputs, *self.inputs)

    def _model(self, state: State, rows: slice) -> tuple[Complex, Complex]:
        with np.errstate(divide="ignore"):
            ratios = self.damping + self.decay / np.sqrt(np.maximum(state.pairs.values, 1e-300))
        reader, n = _Cut(state.family, rows), len(state.pairs.values)
        keep = np.r_[:n, n + np.arange(rows.start, rows.stop)]
        H, dH = modal_response(
            reader,
            state.at,
            state.pairs,
            state.moved,
            static=state.G[:, rows],
            changes=[Change(c.K[:, keep], c.M[:, keep], c.Y[rows][:, keep]) for c in state.changes],
            hz=self.hz,
            outputs=len(self.outputs),
            damping=ratios,
        )
        order = np.array([DERIVATIVE.get(c.quantity, 0) for c in self.outputs])
        factor = ((2j * np.pi * self.hz[:, None]) ** order)[:, :, None]
        return H * factor, dH * factor

    def residual(self, state: State, rows: slice) -> Array:
        """Real and imaginary part of ln(H/H_measured)/sigma (theory eq. K15)."""
        H, _ = self._model(state, rows)
        compared = self._is_compared(H)
        ratio = np.where(compared, H, 1.0) / np.where(compared, self.H, 1.0)
        left = np.where(compared, np.log(ratio), 0.0) / self.sigma
        return np.concatenate([left.real.ravel(), left.imag.ravel()])

    def jacobian(self, state: State, rows: slice) -> Array:
        """Derivatives (r, P) of the residual."""
        H, dH = self._model(state, rows)
        compared = self._is_compared(H)
        slope = (np.where(compared, dH / np.where(compared, H, 1.0), 0.0) / self.sigma).reshape(len(dH), -1).T
        return np.concatenate([slope.real, slope.imag])

    def _is_compared(self, H: Complex) -> NDArray[np.bool_]:
        """Where there is something to compare (f, p, m): not where the model's response is zero by symmetry."""
        return np.isfinite(self.sigma) & (np.abs(H) > SILENT_RESPONSE**2 * np.abs(self.H))


class _Cut:
    """A family that reads some of its rows only."""

    def __init__(self, family: Reader, rows: slice) -> None:
        self._family, self._rows = family, rows

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        return self._family.readings(parameters, X)[self._rows]


Target = ModalTarget | ResponseTarget


def targets_of(data: Any, sigma: float, shape_sigma: float, response_sigma: float, damping: float) -> list[Target]:
    """Targets from frequencies in Hz, identified modes, frequency responses, measurements, or a list of these.

    Raises OptionError for anything else.
    """
    if isinstance(data, MeasuredFrequencies):
        relative, number = np.where(np.isnan(data.sigma), sigma, data.sigma), tuple(data.number.tolist())
        return [ModalTarget(data.frequency_hz, relative, None, (), shape_sigma, data.name, data.setups, number)]
    if isinstance(data, IdentifiedModes):
        spread = np.array([e.frequency_spread for e in data.evidence]) if data.evidence else np.zeros(1)
        relative = np.maximum(np.where(np.isfinite(spread), spread, 0.0), sigma) * np.ones(len(data.poles))
        shapes, channels = (data.real_shapes, data.outputs) if len(data.outputs) > 1 else (None, ())
        return [ModalTarget(data.frequency_hz, relative, shapes, channels, shape_sigma, data.name, setups_of(data))]
    if isinstance(data, MeasuredFRF):
        return [_response_target(data, response_sigma, damping)]
    if isinstance(data, Measurement):
        if not data.frfs:
            raise OptionError(f"{data.name} holds no frequency responses; estimate or identify them first")
        return [_response_target(frf, response_sigma, damping) for frf in data.frfs]
    if isinstance(data, Sequence | np.ndarray) and len(data) and not isinstance(data, str):
        if all(x is None or isinstance(x, int | float | np.number) for x in data):
            return targets_of(MeasuredFrequencies.of(data), sigma, shape_sigma, response_sigma, damping)
        return [t for x in data for t in targets_of(x, sigma, shape_sigma, response_sigma, damping)]
    raise OptionError(
        "data are frequencies in Hz, identified modes, frequency responses, a measurement, or a list of these; not"
        f" {type(data).__name__}"
    )


def _response_target(frf: MeasuredFRF, sigma: float, damping: float) -> ResponseTarget:
    """Points that are finite, not zero and coherent; coherence widens sigma (Bendat and Piersol 2010, ch. 9)."""
    sigmas = np.full(frf.response.shape, sigma)
    if frf.sigma is not None:
        size = np.abs(frf.response) * np.sqrt(2)
        sigmas = np.hypot(sigmas, np.divide(frf.sigma, size, out=np.zeros_like(sigmas), where=size > 0))
    elif frf.coherence is not None:
        gamma = np.clip(frf.coherence, 1e-6, 1.0)
        sigmas = np.hypot(sigmas, np.sqrt((1 - gamma) / (2 * gamma * max(frf.averages or 1, 1))))
        sigmas = np.where(frf.coherence >= COHERENT_POINT, sigmas, np.inf)
    good = np.isfinite(frf.response) & (np.abs(frf.response) > 0) & (frf.frequency_hz > 0)[:, None, None]
    peak = np.where(good, np.abs(frf.response), 0.0).max(axis=0)
    loud = peak > SILENT_RESPONSE * np.sqrt(np.outer(peak.max(axis=1), peak.max(axis=0)))
    sigmas = np.where(good & loud, sigmas, np.inf)
    useful = np.flatnonzero(np.isfinite(sigmas).any(axis=(1, 2)))
    if not len(useful):
        raise OptionError("the frequency responses have no point that is finite, not zero and coherent")
    at = useful[np.unique(np.linspace(0, len(useful) - 1, min(len(useful), MOST_POINTS)).round().astype(int))]
    H = np.where(np.isfinite(sigmas), frf.response, 1.0)
    setups = ((frf.setup, frf.outputs),)
    return ResponseTarget(frf.frequency_hz[at], H[at], sigmas[at], frf.outputs, frf.inputs, damping, frf.decay, setups)
