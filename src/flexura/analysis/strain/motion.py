"""What moves in a mode: rigid bodies and masses, or members and nodes, and the parts whose deformation lets them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from flexura.analysis.strain.energy import KINDS, PartEnergy, energies
from flexura.arrays import Array
from flexura.linalg import leading, ranked, turned
from flexura.mechanism import origin_of
from flexura.records import Record
from flexura.structure import DiscreteElement, ElasticBody, FullOrderModel, Lumped, Part

STILL = 0.05
"""A body, mass or part with a smaller share of the kinetic energy is said to stand still, unless all shares are small:
then one with less than half of the largest."""

MOVES = 0.3
"""Share of the largest displacement from which a named node is said to move, rather than a member between its nodes."""

SECONDARY = 0.1
"""Share of a body's kinetic energy from which the smaller of its translation and rotation is named as well."""


@dataclass(frozen=True)
class BodyMotion:
    """How a rigid body or a point mass takes part in a mode.

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
        texts = [f"moves along {_direction_name(self.translation)}", f"turns about {_direction_name(self.rotation)}"]
        if self.rotation_share >= 0.5:
            texts.reverse()
        both = SECONDARY <= self.rotation_share <= 1 - SECONDARY
        return f"{self.body} {' and '.join(texts if both else texts[:1])}"


@dataclass(frozen=True, repr=False)
class Motion(Record):
    """What moves in one mode.

    Shares add up to one; `strain_share` and `kinetic_share` are by placed part, `strain_by_substructure` and
    `deformation` by kind of deformation in each prototype (in each member or spring of the mechanism itself).
    `masses` are point masses and sensors with a mass, like `bodies` in the order of their kinetic energy; `summary`
    names, in this order too, what holds most of it.
    """

    _shown = ("summary",)

    bodies: tuple[BodyMotion, ...]
    masses: tuple[BodyMotion, ...]
    strain_share: dict[str, float]
    kinetic_share: dict[str, float]
    strain_by_substructure: dict[str, float]
    deformation: dict[str, float]
    summary: str


def motions(model: FullOrderModel, displacements: Array) -> list[Motion]:
    """Describe motions given by displacements (n_nodes, 6, k) of all nodes, global frame."""
    parts = energies(model, displacements)
    rigid = _rigid_motions(model, displacements, np.sum([part.kinetic for part in parts], axis=0))
    return [_describe(model, parts, rigid, displacements[:, :, k], k) for k in range(displacements.shape[2])]


def _placed(model: FullOrderModel) -> Iterator[tuple[tuple[str, ...], Part, int, int]]:
    """Path, part, instance and number of the first node of all that has matrices, in the order of `energies`."""
    for name in model.matrices:
        placed = model.plan.topology.copies[name]
        for path, instance, offset in zip(placed.paths, placed.number, placed.offset, strict=True):
            yield path, model.plan.parts[name], instance, offset


@dataclass(frozen=True)
class _Rigid:
    """A rigid body, or a mass, with its motions in k modes: node that it is at, number of its part, energies (k,)."""

    name: str
    is_body: bool
    node: int
    part: int
    moving: Array
    turning: Array
    velocity: Array
    rotation: Array
    total: Array

    def motion(self, k: int) -> BodyMotion:
        """Its part in mode k."""
        energy = float(self.moving[k] + self.turning[k])
        share = float(self.turning[k]) / energy if energy else 0.0
        return BodyMotion(
            body=self.name,
            kind="rotation" if share > 0.5 else "translation",
            translation=_unit(self.velocity[:, k]),
            rotation=_unit(self.rotation[:, k]),
            rotation_share=share,
            kinetic_share=energy / float(self.total[k]),
        )


def _rigid_motions(model: FullOrderModel, u: Array, total: Array) -> list[_Rigid]:
    """Everything rigid that has a mass of its own: bodies, point masses, sensors. total (k,): all kinetic energy."""
    rigid = []
    for number, (path, part, instance, offset) in enumerate(_placed(model)):
        Q = model.geometry.Q[instance]
        every = zip(part.discrete, model.matrices[part.name].discrete_elements, strict=True)
        for (_, _, described), discrete in every:
            if (found := _rigid_mass(model, described, discrete)) is None:
                continue
            node, M = offset + found[0], found[1]
            m = M[0, 0]
            coupling = M[3:, :3] / (m or 1.0)
            arm = Q @ np.array([coupling[2, 1], coupling[0, 2], coupling[1, 0]])
            turn = u[node, 3:]
            v = np.asarray(u[node, :3] + np.cross(turn, arm, axis=0), dtype=np.float64)
            inertia = Q @ (M[3:, 3:] - m * coupling @ coupling.T) @ Q.T
            turning = np.einsum("ik,ij,jk->k", turn, inertia, turn) / 2
            about = (".".join((*path, discrete.name)), discrete.name in part.bodies, node, number)
            rigid.append(_Rigid(*about, m * (v**2).sum(axis=0) / 2, turning, v, turn, total))
    return rigid


def _rigid_mass(model: FullOrderModel, described: Lumped, discrete: DiscreteElement) -> tuple[int, Array] | None:
    """The node of a mass, and its matrix (6, 6) there; of a body that bends, its mean motion and all of its mass."""
    if isinstance(described, ElasticBody):
        return described.own, described.body.matrix(model.values)
    if len(discrete.nodes) > 1 or discrete.K is not None or discrete.M is None or not discrete.M.any():
        return None
    return discrete.nodes[0], discrete.M


def _loose(model: FullOrderModel, number: int, u: Array) -> str:
    """What to say of a part's members and nodes where nothing rigid moves in u (n_nodes, 6): the named node that moves
    most, or the member that vibrates between its nodes."""
    path, part, _, offset = list(_placed(model))[number]
    prefix = "".join(f"{step}." for step in path)
    moved = u[offset : offset + part.n_positioned]
    shift, turn = np.linalg.norm(moved[:, :3], axis=1), np.linalg.norm(moved[:, 3:], axis=1)
    if not moved.any():
        return f"{'.'.join(path) or 'mechanism'} vibrates"
    size = float(np.ptp(model.positions, axis=0).max())
    if shift.max() < MOVES * 1e-2 * size * turn.max():
        return f"{prefix}{part.node_names[int(leading(turn))].split('[')[0]} twists"
    node = int(leading(shift[: part.n_named])) if part.n_named else 0
    if part.n_named and shift[node] >= MOVES * shift.max():
        return f"{prefix}{part.node_names[node]} moves along {_direction_name(_unit(moved[node, :3]))}"
    return f"{prefix}{part.node_names[int(leading(shift))].split('[')[0]} vibrates"


def _unit(vector: Array) -> tuple[float, float, float]:
    length = float(np.linalg.norm(vector))
    x, y, z = (float(c) for c in turned(vector / length if length else vector))
    return x, y, z


def _direction_name(direction: tuple[float, float, float]) -> str:
    main = int(np.argmax(np.abs(direction)))
    if abs(direction[main]) > 0.97:
        return "xyz"[main]
    return "(" + ", ".join(f"{round(c, 2) + 0.0:g}" for c in direction) + ")"


def _describe(model: FullOrderModel, parts: list[PartEnergy], rigid: list[_Rigid], u: Array, k: int) -> Motion:
    strain = np.array([sum(kinds[:, k].sum() for kinds in part.strain.values()) for part in parts])
    kinetic = np.array([part.kinetic[k] for part in parts])
    elastic = bool(strain.sum() > 1e-12 * kinetic.sum())
    total = float(strain.sum()) if elastic else np.inf
    by_prototype: dict[str, float] = {}
    by_kind: dict[str, Array] = {}
    for part, energy in zip(parts, strain, strict=True):
        label = origin_of(part.prototype) or "mechanism"
        by_prototype[label] = by_prototype.get(label, 0.0) + float(energy) / total
        for name, kinds in part.strain.items():
            at = origin_of(part.prototype) or name
            by_kind[at] = by_kind.get(at, np.zeros(len(KINDS))) + kinds[:, k] / total
    deformation = {
        f"{at}: {kind}" if kind != "spring" else at: float(v)
        for at, kinds in by_kind.items()
        for kind, v in zip(KINDS, kinds, strict=True)
        if v > 1e-3
    }
    shares = kinetic / kinetic.sum()
    bodies, masses = (_in_order([r.motion(k) for r in rigid if r.is_body is kind]) for kind in (True, False))
    causes = [f"{cause} {share:.0%}" for cause, share in _largest(deformation)[:2] if share >= 0.1]
    moves = _what_moves(model, parts, rigid, shares, u, k)
    return Motion(
        bodies=bodies,
        masses=masses,
        strain_share={part.path: float(energy) / total for part, energy in zip(parts, strain, strict=True)},
        kinetic_share={p.path: float(s) for p, s in zip(parts, shares, strict=True)},
        strain_by_substructure=by_prototype,
        deformation=dict(_largest(deformation)),
        summary=moves + (f" ({', '.join(causes)})" if causes else ""),
    )


def _in_order(motions: list[BodyMotion]) -> tuple[BodyMotion, ...]:
    """Motions of bodies by their kinetic energy, the largest first."""
    return tuple(motions[i] for i in ranked([m.kinetic_share for m in motions]))


def _largest(shares: dict[str, float]) -> list[tuple[str, float]]:
    items = list(shares.items())
    return [items[i] for i in ranked(list(shares.values()))]


def _what_moves(
    model: FullOrderModel, parts: list[PartEnergy], rigid: list[_Rigid], kinetic: Array, u: Array, k: int
) -> str:
    """What holds the kinetic energy: bodies and masses first if that is half of it, else members and nodes first."""
    rest = kinetic.copy()
    for body in rigid:
        rest[body.part] -= body.motion(k).kinetic_share
    clusters = _clusters(model, rigid, k)
    least = min(STILL, max([rest.max(initial=0.0), *(m.kinetic_share for m in clusters)]) / 2)
    moving = [m for m in clusters if m.kinetic_share > least]
    bodies = "; ".join(map(str, moving[:2])) + (f" and {len(moving) - 2} more" if len(moving) > 2 else "")
    if moving and sum(m.kinetic_share for m in clusters) >= 0.5:
        return bodies
    busy = [int(i) for i in ranked(rest) if rest[i] > least]
    named = ", ".join(parts[i].path for i in busy[:4]) + (f" and {len(busy) - 4} more" if len(busy) > 4 else "")
    if len(busy) == 1:
        named = _loose(model, busy[0], u)
    elif not rigid:
        named = "; ".join(_loose(model, i, u) for i in busy[:2])
        named += f" and {len(busy) - 2} more" if len(busy) > 2 else ""
    else:
        named += " vibrate"
    if not busy:
        return bodies
    if moving:
        return f"{named}; {bodies}"
    return f"local mode (bodies at rest): {named}" if any(body.is_body for body in rigid) else named


def _clusters(model: FullOrderModel, rigid: list[_Rigid], k: int) -> list[BodyMotion]:
    """Bodies, each with the masses that it carries, and masses on nodes without a body, largest share first."""
    root = model.plan.topology.root
    body_at = {root[one.node]: one for one in reversed(rigid) if one.is_body}
    clusters: dict[str, BodyMotion] = {}
    for one in rigid:
        head = one if one.is_body else body_at.get(root[one.node], one)
        before = clusters.get(head.name) or replace(head.motion(k), kinetic_share=0.0)
        clusters[head.name] = replace(before, kinetic_share=before.kinetic_share + one.motion(k).kinetic_share)
    return list(_in_order(list(clusters.values())))
