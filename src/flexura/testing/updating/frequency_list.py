"""Measured natural frequencies as a plain list, from YAML or CSV."""

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
from flexura.arrays import Array
from flexura.errors import ModelError, OptionError
from flexura.files import read_text
from flexura.modelfile import parse_any
from flexura.results import Tabular
from flexura.tables import Facts, Table, percent
from flexura.testing.measurement import MeasuredChannel

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

    def _view(self) -> Iterator[Facts | Table]:
        known = [percent(float(s)) for s in self.sigma]
        yield Table({"mode": self.number, "measured [Hz]": self.frequency_hz, "standard deviation": known}, "modes")

    def _columns(self) -> dict[str, Any]:
        own = {"frequency [Hz]": self.frequency_hz, "relative standard deviation": self.sigma}
        return {"mode": self.number, **own}

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
    found = [_entry(row, f"{file.name}, entry {k + 1}") for k, row in enumerate(rows)]
    if all(hz is None for hz, _ in found):
        raise OptionError(f"{file.name} holds no frequencies")
    return MeasuredFrequencies.of([hz for hz, _ in found], [sigma for _, sigma in found], file.stem)


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
    if row.get("sigma") is None:
        return value * UNITS[unit], np.nan
    sigma, own = _quantity(row["sigma"], place)
    if own == "%":
        return value * UNITS[unit], sigma / 100
    if own and own not in UNITS:
        raise OptionError(f"{place}: sigma is in % or a unit of frequency, not {own}")
    return value * UNITS[unit], sigma * UNITS[own or unit] / (value * UNITS[unit]) if value else np.nan


def _quantity(raw: Any, place: str) -> tuple[float, str]:
    match = _NUMBER.fullmatch(str(raw))
    if match is None or isinstance(raw, bool):
        raise OptionError(f"{place}: {raw!r} is not a number with a unit")
    return float(match[1]), match[2] or ""
