"""Pieces of a solid in normal form, reduced to the nodes that they hang on: once for all sizes and metals."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.mechanism import Faces
from flexura.records import Kept
from flexura.solid.fem.cache import Arrays, content_key, remembered
from flexura.solid.fem.condensation import constraint_modes
from flexura.solid.fem.constraints import Face, face_ties
from flexura.solid.fem.matrices import elastic_matrices, mesh_mass
from flexura.solid.geometry import ENDS, MemberSolid
from flexura.solid.mesh import SolidMesh, Surface, group_mesh, outer_sides, rigid_motions

Announce = Callable[[str], None]
Matrices = Callable[[SolidMesh], tuple[Any, Any]]

REVISION = 5
"""Goes up whenever meshes or matrices of pieces change, so that those in the cache are worked out anew."""

LEAST_MODES = 8
"""Fixed-interface modes that are kept of every piece, asked for or not."""

MOST_MODES = 64
"""Fixed-interface modes that are worked out of any piece, whatever frequency they are asked up to."""

EACH = 5.0
"""Seconds after which a stage that goes on says how far it is."""

LEAST_POINTS = 12
"""A mean over a section takes in at least so many points."""

RECENT = 64
"""Pieces that are kept in memory."""

IN_MEMORY = Kept(most=RECENT)
"""Arrays of the pieces that were asked for last, by what they were worked out from."""


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
        own = self.members[member]
        return own.start + fraction * own.length * own.axes[0]


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
        own = self.surface
        faster = float(np.sqrt(E / rho)) / length
        rows = (own.rows * (length * s)).astype(own.rows.dtype)
        return ReducedPiece(
            E * length**3 * both * self.K,
            rho * length**5 * both * self.M,
            self.amplitudes,
            unit[:, None] * self.average * s,
            Surface(length * own.points, own.facets, rows),
            rho * length**3 * self.mass,
            self.dofs,
            self.cells,
            self.seconds,
            faster * self.fixed_hz,
            faster * self.complete_hz,
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
        return _worked_out(piece, size, max(modes, LEAST_MODES), limit, hexahedra, matrices, announce)

    def enough(found: Arrays) -> bool:
        full = len(found["modes_hz"]) >= min(max(modes, MOST_MODES), int(found["free"]))
        return full or (len(found["modes_hz"]) >= min(modes, int(found["free"])) and float(found["limit"]) >= limit)

    parts = (REVISION, [m.key for m in piece.members], piece.ties, piece.sections, size, hexahedra)
    found = _kept(parts, compute, enough) if matrices is elastic_matrices else compute()
    wanted = max(modes, int((found["modes_hz"] <= limit).sum()))
    order = len(found["K"]) - len(found["modes_hz"]) + min(wanted, len(found["modes_hz"]))
    kept = found["modes_hz"][:wanted]
    whole = len(found["modes_hz"]) == int(found["free"])
    following = found["modes_hz"][wanted:]
    complete = float(following[0]) if len(following) else np.inf if whole else float(found["limit"])
    return ReducedPiece(
        found["K"][:order, :order],
        found["M"][:order, :order],
        order - 6 * len(piece.places),
        found["average"][:, :order],
        Surface(found["points"], found["facets"], found["rows"][:, :order]),
        float(found["mass"]),
        int(found["dofs"]),
        int(found["cells"]),
        float(found["seconds"]),
        kept,
        complete,
    )


def _kept(parts: Any, compute: Callable[[], Arrays], enough: Callable[[Arrays], bool]) -> Arrays:
    return IN_MEMORY.once(content_key(parts), lambda: remembered("solid-piece", parts, compute, enough), enough)


def _worked_out(
    piece: Piece, size: float, modes: int, limit: float, hexahedra: bool, matrices: Matrices, announce: Announce
) -> Arrays:
    begin = time.perf_counter()
    announce("mesh")
    mesh = group_mesh(piece.members, size, hexahedra=hexahedra)
    announce(f"{mesh.order} DOFs")
    places = piece.places
    faces = [
        Face(mesh.point_sets[f"{piece.members[tie.member].name} {ENDS[tie.end]}"], places[tie.node], tie.node, tie.kind)
        for tie in piece.ties
    ]
    ties = face_ties(mesh, faces)
    K, M = (sp.csc_matrix(ties.T.T @ A @ ties.T) for A in matrices(mesh))
    least = min(modes, len(ties.free) - 1)
    found = constraint_modes(K, M, ties.boundary, least, up_to_hz=limit, most=MOST_MODES, progress=_stages(announce))
    highest = float(found.fixed_frequency_hz.max(initial=0.0))
    reached = highest if len(found.fixed_frequency_hz) >= MOST_MODES else max(limit, highest)
    basis = ties.T @ found.basis
    own = mesh_mass(mesh)
    lost = piece.members[0].volume / own.volume if len(piece.members) == 1 else 1.0
    used, facets = outer_sides(mesh)
    return {
        "K": balanced(found.K, places),
        "M": lost * found.M,
        "modes_hz": found.fixed_frequency_hz / np.sqrt(lost),
        "free": np.array(len(ties.free) - 1),
        "limit": np.array(reached),
        "average": np.vstack([np.empty((0, basis.shape[1])), *(_means(mesh, basis, piece, s) for s in piece.sections)]),
        "points": mesh.points[used],
        "facets": facets,
        "rows": basis[_dofs(used)].astype(np.float32),
        "mass": np.array(lost * own.mass),
        "dofs": np.array(mesh.order),
        "cells": np.array(sum(len(cells) for cells in mesh.cells.values())),
        "seconds": np.array(time.perf_counter() - begin),
    }


def _stages(announce: Announce) -> Callable[[str, float], None]:
    """A progress that announces every stage, and how far it is every few seconds."""
    words = {"factorise": "factorisation", "condense": "constraint modes", "iterate": "fixed-interface modes"}
    told: dict[str, float] = {}

    def progress(stage: str, share: float) -> None:
        now = time.monotonic()
        if stage in words and stage not in told:
            told[stage] = now
            announce(words[stage])
        elif stage in words and now > told[stage] + EACH:
            told[stage] = now
            announce(f"{words[stage]}, {share:.0%}")

    return progress


def _means(mesh: SolidMesh, basis: Array, piece: Piece, section: Section) -> Array:
    """Mean displacements (6, c) of the points near a section, about the axis (theory eq. E6)."""
    member = piece.members[section.member]
    own = np.unique(
        np.concatenate([cells[np.array(mesh.parts[kind]) == member.name].ravel() for kind, cells in mesh.cells.items()])
    )
    off = np.abs(member.local(mesh.points[own])[:, 0] - member.length * section.element / section.elements)
    reach = max(member.length / section.elements / 8, np.sort(off)[min(LEAST_POINTS, len(off)) - 1])
    near = own[off <= reach + 1e-9 * member.length]
    x = mesh.points[near]
    scale = np.repeat([1.0, 1 / float(np.ptp(x, axis=0).max())], 3)
    G = rigid_motions(x, piece.on_axis(section.member, section.element / section.elements))
    return scale[:, None] * (np.linalg.pinv(G * scale) @ basis[_dofs(near)])


def balanced(K: Array, places: Array) -> Array:
    """K over nodes at `places` (k, 3) and amplitudes, without round-off in the rigid motions, which strain nothing."""
    c = 6 * len(places)
    rigid = np.zeros((len(K), 6))
    rigid[:c] = np.vstack([rigid_arm(place - places[0]) for place in places])
    size = float(np.ptp(places, axis=0).max()) or 1.0
    scale = np.append(np.tile(np.repeat([1.0, size], 3), len(places)), np.ones(len(K) - c))
    Q = np.linalg.qr(scale[:, None] * rigid)[0]
    scaled = (K + K.T) / 2 / np.outer(scale, scale)
    scaled = scaled - Q @ (Q.T @ scaled)
    scaled = scaled - (scaled @ Q) @ Q.T
    return (scaled + scaled.T) / 2 * np.outer(scale, scale)


def _dofs(points: Index | Sequence[int]) -> Index:
    return (3 * np.asarray(points)[:, None] + np.arange(3)).ravel()
