"""A design as a model file on top of the one that was varied."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from flexura.expressions import NUMBER, Expression
from flexura.files import write_file
from flexura.mechanism import Mechanism, parameter_dimensions
from flexura.modelfile import Changed, variant_text
from flexura.units import format_quantity


def save_design(
    mechanism: Mechanism, design: Mapping[str, float], fixed: Mapping[str, float], said: str, path: Path, base: Path
) -> Path:
    """Write a model file `path` that extends `base` with SI values of parameters, those of a `design` and `fixed` ones;
    the source of each says where it comes from, what was `said` of the design, the value in `base`, and its source."""
    dimensions = parameter_dimensions(mechanism.parameters)
    changed = {}
    for name, value in {**fixed, **design}.items():
        own = mechanism.parameters[name]
        exponents = dimensions[name] or NUMBER
        was = str(own.value) if isinstance(own.value, Expression) else format_quantity(own.value, exponents)
        known = f" ({own.source})" if own.source else ""
        changed[name] = Changed(value, f"{said if name in design else 'given'}; was {was}{known}")
    text = variant_text(mechanism, f"{mechanism.name}, optimised", base, path, changed)
    return write_file(path, lambda file: file.write_text(text, encoding="utf-8", newline="\n"))
