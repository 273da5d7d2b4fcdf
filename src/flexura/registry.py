"""What rooms use of rooms above them: functions registered by name at the top of the package, imported on first use.

There are few of these. Each is a step that a user would otherwise take by hand, or that few ask for; without it the
room still works.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

_MODULES: dict[str, str] = {}


def register(name: str, module: str) -> None:
    """Let `registered` find the function of this name in a module."""
    _MODULES[name] = module


def registered(name: str) -> Callable[..., Any]:
    """The function that was registered. Raises KeyError where there is none."""
    return getattr(import_module(_MODULES[name]), name)
