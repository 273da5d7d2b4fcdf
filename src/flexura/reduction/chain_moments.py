"""What a serial chain of elements contributes to low frequencies, with a bound on all that it leaves out.

With both ends of a chain held, its interior answers forces by a flexibility G, and forces of inertia M u drive it. For
motions u = Psi b + U a, constraint modes Psi of the ends and kept interior motions U, the rest of the interior adds to
the dynamic stiffness K - lambda M of the coordinates (b, a) the term -lambda^2 R and higher ones, where

    R = [Psi, U]' M (G - U (U' K U)^-1 U') M [Psi, U]

is the energy of the interior under those forces (theory eqs. N1-N3). All of it follows from running sums of
flexibilities and of wrenches at one pole: no interior matrix is assembled, factorised or solved, and no digits cancel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.linalg import Eigenpairs, inverse_roots, lowest
from flexura.reduction.chain import ChainGroup, ChainKinematics, taken
from flexura.structure import Elements, ElementSlice

Array = NDArray[np.float64]

EPS = float(np.finfo(float).eps)

ELEMENT_TERMS = 64.0
"""Largest sum of |X^-1| |C| |X^-T| over the diagonal of X^-1 C X^-T for the flexibility C of a beam element, six terms
whose correlation is that of a cantilever's end deflection and slope, sqrt(3)/2 or less: 6 / (1 - 0.87) and some."""


@dataclass(frozen=True)
class ChainMoments:
    """Matrices of each chain (..., c, ...) in its coordinates: twist of the first end and relative twist of the ends at
    the pole, then kept motions a (k,) of the interior.

    `k` (6, 6) is the stiffness against the relative twist, `k_modes` (k, k) that of kept motions; M and R (12 + k,
    12 + k). `slowness`, s^2/rad^2, is at least 1/mu, mu the lowest squared frequency of the motions left out. `loss`
    bounds the relative error in energy that round-off has left in k and in the constraint modes.
    """

    k: Array
    k_modes: Array
    M: Array
    R: Array
    slowness: Array
    loss: Array


class PoleFrame:
    """Maps Xd (..., c, e, 12, 12) from the twists of an element's first and second end, in walking order, to the
    displacements of its ends i and j in its own axes."""

    def __init__(self, group: ChainGroup, kin: ChainKinematics) -> None:
        self.kin, self.group = kin, group
        X = kin.X
        self.Xd = np.zeros((*X.shape[:-2], 12, 12))
        i, j = slice(0, 6), slice(6, 12)
        for walked, first, second in ((~group.reverse, i, j), (group.reverse, j, i)):
            self.Xd[..., walked, first, :6] = X[..., walked, first, :]
            self.Xd[..., walked, second, 6:] = X[..., walked, second, :]
        self.Xt = np.ascontiguousarray(np.swapaxes(self.Xd, -1, -2))

    def internal(self, forces: Array) -> Array:
        """Wrenches (..., c, e, 6, k) in the elements of the chain, clamped at its first end and free at the other,
        under forces (c, e, 12, k) on the ends i, j of its elements in their axes, at its interior nodes."""
        return _beyond(self.Xt @ forces)


def _beyond(wrenches: Array) -> Array:
    """Running sums (..., e, 6, k) from the far end of wrenches (..., e, 12, k) at both ends of the elements; those on
    the chain's own ends, which are held, are left out."""
    out = np.zeros((*wrenches.shape[:-2], 6, wrenches.shape[-1]))
    if wrenches.shape[-3] > 1:
        at_nodes = wrenches[..., :-1, 6:, :] + wrenches[..., 1:, :6, :]
        out[..., :-1, :, :] = np.cumsum(at_nodes[..., ::-1, :, :], axis=-3)[..., ::-1, :, :]
    return out


def _flat(A: Array) -> Array:
    """(..., e, r, k) as (..., e r, k)."""
    return A.reshape(*A.shape[:-3], A.shape[-3] * A.shape[-2], A.shape[-1])


def _t(A: Array) -> Array:
    return np.swapaxes(A, -1, -2)


def flexibilities(frame: PoleFrame, elements: Elements | ElementSlice) -> tuple[Array, Array]:
    """Flexibility F (..., c, e, 6, 6) of every element at the pole, and its running sums (..., c, e, 6, 6)."""
    inverse = frame.kin.Xj_inverse
    F = inverse @ taken(elements.C, frame.group.elements, frame.kin.run) @ _t(inverse)
    return F, np.cumsum(F, axis=-3)


def moments(frame: PoleFrame, elements: Elements | ElementSlice, forces: Array) -> ChainMoments:
    """Moments of the chains of a group (theory eqs. N3-N5).

    The kept motions are the static response of the interior to `forces` (c, e, 12, k), N and N m, at the ends of the
    elements in their axes. Raises LinAlgError when a flexibility is singular.
    """
    F, running = flexibilities(frame, elements)
    total = running[..., -1, :, :]
    k = np.asarray(np.linalg.inv(total), dtype=np.float64)
    k = (k + _t(k)) / 2
    m = frame.Xt @ taken(elements.M, frame.group.elements, frame.kin.run) @ frame.Xd
    P = np.zeros((*running.shape[:-3], running.shape[-3] + 1, 6, 6))
    np.matmul(running[..., :-1, :, :], k[..., None, :, :], out=P[..., 1:-1, :, :])
    P[..., -1, :, :] = np.eye(6)
    kept = forces.shape[-1]
    E = np.empty((*m.shape[:-1], 12 + kept))
    E[..., :6, :6] = E[..., 6:, :6] = np.eye(6)
    E[..., :6, 6:12], E[..., 6:, 6:12] = P[..., :-1, :, :], P[..., 1:, :, :]
    Ft = _t(_flat(F))
    bent, k_modes = np.zeros((*F.shape[:-1], 0)), np.zeros((*k.shape[:-2], 0, 0))
    if kept:
        bent = _closed(frame.internal(forces), Ft, k)
        stretched = F @ bent
        k_modes = _t(_flat(bent)) @ _flat(stretched)
        moved = np.cumsum(stretched, axis=-3)
        moved[..., -1, :, :] = 0.0
        E[..., 6:, 12:], E[..., 0, :6, 12:] = moved, 0.0
        E[..., 1:, :6, 12:] = moved[..., :-1, :, :]
    loads = m @ E
    M = _t(_flat(E)) @ _flat(loads)
    slowness = _trace(m, F, running, P)
    W = _closed(_beyond(loads), Ft, k)
    if kept:
        c = np.linalg.solve(k_modes, _t(_flat(F @ bent)) @ _flat(W))
        W = W - bent @ c[..., None, :, :]
        slowness = slowness - np.einsum("...ii->...", np.linalg.solve(k_modes, M[..., 12:, 12:]))
        slowness = slowness + 64 * kept * EPS * np.einsum("...ii->...", np.linalg.solve(k_modes, M[..., 12:, 12:]))
    R = _t(_flat(W)) @ _flat(F @ W)
    return ChainMoments(k, k_modes, M, R, slowness, _loss(total, k, F.shape[-3]))


def _closed(W: Array, Ft: Array, k: Array) -> Array:
    """Wrenches of a chain held at both ends from those W of one held at its first end: the redundant wrench k d at the
    other end takes the displacement d back. The energy of any wrenches in equilibrium is at least the true one, so that
    an error in k d makes R no smaller."""
    return W - (k @ (Ft @ _flat(W)))[..., None, :, :]


def _trace(m: Array, F: Array, running: Array, P: Array) -> Array:
    """Sum of 1/omega^2 over all motions of the interior, ends held: tr(G M) element by element (theory eq. N5)."""
    if F.shape[-3] == 1:
        return np.zeros(F.shape[:-3])
    G = running[..., :-1, :, :] - P[..., 1:-1, :, :] @ running[..., :-1, :, :]
    cross = G[..., :-1, :, :] - P[..., 1:-2, :, :] @ F[..., 1:-1, :, :]
    at_nodes = m[..., :-1, 6:, 6:] + m[..., 1:, :6, :6]
    own = np.einsum("...eij,...eij->...", at_nodes, G)
    return own + 2 * np.einsum("...eij,...eij->...", m[..., 1:-1, :6, 6:], cross)


def _loss(total: Array, k: Array, count: int) -> Array:
    """Bound on the relative error of k in energy (theory eq. N9): round-off in the sum, and in its inverse."""
    diagonal = np.einsum("...ii->...i", total)
    spread = np.einsum("...i,...ii->...", diagonal, k)
    d = inverse_roots(diagonal)
    error = (total @ k - np.eye(6)) * (d[..., :, None] / d[..., None, :])
    inverse = np.sqrt(spread * np.einsum("...ij,...ij->...", error, error)) + 16 * EPS * spread
    return 6 * ELEMENT_TERMS * (count + 16) * EPS / 2 * spread + inverse


def interior_modes(frame: PoleFrame, elements: Elements | ElementSlice, count: int) -> Array:
    """Forces (c, e, 12, count) of inertia of the lowest fixed-interface modes of each chain, one design, scaled to unit
    strain energy, at the ends of the elements in their axes: what `moments` asks for."""
    F, _ = flexibilities(frame, elements)
    M = taken(elements.M, frame.group.elements, frame.kin.run)
    mass = frame.Xt @ M @ frame.Xd
    length = F.shape[1]
    found = []
    for own, inertia, local, Xd in zip(F, mass, M, frame.Xd, strict=True):
        pairs = _modes(np.linalg.inv(own), inertia, min(count, 6 * (length - 1)))
        n = int(np.isfinite(pairs.values).sum())
        moved = np.zeros((length + 1, 6, n))
        moved[1:-1] = pairs.vectors[:, :n].reshape(length - 1, 6, n)
        found.append(local @ (Xd @ np.concatenate([moved[:-1], moved[1:]], axis=1)) * np.sqrt(pairs.values[:n]))
    least = min(forces.shape[-1] for forces in found)
    return np.stack([forces[..., :least] for forces in found])


def _modes(k: Array, mass: Array, count: int) -> Eigenpairs:
    """Lowest modes of a chain of elements with stiffness k (e, 6, 6), mass (e, 12, 12) at the pole, both ends held."""
    n = 6 * (len(k) - 1)
    K, M = np.zeros((n + 12, n + 12)), np.zeros((n + 12, n + 12))
    for e, (own, inertia) in enumerate(zip(k, mass, strict=True)):
        at = slice(6 * e, 6 * e + 12)
        K[at, at] += np.block([[own, -own], [-own, own]])
        M[at, at] += inertia
    return lowest(K[6:-6, 6:-6], M[6:-6, 6:-6], count)
