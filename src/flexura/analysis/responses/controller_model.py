"""Controllers of a mechanism as models of their own, in steps as they are sampled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis.responses.closed_loop import each_loop
from flexura.arguments import verb
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism, evaluated
from flexura.structure import Channel, FullOrderModel, Plan
from flexura.systems import Filter, StateSpace, filter_of, system
from flexura.tables import in_hz, quantity

NEAR = 0.01
"""Difference of a controller in steps from the one described, relative, up to which it is told to follow it."""


@verb
def controller_model(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    controller: str | None = None,
    dt: float | None = None,
) -> StateSpace:
    """A controller that is described, as a state space from reading and reference to command.

    A sampled one is in steps of its `sample_time`, one that is not in steps of `dt`, s, or continuous without. Steps
    are those of the triangle hold, which adds no phase and keeps poles, and of a dead time that is no whole number of
    steps the command over each is the mean that the described one has (theory eqs. X20-X21); `notes` say up to which
    frequency it is that controller. Its output is to be held over each step: the hold is not in it. `controller`
    may be left out of a single one, and the copies of one with wildcards are numbered. Positive position feedback has
    no reference.

    Raises ModelError, and OptionError for names that are not there and for a step beside a sample time.
    """
    if isinstance(model, Mechanism):
        model = plan_of(model, parameters)
    plan = model if isinstance(model, Plan) else model.plan
    values = plan.parameter_values(parameters if isinstance(model, Plan) else model.parameters)
    described = plan.mechanism.controllers
    loops = each_loop({key: evaluated(own, values) for key, own in described.items()}, plan)
    name = next(iter(loops)) if controller is None and len(loops) == 1 else controller
    if name is None or name not in loops:
        wrong = "name one" if name is None else f"there is no controller {name!r}"
        raise OptionError(f"{wrong}; known: {', '.join(loops) or 'none, describe `controllers`'}")
    own, of = loops[name], filter_of(loops[name])
    if dt is not None and of.sample_time is not None:
        raise OptionError(f"{name} is sampled every {quantity(of.sample_time, 's')}: its steps are these")
    ends = system(model, parameters, inputs=[own.actuator], outputs=[own.sensor], order="full")
    reading = ends.outputs[0].quantity
    named = {f"{name}.reading": of.sign} | ({f"{name}.reference": 1.0} if of.sign < 0 else {})
    A, B, C, D = of.matrices
    one = StateSpace(
        A, B, C, D, (Channel("error", reading),), (Channel(f"{name}.command", ends.inputs[0].quantity),),
        tuple(f"{name} state {k + 1}" for k in range(len(A))), None, of.delay, name,
        (f"controller {name} of {plan.mechanism.name}",),
    )  # fmt: skip
    step = of.sample_time or dt
    one = one if step is None else _in_steps(one, of, step)
    signs = np.array([list(named.values())])
    return replace(one, B=one.B @ signs, D=one.D @ signs, inputs=tuple(Channel(key, reading) for key in named))


def _in_steps(one: StateSpace, of: Filter, dt: float) -> StateSpace:
    """A controller of one input, e, in steps; its dead time in whole steps and a mean of two."""
    whole, part = divmod(of.delay / dt, 1.0)
    if min(part, 1 - part) < 1e-9:
        whole, part = np.round(of.delay / dt), 0.0
    plain = one.discretised(dt, "foh", delay=0.0)
    A, B, C, D = plain.A, plain.B, plain.C, plain.D
    states, late = list(one.state_names), int(whole) + bool(part)
    if late:  # commands of the steps before, the last one first
        n = len(A)
        A = np.block([[A, np.zeros((n, late))], [C, np.zeros((1, late))], [np.eye(late - 1, n + late, k=n)]])
        B = np.vstack([B, D, np.zeros((late - 1, 1))])
        weights = np.eye(late + 1)[int(whole)] * (1 - part) + np.eye(late + 1)[late] * part
        C, D = np.hstack([weights[0] * C, weights[None, 1:]]), weights[0] * D
        states += [f"{one.name} command {k} steps before" for k in range(1, late + 1)]
    model = replace(one, A=A, B=B, C=C, D=D, state_names=tuple(states), dt=dt, delay=0.0)
    hz = np.geomspace(1e-4, 0.4999, 2000) / dt
    K = model.frequency_response(hz)[:, 0, 0]
    described = Filter(of.sections, of.gain, of.sign, of.delay, None, of.pade).response(hz)
    off = np.abs(K - described) > NEAR * np.abs(described)
    up_to = hz[np.argmax(off)] if off.any() else hz[-1]
    fast = max((w for _, _, w in of.sections), default=0.0)
    warnings: tuple[Diagnostic, ...] = ()
    if fast * dt > np.pi:
        hertz = fast / (2 * np.pi)
        text = (
            f"{one.name} has a filter at {in_hz(hertz)}, above half its rate of samples, {in_hz(0.5 / dt)}: steps do"
            " not follow it"
        )
        warnings = (Diagnostic("tolerance", one.name, hertz, 0.5 / dt, "Hz", text),)
    notes = (*one.notes, f"in steps of {quantity(dt, 's')}, within 1 % of it up to {in_hz(up_to)}, the hold left out")
    return replace(model, notes=notes, warnings=warnings)
