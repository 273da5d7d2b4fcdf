"""The file that a page has open: read, watched, and varied into new files beside it."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from flexura.errors import FlexuraError, OptionError
from flexura.expressions import Expression
from flexura.files import write_file
from flexura.modelfile import Changed, files_of, load, variant_text
from flexura.pages.live.described import Described, notes_of
from flexura.pages.live.questions import questions
from flexura.pages.live.sliders import parameters_of
from flexura.structure import plan_of

_NAME = re.compile(r"[^\W.][\w. ()+=,-]{0,120}\.ya?ml")
"""What a new file may be called: no folder, nothing hidden."""

Signature = tuple[tuple[str, tuple[int, ...] | None], ...]
"""Files, with what changes when they are written; None where a file is missing."""


@dataclass(frozen=True)
class Opened(Described):
    """What was read of a file. `files` are the file and those that it extends."""

    path: Path
    files: tuple[Path, ...]

    @staticmethod
    def of(path: Path, revision: int, modes: int) -> Opened:
        """Read the file. Raises FlexuraError for one that cannot be used."""
        mechanism = load(path)
        plan = plan_of(mechanism)
        own = Opened(plan, modes, notes_of(mechanism, plan), revision, path, files_of(path))
        _ = own.greeting, own.scene  # what cannot be solved or drawn as it is described is refused here
        return own

    @cached_property
    def greeting(self) -> dict[str, Any]:
        """What a page is told of the file: name, sliders, what may be asked, and notes; plain data."""
        plan, (model, found) = self.plan, self.reference
        copies = plan.topology.copies.items()
        return {
            "revision": self.revision,
            "name": plan.name,
            "file": self.path.name,
            "description": plan.mechanism.description,
            "sliders": [own.to_dict() for own in self.sliders.values()],
            "modes": self.modes,
            "notes": [*self.notes, *self.drawn[0].notes],
            **questions(model, found, self.modes + self.rigid),
            "members": sum(len(plan.parts[name].members) * len(own.paths) for name, own in copies),
        }

    def save(self, file: str, numbers: Mapping[str, float], overwrite: bool = False) -> Path:
        """Write a file beside the one that is open that extends it with these numbers of sliders.

        Raises FileExistsError unless it may `overwrite`, OptionError for names that are no such file or where nothing
        is changed, ModelError for designs that cannot be, and OptionError where it cannot be written.
        """
        folder = self.path.absolute().parent
        target = folder / file
        if not _NAME.fullmatch(file):
            raise OptionError(f"{file!r}: a plain file name that ends in .yaml is expected, without a folder")
        if target.is_symlink() or any(_same(target, own) for own in self.files):
            raise OptionError(f"{file} is the file that is open, one that it extends, or a link: give another name")
        if os.path.lexists(target) and not overwrite:
            raise FileExistsError(file)
        parameters = parameters_of(self.sliders, numbers)
        described = self.plan.parameter_values()
        changed = {name: value for name, value in parameters.items() if value != described[name]}
        if not changed:
            raise OptionError("nothing differs from the file: there is nothing to save")
        self.plan.verify(changed)
        own = {name: Changed(value, self._source(name)) for name, value in changed.items()}
        text = variant_text(self.plan.mechanism, f"{self.plan.name}, {target.stem}", self.path, target, own)
        return write_file(target, lambda part: part.write_text(text, encoding="utf-8", newline="\n"))

    def _source(self, name: str) -> str:
        """Where a changed value comes from, and what the file has."""
        value, own = self.plan.mechanism.parameters[name].value, self.sliders[name]
        before = str(value) if isinstance(value, Expression) else f"{own.value:.9g} {own.unit}".strip()
        return f"chosen on the live page; {self.path.name} has {before}"


def signature(files: Iterable[Path]) -> Signature:
    """What changes when one of some files is written, comes or goes."""
    found = []
    for file in files:
        try:
            own = file.stat()
            found.append((str(file), (own.st_mtime_ns, own.st_size, own.st_ino)))
        except OSError:
            found.append((str(file), None))
    return tuple(found)


def problems_of(error: FlexuraError) -> list[dict[str, str]]:
    """What is wrong with a file, each with the line that it stands at."""
    problems = getattr(error, "problems", None)
    if problems is None:
        return [{"where": "", "text": str(error), "hint": ""}]
    return [
        {"where": p.where, "text": f"{p.place}: {p.rule}" + (f" (found {p.value})" if p.value else ""), "hint": p.hint}
        for p in problems
    ]


def _same(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except OSError:
        return False
