"""What the modes left out of a modal system do: their flexibility, inertia and damping to first order, and a bound on
the rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from flexura.arrays import Array, Complex
from flexura.records import Record
from flexura.systems.second_order import SecondOrder

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, repr=False)
class Remainder(Record):
    """Products W' Y X of columns W = [B, rows', C Phi, H Phi] (n, k) with their static responses X = K^-1 W in the
    modes left out: `stiff` (Y = K), `heavy` (M), `viscous` (C, of dashpots), `lossy` (H), each (k, k).

    `places` are the columns of B, rows, C Phi and H Phi; the last two are empty where damping does not couple modes.
    C Phi are forces of dashpots and H Phi, where loss factors differ, of structural damping on modes that are kept.
    `largest` are the greatest eigenvalues of K^-1 C, s, and of K^-1 H. `whole` (k,) is W' K^-1 W, kept modes included.
    """

    _shown = ("stiff", "largest")

    stiff: Array
    heavy: Array
    viscous: Array
    lossy: Array
    places: tuple[NDArray[np.intp], ...]
    largest: tuple[float, float]
    whole: Array

    @property
    def couples(self) -> bool:
        """True when damping couples modes that are kept to those left out."""
        return bool(len(self.places[2]) or len(self.places[3]))

    def selected(self, inputs: list[int], outputs: list[int]) -> Remainder:
        """With some of the inputs and outputs, by position."""
        B, rows, C, H = self.places
        return replace(self, places=(B[inputs], rows[outputs], C, H))

    def flexibility(self, system: SecondOrder, w: Array, at: Any) -> Complex:
        """W' (s K + A)^-1 W (f, i, j) to first order in A = -(w^2 - i w alpha) M + i w C + i H: stiff/s - W' A W/s^2.

        s = 1 + i (eta + w beta) is one loss factor for everything and Rayleigh damping. `at` are rows and columns.
        """
        i, j = np.ix_(*at)
        w = w[:, None, None]
        s = stiffening(system, w)
        first = (w**2 - 1j * w * system.law.alpha) * self.heavy[i, j]
        first -= 1j * (w * self.viscous[i, j] + np.sign(w) * self.lossy[i, j])
        return np.asarray(self.stiff[i, j] / s + first / s**2, dtype=complex)

    def forces(self, w: Array) -> Complex:
        """What [C Phi, H Phi] are multiplied by for the forces of damping on the modes left out (f, c + h)."""
        counts = [len(self.places[2]), len(self.places[3])]
        return np.asarray(np.repeat(np.stack([1j * w, 1j * np.sign(w)], axis=1), counts, axis=1), dtype=complex)


def stiffening(system: SecondOrder, w: Array, lossy: bool = True) -> Complex:
    """1 + i (eta sgn w + w beta) (f,): what one loss factor and Rayleigh damping multiply the stiffness by."""
    eta = (system.uniform_loss or 0.0) if lossy else 0.0
    return np.asarray(1 + 1j * (eta * np.sign(w) + system.law.beta * w), dtype=complex)


def remainder_of(system: SecondOrder, omega: Array, V: Array) -> Remainder:
    """What the modes of a system beyond the kept ones, `omega` (r,) and V (n, r), do."""
    Cd, H = system.dashpots, None if system.uniform_loss is not None else system.H
    m, p = system.B.shape[1], len(system.rows)
    blocks = [system.B, system.rows.T]
    dashpots = dashpot_columns(Cd)
    blocks.append(np.asarray(Cd @ V) if dashpots.shape[1] else V[:, :0])
    blocks.append(np.asarray(H @ V) if H is not None else V[:, :0])
    W = np.hstack(blocks)
    shift, static = system.flexibility.shift, system.flexibility(np.hstack([W, dashpots]))
    X = static[:, : W.shape[1]]
    whole = np.einsum("ij,ij->j", X, W)
    X = X - V @ ((V.T @ W) / (omega**2 + shift)[:, None])
    X = X - V @ (V.T @ (system.M @ X))
    nothing = np.zeros((W.shape[1],) * 2)
    viscous = _symmetric(X.T @ (Cd @ X)) if dashpots.shape[1] else nothing
    lossy = _symmetric(X.T @ (H @ X)) if H is not None else nothing
    steepest = float(la.eigvalsh(dashpots.T @ static[:, W.shape[1] :])[-1]) if dashpots.shape[1] else 0.0
    ends = np.cumsum([0, m, p, *(b.shape[1] for b in blocks[2:])])
    places = tuple(np.arange(a, b) for a, b in pairwise(ends))
    largest = (max(steepest, 0.0), _largest_loss(system) if H is not None else 0.0)
    return Remainder(
        _symmetric(W.T @ X), _symmetric(X.T @ (system.M @ X)), viscous, lossy, places, largest, np.abs(whole)
    )  # fmt: skip


def _symmetric(A: Array) -> Array:
    return (A + A.T) / 2


def dashpot_columns(C: Any) -> Array:
    """L (n, d) with C = L L', of the damping matrix of dashpots."""
    at = np.flatnonzero(C.diagonal())
    L = np.zeros((C.shape[0], len(at)))
    if not len(at):
        return L
    own = C[np.ix_(at, at)] if isinstance(C, np.ndarray) else C[at][:, at].toarray()
    values, vectors = la.eigh(own)
    keep = values > 1e-15 * values[-1]
    L = np.zeros((C.shape[0], int(keep.sum())))
    L[at] = vectors[:, keep] * np.sqrt(values[keep])
    return L


def _largest_loss(system: SecondOrder) -> float:
    """The greatest loss factor of anything elastic, which bounds the eigenvalues of K^-1 H."""
    model, default = system.model, system.law.loss_factor
    found = [default]
    for part in model.plan.parts.values():
        found += np.ravel(part.table.loss_factors(model.values, default)).tolist()
        found += part.discrete_losses(model.values, default)
    return float(max(found))
