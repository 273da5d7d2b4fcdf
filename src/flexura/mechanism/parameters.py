"""Named parameters of a description."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator

from flexura.expressions import Dimension
from flexura.mechanism.base import Part, Text, refuse
from flexura.mechanism.quantity import AnyQuantity


def _coherent(unit: str) -> str:
    if unit and Dimension.of_unit(unit) is None:
        raise refuse(
            "the unit of a parameter is a coherent SI unit, e.g. m, N/m or kg*m**-3",
            "values are in SI; text with other units belongs in a model file",
        )
    return unit


HELD = (
    "held by bounds that leave one value: solid and imported parts are made for it; fidelity: beam lets sizes of a"
    " solid member vary"
)
"""What is said of a parameter that is held where it is to vary."""


class Parameter(Part):
    """A named value, or an expression over other parameters, with bounds and a note on its origin.

    Parameters compare by their numbers; `unit` only says what these are numbers of.
    """

    value: AnyQuantity
    minimum: AnyQuantity | None = None
    maximum: AnyQuantity | None = None
    unit: Annotated[str, AfterValidator(_coherent)] = ""
    """SI unit of the value, e.g. `m`, `N/m`, `kg*m**2*s**(-2)` or `1`; a file sets it from the text, Python may
    leave it out."""
    source: Text = ""
    """Where the value comes from: measured, assumed, calibrated, or a reference."""

    @property
    def dimension(self) -> Dimension | None:
        """Physical dimension by `unit`; None when it was left out."""
        return Dimension.of_unit(self.unit) if self.unit else None

    @property
    def is_held(self) -> bool:
        """Whether the bounds leave no room, as where a solid member is made for the value."""
        return self.minimum is not None and self.minimum == self.maximum

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Parameter) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        return (self.value, self.minimum, self.maximum, self.source)
