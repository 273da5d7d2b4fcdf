"""What a page shows in three dimensions, as data: SI units, global frame, all text plain."""

from __future__ import annotations

from dataclasses import dataclass, field

from flexura.pages.viewer.buffers import Buffer
from flexura.tables import scales_of

Triple = tuple[float, float, float]
Fact = tuple[str, str]
Range = tuple[int, int]


@dataclass(frozen=True)
class ShownKind:
    """A kind of part: its words in the legend, its colour as #rrggbb, its opacity, and the group that it is in."""

    key: str
    label: str
    colour: str
    opacity: float
    group: str


@dataclass(frozen=True)
class ShownPart:
    """A named part of one kind, by its key, with what there is to know of it, and which triangles, lines and dots are
    its: the first, and how many."""

    name: str
    kind: str
    facts: tuple[Fact, ...]
    triangles: Range
    lines: Range
    dots: Range


@dataclass(frozen=True)
class Colouring:
    """What colours the points of a motion: shares (v,) of the largest; None for the size of the displacement. `scales`
    are the units in which it is written, the largest first: the name of each, its size, and from which value on."""

    key: str
    label: str
    unit: str
    largest: float | None
    values: Buffer | None
    scales: tuple[tuple[str, float, float], ...] = field(init=False)

    def __post_init__(self) -> None:
        scales = tuple((scale.unit, scale.size, least) for scale, least in scales_of(self.unit))
        object.__setattr__(self, "scales", scales)


@dataclass(frozen=True)
class Axis:
    """A screw axis: a point on it, m, its direction, and its pitch, m/rad, None for a translation."""

    at: Triple
    direction: Triple
    pitch: float | None
    label: str


@dataclass(frozen=True)
class Arrow:
    """A force, a moment or a command, at a point, m."""

    at: Triple
    direction: Triple
    label: str


@dataclass(frozen=True)
class ByPart:
    """A number of each part in a motion, as text, in the order of the parts; empty where there is none."""

    label: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class ShownMotion:
    """A motion of all points: displacements (v, 3), m, times `factor`.

    nature: `vibration`, of which only the shape is known, or `displacement`, which is true at a factor of one; largest:
    the largest displacement, m, None where only the shape is known. flag: what is wrong, in a few words.
    """

    id: str
    group: str
    title: str
    displacement: Buffer
    nature: str
    factor: float
    largest: float | None
    subtitle: str = ""
    flag: str = ""
    colours: tuple[Colouring, ...] = ()
    axes: tuple[Axis, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    facts: tuple[Fact, ...] = ()
    by_part: tuple[ByPart, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Poses:
    """Motions that are played one after another, with the value at each."""

    id: str
    title: str
    motions: tuple[str, ...]
    label: str
    values: tuple[float, ...]
    unit: str


@dataclass(frozen=True)
class PlacedMark:
    """Something to be said of a place, m, and what of it stands there: a `doubt` or a `warning`, of a part where it is
    of one."""

    at: Triple
    text: str
    label: str
    severity: str
    part: str | None = None


@dataclass(frozen=True)
class Scene:
    """A mechanism to be looked at, with its motions.

    size: its longest side, m; bounds: lower and upper corner, m; points: (v, 3), m; triangles (t, 3), lines (l, 2) and
    dots (d,) index the points. picture: a PNG as data URI for where nothing can be drawn in three dimensions.
    """

    name: str
    size: float
    bounds: tuple[Triple, Triple]
    kinds: tuple[ShownKind, ...]
    parts: tuple[ShownPart, ...]
    points: Buffer
    triangles: Buffer
    lines: Buffer
    dots: Buffer
    motions: tuple[ShownMotion, ...] = ()
    sequences: tuple[Poses, ...] = ()
    marks: tuple[PlacedMark, ...] = ()
    picture: str | None = None
    notes: tuple[str, ...] = ()
    up: str = "z"
