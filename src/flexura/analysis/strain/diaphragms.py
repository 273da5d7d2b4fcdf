"""How diaphragms bend in a motion, and from which frequency on they vibrate by themselves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from flexura.analysis.strain.energy import placed_motions
from flexura.arrays import Array
from flexura.beam import rigid_arm, ring_plate
from flexura.errors import Diagnostic
from flexura.structure import FullOrderModel, described_prestress
from flexura.tables import in_hz

STIFFER = 0.01
"""By how much more stiffness along the normal than without its loads a diaphragm has to have to be told."""

NEAR_LOWEST = 0.5
"""Frequency over the lowest one of a diaphragm by itself from which that is told."""


class BentPlate(NamedTuple):
    """A diaphragm or a sheet as placed and as described: what it is called, and its `deflection` (3, k) over its
    thickness, along the normal and by tilts of the hub at the lever of the plate.

    `stiffening` is the relative increase of the axial force per square of it. Of plates in closed form also the `plate`
    and the `motion` (6, k) of the hub seen from the rim, own axes, with the normal last.
    """

    kind: str
    name: str
    place: str
    deflection: Array
    stiffening: float
    plate: ring_plate.RingPlate | None = None
    motion: Array = np.empty((6, 0))


def bent_plates(model: FullOrderModel, displacements: Array) -> Iterator[BentPlate]:
    """All placed diaphragms and sheets in motions (n_nodes, 6, k) of all nodes, global frame, m and rad."""
    for name, part in model.plan.parts.items():
        described = model.plan.layout.prototypes[name].superelements
        sheets = {key: own.sheet for key, own in described.items() if own.sheet is not None}
        if not part.diaphragms and not sheets:
            continue
        x = model.geometry.parts[name].positions
        for path, u in placed_motions(model, displacements, name):
            for key, diaphragm in part.diaphragms.items():
                _, B = diaphragm.resisted(model.values, x[diaphragm.nodes])
                plate, motion = diaphragm.plate(model.values), B @ u[diaphragm.nodes].reshape(12, -1)
                lever = np.array([[1.0], [plate.lever], [plate.lever]])
                c = 2 * ring_plate.membrane(plate).axial * plate.thickness**2 / ring_plate.stiffnesses(plate)[2]
                called = "diaphragm", ".".join((*path, key)), ".".join(filter(None, (name, key)))
                yield BentPlate(*called, lever * motion[2:5] / plate.thickness, float(c), plate, motion)
            for key, sheet in sheets.items():
                first, *others = (node for node in part.superelements[key].nodes if node < part.n_positioned)
                called = "sheet", ".".join((*path, key)), ".".join(filter(None, (name, key)))
                for node in others:
                    apart = u[node, :3] - (rigid_arm(x[node] - x[first]) @ u[first])[:3]
                    deflection = np.zeros((3, u.shape[2]))
                    deflection[0] = np.array(sheet.normal) @ apart / sheet.thickness
                    yield BentPlate(*called, deflection, sheet.stiffening)


def plate_warnings(model: FullOrderModel, hz: float) -> tuple[Diagnostic, ...]:
    """Warnings of the diaphragms that vibrate by themselves below twice a frequency, Hz, for the model moves them in
    their static shapes alone, and of those that the loads described stiffen by 1 % or more."""
    found: dict[tuple[str, str], Diagnostic] = {}
    u = np.zeros((model.plan.topology.n_nodes, 6, 1))
    if model.plan.is_loaded and any(True for _ in bent_plates(model, u)):
        u = model.node_displacements(described_prestress(model.design).displacement[:, None])
    for bent in bent_plates(model, u):
        own, deflection = (
            np.inf if bent.plate is None else float(bent.plate.lowest_hz),
            float(np.abs(bent.deflection).max()),
        )
        if hz > NEAR_LOWEST * own:
            text = (
                f"diaphragm {bent.place}: it vibrates by itself from about {in_hz(own, 3)} on, which the model does not"
                f" have; frequencies from half of that on are without it, up to {in_hz(hz, 4)} here"
            )
            found["own", bent.place] = Diagnostic("resonance", bent.place, hz, NEAR_LOWEST * own, "Hz", text)
        stiffer = 3 * bent.stiffening * deflection**2
        if stiffer > STIFFER:
            has = "a pose has it" if bent.plate else "nothing here has it"
            text = (
                f"{bent.kind} {bent.name}: loads bend it by {deflection:.3g} times its thickness, which makes it about"
                f" {100 * stiffer:.2g} % stiffer along its normal; what is linear lacks that, {has}"
            )
            found["bent", bent.name] = Diagnostic("stiffness", bent.name, stiffer, STIFFER, "1", text)
    return tuple(found.values())
