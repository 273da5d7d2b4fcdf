"""What follows from the exact dynamic stiffness without a mesh: frequency response, and motion inside members."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from flexura.arrays import Array, Complex, Index
from flexura.beam import UniformBeam, at_pole, dynamic_beam, join, rigid_arm
from flexura.errors import OptionError
from flexura.linalg import scaled, unit_scale
from flexura.methods.dynamic_stiffness import DynamicStiffness
from flexura.methods.exact_chains import beams_at, in_series, twists_inside
from flexura.methods.solution import Solution
from flexura.structure import ElementSlice, FullOrderModel, InputPort, OutputPort, full_order
from flexura.systems import DampingLaw, uniform_loss


class ExactResponse:
    """Displacements of the kept nodes per unit input, with damping that is the same everywhere and dashpots.

    Rayleigh damping and one loss factor eta turn K(omega) into s K0(mu) with s = 1 + i eta + i beta omega and
    mu^2 = omega^2 (1 - i alpha/omega)/s, K0 being the undamped dynamic stiffness (theory eq. T12). Raises OptionError
    for modal damping ratios, loss factors that differ, and inputs and outputs at nodes that a substructure does not
    keep.
    """

    def __init__(
        self,
        model: FullOrderModel,
        law: DampingLaw,
        inputs: Sequence[InputPort],
        outputs: Sequence[OutputPort],
        direct: Array,
    ) -> None:
        model.plan.refuse_loads("the exact dynamic stiffness", model.values)
        if law.is_modal:
            hint = "give Rayleigh damping, a loss factor or dashpots"
            raise OptionError(f"the exact dynamic stiffness has no modes to which damping ratios could belong; {hint}")
        self.stiffness: DynamicStiffness = DynamicStiffness(model)
        self.model = model
        self.law = law
        self.direct = direct
        plan = model.plan
        C, H = full_order(plan).dissipation(model.design, law.loss_factor)
        loss = uniform_loss(H, model.K)
        if loss is None:
            hint = "use the full-order model with method direct"
            raise OptionError(f"the exact dynamic stiffness takes one loss factor for everything elastic; {hint}")
        self.loss_factor = loss
        self.kept: Index = plan.topology.dof.ravel()[self.stiffness.assembler.physical]
        self.C = self._over_kept(C.toarray(), "a dashpot")[self.kept] if C.nnz else None
        self.derivative: Index = np.array([o.derivative for o in outputs], dtype=np.intp)
        self.rows: Array = np.stack([self._over_kept(o.row[None], o.channel.name)[0] for o in outputs])
        self.loads: Array = np.stack([self._over_kept(i.load[None], i.channel.name)[0] for i in inputs], axis=1)
        self.base: list[Array | None] = [i.base for i in inputs]

    def _over_kept(self, rows: Array, name: str) -> Array:
        """Rows over the kept DOFs. Raises OptionError where they reach others."""
        kept = self.stiffness.over_kept(rows)
        if kept is None:
            hint = "make its node an interface of its substructure"
            raise OptionError(f"{name} is at a node that the exact dynamic stiffness eliminates; {hint}")
        return kept

    def at(self, omega: float) -> Complex:
        """H (p, m) at an angular frequency, rad/s, above zero."""
        law = self.law
        s = 1 + 1j * (self.loss_factor + law.beta * omega)
        mu = omega * np.sqrt((1 - 1j * law.alpha / omega) / s)
        K, _, _ = self.stiffness.at(mu if mu.imag else omega)
        Z = s * K
        if self.C is not None:
            Z = Z + 1j * omega * self.C
        loads = self.loads.astype(complex)
        if any(base is not None for base in self.base):
            F = s * self._rigid_load(mu) / (omega**2 - 1j * law.alpha * omega)
            for k, base in enumerate(self.base):
                if base is not None:
                    loads[:, k] = F @ base
        d = unit_scale(Z)
        q = d[:, None] * np.linalg.solve(scaled(Z, d), d[:, None] * loads)
        H = (self.rows @ q) * ((1j * omega) ** self.derivative)[:, None]
        return H + self.direct

    def _rigid_load(self, mu: complex) -> Complex:
        """Load (n, 6) on the kept DOFs when everything is carried along in rigid motions of and about the origin.

        Springs to ground ride along and are left out (theory eq. T13).
        """
        plan, assembler = self.model.plan, self.stiffness.assembler
        transforms = assembler.transforms(self.model.design)
        load = np.zeros((len(assembler.physical) + 1, 6), dtype=complex)  # DOF -1 goes to the last row
        for name, part in self.stiffness.parts.items():
            K = part.at(mu**2).K.astype(complex)
            boundary = assembler.reducers[name].part.boundary
            position = {int(node): k for k, node in enumerate(boundary)}
            for discrete in part.matrices.discrete_elements:
                if discrete.K is not None and len(discrete.nodes) == 1:
                    at = 6 * position[discrete.nodes[0]] + np.arange(6)
                    K[np.ix_(at, at)] -= discrete.K
            T = transforms[name]
            number = np.array(plan.topology.copies[name].offset)[:, None] + boundary
            root = plan.topology.root[number]
            rigid = rigid_arm(self.model.geometry.positions[root]).reshape(len(T), -1, 6)
            force = np.swapaxes(T, -1, -2) @ (K @ (T @ rigid))
            np.add.at(load, assembler.coordinates(name, 0, 0), force)
        return load[:-1]


class _Placed(NamedTuple):
    """A member as placed: its prototype, elements and their nodes (e, 2); from global axes to the member's (6, 6), and
    from displacements of the nodes to those of the elements' ends in the member's axes (e, 12, 12)."""

    name: str
    elements: range
    nodes: Index
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
    placed = _placed(model, member)
    elements = model.matrices[placed.name].elements
    assert isinstance(elements, ElementSlice)
    cut = elements.cut(1)
    first = np.concatenate([[0], np.cumsum(cut.counts)])
    motion = np.empty((len(at), 6, solution.shapes.shape[2]))
    index = np.minimum((at * len(placed.elements)).astype(int), len(placed.elements) - 1)
    for k, hz in enumerate(solution.frequency_hz):
        ends = placed.to_ends @ (solution.shapes[placed.nodes, :, k].reshape(len(placed.nodes), 12, 1))
        for e in np.unique(index):
            number = placed.elements[int(e)]
            beam = cut.beam.take(cut.kind[first[number] : first[number + 1]])
            flexibility = [cut.roots[root] if root >= 0 else None for root in cut.root[number]]
            element = _Element(beam, (2 * np.pi * hz) ** 2, ends[e, :, 0], flexibility)
            points = np.flatnonzero(index == e)
            motion[points, :, k] = element.at(at[points] * len(placed.elements) - e) @ placed.to_member
    return motion


def _placed(model: FullOrderModel, member: str) -> _Placed:
    *path, key = member.split(".")
    topology = model.plan.topology
    for name, copies in topology.copies.items():
        if tuple(path) not in copies.paths or key not in copies.part.members:
            continue
        copy, k = copies.paths.index(tuple(path)), list(copies.part.members).index(key)
        elements = range(int(copies.part.first[k]), int(copies.part.first[k + 1]))
        Q = model.geometry.Q[copies.number[copy]]
        R = model.geometry.parts[name].R[k]
        inward = np.kron(np.diag([1.0, np.linalg.det(Q).round()]), Q.T)
        to_member = np.kron(np.eye(2), R) @ inward
        to_ends = model.geometry.T[name][elements] @ np.kron(np.eye(2), inward)
        nodes = copies.offset[copy] + copies.part.connectivity[elements]
        return _Placed(name, elements, nodes, to_member, to_ends)
    raise OptionError(f"there is no member {member!r}; members are written NAME or INSTANCE.NAME")


class _Element:
    """An element, as uniform pieces of equal length, that vibrates at a squared angular frequency lam.

    `ends` (12,) are displacements of what its ends are joined to, by elastic roots of a flexibility (6, 6) or directly.
    """

    def __init__(self, beam: UniformBeam, lam: float, ends: Array, flexibility: Sequence[Array | None]) -> None:
        self._beam, self._lam = beam, lam
        s, L = len(beam.length), float(beam.length[0])
        self._step = np.zeros((s, 3))
        self._step[:, 0] = -L * np.arange(s)
        pieces = at_pole(dynamic_beam(beam, lam), rigid_arm(-self._step))
        whole, levels = in_series(beams_at(pieces, None))
        back = rigid_arm([-s * L, 0.0, 0.0])
        if any(root is not None for root in flexibility):
            T = np.eye(12)
            T[6:, :6], T[6:, 6:] = -np.eye(6), back
            ends = _behind_roots(T.T @ whole.K[0] @ T, ends, flexibility)
        motion = np.concatenate([ends[:6], back @ ends[6:] - ends[:6]])[None, :, None]
        self._twists = twists_inside(levels, motion)[0, :, :, 0]

    def at(self, x: Array) -> Array:
        """Displacements (points, 6) at fractions of the element, in its axes."""
        motion = np.empty((len(x), 6))
        for row, fraction in enumerate(x * len(self._step)):
            piece = min(int(fraction), len(self._step) - 1)
            twist = rigid_arm(-self._step[piece]) @ self._twists[piece : piece + 2, :, None]
            motion[row] = _within(self._beam.take(piece), self._lam, twist, float(fraction - piece))
        return motion


def _behind_roots(K: Array, ends: Array, flexibility: Sequence[Array | None]) -> Array:
    """Displacements (12,) of the ends of a beam with the stiffness K (12, 12) from those of what they are joined to."""
    rooted = np.repeat([root is not None for root in flexibility], 6)
    springs = la.block_diag(*(np.zeros((6, 6)) if root is None else np.linalg.inv(root) for root in flexibility))
    load = springs @ ends - np.where(rooted, K @ np.where(rooted, 0.0, ends), 0.0)
    inside = ends.copy()
    inside[rooted] = np.linalg.solve((K + springs)[np.ix_(rooted, rooted)], load[rooted])
    return inside


def _within(beam: UniformBeam, lam: float, twist: Array, fraction: float) -> Array:
    """Displacement (6,) at a fraction of a uniform beam from the twists of both its ends (2, 6, 1) at its first."""
    arm = rigid_arm([fraction * float(beam.length), 0.0, 0.0])
    if fraction in (0.0, 1.0):
        return (arm @ twist[int(fraction)])[:, 0]
    parts = [dynamic_beam(beam._replace(length=share * beam.length), lam) for share in (fraction, 1 - fraction)]
    P = join(parts[0], at_pole(parts[1], arm)).P
    middle = twist[0] + P @ np.concatenate([twist[0], twist[1] - twist[0]])
    return (arm @ middle)[:, 0]
