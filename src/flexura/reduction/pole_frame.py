"""Serial chains of elements in twists at one pole for each, of one geometry or of many."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from flexura.arrays import Array, Index
from flexura.beam import PLANE_BASIS
from flexura.kernels import address
from flexura.structure import Elements

FRAME_AXES = 4
"""Axes of the maps of chains whose geometry is the same in all designs."""


class Strips(NamedTuple):
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

    def strips(self, table: Elements) -> Iterator[Strips]:
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
                yield Strips(chain, e, S[..., own, order[:, :, None], order[:, None, :]], axis)

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
        return summed(self.beyond, wrenches[..., :-1, 6:, :] + wrenches[..., 1:, :6, :])


def _contracted(coefficients: Array, basis: Array) -> Array:
    """Coefficients (designs, ..., k) times the basis (..., k, n) of each: (designs, ..., n), by products of matrices
    over the designs."""
    products = np.empty((*coefficients.shape[:-1], basis.shape[-1]))
    np.matmul(np.moveaxis(coefficients, 0, -2), basis, out=np.moveaxis(products, 0, -2))
    return products


def summed(sums: Array, A: Array) -> Array:
    """Sums (n, m) over the axis m of A (..., m, r, k): (..., n, r, k)."""
    m, r, k = A.shape[-3:]
    return np.asarray((sums @ A.reshape(*A.shape[:-3], m, r * k)).reshape(*A.shape[:-3], len(sums), r, k))
