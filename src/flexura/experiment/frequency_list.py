"""Measured natural frequencies as a plain list, from YAML or CSV."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.errors import OptionError
from flexura.experiment.measurement import MeasuredChannel

Array = NDArray[np.float64]

UNITS = {"Hz": 1.0, "kHz": 1e3, "rad/s": 1 / (2 * np.pi), "rpm": 1 / 60}
"""Hz in units of frequency."""

_NUMBER = re.compile(r"\s*([-+]?\d*\.?\d+(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*")


@dataclass(frozen=True)
class MeasuredFrequencies:
    """Natural frequencies `frequency_hz` (n,), ascending, and their relative standard deviations `sigma` (n,).

    Nan in `sigma`: not known. `setups` have the names and outputs of the setups of a test in which they were measured.
    """

    name: str
    frequency_hz: Array
    sigma: Array
    setups: tuple[tuple[str, tuple[MeasuredChannel, ...]], ...] = ()

    @classmethod
    def of(cls, frequency_hz: ArrayLike, sigma: ArrayLike | None = None, name: str = "") -> MeasuredFrequencies:
        """From numbers in Hz. Raises OptionError for what is not positive and finite."""
        place = f"{name}: " if name else ""
        try:
            hz = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
            relative = np.broadcast_to(np.asarray(np.nan if sigma is None else sigma, dtype=float), hz.shape)
        except (TypeError, ValueError):
            raise OptionError(f"{place}a list of frequencies in Hz is expected") from None
        if hz.ndim != 1 or not len(hz):
            raise OptionError(f"{place}at least one frequency is expected")
        bad = hz[~(np.isfinite(hz) & (hz > 0))]
        if len(bad):
            raise OptionError(f"{place}a natural frequency is positive and finite, not {bad[0]:g}")
        if (relative <= 0).any() or np.isinf(relative).any():
            raise OptionError(f"{place}a standard deviation is positive and finite")
        order = np.argsort(hz, kind="stable")
        return cls(name, hz[order], relative[order].copy())


def read_frequencies(path: str | Path) -> MeasuredFrequencies:
    """Frequencies of a YAML or CSV file.

    CSV: a header `frequency,unit,sigma`, of which the last two columns may be absent. YAML: a list, or a mapping with
    the key `frequencies` that holds one, of entries such as `46.861 rad/s` or `{frequency: 46.861 rad/s, sigma: 1 %}`.
    Units are Hz, kHz, rad/s and rpm; sigma is in per cent, or in the unit of the frequency. Raises OptionError, with
    the entry, for anything else.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise OptionError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    rows = _csv_rows(text, file.name) if file.suffix.lower() == ".csv" else _yaml_rows(text, file.name)
    found = [_entry(row, f"{file.name}, entry {k + 1}") for k, row in enumerate(rows)]
    if not found:
        raise OptionError(f"{file.name} holds no frequencies")
    hz, sigma = np.array(found).T
    return MeasuredFrequencies.of(hz, np.where(np.isnan(sigma), np.nan, sigma), file.stem)


def _csv_rows(text: str, name: str) -> list[Any]:
    reader = csv.DictReader(io.StringIO(text), skipinitialspace=True)
    if "frequency" not in (reader.fieldnames or ()):
        raise OptionError(f"{name}: the header is frequency,unit,sigma")
    return [{k: v for k, v in row.items() if k and v not in (None, "")} for row in reader]


def _yaml_rows(text: str, name: str) -> list[Any]:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        data = YAML(typ="safe", pure=True).load(text)
    except YAMLError as error:
        raise OptionError(f"{name}: not valid YAML: {' '.join(str(error).split())[:200]}") from None
    rows = data.get("frequencies") if isinstance(data, Mapping) else data
    if not isinstance(rows, Sequence) or isinstance(rows, str):
        raise OptionError(f"{name}: a list of frequencies is expected, e.g. frequencies: [46.9 rad/s, 53.5 rad/s]")
    return list(rows)


def _entry(row: Any, place: str) -> tuple[float, float]:
    """Frequency, Hz, and relative standard deviation, nan where it is not given."""
    if not isinstance(row, Mapping):
        row = {"frequency": row}
    unknown = set(row) - {"frequency", "unit", "sigma"}
    if unknown or "frequency" not in row:
        raise OptionError(f"{place}: keys are frequency, unit and sigma; found {', '.join(map(str, row))}")
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
