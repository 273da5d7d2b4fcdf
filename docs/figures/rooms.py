"""Draw which room of the package imports which, as the code stands: python docs/figures/rooms.py."""

from __future__ import annotations

import ast
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "flexura"
CELL, LEFT, TOP = 26, 120, 110
DARKEST = 30
"""Imports from which on a cell is drawn in the full colour."""


def rooms() -> list[str]:
    """Rooms in the order of the import contract, top first."""
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = next(
        c["layers"]
        for c in config["tool"]["importlinter"]["contracts"]
        if c["type"] == "layers" and "containers" not in c
    )
    return [layer.removeprefix("flexura.") for layer in layers]


def imports() -> Counter[tuple[str, str]]:
    """How many import statements of one room name another, those for type checking included."""
    found: Counter[tuple[str, str]] = Counter()
    for path in SOURCE.rglob("*.py"):
        room = path.relative_to(SOURCE).parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module == "flexura":
                modules = [f"flexura.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                modules = [node.module or ""]
            elif isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            else:
                continue
            parts = [module.split(".") for module in modules]
            found.update((room, p[1]) for p in parts if p[0] == "flexura" and len(p) > 1 and p[1] != room)
    return found


def draw() -> str:
    """Rows import from columns; a number of statements in every cell."""
    order, counts = rooms(), imports()
    width, height = LEFT + CELL * len(order) + 20, TOP + CELL * len(order) + 20
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}"'
        ' font-family="sans-serif" font-size="13">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    for k, room in enumerate(order):
        x, y = LEFT + CELL * k, TOP + CELL * k
        lines += [
            f'<text x="{LEFT - 8}" y="{y + 18}" text-anchor="end" fill="#222">{room}</text>',
            f'<text transform="translate({x + 17} {TOP - 8}) rotate(-60)" fill="#222">{room}</text>',
            f'<rect x="{x}" y="{y}" width="{CELL}" height="{CELL}" fill="#ddd"/>',
        ]
        lines.append(f'<path d="M{LEFT} {y}h{CELL * len(order)}M{x} {TOP}v{CELL * len(order)}" stroke="#eee"/>')
    for (room, other), count in sorted(counts.items()):
        if room in order and other in order:
            row, column = order.index(room), order.index(other)
            x, y = LEFT + CELL * column, TOP + CELL * row
            share = 0.25 + 0.75 * min(1.0, count / DARKEST)
            ink = "white" if share > 0.6 else "#222"
            lines += [
                f'<rect x="{x + 1}" y="{y + 1}" width="{CELL - 2}" height="{CELL - 2}" fill="#22344e"'
                f' fill-opacity="{share:.2f}"/>',
                f'<text x="{x + CELL / 2:g}" y="{y + 18}" text-anchor="middle" font-size="11" fill="{ink}">'
                f"{count}</text>",
            ]
    return "\n".join([*lines, "</svg>"]) + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("rooms.svg").write_text(draw(), encoding="utf-8")
