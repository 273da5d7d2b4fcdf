"""How far eigenpairs and static responses may be off, by what they leave over in energies (`Pencil`)."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg.factor import Factor, factorise
from flexura.linalg.pencil import Pencil
from flexura.linalg.search import Eigenpairs

POLISH = 2
"""Corrections of a solution by its residual in energies."""

UNSETTLED = 1e-6
"""Change of the root of the work of loads, relative, in the last correction of their response."""


FURTHER, STEP = 4, 64.0
"""How often a shift below all eigenvalues is tried again, and so many times as far below."""


def residuals(pencil: Pencil, pairs: Eigenpairs) -> Array:
    """Relative residuals (k,) of eigenpairs of K x = lambda M x in the norm that bounds the eigenvalue (theory eq. 56).

    r = (lambda - s) (K - s M)^-1 M x - x, in the M-norm relative to x: some exact eigenvalue mu has
    |(lambda - s) / (mu - s) - 1| <= |r| (Krylov and Weinstein, Parlett 1980, sec. 4.5). s is zero for definite K, else
    below the lowest eigenvalue of the pairs by at least the lowest positive one (by one when there is none).
    """
    return _weinstein(pencil, pairs.values, pairs.vectors)[0]


def residual_intervals(pencil: Pencil, values: Array, vectors: Array) -> tuple[Array, Array]:
    """Bounds (k,), (k,) between which some eigenvalue lies, for each Ritz pair (Krylov and Weinstein; theory eq. C5).

    The residuals, as in `residuals`, are widened for round-off. The upper bound is infinite where the residual is one
    or more.
    """
    radius, shift = _weinstein(pencil, values, vectors)
    distance = values - shift
    margin = pencil.margin(vectors) + np.abs(values) * pencil.mass_margin(vectors)
    radius = radius + margin / distance
    upper = np.where(radius < 1, shift + distance / np.where(radius < 1, 1 - radius, 1.0), np.inf)
    return shift + distance / (1 + radius) - margin, upper + margin


def _weinstein(pencil: Pencil, values: Array, vectors: Array) -> tuple[Array, float]:
    """The residuals and the shift that they refer to."""
    elastic = values[values > 0]
    least = float(elastic.min()) if len(elastic) else 1.0
    shift = 0.0 if len(elastic) == len(values) else 2 * float(values.min(initial=0.0)) - least
    Mx = pencil.M @ vectors
    for further in (True,) * FURTHER + (False,):
        try:
            y = solution(pencil, Mx, shift)
            break
        except SolverError:
            if not further:
                raise
            shift = STEP * shift if shift else -least  # soft enough to look singular
    r = (values - shift) * y - vectors
    size = np.einsum("ik,ik->k", vectors, Mx)
    return np.sqrt(np.abs(np.einsum("ik,ik->k", r, pencil.M @ r)) / size), shift


def static_response(pencil: Pencil, loads: Array, shift: float = 0.0, settled: float = UNSETTLED) -> Array:
    """(K + shift M)^-1 loads (n, k), definite, corrected by residuals in energies until it stands: the last correction
    changes the root of the work of each load by less than `settled` of it.

    Raises SolverError when K is singular, or so close to it that round-off stands in the way.
    """
    Y = solution(pencil, loads, -shift)
    last = solution(pencil, loads - pencil.stiffness(Y) - shift * (pencil.M @ Y), -shift)
    off, size = (np.sqrt(np.abs(np.einsum("ik,ik->k", X, loads))) for X in (last, Y))
    if (off > settled * size).any():
        raise SolverError("something can move freely, or is held by less than round-off in the stiffness hides")
    return Y + last


def solution(pencil: Pencil, right: Array, shift: float, factors: Factor | None = None) -> Array:
    """(K - shift M)^-1 of right sides (n, k), definite, by factors of what is stored and corrections by energies."""
    if factors is None:
        factors = factorise(pencil.K - shift * pencil.M if shift else pencil.K)
    Y, rest = np.zeros_like(right), right
    for step in range(1 + POLISH):
        Y = Y + factors.solve(rest)
        if step < POLISH:
            rest = right - (pencil.stiffness(Y) - shift * (pencil.M @ Y))
    return Y
