"""What a check doubts, each at its place."""

from __future__ import annotations

import numpy as np

from flexura.analysis import CheckReport
from flexura.pages.viewer.geometry import Drawing
from flexura.pages.viewer.motions import triple
from flexura.pages.viewer.scene import PlacedMark
from flexura.structure import FullOrderModel, solids_of

CLASHES = {"clash", "deep", "touch", "gap"}


def doubted_parts(report: CheckReport, model: FullOrderModel) -> set[str]:
    """Names of the members and bodies in doubt."""
    own = {name for clash in report.clashes for name in clash.parts}
    bars, bodies = solids_of(model)
    known = {*bars.names, *bars.labels, *bodies.names, *bodies.labels}
    return own | {doubt.place for doubt in report.doubts if doubt.place in known}


def doubt_marks(drawing: Drawing, report: CheckReport) -> tuple[list[PlacedMark], list[str]]:
    """Doubts about parts at their places, and those about the whole as text."""
    marks = [PlacedMark(triple(own.at), f"{own.first}: {own.text}", "doubt", own.first) for own in report.clashes]
    bars, bodies = solids_of(drawing.model)
    middles = bars.origin + bars.axes[:, 0] * bars.length[:, None] / 2
    places = [*zip(bars.names, bars.labels, middles, strict=True)]
    places += zip(bodies.names, bodies.labels, bodies.origin, strict=True)
    nodes = {name: k for k, name in enumerate(drawing.model.plan.topology.node_names)}
    whole = []
    for doubt in report.doubts:
        found = [(name, at) for name, label, at in places if doubt.place in (name, label)]
        if not found and doubt.place in nodes:
            found = [(doubt.place, drawing.model.positions[nodes[doubt.place]])]
        if doubt.kind in CLASHES and report.clashes:
            continue
        if found:
            marks.append(PlacedMark(triple(np.asarray(found[0][1])), str(doubt), "doubt", found[0][0]))
        else:
            whole.append(f"doubt: {doubt}")
    return marks, whole
