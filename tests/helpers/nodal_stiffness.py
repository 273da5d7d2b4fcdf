"""Exact dynamic stiffness assembled over the displacements of all nodes, sparse: the direct form of the method.

The matrix is what spectral elements and frequency responses of large mechanisms need. Frequencies are better taken from
`dynamic_stiffness`: here short stiff members cost the lowest of them digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.beam import UniformBeam, rigid_arm
from flexura.beam.dynamic import dynamic_beam
from flexura.linalg import count_below
from flexura.structure.segments import Segments


def end_stiffness(beam: UniformBeam, omega: float | complex) -> NDArray[np.float64]:
    """The dynamic stiffness (..., 12, 12) of uniform beams over the displacements of both ends, in own axes, at an
    angular frequency, rad/s: the usual form, which loses digits of the inertia of short beams."""
    arm = np.zeros((*np.shape(beam.length), 3))
    arm[..., 0] = -np.asarray(beam.length)
    T = np.zeros((*arm.shape[:-1], 12, 12))
    T[..., :6, :6], T[..., 6:, :6] = np.eye(6), -np.eye(6)
    T[..., 6:, 6:] = rigid_arm(arm)
    K = np.swapaxes(T, -1, -2) @ dynamic_beam(beam, omega**2).K @ T
    return (K + np.swapaxes(K, -1, -2)) / 2


class NodalStiffness:
    """K(omega) over the DOFs of segments, and the number of frequencies below one."""

    def __init__(self, own: Segments) -> None:
        self.own = own
        self._scatter = own.scatter()
        self._transforms = own.transforms

    def matrix(self, omega: float | complex) -> Any:
        """K(omega) (n, n), sparse by columns, at an angular frequency, rad/s; complex for complex omega."""
        k = end_stiffness(self.own.beam, omega)[self.own.kind]
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
