"""Colours and names of the kinds of part."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from numpy.typing import ArrayLike

from flexura.view.scene import Array, Kind

COLOURS: dict[Kind, tuple[float, float, float]] = {
    Kind.FLEXURE: (0.93, 0.42, 0.10),
    Kind.LINK: (0.42, 0.64, 0.84),
    Kind.BODY: (0.78, 0.79, 0.81),
    Kind.EQUIVALENT_BODY: (0.66, 0.70, 0.62),
    Kind.SPRING: (0.05, 0.52, 0.36),
    Kind.MASS: (0.45, 0.25, 0.60),
    Kind.SUPERELEMENT: (0.80, 0.20, 0.52),
    Kind.CLAMP: (0.30, 0.32, 0.36),
    Kind.PARTLY_HELD: (0.95, 0.80, 0.25),
    Kind.ARM: (0.20, 0.20, 0.22),
    Kind.NODE: (1.0, 1.0, 1.0),
    Kind.CENTRE: (0.10, 0.10, 0.10),
    Kind.PIEZO: (0.35, 0.75, 0.78),
    Kind.DOUBTED: (0.84, 0.05, 0.15),
    Kind.DOUBTED_BODY: (0.93, 0.45, 0.50),
    Kind.ACTUATOR: (0.60, 0.05, 0.25),
    Kind.SENSOR: (0.13, 0.30, 0.75),
    Kind.DASHPOT: (0.52, 0.30, 0.12),
}
"""Colour of each kind of part, RGB."""
NAMES: dict[Kind, str] = {
    Kind.FLEXURE: "flexure",
    Kind.LINK: "link",
    Kind.BODY: "rigid body",
    Kind.EQUIVALENT_BODY: "rigid body (box of equal inertia)",
    Kind.SPRING: "spring",
    Kind.MASS: "point mass",
    Kind.SUPERELEMENT: "superelement",
    Kind.CLAMP: "clamped",
    Kind.PARTLY_HELD: "partly held",
    Kind.ARM: "rigid arm",
    Kind.NODE: "node",
    Kind.CENTRE: "centre of mass",
    Kind.PIEZO: "piezo stack",
    Kind.DOUBTED: "member with a warning",
    Kind.DOUBTED_BODY: "rigid body with a warning",
    Kind.ACTUATOR: "actuator",
    Kind.SENSOR: "sensor",
    Kind.DASHPOT: "dashpot",
}
WIDTHS = {
    Kind.ARM: 0.8,
    Kind.SPRING: 1.2,
    Kind.DASHPOT: 1.2,
    Kind.SUPERELEMENT: 1.1,
    Kind.FLEXURE: 1.6,
    Kind.LINK: 1.0,
    Kind.DOUBTED: 1.6,
}
INK = "#22262b"
WARNING = "#8a5a00"
GHOST = (0.90, 0.91, 0.92)


def displacement_colours(share: ArrayLike) -> Array:
    """Colours (..., 3), RGB, of displacements (...) relative to the largest."""
    return colormaps["viridis"](0.04 + 0.92 * np.clip(share, 0.0, 1.0))[..., :3]


def stress_colours(share: ArrayLike) -> Array:
    """Colours (..., 3), RGB, of stresses (...) relative to the largest."""
    return colormaps["YlOrRd"](0.98 * np.clip(share, 0.0, 1.0))[..., :3]


def force_colours(share: ArrayLike) -> Array:
    """Colours (..., 3), RGB, of axial forces (...) from -1, compression, to 1, tension."""
    return colormaps["RdBu_r"](0.5 + 0.46 * np.clip(np.asarray(share, dtype=float), -1.0, 1.0)[..., None])[..., 0, :3]
