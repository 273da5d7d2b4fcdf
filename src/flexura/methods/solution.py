"""What every method answers: natural frequencies, and where it has them mode shapes."""

from __future__ import annotations

from dataclasses import dataclass

from flexura.arrays import Array


@dataclass(frozen=True)
class Solution:
    """The lowest natural frequencies of a mechanism by one method.

    `order` is the number of coordinates of the eigenvalue problem, None for methods that have no finite one;
    `frequency_hz` (k,) ascending, repeated ones repeated; `shapes` (n_nodes, 6, k), displacements of all nodes of the
    full-order model, global frame, or None; `note` says what a reader should know about the numbers.
    """

    method: str
    order: int | None
    frequency_hz: Array
    shapes: Array | None = None
    note: str = ""
