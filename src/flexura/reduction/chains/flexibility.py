"""Static responses of a model to loads, with the digits that soft supports beside stiff members would cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import factorise, is_definite, least_pivot, scaled, static_response, unit_scale
from flexura.reduction.chains.chained import ChainedModel, chained
from flexura.structure import FullOrderModel

WELL = 1e-8
"""A pivot of the diagonally scaled stiffness above this costs no digit that matters."""

LOST = 1e-7
"""Work that round-off in the stored stiffness may do, over that of the loads, from which it is done without; what is
lost in truth is some 30 times less."""

NEAR_ZERO = 1e-3
"""Shift of something that floats, over the lowest diagonal ratio of stiffness to mass."""

DISPLACED = 1e-4
"""Root of the work of loads about a pose, relative, that may be lost: displacements there are nodal, and keep as many
digits as these have."""

EPS = float(np.finfo(float).eps)

FREE = "something can move freely under the load: hold it, or attach it by a stiffness"


@dataclass(frozen=True)
class Flexibility:
    """(K + shift M)^-1 of a model: displacements (n, k) for loads (n, k).

    `shift`, (rad/s)^2, is zero for something that is held, else a small squared frequency (theory eq. T9).
    """

    shift: float
    solve: Callable[[Array], Array]

    def __call__(self, loads: Array) -> Array:
        return self.solve(loads)

    def held(self, loads: Array) -> Array:
        """K^-1 loads. Raises SolverError when something can move freely."""
        if self.shift:
            raise SolverError(FREE)
        return self.solve(loads)


def stored_flexibility(K: Any, M: Any, shift: float | None = None) -> Flexibility:
    """That of matrices (n, n) as they are stored; with the shift that they need unless it is given."""
    if shift is None:
        shift = 0.0 if is_definite(K) else _near_zero(K, M)
    A = K + shift * M if shift else K
    if not isinstance(A, np.ndarray):
        return Flexibility(shift, factorise(A).solve)
    d = unit_scale(A)
    factor = la.cho_factor(scaled(A, d))
    return Flexibility(shift, lambda loads: d[:, None] * la.cho_solve(factor, d[:, None] * loads))


def flexibility(model: FullOrderModel) -> Flexibility:
    """That of a full-order model: where K as it is stored would lose digits, in relative coordinates and by energies.

    Digits are lost where a soft direction is held by stiff members only (a small pivot), and where many short elements
    bend as one: their K u is a small difference of large forces. That is seen once displacements are known.

    Raises SolverError where even those are lost.
    """
    if least_pivot(model.K) <= WELL:
        return _by_energies(model)
    stored = stored_flexibility(model.K, model.M, 0.0)

    def solve(loads: Array) -> Array:
        moved = stored(loads)
        return moved if lost_work(model.K, moved, loads) <= LOST else _by_energies(model)(loads)

    return Flexibility(0.0, solve)


def _by_energies(model: FullOrderModel) -> Flexibility:
    """That in relative coordinates, of something that may float."""
    own = chained(model)
    if model.design.posed is not None:  # stable, which has been looked at
        return Flexibility(0.0, lambda loads: static_response(own.pencil, loads, settled=DISPLACED))
    shift = 0.0 if _is_held(own) else _near_zero(model.K, model.M)
    if shift and least_pivot(model.K + shift * model.M) > WELL:
        return stored_flexibility(model.K, model.M, shift)
    return Flexibility(shift, lambda loads: own.recover(static_response(own.pencil, own.forces(loads), shift)))


def lost_work(K: Any, moved: Array, loads: Array) -> float:
    """The most that round-off in K (n, n) as it is stored changes the work of loads (n, k) on their displacements,
    relative."""
    size = np.abs(moved)
    lost = EPS * np.einsum("ik,ik->k", size, abs(K) @ size)
    work = np.abs(np.einsum("ik,ik->k", moved, loads))
    return float(np.divide(lost, work, out=np.where(lost > 0, np.inf, 0.0), where=work > 0).max(initial=0.0))


def _is_held(own: ChainedModel) -> bool:
    """True when no rigid motion is free, and a response to loads on everything comes to stand."""
    if own.free_motions:
        return False
    try:
        static_response(own.pencil, np.sqrt(np.maximum(own.pencil.K.diagonal(), 0.0))[:, None])
    except SolverError:
        return False
    return True


def _near_zero(K: Any, M: Any) -> float:
    k, m = K.diagonal(), M.diagonal()
    ratio = k[(m > 0) & (k > 0)] / m[(m > 0) & (k > 0)]
    return NEAR_ZERO * float(ratio.min()) if len(ratio) else 1.0
