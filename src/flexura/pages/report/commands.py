"""The command that makes a number again: as a shell takes it, or as Python does where no file is known."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from flexura.mechanism import Layout, Mechanism, command_of, is_rotation, matching, parameter_dimensions
from flexura.units import format_number, format_quantity

POSED = {"displacement": "m", "rotation": "rad", "expansion": "m", "voltage": "V", "force": "N", "moment": "N*m"}


@dataclass(frozen=True)
class Commands:
    """What makes numbers of one mechanism again, with its parameters and its pose as a command line has them."""

    file: Path | None
    settings: tuple[str, ...]
    pose: tuple[str, ...]

    @staticmethod
    def of(
        mechanism: Mechanism, file: Path | None, parameters: Mapping[str, float], at: Mapping[str, float]
    ) -> Commands:
        """Those of a mechanism from a file, with parameters and a pose in SI."""
        dimensions = parameter_dimensions(mechanism.parameters)
        settings = [f"{name}={_quantity(value, dimensions.get(name))}" for name, value in parameters.items()]
        actuators = Layout(mechanism).actuators()
        pose = []
        for name, value in at.items():
            own = next((command_of(actuators[key]) for key in matching(name, actuators)), None)
            kind = own or ("rotation" if is_rotation(name) else "displacement")
            pose.append(f"{name}={format_number(value)} {POSED[kind]}")
        return Commands(file, tuple(settings), tuple(pose))

    def __call__(self, verb: str, options: Sequence[str] = (), python: str = "", *, posed: bool = True) -> str:
        """The command of a verb with its options; `python` are the same options as arguments. Verbs that know of no
        pose go without."""
        if self.file is None:
            given = ", ".join(part for part in ("mechanism, parameters", python) if part)
            return f"fx.{verb.replace('-', '_')}({given})"
        words = ["flexura", verb, str(self.file), *options]
        for setting in self.settings:
            words += ["--set", setting]
        for own in self.pose if posed else ():
            words += ["--at", own]
        return shlex.join(words)


def _quantity(value: float, dimension: object) -> str:
    return format_number(value) if dimension is None else format_quantity(value, dimension)  # type: ignore[arg-type]
