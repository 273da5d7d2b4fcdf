"""A calibrated mechanism as a model file on top of the one that was calibrated."""

from __future__ import annotations

from pathlib import Path

from flexura.arguments import verb
from flexura.expressions import NUMBER
from flexura.files import write_file
from flexura.mechanism import parameter_dimensions
from flexura.modelfile import Changed, variant_text
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
    described = mechanism.parameters
    dimensions = parameter_dimensions(described)
    moved = {p.name: p for p in calibration.parameters if p.name in own.free}
    changed = {}
    for name, value in own.point(calibration.values).items():
        at_bound = name not in moved or moved[name].at_bound
        comment = ""
        if name in moved:
            exponents = dimensions[name] or NUMBER
            low, high = (format_quantity(float(f"{x:.3g}"), exponents) for x in moved[name].interval)
            comment = f"95 %: {low} to {high}" + (", at its bound" if moved[name].at_bound else "")
        rounded = value if at_bound else float(f"{value:.{DIGITS}g}")
        changed[name] = Changed(rounded, described[name].source, comment)
    text = variant_text(mechanism, f"{mechanism.name}, calibrated", Path(base), Path(path), changed)
    return write_file(Path(path), lambda file: file.write_text(text, encoding="utf-8", newline="\n"))
