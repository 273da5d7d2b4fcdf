"""First-order form with named inputs, outputs and states, continuous or discrete, and what it lacks of its mechanism in
the band that it is for: modes left out, and damping made viscous.
"""

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
from flexura.linalg import leading
from flexura.reduction import LowOrderModel
from flexura.results import Result
from flexura.structure import Channel, FullOrderModel, channel_positions, ends_of
from flexura.systems.tuning import Tuning
from flexura.tables import Facts, Item, ends, in_hz, number, percent, quantity

WORTH = 0.01
"""Share of a channel's largest response that may be neglected without a warning."""

FAINT = 0.01
"""Least size of a channel beside what it would reach if all modes added up: one that responds with less, as across a
symmetry, is held against so much."""

Hold = Literal["zoh", "foh"]

DEPENDENT_POLES = 1e5
"""Condition number of the eigenvectors from which a frequency response is solved frequency by frequency."""


@dataclass(frozen=True, repr=False)
class Neglected(Result):
    """Bound (f, p, m) on what a model lacks of the responses of its mechanism at `frequency_hz` (f,), over its band.

    What first-order inertia and damping of the modes left out would add is worked out, with what damping that was made
    viscous and balanced truncation change, and what is left of these modes is bounded (theory eq. T28). `scale` (p, m)
    is the size of every channel: its largest response in the band, and at least 1 % of what modes could add up to.
    """

    _shown = ("text",)

    frequency_hz: Array
    bound: Array
    scale: Array
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz."""
        return float(self.frequency_hz[0]), float(self.frequency_hz[-1])

    @property
    def shares(self) -> Array:
        """The bound over the size of each channel (p, m), at its worst frequency."""
        return np.asarray((self.bound / self.scale).max(axis=0))

    @property
    def share(self) -> float:
        """The largest of the shares."""
        return float(self.shares.max(initial=0.0))

    @property
    def worst(self) -> str:
        """The pair of channels with the largest share, as `output / input`."""
        k, j = np.unravel_index(int(leading(self.shares.ravel())), self.shares.shape)
        return f"{self.outputs[k].name} / {self.inputs[j].name}"

    @property
    def holds_up_to(self) -> float:
        """Highest frequency, Hz, up to which no share is above 1 %; zero without any."""
        beyond = np.flatnonzero((self.bound / self.scale).max(axis=(1, 2)) > WORTH)
        if not len(beyond):
            return self.band[1]
        return float(self.frequency_hz[beyond[0] - 1]) if beyond[0] else 0.0

    @property
    def text(self) -> str:
        """One sentence."""
        top = in_hz(self.band[1])
        if not np.isfinite(self.share):
            text = f"what is left out of {self.worst} has no bound up to {top}"
        else:
            text = f"at most {rounded_up(self.share, 2)} of the largest responses is left out up to {top}"
        if self.share <= WORTH:
            return text
        text += f", most of {self.worst}" if np.isfinite(self.share) else ""
        limit = f"up to {in_hz(self.holds_up_to, 4)}" if self.holds_up_to else "at no frequency"
        return f"{text}; no more than {WORTH:g} {limit}"

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """One, when more than 1 % of a channel is left out."""
        if self.share <= WORTH:
            return ()
        advice = "keep more modes, add residual modes, or state the band that it is for"
        return (Diagnostic("tolerance", self.worst, self.share, WORTH, "1", f"{self.text}: {advice}"),)

    def selected(self, inputs: list[int], outputs: list[int]) -> Neglected:
        """With some of the inputs and outputs, by position."""
        at = np.ix_(range(len(self.frequency_hz)), outputs, inputs)
        ends = tuple(self.inputs[k] for k in inputs), tuple(self.outputs[k] for k in outputs)
        return replace(self, bound=self.bound[at], scale=self.scale[at[1:]][0], inputs=ends[0], outputs=ends[1])

    def presentation(self) -> Iterator[Item]:
        low, high = self.band
        yield Facts(
            {
                "band": ends((low, high), "Hz", 5),
                "at most": percent(self.share),
                "of": self.worst,
                "holds up to": in_hz(self.holds_up_to),
            }
        )

    def _data(self) -> dict[str, Any]:
        return {"band_hz": self.band, "shares": self.shares, "holds_up_to_hz": self.holds_up_to, "text": self.text}


def rounded_up(bound: float, digits: int = 3) -> str:
    """A bound to a few digits that are not below it."""
    if not (np.isfinite(bound) and bound > 0):
        return f"{bound:g}"
    digit = 10.0 ** (np.floor(np.log10(bound)) - digits + 1)
    return f"{np.ceil(bound / digit * (1 - 1e-12)) * digit:.{digits}g}"


@dataclass(frozen=True, repr=False)
class StateSpace(Result):
    """x' = A x + B u, y = C x + D u; or with a step `dt`, s: x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k].

    A (n, n), B (n, m), C (p, n), D (p, m), SI. `inputs` (m) and `outputs` (p) say what u and y are. `delay` is a dead
    time of all inputs, s, that the matrices of a continuous model leave out and those of a discrete one contain.
    `notes` say where the model comes from and what was neglected, and `warnings` where that is not small. `neglected`
    is a bound on what a continuous model lacks in the band that it is for, None where nothing was left out. `model` is
    what it was made from, and `tuning` the parameters of a continuous model that can be changed in it.
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
    tuning: Tuning | None = field(default=None, repr=False, compare=False)

    def presentation(self) -> Iterator[Item]:
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
        matrix = -self.A if self.dt is None else np.eye(self.order) - self.A
        try:
            return self.D + self.C @ np.linalg.solve(matrix, self.B)
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
        if self.tuning is not None and self.tuning.masses:
            raise OptionError(f"{self.tuning.masses[0]} is a parameter of a continuous model: make it without payloads")
        delay = self.delay if delay is None else delay
        if not (np.isfinite(delay) and delay >= 0):
            raise OptionError(f"a delay is a time in s that is not negative, not {delay}")
        whole = round(delay / dt) if abs(delay / dt - round(delay / dt)) < 1e-9 else int(np.ceil(delay / dt))
        lead = whole * dt - delay
        lead = 0.0 if abs(lead) < 1e-9 * dt else lead
        if lead and hold == "foh":
            raise OptionError("with foh a delay is a whole number of steps; zoh takes any")
        one = replace(self, delay=0.0, tuning=None)
        plain = _foh(one, dt) if hold == "foh" else _zoh(one, dt, lead)
        return _delayed(plain, whole if not lead else whole - 1, delay) if whole else plain

    def selected(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> StateSpace:
        """The model with some of its inputs and outputs, by name. Raises OptionError for others."""
        i, o = channel_positions(self.inputs, inputs), channel_positions(self.outputs, outputs)
        B, C, D = self.B[:, i], self.C[o], self.D[np.ix_(o, i)]
        ins, outs = tuple(self.inputs[k] for k in i), tuple(self.outputs[k] for k in o)
        lost = None if self.neglected is None else self.neglected.selected(i, o)
        tuning = None if self.tuning is None else self.tuning.selected(i, o)
        return replace(self, B=B, C=C, D=D, inputs=ins, outputs=outs, neglected=lost, tuning=tuning)


def _diagonal_form(A: Array, B: Array, C: Array) -> tuple[Complex, Complex, Complex] | None:
    """Poles (n,), inputs (n, m) and outputs (p, n) of the balanced A in its eigenvectors; None where these are all but
    dependent."""
    if not len(A):
        return None
    balanced, (scale, _) = la.matrix_balance(A, permute=False, separate=True)
    found = np.linalg.eig(balanced)
    V: Complex = found[1].astype(complex)
    if not np.linalg.cond(V) < DEPENDENT_POLES:
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
        chunk = slice(start, start + 256)
        with suppress(np.linalg.LinAlgError):
            H[chunk] = model.C @ np.linalg.solve(
                z[chunk, None, None] * np.eye(model.order) - model.A, model.B.astype(complex)
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
