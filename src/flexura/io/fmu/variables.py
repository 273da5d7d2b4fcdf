"""Variables of a model in an FMU, whichever version, and what depends on what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexura.analysis import ScheduledPlant
from flexura.arrays import Array, Bools
from flexura.io.contents import refuse_clashes, signal_names
from flexura.io.fmu.code import blocks_of, nominals, patterns
from flexura.systems import StateSpace


class Variable(NamedTuple):
    """A variable in the words of FMI, a number or with an `interval`, s, a clock; its value reference is its place in
    the list."""

    name: str
    causality: str
    variability: str
    initial: str | None = None
    unit: str | None = None
    start: float | None = None
    nominal: float | None = None
    minimum: float | None = None
    derivative_of: int | None = None
    previous: int | None = None
    interval: float | None = None


class Dependency(NamedTuple):
    """On which variable, and how: by a `constant` or `tunable` factor, or otherwise (`dependent`)."""

    reference: int
    kind: str


@dataclass(frozen=True)
class Variables:
    """All variables: inputs, outputs, states, derivatives where time is continuous, parameters, gains, and time; where
    it is not, next states and a clock, which FMI 3 alone has, follow.

    `outputs` and `rates`, which are derivatives or next states, are what each of these, by its value reference, depends
    on; `parameters` is the value reference of the first parameter, `indicators` those of event indicators, before time.
    """

    variables: list[Variable]
    outputs: dict[int, list[Dependency]]
    rates: dict[int, list[Dependency]]
    parameters: int
    indicators: tuple[int, ...] = ()
    clocked: tuple[Variable, ...] = ()

    @property
    def clock(self) -> int | None:
        """The value reference of the clock, the last."""
        return len(self.variables) + len(self.clocked) - 1 if self.clocked else None


def variables_of(model: StateSpace) -> Variables:
    """Variables of a linear model. Raises OptionError for names that clash."""
    pattern, own, n = patterns(model), model.tuning, model.order
    sizes = nominals(model, blocks_of(pattern.A))
    parameters = [
        Variable(q.name, "parameter", "tunable", "exact", q.unit, q.start, minimum=0.0)
        for q in (own.parameters if own is not None else ())
    ]
    found, first = listed(model, (np.zeros(n), *sizes), parameters, [], model.is_discrete)
    m, p = len(model.inputs), len(model.outputs)
    clocked = () if model.dt is None else _clocked(found[m + p : m + p + n], m + p, model.dt)
    refuse_clashes([v.name for v in (*found, *clocked)])
    outputs = {m + i: _depends(model, pattern.C[i], pattern.D[i], pattern.onto[i], first) for i in range(p)}
    at = len(found) if clocked else m + p + n
    rates = {at + i: _depends(model, pattern.A[i], pattern.B[i], pattern.into[i], first) for i in range(n)}
    return Variables(found, outputs, rates, first, clocked=clocked)


def _clocked(states: Sequence[Variable], first: int, dt: float) -> tuple[Variable, ...]:
    """Next states, and the clock."""
    following = [
        Variable(f"next({x.name})", "local", "discrete", "calculated", previous=first + k) for k, x in enumerate(states)
    ]
    return *following, Variable("clock", "input", "discrete", interval=dt)


def listed(
    model: StateSpace | ScheduledPlant,
    sizes: tuple[Array, Array, Array],
    parameters: Sequence[Variable],
    indicators: Sequence[Variable],
    is_discrete: bool,
) -> tuple[list[Variable], int]:
    """All variables by value reference, and that of the first parameter; `sizes` are states at first, and ordinary
    sizes of states and outputs. Raises OptionError for names that clash."""
    names, (start, x, y) = signal_names(model), sizes
    m, p = len(model.inputs), len(model.outputs)
    time = "discrete" if is_discrete else "continuous"
    ends = zip(names.inputs, model.inputs, strict=True), zip(names.outputs, model.outputs, strict=True)
    found = [Variable(name, "input", time, unit=channel.unit, start=0.0) for name, channel in ends[0]]
    found += [
        Variable(name, "output", time, "calculated", channel.unit, nominal=float(size))
        for (name, channel), size in zip(ends[1], y, strict=True)
    ]
    found += [
        Variable(name, "local", time, "exact", start=float(at), nominal=float(size))
        for name, at, size in zip(names.states, start, x, strict=True)
    ]
    if not is_discrete:
        found += [
            Variable(f"der({name})", "local", time, "calculated", derivative_of=m + p + k)
            for k, name in enumerate(names.states)
        ]
    first = len(found)
    found += parameters
    found += [Variable(f"{name}.gain", "parameter", "tunable", "exact", "1", 1.0) for name in names.inputs]
    found += indicators
    found.append(Variable("time", "independent", "continuous", unit="s"))
    refuse_clashes([v.name for v in found])
    return found, first


def _depends(model: StateSpace, states: Bools, inputs: Bools, ports: Bools, first: int) -> list[Dependency]:
    """What a row of [A B] or [C D] with these entries depends on: inputs, states, parameters, and gains of inputs."""
    m, p, own = len(model.inputs), len(model.outputs), model.tuning
    tuned, parameters = np.zeros(len(states), dtype=bool), 0
    driven, acting = np.flatnonzero(inputs).tolist(), np.zeros(0, dtype=np.intp)
    if own is not None:
        tuned, acting = (own.of_states[ports] != 0).any(axis=0), np.unique(own.parameter[ports])
        parameters = len(own.parameters)
    return [
        *(Dependency(j, "tunable") for j in driven),
        *(Dependency(m + p + j, "tunable" if tuned[j] else "constant") for j in np.flatnonzero(states).tolist()),
        *(Dependency(first + j, "dependent") for j in acting.tolist()),
        *(Dependency(first + parameters + j, "dependent") for j in driven),
    ]
