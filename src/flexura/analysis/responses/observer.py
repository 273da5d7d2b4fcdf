"""A Kalman observer of modes: what sensors with noise tell of a mechanism that disturbances drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from flexura.analysis.responses.budget import Source, chosen_disturbances, sources_in
from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.full_order import plan_of
from flexura.mechanism import Damping, Disturbance, Mechanism
from flexura.modal import close_groups
from flexura.results import Tabular
from flexura.structure import Channel, FullOrderModel, Plan, actuator_names, matched, sensor_names
from flexura.systems import (
    Kalman,
    Noise,
    StateSpace,
    covariance_of_step,
    kalman,
    state_space,
    system,
)
from flexura.tables import Facts, Item, Table, in_hz, quantity

UNSEEN = 1e-6
"""Share of the largest motion per mode at a sensor below which it does not see a mode."""

REPEATED = 1e-9
"""Relative gap of frequencies that are one."""

GROWS, DECAYS = 1e-9, 1e-9
"""Real part of a pole over its size from which it grows, and from which it decays."""


@dataclass(frozen=True, repr=False)
class Observer(Tabular):
    """The steady-state Kalman filter of a `model` in steps, of which it estimates the states at the next sample.

    x+ = A x + B u + `gain` (y - C x - D u), with inputs u and readings y of the sensors at this sample; `gain` is (n,
    p) and `covariance` (n, n) that of the error of estimates; states that are inputs of steps before have none. `noise`
    has the covariances of a step, `motion` (p,) the mean square of what sensors read without their noise, infinite
    where nothing damps it, and `seen` (p, r) how much of each mode a sensor sees, its largest being 1.
    """

    _shown = ("name", "inputs", "sensors")

    model: StateSpace
    sources: tuple[str, ...]
    noise: Noise
    filter: Kalman
    motion: Array
    seen: Array
    frequency_hz: Array
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    @property
    def name(self) -> str:
        """That of the mechanism."""
        return self.model.name

    @property
    def inputs(self) -> tuple[Channel, ...]:
        """What is commanded, and known."""
        return self.model.inputs

    @property
    def sensors(self) -> tuple[Channel, ...]:
        """What is read."""
        return self.model.outputs

    @property
    def gain(self) -> Array:
        """Change of each state by what readings differ (n, p), SI."""
        return np.vstack([self.filter.gain, np.zeros((self.model.order - len(self.filter.gain), len(self.sensors)))])

    @property
    def covariance(self) -> Array:
        """Of the error of the states of modes (n, n), SI, before a sample is read."""
        return self.filter.covariance

    @cached_property
    def poles(self) -> Complex:
        """Of the error of estimates (n,), per step."""
        n = len(self.covariance)
        return np.asarray(la.eigvals(self.model.A[:n, :n] - self.filter.gain @ self.model.C[:, :n]), dtype=complex)

    @property
    def error_rms(self) -> Array:
        """Root mean squares (p,) of the difference between what is estimated and what is there at sensors."""
        C = self.model.C[:, : len(self.covariance)]
        return np.sqrt(np.einsum("ij,jk,ik->i", C, self.covariance, C))

    @property
    def estimator(self) -> StateSpace:
        """From inputs and readings of a sample to what is estimated of the next, of modes of modal mass 1 kg."""
        m, L = self.model, self.gain
        readings = tuple(Channel(f"{c.name}.reading", c.quantity) for c in m.outputs)
        states = self.model.state_names[: len(self.covariance)]
        words = ("displacement", "velocity")
        outputs = tuple(Channel(name, words[k % 2]) for k, name in enumerate(states))
        A, B = m.A - L @ m.C, np.hstack([m.B - L @ m.D, L])
        C, D = A[: len(states)], B[: len(states)]
        ends = (*m.inputs, *readings), outputs
        return StateSpace(A, B, C, D, *ends, m.state_names, m.dt, m.delay, m.name, self.notes, self.warnings)

    def presentation(self) -> Iterator[Item]:
        slow = np.abs(self.poles).max()
        assert self.model.dt is not None
        yield Facts(
            {
                "modes": len(self.frequency_hz),
                "step": quantity(self.model.dt, "s"),
                "settles with": quantity(-self.model.dt / np.log(slow) if slow > 0 else 0.0, "s", 3),
                "driven by": ", ".join(self.sources),
            }
        )
        columns = {"sensor": [c.name for c in self.sensors]}
        for word, rms in self._rms().items():
            columns[word] = [quantity(x, c.unit, 4) for x, c in zip(rms.tolist(), self.sensors, strict=True)]
        yield Table(columns, "sensors", title="root mean squares")

    def _data(self) -> dict[str, Any]:
        names = ("name", "inputs", "sensors", "sources", "gain", "covariance", "poles", "seen", "frequency_hz")
        states = self.model.state_names
        more = {"state_names": states, "noise": self.noise._asdict(), "rms": self._rms(), "dt_s": self.model.dt}
        return {**{name: getattr(self, name) for name in names}, **more}

    def _rms(self) -> dict[str, Array]:
        """Root mean squares (p,) of motion at sensors, of the noise of their readings and of the error of estimates."""
        readings = np.sqrt(self.noise.reading.diagonal())
        return {"motion": np.sqrt(self.motion), "readings": readings, "estimates": self.error_rms}

    def _columns(self) -> dict[str, Any]:
        """Root mean squares at every sensor."""
        rms = self._rms()
        columns = {str(c): [own[k] for own in rms.values()] for k, c in enumerate(self.sensors)}
        return {"root mean square of": list(rms), **columns}


@verb
def observer(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    dt: float,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    disturbances: Mapping[str, Disturbance] | None = None,
    sources: Sequence[str] | None = None,
    n: int | None = None,
    up_to: float | None = None,
    damping: Damping | float | Mapping[str, Any] | None = None,
    delay: float = 0.0,
) -> Observer:
    """A steady-state Kalman filter of modes in steps of `dt`, s, from disturbances and noise of sensors (theory eqs.
    X10-X13; Anderson and Moore 1979).

    `inputs` are commanded and known, `outputs` are sensors that are read, all by default; `delay`, s, is a dead time of
    inputs. Of `n` modes (6), or those `up_to` a frequency, Hz. What drives the states and what sensors have of noise
    are the `disturbances` that are described, or those given in their place by name, all or the `sources` that are
    named. They are white: one `density` each, over a `band` or not. Noise of sensors is sampled behind a low-pass at
    half the rate, or with all of a band that ends beyond. A density that reaches a reading directly, as that of a force
    an acceleration, is read as its mean over the step.

    Raises ModelError; OptionError for densities that are not white, sensors without noise and names that are not there;
    SolverError where a mode grows, and where one that nothing damps is not seen by any sensor or driven by nothing.
    """
    if not (np.isfinite(dt) and dt > 0):
        raise OptionError(f"a step is a positive time in s, not {dt}")
    if isinstance(model, Mechanism):
        model = plan_of(model, parameters)
    plan = model if isinstance(model, Plan) else model.plan
    found = sources_in(model, parameters, chosen_disturbances(plan.mechanism, disturbances, sources))
    intensity = [_white(source) for source in found]
    known = _named(inputs, actuator_names(plan), "actuators")
    read = _named(outputs, sensor_names(plan), "sensors")
    driving = list(dict.fromkeys(name for source in found for name in source.inputs))
    if not driving:
        raise OptionError("no disturbance moves anything: an observer needs one that does, of an `input` or the `base`")
    every = list(dict.fromkeys([*known, *driving]))
    built = system(model, parameters, inputs=every, outputs=read, damping=damping, order="full")
    whole = _moving(_aligned(state_space(built, n=6 if n is None and up_to is None else n, up_to=up_to)))
    own = whole.selected(driving, read)
    W, R = np.zeros((len(driving), len(driving))), np.zeros((len(read), len(read)))
    for source, power in zip(found, intensity, strict=True):
        drives, reads = source.weights(own.inputs), source.read(own.outputs)
        W += power * drives @ drives.T
        R += _variance(source, dt) * reads @ reads.T
    silent = next((c.name for c, r in zip(own.outputs, np.diag(R), strict=True) if not r > 0), None)
    if silent is not None:
        raise OptionError(f"{silent} has no noise: describe some in `disturbances`, or leave it out of `outputs`")
    _refuse_hidden(own, W)
    held = own.discretised(dt)
    cross = held.B @ W @ own.D.T / dt
    noise = Noise(covariance_of_step(own.A, own.B, W, dt), R + own.D @ W @ own.D.T / dt, cross)
    steps = whole.selected(known, read).discretised(dt, delay=delay)
    found_filter = kalman(held.A, own.C, noise)
    notes = (
        *steps.notes,
        *_bands(found, dt),
        f"covariance checked by Lyapunov's equation: {found_filter.mismatch:.1g}",
    )
    return Observer(
        steps,
        tuple(s.name for s in found),
        noise,
        found_filter,
        _motion(held.A, own, noise.process),
        _seen(own),
        _omega(own) / (2 * np.pi),
        notes,
        (*steps.warnings, *_unseen(own)),
    )


def _named(wanted: Sequence[str] | None, known: Sequence[str], what: str) -> list[str]:
    """Names, with wildcards over those that are described; all of them by default."""
    if wanted is None:
        if not known:
            raise OptionError(f"no {what} are described: name what is meant")
        return list(known)
    names = [wanted] if isinstance(wanted, str) else list(wanted)
    return [name for own in matched(names, list(known)).values() for name in own]


def _white(source: Source) -> float:
    """Two-sided intensity, squared units times s, of a density that is the same at all frequencies. Raises OptionError
    for others."""
    values = {n: c for n, c in source.spectrum.terms.items() if c.any()}
    if set(values) - {0} or len(source.spectrum.start) != 1:
        raise OptionError(
            f"{source.name} is not white: an observer takes one density for all frequencies; leave it out (`sources`),"
            " or give a density in its place (`disturbances`)"
        )
    return float(values[0][0]) / 2 if values else 0.0


def _variance(source: Source, dt: float) -> float:
    """Mean square of a sample."""
    top, half = float(source.spectrum.stop[-1]), 0.5 / dt
    return 2 * _white(source) * (max(top, half) if np.isfinite(top) else half)


def _bands(found: Sequence[Source], dt: float) -> list[str]:
    """What is said of densities that end below half the rate of samples, or begin above zero."""
    half = 0.5 / dt
    limited = [s.name for s in found if s.spectrum.stop[-1] < half or s.spectrum.start[0] > 0]
    text = f"{', '.join(limited)}: taken as white from zero to half the rate, {in_hz(half)}, beyond the band described"
    return [text] if limited else []


def _mode(model: StateSpace, k: int) -> str:
    """Name and frequency of a mode."""
    return f"{model.state_names[2 * k].rsplit(' ', 1)[0]}, {in_hz(float(_omega(model)[k]) / (2 * np.pi))}"


def _omega(model: StateSpace) -> Array:
    """Angular frequencies (r,) of modes."""
    return np.sqrt(np.maximum(-model.A[1::2, 0::2].diagonal(), 0.0))


def _over_largest(values: Any) -> Array:
    """Sizes (..., r) over the largest of each row."""
    return np.abs(values) / np.maximum(np.abs(values).max(axis=-1, keepdims=True, initial=0.0), 1e-300)


def _seen(model: StateSpace) -> Array:
    """How much of each mode every sensor sees (p, r), its largest being 1."""
    return _over_largest(model.C[:, 0::2] + 1j * _omega(model) * model.C[:, 1::2])


def _aligned(model: StateSpace) -> StateSpace:
    """The model with modes that coincide, damping included, turned within their space so that the last of them are seen
    by as few sensors as can be: of two in x and y, a sensor along x then sees one alone."""
    A, R, notes = model.A.copy(), np.eye(model.order), list[str]()
    size = np.sqrt(np.maximum(-A[1::2, 1::2].diagonal(), 0.0))
    for group in close_groups(_omega(model), REPEATED):
        q, v = 2 * np.asarray(group), 2 * np.asarray(group) + 1
        damping = A[np.ix_(v, v)]
        even = np.abs(damping - damping[0, 0] * np.eye(len(q))).max() <= UNSEEN * size[group].max() ** 2
        coupled = np.abs(np.delete(A[v, 1::2], group, axis=1)).max(initial=0.0) > 0
        if len(q) < 2 or coupled or not even:
            continue
        A[np.ix_(v, q)] = A[np.ix_(v, q)].diagonal().mean() * np.eye(len(q))
        A[np.ix_(v, v)] = damping.diagonal().mean() * np.eye(len(q))
        read = model.C[:, q] + _omega(model)[group[0]] * model.C[:, v]
        _, _, turn = np.linalg.svd(read / np.maximum(np.abs(read).max(axis=1, keepdims=True), 1e-300))
        R[np.ix_(q, q)] = R[np.ix_(v, v)] = turn.T
        notes.append(f"modes that coincide are turned to what sensors see: {_mode(model, int(group[0]))}")
    return replace(model, A=A, B=R.T @ model.B, C=model.C @ R, notes=(*model.notes, *notes))


def _moving(model: StateSpace) -> StateSpace:
    """The model without modes that nothing drives and nothing sees, but for round-off, as those across a symmetry."""
    damping = -model.A[1::2, 1::2]
    size = np.sqrt(np.maximum(damping.diagonal(), 0.0))
    coupled = (np.abs(damping) > UNSEEN * np.outer(size, size)) & ~np.eye(len(size), dtype=bool)
    apart = ~coupled.any(axis=1)
    rests = (_seen(model) < UNSEEN).all(axis=0) & (_over_largest(model.B[1::2].T) < UNSEEN).all(axis=0) & apart
    if not rests.any():
        return model
    text = "; ".join(_mode(model, k) for k in np.flatnonzero(rests).tolist())
    kept = np.flatnonzero(~rests.repeat(2))
    names = tuple(model.state_names[k] for k in kept.tolist())
    reduced = replace(model, A=model.A[np.ix_(kept, kept)], B=model.B[kept], C=model.C[:, kept], state_names=names)
    return replace(reduced, notes=(*model.notes, f"neither driven nor seen, and left out: {text}"))


def _refuse_hidden(model: StateSpace, W: Array) -> None:
    """Raise SolverError for modes that grow, and those that nothing damps and nothing drives or sees."""
    balanced, (scale, _) = la.matrix_balance(model.A, permute=False, separate=True)
    poles, vectors = la.eig(balanced)
    omega, seen = _omega(model), _seen(model).max(axis=0)
    pushed = _over_largest(np.sqrt(np.einsum("ij,jk,ik->i", model.B, W, model.B))[1::2])
    names = ", ".join(c.name for c in model.outputs)
    for pole, vector in zip(poles, vectors.T, strict=True):
        k = int((np.abs((scale * vector)[0::2]) * np.maximum(omega, 1e-300)).argmax())
        if pole.real > GROWS * max(abs(pole), omega.max()):
            raise SolverError(f"{_mode(model, k)}, grows by {pole.real:.4g} 1/s: nothing steady observes it")
        if pole.real < -DECAYS * max(abs(pole), 1e-6 * omega.max()):
            continue
        if seen[k] < UNSEEN:
            raise SolverError(f"nothing damps {_mode(model, k)}, and no sensor sees it ({names}): add one, or damping")
        if pushed[k] < UNSEEN:
            raise SolverError(
                f"nothing damps {_mode(model, k)}, and no disturbance drives it: describe one, or damping"
            )


def _unseen(model: StateSpace) -> list[Diagnostic]:
    """Modes that no sensor sees."""
    seen, names = _seen(model).max(axis=0), ", ".join(c.name for c in model.outputs)
    texts = {k: f"{_mode(model, k)}, is not seen by {names}" for k in np.flatnonzero(seen < UNSEEN).tolist()}
    return [
        Diagnostic(
            "proof", _mode(model, k), float(seen[k]), UNSEEN, "1", f"{text}: its estimate is what the model says"
        )
        for k, text in texts.items()
    ]


def _motion(A: Array, model: StateSpace, process: Array) -> Array:
    """Mean squares (p,) of what sensors read without noise; infinite where nothing damps what moves."""
    if not np.abs(la.eigvals(A)).max() < 1 - 1e-13:
        return np.full(len(model.C), np.inf)
    size = np.sqrt(np.maximum(process.diagonal(), 0.0))
    size = np.where(size > 0, size, size.max() or 1.0)
    P: Any = la.solve_discrete_lyapunov(A * size / size[:, None], process / np.outer(size, size))
    C = model.C * size
    return np.asarray(np.einsum("ij,jk,ik->i", C, P, C))
