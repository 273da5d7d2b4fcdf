"""What a mechanism is at one pose of its stroke, and poses as tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, isnan
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis.limits import mesh_errors
from flexura.analysis.model_error import ModelError
from flexura.analysis.strain import ScrewAxis, YieldRatios, screw_axis
from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.linalg import Matrix, counted_intervals, inverse_roots, leading, scaled
from flexura.mechanism import DOF_NAMES, FORCE_UNITS, FORCES, UNITS, is_rotation
from flexura.modal import track_modes
from flexura.motion import Equations, Equilibrium, Pose, buckling_factor
from flexura.records import Record
from flexura.tables import number
from flexura.thresholds import STATIC_ROUND_OFF

FEW_NODES = 2
"""Nodes that tell how far a mechanism goes, where commands and loads alone move it."""

SAME_MODE_MAC = 0.5
"""MAC of a mode with one of the pose before from which on it is the same: else another has come among the lowest."""


@dataclass(frozen=True, repr=False)
class StrokePose(Record):
    """The mechanism at one pose, m and rad, N and N m, Hz; global axes.

    `share` is that of the way from the first values of what is prescribed to the last ones. `move` are the prescribed
    displacements by name, `load` the components of loads that change over the stroke, N, N m
    and m/s^2, and `actuators` the commands that do, in the units of their inputs. `reaction` are the forces and moments
    that hold the prescribed displacements there and `drive_stiffness` how these grow with the displacement, all other
    prescribed ones held. `frequency_hz` are natural frequencies with actuators free under these forces, which stay as
    they are, `frequency_hz_held` with actuators locked; a state that is unstable has a negative one, the rate at which
    it springs away. `frequency_interval_hz` holds bounds of each of `frequency_hz`, round-off of its computation
    included; `proven` says that they are those of the frequencies of these numbers, counted so that none is missed.
    `tracked` (m,) says which of `frequency_hz` each of the modes that were among the lowest at any pose up to here has
    become, those of the first pose first; -1 where it is among them no longer. `displacement` (6,) is
    that of nodes from rest, with their rotation vectors. `support_stiffness` (6,) is one over the diagonal of the
    compliance with actuators locked at the first driven node, or without drives at the first of `nodes`, NaN where
    these hold it, in N/m and N m/rad.

    `screw_axis` is the axis about which the node of each drive moves as this moves on, the others held.
    `ground_reaction` (6,) is the force and the moment about the global origin that the ground exerts. `energy` is the
    strain energy, N m, and `energy_by_part` that of every instance of the mechanism and of every member, spring and
    superelement of its own. `mesh_error` estimates, for members to which it is owed, by how much `support_stiffness`
    and the squares of frequencies are too large where that is worst, all members together, for want of finer elements,
    beyond what elements lack at rest; errors below 1e-4 are left out. `stress_margin` is the least yield stress over
    largest von Mises stress with notch factors, in `stress_member` at the fraction `stress_position` of its length, or
    in a part at `stress_place` (x, y, z), m, before anything moves; None where no yield stress is known.

    `buckling_factor` on all loads and forces of the drives is that at which the state would buckle with the drives
    held, linear from the pose; None where nothing buckles.

    Where they were asked for, `compliance` and `stiffness` (6, 6) are those of nodes with actuators free under their
    forces, `compliance_held` and `stiffness_held` with actuators locked: m/N, 1/N, rad/(N m), N/m, N, N m/rad, forces
    and moments on the node in columns. A stiffness is NaN where the node cannot move in some direction.
    """

    _shown = ("move", "reaction", "frequency_hz")

    share: float
    move: dict[str, float]
    load: dict[str, float]
    actuators: dict[str, float]
    reaction: dict[str, float]
    drive_stiffness: dict[str, float]
    frequency_hz: tuple[float, ...]
    frequency_hz_held: tuple[float, ...]
    frequency_interval_hz: tuple[tuple[float, float], ...]
    proven: bool
    tracked: tuple[int, ...]
    displacement: dict[str, tuple[float, ...]]
    support_stiffness: tuple[float, ...]
    screw_axis: dict[str, ScrewAxis]
    ground_reaction: tuple[float, ...]
    energy: float
    energy_by_part: dict[str, float]
    mesh_error: dict[str, float]
    stress_margin: float | None
    stress_member: str | None
    stress_position: float | None
    stress_place: tuple[float, ...] | None
    buckling_factor: float | None
    compliance: dict[str, Array]
    compliance_held: dict[str, Array]
    stiffness: dict[str, Array]
    stiffness_held: dict[str, Array]

    @property
    def varied(self) -> dict[str, float]:
        """What is prescribed and may differ from pose to pose: displacements, loads and commands by name."""
        return {**self.move, **self.load, **self.actuators}


class Requested(NamedTuple):
    """What is worked out at every pose: how many modes, the displacements of which nodes, numbers by name, and whether
    also their compliances."""

    modes: int
    nodes: Mapping[str, int]
    compliance: bool


class PathState(NamedTuple):
    """A state of a stroke with what the mechanism is there by itself, eigenvalues (k,) and mode shapes (n, k), and the
    mass (n, n) in which these are orthonormal, actuators free."""

    state: Equilibrium
    pose: StrokePose
    values: Array
    vectors: Array
    M: Matrix

    @property
    def buckling_modes(self) -> int:
        """In how many modes it is unstable with actuators locked."""
        return sum(hertz < 0 for hertz in self.pose.frequency_hz_held)

    def without_mesh_error(self) -> PathState:
        """Where a stiffness vanishes, it is off by any factor however fine the mesh."""
        return self._replace(pose=replace(self.pose, mesh_error={}))


def path_state(
    equations: Equations,
    state: Equilibrium,
    share: float,
    values: Mapping[str, dict[str, float]],
    requested: Requested,
) -> PathState:
    """What the mechanism is at a state, but for modes that are tracked and stress; `values` are those that are
    prescribed there, by kind."""
    checkpoint()
    pose = Pose(equations, state)
    drives, nodes = equations.drives, requested.nodes
    names = [drive.name for drive in drives]
    free, held = pose.modes(requested.modes), pose.held_values(requested.modes)
    lower, upper, proven = counted_intervals(pose.K, pose.M, free.values, free.vectors)
    node = drives[0].node if drives else next(iter(nodes.values()), None)
    support = _support_stiffness(pose, node)
    motions, energies = free.vectors, free.values
    if node is not None:
        elastic = [k for k, stiffness in enumerate(support) if 0 < stiffness < np.inf]
        motions = np.concatenate([motions, pose.pushed(node, held=True)[:, elastic]], axis=1)
        energies = np.append(energies, 1 / np.array(support)[elastic])
    compliance, compliance_held = (
        {name: pose.compliance(k, held=held) for name, k in nodes.items()} if requested.compliance else {}
        for held in (False, True)
    )
    stiffness, stiffness_held = (
        {name: _stiffness(C, compliance[name]) for name, C in table.items()} for table in (compliance, compliance_held)
    )
    result = StrokePose(
        share=share,
        **values,
        reaction=dict(zip(names, state.drive.tolist(), strict=True)),
        drive_stiffness=dict(zip(names, pose.drive_stiffness().tolist(), strict=True)),
        frequency_hz=_hertz(free.values),
        frequency_hz_held=_hertz(held),
        frequency_interval_hz=tuple(zip(_hertz(lower), _hertz(upper), strict=True)),
        proven=proven,
        tracked=tuple(range(len(free.values))),
        displacement={name: tuple(pose.displacement(k).tolist()) for name, k in nodes.items()},
        support_stiffness=support,
        screw_axis={name: _screw_axis(pose, k) for k, name in enumerate(names)},
        ground_reaction=tuple(equations.ground_reaction(state).tolist()),
        energy=state.tangent.forces.energy,
        energy_by_part=_energies(state),
        mesh_error=mesh_errors(pose, motions, energies),
        stress_margin=None,
        stress_member=None,
        stress_position=None,
        stress_place=None,
        buckling_factor=buckling_factor(pose),
        compliance=compliance,
        compliance_held=compliance_held,
        stiffness=stiffness,
        stiffness_held=stiffness_held,
    )
    return PathState(state, result, free.values, free.vectors, pose.M)


def stroke_poses(states: Sequence[PathState], yields: YieldRatios) -> Iterator[StrokePose]:
    """Poses with their modes tracked from one to the next, and with their stress: yield stress over stress where that
    is least, in which member, and where along it."""
    shapes: Array | None = None
    for k, (_, pose, values, vectors, M) in enumerate(states):
        number = np.arange(len(values))
        if shapes is None:
            shapes = vectors
        else:
            tracked = track_modes(shapes, values, vectors, M, close=0.02)
            number = np.where(tracked.mac >= SAME_MODE_MAC, tracked.number, -1)
            shapes = np.where(number >= 0, tracked.shapes[:, number], shapes)
            new = np.setdiff1d(np.arange(len(values)), number)
            number, shapes = np.append(number, new), np.hstack([shapes, tracked.shapes[:, new]])
        stressed = replace(pose, tracked=tuple(number.tolist()))
        if yields.names:
            worst = int(leading(yields.ratio[:, k]))
            ratio, position, place = (float(yields.ratio[worst, k]), yields.position[worst, k], yields.place[worst, k])
            stressed = replace(
                stressed,
                stress_margin=1 / ratio if ratio else np.inf,
                stress_member=yields.names[worst],
                stress_position=None if np.isnan(position) else float(position),
                stress_place=None if np.isnan(place).any() else tuple(place.tolist()),
            )
        yield stressed


def _support_stiffness(pose: Pose, node: int | None) -> tuple[float, ...]:
    """One over the diagonal of the compliance (6,) of a node, actuators locked; NaN where these hold it."""
    if node is None:
        return (np.nan,) * 6
    support, loose = (np.diag(pose.compliance(node, held=held)) for held in (True, False))
    with np.errstate(divide="ignore"):
        return tuple(np.where(np.abs(support) > STATIC_ROUND_OFF * np.abs(loose), 1 / support, np.nan).tolist())


def _stiffness(C: Array, loose: Array) -> Array:
    """The stiffness (6, 6) of a compliance; NaN where a motion that may be there when it is `loose` is held."""
    d = inverse_roots(np.diag(loose))
    unitless = scaled(C, d)
    if not np.abs(np.linalg.eigvalsh(unitless)).min() > STATIC_ROUND_OFF:
        return np.full(C.shape, np.nan)
    return scaled(np.linalg.inv(unitless), d)


def _screw_axis(pose: Pose, drive: int) -> ScrewAxis:
    """The axis about which the node of a drive moves, by its point nearest to where the node is."""
    model, frames, node = pose.equations.model, pose.state.frames, pose.equations.drives[drive].node
    root = model.root[node]
    position = frames.x[root] + frames.R[root] @ model.arm[node]
    return screw_axis(pose.following(drive), position, at=position)


def _energies(state: Equilibrium) -> dict[str, float]:
    """Strain energies, N m, by the first step of the names of elements: instances, and the mechanism's own members."""
    energies: dict[str, float] = {}
    tangent = state.tangent
    for names, response in zip(tangent.model.names, tangent.forces.responses, strict=True):
        for name, energy in zip(names, response.energy.tolist(), strict=True):
            part = name.partition(".")[0]
            energies[part] = energies.get(part, 0.0) + energy
    return energies


def _hertz(values: Array) -> tuple[float, ...]:
    """Frequencies of eigenvalues, negative for negative ones."""
    return tuple((np.sign(values) * np.sqrt(np.abs(values)) / (2 * np.pi)).tolist())


def pose_columns(poses: Sequence[StrokePose], units: Mapping[str, str], errors: Sequence[ModelError]) -> dict[str, Any]:
    """What each pose is, by heading; `units` are those of what is prescribed, `errors` how far the part may be from the
    model at each pose, none where that is not known."""
    if not poses:
        return {}
    first = poses[0]
    columns: dict[str, Any] = {f"{name} [{units[name]}]": [p.varied[name] for p in poses] for name in first.varied}
    for name in first.move:
        unit, force = UNITS[is_rotation(name)], FORCE_UNITS[is_rotation(name)].replace("*", " ")
        columns[f"reaction {name} [{force}]"] = [p.reaction[name] for p in poses]
        columns[f"drive stiffness {name} [{force}/{unit}]"] = [p.drive_stiffness[name] for p in poses]
    columns |= _frequency_columns(poses, errors)
    for k, dof in enumerate(DOF_NAMES):
        columns[f"support {dof} [{'N/m' if k < 3 else 'N m/rad'}]"] = [p.support_stiffness[k] for p in poses]
    for node in first.displacement:
        for k, dof in enumerate(DOF_NAMES):
            columns[f"{node} {dof} [{UNITS[k > 2]}]"] = [p.displacement[node][k] for p in poses]
    for name in ("stress margin", "stress member", "stress position", "buckling factor"):
        columns[name] = [getattr(p, name.replace(" ", "_")) for p in poses]
    columns["energy [N m]"] = [p.energy for p in poses]
    for name in first.energy_by_part:
        columns[f"energy {name} [N m]"] = [p.energy_by_part[name] for p in poses]
    for name in first.move:
        for k, axis in enumerate("xyz"):
            columns[f"axis {name} direction {axis} [1]"] = [p.screw_axis[name].direction[k] for p in poses]
            columns[f"axis {name} {axis} [m]"] = [p.screw_axis[name].point[k] for p in poses]
        columns[f"axis {name} pitch [m/rad]"] = [p.screw_axis[name].pitch for p in poses]
    for k, name in enumerate(FORCES):
        columns[f"ground {name} [{'N' if k < 3 else 'N m'}]"] = [p.ground_reaction[k] for p in poses]
    return columns | _compliance_columns(poses)


def _frequency_columns(poses: Sequence[StrokePose], errors: Sequence[ModelError]) -> dict[str, Any]:
    """Frequencies, between which proven bounds they are, how far the part may be, and those with actuators locked."""
    columns: dict[str, Any] = {}
    for k in range(min(len(p.frequency_hz) for p in poses)):
        columns[f"f{k + 1} [Hz]"] = [p.frequency_hz[k] for p in poses]
        for end, name in enumerate(("lower", "upper")):
            columns[f"f{k + 1} {name} [Hz]"] = [p.frequency_interval_hz[k][end] for p in poses]
        if errors:
            for name in ("low", "high"):
                columns[f"f{k + 1} model error, {name}"] = [float(getattr(error, name)[k]) for error in errors]
    columns["proven"] = [p.proven for p in poses]
    for k in range(min(len(p.frequency_hz_held) for p in poses)):
        columns[f"f{k + 1} held [Hz]"] = [p.frequency_hz_held[k] for p in poses]
    return columns


def _compliance_columns(poses: Sequence[StrokePose]) -> dict[str, Any]:
    """Compliances and stiffnesses of nodes where they are requested, an entry above the diagonal each."""
    columns: dict[str, Any] = {}
    for what, units in (("compliance", ("m/N", "1/N", "rad/(N m)")), ("stiffness", ("N/m", "N", "N m/rad"))):
        for held in ("", "_held"):
            tables = [getattr(p, f"{what}{held}") for p in poses]
            for node in tables[0]:
                for i, row in enumerate(DOF_NAMES):
                    for j, column in enumerate(DOF_NAMES[i:], i):
                        heading = f"{what}{held.replace('_', ' ')} {node} {row} {column} [{units[(i > 2) + (j > 2)]}]"
                        columns[heading] = [table[node][i, j] for table in tables]
    return columns


def short_columns(poses: Sequence[StrokePose], units: Mapping[str, str], modes: int) -> dict[str, Any]:
    """What readers see of each pose, by heading: what is prescribed, what holds it, up to so many frequencies, support
    stiffness where there is any, and factors on what is there."""
    if not poses:
        return {}
    first = poses[0]
    columns: dict[str, Any] = {f"{name} [{units[name]}]": [p.varied[name] for p in poses] for name in first.varied}
    for node in list(first.displacement)[:FEW_NODES] if not first.move else ():
        moved = np.array([p.displacement[node] for p in poses])
        span = np.abs(moved).max(axis=0)
        k = int(span[:3].argmax() if span[:3].any() else 3 + span[3:].argmax())
        name = DOF_NAMES[k][1:] if k < 3 else DOF_NAMES[k]
        columns[f"{node}.{name} [{UNITS[k > 2]}]"] = moved[:, k].tolist()
    for name in first.move:
        what = f"{'moment' if is_rotation(name) else 'force'}{f' {name}' if len(first.move) > 1 else ''}"
        columns[f"{what} [{FORCE_UNITS[is_rotation(name)]}]"] = [p.reaction[name] + 0.0 for p in poses]
    for k in range(min(max(len(p.frequency_hz) for p in poses), modes)):
        columns[f"f{k + 1} [Hz]"] = [p.frequency_hz[k] if k < len(p.frequency_hz) else None for p in poses]
    if any(not isnan(stiffness) for p in poses for stiffness in p.support_stiffness[:3]):
        for k, axis in enumerate("xyz"):
            stiffness = [p.support_stiffness[k] for p in poses]
            columns[f"k{axis} [N/m]"] = ["driven" if isnan(value) else value for value in stiffness]
    for heading, factors in (
        ("to yield", [p.stress_margin for p in poses]),
        ("to buckle", [p.buckling_factor for p in poses]),
    ):
        columns[heading] = ["" if value is None or not isfinite(value) else number(value, 3) for value in factors]
    return columns
