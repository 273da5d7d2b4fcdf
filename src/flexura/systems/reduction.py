"""State space of a modal system: modal truncation with the static gain kept and the rest bounded, and balancing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.structure import FullOrderModel
from flexura.systems.balancing import balance
from flexura.systems.band import UNDAMPED, proof_limits
from flexura.systems.bounds import neglected
from flexura.systems.modal import ModalSystem, modal_system
from flexura.systems.residual_modes import with_residual_modes
from flexura.systems.state_space import StateSpace
from flexura.systems.system import System
from flexura.tables import in_hz


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
) -> StateSpace:
    """Continuous state space in modal coordinates: displacement and velocity of each mode, in turn.

    Keeps the `n` lowest modes, those up to `up_to` Hz, or all of a finished modal system; the static gain of
    displacements is that of the whole (theory eq. T8). With `residual_modes` that of velocities, accelerations and
    dashpots is as well, by one more mode for each of them that is an input (theory eq. T29). `balanced` then truncates
    a balanced realisation to so many states, or, below one, until twice the sum of the Hankel singular values left out
    is so much of the largest (Moore 1981; theory eq. T19), the static gain kept (Fernando and Nicholson 1982).
    Structural damping becomes viscous as in time response. `delay`, s, is a dead time of all inputs.

    The result has a bound on what it lacks over the `band` (from, to), Hz, that it is for, by default up to the highest
    mode kept, and a warning where that is more than 1 % of the largest response of a channel (theory eq. T28).

    Raises OptionError for impossible numbers, and for balancing what is not asymptotically stable.
    """
    if not (np.isfinite(delay) and delay >= 0):
        raise OptionError(f"a delay is a time in s that is not negative, not {delay}")
    modes = modal_system(system, n, up_to) if isinstance(system, System) else system
    if isinstance(system, ModalSystem) and (n is not None or up_to is not None):
        raise OptionError("n and up_to belong to a System; a modal system has its modes already")
    kept = with_residual_modes(modes) if residual_modes else modes
    model = _first_order(kept.viscous(), delay, (_origin(modes, kept), *_range(modes)))
    if balanced is not None:
        model = balance(model, balanced)
    lost = neglected(modes, model, band)
    if lost is None:
        return model
    known = (*lost.warnings, *proof_limits(modes.system, lost.band[1]))
    first, *others = model.notes
    return replace(model, neglected=lost, notes=(first, lost.text, *others), warnings=(*model.warnings, *known))


def _first_order(modes: ModalSystem, delay: float, notes: tuple[str, ...]) -> StateSpace:
    """Displacement and velocity of each viscously damped mode as states."""
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
    of = modes.system
    return StateSpace(A, B, C, D, modes.inputs, modes.outputs, states, None, delay, of.name, notes, model=of.model)


def _origin(modes: ModalSystem, kept: ModalSystem) -> str:
    """Which modes of which model these are."""
    more = kept.order - modes.order
    residual = f" and {more} residual mode{'s' if more > 1 else ''}" if more else ""
    whole = f"{_kind(modes)} model of order {modes.system.order}"
    return f"{modes.order} modes{residual} of the {whole}, static gain kept"


def _kind(modes: ModalSystem) -> str:
    return "full-order" if isinstance(modes.system.model, FullOrderModel) else "low-order"


def _range(modes: ModalSystem) -> list[str]:
    """Where a state space holds: below the first mode left out, and within the ranges of what drives it."""
    said = (
        [f"modes from {in_hz(modes.next_omega / (2 * np.pi))} on are left out"] if np.isfinite(modes.next_omega) else []
    )
    ranges = [
        f"{channel.name} {low:.5g} to {high:.5g} {channel.unit}"
        for channel, (low, high) in zip(modes.inputs, modes.system.limits, strict=True)
        if np.isfinite(low) and np.isfinite(high)
    ]
    bare = modes.frequency_hz[(modes.total_ratios < UNDAMPED) & (modes.omega > 0)]
    if len(bare):
        said.append(f"nothing damps {len(bare)} of the modes, the lowest at {in_hz(bare[0])}: its poles do not decay")
    return said + ([f"inputs hold within {', '.join(ranges)}"] if ranges else [])
