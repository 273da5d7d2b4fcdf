"""How actuators move a platform: coupling, amplification, stiffness, workspace, freedoms and their screw axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike, NDArray

from flexura.analysis.drift import ScrewAxis, screw_axis
from flexura.analysis.limits import workspace_limits
from flexura.analysis.numbers import finite_numbers
from flexura.analysis.statics import response_to
from flexura.analysis.tangent import tangent_stiffness
from flexura.errors import Exceeded, OptionError, SolverError, Warned
from flexura.linalg import is_definite
from flexura.mechanism.substructure import Mechanism
from flexura.structure import FullOrderModel, Plan, assemble
from flexura.systems.channel import Channel
from flexura.systems.placed import Placement
from flexura.systems.system import static_solution

Array = NDArray[np.float64]

OWNED = 0.5
"""Share of a compliance that locking the actuators takes away, from which it is a freedom."""

GAP = 10.0
"""Least ratio of compliances between freedoms and constraints where there are no actuators."""

ROUNDING = 1e-8
"""Compliances below so much of their bound, sqrt(S_ii S_jj), are round-off."""

TURNS = 0.1
"""Share of rotation in a freedom, lengths over the size of the mechanism, below which it is a translation."""


@dataclass(frozen=True)
class Freedom:
    """One way in which a platform is free: a twist (6,) of its node of unit size, m and rad, and its screw axis.

    `share` is the part of the compliance that the actuators own, 1 where they are all of it; nan without actuators.
    `command` (a,) are the actuator commands, in their units, per unit of the twist. In units of the twist, `stroke` is
    how far they reach to either side within their limits, and `yield_stroke` how far until a link or flexure yields;
    `shift`, m, and `tilt`, rad, say how far the axis drifts at the end of the stroke. None where there are no commands,
    limits or yield stresses, and where the tangent stiffness is refused (`tangent_stiffness`).
    """

    kind: str
    twist: tuple[float, ...]
    axis: ScrewAxis
    share: float
    command: tuple[float, ...]
    stroke: float | None = None
    yield_stroke: float | None = None
    shift: float | None = None
    tilt: float | None = None


@dataclass(frozen=True)
class Kinetostatics(Warned):
    """A platform, node `platform`, under the actuators `inputs` (a).

    coupling (6, a): its displacement per unit command; compliance (6, 6) with the actuators mounted and not driven,
    compliance_free (6, 6) as if they had no stiffness along their line, compliance_locked (6, 6) with their lengths
    held; jacobian (6, a): its displacement per unit elongation of each while the others keep their lengths;
    input_stiffness (a,), N/m or N m/rad: what each has to push against, its own stiffness left out; elongation (a, a)
    of each per unit command of each; workspace (6, 2): least and largest displacement within the limits of the
    commands, one coordinate at a time, infinite without limits. SI, global frame.
    """

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
    notes: tuple[str, ...] = field(default=())
    warnings: tuple[Exceeded, ...] = ()

    @property
    def kind(self) -> str:
        """Freedoms in the usual short form, e.g. `2R1T`."""
        counts = [sum(f.kind == kind for f in self.freedoms) for kind in ("R", "T")]
        return "".join(f"{n}{kind}" for n, kind in zip(counts, "RT", strict=True) if n) or "none"

    @property
    def stiffness(self) -> Array:
        """Output stiffness (6,), N/m and N m/rad: force over displacement in each coordinate, the others free."""
        return 1 / np.diagonal(self.compliance)

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

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data; infinite numbers as None."""
        return {
            "platform": self.platform,
            "kind": self.kind,
            "inputs": [{"name": c.name, "unit": c.unit} for c in self.inputs],
            **{
                name: _plain(getattr(self, name))
                for name in (
                    *("coupling", "compliance", "compliance_free", "compliance_locked", "jacobian"),
                    *("input_stiffness", "stiffness", "elongation", "workspace"),
                )
            },
            "freedoms": [
                {
                    "kind": f.kind,
                    "twist": list(f.twist),
                    "direction": list(f.axis.direction),
                    "point": list(f.axis.point),
                    "pitch": _plain(np.array(f.axis.pitch)),
                    "share": _plain(np.array(f.share)),
                    "command": list(f.command),
                    "stroke": f.stroke,
                    "yield_stroke": f.yield_stroke,
                    "shift": f.shift,
                    "tilt": f.tilt,
                }
                for f in self.freedoms
            ],
            "notes": list(self.notes),
            "warnings": [w.to_dict() for w in self.warnings],
        }


def _plain(values: Array) -> Any:
    return np.where(np.isfinite(values), values.astype(object), np.array(None)).tolist()


def kinetostatics(
    mechanism: Mechanism | Plan | FullOrderModel,
    platform: str | None = None,
    actuators: Sequence[str] | None = None,
    *,
    parameters: Mapping[str, ArrayLike] | None = None,
) -> Kinetostatics:
    """Coupling, amplification, stiffness, workspace and freedoms of a platform (theory eqs. T20-T23).

    `platform` is a node, by default the only rigid body; `actuators` are inputs as in `system`, by default all that are
    described. Freedoms are the motions whose compliance the actuators own: what is left of it when their lengths are
    held is less than half. Without actuators they are the compliances above the largest gap of their spectrum.

    Raises ModelError; OptionError for unknown names and where the platform is not clear; SolverError when something can
    move freely.
    """
    model = mechanism if isinstance(mechanism, FullOrderModel) else assemble(mechanism, parameters)
    if not is_definite(model.K):
        raise SolverError("something can move freely: hold it, or attach it by a stiffness")
    node = _platform(model, platform)
    place = Placement(model.plan, model.values, model.geometry)
    inputs = place.inputs(actuators)
    if any(i.base is not None for i in inputs):
        inputs = [i for i in inputs if i.base is None]
    number = model.plan.topology.numbers([node])
    P = model.plan.node_rows(number, model.geometry).toarray()
    a = len(inputs)
    R = np.stack([i.row for i in inputs]) if a else np.zeros((0, model.order))
    rows = np.vstack([P, R])
    moved = static_solution(model.K, model.M, np.ascontiguousarray(rows.T))
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
    freedoms, notes = _freedoms(model, free[p, p], locked, coupling, number)
    found = [_drifted(model, P, node, f, [i.channel.name for i in inputs], place, limits) for f in freedoms]
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
        notes,
        workspace_limits(model, moved[:, q] * gain, limits),
    )


def _platform(model: FullOrderModel, platform: str | None) -> str:
    if platform is not None:
        if model.plan.topology.held[model.plan.topology.root[model.plan.topology.numbers([platform])]].all():
            raise OptionError(f"{platform} is held")
        return platform
    bodies = [
        ".".join((*path, key))
        for name, part in model.plan.parts.items()
        for path in model.plan.topology.placed[name].paths
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
    model: FullOrderModel, free: Array, locked: Array, coupling: Array, number: Any
) -> tuple[list[Freedom], tuple[str, ...]]:
    """Freedoms as rotations about axes and translations, and what else is to be said (theory eqs. T21-T23)."""
    size = float(np.linalg.norm(np.ptp(model.geometry.positions, axis=0))) / 2 or 1.0
    scale = np.array([1.0, 1.0, 1.0, size, size, size])
    own = free * scale[:, None] * scale
    notes: list[str] = []
    if coupling.shape[1]:
        left, W = la.eigh(locked * scale[:, None] * scale, own)
        taken = left < 1 - OWNED
        twists = own @ W[:, taken]
        if not taken.all():
            loose = [float(x) for x in la.eigh(own, eigvals_only=True)]
            rest = la.eigh(locked * scale[:, None] * scale, eigvals_only=True)
            if rest[-1] > loose[-int(taken.sum())] / GAP and taken.any():
                notes.append("the platform is compliant, beside its freedoms, in motions that no actuator controls")
    else:
        values, W = la.eigh(own)
        ratio = values[1:] / values[:-1]
        first = int(np.argmax(ratio)) + 1
        if ratio[first - 1] < GAP:
            notes.append(f"no clear freedoms: compliances are at most {ratio.max():.2g} times each other")
            first = 6
        twists = W[:, first:]
    basis = la.orth(twists) if twists.size else np.zeros((6, 0))
    at = model.geometry.positions[number[0]]
    return [_freedom(t, kind, scale, at, coupling, free, locked) for t, kind in _screws(basis)], tuple(notes)


def _screws(basis: Array) -> list[tuple[Array, str]]:
    """Rotations and translations that span a space of twists (6, f), translation first in each column.

    Rotations carry no part of the pure translations, and are turned among themselves so that their directions are those
    of largest rotation.
    """
    if not basis.shape[1]:
        return []
    _, cosines, Vt = la.svd(basis[3:])
    cosines = np.append(cosines, np.zeros(max(0, basis.shape[1] - len(cosines))))
    turning = cosines > TURNS
    found = [(basis @ v, "R" if turns else "T") for v, turns in zip(Vt, turning, strict=True)]
    turns = np.stack([t for t, kind in found if kind == "R"], axis=1) if turning.any() else np.zeros((6, 0))
    turns = _along_axes(turns)
    slides = [t for t, kind in found if kind == "T"]
    return [(t, "R") for t in turns.T] + [(t, "T") for t in slides]


def _along_axes(turns: Array) -> Array:
    """The same space of rotations (6, r) with directions as near to the global axes as can be."""
    r = turns.shape[1]
    if r < 2:
        return turns
    W = turns[3:]
    chosen = np.argsort(-np.linalg.norm(la.orth(W).T, axis=0))[:r]
    inverse = np.linalg.pinv(W)
    wanted = np.eye(3)[:, sorted(chosen)]
    return turns @ (inverse @ wanted)


def _freedom(t: Array, kind: str, scale: Array, at: Array, coupling: Array, free: Array, locked: Array) -> Freedom:
    twist = t / scale
    turn, slide = float(np.linalg.norm(twist[3:])), float(np.linalg.norm(twist[:3]))
    twist = twist / (turn if kind == "R" else slide)
    own = twist[3:] if kind == "R" else twist[:3]
    twist *= np.sign(own[np.argmax(np.abs(own))])
    twist[np.abs(twist) < 1e-9 * np.abs(twist).max()] = 0.0
    axis = screw_axis(twist, at, at=at) if kind == "R" else screw_axis([*twist[:3], 0, 0, 0], at, at=at)
    command = np.linalg.lstsq(coupling * scale[:, None], twist * scale, rcond=1e-9)[0]
    wrench = np.linalg.solve(free, twist)
    share = 1 - float(wrench @ locked @ wrench) / float(wrench @ twist) if len(command) else np.nan
    command[np.abs(command) < 1e-8 * np.abs(command).max(initial=0.0)] = 0.0
    return Freedom(kind, tuple(float(x) for x in twist), axis, share, tuple(float(x) for x in command))


def _drifted(
    model: FullOrderModel,
    P: Array,
    node: str,
    freedom: Freedom,
    names: list[str],
    place: Placement,
    limits: Sequence[tuple[float, float]],
) -> Freedom:
    """The freedom with the drift of its axis from rest to half the commands' range (theory eq. S22)."""
    box, command = np.array(limits).reshape(-1, 2), np.array(freedom.command)
    if not len(command) or not np.abs(command).max() > 0:
        return freedom
    unit = response_to(model, dict(zip(names, command, strict=True)))
    factor = unit.stresses().factor_to_yield
    freedom = replace(freedom, yield_stroke=factor if factor is not None and np.isfinite(factor) else None)
    if not np.isfinite(box).all():
        return freedom
    half = (box[:, 1] - box[:, 0]) / 2
    used = np.abs(command) > 1e-9 * np.abs(command).max()
    stroke = float((half[used] / np.abs(command[used])).min())
    displaced = stroke * unit.displacement_vector
    load = sum(c * i.load for c, i in zip(command, place.inputs(names), strict=True))
    try:
        K_t = tangent_stiffness(model, displaced)
    except OptionError:
        return replace(freedom, stroke=stroke)
    twist = P @ static_solution(K_t, model.M, np.asarray(load)[:, None])[:, 0]
    number = model.plan.topology.numbers([node])[0]
    at = model.geometry.positions[number]
    moved = at + (P @ displaced)[:3]
    if freedom.kind == "T":
        slide = twist[:3] / np.linalg.norm(twist[:3])
        before = np.array(freedom.axis.direction)
        tilt = float(np.arctan2(np.linalg.norm(np.cross(before, slide)), abs(before @ slide)))
        return replace(freedom, stroke=stroke, shift=0.0, tilt=tilt)
    axis = screw_axis(twist, at, at=moved)
    before, after = np.array(freedom.axis.direction), np.array(axis.direction)
    tilt = float(np.arctan2(np.linalg.norm(np.cross(before, after)), abs(before @ after)))
    shift = float(np.linalg.norm(np.subtract(axis.point, freedom.axis.point)))
    return replace(freedom, stroke=stroke, shift=shift, tilt=tilt)
