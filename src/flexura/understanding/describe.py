"""A planar part as a mechanism: flexures and arms as members, blocks as bodies, what is held of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.mechanism import Material, Mechanism
from flexura.outlines import Outline
from flexura.tables import in_mm, quantity
from flexura.understanding.thin import Block, Flexure, Link

PLANE = 1e-6
"""Distance from a plane, over the size of the part, up to which something lies in it."""

MATERIAL = "metal"
"""What the material is called in the description."""

DECIMALS = 13
"""Digits of metres that are written."""

BLUNT = 2e-3
"""Distance of chords from the arcs of a block, over the root of its area."""

UNLIKE = 0.01
"""How far the middle of the faces lies off the axis, over the web, from which faces are unlike."""

ELEMENTS = 10, 16
"""Elements of a leaf, and of a notch."""


@dataclass(frozen=True)
class Plane:
    """What is held: a plane across the drawing, the points x with `normal` (2,) times x = `offset`, m; `name`."""

    normal: tuple[float, float]
    offset: float
    name: str

    def beyond(self, points: Array) -> Array:
        """How far points (..., 2) lie beyond it, m."""
        return np.asarray(points @ np.array(self.normal) - self.offset)


@dataclass(frozen=True)
class Description:
    """A mechanism, and the names in it: of flexures and blocks in their order, of the two blocks or arms that each
    flexure joins; `notes` say what was simplified."""

    mechanism: Mechanism
    flexures: tuple[str, ...]
    blocks: tuple[str, ...]
    joins: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]


def described(
    outline: Outline,
    thickness: float,
    material: Material | str,
    held: Plane,
    parts: tuple[Sequence[Flexure], Sequence[Link], Sequence[Block]],
    name: str,
) -> Description:
    """The mechanism of flexures, arms and blocks of a part of a thickness, m, that lies from z = 0 on.

    Raises OptionError where nothing moves or nothing of it is held.
    """
    flexures, links, blocks = parts
    if not flexures:
        rule = "no place of the drawing is thin beside what it joins, so that no flexure was recognised"
        raise OptionError(f"{name}: {rule}: is it the outline of a flexure mechanism?")
    near = PLANE * outline.size
    z = _rounded(thickness / 2)
    on_plane = [_on(held, block, near) for block in blocks]
    if not any(on_plane):
        raise OptionError(f"{name}: nothing of the part lies on {held.name}: hold another place")
    numbers = sorted(range(len(blocks)), key=lambda k: (not on_plane[k], -blocks[k].polygon.area))
    block_names = _block_names(numbers, on_plane)
    names = [f"{'notch' if own.kind not in ('leaf', 'tapered') else 'leaf'}{k + 1}" for k, own in enumerate(flexures)]
    nodes: dict[str, list[float]] = {}
    ends: dict[tuple[int, int], str] = {}
    link_data, carried = {}, {k: list[str]() for k in range(len(blocks))}
    joins = {(k, e): "" for k in range(len(flexures)) for e in (0, 1)}
    for k, own in enumerate(flexures):
        for e in (0, 1):
            ends[k, e] = f"{names[k]}_{'ab'[e]}"
            nodes[ends[k, e]] = _place(own.at((own.start, own.end)[e]), z)
    hosts = {j: k for k, block in enumerate(blocks) for j in block.links}
    for j, link in enumerate(links):
        first, last = link.ends
        far = ends[last] if last else f"arm{j + 1}_end"
        if not last:
            nodes[far] = _place(np.array(link.end), z)
            carried[hosts[j]].append(far)
        own = flexures[first[0]]
        section = {"shape": "rectangle", "width": thickness, "thickness": _rounded(link.thickness)}
        link_data[f"arm{j + 1}"] = {
            "nodes": (ends[first], far), "material": MATERIAL, "reference": _across(own), "section": section
        }  # fmt: skip
        for key, node, at in (("start_offset", ends[first], link.start), ("end_offset", far, link.end)):
            offset = np.array(_place(np.array(at), z)) - nodes[node]
            if np.linalg.norm(offset) > near:
                link_data[f"arm{j + 1}"][key] = tuple(map(_rounded, offset))
        for end in filter(None, (first, last)):
            joins[end] = block_names[hosts[j]] if j in hosts else f"arm{j + 1}"
    for k, block in enumerate(blocks):
        carried[k] = [ends[end] for end in block.flexures] + carried[k]
        joins |= dict.fromkeys(block.flexures, block_names[k])
    flexure_data = {}
    for k, own in enumerate(flexures):
        flexure_data[names[k]] = _flexure(own, (ends[k, 0], ends[k, 1]), nodes, thickness)
    bodies = {}
    for k in numbers:
        ends_of = [*blocks[k].flexures, *(links[j].ends[0] for j in blocks[k].links)]
        along = flexures[ends_of[0][0]].along if ends_of else (1.0, 0.0)
        bodies[block_names[k]] = _body(blocks[k], thickness, held if on_plane[k] else None, carried[k], near, along)
    mechanism = Mechanism.model_validate(
        {
            "name": name, "materials": {MATERIAL: material}, "nodes": nodes, "links": link_data,
            "flexures": flexure_data, "bodies": bodies,
        }
    )  # fmt: skip
    pairs = tuple((joins[k, 0], joins[k, 1]) for k in range(len(flexures)))
    return Description(mechanism, tuple(names), tuple(block_names), pairs, tuple(_notes(flexures, names)))


def _block_names(numbers: Sequence[int], on_plane: Sequence[bool]) -> list[str]:
    """Names of blocks by number: those that are held are bases."""
    names, bases = [""] * len(numbers), sum(on_plane)
    for j, k in enumerate(numbers):
        held = "base" if bases == 1 else f"base{j + 1}"
        names[k] = held if on_plane[k] else f"block{j + 1 - bases}"
    return names


def _notes(flexures: Sequence[Flexure], names: Sequence[str]) -> Iterator[str]:
    """What of flexures was simplified."""
    for own, name in zip(flexures, names, strict=True):
        if own.shift > UNLIKE * own.web:
            yield (
                f"{name} at ({in_mm(own.centre)}) mm: its faces are unlike, taken as symmetric about its axis, "
                f"{quantity(own.shift, 'm', 2)} off their middle; bending out of the plane may be 15 % too stiff"
            )
        if own.kind == "table":
            yield f"{name} at ({in_mm(own.centre)}) mm: no contour fits, it is a table of thicknesses"


def _on(held: Plane, block: Block, near: float) -> bool:
    """Whether a side of a block lies in a plane."""
    corners = np.array(block.polygon.exterior.coords)
    on = np.abs(held.beyond(corners)) < 10 * near
    return bool((on[:-1] & on[1:]).any())


def _flexure(own: Flexure, ends: tuple[str, str], nodes: dict[str, list[float]], thickness: float) -> dict[str, Any]:
    data: dict[str, Any] = {"nodes": ends, "material": MATERIAL, "reference": _across(own)}
    if own.kind in ("leaf", "tapered"):
        thin: Any = _rounded(own.web) if own.kind == "leaf" else tuple(map(_rounded, own.thick))
        profile = {"type": "leaf", "width": thickness, "thickness": thin}
        return data | {
            "profile": profile, "elements": ELEMENTS[0], "fillet": tuple(_rounded(r) for r in own.radius)
        }  # fmt: skip
    web, radius = _rounded(own.web), _rounded(float(np.mean(own.radius)))
    contour: dict[str, Any] = {"shape": own.kind, "web": web}
    if own.kind == "circular":
        contour["radius"] = max(radius, _rounded(own.length / 2))
    elif own.kind == "elliptical":
        contour["depth"] = _rounded((float(np.mean(own.thick)) - own.web) / 2)
    elif own.kind == "corner_filleted":
        contour["fillet_radius"] = radius
    else:
        x, h = (tuple(map(_rounded, column)) for column in own.table)
        length = math.dist(nodes[ends[0]], nodes[ends[1]])
        contour = {"shape": "table", "positions": (0.0, *x[1:-1], length), "thicknesses": h}
    profile = {"type": "notch", "width": thickness, "contour": contour}
    return data | {"profile": profile, "elements": ELEMENTS[1], "integration": "tapered"}


def _body(
    block: Block, thickness: float, held: Plane | None, carries: list[str], near: float, along: tuple[float, float]
) -> dict[str, Any]:
    """A body: a box where the block is a rectangle, else a prism less cylinders and prisms; turned so that what is held
    of it, or else a flexure that it carries, is across or along an axis of its own."""
    x, y = along if held is None else held.normal
    turn = math.atan2(y, x)
    blunt = BLUNT * math.sqrt(block.polygon.area)
    corners = _simple(block.polygon.exterior, blunt, near)
    is_box = len(corners) == 4 and _is_rectangle(corners)
    if is_box and held is None:
        side = corners[1] - corners[0]
        turn = math.atan2(side[1], side[0])
    turn = round(turn % (math.pi / 2), DECIMALS) if abs(math.remainder(turn, math.pi / 2)) > 1e-9 else 0.0
    depth = _rounded(1.1 * thickness)
    c, s = math.cos(turn), math.sin(turn)
    R = np.array([[c, s], [-s, c]])  # into the axes of the body
    local = corners @ R.T
    low, high = local.min(axis=0), local.max(axis=0)
    is_box &= bool((np.minimum(np.abs(local - low), np.abs(local - high)) < 10 * near).all())
    centre = (low + high) / 2 if is_box else np.array(block.polygon.centroid.coords[0]) @ R.T
    data: dict[str, Any] = {"centre": _place(centre @ R, thickness / 2), "carries": tuple(carries)}
    if turn:
        data["rotate"] = {"axis": (0.0, 0.0, 1.0), "angle": turn}
    holes = []
    for ring in block.polygon.interiors:
        round_ = np.array(ring.coords)[:-1] @ R.T - centre
        middle = round_.mean(axis=0)
        radius = np.linalg.norm(round_ - middle, axis=1)
        if len(round_) > 8 and np.ptp(radius) < 100 * near:
            at = (_rounded(middle[0]), _rounded(middle[1]), 0.0)
            holes.append(
                {"shape": "cylinder", "diameter": _rounded(2 * float(radius.max())), "length": depth, "at": at}
            )
        else:
            holes.append(_prism(_simple(ring, blunt, near) @ R.T - centre, depth))
    box = {"shape": "box", "size": (*map(_rounded, high - low), thickness)}
    if is_box and not holes:
        data["solid"] = {**box, "material": MATERIAL}
    else:
        add = box if is_box else _prism(local - centre, thickness)
        data["solid"] = {"shape": "composite", "material": MATERIAL, "add": (add,), "cut": tuple(holes)}
    if held is not None:
        normal = R @ np.array(held.normal)
        axis = int(np.abs(normal).argmax())
        level = held.offset * float(np.sign(normal[axis]))
        if min(abs(level - low[axis]), abs(level - high[axis])) > 10 * near:
            rule = "what is held of a block is the face that is outermost"
            raise OptionError(f"{held.name} runs through the block at ({in_mm(centre @ R)}) mm: {rule}")
        side = "+" if abs(level - high[axis]) < abs(level - low[axis]) else "-"
        data["held"] = {"face": "xy"[axis] + side}
    return data


def _prism(corners: Array, thickness: float) -> dict[str, Any]:
    outline = tuple((_rounded(x), _rounded(y)) for x, y in corners.tolist())
    return {"shape": "prism", "outline": outline, "thickness": thickness}


def _simple(ring: Any, blunt: float, near: float) -> Array:
    """Corners of a ring of shapely with longer chords along its arcs, without those that are on the line between their
    neighbours, or on their neighbour."""
    corners = np.array(ring.simplify(blunt).coords)[:-1]
    while True:
        before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
        along = after - before
        length = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
        away = corners - before
        off = np.abs(away[:, 0] * along[:, 1] - away[:, 1] * along[:, 0]) / length
        spare = (off < near / 10) | (np.linalg.norm(away, axis=1) < near)
        if not spare.any() or len(corners) <= 4:
            return corners
        corners = np.delete(corners, int(np.argmax(spare)), axis=0)


def _is_rectangle(corners: Array) -> bool:
    sides = np.roll(corners, -1, axis=0) - corners
    unit = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    return bool((np.abs((unit * np.roll(unit, -1, axis=0)).sum(axis=1)) < 1e-5).all())


def _across(own: Flexure) -> tuple[float, float, float]:
    return (-own.along[1] + 0.0, own.along[0], 0.0)


def _place(at: Array, z: float) -> list[float]:
    return [_rounded(at[0]), _rounded(at[1]), z]


def _rounded(x: float) -> float:
    return round(float(x), DECIMALS) + 0.0
