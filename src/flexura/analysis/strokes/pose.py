"""What a mechanism is at one pose of its stroke."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from flexura.analysis.strain import ScrewAxis, YieldRatios, screw_axis
from flexura.analysis.strokes.ways import Varied
from flexura.arrays import Array
from flexura.deadline import checkpoint
from flexura.errors import Diagnostic
from flexura.linalg import Eigenpairs, Matrix, counted_intervals, inverse_roots, leading, scaled
from flexura.modal import track_modes
from flexura.motion import Equations, Equilibrium, Pose, buckling_factor, stiffness_errors
from flexura.records import Record
from flexura.structure import FullOrderModel

GOOD_SHARE = 0.2
"""Share of the most that any member has in an error, from which on this is also that of the member."""

ACCURATE = 0.01
"""Estimated relative error of stiffness from which on elements are too few."""

NO_ERROR = 1e-4
"""Errors of stiffness that are not told."""

ALIKE = 0.5
"""MAC of a mode with one of the pose before from which on it is the same: else another has come among the lowest."""

HELD = 1e-9
"""Part of the compliance with actuators free that is left where these hold a displacement, by round-off."""


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
    largest von Mises stress with notch factors, in `stress_member` at the fraction `stress_position` of its length;
    None where no yield stress is known.

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
    buckling_factor: float | None
    compliance: dict[str, Array]
    compliance_held: dict[str, Array]
    stiffness: dict[str, Array]
    stiffness_held: dict[str, Array]

    @property
    def varied(self) -> dict[str, float]:
        """What is prescribed and may differ from pose to pose: displacements, loads and commands by name."""
        return {**self.move, **self.load, **self.actuators}


class Asked(NamedTuple):
    """What is asked of every pose: how many modes, the displacements of which nodes, numbers by name, and whether also
    their compliances."""

    modes: int
    nodes: Mapping[str, int]
    compliance: bool


class Measured(NamedTuple):
    """What the mechanism is at a state by itself, with eigenvalues (k,), mode shapes (n, k) and the mass (n, n) in
    which they are orthonormal, actuators free."""

    pose: StrokePose
    values: Array
    vectors: Array
    M: Matrix


def measured(equations: Equations, state: Equilibrium, at: Varied, asked: Asked) -> Measured:
    """What the mechanism is at a state with what is prescribed there, but for modes that are tracked and stress."""
    checkpoint()
    pose = Pose(equations, state)
    names = [drive.name for drive in equations.drives]
    free, held = pose.modes(asked.modes), pose.held_values(asked.modes)
    lower, upper, proven = counted_intervals(pose.K, pose.M, free.values, free.vectors)
    support = _support(pose, asked)
    compliance, compliance_held, stiffness, stiffness_held = _tables(pose, asked)
    found = StrokePose(
        share=at.share,
        move=at.move,
        load=at.load,
        actuators=at.actuators,
        reaction=dict(zip(names, state.drive.tolist(), strict=True)),
        drive_stiffness=dict(zip(names, pose.drive_stiffness().tolist(), strict=True)),
        frequency_hz=_hertz(free.values),
        frequency_hz_held=_hertz(held),
        frequency_interval_hz=tuple(zip(_hertz(lower), _hertz(upper), strict=True)),
        proven=proven,
        tracked=tuple(range(len(free.values))),
        displacement={name: tuple(pose.displacement(k).tolist()) for name, k in asked.nodes.items()},
        support_stiffness=support,
        screw_axis={name: _axis(pose, k) for k, name in enumerate(names)},
        ground_reaction=tuple(equations.ground_reaction(state).tolist()),
        energy=state.tangent.forces.energy,
        energy_by_part=_energies(state),
        mesh_error=_mesh_errors(pose, asked, free, support),
        stress_margin=None,
        stress_member=None,
        stress_position=None,
        buckling_factor=buckling_factor(pose),
        compliance=compliance,
        compliance_held=compliance_held,
        stiffness=stiffness,
        stiffness_held=stiffness_held,
    )
    return Measured(found, free.values, free.vectors, pose.M)


def stroke_poses(found: Sequence[Measured], yields: YieldRatios) -> Iterator[StrokePose]:
    """Poses with their modes tracked from one to the next, and with their stress."""
    before: Array | None = None
    for k, own in enumerate(found):
        number = np.arange(len(own.values))
        if before is None:
            before = own.vectors
        else:
            tracked = track_modes(before, own.values, own.vectors, own.M, close=0.02)
            number = np.where(tracked.mac >= ALIKE, tracked.number, -1)
            before = np.where(number >= 0, tracked.shapes[:, number], before)
            new = np.setdiff1d(np.arange(len(own.values)), number)
            number, before = np.append(number, new), np.hstack([before, tracked.shapes[:, new]])
        margin, member, position = _margin(yields, k)
        yield replace(
            own.pose,
            tracked=tuple(int(k) for k in number),
            stress_margin=margin,
            stress_member=member,
            stress_position=position,
        )


def _support(pose: Pose, asked: Asked) -> tuple[float, ...]:
    """One over the diagonal of the compliance (6,) at the first driven node, actuators locked; without these at the
    first node that is asked for, or none."""
    node = _first(pose, asked)
    if node is None:
        return (np.nan,) * 6
    support, loose = (np.diag(pose.compliance(node, held=held)) for held in (True, False))
    with np.errstate(divide="ignore"):
        return tuple(np.where(np.abs(support) > HELD * np.abs(loose), 1 / support, np.nan).tolist())


def _first(pose: Pose, asked: Asked) -> int | None:
    """The first driven node, or without drives the first that is asked for."""
    drives = pose.equations.drives
    return drives[0].node if drives else next(iter(asked.nodes.values()), None)


def _mesh_errors(pose: Pose, asked: Asked, free: Eigenpairs, support: Sequence[float]) -> dict[str, float]:
    """By member, the largest error of a stiffness in all members together of which it has a good share."""
    motions, energies, node = free.vectors, free.values, _first(pose, asked)
    if node is not None:
        kept = [k for k, stiffness in enumerate(support) if 0 < stiffness < np.inf]
        motions = np.concatenate([motions, pose.pushed(node, held=True)[:, kept]], axis=1)
        energies = np.append(energies, 1 / np.array(support)[kept])
    return mesh_errors_of(pose, motions, energies)


def coarse(model: FullOrderModel, name: str, error: float, where: str) -> Diagnostic | None:
    """The warning of an error of stiffnesses that is owed to a member with few elements, or to a superelement that
    bends; None where it is small."""
    if not error > ACCURATE:
        return None
    copies = model.plan.topology.copies.values()
    inside = {".".join((*path, key)) for own in copies for path in own.paths for key in own.part.superelements}
    off = f"{where} support stiffnesses or squares of frequencies are too large by some {100 * error:.2g} %"
    if name in inside and error >= 1:
        text = (
            f"superelement {name}: {where} a beam of its stiffness would have lost its stability: it is linear inside"
        )
    elif name in inside:
        text = f"superelement {name}: {off}, as far as it is a beam: it is linear inside, and bending softens beams"
    else:
        text = f"member {name}: {off}, the error of its mesh: refine it"
    return Diagnostic("mesh", name, error, ACCURATE, "1", text)


def mesh_errors_of(pose: Pose, motions: Array, energies: Array) -> dict[str, float]:
    """By member, the largest relative error of the stiffness that free displacements (n, k) from a pose meet in all
    members together, of those errors of which it has a good share; `energies` (k,), N m, are twice those of the
    displacements."""
    stable = energies > 0
    errors = stiffness_errors(pose.equations.model, pose.state.frames, motions[:, stable], energies[stable])
    if not errors or not stable.any():
        return {}
    own = np.stack(list(errors.values()))
    total = np.where(own >= GOOD_SHARE * own.max(axis=0), own.sum(axis=0), 0.0).max(axis=1)
    return {name: float(error) for name, error in zip(errors, total, strict=True) if error > NO_ERROR}


def _tables(pose: Pose, asked: Asked) -> Iterator[dict[str, Array]]:
    """Compliances of nodes, actuators free and locked, then stiffnesses; empty where they are not asked for."""
    nodes = asked.nodes if asked.compliance else {}
    tables = [{name: pose.compliance(k, held=held) for name, k in nodes.items()} for held in (False, True)]
    yield from tables
    for table in tables:
        yield {name: _inverse(C, tables[0][name]) for name, C in table.items()}


def _inverse(C: Array, loose: Array) -> Array:
    """The stiffness (6, 6) of a compliance; NaN where a motion that may be there when it is `loose` is held."""
    d = inverse_roots(np.diag(loose))
    own = scaled(C, d)
    if not np.abs(np.linalg.eigvalsh(own)).min() > HELD:
        return np.full(C.shape, np.nan)
    return scaled(np.linalg.inv(own), d)


def _axis(pose: Pose, drive: int) -> ScrewAxis:
    """The axis about which the node of a drive moves, by its point nearest to where the node is."""
    model, frames, node = pose.equations.model, pose.state.frames, pose.equations.drives[drive].node
    root = model.root[node]
    here = frames.x[root] + frames.R[root] @ model.arm[node]
    return screw_axis(pose.following(drive), here, at=here)


def _energies(state: Equilibrium) -> dict[str, float]:
    """Strain energies, N m, by the first step of the names of elements: instances, and the mechanism's own members."""
    found: dict[str, float] = {}
    tangent = state.tangent
    for names, own in zip(tangent.model.names, tangent.forces.responses, strict=True):
        for name, energy in zip(names, own.energy.tolist(), strict=True):
            part = name.partition(".")[0]
            found[part] = found.get(part, 0.0) + energy
    return found


def _margin(yields: YieldRatios, k: int) -> tuple[float | None, str | None, float | None]:
    """Yield stress over stress in state k where it is least, in which member, and where along it."""
    if not yields.names:
        return None, None, None
    worst = int(leading(yields.ratio[:, k]))
    ratio = float(yields.ratio[worst, k])
    return 1 / ratio if ratio else np.inf, yields.names[worst], float(yields.position[worst, k])


def _hertz(values: Array) -> tuple[float, ...]:
    """Frequencies of eigenvalues, negative for negative ones."""
    return tuple((np.sign(values) * np.sqrt(np.abs(values)) / (2 * np.pi)).tolist())
