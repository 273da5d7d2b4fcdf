"""What is wrong with a description that no single part of it can see."""

from __future__ import annotations

from collections.abc import Collection

from flexura.errors import Problem
from flexura.mechanism.substructure import Mechanism


def problems(
    mechanism: Mechanism, *, ignore_missing: Collection[str] = (), partial: bool = False
) -> list[Problem]:
    """Everything wrong with the mechanism as a whole."""
    return []
