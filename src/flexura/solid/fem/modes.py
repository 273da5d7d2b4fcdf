"""Natural modes of a mechanism whose members are solids, tied to the nodes of its beam model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.linalg import lowest
from flexura.methods import Solution
from flexura.solid.fem.components import Component, Copy, components, turned
from flexura.solid.fem.matrices import elastic_matrices
from flexura.solid.fem.reduced import LEAST_MODES, Announce, Matrices, ReducedPiece, reduced_piece
from flexura.solid.mesh import SurfaceShape
from flexura.structure import FullOrderModel, full_order

REACH = 6.0
"""Fixed-interface modes are kept up to so many times the highest beam frequency asked for."""


SURE = 2.0
"""Modes are given up to the frequency, over this, from which fixed-interface modes are left out."""

OCTAVE = np.sqrt(2.0)
"""What modes left out may do is estimated by leaving out those of the last part of so much in frequency as well."""


@dataclass(frozen=True)
class SolidModes:
    """The lowest modes of a mechanism of solids.

    `solution` has frequencies and shapes at the nodes of the beam model, means over sections (theory eq. E6), of length
    one in the solid's mass matrix; `surfaces` are those of all placed pieces in these modes. `order` is that of the
    problem solved, `dofs` that of all meshes placed, `meshed_dofs` and `cells` of the distinct meshes; `mass`, kg, of
    solids and discrete elements; `size` the relative mesh size. `truncation` (m,) is about how much of each frequency
    the fixed-interface modes that are left out may take, relative; all up to `complete_hz` are kept.
    """

    solution: Solution
    order: int
    dofs: int
    meshed_dofs: int
    cells: int
    mass: float
    size: float
    truncation: Array
    complete_hz: float
    surfaces: tuple[SurfaceShape, ...] = ()


@dataclass(frozen=True)
class _Placed:
    """A copy of a component: its coordinates are S times those of the mechanism."""

    component: Component
    own: ReducedPiece
    copy: Copy
    S: sp.csc_matrix


def solid_modes(
    model: FullOrderModel,
    n: int = 6,
    size: float = 1.0,
    *,
    more: int = 0,
    hexahedra: bool = True,
    matrices: Matrices = elastic_matrices,
    announce: Announce = lambda _: None,
) -> SolidModes:
    """The `n` lowest modes with every member a solid that follows nodes at its ends (theory eqs. E1-E8).

    Distinct pieces are meshed and reduced once, with the fixed-interface modes up to `REACH` times the highest of the
    beam model's `n` frequencies, as far as MOST_MODES of a piece reach: there are fewer than `n` where that is
    less than SURE times their frequency. So many `more` come with them, less accurate, to be paired. `hexahedra`,
    `matrices` and `announce` as in `reduced_piece`. Raises OptionError and SolverError.
    """
    top = REACH * _top_hz(model, n)
    made: list[tuple[Component, ReducedPiece]] = []
    for component in components(model):
        label = f"solid of {component.label}, size {size:g}"
        unit = reduced_piece(
            component.piece,
            size,
            LEAST_MODES,
            top * component.frequency_scale,
            hexahedra=hexahedra,
            matrices=matrices,
            announce=lambda stage, label=label: announce(f"{label}: {stage}"),
        )
        made.append((component, component.placed(unit)))
    return _solved(model, made, n + more, size, top)


def beam_mass(model: FullOrderModel) -> float:
    """Mass, kg, of all placed members by density, section and length."""
    total = 0.0
    for name, placed in model.plan.topology.copies.items():
        part = model.plan.parts[name]
        if part.members:
            masses = [mass.sum() for mass, _, _ in part.prisms(model.values, model.geometry.parts[name])]
            total += len(placed.paths) * float(np.sum(masses))
    return total


def _top_hz(model: FullOrderModel, n: int) -> float:
    values = lowest(model.K, model.M, min(n, model.order)).values
    return float(np.sqrt(max(values[np.isfinite(values)].max(initial=0.0), 0.0)) / (2 * np.pi))


def _solved(
    model: FullOrderModel, made: list[tuple[Component, ReducedPiece]], n: int, size: float, top: float
) -> SolidModes:
    """Place all copies among the discrete elements of the beam model and solve."""
    complete = min((own.complete_hz for _, own in made), default=np.inf)
    high = np.zeros(0, dtype=np.intp)
    total = model.order + sum(len(c.copies) * own.amplitudes for c, own in made)
    K, M = (
        sp.csc_matrix((A.data, A.indices, np.append(A.indptr, [A.nnz] * (total - model.order))), (total, total))
        for A in full_order(model.plan).discrete_matrices(model.design)
    )
    placed, first = [], model.order
    for component, own in made:
        for copy in component.copies:
            S = _placing(model, component, copy, own.amplitudes, first, total)
            K, M = K + S.T @ sp.csc_matrix(own.K) @ S, M + S.T @ sp.csc_matrix(own.M) @ S
            placed.append(_Placed(component, own, copy, S))
            first += own.amplitudes
            above = np.flatnonzero(own.fixed_hz[::-1] > complete / OCTAVE)
            high = np.concatenate([high, first - 1 - above])
    used = np.flatnonzero((K.diagonal() > 0) | (M.diagonal() > 0))
    if not len(used):
        raise OptionError("nothing in this mechanism can move: every node is held")
    hz, vectors = _lowest_hz(K, M, used, n)
    truncation = np.zeros(len(hz))
    if complete < top:
        sure = hz <= complete / SURE
        hz, vectors = hz[sure], vectors[:, sure]
        without = _lowest_hz(K, M, np.setdiff1d(used, high), len(hz))[0]
        truncation = without / np.where(hz > 0, hz, 1.0) - np.where(hz > 0, 1.0, 0.0)
    x = np.zeros((total, len(hz)))
    x[used] = vectors
    return SolidModes(
        Solution("solid", len(used), hz, _shapes(model, placed, used, x)),
        len(used),
        sum(len(c.copies) * own.dofs for c, own in made),
        sum(own.dofs for _, own in made),
        sum(own.cells for _, own in made),
        sum(len(c.copies) * own.mass for c, own in made),
        size,
        truncation,
        complete,
        tuple(_surface(one, x) for one in placed),
    )


def _lowest_hz(K: sp.csc_matrix, M: sp.csc_matrix, used: Index, n: int) -> tuple[Array, Array]:
    """Frequencies (k,), Hz, and vectors of the `n` lowest modes, or fewer, over the coordinates `used`."""
    pairs = lowest(sp.csc_matrix(K[used][:, used]), sp.csc_matrix(M[used][:, used]), min(n, len(used)))
    finite = np.isfinite(pairs.values)
    return np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi), pairs.vectors[:, finite]


def _placing(
    model: FullOrderModel, component: Component, copy: Copy, amplitudes: int, first: int, total: int
) -> sp.csc_matrix:
    """S (6 k + amplitudes, total): a component's coordinates from all coordinates, for a copy (theory eq. E4)."""
    numbers = np.array([copy.node[i] for i in component.nodes])
    turn = sp.kron(sp.eye(len(numbers)), turned(copy.Q).T)
    rows = sp.coo_matrix(turn @ model.design.node_rows(numbers))
    inner = np.arange(amplitudes)
    data = np.concatenate([rows.data, np.ones(amplitudes)])
    row = np.concatenate([rows.row, 6 * len(numbers) + inner])
    column = np.concatenate([rows.col, first + inner])
    return sp.csc_matrix((data, (row, column)), shape=(6 * len(numbers) + amplitudes, total))


def _shapes(model: FullOrderModel, placed: list[_Placed], used: Index, x: Array) -> Array:
    """Displacements (n_nodes, 6, m) of all beam nodes: of what they are tied to, else means over sections."""
    topology = model.plan.topology
    u = model.node_displacements(x[: model.order])
    is_tied = np.asarray(np.isin(topology.dof, used).any(axis=1))[topology.root]
    for one in placed:
        means = (one.own.average @ (one.S @ x)).reshape(len(one.component.section_nodes), 6, -1)
        for node, mean in zip(one.component.section_nodes, means, strict=True):
            root = topology.root[one.copy.node[node]]
            if not is_tied[root]:
                u[root] = turned(one.copy.Q) @ mean
    loose = np.flatnonzero(~is_tied & ~topology.is_rigid)
    u[loose] = u[topology.root[loose]]
    return u


def _surface(one: _Placed, x: Array) -> SurfaceShape:
    """The surface of a placed piece, mirrored facets turned round."""
    Q, surface = one.copy.Q, one.own.surface
    moved = np.einsum("ij,sjm->sim", Q, (surface.rows @ (one.S @ x)).reshape(len(surface.points), 3, -1))
    facets = surface.facets if np.linalg.det(Q) > 0 else surface.facets[:, ::-1]
    return SurfaceShape(one.copy.name, surface.points @ Q.T + one.copy.t, facets, moved)
