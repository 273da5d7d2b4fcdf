"""Functions of frequency that show where modes are."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.testing.measurement import ResponseMatrix


def mode_indicators(matrix: ResponseMatrix) -> Array:
    """Complex mode indicator functions (f, min(p, m)): singular values of the responses, scaled to comparable size.

    Each mode is a peak of the first; where a second one peaks at the same place, modes are repeated (theory eq. I23;
    Shih, Tsuei, Allemang and Brown 1988, Mechanical Systems and Signal Processing 2).
    """
    return np.asarray(np.linalg.svd(matrix.scaled, compute_uv=False), dtype=np.float64)
