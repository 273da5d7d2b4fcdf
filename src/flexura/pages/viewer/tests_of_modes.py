"""Shapes of a test, or of a solid, beside those of the model, and where the sensors of a test are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexura.errors import OptionError
from flexura.pages.viewer.geometry import DISPLACEMENT, Drawing, still, vibrating
from flexura.pages.viewer.motions import triple
from flexura.pages.viewer.scene import Arrow, Fact, ShownMotion
from flexura.solid.verification import ShapePairs, Verification
from flexura.tables import percent, quantity
from flexura.testing.correlation import Correlation
from flexura.testing.virtual import SensorPlacement
from flexura.view import mode_scale


def paired_motions(drawing: Drawing, result: Correlation) -> Iterator[ShownMotion]:
    """Every test mode, expanded to the mechanism, followed by its counterpart, both of the same size."""
    for k, pair in enumerate(result.pairs):
        shapes = result.expanded[:, :, pair.test - 1], result.counterparts[:, :, k]
        moved = [drawing.moved(np.real(u)) for u in shapes]
        factor = min((mode_scale(own) for own in moved if own.largest_motion() > 0), default=0.0)
        facts: tuple[Fact, ...] = (
            ("test", f"{quantity(pair.test_hz, 'Hz')}, damping {percent(pair.damping_ratio)}"),
            ("model", f"{quantity(pair.model_hz, 'Hz')}, {100 * pair.error:+.2g} %"),
            ("MAC", f"{pair.mac:.3f}"),
            ("not represented by the model's shapes", percent(pair.expansion_error)),
        )
        titles = (
            f"test mode {pair.test}: {quantity(pair.test_hz, 'Hz')}",
            f"model mode {pair.model}: {quantity(pair.model_hz, 'Hz')}",
        )
        for what, title, own in zip(("test", "model"), titles, moved, strict=True):
            yield ShownMotion(
                id=f"{what}-{pair.test}",
                group="test and model",
                title=title,
                **vibrating(own, factor),
                subtitle=f"MAC of the pair {pair.mac:.3f}",
                colours=(DISPLACEMENT,),
                facts=facts,
            )


def verified_motions(drawing: Drawing, result: Verification) -> Iterator[ShownMotion]:
    """Every mode of the solid, as the mechanism's nodes move in it, followed by its counterpart of the beams."""
    pairs = verified_shapes(result)
    row = next(own for own in result.rows if own.model == pairs.label)
    solid = np.asarray(pairs.solid.solution.shapes)
    for k, hz in enumerate(result.frequency_hz):
        known = result.uncertainty[k] if k < len(result.uncertainty) else None
        facts: list[Fact] = [("solid", f"{quantity(hz, 'Hz')}")]
        facts.append(("known to", f"{100 * known:.2g} %" if known is not None else "unknown: of one mesh alone"))
        moved = drawing.moved(solid[:, :, k])
        own, number, mac, error = row.frequency_hz[k], row.number[k], row.mac[k], row.error[k]
        shapes = [("solid", f"mode {k + 1} of the solid: {quantity(hz, 'Hz')}", moved)]
        if own is None or mac is None or error is None:
            subtitle = f"{pairs.label}: no mode of this shape"
        else:
            facts += [(pairs.label, f"{quantity(own, 'Hz')}, {100 * error:+.2g} %"), ("MAC", f"{mac:.4f}")]
            subtitle = f"{pairs.label}: {100 * error:+.2g} %, MAC {mac:.4f}"
            title = f"mode {number} of the beams: {quantity(own, 'Hz')}"
            shapes.append(("beams", title, drawing.moved(pairs.beams[:, :, k])))
        for what, title, shape in shapes:
            yield ShownMotion(
                id=f"{what}-{k + 1}",
                group="solid and beams",
                title=title,
                **vibrating(shape),
                subtitle=subtitle,
                colours=(DISPLACEMENT,),
                facts=tuple(facts),
            )


def verified_shapes(result: Verification) -> ShapePairs:
    """The shapes of a verification. Raises OptionError where it has none."""
    if result.shapes is None:
        raise OptionError(
            "there is nothing to show: the solid has not been solved, or has no shapes; show the mechanism"
        )
    return result.shapes


def sensor_motions(drawing: Drawing, result: SensorPlacement) -> Iterator[ShownMotion]:
    """Chosen sensors as arrows, by importance; nothing moves."""
    own = zip(result.sensors, result.positions, result.directions, result.turns, result.independence, strict=True)
    arrows = [
        Arrow(triple(at), triple(way), f"{k}: {name}{' (rotation)' if turn else ''}, independence {share:.2f}")
        for k, (name, at, way, turn, share) in enumerate(own, start=1)
        if np.isfinite(at).all()
    ]
    between = len(result.sensors) - len(arrows)
    notes = [f"{between} sensors between two nodes have no single place"] if between else []
    yield ShownMotion(
        id="sensors",
        group="sensors",
        title=f"{len(result.sensors)} of {len(result.candidates)} candidates for sensors",
        **still(drawing),
        subtitle=f"largest MAC of two modes {result.worst_mac:.2f}, condition {result.condition:.3g}",
        colours=(DISPLACEMENT,),
        arrows=tuple(arrows),
        facts=tuple(
            (name, f"independence {share:.2f}") for name, share in zip(result.sensors, result.independence, strict=True)
        ),
        warnings=tuple(notes),
    )
