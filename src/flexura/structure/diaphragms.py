"""Diaphragms as plates between rim and hub."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array
from flexura.beam import block_rotation, member_frame, rigid_arm, ring_plate, skew
from flexura.duals import zeros
from flexura.mechanism import Diaphragm, Mechanism
from flexura.structure.discrete_elements import Lumped, least_aligned, rigid_mass
from flexura.structure.values import ValueTable


class DiaphragmElement(Lumped):
    """Stiffness and mass of a diaphragm over the nodes of its rim and its hub (theory eqs. Z1-Z5)."""

    def __init__(self, table: ValueTable, diaphragm: Diaphragm, mechanism: Mechanism, nodes: list[int]) -> None:
        self.nodes = nodes
        material = mechanism.material(diaphragm.material)
        loss = material.loss_factor if diaphragm.loss_factor is None else diaphragm.loss_factor
        self.loss: int | None = None if loss is None else table.add(loss)
        self._sizes = table.entries((diaphragm.rim_diameter, diaphragm.hub_diameter, diaphragm.thickness))
        self._normal = table.entries(diaphragm.normal)
        self._reference = None if diaphragm.reference is None else table.entries(diaphragm.reference)
        self._E, self._rho = table.add(material.E), table.add(material.rho)
        self._nu = None if material.nu is None else table.add(material.nu)
        self._G = None if material.G is None else table.add(material.G)

    def plate(self, values: Array) -> ring_plate.RingPlate:
        """The plate of numbers (...)."""
        rim, hub, thickness = (values[..., k] for k in self._sizes)
        E = values[..., self._E]
        nu = E / (2 * values[..., self._G]) - 1 if self._nu is None else values[..., self._nu]
        return ring_plate.RingPlate(rim / 2, hub / 2, thickness, E, nu, values[..., self._rho])

    def axes(self, values: Array) -> Array:
        """Its axes (..., 3, 3) as rows, part's axes: the reference, or another direction, and last the normal."""
        normal = values[..., None, self._normal]
        given = least_aligned(normal) if self._reference is None else values[..., None, self._reference]
        return member_frame(normal, given)[..., 0, [2, 1, 0], :] * np.array([[1.0], [-1.0], [1.0]])

    def to_centre(self, values: Array, positions: Array) -> Array:
        """T (..., 12, 12) from displacements of the nodes at `positions` (..., 2, 3), part's axes, to those of rim and
        hub at the centre, its own axes."""
        X = block_rotation(self.axes(values))
        rim = X @ rigid_arm(positions[..., 1, :] - positions[..., 0, :])
        T = zeros((*rim.shape[:-2], 12, 12), rim)
        T[..., :6, :6], T[..., 6:, 6:] = rim, X
        return T

    def matrices(self, values: Array, positions: Array) -> tuple[Array, Array]:
        """K and M (..., 12, 12), part's axes."""
        T = self.to_centre(values, positions)
        B, plate, Tt = _seen(T), self.plate(values), np.swapaxes(T, -1, -2)
        k = ring_plate.stiffnesses(plate)
        return np.swapaxes(B, -1, -2) @ (k[..., :, None] * B), Tt @ ring_plate.mass(plate) @ T

    def geometric(self, values: Array, positions: Array, ends: Array) -> Array:
        """Geometric stiffness (c, 12, 12), part's axes, in displacements (c, 12) of its nodes (theory eq. Z8): of
        membrane forces on bending, and of a force and a moment that turn with rim and hub, bent as little as buckling
        is taken to begin with. One design."""
        T, plate = self.to_centre(values, positions), self.plate(values)
        d, shift = ends @ _seen(T).T, ring_plate.membrane(plate).shift
        n = d * ring_plate.stiffnesses(plate)
        stretched = zeros((len(ends), 6, 6), d)
        stretched[:, 2, 4] = stretched[:, 4, 2] = shift * d[:, 0]
        stretched[:, 2, 3] = stretched[:, 3, 2] = -shift * d[:, 1]
        turned = zeros((len(ends), 12, 12), d)
        force, moment = skew(n[:, :3]) / 2, skew(n[:, 3:]) / 2
        for end in (3, 9):
            turned[:, end : end + 3, :3], turned[:, end : end + 3, 6:9] = -force, force
        turned[:, 3:6, 9:] = moment
        difference = np.concatenate([-np.eye(6), np.eye(6)], axis=1)
        K = difference.T @ stretched @ difference + turned + np.swapaxes(turned, -1, -2)
        return T.T @ K @ T

    def resisted(self, values: Array, positions: Array) -> tuple[Array, Array]:
        """The displacement of the hub seen from the rim."""
        k = ring_plate.stiffnesses(self.plate(values))
        return k[..., None] * np.eye(6), _seen(self.to_centre(values, positions))

    def described_mass(self, values: Array, positions: Array) -> Array:
        """Rigid-body mass matrix (6, 6) about the part's origin, from density and size alone."""
        mass, inertia = ring_plate.described_mass(self.plate(values))
        R, D = self.axes(values), rigid_arm(positions[1])
        return D.T @ rigid_mass(mass, R.T @ (inertia[:, None] * R)) @ D


def _seen(T: Array) -> Array:
    """Displacements (..., 6, 12) of the hub seen from the rim, from those of both (..., 12, 12)."""
    return T[..., 6:, :] - T[..., :6, :]
