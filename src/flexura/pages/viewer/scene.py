"""A scene as plain data: what pages show of a mechanism, and how its numbers travel."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.results import plain
from flexura.tables import scales_of

STEPS = 32_767
"""Steps of a field of displacements between nothing and its largest component."""

UNKNOWN = 255
"""What stands for a share that is not known; those that are known go from 0 to 254."""


@dataclass(frozen=True, eq=False)
class Buffer:
    """An array in a few bytes: `scale` times what is stored, as `dtype`, is what it stands for."""

    dtype: str
    stored: NDArray[Any]
    scale: float | None = None

    @staticmethod
    def floats(values: ArrayLike) -> Buffer:
        """Single precision."""
        return Buffer("f32", np.asarray(values, dtype="<f4"))

    @staticmethod
    def numbers(values: ArrayLike) -> Buffer:
        """Whole numbers from zero on."""
        return Buffer("u32", np.asarray(values, dtype="<u4"))

    @staticmethod
    def field(values: NDArray[np.float64]) -> Buffer:
        """Vectors in 65 535 steps from minus to plus the largest component."""
        largest = float(np.abs(values).max(initial=0.0))
        scale = largest / STEPS if largest > 0 else 1.0
        return Buffer("i16", np.round(values / scale).astype("<i2"), scale)

    @staticmethod
    def shares(values: NDArray[np.float64], largest: float) -> Buffer:
        """Values from zero to the largest, in 255 steps; NaN for those that are not known."""
        share = np.clip(np.nan_to_num(values) / (largest or 1.0), 0.0, 1.0)
        stored = np.where(np.isnan(values), UNKNOWN, np.round((UNKNOWN - 1) * share)).astype("u1")
        return Buffer("u8", stored, 1 / (UNKNOWN - 1))

    @property
    def raw(self) -> bytes:
        """What is stored, row by row, least significant byte first."""
        return np.ascontiguousarray(self.stored).tobytes()

    def _head(self) -> dict[str, Any]:
        head: dict[str, Any] = {"dtype": self.dtype, "shape": list(self.stored.shape)}
        return head if self.scale is None else {**head, "scale": self.scale}

    def deflated(self) -> dict[str, Any]:
        """As JSON has it: base64 of the deflated bytes."""
        return {**self._head(), "data": base64.b64encode(zlib.compress(self.raw)).decode()}

    def at(self, offset: int) -> dict[str, Any]:
        """As the header of a binary message has it, its bytes being `offset` behind the beginning of the message."""
        return {**self._head(), "offset": offset, "bytes": len(self.raw)}


class _Placeholder(NamedTuple):
    """Stands for a buffer until it is known where it is."""

    number: int


def to_json(data: object) -> Any:
    """Plain data for JSON of dataclasses, mappings, sequences, numbers and texts, buffers deflated."""
    return _told(data, Buffer.deflated)


def to_message(data: Mapping[str, object]) -> bytes:
    """The same as one binary message: the length of a JSON header as an unsigned 32-bit number, least significant byte
    first, the header, padded with spaces to a multiple of four bytes, and behind it all buffers, each at a multiple of
    four bytes, where the header says by `offset` from the beginning of the message."""
    found: list[Buffer] = []

    def place(buffer: Buffer) -> _Placeholder:
        found.append(buffer)
        return _Placeholder(len(found) - 1)

    told = _told(data, place)
    sizes = [-(-len(buffer.raw) // 4) * 4 for buffer in found]
    behind = np.cumsum([0, *sizes]).tolist()
    start = 0
    while True:  # offsets count from the beginning, and how long the header is depends on how many digits they have
        header = json.dumps(_placed(told, found, [start + own for own in behind]), allow_nan=False).encode()
        needed = 4 + -(-len(header) // 4) * 4
        if needed <= start:
            break
        start = needed
    pieces = [buffer.raw.ljust(size, b"\0") for buffer, size in zip(found, sizes, strict=True)]
    return b"".join([(start - 4).to_bytes(4, "little"), header.ljust(start - 4), *pieces])


def _placed(told: Any, found: list[Buffer], offsets: list[int]) -> Any:
    """The header, in which buffers are placeholders so far."""
    if isinstance(told, _Placeholder):
        return found[told.number].at(offsets[told.number])
    if isinstance(told, dict):
        return {name: _placed(own, found, offsets) for name, own in told.items()}
    return [_placed(own, found, offsets) for own in told] if isinstance(told, list) else told


def _told(data: Any, tell: Callable[[Buffer], Any]) -> Any:
    """Plain data, each buffer as `tell` has it."""
    if isinstance(data, Buffer):
        return tell(data)
    if is_dataclass(data):
        return {own.name: _told(getattr(data, own.name), tell) for own in fields(data)}
    if isinstance(data, Mapping):
        return {str(name): _told(own, tell) for name, own in data.items()}
    if isinstance(data, list | tuple):
        return [_told(own, tell) for own in data]
    return plain(data)


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
    its: the first, and how many. `choices` choose it in a file, as text, with what else they choose; a click copies the
    first."""

    name: str
    kind: str
    facts: tuple[Fact, ...]
    triangles: Range
    lines: Range = (0, 0)
    dots: Range = (0, 0)
    choices: tuple[Fact, ...] = ()


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
