"""A continuous linear model as C code has it: nonzeros by rows, diagonal blocks of A, sizes of its variables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from flexura.arrays import Array, Index
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


def blocks_of(A: Array) -> Blocks:
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
    """Raise OptionError for a model that an FMU of a linear continuous system cannot stand for."""
    if model.is_discrete:
        raise OptionError(f"an FMU takes a continuous model, and this one has steps of {model.dt} s: export the first")
    if model.delay:
        raise OptionError(
            f"an FMU has no dead time, and this model has {model.delay} s: set its delay to zero and put the dead time"
            " in front of the FMU, in the tool that reads it"
        )
    if not len(model.outputs):
        raise OptionError("a model without outputs has no results: name at least one")
    if not all(np.isfinite(X).all() for X in (model.A, model.B, model.C, model.D)):
        raise OptionError("the matrices of the model have entries that are not finite")
    sizes = blocks_of(model.A).sizes
    if len(sizes) and sizes.max() > LARGEST_BLOCK:
        raise OptionError(
            f"{sizes.max()} states are coupled with each other, at most {LARGEST_BLOCK} can be: reduce the model, or"
            " take its modal form"
        )


def balance(A: Array, blocks: Blocks) -> Array:
    """Powers of two s (n,) for which s_i^-1 A_ij s_j has rows and columns of like size (Parlett and Reinsch 1969)."""
    scale = np.ones(len(A))
    for k in np.flatnonzero(blocks.sizes > 1):
        own = blocks.member[blocks.first[k] : blocks.first[k + 1]]
        _, (factor, _) = la.matrix_balance(A[np.ix_(own, own)], permute=False, separate=True)
        scale[own] = factor
    return scale


def pole_sizes(A: Array, blocks: Blocks) -> Array:
    """|eigenvalues| (n,) of A, rad/s, block by block; zeros to round-off come out as zero."""
    size = np.zeros(len(A))
    for k in range(len(blocks.sizes)):
        span = slice(blocks.first[k], blocks.first[k + 1])
        own = blocks.member[span]
        size[span] = np.abs(la.eigvals(A[np.ix_(own, own)]))
    return np.where(size > 1e-9 * size.max(initial=0.0), size, 0.0)


def nominals(model: StateSpace, blocks: Blocks) -> tuple[Array, Array]:
    """Ordinary sizes (n,), (p,) of states and outputs under inputs of typical size.

    They are 2 |(s - A)^-1 B| u at real s as large as the eigenvalues: away from resonance, and of the right ratio
    between displacements and velocities. 1 for what no input moves.
    """
    u = np.array([TYPICAL_INPUT.get(c.quantity, 1.0) for c in model.inputs])
    x = np.zeros(model.order)
    for k in range(len(blocks.sizes)):
        own = blocks.member[blocks.first[k] : blocks.first[k + 1]]
        A, B = model.A[np.ix_(own, own)], model.B[own]
        size = np.abs(la.eigvals(A))
        size = np.unique(size[size > 1e-9 * max(size.max(), 1e-300)])
        if len(size) and B.any():
            s = size[np.unique(np.linspace(0, len(size) - 1, 8).astype(int))]
            s = s if (la.eigvals(A).real <= 0).all() else 2 * size[-1:]
            response = np.linalg.solve(s[:, None, None] * np.eye(len(own)) - A, B)
            x[own] = 2 * (np.abs(response) @ u).max(axis=0)
    y = np.abs(model.C) @ x + np.abs(model.D) @ u
    return _ordinary(x), _ordinary(y)


def _ordinary(size: Array) -> Array:
    """Sizes to two digits; 1 where there is none."""
    return np.array([float(f"{v:.1e}") if np.isfinite(v) and v > 1e-30 else 1.0 for v in size])
