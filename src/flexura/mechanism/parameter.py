"""Named parameters of a description."""

from __future__ import annotations

from flexura.mechanism.base import Part
from flexura.mechanism.quantity import AnyQuantity


class Parameter(Part):
    """A named value, or an expression over other parameters, with bounds and a note on its origin."""

    value: AnyQuantity
    minimum: AnyQuantity | None = None
    maximum: AnyQuantity | None = None
    unit: str = ""
    """SI unit of the value, e.g. `m` or `kg*m**-1*s**-2`; a file sets it from the text, Python may leave it out."""
    source: str = ""
    """Where the value comes from: measured, assumed, calibrated, or a reference."""
