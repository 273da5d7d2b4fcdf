"""The mathematics of coupling by Lagrange multipliers (de Klerk, Rixen and de Jong 2006), as functions of arrays.

Compatibility of displacements and equilibrium of forces between receptances that stand beside each other, the singular
values of what is inverted for that, and the scatter of the outcome to first order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Complex
from flexura.testing.substructuring.parts import Scatter

LINES_AT_ONCE = 256
"""Lines that are worked out together."""

ROUND_OFF = 1e-13
"""Singular values of interface receptances below this share of the largest are round-off."""


class Block(NamedTuple):
    """Receptances (f, n, m) of a part in their place among all, `sign` -1 where the part is taken away, with their
    scatter."""

    Y: Complex
    sign: float
    scatter: Scatter | None


@dataclass(frozen=True)
class Interface:
    """Rows of signs that make interface displacements `Bu` (j, N) differences, and of their forces `Bf` (j, M), and the
    `compliance` (f, j) between their two sides, zero where they are one (theory eqs. H16-H18)."""

    Bu: Array
    Bf: Array
    compliance: Complex


class Coupled(NamedTuple):
    """Receptances (f, p, m), and by line: the `condition` (f,) of the interface receptances, their `rank` (f,), and
    what of the joins moves least, `directions` (f, j). Where noise is known, the standard deviations `sigma` (f, p, m),
    and the `disturbance` (f,), the size of the noise in the interface receptances after their inverse (theory eq. H22).
    """

    Y: Complex
    condition: Array
    rank: NDArray[np.intp]
    directions: Array
    sigma: Array | None = None
    disturbance: Array | None = None


def coupled(
    blocks: Sequence[Block],
    interface: Interface,
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    tolerance: float | None = None,
) -> Coupled:
    """The receptances of all parts coupled at an interface (theory eq. H17), at some rows and columns of them.

    The interface receptances are made dimensionless by the root mean square of their diagonal over the lines, and
    inverted without singular values below `tolerance` times the largest; by default those of round-off.
    """
    size = _sizes(blocks, interface)
    least = ROUND_OFF if tolerance is None else tolerance
    chunks = [_at_lines(lines, blocks, interface, size, least, rows, columns) for lines in _chunks(len(blocks[0].Y))]
    joined: list[Any] = [None if own[0] is None else np.concatenate(own) for own in zip(*chunks, strict=True)]
    return Coupled(*joined)


def _chunks(count: int) -> Iterator[slice]:
    return (slice(start, start + LINES_AT_ONCE) for start in range(0, count, LINES_AT_ONCE))


def _places(blocks: Sequence[Block]) -> Iterator[tuple[Block, slice, slice]]:
    """Each block with its rows and columns among all."""
    row = column = 0
    for block in blocks:
        n, m = block.Y.shape[1:]
        yield block, slice(row, row + n), slice(column, column + m)
        row, column = row + n, column + m


def _sizes(blocks: Sequence[Block], interface: Interface) -> Array:
    """Root mean squares over the lines of the diagonal (j,) of the interface receptances, by which they are scaled."""
    squares = (np.abs(interface.compliance) ** 2).mean(axis=0)
    for block, row, column in _places(blocks):
        own = np.einsum("ju,fuv,jv->fj", interface.Bu[:, row], block.Y, interface.Bf[:, column], optimize=True)
        squares = squares + (np.abs(own) ** 2).mean(axis=0)
    root = np.sqrt(np.sqrt(squares))
    return np.where(root > 0, root, 1.0)


def _at_lines(
    lines: slice,
    blocks: Sequence[Block],
    interface: Interface,
    size: Array,
    least: float,
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
) -> Coupled:
    """What is coupled at some lines."""
    Bu, Bf = interface.Bu, interface.Bf
    Y = np.zeros((len(blocks[0].Y[lines]), Bu.shape[1], Bf.shape[1]), dtype=complex)
    for block, row, column in _places(blocks):
        Y[:, row, column] = block.sign * block.Y[lines]
    YB, BY = Y[:, rows] @ Bf.T, Bu @ Y[:, :, columns]
    A = Bu @ Y @ Bf.T + interface.compliance[lines][:, :, None] * np.eye(len(Bu))
    U, values, Vh = np.linalg.svd(A / size[:, None] / size)
    kept = values > least * values[:, :1]
    inverse = np.where(kept, 1 / np.where(kept, values, 1.0), 0.0)
    scaled = (Vh.conj().swapaxes(1, 2) * inverse[:, None, :]) @ U.conj().swapaxes(1, 2)
    G = scaled / size[:, None] / size
    outcome = np.asarray(Y[:, rows][:, :, columns] - YB @ G @ BY, dtype=np.complex128)
    rank = kept.sum(axis=1)
    smallest = np.take_along_axis(values, np.maximum(rank - 1, 0)[:, None], axis=1)[:, 0]
    condition = np.divide(values[:, 0], smallest, out=np.full(len(values), np.inf), where=smallest > 0)
    known = outcome, condition, rank, np.abs(Vh[:, -1])
    if all(block.scatter is None for block in blocks):
        return Coupled(*known)
    left = np.eye(Bu.shape[1])[rows] - YB @ G @ Bu
    right = np.eye(Bf.shape[1])[:, columns] - Bf.T @ G @ BY
    variance = _variance(lines, blocks, left, right)
    noise = _variance(lines, blocks, (Bu / size[:, None])[None], (Bf / size[:, None]).T[None])
    return Coupled(*known, np.sqrt(variance), np.sqrt((np.abs(scaled) ** 2 @ noise).sum(axis=(1, 2))))


def _variance(lines: slice, blocks: Sequence[Block], left: NDArray[Any], right: NDArray[Any]) -> Array:
    """Variances of left Y right at some lines by the scatter of all blocks."""
    return np.sum(
        [
            replace(block.scatter, sigma=block.scatter.sigma[lines]).spread(left[..., row], right[:, column])
            for block, row, column in _places(blocks)
            if block.scatter is not None
        ],
        axis=0,
    )
