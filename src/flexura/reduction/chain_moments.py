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
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import PLANE_BASIS
from flexura.kernels import Kernel, address, is_compiled, packed, scratch
from flexura.linalg import EPS, Eigenpairs, inverse_roots, lowest
from flexura.structure import Elements

ELEMENT_TERMS = 64.0
"""Largest sum of |X^-1| |C| |X^-T| over the diagonal of X^-1 C X^-T for the flexibility C of a beam element, six terms
whose correlation is that of a cantilever's end deflection and slope, sqrt(3)/2 or less: 6 / (1 - 0.87) and some."""


STRIP_ROUNDING = 1e-9
"""Relative error of what strips lower."""

FRAME_AXES = 4
"""Axes of the maps of chains whose geometry is the same in all designs."""

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


class _Strips(NamedTuple):
    """Strips (q,) in the chains of a frame: their chain (q, 1) and elements there (q, n), ascending; what couples
    these, S (..., q, n, n) as of `Coupling`; and `axis` (..., q, n, 6), with torque = axis . wrench at the pole."""

    chain: Index
    elements: Index
    S: Array
    axis: Array


class PoleFrame:
    """Chains (c, e) of elements, numbered in one table of all elements, in twists at one pole for each.

    `Xd` (..., c, e, 12, 12) takes twists of an element's ends i and j to their displacements in its own axes,
    `Xj_inverse` is the inverse of its lower half, and `reverse` (c, e) says which elements are walked from j to i.
    Where no geometry varies, flexibilities and masses are products of the elements' coefficients with bases that are
    worked out once.
    """

    def __init__(self, elements: Index, reverse: NDArray[np.bool_], Xd: Array, Xj_inverse: Array) -> None:
        self.elements = elements
        self.Xj_inverse = Xj_inverse
        flat = elements.ravel()
        consecutive = np.array_equal(flat, np.arange(flat[0], flat[0] + len(flat)))
        self._own: slice | Index = slice(int(flat[0]), int(flat[0]) + len(flat)) if consecutive else flat
        self.Xd: Array = np.where(reverse[:, :, None, None], np.roll(Xd, 6, axis=-1), Xd) if reverse.any() else Xd
        self.Xt: Array = self.Xd.mT
        self._kept = (
            np.ascontiguousarray(elements, dtype=np.int64),
            np.ascontiguousarray(reverse, dtype=np.int64),
            np.ascontiguousarray(self.Xd),
        )
        self.at: list[int] = [address(one) for one in self._kept]
        """Where elements, whether these are turned, and X are, for kernels."""
        e = elements.shape[1]
        self.before: Array = np.tri(e)
        """Sums (e, e) over an element and those before it."""
        self.beyond: Array = np.triu(np.ones((e, e - 1)))
        """Sums (e, e - 1) over the interior nodes beyond an element."""
        self._mass_bases: tuple[int, Array] | None = None
        self._flexibility_bases: tuple[int, Array] | None = None
        self._root_basis: Array | None = None
        self._strips: list[tuple[Index, Index, Index]] | None = None

    @property
    def is_fixed(self) -> bool:
        """Whether the geometry is the same in all designs."""
        return self.Xd.ndim == FRAME_AXES

    def taken(self, table: Array) -> Array:
        """Rows (..., c, e, k) of a table (..., elements, k)."""
        rows = table[..., self._own, :] if isinstance(self._own, slice) else np.take(table, self._own, axis=-2)
        return rows.reshape(*table.shape[:-2], *self.elements.shape, table.shape[-1])

    def strips(self, table: Elements) -> Iterator[_Strips]:
        """What couples the elements of strips in these chains."""
        if self._strips is None:
            place = np.full(int(self.elements.max(initial=0)) + 1, -1)
            place[self.elements] = np.arange(self.elements.size).reshape(self.elements.shape)
            self._strips = []
            for elements, _ in table.couplings:
                known = elements.max(axis=1) < len(place)
                own = np.flatnonzero(known)[(place[elements[known]] >= 0).all(axis=1)]
                at = place[elements[own]]
                order = np.argsort(at, axis=1)
                self._strips.append((own[:, None, None], order, np.take_along_axis(at, order, axis=1)))
        for (own, order, at), (_, S) in zip(self._strips, table.couplings, strict=True):
            if len(own):
                chain, e = at[:, :1] // self.elements.shape[1], at % self.elements.shape[1]
                axis = self.Xj_inverse[..., 3][..., chain, e, :]
                yield _Strips(chain, e, S[..., own, order[:, :, None], order[:, None, :]], axis)

    def _flexibility_basis(self, basis: Array) -> Array:
        """(c, e, k, 36) from that of an element in its own axes (k, 36)."""
        if self._flexibility_bases is None or self._flexibility_bases[0] != len(basis):
            inverse = self.Xj_inverse[..., None, :, :]
            turned = inverse @ basis.reshape(-1, 6, 6) @ inverse.mT
            self._flexibility_bases = len(basis), turned.reshape(*self.elements.shape, -1, 36)
        return self._flexibility_bases[1]

    def flexibilities(self, table: Elements) -> Array:
        """Flexibility (..., c, e, 6, 6) of every element at the pole."""
        coefficients = self.taken(table.flexibility_coefficients)
        if self.is_fixed:
            flexibility = _contracted(coefficients, self._flexibility_basis(table.flexibility_basis))
            return flexibility.reshape(*flexibility.shape[:-1], 6, 6)
        C = (coefficients @ table.flexibility_basis).reshape(*coefficients.shape[:-1], 6, 6)
        return np.asarray(self.Xj_inverse @ C @ self.Xj_inverse.mT)

    def masses(self, table: Elements) -> Array:
        """Mass (..., c, e + 1, 6, 18) at the pole of every node of the chains, with the node before, itself and the
        one after."""
        coefficients = self.taken(table.mass_coefficients)
        *lead, c, e, k = coefficients.shape
        if not self.is_fixed:
            M = (coefficients @ table.mass_basis).reshape(*lead, c, e, 12, 12)
            m = self.Xt @ self._with_roots(M, table) @ self.Xd
            band = np.zeros((*m.shape[:-4], c, e + 1, 6, 18))
            band[..., 1:, :, :12] = m[..., 6:, :]
            band[..., :-1, :, 6:] += m[..., :6, :]
            return band
        if self._mass_bases is None or self._mass_bases[0] != k:
            self._mass_bases = k, self._mass_basis(table.mass_basis)
        padded = np.zeros((*lead, c, (e + 2) * k))
        padded[..., k:-k] = coefficients.reshape(*lead, c, e * k)
        pairs = as_strided(padded, (*lead, c, e + 1, 2 * k), (*padded.strides[:-1], 8 * k, 8), writeable=False)
        mass = _contracted(pairs, self._mass_bases[1])
        return self._with_roots(mass.reshape(*lead, c, e + 1, 6, 18), table)

    def _with_roots(self, A: Array, table: Elements) -> Array:
        """The `masses` with what elastic roots change of them; of a frame that is not fixed those of the elements
        (..., c, e, 12, 12) in their own axes."""
        c, e = np.nonzero(np.isin(self.elements, table.rooted))
        if not len(c):
            return A
        changes = table.root_mass[..., np.searchsorted(table.rooted, self.elements[c, e]), :]
        if not self.is_fixed:
            m = changes @ PLANE_BASIS
        else:
            if self._root_basis is None:
                turned = self.Xt[c, e, None] @ PLANE_BASIS.reshape(-1, 12, 12) @ self.Xd[c, e, None]
                self._root_basis = turned.reshape(len(c), 72, 144)
            m = _contracted(changes.reshape(-1, len(c), 72), self._root_basis)
        m = m.reshape(*changes.shape[:-1], 12, 12)
        if m.ndim > A.ndim - 1:
            A = np.broadcast_to(A, (*m.shape[:-3], *A.shape[-4:])).copy()
        if not self.is_fixed:
            A[..., c, e, :, :] += m
        else:
            A[..., c, e + 1, :, :12] += m[..., 6:, :]
            A[..., c, e, :, 6:] += m[..., :6, :]
        return A

    def _mass_basis(self, basis: Array) -> Array:
        """(c, e + 1, 2 k, 108) from that of an element in its own axes (k, 144)."""
        m = self.Xt[..., None, :, :] @ basis.reshape(-1, 12, 12) @ self.Xd[..., None, :, :]
        c, e, k, _, _ = m.shape
        bases = np.zeros((c, e + 1, 2, k, 6, 18))
        bases[:, 1:, 0, :, :, :12] = m[..., 6:, :]
        bases[:, :-1, 1, :, :, 6:] = m[..., :6, :]
        return bases.reshape(c, e + 1, 2 * k, 108)

    def internal(self, forces: Array) -> Array:
        """Wrenches (..., c, e, 6, k) in the elements of the chain, clamped at its first end and free at the other,
        under forces (c, e, 12, k) on the ends i, j of its elements in their axes, at its interior nodes."""
        wrenches = self.Xt @ forces
        return _summed(self.beyond, wrenches[..., :-1, 6:, :] + wrenches[..., 1:, :6, :])


def _contracted(coefficients: Array, basis: Array) -> Array:
    """Coefficients (designs, ..., k) times the basis (..., k, n) of each: (designs, ..., n), by products of matrices
    over the designs."""
    products = np.empty((*coefficients.shape[:-1], basis.shape[-1]))
    np.matmul(np.moveaxis(coefficients, 0, -2), basis, out=np.moveaxis(products, 0, -2))
    return products


def _summed(sums: Array, A: Array) -> Array:
    """Sums (n, m) over the axis m of A (..., m, r, k): (..., n, r, k)."""
    m, r, k = A.shape[-3:]
    return np.asarray((sums @ A.reshape(*A.shape[:-3], m, r * k)).reshape(*A.shape[:-3], len(sums), r, k))


def _flat(A: Array) -> Array:
    """(..., e, r, k) as (..., e r, k)."""
    return A.reshape(*A.shape[:-3], A.shape[-3] * A.shape[-2], A.shape[-1])


def _inverted(total: Array) -> Array:
    k = np.asarray(np.linalg.inv(total), dtype=np.float64)
    return (k + k.mT) / 2


def stiffness_and_mass(frame: PoleFrame, table: Elements) -> Array:
    """K and M (2, designs, c, 12, 12) of chains by constraint modes alone, in the coordinates of `ChainMoments`."""
    if found := _by_kernel(frame, table, np.zeros((*frame.elements.shape, 12, 0)), 2):
        return found.A
    F = frame.flexibilities(table)
    running = _summed(frame.before, F)
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
    if not strips and (found := _by_kernel(frame, table, forces, 3)):
        return found
    F = frame.flexibilities(table)
    running = _summed(frame.before, F)
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
        V[..., 2:-2, :, 12:] = _summed(frame.before, stretched)[..., :-1, :, :]
    band = frame.masses(table)
    loads = _loads(band, V)
    M = _flat(V[..., 1:-1, :, :]).mT @ _flat(loads)
    loss = _loss(total, k, F.shape[-3])
    slowness = _trace(band, running, M, loss) - _twisted_together(band, strips, loss.shape)
    W = _closed(_summed(frame.beyond, loads[..., 1:-1, :, :]), Ft, k)
    if kept:
        c = np.linalg.solve(k_modes, _flat(stretched).mT @ _flat(W))
        W = W - bent @ c[..., None, :, :]
        slowness = slowness - np.einsum("...ii->...", np.linalg.solve(k_modes, M[..., 12:, 12:]))
        slowness = slowness + 64 * kept * EPS * np.einsum("...ii->...", np.linalg.solve(k_modes, M[..., 12:, 12:]))
    A = np.zeros((3, *M.shape))
    A[0, ..., 6:12, 6:12], A[0, ..., 12:, 12:], A[1] = k, k_modes, M
    np.matmul(_flat(W).mT, _flat(_stretched(F, W, strips)), out=A[2])
    return ChainMoments(A, slowness, loss)


def _by_kernel(frame: PoleFrame, table: Elements, forces: Array, matrices: int) -> ChainMoments | None:
    """The same without strips, of so many of the matrices K, M and R; None where it has to be done in NumPy: without a
    library, with elastic roots, or where a flexibility is not positive."""
    if not is_compiled() or len(table.rooted):
        return None
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
    slowness, loss = np.empty((2, designs, c))
    bad = _compiled(
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
    return None if bad else ChainMoments(A, slowness, loss)


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


def _stretched(F: Array, W: Array, strips: Sequence[_Strips]) -> Array:
    """Relative twists (..., c, e, 6, k) of the elements of chains with flexibilities F under wrenches W, which elements
    of strips share."""
    out = F @ W
    for chain, e, S, axis in strips:
        torque = (axis[..., None, :] @ W[..., chain, e, :, :])[..., 0, :]
        out[..., chain, e, :, :] -= axis[..., None] * (S @ torque)[..., None, :]
    return out


def _twisted_together(band: Array, strips: Sequence[_Strips], lead: tuple[int, ...]) -> Array:
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


def _together(F: Array, strips: Iterator[_Strips]) -> Array:
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
