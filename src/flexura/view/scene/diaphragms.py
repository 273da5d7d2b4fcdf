"""Diaphragms as rings, and sheets by the surface of their mesh, that bend with their nodes."""

from __future__ import annotations

import numpy as np

from flexura.beam import ring_plate
from flexura.fem import surface_of
from flexura.structure import FullOrderModel
from flexura.view.scene.meshes import Array, Mesh, loft_faces
from flexura.view.scene.scene import Collector, Kind, Motions

FINE, COARSE = (9, 48), (3, 24)
"""Points of a ring from hub to rim and around."""

FEW_FACES = 1000
"""Faces of all members below which rings are drawn coarsely."""


def add_diaphragms(collector: Collector, model: FullOrderModel) -> None:
    """Add all diaphragms, bent by the shapes of their stiffness."""
    counts = COARSE if collector.look.faces < FEW_FACES else FINE
    for name, part in model.plan.parts.items():
        placed = model.plan.topology.copies[name]
        for key, diaphragm in part.diaphragms.items():
            plate, axes = diaphragm.plate(model.values), diaphragm.axes(model.values)
            for copy in collector.look.chosen(len(placed.paths)):
                Q, nodes = model.geometry.Q[placed.number[copy]], placed.offset[copy] + np.array(diaphragm.nodes)
                label = ".".join((*placed.paths[copy], key))
                is_flagged = bool({label, f"{name}.{key}"} & collector.flagged)
                x = model.geometry.positions[nodes]
                mesh, motions = _ring(plate, Q @ axes.T, x, collector.motions.of(nodes), counts)
                collector.mesh(mesh, motions, Kind.FLAGGED if is_flagged else Kind.FLEXURE, label)


def add_surfaces(collector: Collector, model: FullOrderModel) -> None:
    """Add the superelements whose surface is known, sheets and parts, as they are bent by their own coordinates."""
    for name, part in model.plan.parts.items():
        placed, described = model.plan.topology.copies[name], model.plan.layout.prototypes[name].superelements
        for key, nodes in ((key, own.nodes) for key, own in part.superelements.items()):
            surface = surface_of(described[key])
            if surface is None:
                continue
            count = len(described[key].nodes)
            for copy in collector.look.chosen(len(placed.paths)):
                Q, t = model.geometry.Q[placed.number[copy]], model.geometry.t[placed.number[copy]]
                numbers = placed.offset[copy] + np.array(nodes)
                x, motions = model.geometry.positions[numbers[:count]], collector.motions.of(numbers)
                points, sign = surface.points @ Q.T + t, np.round(np.linalg.det(Q))
                first = motions.of(0)
                coordinates = []
                for k in range(len(nodes)):
                    own = motions.of(k)
                    turn = own.turn - first.turn * (k < count)
                    six = [own.shift, (turn - turn.T)[[2, 0, 1], [1, 2, 0]] / 2]
                    if k < count:
                        six = [Q.T @ (six[0] - first.carried(x[k] - x[0])), sign * Q.T @ six[1]]
                    coordinates += six
                q = np.concatenate(coordinates)[: surface.rows.shape[1]]
                moved = first.carried(points - x[0]) + (surface.rows @ q).reshape(-1, 3) @ Q.T
                facets = surface.facets[:, ::-1] if sign < 0 else surface.facets
                label = ".".join((*placed.paths[copy], key))
                collector.surface(Mesh(points, facets), moved, label)


def _ring(
    plate: ring_plate.RingPlate, axes: Array, x: Array, motions: Motions, counts: tuple[int, int]
) -> tuple[Mesh, Array]:
    """A ring, global frame, and the motions (v, 3) of its points, from those of rim and hub at x (2, 3); `axes` (3, 3)
    as columns."""
    radii, sides = counts
    at, angle = np.linspace(0, 1, radii), 2 * np.pi * np.arange(sides) / sides
    radius = plate.hub * (plate.rim / plate.hub) ** at
    loop = np.concatenate([np.arange(radii), np.arange(radii)[::-1]])
    height = np.repeat([0.5, -0.5], radii) * float(plate.thickness)
    local = np.empty((sides, 2 * radii, 3))
    local[..., 0], local[..., 1] = (np.outer(f(angle), radius[loop]) for f in (np.cos, np.sin))
    local[..., 2] = height
    points = local.reshape(-1, 3) @ axes.T + x[1]
    faces = loft_faces(sides, 2 * radii, cyclic=True)
    rim, hub = (motions.of(k) for k in (0, 1))
    turn = hub.turn - rim.turn
    apart = np.concatenate([hub.shift - rim.carried(x[1] - x[0]), (turn - turn.T)[[2, 0, 1], [1, 2, 0]] / 2])
    sign = np.round(np.linalg.det(axes))
    own = np.concatenate([axes.T @ apart[:3], sign * axes.T @ apart[3:]])
    bent = np.moveaxis(ring_plate.displacements(plate, at, angle, own), 0, 1)[:, loop].reshape(-1, 3)
    return Mesh(points, faces[:, ::-1] if sign < 0 else faces), rim.carried(points - x[0]) + bent @ axes.T
