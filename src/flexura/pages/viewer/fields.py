"""What colours a motion and what is said of each part in it: strain energy, stress."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexura.analysis import Stresses, element_strains, energies
from flexura.arrays import Array
from flexura.pages.viewer.buffers import Buffer
from flexura.pages.viewer.geometry import Drawing
from flexura.pages.viewer.scene import ByPart, Colouring
from flexura.structure import FullOrderModel
from flexura.tables import number, quantity
from flexura.view import Grid, Kind

DISPLACEMENT = Colouring("displacement", "displacement", "m", None, None)

STRAINED = {Kind.FLEXURE, Kind.LINK, Kind.SPRING, Kind.SUPERELEMENT, Kind.PIEZO}
MEMBERS = {Kind.FLEXURE, Kind.LINK}
HEAVY = {Kind.BODY, Kind.EQUIVALENT_BODY, Kind.MASS, Kind.SENSOR}

LEAST = 5e-4
"""Share of the energy below which nothing is said of a part."""


class Energy:
    """Strain energies of k motions of all nodes, displacements (n_nodes, 6, k), m and rad in any common scale."""

    def __init__(self, drawing: Drawing, displacements: Array) -> None:
        self.drawing = drawing
        self.model: FullOrderModel = drawing.model
        parts = energies(self.model, displacements)
        prefixes = ["" if own.path == "mechanism" and not own.prototype else f"{own.path}." for own in parts]
        self.strain: dict[str, Array] = {
            prefix + key: kinds.sum(axis=0)
            for prefix, own in zip(prefixes, parts, strict=True)
            for key, kinds in own.strain.items()
        }
        self.total: Array = sum(self.strain.values(), np.zeros(displacements.shape[2]))
        self._densities = [(grid, self._density(grid, displacements)) for grid in drawing.solids.grids]

    def _density(self, grid: Grid, displacements: Array) -> Array:
        """Strain energy over volume (c, m, p, k), J/m^3, the mean over the section, at the points of members."""
        part = self.model.plan.parts[grid.prototype]
        volume = _volumes(self.model, grid.prototype)
        n = int(part.counts[grid.members[0]])
        elements = part.first[grid.members][:, None] + np.arange(n)
        if self.model.plan.is_posed:
            names = [_names(self.model, grid, c) for c in grid.copies]
            own = np.array([[self.strain[name] for name in names_of] for names_of in names])
            density = (own / volume[elements].sum(axis=1)[:, None])[:, :, None]
            return np.repeat(density, len(grid.along), axis=2)
        strains = element_strains(self.model, displacements, grid.prototype, grid.copies.tolist())
        density = strains[:, elements] / volume[elements][..., None]
        middles = (np.arange(n) + 0.5) / n
        weights = np.stack([np.interp(grid.along, middles, row) for row in np.eye(n)], axis=-1)
        return np.einsum("pe,cmek->cmpk", weights, density)

    def colouring(self, k: int) -> Colouring | None:
        """Density of the strain energy in motion k, members alone; None where nothing is strained."""
        values = np.full(len(self.drawing.solids.points), np.nan)
        for grid, density in self._densities:
            own = density[..., k].ravel()
            values[grid.first : grid.first + len(own)] = own
        largest = float(np.nanmax(values, initial=0.0))
        if not largest > 0 or not self.total[k] > 0:
            return None
        return Colouring("energy", "strain energy density", "", None, Buffer.shares(values, largest))

    def by_part(self, k: int) -> ByPart:
        """Shares of the strain energy in motion k."""
        total = float(self.total[k])
        shares = {name: float(own[k]) / total for name, own in self.strain.items()} if total > 0 else {}
        return by_part(
            self.drawing, "strain energy", STRAINED, {n: percent(s) for n, s in shares.items() if s >= LEAST}
        )


def stress_colouring(values: Array, largest: float | None = None) -> Colouring | None:
    """Stresses (v,), Pa, NaN where they are not known; `largest` of several motions that are to be compared."""
    most = float(np.nanmax(values, initial=0.0)) if largest is None else largest
    return (
        Colouring("stress", "largest von Mises stress in the section", "Pa", most, Buffer.shares(values, most))
        if most > 0
        else None
    )


def stress_by_part(drawing: Drawing, stresses: Stresses) -> tuple[ByPart, ...]:
    """Largest stress of each member, and how far it is from yield."""
    most = {own.name: quantity(own.von_mises, "Pa", 4) for own in stresses.members if own.von_mises is not None}
    margin = {
        own.name: f"at {number(own.factor_to_yield, 4)} times this"
        for own in stresses.members
        if own.factor_to_yield is not None and np.isfinite(own.factor_to_yield)
    }
    return by_part(drawing, "largest stress", MEMBERS, most), by_part(drawing, "yields", MEMBERS, margin)


def by_part(drawing: Drawing, label: str, kinds: set[Kind], told: Mapping[str, str]) -> ByPart:
    """What is told of parts by name, of those of some kinds, as the page has it."""
    names = drawing.solids.names
    held = {*kinds, Kind.FLAGGED, Kind.FLAGGED_BODY}
    return ByPart(
        label, tuple(told.get(names[n], "") if Kind(kind) in held else "" for n, kind in drawing.parts.tolist())
    )


def percent(share: float) -> str:
    """A share in percent, three digits."""
    return f"{100 * share:.3g} %"


def _names(model: FullOrderModel, grid: Grid, copy: int) -> list[str]:
    keys = list(model.plan.parts[grid.prototype].members)
    path = model.plan.topology.copies[grid.prototype].paths[copy]
    return [".".join((*path, keys[m])) for m in grid.members]


def _volumes(model: FullOrderModel, name: str) -> Array:
    """Volumes (e,), m^3, of the elements of a prototype."""
    part, length = model.plan.parts[name], model.geometry.parts[name].length
    nu = part.table.moduli(model.values)[2]
    area: Any = part.table.section_properties(model.values, nu, length).A
    member = part.table.element_member
    return area * (length / np.asarray(part.counts))[member]
