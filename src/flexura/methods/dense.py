"""The order up to which exact methods, which write dense equations, are asked."""

from __future__ import annotations

from flexura.errors import SolverError
from flexura.reduction import LowOrderAssembler

LARGEST = 2000
"""Largest order of dense equations: beyond it a dozen matrices fill gigabytes and each factorisation takes minutes."""


def refuse_large(order: int, over: str) -> None:
    """Raise SolverError where there are more dense equations over something than are solved."""
    if order > LARGEST:
        hint = "the full-order model and finite elements are sparse and have no such limit"
        raise SolverError(f"{order} equations over {over} are more than the {LARGEST} that exact methods solve; {hint}")


def refuse_large_parts(assembler: LowOrderAssembler) -> None:
    """Raise SolverError, before any matrix is made, where junctions of a prototype or kept nodes are too many."""
    refuse_large(len(assembler.physical), "the nodes that substructures keep")
    for name, reducer in assembler.reducers.items():
        refuse_large(6 * len(reducer.remaining), f"the junctions of {name or 'the top level'!r}")
