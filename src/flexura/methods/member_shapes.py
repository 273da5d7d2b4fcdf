"""Exact motion inside members between the nodes of a model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array
from flexura.beam import DynamicBeam, UniformBeam, at_pole, dynamic_beam, join, rigid_arm
from flexura.errors import OptionError
from flexura.methods.exact_chains import in_series, twists_inside
from flexura.methods.solution import Solution
from flexura.structure import ElementSlice, FullOrderModel


class _Placed(NamedTuple):
    """A member as placed: its prototype, elements and their nodes (e, 2); from global axes to the member's (6, 6), and
    from displacements of the nodes to those of the elements' ends in the member's axes (e, 12, 12)."""

    name: str
    elements: range
    nodes: NDArray[np.intp]
    to_member: Array
    to_ends: Array


def inside_member(model: FullOrderModel, solution: Solution, member: str, fractions: ArrayLike) -> Array:
    """Displacements (points, 6, k), global frame, of the modes of `dynamic_stiffness` along a placed member.

    `member` is written NAME or INSTANCE.NAME; `fractions` (points,) run from 0 at its start to 1 at its end, without
    the rigid arms of end offsets. The motion of the ends of an element, which are nodes, and the frequency determine
    it inside: a beam cut at the point has the twist there that `join` eliminates (theory eq. D7). Raises OptionError
    for unknown members, fractions outside [0, 1], and solutions without shapes.
    """
    at = np.atleast_1d(np.asarray(fractions, dtype=float))
    if solution.shapes is None:
        raise OptionError(f"{solution.method} has no shapes")
    if not ((at >= 0) & (at <= 1)).all():
        raise OptionError("fractions of a member lie between 0 and 1")
    placed = _find(model, member)
    elements = model.matrices[placed.name].elements
    assert isinstance(elements, ElementSlice)
    cut = elements.cut(1)
    first = np.concatenate([[0], np.cumsum(cut.counts)])
    found = np.empty((len(at), 6, solution.shapes.shape[2]))
    index = np.minimum((at * len(placed.elements)).astype(int), len(placed.elements) - 1)
    for k, hz in enumerate(solution.frequency_hz):
        ends = placed.to_ends @ (solution.shapes[placed.nodes, :, k].reshape(len(placed.nodes), 12, 1))
        for e in np.unique(index):
            number = placed.elements[int(e)]
            beam = cut.beam.take(cut.kind[first[number] : first[number + 1]])
            own = np.flatnonzero(index == e)
            x = at[own] * len(placed.elements) - e
            lam = (2 * np.pi * hz) ** 2
            inside = _inside_roots(beam, lam, ends[e, :, 0], cut.root[number], cut.roots)
            found[own, :, k] = _along(beam, lam, inside, x) @ placed.to_member
    return found


def _find(model: FullOrderModel, member: str) -> _Placed:
    *path, key = member.split(".")
    topology = model.plan.topology
    for name, placed in topology.copies.items():
        if tuple(path) not in placed.paths or key not in placed.part.members:
            continue
        copy, k = placed.paths.index(tuple(path)), list(placed.part.members).index(key)
        own = range(int(placed.part.first[k]), int(placed.part.first[k + 1]))
        Q = model.geometry.Q[placed.number[copy]]
        R = model.geometry.parts[name].R[k]
        inward = np.kron(np.diag([1.0, np.linalg.det(Q).round()]), Q.T)
        to_member = np.kron(np.eye(2), R) @ inward
        to_ends = model.geometry.T[name][own] @ np.kron(np.eye(2), inward)
        nodes = placed.offset[copy] + placed.part.connectivity[own]
        return _Placed(name, own, nodes, to_member, to_ends)
    raise OptionError(f"there is no member {member!r}; members are written NAME or INSTANCE.NAME")


def _inside_roots(beam: UniformBeam, lam: float, ends: Array, root: NDArray[np.intp], roots: Array) -> Array:
    """Displacements (12,) of the ends of an element of pieces of equal length from those of what they are joined to by
    elastic roots; root (2,) says by which, -1 for none."""
    if (root < 0).all():
        return ends
    s, L = len(beam.length), float(beam.length[0])
    step = np.zeros((s, 3))
    step[:, 0] = -L * np.arange(s)
    whole = in_series(DynamicBeam(*(f[None] for f in at_pole(dynamic_beam(beam, lam), rigid_arm(-step)))))[0]
    T = np.eye(12)
    T[6:, :6], T[6:, 6:] = -np.eye(6), rigid_arm([-s * L, 0.0, 0.0])
    K, springs = T.T @ whole.K[0] @ T, np.zeros((12, 12))
    rooted = np.repeat(root >= 0, 6)
    for end in np.flatnonzero(root >= 0):
        springs[6 * end : 6 * end + 6, 6 * end : 6 * end + 6] = np.linalg.inv(roots[root[end]])
    load = springs @ ends - np.where(rooted, K @ np.where(rooted, 0.0, ends), 0.0)
    inside = ends.copy()
    inside[rooted] = np.linalg.solve((K + springs)[np.ix_(rooted, rooted)], load[rooted])
    return inside


def _along(beam: UniformBeam, lam: float, ends: Array, x: Array) -> Array:
    """Displacements (points, 6) at fractions x of an element of pieces of equal length, in its axes, from those of its
    ends (12,)."""
    s, L = len(beam.length), float(beam.length[0])
    step = np.zeros((s, 3))
    step[:, 0] = -L * np.arange(s)
    pieces = at_pole(dynamic_beam(beam, lam), rigid_arm(-step))
    _, levels = in_series(DynamicBeam(*(field[None] for field in pieces)))
    far = rigid_arm([-s * L, 0.0, 0.0]) @ ends[6:]
    motion = np.concatenate([ends[:6], far - ends[:6]])[None, :, None]
    twist = twists_inside(levels, motion)[0, :, :, 0]
    found = np.empty((len(x), 6))
    for row, fraction in enumerate(x * s):
        piece = min(int(fraction), s - 1)
        own = rigid_arm(-step[piece]) @ twist[piece : piece + 2, :, None]
        found[row] = _within(beam.take(piece), lam, own, float(fraction - piece))
    return found


def _within(beam: UniformBeam, lam: float, twist: Array, fraction: float) -> Array:
    """Displacement (6,) at a fraction of a uniform beam from the twists of both its ends (2, 6, 1) at its first."""
    arm = rigid_arm([fraction * float(beam.length), 0.0, 0.0])
    if fraction in (0.0, 1.0):
        return (arm @ twist[int(fraction)])[:, 0]
    parts = [dynamic_beam(beam._replace(length=share * beam.length), lam) for share in (fraction, 1 - fraction)]
    P = join(parts[0], at_pole(parts[1], arm)).P
    middle = twist[0] + P @ np.concatenate([twist[0], twist[1] - twist[0]])
    return (arm @ middle)[:, 0]
