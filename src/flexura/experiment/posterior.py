"""What data say of parameters: the Gaussian approximation at the optimum, its directions, and draws that check it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

QUANTILE = 1.959963984540054
"""95 % of a normal distribution lie within so many standard deviations."""

TOLD = 0.5
"""A direction of which the data tell less than this share is one that they cannot tell."""


@dataclass(frozen=True)
class Direction:
    """A combination of parameters: `weights` by name, in prior standard deviations, unit length.

    `told` is the share of its prior variance that the data take away, s^2/(1 + s^2) with the singular value s of the
    scaled sensitivities (theory eq. K18): 1 is told by the data alone, 0 not at all.
    """

    told: float
    weights: dict[str, float]

    def __str__(self) -> str:
        largest = max(abs(w) for w in self.weights.values())
        shown = sorted(
            ((n, w) for n, w in self.weights.items() if abs(w) >= 0.3 * largest), key=lambda item: -abs(item[1])
        )
        text = " ".join(f"{'-' if w < 0 else '+'} {abs(w):.2f} {n}" for n, w in shown)
        return text.removeprefix("+ ")


def directions(J: Array, names: tuple[str, ...]) -> tuple[Direction, ...]:
    """Directions of z that the weighted sensitivities J (r, P) tell apart, best told first (theory eq. K18)."""
    _, s, Vt = np.linalg.svd(J, full_matrices=True)
    s = np.concatenate([s, np.zeros(len(names) - len(s))])
    found = []
    for value, own in zip(s, Vt, strict=True):
        signed = own * np.sign(own[np.argmax(np.abs(own))])
        found.append(Direction(float(value**2 / (1 + value**2)), dict(zip(names, signed.tolist(), strict=True))))
    return tuple(found)


def covariance(J: Array, with_prior: bool) -> Array:
    """Covariance (P, P) of z: (J'J + I)^-1 with the prior, else (J'J)^-1, infinite variance along what J leaves open
    (theory eq. K17)."""
    _, s, Vt = np.linalg.svd(J, full_matrices=True)
    s = np.concatenate([s, np.zeros(Vt.shape[0] - len(s))])
    if with_prior:
        return (Vt.T / (1 + s**2)) @ Vt
    open_ = s <= 1e-10 * max(float(s.max(initial=0.0)), 1e-300)
    found = (Vt.T / np.where(open_, np.inf, np.where(open_, 1.0, s) ** 2)) @ Vt
    touched = (Vt[open_] ** 2).sum(axis=0) > 1e-12
    found[touched, touched] = np.inf
    return found


@dataclass(frozen=True)
class Sample:
    """Draws of the posterior: `values` (d, P) in SI with `weights` (d,), and the number of independent draws that these
    are worth. `mean` (P,) and `interval` (P, 2), 95 %, are theirs."""

    values: Array
    weights: Array
    effective: float
    mean: Array
    interval: Array


def draw(
    centre: Array,
    cov: Array,
    bounds: tuple[Array, Array],
    cost: Callable[[Array], float],
    values: Callable[[Array], Array],
    count: int,
    seed: int,
) -> Sample:
    """Draw from the posterior exp(-cost(z)) by importance sampling from a Student distribution of 5 degrees of freedom
    about the Gaussian approximation (Gelman et al. 2013, sec. 10.4; theory eq. K19)."""
    rng = np.random.default_rng(seed)
    root = np.linalg.cholesky(cov + 1e-14 * np.trace(cov) * np.eye(len(cov)))
    degrees, P = 5.0, len(centre)
    normal = rng.standard_normal((count, P))
    stretch = np.sqrt(degrees / rng.chisquare(degrees, count))
    z = centre + (normal * stretch[:, None]) @ root.T
    q2 = ((normal * stretch[:, None]) ** 2).sum(axis=1)
    log_proposal = -(degrees + P) / 2 * np.log1p(q2 / degrees)
    inside = ((z >= bounds[0]) & (z <= bounds[1])).all(axis=1)
    log_target = np.array([-cost(own) if ok else -np.inf for own, ok in zip(z, inside, strict=True)])
    log_weight = log_target - log_proposal
    weights = np.exp(log_weight - log_weight.max()) if np.isfinite(log_weight).any() else np.ones(count)
    weights /= weights.sum()
    found = values(z)
    intervals = np.array([_quantiles(column, weights) for column in found.T])
    return Sample(found, weights, float(1 / (weights**2).sum()), weights @ found, intervals)


def _quantiles(x: Array, weights: Array) -> Array:
    order = np.argsort(x)
    return np.interp([0.025, 0.975], np.cumsum(weights[order]) - weights[order] / 2, x[order])
