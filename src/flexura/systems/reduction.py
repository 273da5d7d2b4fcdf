"""State space of a modal system: modal truncation with the static gain kept and the rest bounded, and balancing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexura.errors import OptionError
from flexura.structure import FullOrderModel
from flexura.systems.balancing import balance
from flexura.systems.modal import ModalSystem, modal_system
from flexura.systems.state_space import StateSpace
from flexura.systems.system import System

Array = NDArray[np.float64]


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
    notes = (f"{r} modes of the {_kind(modes)} model of order {modes.system.order}, static gain kept", *_range(modes))
    full = StateSpace(A, B, C, D, modes.inputs, modes.outputs, states, None, delay, modes.system.name, notes)
    return full if balanced is None else balance(full, balanced)


def _kind(modes: ModalSystem) -> str:
    return "full-order" if isinstance(modes.system.model, FullOrderModel) else "low-order"


def _range(modes: ModalSystem) -> list[str]:
    """Where the state space holds: below the first mode left out, and within the ranges of what drives it."""
    said = (
        [f"modes from {modes.next_omega / (2 * np.pi):.5g} Hz on are left out"] if np.isfinite(modes.next_omega) else []
    )
    ranges = [
        f"{channel.name} {low:.5g} to {high:.5g} {channel.unit}"
        for channel, (low, high) in zip(modes.inputs, modes.system.limits, strict=True)
        if np.isfinite(low) and np.isfinite(high)
    ]
    return said + ([f"inputs hold within {', '.join(ranges)}"] if ranges else [])
