"""Faces of packages: their public names, listed once in the stub `__init__.pyi`, imported on first use.

The stub has a line `from MODULE import NAME as NAME` for each name, which type checkers read too.
"""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from types import ModuleType
from typing import Any

_LINE = re.compile(r"^from (\S+) import (\w+) as \2$", re.MULTILINE)


class _Face(ModuleType):
    """A package with names of its modules; a module of the same name as one of them stays hidden behind it."""

    _module_of: dict[str, str]
    _former: Mapping[str, str]

    def __getattr__(self, name: str) -> Any:
        if name in self.__dict__["_former"]:
            now = self.__dict__["_former"][name]
            text = f"{self.__name__}.{name} is called {now} and goes with the next release"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            return attrgetter(now)(self)
        module = self.__dict__["_module_of"].get(name)
        if module is None:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        imported = import_module(module)
        is_module = imported is self or not hasattr(imported, name)
        value = import_module(f"{module}.{name}") if is_module else getattr(imported, name)
        self.__dict__[name] = value
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        # what imports a module sets it in its package, where `modes` is a function and not the module of that name
        if not isinstance(value, ModuleType) or self.__dict__["_module_of"].get(name, self.__name__) == self.__name__:
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted(self.__all__)

    def __reduce__(self) -> tuple[Any, ...]:
        # functions of a script that name a package are sent to the workers of a cluster with it
        return import_module, (self.__name__,)


@cache
def plugins(kind: str) -> dict[str, Any]:
    """What other packages add: the entry points of the group `flexura.KIND` by name, loaded."""
    from importlib.metadata import entry_points  # slow to import

    return {entry.name: entry.load() for entry in entry_points(group=f"flexura.{kind}")}


def listed(stub: str) -> dict[str, str]:
    """Modules by public name, of the text of a stub."""
    return {name: module for module, name in _LINE.findall(stub)}


def face(package: str, *others: str, former: Mapping[str, str] | None = None) -> None:
    """Let a package, while it is imported, give the names that its stub lists; `others` are its own, and `former`
    leads from older public names, which warn, to those that they have now."""
    module = sys.modules[package]
    stub = Path(str(module.__file__)).with_suffix(".pyi").read_text(encoding="utf-8")
    vars(module)["_module_of"] = listed(stub)
    vars(module)["_former"] = former or {}
    vars(module)["__all__"] = [*others, *vars(module)["_module_of"]]
    module.__class__ = _Face
