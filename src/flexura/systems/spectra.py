"""One-sided densities of power over frequency, in pieces that are sums of its powers, and their integrals by poles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Complex
from flexura.mechanism import FLOOR_TOP, FLOORS, KNEE, Disturbance

THIRD_OCTAVE = float(np.log(2) / 3)
"""Mean square in a one-third octave band over f S(f), for densities S that fall as 1/f."""

FLOOR_BEGINS = {True: 4.0, False: 1.0}
"""Hz: where criteria for floors begin that have a knee, and those that have none."""

NEAR_ZERO = 0.1
"""Size of f/z below which integrals are summed as series."""

SERIES = 16
"""Terms of these series: what follows is below 0.1^16."""


class Integrals(NamedTuple):
    """Real and imaginary parts (j, K)."""

    real: Array
    imag: Array


@dataclass(frozen=True)
class Spectrum:
    """S(f) = sum of c f^n over `terms`, coefficients (k,) by power n, in pieces from `start` (k,) to `stop` (k,), Hz,
    which may be infinite; zero outside of them. The unit is that of what it is of, squared, per Hz."""

    start: Array
    stop: Array
    terms: Mapping[int, Array]

    @property
    def is_bounded(self) -> bool:
        """Whether it ends."""
        return bool(np.isfinite(self.stop[-1]))

    def coefficients(self, points: Array) -> dict[int, Array]:
        """Coefficients (j,) by power between neighbours of rising points (j + 1,), of which every end of a piece is
        one."""
        middle = np.where(np.isfinite(points[1:]), (points[:-1] + points[1:]) / 2, points[:-1] * 2 + 1)
        piece = np.searchsorted(self.start, middle, side="right") - 1
        inside = (piece >= 0) & (middle < self.stop[np.maximum(piece, 0)])
        return {n: np.where(inside, c[np.maximum(piece, 0)], 0.0) for n, c in self.terms.items()}

    def at(self, hz: Array) -> Array:
        """Densities (f,) at frequencies (f,), Hz."""
        piece = np.minimum(np.maximum(np.searchsorted(self.start, hz, side="right") - 1, 0), len(self.start) - 1)
        inside = (hz >= self.start[piece]) & (hz <= self.stop[piece])
        safe = np.where(hz > 0, hz, 1.0)
        total: Any = sum(c[piece] * (safe**n if n < 0 else hz**n) for n, c in self.terms.items())
        return np.where(inside, total, 0.0)


def spectrum_of(of: Disturbance) -> Spectrum:
    """The density of a disturbance in numbers: of a floor that of its acceleration.

    A criterion for floors gives the RMS velocity v of every one-third octave band, so that the density of velocity is
    v^2/(0.2310 f), with ln(2)/3 = 0.2310, and that of acceleration (2 pi f)^2 times that.
    """
    low, high = (float(end) for end in of.band or (0.0, np.inf))  # type: ignore[arg-type]
    if of.spectrum is not None:
        return _floor(of, of.band is not None, low, high)
    if of.table is not None:
        hz, power = np.array(of.table.frequency_hz), np.array(of.table.values) ** 2
        slope = np.diff(power) / np.diff(hz)
        start, stop = np.maximum(hz[:-1], low), np.minimum(hz[1:], high)
        kept = start < stop
        terms = {0: (power[:-1] - slope * hz[:-1])[kept], 1: slope[kept]}
        found = Spectrum(start[kept], stop[kept], terms)
    else:
        assert of.density is not None
        white = np.array([of.density.value**2])
        terms = {0: white} if of.corner is None else {0: white, -1: white * float(of.corner)}  # type: ignore[arg-type]
        found = Spectrum(np.array([low]), np.array([high]), terms)
    order = {"m/s": 2, "m": 4}.get(of.unit, 0) if of.base is not None else 0
    return Spectrum(found.start, found.stop, {n + order: (2 * np.pi) ** order * c for n, c in found.terms.items()})


def _floor(of: Disturbance, has_band: bool, low: float, high: float) -> Spectrum:
    """A criterion for floors, from where its curve begins to where it ends, or over a band along its outer branches."""
    assert of.spectrum is not None
    velocity, has_knee = FLOORS[of.spectrum]
    if not has_band:
        low, high = FLOOR_BEGINS[has_knee], FLOOR_TOP
    rising = (2 * np.pi * velocity) ** 2 / THIRD_OCTAVE
    start, stop = np.array([low, KNEE]), np.array([KNEE, high])
    falls = np.array([rising * KNEE**2, 0.0]) if has_knee else np.zeros(2)
    rises = np.array([0.0 if has_knee else rising, rising])
    start, stop = np.maximum(start, low), np.minimum(stop, high)
    kept = start < stop
    return Spectrum(start[kept], stop[kept], {-1: falls[kept], 1: rises[kept]})


def points_of(spectra: Iterable[Spectrum], hz: Array) -> Array:
    """All ends of pieces and frequencies, rising, each once."""
    ends = [np.concatenate([s.start, s.stop]) for s in spectra]
    return np.unique(np.concatenate([*ends, hz]))


def primitives(z: Complex, points: Array, powers: Iterable[int]) -> dict[int, Integrals]:
    """Integrals (j, K) of f^n/(f - z) up to points (j,), Hz, by power n, for poles z (K,) off the real axis.

    From zero, but for n = -1, by recursion in n from log(1 - f/z), and near zero by the series in f/z. At infinity
    without what grows as log(f), which cancels in sums that converge. Infinite where an integral does not exist.
    """
    wanted = sorted(set(powers))
    top = max(*wanted, 0) if wanted else 0
    finite = np.isfinite(points)
    f = np.where(finite, points, 0.0)
    inverse: Complex = -1 / z
    a, b = np.multiply.outer(f, inverse.real), np.multiply.outer(f, inverse.imag)
    log = Integrals(0.5 * np.log1p(a * (2 + a) + b * b), np.arctan2(b, 1 + a))
    values = {0: log}
    for n in range(1, top + 1):
        x, y = values[n - 1]
        values[n] = Integrals(z.real * x - z.imag * y + (f**n / n)[:, None], z.real * y + z.imag * x)
    near = np.flatnonzero(np.multiply.outer(f, np.abs(inverse)) < NEAR_ZERO) if top else np.empty(0, dtype=np.intp)
    if len(near):
        small, at, low = -(a.ravel()[near] + 1j * b.ravel()[near]), z[near % len(z)], f[near // len(z)]
        last: Complex = np.zeros(len(at), dtype=complex)
        for j in range(SERIES, 0, -1):
            last = small * (last - 1 / (top + j))
        last = last * low**top
        for n in range(top, 0, -1):
            values[n].real.ravel()[near], values[n].imag.ravel()[near] = last.real, last.imag
            last = (last - low**n / n) / at
    rest: Complex = np.log(inverse)
    if wanted and wanted[0] < 0:
        x, y = log.real - _logs(points)[:, None], log.imag
        u, v = -inverse.real, -inverse.imag
        values[-1] = Integrals(u * x - v * y, u * y + v * x)
        values[-1].real[~finite], values[-1].imag[~finite] = (rest / z).real, (rest / z).imag
    log.real[~finite], log.imag[~finite] = rest.real, rest.imag
    for n in range(1, top + 1):
        values[n].real[~finite] = values[n].imag[~finite] = np.inf
    return {n: values[n] for n in wanted}


def plain_primitives(points: Array, n: int) -> Array:
    """Integrals (j,) of f^n up to points (j,), from zero but for n = -1; infinite where they do not exist."""
    if n != -1:
        return points ** (n + 1) / (n + 1)
    return np.where(np.isfinite(points), _logs(points), np.inf)


def _logs(points: Array) -> Array:
    """Logarithms (j,); none of zero, where nothing that rises as 1/f begins, and of infinity."""
    return np.log(np.where((points > 0) & np.isfinite(points), points, 1.0))
