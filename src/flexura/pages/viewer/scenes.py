"""The scene of a mechanism, with the motions of results of it and what a check doubts, each at its place."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from flexura.analysis import CheckReport, Drift, FreedomSpaces, Kinetostatics, Modes, Preload, Statics, Stroke
from flexura.errors import OptionError
from flexura.full_order import assemble
from flexura.mechanism import Mechanism
from flexura.pages.viewer.facts import Facts
from flexura.pages.viewer.geometry import Cells, Drawing
from flexura.pages.viewer.measured_shapes import with_test
from flexura.pages.viewer.motions import (
    drift_motions,
    freedom_motions,
    mode_motions,
    preload_motions,
    space_motions,
    static_motions,
    stroke_poses,
    triple,
)
from flexura.pages.viewer.scene import Buffer, Fact, PlacedMark, Poses, Range, Scene, ShownKind, ShownMotion, ShownPart
from flexura.pages.viewer.tests_of_modes import paired_motions, sensor_motions, verified_motions, verified_shapes
from flexura.solid.verification import Verification
from flexura.structure import FullOrderModel, Plan, solids_of
from flexura.testing.correlation import Correlation
from flexura.testing.virtual import SensorPlacement
from flexura.view import COLOURS, HIDDEN, NAMES, Kind, Solids, customary_camera, draw_mechanism, visible_flexures

CLASHES = {"clash", "deep", "touch", "gap"}

LABEL = 48
"""Characters of a label."""


class Doubts(NamedTuple):
    """Doubts about parts at their places, by the names of all parts that they are about, and those about the whole."""

    marks: list[PlacedMark]
    by_part: Mapping[str, list[str]]
    whole: list[str]


def doubted_parts(report: CheckReport, model: FullOrderModel) -> set[str]:
    """Names of the members and bodies in doubt."""
    own = {name for clash in report.clashes for name in clash.parts}
    bars, bodies = solids_of(model)
    known = {*bars.names, *bars.labels, *bodies.names, *bodies.labels}
    return own | {name for doubt in report.warnings for name in doubt.places or (doubt.place,) if name in known}


def doubts_of(drawing: Drawing, report: CheckReport) -> Doubts:
    """The doubts of a check of the mechanism that is drawn."""
    found = Doubts([], {}, [])
    by_part: dict[str, list[str]] = {}
    for clash in report.clashes:
        text = f"{clash.first}: {clash.text}"
        found.marks.append(PlacedMark(triple(clash.at), text, _label(text), "doubt", clash.first))
        for name in clash.parts:
            by_part.setdefault(name, []).append(text)
    bars, bodies = solids_of(drawing.model)
    middles = bars.origin + bars.axes[:, 0] * bars.length[:, None] / 2
    places = [*zip(bars.names, bars.labels, middles, strict=True)]
    places += zip(bodies.names, bodies.labels, bodies.origin, strict=True)
    topology = drawing.model.plan.topology
    places += [(name, name, x) for name, x in zip(topology.node_names, drawing.model.positions, strict=True)]
    for doubt in report.warnings:
        if doubt.kind in CLASHES and report.clashes:
            continue
        own = [(name, at) for name, label, at in places if doubt.is_about(name, label)]
        if own:
            name, at = own[0]
            more = f" and {len(doubt.places) - 1} more" if len(doubt.places) > 1 else ""
            label = _label(f"{(doubt.places or (doubt.place,))[0]}{more}: {doubt.text}")
            found.marks.append(PlacedMark(triple(np.asarray(at)), str(doubt), label, "doubt", name))
        else:
            found.whole.append(f"warning: {doubt}")
        for name, _ in own:
            by_part.setdefault(name, []).append(doubt.text)
    return found._replace(by_part=by_part)


def _label(text: str) -> str:
    """The place and the first words of what is said of it."""
    place, _, said = text.partition(": ")
    short = f"{place}: {re.split(r'[:;,(]', said)[0].strip()}"
    return short if len(short) <= LABEL else f"{short[: LABEL - 1]}…"


Shown = (
    Mechanism | Plan | FullOrderModel | Modes | Statics | Stroke | Preload | Kinetostatics | Drift | CheckReport
    | FreedomSpaces | Correlation | SensorPlacement | Verification
)  # fmt: skip
"""What has a place in a scene."""

WITH_MODEL = (Modes, Statics, Stroke, Preload, FreedomSpaces, Correlation, SensorPlacement)
"""Results that hold their model."""
WITHOUT = (Kinetostatics, Drift, CheckReport)
WITH_NOTES = (Statics, Stroke, Kinetostatics, FreedomSpaces, Correlation, SensorPlacement, Verification)

GROUPS: dict[Kind, str] = {
    Kind.FLEXURE: "flexures",
    Kind.LINK: "links",
    Kind.BODY: "bodies",
    Kind.EQUIVALENT_BODY: "bodies",
    Kind.SPRING: "springs",
    Kind.MASS: "bodies",
    Kind.SUPERELEMENT: "superelements",
    Kind.CLAMP: "ground",
    Kind.PARTLY_HELD: "ground",
    Kind.ARM: "rigid arms",
    Kind.NODE: "nodes",
    Kind.CENTRE: "nodes",
    Kind.PIEZO: "actuators",
    Kind.FLAGGED: "with warnings",
    Kind.FLAGGED_BODY: "with warnings",
    Kind.ACTUATOR: "actuators",
    Kind.SENSOR: "sensors",
    Kind.DASHPOT: "dashpots",
    Kind.STOP: "stops",
}
"""Groups of the legend."""

CLEAR = {Kind.EQUIVALENT_BODY: 0.45, Kind.FLAGGED_BODY: 0.45}
"""Opacity of what lets see through it."""

HIDING = 0.35
"""Opacity of rigid bodies that would hide the flexures."""

PICTURE_DPI = 90
"""Dots per inch of the picture."""


def scene_of(*shown: Shown, picture: bool = False) -> Scene:
    """The scene of a mechanism and of results of it, all of one design.

    shown: a mechanism, a plan or a full-order model, and results of it, in the order in which they are to be shown;
    results that hold their model may stand alone. `picture` adds one for where nothing can be drawn in three
    dimensions. Of mechanisms that are too large for a page parts are left out, or members drawn as lines; `notes` say
    so. Raises OptionError for what has no place in a scene, results without a model, and results of several designs;
    ModelError as `assemble`.
    """
    return scene_and_drawing(*shown, picture=picture)[0]


def scene_and_drawing(*shown: Shown, picture: bool = False) -> tuple[Scene, Drawing]:
    """The same, with the drawing that other designs of the mechanism may be put in the place of (`quick`)."""
    model = _model_of(shown)
    doubted = {name for own in shown if isinstance(own, CheckReport) for name in doubted_parts(own, model)}
    drawing = Drawing.of(model, doubted)
    parts = drawing.solids
    if not len(parts.points):
        raise OptionError("there is nothing to show: the mechanism has no nodes")
    found = _Found()
    for own in shown:
        found.add(drawing, own)
    low, high = parts.bounds()
    hiding = _hides(parts)
    scene = Scene(
        name=model.name,
        size=parts.size(),
        bounds=(triple(low), triple(high)),
        kinds=tuple(_kind(kind, hiding) for kind in sorted(parts.kinds)),
        parts=_parts(drawing, found.doubts),
        points=Buffer.floats(parts.points),
        triangles=Buffer.numbers(drawing.triangles.cells),
        lines=Buffer.numbers(drawing.lines.cells),
        dots=Buffer.numbers(drawing.dots.cells),
        motions=tuple(found.motions),
        sequences=tuple(found.sequences),
        marks=tuple(found.marks),
        picture=picture_of(draw_mechanism(model, dpi=PICTURE_DPI)) if picture else None,
        notes=tuple(dict.fromkeys((*parts.notes, *found.notes))),
    )
    for own in shown:
        if isinstance(own, Correlation):
            scene = with_test(scene, own)
    return scene, drawing


@dataclass
class _Found:
    """What results add to a scene."""

    motions: list[ShownMotion] = field(default_factory=list)
    sequences: list[Poses] = field(default_factory=list)
    marks: list[PlacedMark] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    doubts: dict[str, list[str]] = field(default_factory=dict)

    def add(self, drawing: Drawing, own: Shown) -> None:
        if isinstance(own, WITH_NOTES):
            self.notes += own.notes
        match own:
            case Modes():
                self.motions += mode_motions(drawing, own)
            case Statics():
                self.motions += static_motions(drawing, own)
            case Stroke():
                motions, sequences, notes = stroke_poses(drawing, own)
                self.motions += motions
                self.sequences += sequences
                self.notes += notes
            case Preload():
                self.motions += preload_motions(drawing, own)
            case Kinetostatics():
                self.motions += freedom_motions(drawing, own)
            case FreedomSpaces():
                self.motions += space_motions(drawing, own)
            case Drift():
                self.motions += drift_motions(drawing, own)
            case CheckReport():
                doubts = doubts_of(drawing, own)
                self.marks += doubts.marks
                self.notes += doubts.whole
                self.doubts |= doubts.by_part
            case Correlation():
                self.motions += paired_motions(drawing, own)
            case Verification():
                self.motions += verified_motions(drawing, own)
                self.notes.append("modes of the solid are drawn on the beams, whose nodes move as the solid does there")
            case SensorPlacement():
                self.motions += sensor_motions(drawing, own)


def _model_of(shown: Sequence[Shown]) -> FullOrderModel:
    """The one model of all. Raises OptionError."""
    models: list[FullOrderModel] = []
    for own in shown:
        if isinstance(own, Mechanism | Plan | FullOrderModel):
            models.append(assemble(own))
        elif isinstance(own, WITH_MODEL):
            models.append(own.model)
        elif isinstance(own, Verification):
            models.append(verified_shapes(own).model)
        elif not isinstance(own, WITHOUT):
            raise OptionError(
                f"{type(own).__name__} has no place in a scene; what has: a mechanism, its full-order model, modes,"
                " statics, a stroke, preload, kinetostatics, freedom spaces, drift, a check, a correlation, a"
                " placement of sensors, a verification"
            )
    if not models:
        told = " and ".join(type(own).__name__ for own in shown) or "nothing"
        raise OptionError(f"{told} holds no mechanism: show the mechanism with it, as in show(mechanism, [result])")
    first = models[0]
    for other in models[1:]:
        same = other.plan.topology.n_nodes == first.plan.topology.n_nodes and other.plan.is_posed == first.plan.is_posed
        if not same or not np.array_equal(other.positions, first.positions):
            raise OptionError(
                f"what is shown together is of one design: {first.name} and {other.name} differ in their nodes, their"
                " parameters or their pose"
            )
    return first


def facts_of(drawing: Drawing) -> list[tuple[Fact, ...]]:
    """Facts of every part of a drawing, in the order of its parts."""
    facts, names = Facts(drawing.model), drawing.solids.names
    return [facts.of(names[name], Kind(kind)) for name, kind in drawing.parts.tolist()]


def _parts(drawing: Drawing, doubts: Mapping[str, Sequence[str]]) -> tuple[ShownPart, ...]:
    names = drawing.solids.names

    def doubted(name: str, kind: Kind) -> tuple[Fact, ...]:
        own = () if kind in (Kind.ARM, Kind.CENTRE) else doubts.get(name, ())
        return tuple(("warning", text) for text in own)

    ranges = zip(*(_ranges(own) for own in (drawing.triangles, drawing.lines, drawing.dots)), strict=True)
    return tuple(
        ShownPart(names[name], Kind(kind).name.lower(), (*facts, *doubted(names[name], Kind(kind))), *own)
        for (name, kind), facts, own in zip(drawing.parts.tolist(), facts_of(drawing), ranges, strict=True)
    )


def _ranges(cells: Cells) -> list[Range]:
    starts = np.cumsum(cells.counts) - cells.counts
    return [*zip(starts.tolist(), cells.counts.tolist(), strict=True)]


def _kind(kind: Kind, hiding: bool) -> ShownKind:
    colour = "#" + "".join(f"{round(255 * share):02x}" for share in COLOURS[kind])
    opacity = HIDING if hiding and kind in (Kind.BODY, Kind.EQUIVALENT_BODY) else CLEAR.get(kind, 1.0)
    return ShownKind(kind.name.lower(), NAMES[kind], colour, opacity, GROUPS[kind])


def _hides(parts: Solids) -> bool:
    """Whether rigid bodies would hide most of the flexures, those in doubt included."""
    kinds = np.where(parts.face_kinds == Kind.FLAGGED, Kind.FLEXURE, parts.face_kinds)
    return visible_flexures(replace(parts, face_kinds=kinds), customary_camera(*parts.bounds())) < HIDDEN


def picture_of(figure: Figure) -> str:
    """A picture as data URI."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"
