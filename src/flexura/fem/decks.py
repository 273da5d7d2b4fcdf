"""Input decks of Abaqus and CalculiX: their keywords with what stands below them, nodes and sets."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.files import read_text
from flexura.sizes import within

SOLID = re.compile(r"D?C3D(\d+)[A-Z]*")
"""Types of solid elements, with their number of points."""

LARGEST_NUMBER = 1e15
"""Numbers of nodes are smaller."""

NESTED = 10
"""Deepest inclusion of decks in decks."""


class Card(NamedTuple):
    """A keyword and its parameters by name, without blanks and in capitals, and the lines of data below it."""

    name: str
    options: dict[str, str]
    lines: list[str]

    @property
    def kind(self) -> str:
        """Type of the elements."""
        return self.options.get("TYPE", "").upper()

    @property
    def points(self) -> int:
        """Number of points of the elements; of those of unknown type what the first line has."""
        solid = SOLID.fullmatch(self.kind)
        return int(solid[1]) if solid else len([text for text in self.lines[0].split(",") if text.strip()]) - 1

    def numbers(self) -> list[str]:
        """All entries of the lines."""
        return [text.strip() for line in self.lines for text in line.split(",") if text.strip()]


def deck_cards(path: Path) -> list[Card]:
    """Keywords of a deck and of those that it includes.

    Raises OptionError for files that cannot be read and decks with parts and instances, which number nodes anew;
    KeyError where a parameter is missing.
    """
    cards = list(_cards(path, 0))
    assembled = [card.name for card in cards if card.name in ("*PART", "*INSTANCE", "*ASSEMBLY")]
    if assembled:
        raise OptionError(f"{path} has {assembled[0]}: write a flat deck, in which every node has one number")
    return cards


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
        values = {key.upper().replace(" ", ""): value.strip().strip('"') for key, value in pairs}
        card = Card(name.upper().replace(" ", ""), values, [])
        head = ""
        if card.name == "*INCLUDE":
            if depth == NESTED:
                raise OptionError(f"{path} includes decks more than {NESTED} deep")
            yield from _cards(path.parent / card.options["INPUT"], depth + 1)
            card = None
    if card is not None:
        yield card


def deck_nodes(cards: list[Card]) -> tuple[Index, Array]:
    """Numbers (p,), ascending, and places (p, 3) of nodes; of those given twice the last. ValueError where none is."""
    nodes = [card for card in cards if card.name == "*NODE" and card.lines]
    if not nodes:
        raise ValueError("it has no *NODE with nodes")
    table = np.concatenate([np.array(card.numbers(), dtype=float).reshape(-1, 4) for card in nodes])
    if not (np.abs(table[:, 0]) < LARGEST_NUMBER).all():
        raise ValueError("a *NODE has a number that is none")
    labels = table[:, 0].astype(np.intp)
    labels, last = np.unique(labels[::-1], return_index=True)
    return labels, table[::-1][last, 1:]


def deck_sets(cards: list[Card], option: str) -> dict[str, Index]:
    """Sets of nodes (`option` NSET) or elements (ELSET) by name, in capitals: by lists, ranges, names of sets, and as
    an option of the cards with their members. ValueError where a set takes in one that is not defined before."""
    members = {"NSET": "*NODE", "ELSET": "*ELEMENT"}[option]
    sets: dict[str, list[Index]] = defaultdict(list)
    for card in cards:
        name = card.options.get(option, "").upper()
        if card.name == f"*{option}" and "GENERATE" in card.options:
            for line in card.lines:
                first, last, *step = (int(text) for text in line.split(",") if text.strip())
                within("file_bytes", 8 * len(range(first, last + 1, *step)), f"set {name}, {line}")
                sets[name].append(np.arange(first, last + 1, *step))
        elif card.name == f"*{option}":
            numbers, names = [], []
            for text in card.numbers():
                if text.lstrip("-").isdigit():
                    numbers.append(int(text))
                elif text.upper() in sets:
                    names.append(text.upper())
                else:
                    raise ValueError(f"*{option} {name} takes in {text}, which is not defined before")
            sets[name].append(np.array(numbers, dtype=np.intp))
            sets[name] += [part for other in names for part in sets[other]]
        elif card.name == members and name and card.lines:
            width = 4 if members == "*NODE" else 1 + card.points
            sets[name].append(np.array(card.numbers()[::width], dtype=float).astype(np.intp))
    return {name: np.unique(np.concatenate(parts)) for name, parts in sets.items() if name and parts}
