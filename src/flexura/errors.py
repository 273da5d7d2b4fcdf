"""The exceptions of flexura: one root class, and messages that say where, what, which rule and what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

Path = tuple[str | int, ...]


class FlexuraError(Exception):
    """Root of every exception that flexura raises on purpose."""


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a description.

    `path` names the place inside the description (keys and list positions), `value` is what stands there,
    `rule` what was expected and `hint` how to mend it. `where` is `file:line` when a file was read.
    """

    path: Path
    value: str
    rule: str
    hint: str = ""
    where: str = ""

    def at(self, where: str) -> Problem:
        """Return the same problem located at `where` (file:line)."""
        return replace(self, where=where)

    @property
    def place(self) -> str:
        """The path as text, e.g. `flexures.leaf.profile.thickness`."""
        return ".".join(str(key) for key in self.path) or "mechanism"

    def __str__(self) -> str:
        head = f"{self.where}: {self.place}" if self.where else self.place
        text = f"{head}: {self.rule}" + (f" (found {self.value})" if self.value else "")
        return text + (f"\n    hint: {self.hint}" if self.hint else "")


class ModelError(FlexuraError):
    """A description that cannot be used; `problems` lists everything that was found, not only the first."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems: tuple[Problem, ...] = tuple(problems)
        count = len(self.problems)
        lines = "\n".join(str(problem) for problem in self.problems)
        super().__init__(f"{count} problem{'s' if count != 1 else ''} in the description\n{lines}")


class ExpressionError(FlexuraError):
    """An expression or quantity that cannot be read or evaluated."""

    def __init__(self, rule: str, hint: str = "") -> None:
        self.rule = rule
        self.hint = hint
        super().__init__(rule + (f" ({hint})" if hint else ""))


class OptionError(FlexuraError):
    """An argument of a verb that makes no sense for the mechanism at hand."""


class SolverError(FlexuraError):
    """A numerical step that could not be completed to its stated accuracy."""
