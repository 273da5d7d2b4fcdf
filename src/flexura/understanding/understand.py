"""A drawing of a planar part understood: its flexures, arms and blocks, a mechanism of these, and how far off it is."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexura.analysis import Modes, modes
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.deadline import Listener, announcer
from flexura.errors import Diagnostic, ExpressionError, OptionError, did_you_mean
from flexura.full_order import assemble
from flexura.mechanism import Material, Mechanism, with_rigid_bodies
from flexura.methods import Solution, counterparts
from flexura.modelfile import material_of
from flexura.outlines import Outline, read_dxf, read_svg
from flexura.results import Tabular
from flexura.tables import Item, Line, Table, in_mm, percent, quantity, signed_percent
from flexura.understanding.describe import Description, Plane, described
from flexura.understanding.sections import Axis, Boundary
from flexura.understanding.solid import SolidModes, solid_modes
from flexura.understanding.thin import Block, Flexure, blocks_of, thin_places
from flexura.units import parse_quantity, parse_unit

CHORD = 1e-5
"""Distance of chords from the arcs of blocks, over the size of the part."""

SPARE_MODES = 6
"""Modes of the description beyond those asked for, among which counterparts are looked for."""

LEAF_CELL, NOTCH_CELL = 4.0, 1.0
"""Length of tetrahedra in a leaf and in a notch, over its thickness there."""

SURE = 0.5
"""MAC of a counterpart below which it is doubtful, and a warning."""


@dataclass(frozen=True)
class RecognisedFlexure:
    """A flexure of a drawing: `name` in the description, `kind` (leaf, circular, elliptical, corner_filleted, table),
    `place` (2,), m, of its thinnest section, `direction` (2,), `web`, `length`, m, `radius` of a circular notch or of
    fillets, m, and the two blocks or arms that it joins."""

    name: str
    kind: str
    place: tuple[float, float]
    direction: tuple[float, float]
    web: float
    length: float
    radius: float
    joins: tuple[str, str]


@dataclass(frozen=True)
class RecognisedBlock:
    """A block of a drawing: `name` in the description, `kind` of its solid, `place` (2,), m, of its centroid, `area`,
    m^2, and whether it is held."""

    name: str
    kind: str
    place: tuple[float, float]
    area: float
    is_held: bool


@dataclass(frozen=True)
class ComparedMode:
    """A mode of the solid of the drawing, `solid_hz`, known to a relative `uncertainty`, and its counterpart in the
    description: `described_hz`, modal assurance criterion `mac`, `difference` relative to the solid, and `model_error`,
    the interval in which the part is expected, relative to the description; `is_within` says whether it is there. None
    where there is no counterpart or no evidence."""

    solid_hz: float
    uncertainty: float
    described_hz: float | None = None
    mac: float | None = None
    difference: float | None = None
    model_error: tuple[float, float] | None = None
    is_within: bool | None = None


@dataclass(frozen=True, repr=False)
class Understanding(Tabular):
    """What a drawing is: `flexures`, `blocks`, and the `mechanism` that describes them, beside the solid of the drawing
    itself mode by mode (`modes`, none where that was not asked for).

    `thickness`, m; `mass`, kg, of the part; `cells` and `dofs` of the solid; `seconds` of the run. `notes` say what of
    the drawing was healed, left out or simplified; `warnings` which modes lie outside of the expected model error.
    """

    name: str
    thickness: float
    mass: float
    flexures: tuple[RecognisedFlexure, ...]
    blocks: tuple[RecognisedBlock, ...]
    mechanism: Mechanism
    modes: tuple[ComparedMode, ...]
    cells: int
    dofs: int
    seconds: float
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    def _title(self) -> str:
        return "a drawing as a mechanism, beside its solid" if self.modes else "a drawing as a mechanism"

    def presentation(self) -> Iterator[Item]:
        """Flexures, blocks, and a row for every mode of the solid."""
        yield Table(
            {
                "flexure": [own.name for own in self.flexures],
                "kind": [own.kind.replace("_", " ") for own in self.flexures],
                "at (x, y), mm": [in_mm(own.place) for own in self.flexures],
                "web [m]": [own.web for own in self.flexures],
                "length [m]": [own.length for own in self.flexures],
                "radius [m]": [own.radius or None for own in self.flexures],
                "joins": [" and ".join(own.joins) for own in self.flexures],
            },
            "flexures",
        )
        yield Table(
            {
                "block": [own.name for own in self.blocks],
                "solid": [own.kind for own in self.blocks],
                "at (x, y), mm": [in_mm(own.place) for own in self.blocks],
                "area [m^2]": [own.area for own in self.blocks],
                "held": [own.is_held for own in self.blocks],
            },
            "blocks",
        )
        if self.modes:
            yield Table(self._shown_modes(), "modes")
            text = f"{self.cells} curved cells of order 3, {self.dofs} DOFs, {quantity(self.seconds, 's', 3)}"
            yield Line(f"difference: described over solid; {text}")

    def _shown_modes(self) -> dict[str, list[Any]]:
        def interval(own: ComparedMode) -> str:
            return "" if own.model_error is None else " to ".join(signed_percent(x) for x in own.model_error)

        return {
            "mode": list(range(1, len(self.modes) + 1)),
            "solid [Hz]": [own.solid_hz for own in self.modes],
            "known to": [percent(own.uncertainty, 2) for own in self.modes],
            "described [Hz]": [own.described_hz for own in self.modes],
            "difference": [signed_percent(own.difference) for own in self.modes],
            "expected of the part": [interval(own) for own in self.modes],
            "within": [own.is_within for own in self.modes],
        }

    def _columns(self) -> dict[str, Any]:
        """A row for each mode."""
        return {
            "mode": list(range(1, len(self.modes) + 1)),
            "solid [Hz]": [own.solid_hz for own in self.modes],
            "uncertainty": [own.uncertainty for own in self.modes],
            "described [Hz]": [own.described_hz for own in self.modes],
            "mac": [own.mac for own in self.modes],
            "difference": [own.difference for own in self.modes],
            "model error, lower": [own.model_error and own.model_error[0] for own in self.modes],
            "model error, upper": [own.model_error and own.model_error[1] for own in self.modes],
        }

    def _data(self) -> Mapping[str, Any]:
        names = ("name", "thickness", "mass", "flexures", "blocks", "modes", "cells", "dofs", "seconds")
        return {name: getattr(self, name) for name in names}

    def __repr__(self) -> str:
        worst = max((own.difference for own in self.modes if own.difference is not None), key=abs, default=None)
        counts = f"{len(self.flexures)} flexures, {len(self.blocks)} blocks"
        return f"Understanding({self.name!r}, {counts}, worst difference {signed_percent(worst) or 'unknown'})"


@verb
def understand(
    drawing: Outline | str | Path,
    *,
    thickness: float,
    material: Material | str,
    hold: str,
    n: int = 6,
    name: str | None = None,
    units: str | None = None,
    with_solid: bool = True,
    progress: Listener | None = None,
) -> Understanding:
    """A planar part, drawn as DXF, SVG or `Outline`, as a mechanism of beams and elastic bodies, beside its solid.

    `thickness`, m, from z = 0 up; `material`, its name in the catalogue or its
    constants, as in 'E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3'; `hold` a plane such as 'x = 0 mm', or the
    name of a layer whose lines lie on one line. Places that are thin beside what they join become leaves and notches,
    arms between them links, and what is left elastic bodies. The `n` lowest modes of the extruded drawing as one solid
    (curved tetrahedra of order 3, without `with_solid` none) tell how far the description is off.

    Raises OptionError for files that are no drawings, materials that are unknown, and what is not there to be held;
    ModelError as `outline_of`; SolverError where the solid fails.
    """
    began, say = time.perf_counter(), announcer(progress)
    if not (isinstance(thickness, float | int) and math.isfinite(thickness) and thickness > 0):
        raise OptionError(f"thickness is a positive length in m, not {thickness!r}")
    outline = drawing if isinstance(drawing, Outline) else _read(Path(drawing), units)
    name = name or ("part" if isinstance(drawing, Outline) else Path(drawing).stem)
    metal = material if isinstance(material, Material) else material_of(material)
    held = held_plane(outline, hold)
    say("flexures, arms and blocks")
    flexures, links, blocks = blocks_of(outline, thin_places(outline), CHORD * outline.size)
    description = described(outline, float(thickness), metal, held, (flexures, links, blocks), name)
    say("the description")
    answer = modes(description.mechanism, n=n + SPARE_MODES, order="full")
    compared: tuple[ComparedMode, ...] = ()
    solid: SolidModes | None = None
    if with_solid:
        say("the solid of the drawing")
        solid, compared = _compared(outline, float(thickness), metal, held, flexures, answer, n)
    warnings = [
        Diagnostic(
            "misfit", f"mode {k + 1}", abs(own.difference), max(map(abs, own.model_error)), "1",
            f"mode {k + 1} of the solid, {own.solid_hz:.5g} Hz, lies outside of what is expected of the part: the "
            f"description is {signed_percent(own.difference)} off",
        )
        for k, own in enumerate(compared)
        if own.is_within is False and own.difference is not None and own.model_error is not None
    ]  # fmt: skip
    warnings += [
        Diagnostic.about("misfit", f"mode {k + 1} of the solid, {own.solid_hz:.5g} Hz, has no clear counterpart")
        for k, own in enumerate(compared)
        if own.mac is None or own.mac < SURE
    ]
    return Understanding(
        name=name,
        thickness=float(thickness),
        mass=outline.area * float(thickness) * float(str(metal.rho)),
        flexures=tuple(_flexures(flexures, description)),
        blocks=tuple(_blocks(blocks, description)),
        mechanism=description.mechanism,
        modes=compared,
        cells=solid.cells if solid else 0,
        dofs=solid.dofs if solid else 0,
        seconds=time.perf_counter() - began,
        notes=(*outline.notes, *description.notes),
        warnings=tuple(warnings),
    )


def _read(path: Path, units: str | None) -> Outline:
    kind = path.suffix.lower()
    if kind not in (".dxf", ".svg"):
        raise OptionError(f"{path}: a drawing is named .dxf or .svg")
    return read_dxf(path, units=units) if kind == ".dxf" else read_svg(path, units)


def held_plane(outline: Outline, text: str) -> Plane:
    """What is held: 'x = 0 mm', or a layer all of whose lines lie on one line. Raises OptionError for anything else."""
    match = re.fullmatch(r"\s*([xy])\s*=\s*(.+)", text)
    if match is not None:
        try:
            offset, dimension = parse_quantity(match[2])
        except ExpressionError as error:
            raise OptionError(f"hold {text!r}: {error}; a plane is, for instance, 'x = 0 mm'") from None
        if dimension != parse_unit("m")[1] and offset:
            raise OptionError(f"hold {text!r}: a length with its unit is expected, for instance 'x = 0 mm'")
        return Plane((1.0, 0.0) if match[1] == "x" else (0.0, 1.0), offset, text.strip())
    own = [segment for segment in outline.segments if segment.layer == text]
    if not own:
        known = did_you_mean(text, outline.layers, f"layers: {', '.join(outline.layers) or 'none'}")
        raise OptionError(f"hold {text!r}: neither a plane, as 'x = 0 mm', nor a layer of the drawing: {known}")
    right = own[0].direction(0.5)
    normal = np.array([right[1], -right[0]])
    places = np.array([at for segment in own for at in (segment.start, segment.end)]) @ normal
    if any(not segment.is_line for segment in own) or np.ptp(places) > 1e-6 * outline.size:
        raise OptionError(
            f"hold {text!r}: what is held of a layer are lines on one line; arcs and several lines are not"
        )
    return Plane((float(normal[0]), float(normal[1])), float(places.mean()), f"layer {text}")


def _flexures(flexures: list[Flexure], description: Description) -> Iterator[RecognisedFlexure]:
    for own, name, joins in zip(flexures, description.flexures, description.joins, strict=True):
        radius = float(np.mean(own.radius)) if own.kind != "elliptical" else 0.0
        yield RecognisedFlexure(name, own.kind, own.centre, own.along, own.web, own.length, radius, joins)


def _blocks(blocks: list[Block], description: Description) -> Iterator[RecognisedBlock]:
    for own, name in zip(blocks, description.blocks, strict=True):
        body = description.mechanism.bodies[name]
        assert body.solid is not None
        x, y = own.polygon.centroid.coords[0]
        yield RecognisedBlock(name, body.solid.shape, (x, y), own.polygon.area, body.held is not None)


def _compared(
    outline: Outline, thickness: float, metal: Material, held: Plane, flexures: list[Flexure], answer: Modes, n: int
) -> tuple[SolidModes, tuple[ComparedMode, ...]]:
    """The modes of the solid with those of the description."""
    rigid = assemble(with_rigid_bodies(answer.model.plan.mechanism))
    names = list(answer.node_names)
    common = [names.index(name) for name in rigid.plan.topology.node_names]
    sizes = _sizes(outline, flexures, thickness)
    E = float(str(metal.E))
    nu = float(str(metal.nu)) if metal.nu is not None else E / (2 * float(str(metal.G))) - 1
    solid = solid_modes(outline, thickness, (E, nu, float(str(metal.rho))), held, n, sizes, rigid.positions)
    inside = np.isfinite(solid.shapes).all(axis=(1, 2), keepdims=True)
    reference = Solution("", None, solid.frequency_hz, np.where(inside, solid.shapes, 0.0))
    other = Solution("", None, answer.frequency_hz, np.where(inside, answer.shapes[common], 0.0))
    rows = []
    for k, mode in enumerate(counterparts(rigid, reference, other, n)):
        hz, unsure = float(solid.frequency_hz[k]), float(solid.uncertainty[k])
        if mode is None:
            rows.append(ComparedMode(hz, unsure))
            continue
        error, ratio = answer.model_error[mode.number], hz / mode.frequency_hz - 1
        within = None if error is None else error[0] - unsure <= ratio <= error[1] + unsure
        rows.append(ComparedMode(hz, unsure, mode.frequency_hz, mode.mac, mode.frequency_hz / hz - 1, error, within))
    return solid, tuple(rows)


def _sizes(outline: Outline, flexures: list[Flexure], thickness: float) -> tuple[Array, Array]:
    """Places (k, 3), m, in thin parts, and lengths (k,), m, of tetrahedra there."""
    boundary = Boundary(outline.segments)
    places, lengths = [], []
    for own in flexures:
        axis = Axis(boundary, np.array(own.centre), np.array(own.along))
        x = own.start
        while x < own.end:
            local = float(axis.thickness(np.array([min(max(x, own.start + 1e-6 * own.length), own.end)]))[0])
            h = local * (LEAF_CELL if own.kind == "leaf" and local < 1.01 * own.web else NOTCH_CELL)
            count = max(2, math.ceil(thickness / h) + 1)
            at = axis.at(x)
            places += [[at[0], at[1], z] for z in np.linspace(0, thickness, count)]
            lengths += [h] * count
            x += h / 2
    return np.array(places), np.array(lengths)
