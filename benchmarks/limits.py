"""How far flexura is from what a question cannot do without: its arithmetic, and the bare LAPACK calls.

    python benchmarks/limits.py [NAME ...]      all rows, half a minute; names are those of ROWS

Arithmetic is counted in multiplications with an addition, of the sums that kernels and LAPACK work out, and told in the
time that NumPy's product of matrices of order 512 takes for as many. LAPACK is called on matrices that are at hand, and
nothing else is done. All are medians of processor time, in turns, on one thread.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import sys
from collections.abc import Callable
from functools import cache
from itertools import count
from statistics import median
from typing import NamedTuple

import designs
import numpy as np
from pairs import HERTZ, MODES, costs
from scipy.linalg import lapack
from speed import RPR

import flexura as fx
from flexura.reduction.chain_assembler import chain_assembler
from flexura.structure import Design

PRODUCT = 512


class Limit(NamedTuple):
    """What a question cannot do without, and what it takes: multiplications, seconds of LAPACK, seconds of ours."""

    arithmetic: float
    bare: float
    own: float
    which: str


@cache
def rate() -> float:
    """Multiplications with an addition a second, of a product of matrices."""
    A = np.ones((PRODUCT, PRODUCT))
    return PRODUCT**3 / costs(lambda: A @ A, lambda: None)[0]


@cache
def plan() -> fx.Plan:
    return fx.Plan(fx.load(RPR))


def of_chains(with_bounds: bool) -> float:
    """Of chains of e elements: their masses moved to the pole, flexibilities, static motions, loads and what these do;
    with bounds the wrenches of inertia, closed, and their energies besides."""
    e = sum(group.elements.size for reducer in chain_assembler(plan()).reducers.values() for group in reducer.chains)
    masses, flexibility, motions, loads, mass = 3 * 12 * 27, 9 * 27, 6**3, 4 * 6**3, 6**3
    closed, energies = 2 * 36 * 12, 6 * 78
    return e * (masses + flexibility + motions + loads + mass + with_bounds * (closed + energies))


def of_branches(arrow: object, with_bounds: bool) -> float:
    """Of chains at their places, insides of branches that follow, Ritz vectors and projections; with bounds each branch
    is eliminated below six values."""
    matrices = 3 if with_bounds else 2
    placed = sum(len(kind.copies) for kind in chain_assembler(plan()).branches.kinds) * 1.5 * 12 * 72 * matrices
    total = placed
    for block in arrow.blocks:  # type: ignore[attr-defined]
        (q, n), r, m = block.A.shape[2:4], block.T.shape[-3], block.inside
        i, p = n - m, block.T.shape[-1]
        follow = m**3 / 2 + m * m * i + matrices * (n * n * i + n * i * i)
        vectors = m**3 + m * m * i + r * (i * p * p + n * i * p + 3 * m * m * p)
        project = r * matrices * (n * n * p + n * p * p)
        eliminated = MODES * (n**3 / 6 + i**3 / 6 + r * 2 * i * p * p) if with_bounds else 0.0
        total += q * (follow + vectors + project + eliminated)
    return total


def low() -> Limit:
    """One design of order 54 from its sizes: dposv of the three kinds of substructures, products with the constraint
    modes, and dsygvx for six values."""
    webs = (3e-4 * (1 + 1e-4 * k) for k in count())
    matrices = Design.of(plan()).matrices
    parts = []
    for name, reducer in chain_assembler(plan()).reducers.items():
        if len(reducer.interior_dofs) and name:
            K, M = (A.toarray() for A in reducer.assembled(matrices[name]))
            inner, ends = reducer.interior_dofs, reducer.boundary_dofs
            parts.append((np.asfortranarray(K[np.ix_(inner, inner)]), np.asfortranarray(K[np.ix_(inner, ends)]), M))
    reduced = fx.reduce(plan(), keep=0)
    K, M = np.asfortranarray(reduced.K), np.asfortranarray(reduced.M)

    def bare() -> object:
        for stiffness, side, mass in parts:
            T = lapack.dposv(stiffness, side)[1]
            _ = side.T @ T, T.T @ (mass[: len(T), : len(T)] @ T)
        return lapack.dsygvx(M, K, jobz="N", range="I", il=len(K) - MODES + 1, iu=len(K))

    own, least = costs(lambda: fx.unproven_frequencies(plan(), {"r_web": next(webs)}, n=MODES), bare)
    true = np.sqrt(1 / bare()[0][:MODES][::-1]) / HERTZ  # type: ignore[index]
    assert np.allclose(true, fx.unproven_frequencies(plan(), n=MODES), rtol=1e-6)
    arrow = chain_assembler(plan()).unproven(Design.of(plan()).stacked())
    return Limit(of_chains(False) + of_branches(arrow, False), least, own, "`dposv` of three substructures, `dsygvx`")


def proven() -> Limit:
    """One of many proven designs: dsygvx alone of order 54."""
    case = designs.CASES[0]
    reduced = fx.reduce(plan(), keep=0)
    K, M = np.asfortranarray(reduced.K), np.asfortranarray(reduced.M)
    n = 1024
    own = median(designs.worked(("proven", case, n, seed))[1] for seed in range(5)) / n
    least = costs(lambda: lapack.dsygvx(M, K, range="I", il=len(K) - MODES + 1, iu=len(K)), lambda: None)[0]
    arrow = chain_assembler(plan())(Design.of(plan()).stacked())
    return Limit(of_chains(True) + of_branches(arrow, True), least, own, "`dsygvx` of order 54 alone")


ROWS: dict[str, Callable[[], Limit]] = {"low order, 54, one design": low, "a proven design of many": proven}


def main() -> None:
    asked = sys.argv[1:] or list(ROWS)
    print(f"{rate() / 1e9:.1f} multiplications with an addition a nanosecond")
    print(
        f"{'':<28}{'arithmetic':>12}{'its time us':>12}{'LAPACK us':>11}{'ours us':>9}{'x':>6}{'x LAPACK':>10}  LAPACK"
    )
    for name in asked:
        found = ROWS[name]()
        least, bare, own = (1e6 * seconds for seconds in (found.arithmetic / rate(), found.bare, found.own))
        print(
            f"{name:<28}{found.arithmetic:>12.0f}{least:>12.1f}{bare:>11.1f}{own:>9.1f}{own / least:>6.1f}"
            f"{own / bare:>10.2f}  {found.which}"
        )


if __name__ == "__main__":
    main()
