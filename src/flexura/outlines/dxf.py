"""Outlines out of DXF files and into them, by ezdxf."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import FlexuraError, OptionError, did_you_mean, need
from flexura.files import refuse_unreadable, write_file
from flexura.outlines.chaining import outline_of
from flexura.outlines.curves import NEAR, as_arcs
from flexura.outlines.outline import Outline, Segment, refused
from flexura.sizes import beyond

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "um": 1e-6, "in": 0.0254, "mil": 2.54e-5, "ft": 0.3048}
"""Units of drawings, m."""

INSUNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 9: "mil", 13: "um"}
"""Units by the value of $INSUNITS."""

FLAT = 1e-6
"""How far a drawing may leave its plane, over its size; sine of the angle between normals."""

DEEPEST = 20
"""Blocks within blocks."""

IGNORED = {"TEXT", "MTEXT", "DIMENSION", "ARC_DIMENSION", "LARGE_RADIAL_DIMENSION", "POINT", "HATCH", "LEADER",
    "MULTILEADER", "MLEADER", "ATTDEF", "ATTRIB", "VIEWPORT", "IMAGE", "WIPEOUT", "TOLERANCE", "RAY", "XLINE",
    "OLE2FRAME", "ACAD_TABLE"}  # fmt: skip
"""Entities that draw nothing of the part."""


@verb
def read_dxf(path: str | Path, layers: Collection[str] | None = None, units: str | None = None) -> Outline:
    """The outline that a DXF file has in its model space, m.

    Lines, arcs, circles, polylines, splines and ellipses count, also those of blocks, on `layers` or on all that are
    on; splines and ellipses become arcs at most 1e-5 of their size off them. Text, dimensions, points, hatches are left
    out, and `notes` say so. Units are `units`, else those of the file ($INSUNITS; mm where it has none and is metric by
    $MEASUREMENT). Raises OptionError for files that are no DXF or of unknown units, and ModelError as `outline_of`.
    """
    ezdxf = need("ezdxf", "solid")
    refuse_unreadable(path, "drawing_bytes")
    try:
        document = ezdxf.readfile(path)
    except Exception as error:  # whatever ezdxf raises for damaged files
        raise OptionError(f"{path}: no DXF file, or a damaged one: {error}") from None
    try:
        return _outline(document, layers, units, str(path))
    except FlexuraError:
        raise
    except Exception as error:
        raise OptionError(f"{path}: a damaged drawing: {type(error).__name__}: {error}") from None


@verb
def write_dxf(outline: Outline, path: str | Path, *, layer: str = "cut") -> Path:
    """Write the loops of an outline as closed polylines with arcs on one layer of a DXF file (R2010), in millimetres,
    scale 1. Raises OptionError where it cannot be written."""
    ezdxf = need("ezdxf", "solid")
    document = ezdxf.new("R2010", units=4)
    document.layers.add(layer)
    for loop in outline.loops:
        points = [(1e3 * own.start[0], 1e3 * own.start[1], own.bulge) for own in loop.segments]
        document.modelspace().add_lwpolyline(points, format="xyb", close=True, dxfattribs={"layer": layer})
    return write_file(path, document.saveas)


def _outline(document: Any, layers: Collection[str] | None, units: str | None, path: str) -> Outline:
    notes: list[str] = []
    scale = _unit(document, units, path, notes)
    drawing = _Drawing(document, layers)
    segments = list(drawing.segments(document.modelspace(), "", 0))
    if drawing.heights:
        low, high = min(drawing.heights), max(drawing.heights)
        size = max((math.dist(own.start, own.end) for own in segments), default=0.0)
        if high - low > FLAT * max(size, 1e-300):
            raise refused(f"heights from {low:g} to {high:g}", "a drawing lies in a plane z = constant")
    if layers is not None and (unknown := set(layers) - drawing.seen):
        name = min(unknown)
        known = ", ".join(sorted(drawing.seen)) or "none"
        raise OptionError(
            f"{path}: nothing is on layer {name!r}: {did_you_mean(name, drawing.seen, f'layers: {known}')}"
        )
    notes += drawing.notes()
    scaled = [Segment(_scaled(own.start, scale), _scaled(own.end, scale), own.bulge, own.layer) for own in segments]
    return outline_of(scaled, notes)


def _scaled(point: tuple[float, float], scale: float) -> tuple[float, float]:
    return scale * point[0], scale * point[1]


def _unit(document: Any, units: str | None, path: str, notes: list[str]) -> float:
    if units is not None:
        if units not in UNITS:
            raise OptionError(f"units of a drawing are one of {', '.join(UNITS)}, not {units!r}")
        return UNITS[units]
    code = int(document.header.get("$INSUNITS", 0) or 0)
    if code in INSUNITS:
        return UNITS[INSUNITS[code]]
    if code == 0 and int(document.header.get("$MEASUREMENT", 0) or 0) == 1:
        notes.append("the drawing has no unit but is metric: mm")
        return UNITS["mm"]
    raise OptionError(f"{path}: the drawing has no unit ($INSUNITS {code}); name it: one of {', '.join(UNITS)}")


class _Drawing:
    """Segments of entities, in units of the drawing, and what was left out."""

    def __init__(self, document: Any, layers: Collection[str] | None) -> None:
        self._document, self._layers = document, layers
        self._left_out: Counter[str] = Counter()
        self._hidden: Counter[str] = Counter()
        self._curves = 0
        self._count = 0
        self.seen: set[str] = set()
        self.heights: list[float] = []

    def notes(self) -> Iterator[str]:
        """What was left out, and what was approximated."""
        if self._left_out:
            yield "left out: " + ", ".join(f"{n} {kind}" for kind, n in sorted(self._left_out.items()))
        if self._hidden:
            yield "on layers that are off or not asked for: " + ", ".join(
                f"{n} on {name}" for name, n in self._hidden.items()
            )
        if self._curves:
            yield f"{self._curves} splines and ellipses are arcs at most {NEAR:g} of their size off them"

    def segments(self, entities: Any, layer: str, depth: int) -> Iterator[Segment]:
        """Those of entities, of blocks on layer 0 on that of the block."""
        if depth > DEEPEST:
            raise refused(f"{depth} levels", f"blocks are within blocks at most {DEEPEST} deep")
        for entity in entities:
            kind, name = entity.dxftype(), entity.dxf.get("layer", "0")
            name = layer if layer and name == "0" else name
            if kind in IGNORED:
                self._left_out[kind] += 1
            elif kind == "INSERT":
                copies = max(entity.mcount, 1)
                if found := beyond("drawing_segments", self._count + copies):
                    raise refused(*found)
                for one in entity.multi_insert() if copies > 1 else [entity]:
                    yield from self.segments(one.virtual_entities(), name, depth + 1)
            elif kind in ("LWPOLYLINE", "POLYLINE"):
                if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
                    self._left_out["mesh"] += 1
                    continue
                yield from self.segments(entity.virtual_entities(), name if layer else "", depth)
            elif self._shows(name, kind):
                for own in self._of(entity, kind, name):
                    self._count += 1
                    if found := beyond("drawing_segments", self._count):
                        raise refused(*found)
                    yield own

    def _shows(self, name: str, kind: str) -> bool:
        if kind not in ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE"):
            self._left_out[kind] += 1
            return False
        table = self._document.layers
        own = table.get(name) if table.has_entry(name) else None
        self.seen.add(name)
        is_off = own is not None and (own.is_off() or own.is_frozen()) and self._layers is None
        if is_off or (self._layers is not None and name not in self._layers):
            self._hidden[name] += 1
            return False
        return True

    def _of(self, entity: Any, kind: str, name: str) -> Iterator[Segment]:
        if kind == "LINE":
            yield Segment(self._flat(entity.dxf.start), self._flat(entity.dxf.end), 0.0, name)
        elif kind in ("ARC", "CIRCLE"):
            sense = self._sense(entity)
            first, turn = 0.0, 360.0
            if kind == "ARC":
                first = entity.dxf.start_angle
                turn = (entity.dxf.end_angle - first) % 360.0 or 360.0
            pieces = 2 if turn > 180.0 + 1e-9 else 1
            angles = np.radians(first + turn * np.arange(pieces + 1) / pieces)
            r, c = entity.dxf.radius, entity.dxf.center
            points = entity.ocs().points_to_wcs(
                [(c[0] + r * math.cos(a), c[1] + r * math.sin(a), c[2]) for a in angles]
            )
            ends = [self._flat(p) for p in points]
            bulge = sense * math.tan(math.radians(turn / pieces) / 4)
            for a, b in pairwise(ends):
                yield Segment(a, b, bulge, name)
        elif kind == "ELLIPSE":
            first = entity.dxf.start_param
            last = first + ((entity.dxf.end_param - first) % math.tau or math.tau)
            yield from self._curve(entity.vertices, first, last, name, 8)
        else:
            tool = entity.construction_tool()
            knots = np.unique(np.asarray(tool.knots(), dtype=float))
            knots = knots[(knots >= tool.knots()[tool.degree]) & (knots <= tool.knots()[tool.count])]
            for a, b in pairwise(knots):
                yield from self._curve(tool.points, float(a), float(b), name, 2)

    def _curve(self, at: Any, first: float, last: float, name: str, pieces: int) -> Iterator[Segment]:
        self._curves += 1

        def curve(t: Array) -> Array:
            return np.array([self._flat(p) for p in at(t.tolist())])

        yield from as_arcs(curve, first, last, name, pieces)

    def _flat(self, point: Any) -> tuple[float, float]:
        self.heights.append(float(point[2]))
        return float(point[0]), float(point[1])

    def _sense(self, entity: Any) -> float:
        normal = entity.dxf.get("extrusion", (0.0, 0.0, 1.0))
        if math.hypot(normal[0], normal[1]) > FLAT * abs(normal[2]):
            raise refused(f"a normal {tuple(normal)}", "a drawing lies in the plane of x and y")
        return math.copysign(1.0, normal[2])
