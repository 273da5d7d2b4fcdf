"""How diaphragms bend in a motion, and from which frequency on they vibrate by themselves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from flexura.analysis.strain.energy import placed_motions
from flexura.arrays import Array
from flexura.beam import ring_plate
from flexura.errors import Diagnostic
from flexura.structure import FullOrderModel, described_prestress
from flexura.tables import in_hz

BENT = 0.07
"""Deflection over thickness from which loads make a diaphragm stiffer by 1 %."""

NEAR_LOWEST = 0.5
"""Frequency over the lowest one of a diaphragm by itself from which that is told."""


class BentPlate(NamedTuple):
    """A diaphragm as placed and as described, its plate, and the motion (6, k) of the hub seen from the rim, own axes,
    with the normal last."""

    name: str
    place: str
    plate: ring_plate.RingPlate
    motion: Array

    @property
    def deflection(self) -> Array:
        """Deflection (3, k) of the hub over the thickness: along the normal, and by tilts at the lever of the plate."""
        lever = np.array([[1.0], [self.plate.lever], [self.plate.lever]])
        return lever * self.motion[2:5] / self.plate.thickness

    @property
    def stiffening(self) -> float:
        """Relative increase of the axial force by membrane forces, per square of the deflection over the thickness."""
        plate = self.plate
        return float(2 * ring_plate.membrane(plate).axial * plate.thickness**2 / ring_plate.stiffnesses(plate)[2])


def bent_plates(model: FullOrderModel, displacements: Array) -> Iterator[BentPlate]:
    """All placed diaphragms in motions (n_nodes, 6, k) of all nodes, global frame, m and rad."""
    for name, part in model.plan.parts.items():
        if not part.diaphragms:
            continue
        x = model.geometry.parts[name].positions
        for path, u in placed_motions(model, displacements, name):
            for key, diaphragm in part.diaphragms.items():
                _, B = diaphragm.resisted(model.values, x[diaphragm.nodes])
                motion = B @ u[diaphragm.nodes].reshape(12, -1)
                place = ".".join(filter(None, (name, key)))
                yield BentPlate(".".join((*path, key)), place, diaphragm.plate(model.values), motion)


def plate_warnings(model: FullOrderModel, hz: float) -> tuple[Diagnostic, ...]:
    """Warnings of the diaphragms that vibrate by themselves below twice a frequency, Hz, for the model moves them in
    their static shapes alone, and of those that the loads described stiffen by 1 % or more."""
    found: dict[tuple[str, str], Diagnostic] = {}
    u = np.zeros((model.plan.topology.n_nodes, 6, 1))
    if model.plan.is_loaded and any(part.diaphragms for part in model.plan.parts.values()):
        u = model.node_displacements(described_prestress(model.design).displacement[:, None])
    for bent in bent_plates(model, u):
        own, deflection = float(bent.plate.lowest_hz), float(np.linalg.norm(bent.deflection))
        if hz > NEAR_LOWEST * own:
            text = (
                f"diaphragm {bent.place}: it vibrates by itself from about {in_hz(own, 3)} on, which the model does not"
                f" have; frequencies from half of that on are without it, up to {in_hz(hz, 4)} here"
            )
            found["own", bent.place] = Diagnostic("resonance", bent.place, hz, NEAR_LOWEST * own, "Hz", text)
        if deflection > BENT:
            stiffer = 3 * bent.stiffening * deflection**2
            text = (
                f"diaphragm {bent.name}: loads bend it by {deflection:.3g} times its thickness, which makes it about"
                f" {100 * stiffer:.2g} % stiffer along its normal; what is linear here lacks that, a pose has it"
            )
            found["bent", bent.name] = Diagnostic("stiffness", bent.name, deflection, BENT, "1", text)
    return tuple(found.values())
