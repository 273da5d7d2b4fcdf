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


def rounded(points: list[tuple[float, float]], radius: float) -> list[Piece]:
    """Corners anticlockwise about the part, with fillets where it turns in."""
    pieces: list[Piece] = []
    for k, (x, y) in enumerate(points):
        (ax, ay), (bx, by) = points[k - 1], points[(k + 1) % len(points)]
        u, v = (x - ax, y - ay), (bx - x, by - y)
        turn = math.atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1])
        if turn > -1e-9 or radius == 0:
            pieces.append((x, y, 0.0))
            continue
        d = radius * math.tan(-turn / 2)
        p, q = d / math.hypot(*u), d / math.hypot(*v)
        pieces += [(x - p * u[0], y - p * u[1], math.tan(turn / 4)), (x + q * v[0], y + q * v[1], 0.0)]
    return pieces


def united(
    boxes: list[tuple[float, float, float, float]], radius: float, turn: float = 0.0, more: object = None
) -> list[list[Piece]]:
    """The union of boxes (x0, y0, x1, y1) and of `more`, with fillets in its inner corners, turned, deg."""
    import shapely
    from shapely import affinity

    parts = [shapely.box(*box) for box in boxes] + ([] if more is None else [more])
    whole = affinity.rotate(shapely.union_all(parts), turn, origin=(0, 0)).simplify(1e-9)
    rings = [whole.exterior, *whole.interiors]
    loops = []
    for k, ring in enumerate(rings):
        corners = list(ring.coords)[:-1]
        if ring.is_ccw != (k == 0):
            corners.reverse()
        loops.append(rounded(corners, radius))
    return loops


def circle(x: float, y: float, diameter: float) -> list[Piece]:
    return [(x - diameter / 2, y, 1.0), (x + diameter / 2, y, 1.0)]


def bridge(radius: float, turn: float = 0.0) -> list[list[Piece]]:
    """C: bridge amplifier: base below, output above, two inputs at the sides, four tilted arms on hinges 4 x 0.5."""
    import shapely

    blocks = [(-7, 0, 7, 7), (-7, 23, 7, 30), (-38, 9, -30, 21), (30, 9, 38, 21)]
    hinges, arms = [], []
    for sx in (-1, 1):
        for up in (False, True):
            inner, outer = (4.0, 12.0) if not up else (26.0, 18.0)
            for x0, y in ((7, inner), (26, outer)):
                x = sorted((sx * x0, sx * (x0 + 4)))
                hinges.append((x[0], y - 0.25, x[1], y + 0.25))
            sides = ((11, inner - 2), (11, inner + 2), (26, outer + 2), (26, outer - 2))
            arms.append(shapely.Polygon([(sx * x, y) for x, y in sides]))
    loops = united([*blocks, *hinges], radius, turn, shapely.union_all(arms))
    return [*loops, circle(*_turned(-3.5, 3, turn), 3), circle(*_turned(3.5, 3, turn), 3)]


def _turned(x: float, y: float, turn: float) -> tuple[float, float]:
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    return c * x - s * y, s * x + c * y


def folded(radius: float) -> list[list[Piece]]:
    """D: stage on folded leaves 24 x 0.4: from the base to a bar, and back to the stage, on both sides."""
    base, stage = [(0, 0, 50, 6), (0, 6, 6, 12), (44, 6, 50, 12)], [(17, 14, 33, 32)]
    bars = [(0, 40, 12, 44), (38, 40, 50, 44)]
    leaves = [(2, 12, 2.4, 40), (47.6, 12, 48, 40), (9, 17, 9.4, 40), (40.6, 17, 41, 40)]
    shelf = [(8, 14, 17, 17), (33, 14, 42, 17)]
    return [*united([*base, *stage, *bars, *leaves, *shelf], radius), circle(25, 23, 8)]


def elliptic(drawing: object) -> None:
    """E: guide as A, whose notches are half ellipses 8 long and 2.8 deep, with webs of 0.4; holes in its blocks."""
    space = drawing.modelspace()  # pyright: ignore[reportAttributeAccessIssue]
    size, wide, arm, a, b = (70, 40), (12, 58), 6.0, 4.0, 2.8
    for y0, out in ((0.0, 1), (arm, -1), (40 - arm, 1), (40.0, -1)):
        begin, end = (0, size[0]) if y0 in (0.0, 40.0) else wide
        x = [begin, 18 - a, 18 + a, 52 - a, 52 + a, end]
        for p, q in ((0, 1), (2, 3), (4, 5)):
            space.add_line((x[p], y0), (x[q], y0))
        for c in (18, 52):
            first = 0 if out > 0 else math.pi
            space.add_ellipse((c, y0), (a, 0), b / a, first, first + math.pi)
    for x, low, high in ((0, 0, 40), (size[0], 0, 40), (wide[0], arm, 40 - arm), (wide[1], arm, 40 - arm)):
        space.add_line((x, low), (x, high))
    for x in (6, 64):
        for y in (10, 30):
            space.add_circle((x, y), 2.5)
