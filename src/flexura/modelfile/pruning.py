"""Taking what is wrong out of the data, so that the rest can be checked too."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

from flexura.errors import Path

_NAMED = frozenset(
    [
        "nodes",
        "links",
        "flexures",
        "springs",
        "bodies",
        "masses",
        "superelements",
        "dashpots",
        "actuators",
        "sensors",
        "instances",
        "joints",
        "interface",
        "ground",
        "loads",
        "at",
        "parameters",
        "materials",
        "sections",
        "substructures",
        "studies",
    ]
)


_STAND_INS: dict[str, Any] = {
    "profile": {"type": "leaf", "width": "2 mm", "thickness": "1 mm"},
    "section": {"shape": "circle", "diameter": "1 mm"},
    "reference": [1, 2, 3],
    "start_offset": [0, 0, 0],
    "end_offset": [0, 0, 0],
    "elements": 1,
    "integration": "stepped",
    "theory": "rayleigh",
    "corrections": "none",
    "ends": ["clamped", "clamped"],
    "root": "elastic",
    "fillet": 0,
    "mesh_size": None,
}
"""What takes the place of a faulty key of a member, so that the nodes, material and section that it names are still
checked."""

_REFERENCES = ("nodes", "material", "section")


class Pruned:
    """Data of a model file with entries removed, and what was removed.

    `names` are those of removed entries; `whole_kinds` tells that a whole mapping such as `nodes` went, and
    `everything` that nothing is left to check.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        self.data = data
        self.names: set[str] = set()
        self.anything: bool = False
        self.whole_kinds: bool = False
        self.everything: bool = False
        self.mended: set[Path] = set()
        """Members in which stand-ins took the place of what was wrong."""
        self._origin: dict[Path, list[int]] = {}

    def original(self, path: Path) -> Path:
        """The path in the file of a path in what is left: entries of lists have moved up."""
        restored = list(path)
        for i, key in enumerate(path):
            origin = self._origin.get(path[:i])
            if origin is not None and isinstance(key, int) and key < len(origin):
                restored[i] = origin[key]
        return tuple(restored)

    def is_news(self, path: Path) -> bool:
        """False for a problem that a stand-in may have caused: of a mended member only its references are checked."""
        entry = entry_of_place(path)
        return entry not in self.mended or path[len(entry) : len(entry) + 1] in [(key,) for key in _REFERENCES]

    def _mend(self, path: Path) -> bool:
        """Put a stand-in for the faulty key of a member; False when there is none for it."""
        entry = entry_of_place(path)
        if len(path) <= len(entry) or path[len(entry) - 2 : len(entry) - 1] not in [("links",), ("flexures",)]:
            return False
        key = path[len(entry)]
        holder: Any = self.data
        try:
            for step in entry:
                holder = holder[step]
            if key not in _STAND_INS or holder[key] == _STAND_INS[key]:
                return False
            holder[key] = deepcopy(_STAND_INS[key])
        except (KeyError, IndexError, TypeError):
            return False
        self.anything = True
        self.mended.add(entry)
        return True

    def remove_all(self, places: list[tuple[Path, bool]]) -> None:
        """Remove unknown keys (True) themselves, and of other places the smallest named entry around them."""
        places = [(path, unknown) for path, unknown in places if unknown or not self._mend(path)]
        paths = {path if unknown else entry_of_place(path) for path, unknown in places}
        for path in sorted(paths, key=_last_first, reverse=True):
            unknown = (path, True) in places
            if not path:
                self.everything = True
            elif unknown:
                self.remove(path)
            else:
                self.remove_entry(path)

    def remove_entry(self, path: Path) -> None:
        """Remove a named entry, or a whole kind of them, and remember the name."""
        self.anything = True
        if isinstance(path[-1], str):
            self.names.add(path[-1])
        if len(path) % 2 == 1 and path[-1] in _NAMED:
            self.whole_kinds = True
        self.remove(path)

    def remove(self, path: Path) -> None:
        """Remove what is at a path, if it is still there."""
        holder: Any = self.data
        key: Any = path[-1]
        try:
            for step in path[:-1]:
                holder = holder[step]
            if isinstance(holder, list):
                self._origin.setdefault(path[:-1], list(range(len(holder)))).pop(key)
            del holder[key]
        except (KeyError, IndexError, TypeError):
            return


def entry_of_place(path: Path) -> Path:
    """The smallest named entry around a place: a member, a node, a material; or the key at the top level."""
    start = 2 if path[:1] == ("substructures",) and len(path) > 2 else 0
    inside = path[start:]
    return path[: start + (2 if len(inside) > 1 and inside[0] in _NAMED else 1)]


def _last_first(path: Path) -> tuple[tuple[bool, int, str], ...]:
    return tuple((isinstance(key, int), key if isinstance(key, int) else 0, str(key)) for key in path)
