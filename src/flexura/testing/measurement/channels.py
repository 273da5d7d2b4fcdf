"""A channel of a test: what it reads, and where."""

from __future__ import annotations

from dataclasses import dataclass

from flexura.systems import Channel


@dataclass(frozen=True)
class MeasuredChannel(Channel):
    """A channel of a test: what it reads, and where.

    `direction` (3,) is a unit vector of the global axes that has the sign of the channel in it; `position` (3,), m.
    `node` is the node's name, or its number as text. Data are SI, in the unit of the quantity.
    """

    node: str | None = None
    direction: tuple[float, float, float] | None = None
    position: tuple[float, float, float] | None = None

    @property
    def location(self) -> tuple[str | None, tuple[float, ...] | None]:
        """Node and position, m, to a nanometre: where a channel is."""
        return self.node, None if self.position is None else tuple(round(x, 9) + 0.0 for x in self.position)
