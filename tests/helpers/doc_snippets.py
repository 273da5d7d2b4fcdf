"""Read, run and compare the fenced snippets of the documentation.

What a block is, by the words behind its fence:

    ```python            run; the blocks of a page share one namespace
    ```text              right behind a python block: what that block prints
    ```yaml              a whole mechanism file: loaded and solved
    ```yaml fragment     part of one: put into a small mechanism and loaded
    ```yaml wish         a wish: read
    ```yaml broken       a file with mistakes in it, for the commands that follow
    ```console           lines that start with `$ flexura` are run and compared with the output below them
    ```sh                lines that start with `flexura` are run

A first line `# file: NAME` also writes the block to that file. In expected output a line `...` stands for any lines.
To rewrite the output of console and text blocks: PYTHONPATH=tests python -m helpers.doc_snippets docs/tutorial.md
"""

from __future__ import annotations

import contextlib
import difflib
import io
import os
import re
import shlex
import shutil
import sys
import tempfile
import traceback
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest import mock

ROOT = Path(__file__).parents[2]
MADE = {"changelog.md", "contributing.md"}
"""Pages that the build of the site writes into the folder of the others."""

FOLDERS = (".", "_examples", "start", "how-to", "theory")
PAGES = [ROOT / "README.md", *(page for own in FOLDERS for page in sorted((ROOT / "docs" / own).glob("*.md")))]
PAGES = [page for page in PAGES if page.name not in MADE]
PROGRAMS = ("flexura", ".venv/bin/flexura")

RELATIVE = 2e-3
"""Relative difference at which two printed numbers still count as equal."""
TINY = 1e-5
"""Residuals and errors below this are round-off and differ between machines."""

BASE = """\
flexura: 1
parameters: {length: 40 mm, width: 10 mm, t: 0.5 mm}
materials: {steel: spring-steel}
sections: {bar: {shape: rectangle, width: 10 mm, thickness: 5 mm}}
substructures:
  leg:
    nodes: {foot: [0, 0, 0], head: [0, 0, length]}
    flexures:
      blade:
        nodes: [foot, head]
        material: steel
        reference: x
        profile: {type: leaf, width: width, thickness: t}
    interface: [foot, head]
nodes: {a: [0, 0, 0], b: [length, 0, 0], c: [length, 0, 20 mm], d: [80 mm, 0, 0]}
links:
  ab: {nodes: [a, b], material: steel, section: bar, reference: z}
  bc: {nodes: [b, c], material: steel, section: bar, reference: x}
  bd: {nodes: [b, d], material: steel, section: bar, reference: z}
ground: {a: clamped}
"""
"""The mechanism that fragments are put into."""


@dataclass(frozen=True)
class Block:
    """A fenced block; `line` is that of its first line of text."""

    language: str
    words: tuple[str, ...]
    text: str
    line: int

    @property
    def file(self) -> str:
        """The file that the block is to be written to, or nothing."""
        match = re.match(r"# file: (\S+)\n", self.text)
        return match[1] if match else ""

    @property
    def is_whole_file(self) -> bool:
        """True for a whole mechanism file."""
        return re.search(r"^flexura: 1$", self.text, re.MULTILINE) is not None


def blocks(page: str) -> list[Block]:
    """All fenced blocks of a page."""
    found: list[Block] = []
    opening: tuple[list[str], int] | None = None
    lines: list[str] = []
    for number, line in enumerate(page.splitlines(), start=1):
        fence = re.match(r"```\s*(.*)$", line)
        if fence and opening is None:
            opening, lines = (fence[1].split(), number + 1), []
        elif fence and opening is not None:
            words, first = opening
            text = "".join(f"{each}\n" for each in lines)
            found.append(Block(words[0] if words else "", tuple(words[1:]), text, first))
            opening = None
        else:
            lines.append(line)
    assert opening is None, f"the block that starts on line {opening and opening[1] - 1} is not closed"
    return found


@dataclass
class Command:
    """A command line of a console block, and the output printed below it."""

    line: int
    text: str
    expected: list[str] = field(default_factory=list)


def commands(block: Block) -> list[Command]:
    """Commands of a block; in sh blocks every line is one, and no output is expected."""
    found: list[Command] = []
    for offset, line in enumerate(block.text.splitlines()):
        if block.language == "sh" or line.startswith("$ "):
            found.append(Command(block.line + offset, line.removeprefix("$ ")))
        elif found:
            found[-1].expected.append(line)
    return found


def run_command(text: str) -> str | None:
    """Output of a flexura command, stdout and then stderr; None for other commands, which are not run."""
    words = shlex.split(text, comments=True)
    if not words or words[0] not in PROGRAMS:
        return None
    target = None
    if len(words) > 2 and words[-2] == ">":
        words, target = words[:-2], words[-1]
    from flexura.cli import main

    out, err = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", ["flexura", *words[1:]]),
        contextlib.suppress(SystemExit),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        main()
    if target is not None:
        Path(target).write_text(out.getvalue(), encoding="utf-8")
        out = io.StringIO()
    return out.getvalue() + err.getvalue()


_NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?(?![A-Za-z_])")


def same_token(expected: str, found: str) -> bool:
    """True for equal words, numbers in them to the printed precision."""
    if expected == found:
        return True
    if _NUMBER.split(expected) != _NUMBER.split(found):
        return False
    return all(map(_same_number, _NUMBER.findall(expected), _NUMBER.findall(found)))


def _same_number(expected: str, found: str) -> bool:
    a, b = float(expected), float(found)
    if max(abs(a), abs(b)) < TINY and "e" in expected.lower() + found.lower():
        return True
    mantissa, _, exponent = expected.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    last_digit = 10.0 ** (int(exponent or 0) - decimals) if decimals or exponent else 0.0
    return abs(a - b) <= max(RELATIVE * abs(a), 1.01 * last_digit)


_SEVERAL = re.compile(r"[\w.]+(?:, [\w.]+)+(?= vibrate)")


def _words(text: str) -> list[str]:
    """Words of a text; names of parts that vibrate alike come in any order, and are put into one."""
    folded = " ".join(text.split())
    return _SEVERAL.sub(lambda match: ", ".join(sorted(match[0].split(", "))), folded).split()


def mismatch(expected: list[str], found: str) -> str:
    """What differs between expected lines and output, whitespace apart; empty when nothing does."""
    texts = re.split(r"^\s*\.\.\.\s*$", "\n".join(expected), flags=re.MULTILINE)
    pieces = [_words(text) for text in texts]
    words = _words(found)
    at = 0
    for k, piece in enumerate(pieces):
        anchored = k == 0
        last = k == len(pieces) - 1
        starts = range(at, at + 1) if anchored else range(at, len(words) - len(piece) + 1)
        if last and not anchored and piece:
            starts = range(max(at, len(words) - len(piece)), len(words) - len(piece) + 1)
        start = next((s for s in starts if _matches(piece, words, s)), None)
        if start is None or (last and piece and start + len(piece) != len(words)):
            wanted = _first_difference(piece, words, at) if anchored else " ".join(piece)[:200]
            return f"expected {wanted!r}, found:\n{found}"
        at = start + len(piece)
    if len(pieces) == 1 and at != len(words):
        return f"more output than expected:\n{found}"
    return ""


def _matches(piece: list[str], words: list[str], start: int) -> bool:
    part = words[start : start + len(piece)]
    return len(part) == len(piece) and all(map(same_token, piece, part))


def _first_difference(piece: list[str], words: list[str], at: int) -> str:
    for k, word in enumerate(piece):
        if at + k >= len(words) or not same_token(word, words[at + k]):
            return " ".join(piece[max(0, k - 3) : k + 4])
    return ""


class Page:
    """A page whose snippets are run in one folder and one namespace."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.blocks = blocks(path.read_text(encoding="utf-8"))
        self.namespace: dict[str, Any] = {"__name__": "__main__"}
        self.printed: str | None = None

    def run(self) -> Iterator[str]:
        """Run everything in the working directory and yield what is wrong."""
        for block in self.blocks:
            if block.file:
                Path(block.file).write_text(block.text, encoding="utf-8")
            try:
                found = list(self._run(block))
            except Exception:
                found = [traceback.format_exc(limit=-3)]
            yield from (f"{self.path.name}:{block.line}: {text}" for text in found)

    def _run(self, block: Block) -> Iterator[str]:
        before, self.printed = self.printed, None
        if block.language == "python":
            self.printed = self.run_python(block)
        elif block.language == "text" and before is not None:
            yield from filter(None, [mismatch(block.text.splitlines(), before)])
        elif block.language == "yaml" and "broken" not in block.words:
            check_yaml(block)
        elif block.language in ("console", "sh"):
            for command in commands(block):
                found = run_command(command.text)
                if found is not None and command.expected:
                    wrong = mismatch(command.expected, found)
                    yield from [f"$ {command.text}\n{wrong}"] if wrong else []
                elif found is not None and re.search(r"^(flexura: |\d+ error)", found, re.MULTILINE):
                    yield f"$ {command.text} failed:\n{found}"

    def run_python(self, block: Block) -> str:
        """What a block of Python prints; the blocks of a page share one namespace."""
        out = io.StringIO()
        padded = "\n" * (block.line - 1) + block.text
        with contextlib.redirect_stdout(out):
            exec(compile(padded, str(self.path), "exec"), self.namespace)  # noqa: S102
        return out.getvalue()


def check_yaml(block: Block) -> None:
    """Load a mechanism file and solve its modes, or load a fragment inside a small mechanism."""
    import flexura
    from flexura.modelfile import read_as
    from flexura.synthesis import WishFile

    if "wish" in block.words:
        read_as(WishFile, block.text, block.file or "snippet")
    elif block.is_whole_file:
        flexura.modes(flexura.loads(block.text, block.file or "snippet"), n=1)
    else:
        flexura.assemble(flexura.with_solid_parts(flexura.loads(embedded(block.text), "fragment")))


def embedded(fragment: str) -> str:
    """Text of the mechanism for fragments with a fragment merged into it."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    out = io.StringIO()
    yaml.dump(_merged(yaml.load(BASE), yaml.load(fragment)), out)
    return out.getvalue()


def _merged(base: Any, extra: Any) -> Any:
    if not (isinstance(base, dict) and isinstance(extra, dict)):
        return extra
    return {**base, **{key: _merged(base.get(key), value) for key, value in extra.items()}}


@contextlib.contextmanager
def workshop() -> Iterator[None]:
    """Work in a temporary folder that holds a copy of the examples."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "examples", Path(folder) / "examples")
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def renewed(expected: list[str], found: str) -> list[str]:
    """The output, without what `...` left out of it before: the lines that are most like those that were kept."""
    output = [text.rstrip() for text in found.splitlines()]
    gaps = [k for k, line in enumerate(expected) if line.strip() == "..."]
    if not gaps:
        return output
    pieces = [expected[a + 1 : b] for a, b in pairwise([-1, *gaps, len(expected)])]
    lines, at = output[: len(pieces[0])], len(pieces[0])
    for k, piece in enumerate(pieces[1:], start=1):
        last = max(len(output) - len(piece), at)
        starts = [last] if k == len(pieces) - 1 else range(at, last + 1)
        start = max(starts, key=lambda s, piece=piece: _likeness(piece, output[s : s + len(piece)]))
        at = start + len(piece)
        lines += [expected[gaps[k - 1]], *output[start:at]]
    return lines


def _likeness(one: list[str], other: list[str]) -> float:
    return difflib.SequenceMatcher(None, "\n".join(one), "\n".join(other)).ratio()


def rewrite(path: Path) -> None:
    """Replace the output in console blocks by what the commands print, and text by what the Python before it prints;
    text that is met is left alone."""
    page = Page(path)
    lines = path.read_text(encoding="utf-8").splitlines()
    fresh: dict[int, tuple[int, list[str]]] = {}
    with workshop():
        for block in page.blocks:
            if block.file:
                Path(block.file).write_text(block.text, encoding="utf-8")
            before, page.printed = page.printed, None
            if block.language == "python":
                page.printed = page.run_python(block)
            expected = block.text.splitlines()
            if block.language == "text" and before is not None and mismatch(expected, before):
                fresh[block.line - 1] = (len(expected), renewed(expected, before))
            for command in commands(block) if block.language in ("console", "sh") else ():
                found = run_command(command.text)
                if found is not None and command.expected and mismatch(command.expected, found):
                    fresh[command.line] = (len(command.expected), renewed(command.expected, found))
    for line in sorted(fresh, reverse=True):
        count, output = fresh[line]
        lines[line : line + count] = output
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:]:
        rewrite(Path(name).resolve())
