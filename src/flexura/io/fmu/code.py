"""C data of a linear model for an FMU: nonzeros by rows, diagonal blocks of A, and ports of its parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Bools, Index
from flexura.errors import OptionError
from flexura.systems import StateSpace

TYPICAL_INPUT = {"expansion": 1e-5}
"""Ordinary size of an input by quantity, SI; 1 for those not listed."""

LARGEST_BLOCK = 1000
"""Order of the largest block of coupled states; its exponential costs some 50 products of that order."""


@dataclass(frozen=True)
class Blocks:
    """States in groups that A couples: block k has the states member[first[k]:first[k + 1]]."""

    first: Index
    member: Index

    @property
    def sizes(self) -> Index:
        """Number of states of each."""
        return np.diff(self.first)


class Patterns(NamedTuple):
    """Which entries of A (n, n), B, C, D are not zero whatever the parameters, and what rows of [A B] (n, r) and of
    [C D] (p, r) each port of a parameter reaches, through others or not."""

    A: Bools
    B: Bools
    C: Bools
    D: Bools
    into: Bools
    onto: Bools


def patterns(model: StateSpace) -> Patterns:
    """Patterns of the matrices of a model."""
    A, B, C, D = (getattr(model, name) != 0 for name in "ABCD")
    own = model.tuning
    if own is None:
        return Patterns(A, B, C, D, np.zeros((len(A), 0), dtype=bool), np.zeros((len(C), 0), dtype=bool))
    reach = np.eye(len(own.slope), dtype=bool)
    inner = np.flatnonzero(own.around.any(axis=1))
    if len(inner):
        reach[np.ix_(inner, inner)] = True
        reach |= _product(reach, own.around != 0)
    into, onto = _product(own.into != 0, reach), _product(own.onto != 0, reach)
    x, u = own.of_states != 0, own.of_inputs != 0
    whole = A | _product(into, x), B | _product(into, u), C | _product(onto, x), D | _product(onto, u)
    return Patterns(*whole, into, onto)


def _product(left: Bools, right: Bools) -> Bools:
    return (left.astype(float) @ right.astype(float)) > 0


def blocks_of(A: Array | Bools) -> Blocks:
    """Connected components of the pattern of A (n, n), in the order of their first states."""
    n = len(A)
    if not n:
        return Blocks(np.zeros(1, dtype=np.intp), np.empty(0, dtype=np.intp))
    _, label = connected_components(sp.csr_matrix(A != 0), directed=False)
    _, first_state = np.unique(label, return_index=True)
    rank = np.argsort(np.argsort(first_state))[label]
    member = np.argsort(rank, kind="stable")
    return Blocks(np.concatenate([[0], np.cumsum(np.bincount(rank))]).astype(np.intp), member.astype(np.intp))


def refuse_unfit(model: StateSpace) -> None:
    """Raise OptionError for a model that an FMU of a linear system cannot stand for."""
    if model.delay and not model.is_discrete:
        raise OptionError(
            f"an FMU has no dead time, and this model has {model.delay} s: discretise it, which makes states of it,"
            " or set its delay to zero and put the dead time in front of the FMU, in the tool that reads it"
        )
    if not len(model.outputs):
        raise OptionError("a model without outputs has no results: name at least one")
    if not all(np.isfinite(X).all() for X in (model.A, model.B, model.C, model.D)):
        raise OptionError("the matrices of the model have entries that are not finite")
    sizes = np.zeros(0) if model.is_discrete else blocks_of(patterns(model).A).sizes
    if len(sizes) and sizes.max() > LARGEST_BLOCK:
        raise OptionError(
            f"{sizes.max()} states are coupled with each other, at most {LARGEST_BLOCK} can be: reduce the model, or"
            " take its modal form"
        )


def balance(A: Array, blocks: Blocks) -> Array:
    """Powers of two s (n,) for which s_i^-1 A_ij s_j has rows and columns of like size (Parlett and Reinsch 1969)."""
    scale = np.ones(len(A))
    for k in np.flatnonzero(blocks.sizes > 1):
        states = blocks.member[blocks.first[k] : blocks.first[k + 1]]
        _, (factor, _) = la.matrix_balance(A[np.ix_(states, states)], permute=False, separate=True)
        scale[states] = factor
    return scale


def pole_sizes(A: Array, blocks: Blocks) -> Array:
    """|eigenvalues| (n,) of A, rad/s, block by block; zeros to round-off come out as zero."""
    size = np.zeros(len(A))
    for k in range(len(blocks.sizes)):
        span = slice(blocks.first[k], blocks.first[k + 1])
        states = blocks.member[span]
        size[span] = np.abs(la.eigvals(A[np.ix_(states, states)]))
    return np.where(size > 1e-9 * size.max(initial=0.0), size, 0.0)


def nominals(model: StateSpace, blocks: Blocks) -> tuple[Array, Array]:
    """Ordinary sizes (n,), (p,) of states and outputs under inputs of typical size.

    They are 2 |(s - A)^-1 B| u at real s as large as the eigenvalues: away from resonance, and of the right ratio
    between displacements and velocities. 1 for what no input moves, and for models in steps.
    """
    if model.is_discrete:
        return np.ones(model.order), np.ones(len(model.outputs))
    u = np.array([TYPICAL_INPUT.get(c.quantity, 1.0) for c in model.inputs])
    x = np.zeros(model.order)
    for k in range(len(blocks.sizes)):
        states = blocks.member[blocks.first[k] : blocks.first[k + 1]]
        A, B = model.A[np.ix_(states, states)], model.B[states]
        size = np.abs(la.eigvals(A))
        size = np.unique(size[size > 1e-9 * max(size.max(), 1e-300)])
        if len(size) and B.any():
            s = size[np.unique(np.linspace(0, len(size) - 1, 8).astype(int))]
            s = s if (la.eigvals(A).real <= 0).all() else 2 * size[-1:]
            response = np.linalg.solve(s[:, None, None] * np.eye(len(states)) - A, B)
            x[states] = 2 * (np.abs(response) @ u).max(axis=0)
    y = np.abs(model.C) @ x + np.abs(model.D) @ u
    return ordinary(x), ordinary(y)


def ordinary(size: Array) -> Array:
    """Sizes to two digits; 1 where there is none."""
    return np.array([float(f"{v:.1e}") if np.isfinite(v) and v > 1e-30 else 1.0 for v in size])


def model_data(model: StateSpace) -> str:
    """`model.c`: the numbers of a model, each as the shortest decimal text that reads back to the same double."""
    pattern, own, n, m = patterns(model), model.tuning, model.order, len(model.inputs)
    blocks = Blocks(np.zeros(1, dtype=np.intp), np.zeros(n, dtype=np.intp))
    if not model.is_discrete:
        blocks = blocks_of(pattern.A)
    r = 0 if own is None else len(own.slope)
    matrices = {name: (getattr(model, name), getattr(pattern, name)) for name in "ABCD"}
    shapes = {"into": (n, r), "onto": (len(model.outputs), r), "of_states": (r, n), "of_inputs": (r, m)}
    for name, shape in {**shapes, "around": (r, r)}.items():
        matrix = np.zeros(shape) if own is None else getattr(own, name)
        matrices[name] = matrix, matrix != 0
    lines = ['#include "dynamics.h"\n#include "step.h"\n']
    for name, (matrix, entries) in matrices.items():
        lines += _rows(name, matrix, entries)
    sizes = blocks.sizes
    integers = {
        "first": blocks.first,
        "member": blocks.member,
        "offset": np.concatenate([[0], np.cumsum(sizes**2)]),
        "place": _places(blocks) if len(sizes) else blocks.member,
        "parameter": np.zeros(0) if own is None else own.parameter,
    }
    doubles = {
        "scale": balance(model.A, blocks),
        "nominal": nominals(model, blocks)[0],
        "slope": np.zeros(0) if own is None else own.slope,
        "start": np.array([] if own is None else [p.start for p in own.parameters], dtype=float),
    }
    lines += [c_integers(name, values) for name, values in integers.items()]
    lines += [c_doubles(name, values) for name, values in doubles.items()]
    counts = (n, m, len(model.outputs), len(sizes), int(sizes.max(initial=1)), int((sizes**2).sum()))
    numbers = ", ".join(map(str, (*counts, len(doubles["start"]), r, repr(float(model.dt or 0.0)))))
    rows = ", ".join(f"{{{name}_start, {name}_column, {name}_value}}" for name in matrices)
    lines += [f"const Model flexura_model = {{{numbers}, {rows}, {', '.join((*integers, *doubles))}}};"]
    own_sizes = (n, m, len(model.outputs), len(doubles["start"]))
    lines += [c_sizes(own_sizes, 0, float(model.dt or 0.0), 0.0, "0", ("", ""))]
    return "\n".join(lines) + "\n"


def _rows(name: str, matrix: Array, entries: Bools) -> list[str]:
    """Entries of a matrix by rows."""
    row, column = np.nonzero(entries)
    start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=len(matrix)))])
    return [
        c_integers(f"{name}_start", start),
        c_integers(f"{name}_column", column),
        c_doubles(f"{name}_value", matrix[row, column]),
    ]


def _places(blocks: Blocks) -> Index:
    place = np.empty_like(blocks.member)
    place[blocks.member] = np.arange(len(blocks.member)) - np.repeat(blocks.first[:-1], blocks.sizes)
    return place


def c_sizes(
    counts: tuple[int, int, int, int], indicators: int, dt: float, slack: float, initial: str, told: tuple[str, str]
) -> str:
    """What every model says of itself: numbers of states, inputs, outputs, parameters and indicators, its step, the
    name of an array of states at first, and what is told where it leaves what it is for and where it is no longer good.
    """
    numbers = ", ".join(map(str, (*counts, indicators, repr(dt), repr(slack))))
    texts = ", ".join('"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"' for text in told)
    return f"const Sizes flexura_sizes = {{{numbers}, {initial}, nominal, start, {texts}}};"


def c_integers(name: str, values: NDArray[Any]) -> str:
    """A constant array of whole numbers."""
    return f"static const int {name}[] = {{{_lines([str(int(v)) for v in values] or ['0'])}}};"


def c_doubles(name: str, values: Array) -> str:
    """A constant array, each number the shortest text that reads back to it."""
    return f"static const double {name}[] = {{{_lines([repr(float(v)) for v in values] or ['0.0'])}}};"


def _lines(words: list[str]) -> str:
    return ",\n  ".join(", ".join(words[k : k + 8]) for k in range(0, len(words), 8))
