"""The exceptions of flexura, one root class, and the warnings of results: where, what, which rule, what to do.

And what is said of packages that only some installations have.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from itertools import chain
from math import isfinite, nan
from types import ModuleType
from typing import Any

Path = tuple[str | int, ...]

LONGEST_SHOWN = 200
"""Characters of a value, or of a key, in a message."""

MOST_ALIKE = 3
"""Places at which one problem is told of each."""

MOST_PLACES = 4
"""Places that the text of a warning names."""


def did_you_mean(name: str, known: Iterable[str], otherwise: str, quoted: bool = True) -> str:
    """A hint towards the known name that is most like another; `otherwise` where none is."""
    close = get_close_matches(name, list(known), n=1)
    if not close:
        return otherwise
    return f"did you mean {close[0]!r}?" if quoted else f"did you mean {close[0]}?"


class FlexuraError(Exception):
    """Root of every exception that flexura raises on purpose."""


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a description.

    `path` names the place inside the description (keys and list positions), `value` is what stands there,
    `rule` what was expected and `hint` how to mend it. `where` is `file:line` when a file was read. `more` counts
    others that differ from it in numbers alone, as of the copies of a pattern.
    """

    path: Path
    value: str
    rule: str
    hint: str = ""
    where: str = ""
    more: int = 0

    def at(self, where: str) -> Problem:
        """Return the same problem located at `where` (file:line)."""
        return replace(self, where=where)

    @property
    def place(self) -> str:
        """The path as text, e.g. `flexures.leaf.profile.thickness`."""
        return ".".join(_shortened(str(key)) for key in self.path) or "mechanism"

    def __str__(self) -> str:
        head = f"{self.where}: {self.place}" if self.where else self.place
        text = f"{head}: {self.rule}" + (f" (found {_shortened(self.value)})" if self.value else "")
        text += f", and {self.more} more like it" if self.more else ""
        return text + (f"\n    hint: {self.hint}" if self.hint else "")


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 3] + "..."


class ModelError(FlexuraError):
    """A description that cannot be used; `problems` lists everything that was found, not only the first, and what is
    found at many places alike once, with the first of them."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems: tuple[Problem, ...] = _alike_once(problems)
        count = len(self.problems)
        lines = "\n".join(str(problem) for problem in self.problems)
        super().__init__(f"{count} problem{'s' if count != 1 else ''} in the description\n{lines}")


def _alike_once(problems: Iterable[Problem]) -> tuple[Problem, ...]:
    """Problems that differ in numbers alone as the first of them: all at one place, and elsewhere more than a few."""
    kinds: dict[tuple[str, ...], dict[Path, list[Problem]]] = {}
    listed = list(problems)
    for problem in listed:
        kind = tuple(map(_numberless, (problem.place, problem.rule, problem.hint)))
        kinds.setdefault(kind, {}).setdefault(problem.path, []).append(problem)
    more: dict[int, int] = {}
    for places in kinds.values():
        groups = [list(chain(*places.values()))] if len(places) > MOST_ALIKE else places.values()
        more |= {id(group[0]): len(group) - 1 + sum(own.more for own in group) for group in groups}
    return tuple(replace(own, more=more[id(own)]) for own in listed if id(own) in more)


def _numberless(text: str) -> str:
    """A text with one sign in the place of every number."""
    return re.sub(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?", "#", text)


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


@dataclass(frozen=True)
class Diagnostic:
    """A warning: a limit beyond which a result no longer holds, of the theory, of a part, or of what is proven; or what
    a description takes for granted or may not mean.

    `kind` is rotation, displacement, stiffness, equilibrium, contact, command, force, stress, buckling, resonance,
    proof, tolerance, mesh, misfit, convergence, consistency, condition, noise, lines, window, study, designs of it that
    are missing or failed, or limit, one that was asked for and is not met, or one of those of `check`; `place` names
    the node, member, channel, kind of data or design, empty where it is the whole; `value` and `limit` are in `unit`,
    SI, `1` for plain numbers. `text` is the whole sentence, or, where there are `places`, what is said of all of these.
    """

    kind: str
    place: str
    value: float
    limit: float
    unit: str
    text: str
    places: tuple[str, ...] = ()

    @classmethod
    def about(cls, kind: str, text: str, *places: str) -> Diagnostic:
        """One without a number, about one or several places, of which `place` names the first few."""
        more = f" and {len(places) - MOST_PLACES} more" if len(places) > MOST_PLACES else ""
        return cls(kind, ", ".join(places[:MOST_PLACES]) + more, nan, nan, "1", text, places)

    def is_about(self, *names: str) -> bool:
        """Whether it is about what has one of these names."""
        return not {*names}.isdisjoint(self.places or (self.place,))

    def __str__(self) -> str:
        return f"{self.place}: {self.text}" if self.places else self.text

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; numbers that are not finite as None, and `places` only where there are some."""
        data = asdict(self)
        if not self.places:
            del data["places"]
        return {key: None if isinstance(v, float) and not isfinite(v) else v for key, v in data.items()}


def foremost(warnings: Iterable[Diagnostic], most: int) -> list[str]:
    """The texts of the warnings of each kind that are furthest beyond their limit, `most` of them at most, and how many
    more there are."""
    kinds: dict[str, list[Diagnostic]] = {}
    for warning in warnings:
        kinds.setdefault(warning.kind, []).append(warning)
    found: list[str] = []
    for own in kinds.values():
        chosen = own if len(own) <= most else sorted(own, key=_within)[:most]
        left = len(own) - len(chosen)
        found += [str(warning) for warning in chosen]
        found[-1] += f" (and {left} more such warning{'s' if left > 1 else ''})" if left else ""
    return found


def _within(warning: Diagnostic) -> float:
    """Minus how far a warning is beyond its limit, relative; zero where no number says so."""
    beyond = abs(warning.value - warning.limit) / (abs(warning.limit) or 1.0)
    return -beyond if isfinite(beyond) else 0.0


class LimitError(FlexuraError):
    """A result that goes beyond its limits, where warnings were asked to be errors; `warnings` lists all."""

    def __init__(self, warnings: Iterable[Diagnostic]) -> None:
        self.warnings: tuple[Diagnostic, ...] = tuple(warnings)
        count = len(self.warnings)
        super().__init__("\n".join([f"{count} warning{'s' if count != 1 else ''}", *map(str, self.warnings)]))


def need(module: str, extra: str) -> ModuleType:
    """Import a module of an extra, without its warnings and without changes to their filters.

    Raises OptionError that names the extra when the module, or a library that it is linked to, is missing or older than
    what is installed beside it.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return import_module(module)
        except ModuleNotFoundError:
            raise OptionError(f"this needs the package {module}: pip install 'flexura[{extra}]'") from None
        except OSError as error:
            raise OptionError(f"{module} needs a library of the system, by its package manager: {error}") from None
        except Exception as error:  # whatever a package raises that was built for another release of NumPy
            reason = f"{module} is installed, but cannot be imported ({' '.join(str(error).split())[:200]})"
            raise OptionError(f"{reason}: pip install --upgrade 'flexura[{extra}]'") from None
