"""Reading a model file into a Mechanism, with everything that is wrong with it at once.

What is wrong is taken out of the data, so that the rest can be checked too.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from copy import deepcopy
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

from pydantic import ValidationError

from flexura.arguments import verb
from flexura.errors import ModelError, OptionError, Path, Problem
from flexura.expressions import Expression
from flexura.mechanism import (
    CONTEXT_KEY,
    UNKNOWN_KEY,
    AnyPart,
    Mechanism,
    Part,
    entry_of,
    problems_of,
    validated,
)
from flexura.mechanism import problems as problems_of_whole
from flexura.modelfile.densities import prepare_densities
from flexura.modelfile.document import FILES_OF_PARTS, VERSION, Node, parse, text_of, with_bases
from flexura.modelfile.gains import prepare_gains
from flexura.modelfile.parameters import entries, holders, prepare_bound_values, prepare_parameters
from flexura.modelfile.quantities import QuantityReader
from flexura.modelfile.schema import unknown_key_hint
from flexura.modelfile.superelements import prepare_superelement

MAX_ROUNDS = 10

_NAMED = frozenset(
    [
        "nodes",
        "links",
        "flexures",
        "diaphragms",
        "flat_springs",
        "springs",
        "bodies",
        "masses",
        "superelements",
        "dashpots",
        "stops",
        "actuators",
        "sensors",
        "instances",
        "parts",
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
        "disturbances",
        "controllers",
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


@verb
def load(path: str | FilePath) -> Mechanism:
    """Read a model file.

    Raises ModelError listing every problem with its file and line.
    """
    try:
        file = FilePath(path)
    except TypeError:
        raise OptionError(f"the path of a model file is expected, not a {type(path).__name__}") from None
    return _read(text_of(file), str(path), file.parent)


@verb
def loads(text: str, name: str = "<text>") -> Mechanism:
    """Read a model from text; `name` represents the file in messages.

    Files that it names are sought in the working directory. Raises ModelError listing every problem with its line.
    """
    if not isinstance(text, str):
        raise OptionError(f"the text of a model is expected, not a {type(text).__name__}")
    return _read(text, name, FilePath())


def described(data: dict[str, Any], name: str) -> Mechanism:
    """The mechanism of keys and values as a file has them. Raises ModelError listing every problem."""
    return _read(json.dumps(data), name, FilePath())


def _read(text: str, name: str, directory: FilePath) -> Mechanism:
    root = with_bases(parse(text, name), directory)
    data = root.plain()
    pruned = Pruned(data)
    problems = [*_version(data, pruned), *_superelements(data, pruned, directory)]
    for problem in prepare_densities(data, directory):
        pruned.remove_entry(problem.path[:2])
        problems.append(problem)
    _find_parts(data, directory)
    parameters = data.get("parameters")
    dimensions, more = prepare_parameters(parameters) if isinstance(parameters, dict) else ({}, [])
    for problem in more:
        if problem.path[2:] == ("unit",):
            pruned.remove_entry(problem.path[:2])
    problems += more
    prepare_gains(data, dimensions)
    for problem in prepare_bound_values(data, dimensions):
        pruned.remove_entry(entry_of_place(problem.path))
        problems.append(problem)
    mechanism, more = _validated(data, pruned, QuantityReader(dimensions))
    problems += more
    if mechanism is not None:
        missing = _All() if pruned.whole_kinds else pruned.names
        whole = problems_of_whole(mechanism, ignore_missing=missing, partial=pruned.anything)
        for problem in whole:
            path = pruned.original(problem.path)
            if pruned.is_news(path):
                problems.append(replace(problem, path=path, value=_as_written(problem, path, mechanism, root)))
    if problems or mechanism is None:
        raise ModelError(_located(problems, root, name))
    return mechanism


def _as_written(problem: Problem, path: Path, mechanism: Mechanism, root: Node) -> str:
    """The value of a problem with an expression as it stands in the file."""
    try:
        expression: Any = mechanism
        for key in problem.path:
            expression = entry_of(expression, str(key)) if isinstance(expression, Part) else expression[key]
        written: Any = root.at(path).value
    except (KeyError, IndexError, TypeError, AttributeError):
        return problem.value
    if isinstance(expression, Expression) and isinstance(written, str):
        return problem.value.replace(str(expression), written, 1)
    if isinstance(expression, float) and isinstance(written, str) and problem.value == str(expression):
        return written
    return problem.value


def _version(data: dict[str, Any], pruned: Pruned) -> Iterator[Problem]:
    version = data.get("flexura", VERSION)
    if version is not True and version == VERSION and isinstance(version, int):
        data.pop("flexura", None)
        return
    rule = f"this is version {VERSION} of the format"
    yield Problem(("flexura",), repr(version), rule, f"write flexura: {VERSION}")
    pruned.remove(("flexura",))


def _superelements(data: dict[str, Any], pruned: Pruned, directory: FilePath) -> list[Problem]:
    problems = []
    for path, holder in holders(data):
        for name, entry in entries(holder, "superelements"):
            problem = prepare_superelement(entry, directory) if isinstance(entry, dict) else None
            if problem is not None:
                here = (*path, "superelements", name)
                problems.append(replace(problem, path=(*here, *problem.path)))
                pruned.remove_entry(here)
    return problems


def _find_parts(data: dict[str, Any], directory: FilePath) -> None:
    """Let the files of parts be found from anywhere."""
    for _, holder in holders(data):
        for _, entry in entries(holder, "parts"):
            for key in FILES_OF_PARTS:
                if isinstance(entry, dict) and isinstance(entry.get(key), str):
                    entry[key] = str((directory / entry[key]).absolute())


def _validated(data: dict[str, Any], pruned: Pruned, reader: QuantityReader) -> tuple[Mechanism | None, list[Problem]]:
    """Validate the parts, removing and reporting what they refuse; None when nothing is left."""
    refused: list[Problem] = []
    for _ in range(MAX_ROUNDS):
        try:
            return validated(Mechanism, data, {CONTEXT_KEY: reader}), refused
        except ValidationError as error:
            problems = problems_of(error, data)
        for problem in problems:
            unknown = problem.rule == UNKNOWN_KEY
            hint = unknown_key_hint(problem.path, data) if unknown else problem.hint
            refused.append(replace(problem, path=pruned.original(problem.path), hint=hint))
        pruned.remove_all([(p.path, p.rule == UNKNOWN_KEY) for p in problems])
        if pruned.everything:
            break
    return None, refused


class _All(Collection[str]):
    """Holds every name."""

    def __contains__(self, _: object) -> bool:
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


def _located(problems: list[Problem], root: Node, name: str) -> list[Problem]:
    """Problems at their places and lines in the file, in that order and each once."""
    located: dict[Problem, tuple[bool, str, int]] = {}
    for problem in problems:
        path, (file, line) = root.locate(problem.path)
        located[replace(problem, path=path, where=f"{file}:{line}")] = (file != name, file, line)
    return sorted(located, key=lambda problem: located[problem])


def read_as(kind: type[AnyPart], text: str, name: str) -> AnyPart:
    """Another document of keys and values with units, such as a wish. Raises ModelError listing every problem with its
    line; `name` stands for the file in messages."""
    root = parse(text, name)
    try:
        return validated(kind, root.plain(), {CONTEXT_KEY: QuantityReader({})})
    except ValidationError as error:
        problems = problems_of(error, root.plain())
    raise ModelError(_located(problems, root, name))
