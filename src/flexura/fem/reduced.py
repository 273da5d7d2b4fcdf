"""Pieces of a solid in normal form, reduced to the nodes that they hang on: once for all sizes and metals.

Craig-Bampton reduction of large sparse systems such as solids.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import OptionError
from flexura.fem.cache import Arrays, content_key, remembered
from flexura.fem.geometry import ENDS, MemberSolid
from flexura.fem.matrices import Face, elastic_matrices, face_ties, mesh_mass
from flexura.fem.meshing import group_mesh
from flexura.fem.solid_mesh import SolidMesh, dofs_of, outer_sides, rigid_motions
from flexura.fem.surfaces import Surface
from flexura.linalg import Eigenpairs, Progress, ShiftInvert, factorise_large, turned
from flexura.mechanism import Faces
from flexura.records import Kept

COLUMNS_AT_ONCE = 64
"""Right sides that are solved at a time."""


Announce = Callable[[str], None]

Matrices = Callable[[SolidMesh], tuple[Any, Any]]

REVISION = 6
"""Goes up whenever meshes or matrices of pieces change, so that those in the cache are worked out anew."""

LEAST_MODES = 8
"""Fixed-interface modes that are kept of every piece, asked for or not."""

MOST_MODES = 64
"""Fixed-interface modes that are worked out of any piece, whatever frequency they are asked up to."""

REPORTED_EVERY = 5.0
"""Seconds after which a stage that goes on says how far it is."""

LEAST_POINTS = 12
"""A mean over a section takes in at least so many points."""

IN_MEMORY = Kept(most=64)
"""Arrays of the pieces that were asked for last, by what they were worked out from."""


@dataclass(frozen=True)
class CondensedSolid:
    """K and M (b + m, b + m) over boundary DOFs and amplitudes of fixed-interface modes, `basis` (n, b + m) that takes
    these to all DOFs, and the frequencies (m,), Hz, of the fixed-interface modes."""

    K: Array
    M: Array
    basis: Array
    fixed_frequency_hz: Array


def constraint_modes(
    K: Any,
    M: Any,
    boundary: Index,
    n_fixed: int = 0,
    *,
    up_to_hz: float = 0.0,
    most: int | None = None,
    memory: float | None = None,
    progress: Progress | None = None,
) -> CondensedSolid:
    """Craig-Bampton reduction to boundary DOFs (b,) and `n_fixed` fixed-interface modes (theory eq. E7).

    Psi = -Kii^-1 Kib, and Kii x = lambda Mii x for the modes, M-orthonormal; without modes it is Guyan's (1965). With
    `up_to_hz` all modes up to that frequency are taken, and at least `n_fixed`, but no more than `most`: their number
    grows as the cube of the frequency. K, M: (n, n) sparse. Raises SolverError when the inside can move with the
    boundary held, or for want of memory.
    """
    K, M = sp.csc_matrix(K), sp.csc_matrix(M)
    n, b = K.shape[0], len(boundary)
    inner = np.setdiff1d(np.arange(n), boundary)
    if len(np.unique(boundary)) != b or len(inner) + b != n or not len(inner):
        raise OptionError(f"boundary DOFs are distinct numbers below {n}, and not all of them")
    Kii, Mii = K[inner][:, inner], M[inner][:, inner]
    factor = factorise_large(Kii, memory=memory, progress=progress)
    psi = np.zeros((n, b))
    psi[boundary, np.arange(b)] = 1.0
    coupling = K[inner][:, boundary]
    for first in range(0, b, COLUMNS_AT_ONCE):
        part = np.arange(first, min(first + COLUMNS_AT_ONCE, b))
        psi[np.ix_(inner, part)] = -factor.solve(coupling[:, part].toarray())
        if progress is not None:
            progress("condense", (part[-1] + 1) / b)
    fixed = _fixed_modes(ShiftInvert(Kii, Mii, 0.0, factor.solve, progress), n_fixed, (2 * np.pi * up_to_hz) ** 2, most)
    values, basis = fixed.values, np.hstack([psi, np.zeros((n, len(fixed.values)))])
    basis[inner, b:] = fixed.vectors
    reduced = [basis.T @ (A @ basis) for A in (K, M)]
    Kr, Mr = ((A + A.T) / 2 for A in reduced)
    Kr[:b, b:] = Kr[b:, :b] = 0.0
    return CondensedSolid(Kr, Mr, basis, np.sqrt(values) / (2 * np.pi))


def _fixed_modes(search: ShiftInvert, least: int, limit: float, most: int | None) -> Eigenpairs:
    """All pairs with values up to a limit, at least `least` and at most `most`; largest entries of vectors positive."""
    n = search.K.shape[0]
    bound = n - 1 if most is None else min(max(most, least), n - 1)
    count = max(least, 6) if limit else least
    if not count:
        return Eigenpairs(np.empty(0), np.empty((n, 0)))
    while True:
        count = min(count, bound)
        search.expected = search.solves + 3 * count + 30
        pairs = search.nearest(count)
        if pairs.values[-1] > limit or count == bound:
            break
        grown = (limit / pairs.values[-1]) ** 1.5  # their number grows as the cube of the frequency
        count = int(min(max(2.0, grown) * count, float(bound)))
    keep = max(int((pairs.values <= limit).sum()), min(least, count))
    return Eigenpairs(pairs.values[:keep], turned(pairs.vectors[:, :keep]))


class EndTie(NamedTuple):
    """An end face, the first (0) or second (1) of a member by position, that follows a node, by position."""

    node: int
    member: int
    end: int
    kind: Faces


class Section(NamedTuple):
    """The section of a member, by position, at the end of its first `element` out of `elements` equal ones."""

    member: int
    element: int
    elements: int


@dataclass(frozen=True)
class Piece:
    """Fused members in normal form (`normalised`), named by their positions, with what is tied and looked at.

    Node k lies in the middle of the first face that follows it.
    """

    members: tuple[MemberSolid, ...]
    ties: tuple[EndTie, ...]
    sections: tuple[Section, ...]

    @property
    def places(self) -> Array:
        """Places (k, 3) of the nodes."""
        first = {tie.node: tie for tie in reversed(self.ties)}
        return np.array([self.on_axis(first[k].member, first[k].end) for k in range(len(first))])

    def on_axis(self, member: int, fraction: float) -> Array:
        """Place (3,) on the axis of a member."""
        solid = self.members[member]
        return solid.start + fraction * solid.length * solid.axes[0]


@dataclass(frozen=True)
class ReducedPiece:
    """K and M over six displacements of every node (k), then `amplitudes`: of flexible faces and fixed-interface modes.

    `average` (6 s, 6 k + amplitudes) has the mean displacements of the sections (theory eq. E6). `mass` is that of the
    solid, `dofs` and `cells` those of its mesh, `seconds` what it took to work out. Axes are those of the first member.
    The last amplitudes are those of fixed-interface modes of `fixed_hz` (m,); up to `complete_hz` none is left out.
    """

    K: Array
    M: Array
    amplitudes: int
    average: Array
    surface: Surface
    mass: float
    dofs: int
    cells: int
    seconds: float
    fixed_hz: Array
    complete_hz: float

    def scaled(self, length: float, E: float, rho: float) -> ReducedPiece:
        """At another length, m, modulus, Pa, and density, kg/m^3, of the first member (theory eq. B6)."""
        nodes = (len(self.K) - self.amplitudes) // 6
        s = np.append(np.tile(np.repeat([1 / length, 1.0], 3), nodes), np.full(self.amplitudes, 1 / length))
        both = np.outer(s, s)
        unit = np.tile(np.repeat([length, 1.0], 3), len(self.average) // 6)
        faster = float(np.sqrt(E / rho)) / length
        rows = (self.surface.rows * (length * s)).astype(self.surface.rows.dtype)
        return replace(
            self,
            K=E * length**3 * both * self.K,
            M=rho * length**5 * both * self.M,
            average=unit[:, None] * self.average * s,
            surface=replace(self.surface, points=length * self.surface.points, rows=rows),
            mass=rho * length**3 * self.mass,
            fixed_hz=faster * self.fixed_hz,
            complete_hz=faster * self.complete_hz,
        )


def reduced_piece(
    piece: Piece,
    size: float = 1.0,
    modes: int = 2,
    up_to: float = 0.0,
    *,
    hexahedra: bool = True,
    matrices: Matrices = elastic_matrices,
    announce: Announce = lambda _: None,
) -> ReducedPiece:
    """Craig-Bampton reduction (theory eq. B5) of a piece with the `modes` lowest fixed-interface modes, and all below.

    `up_to` is a frequency of the piece in normal form; it is rounded up to a power of sqrt(2). No more than MOST_MODES
    are worked out, or `modes` if that is more: see `complete_hz` of the result. `size` scales the cells,
    `matrices` makes K and M of a mesh, `announce` is told each step. From the cache where our own elements make the
    matrices. Raises OptionError and SolverError.
    """
    limit = 2.0 ** (np.ceil(2 * np.log2(up_to)) / 2) if up_to > 0 else 0.0

    def compute() -> Arrays:
        begin = time.perf_counter()
        announce("mesh")
        mesh = group_mesh(piece.members, size, hexahedra=hexahedra)
        announce(f"{mesh.order} DOFs")
        arrays = _condensed(piece, mesh, matrices(mesh), (max(modes, LEAST_MODES), limit), announce)
        return {**arrays, "seconds": np.array(time.perf_counter() - begin)}

    def enough(arrays: Arrays) -> bool:
        n, free = len(arrays["modes_hz"]), int(arrays["free"])
        return n >= min(max(modes, MOST_MODES), free) or (n >= min(modes, free) and float(arrays["limit"]) >= limit)

    if matrices is elastic_matrices:
        parts = (REVISION, [m.key for m in piece.members], piece.ties, piece.sections, size, hexahedra)
        key = content_key(parts)
        arrays = IN_MEMORY.once(key, lambda: remembered("solid-piece", parts, compute, enough), enough)
    else:
        arrays = compute()
    hz = arrays["modes_hz"]
    wanted = max(modes, int((hz <= limit).sum()))
    order = len(arrays["K"]) - len(hz) + min(wanted, len(hz))
    if wanted < len(hz):
        complete = float(hz[wanted])
    else:
        complete = np.inf if len(hz) == int(arrays["free"]) else float(arrays["limit"])
    return ReducedPiece(
        K=arrays["K"][:order, :order],
        M=arrays["M"][:order, :order],
        amplitudes=order - 6 * len(piece.places),
        average=arrays["average"][:, :order],
        surface=Surface(arrays["points"], arrays["facets"], arrays["rows"][:, :order]),
        mass=float(arrays["mass"]),
        dofs=int(arrays["dofs"]),
        cells=int(arrays["cells"]),
        seconds=float(arrays["seconds"]),
        fixed_hz=hz[:wanted],
        complete_hz=complete,
    )


def _condensed(
    piece: Piece, mesh: SolidMesh, matrices: tuple[Any, Any], kept: tuple[int, float], announce: Announce
) -> Arrays:
    """K, M and all else that is kept of a piece in normal form; `kept` are the least number of fixed-interface modes
    and the frequency up to which all are worked out."""
    modes, limit = kept
    places = piece.places
    faces = [
        Face(mesh.point_sets[f"{piece.members[tie.member].name} {ENDS[tie.end]}"], places[tie.node], tie.node, tie.kind)
        for tie in piece.ties
    ]
    ties = face_ties(mesh, faces)
    K, M = (sp.csc_matrix(ties.T.T @ A @ ties.T) for A in matrices)
    least = min(modes, len(ties.free) - 1)
    solid = constraint_modes(K, M, ties.boundary, least, up_to_hz=limit, most=MOST_MODES, progress=_stages(announce))
    highest = float(solid.fixed_frequency_hz.max(initial=0.0))
    reached = highest if len(solid.fixed_frequency_hz) >= MOST_MODES else max(limit, highest)
    basis = ties.T @ solid.basis
    of_mesh = mesh_mass(mesh)
    lost = piece.members[0].volume / of_mesh.volume if len(piece.members) == 1 else 1.0
    used, facets = outer_sides(mesh)
    return {
        "K": balanced(solid.K, places),
        "M": lost * solid.M,
        "modes_hz": solid.fixed_frequency_hz / np.sqrt(lost),
        "free": np.array(len(ties.free) - 1),
        "limit": np.array(reached),
        "average": np.vstack([np.empty((0, basis.shape[1])), *(_means(mesh, basis, piece, s) for s in piece.sections)]),
        "points": mesh.points[used],
        "facets": facets,
        "rows": basis[dofs_of(used)].astype(np.float32),
        "mass": np.array(lost * of_mesh.mass),
        "dofs": np.array(mesh.order),
        "cells": np.array(sum(len(cells) for cells in mesh.cells.values())),
    }


def _stages(announce: Announce) -> Callable[[str, float], None]:
    """A progress that announces every stage, and how far it is every few seconds."""
    words = {"factorise": "factorisation", "condense": "constraint modes", "iterate": "fixed-interface modes"}
    reported: dict[str, float] = {}

    def progress(stage: str, share: float) -> None:
        now = time.monotonic()
        if stage in words and stage not in reported:
            reported[stage] = now
            announce(words[stage])
        elif stage in words and now > reported[stage] + REPORTED_EVERY:
            reported[stage] = now
            announce(f"{words[stage]}, {share:.0%}")

    return progress


def _means(mesh: SolidMesh, basis: Array, piece: Piece, section: Section) -> Array:
    """Mean displacements (6, c) of the points near a section, about the axis (theory eq. E6)."""
    member = piece.members[section.member]
    cells = [cells[np.array(mesh.parts[kind]) == member.name].ravel() for kind, cells in mesh.cells.items()]
    points = np.unique(np.concatenate(cells))
    off = np.abs(member.local(mesh.points[points])[:, 0] - member.length * section.element / section.elements)
    within = max(member.length / section.elements / 8, np.sort(off)[min(LEAST_POINTS, len(off)) - 1])
    near = points[off <= within + 1e-9 * member.length]
    x = mesh.points[near]
    scale = np.repeat([1.0, 1 / float(np.ptp(x, axis=0).max())], 3)
    G = rigid_motions(x, piece.on_axis(section.member, section.element / section.elements))
    return scale[:, None] * (np.linalg.pinv(G * scale) @ basis[dofs_of(near)])


def balanced(K: Array, places: Array) -> Array:
    """K over nodes at `places` (k, 3) and amplitudes, without round-off in the rigid motions, which strain nothing."""
    c = 6 * len(places)
    rigid = np.zeros((len(K), 6))
    rigid[:c] = rigid_arm(places - places[0]).reshape(c, 6)
    size = float(np.ptp(places, axis=0).max()) or 1.0
    scale = np.append(np.tile(np.repeat([1.0, size], 3), len(places)), np.ones(len(K) - c))
    Q = np.linalg.qr(scale[:, None] * rigid)[0]
    scaled = (K + K.T) / 2 / np.outer(scale, scale)
    scaled = scaled - Q @ (Q.T @ scaled)
    scaled = scaled - (scaled @ Q) @ Q.T
    return (scaled + scaled.T) / 2 * np.outer(scale, scale)
