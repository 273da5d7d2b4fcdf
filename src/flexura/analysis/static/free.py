"""Freedom and constraint spaces of bodies as screws, and how pure they are in energy and in compliance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.analysis.static.counting import Count, counted_between
from flexura.analysis.static.deformations import GROUND, LEAST_GAP, Skeleton
from flexura.analysis.static.freedoms import ComplianceSpectrum, compliance_spectrum
from flexura.analysis.strain import ScrewAxis, screw_axis
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import Diagnostic, SolverError
from flexura.full_order import unloaded
from flexura.mechanism import Mechanism
from flexura.records import Record
from flexura.reduction import flexibility, stored_flexibility
from flexura.results import Tabular, plain
from flexura.screws import Screw, ScrewSpace
from flexura.structure import FullOrderModel, Plan
from flexura.tables import Facts, Item, Table, counted, in_mm, number, percent, quantity
from flexura.thresholds import ROUND_OFF, STATIC_ROUND_OFF

ALIKE = 1e-6
"""Directions, and pitches and distances over the characteristic length, that differ by no more are the same."""


@dataclass(frozen=True, repr=False)
class SpaceScrew(Record):
    """A screw of a space: a `rotation`, `translation` or `screw` that is free, or a `force`, `couple` or `wrench` that
    is borne, with its axis; its pitch is m/rad, or N m/N.

    Of what is free, `energy` is that in stiff deformations over that in soft ones, `elastic` the axis that the
    compliance shows in its place, `offset`, m, the distance of both at the ideal axis' point, nan where either is a
    translation, and `tilt`, rad, the angle between them; None where there is no compliance.
    """

    kind: str
    axis: ScrewAxis
    energy: float | None = None
    elastic: ScrewAxis | None = None
    offset: float | None = None
    tilt: float | None = None

    @property
    def told(self) -> str:
        """What it is, with its pitch."""
        return f"{self.kind}, {_pitch(self.axis)}" if self.kind in ("screw", "wrench") else self.kind

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, axes by their `direction`, `point` and `pitch`."""
        told = {name: value for name, value in vars(self).items() if name not in ("axis", "elastic")}
        elastic = None if self.elastic is None else _axis(self.elastic)
        return plain({**told, **_axis(self.axis), "elastic": elastic})


def _axis(own: ScrewAxis) -> dict[str, Any]:
    return {"direction": own.direction, "point": own.point, "pitch": own.pitch}


@dataclass(frozen=True, repr=False)
class SpannedSpace(Record):
    """A space of twists that are free or wrenches that are borne: its `name`, its `dimension`, what its `lines` are,
    pure rotations or forces, and of what dimension they are alone (`by_lines`), and `screws` that span it."""

    name: str
    dimension: int
    lines: str
    by_lines: int
    screws: tuple[SpaceScrew, ...]


@dataclass(frozen=True, repr=False)
class BodySpaces(Record):
    """What one body is free in and what it is held by (theory eqs. Y12-Y15).

    `freedom` and `constraint` are reciprocal; `is_parallel` when forces along lines alone span the constraints, so that
    wires and leaves side by side make them. `energy` are the energies in stiff over those in soft deformations of its
    motions, ascending, of which the first are the freedoms.

    Compliances are those of the elastic mechanism at `centre` (3,), m, rotations counted at the characteristic
    `length`, m: `compliance` (6,), m/N, by size, `gap` the least of what is free over the largest under what is borne,
    and `outside` the share of their sum that is outside of the freedom space. `counted` are the freedoms that the
    compliances show by themselves, None where they show no clear gap. All are None where something is loose.
    """

    body: str
    freedom: SpannedSpace
    constraint: SpannedSpace
    is_parallel: bool
    energy: tuple[float, ...]
    centre: tuple[float, float, float]
    length: float
    compliance: tuple[float, ...] | None = None
    gap: float | None = None
    outside: float | None = None
    counted: int | None = None


@dataclass(frozen=True, repr=False)
class FreedomSpaces(Tabular):
    """Freedom and constraint spaces of the bodies of a mechanism, relative to the body that is `held`, or of the second
    of two relative to the first; `over` counts over-constraints, as `constraints` does."""

    _shown = ("name", "held", "bodies", "over", "warnings")

    name: str
    held: str
    between: tuple[str, str] | None
    bodies: tuple[BodySpaces, ...]
    over: int
    model: FullOrderModel = field(repr=False)
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    def _title(self) -> str:
        told = [f"{own.body} has {counted(own.freedom.dimension, 'freedom')}" for own in self.bodies]
        return f"{', '.join(told[:3])} relative to {self.held}" + (", ..." if len(told) > 3 else "")

    def presentation(self) -> Iterator[Item]:
        own = self.bodies
        columns = {
            "body": [body.body for body in own],
            "is free in": [_told(body.freedom) for body in own],
            "is held by": [_told(body.constraint) for body in own],
            "lines make": ["all of it" if body.is_parallel else f"{body.constraint.by_lines} of it" for body in own],
            "stiff over soft energy": [_energies(body) for body in own],
            "gap": [body.gap for body in own],
            "outside": [percent(body.outside, 2) for body in own],
        }
        yield Table(columns, "bodies")
        for title, space in (("freedoms", "freedom"), ("constraints", "constraint")):
            screws = [(body.body, screw) for body in own for screw in getattr(body, space).screws]
            if screws:
                yield Table(_screw_columns(screws, space == "freedom"), "screws", title)
        yield Facts({"over-constraints": self.over})

    def _columns(self) -> dict[str, Any]:
        rows = [
            (body.body, kind, screw)
            for body in self.bodies
            for kind, space in (("freedom", body.freedom), ("constraint", body.constraint))
            for screw in space.screws
        ]
        columns: dict[str, Any] = {
            "body": [body for body, *_ in rows],
            "space": [kind for _, kind, _ in rows],
            "screw": [screw.kind for *_, screw in rows],
        }
        for k, axis in enumerate("xyz"):
            columns[f"direction {axis}"] = [screw.axis.direction[k] for *_, screw in rows]
        for k, axis in enumerate("xyz"):
            columns[f"point {axis} [m]"] = [screw.axis.point[k] for *_, screw in rows]
        columns["pitch [m]"] = [screw.axis.pitch for *_, screw in rows]
        for name, own in (("stiff over soft energy", "energy"), ("offset [m]", "offset"), ("tilt [rad]", "tilt")):
            values = [getattr(screw, own) for *_, screw in rows]
            columns[name] = [np.nan if value is None else value for value in values]
        return columns


def _told(space: SpannedSpace) -> str:
    return f"{space.dimension}: {space.name}" if space.dimension else space.name


def _screw_columns(screws: Sequence[tuple[str, SpaceScrew]], is_free: bool) -> dict[str, Any]:
    """What is told of screws of bodies."""
    own = [screw for _, screw in screws]
    columns: dict[str, Any] = {
        "body": [body for body, _ in screws],
        "screw": [screw.kind for screw in own],
        "axis": [" ".join(f"{x:+.4f}" for x in screw.axis.direction) for screw in own],
        "through mm": ["" if screw.axis.is_translation else in_mm(screw.axis.point) for screw in own],
        "pitch": [_pitch(screw.axis) for screw in own],
    }
    if is_free:
        columns["stiff over soft energy"] = ["" if x.energy is None else number(x.energy, 3) for x in own]
        columns["elastic axis off by"] = [
            ", ".join(quantity(x, unit, 3) for x, unit in ((own.offset, "m"), (own.tilt, "rad")) if _is_known(x))
            for own in own
        ]
        turned = [None if x.axis.is_translation else x.elastic for x in own]
        columns["its pitch"] = ["" if axis is None else _pitch(axis) for axis in turned]
    return columns


def _pitch(axis: ScrewAxis) -> str:
    """The pitch in few digits, without what is round-off."""
    return "" if axis.is_translation else f"{number(round(1e3 * axis.pitch, 6), 4)} mm"


def _is_known(value: float | None) -> bool:
    return value is not None and np.isfinite(value)


def _energies(own: BodySpaces) -> str:
    """Those of freedoms at most, and of constraints at least."""
    free, fixed = _extremes(own.energy, own.freedom.dimension)
    said = [f"at most {number(free, 3)} free"] if own.freedom.dimension else []
    return ", ".join([*said, *([f"at least {number(fixed, 3)} held"] if own.constraint.dimension else [])])


def _extremes(energy: Sequence[float], freedoms: int) -> tuple[float, float]:
    """The largest of the energies of freedoms and the least of those of constraints."""
    return max(energy[:freedoms], default=0.0), min(energy[freedoms:], default=np.inf)


@verb
def free(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    between: Sequence[str] | None = None,
) -> FreedomSpaces:
    """Freedom and constraint spaces of each described body as screws, and how pure they are (theory eqs. Y12-Y15).

    Deformations are stiff or soft, and bodies rigid, as `constraints` has them. Motions of a body whose energy is in
    soft deformations, while all else is where it will, are its freedom space, twists; the wrenches that do no work on
    these its constraint space (Ball 1900; Hopkins and Culpepper 2010). Both are named and given by screws that span
    them: lines where these may, and else principal screws. Beside them stands what the stiffness of the elastic
    mechanism shows. `between` two bodies, nodes or `ground`, it is what the second is free in relative to the first.
    `parameters` replace those of the description, SI.

    Raises ModelError; OptionError for unknown bodies, two that are one, a described pose, and where nothing is elastic.
    """
    own = unloaded(model, parameters)
    found, count, pair = counted_between(own, between)
    if pair is None:
        numbers = [b for b in found.described if b != count.held] or count.moving
        bodies = {b: found.names[b] for b in numbers}
        held = found.names[count.held]
    else:
        held, second = (str(name) for name in between)  # type: ignore[union-attr]
        bodies = {pair[1]: second}
    spaces, notes = [], list(found.notes)
    compliances: Sequence[Array | None]
    try:
        compliances = _compliances_of(own, [(held, name) for name in bodies.values()], found.ground is not None)
    except SolverError:
        compliances = len(bodies) * [None]
        notes.append("something moves without any stiffness: there are no compliances")
    for (body, name), C in zip(bodies.items(), compliances, strict=True):
        node = _node(own, held, name)
        spaces.append(_spaces(found, count, body, name, None if C is None else compliance_spectrum(own, node, C)))
    return FreedomSpaces(
        name=own.name,
        held=held,
        between=None if pair is None else (held, bodies[pair[1]]),
        bodies=tuple(spaces),
        over=count.over,
        model=own,
        notes=tuple(notes),
        warnings=tuple(warning for space in spaces for warning in _unclear(space)),
    )


def _compliances_of(model: FullOrderModel, pairs: Sequence[tuple[str, str]], is_held: bool) -> list[Array]:
    """Compliance (6, 6), global frame, SI, of the second node of each pair under wrenches at it and against them at the
    first; `ground` does not move, which is the same whichever is named first.

    Where nothing is held, springs hold the first of the first pair, which such wrenches do not strain. Raises
    SolverError.
    """
    x, rows = model.geometry.positions, []
    for held, name in pairs:
        number = _node(model, held, name)
        own = _rows(model, number)
        if GROUND not in (held, name):
            first = _node(model, GROUND, held)
            own = own - rigid_arm(x[number] - x[first]) @ _rows(model, first)
        rows.append(own)
    if is_held:
        solve = flexibility(model).held
    else:
        at = sp.csc_matrix(_rows(model, _node(model, GROUND, pairs[0][0])))
        size = (at @ model.K @ at.T).diagonal()
        springs = sp.diags(np.repeat([size[:3].max(), size[3:].max()], 3))
        solve = stored_flexibility(sp.csc_matrix(model.K + at.T @ springs @ at), model.M, 0.0).held
    moved = solve(np.concatenate(rows).T.copy())
    return [own @ moved[:, 6 * k : 6 * k + 6] for k, own in enumerate(rows)]


def _node(model: FullOrderModel, held: str, name: str) -> int:
    """The number of the node of a name, of the other one where that is `ground`."""
    return int(model.plan.topology.numbers([held if name == GROUND else name])[0])


def _rows(model: FullOrderModel, number: int) -> Array:
    """Rows (6, n) that read the displacement of a node."""
    return model.design.node_rows(np.array([number])).toarray()


def _spaces(found: Skeleton, count: Count, body: int, name: str, spectrum: ComplianceSpectrum | None) -> BodySpaces:
    """Both spaces of a body, by the count, beside its compliances."""
    centre, length = (found.points[body], found.size) if spectrum is None else (spectrum.centre, spectrum.length)
    motions = count.of_bodies(body)
    arm = rigid_arm(centre - found.points[body]) / np.repeat([1.0, found.size], 3)
    unit = np.repeat([length, 1.0], 3)
    columns = arm @ motions.freedoms / unit[:, None]
    size = np.linalg.norm(columns, axis=0)
    freedom = ScrewSpace("twists", la.svd(columns / size, full_matrices=False)[0], length, ALIKE)
    constraint = freedom.reciprocal()
    free: list[SpaceScrew] = []
    for screw in freedom.simplest():
        twist = unit * (freedom.basis @ (freedom.basis.T @ (screw.components("twists") / unit)))
        free.append(
            SpaceScrew(
                screw.word("twists"),
                _placed(screw, centre),
                _above_round_off(motions.odds_of(la.solve(arm, twist))),
                **({} if spectrum is None else _elastic(spectrum, freedom.dimension, screw)),
            )
        )
    borne = [SpaceScrew(own.word("wrenches"), _placed(own, centre)) for own in constraint.simplest()]
    spaces = (_spanned(freedom, free), _spanned(constraint, borne))
    return BodySpaces(
        name,
        *spaces,
        is_parallel=spaces[1].by_lines == spaces[1].dimension,
        energy=tuple(_above_round_off(own) for own in motions.odds.tolist()),
        centre=_triple(centre),
        length=length,
        **({} if spectrum is None else _purity(spectrum, freedom, constraint)),
    )


def _spanned(space: ScrewSpace, screws: Sequence[SpaceScrew]) -> SpannedSpace:
    return SpannedSpace(space.name, space.dimension, space.variety, space.lines().dimension, tuple(screws))


def _placed(screw: Screw, centre: Array) -> ScrewAxis:
    """A screw about a centre (3,), m, in the global frame."""
    return ScrewAxis(_triple(screw.direction), _triple(screw.point + centre), screw.pitch)


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def _above_round_off(odds: float) -> float:
    return odds if odds > ROUND_OFF else 0.0


def _purity(spectrum: ComplianceSpectrum, freedom: ScrewSpace, constraint: ScrewSpace) -> dict[str, Any]:
    """How far the compliance and the spaces agree (theory eq. Y14)."""
    C = (spectrum.axes * spectrum.compliance) @ spectrum.axes.T
    free, held = (space.basis.T @ C @ space.basis for space in (freedom, constraint))
    between = 0 < freedom.dimension < 6
    return {
        "compliance": tuple(spectrum.compliance.tolist()),
        "gap": float(la.eigvalsh(free)[0] / la.eigvalsh(held)[-1]) if between else None,
        "outside": float(np.trace(held) / np.trace(C)),
        "counted": spectrum.count if spectrum.is_clear else None,
    }


def _elastic(spectrum: ComplianceSpectrum, count: int, screw: Screw) -> dict[str, Any]:
    """The axis nearest to a screw among the most compliant motions, how far off it is, m, and by what angle, rad
    (theory eq. Y15); nothing where it has no part in them."""
    unit = np.repeat([spectrum.length, 1.0], 3)
    E, wanted = spectrum.axes[:, :count], screw.components("twists") / unit
    twist = unit * (E @ (E.T @ wanted))
    if np.linalg.norm(twist / unit) < ALIKE * np.linalg.norm(wanted):
        return {}
    if np.linalg.norm(twist[3:]) * spectrum.length <= ALIKE * np.linalg.norm(twist[:3]):
        twist[3:] = 0.0
    turns = not np.isinf(screw.pitch)
    axis = screw_axis(twist, screw.point)
    along = twist[3:] if turns else twist[:3]
    tilt = np.arctan2(np.linalg.norm(np.cross(screw.direction, along)), screw.direction @ along)
    off = float(np.linalg.norm(np.subtract(axis.point, screw.point))) if turns else np.nan
    placed = _placed(Screw(np.array(axis.direction), np.array(axis.point), axis.pitch), spectrum.centre)
    return {
        "elastic": placed,
        "offset": 0.0 if off < STATIC_ROUND_OFF * spectrum.length else off,
        "tilt": 0.0 if tilt < STATIC_ROUND_OFF else float(tilt),
    }


def _unclear(own: BodySpaces) -> Iterator[Diagnostic]:
    """Where what is free and what is held are not far apart, or where the stiffness shows other freedoms."""
    d = own.freedom.dimension
    free, fixed = _extremes(own.energy, d)
    if max(free, 1 / fixed) > 1 / LEAST_GAP:
        text = f"the freedoms of {own.body} are not clear: energy in stiff over soft deformations {_energies(own)}"
        yield Diagnostic("no gap", own.body, max(free, 1 / fixed), 1 / LEAST_GAP, "1", text)
    if own.gap is not None and own.gap < LEAST_GAP:
        text = f"the freedoms of {own.body} are only {own.gap:.3g} times as compliant as what holds it"
        yield Diagnostic("no gap", own.body, own.gap, LEAST_GAP, "1", text)
    if own.counted is not None and own.counted != d:
        text = f"the stiffness shows {counted(own.counted, 'freedom')} of {own.body}, and its constraints leave {d}"
        yield Diagnostic("no gap", own.body, own.counted, d, "1", text)
