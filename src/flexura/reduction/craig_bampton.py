"""Craig-Bampton reduction of one substructure (Craig and Bampton 1968; the RPR paper, eqs. 1-7 and 28-29)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.errors import SolverError
from flexura.linalg import count_below, factorise, lowest
from flexura.structure.slots import Index

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReducedPart:
    """A substructure in Craig-Bampton coordinates: interface displacements, then amplitudes of kept normal modes.

    K, M: (b + k, b + k); T: (n, b + k) recovers all n displacements; `frequencies` (k,) of the kept fixed-interface
    normal modes, rad/s.
    """

    K: Array
    M: Array
    T: Array
    frequencies: Array


def constraint_modes(K: sp.csc_matrix, interior: Index, boundary: Index) -> Array:
    """Interior displacements (i, b) for unit displacements of each boundary DOF, eq. 6: -K_ii^-1 K_ib (theory eq. 39).

    Raises SolverError when part of the interior can move freely with the boundary held.
    """
    if not len(interior):
        return np.zeros((0, len(boundary)))
    K_ii = K[interior][:, interior].tocsc()
    d = sp.diags(1 / np.sqrt(K_ii.diagonal()))
    right = (d @ K[interior][:, boundary]).toarray()
    return -np.asarray(d @ factorise((d @ K_ii @ d).tocsc()).solve(right))


def fixed_interface_modes(
    K: sp.csc_matrix, M: sp.csc_matrix, interior: Index, count: int = 0, below_hz: float = 0.0
) -> tuple[Array, Array]:
    """Normal modes of the interior with the boundary held, eq. 2 (theory eq. 40): angular frequencies (k,) and modes
    (i, k).

    The lowest `count`, and all below `below_hz` Hz if that is more.
    """
    K_ii, M_ii = K[interior][:, interior].tocsc(), M[interior][:, interior].tocsc()
    limit = (2 * np.pi * below_hz) ** 2
    if limit and len(interior):
        count = max(count, count_below(K_ii, M_ii, limit))
    if not count or not len(interior):
        return np.empty(0), np.empty((len(interior), 0))
    pairs = lowest(K_ii, M_ii, count)
    finite = np.isfinite(pairs.values)
    return np.sqrt(pairs.values[finite]), pairs.vectors[:, finite]


def craig_bampton(
    K: Any, M: Any, interior: Index, boundary: Index, count: int = 0, below_hz: float = 0.0
) -> ReducedPart:
    """Reduce K, M (n, n), SI, to the boundary DOFs and kept fixed-interface normal modes (theory eqs. 41-42).

    With count and below_hz zero these are the constraint modes alone, as in the RPR paper.
    Raises SolverError when the interior is singular.
    """
    K, M = sp.csc_matrix(K), sp.csc_matrix(M)
    n, b = K.shape[0], len(boundary)
    if len(interior) and not (K.diagonal()[interior] > 0).all():
        raise SolverError("a node inside a substructure has no stiffness in some direction")
    omega, modes = fixed_interface_modes(K, M, interior, count, below_hz)
    T = np.zeros((n, b + len(omega)))
    T[boundary, np.arange(b)] = 1.0
    T[interior, :b] = constraint_modes(K, interior, boundary)
    T[interior, b:] = modes
    MT = M @ T
    M_r = T.T @ MT
    K_r = np.zeros_like(M_r)
    K_bb = T[:, :b].T @ (K @ T[:, :b])
    K_r[:b, :b] = (K_bb + K_bb.T) / 2
    K_r[np.arange(b, b + len(omega)), np.arange(b, b + len(omega))] = omega**2
    return ReducedPart(K_r, (M_r + M_r.T) / 2, T, omega)
