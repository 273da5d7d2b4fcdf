"""Virtual points: responses and impacts around an interface become motions and loads of one point that is rigid.

Least squares on rigid motion of the interface (van der Seijs, van den Bosch, Rixen and de Klerk 2013), and how well
each sensor and each impact agrees with the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError
from flexura.mechanism import DOF_NAMES
from flexura.results import plain
from flexura.structure import DERIVATIVE, Channel
from flexura.tables import Facts, Item, Table, counted, ends, vector
from flexura.testing.measurement import FORCES
from flexura.testing.substructuring.parts import (
    Part,
    Responses,
    Scatter,
    ScatteredResponse,
    is_turning,
    motion,
    part_of,
    powers_of,
)

UNSEEN = 1e-6
"""Singular values of rigid motions at the channels below this share of the largest belong to motions not seen."""

NAMED = 0.1
"""Share of a DOF in a motion that is not seen from which it is named."""

WEAK = 30.0
"""Condition of the rigid motions at the channels from which noise grows much on the way to the point."""

LOW_CONSISTENCY = 0.9
"""Consistency below which a channel does not fit rigid motion of the interface."""


@dataclass(frozen=True)
class VirtualPoint:
    """A point at a `position` (3,), m, whose `dofs` take the place of channels around it.

    `outputs` and `inputs` name the channels, wildcards allowed; by default they are those whose node has the name of
    the point.
    """

    position: tuple[float, float, float]
    dofs: tuple[str, ...] = DOF_NAMES
    outputs: tuple[str, ...] | None = None
    inputs: tuple[str, ...] | None = None


@dataclass(frozen=True)
class _Side:
    """Channels at one point, by their places among all of a side: rigid motions `R` (k, d) at them, `T` (d, k) that
    solves R q = u in the least squares, the `condition` of R with rotations in lengths, and the consistency (f, k)."""

    at: list[int]
    R: Array
    T: Array
    condition: float
    consistency: Array


@dataclass(frozen=True, repr=False)
class VirtualPointResponse(ScatteredResponse):
    """Responses with virtual points in the place of channels around them, with motions and loads `POINT.tx` to `.rz`.

    `sensor_consistency` and `impact_consistency` have by channel how it agrees with rigid motion of its interface over
    the frequencies (f,), between 0 and 1 (theory eq. H27). `conditions` are by point those of the motions that
    sensors and impacts tell apart, rotations in lengths; `counts` the sensors, impacts and DOFs.
    """

    _shown = ("name", "frequency_hz", "inputs", "outputs", "counts")

    sensor_consistency: Mapping[str, Array] = field(default_factory=dict)
    impact_consistency: Mapping[str, Array] = field(default_factory=dict)
    conditions: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    counts: Mapping[str, tuple[int, int, int]] = field(default_factory=dict)

    def _title(self) -> str:
        p, m, hz = len(self.outputs), len(self.inputs), self.frequency_hz
        points = counted(len(self.counts), "virtual point")
        return f"{p} x {m} responses at {counted(len(hz), 'frequency')}, {ends((hz[0], hz[-1]), 'Hz')}, {points}"

    def presentation(self) -> Iterator[Item]:
        """How well the points are determined, and how consistent their channels are."""
        counts, conditions = self.counts.values(), self.conditions.values()
        sides = list(zip(counts, conditions, strict=True))
        yield Table(
            {
                "point": list(self.counts),
                "sensors": [f"{n[0]} for {n[2]} DOFs, condition {c[0]:.3g}" for n, c in sides],
                "impacts": [f"{n[1]} for {n[2]} DOFs, condition {c[1]:.3g}" for n, c in sides],
            },
            "points",
        )
        tables = [("sensor", self.sensor_consistency), ("impact", self.impact_consistency)]
        rows = [(side, name, own) for side, table in tables for name, own in table.items()]
        yield Table(
            {
                "channel": [name for _, name, _ in rows],
                "is": [side for side, _, _ in rows],
                "consistency": [f"{own.mean():.3f}" for _, _, own in rows],
                "lowest consistency": [f"{own.min():.3f}" for _, _, own in rows],
                "at [Hz]": [float(self.frequency_hz[own.argmin()]) for _, _, own in rows],
            },
            "channels",
        )
        yield Facts({"scatter": "not known: no noise and no coherence with averages" if self.scatter is None else ""})

    def _data(self) -> dict[str, Any]:
        own = {
            "sensor_consistency": plain(self.sensor_consistency),
            "impact_consistency": plain(self.impact_consistency),
            "conditions": plain(self.conditions),
            "counts": plain(self.counts),
        }
        return {**super()._data(), "sigma": self.sigma, **own}


@verb
def virtual_points(
    data: Responses,
    points: Mapping[str, VirtualPoint | Sequence[float]],
    *,
    name: str | None = None,
    noise: float | None = None,
) -> VirtualPointResponse:
    """Responses at virtual points in the place of the channels around them, by least squares (theory eqs. H24-H27).

    `points` by name: a `VirtualPoint`, or its position (3,), m, with all channels whose node has the name of the point.
    Sensors have a position and a direction, as the measurement has them; so have impacts. Other channels stay as they
    are. `noise`, over the root mean square of every response, or else the coherence, gives the scatter (`sigma`).
    Channels of a consistency below 0.9, and points that are ill determined, are warned of.

    Raises OptionError for names without channels, channels without a place, with another quantity or in two points,
    fewer channels than DOFs, and DOFs that the channels do not tell apart, as sensors on one line.
    """
    if not points:
        raise OptionError("points: there is no virtual point; name one with its position, e.g. tip: (0.04, 0, 0.062)")
    title = name or getattr(data, "name", "") or "measurement"
    part = part_of(title, data, noise)
    asked = {key: _point(key, own) for key, own in points.items()}
    sensors, impacts = (
        _sides(part, asked, channels, side) for channels, side in ((part.outputs, "output"), (part.inputs, "input"))
    )
    Tu, outputs = _transformation(part.outputs, asked, sensors)
    Tf, inputs = _transformation(part.inputs, asked, impacts)
    scatter = part.scatter
    if scatter is not None:
        rows = Tu if scatter.rows is None else Tu @ scatter.rows
        scatter = Scatter(scatter.sigma, rows, Tf.T if scatter.columns is None else scatter.columns @ Tf.T)
    response = (Tu @ part.Y @ Tf.T) * part.s[:, None, None] ** powers_of(outputs)[:, None]
    told = [_told(key, asked[key], sensors[key], impacts[key], part) for key in asked]
    return VirtualPointResponse(
        *(title, part.frequency_hz, response, inputs, outputs, np.zeros(0), np.zeros(0), 0),
        notes=(*part.notes, *(note for notes, _ in told for note in notes)),
        known=(*part.warnings, *(warning for _, warnings in told for warning in warnings)),
        scatter=scatter,
        decay=part.decay,
        sensor_consistency=_by_name(part.outputs, sensors),
        impact_consistency=_by_name(part.inputs, impacts),
        conditions={key: (sensors[key].condition, impacts[key].condition) for key in asked},
        counts={key: (len(sensors[key].at), len(impacts[key].at), len(asked[key].dofs)) for key in asked},
    )


def _point(name: str, own: VirtualPoint | Sequence[float]) -> VirtualPoint:
    """A virtual point as it was asked for. Raises OptionError for positions and DOFs that are none."""
    point = own if isinstance(own, VirtualPoint) else VirtualPoint(tuple(own))  # pyright: ignore[reportArgumentType]
    try:
        position = np.array([float(x) for x in point.position])
    except (TypeError, ValueError):
        position = np.zeros(0)
    if position.shape != (3,) or not np.isfinite(position).all():
        raise OptionError(f"virtual point {name}: a position is three numbers in m, not {point.position!r}")
    wrong = next((dof for dof in point.dofs if dof not in DOF_NAMES), None)
    if wrong is not None or not point.dofs or len({*point.dofs}) < len(point.dofs):
        raise OptionError(f"virtual point {name}: DOFs are some of {', '.join(DOF_NAMES)}, not {point.dofs!r}")
    return point


def _sides(part: Part, points: Mapping[str, VirtualPoint], channels: Sequence[Channel], side: str) -> dict[str, _Side]:
    """The channels of one side at each point. Raises OptionError for those that are in two, or in none."""
    taken: dict[int, str] = {}
    found: dict[str, _Side] = {}
    for key, point in points.items():
        where = f"{part.name}: virtual point {key}"
        at = _chosen(where, key, point.outputs if side == "output" else point.inputs, channels, side)
        for k in at:
            if k in taken:
                raise OptionError(f"{where}: {side} {channels[k].name} belongs to virtual point {taken[k]} already")
            taken[k] = key
        Y = part.Y[:, at] if side == "output" else part.Y[:, :, at].transpose(0, 2, 1)
        own = [channels[k] for k in at]
        R = _rigid_motions(where, point, own, side)
        turning = np.array([is_turning(c.quantity) for c in own])
        found[key] = _solved(where, point, at, (R, turning), Y, side)
    return found


def _chosen(where: str, key: str, names: Sequence[str] | None, channels: Sequence[Channel], side: str) -> list[int]:
    known = ", ".join(c.name for c in channels)
    if names is None:
        at = [k for k, c in enumerate(channels) if c.node == key]
        if not at:
            nodes = ", ".join(dict.fromkeys(c.node for c in channels if c.node)) or "none"
            raise OptionError(
                f"{where}: no {side} is at a node of this name; nodes: {nodes}; name the channels"
                f" (VirtualPoint(..., {side}s=...)), of {known}"
            )
        return at
    for name in names:
        if not any(fnmatchcase(c.name, name) or c.name == name for c in channels):
            raise OptionError(f"{where}: there is no {side} {name!r}; known: {known}")
    return [k for k, c in enumerate(channels) if any(fnmatchcase(c.name, n) or c.name == n for n in names)]


def _rigid_motions(where: str, point: VirtualPoint, channels: Sequence[Channel], side: str) -> Array:
    """What each channel (k, d) reads of unit motions of the point, or does to it as a load (theory eq. H24)."""
    columns = [DOF_NAMES.index(dof) for dof in point.dofs]
    rows = np.zeros((len(channels), 6))
    powers = {DERIVATIVE.get(c.quantity) for c in channels}
    wanted = DERIVATIVE if side == "output" else FORCES
    for k, c in enumerate(channels):
        if c.quantity not in wanted or c.against is not None:
            what = "a motion" if side == "output" else "a force or a moment"
            raise OptionError(f"{where}: {side} {c.name} is no {what} of one place, but {c.quantity}")
        missing = [text for text, own in (("direction", c.direction), ("position", c.position)) if own is None]
        if missing:
            raise OptionError(f"{where}: {side} {c.name} has no {missing[0]}; give it in a file of channels")
        e, arm = np.array(c.direction), np.array(c.position) - np.array(point.position)
        turns = is_turning(c.quantity)
        rows[k] = np.concatenate([np.zeros(3), e] if turns else [e, np.cross(arm, e)])
    if side == "output" and len(powers) > 1:
        quantities = ", ".join(dict.fromkeys(c.quantity for c in channels))
        raise OptionError(f"{where}: its outputs are of several kinds: {quantities}; read all of them as one")
    return rows[:, columns]


def _solved(
    where: str, point: VirtualPoint, at: list[int], motions: tuple[Array, NDArray[np.bool_]], Y: Complex, side: str
) -> _Side:
    """The least squares, in lengths: a rotation counts as the motion at the root mean square of the arms. `motions` are
    those at the channels and which of these turn. Raises OptionError for DOFs that are not told apart."""
    R, turning = motions
    d, what = len(point.dofs), "sensors" if side == "output" else "impacts"
    if len(at) < d:
        raise OptionError(
            f"{where}: {counted(len(at), what[:-1])} for {d} DOFs ({', '.join(point.dofs)}): it takes {d} at least, or"
            " fewer DOFs (dofs=...)"
        )
    turns = np.array([dof.startswith("r") for dof in point.dofs])
    arms = R[~turning][:, turns]
    length = float(np.sqrt((arms**2).sum(axis=1).mean())) if arms.any() else 1.0
    size, weight = np.where(turns, length, 1.0), np.where(turning, length, 1.0)
    U, values, Vh = np.linalg.svd(R * weight[:, None] / size, full_matrices=False)
    if values[-1] <= UNSEEN * values[0]:
        shares = np.abs(Vh[values <= UNSEEN * values[0]]).max(axis=0)
        unseen = [dof for dof, share in zip(point.dofs, shares, strict=True) if share > NAMED]
        raise OptionError(
            f"{where}: its {len(at)} {what} do not tell apart {', '.join(unseen)}: they are on one line or look in too"
            f" few directions; add {what}, or leave DOFs out (dofs=...)"
        )
    T = (Vh.T / values) @ (U.T * weight) / size[:, None]
    return _Side(at, R, T, float(values[0] / values[-1]), consistency(R @ (T @ Y), Y))


def consistency(fitted: Complex, measured: Complex) -> Array:
    """How alike fitted and measured responses (f, k, m) of k channels are, (f, k), over all of their counterparts.

    1 where they are equal, 0 where they are opposite (van der Seijs and others 2013; theory eq. H27). Counterparts
    count alike, whatever their units.
    """
    level = np.sqrt((np.abs(measured) ** 2).mean(axis=(0, 1)))
    level = np.where(level > 0, level, 1.0)
    a, b = fitted / level, measured / level
    above = (np.abs(a + b) ** 2).sum(axis=2)
    below = 2 * (np.abs(a) ** 2 + np.abs(b) ** 2).sum(axis=2)
    return np.divide(above, below, out=np.ones_like(above), where=below > 0)


def _transformation(
    channels: Sequence[Channel], points: Mapping[str, VirtualPoint], sides: Mapping[str, _Side]
) -> tuple[Array, tuple[Channel, ...]]:
    """The matrix (p', p) from all channels to those that stay and the DOFs of the points, and what these are."""
    taken = {k for side in sides.values() for k in side.at}
    kept = [k for k in range(len(channels)) if k not in taken]
    rows, named = [np.eye(len(channels))[kept]], [channels[k] for k in kept]
    for key, point in points.items():
        side, x, y, z = sides[key], *(float(x) for x in point.position)
        own = np.zeros((len(point.dofs), len(channels)))
        own[:, side.at] = side.T
        rows.append(own)
        first = channels[side.at[0]].quantity
        kinds = FORCES if first in FORCES else [motion(DERIVATIVE[first], turns) for turns in (False, True)]
        for dof in point.dofs:
            a, b, c = np.eye(3)[DOF_NAMES.index(dof) % 3].tolist()
            named.append(Channel(f"{key}.{dof}", kinds[dof.startswith("r")], key, (a, b, c), (x, y, z)))
    return np.concatenate(rows), tuple(named)


def _by_name(channels: Sequence[Channel], sides: Mapping[str, _Side]) -> dict[str, Array]:
    pairs = ((k, own) for side in sides.values() for k, own in zip(side.at, side.consistency.T, strict=True))
    return {channels[k].name: own for k, own in pairs}


def _told(
    key: str, point: VirtualPoint, sensors: _Side, impacts: _Side, part: Part
) -> tuple[list[str], list[Diagnostic]]:
    """Notes and warnings of one point."""
    notes: list[str] = []
    warnings: list[Diagnostic] = []
    where = f"virtual point {key} at {vector(point.position, 'm')}"
    for side, channels, what in ((sensors, part.outputs, "sensor"), (impacts, part.inputs, "impact")):
        if len(side.at) == len(point.dofs):
            notes.append(f"{where}: as many {what}s as DOFs, {len(side.at)}: consistency says nothing of them")
        if side.condition > WEAK:
            text = f"{where}: its {what}s tell the DOFs apart with a condition of {side.condition:.3g}: noise grows so"
            text += " much; spread them, or leave out a DOF"
            warnings.append(Diagnostic("condition", key, side.condition, WEAK, "1", text))
        for k, own in sorted(zip(side.at, side.consistency.mean(axis=0), strict=True), key=lambda pair: pair[1]):
            if own < LOW_CONSISTENCY:
                text = f"{where}: {what} {channels[k].name} has a consistency of {own:.2f} with rigid motion of the"
                text += " interface: its direction, position or sign is wrong, or the interface bends"
                warnings.append(Diagnostic("consistency", channels[k].name, float(own), LOW_CONSISTENCY, "1", text))
    return notes, warnings
