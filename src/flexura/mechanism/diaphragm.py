"""Diaphragms: thin rings in a plane that guide a hub in a rim."""

from __future__ import annotations

from flexura.mechanism.base import Direction, Part
from flexura.mechanism.quantity import NonNegativeNumber, PositiveLength


class Diaphragm(Part):
    """A flat ring between a rigid rim and a rigid hub, by plate theory.

    Its centre is at the node of the hub, in the middle of its thickness; the node of the rim reaches it by a rigid arm.
    """

    nodes: tuple[str, str]
    """The node of the rim, and that of the hub."""
    material: str
    """A name from `materials`, or of the catalogue."""
    normal: Direction = (0.0, 0.0, 1.0)
    """Normal of its plane."""
    rim_diameter: PositiveLength
    """Diameter inside which it is free."""
    hub_diameter: PositiveLength
    """Diameter outside which it is free."""
    thickness: PositiveLength
    loss_factor: NonNegativeNumber | None = None
    """Structural loss factor; None takes the material's."""
