"""The mesh of a flexura model built again in OpenSeesPy: nodes, section constants, masses and constraints, no matrices.

OpenSees' `elasticBeamColumn` with `-cMass` is the Euler-Bernoulli beam with consistent mass and no rotary inertia of
bending. Its torsional inertia is rho Jx, with its torsion constant where the polar second moment belongs. So it is
given Jx = Iy + Iz and a shear modulus of G J / (Iy + Iz): the torsional stiffness is then G J, the inertia
rho (Iy + Iz), and the element uses G and Jx for nothing else. Ends off their nodes are nodes of their own on rigid
links: with `-jntOffset` OpenSees carries the stiffness over the offset, but not the consistent mass.
"""

from __future__ import annotations

import ctypes
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from flexura import FullOrderModel


def _load_bundled_blas() -> None:
    """The Linux wheel brings a BLAS along where its LAPACK does not look for it; load it where the system has none."""
    wheel = find_spec("openseespylinux")
    for library in ("libgfortran.so.4", "libblas.so.3") if wheel is not None and wheel.origin else ():
        bundled = Path(wheel.origin).parent / "lib" / library
        if bundled.exists():
            ctypes.CDLL(str(bundled))


_load_bundled_blas()
import openseespy.opensees as ops  # noqa: E402


class OpenSeesMesh:
    """A model whose mechanism has beams, rigid bodies and point masses only."""

    def __init__(self, model: FullOrderModel) -> None:
        self._model = model
        topology = model.plan.topology
        self._beams = [beam for name in model.plan.parts for beam in self._part_beams(name)]
        self._masses = [mass for name in model.plan.parts for mass in self._part_masses(name)]
        used = {node for beam in self._beams for node in beam[0]} | {node for node, _ in self._masses}
        self._nodes = sorted(used | {int(topology.root[node]) for node in used})

    def _tag(self, node: int) -> int:
        """Nodes that coincide are one; nodes on rigid arms stay apart."""
        topology = self._model.plan.topology
        return int(node if topology.is_rigid[node] else topology.root[node])

    def _part_beams(self, name: str) -> list[tuple[list[int], dict[str, float], list[float]]]:
        plan, geometry, values = self._model.plan, self._model.geometry, self._model.values
        part, own = plan.parts[name], geometry.parts[name]
        E, rho, nu, G = part.table.moduli(values)
        sections = part.table.section_properties(values, nu, own.length)
        placed = plan.topology.copies[name]
        beams = []
        for instance, offset in zip(placed.number, placed.offset, strict=True):
            Q = geometry.Q[instance]
            for e, (i, j) in enumerate(part.connectivity):
                m = int(part.table.element_member[e])
                arms = np.zeros((2, 3))
                if e == part.first[m]:
                    arms[0] = Q @ own.offsets[m, 0]
                if e == part.first[m + 1] - 1:
                    arms[1] = Q @ own.offsets[m, 1]
                constants = {
                    "A": sections.A[e], "E": E[m], "G": G[m], "J": sections.J[e],
                    "Iy": sections.Iy[e], "Iz": sections.Iz[e], "rho": rho[m],
                }  # fmt: skip
                local_z = Q @ own.R[m, 2]
                numbers = {key: float(value) for key, value in constants.items()}
                beams.append(([self._tag(offset + i), self._tag(offset + j)], numbers, [*local_z, *arms.ravel()]))
        return beams

    def _part_masses(self, name: str) -> list[tuple[int, list[float]]]:
        plan = self._model.plan
        part, placed = plan.parts[name], plan.topology.copies[name]
        masses = []
        for instance, offset in zip(placed.number, placed.offset, strict=True):
            Q = self._model.geometry.Q[instance]
            for node, discrete in part.bodies.values():
                mass, inertia = discrete.mass_and_inertia(self._model.values)
                turned = Q @ inertia @ Q.T
                if not np.allclose(turned, np.diag(np.diagonal(turned)), atol=1e-12 * np.abs(turned).max()):
                    raise ValueError("OpenSees takes principal inertias along the axes only")
                masses.append((self._tag(offset + node), [float(mass)] * 3 + [float(v) for v in np.diagonal(turned)]))
        return masses

    def build(self) -> None:
        """Lay the model out in the OpenSees domain, which is emptied first."""
        topology, positions = self._model.plan.topology, self._model.geometry.positions
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", 6)
        tags = sorted({self._tag(node) for node in self._nodes})
        for tag in tags:
            ops.node(tag + 1, *(float(x) for x in positions[tag]))
        for tag in tags:
            root = int(topology.root[tag])
            held = topology.held[root]
            if tag == root and held.any():
                ops.fix(tag + 1, *(int(h) for h in held))
        for tag, mass in self._masses:
            ops.mass(tag + 1, *mass)
        extra = max(tags) + 2
        for number, (ends, c, frame) in enumerate(self._beams, start=1):
            ops.geomTransf("Linear", number, *(float(x) for x in frame[:3]))
            polar = c["Iy"] + c["Iz"]
            section = (c["A"], c["E"], c["G"] * c["J"] / polar, polar, c["Iy"], c["Iz"])
            i_j = []
            for end, arm in zip(ends, np.reshape(frame[3:], (2, 3)), strict=True):
                i_j.append(end + 1)
                if arm.any():
                    if int(topology.root[end]) != end:
                        raise ValueError("a beam off a node that is itself on a rigid arm")
                    ops.node(extra, *(float(x) for x in positions[end] + arm))
                    ops.rigidLink("beam", end + 1, extra)
                    i_j[-1], extra = extra, extra + 1
            ops.element("elasticBeamColumn", number, *i_j, *section, number, "-mass", c["rho"] * c["A"], "-cMass")
        for tag in tags:
            root = int(topology.root[tag])
            if tag != root:
                ops.rigidLink("beam", root + 1, tag + 1)
        ops.constraints("Transformation")

    def frequencies(self, count: int) -> np.ndarray:
        """Build the model and solve for its lowest natural frequencies (count,), Hz."""
        self.build()
        values = np.array(ops.eigen("-genBandArpack", count))
        return np.sqrt(values) / (2 * np.pi)
