"""Stiffness of a mechanism about a displaced state, small strains, rotations that are not; and how far the screw axes
of its motions drift there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.analysis.strain.internal_forces import finite_numbers
from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.beam import arm_stiffness, geometric_stiffness, rigid_arm, skew
from flexura.errors import OptionError, SolverError
from flexura.linalg import factorise, is_definite
from flexura.motion import rotation, rotation_vector
from flexura.results import Result
from flexura.structure import FullOrderModel, Scatter, Segments, block_diagonal, segments
from flexura.tables import Facts, Item, Table, in_mm, quantity

_MEAN = np.vstack([-np.eye(6) / 2, np.eye(6) / 2])
"""End motions (12, 6) of an element from its deformation, about a frame that turns with the mean of both ends."""


class _Elements(NamedTuple):
    """All placed elements: DOFs (e, 2, 6) of the nodes that their ends follow, -1 where held; arms (e, 2, 3) from there
    to the ends, m, global frame; axes E (e, 3, 3) that carry global vectors into right-handed element axes; the sign
    (e,) of true local axes; length (e,), m; deformation per load C (e, 6, 6); and G (e, 6, 6), geometric stiffness
    per axial force, of the deformation."""

    dof: Index
    arm: Array
    E: Array
    sign: Array
    length: Array
    C: Array
    G: Array


@verb
def tangent_stiffness(
    model: FullOrderModel, u: ArrayLike, *, loads: Mapping[str, ArrayLike] | None = None
) -> sp.csc_matrix:
    """K_t (n, n): the stiffness of a mechanism about its displaced state u (n,), m and rad (theory eqs. S13-S21).

    Elements, rigid arms and bodies turn with the displacement, members shorten as they bend and twist, and internal
    forces of the linear response add their geometric stiffness. Rows and columns are small translations and rotations
    about the displaced state, global frame. K_t(0) = K, and K_t is symmetric. `loads`, (6,) N and N m by node, are
    needed only where dead forces act on rigid arms.

    Correct to first order in u: internal forces are those of small displacements. Bodies that bend turn with their
    frames; springs, diaphragms, superelements and piezo stacks do not turn. Raises OptionError for displacements that
    do not fit, unknown nodes, and springs on rigid arms.
    """
    state = finite_numbers("displacements", u, model.order)
    model.plan.refuse_pose("the stiffness about linear displacements")
    _refuse_springs_on_arms(model)
    cut = segments(model, tapered_pieces=1, roots=False)
    elements = _elements(model, cut)
    K, force, arm = _element_tangents(elements, np.append(state, 0.0)[elements.dof])
    dof = elements.dof.reshape(-1, 6)
    force, arm = force.reshape(-1, 3), arm.reshape(-1, 3)
    for at, load, load_arm in _dead_load_arms(model, state, loads or {}):
        dof, force, arm = np.vstack([dof, at]), np.vstack([force, -load]), np.vstack([arm, load_arm])
    bodies = list(_turned_bodies(model, state))
    for body in bodies:
        dof, force, arm = np.vstack([dof, body.frame]), np.vstack([force, body.force]), np.vstack([arm, body.arm])
    turning = Scatter([dof[:, 3:]], model.order).sparse([arm_stiffness(force, arm)])
    turned = Scatter([body.dof[None] for body in bodies], model.order).sparse([body.K[None] for body in bodies])
    K_t = cut.scatter().sparse([K]) + turning + turned + cut.K
    return ((K_t + K_t.T) / 2).tocsc()


class _TurnedBody(NamedTuple):
    """A body that bends and turns with its frame: DOFs (6n,) of its nodes, -1 where held, and what the turn changes of
    its stiffness (6n, 6n); DOFs (k, 6) of the frame, and forces (k, 3), N, and arms (k, 3), m, of nodes that pull at
    it."""

    dof: Index
    K: Array
    frame: Index
    force: Array
    arm: Array


def _turned_bodies(model: FullOrderModel, u: Array) -> Iterator[_TurnedBody]:
    """All placed bodies that bend, as turned by u (n,)."""
    topology, positions, moved = model.plan.topology, model.geometry.positions, np.append(u, 0.0)
    for name, placed in topology.copies.items():
        if not placed.part.elastic:
            continue
        for own in placed.part.bent_bodies(model.matrices[name].discrete_elements):
            nodes = np.array(own.body.nodes)
            count = int((nodes < placed.part.n_positioned).sum())
            for G, offset in zip(model.design.node_transforms(name, nodes), placed.offset, strict=True):
                dof = topology.dof[topology.root[offset + nodes]]
                T = block_diagonal(G[None])[0]
                K = T.T @ own.K @ T
                turn = rotation(moved[dof[0, 3:]])
                X = np.eye(len(K))
                for k in range(2 * count):
                    X[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = turn
                force = (K @ moved[dof].ravel()).reshape(-1, 6)[1:count, :3]
                arm = positions[offset + nodes[1:count]] - positions[offset + nodes[0]]
                yield _TurnedBody(
                    dof.ravel(), X @ K @ X.T - K, np.tile(dof[0], (count - 1, 1)), -force @ turn.T, arm @ turn.T
                )


def _refuse_springs_on_arms(model: FullOrderModel) -> None:
    """Raise OptionError where a spring, diaphragm, superelement or piezo stack pulls on a rigid arm: how its force
    turns is not known."""
    topology = model.plan.topology
    for name, placed in topology.copies.items():
        part = model.plan.parts[name]
        ends = [n for spring in part.springs.values() for n in spring.nodes]
        ends += [n for diaphragm in part.diaphragms.values() for n in diaphragm.nodes]
        ends += [n for own in part.superelements.values() for n in own.nodes]
        ends += [n for piezo in part.channels.piezos.values() for n in piezo.nodes]
        number = np.array(placed.offset, dtype=np.intp)[:, None] + np.array(sorted(set(ends)), dtype=np.intp)
        if (topology.is_rigid[number] & (topology.root[number] != number)).any():
            what = f"a spring, diaphragm, superelement or piezo stack of {name or 'the mechanism'}"
            raise OptionError(f"{what} is attached off a body's centre: use a short link")


def _dead_load_arms(
    model: FullOrderModel, u: Array, loads: Mapping[str, ArrayLike]
) -> Iterator[tuple[Index, Array, Array]]:
    """DOFs (6,) of the node that every loaded node follows, the force (3,) and the arm (3,) as turned by u (n,)."""
    topology = model.plan.topology
    for node, value in loads.items():
        number = int(topology.numbers([node])[0])
        force = finite_numbers(f"load on {node}", value, 6)[:3]
        if topology.is_rigid[number]:
            root = topology.root[number]
            arm = model.geometry.positions[number] - model.geometry.positions[root]
            turn = np.append(u, 0.0)[topology.dof[root, 3:]]
            yield topology.dof[root], force, rotation(turn) @ arm


def _elements(model: FullOrderModel, cut: Segments) -> _Elements:
    """The elements of a model, cut into one segment each."""
    axes = cut.X[..., 3:, 3:]
    true = cut.X[..., :3, :3]
    lever = -np.swapaxes(true, -1, -2) @ cut.X[..., :3, 3:]
    arm = np.stack([lever[..., 2, 1], lever[..., 0, 2], lever[..., 1, 0]], axis=-1)
    flexibility = [
        np.tile(matrices.elements.C, (len(model.plan.topology.copies[name].paths), 1, 1))
        for name, matrices in model.matrices.items()
        if len(model.plan.parts[name].connectivity)
    ]
    beam = cut.beam.take(cut.kind)
    length = np.asarray(beam.length)
    half = np.zeros((len(length), 3))
    half[:, 0] = length / 2
    to_mean = rigid_arm(-half)
    C = to_mean @ np.concatenate([np.empty((0, 6, 6)), *flexibility]) @ np.swapaxes(to_mean, -1, -2)
    G = _MEAN.T @ geometric_stiffness(np.ones(len(length)), beam) @ _MEAN
    return _Elements(cut.dof, arm, axes[:, 0], np.linalg.det(true[:, 0]).round(), length, C, G)


def _element_tangents(elements: _Elements, u: Array) -> tuple[Array, Array, Array]:
    """Tangents (e, 12, 12) over the DOFs of the elements for displacements u (e, 2, 6), forces (e, 2, 3) of the nodes
    on the ends, N, and arms (e, 2, 3) as turned, m, global frame."""
    sign = elements.sign[:, None]
    d, k = _deformation(elements, u), np.linalg.inv(elements.C)
    load = (k @ d[..., None])[..., 0]
    bow = (elements.G @ d[..., None])[..., 0]
    # bending shortens the chord, against all forces that stretching causes: where roots give askew, moments as well
    bow, stretch = bow[:, :, None], k[:, :, :1]
    bent = stretch @ bow.mT
    k = k + load[:, 0, None, None] * elements.G + bent + bent.mT + stretch[:, :1] * bow @ bow.mT
    flip = np.concatenate([np.repeat(sign, 3, axis=1), np.ones((len(sign), 3))], axis=1)
    k *= flip[:, :, None] * flip[:, None, :]
    f, m = sign * load[:, :3], load[:, 3:]

    turn = rotation(u[..., 3:])
    arm = (turn @ elements.arm[..., None])[..., 0]
    first, second = turn[:, 0], turn[:, 1]
    E = elements.E @ (first @ rotation(rotation_vector(first.mT @ second) / 2)).mT
    axis = elements.length[:, None] * sign * elements.E[:, 0]
    ends = u[..., :3] + arm - elements.arm
    chord = (E @ (axis + ends[:, 1] - ends[:, 0])[..., None])[..., 0]
    B, H = _kinematics(chord, d[:, 3:], f, m)
    T = _end_motions(E, arm)
    K = np.swapaxes(T, -1, -2) @ (np.swapaxes(B, -1, -2) @ k @ B + H) @ T
    force = (np.swapaxes(E, -1, -2) @ f[..., None])[..., 0]
    return K, np.stack([-force, force], axis=1), arm


def _deformation(elements: _Elements, u: Array) -> Array:
    """Linear deformation (e, 6), local axes: of the ends against a frame that turns with their mean rotation."""
    ends = u[..., :3] + np.cross(u[..., 3:], elements.arm)
    axis = (elements.sign * elements.length)[:, None] * elements.E[:, 0]
    mean = u[:, :, 3:].mean(axis=1)
    shift = ends[:, 1] - ends[:, 0] - np.cross(mean, axis)
    moved = (elements.E @ np.stack([shift, u[:, 1, 3:] - u[:, 0, 3:]], axis=-1)).swapaxes(-1, -2)
    moved[:, 0] *= elements.sign[:, None]
    return moved.reshape(-1, 6)


def _kinematics(chord: Array, bend: Array, f: Array, m: Array) -> tuple[Array, Array]:
    """First variation B (e, 6, 12) of the deformation with the motion of the ends, and the stiffness H (e, 12, 12) of
    forces f and moments m (e, 3) against its second variation, element axes (theory eqs. S17-S19)."""
    one, C = np.broadcast_to(np.eye(3), (len(f), 3, 3)), skew(chord)
    W = skew(bend) / 8
    mean = (one / 2 + W, one / 2 - W)
    B = np.zeros((len(f), 6, 12))
    B[:, :3, :3], B[:, :3, 6:9] = -one, one
    B[:, 3:, 3:6], B[:, 3:, 9:] = -one, one
    for at, share in zip((slice(3, 6), slice(9, 12)), mean, strict=True):
        B[:, :3, at] = C @ share
    H = np.zeros((len(f), 12, 12))
    F, M, swing = skew(f) / 2, skew(m) / 2, arm_stiffness(f, chord) / 4
    for a in (slice(3, 6), slice(9, 12)):
        H[:, :3, a], H[:, 6:9, a] = F, -F
        H[:, a, :3], H[:, a, 6:9] = -F, F
        for b in (slice(3, 6), slice(9, 12)):
            H[:, a, b] = swing
    H[:, 3:6, 9:] += M
    H[:, 9:, 3:6] -= M
    return B, H


def _end_motions(E: Array, arm: Array) -> Array:
    """T (e, 12, 12): motions of the ends in element axes from those of the nodes that they follow."""
    T = np.zeros((len(E), 12, 12))
    D = rigid_arm(arm)
    for end in (0, 1):
        six = slice(6 * end, 6 * end + 6)
        T[:, six, six] = D[:, end]
    for k in range(4):
        three = slice(3 * k, 3 * k + 3)
        T[:, three] = E @ T[:, three]
    return T


Vector = tuple[float, float, float]

FAR = 1e6
"""Distance, m, of an axis beyond which a motion counts as a translation."""


@dataclass(frozen=True, repr=False)
class ScrewAxis(Result):
    """The axis about and along which a rigid body moves at an instant (theory eq. S22).

    `direction` is a unit vector; `point` is the point of the axis nearest to the point that was asked for, m; `pitch`
    is the advance per angle, m/rad. A pure translation has an infinite pitch, its direction, and the point asked for.
    """

    direction: Vector
    point: Vector
    pitch: float

    @property
    def _along(self) -> str:
        return " ".join(f"{x:+.4f}" for x in self.direction)

    def presentation(self) -> Iterator[Item]:
        if self.is_translation:
            yield Facts({"translation along": self._along})
        else:
            yield Facts(
                {
                    "direction": self._along,
                    "through": f"({in_mm(self.point)}) mm",
                    "pitch": quantity(self.pitch, "m/rad", 4),
                }
            )

    @property
    def is_translation(self) -> bool:
        """True when nothing turns."""
        return bool(np.isinf(self.pitch))


@dataclass(frozen=True, repr=False)
class Drift(Result):
    """The screw axis of a node's motion under one load, at rest and about a displaced state.

    `shift` (3,) leads from the point of the axis at rest to that of the displaced one, m, `distance` is its length,
    and `tilt` is the angle between the axes, rad. Translations have no shift. `twists` (2, 6) are the motions per load,
    m/N, rad/N or of the load's unit, of the node at rest and displaced.
    """

    rest: ScrewAxis
    displaced: ScrewAxis
    twists: Array

    _shown = ("distance", "tilt")
    _told = ("rest", "displaced", "twists", "shift", "distance", "tilt")

    def presentation(self) -> Iterator[Item]:
        yield Facts({"distance": quantity(self.distance, "m", 4), "tilt": quantity(self.tilt, "rad", 4)})
        both = (self.rest, self.displaced)
        yield Table(
            {
                "": ("undeformed", "displaced"),
                "direction": [a._along for a in both],
                "through [mm]": [in_mm(a.point) for a in both],
                "pitch": [quantity(a.pitch, "m/rad") for a in both],
            }
        )

    @property
    def shift(self) -> Vector:
        """From the point at rest to the displaced one, m; zero unless both turn."""
        if self.rest.is_translation or self.displaced.is_translation:
            return 0.0, 0.0, 0.0
        return _vector(np.subtract(self.displaced.point, self.rest.point))

    @property
    def distance(self) -> float:
        """Length of the shift, m."""
        return float(np.linalg.norm(self.shift))

    @property
    def tilt(self) -> float:
        """Angle between the directions, rad."""
        a, b = np.array(self.rest.direction), np.array(self.displaced.direction)
        return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


@verb
def screw_axis(twist: ArrayLike, near: ArrayLike = (0.0, 0.0, 0.0), *, at: ArrayLike = (0.0, 0.0, 0.0)) -> ScrewAxis:
    """The screw axis of a twist (theory eq. S22).

    twist: (6,) translation of the body's point `at`, m, and rotation, rad, small or per time or load; near, at: (3,) m.
    The axis is given by its point nearest to `near`. Raises OptionError for what is no motion.
    """
    motion = finite_numbers("a twist", twist, 6)
    origin, wanted = finite_numbers("at", at, 3), finite_numbers("near", near, 3)
    v, w = motion[:3], motion[3:]
    speed, rate = float(np.linalg.norm(v)), float(np.linalg.norm(w))
    if rate * FAR <= speed:
        if not speed:
            raise OptionError("a twist of nothing but zeros has no axis")
        return ScrewAxis(_vector(v / speed), _vector(wanted), np.inf)
    direction = w / rate
    foot = origin + np.cross(direction, v) / rate
    nearest = foot + direction * (direction @ (wanted - foot))
    return ScrewAxis(_vector(direction), _vector(nearest), float(direction @ v) / rate)


@verb
def drift(
    model: FullOrderModel,
    u: ArrayLike,
    *,
    node: str,
    load: ArrayLike,
    near: ArrayLike | None = None,
    loads: Mapping[str, ArrayLike] | None = None,
) -> Drift:
    """How the axis about which a small load moves a node drifts when the mechanism is displaced.

    u: (n,) displaced state, m and rad; load: (6,) N and N m at the node, global frame, which is small and tells axes
    apart where there are several freedoms; near: (3,) m, by default the node at rest; loads: as in `tangent_stiffness`.
    Axes are those of K^-1 at rest and K_t^-1 about the displaced state, first order in u.

    Raises OptionError for unknown nodes and loads that are none, SolverError when something can move freely.
    """
    state, wrench = finite_numbers("displacements", u, model.order), finite_numbers("load", load, 6)
    if not is_definite(model.K):
        raise SolverError("something can move freely under the load: hold it, or attach it by a stiffness")
    topology = model.plan.topology
    number = topology.numbers([node])
    root = topology.root[number[0]]
    at = model.geometry.positions[number[0]]
    arm = at - model.geometry.positions[root] if topology.is_rigid[number[0]] else np.zeros(3)
    motion = np.append(state, 0.0)[topology.dof[root]]
    turned = rotation(motion[3:]) @ arm
    moved = at - arm + motion[:3] + turned
    wanted = at if near is None else finite_numbers("near", near, 3)
    K_t = tangent_stiffness(model, state, loads=loads)
    twists = np.stack([_response(K, topology.dof[root], a, wrench) for K, a in ((model.K, arm), (K_t, turned))])
    return Drift(screw_axis(twists[0], wanted, at=at), screw_axis(twists[1], wanted, at=moved), twists)


def _response(K: sp.csc_matrix, dof: NDArray[np.intp], arm: Array, load: Array) -> Array:
    """Motion (6,) of a point on an arm from the node with the DOFs, -1 where held, per load (6,) on it."""
    D = rigid_arm(arm)
    free = dof >= 0
    force = np.zeros(K.shape[0])
    force[dof[free]] = (D.T @ load)[free]
    u = factorise(K).solve(force)
    return D @ np.where(free, u[dof], 0.0)


def _vector(v: Array) -> Vector:
    x, y, z = (float(c) + 0.0 for c in v)
    return x, y, z
