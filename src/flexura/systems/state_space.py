"""First-order form with named inputs, outputs and states, continuous or discrete."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError
from flexura.reduction import LowOrderModel
from flexura.results import Result
from flexura.structure import FullOrderModel
from flexura.systems.channel import Channel, ends_of, positions
from flexura.systems.neglected import Neglected
from flexura.tables import Facts, Table, number, quantity

Hold = Literal["zoh", "foh"]

DEPENDENT = 1e5
"""Condition number of the eigenvectors from which a frequency response is solved frequency by frequency."""


@dataclass(frozen=True, repr=False)
class StateSpace(Result):
    """x' = A x + B u, y = C x + D u; or with a step `dt`, s: x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k].

    A (n, n), B (n, m), C (p, n), D (p, m), SI. `inputs` (m) and `outputs` (p) say what u and y are. `delay` is a dead
    time of all inputs, s, that the matrices of a continuous model leave out and those of a discrete one contain.
    `notes` say where the model comes from and what was neglected, and `warnings` where that is not small. `neglected`
    is a bound on what a continuous model lacks in the band that it is for, None where nothing was left out. `model` is
    what it was made from.
    """

    _shown = ("name", "order", "inputs", "outputs", "dt")

    A: Array
    B: Array
    C: Array
    D: Array
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    state_names: tuple[str, ...]
    dt: float | None = None
    delay: float = 0.0
    name: str = "mechanism"
    notes: tuple[str, ...] = field(default=())
    warnings: tuple[Diagnostic, ...] = ()
    neglected: Neglected | None = None
    model: FullOrderModel | LowOrderModel | None = field(default=None, repr=False, compare=False)

    def _view(self) -> Iterator[Facts | Table]:
        poles = self.poles()
        slow = poles[np.argsort(np.abs(poles))]
        facts: dict[str, Any] = {"order": self.order, **ends_of(self.inputs, self.outputs)}
        if self.dt is None:
            hz = np.abs(slow) / (2 * np.pi)
            facts |= {"poles": f"{number(float(hz[0]))} to {number(float(hz[-1]))} Hz" if len(hz) else ""}
            facts |= {"stable": bool((poles.real <= 0).all()), "dead time": quantity(self.delay or None, "s")}
        else:
            facts |= {"step": quantity(self.dt, "s"), "stable": bool((np.abs(poles) <= 1).all())}
        yield Facts(facts)

    def _data(self) -> dict[str, Any]:
        names = ("name", "inputs", "outputs", "state_names", "A", "B", "C", "D", "neglected")
        return {**{name: getattr(self, name) for name in names}, "dt_s": self.dt, "delay_s": self.delay}

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.A)

    @property
    def is_discrete(self) -> bool:
        """True with a step."""
        return self.dt is not None

    def poles(self) -> Complex:
        """Eigenvalues (n,) of A, rad/s, or of the step."""
        return np.asarray(la.eigvals(self.A), dtype=complex)

    def frequency_response(self, frequency_hz: ArrayLike) -> Complex:
        """H (f, p, m) at frequencies (f,), Hz, dead time included.

        Raises OptionError for frequencies that are negative or not finite, and at undamped poles.
        """
        hz = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
        if hz.ndim != 1 or not np.isfinite(hz).all() or (hz < 0).any():
            raise OptionError("frequencies are a list of finite numbers that are not negative, Hz")
        s = 2j * np.pi * hz
        z = s if self.dt is None else np.exp(s * self.dt)
        modes = _diagonal_form(self.A, self.B, self.C)
        H = _by_solution(self, z) if modes is None else _by_modes(*modes, z)
        if not np.isfinite(H).all():
            raise OptionError("one of the frequencies is an undamped pole: give the model some damping")
        H += self.D
        return H * np.exp(-s * self.delay)[:, None, None] if self.dt is None and self.delay else H

    def static_gain(self) -> Array:
        """Gain (p, m) at frequency zero. Raises OptionError when something drifts."""
        own = -self.A if self.dt is None else np.eye(self.order) - self.A
        try:
            return self.D + self.C @ np.linalg.solve(own, self.B)
        except np.linalg.LinAlgError:
            raise OptionError("static gain is undefined: something can move freely") from None

    def discretised(self, dt: float, hold: Hold = "zoh", delay: float | None = None) -> StateSpace:
        """The same model in steps of `dt`, s, exact for inputs held over each step (`zoh`) or going on in straight
        lines (`foh`, the triangle hold of Franklin, Powell and Workman, Digital Control, 1998, section 6.3.2).

        A dead time of the inputs, by default that of the model, is exact too: whole steps become states, and a part of
        a step splits the hold (zoh only). Raises OptionError for impossible steps and delays.
        """
        if self.dt is not None:
            raise OptionError("the model is discrete already")
        if not (np.isfinite(dt) and dt > 0):
            raise OptionError(f"a step is a positive time in s, not {dt}")
        if hold not in ("zoh", "foh"):
            raise OptionError(f"hold is zoh or foh, not {hold!r}")
        delay = self.delay if delay is None else delay
        if not (np.isfinite(delay) and delay >= 0):
            raise OptionError(f"a delay is a time in s that is not negative, not {delay}")
        whole = round(delay / dt) if abs(delay / dt - round(delay / dt)) < 1e-9 else int(np.ceil(delay / dt))
        lead = whole * dt - delay
        lead = 0.0 if abs(lead) < 1e-9 * dt else lead
        if lead and hold == "foh":
            raise OptionError("with foh a delay is a whole number of steps; zoh takes any")
        one = replace(self, delay=0.0)
        plain = _foh(one, dt) if hold == "foh" else _zoh(one, dt, lead)
        return _delayed(plain, whole if not lead else whole - 1, delay) if whole else plain

    def selected(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> StateSpace:
        """The model with some of its inputs and outputs, by name. Raises OptionError for others."""
        i, o = positions(self.inputs, inputs), positions(self.outputs, outputs)
        B, C, D = self.B[:, i], self.C[o], self.D[np.ix_(o, i)]
        ins, outs = tuple(self.inputs[k] for k in i), tuple(self.outputs[k] for k in o)
        lost = None if self.neglected is None else self.neglected.selected(i, o)
        return replace(self, B=B, C=C, D=D, inputs=ins, outputs=outs, neglected=lost)


def _diagonal_form(A: Array, B: Array, C: Array) -> tuple[Complex, Complex, Complex] | None:
    """Poles (n,), inputs (n, m) and outputs (p, n) of the balanced A in its eigenvectors; None where these are all but
    dependent."""
    if not len(A):
        return None
    balanced, (scale, _) = la.matrix_balance(A, permute=False, separate=True)
    found = np.linalg.eig(balanced)
    V: Complex = found[1].astype(complex)
    if not np.linalg.cond(V) < DEPENDENT:
        return None
    inputs: Complex = np.asarray(np.linalg.solve(V, B / scale[:, None]), dtype=complex)
    return np.asarray(found[0], dtype=complex), inputs, np.asarray((C * scale) @ V, dtype=complex)


def _by_modes(poles: Complex, inputs: Complex, outputs: Complex, z: Complex) -> Complex:
    """C (z - A)^-1 B (f, p, m) as a sum over poles."""
    residues = (outputs.T[:, :, None] * inputs[:, None, :]).reshape(len(poles), -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return ((1 / (z[:, None] - poles)) @ residues).reshape(len(z), len(outputs), -1)


def _by_solution(model: StateSpace, z: Complex) -> Complex:
    """C (z - A)^-1 B (f, p, m) by solution at every frequency; infinite at poles."""
    H = np.full((len(z), len(model.C), model.B.shape[1]), np.inf, dtype=complex)
    for start in range(0, len(z), 256):
        own = slice(start, start + 256)
        with suppress(np.linalg.LinAlgError):
            H[own] = model.C @ np.linalg.solve(
                z[own, None, None] * np.eye(model.order) - model.A, model.B.astype(complex)
            )
    return H


def held_exponentials(A: Array, B: Array, dt: float) -> tuple[Array, Array, Array]:
    """e^(A dt), and the weights of an input held constant and of one that grows linearly, per step (Van Loan 1978)."""
    n, m = B.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n : n + m] = A * dt, B * dt
    block[n : n + m, n + m :] = np.eye(m)
    E: Any = la.expm(block)
    return E[:n, :n], E[:n, n : n + m], E[:n, n + m :]


def _zoh(model: StateSpace, dt: float, lead: float) -> StateSpace:
    """Held inputs; with `lead` > 0 an input acts for the last `lead` of the step before, so that it is split in two."""
    n, m = model.B.shape
    A, B, _ = held_exponentials(model.A, model.B, dt)
    if not lead:
        return replace(model, A=A, B=B, dt=dt, delay=0.0)
    late, B_new, _ = held_exponentials(model.A, model.B, lead)
    _, B_old, _ = held_exponentials(model.A, model.B, dt - lead)
    A2 = np.block([[A, late @ B_old], [np.zeros((m, n + m))]])
    C2 = np.hstack([model.C, model.D])
    names = (*model.state_names, *(f"{c.name} one step before" for c in model.inputs))
    B2 = np.vstack([B_new, np.eye(m)])
    return replace(model, A=A2, B=B2, C=C2, D=0 * model.D, state_names=names, dt=dt, delay=0.0)


def _foh(model: StateSpace, dt: float) -> StateSpace:
    A, constant, ramp = held_exponentials(model.A, model.B, dt)
    before = constant - ramp
    B = before + A @ ramp
    return replace(model, A=A, B=B, D=model.D + model.C @ ramp, dt=dt, delay=0.0)


def _delayed(model: StateSpace, steps: int, delay: float) -> StateSpace:
    """The model with its inputs `steps` later, each a chain of states."""
    n, m = model.B.shape
    if not steps:
        return replace(model, delay=delay)
    A = np.zeros((n + steps * m, n + steps * m))
    A[:n, :n], A[:n, n : n + m] = model.A, model.B
    A[n : n + (steps - 1) * m, n + m :] = np.eye((steps - 1) * m)
    B = np.zeros((n + steps * m, m))
    B[-m:] = np.eye(m)
    C = np.hstack([model.C, model.D, np.zeros((len(model.C), (steps - 1) * m))])
    late = [f"{c.name} {k} steps before" for k in range(steps, 0, -1) for c in model.inputs]
    return replace(model, A=A, B=B, C=C, D=np.zeros_like(model.D), state_names=(*model.state_names, *late), delay=delay)
