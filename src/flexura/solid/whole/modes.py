"""The lowest modes of the whole part."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.errors import OptionError, SolverError
from flexura.linalg import SingularError, factorise_large
from flexura.solid.whole.elements import Elements, meshed
from flexura.solid.whole.lumped import Lumped
from flexura.solid.whole.pieces import Block, beyond, is_ground, pieces_of, thickness
from flexura.solid.whole.shapes import Part, part_of
from flexura.structure import FullOrderModel

Say = Callable[[str], None]

ORDER = 3
"""Order of the tetrahedra."""
ORDERS = (2, 5)
"""Least and largest order of the tetrahedra."""
SIZES = (0.25, 4.0)
"""Least and largest size of the tetrahedra."""
INSIDE = 1e-3
"""How far into its piece a node on the surface is moved to be found in a curved mesh, over the thickness."""
TOLERANCE = 1e-7
"""Relative tolerance of eigenvalues."""


@dataclass(frozen=True)
class WholeModes:
    """Modes of the part as one solid: `frequency_hz` (n,), ascending; `shapes` (n_nodes, 6, n), displacements and
    rotations (half the curl) at the nodes of the plan, NaN where a node lies in no solid.

    `order` and `size` of the tetrahedra, `cells` and `dofs` of them; `mass`, kg, of all solids, ground included;
    `seconds` of the run. `notes` say what was held how, and what is lumped.
    """

    frequency_hz: Array
    shapes: Array = field(repr=False)
    order: int
    size: float
    cells: int
    dofs: int
    mass: float
    seconds: float
    notes: tuple[str, ...] = ()


class WholePart:
    """The part of a mechanism, drawn and meshed once, whose modes are found for some orders and stiffnesses.

    Members and bodies are one piece where they touch, and nothing is rigid but what is held; point masses, springs and
    piezo stacks act on mean motions of patches. `size` of the tetrahedra is relative to the thickness of what they are
    in. Raises ModelError for what cannot be drawn, OptionError for what does not fit into memory, and SolverError.
    `order` is the largest that will be asked for: memory for it is looked at before anything is solved.
    """

    def __init__(self, model: FullOrderModel, order: int, size: float, say: Say) -> None:
        if not ORDERS[0] <= order <= ORDERS[1]:
            raise OptionError(f"the order of the tetrahedra is from {ORDERS[0]} to {ORDERS[1]}, not {order}")
        if not SIZES[0] <= size <= SIZES[1]:
            raise OptionError(f"the size of the tetrahedra is from {SIZES[0]:g} to {SIZES[1]:g}, not {size!r}")
        model.plan.refuse_loads("the part as one solid", model.values)
        self.model: FullOrderModel = model
        self.size: float = size
        self._say = say
        say("drawing the whole part")
        self.part: Part = part_of(pieces_of(model))
        self.mesh: Any = meshed(self.part, order, size, say)

    @property
    def held(self) -> frozenset[int]:
        """Numbers of the blocks that are held: bodies that are clamped and blocks of ground."""
        clamped: NDArray[np.bool_] = np.asarray(self.model.plan.topology.held.all(axis=1))
        return frozenset(k for k, block in enumerate(self.part.pieces.blocks) if clamped[block.root])

    @property
    def bodies(self) -> frozenset[int]:
        """Numbers of the blocks that move."""
        return frozenset(range(len(self.part.pieces.blocks))) - self.held

    def modes(self, n: int, order: int, stiffer: Collection[int] = (), *, factor: float = 1.0) -> WholeModes:
        """The `n` lowest modes with elements of some order, some pieces `factor` times as stiff."""
        began = time.perf_counter()
        elements = Elements(self.part, self.mesh, order, self._say, dict.fromkeys(stiffer, factor))
        lumped = Lumped(self.model, self.part, elements)
        self._say("factorising")
        values, vectors = _lowest(lumped.K, lumped.M, n, lumped.is_free)
        return WholeModes(
            np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi),
            self._at_nodes(elements, vectors[: elements.dofs]),
            order,
            self.size,
            self.mesh.ne,
            elements.dofs,
            elements.mass,
            time.perf_counter() - began,
            (*self.part.pieces.notes, *lumped.notes),
        )

    def _at_nodes(self, elements: Elements, vectors: Array) -> Array:
        """Displacements and rotations (n_nodes, 6, k) at the nodes that lie in a solid, NaN at others."""
        points = self.model.positions.copy()
        inside = np.zeros(len(points), dtype=bool)
        for piece in self.part.pieces.all:
            if is_ground(piece):
                continue
            near = beyond(piece, points)
            thin = thickness(piece)
            own = (near < 1e-3 * thin) & ~inside
            if isinstance(piece, Block):
                towards = piece.centre - points[own]
            else:
                middle = piece.local(points[own])
                middle[:, 0] = np.clip(middle[:, 0], 0.02 * piece.length, 0.98 * piece.length)
                middle[:, 1:] = 0.0
                towards = piece.placed(middle) - points[own]
            reach = np.linalg.norm(towards, axis=1, keepdims=True)
            points[own] += towards * np.minimum(INSIDE * thin / np.where(reach > 0, reach, 1.0), 1.0)
            inside |= own
        inside &= self.model.plan.topology.has_position
        found = np.full((len(points), 6, vectors.shape[1]), np.nan)
        found[inside] = elements.motions_at(points[inside], vectors)
        return found


def _lowest(K: sp.csr_matrix, M: sp.csr_matrix, n: int, is_free: bool) -> tuple[Array, Array]:
    """The `n` lowest eigenpairs; a free part is shifted below zero."""
    shift = 0.0
    if is_free:
        shift = -1e-6 * float(np.median(K.diagonal())) / float(np.median(M.diagonal()))
    try:
        factor = factorise_large(K - shift * M if shift else K)
    except SingularError:
        raise SolverError("the whole part can move freely: something of it touches nothing that is held") from None
    d = factor.scale

    def solve(b: Array) -> Array:
        checkpoint()
        return d * factor.solve_scaled(np.ascontiguousarray(d * np.ravel(b))).ravel()

    count = n + 2
    operator = spla.LinearOperator(K.shape, matvec=solve, dtype=float)
    try:
        values, vectors = spla.eigsh(
            K,
            count,
            M=M,
            sigma=shift,
            OPinv=operator,
            v0=np.cos(np.arange(K.shape[0])),
            ncv=2 * count + 8,
            tol=TOLERANCE,
        )
    except spla.ArpackError as error:
        raise SolverError(f"the eigenvalue search did not converge: {error}") from None
    first = np.argsort(values)[:n]
    return values[first], vectors[:, first]
