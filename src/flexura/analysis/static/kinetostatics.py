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
    LEAST_GAP,
    ComplianceSpectrum,
    Freedom,
    compliance_spectrum,
    screws,
    stiffness_without_springs,
    unit_freedom,
)
from flexura.analysis.static.statics import Statics, response_to
from flexura.analysis.strain import finite_numbers, motion_meshes, screw_axis, tangent_stiffness
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import Diagnostic, OptionError
from flexura.full_order import assemble
from flexura.mechanism import DOF_NAMES, STIFFNESS_UNITS, UNITS, Mechanism
from flexura.reduction import STATE, flexibility, stored_flexibility
from flexura.results import Result
from flexura.structure import Channel, FullOrderModel, InputPort, Plan, Ports
from flexura.tables import SHOWN_AS_ZERO, Facts, Item, Table, in_mm, number, percent, quantity, scale_for
from flexura.thresholds import CROSS_COMPLIANCE, STATIC_ROUND_OFF

OWNED_SHARE = 0.5
"""Share of a compliance that locking the actuators takes away, from which it is a freedom."""

LEAST_DRIFT = 1e-7
"""Drifts below this, m or rad, are round-off."""


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

    name: str
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
        intervals, a = self.model_errors.intervals, len(self.inputs)
        rows = [list(intervals[k : k + a]) for k in range(6 + a, 6 + 7 * a, max(a, 1))]
        return {"stiffness": list(intervals[:6]), "input_stiffness": list(intervals[6 : 6 + a]), "coupling": rows}

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
        diagonal = np.diagonal(self.compliance)
        return np.divide(1.0, diagonal, out=np.full(6, np.inf), where=diagonal != 0)

    def amplification(self, command: ArrayLike | None = None) -> Array:
        """Displacement (6,) of the platform per mean elongation, m/m and rad/m, of the actuators under a command (a,).

        By default all are driven alike. Raises OptionError for commands that do not fit or stretch nothing.
        """
        a = len(self.inputs)
        given = np.ones(a) if command is None else finite_numbers("a command", command, a)
        elongation = self.elongation @ given
        driven = elongation[given != 0] if (given != 0).any() else elongation
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

    def presentation(self) -> Iterator[Item]:
        """Freedoms with their screw axes, the coupling matrix, stiffness and workspace."""
        if self.freedoms:
            yield Table(self.freedom_columns(), "freedoms")
        if self.inputs:
            yield Table(self.coupling_columns(), "coordinates")
        else:
            yield from self.spectrum.presentation()
        yield Table(self.stiffness_columns(), "coordinates")
        if self.inputs:
            gain, turning = self.amplification(), all(c.quantity == "moment" for c in self.inputs)
            units = [
                (dof, "" if turning == (k > 2) else f"{UNITS[k > 2]}/{UNITS[turning]}")
                for k, dof in enumerate(DOF_NAMES)
            ]
            moved = [
                f"{dof} {quantity(g, unit, 4)}"
                for (dof, unit), g in zip(units, gain.tolist(), strict=True)
                if abs(g) > SHOWN_AS_ZERO * abs(gain).max()
            ]
            yield Facts({"all actuators driven alike, per elongation of each": ", ".join(moved)})

    def freedom_columns(self) -> dict[str, Any]:
        """A row for each freedom: its screw axis, how far commands within their limits take it, how the axis drifts
        there, and how far it goes before something yields."""
        freedoms = [(f, f.kind == "R") for f in self.freedoms]
        return {
            "freedom": ["rotation" if turns else "translation" for _, turns in freedoms],
            "axis": [" ".join(f"{x:+.4f}" for x in f.axis.direction) for f, _ in freedoms],
            "through mm": [in_mm(f.axis.point) if turns else "" for f, turns in freedoms],
            "pitch [m/rad]": [f.axis.pitch if turns else None for f, turns in freedoms],
            "owned": [percent(f.share, 4) for f, _ in freedoms],
            "range": ["" if f.stroke is None else f"± {quantity(f.stroke, UNITS[turns], 4)}" for f, turns in freedoms],
            "axis drifts": [
                "" if f.shift is None or f.tilt is None else f"{_drift(f.shift, 'm')}, {_drift(f.tilt, 'rad')}"
                for f, _ in freedoms
            ],
            "stroke to yield": [
                quantity(f.yield_stroke, UNITS[turns], 4) + ("" if f.yields_in_range else ", beyond linear theory")
                for f, turns in freedoms
            ],
        }

    def coupling_columns(self) -> dict[str, Any]:
        """What a unit of each command moves the platform by, and what each actuator has to push against."""
        largest = [np.abs(rows).max(initial=0.0) for rows in (self.coupling[:3], self.coupling[3:])]
        columns: dict[str, Any] = {"per unit command": [*DOF_NAMES, "input stiffness"]}
        for j, channel in enumerate(self.inputs):
            per = f"({channel.unit})" if "*" in channel.unit else channel.unit
            cells = [
                quantity(x if abs(x) > SHOWN_AS_ZERO * largest[k > 2] else 0.0, f"{UNITS[k > 2]}/{per}", 4)
                for k, x in enumerate(self.coupling[:, j].tolist())
            ]
            unit = STIFFNESS_UNITS[channel.quantity == "moment"]
            columns[channel.name] = [*cells, quantity(float(self.input_stiffness[j]), unit, 4)]
        return columns

    def stiffness_columns(self) -> dict[str, Any]:
        """Stiffness of the platform, one coordinate at a time, and with actuators also with these free and locked, and
        where they take it within their limits."""

        def stiffness(compliance: float, k: int, unlocked: float = 0.0) -> str:
            is_held = compliance <= STATIC_ROUND_OFF * unlocked
            return "held" if is_held else quantity(1 / compliance, STIFFNESS_UNITS[k > 2], 4)

        mounted, free, locked = (
            np.diagonal(C).tolist() for C in (self.compliance, self.compliance_free, self.compliance_locked)
        )
        columns: dict[str, Any] = {
            "coordinate": DOF_NAMES,
            "stiffness": [stiffness(c, k) for k, c in enumerate(mounted)],
            "model error": ["" if c == 0 else text for c, text in zip(mounted, self.model_errors.texts, strict=False)],
        }
        if not self.inputs:
            return columns
        spans = []
        for k, (low, high) in enumerate(self.workspace.tolist()):
            scale = scale_for([low, high], UNITS[k > 2])
            is_known = np.isfinite([low, high]).all()
            spans.append(f"{number(low / scale.size, 4)} to {scale.text(high, 4)}" if is_known else "no limits")
        return columns | {
            "actuators free": [stiffness(c, k) for k, c in enumerate(free)],
            "actuators locked": [stiffness(c, k, free[k]) for k, c in enumerate(locked)],
            "workspace": spans,
        }

    def _data(self) -> dict[str, Any]:
        arrays = ("coupling", "compliance", "compliance_free", "compliance_locked", "jacobian", "input_stiffness")
        names = ("platform", "kind", "inputs", *arrays, "stiffness", "elongation", "workspace")
        return {name: getattr(self, name) for name in (*names, "spectrum", "freedoms", "model_error")}


@verb
def kinetostatics(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    platform: str | None = None,
    actuators: Sequence[str] | None = None,
) -> Kinetostatics:
    """Coupling, amplification, stiffness, workspace and freedoms of a platform (theory eqs. T20-T24).

    `platform` is a node, by default the only body that moves; `actuators` are inputs as in `system`, by default all
    that are described. Freedoms are the motions whose compliance the actuators own: what is left of it when their
    lengths are held is less than half. Without actuators they are the compliances above a gap of their spectrum that
    stands out (`ComplianceSpectrum`, theory eq. T24), or none is named.

    Raises ModelError; OptionError for unknown names and where the platform is not clear; SolverError when something can
    move freely.
    """
    model = assemble(model, parameters)
    model.plan.refuse_pose("kinetostatics")
    node = _platform_node(model, platform)
    inputs = [port for port in Ports(model.design).inputs(actuators) if port.base is None]
    [number] = model.plan.topology.numbers([node]).tolist()
    P, a = model.design.node_rows(np.array([number])).toarray(), len(inputs)
    rows = np.vstack([P, *(port.row for port in inputs)])
    moved = flexibility(model).held(np.ascontiguousarray(rows.T))
    S = rows @ moved
    S = (S + S.T) / 2
    size = np.sqrt(np.outer(np.diagonal(S), np.diagonal(S)))
    S[np.abs(S) < CROSS_COMPLIANCE * size] = 0.0
    k = np.array([port.stiffness or 0.0 for port in inputs])
    gain = np.array([(port.stiffness * port.stroke if port.stiffness else 1.0) for port in inputs])
    free = _without_stiffness(S, k)
    p, q = slice(0, 6), slice(6, 6 + a)
    jacobian = np.asarray(np.linalg.solve(free[q, q], free[q, p]).T, dtype=np.float64)
    locked = free[p, p] - jacobian @ free[q, p]
    coupling = S[p, q] * gain
    spectrum, spectrum_notes = _spectrum(model, P, number, free[p, p], a > 0)
    output = _Platform(model, node, number, P, inputs, coupling, free[p, p], locked, spectrum)
    freedoms, notes = output.freedoms()
    loaded = (f"{STATE}, whose own stress the strokes at yield leave out",) if model.plan.is_loaded else ()
    directions = [f"of {node} by a load along its {dof}" for dof in DOF_NAMES]
    driven = [*directions, *(f"by {port.channel.name}" for port in inputs)]
    return Kinetostatics(
        name=model.name,
        platform=node,
        inputs=tuple(port.channel for port in inputs),
        coupling=coupling,
        compliance=S[p, p],
        compliance_free=free[p, p],
        compliance_locked=locked,
        jacobian=jacobian,
        input_stiffness=1 / np.diagonal(S[q, q]) - k,
        elongation=S[q, q] * gain,
        workspace=_workspace(coupling, output.limits),
        limits=tuple(port.limits for port in inputs),
        freedoms=tuple(freedoms),
        spectrum=spectrum,
        is_clear=bool(a) or spectrum.is_clear,
        notes=(*spectrum_notes, *notes, *loaded, *(not_looked_at(model) if a else ())),
        warnings=(*workspace_limits(model, moved[:, q] * gain, inputs), *motion_meshes(model, moved, driven)),
        model_errors=errors_of(model, moved, lambda E: _stiffness_and_coupling(S + E, k)),
    )


def _stiffness_and_coupling(S: Array, k: Array) -> Array:
    """Stiffness (6,), input stiffness (a,) and coupling (6 a,), per force, of compliances S (6 + a, 6 + a) with springs
    k (a,) in the actuators; zero where nothing moves."""
    diagonal = np.diagonal(S)
    stiffness = np.divide(1.0, diagonal, out=np.zeros(len(diagonal)), where=diagonal != 0)
    stiffness[6:] -= k
    return np.append(stiffness, S[:6, 6:])


def _drift(value: float, unit: str) -> str:
    """How far an axis drifts."""
    return quantity(value if abs(value) >= LEAST_DRIFT else 0.0, unit, 3)


def _platform_node(model: FullOrderModel, platform: str | None) -> str:
    plan = model.plan
    if platform is not None:
        if plan.topology.held[plan.topology.root[plan.topology.numbers([platform])]].all():
            raise OptionError(f"{platform} is held")
        return platform
    bodies = plan.moving_bodies
    if len(bodies) != 1:
        raise OptionError(f"name the platform: there are {len(bodies)} moving bodies ({', '.join(bodies[:8])})")
    return bodies[0]


def _without_stiffness(S: Array, k: Array) -> Array:
    """Compliances S (6 + a, 6 + a) when springs k (a,) of the last a coordinates are taken out (theory eq. T20)."""
    sprung = np.flatnonzero(k)
    if not len(sprung):
        return S
    at = 6 + sprung
    return S + S[:, at] @ np.linalg.solve(np.diag(1 / k[sprung]) - S[np.ix_(at, at)], S[at])


def _workspace(coupling: Array, limits: Array) -> Array:
    """Least and largest displacement (6, 2) in each coordinate."""
    with np.errstate(invalid="ignore"):
        ends = np.where(coupling[:, :, None] == 0, 0.0, coupling[:, :, None] * limits)
    return np.stack([ends.min(axis=2).sum(axis=1), ends.max(axis=2).sum(axis=1)], axis=1)


def _spectrum(
    model: FullOrderModel, P: Array, number: int, C: Array, driven: bool
) -> tuple[ComplianceSpectrum, tuple[str, ...]]:
    """The spectrum of a compliance C (6, 6); where freedoms are not clear, that without springs in which they are."""
    spectrum = compliance_spectrum(model, number, C)
    K = None if driven or spectrum.is_clear else stiffness_without_springs(model)
    if K is None:
        return spectrum, ()
    C_without = P @ stored_flexibility(K, model.M, 0.0)(np.ascontiguousarray(P.T))
    without = compliance_spectrum(model, number, C_without)
    if not without.is_clear:
        return spectrum, ()
    values = " ".join(f"{1e6 * c:.4g}" for c in spectrum.compliance)
    return without, (
        "freedoms and compliances are those without springs, which stiffen them; with the springs no freedoms are "
        f"clear cut: {values} um/N",
    )


@dataclass(frozen=True)
class _Platform:
    """A platform, a node by its `number`, rows `P` (6, n) that read its displacement, the actuators that drive it by
    their `coupling` (6, a), its compliances (6, 6) with these `free` and `locked`, and the spectrum of its freedoms."""

    model: FullOrderModel
    node: str
    number: int
    P: Array
    inputs: Sequence[InputPort]
    coupling: Array
    free: Array
    locked: Array
    spectrum: ComplianceSpectrum

    @property
    def limits(self) -> Array:
        """Least and largest commands (a, 2)."""
        return np.array([port.limits for port in self.inputs]).reshape(-1, 2)

    @property
    def scale(self) -> Array:
        """What rotations are multiplied by (6,) to be lengths."""
        return np.repeat([1.0, self.spectrum.length], 3)

    def freedoms(self) -> tuple[list[Freedom], list[str]]:
        """Freedoms as rotations about axes and translations, and notes on them (theory eqs. T21-T24)."""
        spectrum, scale, position = self.spectrum, self.scale, self.model.geometry.positions[self.number]
        arm = rigid_arm(spectrum.centre - position)
        free, held = ((arm @ C @ arm.T) * scale[:, None] * scale for C in (self.free, self.locked))
        notes: list[str] = []
        if self.inputs:
            left, W = la.eigh(held, free)
            owned = left < 1 - OWNED_SHARE
            basis = la.orth(free @ W[:, owned]) if owned.any() else np.zeros((6, 0))
            if owned.any() and not owned.all():
                rest = la.eigh(held, eigvals_only=True)
                if rest[-1] > spectrum.compliance[owned.sum() - 1] / LEAST_GAP:
                    notes.append("the platform is compliant, beside its freedoms, in motions that no actuator controls")
        else:
            basis = spectrum.axes[:, : spectrum.count if spectrum.is_clear else 0]
            if not spectrum.is_clear:
                notes.append(spectrum.why_unclear)
        freedoms = []
        couples = free[:, 3:] @ la.pinvh(free[3:, 3:], rtol=STATIC_ROUND_OFF)
        for motion, kind in screws(basis, free, self.model):
            by_couple = kind == "R" and not self.inputs
            twist = (couples @ motion[3:] if by_couple else motion) / scale
            unit = unit_freedom(rigid_arm(position - spectrum.centre) @ twist, kind, position)
            freedoms.append(self._with_commands(unit) if self.inputs else self._with_wrench(unit))
        return freedoms, notes

    def _with_wrench(self, freedom: Freedom) -> Freedom:
        """The freedom with the stroke at which something yields under the wrench at the node that makes its twist."""
        scale = self.scale
        stiffness = la.pinvh(self.free * scale[:, None] * scale, rtol=STATIC_ROUND_OFF)
        wrench = scale * (stiffness @ (scale * np.array(freedom.twist)))
        return _with_yield(freedom, response_to(self.model, loads={self.node: wrench}))

    def _with_commands(self, freedom: Freedom) -> Freedom:
        """The freedom with the commands that make it, the share that actuators own of it, its strokes, and the drift of
        its axis from the state without commands to half their range (theory eq. S22)."""
        twist, scale = np.array(freedom.twist), self.scale
        command = np.linalg.lstsq(self.coupling * scale[:, None], twist * scale, rcond=1e-9)[0]
        wrench = np.linalg.solve(self.free, twist)
        share = 1 - float(wrench @ self.locked @ wrench) / float(wrench @ twist)
        command[np.abs(command) < 1e-8 * np.abs(command).max(initial=0.0)] = 0.0
        freedom = replace(freedom, share=share, command=tuple(command.tolist()))
        if not np.abs(command).max() > 0:
            return freedom
        names = [port.channel.name for port in self.inputs]
        unit = response_to(self.model, dict(zip(names, command.tolist(), strict=True)))
        freedom = _with_yield(freedom, unit)
        if not np.isfinite(self.limits).all():
            return freedom
        half = (self.limits[:, 1] - self.limits[:, 0]) / 2
        used = command != 0
        stroke = float((half[used] / np.abs(command[used])).min())
        displaced = stroke * unit.displacement_vector
        try:
            K_t = tangent_stiffness(self.model, displaced)
        except OptionError:
            return replace(freedom, stroke=stroke)
        load = sum((c * port.load for c, port in zip(command, self.inputs, strict=True)), np.zeros(self.model.order))
        moving = self.P @ stored_flexibility(K_t, self.model.M, 0.0)(load[:, None])[:, 0]
        before, shift = np.array(freedom.axis.direction), 0.0
        if freedom.kind == "T":
            after = moving[:3] / np.linalg.norm(moving[:3])
        else:
            position = self.model.geometry.positions[self.number]
            axis = screw_axis(moving, position, at=position + (self.P @ displaced)[:3])
            after = np.array(axis.direction)
            shift = float(np.linalg.norm(np.subtract(axis.point, freedom.axis.point)))
        tilt = float(np.arctan2(np.linalg.norm(np.cross(before, after)), abs(before @ after)))
        return replace(freedom, stroke=stroke, shift=shift, tilt=tilt)


def _with_yield(freedom: Freedom, unit: Statics) -> Freedom:
    """The freedom with the stroke at yield from the response to a unit of it, and whether motions are small there."""
    stroke = unit.stresses().factor_to_yield
    if stroke is None or not np.isfinite(stroke):
        return freedom
    beyond = motion_limits(States(unit.model, stroke * unit.displacement_vector[:, None]))
    return replace(freedom, yield_stroke=stroke, yields_in_range=not beyond)
