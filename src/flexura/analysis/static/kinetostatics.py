"""How actuators move a platform: coupling, amplification, stiffness, workspace, freedoms and their screw axes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from flexura.analysis.limits import States, motion_limits, not_looked_at, workspace_limits
from flexura.analysis.model_error import NO_ERRORS, ModelError, errors_of
from flexura.analysis.static.freedoms import (
    GAP,
    NOISE,
    ComplianceSpectrum,
    Freedom,
    compliance_spectrum,
    freedom,
    screws,
    stiffness_without_springs,
)
from flexura.analysis.static.statics import Statics, response_to
from flexura.analysis.strain import finite_numbers, motion_meshes, screw_axis, tangent_stiffness
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import Diagnostic, OptionError
from flexura.mechanism import DOF_NAMES, STIFFNESS_UNITS, UNITS, Mechanism
from flexura.reduction import STATE, flexibility, stored_flexibility
from flexura.results import Result
from flexura.structure import FullOrderModel, Plan, assemble
from flexura.systems import Channel, Ports
from flexura.tables import ROUND_OFF, Facts, Table, in_mm, number, percent, quantity, scale_for

OWNED = 0.5
"""Share of a compliance that locking the actuators takes away, from which it is a freedom."""

HELD = 1e-9
"""Compliances below so much of what they stand beside are none."""

LEAST = 1e-7
"""Drifts below this, m or rad, are round-off."""

ROUNDING = 1e-8
"""Compliances below so much of their bound, sqrt(S_ii S_jj), are round-off."""


@dataclass(frozen=True, repr=False)
class Kinetostatics(Result):
    """A platform, node `platform`, under the actuators `inputs` (a).

    coupling (6, a): its displacement per unit command; compliance (6, 6) with the actuators mounted and not driven,
    compliance_free (6, 6) as if they had no stiffness along their line, compliance_locked (6, 6) with their lengths
    held; jacobian (6, a): its displacement per unit elongation of each while the others keep their lengths;
    input_stiffness (a,), N/m or N m/rad: what each has to push against, its own stiffness left out; elongation (a, a)
    of each per unit command of each; workspace (6, 2): least and largest displacement within the limits of the
    commands, one coordinate at a time, infinite without limits; spectrum: the compliances without the actuators'
    stiffness on one scale. `is_clear` is False where there are no actuators and no gap in the spectrum tells freedoms
    from constraints. SI, global frame.
    """

    _shown = ("platform", "kind", "inputs", "freedoms", "warnings")

    platform: str
    inputs: tuple[Channel, ...]
    coupling: Array
    compliance: Array
    compliance_free: Array
    compliance_locked: Array
    jacobian: Array
    input_stiffness: Array
    elongation: Array
    workspace: Array
    limits: tuple[tuple[float, float], ...]
    freedoms: tuple[Freedom, ...]
    spectrum: ComplianceSpectrum
    is_clear: bool
    notes: tuple[str, ...] = field(default=())
    warnings: tuple[Diagnostic, ...] = ()
    model_errors: ModelError = NO_ERRORS
    """How far the part may be from the model: of `compliance` along the six coordinates, of `input_stiffness`, and of
    `coupling`, row by row."""

    @property
    def model_error(self) -> dict[str, Any]:
        """Where the part's `stiffness` (6,), `input_stiffness` (a,) and `coupling` (6, a) lie: between 1 + low and
        1 + high times those given; None where there is no evidence, or nothing moves."""
        own, a = self.model_errors.intervals, len(self.inputs)
        rows = [list(own[k : k + a]) for k in range(6 + a, 6 + 7 * a, max(a, 1))]
        return {"stiffness": list(own[:6]), "input_stiffness": list(own[6 : 6 + a]), "coupling": rows}

    @property
    def kind(self) -> str:
        """Freedoms in the usual short form, e.g. `2R1T`; `unclear` where they are not clear cut."""
        if not self.is_clear:
            return "unclear"
        counts = [sum(f.kind == kind for f in self.freedoms) for kind in ("R", "T")]
        return "".join(f"{n}{kind}" for n, kind in zip(counts, "RT", strict=True) if n) or "none"

    @property
    def stiffness(self) -> Array:
        """Output stiffness (6,), N/m and N m/rad: force over displacement in each coordinate, the others free; infinite
        where supports hold it."""
        own = np.diagonal(self.compliance)
        return np.divide(1.0, own, out=np.full(6, np.inf), where=own != 0)

    def amplification(self, command: ArrayLike | None = None) -> Array:
        """Displacement (6,) of the platform per mean elongation, m/m and rad/m, of the actuators under a command (a,).

        By default all are driven alike. Raises OptionError for commands that do not fit or stretch nothing.
        """
        n = len(self.inputs)
        given = np.ones(n) if command is None else finite_numbers("a command", command, n)
        own = self.elongation @ given
        driven = own[given != 0] if (given != 0).any() else own
        if not np.abs(driven).max(initial=0.0) > 0:
            raise OptionError("these commands stretch no actuator")
        return self.coupling @ given / np.abs(driven).mean()

    def vertices(self) -> Array:
        """Displacements (k, 6) of the platform at all corners of the limits of the commands.

        Raises OptionError for commands without limits and for more than 16 actuators.
        """
        box = np.array(self.limits)
        if not np.isfinite(box).all():
            raise OptionError("the workspace needs limits: free_stroke, blocked_force or limit of every actuator")
        if len(box) > 16:
            raise OptionError("corners are worked out for at most 16 actuators")
        corners = np.stack(np.meshgrid(*box, indexing="ij"), axis=-1).reshape(-1, len(box))
        return corners @ self.coupling.T

    def _title(self) -> str:
        return (
            f"{self.platform} has {self.kind}"
            if self.is_clear
            else f"{self.platform} has no freedoms that are clear cut"
        )

    def _view(self) -> Iterator[Facts | Table]:
        yield Table(self.freedom_columns(), "freedoms")
        yield Table(self.stiffness_columns(), "coordinates")
        if self.inputs:
            yield Table(self.coupling_columns(), "coordinates")

    def freedom_columns(self) -> dict[str, Any]:
        """A row for each freedom: its screw axis, how far commands within their limits take it, how the axis drifts
        there, and how far it goes before something yields."""
        free = self.freedoms
        turns = [f.kind == "R" for f in free]
        drifts = [
            "" if f.shift is None or f.tilt is None else f"{_drift(f.shift, 'm')}, {_drift(f.tilt, 'rad')}"
            for f in free
        ]
        ranges = [quantity(f.stroke, UNITS[f.kind == "R"], 4) for f in free]
        ends = [quantity(f.yield_stroke, UNITS[f.kind == "R"], 4) for f in free]
        beyond = ["" if f.yields_in_range else ", beyond linear theory" for f in free]
        return {
            "freedom": ["rotation" if turn else "translation" for turn in turns],
            "axis": [" ".join(f"{x:+.4f}" for x in f.axis.direction) for f in free],
            "through mm": [in_mm(f.axis.point) if turn else "" for f, turn in zip(free, turns, strict=True)],
            "pitch [m/rad]": [f.axis.pitch if turn else None for f, turn in zip(free, turns, strict=True)],
            "owned": [percent(f.share, 4) for f in free],
            "range": [f"± {text}" if text else "" for text in ranges],
            "axis drifts": drifts,
            "stroke to yield": [own + more for own, more in zip(ends, beyond, strict=True)],
        }

    def coupling_columns(self) -> dict[str, Any]:
        """What a unit of each command moves the platform by, and what each actuator has to push against."""
        largest = [np.abs(own).max(initial=0.0) for own in (self.coupling[:3], self.coupling[3:])]
        columns: dict[str, Any] = {"per unit command": [*DOF_NAMES, "input stiffness"]}
        for j, channel in enumerate(self.inputs):
            per = f"({channel.unit})" if "*" in channel.unit else channel.unit
            cells = [
                quantity(x if abs(x) > ROUND_OFF * largest[k > 2] else 0.0, f"{UNITS[k > 2]}/{per}", 4)
                for k, x in enumerate(self.coupling[:, j].tolist())
            ]
            unit = STIFFNESS_UNITS[channel.quantity == "moment"]
            columns[channel.name] = [*cells, quantity(float(self.input_stiffness[j]), unit, 4)]
        return columns

    def stiffness_columns(self) -> dict[str, Any]:
        """Stiffness of the platform, one coordinate at a time, and with actuators also with these free and locked, and
        where they take it within their limits."""

        def told(compliance: float, k: int, beside: float = 0.0) -> str:
            return "held" if compliance <= HELD * beside else quantity(1 / compliance, STIFFNESS_UNITS[k > 2], 4)

        own, free, locked = (
            np.diagonal(C).tolist() for C in (self.compliance, self.compliance_free, self.compliance_locked)
        )
        columns: dict[str, Any] = {
            "coordinate": DOF_NAMES,
            "stiffness": [told(c, k) for k, c in enumerate(own)],
            "model error": ["" if c == 0 else text for c, text in zip(own, self.model_errors.texts, strict=False)],
        }
        if not self.inputs:
            return columns
        spans = []
        for k, (low, high) in enumerate(self.workspace.tolist()):
            scale = scale_for([low, high], UNITS[k > 2])
            is_known = np.isfinite([low, high]).all()
            spans.append(f"{number(low / scale.size, 4)} to {scale.text(high, 4)}" if is_known else "no limits")
        return columns | {
            "actuators free": [told(c, k) for k, c in enumerate(free)],
            "actuators locked": [told(c, k, free[k]) for k, c in enumerate(locked)],
            "workspace": spans,
        }

    def _data(self) -> dict[str, Any]:
        return {
            "platform": self.platform,
            "kind": self.kind,
            "inputs": self.inputs,
            **{
                name: getattr(self, name)
                for name in (
                    *("coupling", "compliance", "compliance_free", "compliance_locked", "jacobian"),
                    *("input_stiffness", "stiffness", "elongation", "workspace"),
                )
            },
            "spectrum": self.spectrum,
            "freedoms": self.freedoms,
            "model_error": self.model_error,
        }


@verb
def kinetostatics(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    platform: str | None = None,
    actuators: Sequence[str] | None = None,
) -> Kinetostatics:
    """Coupling, amplification, stiffness, workspace and freedoms of a platform (theory eqs. T20-T24).

    `platform` is a node, by default the only rigid body; `actuators` are inputs as in `system`, by default all that are
    described. Freedoms are the motions whose compliance the actuators own: what is left of it when their lengths are
    held is less than half. Without actuators they are the compliances above a gap of their spectrum that stands out
    (`ComplianceSpectrum`, theory eq. T24), or none is named.

    Raises ModelError; OptionError for unknown names and where the platform is not clear; SolverError when something can
    move freely.
    """
    model = assemble(model, parameters)
    model.plan.refuse_pose("kinetostatics")
    node = _platform(model, platform)
    ports = Ports(model.design)
    inputs = ports.inputs(actuators)
    if any(i.base is not None for i in inputs):
        inputs = [i for i in inputs if i.base is None]
    number = model.plan.topology.numbers([node])
    P = model.design.node_rows(number).toarray()
    a = len(inputs)
    R = np.stack([i.row for i in inputs]) if a else np.zeros((0, model.order))
    rows = np.vstack([P, R])
    moved = flexibility(model).held(np.ascontiguousarray(rows.T))
    S = rows @ moved
    S = (S + S.T) / 2
    size = np.sqrt(np.outer(np.diagonal(S), np.diagonal(S)))
    S[np.abs(S) < ROUNDING * size] = 0.0
    k = np.array([i.stiffness or 0.0 for i in inputs])
    free = _without_stiffness(S, k)
    p, q = slice(0, 6), slice(6, 6 + a)
    jacobian = np.asarray(np.linalg.solve(free[q, q], free[q, p]).T, dtype=np.float64)
    locked = free[p, p] - jacobian @ free[q, p]
    gain = np.array([(i.stiffness * i.stroke if i.stiffness else 1.0) for i in inputs])
    coupling, elongation = S[p, q] * gain, S[q, q] * gain
    own = np.diagonal(S[q, q])
    limits = tuple(i.limits for i in inputs)
    spectrum, said = _spectrum(model, P, int(number[0]), free[p, p], a > 0)
    freedoms, notes = _freedoms(model, free[p, p], locked, coupling, spectrum, int(number[0]))
    names = [i.channel.name for i in inputs]
    driven = [f"of {node} by a load along its {dof}" for dof in DOF_NAMES] + [f"by {name}" for name in names]
    found = [
        _drifted(model, P, node, f, names, ports, limits) if a else _yielding(model, node, f, free[p, p], spectrum)
        for f in freedoms
    ]
    loaded = (f"{STATE}, whose own stress the strokes at yield leave out",) if model.plan.is_loaded else ()
    return Kinetostatics(
        node,
        tuple(i.channel for i in inputs),
        coupling,
        S[p, p],
        free[p, p],
        locked,
        jacobian,
        1 / own - k,
        elongation,
        _workspace(coupling, limits),
        limits,
        tuple(found),
        spectrum,
        bool(a) or spectrum.is_clear,
        (*said, *notes, *loaded, *(not_looked_at(model) if a else ())),
        (*workspace_limits(model, moved[:, q] * gain, inputs), *motion_meshes(model, moved, driven)),
        errors_of(model, moved, lambda E: _numbers(S + E, k)),
    )


def _numbers(S: Array, k: Array) -> Array:
    """Stiffness (6,), input stiffness (a,) and coupling (6 a,), per force, of compliances S (6 + a, 6 + a) with springs
    k (a,) in the actuators; zero where nothing moves."""
    own = np.diagonal(S)
    stiff = np.divide(1.0, own, out=np.zeros(len(own)), where=own != 0)
    stiff[6:] -= k
    return np.append(stiff, S[:6, 6:])


def _drift(value: float, unit: str) -> str:
    """How far an axis drifts."""
    return quantity(value if abs(value) >= LEAST else 0.0, unit, 3)


def _platform(model: FullOrderModel, platform: str | None) -> str:
    if platform is not None:
        if model.plan.topology.held[model.plan.topology.root[model.plan.topology.numbers([platform])]].all():
            raise OptionError(f"{platform} is held")
        return platform
    bodies = [
        ".".join((*path, key))
        for name, part in model.plan.parts.items()
        for path in model.plan.topology.copies[name].paths
        for key in part.bodies
    ]
    if len(bodies) != 1:
        raise OptionError(f"name the platform: there are {len(bodies)} rigid bodies ({', '.join(bodies[:8])})")
    return bodies[0]


def _without_stiffness(S: Array, k: Array) -> Array:
    """Compliances S (6 + a, 6 + a) when springs k (a,) of the last a coordinates are taken out (theory eq. T20)."""
    own = np.flatnonzero(k)
    if not len(own):
        return S
    at = 6 + own
    return S + S[:, at] @ np.linalg.solve(np.diag(1 / k[own]) - S[np.ix_(at, at)], S[at])


def _workspace(coupling: Array, limits: Sequence[tuple[float, float]]) -> Array:
    """Least and largest displacement (6, 2) in each coordinate."""
    box = np.array(limits).reshape(-1, 2)
    with np.errstate(invalid="ignore"):
        ends = np.where(coupling[:, :, None] == 0, 0.0, coupling[:, :, None] * box)
    return np.stack([ends.min(axis=2).sum(axis=1), ends.max(axis=2).sum(axis=1)], axis=1)


def _freedoms(
    model: FullOrderModel, free: Array, locked: Array, coupling: Array, spectrum: ComplianceSpectrum, number: int
) -> tuple[list[Freedom], tuple[str, ...]]:
    """Freedoms as rotations about axes and translations, and what else is to be said (theory eqs. T21-T24)."""
    at = model.geometry.positions[number]
    scale = np.repeat([1.0, spectrum.length], 3)
    arm = rigid_arm(spectrum.centre - at)
    own, held = ((arm @ C @ arm.T) * scale[:, None] * scale for C in (free, locked))
    notes: list[str] = []
    if coupling.shape[1]:
        left, W = la.eigh(held, own)
        taken = left < 1 - OWNED
        basis = la.orth(own @ W[:, taken]) if taken.any() else np.zeros((6, 0))
        if taken.any() and not taken.all():
            rest = la.eigh(held, eigvals_only=True)
            if rest[-1] > spectrum.compliance[taken.sum() - 1] / GAP:
                notes.append("the platform is compliant, beside its freedoms, in motions that no actuator controls")
    else:
        basis = spectrum.axes[:, : spectrum.count if spectrum.is_clear else 0]
        if not spectrum.is_clear:
            notes.append(_unclear(spectrum))
    found = []
    couples = own[:, 3:] @ la.pinvh(own[3:, 3:], rtol=NOISE)
    for motion, kind in screws(basis, own, model):
        alone = kind == "R" and not coupling.shape[1]
        twist = (couples @ motion[3:] if alone else motion) / scale
        one = freedom(rigid_arm(at - spectrum.centre) @ twist, kind, at)
        found.append(_commanded(one, coupling, free, locked, scale) if coupling.shape[1] else one)
    return found, tuple(notes)


def _spectrum(
    model: FullOrderModel, P: Array, number: int, C: Array, driven: bool
) -> tuple[ComplianceSpectrum, tuple[str, ...]]:
    """The spectrum of a compliance C (6, 6); where freedoms are not clear, that without springs in which they are."""
    spectrum = compliance_spectrum(model, number, C)
    if driven or spectrum.is_clear:
        return spectrum, ()
    K = stiffness_without_springs(model)
    if K is None:
        return spectrum, ()
    own = compliance_spectrum(model, number, P @ stored_flexibility(K, model.M, 0.0)(np.ascontiguousarray(P.T)))
    if not own.is_clear:
        return spectrum, ()
    values = " ".join(f"{1e6 * c:.4g}" for c in spectrum.compliance)
    return own, (
        "freedoms and compliances are those without springs, which stiffen them; with the springs no freedoms are "
        f"clear cut: {values} um/N",
    )


def _unclear(spectrum: ComplianceSpectrum) -> str:
    """Why no freedoms are named."""
    if spectrum.gap < GAP:
        return f"no clear freedoms: compliances are at most {spectrum.gap:.2g} times each other"
    if spectrum.is_outstanding:
        return "no clear freedoms: where the largest gap is depends on the length at which rotations are counted"
    return f"no clear freedoms: another gap is nearly as large as the largest, {spectrum.gap:.2g} times"


def _commanded(one: Freedom, coupling: Array, free: Array, locked: Array, scale: Array) -> Freedom:
    """The freedom with the commands that make it and the share that actuators own of it."""
    twist = np.array(one.twist)
    command = np.linalg.lstsq(coupling * scale[:, None], twist * scale, rcond=1e-9)[0]
    wrench = np.linalg.solve(free, twist)
    share = 1 - float(wrench @ locked @ wrench) / float(wrench @ twist)
    command[np.abs(command) < 1e-8 * np.abs(command).max(initial=0.0)] = 0.0
    return replace(one, share=share, command=tuple(float(x) for x in command))


def _yielding(
    model: FullOrderModel, node: str, one: Freedom, compliance: Array, spectrum: ComplianceSpectrum
) -> Freedom:
    """The freedom with the stroke at which something yields under the wrench at the node that makes its twist."""
    scale = np.repeat([1.0, spectrum.length], 3)
    stiffness = la.pinvh(compliance * scale[:, None] * scale, rtol=NOISE)
    wrench = scale * (stiffness @ (scale * np.array(one.twist)))
    return _with_yield(one, response_to(model, loads={node: wrench}))


def _with_yield(one: Freedom, unit: Statics) -> Freedom:
    """The freedom with the stroke at yield from the response to a unit of it, and whether motions are small there."""
    stroke = unit.stresses().factor_to_yield
    if stroke is None or not np.isfinite(stroke):
        return one
    beyond = motion_limits(States(unit.model, stroke * unit.displacement_vector[:, None]))
    return replace(one, yield_stroke=stroke, yields_in_range=not beyond)


def _drifted(
    model: FullOrderModel,
    P: Array,
    node: str,
    one: Freedom,
    names: list[str],
    ports: Ports,
    limits: Sequence[tuple[float, float]],
) -> Freedom:
    """The freedom with the drift of its axis from rest to half the commands' range (theory eq. S22)."""
    box, command = np.array(limits).reshape(-1, 2), np.array(one.command)
    if not len(command) or not np.abs(command).max() > 0:
        return one
    unit = response_to(model, dict(zip(names, command, strict=True)))
    one = _with_yield(one, unit)
    if not np.isfinite(box).all():
        return one
    half = (box[:, 1] - box[:, 0]) / 2
    used = np.abs(command) > 1e-9 * np.abs(command).max()
    stroke = float((half[used] / np.abs(command[used])).min())
    displaced = stroke * unit.displacement_vector
    load = sum(c * i.load for c, i in zip(command, ports.inputs(names), strict=True))
    try:
        K_t = tangent_stiffness(model, displaced)
    except OptionError:
        return replace(one, stroke=stroke)
    twist = P @ stored_flexibility(K_t, model.M, 0.0)(np.asarray(load)[:, None])[:, 0]
    number = model.plan.topology.numbers([node])[0]
    at = model.geometry.positions[number]
    moved = at + (P @ displaced)[:3]
    if one.kind == "T":
        slide = twist[:3] / np.linalg.norm(twist[:3])
        before = np.array(one.axis.direction)
        tilt = float(np.arctan2(np.linalg.norm(np.cross(before, slide)), abs(before @ slide)))
        return replace(one, stroke=stroke, shift=0.0, tilt=tilt)
    axis = screw_axis(twist, at, at=moved)
    before, after = np.array(one.axis.direction), np.array(axis.direction)
    tilt = float(np.arctan2(np.linalg.norm(np.cross(before, after)), abs(before @ after)))
    shift = float(np.linalg.norm(np.subtract(axis.point, one.axis.point)))
    return replace(one, stroke=stroke, shift=shift, tilt=tilt)
