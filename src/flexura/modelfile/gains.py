"""Gains of controllers in a model file: numbers with units, or expressions over parameters, and their units noted."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from flexura.errors import ExpressionError
from flexura.expressions import Dimension, Expression
from flexura.mechanism import GAINS
from flexura.modelfile.parameters import entries, measure
from flexura.modelfile.quantities import QuantityReader


def prepare_gains(data: dict[str, Any], dimensions: Mapping[str, Dimension | None]) -> None:
    """Write gains out in full, in place: `integral: 40 N/m/s` is `{value: 40, unit: N/m/s}`. What cannot be read is
    left for validation to report."""
    reader = QuantityReader(dimensions)
    for _, entry in entries(data, "controllers"):
        for key in GAINS if isinstance(entry, dict) else ():
            raw = entry.get(key)
            if raw is None or isinstance(raw, dict | bool):
                continue
            with suppress(ExpressionError):
                value, dimension = measure(reader, raw)
                if dimension is None and isinstance(value, Expression):
                    dimension = value.dimension(dimensions)
                entry[key] = {"value": value, "unit": "" if dimension is None else dimension.unit() or "1"}
