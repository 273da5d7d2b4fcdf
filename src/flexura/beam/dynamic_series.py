"""The exact dynamic stiffness of uniform beams as power series of the squared frequency, for evaluation at many.

The series of K itself converges up to the first eigenvalue that a beam has with both ends held. Pieces short enough
that this is far away need few terms, and are joined to whole beams (theory eqs. D4, D6-D7).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.beam.dynamic import (
    AXIAL,
    BENDING_XY,
    BENDING_XZ,
    TORSION,
    Array,
    DynamicBeam,
    at_pole,
    bar_system,
    bending_system,
    join,
    radians,
)
from flexura.beam.frames import rigid_arm
from flexura.beam.uniform import UniformBeam

DEGREE = 17
"""Terms of the series of K."""

TERMS = 26
"""Terms of the series of the exponential function."""

SMALL = 1.0
"""Largest number of radians of any wave on a piece; its own first eigenvalue lies beyond pi."""


class BeamSeries:
    """Matrices over [t, e] of uniform beams (k,) at any real or complex lam with |lam| <= `limit`, rad^2/s^2."""

    def __init__(self, beam: UniformBeam, limit: float) -> None:
        self.limit = limit
        waves = radians(beam, limit) / SMALL
        self.halvings: NDArray[np.intp] = np.ceil(np.log2(np.maximum(waves, 1.0))).astype(np.intp)
        pieces = 2.0**self.halvings
        self._length = beam.length / pieces
        self._coefficients = series(beam._replace(length=self._length), limit)

    def __call__(self, lam: Array, count: bool = True) -> DynamicBeam:
        """Matrices (k, l, 12, 12) at squared angular frequencies lam (l,); eigenvalues with both ends held are counted
        on demand only."""
        lam = np.asarray(lam)
        C = self._coefficients
        n, k = C.shape[:2]
        powers = (lam / self.limit)[:, None] ** np.arange(n)
        rates = np.arange(1, n) * powers[:, :-1] / self.limit
        flat = C.reshape(n, -1)
        K, slope = (
            np.swapaxes((p @ flat[n - p.shape[1] :]).reshape(len(lam), k, 12, 12), 0, 1) for p in (powers, rates)
        )
        own = DynamicBeam(K, slope, np.zeros((k, len(lam)), dtype=np.intp))
        for step in range(int(self.halvings.max(initial=0))):
            at = np.flatnonzero(self.halvings > step)
            arm = np.zeros((len(at), 1, 3))
            arm[:, 0, 0] = self._length[at] * 2**step
            piece = DynamicBeam(*(field[at] for field in own))
            whole = join(piece, at_pole(piece, rigid_arm(arm)), count).beam
            if len(at) == k:
                own = whole
                continue
            for field, longer in zip(own, whole, strict=True):
                field[at] = longer
        return own


def series(beam: UniformBeam, limit: float) -> Array:
    """Coefficients (n, k, 12, 12) of K over [t, e] in powers of lam / limit (theory eq. D4), for beams (k,) of at most
    `SMALL` radians at the limit."""
    k = len(beam.length)
    K = np.zeros((DEGREE + 1, k, 12, 12))
    L = beam.length
    for dofs, EI, shear, rotary in (
        (BENDING_XY, beam.EIz, beam.shear_y, beam.rotary_z),
        (BENDING_XZ, beam.EIy, beam.shear_z, beam.rotary_y),
    ):
        A0, A1 = bending_system(EI, shear, beam.mass, rotary, L)
        unit = np.stack([1 / L, np.ones(k)], axis=-1)
        _place(K, dofs, _condensed(_exponential(A0, limit * A1), unit, EI / L))
    for dofs, stiff, inertia in ((AXIAL, beam.EA, beam.mass), (TORSION, beam.GJ, beam.polar)):
        A0, A1 = bar_system(stiff, inertia, L)
        _place(K, dofs, _condensed(_exponential(A0, limit * A1), np.ones((k, 1)), stiff / L))
    T = np.zeros((k, 12, 12))
    T[:, :6, :6] = np.eye(6)
    T[:, 6:, 6:] = rigid_arm(np.stack([L, 0 * L, 0 * L], axis=-1))
    K = np.swapaxes(T, -1, -2) @ K @ T
    return (K + np.swapaxes(K, -1, -2)) / 2


def _place(K: Array, dofs: tuple[tuple[int, float], ...], own: Array) -> None:
    """Put the matrices over (r, d) of some freedoms in place, with their signs."""
    at = np.array([*(k for k, _ in dofs), *(6 + k for k, _ in dofs)])
    sign = np.array([s for _, s in dofs] * 2)
    K[..., at[:, None], at] = own * sign[:, None] * sign


def _exponential(A0: Array, A1: Array) -> Array:
    """Coefficients (n, k, m, m) of exp(A0 + x A1) in powers of x."""
    term = np.zeros((DEGREE + 1, *A0.shape))
    term[0] = np.eye(A0.shape[-1])
    total = term.copy()
    for k in range(1, TERMS):
        more = A0 @ term
        more[1:] += A1 @ term[:-1]
        term = more / k
        total += term
    return total


def _condensed(phi: Array, unit: Array, energy: Array) -> Array:
    """Series of K over (r, d) from that of the transfer matrix, in the units of the displacements and of K."""
    n = phi.shape[-1] // 2
    u, q = slice(None, n), slice(n, None)
    R = np.swapaxes(phi[0][..., u, u], -1, -2)
    first = np.linalg.inv(phi[0][..., u, q])
    F = np.zeros_like(phi[..., u, q])
    F[0] = first
    for k in range(1, len(F)):
        F[k] = -first @ (phi[1 : k + 1, ..., u, q] @ F[k - 1 :: -1]).sum(axis=0)
    own = phi.copy()
    own[0][..., q, u] = own[0][..., u, u] = 0.0
    change = phi[..., q, q].copy()
    change[0] = 0.0
    bF = _product(R @ change, F)
    K = np.zeros((len(phi), *phi.shape[1:]))
    K[..., u, u] = R @ own[..., q, u] - _product(bF, own[..., u, u])
    K[..., u, q] = bF
    K[..., q, u] = np.swapaxes(bF, -1, -2)
    K[..., q, q] = _product(phi[..., q, q], F)
    units = np.concatenate([unit, unit], axis=-1)
    return K * (energy[:, None, None] * units[:, :, None] * units[:, None, :])


def _product(a: Array, b: Array) -> Array:
    """Product of two series of matrices."""
    out = np.zeros((len(a), *a.shape[1:-1], b.shape[-1]))
    for k in range(len(a)):
        out[k] = (a[: k + 1] @ b[k::-1]).sum(axis=0)
    return out
