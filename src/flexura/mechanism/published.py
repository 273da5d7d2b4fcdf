"""Numbers that others give of a mechanism: in a paper, a handbook, a closed form."""

from __future__ import annotations

from typing import Annotated

from pydantic import StringConstraints

from flexura.mechanism.base import Part
from flexura.mechanism.corrections import RootKind
from flexura.mechanism.quantity import PositiveNumber
from flexura.mechanism.studies import Question


class PublishedValue(Part):
    """A number that a source gives, and how near to it the mechanism is to be."""

    ask: Question
    """What the number is of, as studies ask it, e.g. `stiffness(stage.x)`, or a formula over such names."""
    value: Question
    """The number with its unit, or the closed form over parameters, e.g. `24 * E * I / length^3`."""
    within: PositiveNumber = 0.01
    """Largest difference, relative to the number."""
    root: RootKind = "elastic"
    """`rigid` for a number that takes all joints as rigid, as closed forms of beams do."""
    source: Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=2000)]
    """Author, year, equation or table; what it holds for."""
