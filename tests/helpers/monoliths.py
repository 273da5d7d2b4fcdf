"""Drawings of two guides that are cut from one block, as segments in mm, and files of them."""

from __future__ import annotations

import math
from pathlib import Path

Piece = tuple[float, float, float]
"""A corner, and the bulge of the side that follows it."""


def notched_window() -> list[list[Piece]]:
    """A: block 60 x 40 with a window; arms 6.3 high, right-circular notches of radius 3 and web 0.3 at x = 16, 44."""
    half = -1.0  # a half circle into the material
    outer = [(0, 0, 0), (13, 0, half), (19, 0, 0), (41, 0, half), (47, 0, 0), (60, 0, 0)]
    outer += [(60, 40, 0), (47, 40, half), (41, 40, 0), (19, 40, half), (13, 40, 0), (0, 40, 0)]
    # seen along the hole anticlockwise, material is outside: its arcs bulge outwards
    inner = [(10, 6.3, 0), (13, 6.3, 1.0), (19, 6.3, 0), (41, 6.3, 1.0), (47, 6.3, 0), (50, 6.3, 0)]
    inner += [(50, 33.7, 0), (47, 33.7, 1.0), (41, 33.7, 0), (19, 33.7, 1.0), (13, 33.7, 0), (10, 33.7, 0)]
    return [outer, inner]


def leaf_guide() -> list[list[Piece]]:
    """B: two blocks 8 x 30, two leaves 20 x 0.5 with sharp corners."""
    outer = [(0, 0), (8, 0), (8, 2), (28, 2), (28, 0), (36, 0), (36, 30), (28, 30), (28, 28), (8, 28), (8, 30), (0, 30)]
    inner = [(8, 2.5), (28, 2.5), (28, 27.5), (8, 27.5)]
    return [[(x, y, 0.0) for x, y in points] for points in (outer, inner)]


GUIDES = {"A": notched_window(), "B": leaf_guide()}


def arc(a: Piece, b: Piece) -> tuple[float, float, float, float, float]:
    """Centre, radius, and the angles, deg, from which and to which it runs anticlockwise."""
    bulge = a[2]
    k = (1 - bulge**2) / (4 * bulge)
    cx, cy = (a[0] + b[0]) / 2 - k * (b[1] - a[1]), (a[1] + b[1]) / 2 + k * (b[0] - a[0])
    angles = [math.degrees(math.atan2(p[1] - cy, p[0] - cx)) for p in (a, b)]
    if bulge < 0:
        angles.reverse()
    return cx, cy, math.hypot(a[0] - cx, a[1] - cy), *angles


def drawn(loops: list[list[Piece]], kind: str, folder: Path) -> Path:
    """A DXF of lines and arcs or of polylines with bulges, or an SVG with a path, in mm."""
    if kind == "svg":
        data = []
        for points in loops:
            text = f"M {points[0][0]} {-points[0][1]}"
            for a, b in zip(points, [*points[1:], points[0]], strict=True):
                if a[2]:
                    r = arc(a, b)[2]
                    text += f" A {r} {r} 0 {int(abs(a[2]) > 1)} {int(a[2] < 0)} {b[0]} {-b[1]}"
                else:
                    text += f" L {b[0]} {-b[1]}"
            data.append(text + " Z")
        path = folder / "part.svg"
        body = f'<path d="{" ".join(data)}"/>'
        head = '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 -100 100 100">'
        path.write_text(f"{head}{body}</svg>")
        return path
    import ezdxf

    document = ezdxf.new()
    document.units = ezdxf.units.MM
    space = document.modelspace()
    for points in loops:
        if kind == "polyline":
            space.add_lwpolyline(points, format="xyb", close=True)
            continue
        for a, b in zip(points, [*points[1:], points[0]], strict=True):
            if a[2]:
                cx, cy, r, first, last = arc(a, b)
                space.add_arc((cx, cy), r, first, last)
            else:
                space.add_line(a[:2], b[:2])
    document.saveas(folder / "part.dxf")
    return folder / "part.dxf"
