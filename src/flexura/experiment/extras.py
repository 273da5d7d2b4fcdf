"""Packages of the extra `experiment`, imported when they are needed."""

from __future__ import annotations

import warnings
from importlib import import_module
from types import ModuleType

from flexura.errors import OptionError


def need(module: str) -> ModuleType:
    """Import a module without its warnings and without changes to their filters.

    Raises OptionError that names the extra when it is missing.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return import_module(module)
        except ImportError:
            raise OptionError(f"this needs the package {module}: pip install 'flexura[experiment]'") from None
