"""What data say of parameters: the Gaussian approximation at the optimum, its directions, and how far the model misses.

Draws of the posterior by random walks with the model itself, and how far they can be trusted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.deadline import Listener, Progress
from flexura.linalg import ranked, turned
from flexura.results import Tabular
from flexura.tables import Item, Line, Table, ends
from flexura.testing.updating.targets import Target

LEAST_SPARE = 0.5
"""Data to spare, beyond what the parameters take up, from which on they can say something of the model."""

UNLIKELY_MISFIT = 0.01
"""Probability of a misfit by chance below which it is the model's."""

QUANTILE = 1.959963984540054
"""95 % of a normal distribution lie within so many standard deviations."""

UNDETERMINED = 1e-10
"""Combinations of parameters that the data feel less, relative to the one that they feel most, are left open."""


@dataclass(frozen=True)
class Misfit:
    """What one kind of data says of the model: frequencies, shapes or responses.

    Of `data` residuals the parameters take up all but `spare`; their squares sum to `chi_square`. `probability` is that
    of so large a sum by chance; nan with nothing to spare.
    """

    kind: str
    data: int
    spare: float
    chi_square: float
    rows: NDArray[np.intp]

    @property
    def probability(self) -> float:
        """That of so large a misfit by chance, if the model and the standard deviations hold."""
        from scipy.special import gammaincc  # slow to import

        return float(gammaincc(self.spare / 2, self.chi_square / 2)) if self.is_testable else float("nan")

    @property
    def is_testable(self) -> bool:
        """Whether there are data to spare, so that chance can be judged."""
        return self.spare >= LEAST_SPARE

    @property
    def ratio(self) -> float:
        """Misfit in standard deviations of the data (Birge 1932); nan with nothing to spare."""
        return float(np.sqrt(self.chi_square / self.spare)) if self.is_testable else float("nan")

    @property
    def is_unlikely(self) -> bool:
        """Whether chance does not explain it."""
        return self.is_testable and self.probability < UNLIKELY_MISFIT

    def to_dict(self) -> dict[str, float | str]:
        """Plain data."""
        return {
            "kind": self.kind,
            "data": self.data,
            "spare": self.spare,
            "chi_square": self.chi_square,
            "ratio": self.ratio,
            "probability": self.probability,
        }


def _is_determined(s: Array) -> NDArray[np.bool_]:
    """Which singular values of sensitivities are more than round-off of the largest."""
    return s > UNDETERMINED * max(float(s.max(initial=0.0)), 1e-300)


def misfits(targets: Sequence[Target], r: Array, J: Array, with_prior: bool) -> tuple[Misfit, ...]:
    """Misfit of each kind of data from residuals r and their sensitivities J (r, P) at the optimum (theory eq. K21).

    What combinations of parameters that the data tell better than the prior could still explain is left out: there,
    data and prior disagree, and not data and model.
    """
    kinds: dict[str, list[Index]] = {}
    first = 0
    for kind, count in (part for t in targets for part in t.parts):
        rows = np.arange(first, first + count)
        if kind == "responses":
            rows = rows[(r[rows] != 0) | (np.abs(J[rows]).sum(axis=1) > 0)]
        kinds.setdefault(kind, []).append(rows)
        first += count
    U, s, _ = np.linalg.svd(J, full_matrices=False)
    determined = U[:, s > 1.0 if with_prior else _is_determined(s)]
    taken, left = (determined**2).sum(axis=1), r - determined @ (determined.T @ r)
    result = []
    for kind, each in kinds.items():
        rows = np.concatenate(each)
        if len(rows):
            spare = max(len(rows) - float(taken[rows].sum()), 0.0)
            result.append(Misfit(kind, len(rows), spare, float(left[rows] @ left[rows]), rows))
    return tuple(result)


def widening(missed: Sequence[Misfit], J: Array, with_prior: bool) -> Array:
    """Covariance (P, P) of z that errors of the model add, of the size that the misfit shows (theory eq. K22).

    Errors of one kind may all push the same way: they do not average out over the data, as noise does. With few data
    to spare their size is known badly, as Student's t has it.
    """
    from scipy.special import stdtrit  # slow to import

    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    sure = _is_determined(s)
    gain = s / (1 + s**2) if with_prior else np.where(sure, 1 / np.where(sure, s, 1.0), 0.0)
    slope = (Vt.T * gain) @ U.T  # dz/dr (P, r): (J'J + I)^-1 J' with the prior, else the pseudo-inverse
    extra = np.zeros((J.shape[1], J.shape[1]))
    for misfit in missed:
        if misfit.is_testable and misfit.ratio > 1:
            t = float(stdtrit(misfit.spare, 0.975)) / QUANTILE
            part = slope[:, misfit.rows]
            extra += (t**2 * (misfit.ratio**2 - 1) * misfit.data) * (part @ part.T)
    return extra


Cost = Callable[[Array], float]

CHAINS = 4
"""Chains, from starts spread wider than the posterior."""

SPREAD_OF_STARTS = 1.5
"""Standard deviation of the starts over that of the Gaussian approximation."""

TUNING_STEPS = 0.5
"""Steps that tune the proposals and are thrown away, over those that are kept."""

LEAST_TUNING = 30
"""Such steps of every chain for each unknown at least."""


@dataclass(frozen=True)
class Chains:
    """Draws `z` (chains, d, P) of a posterior and the share of proposals that was accepted.

    `is_whole` is false when drawing was interrupted.
    """

    z: Array
    acceptance: float
    is_whole: bool


def metropolis(
    centre: Array,
    cov: Array,
    bounds: tuple[Array, Array],
    cost: Cost,
    count: int,
    seed: int,
    progress: Listener | None = None,
) -> Chains:
    """Draw from exp(-cost(z)) within bounds by random walks (Metropolis et al. 1953; theory eq. K19).

    Steps are normal with 2.38^2/P times the covariance `cov`, which is tuned, with the length of the step, before the
    first draw is kept (Gelman, Roberts and Gilks 1996; Haario et al. 2001). An interrupt ends the walk with the draws
    that there are, and is passed on before there are two of every chain.
    """
    rng, P = np.random.default_rng(seed), len(centre)
    keep = max(-(-count // CHAINS), 4)
    tune = max(int(TUNING_STEPS * keep), LEAST_TUNING * P)
    starts = centre + SPREAD_OF_STARTS * rng.standard_normal((CHAINS, P)) @ _root(cov).T
    walk = _Walk(rng, np.clip(starts, *bounds), bounds, cost, cov)
    kept = np.empty((keep, CHAINS, P))
    done, total = 0, tune + keep
    try:
        for k in range(total):
            walk.step(tuning=k < tune)
            if k + 1 in (tune // 3, 2 * tune // 3, tune):
                walk.tune(cov)
            if k >= tune:
                kept[k - tune] = walk.z
                done += 1
            if progress is not None:
                progress(Progress("draws", k + 1, total))
    except KeyboardInterrupt:
        if done < 4:
            raise
    return Chains(np.swapaxes(kept[:done], 0, 1), walk.accepted / max(walk.steps, 1), done == keep)


def _root(cov: Array) -> Array:
    return np.linalg.cholesky(cov + 1e-12 * np.trace(cov) * np.eye(len(cov)))


class _Walk:
    """All chains at one step; `accepted` of `steps` after tuning."""

    def __init__(self, rng: np.random.Generator, z: Array, bounds: tuple[Array, Array], cost: Cost, cov: Array) -> None:
        self._rng, self.z, self._bounds, self._cost = rng, z, bounds, cost
        self._costs = np.array([cost(start) for start in z])
        self._root, self._scale = _root(cov), 2.38 / np.sqrt(z.shape[1])
        self._seen: list[Array] = []
        self.accepted = self.steps = 0

    def step(self, tuning: bool) -> None:
        """Propose a step to every chain."""
        proposed = self.z + self._scale * self._rng.standard_normal(self.z.shape) @ self._root.T
        inside = ((proposed >= self._bounds[0]) & (proposed <= self._bounds[1])).all(axis=1)
        costs = np.array([self._cost(z) if ok else np.inf for z, ok in zip(proposed, inside, strict=True)])
        taken = -self._rng.exponential(size=len(costs)) < self._costs - costs
        self.z = np.where(taken[:, None], proposed, self.z)
        self._costs = np.where(taken, costs, self._costs)
        if tuning:
            self._seen.append(self.z)
            wanted = 0.44 if self.z.shape[1] == 1 else 0.25
            self._scale *= float(np.exp((taken.mean() - wanted) / np.sqrt(1 + len(self._seen))))
        else:
            self.accepted, self.steps = self.accepted + int(taken.sum()), self.steps + len(taken)

    def tune(self, cov: Array) -> None:
        """Take the covariance of what was seen since the last time, as far as it is enough."""
        seen = np.concatenate(self._seen) if self._seen else self.z
        few = 10 * seen.shape[1]
        sampled = np.atleast_2d(np.cov(seen.T)) if len(seen) > few else cov
        self._root = _root((len(seen) * sampled + few * cov) / (len(seen) + few))
        self._seen = []


def split_r_hat(z: Array) -> Array:
    """Potential scale reduction (P,) of draws (chains, d, P), each chain cut in halves (Gelman et al. 2013, sec. 11.4).

    One where all chains tell the same.
    """
    half = z.shape[1] // 2
    parts = np.concatenate([z[:, :half], z[:, half : 2 * half]])
    within = parts.var(axis=1, ddof=1).mean(axis=0)
    between = parts.mean(axis=1).var(axis=0, ddof=1)
    total = (half - 1) / half * within + between
    return np.sqrt(np.where(within > 0, total / np.where(within > 0, within, 1.0), np.where(between > 0, np.inf, 1.0)))


def effective_draws(z: Array) -> Array:
    """Independent draws (P,) that draws (chains, d, P) are worth (Gelman et al. 2013, eqs. 11.7-11.8).

    The sum of autocorrelations ends with the first pair that is negative (Geyer 1992).
    """
    chains, d, P = z.shape
    spectrum = np.fft.rfft(z - z.mean(axis=1, keepdims=True), 2 * d, axis=1)
    auto = np.fft.irfft(np.abs(spectrum) ** 2, 2 * d, axis=1)[:, :d].mean(axis=0) / d
    within = auto[0] * d / (d - 1)
    total = auto[0] + z.mean(axis=1).var(axis=0, ddof=1)
    rho = 1 - (within - auto) / np.where(total > 0, total, 1.0)
    pairs = rho[: d - d % 2].reshape(-1, 2, P).sum(axis=1)
    counted = np.minimum.accumulate(np.where(np.cumsum(pairs < 0, axis=0) == 0, pairs, 0.0), axis=0)
    return chains * d / np.maximum(2 * counted.sum(axis=0) - 1, 1 / np.log10(max(chains * d, 10)))


LEAST_REDUCTION = 0.5
"""A direction whose variance reduction is less is left to the prior."""

ENOUGH_DRAWS = 50
"""Effective sample size from which on intervals are given."""

SETTLED_R_HAT = 1.05
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
        heavy = [(n, w) for n, w in self.weights.items() if abs(w) >= 0.3 * largest]
        shown = (heavy[i] for i in ranked([abs(w) for _, w in heavy]))
        text = " ".join(f"{'-' if w < 0 else '+'} {abs(w):.2f} {n}" for n, w in shown)
        return text.removeprefix("+ ")


def directions(J: Array, names: tuple[str, ...]) -> tuple[Direction, ...]:
    """Directions of z by their variance reduction from weighted sensitivities J (r, P), largest first (theory eq.
    K18)."""
    _, s, Vt = np.linalg.svd(J, full_matrices=True)
    s = np.concatenate([s, np.zeros(len(names) - len(s))])
    weights = (dict(zip(names, turned(row).tolist(), strict=True)) for row in Vt)
    return tuple(Direction(float(x**2 / (1 + x**2)), row) for x, row in zip(s, weights, strict=True))


def covariance(J: Array, with_prior: bool) -> Array:
    """Covariance (P, P) of z: (J'J + I)^-1 with the prior, else (J'J)^-1, infinite variance along what J leaves open
    (theory eq. K17)."""
    _, s, Vt = np.linalg.svd(J, full_matrices=True)
    s = np.concatenate([s, np.zeros(Vt.shape[0] - len(s))])
    if with_prior:
        return (Vt.T / (1 + s**2)) @ Vt
    sure = _is_determined(s)
    cov = (Vt.T / np.where(sure, s**2, np.inf)) @ Vt
    touched = (Vt[~sure] ** 2).sum(axis=0) > 1e-12
    cov[touched, touched] = np.inf
    return cov


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
    units: tuple[str, ...] = ()

    @property
    def is_settled(self) -> bool:
        """Whether the chains agree and are long enough for their intervals."""
        return self.r_hat < SETTLED_R_HAT and self.effective >= ENOUGH_DRAWS

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

    def presentation(self) -> Iterator[Item]:
        chains, count = self.values.shape[:2]
        text = f"{chains} chains of {count} draws, worth {self.effective:.0f} independent ones; R-hat {self.r_hat:.3f}"
        yield Line(f"{text}, {100 * self.acceptance:.0f} % accepted")
        if not self.is_whole:
            yield Line("drawing was interrupted")
        if not self.is_settled:
            yield Line("these are too few to check the intervals: more draws, or fewer free parameters")
            return
        intervals = [ends(interval, unit, 4) for interval, unit in zip(self.interval.tolist(), self.units, strict=True)]
        yield Table({"parameter": self.names, "95 % interval of the draws": intervals}, "parameters")

    def _columns(self) -> dict[str, Any]:
        """A row for each parameter."""
        ends = {"lower [SI]": self.interval[:, 0], "upper [SI]": self.interval[:, 1]}
        return {"parameter": self.names, "mean [SI]": self.mean, **ends}
