"""What an FMU is of: variables, C sources and their data, whichever model it was made from."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from flexura.arrays import Array
from flexura.io.contents import notes_of
from flexura.io.fmu.code import blocks_of, model_data, pole_sizes, refuse_unfit
from flexura.io.fmu.variables import Variables, variables_of
from flexura.systems import StateSpace

COMMON = ("unit.c", "unit.h", "values.c", "instance.h", "clock.c", "clock.h", "dynamics.h")
"""C files of every unit."""


@dataclass(frozen=True)
class Unit:
    """A model as an FMU has it: `own` are the C files of its equations, with their headers, `data` the text of
    `model.c`, `dt` the step of a model in steps, s, and `experiment` an ordinary stop time and step, s."""

    name: str
    notes: list[str]
    variables: Variables
    own: tuple[str, ...]
    data: str
    dt: float | None
    experiment: tuple[float, float] | None

    def compiled(self, version: int) -> tuple[str, ...]:
        """Names of the C files that a version of FMI compiles."""
        return (f"fmi{version}.c", *(name for name in (*COMMON, *self.own) if name.endswith(".c")), "model.c")

    def sources(self, token: str, version: int) -> dict[str, str]:
        """All C files by name: fixed ones, and `model.c` with the numbers of the model."""
        folder = files("flexura.io.fmu") / "sources"
        names = (f"fmi{version}.c", f"fmi{version}.h", *COMMON, *self.own)
        fixed = {name: (folder / name).read_text(encoding="utf-8") for name in names}
        return {**fixed, "model.h": f'#define MODEL_TOKEN "{token}"\n', "model.c": self.data}


def linear_unit(model: StateSpace) -> Unit:
    """A linear model as a unit. Raises OptionError for what none can stand for, and names that clash."""
    refuse_unfit(model)
    times = (1000 * model.dt, model.dt) if model.dt is not None else ordinary_times(model.A)
    return Unit(
        model.name,
        notes_of(model),
        variables_of(model),
        ("linear.c", "step.c", "step.h"),
        model_data(model),
        None if model.dt is None else float(model.dt),
        None if times is None else (float(f"{times[0]:.6g}"), float(times[1])),
    )


def ordinary_times(A: Array) -> tuple[float, float] | None:
    """Ten periods of the slowest motion, s, in steps of a twentieth of that of the fastest; None where none moves."""
    speed = pole_sizes(A, blocks_of(A))
    speed = speed[speed > 0]
    if not len(speed):
        return None
    stop, step = (float(f"{2 * np.pi * k:.1e}") for k in (10 / speed.min(), 0.05 / speed.max()))
    return stop, step
