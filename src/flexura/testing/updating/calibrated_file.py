"""A calibrated mechanism as a model file on top of the one that was calibrated."""

from __future__ import annotations

import json
import os
from pathlib import Path

from flexura.arguments import verb
from flexura.expressions import NUMBER
from flexura.files import write_file
from flexura.mechanism import parameter_dimensions
from flexura.modelfile import VERSION
from flexura.testing.updating.calibrated import Calibration
from flexura.units import format_quantity

DIGITS = 6
"""Significant digits of calibrated values."""


@verb
def save_calibrated(calibration: Calibration, path: str | Path, *, base: str | Path, configuration: int = 0) -> Path:
    """Write a model file that extends `base`, the file that was calibrated, with the new values and what they rest on.

    Values have six digits. `configuration` counts the mechanisms that were calibrated together. Raises OptionError when
    it cannot be written.
    """
    mechanism = (calibration.mechanism, *calibration.also)[configuration]
    own = calibration.problem.configurations[configuration]
    target = Path(path)
    described = mechanism.parameters
    dimensions = parameter_dimensions(described)
    above = Path(os.path.relpath(Path(base).resolve(), target.resolve().parent)).as_posix()
    name = json.dumps(f"{mechanism.name}, calibrated", ensure_ascii=False)
    lines = [f"flexura: {VERSION}", f"extends: {json.dumps(above)}", f"name: {name}", "", "parameters:"]
    moved = {p.name: p for p in calibration.parameters if p.name in own.free}
    for name, value in own.point(calibration.values).items():
        exponents = dimensions[name] or NUMBER
        at_bound = name not in moved or moved[name].at_bound
        number = format_quantity(value if at_bound else float(f"{value:.{DIGITS}g}"), exponents)
        source, comment = json.dumps(described[name].source, ensure_ascii=False), ""
        if name in moved:
            low, high = (format_quantity(float(f"{x:.3g}"), exponents) for x in moved[name].interval)
            comment = f"  # 95 %: {low} to {high}" + (", at its bound" if moved[name].at_bound else "")
        lines.append(f"  {name}: {{value: {number}, source: {source}}}{comment}")
    text = "\n".join(lines) + "\n"
    return write_file(target, lambda file: file.write_text(text, encoding="utf-8", newline="\n"))
