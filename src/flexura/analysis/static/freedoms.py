"""Ways in which a platform is free: rotations about screw axes and translations, from its compliance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.analysis.strain import ScrewAxis, screw_axis
from flexura.arrays import Array
from flexura.beam import block_rotation, rigid_arm
from flexura.linalg import is_definite
from flexura.records import Record
from flexura.results import Result, plain
from flexura.structure import FullOrderModel
from flexura.tables import Facts, Item, Table, counted, in_mm, number, quantity
from flexura.thresholds import STATIC_ROUND_OFF

LEAST_GAP = 10.0
"""Least ratio of compliances between freedoms and constraints where there are no actuators."""

OUTSTANDING_GAP = 2.0
"""How many times the second largest ratio of neighbouring compliances the largest must be."""

LENGTH_FACTORS = (2**-0.5, 2**0.5)
"""Factors of the characteristic length with which freedoms have to be the same."""

TURNING_SHARE = 0.1
"""Share of rotation in a freedom, lengths over the characteristic length, below which it is a translation."""

REPEATED_STIFFNESS = 1e-3
"""Stiffnesses that differ by no more are repeated: their axes are a matter of choice."""

SAME_DIRECTION = 1e-6
"""Directions are the same when their components differ by no more."""


@dataclass(frozen=True, repr=False)
class Freedom(Record):
    """One way in which a platform is free: a twist (6,) of its node of unit size, m and rad, and its screw axis.

    `share` is the part of the compliance that the actuators own, 1 where they are all of it; nan without actuators.
    `command` (a,) are the actuator commands, in their units, per unit of the twist. In units of the twist, `stroke` is
    how far they reach to either side within their limits, and `yield_stroke` how far until a link or flexure yields,
    moved by the actuators or, without them, by the one wrench at the platform that makes this twist; `shift`, m, and
    `tilt`, rad, say how far the axis drifts at the end of the stroke. None where there are no commands, limits or yield
    stresses, and where the tangent stiffness is refused (`tangent_stiffness`).
    """

    kind: str
    twist: tuple[float, ...]
    axis: ScrewAxis
    share: float
    command: tuple[float, ...]
    stroke: float | None = None
    yield_stroke: float | None = None
    yields_in_range: bool = True
    """Whether linear theory still holds at `yield_stroke`: no rotation or deflection there is beyond its limit."""
    shift: float | None = None
    tilt: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, the screw axis by its `direction`, `point` and `pitch`."""
        axis = {"direction": self.axis.direction, "point": self.axis.point, "pitch": self.axis.pitch}
        values = {name: value for name, value in vars(self).items() if name != "axis"}
        return plain({"kind": self.kind, "twist": self.twist, **axis, **values})


@dataclass(frozen=True, repr=False)
class ComplianceSpectrum(Result):
    """Compliances of a platform on one scale, translations and rotations together (theory eq. T24).

    `compliance` (6,), m/N, largest first: of the platform at `centre` (3,), m, the centroid of what holds it, rotations
    counted as what they move at the characteristic `length`, m, its radius of gyration. `gap` is the largest ratio of
    two that follow each other, `count` how many are above it; `is_outstanding` when no other is near it, and `is_clear`
    when it is also large, and in the same place for lengths up to sqrt(2) times as short and as long. `axes` (6, 6) are
    the motions, one in each column, translations of the centre in m and rotations times the length.
    """

    compliance: Array
    axes: Array
    centre: Array
    length: float
    gap: float
    count: int
    is_outstanding: bool
    is_clear: bool

    def _title(self) -> str:
        return counted(self.count, "freedom") if self.is_clear else "no clear cut between freedoms and constraints"

    def presentation(self) -> Iterator[Item]:
        yield Table({"": range(1, 7), "compliance [m/N]": self.compliance}, "compliances")
        gap, length = f"{number(self.gap, 4)} after the {self.count}.", quantity(self.length, "m", 4)
        yield Facts({"largest gap": gap, "rotations counted at": length, "centre [mm]": in_mm(self.centre)})

    def _data(self) -> dict[str, Any]:
        values = {name: value for name, value in vars(self).items() if name != "length"}
        return {**values, "characteristic_length": self.length}

    @property
    def why_unclear(self) -> str:
        """Why no freedoms are named where it is not clear."""
        if self.gap < LEAST_GAP:
            return f"no clear freedoms: compliances are at most {self.gap:.2g} times each other"
        if self.is_outstanding:
            return "no clear freedoms: where the largest gap is depends on the length at which rotations are counted"
        return f"no clear freedoms: another gap is nearly as large as the largest, {self.gap:.2g} times"


def compliance_spectrum(model: FullOrderModel, number: int, C: Array) -> ComplianceSpectrum:
    """The spectrum of the compliance C (6, 6) of a node, by number, global frame, SI (theory eq. T24).

    Centre and length are centroid and radius of gyration of what holds the platform, each member, spring or stack
    counting once and members as straight lines: for a single leaf its middle and l / sqrt(12), where it is as compliant
    in translation, l^3 / 12 E I, as in rotation, l / E I. They go with the mechanism's size and frame, and do not
    depend on which node of the platform is named.
    """
    middle, spread = _holders(model, number)
    position = model.geometry.positions[number]
    centre = middle.mean(axis=0) if len(middle) else position
    square = float((((middle - centre) ** 2).sum(axis=1) + spread).mean()) if len(middle) else 0.0
    A = rigid_arm(centre - position)
    at_centre = A @ C @ A.T
    if not square > 0:
        piece = model.plan.topology.piece
        cluster = model.geometry.positions[piece == piece[number]]
        square = float(((cluster - centre) ** 2).sum(axis=1).max())
    if not square > 0:
        turning = float(np.trace(at_centre[3:, 3:]))
        square = float(np.trace(at_centre[:3, :3])) / turning if turning > 0 else 1.0
    length = float(np.sqrt(square))
    values, axes = _scaled(at_centre, length)
    count, gap, next_gap = _largest_gap(values)
    is_outstanding = gap >= OUTSTANDING_GAP * next_gap
    is_same = all(_largest_gap(_scaled(at_centre, factor * length)[0])[0] == count for factor in LENGTH_FACTORS)
    is_clear = gap >= LEAST_GAP and is_outstanding and is_same
    return ComplianceSpectrum(values, axes, centre, length, gap, count, is_outstanding, is_clear)


def _scaled(C: Array, length: float) -> tuple[Array, Array]:
    """Compliances (6,), m/N, largest first, and their axes (6, 6), rotations as lengths."""
    scale = np.array([1.0, 1.0, 1.0, length, length, length])
    values, axes = la.eigh(C * scale[:, None] * scale)
    return np.maximum(values[::-1], STATIC_ROUND_OFF * values[-1]), axes[:, ::-1]


def _largest_gap(values: Array) -> tuple[int, float, float]:
    """How many compliances (6,) are above the largest gap, this ratio, and the next largest ratio.

    What is held does not move at all: the step down to it counts only where there is no gap above it.
    """
    ratio = values[:-1] / values[1:]
    elastic = np.where(values[1:] > STATIC_ROUND_OFF * values[0], ratio, 1.0)
    if elastic.max() < LEAST_GAP and (elastic < ratio).any():
        elastic = ratio
    first = int(np.argmax(elastic))
    return first + 1, float(elastic[first]), float(np.delete(elastic, first).max())


def _holders(model: FullOrderModel, number: int) -> tuple[Array, Array]:
    """Middles (k, 3), m, of the members, diaphragms, springs, stacks and superelements on the body of a node, and their
    mean squares of distance from there (k,), m^2."""
    topology = model.plan.topology
    on_platform = topology.piece == topology.piece[number]
    middle: list[Array] = []
    spread: list[float] = []
    for name in model.matrices:
        placed, geometry = topology.copies[name], model.geometry.parts[name]
        part = placed.part
        ends = geometry.positions[part.ends] + geometry.offsets
        discrete_elements = [(spring.nodes, 0.0) for spring in part.springs.values()]
        discrete_elements += [(diaphragm.nodes, 0.0) for diaphragm in part.diaphragms.values()]
        discrete_elements += [(stack.nodes, 1 / 3) for stack in part.channels.piezos.values()]
        discrete_elements += [
            ([n for n in own.nodes if n < part.n_positioned], 1.0) for own in part.superelements.values()
        ]
        for instance, offset in zip(placed.number, placed.offset, strict=True):
            m = np.flatnonzero(on_platform[offset + part.ends].sum(axis=1) == 1)
            middle += list(ends[m].mean(axis=1) @ model.geometry.Q[instance].T + model.geometry.t[instance])
            spread += (geometry.length[m] ** 2 / 12).tolist()
            for nodes, share in discrete_elements:
                held_by = offset + np.array(nodes, dtype=np.intp)
                if on_platform[held_by].any() and not (on_platform[held_by].all() and len(held_by) > 1):
                    x = model.geometry.positions[held_by]
                    middle.append(x.mean(axis=0))
                    spread.append(share * float(((x - middle[-1]) ** 2).sum(axis=1).mean()))
    return np.array(middle).reshape(-1, 3), np.array(spread)


def stiffness_without_springs(model: FullOrderModel) -> sp.csc_matrix | None:
    """K (n, n) without the springs of the description; None when there are none, or when nothing else holds."""
    K: Any = model.K.tocsc(copy=True)
    topology = model.plan.topology
    for name, matrices in model.matrices.items():
        placed = topology.copies[name]
        for discrete in matrices.discrete_elements:
            if discrete.name not in placed.part.springs or discrete.K is None:
                continue
            for instance, offset in zip(placed.number, placed.offset, strict=True):
                rows = model.design.node_rows(np.array([offset + n for n in discrete.nodes]))
                Q = model.geometry.Q[instance].T
                turned = block_rotation(Q)
                turned[3:, 3:] *= round(float(np.linalg.det(Q)))
                B = sp.csr_matrix(np.kron(np.eye(len(discrete.nodes)), turned)) @ rows
                K = K - B.T @ sp.csc_matrix(discrete.K) @ B
    has_springs = any(part.springs for part in model.plan.parts.values())
    if not has_springs or (K.diagonal() < STATIC_ROUND_OFF * model.K.diagonal()).any():
        return None
    K = sp.csc_matrix((K + K.T) / 2)
    return K if is_definite(K) else None


def screws(basis: Array, C: Array, model: FullOrderModel) -> list[tuple[Array, str]]:
    """Rotations (`R`) and translations (`T`) that span a space of twists (6, f), rotations times the length.

    Rotations carry no part of the pure translations. Among themselves both have the principal directions of the
    stiffness, the inverse of C (6, 6); where that is the same in several, the directions of the most members'
    axes or else of the global ones.
    """
    if not basis.shape[1]:
        return []
    _, cosines, Vt = la.svd(basis[3:])
    cosines = np.append(cosines, np.zeros(max(0, basis.shape[1] - len(cosines))))
    turning = cosines > TURNING_SHARE
    K = np.asarray(la.pinvh(C, rtol=STATIC_ROUND_OFF), dtype=np.float64)
    axes = _member_axes(model)
    turns = _along_axes(basis @ Vt[turning].T, slice(3, 6), K, axes)
    slides = _along_axes(basis @ Vt[~turning].T, slice(0, 3), K, axes)
    return [(t, "R") for t in turns] + [(t, "T") for t in slides]


def _along_axes(space: Array, part: slice, K: Array, axes: Array) -> list[Array]:
    """Twists of unit directions that span a space (6, f), in the order of the coordinate axes that they are nearest."""
    if space.shape[1] < 2:
        return list(space.T)
    inverse = np.linalg.pinv(space[part])
    axes_in_space = la.orth(space[part])
    twists = space @ inverse @ axes_in_space
    stiffness, Y = la.eigh(twists.T @ K @ twists)
    directions: list[Array] = []
    first = 0
    for k in range(1, len(stiffness) + 1):
        if k == len(stiffness) or stiffness[k] > (1 + REPEATED_STIFFNESS) * stiffness[k - 1]:
            group = axes_in_space @ Y[:, first:k]
            directions += [group[:, 0]] if k - first == 1 else _directions_in(group, axes)
            first = k
    directions.sort(key=lambda d: int(np.flatnonzero(np.abs(d) > np.abs(d).max() - SAME_DIRECTION)[0]))
    return [space @ inverse @ d for d in directions]


def _directions_in(space: Array, axes: Array) -> list[Array]:
    """Orthogonal directions that span a space (3, f): of the axes (n, 3) the first ones in it, else projections of the
    longest."""
    directions: list[Array] = []
    rest = space
    while rest.shape[1]:
        inside = np.linalg.norm(axes @ rest, axis=1)
        within = np.flatnonzero(inside > 1 - SAME_DIRECTION)
        best = within[0] if len(within) else np.flatnonzero(inside > inside.max() - SAME_DIRECTION)[0]
        d = rest @ (rest.T @ axes[best])
        d = d / np.linalg.norm(d)
        directions.append(d)
        rest = rest @ la.null_space((d @ rest)[None, :])
    return directions


def _member_axes(model: FullOrderModel) -> Array:
    """Directions (n, 3) of the members' axes and the global ones, without their sign: first what most members have,
    and among equals the global ones."""
    axes = [np.eye(3)]
    for name in model.matrices:
        placed, R = model.plan.topology.copies[name], model.geometry.parts[name].R
        is_round = placed.part.table.is_round  # of which only the axis along them counts
        local = np.concatenate([R[is_round, 0], R[~is_round].reshape(-1, 3)])
        axes += [local @ model.geometry.Q[instance].T for instance in placed.number]
    directions = np.concatenate(axes)
    directions[np.abs(directions) < SAME_DIRECTION] = 0.0
    first = directions[np.arange(len(directions)), np.argmax(directions != 0, axis=1)]
    directions *= np.sign(first)[:, None]
    rounded = np.round(directions / SAME_DIRECTION / 10)
    _, at, same, counts = np.unique(rounded, axis=0, return_index=True, return_inverse=True, return_counts=True)
    votes = counts.astype(float)
    votes[same[:3]] -= 0.5
    order = np.lexsort((at, -votes))
    return directions[at[order]]


def unit_freedom(twist: Array, kind: str, position: Array) -> Freedom:
    """A freedom of unit size from a twist (6,) at a point (3,), m and rad, without what actuators make of it."""
    moving = twist[3:] if kind == "R" else twist[:3]
    largest = np.flatnonzero(np.abs(moving) > (1 - SAME_DIRECTION) * np.abs(moving).max())[0]
    twist = twist / (np.linalg.norm(moving) * np.sign(moving[largest]))
    twist[np.abs(twist) < 1e-9 * np.abs(twist).max()] = 0.0
    axis = screw_axis(twist if kind == "R" else [*twist[:3], 0, 0, 0], position, at=position)
    return Freedom(kind, tuple(float(x) for x in twist), axis, np.nan, ())
