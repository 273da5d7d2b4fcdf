"""What the modes left out of a modal system do: their flexibility, inertia and damping to first order, and a bound on
the rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.errors import SolverError
from flexura.systems.system import System

if TYPE_CHECKING:
    from flexura.systems.modal import ModalSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SLACK = 1e-9
"""Relative round-off allowed for in static sums."""

CHUNK = 64
"""Frequencies whose matrices are formed at a time."""


@dataclass(frozen=True)
class Remainder:
    """Products W' Y X of columns W = [B, rows', C Phi, H Phi] (n, k) with their static responses X = K^-1 W in the
    modes left out: `stiff` (Y = K), `heavy` (M), `viscous` (C, of dashpots), `lossy` (H), each (k, k).

    `places` are the columns of B, rows, C Phi and H Phi; the last two are empty where damping does not couple modes.
    C Phi are forces of dashpots and H Phi, where loss factors differ, of structural damping on modes that are kept.
    `largest` are the greatest eigenvalues of K^-1 C, s, and of K^-1 H. `whole` (k,) is W' K^-1 W, kept modes included.
    """

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

    def flexibility(self, system: System, w: Array, at: Any) -> Complex:
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


def stiffening(system: System, w: Array, lossy: bool = True) -> Complex:
    """1 + i (eta sgn w + w beta) (f,): what one loss factor and Rayleigh damping multiply the stiffness by."""
    eta = (system.uniform_loss or 0.0) if lossy else 0.0
    return np.asarray(1 + 1j * (eta * np.sign(w) + system.law.beta * w), dtype=complex)


def remainder_of(system: System, omega: Array, V: Array) -> Remainder:
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


def _largest_loss(system: System) -> float:
    """The greatest loss factor of anything elastic, which bounds the eigenvalues of K^-1 H."""
    model, default = system.model, system.law.loss_factor
    found = [default]
    for part in model.plan.parts.values():
        found += np.ravel(part.table.loss_factors(model.values, default)).tolist()
        found += part.lump_losses(model.values, default)
    return float(max(found))


def coupled_response(modes: ModalSystem, w: Array, remainder: Remainder) -> tuple[Complex, Complex, Complex]:
    """Displacements (f, p, m) where damping couples kept modes with those left out, and what loads (f, k, m) and
    readings (f, k, p) the latter get, in multiples of the columns of W (theory eq. T26).

    With Q the damping forces of kept modes on the others and N their flexibility to first order,
    eta = (Z - Q' N Q)^-1 (Phi' B - Q' N B) and y = C eta + N_rows (B - Q eta).
    """
    system, (B, rows, *others) = modes.system, remainder.places
    damped = np.concatenate(others)
    every = np.concatenate([B, rows, damped])
    m, p, r, c, k = len(B), len(rows), modes.order, len(damped), len(every)
    gather = np.tile(np.eye(r), c // r) if r else np.zeros((0, c))
    loss = np.zeros((r, r)) if modes.loss is None else modes.loss
    y: Complex = np.empty((len(w), p, m), dtype=complex)
    load: Complex = np.zeros((len(w), k, m), dtype=complex)
    reading: Complex = np.zeros((len(w), k, p), dtype=complex)
    for start in range(0, len(w), CHUNK):
        own = slice(start, start + CHUNK)
        v = w[own]
        N = remainder.flexibility(system, v, (every, every))
        Z = np.diag(modes.omega**2) - v[:, None, None] ** 2 * np.eye(r)
        Z = Z + 1j * (v[:, None, None] * modes.damping + np.sign(v)[:, None, None] * loss)
        Q = remainder.forces(v)[:, :, None] * gather.T
        QN = np.swapaxes(Q, 1, 2) @ N[:, m + p :]
        Z = Z - QN[:, :, m + p :] @ Q
        sides = np.concatenate(
            [np.broadcast_to(modes.B, (len(v), r, m)), np.broadcast_to(modes.C.T, (len(v), r, p))], 2
        )
        eta = np.linalg.solve(Z, sides - QN[:, :, : m + p])
        left = np.concatenate([np.broadcast_to(np.eye(m + p), (len(v), m + p, m + p)), -Q @ eta], 1)
        load[own], reading[own] = left[:, :, :m], left[:, :, m:]
        y[own] = modes.C @ eta[:, :, :m] + N[:, m : m + p] @ left[:, :, :m]
    return y, load, reading


@verb
def neglected_bound(modes: ModalSystem, frequency_hz: ArrayLike) -> Array:
    """Bound (f, p, m) on the error of displacements of `modes.response` from modes left out, at frequencies (f,), Hz.

    What these modes add beyond first order in w^2 M, w C and H is at most the product of two norms, one of the inputs
    and one of the outputs, over 1 - (w/w_next)^2; no mode that is left out is computed (theory eq. T18). Damping ratios
    of these modes are in the bound and not in the response. Infinite from the first frequency left out. Raises
    SolverError for something that floats.
    """
    system = modes.system
    if system.flexibility.shift:
        raise SolverError("the bound needs a mechanism that is held")
    w = 2 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    shape = (len(w), len(modes.outputs), len(modes.inputs))
    remainder = modes.remainder
    if remainder is None:
        return np.zeros(shape) if not np.isfinite(modes.next_omega) else np.full(shape, np.inf)
    B, rows, *others = remainder.places
    if remainder.couples:
        _, load, reading = coupled_response(modes, w, remainder)
    else:
        m, p = len(B), len(rows)
        both = np.broadcast_to(np.eye(m + p), (len(w), m + p, m + p))
        load, reading = both[:, :, :m], both[:, :, m:]
    every = np.concatenate([B, rows, *others])
    sides = [_norms(modes, remainder, every, T, w) for T in (load, reading)]
    near = 1 - (w / modes.next_omega) ** 2
    second = sides[1][0][:, :, None] * sides[0][0][:, None, :]
    room = near - _spilled(modes, remainder, w)
    law, nearer = system.law, near[:, None, None]
    zeta = max([law.ratio, *(ratio for _, ratio in law.bands), *law.ratios])
    static = sides[1][1][:, :, None] * sides[0][1][:, None, :]
    plain = 2 * zeta * w[:, None, None] * _slow(modes, sides, static) / np.where(nearer > 0, nearer, 1.0) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = second / np.where(room > 0, room, 0.0)[:, None, None] + plain
    rounding = SLACK * np.sqrt(np.outer(remainder.whole[rows], remainder.whole[B]))
    inside = ((w < modes.next_omega) & (room > 0))[:, None, None]
    return np.where(inside, np.where(second > 0, bound, plain) + rounding, np.inf)


def _slow(modes: ModalSystem, sides: list[tuple[Array, ...]], static: Array) -> Array:
    """Bound (f, p, m) on the sum of c b/omega^3 over the modes left out."""
    if modes.remainder is not None and modes.remainder.couples:
        return static / modes.next_omega
    (_, load, load_heavy), (_, reading, reading_heavy) = sides
    one = reading[:, :, None] * load_heavy[:, None, :]
    return np.minimum(one, reading_heavy[:, :, None] * load[:, None, :])


def _norms(modes: ModalSystem, remainder: Remainder, at: Any, T: Any, w: Array) -> tuple[Array, ...]:
    """Of loads W T (f, k, q) on the modes left out: |A K^-1 W T| and |W T| in the norm of K^-1, and |K^-1 W T| in that
    of M, each (f, q)."""
    i = np.ix_(at, at)
    stiff, heavy, viscous, lossy = (
        np.sqrt(np.maximum(np.einsum("fkq,fkq->fq", T.conj(), Y[i] @ T).real, 0.0))
        for Y in (remainder.stiff, remainder.heavy, remainder.viscous, remainder.lossy)
    )
    w = w[:, None]
    steepest, lossiest = remainder.largest
    first = (w**2 + w * modes.system.law.alpha) / modes.next_omega * heavy
    return first + w * np.sqrt(steepest) * viscous + np.sqrt(lossiest) * lossy, stiff, heavy


def _spilled(modes: ModalSystem, remainder: Remainder, w: Array) -> Array:
    """What the kept modes give back (f,) of the error that damping spills to them, as a share of it."""
    found = np.zeros(len(w))
    if not remainder.couples or not modes.order:
        return found
    r, damped = modes.order, np.concatenate(remainder.places[2:])
    i = np.ix_(damped, damped)
    gather = np.tile(np.eye(r), len(damped) // r)
    steepest, lossiest = remainder.largest
    loss = np.zeros((r, r)) if modes.loss is None else modes.loss
    for k, v in enumerate(w):
        size = (v**2 + v * modes.system.law.alpha) ** 2 / modes.next_omega**2 * remainder.heavy[i]
        size = 3 * (size + v**2 * steepest * remainder.viscous[i] + lossiest * remainder.lossy[i])
        q = remainder.forces(np.array([v]))[0].imag
        P = gather @ (q[:, None] * size * q) @ gather.T
        N = remainder.flexibility(modes.system, np.array([v]), (damped, damped))[0]
        Z = np.diag(modes.omega**2 - v**2) + 1j * (v * modes.damping + loss)
        Z = Z + gather @ (q[:, None] * N * q) @ gather.T
        Y = np.linalg.solve(Z, P)
        found[k] = np.sqrt(np.abs(np.einsum("ij,ji->", Y, Y.conj())))
    return found
