"""A scene by hand, independent of the code that makes scenes: two boxes, a line, a dot, and their motions."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np

SIZE = 0.1
BODY, FLEXURE = "#4f8fd0", "#e0701c"
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
"""Faces of a box whose normals point outward."""
SCALES = {
    "": [["", 1.0, 0.0]],
    "m": [["m", 1.0, 1.0], ["mm", 1e-3, 0.0]],
    "J": [["J", 1.0, 1.0], ["mJ", 1e-3, 0.0]],
    "Pa": [["MPa", 1e6, 1e6], ["Pa", 1.0, 0.0]],
}
"""Units, the largest first: the name of each, its size, and from which value on."""


def buffer(values: Any, dtype: str, scale: float | None = None) -> dict[str, Any]:
    """Numbers as a page has them."""
    types = {"f32": "<f4", "u32": "<u4", "i16": "<i2", "u8": "u1"}
    own = np.ascontiguousarray(values, dtype=types[dtype])
    data = base64.b64encode(zlib.compress(own.tobytes())).decode()
    return {"dtype": dtype, "shape": list(own.shape), "data": data} | ({} if scale is None else {"scale": scale})


def box(low: list[float], high: list[float]) -> np.ndarray:
    return np.array(low) + CORNERS * (np.array(high) - np.array(low))


def quantity(key: str, label: str, unit: str, largest: float | None, values: Any) -> dict[str, Any]:
    """What colours a motion, with the units that it is written in."""
    return {"key": key, "label": label, "unit": unit, "largest": largest, "values": values, "scales": SCALES[unit]}


def motion(ident: str, displacement: np.ndarray, **more: Any) -> dict[str, Any]:
    largest = float(np.abs(displacement).max())
    stored = np.round(displacement / largest * 32767)
    own = {
        "id": ident,
        "group": "modes",
        "title": ident,
        "subtitle": "",
        "flag": "",
        "displacement": buffer(stored, "i16", largest / 32767),
        "nature": "vibration",
        "factor": 1.0,
        "largest": None,
        "colours": [quantity("displacement", "displacement", "", None, None)],
        "axes": [],
        "arrows": [],
        "facts": [],
        "warnings": [],
    }
    return own | more


STROKE = {
    "id": "stroke",
    "title": "stroke of arm",
    "motions": [f"pose-{k}" for k in range(4)],
    "label": "arm.tz",
    "values": [-20.0, -8.0, 10.0, 20.0],
    "unit": "mm",
}


def motions_of(points: np.ndarray) -> list[dict[str, Any]]:
    """The orange box 20 mm upward, the blue one 20 mm backward, the first under a force, and through a stroke."""
    upward, sideways = np.zeros_like(points), np.zeros_like(points)
    upward[8:16, 2] = 0.02
    sideways[:8, 1] = 0.02
    shares = buffer(np.array([0] * 8 + [128, 254] * 4 + [255] * 3), "u8", 1 / 254)
    moved = quantity("displacement", "displacement", "", None, None)
    energy = quantity("energy", "strain energy", "J", 0.002, shares)
    stress = quantity("stress", "stress", "Pa", 2e8, shares)
    in_metres = quantity("displacement", "displacement", "m", 0.002, None)
    screw = {"at": [0, 0, 0], "direction": [0, 1, 0], "pitch": 0.001, "label": "screw, pitch 1 mm"}
    arrow = {"at": [0.05, 0, 0.02], "direction": [0, 0, 1], "label": "1 N"}
    facts = [["frequency", "22.44 Hz"]]
    bend = {"nature": "displacement", "factor": 10.0, "largest": 0.002, "axes": [screw], "arrows": [arrow]}
    doubtful = {"flag": "not proven", "warnings": ["the bound is 3 % wide"]}
    poses = [
        motion(f"pose-{k}", upward * value / 20, group="stroke", nature="displacement", colours=[in_metres])
        for k, value in enumerate(STROKE["values"])
    ]
    return [
        motion("mode-1", upward, title="mode 1: 22.44 Hz", subtitle="arm up", facts=facts, colours=[moved, energy]),
        motion("mode-2", sideways, title="mode 2: 31.4 Hz", **doubtful),
        motion("static-1", upward / 10, group="statics", title="1 N at arm", colours=[in_metres, stress], **bend),
        *poses,
    ]


def part(name: str, kind: str, facts: list[list[str]], **cells: list[int]) -> dict[str, Any]:
    none = [0, 0]
    return {"name": name, "kind": kind, "facts": facts, "triangles": none, "lines": none, "dots": none} | cells


def two_boxes(name: str = "two boxes") -> dict[str, Any]:
    """A blue body at the left, an orange flexure at the right, a line and a dot; two modes, a static, a stroke."""
    left, right = box([-0.05, -0.02, -0.02], [-0.005, 0.02, 0.02]), box([0.005, -0.005, -0.02], [0.05, 0.005, 0.02])
    more = np.array([[-0.005, 0, 0.03], [0.005, 0, 0.03], [0, 0, 0.04]])
    points = np.concatenate([left, right, more])
    triangles = np.array([[q[a], q[b], q[c]] for q in QUADS for a, b, c in ((0, 1, 2), (0, 2, 3))])
    kinds = [
        {"key": "body", "label": "bodies", "colour": BODY, "opacity": 1.0, "group": "bodies"},
        {"key": "flexure", "label": "flexures", "colour": FLEXURE, "opacity": 1.0, "group": "flexures"},
        {"key": "spring", "label": "springs", "colour": "#0d8560", "opacity": 1.0, "group": "springs"},
        {"key": "node", "label": "nodes", "colour": "#ffffff", "opacity": 1.0, "group": "nodes"},
    ]
    parts = [
        part("base", "body", [["mass", "0.2 g"]], triangles=[0, 12]),
        part("arm[1].leaf", "flexure", [["length", "45 mm"], ["section", "40 x 10 mm"]], triangles=[12, 12]),
        part("<b>spring</b>", "spring", [], lines=[0, 1]),
        part("tip", "node", [], dots=[0, 1]),
    ]
    return {
        "name": name,
        "size": SIZE,
        "bounds": [[-0.05, -0.02, -0.02], [0.05, 0.02, 0.04]],
        "up": "z",
        "kinds": kinds,
        "parts": parts,
        "points": buffer(points, "f32"),
        "triangles": buffer(np.concatenate([triangles, triangles + 8]), "u32"),
        "lines": buffer([[16, 17]], "u32"),
        "dots": buffer([18], "u32"),
        "motions": motions_of(points),
        "sequences": [STROKE],
        "marks": [{"at": [-0.05, 0, 0.02], "text": "thickness in doubt", "severity": "doubt", "part": "base"}],
        "picture": None,
        "notes": ["drawn by hand"],
    }
