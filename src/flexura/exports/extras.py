"""Packages that only some formats need."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from flexura.errors import OptionError


def need(module: str) -> ModuleType:
    """Import a module of the extra `export`. Raises OptionError that names the extra when it is missing."""
    try:
        return import_module(module)
    except ImportError:
        raise OptionError(f"this needs the package {module}: pip install 'flexura[export]'") from None
