"""The scene of a test: its points where they were measured, the directions there, lines between them, and shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.pages.viewer.geometry import DISPLACEMENT
from flexura.pages.viewer.motions import triple
from flexura.pages.viewer.scene import (
    UNKNOWN,
    Arrow,
    Buffer,
    Colouring,
    Fact,
    Scene,
    ShownKind,
    ShownMotion,
    ShownPart,
    Triple,
)
from flexura.tables import in_mm, percent, quantity
from flexura.testing.correlation import Correlation, shapes_of
from flexura.testing.measurement import IdentifiedModes, MeasuredChannel, Trace
from flexura.testing.rig import TURNS
from flexura.view import MODE_SIZE

KINDS = (
    ShownKind("trace", "lines between points", "#5b6b7f", 1.0, "test"),
    ShownKind("measured", "measured point", "#c8460f", 1.0, "test"),
    ShownKind("unmeasured", "point without a sensor", "#9aa3ad", 1.0, "test"),
)
THROUGH = 0.4
"""Opacity of the model around the points of a test, at most."""

LEAST_SIZE = 1e-3
"""Size of a scene whose points are all at one place, m."""


class Reading(NamedTuple):
    """A channel that says how its point moves, with its row of the shapes, and where and along what it reads."""

    channel: MeasuredChannel
    row: int
    at: Triple
    direction: Triple


@dataclass(frozen=True, eq=False)
class TestPoints:
    """Points of a test (k, 3), m, measured ones first, what is read at each of those, and lines (l, 2) between them."""

    __test__ = False

    places: Array
    read: Sequence[Sequence[Reading]]
    lines: Array

    @staticmethod
    def of(channels: Sequence[MeasuredChannel], traces: Sequence[Trace]) -> TestPoints:
        """Those of channels that have a place and a direction. Raises OptionError where none has."""
        read: dict[Triple, list[Reading]] = {}
        for row, c in enumerate(channels):
            if c.position is None or c.direction is None or c.quantity in TURNS:
                continue
            if np.isfinite((*c.position, *c.direction)).all():
                read.setdefault(_key(c.position), []).append(Reading(c, row, triple(c.position), triple(c.direction)))
        if not read:
            raise OptionError(
                "no channel has a position and a direction to show shapes at: universal files have them in datasets 15"
                " or 2411, other data in a file of channels"
            )
        number = {at: k for k, at in enumerate(dict.fromkeys((*read, *(_key(p) for t in traces for p in t))))}
        pairs = [(number[_key(a)], number[_key(b)]) for t in traces for a, b in pairwise(t)]
        return TestPoints(np.array([*number]), [*read.values()], np.array(pairs, dtype=int).reshape(-1, 2))

    def moved(self, shapes: Array) -> Array:
        """Displacements (k, 3, n) of shapes (p, n) at the channels: the least that these allow, none without any."""
        u = np.zeros((len(self.places), 3, shapes.shape[1]))
        for k, own in enumerate(self.read):
            u[k] = np.linalg.pinv(np.array([r.direction for r in own])) @ shapes[[r.row for r in own]]
        return u

    @property
    def size(self) -> float:
        """The longest side, m."""
        return max(float(np.ptp(self.places, axis=0).max()), LEAST_SIZE)

    @property
    def notes(self) -> list[str]:
        """What of the drawing is not measured."""
        bare, partly = len(self.places) - len(self.read), sum(_rank(own) < 3 for own in self.read)
        notes = [f"{bare} points of the lines have no sensor: they are drawn at rest"] if bare else []
        if partly:
            notes.append(f"{partly} of {len(self.read)} points move in the directions that were measured alone")
        return notes if len(self.lines) else [*notes, "the data have no lines between points (dataset 82, or traces)"]

    def parts(self, lines: int = 0, dots: int = 0) -> list[ShownPart]:
        """The lines, then every point with what is read there, behind so many lines and dots of others."""
        parts = [ShownPart("lines", "trace", (), (0, 0), (lines, len(self.lines)))] if len(self.lines) else []
        for k, place in enumerate(self.places):
            own = self.read[k] if k < len(self.read) else ()
            name = own[0].channel.node or own[0].channel.name if own else f"point {k + 1}"
            facts: list[Fact] = [("place", f"{in_mm(place)} mm")]
            facts += [(r.channel.name, f"along {', '.join(f'{x:.3g}' for x in r.direction)}") for r in own]
            kind = "measured" if own else "unmeasured"
            parts.append(ShownPart(f"measured {name}", kind, tuple(facts), (0, 0), (0, 0), (dots + k, 1)))
        return parts

    def arrows(self) -> tuple[Arrow, ...]:
        """The directions of the channels."""
        return tuple(Arrow(r.at, r.direction, r.channel.name) for own in self.read for r in own)


def _key(place: Sequence[float]) -> Triple:
    """A place to a nanometre."""
    return triple([round(float(x), 9) for x in place])


def _rank(own: Sequence[Reading]) -> int:
    return int(np.linalg.matrix_rank(np.array([r.direction for r in own])))


def scene_of_test(modes: IdentifiedModes) -> Scene:
    """Shapes of identified modes on the test's own points and lines, the real ones nearest to them.

    Raises OptionError where no channel has a place.
    """
    shapes = shapes_of(modes)
    points = TestPoints.of(shapes.channels, modes.traces)
    u = points.moved(shapes.real_shapes)
    still = ShownMotion(
        "channels",
        "test",
        "directions of the channels",
        Buffer.field(np.zeros((2 * len(points.places), 3))),
        "displacement",
        1.0,
        0.0,
        arrows=points.arrows(),
    )
    low, high = points.places.min(axis=0), points.places.max(axis=0)
    return Scene(
        name=modes.name,
        size=points.size,
        bounds=(triple(low), triple(high)),
        kinds=KINDS,
        parts=tuple(points.parts()),
        points=Buffer.floats(np.tile(points.places, (2, 1))),  # of the lines, and of the dots, in their colours
        triangles=Buffer.numbers(np.zeros((0, 3))),
        lines=Buffer.numbers(points.lines),
        dots=Buffer.numbers(np.arange(len(points.places)) + len(points.places)),
        motions=(*(_motion(modes, k, u[:, :, k], points.size) for k in range(len(modes.poles))), still),
        notes=(*points.notes, *shapes.notes),
    )


def _motion(modes: IdentifiedModes, k: int, u: Array, size: float) -> ShownMotion:
    largest, evidence = float(np.linalg.norm(u, axis=1).max()), modes.evidence[k]
    hz, zeta = quantity(float(modes.frequency_hz[k]), "Hz"), percent(float(modes.damping_ratio[k]))
    return ShownMotion(
        id=f"mode-{k + 1}",
        group="identified modes",
        title=f"mode {k + 1}: {hz}",
        displacement=Buffer.field(np.tile(u, (2, 1))),
        nature="vibration",
        factor=MODE_SIZE * size / largest if largest > 0 else 0.0,
        largest=None,
        subtitle=f"damping {zeta}, MPC {evidence.modal_phase_collinearity:.3f}",
        colours=(DISPLACEMENT,),
    )


def _with_blank(colour: Colouring, count: int) -> Colouring:
    """A colouring with so many more points of which nothing is known."""
    if colour.values is None:
        return colour
    stored = np.append(colour.values.stored, np.full(count, UNKNOWN, dtype="u1"))
    return replace(colour, values=replace(colour.values, stored=stored))


def with_test(scene: Scene, result: Correlation) -> Scene:
    """The scene of a correlation with the test's own points and lines, which move as measured beside the model's.

    Channels without a place or a direction have those that they are paired with.
    """
    found = zip(result.matched, result.sensors.positions, result.sensors.directions, strict=True)
    channels = [
        replace(m.channel, position=m.channel.position or triple(at), direction=m.channel.direction or triple(along))
        for m, at, along in found
    ]
    points = TestPoints.of(channels, result.traces)
    u = points.moved(result.measured)
    known = {f"{what}-{pair.test}": u[:, :, pair.test - 1] for pair in result.pairs for what in ("test", "model")}
    first, count = len(scene.points.stored), len(points.places)
    parts = points.parts(len(scene.lines.stored), len(scene.dots.stored))

    def moving(own: ShownMotion) -> ShownMotion:
        before = own.displacement.stored * (own.displacement.scale or 1.0)
        more = known.get(own.id, np.zeros((count, 3)))
        return replace(
            own,
            displacement=Buffer.field(np.concatenate([before, more, more])),
            colours=tuple(_with_blank(c, 2 * count) for c in own.colours),
            by_part=tuple(replace(by, values=(*by.values, *[""] * len(parts))) for by in own.by_part),
        )

    return replace(
        scene,
        kinds=(*(replace(own, opacity=min(own.opacity, THROUGH)) for own in scene.kinds), *KINDS),
        parts=(*scene.parts, *parts),
        points=Buffer.floats(np.concatenate([scene.points.stored, points.places, points.places])),
        lines=Buffer.numbers(np.concatenate([scene.lines.stored.reshape(-1, 2), points.lines + first])),
        dots=Buffer.numbers(np.concatenate([scene.dots.stored.ravel(), np.arange(count) + first + count])),
        motions=tuple(map(moving, scene.motions)),
        notes=(*scene.notes, *points.notes),
    )
