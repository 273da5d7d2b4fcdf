"""What pulls at the bodies of a mechanism that bend, and which of them bend enough to matter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.beam import block_rotation, member_frame, patch_flexibility, rigid_arm
from flexura.errors import ModelError, Problem, SolverError
from flexura.mechanism import TOP, origin_of
from flexura.structure.discrete_elements import BodyElement, Hold
from flexura.structure.elastic_bodies import BARE, ElasticBody, OffSolidError, Pulls, inside
from flexura.structure.elements import Elements
from flexura.structure.members import Members
from flexura.structure.part import Part
from flexura.structure.topology import Geometry
from flexura.thresholds import SAME_PLACE

MATTERS = 2e-3
"""Flexibility of a body over that of the members on it, held at their other ends, from which it bends: half of that is
the change of a frequency."""


SQUARED = np.sqrt(np.pi) / 2
"""Half side of a square over the radius of a disc of its area."""

AWAY = 0.05
"""Distance of what a body carries from its solid, over its longest side, from which it does not touch it."""

BESIDE = 1e-5
"""How far to both sides of a place it is looked whether it is on a face, over the least half size."""

TOUCH = "let its solid reach there, draw links or bodies between, or say elastic: false"


def body_name(part: Part, body: ElasticBody) -> str:
    """The name of a body of a part."""
    return next(key for key, own in part.elastic.items() if own is body)


def cannot_bend(prototype: str, key: str, rule: str, hint: str) -> Problem:
    """Why a body that is described as elastic is not."""
    above = () if prototype == TOP else ("substructures", origin_of(prototype))
    return Problem((*above, "bodies", key, "elastic"), "true", rule, hint)


def _off_solid(prototype: str, key: str, node: str) -> Problem:
    above = () if prototype == TOP else ("substructures", origin_of(prototype))
    rule = "what pulls there finds no solid: it is over a hole, in a pocket or beyond a face"
    hint = "move the node to a face, let the solid reach there, or say elastic: false"
    return Problem((*above, "bodies", key, "carries"), node, rule, hint)


class _Place(NamedTuple):
    """The instance of a copy, the axes (3, 3) of its part as columns, and something in it."""

    instance: int
    Q: Array
    part: str
    index: int
    end: int


class BodyPlaces:
    """What pulls at bodies that bend, for one design: all parts, the values, and the elements of all members."""

    def __init__(
        self, parts: Mapping[str, Part], members: Members, geometry: Geometry, values: Array, elements: Elements
    ) -> None:
        self._parts, self._members, self._elements = parts, members, elements
        self._values, self._geometry, self._topology = values, geometry, geometry.topology
        first = np.cumsum([0, *(len(part.members) for part in parts.values())]).tolist()
        self._first: dict[str, int] = dict(zip(parts, first, strict=False))
        self._ends: dict[int, list[_Place]] = {}
        self._rings: dict[int, tuple[Array, float]] = {}
        self._solids: dict[int, list[tuple[int, _Place, BodyElement]]] = {}
        root = self._topology.root
        for name, copies in self._topology.copies.items():
            part = parts[name]
            for number, offset in zip(copies.number, copies.offset, strict=True):
                Q = self._geometry.Q[number]
                for m, both in enumerate(part.ends.tolist()):
                    for end, node in enumerate(both):
                        self._ends.setdefault(int(root[offset + node]), []).append(_Place(number, Q, name, m, end))
                for diaphragm in part.diaphragms.values():
                    plate, axes = diaphragm.plate(values), Q @ diaphragm.axes(values).T[:, [2, 0, 1]]
                    for node, radius in zip(diaphragm.nodes, (plate.rim, plate.hub), strict=True):
                        self._rings[int(root[offset + node])] = axes, float(radius)
                for key, (node, body) in part.bodies.items():
                    if not body.has_form:
                        continue
                    for on in part.elastic[key].carried if key in part.elastic else [node, *part.carried[node]]:
                        place = _Place(number, Q, name, offset + node, 0)
                        self._solids.setdefault(int(root[offset + on]), []).append((offset + on, place, body))
        self._sizes = members.end_sizes(values, geometry.lengths)
        self._area = self._sizes[0] * self._sizes[1]

    def settle(self, name: str, body: ElasticBody) -> bool:
        """Place what pulls at a body of a prototype, as at its first copy. Whether what it gives changes a number by
        more than MATTERS at most, or another body sits on it; no for one that is too slender for polynomials."""
        topology = self._topology
        copies = topology.copies[name]
        number, offset = copies.number[0], copies.offset[0]
        own = _PlacedBody(
            body.body, self._values, self._geometry.Q[number], self._geometry.positions[offset + body.nodes[0]]
        )
        rows = [self._pull(own, offset + node) for node in body.carried]
        at = np.array([own.turn @ (self._geometry.positions[offset + node] - own.centre) for node in body.carried])
        at = at + np.array([row[3] for row in rows]) @ (own.turn @ own.Q).T
        away = np.linalg.norm(at - inside(at, own.half, own.body.is_round), axis=1)
        if away.max() > AWAY * 2 * own.half.max():
            node = self._parts[name].node_names[body.carried[int(away.argmax())]].removesuffix("[seat]")
            reason = f"it carries {node}, which is {1e3 * away.max():.3g} mm from its solid"
            if body.body.elastic is True:
                raise ModelError([cannot_bend(name, body_name(self._parts[name], body), reason, TOUCH)])
            return False
        try:
            nodes = self._geometry.parts[name].positions[body.nodes]
            pulls = Pulls(*(np.array(column) for column in zip(*rows, strict=True)))
            body.place(self._values, pulls, nodes, self._sizes)
        except OffSolidError as error:
            node = self._parts[name].node_names[body.carried[error.carried]].removesuffix("[seat]")
            raise ModelError([_off_solid(name, body_name(self._parts[name], body), node)]) from None
        except SolverError:
            if body.body.elastic is True:
                raise
            return False
        return bool(body.pulls.is_seat.any()) or self._gives(name, body) > MATTERS

    def _pull(self, own: _PlacedBody, node: int) -> tuple[int, int, Array, Array, bool, Array, bool]:
        """One row of `Pulls`."""
        root, positions = int(self._topology.root[node]), self._geometry.positions
        first = self._first
        if members := self._ends.get(root):
            at = max(members, key=lambda place: self._area[first[place.part] + place.index, place.end])
            geometry = self._geometry.parts[at.part]
            axes = own.turn @ at.Q @ geometry.R[at.index].T
            axes = axes * np.array([2.0 * at.end - 1.0, 1.0, 1.0])
            member = first[at.part] + at.index
            offset = own.Q.T @ at.Q @ geometry.offsets[at.index, at.end]
            is_rod = bool(self._members.is_round[member])
            if is_rod:  # which of its axes is which says nothing
                axes = member_frame(axes[:, 0], np.eye(3)[int(np.abs(axes[:, 0]).argmin())]).T
            return member, at.end, axes, offset, is_rod, np.zeros(2), False
        at, bare = own.turn @ (positions[node] - own.centre), np.full(3, BARE * own.half.min())
        if root in self._rings:
            axes, radius = self._rings[root]
            return -1, 0, own.turn @ axes, np.zeros(3), False, np.full(2, SQUARED * radius), True
        is_seat = False
        for _, place, other in self._solids.get(root, []):
            if other is own.body:
                continue
            rows, half = other.box(self._values)
            reach = np.abs(own.turn @ place.Q @ rows.T) @ half
            centre = positions[place.index] + place.Q @ other.middle(self._values)
            middle = own.turn @ (centre - own.centre)
            low, high = np.maximum(middle - reach, -own.half), np.minimum(middle + reach, own.half)
            at, bare, is_seat = (low + high) / 2, np.maximum((high - low) / 2, 0.0), True
            break
        axis, sign = own.face(at)
        others = [k for k in range(3) if k != axis]
        axes = np.zeros((3, 3))
        axes[axis, 0], axes[others[0], 1], axes[others[1], 2] = -sign, 1.0, 1.0
        offset = own.Q.T @ (own.turn.T @ at + own.centre - positions[node])
        return -1, 0, axes, offset, False, bare[others], is_seat

    def hold(self, name: str, body: ElasticBody) -> tuple[bool, Hold | None]:
        """Whether it is known how a body of a prototype is held, and how: at the face that is described, or at one on
        which nodes lie that it carries and that are clamped.

        Nothing says at which face where its own node, or one within it, is clamped or joined to another body.
        """
        topology, part = self._topology, self._parts[name]
        offset = topology.copies[name].offset
        root = topology.root[[k + body.own for k in offset]]
        bodies = [k + node for own, copies in topology.copies.items() for k in copies.offset
                  for node, _ in self._parts[own].bodies.values()]  # fmt: skip
        if (
            topology.held[root].any()
            or (np.bincount(topology.root[bodies], minlength=topology.n_nodes)[root] > 1).any()
        ):
            return False, None
        clamped = [n for n in body.carried if topology.held[topology.root[[k + n for k in offset]]].all(axis=1).any()]
        if not clamped:
            return True, body.hold
        own = _PlacedBody(body.body, self._values, np.eye(3), self._geometry.parts[name].positions[body.own])
        at = own.turn @ (self._geometry.parts[name].positions[clamped] - own.centre).T / own.half[:, None]
        on = {(k, side) for k in range(1 if body.body.is_round else 3) for side in (-1, 1)
              if (np.abs(side * at[k] - 1) < SAME_PLACE).all()}  # fmt: skip
        names = tuple(part.node_names[n] for n in clamped)
        if len(on) != 1 or len(offset) > 1 or (body.hold and body.hold.face not in on):
            return False, None
        return True, Hold(on.pop(), names)

    def _gives(self, name: str, body: ElasticBody) -> float:
        """Flexibility of a body over that of the members on it, at most (theory eq. O5)."""
        geometry, values = self._geometry.parts[name], self._values
        patches = body.patches(values, geometry.positions[body.nodes], self._sizes)
        C = patch_flexibility(body.modal(values), patches)
        k = np.zeros_like(C)
        for p, (member, end) in enumerate(zip(body.pulls.member.tolist(), body.pulls.end.tolist(), strict=True)):
            if member >= 0:
                axes = body.pulls.axes[p] * np.array([2.0 * end - 1.0, 1.0, 1.0])
                six = slice(6 * p, 6 * p + 6)
                turn = block_rotation(axes)
                k[six, six] = turn @ self._held_at_the_other_end(member, end) @ turn.T
        return float(np.abs(la.eigvals(C @ k)).max(initial=0.0))

    def _held_at_the_other_end(self, member: int, end: int) -> Array:
        """Stiffness (6, 6) of a member at an end, its own axes."""
        first, elements = self._members.first, self._elements
        own = slice(int(first[member]), int(first[member + 1]))
        C = elements.C[own]
        step = float(self._geometry.lengths[member]) / len(C)
        arms = np.zeros((len(C), 3))
        arms[:, 0] = step * np.arange(len(C) - 1, -1, -1)
        D = rigid_arm(arms)
        k = np.linalg.inv((D @ C @ np.swapaxes(D, -1, -2)).sum(axis=0))
        whole = rigid_arm(np.array([step * len(C), 0.0, 0.0]))
        return k if end else whole.T @ k @ whole


class _PlacedBody:
    """A body as placed: its element, the axes (3, 3) of its part as columns, the middle (3,), m, of the box around it,
    what turns global axes into its own (3, 3), and half sizes (3,), m."""

    def __init__(self, body: BodyElement, values: Array, Q: Array, node: Array) -> None:
        self.body, self.Q, self.centre = body, Q, node + Q @ body.middle(values)
        rows, self.half = body.box(values)
        self.turn: Array = rows @ Q.T
        self._middle: Array = rows @ body.middle(values)

    def face(self, at: Array) -> tuple[int, int]:
        """Axis and side of the face that is next to a place (3,) from the middle of the box, own axes."""
        if self.body.mesh is not None:
            ways = BESIDE * self.half.min() * np.concatenate([np.eye(3), -np.eye(3)])
            out, back = (self.body.mesh.pieces.beyond(at + self._middle + sign * ways) for sign in (1, -1))
            if ((out > 0) & (back < 0)).any():
                k = int(((out > 0) & (back < 0)).argmax())
                return k % 3, 1 if k < 3 else -1
        axis = int((np.abs(inside(at[None], self.half, self.body.is_round)[0]) / self.half).argmax())
        return axis, 1 if at[axis] > 0 else -1
