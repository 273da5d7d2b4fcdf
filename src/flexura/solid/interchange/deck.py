"""Nodes, sets, masses and rigid bodies of an input deck of CalculiX, as Abaqus has them too."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.files import read_text
from flexura.sizes import within
from flexura.solid.fem import mesh_mass
from flexura.solid.geometry import SolidMaterial
from flexura.solid.mesh import SolidMesh

CELLS = {"C3D10": "tetra10", "C3D20": "hexahedron20", "C3D20R": "hexahedron20"}
"""Elements that are read as cells; their points come in the same order."""

NESTED = 10
"""Deepest inclusion of decks in decks."""


class Card(NamedTuple):
    """A keyword without blanks and its parameters by name, in capitals, and the lines of data below it."""

    name: str
    options: dict[str, str]
    lines: list[str]

    @property
    def kind(self) -> str:
        """Type of the elements."""
        return self.options.get("TYPE", "").upper()

    def numbers(self) -> list[str]:
        """All entries of the lines."""
        return [text.strip() for line in self.lines for text in line.split(",") if text.strip()]


@dataclass(frozen=True)
class Deck:
    """Numbers (p,) and places (p, 3) of nodes, numbers of nodes by set, and mass, in the units of the deck.

    `cells` are the points of elements by position, as in a `SolidMesh`; `mass` is density times volume, None where
    there are elements of other kinds or without density. `rotations` are nodes whose translations stand for the
    rotation of another, by number: ROT NODE and REF NODE of a *RIGID BODY.
    """

    labels: Index
    points: Array
    sets: dict[str, Index]
    cells: dict[str, Index]
    mass: float | None
    rotations: dict[int, int]


def read_deck(path: str | Path) -> Deck:
    """Read a deck, with the decks it includes; whatever else is in it is passed over.

    Names of sets are in capitals, as CalculiX has them. Raises OptionError for files that cannot be read, decks without
    nodes, and those with parts and instances, which number nodes anew.
    """
    path = Path(path)
    try:
        cards = list(_cards(path, 0))
        return _deck(cards, path)
    except (ValueError, IndexError, KeyError) as error:
        raise OptionError(f"{path} is no input deck that can be read: {error}") from None


def _deck(cards: list[Card], path: Path) -> Deck:
    assembled = [card.name for card in cards if card.name in ("*PART", "*INSTANCE", "*ASSEMBLY")]
    if assembled:
        raise OptionError(f"{path} has {assembled[0]}: write a flat deck, in which every node has one number")
    nodes = [
        np.array(card.numbers(), dtype=float).reshape(-1, 4) for card in cards if card.name == "*NODE" and card.lines
    ]
    if not nodes:
        raise OptionError(f"{path} has no *NODE with nodes: it should be the deck that the matrices come from")
    table = np.concatenate(nodes)
    labels = table[:, 0].astype(np.intp)
    labels, last = np.unique(labels[::-1], return_index=True)
    points = table[::-1][last, 1:]
    cells, densities = _cells(cards, labels)
    is_known = cells and all(card.kind in CELLS for card in cards if card.name == "*ELEMENT")
    is_known = is_known and all(np.isfinite(own).all() for own in densities.values())
    mass = _mass(points, cells, densities) if is_known else None
    return Deck(labels, points, _sets(cards, "*NSET", "NSET", "*NODE"), cells, mass, _rotations(cards))


def _cards(path: Path, depth: int) -> Iterator[Card]:
    """Keywords with their lines; a line of keywords that ends in a comma goes on in the next."""
    text = read_text(path, encoding="latin-1")
    card: Card | None = None
    head = ""
    for line in map(str.strip, text.splitlines()):
        if not line or line.startswith("**"):
            continue
        if not (line.startswith("*") or head):
            if card is not None:
                card.lines.append(line)
            continue
        head += line
        if head.endswith(","):
            continue
        if card is not None:
            yield card
        name, *options = (part.strip() for part in head.split(","))
        pairs = [option.partition("=")[::2] for option in options]
        card = Card("".join(name.upper().split(" ")), {k.strip().upper(): v.strip().strip('"') for k, v in pairs}, [])
        head = ""
        if card.name == "*INCLUDE":
            if depth == NESTED:
                raise OptionError(f"{path} includes decks more than {NESTED} deep")
            yield from _cards(path.parent / card.options["INPUT"], depth + 1)
            card = None
    if card is not None:
        yield card


def _sets(cards: list[Card], keyword: str, option: str, other: str) -> dict[str, Index]:
    """Sets of nodes or elements: by lists, ranges, names of sets, and as a parameter of what defines their members."""
    found: dict[str, list[Index]] = defaultdict(list)
    for card in cards:
        name = card.options.get(option, "").upper()
        if card.name == keyword and "GENERATE" in card.options:
            for line in card.lines:
                first, last, *step = (int(text) for text in line.split(",") if text.strip())
                within("file_bytes", 8 * len(range(first, last + 1, *step)), f"set {name}, {line}")
                found[name].append(np.arange(first, last + 1, *step))
        elif card.name == keyword:
            texts = card.numbers()
            unknown = [text for text in texts if not _is_number(text) and text.upper() not in found]
            if unknown:
                raise ValueError(f"{keyword} {name} takes in {unknown[0]}, which is not defined before")
            found[name].append(np.array([int(t) for t in texts if _is_number(t)], dtype=np.intp))
            found[name] += [part for t in texts if not _is_number(t) for part in found[t.upper()]]
        elif card.name == other and name and card.lines:
            width = 4 if other == "*NODE" else 1 + _points(card)
            found[name].append(np.array(card.numbers()[::width], dtype=float).astype(np.intp))
    return {name: np.unique(np.concatenate(parts)) for name, parts in found.items() if name and parts}


def _is_number(text: str) -> bool:
    return text.lstrip("-").isdigit()


def _points(card: Card) -> int:
    """Number of points of the elements of a card; of those of unknown type what its first line has."""
    known = {"C3D10": 10, "C3D20": 20, "C3D20R": 20, "C3D15": 15}
    own = known.get(card.kind)
    return own or len([text for text in card.lines[0].split(",") if text.strip()]) - 1


def _cells(cards: list[Card], labels: Index) -> tuple[dict[str, Index], dict[str, Array]]:
    """Points of elements of known shape, by position, and their densities, nan where there is none, by kind of cell."""
    density: dict[str, float] = {}
    material = ""
    for card in cards:
        if card.name == "*MATERIAL":
            material = card.options["NAME"].upper()
        elif card.name == "*DENSITY":
            density[material] = float(card.numbers()[0])
    members = _sets(cards, "*ELSET", "ELSET", "*ELEMENT")
    found: dict[str, list[Index]] = defaultdict(list)
    for card in cards:
        if card.name == "*ELEMENT" and card.kind in CELLS and card.lines:
            found[CELLS[card.kind]].append(np.array(card.numbers(), dtype=np.intp).reshape(-1, 1 + _points(card)))
    cells, densities = {}, {}
    for kind, tables in found.items():
        table = np.concatenate(tables)
        if not np.isin(table[:, 1:], labels).all():
            raise ValueError("an element has a node that is not defined")
        cells[kind] = np.searchsorted(labels, table[:, 1:])
        densities[kind] = np.full(len(table), np.nan)
        for card in cards:
            if card.name == "*SOLIDSECTION":
                own = np.isin(table[:, 0], members.get(card.options["ELSET"].upper(), []))
                densities[kind][own] = density.get(card.options["MATERIAL"].upper(), np.nan)
    return cells, densities


def _mass(points: Array, cells: dict[str, Index], densities: dict[str, Array]) -> float:
    """Density times volume of some cells."""
    values = np.unique(np.concatenate(list(densities.values())))
    materials = tuple(SolidMaterial("", 1.0, 0.0, rho) for rho in values.tolist())
    of_cells = {kind: np.searchsorted(values, own) for kind, own in densities.items()}
    return mesh_mass(SolidMesh(points, cells, of_cells, materials)).mass


def _rotations(cards: list[Card]) -> dict[int, int]:
    options = [card.options for card in cards if card.name == "*RIGIDBODY" and "ROTNODE" in _squeezed(card.options)]
    return {int(_squeezed(own)["ROTNODE"]): int(_squeezed(own)["REFNODE"]) for own in options}


def _squeezed(options: dict[str, str]) -> dict[str, str]:
    return {key.replace(" ", ""): value for key, value in options.items()}
