"""Residual modes: what the modes left out do under static loads, as further modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.linalg import Eigenpairs
from flexura.systems.modal import ModalSystem, in_modes
from flexura.systems.remainder import dashpot_columns

CARRIED = 1e-10
"""Share of the static energy of an input that modes left out must carry for it to have a residual mode."""

INDEPENDENT = 1e-8
"""Share of its energy by which a residual vector must differ from the others."""


def with_residual_modes(modes: ModalSystem) -> ModalSystem:
    """The modes with residual ones added, one for each input and dashpot that the modes left out carry a part of.

    The static responses to these loads less what the modes do, orthogonalised with K and M (Dickens, Nakagawa and
    Wittbrodt 1997, Comput. Struct. 62, 985; theory eq. T29): so velocities, accelerations and forces have their static
    part, and the inertia and damping of the modes left out are there to first order. The system itself where none is
    left out. `next_omega` stays.
    """
    if not np.isfinite(modes.next_omega):
        return modes
    Z, omega = _residual_vectors(modes)
    if not len(omega):
        return modes
    values = np.concatenate([modes.omega, omega]) ** 2
    pairs = Eigenpairs(values, np.hstack([modes.shapes, Z]))
    return replace(in_modes(modes.system, pairs, np.inf), next_omega=modes.next_omega)


def _residual_vectors(modes: ModalSystem) -> tuple[Array, Array]:
    """Residual modes Z (n, k), of unit modal mass and ascending, and their frequencies (k,), rad/s."""
    system, V = modes.system, modes.shapes
    W = np.hstack([system.B, dashpot_columns(system.dashpots)])
    shift, X = system.flexibility.shift, system.flexibility(W)
    whole = np.einsum("ij,ij->j", X, W)
    X = X - V @ ((V.T @ W) / (modes.omega**2 + shift)[:, None])
    X = X - V @ (V.T @ (system.M @ X))
    energy = np.einsum("ij,ij->j", X, system.K @ X)
    own = energy > CARRIED * whole
    X = X[:, own] / np.sqrt(energy[own])
    stiff, turn = la.eigh(_symmetric(X.T @ (system.K @ X)))
    own = stiff > INDEPENDENT
    X = X @ (turn[:, own] / np.sqrt(stiff[own]))
    flexible, turn = la.eigh(_symmetric(X.T @ (system.M @ X)))
    own = flexible > 0
    omega = 1 / np.sqrt(flexible[own][::-1])
    return np.asarray((X @ turn[:, own])[:, ::-1] * omega), omega


def _symmetric(A: Array) -> Array:
    return (A + A.T) / 2
