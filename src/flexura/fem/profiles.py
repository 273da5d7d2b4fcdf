"""What is cut along one line: the outline of members and bodies as seen along it, with fillets, lines and arcs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.fem.geometry import MILLIMETRE, BodySolid, MemberSolid, body_solids, filleted, solids
from flexura.fem.occ import kernel, plane_face
from flexura.outlines import Outline, Segment, as_arcs, outline_of
from flexura.structure import FullOrderModel

SQUARE = 1e-6
"""Sine of an angle up to which things are along the cut."""

COVERED = 1e-6
"""Area that two profiles share over that of the smaller one, from which one covers the other."""

Piece = MemberSolid | BodySolid


def cut_profile(model: FullOrderModel, beside: Callable[[str], bool] = lambda _: False) -> Outline:
    """The outline of all members and bodies in a plane across the widths of the members, m; bodies whose names `beside`
    picks are parts of their own.

    What a wire leaves is as wide everywhere as it is drawn only where it is cut to that from the sides as well. Raises
    OptionError where members are not all wide along one line, where a body is no box along it nor a cylinder about it,
    and where one thing covers another that it does not hang together with; ModelError where the outline is not in one
    piece, and SolverError.
    """
    members = filleted(model, solids(model))
    bodies = [body for body in body_solids(model) if not beside(body.name)]
    along = members[0].axes[1]
    for member in members:
        if member.outline.is_round or np.ptp(member.outline.y) > SQUARE * member.outline.y[0]:
            raise OptionError(f"{member.name} is not cut along one line: it is not as wide all along")
        if np.linalg.norm(np.cross(along, member.axes[1])) > SQUARE:
            raise OptionError(f"{member.name} is not cut along the same line as {members[0].name}")
    first = np.eye(3)[int(np.argmin(np.abs(along)))]
    x = np.cross(first, along) / np.linalg.norm(np.cross(first, along))
    plane = np.array([x, np.cross(along, x)])
    with kernel() as occ:
        pieces: list[Piece] = [*members, *bodies]
        runs = [_runs(piece, along) for piece in pieces]
        flat = [_anticlockwise([run @ plane.T / MILLIMETRE for run in own]) for own in runs]
        faces = [plane_face(occ, [np.pad(run, ((0, 0), (0, 1))) for run in own]) for own in flat]
        _refuse_covered(model, pieces, faces)
        whole = faces[0]
        for face in faces[1:]:
            whole = whole + face
        segments = [own for edge in whole.edges for own in _segments(edge)]
    return outline_of(segments)


def _runs(piece: Piece, along: Array) -> list[Array]:
    """The profile of a piece as runs of points (n, 3), m, global frame, that join."""
    if isinstance(piece, MemberSolid):
        return [piece.placed(np.stack([run[:, 0], 0 * run[:, 0], run[:, 1]], axis=-1)) for run in piece.profile()]
    axis = int(np.argmax(np.abs(piece.axes @ along)))
    if piece.pieces is not None or np.linalg.norm(np.cross(piece.axes[axis], along)) > SQUARE:
        raise OptionError(f"{piece.name} is no box along the line of the cut")
    if piece.is_round and axis:
        raise OptionError(f"{piece.name} is a cylinder across the line of the cut")
    u, v = (piece.half[k] * piece.axes[k] for k in range(3) if k != axis)
    if piece.is_round:
        halves = [np.linspace(a, a + np.pi, 9) for a in (0.0, np.pi)]
        return [piece.centre + np.cos(own)[:, None] * u + np.sin(own)[:, None] * v for own in halves]
    corners = [piece.centre + a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    return [np.array(pair) for pair in pairwise(corners)]


def _anticlockwise(runs: list[Array]) -> list[Array]:
    """Runs of points (n, 2) that join, so that all faces within such runs look to the same side."""
    x, y = np.concatenate(runs).T
    area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return runs if area > 0 else [run[::-1] for run in reversed(runs)]


def _refuse_covered(model: FullOrderModel, pieces: Sequence[Piece], faces: Sequence[Any]) -> None:
    """Raise OptionError where pieces that do not hang together cover each other, so that no cut goes between them."""
    topology = model.plan.topology
    roots = [set(p.roots) if isinstance(p, MemberSolid) else {int(topology.root[p.node])} for p in pieces]
    held = [any(bool(topology.held[root].any()) for root in own) for own in roots]
    for a, b in combinations(range(len(pieces)), 2):
        if roots[a] & roots[b] or (held[a] and held[b] and isinstance(pieces[a], BodySolid)):
            continue
        least = min(faces[a].mass, faces[b].mass)
        shared = (faces[a] * faces[b]).mass
        if COVERED * least < shared < (1 - COVERED) * max(faces[a].mass, faces[b].mass):
            raise OptionError(f"no cut goes between {pieces[a].name} and {pieces[b].name}: one covers the other")


def _segments(edge: Any) -> list[Segment]:
    """Lines and arcs of an edge in millimetres."""

    def curve(t: Array) -> Array:
        points = (edge.Value(float(own)) for own in t)
        return np.array([[p.x, p.y] for p in points]) * MILLIMETRE

    first, last = edge.parameter_interval
    return as_arcs(curve, first, last, pieces=1)
