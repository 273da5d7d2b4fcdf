"""What a check doubts, each at its place."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from flexura.analysis import CheckReport
from flexura.pages.viewer.geometry import Drawing
from flexura.pages.viewer.motions import triple
from flexura.pages.viewer.scene import PlacedMark
from flexura.structure import FullOrderModel, solids_of

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
    return own | {name for doubt in report.doubts for name in doubt.places or (doubt.place,) if name in known}


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
    for doubt in report.doubts:
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
