"""Axes of charts on paper: ends on round numbers, ticks and their text."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array

ANGLES = (1, 2, 5, 10, 15, 30, 45, 90, 180, 360)
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
PLAIN = (1e-3, 1e4)
"""Between these numbers of logarithmic axes are plain; the script of pages has the same."""
TINY = 1e-300
"""Smaller numbers, such as round-off of a force that is zero, are drawn as zero: parts of their range underflow."""
LONG = 1e6
"""Up to here those of even axes are."""


@dataclass(frozen=True)
class Scale:
    """An axis from `low` to `high`, which lie at `start` and `end` on the paper."""

    low: float
    high: float
    log: bool
    start: float
    end: float

    def __call__(self, values: Array) -> Array:
        """Where values lie; NaN for those that a logarithmic axis cannot show."""
        x = np.asarray(values, dtype=float)
        with np.errstate(all="ignore"):
            if self.log:
                share = np.log(x / self.low) / math.log(self.high / self.low)
            else:
                share = (x - self.low) / (self.high - self.low)
        return self.start + np.where(np.isfinite(share), share, np.nan) * (self.end - self.start)


def ends(values: Array, log: bool, unit: str) -> tuple[float, float]:
    """Ends on round numbers that hold all finite values, on a logarithmic axis the positive ones."""
    values = np.where(np.abs(values) < TINY, 0.0, values)
    shown = values[np.isfinite(values) & ((values > 0) | (not log))]
    if not len(shown):
        return (0.1, 10.0) if log else (-1.0, 1.0)
    low, high = float(shown.min()), float(shown.max())
    if log:
        stretch = max(1.0, math.sqrt(10 * low / high))
        return _below(low / stretch / 1.05), _above(high * stretch * 1.05)
    flat = max(abs(low), abs(high)) or 1.0
    spread = high - low if high - low > 1e-9 * flat else 0.2 * flat
    middle, step = (low + high) / 2, _step(1.1 * spread, 5, unit)
    return step * math.floor((middle - 0.52 * spread) / step), step * math.ceil((middle + 0.52 * spread) / step)


def ticks(low: float, high: float, log: bool, most: float, unit: str = "") -> list[tuple[float, str]]:
    """Ticks with their text, about `most` of them."""
    most = max(2.0, most)
    if log and high / low >= 4:
        return _logarithmic(low, high, most)
    step = _step(high - low, most, unit)
    return [
        (k * step, _text(k * step, step))
        for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    ]


def _step(span: float, most: float, unit: str) -> float:
    """A step of 1, 2 or 5 times a power of ten, or of usual angles."""
    if unit == "deg" and span > 10:
        return next((step for step in ANGLES if span / step <= most), 360 * math.ceil(span / 360 / most))
    ten = 10.0 ** math.floor(math.log10(span / most))
    return ten * next((factor for factor in (1, 2, 5) if span / (factor * ten) <= most), 10)


def _logarithmic(low: float, high: float, most: float) -> list[tuple[float, str]]:
    decades = math.log10(high / low)
    within = (1, 2, 5) if 3 * decades <= most else (1,)
    every = max(1, math.ceil(decades / most))
    exponents = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    found = [(factor, power) for power in exponents if power % every == 0 for factor in within]
    return [
        (factor * 10.0**power, _plain(factor * 10.0**power, PLAIN[1] * (1 + 1e-9)))
        for factor, power in found
        if low * (1 - 1e-9) <= factor * 10.0**power <= high * (1 + 1e-9)
    ]


def _plain(value: float, most: float) -> str:
    """A plain number of six digits, or one with a power of ten where it is more than `most` or very small."""
    if value == 0 or PLAIN[0] * (1 - 1e-9) <= abs(value) < most:
        return f"{float(f'{value:.6g}'):.12g}"
    factor, power = f"{value:.5e}".split("e")
    factor = factor.rstrip("0").rstrip(".")
    return ("" if factor == "1" else f"{factor}·") + "10" + str(int(power)).translate(SUPERSCRIPTS)


def _text(value: float, step: float) -> str:
    if abs(value) < 1e-9 * step:
        return "0"
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    return f"{value:.{digits}f}" if digits <= 4 and abs(value) < LONG else _plain(value, LONG)


def _below(value: float) -> float:
    ten = 10.0 ** math.floor(math.log10(value))
    return ten * (5 if value / ten >= 5 else 2 if value / ten >= 2 else 1)


def _above(value: float) -> float:
    ten = 10.0 ** math.floor(math.log10(value))
    return ten * next((factor for factor in (1, 2, 5) if value / ten <= factor), 10)
