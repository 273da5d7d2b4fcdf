"""A plant that depends on a scheduling parameter: second-order systems at points of it, polynomials between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from flexura.arrays import Array, Complex
from flexura.errors import OptionError, SolverError
from flexura.records import Record
from flexura.tables import ends, quantity

OUTSIDE = 1e-9
"""How far outside its range a parameter may lie by round-off, over the range."""

SOUGHT = 201
"""Points among which static states are sought."""

MOTION_ERROR = 1e-8
"""Relative error of a step of motion."""


def chebyshev_points(low: float, high: float, count: int) -> Array:
    """Points (count,) from low to high where polynomials are good everywhere between: extremes of Chebyshev's. With
    2 count - 1 of them every second one is among those of count."""
    return (low + high) / 2 - (high - low) / 2 * np.cos(np.pi * np.arange(count) / (count - 1))


class Frozen(NamedTuple):
    """What a plant is at one point, or at several along a leading axis: M, C, K (r, r), B (r, m), `rows` (p, r) of the
    outputs and their static part `residual` (p, m) that the coordinates lack, the `force` of the drive that holds the
    equilibrium there, what the outputs read in it, `readings` (p,), and forces `swing` (r,) per square of the speed.

    The first coordinate is the scheduling parameter itself, the others are deviations from the equilibrium.
    """

    M: Array
    C: Array
    K: Array
    B: Array
    rows: Array
    residual: Array
    force: Array
    readings: Array
    swing: Array

    def frequencies_hz(self) -> Array:
        """Natural frequencies (r,), Hz, negative for unstable ones."""
        values = la.eigvalsh(self.K, self.M)
        return np.sign(values) * np.sqrt(np.abs(values)) / (2 * np.pi)

    def response(self, frequency_hz: Array, derivative: NDArray[np.intp], D: Array) -> Complex:
        """H (f, p, m) about the point, outputs being so often differentiated, D (p, m) what goes directly."""
        w = 2 * np.pi * frequency_hz[:, None, None]
        Z = self.K - w**2 * self.M + 1j * w * self.C
        H: Complex = self.rows @ np.linalg.solve(Z, np.broadcast_to(self.B.astype(complex), (len(Z), *self.B.shape)))
        return (H + self.residual) * (1j * w) ** derivative[:, None] + D

    def first_order(self, derivative: NDArray[np.intp], D: Array) -> tuple[Array, Array, Array, Array]:
        """A (2r, 2r), B, C, D about the point; states are the coordinates, then their rates."""
        r, m = self.B.shape
        solved = la.solve(self.M, np.hstack([-self.K, -self.C, self.B]), assume_a="pos")
        A = np.block([[np.zeros((r, r)), np.eye(r)], [solved[:, : 2 * r]]])
        B = np.vstack([np.zeros((r, m)), solved[:, 2 * r :]])
        none = np.zeros_like(self.rows)
        by_order = (np.hstack([self.rows, none]), np.hstack([none, self.rows]), self.rows @ solved[:, : 2 * r])
        C = np.choose(derivative[:, None], by_order)
        direct = np.choose(derivative[:, None], (self.residual, 0 * D, self.rows @ solved[:, 2 * r :]))
        return A, B, C, D + direct


class Motion(NamedTuple):
    """Outputs (p, N), coordinates (r, N) and rates (r, N) over time."""

    outputs: Array
    coordinates: Array
    rates: Array


@dataclass(frozen=True, repr=False)
class ScheduledSystem(Record):
    """M(p) x'' + C(p) x' + (f(p), K(p) x) + s(p) p'^2 = B(p) u, x = (p, deviations), with polynomials between points.

    `points` (k,) are Chebyshev's, `samples` what was found there, along a leading axis; `parameter` is the name of p
    and `unit` its unit. Outputs are (d/dt)^`derivative` (readings(p) + rows(p) x + residual(p) u) + D u, x without p.
    The slope of f is the stiffness by which the frozen system answers p, so that static states are those of the
    equilibria (theory eqs. T41-T44).
    """

    _shown = ("parameter", "points")

    parameter: str
    unit: str
    points: Array
    samples: Frozen
    derivative: NDArray[np.intp]
    D: Array

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the greatest value of the parameter."""
        return float(self.points[0]), float(self.points[-1])

    def text(self, p: float) -> str:
        """A value of the parameter in words."""
        return f"{self.parameter} = {quantity(p, self.unit)}"

    @property
    def _places(self) -> Array:
        """The points (k,) between -1 and 1."""
        low, high = self.ends
        return (2 * self.points - low - high) / (high - low)

    def coefficients(self, values: Array) -> Array:
        """Coefficients (k, ...) of Chebyshev polynomials through values (k, ...) at the points."""
        V = chebyshev.chebvander(self._places, len(self.points) - 1)
        found: Array = np.asarray(np.linalg.solve(V, values.reshape(len(values), -1)), dtype=float)
        return found.reshape(values.shape)

    def slopes(self, values: Array) -> Array:
        """Derivatives (k, ...) by the parameter, at the points, of polynomials through values (k, ...) there."""
        low, high = self.ends
        of_slope = chebyshev.chebder(self.coefficients(values), axis=0) * 2 / (high - low)
        V = chebyshev.chebvander(self._places, len(of_slope) - 1)
        return np.asarray(np.tensordot(V, of_slope, 1), dtype=float)

    @cached_property
    def _force(self) -> tuple[Array, Array]:
        """Coefficients (2k,) of the force, which has its values and its slopes, the stiffness by which p is answered,
        at the points, and (2k - 1,) of its slope: so the static states are those of the frozen stiffness."""
        low, high = self.ends
        count, half = 2 * len(self.points), (high - low) / 2
        V = chebyshev.chebvander(self._places, count - 1)
        rises = chebyshev.chebvander(self._places, count - 2) @ chebyshev.chebder(np.eye(count))
        values = np.append(self.samples.force, self.samples.K[:, 0, 0] * half)
        force: Array = np.asarray(np.linalg.solve(np.vstack([V, rises]), values), dtype=float)
        return force, np.asarray(chebyshev.chebder(force) / half, dtype=float)

    @property
    def force_coefficients(self) -> Array:
        """Coefficients (2k,) of Chebyshev polynomials of the force."""
        return self._force[0]

    @cached_property
    def _flat(self) -> tuple[Array, list[tuple[slice, tuple[int, ...]]]]:
        """Coefficients (k, all) of everything else, and where each of it is in what shape."""
        places, start = list[tuple[slice, tuple[int, ...]]](), 0
        everything = (*self.samples, self.slopes(self.samples.rows))
        for values in everything:
            size = int(np.prod(values.shape[1:]))
            places.append((slice(start, start + size), values.shape[1:]))
            start += size
        return self.coefficients(np.hstack([values.reshape(len(values), -1) for values in everything])), places

    def _evaluated(self, p: float) -> tuple[Frozen, Array]:
        """What the plant is at a value of the parameter, and how `rows` change with it."""
        coefficients, places = self._flat
        low, high = self.ends
        place = min(max((2 * p - low - high) / (high - low), -1.0), 1.0)
        T = np.cos(np.arange(2 * len(coefficients)) * np.arccos(place))
        flat = T[: len(coefficients)] @ coefficients
        *own, turned = (flat[at].reshape(shape) for at, shape in places)
        frozen, (force, slope) = Frozen(*own), self._force
        frozen.K[0, 0] = T[:-1] @ slope
        return frozen._replace(force=T @ force), turned

    def at(self, p: float) -> Frozen:
        """What the plant is at a value of the parameter. Raises OptionError outside the range."""
        low, high = self.ends
        slack = OUTSIDE * (high - low)
        if not (np.isfinite(p) and low - slack <= p <= high + slack):
            raise OptionError(f"{self.text(p)} is not on the stroke, {ends(self.ends, self.unit)}")
        return self._evaluated(p)[0]

    def resting(self, u: Array) -> Array:
        """Coordinates (r,) of the static state under inputs u (m,). Raises OptionError where there is none."""
        from scipy.optimize import brentq  # slow to import

        def missing(p: float) -> float:
            own = self.at(p)
            return float(own.force - own.B[0] @ u)

        tried = np.linspace(*self.ends, SOUGHT)
        values = np.array([missing(float(p)) for p in tried])
        scale = max(float(np.abs(self.samples.force).max()), 1e-300)
        still = np.flatnonzero(np.abs(values) <= 1e-9 * scale)
        crossing = np.flatnonzero(values[:-1] * values[1:] < 0)
        if len(still):
            p = float(tried[still[0]])
        elif len(crossing):
            p = float(brentq(missing, *tried[crossing[0] : crossing[0] + 2].tolist(), xtol=1e-15))
        else:
            raise OptionError(
                f"no static state under these inputs is on the stroke, {ends(self.ends, self.unit)}, where the drive"
                f" holds {values.min():.4g} to {values.max():.4g} more than they do: move further, or start elsewhere"
            )
        own = self.at(p)
        return np.append(p, np.linalg.solve(own.K[1:, 1:], own.B[1:] @ u))

    def _acceleration(self, own: Frozen, x: Array, v: Array, u: Array) -> Array:
        held = own.K[:, 1:] @ x[1:]
        held[0] = own.force
        return np.linalg.solve(own.M, own.B @ u - own.C @ v - held - own.swing * v[0] ** 2)

    def motion(self, inputs: Callable[[float], Array], dt: float, count: int, start: Array) -> Motion:
        """The motion from rest at coordinates `start` (r,) under inputs (m,) at times, at 0, dt, ... (Dormand and
        Prince 1980, of order 8). Raises SolverError where it leaves the stroke."""
        from scipy.integrate import solve_ivp  # slow to import

        r, (low, high), times = len(start), self.ends, dt * np.arange(count, dtype=float)

        def rate(t: float, z: Array) -> Array:
            return np.concatenate([z[r:], self._acceleration(self._evaluated(z[0])[0], z[:r], z[r:], inputs(t))])

        def within(_: float, z: Array) -> float:
            return float(min(z[0] - low, high - z[0]) + OUTSIDE * (high - low))

        within.terminal = True  # type: ignore[attr-defined]
        sizes = np.append(np.full(r, MOTION_ERROR * (high - low) * 1e-3), np.full(r, MOTION_ERROR * (high - low)))
        found = solve_ivp(
            rate, (0.0, float(times[-1])), np.append(start, np.zeros(r)), "DOP853", times,
            events=within, rtol=MOTION_ERROR, atol=sizes, max_step=dt,
        )  # fmt: skip
        if found.status == 1 and found.t_events and found.y_events:
            place = (
                f"{self.text(float(found.y_events[0][0][0]))}, {quantity(found.t_events[0][0], 's')} after the start"
            )
            raise SolverError(f"the motion leaves the stroke, {ends(self.ends, self.unit)}, at {place}")
        if not found.success:
            raise SolverError(f"the motion cannot be followed beyond {quantity(float(found.t[-1]), 's')}")
        x, v = found.y[:r], found.y[r:]
        u = np.stack([inputs(t) for t in times], axis=1)
        return Motion(np.stack([self._read(x[:, k], v[:, k], u[:, k]) for k in range(count)], axis=1), x, v)

    def _read(self, x: Array, v: Array, u: Array) -> Array:
        """Outputs (p,) in a state of motion."""
        own, turned = self._evaluated(float(x[0]))
        still = own.readings + own.rows[:, 1:] @ x[1:] + own.residual @ u
        faster = own.rows @ self._acceleration(own, x, v, u) + turned @ v * v[0]
        return np.choose(self.derivative, (still, own.rows @ v, faster)) + self.D @ u


def aligned(vectors: Array, reference: Array, M: Array) -> tuple[Array, float]:
    """What vectors (n, k) span, as vectors orthonormal in M that are as near to others (n, k) as they get, and the
    least part of these that they span (Schönemann 1966, Psychometrika 31, 1; Amsallem and Farhat 2011)."""
    L = la.cholesky(vectors.T @ (M @ vectors), lower=True)
    own = la.solve_triangular(L, vectors.T, lower=True).T
    U, size, Wt = la.svd(own.T @ (M @ reference))
    return np.asarray(own @ (U @ Wt)), float(size.min(initial=1.0))
