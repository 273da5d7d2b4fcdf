"""The evidence that comes with every modal result."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.records import Record
from flexura.structure import FullOrderModel, Part, PartGeometry, PartMatrices, node_dofs, rigid_mass
from flexura.tables import Item, Line, Table, counted, in_hz, quantity

MOST_MISSED = 12
"""Missed modes that are listed."""


@dataclass(frozen=True)
class MissedMode:
    """A full-order mode in the reported range that the low-order model does not have."""

    frequency_hz: float
    summary: str


@dataclass(frozen=True)
class MassProperties:
    """Mass, kg; centre of mass (3,), m; inertia tensor (3, 3) about it, kg m^2."""

    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[tuple[float, float, float], ...]

    @staticmethod
    def of(M: Array) -> MassProperties:
        """Read off a 6 x 6 rigid-body mass matrix about the origin (theory eq. 58)."""
        mass = float(M[0, 0] + M[1, 1] + M[2, 2]) / 3
        S = M[3:, :3] / mass if mass else np.zeros((3, 3))
        c = np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]]) / 2
        D = rigid_arm(-c)
        inertia = (D.T @ M @ D)[3:, 3:]
        x, y, z = (float(v) for v in c)
        return MassProperties(mass, (x, y, z), tuple((float(a), float(b), float(d)) for a, b, d in inertia))


@dataclass(frozen=True, repr=False)
class Evidence(Record):
    """Why the numbers of a modal result can be believed, or not.

    `model_mass` comes from the mass matrices by rigid motions, `described_mass` from density times volume;
    `mass_error` and `inertia_error` are their relative differences. `rigid_body_residual` is the largest
    |K r| / (k (k |r|)), k the square roots of the diagonal, over six rigid motions of every unrestrained part.
    `full_residual` and `low_residual` are the largest residuals of the reported modes of either model, in the norm that
    bounds the relative error of the eigenvalue (`flexura.linalg.residuals`); None where a model was not solved.
    `sturm_count` full-order eigenvalues lie below `sturm_below_hz`, beyond the highest frequency certified, and
    `reported_below` of the model reported; where not `is_counted`, round-off hides how many, and `sturm_count` is the
    most there can be. `missed` lists full-order modes there without a counterpart, `more_missed` counts those not
    listed.
    """

    _shown = ("complete", "sturm_count", "sturm_below_hz")

    model_mass: MassProperties
    described_mass: MassProperties
    mass_error: float
    inertia_error: float
    rigid_body_residual: float
    rigid_body_modes: int
    full_residual: float | None
    low_residual: float | None
    sturm_below_hz: float
    sturm_count: int
    reported_below: int
    missed: tuple[MissedMode, ...]
    more_missed: int = 0
    is_counted: bool = True

    @property
    def complete(self) -> bool:
        """True when it is proven that no full-order mode in the reported range lacks a counterpart."""
        return self.is_counted and not self.missed and not self.more_missed

    def presentation(self) -> Iterator[Item]:
        """The evidence, and modes that are missing."""
        yield from map(Line, self.lines)
        if self.complete:
            yield Line("no mode is missing in this range", "good")
            return
        if not self.is_counted:
            yield Line("round-off hides whether a mode is missing in this range", "bad")
            return
        count = len(self.missed) + self.more_missed
        yield Line(
            f"{counted(count, 'mode')} in this range {'is' if count == 1 else 'are'} MISSING from the low-order model",
            "bad",
        )
        missed = {
            "frequency [Hz]": [m.frequency_hz for m in self.missed],
            "what moves": [m.summary for m in self.missed],
        }
        yield Table(missed, "modes", count=count, most=MOST_MISSED)
        yield Line("keep fixed-interface normal modes to see them: --tolerance 1e-3 --up-to 'F Hz', or --keep 2")

    @property
    def lines(self) -> tuple[str, ...]:
        """Masses, rigid motions, residuals and counts in words."""
        found_in = "found" if self.low_residual is None else "in the low-order model"
        residuals = (("full", self.full_residual), ("low-order", self.low_residual))
        free = f"; {self.rigid_body_modes} rigid-body modes" if self.rigid_body_modes else ""
        return (
            f"mass {quantity(self.model_mass.mass, 'kg', 6)}, as described to {self.mass_error:.1g};"
            f" inertia to {self.inertia_error:.1g}",
            f"rigid-body motions strain nothing: residual {self.rigid_body_residual:.1g}{free}",
            "eigen-residuals: " + ", ".join(f"{name} {value:.1g}" for name, value in residuals if value is not None),
            f"Sturm count below {in_hz(self.sturm_below_hz)}: {'' if self.is_counted else 'at most '}{self.sturm_count}"
            f" of the full order, {self.reported_below} {found_in}",
        )


def mass_evidence(model: FullOrderModel) -> dict[str, Any]:
    """Masses of model and description, their differences, and the rigid-body residual, as fields of Evidence."""
    modelled, described, worst = np.zeros((6, 6)), np.zeros((6, 6)), 0.0
    for name, matrices in model.matrices.items():
        part, geometry = model.plan.parts[name], model.geometry.parts[name]
        R = _rigid_motions(part, geometry)
        worst = max(worst, _rigid_residual(part, matrices, R))
        of_model, of_description = rigid_mass_of(part, matrices, R), _described(part, model.values, geometry)
        for instance in model.plan.topology.copies[name].number:
            Q, t = model.geometry.Q[instance], model.geometry.t[instance]
            X = np.zeros((6, 6))
            X[:3, :3], X[3:, 3:] = Q.T, np.linalg.det(Q).round() * Q.T
            X = X @ rigid_arm(t)
            modelled, described = modelled + X.T @ of_model @ X, described + X.T @ of_description @ X
    found, expected = MassProperties.of(modelled), MassProperties.of(described)
    scale = np.abs(expected.inertia).max()
    return {
        "model_mass": found,
        "described_mass": expected,
        "mass_error": abs(found.mass / expected.mass - 1) if expected.mass else 0.0,
        "inertia_error": float(np.abs(np.subtract(found.inertia, expected.inertia)).max() / scale) if scale else 0.0,
        "rigid_body_residual": worst,
    }


def rigid_mass_of(part: Part, matrices: PartMatrices, R: Array) -> Array:
    """R' M R (k, k) of a part for displacements R (6n, k) of its nodes, summed over its elements and discrete
    elements."""
    k, local = R.shape[1], matrices.T @ R[node_dofs(part.connectivity)]
    M = local.reshape(-1, k).T @ (matrices.elements.M @ local).reshape(-1, k)
    for discrete in matrices.discrete_elements:
        if discrete.M is not None:
            moved = R[node_dofs(discrete.nodes)]
            M += moved.T @ discrete.M @ moved
    return M


def _rigid_residual(part: Part, matrices: PartMatrices, R: Array) -> float:
    """Largest |K r| / (k (k |r|)) over rigid motions R (6n, 6) and DOFs, springs to ground left out (theory eq. 59)."""
    at, T = node_dofs(part.connectivity), matrices.T
    KT = matrices.elements.K @ T
    on_ends = np.concatenate([np.swapaxes(T, -1, -2) @ (KT @ R[at]), np.einsum("eij,eij->ej", T, KT)[..., None]], -1)
    summed = [np.bincount(at.ravel(), column.ravel(), len(R)) for column in np.moveaxis(on_ends, -1, 0)]
    forces, squares = np.stack(summed[:-1], axis=1).astype(float), summed[-1].astype(float)
    for discrete in chain(matrices.discrete_elements, *(strips.each for strips in matrices.strips)):
        if discrete.K is not None:
            rows = node_dofs(discrete.nodes)
            squares[rows] += np.diagonal(discrete.K)
            if len(discrete.nodes) > 1:
                forces[rows] += discrete.K @ R[rows]
    stiff = np.sqrt(squares)
    size = np.outer(stiff, stiff @ np.abs(R))
    return float(np.max(np.abs(forces[size > 0]) / size[size > 0], initial=0.0))


def _described(part: Part, values: Array, geometry: PartGeometry) -> Array:
    """Rigid-body mass matrix (6, 6) about the part's origin from density, volume and the parallel-axis theorem.

    Every element is a prism with the section at its middle (at its stations when tapered).
    """
    total = np.zeros((6, 6))
    if part.members:
        for mass, inertia, centre in part.prisms(values, geometry):
            D = rigid_arm(centre)
            total += np.einsum("eji,ejk,ekl->il", D, rigid_mass(mass, inertia), D)
    for node, discrete in [*part.bodies.values(), *part.points.values()]:
        D = rigid_arm(geometry.positions[node])
        total += D.T @ discrete.matrix(values) @ D
    for diaphragm in part.diaphragms.values():
        total += diaphragm.described_mass(values, geometry.positions[diaphragm.nodes])
    for key, piezo in part.channels.piezos.items():
        total += part.channels.described_mass(key, values, geometry.positions[piezo.nodes])
    for _, node, M in part.channels.mass_matrices(values):
        D = rigid_arm(geometry.positions[node])
        total += D.T @ M @ D
    rigid = _rigid_motions(part, geometry).reshape(-1, 6, 6)
    for own in part.superelements.values():
        _, M = own.matrices(values, geometry.positions[own.nodes])
        R = rigid[own.nodes].reshape(-1, 6)
        total += R.T @ M @ R
    return total


def _rigid_motions(part: Part, geometry: PartGeometry) -> Array:
    """Displacements (6n, 6) of all nodes in rigid motions of the part about its origin; amplitudes stay zero."""
    motions = rigid_arm(geometry.positions)
    motions[part.n_positioned :] = 0.0
    return motions.reshape(-1, 6)
