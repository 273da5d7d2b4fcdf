"""Freedoms of a platform and drifting axes as motions with screw axes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexura.analysis import Drift, Freedom, Kinetostatics, response_to
from flexura.pages.viewer.fields import DISPLACEMENT, Energy
from flexura.pages.viewer.geometry import Drawing, still, vibrating
from flexura.pages.viewer.motions import shown_axis
from flexura.pages.viewer.scene import Fact, ShownMotion
from flexura.tables import number, quantity

WORDS = {"R": "rotation", "T": "translation"}


def freedom_motions(drawing: Drawing, result: Kinetostatics) -> Iterator[ShownMotion]:
    """Every freedom of the platform, as its actuators make it, or a wrench at it where there are none."""
    for k, freedom in enumerate(result.freedoms):
        u = drawing.model.node_displacements(_response(drawing, result, freedom)[:, None])
        moved, energy = drawing.moved(u[:, :, 0]), Energy(drawing, u)
        coloured = energy.colouring(0)
        yield ShownMotion(
            id=f"freedom-{k + 1}",
            group="freedoms",
            title=f"freedom {k + 1}: {WORDS[freedom.kind]} of {result.platform}",
            **vibrating(moved),
            subtitle=f"freedoms of {result.platform}: {result.kind}",
            colours=(DISPLACEMENT, *([coloured] if coloured else [])),
            axes=(shown_axis(freedom.axis, f"freedom {k + 1}"),),
            facts=tuple(_facts(result, freedom)),
            by_part=(energy.by_part(0),),
            warnings=tuple(str(own) for own in result.warnings),
        )


def drift_motions(drawing: Drawing, result: Drift) -> Iterator[ShownMotion]:
    """The screw axis at rest and the displaced one; nothing moves."""
    facts: list[Fact] = [("shift", quantity(result.distance, "m", 4)), ("tilt", quantity(result.tilt, "rad", 4))]
    yield ShownMotion(
        id="drift",
        group="drift",
        title=f"drift of the axis: {quantity(result.distance, 'm', 4)}, {quantity(result.tilt, 'rad', 4)}",
        **still(drawing),
        colours=(DISPLACEMENT,),
        axes=(shown_axis(result.rest, "undeformed"), shown_axis(result.displaced, "displaced")),
        facts=tuple(facts),
    )


def _response(drawing: Drawing, result: Kinetostatics, freedom: Freedom) -> np.ndarray:
    """Displacements (n,) of the freedom, of any size."""
    if any(freedom.command):
        commands = {own.name: value for own, value in zip(result.inputs, freedom.command, strict=True) if value}
        return response_to(drawing.model, commands).displacement_vector
    wrench = np.linalg.lstsq(result.compliance, np.array(freedom.twist), rcond=1e-12)[0]
    return response_to(drawing.model, loads={result.platform: wrench}).displacement_vector


def _facts(result: Kinetostatics, freedom: Freedom) -> list[Fact]:
    unit = "rad" if freedom.kind == "R" else "m"
    found: list[Fact] = [("twist", ", ".join(number(own, 4) for own in freedom.twist))]
    if np.isfinite(freedom.share):
        found.append(("share that the actuators own", f"{100 * freedom.share:.3g} %"))
    if freedom.stroke is not None:
        found.append(("stroke to either side", quantity(freedom.stroke, unit, 4)))
    if freedom.yield_stroke is not None:
        beyond = "" if freedom.yields_in_range else ", beyond what linear theory holds for"
        found.append(("something yields at", quantity(freedom.yield_stroke, unit, 4) + beyond))
    if freedom.shift is not None:
        found.append(("axis shifts at the end of the stroke", quantity(freedom.shift, "m", 4)))
    if freedom.tilt is not None:
        found.append(("axis tilts there", quantity(freedom.tilt, "rad", 4)))
    found += [
        (f"command of {own.name}", quantity(value, f"{own.unit}/{unit}", 4))
        for own, value in zip(result.inputs, freedom.command, strict=False)
        if value
    ]
    return found
