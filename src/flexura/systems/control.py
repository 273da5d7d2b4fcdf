"""Controllers as state spaces, loops closed around a modal system, and how far from instability these are.

Filters are sections of at most second order in series, each scaled by a frequency of its own; dead time is the diagonal
Pade approximation in states, and exact in margins. A sampled controller holds its output, which is half a step more of
dead time (Franklin, Powell and Workman 1998).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import factorial
from typing import Any, cast

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array, Complex
from flexura.errors import OptionError, SolverError
from flexura.mechanism import Controller
from flexura.records import Record
from flexura.structure import Channel
from flexura.systems.modal import ModalSystem
from flexura.systems.pole_form import PoleForm, parts_of_modes
from flexura.systems.reduction import first_order
from flexura.systems.state_space import StateSpace
from flexura.systems.tuning import Tuning
from flexura.tables import in_hz

ALGEBRAIC = 1e12
"""Condition number of the direct path around a loop from which it has no solution."""

GROWS = 1e-9
"""Real part of a pole over its size above which it grows."""

DEFECTIVE = 1e10
"""Condition number of the modes of a loop from which they all but coincide."""

Matrices = tuple[Array, Array, Array, Array]


def _section(num: Sequence[float], den: Sequence[float], w: float) -> Matrices:
    """A, B, C, D of a ratio of polynomials in s/w, lowest power first, of which that below has the higher order."""
    n = len(den) - 1
    a = np.array(den[:-1]) / den[-1]
    b = np.zeros(n + 1)
    b[: len(num)] = np.array(num) / den[-1]
    A = np.eye(n, k=1) * w
    A[-1] = -a * w
    B = np.zeros((n, 1))
    B[-1] = w
    return A, B, (b[:-1] - b[-1] * a)[None], np.array([[b[-1]]])


def _series(first: Matrices, second: Matrices) -> Matrices:
    (A, B, C, D), (E, F, G, H) = first, second
    whole = np.block([[A, np.zeros((len(A), len(E)))], [F @ C, E]])
    return whole, np.vstack([B, F @ D]), np.hstack([H @ C, G]), H @ D


@dataclass(frozen=True)
class Filter:
    """A controller in numbers: sections (numerator, denominator, w) in s/w, a gain, and its `dead_time`, s, that of the
    hold included; `delay` is without, and `sample_time` None where nothing is sampled."""

    sections: tuple[tuple[tuple[float, ...], tuple[float, ...], float], ...]
    gain: float
    sign: float
    delay: float
    sample_time: float | None
    pade: int

    @property
    def dead_time(self) -> float:
        """Of computing, and half a step of the hold, s."""
        return self.delay + (self.sample_time or 0.0) / 2

    @property
    def matrices(self) -> Matrices:
        """A, B, C, D without dead time."""
        nothing = np.zeros((0, 0))
        whole: Matrices = (nothing, np.zeros((0, 1)), np.zeros((1, 0)), np.array([[self.gain]]))
        for num, den, w in self.sections:
            whole = _series(whole, _section(num, den, w))
        return whole

    @property
    def with_dead_time(self) -> Matrices:
        """A, B, C, D with dead time as a rational function."""
        tau, n = self.dead_time, self.pade
        if not tau:
            return self.matrices
        c = [
            factorial(2 * n - k) * factorial(n) / (factorial(2 * n) * factorial(k) * factorial(n - k))
            for k in range(n + 1)
        ]
        num = [own * (-1) ** k for k, own in enumerate(c)]
        scale = 2.0 * n  # so that the polynomials are even
        num, den = ([own * scale**k for k, own in enumerate(of)] for of in (num, c))
        return _series(self.matrices, _section(num, den, scale / tau))

    def response(self, hz: Array) -> Complex:
        """K (f,) at frequencies (f,), Hz, dead time and hold exact, without the sign of the feedback."""
        s = 2j * np.pi * hz
        K: Complex = np.full(len(hz), self.gain, dtype=complex)
        for num, den, w in self.sections:
            x = s / w
            K *= np.polyval(num[::-1], x) / np.polyval(den[::-1], x)
        K *= np.exp(-s * self.delay)
        if self.sample_time:
            T = self.sample_time
            K *= np.exp(-s * T / 2) * np.sinc(hz * T)
        return K


def filter_of(of: Controller) -> Filter:
    """A controller, whose expressions are evaluated, in numbers."""

    def number(x: Any) -> float:
        return 0.0 if x is None else float(x.value if hasattr(x, "value") else x)

    sections: list[tuple[tuple[float, ...], tuple[float, ...], float]] = []
    root, gain = np.sqrt(2.0), 1.0
    low = 2 * np.pi * number(of.low_pass)
    if of.type == "pid":
        kp, ki, kd = (number(own) for own in (of.proportional, of.integral, of.derivative))
        w = low or (ki / kp if kp and ki else 1.0)
        if ki and kd:
            sections += [((ki, kp * w, kd * w * w), (1.0, root, 1.0), w), ((1.0,), (0.0, w), w)]
        elif kd:
            sections.append(((kp, kd * w), (1.0, root, 1.0), w))
        elif ki:
            sections.append(((ki, kp * w), (0.0, w), w))
        else:
            gain = kp
        low = 0.0 if kd else low
    elif of.type == "iff":
        leak = 2 * np.pi * number(of.leak)
        w = leak or 1.0
        sections.append(((number(of.gain),), (leak, w), w))
    elif of.type == "ppf":
        sections.append(((number(of.gain),), (1.0, 2 * number(of.ratio), 1.0), 2 * np.pi * number(of.frequency)))
    else:
        gain = number(of.gain)
    if of.lead is not None:
        zero, pole = (2 * np.pi * float(f) for f in of.lead)  # type: ignore[arg-type]
        sections.append(((1.0, pole / zero), (1.0, 1.0), pole))
    if low:
        sections.append(((1.0,), (1.0, root, 1.0), low))
    for notch in of.notches:
        zeta, depth = number(notch.ratio), number(notch.depth)
        sections.append(((1.0, 2 * zeta * depth, 1.0), (1.0, 2 * zeta, 1.0), 2 * np.pi * number(notch.frequency)))
    return Filter(tuple(sections), gain, of.sign, number(of.delay), number(of.sample_time) or None, of.pade)


@dataclass(frozen=True, repr=False)
class Closed(Record):
    """Loops closed around a system: `model` from its inputs, noises of sensors and references to its outputs and the
    commands of actuators; `plant` without loops, and `groups` (n,), the mode that each state is of, -1 of controllers.
    """

    _shown = ("model",)

    model: StateSpace
    plant: StateSpace
    groups: Array
    filters: tuple[Filter, ...]

    def refuse_unstable(self, hz: Array) -> None:
        """Raise SolverError where a pole grows, naming it and the mode, of frequencies (r,), Hz, that moves most."""
        poles, vectors = la.eig(self.model.A)
        k = int(np.argmax(poles.real / np.maximum(np.abs(poles), 1e-300)))
        if poles[k].real <= GROWS * abs(poles[k]):
            return
        energy = np.zeros(len(hz) + 1)
        size = np.abs(vectors[:, k]) ** 2
        for state, group in enumerate(self.groups.astype(int)):
            is_displacement = group >= 0 and state % 2 == 0
            energy[group] += size[state] * ((2 * np.pi * hz[group]) ** 2 if is_displacement else group >= 0)
        mode = int(np.argmax(energy[:-1])) if energy[:-1].any() else -1
        of = f", most of it mode {mode + 1}, {in_hz(hz[mode])}" if mode >= 0 else ", most of it the controller"
        at = in_hz(abs(poles[k]) / (2 * np.pi))
        raise SolverError(
            f"the closed loop is unstable: the pole at {at} grows by {poles[k].real:.4g} 1/s{of};"
            " lower the gain, or move the phase there"
        )

    def pole_form(self, modes: ModalSystem, kept: int) -> PoleForm:
        """The closed loops as a sum over poles, by the mode that each state is of. Raises SolverError where poles all
        but coincide."""
        A = self.model.A
        balanced, (scale, _) = la.matrix_balance(A, permute=False, separate=True)
        poles, V = np.linalg.eig(balanced)
        if not np.linalg.cond(V) < DEFECTIVE:
            raise SolverError("poles of the closed loop all but coincide: move a filter's frequency a little")
        right = (self.model.B / scale[:, None]).astype(complex)
        loads: Complex = np.asarray(np.linalg.solve(V, right), dtype=complex)
        C = self.model.C * scale
        of_mode, names = parts_of_modes(modes.frequency_hz[:kept])
        last = len(names) - 1
        mode = self.groups.astype(int)
        group = np.where(mode < 0, last, np.append(of_mode, last - 1)[np.minimum(mode, kept)])
        parts = np.stack([(C * (group == g)) @ V for g in range(last + 1)]) / (2j * np.pi)
        direct = np.zeros((last + 1, *self.model.D.shape))
        direct[-1] = self.model.D
        return PoleForm(poles / (2j * np.pi), parts, loads, direct, 0 * self.model.D, names)


def closed(modes: ModalSystem, controllers: Mapping[str, Controller]) -> Closed:
    """Loops closed around viscously damped modes, whose last inputs and outputs are the actuator and the sensor of each
    controller, in their order. Raises OptionError for a loop without a solution.
    """
    plant = first_order(modes, 0.0, ("loops closed around modes",))
    filters = tuple(map(filter_of, controllers.values()))
    c, m, p = len(filters), plant.B.shape[1] - len(filters), plant.C.shape[0] - len(filters)
    tuning = cast("Tuning", plant.tuning)
    B, C, D = tuning.joined(plant.B, plant.C, plant.D)
    ports = len(tuning.slope)
    driven, read = ports + m, ports + p
    Bw, Bc, Cz, Cy = B[:, :driven], B[:, driven:], C[:read], C[read:]
    Dzw, Dzc, Dyw, Dyc = D[:read, :driven], D[:read, driven:], D[read:, :driven], D[read:, driven:]
    K = [own.with_dead_time for own in filters]
    Ak, Bk, Ck, Dk = (la.block_diag(*of) if c else np.zeros((0, 0)) for of in zip(*K, strict=True))
    sign, follows = np.diag([f.sign for f in filters]), np.diag([float(f.sign < 0) for f in filters])
    loop = np.eye(c) - Dyc @ Dk @ sign
    if not np.linalg.cond(loop) < ALGEBRAIC:
        raise OptionError("the direct path around a loop has a gain of one: it has no solution; give it a low_pass")
    inner = np.linalg.inv(loop)
    # reading y, and command u, of states x, xk and inputs w, noises n, references r
    y = [inner @ part for part in (Cy, Dyc @ Ck, Dyw, Dyc @ Dk @ sign, Dyc @ Dk @ follows)]
    noise = np.eye(c)
    e = [sign @ y[0], sign @ y[1], sign @ y[2], sign @ (y[3] + noise), sign @ y[4] + follows]
    u = [Dk @ e[0], Ck + Dk @ e[1], Dk @ e[2], Dk @ e[3], Dk @ e[4]]
    A = np.block([[plant.A + Bc @ u[0], Bc @ u[1]], [Bk @ e[0], Ak + Bk @ e[1]]])
    B = np.block([[Bw + Bc @ u[2], Bc @ u[3], Bc @ u[4]], [Bk @ e[2], Bk @ e[3], Bk @ e[4]]])
    C = np.block([[Cz + Dzc @ u[0], Dzc @ u[1]], [u[0], u[1]]])
    D = np.block([[Dzw + Dzc @ u[2], Dzc @ u[3], Dzc @ u[4]], [u[2], u[3], u[4]]])
    names, sensors, actuators = list(controllers), plant.outputs[p:], plant.inputs[m:]
    inputs = (
        *plant.inputs[:m],
        *(Channel(f"{name}.noise", s.quantity) for name, s in zip(names, sensors, strict=True)),
        *(Channel(f"{name}.reference", s.quantity) for name, s in zip(names, sensors, strict=True)),
    )
    outputs = (
        *plant.outputs[:p],
        *(Channel(f"{n}.command", a.quantity) for n, a in zip(names, actuators, strict=True)),
    )
    states = (*plant.state_names, *(f"controller state {k + 1}" for k in range(len(Ak))))
    notes = (*plant.notes, *_dead_times(names, filters))
    tuning, (B, C, D) = tuning.parted(A, B, C, D)
    model = StateSpace(
        A, B, C, D, inputs, outputs, states, None, 0.0, plant.name, notes, model=plant.model, tuning=tuning
    )
    groups = np.concatenate([np.repeat(np.arange(modes.order), 2), np.full(len(Ak), -1)]).astype(float)
    return Closed(model, plant, groups, filters)


def _dead_times(names: Sequence[str], filters: Sequence[Filter]) -> list[str]:
    return [
        f"{name}: a dead time of {1e3 * f.dead_time:.5g} ms, that of the hold included, of order {f.pade} in states"
        for name, f in zip(names, filters, strict=True)
        if f.dead_time
    ]
