"""Model files that extend others, and the text of files."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path as FilePath

from flexura.errors import ModelError, OptionError, Problem
from flexura.files import MISSING, read_bytes
from flexura.modelfile.document import Node, parse
from flexura.sizes import beyond

KEY = "extends"
MAX_BASES = 10


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
        own, found = file.resolve(), file.is_file()
    except (OSError, ValueError, RuntimeError) as error:  # names that are too long, null bytes, circles of links
        raise refused(f"the file cannot be found: {getattr(error, 'strerror', None) or error}") from None
    if own in above:
        raise refused("the files extend each other in a circle")
    if len(above) >= MAX_BASES:
        raise refused(f"at most {MAX_BASES} files extend each other")
    if not found:
        raise refused("the file does not exist", f"looked in {directory.resolve()}")
    lower = with_bases(parse(text_of(file), str(file)), file.parent, (*above, own))
    if file.parent != directory:
        _carry_paths(lower, FilePath(base.value).parent)
    whole = lower.extended(root)
    if too_large := beyond("model_values", whole.size):
        raise refused(*too_large[1:])
    return whole


def files_of(file: FilePath) -> tuple[FilePath, ...]:
    """A model file and those that it extends, as far as they can be read."""
    found: list[FilePath] = []
    own: FilePath | None = file
    while own is not None and len(found) <= MAX_BASES:
        found.append(own)
        try:
            base = parse(text_of(own), str(own)).value.get(KEY)
        except ModelError:
            break
        own = own.parent / base.value if base is not None and isinstance(base.value, str) else None
    return tuple(found)


def _carry_paths(node: Node, folder: FilePath) -> None:
    """Let files that the superelements of a document name be found from another folder."""
    substructures = node.value.get("substructures")
    carried: dict[int, Node] = {}  # aliases share nodes
    holders = [node, *(substructures.value.values() if substructures and isinstance(substructures.value, dict) else ())]
    for holder in holders:
        entries = holder.value.get("superelements") if isinstance(holder.value, dict) else None
        for entry in entries.value.values() if entries and isinstance(entries.value, dict) else ():
            for matrix in entry.value.values() if isinstance(entry.value, dict) else ():
                if isinstance(matrix.value, dict) and isinstance(getattr(matrix.value.get("file"), "value", None), str):
                    carried[id(matrix.value["file"])] = matrix.value["file"]
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
            close = get_close_matches(file.name, nearby, n=1)
            hint = f"did you mean {close[0]}?" if close else ""
        raise refused(rule, hint) from None
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ModelError([Problem((), "", "a model file is text in UTF-8", "", f"{file}:{line}")]) from None
