"""Factors of symmetric matrices behind one interface, whichever library makes them.

L D L' by a kernel, SuperLU and LAPACK; for matrices too large to be taken lightly MKL Pardiso where pypardiso is
installed.
"""

from __future__ import annotations

import copy
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from flexura.arrays import Array, Index
from flexura.errors import SolverError
from flexura.kernels import is_compiled
from flexura.linalg.ldl import Factors
from flexura.linalg.pencil import EPS, scaled, unit_scale

Matrix = Any
"""A dense array or a SciPy sparse matrix."""

FACTOR_ROUNDING = 8
"""Units of round-off of a factor's entry per unit of the product of their absolute values."""

UNSTABLE_PIVOTS = 1e-7
"""A factorisation that may be off by more than this, beside a diagonal of ones, is not trusted for its signs."""

SINGULAR_PIVOT = 1e-13
"""A pivot of the diagonally scaled stiffness below this counts as zero."""

DENSE_LIMIT = 240
"""Up to this order dense routines are as fast as sparse ones."""

MOVES = "the stiffness matrix is singular: something can move freely"

Progress = Callable[[str, float], None]
"""Called with what is being done and the fraction of it that is done; what it raises ends the work."""

SUPERLU_FILL = 3.3
"""Numbers in the factors of a cube of n DOFs over n^(5/3), 12 bytes each, with minimum degree ordering: measured up to
14 000 DOFs; slender solids need about half."""

SINGLE = {1: 1, 2: 2, 28: 1}
"""Pardiso's parameters, by place, for single precision: values are given, order by nested dissection, four bytes."""

DEFINITE, INDEFINITE = 2, -2
"""Pardiso's kinds of real symmetric matrices."""

LIBRARY = "PYPARDISO_MKL_RT"
"""Variable of the environment in which pypardiso looks for the path of MKL first."""

NOT_DEFINITE = -4
"""Pardiso's error for a pivot that is zero or, in a definite matrix, negative."""


class SingularError(SolverError):
    """A matrix that is singular, or not definite where its factors need that."""


class Factor(ABC):
    """Factors of D A D for a symmetric A (n, n), D = diag(scale), scale (n,).

    `name` is that of the library, `memory` the bytes that the factors take. `negative` is the number of negative
    eigenvalues by Sylvester's law of inertia, None where the library has not counted them on pivots that are sure.
    """

    name: ClassVar[str]
    scale: Array

    def solve(self, b: Array) -> Array:
        """A^-1 b for b (n,) or (n, k)."""
        b = np.asarray(b, dtype=float)
        d = self.scale if b.ndim == 1 else self.scale[:, None]
        return d * self.solve_scaled(d * b)

    @property
    @abstractmethod
    def memory(self) -> float: ...

    @property
    @abstractmethod
    def negative(self) -> int | None: ...

    @abstractmethod
    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""


class Elimination(Factor):
    """Factors of a sparse matrix in an order that fills little, diagonal pivots preferred."""

    @property
    @abstractmethod
    def pivots(self) -> Array:
        """Pivots (n,), in the order of elimination."""
        ...

    @property
    @abstractmethod
    def lost(self) -> Array | None:
        """Row sums (n,) of a bound on the round-off in the product of the factors (Higham 2002, theorem 9.3), None
        where pivots are not diagonal ones or not finite."""
        ...

    @property
    def least_pivot(self) -> float:
        """The least pivot, of either sign."""
        return float(self.pivots.min())

    @property
    def negative(self) -> int | None:
        """Number of negative pivots where all are diagonal ones, else None."""
        return None if self.lost is None else int((self.pivots < 0).sum())


class LDL(Elimination):
    """Factors L D L' of a matrix that is nearly symmetric, by a kernel."""

    name = "ldl"

    def __init__(self, factors: Factors, scale: Array) -> None:
        self.scale: Array = scale
        self._factors = factors

    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""
        return self._factors.solve(b)

    @property
    def memory(self) -> float:
        """Bytes that the factors take."""
        return 16.0 * len(self._factors.L)

    @property
    def pivots(self) -> Array:
        """Pivots (n,), in the order of elimination."""
        return self._factors.D

    @property
    def arrays(self) -> tuple[Index, Index, Index, Array, Array]:
        """Order, first entries, rows, L and D, as kernels take them."""
        own = self._factors
        return own.by.order, own.by.first, own.below, own.L, own.D

    @cached_property
    def lost(self) -> Array | None:
        """Row sums (n,) of a bound on the round-off in the product of the factors, None where they are not finite."""
        size = self._factors.sizes()
        return FACTOR_ROUNDING * EPS * size if np.isfinite(size).all() else None


class SuperLU(Elimination):
    """Factors by SuperLU (Demmel et al. 1999) of D A D, by columns and in order. Raises SingularError."""

    name = "superlu"

    def __init__(self, unit: sp.csc_matrix, scale: Array) -> None:
        self.scale: Array = scale
        try:
            self._lu = spla.splu(
                unit, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError:
            raise SingularError(MOVES) from None

    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""
        return self._lu.solve(np.ascontiguousarray(b))

    @property
    def memory(self) -> float:
        """Bytes that the factors take."""
        return 12.0 * self._lu.nnz

    @property
    def pivots(self) -> Array:
        """Pivots (n,), in the order of elimination."""
        return self._lu.U.diagonal()

    @cached_property
    def lost(self) -> Array | None:
        """Row sums (n,) of a bound on the round-off in the product of the factors, None where pivots are not diagonal
        ones or not finite."""
        if not np.array_equal(self._lu.perm_r, self._lu.perm_c):
            return None
        size = np.asarray(abs(self._lu.L) @ (abs(self._lu.U) @ np.ones(len(self.scale))))
        return FACTOR_ROUNDING * EPS * size[self._lu.perm_r] if np.isfinite(size).all() else None


def eliminated(A: Matrix, scale: Array | None = None) -> Elimination:
    """Factors of a sparse A (n, n), which stays as it is: L D L' where these are sparse, else SuperLU's.

    `scale` is by default that of `unit_scale`. Raises SingularError.
    """
    A = sp.csc_matrix(A)
    scale = unit_scale(A) if scale is None else scale
    if is_compiled() and (factors := Factors.of(A, scale)) is not None:
        found = LDL(factors, scale)
        if found.lost is not None and found.lost.max(initial=0.0) < UNSTABLE_PIVOTS:
            return found
    unit = scaled(A, scale)
    unit.sort_indices()  # SuperLU would do so in what it is given
    return SuperLU(unit, scale)


class Dense(Factor):
    """Factors of a full matrix by LAPACK's LU with partial pivoting. `scale` is that of `unit_scale`. Raises
    SingularError."""

    name = "lapack"

    def __init__(self, A: Array) -> None:
        self.scale: Array = unit_scale(A)
        self._lu, self._pivots, singular = la.lapack.dgetrf(scaled(A, self.scale))
        if singular:
            raise SingularError(MOVES)

    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""
        return np.asarray(la.lapack.dgetrs(self._lu, self._pivots, b)[0])

    @property
    def arrays(self) -> tuple[Index, int, int, Array, int]:
        """Pivots and factors by columns, as kernels take them, where those of `LDL` have five arrays."""
        return self._pivots.astype(np.int64), 0, 0, np.ascontiguousarray(self._lu.T), 0

    @property
    def memory(self) -> float:
        """Bytes that the factors take."""
        return float(self._lu.nbytes)

    @property
    def negative(self) -> None:
        """Not counted."""


def factorise(A: Matrix) -> Factor:
    """Factors of a symmetric A (n, n), full or sparse. Raises SingularError, a SolverError, where it is singular."""
    return Dense(A) if isinstance(A, np.ndarray) else eliminated(A)


def pivoted(K: Matrix) -> tuple[float, Elimination | None]:
    """The least pivot, as `least_pivot`, and the factors where they are sparse."""
    if not (K.diagonal() > 0).all():
        return 0.0, None
    if K.shape[0] <= DENSE_LIMIT:
        dense = K if isinstance(K, np.ndarray) else np.asarray(K.toarray())
        try:
            pivots = np.diagonal(np.linalg.cholesky(scaled(dense, unit_scale(dense)))) ** 2
        except np.linalg.LinAlgError:
            return 0.0, None
        return float(pivots.min(initial=np.inf)), None
    try:
        factor = eliminated(K)
    except SingularError:
        return 0.0, None
    return factor.least_pivot, factor


def is_definite(K: Matrix) -> bool:
    """True when symmetric positive semidefinite K (n, n) is definite to working accuracy, judged by its pivots."""
    return least_pivot(K) > SINGULAR_PIVOT


def least_pivot(K: Matrix) -> float:
    """The least pivot of a symmetric positive semidefinite K (n, n), its diagonal scaled to one; zero where it is
    singular. Solutions with K lose about as many digits as it has leading zeros."""
    return pivoted(K)[0]


def available_memory() -> float:
    """Bytes that can still be had, from the operating system and the limit of the control group; inf where unknown."""
    available = [float("inf")]
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        available += [1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable")]
        group = Path("/sys/fs/cgroup")
        limit = (group / "memory.max").read_text().strip()
        if limit != "max":
            rows = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
            in_use = float((group / "memory.current").read_text()) - float(rows.get("inactive_file", 0))
            available.append(float(limit) - in_use)
    except (OSError, ValueError):
        pass
    return min(available)


def factorise_large(
    A: Any,
    *,
    definite: bool = True,
    memory: float | None = None,
    progress: Progress | None = None,
    single: bool = False,
) -> Factor:
    """Factors of a sparse symmetric A (n, n), positive definite where `definite` says so.

    With `single` the numbers of the factors have four bytes where the library can do that: they precondition, in half
    the memory. The memory is estimated first. Raises SolverError when that is more than `memory`, bytes (default: what
    is available), and SingularError, which is one, when A is singular or not definite.
    """
    limit = available_memory() if memory is None else memory
    solver = _pardiso_solver()
    if solver is not None:
        return Pardiso(solver, A, definite, limit, progress or (lambda _stage, _fraction: None), single)
    n = A.shape[0]
    _refuse(12 * SUPERLU_FILL * n ** (5 / 3), limit, n)
    return eliminated(A)


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
    from importlib.metadata import PackageNotFoundError, files  # slow to import

    known = LIBRARY in os.environ
    try:
        libraries = [file.locate() for file in files("mkl") or () if file.name.startswith(("libmkl_rt.", "mkl_rt."))]
    except PackageNotFoundError:
        libraries = []
    if libraries and not known:
        os.environ[LIBRARY] = str(Path(str(libraries[0])).resolve())
    try:
        yield
    finally:
        if libraries and not known:
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
            self.solver._call_pardiso(self.A, np.zeros((self.A.shape[0], 1), dtype=self.A.dtype, order="F"))
        except Exception:  # the interpreter may be at its end
            return


class Pardiso(Factor):
    """Factors by a solver of pypardiso: analysis, which tells the memory, then the upper triangle is factorised.

    Raises SolverError beyond the `limit`, bytes, and SingularError.
    """

    name = "pardiso"

    def __init__(
        self, solver: Any, A: Any, definite: bool, limit: float, progress: Progress, single: bool = False
    ) -> None:
        from pypardiso.pardiso_wrapper import PyPardisoError

        n = A.shape[0]
        self.scale: Array = unit_scale(A)
        at, diagonal = sp.triu(scaled(sp.csc_matrix(A), self.scale), format="coo"), np.arange(n)
        entries = np.append(at.data, np.zeros(n))  # Pardiso wants every diagonal entry, zero or not
        upper = sp.csr_matrix((entries, (np.append(at.row, diagonal), np.append(at.col, diagonal))), shape=A.shape)
        upper.sort_indices()
        self._type: Any = np.float32 if single else np.float64
        if single:
            for place, value in SINGLE.items():
                solver.set_iparm(place, value)
        self._held = _Held(solver, sp.csr_matrix(upper, dtype=self._type), DEFINITE if definite else INDEFINITE)
        nothing = np.zeros((n, 1), dtype=self._type, order="F")
        try:
            progress("analyse", 0.0)
            self._held.phase(11, nothing)
            self._memory = 1024.0 * max(solver.get_iparm(15), solver.get_iparm(16) + solver.get_iparm(17))
            _refuse(self._memory, limit, n)
            progress("factorise", 0.0)
            self._held.phase(22, nothing)
            progress("factorise", 1.0)
        except PyPardisoError as error:
            if error.value == NOT_DEFINITE:
                raise SingularError("the matrix is not positive definite: something can move freely") from None
            raise SolverError(f"Pardiso could not factorise a matrix of order {n}: {error}") from None
        counted = not definite and solver.get_iparm(14) == 0
        self._negative = int(solver.get_iparm(23)) if counted else None

    def solve_scaled(self, b: Array) -> Array:
        """(D A D)^-1 b."""
        return self._held.phase(33, np.asfortranarray(b, dtype=self._type))

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
