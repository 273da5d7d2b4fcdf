"""Outlines out of SVG files (SVG 1.1: paths, basic shapes, transforms, units)."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.files import read_text
from flexura.outlines.chaining import outline_of
from flexura.outlines.curves import as_arcs
from flexura.outlines.outline import Outline, Segment
from flexura.sizes import within

LENGTHS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6, "px": 0.0254 / 96,
    "": 0.0254 / 96, "m": 1.0, "um": 1e-6, "Q": 2.5e-4}  # fmt: skip
"""Units of lengths, m; a px is 1/96 inch (CSS 2.1, 4.3.2)."""

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
TOKEN = re.compile(rf"([A-Za-z])|({NUMBER.pattern})|([\s,]+)|(.)", re.DOTALL)
TRANSFORM = re.compile(r"\s*,?\s*(\w+)\s*\(([^)]*)\)")
ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
SKIPPED = {"defs", "symbol", "clipPath", "mask", "marker", "pattern", "text", "title", "desc", "metadata", "style",
    "script", "namedview", "image", "foreignObject", "linearGradient", "radialGradient", "filter", "use"}  # fmt: skip

Matrix = Array


@verb
def read_svg(path: str | Path, units: str | None = None) -> Outline:
    """The outline that an SVG file draws, m, y upwards.

    Paths, rectangles, circles, ellipses, lines, polylines and polygons count, with their transforms; Bezier curves and
    ellipses become arcs at most 1e-5 of their size off them. One unit of the drawing is `units`, else what `width` and
    `viewBox` make it. The layer of a segment is the `id` of the nearest group, or of itself. Raises OptionError for
    files that are no SVG or define entities, and ModelError as `outline_of`.
    """
    text = read_text(path, "drawing_bytes")
    if "<!ENTITY" in text:
        raise OptionError(f"{path}: the file defines entities, which are not read")
    try:
        root = ET.fromstring(text)
    except (ET.ParseError, ValueError) as error:
        raise OptionError(f"{path}: no SVG file, or a damaged one: {error}") from None
    if _tag(root) != "svg":
        raise OptionError(f"{path}: no SVG file: its root is <{_tag(root)}>")
    if units is not None and units not in LENGTHS:
        raise OptionError(f"units of a drawing are one of {', '.join(filter(None, LENGTHS))}, not {units!r}")
    try:
        scale = _scale(root) if units is None else np.full(2, LENGTHS[units])
        left_out: Counter[str] = Counter()
        base = np.array([[scale[0], 0.0, 0.0], [0.0, -scale[1], 0.0], [0.0, 0.0, 1.0]])
        segments: list[Segment] = []
        for own in _segments(root, base, left_out):
            segments.append(own)
            within("drawing_segments", len(segments), str(path))
    except (ValueError, IndexError) as error:
        raise OptionError(f"{path}: a damaged drawing: {error}") from None
    notes = ["left out: " + ", ".join(f"{n} {kind}" for kind, n in sorted(left_out.items()))] if left_out else []
    return outline_of(segments, notes)


def _tag(element: ET.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _length(text: str | None, otherwise: float = 0.0) -> float:
    """A length in units of the drawing."""
    return otherwise if text is None else _metres(text)[0] if not _metres(text)[1] else _physical(text)


def _metres(text: str) -> tuple[float, str]:
    match = re.fullmatch(rf"\s*({NUMBER.pattern})\s*([a-zA-Z%]*)\s*", text)
    if match is None or (match[2] and match[2] not in LENGTHS):
        raise ValueError(f"no length: {text[:40]!r}")
    return float(match[1]), match[2]


def _physical(text: str) -> float:
    value, unit = _metres(text)
    return value * LENGTHS[unit] / LENGTHS["px"]


def _scale(root: ET.Element) -> Array:
    """Metres per unit along x and y."""
    view, sizes = root.get("viewBox"), (root.get("width"), root.get("height"))
    if view is None or any(size is None or "%" in size for size in sizes):
        return np.full(2, LENGTHS["px"])
    _, _, width, height = (float(x) for x in NUMBER.findall(view))
    whole = [value * LENGTHS[unit] for value, unit in (_metres(str(size)) for size in sizes)]
    each = np.array(whole) / [width, height]
    if (root.get("preserveAspectRatio") or "").strip() != "none":
        each[:] = each.min()
    return each


def _segments(root: ET.Element, base: Matrix, left_out: Counter[str]) -> Iterator[Segment]:
    todo = [(root, base, "")]
    while todo:
        element, matrix, layer = todo.pop()
        kind = _tag(element)
        style = (element.get("style") or "").replace(" ", "")
        if kind in SKIPPED or element.get("display") == "none" or "display:none" in style:
            if kind in ("text", "use", "image", "symbol"):
                left_out[kind] += 1
            continue
        matrix = matrix @ _transform(element.get("transform"))
        layer = (element.get("id") or layer) if kind in ("g", "path") or not layer else layer
        todo += [(child, matrix, layer if kind != "svg" else "") for child in element if isinstance(child.tag, str)]
        if kind not in ("svg", "g", "a", "switch"):
            yield from _placed(element, kind, matrix, layer)


def _transform(text: str | None) -> Matrix:
    matrix = np.eye(3)
    for name, values in TRANSFORM.findall(text or ""):
        v = [float(x) for x in NUMBER.findall(values)]
        one = np.eye(3)
        if name == "matrix":
            one[:2] = np.reshape(v, (3, 2)).T
        elif name == "translate":
            one[:2, 2] = [v[0], v[1] if len(v) > 1 else 0.0]
        elif name == "scale":
            one[0, 0], one[1, 1] = v[0], v[-1]
        elif name == "rotate":
            a, centre = math.radians(v[0]), np.array(v[1:3] or [0.0, 0.0])
            one[:2, :2] = [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]
            one[:2, 2] = centre - one[:2, :2] @ centre
        elif name in ("skewX", "skewY"):
            one[(0, 1) if name == "skewX" else (1, 0)] = math.tan(math.radians(v[0]))
        else:
            raise ValueError(f"no transform: {name}")
        matrix = matrix @ one
    return matrix


def _placed(element: ET.Element, kind: str, matrix: Matrix, layer: str) -> Iterator[Segment]:
    """Segments of a shape: lines, ellipses (centre, half axes, turn, first and last angle) and Bezier curves."""
    for piece in _pieces(element, kind):
        if len(piece) == 2:
            a, b = (matrix[:2, :2] @ p + matrix[:2, 2] for p in piece)
            yield Segment((float(a[0]), float(a[1])), (float(b[0]), float(b[1])), 0.0, layer)
        elif len(piece) == 6:
            yield from _elliptic(piece, matrix, layer)
        else:
            control = np.array(piece) @ matrix[:2, :2].T + matrix[:2, 2]
            yield from as_arcs(lambda t, c=control: _bezier(c, t), 0.0, 1.0, layer)


def _bezier(control: Array, t: Array) -> Array:
    s = t[:, None]
    a, b, c, d = control
    return (1 - s) ** 3 * a + 3 * s * (1 - s) ** 2 * b + 3 * s * s * (1 - s) * c + s**3 * d


def _elliptic(piece: tuple, matrix: Matrix, layer: str) -> Iterator[Segment]:
    centre, rx, ry, turn, first, last = piece
    c, s = math.cos(turn), math.sin(turn)
    axes = matrix[:2, :2] @ np.array([[c * rx, -s * ry], [s * rx, c * ry]])
    middle = matrix[:2, :2] @ centre + matrix[:2, 2]

    def curve(t: Array) -> Array:
        return np.stack([np.cos(t), np.sin(t)], axis=1) @ axes.T + middle

    gram = axes.T @ axes
    if abs(gram[0, 1]) + abs(gram[0, 0] - gram[1, 1]) > 1e-9 * gram.trace():
        yield from as_arcs(curve, first, last, layer, 8)
        return
    pieces = 2 if abs(last - first) > math.pi * (1 + 1e-9) else 1
    ends = curve(np.linspace(first, last, pieces + 1)).tolist()
    bulge = math.tan((last - first) / pieces / 4) * math.copysign(1.0, np.linalg.det(axes))
    for a, b in pairwise(ends):
        yield Segment((a[0], a[1]), (b[0], b[1]), bulge, layer)


def _pieces(element: ET.Element, kind: str) -> Iterator[tuple]:
    def size(name: str) -> float:
        return _length(element.get(name))

    def polygon(points: list[Array], is_closed: bool) -> Iterator[tuple]:
        yield from pairwise(points)
        if is_closed:
            yield points[-1], points[0]

    if kind == "path":
        yield from _path(element.get("d") or "")
    elif kind in ("polygon", "polyline"):
        numbers = [float(x) for x in NUMBER.findall(element.get("points") or "")]
        yield from polygon(list(np.reshape(numbers, (-1, 2))), kind == "polygon")
    elif kind == "line":
        yield np.array([size("x1"), size("y1")]), np.array([size("x2"), size("y2")])
    elif kind in ("circle", "ellipse"):
        rx, ry = (size("r"), size("r")) if kind == "circle" else (size("rx"), size("ry"))
        yield np.array([size("cx"), size("cy")]), rx, ry, 0.0, 0.0, math.tau
    elif kind == "rect":
        x, y, w, h = size("x"), size("y"), size("width"), size("height")
        rx = _length(element.get("rx"), size("ry"))
        ry = _length(element.get("ry"), rx)
        rx, ry = min(rx, w / 2), min(ry, h / 2)
        if rx == 0 or ry == 0:
            yield from polygon([np.array(p) for p in ((x, y), (x + w, y), (x + w, y + h), (x, y + h))], True)
            return
        corners = (
            (x + w - rx, y + ry, -0.25),
            (x + w - rx, y + h - ry, 0.0),
            (x + rx, y + h - ry, 0.25),
            (x + rx, y + ry, 0.5),
        )
        ends = []
        for cx, cy, turn in corners:
            a, b = math.tau * turn, math.tau * (turn + 0.25)
            yield np.array([cx, cy]), rx, ry, 0.0, a, b
            ends += [np.array([cx + rx * math.cos(t), cy + ry * math.sin(t)]) for t in (a, b)]
        for k in range(4):
            a, b = ends[2 * k + 1], ends[(2 * k + 2) % 8]
            if np.linalg.norm(b - a) > 0:
                yield a, b
    else:
        raise ValueError(f"<{kind}> is not read")


def _path(text: str) -> Iterator[tuple]:  # noqa: PLR0912  one branch for each command
    """Pieces of path data (SVG 1.1, 8.3)."""
    tokens = [m[1] or float(m[2]) for m in map(_legal, TOKEN.finditer(text)) if not m[3]]
    at = start = np.zeros(2)
    command, last, control, k = "", "", np.zeros(2), 0
    while k < len(tokens):
        if isinstance(tokens[k], str):
            command, k = str(tokens[k]), k + 1
        count = ARGUMENTS.get(command.upper())
        if count is None or (count == 0 and k < len(tokens) and not isinstance(tokens[k], str)):
            raise ValueError(f"no path command: {command!r}")
        given = tokens[k : k + count]
        k += count
        if len(given) < count or any(isinstance(x, str) for x in given):
            raise ValueError(f"numbers are missing behind {command!r}")
        v = np.array(given, dtype=float)
        kind, origin = command.upper(), at if command.islower() else np.zeros(2)
        if kind == "Z":
            if np.linalg.norm(at - start) > 0:
                yield at, start
            at = start
        elif kind == "M":
            at = start = origin + v
            command = "l" if command == "m" else "L"
        elif kind in "LHV":
            to = origin + v if kind == "L" else at.copy()
            if kind != "L":
                to[int(kind == "V")] = origin[int(kind == "V")] + v[0]
            yield at, to
            at = to
        elif kind == "A":
            to = origin + v[5:]
            yield from _arc(at, to, *v[:5].tolist())
            at = to
        else:
            points = np.reshape(v, (-1, 2)) + origin
            mirrored = 2 * at - control if last in ({"C", "S"} if kind in "CS" else {"Q", "T"}) else at
            if kind in "ST":
                points = np.concatenate([mirrored[None], points])
            control, to = points[-2], points[-1]
            if kind in "QT":
                points = np.stack([at + 2 / 3 * (control - at), to + 2 / 3 * (control - to), to])
            yield at, *points
            at = to
        last = kind


def _legal(match: re.Match[str]) -> re.Match[str]:
    if match[4]:
        raise ValueError(f"no path data: {match[4]!r}")
    return match


def _arc(a: Array, b: Array, rx: float, ry: float, turn: float, large: float, sweep: float) -> Iterator[tuple]:
    """An elliptical arc by its ends (SVG 1.1, F.6.5)."""
    if np.array_equal(a, b):
        return
    rx, ry, turn = abs(rx), abs(ry), math.radians(turn)
    if rx == 0 or ry == 0:
        yield a, b
        return
    c, s = math.cos(turn), math.sin(turn)
    x, y = np.array([[c, s], [-s, c]]) @ (a - b) / 2
    grown = math.sqrt(max(1.0, (x / rx) ** 2 + (y / ry) ** 2))
    rx, ry = rx * grown, ry * grown
    rest = (rx * ry) ** 2 / ((rx * y) ** 2 + (ry * x) ** 2) - 1
    k = math.sqrt(max(rest, 0.0)) * (-1 if bool(large) == bool(sweep) else 1)
    cx, cy = k * rx * y / ry, -k * ry * x / rx
    centre = np.array([[c, -s], [s, c]]) @ [cx, cy] + (a + b) / 2
    first = math.atan2((y - cy) / ry, (x - cx) / rx)
    last = math.atan2((-y - cy) / ry, (-x - cx) / rx)
    turned = (last - first) % math.tau
    yield centre, rx, ry, turn, first, first + (turned if sweep else turned - math.tau)
