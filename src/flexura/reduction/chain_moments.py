"""What a serial chain of elements contributes to low frequencies, with a bound on all that it leaves out.

With both ends of a chain held, its interior answers forces by a flexibility G, and forces of inertia M u drive it. For
motions u = Psi b + U a, constraint modes Psi of the ends and kept interior motions U, the rest of the interior adds to
the dynamic stiffness K - lambda M of the coordinates (b, a) the term -lambda^2 R and higher ones, where

    R = [Psi, U]' M (G - U (U' K U)^-1 U') M [Psi, U]

is the energy of the interior under those forces (theory eqs. N1-N3). All of it follows from running sums of
flexibilities and of wrenches at one pole: no interior matrix is assembled, factorised or solved, and no digits cancel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import as_strided

from flexura.arrays import Array, Index
from flexura.kernels import Kernel, address, is_compiled, packed, scratch
from flexura.linalg import EPS, Eigenpairs, inverse_roots, lowest
from flexura.reduction.pole_frame import PoleFrame, Strips, summed
from flexura.structure import Elements

ELEMENT_TERMS = 64.0
"""Largest sum of |X^-1| |C| |X^-T| over the diagonal of X^-1 C X^-T for the flexibility C of a beam element, six terms
whose correlation is that of a cantilever's end deflection and slope, sqrt(3)/2 or less: 6 / (1 - 0.87) and some."""


STRIP_ROUNDING = 1e-9
"""Relative error of what strips lower."""

_compiled = Kernel("chain_moments", "aaaaaaaaaaaaaaa")


@dataclass(frozen=True)
class ChainMoments:
    """Matrices of each chain (..., c, ...) in its coordinates: twist of the first end and relative twist of the ends at
    the pole, then kept motions a (k,) of the interior.

    A (3, ..., c, 12 + k, 12 + k) are K, M and R. `slowness`, s^2/rad^2, is at least 1/mu, mu the lowest squared
    frequency of the motions left out. `loss` bounds the relative error in energy that round-off has left in the
    stiffness against relative twists and in the constraint modes.
    """

    A: Array
    slowness: Array
    loss: Array


def _flat(A: Array) -> Array:
    """(..., e, r, k) as (..., e r, k)."""
    return A.reshape(*A.shape[:-3], A.shape[-3] * A.shape[-2], A.shape[-1])


def _inverted(total: Array) -> Array:
    k = np.asarray(np.linalg.inv(total), dtype=np.float64)
    return (k + k.mT) / 2


def stiffness_and_mass(frame: PoleFrame, table: Elements) -> Array:
    """K and M (2, designs, c, 12, 12) of chains by constraint modes alone, in the coordinates of `ChainMoments`."""
    if not _has_kernel(table):
        return _stiffness_and_mass(frame, table)
    found, missing = _by_kernel(frame, table, np.zeros((*frame.elements.shape, 12, 0)), 2)
    if missing:
        lost = np.isnan(found.slowness)
        found.A[:, lost] = _stiffness_and_mass(frame, table)[:, lost]
    return found.A


def _stiffness_and_mass(frame: PoleFrame, table: Elements) -> Array:
    """The same in NumPy."""
    F = frame.flexibilities(table)
    running = summed(frame.before, F)
    k = _inverted(running[..., -1, :, :])
    V = _motions(running, k, 0)
    A = np.zeros((2, *k.shape[:-2], 12, 12))
    A[0, ..., 6:, 6:] = k
    np.matmul(_flat(V[..., 1:-1, :, :]).mT, _flat(_loads(frame.masses(table), V)), out=A[1])
    return A


def moments(frame: PoleFrame, table: Elements, forces: Array) -> ChainMoments:
    """Moments of the chains of a group, designs along the leading axis (theory eqs. N3-N5).

    The kept motions are the static response of the interior to `forces` (c, e, 12, k), N and N m, at the ends of the
    elements in their axes. Raises LinAlgError when a flexibility is singular.
    """
    strips = list(frame.strips(table))
    if strips or not _has_kernel(table):
        return _moments(frame, table, forces, strips)
    found, missing = _by_kernel(frame, table, forces, 3)
    if missing:
        lost, own = np.isnan(found.slowness), _moments(frame, table, forces, strips)
        found.A[:, lost], found.slowness[lost], found.loss[lost] = own.A[:, lost], own.slowness[lost], own.loss[lost]
    return found


def _moments(frame: PoleFrame, table: Elements, forces: Array, strips: list[Strips]) -> ChainMoments:
    """The same in NumPy."""
    F = frame.flexibilities(table)
    running = summed(frame.before, F)
    total, Ft, kept = running[..., -1, :, :], _flat(F).mT, forces.shape[-1]
    k = _inverted(total)
    V = _motions(running, k, kept)
    bent = stretched = np.zeros((*F.shape[:-1], 0))
    k_modes = np.zeros((*k.shape[:-2], 0, 0))
    if kept:
        # closed again, since what is left of the other end's displacement would strain the stiffest element
        bent = _closed(_closed(frame.internal(forces), Ft, k), Ft, k)
        stretched = _stretched(F, bent, strips)
        k_modes = _flat(bent).mT @ _flat(stretched)
        V[..., 2:-2, :, 12:] = summed(frame.before, stretched)[..., :-1, :, :]
    band = frame.masses(table)
    loads = _loads(band, V)
    M = _flat(V[..., 1:-1, :, :]).mT @ _flat(loads)
    loss = _loss(total, k, F.shape[-3])
    slowness = _trace(band, running, M, loss) - _twisted_together(band, strips, loss.shape)
    W = _closed(summed(frame.beyond, loads[..., 1:-1, :, :]), Ft, k)
    if kept:
        c = np.linalg.solve(k_modes, _flat(stretched).mT @ _flat(W))
        W = W - bent @ c[..., None, :, :]
        slowness = slowness - np.einsum("...ii->...", np.linalg.solve(k_modes, M[..., 12:, 12:]))
        slowness = slowness + 64 * kept * EPS * np.einsum("...ii->...", np.linalg.solve(k_modes, M[..., 12:, 12:]))
    A = np.zeros((3, *M.shape))
    A[0, ..., 6:12, 6:12], A[0, ..., 12:, 12:], A[1] = k, k_modes, M
    np.matmul(_flat(W).mT, _flat(_stretched(F, W, strips)), out=A[2])
    return ChainMoments(A, slowness, loss)


def _has_kernel(table: Elements) -> bool:
    """Whether chains of elements, without strips, are worked out by the kernel: not those with elastic roots."""
    return is_compiled() and not len(table.rooted)


def _by_kernel(frame: PoleFrame, table: Elements, forces: Array, matrices: int) -> tuple[ChainMoments, int]:
    """The moments by the kernel, so many of K, M and R, and of how many chains they are missing, whose flexibility is
    not positive and whose slowness is no number."""
    own = [np.ascontiguousarray(one) for one in (table.flexibility_coefficients, table.mass_coefficients)]
    varies = not frame.is_fixed and len(frame.Xd) > 1
    designs = len(frame.Xd) if varies else max(len(one) for one in own)
    (c, e), kept = frame.elements.shape, forces.shape[-1]
    n = 12 + kept
    bases = [_Basis.of(basis) for basis in (table.flexibility_basis, table.mass_basis)]
    sizes = []
    for coefficients, basis in zip(own, bases, strict=True):
        _, elements, k = coefficients.shape
        sizes += [k, basis.entries, elements * k if len(coefficients) > 1 else 0]
    sizes += [c * e * 144 if varies else 0, designs, c, e, kept, matrices]
    room = scratch(36 * (2 * e + 2) + 12 * (e + 1) * (n + kept) + 6 * n * n + 24 * n)
    A = np.empty((matrices, designs, c, n, n))
    slowness, loss = np.zeros((2, designs, c))
    missing = _compiled(
        own[0],
        *bases[0].at,
        own[1],
        *bases[1].at,
        *frame.at,
        np.ascontiguousarray(forces),
        packed(*sizes),
        room,
        A,
        slowness,
        loss,
    )
    return ChainMoments(A, slowness, loss), missing


class _Basis:
    """Entries of a basis (k, n) that are not zero, kept with it: their number, and where values and places are."""

    def __init__(self, basis: Array) -> None:
        self.basis = basis
        self._places: Index = np.ascontiguousarray(np.argwhere(basis), dtype=np.int64)
        self._values: Array = basis[*self._places.T]
        self.entries: int = len(self._values)
        self.at: tuple[int, int] = address(self._values), address(self._places)

    @staticmethod
    def of(basis: Array) -> _Basis:
        """Of a basis, found once."""
        found = _BASES.get(id(basis))
        if found is None:
            found = _BASES[id(basis)] = _Basis(basis)
        return found


_BASES = dict[int, _Basis]()
"""By the identity of bases, which are kept."""


def _stretched(F: Array, W: Array, strips: Sequence[Strips]) -> Array:
    """Relative twists (..., c, e, 6, k) of the elements of chains with flexibilities F under wrenches W, which elements
    of strips share."""
    out = F @ W
    for chain, e, S, axis in strips:
        torque = (axis[..., None, :] @ W[..., chain, e, :, :])[..., 0, :]
        out[..., chain, e, :, :] -= axis[..., None] * (S @ torque)[..., None, :]
    return out


def _twisted_together(band: Array, strips: Sequence[Strips], lead: tuple[int, ...]) -> Array:
    """By how much coupled strips lower the sum of 1/omega^2 (..., c): moments about the strip at its inner nodes,
    which are steps of its torque, against the inertia there."""
    less = np.zeros(lead)
    for chain, e, S, axis in strips:
        n = e.shape[1]
        steps = np.tri(n, n - 1, -1)
        D = steps.T @ S @ steps
        inner, p = e[:, :-1] + 1, axis[..., :-1, :, None]
        rows = np.swapaxes(p, -1, -2) @ band[..., chain, inner, :, :]
        own, after = ((rows[..., part] @ p)[..., 0, 0] for part in (slice(6, 12), slice(12, 18)))
        trace = (np.einsum("...ii->...i", D) * own).sum(axis=-1)
        trace = trace + 2 * (np.einsum("...ii->...i", D[..., :-1, 1:]) * after[..., :-1]).sum(axis=-1)
        for strip, c in enumerate(chain[:, 0]):
            less[..., c] += (1 - STRIP_ROUNDING) * trace[..., strip]
    return less


def _motions(running: Array, k: Array, kept: int) -> Array:
    """Twists (..., e + 3, 6, 12 + kept) of the nodes of a chain, with one more before and after, for unit twists of the
    first end and relative twists of the ends; room for kept motions."""
    *lead, e, _, _ = running.shape
    V = np.zeros((*lead, e + 3, 6, 12 + kept))
    V[..., 1:-1, :, :6] = V[..., -2, :, 6:12] = np.eye(6)
    inner = running[..., :-1, :, :].reshape(*lead, 6 * (e - 1), 6) @ k
    V[..., 2:-2, :, 6:12] = inner.reshape(*lead, e - 1, 6, 6)
    return V


def _loads(band: Array, V: Array) -> Array:
    """Mass times motions, (..., e + 1, 6, n), from the `masses` of a chain and motions (..., e + 3, 6, n)."""
    n = V.shape[-1]
    shape = (*V.shape[:-3], V.shape[-3] - 2, 18, n)
    return np.asarray(band @ as_strided(V, shape, V.strides, writeable=False))


def _closed(W: Array, Ft: Array, k: Array) -> Array:
    """Wrenches of a chain held at both ends from those W of one held at its first end: the redundant wrench k d at the
    other end takes the displacement d back. The energy of any wrenches in equilibrium is at least the true one, so that
    an error in k d makes R no smaller."""
    return W - (k @ (Ft @ _flat(W)))[..., None, :, :]


def _trace(band: Array, running: Array, M: Array, loss: Array) -> Array:
    """Sum of 1/omega^2 over all motions of the interior, ends held, from above: that of the chain held at its first end
    less what its other end takes back (theory eq. N5)."""
    diagonal, after = band[..., 1:, :, 6:12], band[..., 1:, :, 12:]
    free = np.einsum("...eij,...eij->...", running, diagonal) + 2 * np.einsum("...eij,...eij->...", running, after)
    total, held = running[..., -1, :, :], M[..., 6:12, 6:12]
    size = np.einsum("...eii,...eii->...", running, diagonal) + np.einsum("...ii,...ii->...", total, held)
    taken_back = np.einsum("...ij,...ij->...", total, held)
    return np.asarray(free - taken_back + 6 * (3 * (running.shape[-3] + 64) * EPS + loss) * size)


def _loss(total: Array, k: Array, count: int) -> Array:
    """Bound on the relative error of k in energy (theory eq. N9): round-off in the sum, and in its inverse."""
    diagonal = np.einsum("...ii->...i", total)
    spread = np.einsum("...i,...ii->...", diagonal, k)
    d = inverse_roots(diagonal)
    error = (total @ k - np.eye(6)) * (d[..., :, None] / d[..., None, :])
    inverse = np.sqrt(spread * np.einsum("...ij,...ij->...", error, error)) + 16 * EPS * spread
    return 6 * ELEMENT_TERMS * (count + 16) * EPS / 2 * spread + inverse


def interior_modes(frame: PoleFrame, table: Elements, count: int) -> Array:
    """Forces (c, e, 12, count) of inertia of the lowest fixed-interface modes of each chain of one design, in a stack
    by itself, scaled to unit strain energy, at the ends of the elements in their axes: what `moments` asks for."""
    F = frame.flexibilities(table)[0]
    M = (frame.taken(table.mass_coefficients) @ table.mass_basis)[0].reshape(*F.shape[:2], 12, 12)
    mass = frame.Xt @ M @ frame.Xd
    length = F.shape[1]
    inertia_forces = []
    for stiffness, inertia, local, Xd in zip(_together(F, frame.strips(table)), mass, M, frame.Xd, strict=True):
        pairs = _modes(stiffness, inertia, min(count, 6 * (length - 1)))
        n = int(np.isfinite(pairs.values).sum())
        moved = np.zeros((length + 1, 6, n))
        moved[1:-1] = pairs.vectors[:, :n].reshape(length - 1, 6, n)
        inertia_forces.append(
            local @ (Xd @ np.concatenate([moved[:-1], moved[1:]], axis=1)) * np.sqrt(pairs.values[:n])
        )
    least = min(forces.shape[-1] for forces in inertia_forces)
    return np.stack([forces[..., :least] for forces in inertia_forces])


def _together(F: Array, strips: Iterator[Strips]) -> Array:
    """Stiffness (c, 6e, 6e) of all elements of chains (c, e, 6, 6) together against their relative twists, one
    design."""
    c, e = F.shape[:2]
    whole = np.zeros((c, e, 6, e, 6))
    whole[:, np.arange(e), :, np.arange(e)] = np.moveaxis(np.linalg.inv(F), 1, 0)
    for chain, at, *one in strips:
        S, axis = (each.reshape(each.shape[-3:]) for each in one)
        q, n = at.shape
        soft = -np.einsum("qer,qef,qfs->qerfs", axis, S, axis)
        soft[:, np.arange(n), :, np.arange(n)] += np.moveaxis(F[chain, at], 1, 0)
        stiff = np.linalg.inv(soft.reshape(q, 6 * n, 6 * n)).reshape(soft.shape)
        whole[chain[..., None], at[:, :, None], :, at[:, None, :]] = np.moveaxis(stiff, 2, 3)
    return whole.reshape(c, 6 * e, 6 * e)


def _modes(k: Array, mass: Array, count: int) -> Eigenpairs:
    """Lowest modes of a chain of elements with stiffness k (6e, 6e) against their relative twists, mass (e, 12, 12) at
    the pole, both ends held."""
    n = len(k) - 6
    M = np.zeros((n + 12, n + 12))
    for e, inertia in enumerate(mass):
        at = slice(6 * e, 6 * e + 12)
        M[at, at] += inertia
    k = k[:, :n] - k[:, 6:]
    K = k[:n] - k[6:]
    return lowest((K + K.T) / 2, M[6:-6, 6:-6], count)
