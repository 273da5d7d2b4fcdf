"""Outlines in a plane: corners, the lines and arcs that lead to them, and holes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, NamedTuple, Self

from pydantic import Discriminator, Field, Tag, model_validator

from flexura.errors import ModelError, Problem
from flexura.mechanism.base import Part, Text, refuse
from flexura.mechanism.quantity import Length, PositiveLength

HALF = 1e-12
"""Square of the distance of a chord from the centre, over that of the radius, up to which an arc is a half circle."""

PlanePoint = tuple[Length, Length]
"""A place in the plane."""


class Side(Part):
    """A corner that a line leads to, or an arc, through another point or of a radius."""

    to: PlanePoint
    through: PlanePoint | None = None
    radius: Length | None = None
    """Of an arc of at most a half circle, which turns left, or right where it is negative."""
    name: Text | None = None
    """Of the face that it is of a part."""

    @model_validator(mode="after")
    def _one_arc(self) -> Self:
        if self.through is not None and self.radius is not None:
            raise refuse("an arc has either a point that it goes through or a radius")
        return self


def _leads(corner: Any) -> str:
    return "side" if isinstance(corner, Mapping | Side) else "point"


Corner = Annotated[Annotated[PlanePoint, Tag("point")] | Annotated[Side, Tag("side")], Discriminator(_leads)]
Corners = Annotated[tuple[Corner, ...], Field(min_length=2, max_length=2000)]
"""Corners in order, joined by lines, or by what leads to them: the first follows the last."""


class Hole(Part):
    """A round hole."""

    centre: PlanePoint
    diameter: PositiveLength
    name: Text | None = None
    """Of the face that it is of a part."""


class Opening(Part):
    """A hole of any outline in a planar part."""

    outline: Corners


def _shape(hole: Any) -> str:
    return "opening" if isinstance(hole, Opening) or (isinstance(hole, Mapping) and "outline" in hole) else "hole"


AnyHole = Annotated[Annotated[Hole, Tag("hole")] | Annotated[Opening, Tag("opening")], Discriminator(_shape)]


class Edge(NamedTuple):
    """From where to where a side leads, m, and `through` where, where it is an arc."""

    start: tuple[float, float]
    through: tuple[float, float] | None
    end: tuple[float, float]
    name: str


def edges_of(corners: Sequence[Any]) -> list[Edge]:
    """The sides of an outline of numbers: the first leads from its first corner to the second, the last one back.

    Raises ModelError, with its place, for an arc whose radius is less than half the distance of its ends.
    """
    sides = [own if isinstance(own, Side) else Side(to=own) for own in corners]
    edges = []
    for k, own in enumerate(sides):
        there = (k + 1) % len(sides)
        led = sides[there]
        start, end = _point(own.to), _point(led.to)
        through = None if led.through is None else _point(led.through)
        if led.radius is not None:
            radius = float(led.radius)  # pyright: ignore[reportArgumentType]
            chord = math.dist(start, end)
            beyond = radius**2 - chord**2 / 4
            near = HALF * radius**2
            if beyond < -near or chord == 0.0:
                rule = f"an arc of radius {abs(1e3 * radius):.6g} mm does not reach over {1e3 * chord:.6g} mm"
                raise ModelError([Problem((there, "radius"), "", rule, "it is half the distance of its ends, or more")])
            rise = math.copysign(abs(radius) - math.sqrt(beyond if beyond > near else 0.0), radius) / chord
            middle = [(a + b) / 2 for a, b in zip(start, end, strict=True)]
            through = middle[0] + rise * (end[1] - start[1]), middle[1] - rise * (end[0] - start[0])
        edges.append(Edge(start, through, end, led.name or ""))
    return edges


def _point(at: Any) -> tuple[float, float]:
    return float(at[0]), float(at[1])
