"""What data say of parameters: the Gaussian approximation at the optimum, its directions, and draws that check it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.deadline import Listener
from flexura.linalg import ranked, turned
from flexura.results import Tabular
from flexura.tables import Facts, Table
from flexura.testing.updating.markov_chain import Cost, effective_draws, metropolis, split_r_hat

QUANTILE = 1.959963984540054
"""95 % of a normal distribution lie within so many standard deviations."""

LEAST_REDUCTION = 0.5
"""A direction whose variance reduction is less is left to the prior."""

ENOUGH = 50
"""Effective sample size from which on intervals are given."""

SETTLED = 1.05
"""Potential scale reduction below which chains tell the same."""


@dataclass(frozen=True)
class Direction:
    """A combination of parameters: `weights` by name, in prior standard deviations, unit length.

    `variance_reduction` is the share of its prior variance that the data take away, s^2/(1 + s^2) with the singular
    value s of the scaled sensitivities (theory eq. K18): 1 is determined by the data alone, 0 not at all.
    """

    variance_reduction: float
    weights: dict[str, float]

    def __str__(self) -> str:
        largest = max(abs(w) for w in self.weights.values())
        own = [(n, w) for n, w in self.weights.items() if abs(w) >= 0.3 * largest]
        shown = (own[i] for i in ranked([abs(w) for _, w in own]))
        text = " ".join(f"{'-' if w < 0 else '+'} {abs(w):.2f} {n}" for n, w in shown)
        return text.removeprefix("+ ")


def directions(J: Array, names: tuple[str, ...]) -> tuple[Direction, ...]:
    """Directions of z by their variance reduction from weighted sensitivities J (r, P), largest first (theory eq.
    K18)."""
    _, s, Vt = np.linalg.svd(J, full_matrices=True)
    s = np.concatenate([s, np.zeros(len(names) - len(s))])
    found = []
    for value, own in zip(s, Vt, strict=True):
        found.append(Direction(float(value**2 / (1 + value**2)), dict(zip(names, turned(own).tolist(), strict=True))))
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


@dataclass(frozen=True, repr=False)
class Sample(Tabular):
    """Draws of the posterior of the parameters `names`: `values` (chains, d, P) in SI, with their `mean` (P,) and 95 %
    `interval` (P, 2).

    `effective` is the number of independent draws that they are worth for the worst of the parameters, and `r_hat` the
    largest potential scale reduction: above 1.05 chains do not agree yet. `acceptance` is the share of steps
    taken; `is_whole` is false when drawing was interrupted.
    """

    _shown = ("names", "effective", "r_hat", "acceptance")

    names: tuple[str, ...]
    values: Array
    effective: float
    r_hat: float
    acceptance: float
    mean: Array
    interval: Array
    is_whole: bool = True

    @property
    def is_settled(self) -> bool:
        """Whether the chains agree and are long enough for their intervals."""
        return self.r_hat < SETTLED and self.effective >= ENOUGH

    def _data(self) -> dict[str, Any]:
        """Everything but the draws."""
        return {
            "effective_draws": self.effective,
            "r_hat": self.r_hat,
            "acceptance": self.acceptance,
            "is_whole": self.is_whole,
            "means": dict(zip(self.names, self.mean, strict=True)),
            "intervals": dict(zip(self.names, self.interval, strict=True)),
        }

    def _view(self) -> Iterator[Facts | Table]:
        settled = "" if self.is_settled else "not settled: chains do not agree yet"
        worth = f"worth {self.effective:.0f} independent draws, R-hat {self.r_hat:.3f}"
        yield Facts({"draws": worth, "intervals": settled})
        yield from super()._view()

    def _columns(self) -> dict[str, Any]:
        """A row for each parameter."""
        ends = {"lower [SI]": self.interval[:, 0], "upper [SI]": self.interval[:, 1]}
        return {"parameter": self.names, "mean [SI]": self.mean, **ends}


def draw(
    centre: Array,
    cov: Array,
    bounds: tuple[Array, Array],
    cost: Cost,
    values: Callable[[Array], Array],
    names: Sequence[str],
    count: int,
    seed: int,
    progress: Listener | None = None,
) -> Sample:
    """About `count` draws of the posterior exp(-cost(z)) by random walks about its Gaussian approximation."""
    found = metropolis(centre, cov, bounds, cost, count, seed, progress)
    flat = values(found.z.reshape(-1, len(centre)))
    return Sample(
        tuple(names),
        flat.reshape(found.z.shape),
        float(effective_draws(found.z).min()),
        float(split_r_hat(found.z).max()),
        found.acceptance,
        flat.mean(axis=0),
        np.quantile(flat, [0.025, 0.975], axis=0).T,
        found.is_whole,
    )
