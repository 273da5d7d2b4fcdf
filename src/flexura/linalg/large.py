"""Factors of matrices too large to be taken lightly: MKL Pardiso where pypardiso is installed, else SuperLU."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg.factor import Factor, SingularError, SuperLU
from flexura.linalg.scaling import scaled, unit_scale

Progress = Callable[[str, float], None]
"""Called with what is being done and the fraction of it that is done; what it raises ends the work."""

SUPERLU_FILL = 3.3
"""Numbers in the factors of a cube of n DOFs over n^(5/3), with minimum degree ordering: measured up to 14 000 DOFs."""

DEFINITE, INDEFINITE = 2, -2
"""Pardiso's kinds of real symmetric matrices."""

LIBRARY = "PYPARDISO_MKL_RT"
"""Variable of the environment in which pypardiso looks for the path of MKL first."""

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


def factorise_large(
    A: Any, *, definite: bool = True, memory: float | None = None, progress: Progress | None = None
) -> Factor:
    """Factors of a sparse symmetric A (n, n), positive definite where `definite` says so.

    The memory is estimated first. Raises SolverError when that is more than `memory`, bytes (default: what is
    available), and SingularError, which is one, when A is singular or not definite.
    """
    limit = available_memory() if memory is None else memory
    solver = _pardiso_solver()
    if solver is not None:
        return Pardiso(solver, A, definite, limit, progress)
    _refuse(superlu_memory(A.shape[0]), limit, A.shape[0])
    return SuperLU(A)


@cache
def _pardiso_library() -> Any:
    """A solver of pypardiso to be copied, since making one looks for a library; None where it is not installed."""
    try:
        with _library_named():
            from pypardiso import PyPardisoSolver

            return PyPardisoSolver()
    except (ImportError, OSError):
        return None


@contextmanager
def _library_named() -> Iterator[None]:
    """Name the library that the package mkl installed, for which pypardiso searches the whole environment else."""
    known = LIBRARY in os.environ
    try:
        found = [own.locate() for own in files("mkl") or () if own.name.startswith(("libmkl_rt.", "mkl_rt."))]
    except PackageNotFoundError:
        found = []
    if found and not known:
        os.environ[LIBRARY] = str(Path(str(found[0])).resolve())
    try:
        yield
    finally:
        if found and not known:
            del os.environ[LIBRARY]


def _pardiso_solver() -> Any:
    made = copy.copy(_pardiso_library())
    if made is not None:
        made.pt, made.iparm = np.zeros_like(made.pt), np.zeros_like(made.iparm)
    return made


class _Held:
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


class Pardiso(Factor):
    """Factors by a solver of pypardiso: analysis, which tells the memory, then the upper triangle is factorised.

    Raises SolverError beyond the `limit`, bytes, and SingularError.
    """

    name = "pardiso"

    def __init__(self, solver: Any, A: Any, definite: bool, limit: float, progress: Progress | None = None) -> None:
        from pypardiso.pardiso_wrapper import PyPardisoError

        n = A.shape[0]
        self.scale: Array = unit_scale(A)
        at, own = sp.triu(scaled(sp.csc_matrix(A), self.scale), format="coo"), np.arange(n)
        entries = np.append(at.data, np.zeros(n))  # Pardiso wants every diagonal entry, zero or not
        upper = sp.csr_matrix((entries, (np.append(at.row, own), np.append(at.col, own))), shape=A.shape)
        upper.sort_indices()
        self._held = _Held(solver, upper, DEFINITE if definite else INDEFINITE)
        nothing = np.zeros((n, 1), order="F")
        try:
            _tell(progress, "analyse", 0.0)
            self._held.phase(11, nothing)
            self._memory = 1024.0 * max(solver.get_iparm(15), solver.get_iparm(16) + solver.get_iparm(17))
            _refuse(self._memory, limit, n)
            _tell(progress, "factorise", 0.0)
            self._held.phase(22, nothing)
            _tell(progress, "factorise", 1.0)
        except PyPardisoError as error:
            if error.value == NOT_DEFINITE:
                raise SingularError("the matrix is not positive definite: something can move freely") from None
            raise SolverError(f"Pardiso could not factorise a matrix of order {n}: {error}") from None
        counted = not definite and solver.get_iparm(14) == 0
        self._negative = int(solver.get_iparm(23)) if counted else None

    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""
        return self._held.phase(33, np.asfortranarray(b))

    @property
    def memory(self) -> float:
        """Bytes that Pardiso says the factors take."""
        return self._memory

    @property
    def negative(self) -> int | None:
        """Number of negative eigenvalues of an indefinite A, None where pivots had to be changed."""
        return self._negative


def _refuse(memory: float, limit: float, n: int) -> None:
    if memory > limit:
        raise SolverError(
            f"factors of a matrix of order {n} would need {memory / 1e9:.3g} GB and {limit / 1e9:.3g} GB can be had: "
            "take a coarser mesh or a larger computer"
        )


def _tell(progress: Progress | None, stage: str, fraction: float) -> None:
    if progress is not None:
        progress(stage, fraction)
