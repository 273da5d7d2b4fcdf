"""Text in lines that fit: measured in the type that is written, words that are too long cut between letters."""

from __future__ import annotations

import re
from functools import lru_cache

from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

SPARE = 1.03
"""How much wider letters may become that are fitted to pixels."""

CUT = " ..."
"""What ends the last line of a text that is longer."""


def wrapped(text: str, width: float, size: float, most: int, weight: str = "normal") -> list[str]:
    """At most so many lines of a text, none wider than a width in inches in type of a size in points."""
    room = 72 * width / (SPARE * size)
    words = [word for word in re.split(r"[ \t\n]+", text) if word]
    lines = [""] if words else []
    for word in words:
        rest = word if not lines[-1] else f" {word}"
        if _width(lines[-1] + rest, weight) > room and lines[-1]:
            lines.append("")
            rest = word
        while rest:
            count = _fitting(lines[-1] + rest, room, weight) - len(lines[-1])
            lines[-1] += rest[:count]
            rest = rest[count:]
            lines += [""] if rest else []
        if len(lines) > most:
            last = lines[most - 1]
            return [*lines[: most - 1], last[: _fitting(last, room - _width(CUT, weight), weight)].rstrip() + CUT]
    return lines


def _fitting(text: str, room: float, weight: str) -> int:
    """How many letters of a text, one at least, fit into a room in sizes of the type."""
    if _width(text, weight) <= room:
        return len(text)
    low, high = 1, len(text)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _width(text[:middle], weight) <= room else (low, middle)
    return low


@lru_cache(maxsize=4096)
def _width(text: str, weight: str) -> float:
    """Width of a text over the size of its type."""
    return text_to_path.get_text_width_height_descent(text, FontProperties(size=1.0, weight=weight), False)[0]
