"""The scenes of a report: everything that moves, and the doubts where they are."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence

from matplotlib.figure import Figure
from PIL import Image

from flexura.analysis import CheckReport, Modes
from flexura.errors import FlexuraError
from flexura.full_order import assemble
from flexura.pages.report.document import Block, Bullets, Content, Paragraph, ViewerFigure
from flexura.pages.report.subject import Subject
from flexura.pages.viewer import Shown, scene_of, to_json
from flexura.tables import counted
from flexura.view import draw_mechanism, draw_sheet, draw_warnings

PICTURE_DPI = 96
COLOURS = 96
"""Colours of the picture that stands where nothing moves."""
MODES = 6
"""Modes on that picture."""


def doubts_figure(subject: Subject, check: CheckReport) -> list[Block]:
    """The undeformed mechanism with marks where its warnings are; nothing without any."""
    if not check.warnings:
        return []
    model = assemble(subject.plan.at_rest(), subject.parameters)
    try:
        scene, picture = scene_of(model, check), png_of(draw_warnings(model, check))
    except FlexuraError as error:
        return [Paragraph(f"The warnings cannot be shown in three dimensions: {error}", "bad")]
    return [ViewerFigure("doubts", to_json(scene), picture, f"{scene.name}, with its warnings where they are")]


def scene_content(subject: Subject, shown: Sequence[Shown]) -> Content:
    """One scene of all results of a report that move, or why there is none."""
    try:
        scene = scene_of(subject.model, *shown)
    except FlexuraError as error:
        return Content([Paragraph(f"Nothing can be shown in three dimensions: {error}", "bad")], "failed")
    modes = [own for own in shown if isinstance(own, Modes)]
    picture = png_of(_sheet(modes[0]) if modes else draw_mechanism(subject.model))
    blocks: list[Block] = [
        ViewerFigure("scene", to_json(scene), picture, f"{scene.name}: {counted(len(scene.motions), 'motion')}")
    ]
    return Content([*blocks, Bullets(scene.notes, "soft")] if scene.notes else blocks)


def _sheet(found: Modes) -> Figure:
    """The first modes on one sheet."""
    modes = found.modes[:MODES]
    titles = [f"mode {mode.number}: {mode.frequency_text}" for mode in modes]
    said = [mode.motion.summary for mode in modes]
    flags = [mode.flag for mode in modes]
    return draw_sheet(found.model, found.shapes[:, :, : len(modes)], titles, said, flags=flags)


def png_of(figure: Figure) -> str:
    """A small PNG as a data URI."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=PICTURE_DPI)
    Image.open(drawn).convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE).save(packed, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(packed.getvalue()).decode()}"
