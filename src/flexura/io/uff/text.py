"""What writers of universal files do to the text of the format: Fortran exponents, and names too long for a column."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from flexura.errors import OptionError
from flexura.files import read_bytes, scratch_folder

_NUMBERS = re.compile(rb"^[ \t\d.+\-EeDd]*\d[Dd][+-]?\d[ \t\d.+\-EeDd]*\r?$", re.MULTILINE)
_EXPONENT = re.compile(rb"(?<=\d)[Dd](?=[+-]?\d)|(?<=\d\.)[Dd](?=[+-]?\d)")
_HEAD = re.compile(rb"^ *-1 *\r?\n +58b?\b[^\n]*\n(?:[^\n]*\n){5}([^\n]*)\n", re.MULTILINE)
_ENDS = re.compile(r".{30} *(\S.*?)\s+(-?\d+)\s+(-?\d+)\s+(\S.*?)\s+(-?\d+)\s+(-?\d+)\s*")
_COLUMNS = 80


@contextmanager
def readable(path: Path) -> Iterator[Path]:
    """The path itself, or of a file in ASCII with exponents such as 1.0D+01 one of a copy that has E in their place."""
    content = read_bytes(path)
    if b"58b" in content or not _NUMBERS.search(content):
        yield path
        return
    with scratch_folder() as folder:
        copy = folder / path.name
        copy.write_bytes(_NUMBERS.sub(lambda line: _EXPONENT.sub(b"E", line[0]), content))
        yield copy


def restore_names(sets: list[dict[str, Any]], content: bytes, path: Path) -> None:
    """Put right the ends of datasets 58 whose names of more than ten letters have moved what stands behind them.

    Raises OptionError for a line of ends that is too long in any other way.
    """
    lines = [match[1].decode("utf-8", "replace").rstrip() for match in _HEAD.finditer(content)]
    own = [(k, s) for k, s in enumerate(sets) if s["type"] == 58]
    if len(lines) != len(own):
        return
    for line, (k, s) in zip(lines, own, strict=True):
        if len(line) <= _COLUMNS:
            continue
        ends = _ENDS.fullmatch(line)
        if ends is None:
            raise OptionError(
                f"{path}: dataset {k + 1}: its response and reference are not readable: {line[30:].strip()!r}"
            )
        for at, which in ((1, "rsp"), (4, "ref")):
            s[f"{which}_ent_name"] = ends[at]
            s[f"{which}_node"], s[f"{which}_dir"] = int(ends[at + 1]), int(ends[at + 2])
