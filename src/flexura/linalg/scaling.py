"""Scaling of symmetric matrices to a diagonal of ones, which takes out what units and unequal members put in."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arrays import Array


def inverse_roots(sizes: ArrayLike) -> Array:
    """1/sqrt|size| for sizes (...), real or complex; one where a size is zero."""
    root = np.sqrt(np.abs(sizes))
    return 1 / np.where(root > 0, root, 1.0)


def unit_scale(A: Any) -> Array:
    """d (..., n) with which D A D has a diagonal of absolute ones, D = diag(d) (van der Sluis 1969).

    A: (..., n, n) dense, or (n, n) sparse. Where its diagonal is zero d is one.
    """
    return inverse_roots(np.einsum("...ii->...i", A) if isinstance(A, np.ndarray) else A.diagonal())


def scaled(A: Any, d: Array) -> Any:
    """D A D for A (..., n, n) dense, or (n, n) sparse by columns, and D = diag(d), d (..., n).

    It shares no array with A.
    """
    if isinstance(A, np.ndarray):
        return A * d[..., :, None] * d[..., None, :]
    data = A.data * d[A.indices] * np.repeat(d, np.diff(A.indptr))
    return sp.csc_matrix((data, A.indices.copy(), A.indptr.copy()), shape=A.shape)
