"""What moves in a mode: rigid bodies, and the parts whose deformation lets them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.energy import KINDS, PartEnergy, energies
from flexura.linalg import leading, ranked, turned
from flexura.mechanism.layout import TOP
from flexura.structure import FullOrderModel

Array = NDArray[np.float64]

STILL = 0.05
"""A body with a smaller share of the kinetic energy is said to stand still."""

LOOSE = 0.3
"""Share of the largest displacement from which a named node is said to move, rather than a member between its nodes."""

SECONDARY = 0.1
"""Share of a body's kinetic energy from which the smaller of its translation and rotation is named as well."""


@dataclass(frozen=True)
class BodyMotion:
    """How a rigid body takes part in a mode.

    `translation` and `rotation` (3,) are unit vectors of the motion of its centre of mass and of its turning, global
    frame; `kind` names whichever holds more kinetic energy, and `rotation_share` is that of the turning.
    `kinetic_share` is the body's part of the mode's kinetic energy.
    """

    body: str
    kind: str
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float]
    rotation_share: float
    kinetic_share: float

    def __str__(self) -> str:
        moves = f"moves along {_direction_name(self.translation)}"
        turns = f"turns about {_direction_name(self.rotation)}"
        said = [moves] if self.rotation_share < 0.5 else [turns]
        if SECONDARY <= self.rotation_share <= 1 - SECONDARY:
            said = [moves, turns] if self.rotation_share < 0.5 else [turns, moves]
        return f"{self.body} {' and '.join(said)}"


@dataclass(frozen=True)
class Motion:
    """What moves in one mode.

    Shares add up to one; `strain_share` and `kinetic_share` are by placed part, `strain_by_substructure` and
    `deformation` by kind of deformation in each prototype (in each member or spring of the mechanism itself).
    """

    bodies: tuple[BodyMotion, ...]
    strain_share: dict[str, float]
    kinetic_share: dict[str, float]
    strain_by_substructure: dict[str, float]
    deformation: dict[str, float]
    summary: str


def motions(model: FullOrderModel, displacements: Array) -> list[Motion]:
    """Describe motions given by displacements (n_nodes, 6, k) of all nodes, global frame."""
    parts = energies(model, displacements)
    bodies = _body_motions(model, displacements, sum(part.kinetic for part in parts))
    loose = _loose_motions(model, displacements)
    return [_describe(parts, bodies[k], loose[k], k) for k in range(displacements.shape[2])]


def _loose_motions(model: FullOrderModel, u: Array) -> list[str]:
    """What to say of the mechanism's own members where no body moves: the named node that moves most, or the member
    that vibrates between its nodes."""
    part, offset = model.plan.parts[TOP], model.plan.topology.placed[TOP].offset[0]
    own, turn = (np.linalg.norm(u[offset : offset + part.n_placed, at], axis=1) for at in (slice(3), slice(3, 6)))
    size = float(np.ptp(model.geometry.positions, axis=0).max())
    said = []
    for k in range(u.shape[2]):
        if part.n_nodes and own[:, k].max() < LOOSE * 1e-2 * size * turn[:, k].max():
            said.append(f"{part.node_names[int(leading(turn[:, k]))].split('[')[0]} twists")
            continue
        node = int(leading(own[: part.n_named, k])) if part.n_named else 0
        if part.n_named and own[node, k] >= LOOSE * own[:, k].max():
            direction = _direction_name(_unit(u[offset + node, :3, k]))
            said.append(f"{part.node_names[node]} moves along {direction}")
        else:
            said.append(f"{part.node_names[int(leading(own[:, k]))].split('[')[0]} vibrates")
    return said


def _body_motions(model: FullOrderModel, u: Array, kinetic: Array | int) -> list[tuple[BodyMotion, ...]]:
    topology = model.plan.topology
    found: list[list[BodyMotion]] = [[] for _ in range(u.shape[2])]
    for name, part in model.plan.parts.items():
        placed = topology.placed[name]
        for key, (node, lump) in part.bodies.items():
            mass, inertia = lump.mass_and_inertia(model.values)
            for path, instance, offset in zip(placed.paths, placed.number, placed.offset, strict=True):
                Q = model.geometry.Q[instance]
                own = u[offset + node]
                moving = mass * (own[:3] ** 2).sum(axis=0) / 2
                turning = np.einsum("ik,ij,jk->k", own[3:], Q @ inertia @ Q.T, own[3:]) / 2
                for k, motion in enumerate(found):
                    own_energy = float(moving[k] + turning[k])
                    rotation_share = float(turning[k]) / own_energy if own_energy else 0.0
                    motion.append(
                        BodyMotion(
                            body=".".join((*path, key)),
                            kind="rotation" if rotation_share > 0.5 else "translation",
                            translation=_unit(own[:3, k]),
                            rotation=_unit(own[3:, k]),
                            rotation_share=rotation_share,
                            kinetic_share=own_energy / float(np.asarray(kinetic)[k]),
                        )
                    )
    return [tuple(motion[i] for i in ranked([m.kinetic_share for m in motion])) for motion in found]


def _unit(vector: Array) -> tuple[float, float, float]:
    length = float(np.linalg.norm(vector))
    x, y, z = (float(c) for c in turned(vector / length if length else vector))
    return x, y, z


def _direction_name(direction: tuple[float, float, float]) -> str:
    main = int(np.argmax(np.abs(direction)))
    if abs(direction[main]) > 0.97:
        return "xyz"[main]
    return "(" + ", ".join(f"{round(c, 2) + 0.0:g}" for c in direction) + ")"


def _describe(parts: list[PartEnergy], bodies: tuple[BodyMotion, ...], loose: str, k: int) -> Motion:
    strain = np.array([sum(kinds[:, k].sum() for kinds in part.strain.values()) for part in parts])
    kinetic = np.array([part.kinetic[k] for part in parts])
    elastic = bool(strain.sum() > 1e-12 * kinetic.sum())
    total = float(strain.sum()) if elastic else np.inf
    by_prototype: dict[str, float] = {}
    by_kind: dict[str, Array] = {}
    for part, energy in zip(parts, strain, strict=True):
        label = part.prototype or "mechanism"
        by_prototype[label] = by_prototype.get(label, 0.0) + float(energy) / total
        for name, kinds in part.strain.items():
            at = part.prototype or name
            by_kind[at] = by_kind.get(at, np.zeros(len(KINDS))) + kinds[:, k] / total
    deformation = {
        f"{at}: {kind}" if kind != "spring" else at: float(v)
        for at, kinds in by_kind.items()
        for kind, v in zip(KINDS, kinds, strict=True)
        if v > 1e-3
    }
    causes = list(deformation)
    deformation = {causes[i]: deformation[causes[i]] for i in ranked(list(deformation.values()))}
    return Motion(
        bodies=bodies,
        strain_share={part.path: float(energy) / total for part, energy in zip(parts, strain, strict=True)},
        kinetic_share={p.path: float(s) for p, s in zip(parts, kinetic / kinetic.sum(), strict=True)},
        strain_by_substructure=by_prototype,
        deformation=deformation,
        summary=_summary(parts, bodies, loose, kinetic / kinetic.sum(), deformation),
    )


def _summary(
    parts: list[PartEnergy],
    bodies: tuple[BodyMotion, ...],
    loose: str,
    kinetic: Array,
    deformation: dict[str, float],
) -> str:
    moving = [body for body in bodies if body.kinetic_share > STILL]
    if moving:
        shown = [str(body) for body in moving[:2]]
        text = "; ".join(shown) + (f" and {len(moving) - 2} more" if len(moving) > 2 else "")
    else:
        busy = [parts[i].path for i in ranked(kinetic) if kinetic[i] > STILL][:4]
        vibrating = ", ".join(busy) + (" vibrates" if len(busy) == 1 else " vibrate")
        text = ("bodies still; " if bodies else "") + (loose if busy == ["mechanism"] else vibrating)
    causes = [f"{cause} {share:.0%}" for cause, share in list(deformation.items())[:2] if share >= 0.1]
    return text + (f" ({', '.join(causes)})" if causes else "")
