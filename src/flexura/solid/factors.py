"""Factorisations of large sparse symmetric matrices: MKL Pardiso where pypardiso is installed, else SuperLU."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.errors import SolverError
from flexura.linalg.inertia import count_below

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]
"""Called with what is being done and the fraction of it that is done; what it raises ends the work."""

SUPERLU_FILL = 3.3
"""Numbers in the factors of a cube of n DOFs over n^(5/3), with minimum degree ordering: measured up to 14 000 DOFs."""

DEFINITE, INDEFINITE = 2, -2
"""Pardiso's kinds of real symmetric matrices."""

NUDGES = (0.0, 1e-8, -1e-8, 1e-6)
"""Relative changes of a value so close to an eigenvalue that pivots vanish."""

NOT_DEFINITE = -4
"""Pardiso's error for a pivot that is zero or, in a definite matrix, negative."""


def available_memory() -> float:
    """Bytes that can still be had, from the operating system and the limit of the control group; inf where unknown."""
    found = [float("inf")]
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        found += [1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable")]
        group = Path("/sys/fs/cgroup")
        limit = (group / "memory.max").read_text().strip()
        if limit != "max":
            rows = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
            in_use = float((group / "memory.current").read_text()) - float(rows.get("inactive_file", 0))
            found.append(float(limit) - in_use)
    except (OSError, ValueError):
        pass
    return min(found)


def superlu_memory(n: int) -> float:
    """Bytes that SuperLU needs for a compact solid of n DOFs, by experience; slender solids need about half."""
    return 12 * SUPERLU_FILL * n ** (5 / 3)


class Factors:
    """Factors of a symmetric A (n, n): called with b (n,) or (n, k) they give A^-1 b.

    `negative` is the number of negative eigenvalues where `solver` (pardiso or superlu) has counted them on pivots that
    it did not have to change; `memory` the bytes taken.
    """

    def __init__(self, solve: Callable[[Array], Array], solver: str, memory: float, negative: int | None) -> None:
        self._solve = solve
        self.solver, self.memory, self.negative = solver, memory, negative

    def __call__(self, b: Array) -> Array:
        return self._solve(b)


def factorise(
    A: Any, *, definite: bool = True, memory: float | None = None, progress: Progress | None = None
) -> Factors:
    """Factors of a sparse symmetric A (n, n), positive definite where `definite` says so.

    The memory is estimated first. Raises SolverError when that is more than `memory`, bytes (default: what is
    available), and when A is singular or not definite.
    """
    limit = available_memory() if memory is None else memory
    d = np.abs(A.diagonal())
    d = 1 / np.sqrt(np.where(d > 0, d, 1.0))
    scaling = sp.diags_array(d)
    scaled = sp.csr_matrix(scaling @ A @ scaling)
    solver = _pardiso_solver()
    inner = _superlu(scaled, limit) if solver is None else _pardiso(solver, scaled, definite, limit, progress)

    def solve(b: Array) -> Array:
        b = np.asarray(b, dtype=float)
        scale = d if b.ndim == 1 else d[:, None]
        return scale * inner(scale * b)

    return Factors(solve, inner.solver, inner.memory, inner.negative)


def negative_count(K: Any, M: Any, value: float, memory: float | None = None) -> int:
    """Number of eigenvalues of K x = lambda M x below `value`, by Sylvester's law of inertia (theory eq. E3).

    Raises SolverError as `factorise`.
    """
    for nudge in NUDGES if _pardiso_solver() is not None else ():
        found = factorise(K - value * (1 + nudge) * M, definite=False, memory=memory).negative
        if found is not None:
            return found
    return count_below(sp.csc_matrix(K), sp.csc_matrix(M), value)


@cache
def _pardiso_library() -> Any:
    """A solver of pypardiso to be copied, since making one searches the disk; None where it is not installed."""
    try:
        from pypardiso import PyPardisoSolver

        return PyPardisoSolver()
    except (ImportError, OSError):
        return None


def _pardiso_solver() -> Any:
    made = copy.copy(_pardiso_library())
    if made is not None:
        made.pt, made.iparm = np.zeros_like(made.pt), np.zeros_like(made.iparm)
    return made


class _Pardiso:
    """One matrix of Pardiso's, whose memory is given back with it."""

    def __init__(self, solver: Any, A: sp.csr_matrix, kind: int) -> None:
        self.solver, self.A = solver, A
        solver.set_matrix_type(kind)
        solver.factorized_A = A  # else what is kept is compared with what is solved, number by number

    def phase(self, phase: int, b: Array) -> Array:
        self.solver.set_phase(phase)
        return self.solver._call_pardiso(self.A, b)

    def __del__(self) -> None:
        try:
            self.solver.set_phase(-1)
            self.solver._call_pardiso(self.A, np.zeros((self.A.shape[0], 1), order="F"))
        except Exception:  # the interpreter may be at its end
            return


def _pardiso(solver: Any, A: sp.csr_matrix, definite: bool, limit: float, progress: Progress | None) -> Factors:
    """Analysis, which tells the memory, then factorisation of the upper triangle."""
    from pypardiso.pardiso_wrapper import PyPardisoError

    at, own = sp.triu(A, format="coo"), np.arange(A.shape[0])
    entries = np.append(at.data, np.zeros(len(own)))  # Pardiso wants every diagonal entry, zero or not
    upper = sp.csr_matrix((entries, (np.append(at.row, own), np.append(at.col, own))), shape=A.shape)
    upper.sort_indices()
    held = _Pardiso(solver, upper, DEFINITE if definite else INDEFINITE)
    nothing = np.zeros((A.shape[0], 1), order="F")
    try:
        _tell(progress, "analyse", 0.0)
        held.phase(11, nothing)
        memory = 1024.0 * max(solver.get_iparm(15), solver.get_iparm(16) + solver.get_iparm(17))
        _refuse(memory, limit, A.shape[0])
        _tell(progress, "factorise", 0.0)
        held.phase(22, nothing)
        _tell(progress, "factorise", 1.0)
    except PyPardisoError as error:
        if error.value == NOT_DEFINITE:
            raise SolverError("the matrix is not positive definite: something can move freely") from None
        raise SolverError(f"Pardiso could not factorise a matrix of order {A.shape[0]}: {error}") from None

    def solve(b: Array) -> Array:
        return held.phase(33, np.asfortranarray(b))

    counted = not definite and solver.get_iparm(14) == 0
    return Factors(solve, "pardiso", memory, int(solver.get_iparm(23)) if counted else None)


def _superlu(A: sp.csr_matrix, limit: float) -> Factors:
    memory = superlu_memory(A.shape[0])
    _refuse(memory, limit, A.shape[0])
    options = {"SymmetricMode": True}
    try:
        lu = spla.splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:
        raise SolverError("the matrix is singular: something can move freely") from None
    return Factors(lambda b: lu.solve(np.ascontiguousarray(b)), "superlu", 12.0 * lu.nnz, None)


def _refuse(memory: float, limit: float, n: int) -> None:
    if memory > limit:
        raise SolverError(
            f"factors of a matrix of order {n} would need {memory / 1e9:.3g} GB and {limit / 1e9:.3g} GB can be had: "
            "take a coarser mesh or a larger computer"
        )


def _tell(progress: Progress | None, stage: str, fraction: float) -> None:
    if progress is not None:
        progress(stage, fraction)
