"""Model files as trees of plain data in which everything knows its line, laid over those that they extend.

Only what a description needs is accepted: one document, no tags, text keys, bounded size. Scalars follow the
core schema of YAML 1.2, and nothing in the text can make an object or run code.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from flexura.errors import ModelError, OptionError, Path, Problem, did_you_mean
from flexura.files import MISSING, read_bytes
from flexura.mechanism import CONTROL
from flexura.sizes import beyond, size_limit

VERSION = 1
"""Of the file format."""

MAX_DEPTH = 30
MAX_BASES = 10
KEY = "extends"
"""The file that a model file is laid over."""

SourcePosition = tuple[str, int]
"""Name of a document, and a line of it."""


@dataclass
class Node:
    """A scalar, list or mapping of the document `name`; `size` counts the nodes in it, aliases written out."""

    line: int
    value: Any = None
    size: int = 1
    key_places: dict[str, SourcePosition] = field(default_factory=dict)
    name: str = ""

    def plain(self) -> Any:
        """The data as dicts, lists and scalars; nothing is shared between two places."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, list):
            return [node.plain() for node in self.value]
        return self.value

    def at(self, path: Path) -> Node:
        """The node at the part of a path that the document has."""
        node = self
        for key in self.locate(path)[0]:
            node = node.value[key]
        return node

    def locate(self, path: Path) -> tuple[Path, SourcePosition]:
        """The part of a path that the document has, and the place of its end.

        One key more is kept where a mapping lacks it; positions are dropped where there is no list.
        """
        node, place = self, (self.name, self.line)
        kept: list[str | int] = []
        for key in path:
            if isinstance(node.value, dict):
                if key in node.value:
                    node, place = node.value[key], node.key_places[str(key)]
                elif isinstance(key, int):
                    continue
                else:
                    return (*kept, key), place
            elif isinstance(node.value, list) and isinstance(key, int) and key < len(node.value):
                node = node.value[key]
                place = (node.name, node.line)
            else:
                break
            kept.append(key)
        return tuple(kept), place

    def extended(self, over: Node, path: Path = ()) -> Node:
        """This document with what another says in its place: mappings are joined key by key, null takes a key out.

        Raises ModelError where there is no such key to take out.
        """
        if not (isinstance(self.value, dict) and isinstance(over.value, dict)):
            return over
        joined, places = dict(self.value), dict(self.key_places)
        for key, node in over.value.items():
            places[key] = over.key_places[key]
            if node.value is None and key not in joined:
                name, line = places[key]
                raise _error(
                    name, line, "there is nothing here to take out", "null removes what a file extends", (*path, key)
                )
            if node.value is None:
                del joined[key]
            else:
                joined[key] = joined[key].extended(node, (*path, key)) if key in joined else node
        return Node(over.line, joined, self.size + over.size, places, over.name)


def parse(text: str, name: str) -> Node:
    """Read one YAML document whose top level is a mapping.

    Raises ModelError, with `name` and the line, for anything else.
    """
    root = parse_any(text, name)
    if not isinstance(root.value, dict):
        raise _error(name, root.line, "the top level of a model file is a mapping of keys to values", _TOP_HINT)
    return root


def parse_any(text: str, name: str) -> Node:
    """Read one YAML document of any kind. Raises ModelError, with `name` and the line, for anything else."""
    if excess := beyond("model_bytes", len(text)):
        raise _error(name, 1, *excess[1:], value=excess[0])
    try:
        return _Builder(text, name).document()
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        rule = " ".join(f"not valid YAML: {error.problem or error.context}".split())
        raise _error(name, mark.line + 1 if mark else 1, rule, _syntax_hint(rule)) from None
    except (YAMLError, ValueError, OverflowError, IndexError, TypeError, AttributeError) as error:
        rule = " ".join(str(error).split())[:200]
        raise _error(name, 1, f"not valid YAML: {rule or type(error).__name__}") from None


_TOP_HINT = "e.g. nodes: {base: [0, 0, 0]}"


def _syntax_hint(rule: str) -> str:
    if "\\t" in rule or "tab" in rule:
        return "indent with spaces, not tabs"
    quoting = "mapping values" in rule or "expected ','" in rule
    return "put text that holds : # or brackets in quotes" if quoting else ""


def _error(name: str, line: int, rule: str, hint: str = "", path: Path = (), value: str = "") -> ModelError:
    return ModelError([Problem(path, value, rule, hint, f"{name}:{line}")])


class _Builder:
    """Builds nodes from the parser's events, checking every bound on the way."""

    def __init__(self, text: str, name: str) -> None:
        self.name = name
        self.events: Iterator[Any] = iter(YAML(typ="safe", pure=True).parse(text))
        self.anchors: dict[str, Node | None] = {}
        self.count, self.most = 0, size_limit("model_values")

    def document(self) -> Node:
        event = next(self.events)
        while type(event).__name__ != "DocumentStartEvent":
            if type(event).__name__ == "StreamEndEvent":
                raise _error(self.name, 1, "the file is empty", _TOP_HINT)
            event = next(self.events)
        first = next(self.events)
        root = self.node(first, ())
        next(self.events)
        after = next(self.events)
        if type(after).__name__ != "StreamEndEvent":
            line = after.start_mark.line + 1
            raise _error(self.name, line, "a model file holds one document", "remove the line ---")
        if root.value is None:
            raise _error(self.name, 1, "the file is empty", _TOP_HINT)
        return root

    def fail(self, event: Any, path: Path, rule: str, hint: str = "", value: str = "") -> ModelError:
        return _error(self.name, event.start_mark.line + 1, rule, hint, path, value)

    def node(self, event: Any, path: Path) -> Node:
        kind = type(event).__name__
        if kind == "AliasEvent":
            return self.alias(event, path)
        if event.tag is not None:
            tag = str(event.tag).replace("tag:yaml.org,2002:", "!!")
            raise self.fail(event, path, "tags are not accepted", "remove the tag", tag)
        if len(path) > MAX_DEPTH:
            raise self.fail(event, path[:3], f"a description nests at most {MAX_DEPTH} deep")
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        node = Node(event.start_mark.line + 1, name=self.name)
        self.grow(event, path, 1)
        if kind == "ScalarEvent":
            node.value = resolve(event.value) if event.implicit[0] else self.text(event, path)
        elif kind == "SequenceStartEvent":
            node.value = []
            while type(item := next(self.events)).__name__ != "SequenceEndEvent":
                child = self.node(item, (*path, len(node.value)))
                node.value.append(child)
                node.size += child.size
        else:
            self.mapping(node, path)
        if event.anchor is not None:
            self.anchors[event.anchor] = node
        return node

    def text(self, event: Any, path: Path) -> str:
        if any("\ud800" <= c <= "\udfff" for c in event.value):
            raise self.fail(event, path, "text holds half of a surrogate pair", "write the character itself")
        if control := CONTROL.search(event.value):
            raise self.fail(event, path, "text holds a control character", "remove it", repr(control[0]))
        return event.value

    def mapping(self, node: Node, path: Path) -> None:
        node.value = {}
        merged: list[Node] | None = None
        while type(event := next(self.events)).__name__ != "MappingEndEvent":
            if type(event).__name__ != "ScalarEvent" or event.tag is not None:
                raise self.fail(event, path, "a key is plain text", "e.g. base: [0, 0, 0]")
            key, line = self.text(event, path), event.start_mark.line + 1
            if key == "<<" and event.implicit[0]:
                if merged is not None:
                    raise self.fail(event, (*path, key), "the same key twice in one mapping", "<<: [*first, *second]")
                merged = self.merged(event, (*path, key))
                continue
            if key in node.value:
                hint = f"it is already on line {node.key_places[key][1]}"
                raise self.fail(event, (*path, key), "the same key twice in one mapping", hint)
            child = self.node(next(self.events), (*path, key))
            node.value[key] = child
            node.key_places[key] = (self.name, line)
            node.size += child.size
        for other in merged or ():
            for key, child in other.value.items():
                if key not in node.value:
                    node.value[key], node.key_places[key] = child, other.key_places[key]
                    node.size += child.size

    def merged(self, event: Any, path: Path) -> list[Node]:
        """The mappings that a key `<<` joins in, the first of them first (YAML merge key, 2005)."""
        node = self.node(next(self.events), path)
        mappings = node.value if isinstance(node.value, list) else [node]
        if not all(isinstance(each.value, dict) for each in mappings):
            raise self.fail(event, path, "<< takes a mapping, or a list of them", "e.g. <<: *leaf")
        return mappings

    def alias(self, event: Any, path: Path) -> Node:
        if event.anchor not in self.anchors:
            raise self.fail(event, path, f"the anchor &{event.anchor} does not exist")
        node = self.anchors[event.anchor]
        if node is None:
            raise self.fail(event, path, f"the alias *{event.anchor} lies inside its own anchor")
        if len(path) + _height(node) > MAX_DEPTH:
            raise self.fail(event, path[:3], f"a description nests at most {MAX_DEPTH} deep")
        self.grow(event, path, node.size)
        return node

    def grow(self, event: Any, path: Path, count: int) -> None:
        self.count += count
        if self.count > self.most and (excess := beyond("model_values", self.count)):
            raise self.fail(event, path[:3], *excess[1:])


def _height(node: Node) -> int:
    children = node.value.values() if isinstance(node.value, dict) else node.value
    return 1 + max(map(_height, children), default=0) if isinstance(node.value, dict | list) else 0


_NULL = re.compile(r"null|Null|NULL|~|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
_INTEGER = re.compile(r"[-+]?[0-9]+")
_RADIX = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_SPECIAL = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_LONGEST_INTEGER = 300


def resolve(text: str) -> Any:
    """Value of a plain scalar by the core schema of YAML 1.2."""
    if _NULL.fullmatch(text):
        return None
    if _BOOL.fullmatch(text):
        return text.lower() == "true"
    if len(text) <= _LONGEST_INTEGER:
        if _INTEGER.fullmatch(text):
            return int(text)
        if _RADIX.fullmatch(text):
            return int(text, 0)
    if _SPECIAL.fullmatch(text):
        return float(text.replace(".", "", 1))
    return float(text) if _FLOAT.fullmatch(text) else text


def with_bases(root: Node, directory: FilePath, above: tuple[FilePath, ...] = ()) -> Node:
    """A document on top of the one that its key `extends` names, relative to `directory`, and so on.

    Raises ModelError for files that cannot be read, that extend each other in a circle or become too large.
    """
    base = root.value.pop(KEY, None)
    if base is None:
        return root
    line = root.key_places.pop(KEY)[1]

    def refused(rule: str, hint: str = "") -> ModelError:
        return ModelError([Problem((KEY,), repr(base.value), rule, hint, f"{root.name}:{line}")])

    if not isinstance(base.value, str):
        raise refused("the name of a model file is expected here", "e.g. extends: stage.yaml")
    file = directory / base.value
    try:
        resolved, is_there = file.resolve(), file.is_file()
    except (OSError, ValueError, RuntimeError) as error:  # names that are too long, null bytes, circles of links
        raise refused(f"the file cannot be found: {getattr(error, 'strerror', None) or error}") from None
    if resolved in above:
        raise refused("the files extend each other in a circle")
    if len(above) >= MAX_BASES:
        raise refused(f"at most {MAX_BASES} files extend each other")
    if not is_there:
        raise refused("the file does not exist", f"looked in {directory.resolve()}")
    lower = with_bases(parse(text_of(file), str(file)), file.parent, (*above, resolved))
    if file.parent != directory:
        _carry_paths(lower, FilePath(base.value).parent)
    whole = lower.extended(root)
    if too_large := beyond("model_values", whole.size):
        raise refused(*too_large[1:])
    return whole


def files_of(file: FilePath) -> tuple[FilePath, ...]:
    """A model file and those that it extends, as far as they can be read."""
    files: list[FilePath] = []
    extended: FilePath | None = file
    while extended is not None and len(files) <= MAX_BASES:
        files.append(extended)
        try:
            base = parse(text_of(extended), str(extended)).value.get(KEY)
        except ModelError:
            break
        extended = extended.parent / base.value if base is not None and isinstance(base.value, str) else None
    return tuple(files)


FILES_OF_PARTS = ("step", "drawing", "mesh")
"""Keys of parts that name files."""


def _carry_paths(node: Node, folder: FilePath) -> None:
    """Let files that superelements and parts of a document name be found from another folder."""
    substructures = node.value.get("substructures")
    carried: dict[int, Node] = {}  # aliases share nodes
    holders = [node, *(substructures.value.values() if substructures and isinstance(substructures.value, dict) else ())]
    for holder in holders:
        entries = holder.value.get("superelements") if isinstance(holder.value, dict) else None
        for entry in entries.value.values() if entries and isinstance(entries.value, dict) else ():
            for matrix in entry.value.values() if isinstance(entry.value, dict) else ():
                if isinstance(matrix.value, dict) and isinstance(getattr(matrix.value.get("file"), "value", None), str):
                    carried[id(matrix.value["file"])] = matrix.value["file"]
        entries = holder.value.get("disturbances") if isinstance(holder.value, dict) else None
        for entry in entries.value.values() if entries and isinstance(entries.value, dict) else ():
            file = entry.value.get("file") if isinstance(entry.value, dict) else None
            if file is not None and isinstance(file.value, str):
                carried[id(file)] = file
        parts = holder.value.get("parts") if isinstance(holder.value, dict) else None
        for entry in parts.value.values() if parts and isinstance(parts.value, dict) else ():
            for key in FILES_OF_PARTS:
                file = entry.value.get(key) if isinstance(entry.value, dict) else None
                if file is not None and isinstance(file.value, str):
                    carried[id(file)] = file
    for file in carried.values():
        file.value = str(folder / file.value)


def text_of(file: FilePath) -> str:
    """Text of a model file. Raises ModelError when it cannot be read."""

    def refused(rule: str, hint: str = "") -> ModelError:
        return ModelError([Problem((), "", rule, hint, str(file))])

    try:
        content = read_bytes(file, "model_bytes")
    except OptionError as error:
        rule, _, hint = str(error).removeprefix(f"{file}: ").partition("\n    hint: ")
        if rule == MISSING:
            nearby = [p.name for p in file.parent.glob("*") if p.is_file()] if file.parent.is_dir() else []
            hint = did_you_mean(file.name, nearby, "", quoted=False)
        raise refused(rule, hint) from None
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ModelError([Problem((), "", "a model file is text in UTF-8", "", f"{file}:{line}")]) from None
