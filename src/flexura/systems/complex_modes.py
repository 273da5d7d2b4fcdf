"""Complex modes, where damping couples the real ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arrays import Array, Complex
from flexura.errors import SolverError
from flexura.results import Tabular
from flexura.tables import Facts, Table, percent


@dataclass(frozen=True, repr=False)
class ComplexModes(Tabular):
    """Poles (2r,), rad/s, in conjugate pairs or real, the lowest first; states (eta, eta') = right z, where
    z' = poles z + left f for modal forces f. right (2r, 2r), left (2r, r)."""

    _shown = ("poles",)

    poles: Complex
    right: Complex
    left: Complex

    @property
    def frequency_hz(self) -> Array:
        """|pole| / 2 pi (2r,), Hz."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def ratios(self) -> Array:
        """Damping ratios (2r,): -Re(pole)/|pole|; 1 for real poles."""
        size = np.abs(self.poles)
        return -self.poles.real / np.where(size > 0, size, np.inf)

    def _view(self) -> Iterator[Facts | Table]:
        own = np.flatnonzero(self.poles.imag >= 0)
        damping = [percent(float(z)) for z in self.ratios[own]]
        yield Table({"frequency [Hz]": self.frequency_hz[own], "damping": damping}, "poles")

    def _columns(self) -> dict[str, Any]:
        poles = {"pole, real [rad/s]": self.poles.real, "pole, imaginary [rad/s]": self.poles.imag}
        return {**poles, "frequency [Hz]": self.frequency_hz, "damping ratio": self.ratios}


DEFECTIVE = 1e10
"""Condition number of the complex modes from which they are taken as defective."""


def complex_modes(omega: Array, damping: Array) -> ComplexModes:
    """Complex modes of eta'' + damping eta' + omega^2 eta = f (Foss 1958, Trans. ASME J. Appl. Mech. 25, 361).

    omega (r,), rad/s; damping (r, r), 1/s. Raises SolverError where poles coincide so that there are no such modes
    (critical damping); generalised-alpha time integration and direct frequency response need none.
    """
    r = len(omega)
    scale = np.where(omega > 0, omega, 1.0)
    A = np.zeros((2 * r, 2 * r))
    A[:r, r:] = np.diag(scale)
    A[r:, :r], A[r:, r:] = np.diag(-(omega**2) / scale), -damping
    found = np.linalg.eig(A)
    poles: Complex = found[0].astype(complex)
    vectors: Complex = found[1].astype(complex)
    order = np.lexsort((poles.imag < 0, np.abs(poles.imag), np.abs(poles)))
    poles, vectors = poles[order], vectors[:, order]
    if np.linalg.cond(vectors) > DEFECTIVE:
        raise SolverError("some poles coincide (critical damping, or a free rigid motion): there are no complex modes")
    left: Complex = np.asarray(np.linalg.inv(vectors)[:, r:], dtype=complex)
    right = vectors.copy()
    right[:r] /= scale[:, None]
    return ComplexModes(poles, right, left)
