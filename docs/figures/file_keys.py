"""Draw what the keys of the mechanism file describe: python docs/figures/file_keys.py."""

from __future__ import annotations

from pathlib import Path

import file_charts
import file_parts
import file_placing

KEYS = Path(__file__).parent / "keys"
PICTURES = {own.__name__: own for own in (*file_parts.PICTURES, *file_placing.PICTURES, *file_charts.PICTURES)}

if __name__ == "__main__":
    KEYS.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        (KEYS / f"{name}.svg").write_text(draw().svg(), encoding="utf-8")
