"""State space of a modal system: modal truncation with the static gain kept and the rest bounded, and balancing.

Residual modes: what the modes left out do under static loads, as further modes. Balanced truncation of a stable state
space: gramians from its poles, and a reduction that stays stable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg as la

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs
from flexura.structure import FullOrderModel
from flexura.systems.left_out import UNDAMPED, neglected, proof_limits
from flexura.systems.modal import ModalSystem, in_modes, modal_system
from flexura.systems.second_order import dashpot_columns, symmetric
from flexura.systems.state_space import DEPENDENT_POLES, StateSpace, rounded_up
from flexura.systems.system import System
from flexura.systems.tuning import Tuning, ports_of_modes
from flexura.tables import in_hz

HANKEL_ROUNDING = 1e-13
"""Round-off of Hankel singular values beside the largest, for eigenvectors of condition one."""

LYAPUNOV_ROUNDING = 1e-7
"""The same where eigenvectors are all but dependent and gramians are solved as they are: half of the digits."""

BALANCED_MARGIN = 4.0
"""How many times the round-off that is expected, or found at the poles, the bound allows for."""

CARRIED_ENERGY = 1e-10
"""Share of the static energy of an input that modes left out must carry for it to have a residual mode."""

INDEPENDENT_ENERGY = 1e-8
"""Share of its energy by which a residual vector must differ from the others."""


@dataclass(frozen=True)
class _Hankel:
    """Factors P = L L', Q = R R' of both gramians, the decomposition R'L = U diag(sigma) W', and the relative size of
    sigma below which it is round-off."""

    L: Array
    R: Array
    U: Array
    sigma: Array
    W: Array
    rounding: float


def balance(model: StateSpace, keep: int | float) -> StateSpace:
    """Truncated balanced realisation with the static gain kept; see `state_space`.

    The square-root method with orthonormal bases (Varga 1991, Proc. 30th CDC, 1062; theory eq. T19). States at the
    level of round-off are never kept, and what comes out is stable. Its notes hold the error bound, round-off included,
    and say where fewer states are kept than were asked for.
    """
    if isinstance(keep, bool) or not ((isinstance(keep, int | np.integer) and keep >= 1) or 0 < keep < 1):
        raise OptionError(f"balanced is a number of states, or a share of the largest singular value, not {keep}")
    even, (d, _) = la.matrix_balance(model.A, permute=False, separate=True)
    even_model = replace(model, A=even, B=model.B / d[:, None], C=model.C * d)
    poles = la.eigvals(even)
    if poles.real.max(initial=-1.0) >= 0:
        raise OptionError("balancing needs a model in which everything is damped and nothing floats")
    hankel = _hankel(even_model, float(np.exp(np.log(np.abs(poles)).mean())) if len(poles) else 1.0)
    sigma = hankel.sigma
    usable = int((sigma > hankel.rounding * sigma.max(initial=0.0)).sum())
    requested = min(int(keep), model.order) if isinstance(keep, int | np.integer) else _enough(sigma, keep)
    n = min(requested, usable)
    whole = _realised(even_model, hankel, n, usable)
    small = _static_kept(whole, n)
    while n and la.eigvals(small.A).real.max() >= 0:
        n -= 1  # equal singular values on both sides of the cut leave a pole on the axis, to round-off
        small = _static_kept(_realised(even_model, hankel, n, usable), n)
    gain = model.static_gain()
    small = replace(small, D=gain + (small.C @ np.linalg.solve(small.A, small.B) if n else 0.0))
    tail = 2 * float(sigma[n:].sum())
    plain = 1e-15 * float(np.linalg.norm(gain) + np.linalg.norm(model.D))
    expected = hankel.rounding * model.order * sigma.max(initial=0.0) + plain
    rounding = BALANCED_MARGIN * max(expected, _beyond(model, small, tail))
    bound = rounded_up(tail + rounding)
    note = f"balanced truncation to {n} states: error at most {bound} at any frequency, in the units of the gains"
    if n < requested:
        note += f"; of {requested} states asked for the others are round-off"
    names = tuple(f"balanced {k + 1}" for k in range(n))
    return replace(small, state_names=names, notes=(*model.notes, note), tuning=None)


def _beyond(model: StateSpace, small: StateSpace, tail: float) -> float:
    """By how much round-off takes two models further apart at their poles than truncation can: where damping is light
    beside the range of frequencies, the digits of a dense A do not carry its slowest poles."""
    poles = np.concatenate([model.poles(), small.poles()])
    hz = np.unique(np.concatenate([[0.0], np.abs(poles.imag), np.abs(poles)])) / (2 * np.pi)
    plain = (replace(m, delay=0.0).frequency_response(hz) for m in (model, small))
    apart = np.linalg.norm(np.subtract(*plain), 2, axis=(1, 2)) if model.D.size else np.zeros(1)
    return max(float(apart.max()) - tail, 0.0)


def _enough(sigma: Array, share: float) -> int:
    """States after which twice the sum of the rest is at most a share of the largest singular value."""
    tails = 2 * np.append(np.cumsum(sigma[::-1])[::-1], 0.0)
    return max(int(np.argmax(tails <= share * sigma.max(initial=0.0))), 1)


def _hankel(model: StateSpace, rate: float) -> _Hankel:
    """Hankel singular values of a balanced model, time being scaled by `rate`, 1/s."""
    A, B, C = model.A / rate, model.B / rate, model.C
    size_in, size_out = (float(np.linalg.norm(X)) or 1.0 for X in (B, C))
    B, C = B / size_in, C / size_out
    found = np.linalg.eig(A) if len(A) else (np.zeros(0), np.zeros((0, 0)))
    poles: Complex = found[0].astype(complex)
    V: Complex = found[1].astype(complex)
    spread = float(np.linalg.cond(V)) if len(A) else 1.0
    if spread < DEPENDENT_POLES:
        inverse: Complex = np.asarray(np.linalg.inv(V), dtype=complex)
        L = V @ _cauchy_factor(poles, inverse @ B)
        R = inverse.conj().T @ _cauchy_factor(poles.conj(), (C @ V).conj().T)
        left, right = (np.hstack([X.real, X.imag]) for X in (L, R))
        rounding = HANKEL_ROUNDING * spread
    else:
        left, right = (
            _root(la.solve_continuous_lyapunov(A, -B @ B.T)),
            _root(la.solve_continuous_lyapunov(A.T, -C.T @ C)),
        )
        rounding = LYAPUNOV_ROUNDING
    U, sigma, Wt = la.svd(right.T @ left)
    n = model.order
    return _Hankel(left, right, U[:, :n], sigma[:n] * size_in * size_out, Wt[:n].T, rounding)


def _cauchy_factor(poles: Complex, B: Complex) -> Complex:
    """Factor L (n, n) of the gramian P = L L* of z' = poles z + B u, P_ij = -b_i b_j*/(p_i + p_j*).

    Elimination of this Cauchy-like matrix with complete pivoting works on the generators B alone, so that small pivots
    keep their digits (Gohberg, Kailath and Olshevsky 1995, Math. Comput. 64, 1557).
    """
    n = len(poles)
    L: Complex = np.zeros((n, n), dtype=complex)
    left = B.astype(complex)
    for k in range(n):
        pivots = (np.abs(left) ** 2).sum(axis=1) / (-2 * poles.real)
        i = int(pivots.argmax())
        if not pivots[i] > 0:
            break
        column = -(left @ left[i].conj()) / (poles + poles[i].conj())
        L[:, k] = column / np.sqrt(pivots[i])
        left = left - np.outer(column / pivots[i], left[i])
        left[i] = 0.0
    return L


def _root(P: Any) -> Array:
    """A factor L (n, n) of a positive semidefinite P = L L'."""
    values, vectors = la.eigh((P + P.T) / 2)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _realised(model: StateSpace, hankel: _Hankel, n: int, usable: int) -> StateSpace:
    """The minimal part of a model, of which the first n states span those of the n largest singular values."""
    T, S = np.zeros((model.order, usable)), np.zeros((usable, model.order))
    for states in (slice(0, n), slice(n, usable)):
        if states.stop > states.start:
            scale = 1 / np.sqrt(hankel.sigma[states])
            right = np.linalg.qr(hankel.L @ (hankel.W[:, states] * scale))[0]
            left = np.linalg.qr(hankel.R @ (hankel.U[:, states] * scale))[0]
            T[:, states], S[states] = right, np.linalg.solve(left.T @ right, left.T)
    return replace(model, A=S @ model.A @ T, B=S @ model.B, C=model.C @ T)


def _static_kept(model: StateSpace, n: int) -> StateSpace:
    """States beyond the first n follow those at once (singular perturbation), so that the static gain stays."""
    A11, A12, A21, A22 = model.A[:n, :n], model.A[:n, n:], model.A[n:, :n], model.A[n:, n:]
    if not A22.size:
        return model
    X, Y = np.linalg.solve(A22, A21), np.linalg.solve(A22, model.B[n:])
    C1, C2 = model.C[:, :n], model.C[:, n:]
    return replace(model, A=A11 - A12 @ X, B=model.B[:n] - A12 @ Y, C=C1 - C2 @ X, D=model.D - C2 @ Y)


@verb
def state_space(
    system: System | ModalSystem,
    *,
    n: int | None = None,
    up_to: float | None = None,
    residual_modes: bool = False,
    balanced: int | float | None = None,
    band: tuple[float, float] | None = None,
    delay: float = 0.0,
    payloads: Sequence[str] = (),
) -> StateSpace:
    """Continuous state space in modal coordinates: displacement and velocity of each mode, in turn.

    Keeps the `n` lowest modes, those up to `up_to` Hz, or all of a finished modal system; the static gain of
    displacements is that of the whole (theory eq. T8). With `residual_modes` that of velocities, accelerations and
    dashpots is as well, by one more mode for each of them that is an input (theory eq. T29). `balanced` then truncates
    a balanced realisation to so many states, or, below one, until twice the sum of the Hankel singular values left out
    is so much of the largest (Moore 1981; theory eq. T19), the static gain kept (Fernando and Nicholson 1982).
    Structural damping becomes viscous as in time response. `delay`, s, is a dead time of all inputs. Nodes named in
    `payloads` can be given a mass later, where the model is exported to (theory eq. X18).

    The result has a bound on what it lacks over the `band` (from, to), Hz, that it is for, by default up to the highest
    mode kept, and a warning where that is more than 1 % of the largest response of a channel (theory eq. T28).

    Raises OptionError for impossible numbers, and for balancing what is not asymptotically stable.
    """
    if not (np.isfinite(delay) and delay >= 0):
        raise OptionError(f"a delay is a time in s that is not negative, not {delay}")
    if balanced is not None and payloads:
        raise OptionError("payloads act on modes, of which a balanced model has none")
    modes = modal_system(system, n, up_to) if isinstance(system, System) else system
    if isinstance(system, ModalSystem) and (n is not None or up_to is not None):
        raise OptionError("n and up_to belong to a System; a modal system has its modes already")
    kept = with_residual_modes(modes) if residual_modes else modes
    model = first_order(kept.viscous(), delay, (_origin(modes, kept), *_range(modes), *_loaded(payloads)), payloads)
    if balanced is not None:
        model = balance(model, balanced)
    lost = neglected(modes, model, band)
    if lost is None:
        return model
    known = (*lost.warnings, *proof_limits(modes.system, lost.band[1]))
    first, *others = model.notes
    return replace(model, neglected=lost, notes=(first, lost.text, *others), warnings=(*model.warnings, *known))


def first_order(modes: ModalSystem, delay: float, notes: tuple[str, ...], payloads: Sequence[str] = ()) -> StateSpace:
    """Displacement and velocity of each viscously damped mode as states, with parameters of modes and payloads."""
    r, m, p = modes.order, len(modes.inputs), len(modes.outputs)
    ports = ports_of_modes(modes, payloads)
    k = len(ports.slope)
    rows, derivative = np.vstack([ports.forces.T, modes.C]), np.concatenate([ports.derivative, modes.derivative])
    A = np.zeros((2 * r, 2 * r))
    A[0::2, 1::2] = np.eye(r)
    A[1::2, 0::2], A[1::2, 1::2] = -np.diag(modes.omega**2), -modes.damping
    B = np.zeros((2 * r, m + k))
    B[1::2] = np.hstack([ports.forces, modes.B])
    C, D = np.zeros((p + k, 2 * r)), np.zeros((p + k, m + k))
    D[k:, k:] = modes.D + np.where(modes.derivative == 0, 1.0, 0.0)[:, None] * modes.residual
    C[derivative == 0, 0::2], C[derivative == 1, 1::2] = rows[derivative == 0], rows[derivative == 1]
    moved = derivative == 2
    C[moved, 0::2], C[moved, 1::2] = -rows[moved] * modes.omega**2, -rows[moved] @ modes.damping
    D[moved] += rows[moved] @ B[1::2]
    nothing = np.zeros((0, 0))
    tuning, (B, C, D) = Tuning(*ports[:3], *(nothing,) * 6).parted(A, B, C, D)
    states = tuple(f"mode {j + 1} {word}" for j in range(r) for word in ("displacement", "velocity"))
    return StateSpace(
        A, B, C, D, modes.inputs, modes.outputs, states, None, delay, modes.system.name, notes,
        model=modes.system.model, tuning=tuning,
    )  # fmt: skip


def _origin(modes: ModalSystem, kept: ModalSystem) -> str:
    """Which modes of which model these are."""
    more = kept.order - modes.order
    residual = f" and {more} residual mode{'s' if more > 1 else ''}" if more else ""
    whole = f"{_kind(modes)} model of order {modes.system.order}"
    return f"{modes.order} modes{residual} of the {whole}, static gain kept"


def _loaded(payloads: Sequence[str]) -> list[str]:
    """What holds of masses that are added later."""
    names = ", ".join(payloads)
    text = "a payload moves the modes kept alone: frequencies come out high, least with residual modes for forces there"
    return [f"{names}: {text}"] if payloads else []


def _kind(modes: ModalSystem) -> str:
    return "full-order" if isinstance(modes.system.model, FullOrderModel) else "low-order"


def _range(modes: ModalSystem) -> list[str]:
    """Where a state space holds: below the first mode left out, and within the ranges of what drives it."""
    notes = (
        [f"modes from {in_hz(modes.next_omega / (2 * np.pi))} on are left out"] if np.isfinite(modes.next_omega) else []
    )
    ranges = [
        f"{channel.name} {low:.5g} to {high:.5g} {channel.unit}"
        for channel, (low, high) in zip(modes.inputs, modes.system.limits, strict=True)
        if np.isfinite(low) and np.isfinite(high)
    ]
    bare = modes.frequency_hz[(modes.total_ratios < UNDAMPED) & (modes.omega > 0)]
    if len(bare):
        notes.append(f"nothing damps {len(bare)} of the modes, the lowest at {in_hz(bare[0])}: its poles do not decay")
    return notes + ([f"inputs hold within {', '.join(ranges)}"] if ranges else [])


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
    kept = energy > CARRIED_ENERGY * whole
    X = X[:, kept] / np.sqrt(energy[kept])
    stiff, turn = la.eigh(symmetric(X.T @ (system.K @ X)))
    kept = stiff > INDEPENDENT_ENERGY
    X = X @ (turn[:, kept] / np.sqrt(stiff[kept]))
    flexible, turn = la.eigh(symmetric(X.T @ (system.M @ X)))
    kept = flexible > 0
    omega = 1 / np.sqrt(flexible[kept][::-1])
    return np.asarray((X @ turn[:, kept])[:, ::-1] * omega), omega
