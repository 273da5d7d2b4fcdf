"""What both writers of universal files share: headers (151, 164), axes (18), codes of directions, data types, text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexura._version import __version__
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.io.uff.datasets import TURNING

LINE = 80
"""Longest line of text, in characters."""

DATA_TYPES = {
    "displacement": (8, 1, 0),
    "rotation": (8, 0, 0),
    "velocity": (11, 1, 0),
    "angular_velocity": (11, 0, 0),
    "acceleration": (12, 1, 0),
    "angular_acceleration": (12, 0, 0),
    "force": (13, 0, 1),
    "moment": (13, 1, 1),
    "expansion": (8, 1, 0),
    "stress": (2, -2, 1),
}
"""Specific data type, and exponents of length and force, of a quantity (universal file dataset 58, record 9)."""

GENERAL = (1, 0, 0)
"""Those of quantities that have no type of their own."""


def headers(name: str, description: str) -> list[dict[str, Any]]:
    """Datasets 151 and 164 of a file in SI units."""
    program = f"flexura {__version__}"
    about = {"type": 151, "model_name": text_of(name), "description": description}
    units = {"type": 164, "units_code": 1, "units_description": "SI: m, N, kg, s", "temp_mode": 1}
    return [
        {**about, "db_app": program, "program": program},
        {**units, "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15},
    ]


def text_of(text: str, length: int = LINE) -> str:
    """One line of ASCII of at most so many characters."""
    return " ".join(text.encode("ascii", "replace").decode().split())[:length] or "NONE"


def refuse_infinite(values: np.ndarray) -> None:
    """Raise OptionError for numbers that are not finite."""
    if not np.isfinite(values).all():
        raise OptionError("there are numbers that are not finite, which universal files cannot hold")


def direction_code(direction: tuple[float, ...], quantity: str, has_axes: bool) -> int:
    """+-1 to +-3 along and +-4 to +-6 about x, y, z; along or about x of axes that belong to the channel alone."""
    turns = 3 if quantity in TURNING.values() else 0
    if has_axes:
        return 1 + turns
    axis = int(np.argmax(np.abs(direction)))
    return int(np.sign(direction[axis])) * (axis + 1 + turns)


def axes_along(x: Array) -> Any:
    """Right-handed axes (3, 3), rows, whose first is along the unit vector x (3,)."""
    z = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z])


def axes_sets(axes: Mapping[int, Array]) -> list[dict[str, Any]]:
    """The dataset 18 of axes (3, 3), rows, by the number of the node that they belong to; none where there are none."""
    if not axes:
        return []
    numbers = sorted(axes)
    frames = np.array([axes[n] for n in numbers])
    names = {"cs_num": numbers, "ref_cs_num": [0] * len(numbers), "cs_name": [f"node {n}" for n in numbers]}
    places = {"ref_o": np.zeros((len(numbers), 3)), "x_point": frames[:, 0], "xz_point": frames[:, 2]}
    return [{"type": 18, **names, **places}]
