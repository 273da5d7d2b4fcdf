"""Which motion of the model each channel of a test reads: by node, by position, or by name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.derivatives import Reading
from flexura.errors import FlexuraError, OptionError
from flexura.fem import body_solids
from flexura.results import Tabular
from flexura.structure import DERIVATIVE, FullOrderModel, Pieces, Ports
from flexura.tables import Item, Table, quantity
from flexura.testing.measurement import FORCES, MeasuredChannel
from flexura.testing.rig.test_points import TestPoint, TestPoints

WITHIN_OF_SIZE = 0.02
"""Farthest a sensor may be from what it is taken to sit on, relative to the longest side of the mechanism."""

WITHIN_OF_POINT = 1e-3
"""Farthest a sensor may be from what it is taken to sit on, m, in a mechanism of a single point."""

UNITS_OF_LENGTH = {"mm": 1e-3, "cm": 1e-2, "inches": 0.0254}
"""Units in which positions may have been written in place of metres."""

TURNS = ("rotation", "angular_velocity", "angular_acceleration", "moment")


@dataclass(frozen=True)
class ChannelMatch:
    """A channel and the node of the model that it is taken to read.

    `how` is node, test (a hammer point or accelerometer of the described test), position, body (a point of a rigid
    body) or name. `distance`, m, is from the channel's position to the node, point or body; None where the channel has
    no position.
    """

    channel: MeasuredChannel
    node: str
    how: str
    distance: float | None


@dataclass(frozen=True)
class UnmatchedChannel:
    """A channel that reads nothing of the model, why, and the nearest node with its distance, m, where known."""

    channel: MeasuredChannel
    reason: str
    nearest: str | None = None
    distance: float | None = None


@dataclass(frozen=True, repr=False)
class ChannelPairing(Tabular):
    """Channels of a test among the DOFs of a model.

    `rows` (q, n) give what the matched channels read, displacement or rotation, from a full-order DOF vector; `at` (q,)
    are their positions among all channels and `turns` (q,) tells those that read rotations. Sensors sit at `positions`
    (q, 3), m, and look along `directions` (q, 3); both are nan where a sensor of the description reads between nodes.
    """

    _shown = ("matched", "unmatched")
    _told = ("matched", "unmatched", "at", "turns", "positions", "directions")

    matched: tuple[ChannelMatch, ...]
    unmatched: tuple[UnmatchedChannel, ...]
    at: Index
    rows: Array
    turns: NDArray[np.bool_]
    positions: Array
    directions: Array
    notes: tuple[str, ...] = ()

    def _title(self) -> str:
        return f"{len(self.matched)} of {len(self.matched) + len(self.unmatched)} channels found in the model"

    def presentation(self) -> Iterator[Item]:
        yield from super().presentation()
        lost = self.unmatched
        columns = {"channel without a counterpart": [u.channel.name for u in lost], "why": [u.reason for u in lost]}
        yield Table({**columns, "nearest": [u.nearest for u in lost]}, "channels")

    def _columns(self) -> dict[str, Any]:
        """The matched channels."""
        return {
            "channel": [m.channel.name for m in self.matched],
            "node": [m.node for m in self.matched],
            "how": [m.how for m in self.matched],
            "distance [m]": [m.distance for m in self.matched],
        }


@dataclass(frozen=True)
class _Place:
    """Where a channel sits: a node, the point `x` (3,) that it reads and its direction; or a described sensor's row."""

    match: ChannelMatch
    number: int
    x: Array
    direction: Array
    row: Array | None = None

    @property
    def turns(self) -> bool:
        """Whether it reads a rotation."""
        return self.match.channel.quantity in TURNS


@verb
def pair_channels(
    model: FullOrderModel, channels: Sequence[MeasuredChannel], *, within: float | None = None
) -> ChannelPairing:
    """Find what each channel of a test reads in the model (theory eqs. Q1-Q2).

    A channel with a direction is matched by the name of its node, or by its position: with the nearest node or point of
    the described test, or a rigid body with a solid that contains it, `within` that distance, m (2 % of the longest
    side of the mechanism when left out). It reads the point where it sits, on a rigid arm from that node. Other
    channels go by their name: that of a hammer point or accelerometer of the test, of a described sensor or actuator,
    or of a DOF such as `platform.tz`. A channel without a counterpart is reported with the nearest node; a position
    that is in other units, or in another frame, shows there. Raises OptionError for a distance that is not positive and
    for a position that is not finite.
    """
    points = _ModelPoints(model, within)
    matches = [points.find(channel) for channel in channels]
    places = {k: place for k, place in enumerate(matches) if isinstance(place, _Place)}
    unmatched = [match for match in matches if isinstance(match, UnmatchedChannel)]
    rows = _rows(model, list(places.values()))
    moves: NDArray[np.bool_] = np.asarray(rows.any(axis=1), dtype=np.bool_)
    held = [place.match for place, move in zip(places.values(), moves, strict=True) if not move]
    unmatched += [UnmatchedChannel(m.channel, "the model holds what it reads", m.node, m.distance) for m in held]
    moving = [place for place, move in zip(places.values(), moves, strict=True) if move]
    return ChannelPairing(
        tuple(place.match for place in moving),
        tuple(unmatched),
        np.array(list(places), dtype=np.intp)[moves],
        rows[moves],
        np.array([place.turns for place in moving], dtype=bool),
        np.array([place.x for place in moving]).reshape(-1, 3),
        np.array([place.direction for place in moving]).reshape(-1, 3),
        tuple(points.hints(unmatched)),
    )


def nothing_matched(name: str, sensors: ChannelPairing) -> str:
    """Why no channel is found in the model."""
    shown = "; ".join(
        f"{u.channel.name}: {u.reason}"
        + (f" (nearest {u.nearest}, {quantity(u.distance, 'm', 3)} away)" if u.distance is not None else "")
        for u in sensors.unmatched[:3]
    )
    hint = "".join(f"; {note}" for note in sensors.notes)
    return f"{name}: none of {len(sensors.unmatched)} channels is found in the model: {shown}{hint}"


def _rows(model: FullOrderModel, places: Sequence[_Place]) -> Array:
    """What channels read of the DOFs (q, n): d . (u + theta x arm), or d . theta."""
    rows = np.zeros((len(places), model.plan.topology.n_dof))
    for row, place in zip(rows, places, strict=True):
        if place.row is not None:
            row[:] = place.row
    at_nodes = [k for k, place in enumerate(places) if place.row is None]
    if at_nodes:
        numbers = np.array([places[k].number for k in at_nodes], dtype=np.intp)
        x, d = (np.array([getattr(places[k], name) for k in at_nodes]) for name in ("x", "direction"))
        turns = np.array([places[k].turns for k in at_nodes])[:, None]
        about = np.where(turns, d, np.cross(x - model.geometry.positions[numbers], d))
        of_node = np.concatenate([np.where(turns, 0.0, d), about], axis=1)
        node_rows = np.asarray(model.design.node_rows(numbers).toarray()).reshape(len(at_nodes), 6, -1)
        rows[at_nodes] = np.einsum("qi,qin->qn", of_node, node_rows)
    return rows


class _ModelPoints:
    """The nodes, bodies and described channels of one model."""

    def __init__(self, model: FullOrderModel, within: float | None) -> None:
        self.model, self.topology = model, model.plan.topology
        self.names = self.topology.node_names
        self.placed = np.flatnonzero(self.topology.has_position)
        self.x = model.geometry.positions[self.placed]
        size = float(np.ptp(self.x, axis=0).max(initial=0.0))
        self.within = (WITHIN_OF_SIZE * size or WITHIN_OF_POINT) if within is None else float(within)
        if not self.within > 0:
            raise OptionError(f"within is a positive length in m, not {self.within:g}")
        self.described = Ports(model.design)
        self.bodies = list(_solid_bodies(model))
        described = None if model.plan.mechanism.test is None else TestPoints(model.design)
        self.hammer = {} if described is None else described.hammer
        self.accelerometers = {} if described is None else described.accelerometers
        self.points = [*self.hammer.values(), *self.accelerometers.values()]

    def find(self, channel: MeasuredChannel) -> _Place | UnmatchedChannel:
        """The place of a channel, or why there is none."""
        x = None if channel.position is None else np.array(channel.position, dtype=float)
        if x is not None and not np.isfinite(x).all():
            raise OptionError(f"channel {channel.name}: its position {channel.position} is not finite")
        if channel.direction is not None:
            d = np.array(channel.direction, dtype=float)
            if not (np.isfinite(d).all() and d.any()):
                raise OptionError(f"channel {channel.name}: its direction {channel.direction} is not one")
            d /= np.linalg.norm(d)
            by_node = self._by_node(channel, x, d)
            if by_node is not None:
                return by_node
            if x is not None:
                return self._by_position(channel, x, d)
        return self._by_test(channel, x) or self._by_name(channel)

    def _by_node(self, channel: MeasuredChannel, x: Array | None, d: Array) -> _Place | UnmatchedChannel | None:
        if channel.node is None:
            return None
        try:
            number = int(self.topology.numbers([channel.node])[0])
        except OptionError:
            return None
        at = self.model.geometry.positions[number]
        if x is None:
            return _Place(ChannelMatch(channel, channel.node, "node", None), number, at, d)
        distance = float(np.linalg.norm(x - at))
        root = self.topology.root
        distance = min([distance, *(_gap(p, x) for p in self.points if root[p.number] == root[number])])
        if self.topology.is_rigid[number]:
            distance = min([distance, *(b.distance(x) for b in self.bodies if b.root == root[number])])
        if distance > self.within:
            reason = f"node {channel.node} is not where the channel is declared"
            return UnmatchedChannel(channel, reason, channel.node, distance)
        return _Place(ChannelMatch(channel, channel.node, "node", distance), number, x, d)

    def _by_position(self, channel: MeasuredChannel, x: Array, d: Array) -> _Place | UnmatchedChannel:
        distances = np.linalg.norm(self.x - x, axis=1)
        nearest = int(np.argmin(distances))
        number, distance, how = int(self.placed[nearest]), float(distances[nearest]), "position"
        for point in self.points:
            if (gap := _gap(point, x)) < distance:
                number, distance, how = point.number, gap, "test"
        for body in self.bodies:
            if (gap := body.distance(x)) < distance:
                number, distance, how = body.number, gap, "body"
        if distance > self.within:
            reason = f"nothing of the model is within {quantity(self.within, 'm', 3)} of it"
            return UnmatchedChannel(channel, reason, self.names[number], distance)
        return _Place(ChannelMatch(channel, self.names[number], how, distance), number, x, d)

    def _by_test(self, channel: MeasuredChannel, x: Array | None) -> _Place | None:
        """A channel that lacks its place or its direction, and has the name of a point of the described test."""
        point = (self.hammer if channel.quantity == "force" else self.accelerometers).get(channel.name)
        if point is None or channel.quantity in TURNS or (x is not None and _gap(point, x) > self.within):
            return None
        at = np.array(point.channel.position if x is None else x, dtype=float)
        d = np.array(point.channel.direction if channel.direction is None else channel.direction, dtype=float)
        match = ChannelMatch(channel, self.names[point.number], "test", None if x is None else _gap(point, x))
        return _Place(match, point.number, at, d / np.linalg.norm(d))

    def _by_name(self, channel: MeasuredChannel) -> _Place | UnmatchedChannel:
        """A channel with the name of a described sensor or actuator, or of a DOF."""
        is_input, name = channel.quantity in FORCES, channel.name
        try:
            port = (self.described.inputs([name]) if is_input else self.described.outputs([name]))[0]
        except FlexuraError:
            lacking = "direction" if channel.direction is None else "position, or node of the model"
            what = "actuator" if is_input else "sensor"
            return UnmatchedChannel(channel, f"it has no {lacking}, and no {what} or DOF has its name")
        described = port.channel
        if is_input and described.quantity not in FORCES:
            return UnmatchedChannel(channel, f"{name} is no force or moment in the model")
        if not is_input and described.quantity not in DERIVATIVE:
            return UnmatchedChannel(channel, f"{name} reads no motion in the model")
        if (described.quantity in TURNS) != (channel.quantity in TURNS):
            return UnmatchedChannel(channel, f"it is a {channel.quantity}, and {name} of the model is not")
        if described.node is None or described.against is not None:
            nowhere = np.full(3, np.nan)
            return _Place(ChannelMatch(channel, name, "name", None), -1, nowhere, nowhere, port.row)
        number = int(self.topology.numbers([described.node])[0])
        match = ChannelMatch(channel, described.node, "name", None)
        return _Place(match, number, self.model.geometry.positions[number], np.array(described.direction), port.row)

    def hints(self, unmatched: Sequence[UnmatchedChannel]) -> list[str]:
        """What may be wrong with all positions together."""
        far = [u.channel.position for u in unmatched if u.channel.position is not None and u.distance is not None]
        if not far:
            return []
        x = np.array(far, dtype=float)
        for unit, factor in UNITS_OF_LENGTH.items():
            gaps = np.linalg.norm(self.x[None] - factor * x[:, None], axis=2).min(axis=1)
            gaps = np.minimum(gaps, [min((b.distance(factor * p) for b in self.bodies), default=np.inf) for p in x])
            if (gaps <= self.within).all():
                return [f"the positions without a counterpart fit the model when read as {unit}: they are given in m"]
        return []


def _gap(point: TestPoint, x: Array) -> float:
    """Distance, m, of a position from a point of the test."""
    return float(np.linalg.norm(np.asarray(point.channel.position) - x))


@dataclass(frozen=True)
class _SolidBody:
    """A placed rigid body with a solid: its node, the root that it follows, and its pieces in the global frame."""

    number: int
    root: int
    pieces: Pieces

    def distance(self, x: Array) -> float:
        """Distance, m, of a point from the solid, zero inside; of a composite from what is added."""
        return float(np.linalg.norm(self.pieces.nearest(x[None])[0] - x))


def _solid_bodies(model: FullOrderModel) -> Iterator[_SolidBody]:
    """Every placed rigid body that has a solid."""
    topology = model.plan.topology
    for body in body_solids(model):
        one = (body.centre[None], body.axes[None], body.half[None], np.array([body.is_round]), 1)
        yield _SolidBody(body.node, int(topology.root[body.node]), body.pieces or Pieces(*one))


def readings_of(model: FullOrderModel, channels: Sequence[MeasuredChannel]) -> list[Reading]:
    """Where channels sit on a mechanism: sensors stay where they are on their node while sizes change.

    Raises OptionError for channels that have no counterpart in the model.
    """
    pairing = pair_channels(model, channels)
    if pairing.unmatched:
        lost = "; ".join(f"{u.channel.name}: {u.reason}" for u in pairing.unmatched[:3])
        more = len(pairing.unmatched) - 3
        raise OptionError(lost + (f"; and {more} more" if more > 0 else ""))
    readings = []
    for k, match in enumerate(pairing.matched):
        if np.isfinite(pairing.positions[k]).all():
            at = model.geometry.positions[model.plan.topology.numbers([match.node])[0]]
            arm = pairing.positions[k] - at
            readings.append(Reading(match.node, pairing.directions[k], bool(pairing.turns[k]), arm))
        else:
            readings.append(Reading(match.node, np.zeros(3), False, np.zeros(3), pairing.rows[k]))
    return readings
