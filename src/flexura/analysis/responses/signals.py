"""Signals for inputs: functions of time, and files."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.files import read_text
from flexura.results import Tabular
from flexura.tables import Facts, Item, Table, quantity

Signal = Callable[[Array], Array]

UNEVEN = 1e-6
"""Relative difference of two steps from which a signal file has a gap."""

TIMES = ("time", "t")


def step(amplitude: float = 1.0, at: float = 0.0) -> Signal:
    """Zero before `at`, s, and `amplitude` from then on."""
    _finite(amplitude=amplitude, at=at)
    return lambda time: np.where(time >= at, amplitude, 0.0)


def half_sine(amplitude: float, width: float, at: float = 0.0) -> Signal:
    """Half a period of a sine of `width`, s, from `at` on: the pulse of a hammer, of impulse 2 amplitude width/pi."""
    _finite(amplitude=amplitude, at=at)
    _positive(width=width)

    def signal(time: Array) -> Array:
        inside = (time >= at) & (time <= at + width)
        return np.where(inside, amplitude * np.sin(np.pi * (time - at) / width), 0.0)

    return signal


def sine(amplitude: float, frequency_hz: float, phase: float = 0.0) -> Signal:
    """A sine of `frequency_hz`, Hz, with a phase, rad."""
    _finite(amplitude=amplitude, phase=phase)
    _positive(frequency_hz=frequency_hz)
    return lambda time: amplitude * np.sin(2 * np.pi * frequency_hz * time + phase)


def sweep(
    amplitude: float, start_hz: float, stop_hz: float, duration: float, law: Literal["linear", "logarithmic"] = "linear"
) -> Signal:
    """A sine whose frequency runs from `start_hz` to `stop_hz`, Hz, over `duration`, s, and is silent afterwards."""
    from scipy.signal import chirp

    _finite(amplitude=amplitude)
    _positive(start_hz=start_hz, stop_hz=stop_hz, duration=duration)
    if law not in ("linear", "logarithmic"):
        raise OptionError(f"law is linear or logarithmic, not {law!r}")

    def signal(time: Array) -> Array:
        wave = chirp(time, start_hz, duration, stop_hz, method=law, phi=-90)
        return np.where((time >= 0) & (time <= duration), amplitude * wave, 0.0)

    return signal


def random(rms: float, band: tuple[float, float] | None = None, seed: int = 0) -> Signal:
    """Gaussian noise of the given root mean square, flat over a band (from, to), Hz, or all frequencies.

    The same seed and times give the same signal.
    """
    _finite(rms=rms)
    if band is not None and not (math.isfinite(band[1]) and 0 <= band[0] < band[1]):
        raise OptionError(f"a band is two frequencies in Hz, 0 <= from < to, not {band}")

    def signal(time: Array) -> Array:
        noise = np.random.default_rng(seed).standard_normal(len(time))
        if band is not None:
            hz = np.fft.rfftfreq(len(time), time[1] - time[0])
            inside = (hz >= band[0]) & (hz <= band[1])
            if not inside.any():
                raise OptionError(f"the band {band[0]:g} to {band[1]:g} Hz lies between the frequencies of this signal")
            noise = np.fft.irfft(np.where(inside, np.fft.rfft(noise), 0.0), len(time))
        return noise * (rms / np.sqrt(np.mean(noise**2)))

    return signal


def _finite(**numbers: float) -> None:
    for name, value in numbers.items():
        if not math.isfinite(value):
            raise OptionError(f"{name} is a finite number, not {value}")


def _positive(**numbers: float) -> None:
    for name, value in numbers.items():
        if not (math.isfinite(value) and value > 0):
            raise OptionError(f"{name} is a positive number, not {value}")


@dataclass(frozen=True, repr=False)
class SignalFile(Tabular):
    """Signals of a file: the step `dt`, s, times (N,) from zero on, and samples (N,) by the name of their column."""

    dt: float
    time: Array
    signals: dict[str, Array]

    def presentation(self) -> Iterator[Item]:
        yield Facts(
            {"samples": len(self.time), "step": quantity(self.dt, "s"), "duration": quantity(float(self.time[-1]), "s")}
        )
        rows = list(self.signals.values())
        extremes = {"least [SI]": [y.min() for y in rows], "largest [SI]": [y.max() for y in rows]}
        yield Table({"signal": list(self.signals), **extremes, "last [SI]": [y[-1] for y in rows]}, "signals")

    def _data(self) -> dict[str, Any]:
        return {"dt_s": self.dt, "time_s": self.time, "signals": self.signals}

    def _columns(self) -> dict[str, Any]:
        """Time and the signals by name, each in the SI unit of its input."""
        return {"time [s]": self.time, **{f"{name} [SI]": samples for name, samples in self.signals.items()}}


@verb
def read_signals(path: str | Path) -> SignalFile:
    """Read signals from a CSV file: a header with `time` and the names of inputs, then evenly spaced rows in SI.

    Columns are separated by commas, semicolons or tabs; a unit in brackets may follow a name, as in `platform.tz [N]`.
    Lines that start with # are left out. Raises OptionError, with the line, for files that cannot be read, columns that
    are missing, named twice or not numbers, and gaps in time.
    """
    file = Path(path)
    text = read_text(file)
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if len(lines) < 3:
        raise OptionError(f"{file}: a header and at least two rows are expected")
    separator = max(",;\t", key=lines[0][1].count)
    try:
        rows = [(n, next(csv.reader([line], delimiter=separator))) for n, line in lines]
    except csv.Error as error:
        raise OptionError(f"{file}: not a table: {error}") from None
    names = _names(file, *rows[0])
    values = np.array([_row(file, n, cells, names) for n, cells in rows[1:]])
    at = next(i for i, name in enumerate(names) if name.lower() in TIMES)
    time = values[:, at]
    dt = _spacing(file, time, [n for n, _ in rows[1:]])
    signals = {name: values[:, i].copy() for i, name in enumerate(names) if i != at}
    return SignalFile(dt, np.asarray(dt * np.arange(len(time), dtype=float)), signals)


def _names(file: Path, line: int, cells: list[str]) -> list[str]:
    names = [cell.partition("[")[0].strip() for cell in cells]
    if sum(name.lower() in TIMES for name in names) != 1:
        raise OptionError(f"{file}:{line}: the header has one column `time`, in s; found {', '.join(names)}")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None or "" in names:
        raise OptionError(f"{file}:{line}: every column has a name of its own; found {', '.join(names)}")
    if len(names) < 2:
        raise OptionError(f"{file}:{line}: beside time at least one column, named as an input, is expected")
    return names


def _row(file: Path, line: int, cells: list[str], names: list[str]) -> list[float]:
    if len(cells) != len(names):
        raise OptionError(f"{file}:{line}: {len(names)} columns are expected, here are {len(cells)}")
    numbers = []
    for name, cell in zip(names, cells, strict=True):
        try:
            number = float(cell)
        except ValueError:
            what = f"{cell.strip()!r} is not a number" if cell.strip() else "is empty"
            raise OptionError(f"{file}:{line}: column {name}: {what}") from None
        if not math.isfinite(number):
            raise OptionError(f"{file}:{line}: column {name}: a finite number is expected, not {number}")
        numbers.append(number)
    return numbers


def _spacing(file: Path, time: Array, lines: list[int]) -> float:
    steps = np.diff(time)
    dt = float(np.median(steps))
    if dt <= 0:
        raise OptionError(f"{file}: time does not increase")
    # times that were rounded when written are as good as even
    rounding = 10.0 ** -_decimals(time)
    rounding = rounding if rounding < dt / 3 else 0.0
    uneven = np.flatnonzero(np.abs(steps - dt) > np.maximum(UNEVEN * dt, rounding))
    if len(uneven):
        k = int(uneven[0])
        raise OptionError(
            f"{file}:{lines[k + 1]}: a gap in time: the step is {quantity(steps[k], 's', 6)} here and"
            f" {quantity(dt, 's', 6)} elsewhere;"
            " resample the signal evenly"
        )
    return float(time[-1] - time[0]) / (len(time) - 1)


def _decimals(time: Array) -> int:
    """Decimals that all times have at most, up to 15."""
    for digits in range(15):
        if np.allclose(time, np.round(time, digits), rtol=0, atol=1e-15 * max(1.0, float(np.abs(time).max()))):
            return digits
    return 15
