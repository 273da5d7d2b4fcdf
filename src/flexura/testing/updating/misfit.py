"""How far a calibrated model misses its data beyond their standard deviations, and what that leaves of intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc, stdtrit

from flexura.arrays import Array
from flexura.testing.updating.targets import ModalTarget, Target

LEAST_SPARE = 0.5
"""Data to spare, beyond what the parameters take up, from which on they can say something of the model."""

UNLIKELY = 0.01
"""Probability of a misfit by chance below which it is the model's."""

NORMAL = 1.959963984540054
"""95 % of a normal distribution lie within so many standard deviations."""


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
        return self.is_testable and self.probability < UNLIKELY

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


def _inverse(J: Array, with_prior: bool) -> Array:
    """dz/dr (P, r) at the optimum: (J'J + I)^-1 J' with the prior, else the pseudo-inverse."""
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    own = s > 1e-10 * max(float(s.max(initial=0.0)), 1e-300)
    gain = s / (1 + s**2) if with_prior else np.where(own, 1 / np.where(own, s, 1.0), 0.0)
    return (Vt.T * gain) @ U.T


def misfits(targets: Sequence[Target], r: Array, J: Array, with_prior: bool) -> tuple[Misfit, ...]:
    """Misfit of each kind of data from residuals r and their sensitivities J (r, P) at the optimum (theory eq. K21).

    What combinations of parameters that the data tell better than the prior could still explain is left out: there,
    data and prior disagree, and not data and model.
    """
    kinds: dict[str, list[NDArray[np.intp]]] = {}
    at = 0
    for t in targets:
        if isinstance(t, ModalTarget):
            k = len(t.frequency_hz)
            parts = [("frequencies", k), ("shapes", 0 if t.shapes is None else k * len(t.channels))]
        else:
            parts = [("responses", 2 * t.sigma.size)]
        for kind, count in parts:
            rows = np.arange(at, at + count)
            if kind == "responses":
                rows = rows[(r[rows] != 0) | (np.abs(J[rows]).sum(axis=1) > 0)]
            kinds.setdefault(kind, []).append(rows)
            at += count
    U, s, _ = np.linalg.svd(J, full_matrices=False)
    determined = U[:, s > (1.0 if with_prior else 1e-10 * max(float(s.max(initial=0.0)), 1e-300))]
    taken, left = (determined**2).sum(axis=1), r - determined @ (determined.T @ r)
    found = []
    for kind, each in kinds.items():
        rows = np.concatenate(each)
        if len(rows):
            spare = max(len(rows) - float(taken[rows].sum()), 0.0)
            found.append(Misfit(kind, len(rows), spare, float(left[rows] @ left[rows]), rows))
    return tuple(found)


def widening(found: Sequence[Misfit], J: Array, with_prior: bool) -> Array:
    """Covariance (P, P) of z that errors of the model add, of the size that the misfit shows (theory eq. K22).

    Errors of one kind may all push the same way: they do not average out over the data, as noise does. With few data
    to spare their size is known badly, as Student's t has it.
    """
    A = _inverse(J, with_prior)
    extra = np.zeros((J.shape[1], J.shape[1]))
    for own in found:
        if own.is_testable and own.ratio > 1:
            t = float(stdtrit(own.spare, 0.975)) / NORMAL
            part = A[:, own.rows]
            extra += (t**2 * (own.ratio**2 - 1) * own.data) * (part @ part.T)
    return extra
