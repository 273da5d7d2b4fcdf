"""Where states lie beyond what is known of them, and why a path of states ends.

Members may bend or twist too far, superelements turn within themselves or be bent of which no more is known than their
stiffness at rest, and the ground may half hold a node.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TypeGuard

import numpy as np

from flexura.arrays import Array
from flexura.beam import member_frame
from flexura.duals import plain
from flexura.errors import Diagnostic, SolverError
from flexura.motion.diaphragms import THICKNESSES, BentRings
from flexura.motion.elements import Frames, Group, PoseElements
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.layout import PLAIN
from flexura.motion.model import MovingModel
from flexura.motion.pose import Pose
from flexura.motion.se3 import LARGEST_ROTATION, rotation_vector
from flexura.motion.strain import beam_strain
from flexura.motion.superelements import Superelements
from flexura.thresholds import FREE_MOTION

BEAM_STEPS = 4
"""Steps of Newton's method for the beam under the same forces."""


def softer_as_beams(group: Superelements, frames: Frames, motions: Array) -> Array:
    """Twice the energy (e, k), N m, that motions (e, 6f, k) of their f frames meet in superelements in a state, less
    what they would meet in uniform beams of the same stiffness at rest between the first node and each other one, the
    largest of these (theory eq. G32).

    Beams soften as they bend, by (G10)-(G12); superelements with a quadratic energy do not. Zero for those whose energy
    knows more, for nodes at one place, and where a beam would be stiffer: motions of it would not be these.
    """
    energies = np.zeros((len(group.node), motions.shape[2]))
    if group.energy.cubic.size or group.count < 2:
        return energies
    d, moved = group.deformation(frames), group.rows(frames) @ motions
    for e in range(len(energies)):
        for i in range(group.count - 1):
            six = slice(6 * i, 6 * i + 6)
            change = _change(group.energy.stiffness[e], six, group.rest[e, i, :3], d[e, six])
            energies[e] = np.maximum(energies[e], np.einsum("ik,ij,jk->k", moved[e, six], change, moved[e, six]))
    return energies


def _change(K: Array, six: slice, line: Array, d: Array) -> Array:
    """The stiffness (6, 6) of a node at `line` (3,) from the first, all others free, less that of a beam of this
    stiffness under the forces of the deformation d (6,)."""
    length = float(np.linalg.norm(line))
    if not length > 0 or not d.any():
        return np.zeros((6, 6))
    others = np.delete(np.arange(len(K)), np.arange(6) + six.start)
    coupled = K[six, others]
    k = K[six, six] - coupled @ np.linalg.pinv(K[np.ix_(others, others)], rcond=1e-12) @ coupled.T
    turn = _principal(k, line[None] / length)
    k, d = turn @ k @ turn.T, turn @ d
    k = (k + k.T) / 2
    if not (np.diag(k) > 0).all():
        return np.zeros((6, 6))
    scale = 1 / np.sqrt(np.diag(k))
    values, vectors = np.linalg.eigh(scale[:, None] * k * scale)
    meant = values > FREE_MOTION * values[-1]
    kept = scale[:, None] * vectors[:, meant] / np.sqrt(values[meant])
    beam, force, at = beam_strain(k[None], np.array([length]), PLAIN), kept.T @ k @ d, d
    for _ in range(BEAM_STEPS):
        _, gradient, bent, _ = beam.response(at[None])
        at = at + kept @ np.linalg.solve(kept.T @ bent[0] @ kept, force - kept.T @ gradient[0])
    return turn.T @ (k - beam.response(at[None])[2][0]) @ turn


def _principal(k: Array, axis: Array) -> Array:
    """Axes (6, 6), as rows for both halves: along a line (1, 3), and across it where bending stiffness is least and
    largest."""
    R = member_frame(axis, np.eye(3)[np.argmin(np.abs(axis), axis=-1)])[0]
    _, across = np.linalg.eigh(R[1:] @ k[3:, 3:] @ R[1:].T)
    R[1:] = (across * np.sign(np.linalg.det(across))).T @ R[1:]
    return np.kron(np.eye(2), R)


BEND_LIMIT = 0.5
"""Largest angle, rad, between sections of an element of a member. Beyond it strains are not quadratic: see the table of
the theory page."""

LINEAR_ROTATION = 0.1
"""Largest rotation, rad, of a superelement within itself, or of a beam in its place: that of linear analysis."""


def stiffness_errors(model: MovingModel, frames: Frames, motions: Array, energies: Array) -> dict[str, Array]:
    """Relative errors (k,) of the stiffness that free displacements (n, k) meet in a state, estimated, by member for
    want of finer elements (theory eq. G27), and by superelement for what bending would make of a beam (theory eq.
    G32). `energies` (k,), N m, are twice those of the displacements."""
    whole = np.concatenate([motions, np.zeros((1, motions.shape[1]))])
    errors: dict[str, Array] = {}
    for group, names in zip(model.elements, model.names, strict=True):
        if _bends(group):
            energy = group.refinement_energy(frames, whole[model.dof[group.node].reshape(len(names), -1)])
        elif isinstance(group, Superelements):
            energy = softer_as_beams(group, frames, whole[model.dof[group.node].reshape(len(names), -1)])
        else:
            continue
        for name, error in zip(names, energy / energies, strict=True):
            errors[name] = errors.get(name, 0.0) + error
    return errors


def _bends(group: Group) -> TypeGuard[PoseElements]:
    """Whether these are beams."""
    return isinstance(group, PoseElements) and group.are_beams


def _angles(group: PoseElements, frames: Frames) -> Array:
    """The largest angle (e,), rad, between two sections of elements: that between the ends, and that between the middle
    and an end, where curvature varies linearly and s = L^3 c/12 (theory eq. G9)."""
    d, length = group.deformation(frames), np.linalg.norm(group.rest[:, :3], axis=1)
    return _largest_angle(d[:, 3:], np.linalg.norm(d[:, 1:3], axis=1) / length)


def _largest_angle(turn: Array, chord: Array) -> Array:
    """The largest angle (e,), rad, inside of a beam whose one end turns by `turn` (e, 3) against the other, and shifts
    across by `chord` (e,), over its length."""
    ends = np.linalg.norm(turn, axis=1)
    return np.maximum(ends, ends / 2 + 1.5 * chord)


def _angles_within(group: Superelements, frames: Frames) -> Array:
    """What that is (k,) of beams from the first node of a superelement to its others."""
    d = group.deformation(frames)[0, : 6 * (group.count - 1)].reshape(-1, 6)
    apart = group.rest[0, :, :3]
    length = np.linalg.norm(apart, axis=1)
    is_apart = length > 0
    unit = apart / np.where(is_apart, length, 1.0)[:, None]
    across = d[:, :3] - np.einsum("ki,ki->k", d[:, :3], unit)[:, None] * unit
    chord = np.where(is_apart, np.linalg.norm(across, axis=1) / np.where(is_apart, length, 1.0), 0.0)
    return _largest_angle(d[:, 3:], chord)


SHEET_STIFFER = 0.02
"""Part of the force of a sheet along its normal, by stretching, that is told."""

EDGE_STRAIN = 2e-4
"""Strain of the edges of members by twist that is told: a tenth or less of what yields."""

PATH_TURN = 1e-3
"""Rotation, rad, that is told where the ground holds the one about its axis, and it depends on the path."""


def beyond(model: MovingModel, states: Sequence[Frames]) -> tuple[Diagnostic, ...]:
    """What is beyond its limit in some states, each place at its worst: elements that bend further than strains are
    known, superelements that turn within themselves, members whose edges twist stretches by what stresses should
    contain, and nodes of which the ground holds one rotation alone."""
    diagnostics: list[Diagnostic] = []
    for limits in (_bent, _stretched, _partly_held):
        worst: dict[str, Diagnostic] = {}
        for frames in states:
            for diagnostic in limits(model, frames):
                if (
                    diagnostic.place not in worst
                    or diagnostic.value / diagnostic.limit
                    > worst[diagnostic.place].value / worst[diagnostic.place].limit
                ):
                    worst[diagnostic.place] = diagnostic
        diagnostics += worst.values()
    return tuple(diagnostics)


def _bent(model: MovingModel, frames: Frames) -> Iterator[Diagnostic]:
    """Members, diaphragms and superelements that bend further within an element than is accurate."""
    for group, names in zip(model.elements, model.names, strict=True):
        if isinstance(group, BentRings):
            deflection = float(group.deflections(frames).max())
            if deflection > THICKNESSES:
                text = (
                    f"diaphragm {names[0]}: its hub moves by {deflection:.3g} times its thickness, more than the"
                    f" {THICKNESSES:g} up to which its stiffening is known to 2 %: it is softer, by 6 % at 2 and by"
                    " 22 % at 5"
                )
                yield Diagnostic("displacement", names[0], deflection, THICKNESSES, "1", text)
        elif isinstance(group, Superelements):
            yield from _bent_sheet(model, frames, group, names[0])
            angle = float(_angles_within(group, frames).max(initial=0.0))
            if angle > LINEAR_ROTATION:
                text = (
                    f"superelement {names[0]}: it turns by {angle:.3g} rad within itself, more than {LINEAR_ROTATION}"
                    " rad; it is linear inside: describe it by flexures (`flexura understand` finds them in a drawing)"
                )
                yield Diagnostic("rotation", names[0], angle, LINEAR_ROTATION, "rad", text)
        elif _bends(group):
            counts = Counter(names)
            for name, angle in zip(names, _angles(group, frames).tolist(), strict=True):
                if angle > BEND_LIMIT:
                    text = (
                        f"member {name}: one of its elements, {counts[name]} in all, bends by {angle:.3g} rad, more"
                        f" than the {BEND_LIMIT} rad up to which strains are known: refine it"
                    )
                    yield Diagnostic("mesh", name, angle, BEND_LIMIT, "rad", text)


def _bent_sheet(model: MovingModel, frames: Frames, group: Superelements, name: str) -> Iterator[Diagnostic]:
    """A superelement that is a sheet, which is linear inside, where stretching would make it stiffer by 2 %."""
    *path, key = name.split(".")
    design = model.design
    placed, copies = next(at for at in design.plan.topology.copies.items() if tuple(path) in at[1].paths)
    described = design.plan.layout.prototypes[placed].superelements.get(key)
    sheet = None if described is None else described.sheet
    if sheet is None:
        return
    Q = plain(design.geometry.Q[copies.number[copies.paths.index(tuple(path))]])
    normal = np.array(sheet.normal) * [1.0, 1.0, np.sign(np.linalg.det(Q))]  # axes of mirrored ones are right-handed
    moved = group.deformation(frames)[0, : 6 * (group.count - 1)].reshape(-1, 6)[:, :3]
    most = float(np.abs(moved @ normal).max(initial=0.0)) / sheet.thickness
    stiffer = sheet.stiffening * most**2
    if stiffer > SHEET_STIFFER:
        text = (
            f"sheet {name}: it is linear inside, and moves along its normal by {most:.3g} times its thickness, where"
            f" stretching adds about {100 * stiffer:.2g} % to its force"
        )
        yield Diagnostic("displacement", name, stiffer, SHEET_STIFFER, "1", text)


def _stretched(model: MovingModel, frames: Frames) -> Iterator[Diagnostic]:
    """Members whose edges twist stretches over the mean of their sections by what stresses should contain, where
    corrections take it in: by (r^2 - Ip/A)/2 times the square of the rate of twist, which is Ip/A times it at corners.
    """
    strains: dict[str, float] = {}
    for group, names in zip(model.elements, model.names, strict=True):
        if _bends(group):
            length = np.linalg.norm(group.rest[:, :3], axis=1)
            # Ip/AL per square of the twist of the ends is what shortens
            stretch = group.strain.curvature[:, 0, 3, 3] * group.deformation(frames)[:, 3] ** 2 / length
            for name, strain in zip(names, stretch.tolist(), strict=True):
                strains[name] = max(strain, strains.get(name, 0.0))
    for name, strain in strains.items():
        if strain > EDGE_STRAIN:
            text = f"member {name}: twist stretches its edges by a further {strain:.2g}, which stresses do not contain"
            yield Diagnostic("twist", name, strain, EDGE_STRAIN, "1", text)


def _partly_held(model: MovingModel, frames: Frames) -> Iterator[Diagnostic]:
    """Nodes of which the ground holds one rotation alone and which turn about both other axes.

    How far they then turn about its axis depends on the path: by half the product of the other two between the straight
    one and one after the other.
    """
    held = model.dof[:-1, 3:] < 0
    nodes = np.flatnonzero((held.sum(axis=1) == 1) & (model.root[:-1] == np.arange(len(held))) & model.rest.placed[:-1])
    for node in nodes.tolist():
        axis = int(np.argmax(held[node]))
        turn = rotation_vector(frames.R[node])
        turned = max(abs(float(turn[axis])), abs(float(turn[axis - 1] * turn[axis - 2])) / 2)
        if turned > PATH_TURN:
            name = model.design.plan.topology.node_names[node]
            text = (
                f"{name}: the ground holds its rotation about {'xyz'[axis]} alone, at every instant; as it turns about"
                f" both other axes, {turned:.3g} rad of its rotation vector there depend on the path"
            )
            yield Diagnostic("rotation", name, turned, PATH_TURN, "rad", text)


NEAR_LARGEST = 0.9
"""Part of the largest rotation within an element from which this is why a path ends."""

STIFFER = 30.0
"""By how much a drive has stiffened where its displacement turns back."""


def why_it_ends(equations: Equations, last: Equilibrium) -> str:
    """What is found in the last state of a path, in words, with what may help."""
    angle, name = _sharpest(equations.model, last.frames)
    if angle > NEAR_LARGEST * LARGEST_ROTATION:
        return (
            f"{name} turns by {angle:.3g} rad between the ends of an element, and up to {LARGEST_ROTATION:.3g} rad are"
            " known: refine a member; a spring turns no further"
        )
    if equations.drives:
        undeformed = equations.solve(equations.model.rest, targets=np.zeros(len(equations.drives)))
        stiffness = zip(_drive_stiffness(equations, last), _drive_stiffness(equations, undeformed), strict=True)
        for drive, (at_last, at_rest) in zip(equations.drives, stiffness, strict=True):
            if at_last > STIFFER * at_rest > 0:
                return (
                    f"the force at {drive.name} grows without limit there, as where members are stretched straight or"
                    " at a limit point of the displacement: prescribe another displacement, or a load"
                )
    return (
        "at a limit point of the displacement, as in a snap-through, prescribe another displacement; refine members"
        " that bend sharply"
    )


def _drive_stiffness(equations: Equations, state: Equilibrium) -> Array:
    """Sizes (d,) of the derivatives of the forces of drives by their displacements, the others held; zero where there
    are none."""
    try:
        return np.abs(Pose(equations, state).drive_stiffness())
    except (SolverError, np.linalg.LinAlgError):
        return np.zeros(len(equations.drives))


def _sharpest(model: MovingModel, frames: Frames) -> tuple[float, str]:
    """The largest rotation, rad, between the ends of an element or the nodes of a superelement, and of which."""
    worst = (0.0, "")
    for group, names in zip(model.elements, model.names, strict=True):
        if isinstance(group, PoseElements | Superelements):
            turns = group.turns(frames)
            k = int(turns.argmax())
            worst = max(worst, (float(turns[k]), names[k]))
    return worst
