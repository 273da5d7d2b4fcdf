"""Actuators and sensors as arrows and marks that move with their nodes; piezo stacks are solids and drawn elsewhere."""

from __future__ import annotations

import numpy as np

from flexura.mechanism import TOP, BaseMotion, BaseRotation, ForceSensor, MomentActuator, PiezoStack
from flexura.structure import Copies, FullOrderModel
from flexura.view.meshes import Array, Mesh, cone, frame_along, sphere
from flexura.view.motions import Motions
from flexura.view.scene import Collector, Kind, Look

LENGTH, WIDTH, BALL = 0.13, 0.011, 0.014
"""Length and half width of an arrow, and radius of a sensor, relative to the mechanism."""


def add_channels(collector: Collector, model: FullOrderModel, motions: Motions, look: Look) -> None:
    """Add described actuators and sensors, each where it is and along its positive direction."""
    size = collector.size
    for placed in model.plan.topology.copies.values():
        channels = placed.part.channels
        for copy in look.chosen(len(placed.paths)) if channels.nodes else ():
            prefix = "".join(f"{step}." for step in placed.paths[copy])
            for key, actuator in channels.actuators.items():
                if not isinstance(actuator, PiezoStack):
                    own = _Placed(model, motions, placed, int(copy), ("actuator", key))
                    turns = isinstance(actuator, MomentActuator | BaseRotation)
                    own.add_arrow(collector, prefix + key, size, turns)
            for key, sensor in channels.sensors.items():
                source = ("actuator", sensor.actuator) if isinstance(sensor, ForceSensor) else ("sensor", key)
                _Placed(model, motions, placed, int(copy), source).add_mark(collector, prefix + key, size)


class _Placed:
    """An actuator or a sensor of one copy of a part: nodes, and its direction (3,), global frame; None where it has
    none."""

    def __init__(
        self, model: FullOrderModel, motions: Motions, placed: Copies, copy: int, own: tuple[str, str]
    ) -> None:
        channels, geometry = placed.part.channels, model.geometry
        number = placed.number[copy]
        described = (channels.actuators if own[0] == "actuator" else channels.sensors)[own[1]]
        self.nodes = [placed.offset[copy] + node for node in channels.nodes[own]]
        if isinstance(described, BaseMotion | BaseRotation):
            self.nodes = _held(model)
        self.x, self.motions = geometry.positions, motions
        along = channels.number(*own, "direction", model.values)
        if along is not None:
            axial = isinstance(described, MomentActuator | BaseRotation)
            along = geometry.Q[number] @ along * (round(float(np.linalg.det(geometry.Q[number]))) if axial else 1)
        elif len(self.nodes) == 2:
            along = self.x[self.nodes[1]] - self.x[self.nodes[0]]
        length = 0.0 if along is None else float(np.linalg.norm(along))
        self.direction = along / length if along is not None and length > 0 else None

    def add_arrow(self, collector: Collector, name: str, size: float, turns: bool) -> None:
        """An arrow from the node, or from the second of two, and one the other way at the first."""
        if self.direction is None or not self.nodes:
            return
        senses = (-1.0, 1.0) if len(self.nodes) == 2 else (1.0,)
        for node, sense in zip(self.nodes, senses, strict=True):
            way = sense * self.direction
            points, tip, heading = _ring(way, size) if turns else _shaft(way, size)
            self._path(collector, name, node, points)
            head = cone(WIDTH * size, 3 * WIDTH * size, -heading, sides=8)
            self._mesh(collector, name, node, Mesh(head.points + tip, head.faces), Kind.ACTUATOR)

    def add_mark(self, collector: Collector, name: str, size: float) -> None:
        """A small ball at each node, with a line along what is read."""
        for node in self.nodes:
            self._mesh(collector, name, node, sphere(BALL * size, 8), Kind.SENSOR)
        if self.direction is not None and self.nodes:
            reach = np.outer([0.0, 4 * BALL * size], self.direction)
            self._path(collector, name, self.nodes[-1], reach, Kind.SENSOR)

    def _path(self, collector: Collector, name: str, node: int, points: Array, kind: Kind = Kind.ACTUATOR) -> None:
        collector.path(self.x[node] + points, self.motions.of(node).carried(points), kind, name)

    def _mesh(self, collector: Collector, name: str, node: int, mesh: Mesh, kind: Kind) -> None:
        moved = self.motions.of(node).carried(mesh.points)
        collector.mesh(Mesh(self.x[node] + mesh.points, mesh.faces), moved, kind, name)


def _shaft(way: Array, size: float) -> tuple[Array, Array, Array]:
    """A straight arrow from a node: points (2, 3), where its tip is, and where it points."""
    return np.outer([0.0, LENGTH * size], way), (LENGTH + 3 * WIDTH) * size * way, way


def _ring(way: Array, size: float) -> tuple[Array, Array, Array]:
    """Three quarters of a circle about an axis, right-handed: points (k, 3), where the tip is, and where it points."""
    _, first, second = frame_along(way)
    angle = np.linspace(0.0, 1.5 * np.pi, 25)
    points = LENGTH / 2 * size * (np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second))
    return points, points[-1] + 3 * WIDTH * size * first, first


def _held(model: FullOrderModel) -> list[int]:
    """The first node that is held, which moves with the base."""
    topology = model.plan.topology
    names = model.plan.layout.exposed(TOP)
    held = [k for k in (topology.node((), name) for name in names) if topology.held[topology.root[k]].any()]
    return held[:1]
