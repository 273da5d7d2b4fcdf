"""Periodic motions by harmonic balance: their equations, errors and stability, and curves of them by arc length.

A motion is q(t) = c0 + sum c_k cos k wt + s_k sin k wt. What holds and accelerates it is worked out at times over a
period and balanced by its own series.

Sources: Cameron, Griffin (1989), J. Appl. Mech. 56 (alternating frequency/time); Krack, Gross (2019), Harmonic balance
for nonlinear vibration problems; Lazarus, Thomas (2010), C. R. Mecanique 338 (stability by sorted exponents of Hill);
Keller (1977), in Applications of bifurcation theory (arc length; branches where the determinant changes its sign).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol
from warnings import catch_warnings

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexura.arrays import Array, Complex
from flexura.errors import SolverError

CONVERGED = 1e-9
"""Largest last step of Newton's method over the unknowns, both in their scales."""

CORRECTIONS = 16
"""Steps of Newton's method after which a shorter step along the curve is tried."""

SLOW = 0.15
"""Share of a step that the next one leaves, from which derivatives are renewed."""

EASY = 7
"""Corrections up to which the next step is longer."""

LONGER = 1.5
"""How many times as long that is."""

BEND = 0.9
"""Least cosine between the tangents at both ends of a step."""

SHORTEST = 1e-6
"""Step over the first one, below which a curve is given up."""

LOCATED = 1e-6
"""How near to its zero something is located, over what it was at the ends of the step."""

CORNERS = 8
"""Motions at which it is looked at on the way at most."""


Factor = tuple[Array, NDArray[np.int32]]

Slopes = tuple[Array, Array, Array]
"""Derivatives (s, n, n) at instants by displacements, velocities and accelerations."""


class Oscillator(Protocol):
    """Forces (s, n) at instants, in coordinates of unit stiffness at rest."""

    @property
    def frequencies(self) -> Array:
        """Natural frequencies (n,) at rest, rad/s."""
        ...

    def forces(self, q: Array, v: Array, a: Array, drive: Array) -> Array:
        """What is missing (s, n) for motions with displacements, velocities and accelerations (s, n) under shares (s,)
        of the excitation."""
        ...

    def slopes(self, q: Array, v: Array, a: Array, drive: Array) -> tuple[Array, Array, Array]:
        """Derivatives (s, n, n) of the forces by displacements, velocities and accelerations."""
        ...


class Series(NamedTuple):
    """Fourier series at times over a period: `values`, `rates` and `seconds` (s, N) make displacements and their
    derivatives by the phase of coefficients in the order c0, c1, s1, ..., or c0, c1, ... where the motion is even;
    `balance` (N, s) makes coefficients of values."""

    harmonics: int
    values: Array
    rates: Array
    seconds: Array
    balance: Array
    order: Array
    """Harmonics (N,) of the coefficients."""

    @staticmethod
    def of(harmonics: int, even: bool = False) -> Series:
        """With so many samples that products of four of a series are balanced exactly."""
        count = 4 * harmonics + 4
        k = np.arange(harmonics + 1.0)
        phase = 2 * np.pi * np.arange(count)[:, None] / count * k
        columns = np.stack([np.cos(phase), np.sin(phase)], axis=-1).reshape(count, -1)
        rates = np.stack([-k * np.sin(phase), k * np.cos(phase)], axis=-1).reshape(count, -1)
        order, kept = np.repeat(k, 2), np.arange(2 * len(k))
        kept = kept[kept % 2 == 0] if even else np.delete(kept, 1)
        order, values = order[kept], columns[:, kept]
        balance = np.where(order == 0, 1.0, 2.0)[:, None] * values.T / count
        return Series(harmonics, values, rates[:, kept], -(order**2) * values, balance, order)

    @property
    def drive(self) -> Array:
        """The cosine (s,) of the first harmonic."""
        return self.values[:, 1]


class Orbit(NamedTuple):
    """A periodic motion: coefficients X (N, n), frequency `omega`, rad/s, the unit `tangent` (N n + 1,) of the curve in
    scaled unknowns, the `determinant` of the equations across it, sign and logarithm, slopes there unless they are
    forgotten, and the arc length of the step that led to it."""

    X: Array
    omega: float
    tangent: Array
    determinant: tuple[float, float]
    slopes: Slopes | None
    step: float

    @property
    def turning(self) -> float:
        """The frequency in the unit tangent, zero at folds."""
        return float(self.tangent[-1])

    @property
    def side(self) -> float:
        """The sign of the determinant, which folds do not change: another curve goes through where it does (Keller
        1977)."""
        return self.determinant[0]


@dataclass(frozen=True)
class Balance:
    """Periodic motions of an oscillator, free ones that are even in time (`driven` false) or driven by its excitation.

    Arc lengths are over amplitudes of coordinates of unit stiffness over `size`, and frequencies over `width`, rad/s.
    Coordinates whose natural frequency is beyond `quick`, rad/s, which follow the others, count by `quick` over it, as
    they do in kinetic energies: where leaves shorten as they bend, their stiffness along would be most of an arc.
    """

    oscillator: Oscillator
    series: Series
    driven: bool
    size: float
    width: float
    quick: float

    @cached_property
    def metric(self) -> Array:
        """Weights (N n + 1,) of squares of scaled unknowns in those of arc lengths."""
        weight = np.square(self.quick / np.maximum(self.oscillator.frequencies, self.quick))
        return np.append(np.tile(weight, len(self.series.order)), 1.0)

    def unit(self, direction: Array) -> Array:
        """A direction (N n + 1,) with arc length one."""
        return direction / np.sqrt(direction @ (self.metric * direction))

    def motion(self, X: Array, omega: float) -> tuple[Array, Array, Array, Array]:
        """Displacements, velocities and accelerations (s, n), and shares (s,) of the excitation."""
        own = self.series
        drive = own.drive if self.driven else np.zeros(len(own.values))
        return own.values @ X, omega * (own.rates @ X), omega**2 * (own.seconds @ X), drive

    def residual(self, X: Array, omega: float) -> Array:
        """What is missing (N, n)."""
        return self.series.balance @ self.oscillator.forces(*self.motion(X, omega))

    def jacobian(self, X: Array, omega: float, slopes: Slopes) -> Array:
        """Derivatives (N n, N n + 1) of what is missing by coefficients over `size` and the frequency over `width`."""
        own, (K, C, M) = self.series, slopes
        size = X.size
        J = np.empty((size, size + 1))
        J[:, :-1] = self.size * self._balanced((K, own.values), (C, omega * own.rates), (M, omega**2 * own.seconds))
        _, v, a, _ = self.motion(X, omega)
        by = (C @ v[..., None] + 2 * M @ a[..., None])[..., 0] / omega
        J[:, -1] = self.width * (own.balance @ by).ravel()
        return J

    def _balanced(self, *terms: tuple[Array, Array]) -> Array:
        """The sum (N n, N n) of slopes (s, n, n) by what (s, N) coefficients do to their arguments, balanced."""
        own, n = self.series, terms[0][0].shape[-1]
        N = own.values.shape[1]
        total = np.zeros((N, n, N, n))
        for slope, columns in terms:
            by = np.einsum("is,sj->ijs", own.balance, columns).reshape(N * N, -1)
            total += (by @ slope.reshape(len(slope), -1)).reshape(N, N, n, n).transpose(0, 2, 1, 3)
        return total.reshape(N * n, N * n)

    def near(self, X: Array, omega: float, direction: Array) -> tuple[Orbit, int]:
        """The motion next to an estimate, in the plane across a direction (N n + 1,), and the corrections that it took.
        Raises SolverError."""
        X, omega, count = self._corrected(X, omega, self.metric * direction)
        slopes = self.oscillator.slopes(*self.motion(X, omega))
        across = self.metric * direction
        factor = self._factor(X, omega, slopes, across)
        last = np.zeros(len(across))
        last[-1] = 1.0
        tangent = la.lu_solve(factor, last, check_finite=False)
        scale = float(np.sqrt(tangent @ (self.metric * tangent)))
        return Orbit(X, omega, tangent / scale, _determinant(factor, scale), slopes, 0.0), count

    def onward(self, orbit: Orbit, length: float, last: Orbit | None = None) -> tuple[Orbit, int]:
        """The motion a step further along the curve, and the corrections that it took. Raises SolverError.

        It is looked for along the tangent, or where the cubic through the `last` motion before that has both tangents
        goes on.
        """
        across, step = self.metric * orbit.tangent, length * orbit.tangent
        if last is not None:
            step = self._cubic(last, orbit, 1 + length / orbit.step)[0] - self._chord(last, orbit)
            step = step + (length - step @ across) * orbit.tangent
        guess = self._moved(orbit, step, orbit.tangent)
        found, count = self.near(guess.X, guess.omega, orbit.tangent)
        return found._replace(step=length), count

    def between(self, one: Orbit, other: Orbit, t: float) -> Orbit:
        """An estimate of the motion t of the way from one to a later one, or beyond it, by the cubic that has their
        tangents (Hermite), and by a line the determinant."""
        step, tangent = self._cubic(one, other, t)
        (sign, log), (later, more) = one.determinant, other.determinant
        value = (1 - t) * sign + t * later * np.exp(np.clip(more - log, -50.0, 50.0))
        determinant = float(np.sign(value)), log + float(np.log(abs(value) or 1e-300))
        return self._moved(one, step, self.unit(tangent))._replace(determinant=determinant)

    def _cubic(self, one: Orbit, other: Orbit, t: float) -> tuple[Array, Array]:
        """Scaled unknowns from those of one motion on, t of the way to another, and how they go on from there."""
        chord, a, b = self._chord(one, other), other.step * one.tangent, other.step * other.tangent
        square, cube = 3 * chord - 2 * a - b, a + b - 2 * chord
        return t * a + t**2 * square + t**3 * cube, a + 2 * t * square + 3 * t**2 * cube

    def _chord(self, one: Orbit, other: Orbit) -> Array:
        """Scaled unknowns (N n + 1,) from one motion to another."""
        return np.append((other.X - one.X).ravel() / self.size, (other.omega - one.omega) / self.width)

    def _moved(self, orbit: Orbit, step: Array, tangent: Array) -> Orbit:
        """An orbit after a step (N n + 1,) in scaled unknowns."""
        X = orbit.X + self.size * step[:-1].reshape(orbit.X.shape)
        return orbit._replace(X=X, omega=orbit.omega + self.width * float(step[-1]), tangent=tangent)

    def _corrected(self, X: Array, omega: float, across: Array) -> tuple[Array, float, int]:
        """The motion in the plane through an estimate, by Newton's method with derivatives of a motion near it."""
        size, factor, fresh = np.inf, None, True
        estimate = omega
        for count in range(1, CORRECTIONS + 1):
            if factor is None:
                factor = self._factor(X, omega, self.oscillator.slopes(*self.motion(X, omega)), across)
                fresh = True
            missing = np.append(-self.residual(X, omega).ravel(), 0.0)
            correction = la.lu_solve(factor, missing, check_finite=False)
            before, size = size, float(np.linalg.norm(correction))
            if not np.isfinite(size) or (fresh and size > before):
                break
            X = X + self.size * correction[:-1].reshape(X.shape)
            omega += self.width * float(correction[-1])
            rate = size / before if count > 1 else 0.5
            if omega <= 0:
                break
            if size * min(rate, 1.0) < CONVERGED * (1 + float(np.linalg.norm(X)) / self.size):
                return X, omega, count
            fresh = False
            if count > 1 and rate > SLOW:
                factor = None
        raise _lost(estimate)

    def _factor(self, X: Array, omega: float, slopes: Slopes, across: Array) -> Factor:
        bordered = np.concatenate([self.jacobian(X, omega, slopes), across[None]])
        if not np.isfinite(bordered).all():
            raise _lost(omega)
        with catch_warnings(action="ignore", category=la.LinAlgWarning):
            factor: Factor = la.lu_factor(bordered, check_finite=False)
        if not factor[0].diagonal().all():
            raise _lost(omega)
        return factor

    def error(self, orbit: Orbit) -> tuple[float, float]:
        """What twice as many harmonics, two more at least, would change, to first order: of the motion and of the
        frequency, relative."""
        series = Series.of(
            max(2 * self.series.harmonics, self.series.harmonics + 2), even=len(orbit.X) == self.series.harmonics + 1
        )
        finer = replace(self, series=series)
        X = np.zeros((len(series.order), orbit.X.shape[1]))
        X[: len(orbit.X)] = orbit.X
        across = np.zeros(X.size + 1)
        across[: orbit.X.size], across[-1] = (self.metric * orbit.tangent)[:-1], orbit.turning
        slopes = self.oscillator.slopes(*finer.motion(X, orbit.omega))
        missing = np.append(-finer.residual(X, orbit.omega).ravel(), 0.0)
        step = la.lu_solve(finer._factor(X, orbit.omega, slopes, across), missing, check_finite=False)
        weights = finer.metric[:-1]
        changed, moving = (float(np.sqrt(own**2 @ weights)) for own in (step[:-1], np.append(0 * X[0], X[1:])))
        return self.size * changed / (moving or 1.0), self.width * abs(float(step[-1])) / orbit.omega

    def exponents(self, orbit: Orbit) -> Complex:
        """Floquet's exponents (2m,), 1/s, of small motions beside a motion: those of Hill's determinant with twice as
        many harmonics whose imaginary parts are least (Lazarus and Thomas 2010). Coordinates beyond the highest
        harmonic of the motion follow the others as in statics, instant by instant."""
        omega, finer = orbit.omega, Series.of(2 * self.series.harmonics)
        own = replace(self, series=finer)
        slopes = orbit.slopes or self.oscillator.slopes(*self.motion(orbit.X, omega))
        K, C, M = (_resampled(slope, len(finer.values)) for slope in self._slow(orbit, slopes))
        D0 = own._balanced((K, finer.values), (C, omega * finer.rates), (M, omega**2 * finer.seconds))
        D1 = omega * own._balanced((C, finer.values), (M, 2 * omega * finer.rates))
        inertia = la.lu_factor(omega**2 * own._balanced((M, finer.values)))
        size = len(D0)
        A = np.zeros((2 * size, 2 * size))
        A[:size, size:] = np.eye(size)
        A[size:, :size], A[size:, size:] = -la.lu_solve(inertia, D0), -la.lu_solve(inertia, D1)
        values: Complex = la.eigvals(A, check_finite=False).astype(complex)
        return omega * values[np.argsort(np.abs(values.imag), kind="stable")[: 2 * K.shape[-1]]]

    def _slow(self, orbit: Orbit, slopes: Slopes) -> tuple[Array, Array, Array]:
        """Slopes (s, m, m) by the coordinates up to the highest harmonic, with the others at rest at each instant."""
        K, C, M = slopes
        m = max(int((self.oscillator.frequencies < self.series.harmonics * orbit.omega).sum()), 1)
        follow = -np.linalg.solve(K[:, m:, m:], K[:, m:, :m])
        T = np.concatenate([np.tile(np.eye(m), (len(K), 1, 1)), follow], axis=1)
        rate = 1j * orbit.omega * np.arange(len(K) // 2 + 1)[:, None, None]
        first, second = (np.fft.irfft(np.fft.rfft(T, axis=0) * rate**k, len(K), axis=0) for k in (1, 2))
        back = np.swapaxes(T, 1, 2)
        return back @ (K @ T + C @ first + M @ second), back @ (C @ T + 2 * M @ first), back @ M @ T


def _determinant(factor: Factor, scale: float) -> tuple[float, float]:
    """Sign and logarithm of the determinant of what is factored, so many times."""
    diagonal, swaps = factor[0].diagonal(), (factor[1] != np.arange(len(factor[1]))).sum()
    sign = np.prod(np.sign(diagonal)) * (-1) ** int(swaps)
    return float(sign), float(np.log(np.abs(diagonal)).sum() + np.log(scale))


def _lost(omega: float) -> SolverError:
    hz = f"{omega / (2 * np.pi):.5g} Hz"
    return SolverError(
        f"no periodic motion is found near {hz}: ask for a smaller amplitude or force, or more harmonics"
    )


def _resampled(values: Array, count: int) -> Array:
    """Values (s, ...) over a period at more instants (count, ...)."""
    return np.fft.irfft(np.fft.rfft(values, axis=0), count, axis=0) * (count / len(values))


def along(balance: Balance, first: Orbit, step: float, longest: Callable[[Orbit], float]) -> Iterator[Orbit]:
    """Motions along a curve in steps that suit it and are no longer than is asked for at each, the first one included,
    until no further one is found."""
    orbit, length, last = first, step, None
    yield orbit
    while length > SHORTEST * step:
        try:
            found, count = balance.onward(orbit, length, last)
        except SolverError:
            length /= 2
            continue
        if float(found.tangent @ (balance.metric * orbit.tangent)) < BEND:
            length /= 2
            continue
        last, orbit = orbit, found
        yield orbit
        length = min(length * (LONGER if count <= EASY else 1.0), longest(orbit))


def located(balance: Balance, before: Orbit, after: Orbit, of: Callable[[Orbit], float]) -> Orbit:
    """The motion between two neighbours on a curve at which something changes its sign: where it does on the cubic
    between them, which is drawn anew through the motion that is found there."""
    low, high, at_low = before, after, of(before)
    scale = max(abs(at_low), abs(of(after)))
    found = min(before, after, key=lambda end: abs(of(end)))
    for _ in range(CORNERS):
        if abs(of(found)) <= LOCATED * scale:
            break
        here = low, high
        t = float(brentq(lambda t: of(balance.between(*here, t)), 0.0, 1.0, xtol=1e-12))
        guess = balance.between(low, high, t)
        found = balance.near(guess.X, guess.omega, guess.tangent)[0]._replace(step=t * high.step)
        if (of(found) > 0) == (at_low > 0):
            low, high = found, high._replace(step=(1 - t) * high.step)
        else:
            high = found
    return found
