"""Natural modes of a mechanism whose members are solids, tied to the nodes of its beam model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import OptionError
from flexura.fem import (
    LEAST_MODES,
    Announce,
    Component,
    Copy,
    Matrices,
    ReducedPiece,
    SurfaceShape,
    components,
    elastic_matrices,
    reduced_piece,
    turned,
)
from flexura.linalg import lowest
from flexura.methods import Solution
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
    reduced: ReducedPiece
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
    values = lowest(model.K, model.M, min(n, model.order)).values
    top = REACH * float(np.sqrt(max(values[np.isfinite(values)].max(initial=0.0), 0.0)) / (2 * np.pi))
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


def _solved(
    model: FullOrderModel, made: list[tuple[Component, ReducedPiece]], n: int, size: float, top: float
) -> SolidModes:
    """Place all copies among the discrete elements of the beam model and solve."""
    complete = min((reduced.complete_hz for _, reduced in made), default=np.inf)
    high = np.zeros(0, dtype=np.intp)
    total = model.order + sum(len(component.copies) * reduced.amplitudes for component, reduced in made)
    K, M = (
        sp.csc_matrix((A.data, A.indices, np.append(A.indptr, [A.nnz] * (total - model.order))), (total, total))
        for A in full_order(model.plan).discrete_matrices(model.design)
    )
    placed, first = [], model.order
    for component, reduced in made:
        for copy in component.copies:
            numbers = np.array([copy.node[node] for node in component.nodes])
            S = _placing(model, turned(copy.Q), numbers, slice(first, first + reduced.amplitudes), total)
            K, M = K + S.T @ sp.csc_matrix(reduced.K) @ S, M + S.T @ sp.csc_matrix(reduced.M) @ S
            placed.append(_Placed(component, reduced, copy, S))
            first += reduced.amplitudes
            above = np.flatnonzero(reduced.fixed_hz[::-1] > complete / OCTAVE)
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
        solution=Solution("solid", len(used), hz, _shapes(model, placed, used, x)),
        order=len(used),
        dofs=sum(piece.reduced.dofs for piece in placed),
        meshed_dofs=sum(reduced.dofs for _, reduced in made),
        cells=sum(reduced.cells for _, reduced in made),
        mass=sum(len(component.copies) * reduced.mass for component, reduced in made),
        size=size,
        truncation=truncation,
        complete_hz=complete,
        surfaces=tuple(_surface(piece, x) for piece in placed),
    )


def _lowest_hz(K: sp.csc_matrix, M: sp.csc_matrix, used: Index, n: int) -> tuple[Array, Array]:
    """Frequencies (k,), Hz, and vectors of the `n` lowest modes, or fewer, over the coordinates `used`."""
    pairs = lowest(sp.csc_matrix(K[used][:, used]), sp.csc_matrix(M[used][:, used]), min(n, len(used)))
    finite = np.isfinite(pairs.values)
    return np.sqrt(np.maximum(pairs.values[finite], 0.0)) / (2 * np.pi), pairs.vectors[:, finite]


def _placing(model: FullOrderModel, turn: Array, nodes: Index, amplitudes: slice, total: int) -> sp.csc_matrix:
    """S (6 k + a, total): coordinates of a copy of a component from all coordinates, of which its a amplitudes are some
    (theory eq. E4); `turn` (6, 6) leads from its first copy, `nodes` (k,) are its own."""
    rows = sp.kron(sp.eye(len(nodes)), turn.T) @ model.design.node_rows(nodes)
    inner = sp.eye(amplitudes.stop - amplitudes.start, total, k=amplitudes.start)
    outer = sp.csc_matrix((rows.shape[0], total - rows.shape[1]))
    return sp.csc_matrix(sp.vstack([sp.hstack([rows, outer]), inner]))


def _shapes(model: FullOrderModel, placed: list[_Placed], used: Index, x: Array) -> Array:
    """Displacements (n_nodes, 6, m) of all beam nodes: of what they are tied to, else means over sections."""
    topology = model.plan.topology
    u = model.node_displacements(x[: model.order])
    is_tied = np.asarray(np.isin(topology.dof, used).any(axis=1))[topology.root]
    for piece in placed:
        means = (piece.reduced.average @ (piece.S @ x)).reshape(len(piece.component.section_nodes), 6, -1)
        for node, mean in zip(piece.component.section_nodes, means, strict=True):
            root = topology.root[piece.copy.node[node]]
            if not is_tied[root]:
                u[root] = turned(piece.copy.Q) @ mean
    loose = np.flatnonzero(~is_tied & ~topology.is_rigid)
    u[loose] = u[topology.root[loose]]
    return u


def _surface(piece: _Placed, x: Array) -> SurfaceShape:
    """The surface of a placed piece, mirrored facets turned round."""
    Q, surface = piece.copy.Q, piece.reduced.surface
    moved = np.einsum("ij,sjm->sim", Q, (surface.rows @ (piece.S @ x)).reshape(len(surface.points), 3, -1))
    facets = surface.facets if np.linalg.det(Q) > 0 else surface.facets[:, ::-1]
    return SurfaceShape(piece.copy.name, surface.points @ Q.T + piece.copy.t, facets, moved)
