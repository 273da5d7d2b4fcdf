"""Files of solid meshes: decks of Abaqus and CalculiX, bulk data of Nastran, and what meshio reads, with their sets.

Cells have their points in the order of VTK: corners, then middles of edges. Points in the middle of sides and of cells
are passed over, as are the coordinates of beams, springs and whatever else is no solid.
"""

from __future__ import annotations

import io
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import OptionError, need
from flexura.fem.decks import SOLID, Card, deck_cards, deck_nodes, deck_sets
from flexura.files import read_text, refuse_unreadable

CORNERS = {"tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8}
"""Shapes of cells with their number of corners."""

QUADRATIC = {"tetra": 10, "pyramid": 13, "wedge": 15, "hexahedron": 20}
"""Shapes with their number of points where edges have a middle."""

SHAPES = {count: shape for counts in (CORNERS, QUADRATIC) for shape, count in counts.items()} | {27: "hexahedron"}
"""Shapes by the number of their points."""

DECKS, BULK = (".inp",), (".bdf", ".nas", ".dat")
"""Names of files that are read here."""

SHEET = re.compile(r"(S|STRI|DS|M3D|SFM3D|R3D|CP[SE]|CAX)\d\w*")
"""Types of flat elements in decks."""

DECK_SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    "tetra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "pyramid": ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "hexahedron": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
"""Corners of the sides S1, S2, ... of Abaqus and CalculiX."""

NOT_READ = ("*NGEN", "*NFILL", "*NCOPY", "*NMAP", "*ELGEN", "*ELCOPY", "*SYSTEM")
"""Keywords of decks that make nodes and elements, or move them."""

BULK_SOLIDS = {"CTETRA": "tetra", "CPYRAM": "pyramid", "CPYRA": "pyramid", "CPENTA": "wedge", "CHEXA": "hexahedron"}
BULK_SHEETS = {"CTRIA3": 3, "CTRIA6": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUAD8": 4, "CQUADR": 4}
"""Elements of Nastran: shapes of solid ones, numbers of corners of flat ones."""

BULK_ORDER = {20: (*range(12), *range(16, 20), *range(12, 16)), 15: (*range(9), *range(12, 15), *range(9, 12))}
"""Places in Nastran's elements of the points of quadratic cells whose order is another one."""

MESHIO = re.compile(r"(tetra|pyramid|wedge|hexahedron)(?:10|13|14|15|18|20|27)?")

NO_SETS = ("cell_tags", "gmsh:geometrical", "gmsh:dim_tags", "vtkGhostType")
"""Data of cells that name nothing."""

MOST_VALUES = 1000
"""Values of data of cells up to which each is a set."""


class Cells(NamedTuple):
    """Cells of a shape: points (c, corners and middles, if any), and numbers (c,) in the file."""

    shape: str
    points: Index
    numbers: Index


@dataclass(frozen=True)
class MeshFile:
    """Points (n, 3), in the unit of the file, and solid cells; `cell_sets` are positions in all blocks, one after the
    other, `point_sets` those of points, and `side_sets` corners (k, 4) of sides, sorted, of triangles the first -1.

    `others` are kinds of elements that are no solids, with their number.
    """

    points: Array
    blocks: tuple[Cells, ...]
    cell_sets: Mapping[str, Index] = field(default_factory=dict)
    point_sets: Mapping[str, Index] = field(default_factory=dict)
    side_sets: Mapping[str, Index] = field(default_factory=dict)
    others: Mapping[str, int] = field(default_factory=dict)


def read_mesh(path: Path) -> MeshFile:
    """The mesh of a file. Raises OptionError for files that are missing, damaged, or in which cells are not known."""
    refuse_unreadable(path, "solid_bytes")
    kind = path.suffix.lower()
    try:
        if kind in DECKS:
            return _of_deck(deck_cards(path))
        return _of_bulk(path) if kind in BULK else _of_meshio(path)
    except (ValueError, IndexError, KeyError, OverflowError) as error:
        text = f"{error.args[0]} is missing" if isinstance(error, KeyError) and error.args else str(error)
        raise OptionError(f"{path}: the mesh cannot be read: {' '.join(text.split())[:200]}") from None


def sorted_sides(corners: Index) -> Index:
    """Corners (k, 3 or 4) of sides, sorted (k, 4): the first one -1 where it is a triangle, also one with its last
    corner twice."""
    if corners.shape[1] == 4:
        twice = corners[:, 3] == corners[:, 2]
        return np.sort(np.column_stack([corners[:, :3], np.where(twice, -1, corners[:, 3])]), axis=1)
    return np.sort(np.column_stack([np.full(len(corners), -1), corners]), axis=1)


def _collected(tables: Mapping[str, list[Index]]) -> dict[str, Index]:
    return {name: np.unique(np.concatenate(parts), axis=0) for name, parts in tables.items() if parts}


def _of_deck(cards: list[Card]) -> MeshFile:
    if made := [card.name for card in cards if card.name in NOT_READ]:
        raise ValueError(f"{made[0]} is not followed: write all nodes and elements, in global coordinates")
    labels, points = deck_nodes(cards)
    blocks, others = [], Counter[str]()
    flat: dict[int, Index] = {}
    for card in cards:
        if card.name != "*ELEMENT" or not card.lines:
            continue
        solid, is_flat = SOLID.fullmatch(card.kind), SHEET.fullmatch(card.kind)
        if not (solid or is_flat):
            others[card.kind] += len(card.lines)
            continue
        table = np.array(card.numbers(), dtype=np.intp).reshape(-1, 1 + card.points)
        if not np.isin(table[:, 1:], labels).all():
            raise ValueError(f"an element of the type {card.kind} has a node that is not defined")
        at = np.searchsorted(labels, table[:, 1:])
        if is_flat:
            others[card.kind] += len(table)
            sides = sorted_sides(at[:, : 3 if card.points in (3, 6) else 4])
            flat |= dict(zip(table[:, 0].tolist(), sides, strict=True))
            continue
        if card.points not in SHAPES:
            raise ValueError(f"elements of the type {card.kind} are not known")
        shape = SHAPES[card.points]
        blocks.append(Cells(shape, at[:, : QUADRATIC[shape]], table[:, 0]))
    numbers = np.concatenate([block.numbers for block in blocks]) if blocks else np.empty(0, dtype=np.intp)
    element_sets = deck_sets(cards, "ELSET")
    cell_sets = {name: np.flatnonzero(np.isin(numbers, members)) for name, members in element_sets.items()}
    node_sets = {name: _positions(labels, own) for name, own in deck_sets(cards, "NSET").items()}
    side_sets: dict[str, list[Index]] = defaultdict(list)
    for name, members in element_sets.items():
        side_sets[name] += [flat[number][None] for number in members.tolist() if number in flat]
    corners_of = {int(n): (b.shape, row) for b in blocks for n, row in zip(b.numbers, b.points, strict=True)}
    for card in cards:
        name = card.options.get("NAME", "").upper()
        if card.name == "*SURFACE" and card.options.get("TYPE", "ELEMENT").upper() == "NODE":
            texts = [text.upper() for text in card.numbers()]
            found = [node_sets[t] if t in node_sets else _positions(labels, np.array([int(t)])) for t in texts]
            node_sets[name] = np.unique(np.concatenate(found))
        elif card.name == "*SURFACE":
            side_sets[name] += list(_deck_sides(card, element_sets, corners_of))
    cell_sets = {name: own for name, own in cell_sets.items() if len(own)}
    return MeshFile(points, tuple(blocks), cell_sets, node_sets, _collected(side_sets), others)


def _positions(labels: Index, numbers: Index) -> Index:
    """Positions of numbers among ascending labels, of those that are there."""
    return np.flatnonzero(np.isin(labels, numbers))


def _deck_sides(
    card: Card, element_sets: Mapping[str, Index], cells: Mapping[int, tuple[str, Index]]
) -> Iterator[Index]:
    """Sides of a *SURFACE of lines `set or element, S1`; other sides than those of solids are passed over."""
    for line in card.lines:
        which, _, side = (text.strip().upper() for text in line.partition(","))
        if not re.fullmatch(r"S[1-6]", side.rstrip(",")):
            raise ValueError(f"*SURFACE {card.options.get('NAME', '')} has the side {side!r}, of S1 to S6")
        members = element_sets[which] if which in element_sets else [int(which)]
        for number in members:
            if int(number) in cells:
                shape, points = cells[int(number)]
                yield sorted_sides(points[list(DECK_SIDES[shape][int(side[1]) - 1])][None])


def _bulk_cards(path: Path, depth: int = 0) -> Iterator[list[str]]:
    """Fields of the cards of bulk data, in free, small or large format, those of continuations joined."""
    lines = [line.partition("$")[0].expandtabs().rstrip() for line in read_text(path, encoding="latin-1").splitlines()]
    begin = [k for k, line in enumerate(lines) if re.match(r"\s*BEGIN\s+(BULK|SUPER)", line, re.IGNORECASE)]
    card: list[str] = []
    for line in lines[begin[0] + 1 if begin else 0 :]:
        if not line:
            continue
        if include := re.match(r"\s*INCLUDE\s+['\"]?([^'\"]+)", line, re.IGNORECASE):
            if depth == 10:
                raise ValueError("files include each other more than 10 deep")
            yield from _bulk_cards(path.parent / include[1].strip(), depth + 1)
            continue
        if line.upper().startswith("ENDDATA"):
            break
        head, fields = _bulk_fields(line)
        if not head or head[0] in "+*":
            card += fields
            continue
        if card:
            yield card
        card = [head, *fields]
    if card:
        yield card


def _bulk_fields(line: str) -> tuple[str, list[str]]:
    """Name, in capitals, and the fields of one line, eight or four of them."""
    if "," in line:
        head, *fields = (text.strip() for text in line.split(","))
        count = 4 if "*" in head else 8
    else:
        head, width = line[:8].strip(), 16 if "*" in line[:8] else 8
        count = 64 // width
        fields = [line[8 + k * width : 8 + (k + 1) * width].strip() for k in range(count)]
    fields = (fields + count * [""])[:count]
    return (head if head[:1] in ("+", "*") else head.rstrip("*_")).upper(), fields


def _bulk_number(text: str) -> float:
    """A number of Nastran, such as 1.5-3 for 0.0015."""
    return float(re.sub(r"(?<=[\d.])([+-])(?=\d)", r"E\1", text.upper().replace("D", "E"))) if text else 0.0


def _of_bulk(path: Path) -> MeshFile:
    labels, places = [], []
    solids: dict[int, tuple[list[int], list[list[int]], list[str]]] = defaultdict(lambda: ([], [], []))
    flat: dict[str, list[list[int]]] = defaultdict(list)
    others = Counter[str]()
    for name, *fields in _bulk_cards(path):
        if name in ("GRID", "GRDSET"):
            system = fields[1]
            if system not in ("", "0"):
                raise ValueError(f"{name} {fields[0]} is given in the system {system}: write it in the basic one")
            if name == "GRID":
                labels.append(int(fields[0]))
                places.append([_bulk_number(text) for text in fields[2:5]])
        elif name in BULK_SOLIDS:
            shape = BULK_SOLIDS[name]
            points = fields[2 : 2 + QUADRATIC[shape]]
            while points and not points[-1]:
                points.pop()
            if len(points) not in (CORNERS[shape], QUADRATIC[shape]) or "" in points:
                rule = f"{CORNERS[shape]} or {QUADRATIC[shape]} points"
                raise ValueError(f"{name} {fields[0]} has {len(points) - points.count('')} of {rule}")
            numbers, cells, properties = solids[len(points)]
            numbers.append(int(fields[0]))
            cells.append([int(points[k]) for k in BULK_ORDER.get(len(points), range(len(points)))])
            properties.append(fields[1])
        elif name in BULK_SHEETS:
            others[name] += 1
            flat[f"property {fields[1]}"].append([int(text) for text in fields[2 : 2 + BULK_SHEETS[name]]])
        elif name[:1] == "C" and name[:4] not in ("CORD", "CONM"):
            others[name] += 1
    if not labels:
        raise ValueError("it has no GRID")
    order = np.argsort(labels)
    known = np.array(labels)[order]

    def at(points: Any) -> Index:
        table = np.array(points, dtype=np.intp)
        if not np.isin(table, known).all():
            raise ValueError(f"an element has the point {table[~np.isin(table, known)][0]}, which no GRID defines")
        return np.searchsorted(known, table)

    blocks = tuple(Cells(SHAPES[n], at(cells), np.array(numbers)) for n, (numbers, cells, _) in solids.items())
    of = np.array([text for _, _, properties in solids.values() for text in properties])
    cell_sets = {f"property {text}": np.flatnonzero(of == text) for text in np.unique(of).tolist() if text}
    sides = {name: [sorted_sides(at([own])) for own in rows] for name, rows in flat.items()}
    return MeshFile(np.array(places)[order], blocks, cell_sets, {}, _collected(sides), others)


def _of_meshio(path: Path) -> MeshFile:
    meshio, said = need("meshio", "solid"), io.StringIO()
    if path.suffix.lower() == ".med":
        need("h5py", "solid")
    try:
        with redirect_stdout(said), redirect_stderr(said):
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # whatever meshio and what it reads with raise
        text = said.getvalue() if isinstance(error, SystemExit) else str(error)
        raise ValueError(f"meshio says {' '.join(text.split())[-180:] or type(error).__name__!r}") from None
    points = np.asarray(mesh.points, dtype=float)
    if points.shape[1] != 3:
        raise ValueError(f"its points have {points.shape[1]} coordinates: solids have three")
    blocks, others, where = [], Counter[str](), []
    flat: dict[int, Index] = {}
    count = 0
    for k, block in enumerate(mesh.cells):
        kind = MESHIO.fullmatch(block.type)
        is_sheet = block.type.startswith(("triangle", "quad"))
        data = np.asarray(block.data if kind or is_sheet else np.empty((0, 0)), dtype=np.intp)
        where.append(count if kind else -1)
        if kind:
            shape = kind[1]
            wanted = CORNERS[shape] if kind[0] == shape else QUADRATIC[shape]
            blocks.append(Cells(shape, data[:, :wanted], count + 1 + np.arange(len(data))))
            count += len(data)
            continue
        if block.dim == 3:
            raise ValueError(f"cells of the kind {block.type} are not known")
        others[block.type] += len(block.data)
        if is_sheet:
            flat[k] = sorted_sides(data[:, : 3 if block.type.startswith("triangle") else 4])
    cells, sides = defaultdict[str, list[Index]](list), defaultdict[str, list[Index]](list)
    for name, k, members in _named_members(mesh):
        if where[k] >= 0:
            cells[name].append(where[k] + members)
        elif k in flat:
            sides[name].append(flat[k][members])
    return MeshFile(points, tuple(blocks), _collected(cells), _named_points(mesh), _collected(sides), others)


def _named_members(mesh: Any) -> Iterator[tuple[str, int, Index]]:
    """Names of sets of cells with the number of a block and positions in it: those of the format, families of MED, and
    values of whole numbers that cells have."""
    for name, members in mesh.cell_sets.items():
        for k, own in enumerate(members):
            if own is not None and len(own):
                yield name, k, np.asarray(own, dtype=np.intp)
    for tag, names in getattr(mesh, "cell_tags", {}).items():
        for k, tags in enumerate(mesh.cell_data.get("cell_tags", [])):
            for name in names:
                yield name, k, np.flatnonzero(np.asarray(tags) == tag)
    for key, data in mesh.cell_data.items():
        if key in NO_SETS or not all(np.ndim(d) == 1 and np.issubdtype(np.asarray(d).dtype, np.integer) for d in data):
            continue
        values = np.unique(np.concatenate(data))
        if len(values) > MOST_VALUES:
            continue
        label = key.rpartition(":")[2]
        named = (
            {(int(tag), int(dim)): name for name, (tag, dim) in mesh.field_data.items()} if label == "physical" else {}
        )
        for k, own in enumerate(data):
            for value in values.tolist():
                name = named.get((value, mesh.cells[k].dim), f"{label} {value}")
                if (found := np.flatnonzero(np.asarray(own) == value)).size:
                    yield name, k, found


def _named_points(mesh: Any) -> dict[str, Index]:
    """Sets of points: those of the format, families of MED, and data of points that are 0 or 1."""
    found = {name: np.asarray(own, dtype=np.intp) for name, own in mesh.point_sets.items()}
    tags = np.asarray(mesh.point_data.get("point_tags", []))
    for tag, names in getattr(mesh, "point_tags", {}).items():
        for name in names:
            found[name] = np.union1d(found.get(name, np.empty(0, dtype=np.intp)), np.flatnonzero(tags == tag))
    for key, data in mesh.point_data.items():
        own = np.asarray(data)
        if key != "point_tags" and own.ndim == 1 and np.issubdtype(own.dtype, np.integer) and set(own) <= {0, 1}:
            found[key] = np.flatnonzero(own)
    return found
