"""How a mechanism is reduced where nothing else is asked for."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from flexura.mechanism.base import Part, refuse


class Reduction(Part):
    """One of three ways: to a proven relative error, to constraint modes alone, or with a number of kept modes."""

    tolerance: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Relative error that what is asked for is proven to."""
    constraint_modes: bool = False
    """Constraint modes alone, as in the RPR paper."""
    keep: Annotated[int, Field(ge=0)] | dict[str, Annotated[int, Field(ge=0)]] | None = None
    """Normal modes kept in each substructure, or by the substructure's name."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.tolerance is not None) + self.constraint_modes + (self.keep is not None) != 1:
            raise refuse("several, or none, are given: a reduction is one of tolerance, constraint_modes: true, keep")
        return self
