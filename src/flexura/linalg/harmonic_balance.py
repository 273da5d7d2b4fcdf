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

UNSETTLED = 1e-3
"""Move of quick coordinates, over all of the motion, from which they settle before derivatives are worked out."""

LEAST_STIFF = 0.3
"""Dynamic stiffness of quick coordinates over the static one at least, where they settle."""

LONGER = 1.5
"""How many times as long that is."""

BEND = 0.9
"""Least cosine between the tangents at both ends of a step."""

SHORTEST = 1e-6
"""Step over the first one, below which a curve is given up."""

LOCATED = 1e-6
"""How near to its zero something is located, over what it was at the ends of the step."""

FOLLOWING = 2.0, 16.0
"""Natural frequencies of coordinates from which they follow the others, over the highest one that instants tell apart
and over that of the motion; the larger one of both."""

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

    def slopes(self, q: Array, v: Array, a: Array, drive: Array, slow: int) -> tuple[Array, Array, Array]:
        """Derivatives (s, n, n) of the forces by displacements, velocities and accelerations, exact along motions of
        the first `slow` coordinates that the others follow as in statics."""
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


class Motion(NamedTuple):
    """A periodic motion: coefficients X (N, m) of slow coordinates, quick ones Q (s, n - m) at instants, which follow,
    and the frequency `omega`, rad/s."""

    X: Array
    Q: Array
    omega: float


class Orbit(NamedTuple):
    """A motion on a curve: the unit `tangent` (N m + 1,) of this in scaled unknowns, how quick coordinates (s, n - m)
    go along, the `determinant` of the equations across the curve, sign and logarithm, slopes at instants unless they
    are forgotten, and the arc length of the step that led here."""

    motion: Motion
    tangent: Array
    along: Array
    determinant: tuple[float, float]
    slopes: Slopes | None
    step: float

    @property
    def omega(self) -> float:
        """The frequency, rad/s."""
        return self.motion.omega

    @property
    def turning(self) -> float:
        """The frequency in the unit tangent, zero at folds."""
        return float(self.tangent[-1])

    @property
    def side(self) -> float:
        """The sign of the determinant, which folds do not change: another curve goes through where it does (Keller
        1977)."""
        return self.determinant[0]


class _Following(NamedTuple):
    """Slopes by slow coordinates (s, m, m) where the others follow as in statics, how all do T (s, n, m), and the
    inverse (s, n - m, n - m) of the stiffness of the others."""

    slopes: Slopes
    T: Array
    inverse: Array

    @staticmethod
    def of(slopes: Slopes, m: int, omega: float) -> _Following:
        """With m slow coordinates."""
        K, C, M = slopes
        inverse: Array = np.linalg.inv(K[:, m:, m:]).astype(float)
        T = np.concatenate([np.tile(np.eye(m), (len(K), 1, 1)), -inverse @ K[:, m:, :m]], axis=1)
        first, second = (_rates(T, omega, k) for k in (1, 2))
        back = np.swapaxes(T, 1, 2)
        own = back @ (K @ T + C @ first + M @ second), back @ (C @ T + 2 * M @ first), back @ M @ T
        return _Following(own, T, inverse)


@dataclass(frozen=True)
class Balance:
    """Periodic motions of an oscillator, free ones that are even in time (`driven` false) or driven by its excitation.

    The first `slow` coordinates are balanced. The others, far above the highest harmonic, are in equilibrium at each
    instant: where leaves bend, what goes along grows with the square of the motion and needs twice its harmonics.
    Arc lengths are over amplitudes of coordinates of unit stiffness over `size`, those with natural frequencies beyond
    `quick`, rad/s, counting less in proportion, and frequencies over `width`, rad/s.
    """

    oscillator: Oscillator
    series: Series
    driven: bool
    size: float
    width: float
    quick: float
    slow: int

    @staticmethod
    def of(oscillator: Oscillator, series: Series, driven: bool, size: float, width: float, quick: float) -> Balance:
        """For frequencies up to `quick`, rad/s."""
        of_instants, of_motion = FOLLOWING
        limit = max(of_instants * len(series.values) / 2, of_motion) * quick
        slow = int((oscillator.frequencies < limit).sum())
        return Balance(oscillator, series, driven, size, width, quick, max(slow, 1))

    @cached_property
    def metric(self) -> Array:
        """Weights (N m + 1,) of squares of scaled unknowns in those of arc lengths."""
        weight = np.square(self.quick / np.maximum(self.oscillator.frequencies[: self.slow], self.quick))
        return np.append(np.tile(weight, len(self.series.order)), 1.0)

    def linear(self, X: Array, omega: float) -> Motion:
        """The motion with coefficients (N, n) of all coordinates."""
        return Motion(X[:, : self.slow], self.series.values @ X[:, self.slow :], omega)

    def instants(self, motion: Motion) -> tuple[Array, Array, Array, Array]:
        """Displacements, velocities and accelerations (s, n), and shares (s,) of the excitation."""
        own, (X, Q, omega) = self.series, motion
        drive = own.drive if self.driven else np.zeros(len(own.values))
        slow = own.values @ X, omega * (own.rates @ X), omega**2 * (own.seconds @ X)
        quick = Q, _rates(Q, omega, 1), _rates(Q, omega, 2)
        q, v, a = (np.concatenate(both, axis=1) for both in zip(slow, quick, strict=True))
        return q, v, a, drive

    def jacobian(self, motion: Motion, slopes: Slopes, following: _Following) -> Array:
        """Derivatives (N m, N m + 1) of what is missing by coefficients over `size` and the frequency over `width`."""
        own, (X, _, omega), (K, C, M) = self.series, motion, following.slopes
        J = np.empty((X.size, X.size + 1))
        J[:, :-1] = self.size * self._balanced((K, own.values), (C, omega * own.rates), (M, omega**2 * own.seconds))
        _, v, a, _ = self.instants(motion)
        _, by_rate, by_second = slopes
        by = (v[:, None] @ np.swapaxes(by_rate, 1, 2) + 2 * a[:, None] @ np.swapaxes(by_second, 1, 2)) / omega
        J[:, -1] = self.width * (own.balance @ (by @ following.T)[:, 0]).ravel()
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

    def near(self, motion: Motion, direction: Array) -> tuple[Orbit, int]:
        """The motion next to an estimate, in the plane across a direction (N m + 1,), and the corrections that it took.
        Raises SolverError."""
        across = self.metric * direction
        found, count = self._corrected(motion, across)
        slopes = self.oscillator.slopes(*self.instants(found), self.slow)
        following = self._following(slopes, found)
        factor = self._factor(found, slopes, following, across)
        last = np.zeros(len(across))
        last[-1] = 1.0
        tangent = la.lu_solve(factor, last, check_finite=False)
        scale = float(np.sqrt(tangent @ (self.metric * tangent)))
        along = self._followed(following, tangent / scale)
        return Orbit(found, tangent / scale, along, _determinant(factor, scale), slopes, 0.0), count

    def _following(self, slopes: Slopes, motion: Motion) -> _Following:
        if not all(np.isfinite(slope).all() for slope in slopes):
            raise _lost(motion.omega)
        try:
            return _Following.of(slopes, self.slow, motion.omega)
        except np.linalg.LinAlgError:
            raise _lost(motion.omega) from None

    def _followed(self, following: _Following, step: Array) -> Array:
        """How quick coordinates (s, n - m) follow a step (N m + 1,)."""
        moved = self.series.values @ (self.size * step[:-1].reshape(-1, self.slow))
        return (following.T[:, self.slow :] @ moved[..., None])[..., 0]

    def onward(self, orbit: Orbit, length: float, last: Orbit | None = None) -> tuple[Orbit, int]:
        """The motion a step further along the curve, and the corrections that it took. Raises SolverError.

        It is looked for along the tangent, or where the cubic through the `last` motion before that has both tangents
        goes on.
        """
        n, tangent = len(orbit.tangent), np.append(orbit.tangent, orbit.along)
        step = length * tangent
        if last is not None:
            step = self._cubic(last, orbit, 1 + length / orbit.step)[0] - self._chord(last, orbit)
            step = step + (length - step[:n] @ (self.metric * orbit.tangent)) * tangent
        found, count = self.near(self._moved(orbit.motion, step), orbit.tangent)
        return found._replace(step=length), count

    def between(self, one: Orbit, other: Orbit, t: float) -> Orbit:
        """An estimate of the motion t of the way from one to a later one by the cubic that has their tangents
        (Hermite), and by a line the determinant."""
        step, tangent = self._cubic(one, other, t)
        tangent = tangent[: len(one.tangent)]
        (sign, log), (later, more) = one.determinant, other.determinant
        value = (1 - t) * sign + t * later * np.exp(np.clip(more - log, -50.0, 50.0))
        unit = tangent / np.sqrt(tangent @ (self.metric * tangent))
        determinant = float(np.sign(value)), log + float(np.log(abs(value) or 1e-300))
        return one._replace(motion=self._moved(one.motion, step), tangent=unit, determinant=determinant)

    def _cubic(self, one: Orbit, other: Orbit, t: float) -> tuple[Array, Array]:
        """Scaled unknowns and quick coordinates from those of one motion on, t of the way to another, and how they go
        on from there."""
        chord = self._chord(one, other)
        a, b = (other.step * np.append(own.tangent, own.along) for own in (one, other))
        square, cube = 3 * chord - 2 * a - b, a + b - 2 * chord
        return t * a + t**2 * square + t**3 * cube, a + 2 * t * square + 3 * t**2 * cube

    def _chord(self, one: Orbit, other: Orbit) -> Array:
        """Scaled unknowns and quick coordinates from those of one motion to another."""
        (X, Q, omega), (X1, Q1, omega1) = one.motion, other.motion
        return np.concatenate([(X1 - X).ravel() / self.size, [(omega1 - omega) / self.width], (Q1 - Q).ravel()])

    def _moved(self, motion: Motion, step: Array) -> Motion:
        """A motion after a step in scaled unknowns and quick coordinates."""
        (X, Q, omega), n = motion, motion.X.size
        X, Q = X + self.size * step[:n].reshape(X.shape), Q + step[n + 1 :].reshape(Q.shape)
        return Motion(X, Q, omega + self.width * float(step[n]))

    def _corrected(self, motion: Motion, across: Array) -> tuple[Motion, int]:
        """The motion in the plane through an estimate, by Newton's method with derivatives of a motion near it."""
        size, of_newton, estimate = np.inf, np.inf, motion.omega
        following: _Following | None = None
        factor: Factor | None = None
        fresh = False
        for count in range(1, CORRECTIONS + 1):
            at = self.instants(motion)
            if factor is None or following is None:
                slopes = self.oscillator.slopes(*at, self.slow)
                following = self._following(slopes, motion)
                factor = self._factor(motion, slopes, following, across)
                fresh = True
            missing = self.oscillator.forces(*at)
            settling = self._settling(following, missing, motion.omega)
            large = 1 + float(np.linalg.norm(motion.X)) / self.size + self._norm(motion.Q)
            if fresh and np.isfinite(settling).all() and self._norm(settling) > UNSETTLED * large:
                motion, factor = motion._replace(Q=motion.Q + settling), None
                continue
            step = self._step(following, factor, missing)
            settling = settling + self._followed(following, step)
            before, size = size, float(np.hypot(np.linalg.norm(step), self._norm(settling)))
            if not np.isfinite(size) or (fresh and size > of_newton):
                break
            of_newton = size if fresh else of_newton
            motion = self._moved(motion, np.append(step, settling))
            rate = size / before if np.isfinite(before) else 0.5
            if motion.omega <= 0:
                break
            if size * min(rate, 1.0) < CONVERGED * large:
                return motion, count
            fresh = False
            if np.isfinite(before) and rate > SLOW:
                factor = None
        raise _lost(estimate)

    def _norm(self, Q: Array) -> float:
        """Size of quick coordinates (s, n - m)."""
        return float(np.linalg.norm(Q)) / (self.size * len(Q) ** 0.5)

    def _step(self, following: _Following, factor: Factor, missing: Array) -> Array:
        """The step (N m + 1,) to what is missing (s, n), negative."""
        balanced = self.series.balance @ (missing[:, None] @ following.T)[:, 0]
        return la.lu_solve(factor, np.append(-balanced.ravel(), 0.0), check_finite=False)

    def _settling(self, following: _Following, missing: Array, omega: float) -> Array:
        """What quick coordinates (s, n - m) give way by to what is missing (s, n): as in statics, harmonics as much
        more as those of modes at rest do."""
        still = -(following.inverse @ missing[:, self.slow :, None])[..., 0]
        dynamic = 1 - np.square(
            np.arange(len(still) // 2 + 1)[:, None] * omega / self.oscillator.frequencies[self.slow :]
        )
        dynamic = np.where(np.abs(dynamic) < LEAST_STIFF, LEAST_STIFF, dynamic)
        return np.fft.irfft(np.fft.rfft(still, axis=0) / dynamic, len(still), axis=0)

    def _factor(self, motion: Motion, slopes: Slopes, following: _Following, across: Array) -> Factor:
        bordered = np.concatenate([self.jacobian(motion, slopes, following), across[None]])
        if not np.isfinite(bordered).all():
            raise _lost(motion.omega)
        with catch_warnings(action="ignore", category=la.LinAlgWarning):
            factor: Factor = la.lu_factor(bordered, check_finite=False)
        if not factor[0].diagonal().all():
            raise _lost(motion.omega)
        return factor

    def error(self, orbit: Orbit) -> tuple[float, float]:
        """What twice as many harmonics, two more at least, would change, to first order: of the motion, by arc length,
        and of the frequency, relative."""
        H, (X, Q, omega) = self.series.harmonics, orbit.motion
        finer = replace(self, series=Series.of(max(2 * H, H + 2), even=len(X) == H + 1))
        more = np.zeros((len(finer.series.order), X.shape[1]))
        more[: len(X)] = X
        motion = Motion(more, _resampled(Q, len(finer.series.values)), omega)
        across = np.zeros(more.size + 1)
        across[: X.size], across[-1] = (self.metric * orbit.tangent)[:-1], orbit.turning
        at = finer.instants(motion)
        slopes = self.oscillator.slopes(*at, self.slow)
        following = finer._following(slopes, motion)
        step = finer._step(following, finer._factor(motion, slopes, following, across), self.oscillator.forces(*at))
        moving = np.append(0 * more[0], more[1:])
        changed, whole = (float(np.sqrt(own**2 @ finer.metric[:-1])) for own in (step[:-1], moving))
        return self.size * changed / (whole or 1.0), self.width * abs(float(step[-1])) / omega

    def exponents(self, orbit: Orbit) -> Complex:
        """Floquet's exponents (2m,), 1/s, of small motions beside a motion: those of Hill's determinant with twice as
        many harmonics whose imaginary parts are least (Lazarus and Thomas 2010). Coordinates beyond the highest
        harmonic of the motion follow the others as in statics, instant by instant."""
        omega, finer = orbit.omega, Series.of(2 * self.series.harmonics)
        own = replace(self, series=finer)
        slopes = orbit.slopes or self.oscillator.slopes(*self.instants(orbit.motion), self.slow)
        m = max(int((self.oscillator.frequencies < self.series.harmonics * omega).sum()), 1)
        K, C, M = (_resampled(slope, len(finer.values)) for slope in _Following.of(slopes, m, omega).slopes)
        D0 = own._balanced((K, finer.values), (C, omega * finer.rates), (M, omega**2 * finer.seconds))
        D1 = omega * own._balanced((C, finer.values), (M, 2 * omega * finer.rates))
        inertia = la.lu_factor(omega**2 * own._balanced((M, finer.values)))
        size = len(D0)
        A = np.zeros((2 * size, 2 * size))
        A[:size, size:] = np.eye(size)
        A[size:, :size], A[size:, size:] = -la.lu_solve(inertia, D0), -la.lu_solve(inertia, D1)
        values: Complex = la.eigvals(A, check_finite=False).astype(complex)
        return omega * values[np.argsort(np.abs(values.imag), kind="stable")[: 2 * K.shape[-1]]]


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


def _rates(values: Array, omega: float, order: int) -> Array:
    """Derivatives by time, of first or second order, of values (s, ...) over a period."""
    rate = (1j * omega * np.arange(len(values) // 2 + 1)) ** order
    spectrum = np.fft.rfft(values, axis=0) * rate.reshape(-1, *[1] * (values.ndim - 1))
    return np.fft.irfft(spectrum, len(values), axis=0)


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
    from scipy.optimize import brentq  # slow to import

    low, high, at_low = before, after, of(before)
    scale = max(abs(at_low), abs(of(after)))
    found = min(before, after, key=lambda end: abs(of(end)))
    for _ in range(CORNERS):
        if abs(of(found)) <= LOCATED * scale:
            break

        def value(t: float, low: Orbit = low, high: Orbit = high) -> float:
            return of(balance.between(low, high, t))

        t = float(brentq(value, 0.0, 1.0, xtol=1e-12))
        guess = balance.between(low, high, t)
        found = balance.near(guess.motion, guess.tangent)[0]._replace(step=t * high.step)
        if (of(found) > 0) == (at_low > 0):
            low, high = found, high._replace(step=(1 - t) * high.step)
        else:
            high = found
    return found
