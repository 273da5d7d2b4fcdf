"""What a time response reaches: motion, stress and force over its steps against their limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexura.analysis.limits import States, command_limits, force_limits, merged, motion_limits, stress_limits
from flexura.analysis.responses.meshes import response_meshes
from flexura.analysis.responses.recurrences import Hold, motion
from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.reduction import stored_flexibility
from flexura.structure import FullOrderModel
from flexura.systems import UNDAMPED, ModalSystem, Ports, SecondOrder, input_loads
from flexura.tables import in_hz, quantity

BLOCK = 10_000_000
"""Modal coordinates that are held at a time."""

DRIVEN = 100.0
"""Amplitude over static amplitude from which an undamped frequency, proven to 1e-4, is off by 1 % of a response."""

REACHED = 1e-9
"""Share of the largest force on a mode from which an input drives it."""

STATES = 256
"""States of a full-order model that are looked at together."""


LOWEST = 6
"""So many of the lowest modes are looked at for what meshes leave uncertain: high ones hardly move."""


@dataclass(frozen=True)
class Run:
    """What a time response follows from: `modes`, viscously damped, from a state `eta`, `rate` (r,), and `hold`.

    `plain` are these modes without residual ones, `impulses` and `start` (m,) what the state follows from.
    """

    modes: ModalSystem
    hold: Hold
    eta: Array
    rate: Array
    plain: ModalSystem
    impulses: Array
    start: Array

    def warnings(self, time: Array, u: Array) -> tuple[Diagnostic, ...]:
        """Limits that are exceeded at some time (N,) under inputs u (m, N).

        The motion of everything is that of the modes, and what stiffer ones follow statically.
        """
        modes, system = self.modes, self.modes.system
        shapes = modes.shapes if isinstance(system.model, FullOrderModel) else system.model.recover(modes.shapes)
        at_rest = modes.B / (modes.omega**2 + system.full_flexibility.shift)[:, None]
        columns = np.hstack([shapes, _left_out(system, shapes, at_rest)])
        found = _merged(system, columns, ((eta, own) for eta, own in self._blocks(time, u)), time, u)
        lowest = float(self.plain.frequency_hz[:LOWEST].max(initial=0.0))
        return (*found, *driven_limits(self.plain, time, u), *response_meshes(system, self.plain, lowest))

    def _blocks(self, time: Array, u: Array) -> Iterator[tuple[Array, slice]]:
        """Modal coordinates (r, k) block by block, and the samples that they are of."""
        step, eta, rate = max(BLOCK // max(self.modes.order, 1), 2), self.eta, self.rate
        dt, count = time[1] - time[0], len(time)
        for first in range(0, count - 1, step):
            own = slice(first, min(first + step, count - 1) + 1)
            last = own.stop == count
            q, v = motion(self.modes, u[:, own], dt, self.hold, eta, rate, {0} if last else {0, 1})
            assert q is not None
            yield q, own
            if v is not None:
                eta, rate = q[:, -1], v[:, -1]


def driven_limits(modes: ModalSystem, time: Array, u: Array) -> tuple[Diagnostic, ...]:
    """Resonances that nothing damps, and that inputs u (m, N) drive to more than 100 times their static amplitude.

    The amplitude of an undamped mode is that of the integral of u e^(-i omega t); it is off by the error of omega times
    as much, and in truth something damps it.
    """
    dt, worst = float(time[1] - time[0]), (DRIVEN, 0.0, 0)
    for r in np.flatnonzero((modes.total_ratios < UNDAMPED) & (modes.omega > 0)):
        w, reached = float(modes.omega[r]), np.abs(modes.B[r]) > REACHED * np.abs(modes.B[r]).max()
        turn = np.exp(-1j * w * time)
        for j in np.flatnonzero(reached & u.any(axis=1)):
            gain = float(w * dt * np.abs(np.cumsum(u[j] * turn)).max() / np.abs(u[j]).max())
            worst = max(worst, (gain, w / (2 * np.pi), int(j)))
    gain, hz, j = worst
    if not hz:
        return ()
    name = modes.inputs[j].name
    text = (
        f"{name} drives the resonance at {in_hz(hz)}, which nothing damps, to {gain:.3g} times its static amplitude: it"
        " grows as long as it is driven; give some damping"
    )
    return (Diagnostic("resonance", name, gain, DRIVEN, "1", text),)


def integrated_warnings(system: SecondOrder, q: Array, time: Array, u: Array) -> tuple[Diagnostic, ...]:
    """Limits that coordinates q (n, N) of a system exceed at some time (N,) under inputs u (m, N)."""
    if not isinstance(system.model, FullOrderModel):
        shapes = system.model.recover(np.eye(system.order))
        gain = stored_flexibility(system.K, system.M, system.full_flexibility.shift)(system.B)
        columns = np.hstack([shapes, _left_out(system, shapes, gain)])
        return (*_merged(system, columns, [(q, slice(0, len(time)))], time, u), *response_meshes(system))
    blocks = ((q[:, k : k + STATES], slice(k, min(k + STATES, len(time)))) for k in range(0, len(time), STATES))
    return (*_merged(system, None, blocks, time, u), *response_meshes(system))


def _left_out(system: SecondOrder, shapes: Array, gain: Array) -> Array:
    """Static displacement (n, m) per input that shapes (n, r), of static gain (r, m), lack."""
    full = system.full_order
    if not system.inputs:
        return np.zeros((full.order, 0))
    return system.full_flexibility(input_loads(system)) - shapes @ gain


def _merged(
    system: SecondOrder, columns: Array | None, blocks: object, time: Array, u: Array
) -> tuple[Diagnostic, ...]:
    full, names = system.full_order, [c.name for c in system.inputs]
    ports = Ports(full.design)
    at_rest = np.zeros((full.order, 1 if columns is None else 0))
    if full.plan.is_loaded and not full.plan.is_posed:
        # what is described as loaded moves about its displaced state
        at_rest = system.full_flexibility(full.dead_load[:, None])
    found = list(command_limits(system.input_ports, u, lambda k: _at(time[k])))
    for q, own in blocks:  # type: ignore[attr-defined]

        def when(k: int, first: int = own.start) -> str:
            return _at(time[first + k])

        if columns is None:
            states = States(full, q + at_rest, None, when)
        else:
            amplitudes = np.vstack([q, u[:, own], np.ones((at_rest.shape[1], q.shape[1]))])
            states = States(full, np.hstack([columns, at_rest]), amplitudes, when)
        found += force_limits(states, ports, dict(zip(names, u[:, own], strict=True)))
        found += [*motion_limits(states), *stress_limits(states)]
    return merged(found)


def _at(t: float) -> str:
    return f" at {quantity(t, 's', 4)}"
