"""A plant that knows its pose as a unit: polynomials over the stroke, and how far a step of its integrator goes."""

from __future__ import annotations

import numpy as np

from flexura.analysis import ScheduledPlant
from flexura.arrays import Array, Bools
from flexura.errors import OptionError
from flexura.io.fmu.code import c_doubles, c_integers, c_sizes, ordinary
from flexura.io.fmu.unit import Unit, ordinary_times
from flexura.io.fmu.variables import Dependency, Variable, Variables, listed
from flexura.tables import ends, percent, quantity

STEP_ERROR = 1e-8
"""Error of a step of the integrator, relative."""

FINE = 1e-3
"""What a displacement is absolutely known to, over that error and the stroke; rates are to one."""

LONGEST = 0.9
"""Angle by which the fastest motion turns in the longest step, rad; from 0.997 on vibrations would grow."""

SHARE = 0.01
"""Energy of each deviation over that of the motion along the stroke, in ordinary sizes."""

SLACK = 2e-9
"""By how much the event indicators of a stroke begin beyond its ends, over the stroke."""

LOOKED_AT = 65
"""Poses at which the fastest motion is looked for."""


def posed_unit(plant: ScheduledPlant) -> Unit:
    """A plant that knows its pose as a unit, at rest without inputs at first, or in the middle of its stroke where
    nothing rests without. Raises OptionError for names that clash."""
    family, (low, high) = plant.family, plant.family.ends
    middle = plant.state_space((low + high) / 2)
    initial, where = _at_first(plant)
    x, y = _sizes(plant)
    unit = family.unit
    indicators = [
        Variable(f"{family.parameter} {text}", "local", "continuous", "calculated", unit)
        for text in ("above its lowest", "below its highest")
    ]
    found, first = listed(plant, (initial, x, y), [], indicators, is_discrete=False)
    at = first + len(plant.inputs)
    notes = [
        *plant.notes,
        *(f"warning: {w}" for w in plant.warnings),
        f"off by at most {percent(plant.error, 2)} in responses up to {plant.up_to:.4g} Hz; inertia forces left out"
        f" below 1 % up to {_speed(plant)}",
        f"in co-simulation steps of Dormand and Prince, order 5, with a relative error of {STEP_ERROR:g} each",
        where,
    ]
    return Unit(
        plant.name,
        notes,
        Variables(found, *_dependencies(plant, first), first, (at, at + 1)),
        ("posed.c", "posed.h"),
        _data(plant, initial, x),
        None,
        ordinary_times(middle.A),
    )


def _speed(plant: ScheduledPlant) -> str:
    return quantity(plant.speed, f"{plant.family.unit}/s", 3)


def _at_first(plant: ScheduledPlant) -> tuple[Array, str]:
    """States (2r,) at first, and what they are."""
    family = plant.family
    r = family.samples.M.shape[-1]
    try:
        return np.append(family.resting(np.zeros(len(plant.inputs))), np.zeros(r)), "at first at rest without inputs"
    except OptionError:
        start = np.zeros(2 * r)
        start[0] = sum(family.ends) / 2
        return start, f"at first in the middle of the stroke, where nothing holds it: {family.text(start[0])}"


def _sizes(plant: ScheduledPlant) -> tuple[Array, Array]:
    """Ordinary sizes (2r,), (p,) of states and outputs: p moves over its stroke with the energy that this takes, and
    each deviation has a hundredth of it."""
    family, (low, high) = plant.family, plant.family.ends
    own, stroke = family.samples, high - low
    M, K = (np.abs(np.diagonal(matrix, axis1=1, axis2=2)).max(axis=0) for matrix in (own.M, own.K))
    energy = max(float(np.abs(own.force).max()) * stroke, float(K[0]) * stroke**2)
    parts = energy * np.repeat([1.0, SHARE], [1, len(M) - 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.sqrt(np.concatenate([parts / K, parts / M]))
    x[0] = stroke
    poses = [plant.state_space(at) for at in (low, (low + high) / 2, high)]
    y = np.max([np.abs(about.C) @ x for about in poses], axis=0)
    return ordinary(x), ordinary(y + np.abs(own.readings).max(axis=0) * (family.derivative == 0))


def _dependencies(plant: ScheduledPlant, first: int) -> tuple[dict[int, list[Dependency]], dict[int, list[Dependency]]]:
    """What outputs and derivatives depend on, by value references."""
    family, m, p = plant.family, len(plant.inputs), len(plant.outputs)
    r = family.samples.M.shape[-1]

    def on(inputs: Bools, states: range) -> list[Dependency]:
        driven = np.flatnonzero(inputs).tolist()
        every = [*driven, *(m + p + k for k in states), *(first + k for k in driven)]
        return [Dependency(k, "dependent") for k in every]

    direct = (family.D != 0) | (family.derivative == 2)[:, None]
    direct |= (np.abs(family.samples.residual).max(axis=0) > 0) & (family.derivative == 0)[:, None]
    outputs = {m + i: on(direct[i], range(2 * r)) for i in range(p)}
    rates = {m + p + 2 * r + i: [Dependency(m + p + r + i, "constant")] for i in range(r)}
    forced = {m + p + 3 * r + i: on(np.ones(m, dtype=bool), range(2 * r)) for i in range(r)}
    return outputs, rates | forced


def _data(plant: ScheduledPlant, initial: Array, nominal: Array) -> str:
    """`model.c` of the plant."""
    family, (low, high) = plant.family, plant.family.ends
    own, count = family.samples, len(family.points)
    r, m, p = own.M.shape[-1], len(plant.inputs), len(plant.outputs)
    K = own.K.copy()
    K[:, :, 0] = 0.0
    whole = (own.M, own.C, K, own.B, own.rows, own.residual, own.readings, own.swing, family.slopes(own.rows))
    flat = family.coefficients(np.hstack([values.reshape(count, -1) for values in whole]))
    sizes = STEP_ERROR * (high - low) * np.repeat([FINE, 1.0], r)
    fastest = max(np.abs(plant.state_space(float(at)).poles()).max() for at in np.linspace(low, high, LOOKED_AT))
    limits = (low, high, SLACK * (high - low), LONGEST / fastest, STEP_ERROR, min(plant.speed, 1e300))
    numbers = (r, m, p, count, *(repr(float(own_limit)) for own_limit in limits))
    doubles = {
        "flat": flat.ravel(),
        "force": family.force_coefficients,
        "direct": family.D.ravel(),
        "size": sizes,
        "initial": initial,
        "nominal": nominal,
        "start": np.zeros(0),
    }
    told = (
        f"{family.parameter} leaves the stroke, {ends(family.ends, family.unit)}, and the motion ends there",
        f"{family.parameter} moves faster than {_speed(plant)}: inertia forces of modes that change with the pose,"
        " which are left out, are more than 1 %",
    )
    lines = [
        '#include "dynamics.h"\n#include "posed.h"\n',
        c_integers("derivative", family.derivative),
        *(c_doubles(name, values) for name, values in doubles.items()),
        f"const Posed flexura_posed = {{{', '.join(map(str, numbers))}, derivative, flat, force, direct, size}};",
        c_sizes((2 * r, m, p, 0), 2, 0.0, SLACK * (high - low), "initial", told),
    ]
    return "\n".join(lines) + "\n"
