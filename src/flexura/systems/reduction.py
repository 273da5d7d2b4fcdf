"""State space of a modal system: modal truncation with the static gain kept and the rest bounded, and balancing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike, NDArray

from flexura.errors import OptionError, SolverError
from flexura.structure import FullOrderModel
from flexura.systems.modal import ModalSystem, modal_system
from flexura.systems.state_space import StateSpace
from flexura.systems.system import System, floating_shift, static_solution

Array = NDArray[np.float64]

SLACK = 1e-9
"""Relative round-off allowed for in static sums."""


def state_space(
    system: System | ModalSystem,
    n: int | None = None,
    up_to: float | None = None,
    *,
    balanced: int | float | None = None,
    delay: float = 0.0,
) -> StateSpace:
    """Continuous state space in modal coordinates: displacement and velocity of each mode, in turn.

    Keeps the `n` lowest modes, those up to `up_to` Hz, or all of a finished modal system; the static gain of
    displacements is that of the whole (theory eq. T8). `balanced` then truncates a balanced realisation to so many
    states, or, below one, until twice the sum of the Hankel singular values left out is so much of the largest
    (Moore 1981; theory eq. T19), the static gain kept (Fernando and Nicholson 1982). Structural damping becomes viscous
    as in time response. `delay`, s, is a dead time of all inputs.

    Raises OptionError for impossible numbers, and for balancing what is not asymptotically stable.
    """
    if not (np.isfinite(delay) and delay >= 0):
        raise OptionError(f"a delay is a time in s that is not negative, not {delay}")
    modes = modal_system(system, n, up_to) if isinstance(system, System) else system
    if isinstance(system, ModalSystem) and (n is not None or up_to is not None):
        raise OptionError("n and up_to belong to a System; a modal system has its modes already")
    modes = modes.viscous()
    r, m = modes.order, len(modes.inputs)
    A = np.zeros((2 * r, 2 * r))
    A[0::2, 1::2] = np.eye(r)
    A[1::2, 0::2], A[1::2, 1::2] = -np.diag(modes.omega**2), -modes.damping
    B = np.zeros((2 * r, m))
    B[1::2] = modes.B
    C, D = np.zeros((len(modes.outputs), 2 * r)), modes.D.copy()
    for k, order in enumerate(modes.derivative):
        if order == 0:
            C[k, 0::2], D[k] = modes.C[k], D[k] + modes.residual[k]
        elif order == 1:
            C[k, 1::2] = modes.C[k]
        else:
            C[k, 0::2], C[k, 1::2] = -modes.C[k] * modes.omega**2, -modes.C[k] @ modes.damping
            D[k] += modes.C[k] @ modes.B
    states = tuple(f"mode {k + 1} {word}" for k in range(r) for word in ("displacement", "velocity"))
    notes = (f"{r} modes of the {_kind(modes)} model of order {modes.system.order}, static gain kept",)
    full = StateSpace(A, B, C, D, modes.inputs, modes.outputs, states, None, delay, modes.system.name, notes)
    return full if balanced is None else balance(full, balanced)


def _kind(modes: ModalSystem) -> str:
    return "full-order" if isinstance(modes.system.model, FullOrderModel) else "low-order"


def balance(model: StateSpace, keep: int | float) -> StateSpace:
    """Truncated balanced realisation with the static gain kept; see `state_space`. Its notes hold the error bound."""
    if isinstance(keep, bool) or not ((isinstance(keep, int | np.integer) and keep >= 1) or 0 < keep < 1):
        raise OptionError(f"balanced is a number of states, or a share of the largest singular value, not {keep}")
    even, (d, _) = la.matrix_balance(model.A, permute=False, separate=True)
    model = replace(model, A=even, B=model.B / d[:, None], C=model.C * d)
    scale = _time_scale(model.A)
    A, B = model.A / scale, model.B / scale
    if la.eigvals(A).real.max(initial=-1.0) >= 0:
        raise OptionError("balancing needs a model in which everything is damped and nothing floats")
    size_in, size_out = np.linalg.norm(B), np.linalg.norm(model.C)
    P = la.solve_continuous_lyapunov(A, -B @ B.T / size_in**2)
    Q = la.solve_continuous_lyapunov(A.T, -model.C.T @ model.C / size_out**2)
    L, R = _root(P), _root(Q)
    U, sigma, Vt = la.svd(R.T @ L)
    sigma = sigma * size_in * size_out
    if isinstance(keep, int | np.integer):
        n = min(int(keep), model.order)
    else:
        tails = 2 * np.append(np.cumsum(sigma[::-1])[::-1], 0.0)
        n = max(int(np.argmax(tails <= keep * sigma[0])), 1)
    usable = int((sigma > 1e-13 * sigma[0]).sum())
    d = 1 / np.sqrt(sigma[:usable] / (size_in * size_out))
    T, S = L @ Vt[:usable].T * d, (R @ U[:, :usable] * d).T
    whole = replace(model, A=scale * (S @ A @ T), B=scale * (S @ B), C=model.C @ T)
    n = min(n, usable)
    kept = _static_kept(whole, n)
    bound = 2 * float(sigma[n:].sum())
    names = tuple(f"balanced {k + 1}" for k in range(n))
    note = f"balanced truncation to {n} states: error at most {bound:.3g} at any frequency, in the units of the gains"
    return replace(kept, state_names=names, notes=(*model.notes, note))


def _static_kept(model: StateSpace, n: int) -> StateSpace:
    """States beyond the first n follow those at once (singular perturbation), so that the static gain stays."""
    A11, A12, A21, A22 = model.A[:n, :n], model.A[:n, n:], model.A[n:, :n], model.A[n:, n:]
    if not A22.size:
        return model
    X, Y = np.linalg.solve(A22, A21), np.linalg.solve(A22, model.B[n:])
    C1, C2 = model.C[:, :n], model.C[:, n:]
    return replace(model, A=A11 - A12 @ X, B=model.B[:n] - A12 @ Y, C=C1 - C2 @ X, D=model.D - C2 @ Y)


def _time_scale(A: Array) -> float:
    size = np.abs(la.eigvals(A))
    return float(np.exp(np.log(size[size > 0]).mean())) if (size > 0).any() else 1.0


def _root(P: Any) -> Array:
    """A factor L (n, n) of a positive semidefinite P = L L'."""
    values, vectors = la.eigh((P + P.T) / 2)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def neglected_bound(modes: ModalSystem, frequency_hz: ArrayLike) -> Array:
    """Bound (f, p, m) on what modes left out add to displacements beyond their static gain, at frequencies (f,), Hz.

    (w^2 s4 + w (2 zeta s3 + alpha s4 + beta s2) + eta s2)/(1 - (w/w_next)^2), the sums s over all modes left out being
    bounded by Cauchy and Schwarz from two static solutions, without computing one of these modes (theory eq. T18).
    Infinite from the first frequency left out. Raises SolverError for something that floats, and where damping couples
    the modes.
    """
    system, law = modes.system, modes.system.law
    if floating_shift(system.K, system.M):
        raise SolverError("the bound needs a mechanism that is held")
    if not modes.is_proportional:
        raise SolverError("the bound needs damping that does not couple the modes")
    w = 2 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float))[:, None, None]
    if not np.isfinite(modes.next_omega):
        return np.zeros((len(w), len(modes.outputs), len(modes.inputs)))
    out, into = (_left_out(modes, V, Y) for V, Y in ((system.rows.T, modes.C.T), (system.B, modes.B)))
    s4, s3, s2 = (np.sqrt(np.outer(out[i], into[j])) for i, j in ((1, 1), (1, 0), (0, 0)))
    zeta = max([law.ratio, *(ratio for _, ratio in law.bands), *law.ratios])
    eta = 0.0 if system.H is None else float(system.H.diagonal().sum() / system.K.diagonal().sum())
    if modes.loss is None:
        zeta, eta = zeta + eta / 2, 0.0
    above = w**2 * s4 + w * (2 * zeta * s3 + law.alpha * s4 + law.beta * s2) + eta * s2
    with np.errstate(divide="ignore"):
        bound = above / np.abs(1 - (w / modes.next_omega) ** 2)
    return np.where(w < modes.next_omega, bound, np.inf)


def _left_out(modes: ModalSystem, V: Array, in_modes: Array) -> tuple[Array, Array]:
    """Sums of v^2/omega^2 and v^2/omega^4 over the modes left out, for each column v of V (n, k), rounded up.

    They are those of the static solution less its part in the modes kept, (r, k), to which it is made orthogonal.
    """
    system, shapes = modes.system, modes.shapes
    X = static_solution(system.K, system.M, np.ascontiguousarray(V))
    whole = np.einsum("ij,ij->j", X, V)
    X = X - shapes @ (in_modes / modes.omega[:, None] ** 2)
    X = X - shapes @ (shapes.T @ (system.M @ X))
    flexibility, inertia = np.einsum("ij,ij->j", X, V), np.einsum("ij,ij->j", X, system.M @ X)
    return np.maximum(flexibility, 0.0) + SLACK * whole, (1 + SLACK) * np.maximum(inertia, 0.0)
