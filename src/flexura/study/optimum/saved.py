"""A design as a model file on top of the one that was varied."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from flexura.expressions import NUMBER
from flexura.files import write_file
from flexura.mechanism import Mechanism, parameter_dimensions
from flexura.modelfile import Changed, variant_text
from flexura.units import format_quantity


def save_design(
    mechanism: Mechanism,
    values: Mapping[str, float],
    starts: Mapping[str, float],
    said: str,
    path: Path,
    base: Path,
) -> Path:
    """Write a model file `path` that extends `base` with SI values of parameters; the source of each that has a start
    says what it comes from: what was `said`, the value before, and the source that this had."""
    described = mechanism.parameters
    dimensions = parameter_dimensions(described)
    changed = {}
    for name, value in values.items():
        known = described[name].source
        source = known
        if name in starts or not starts:
            was = format_quantity(starts[name], dimensions[name] or NUMBER) if name in starts else ""
            source = said + (f"; was {was}" if was else "") + (f" ({known})" if known else "")
        changed[name] = Changed(value, source)
    text = variant_text(mechanism, f"{mechanism.name}, optimised", base, path, changed)
    return write_file(path, lambda file: file.write_text(text, encoding="utf-8", newline="\n"))
