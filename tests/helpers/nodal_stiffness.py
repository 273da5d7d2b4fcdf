"""Exact dynamic stiffness assembled over the displacements of all nodes, sparse: the direct form of the method.

The matrix is what spectral elements and frequency responses of large mechanisms need. Frequencies are better taken from
`dynamic_stiffness`: here short stiff members cost the lowest of them digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from flexura.beam.dynamic import dynamic_beam, dynamic_stiffness
from flexura.linalg import count_below
from flexura.structure.segments import Segments


class NodalStiffness:
    """K(omega) over the DOFs of segments, and the number of frequencies below one."""

    def __init__(self, own: Segments) -> None:
        self.own = own
        self._scatter = own.scatter()
        self._transforms = own.transforms

    def matrix(self, omega: float | complex) -> Any:
        """K(omega) (n, n), sparse by columns, at an angular frequency, rad/s; complex for complex omega."""
        k = dynamic_stiffness(self.own.beam, omega)[self.own.kind]
        k = np.swapaxes(self._transforms, -1, -2) @ k @ self._transforms
        K: Any = self._scatter.sparse([k.real]) + self.own.K - (omega**2) * self.own.M
        if np.iscomplexobj(k):
            K = K + 1j * self._scatter.sparse([k.imag])
        return K.tocsc()

    def count_below(self, hz: float) -> int:
        """Number of natural frequencies below `hz` (Wittrick and Williams 1971; theory eq. D9): negative pivots of K,
        and frequencies of the segments with both ends held. Raises SolverError where no factorisation is stable."""
        omega = 2 * np.pi * hz
        J0 = dynamic_beam(self.own.beam, omega**2).J0[self.own.kind]
        return int(J0.sum()) + count_below(self.matrix(omega), sp.identity(self.own.n, format="csc"), 0.0)
