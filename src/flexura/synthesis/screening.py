"""Which designs of topologies are worth a closer look: many at rest, the best of these over their strokes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.stats import qmc

from flexura.analysis import check
from flexura.arrays import Array
from flexura.errors import FlexuraError, ModelError
from flexura.full_order import plan_of
from flexura.mechanism import CATALOGUE, Mechanism, with_rigid_bodies
from flexura.structure import Plan
from flexura.study.questions import Questions, Relation, questions, relation
from flexura.synthesis.bending import strain_over_stroke
from flexura.synthesis.drafts import draft, with_values
from flexura.synthesis.drives import reach
from flexura.synthesis.extents import extents_of
from flexura.synthesis.topologies import Topology
from flexura.synthesis.wish import DOFS, Room, WishFile, si
from flexura.thresholds import ROUND_OFF

BEST_OF_EACH = 8
"""Designs of each topology at rest that may be led through their strokes."""

CORNERS = 64
"""Corners of the limits of sizes that are among the designs, at most."""

SPARE = 2.2
"""Yield strain over that of the limbs, roughly, where a margin of stress is required."""


@dataclass(frozen=True)
class AtRest:
    """Designs of topologies at rest within the envelope, one topology after another: what a worker is sent.

    A block has the `values` (k, p) of the best designs of a topology, best first, in the order of its parameters, the
    `margins` (k, r) of the requirements that are asked at rest, nan where there is none, the `gap` (k,), and the
    `score` (k,) by which they are best, of `count` designs; all nan where limbs cannot be made with the tool.
    """

    file: WishFile
    room: Room
    listed: tuple[Topology, ...]
    samples: int

    @property
    def blocks(self) -> int:
        """How many topologies there are."""
        return len(self.listed)

    def designs(self, *numbers: int) -> str:
        """Topologies in words."""
        return f"topology {', '.join(str(n + 1) for n in numbers)}"

    def required_of(self, own: Topology) -> dict[str, str]:
        """Requirements that ask nothing at poses, of strokes or stresses, by names that are the same of all
        topologies; how far stacks reach is asked of each by its own drives."""
        found = {**(reach(own.drive, self.file.wish) if own.drive else {}), **self.file.required}
        return {name: text for name, text in found.items() if is_at_rest(text)}

    def gaps(self, own: Topology, plan: Plan, designs: Mapping[str, Array], poses: Sequence[str] = ()) -> Array:
        """The least gap (n,) of designs of a topology at rest and at some poses, without its stacks, as these are what
        moves the freedoms, and without amplifiers that do not hold the platform."""
        if own.drive is not None:
            plan = plan_of(self.without_stacks(own))
            designs = {name: designs[name] for name in plan.mechanism.parameters}
        asked = [[name + at for name in COMPLIANCES] for at in ("", *(f" at {pose}" for pose in poses))]
        return np.min([gap_of(questions(plan, each).values(designs).value, self.room) for each in asked], axis=0)

    def without_stacks(self, own: Topology) -> Mechanism:
        """The draft of a topology with rigid bodies, without its stacks, and without amplifiers that do not hold the
        platform."""
        holds = own.drive.without_force if own.drive is not None and own.drive.top is not None else None
        return with_rigid_bodies(draft(replace(own, drive=holds), self.file, self.room, "draft"))

    @cached_property
    def allowed(self) -> float:
        """The strain that limbs are to have at most at the end of the stroke, by the material and what is required."""
        material = CATALOGUE[self.file.wish.make.material]
        required = any("margin" in text or "stress" in text for text in self.file.requirements.values())
        return si(material.yield_stress or np.inf) / si(material.E) / (SPARE if required else 1.0)

    def __call__(self, number: int) -> dict[str, Array]:
        """The best designs of a topology."""
        own = self.listed[number]
        try:
            plan = plan_of(with_rigid_bodies(draft(own, self.file, self.room, "draft")))
        except ModelError:  # of limbs that are too short for the radius of the tool
            rows = {"values": (1, 1), "margins": (1, len(self.required_of(own))), "gap": (1,), "score": (1,)}
            return {name: np.full(shape, np.nan) for name, shape in rows.items()} | {"count": np.array(0.0)}
        parameters = plan.mechanism.parameters
        low, high = (np.array([float(getattr(p, end)) for p in parameters.values()]) for end in ("minimum", "maximum"))
        unit = _in_cube(len(low), self.samples, number)
        drawn = [float(p.value) for p in parameters.values()]  # type: ignore[arg-type]
        extents = extents_of(own, self.room, plan.mechanism)
        values = np.concatenate([[drawn], extents.within(np.array(drawn), low + unit * (high - low))])
        designs = dict(zip(parameters, values.T, strict=True))
        relations = [relation(plan, text) for text in self.required_of(own).values()]
        margins = _margins(plan, relations, designs).reshape(len(relations), len(values))
        gaps = self.gaps(own, plan, designs)
        spare = self.allowed / np.maximum(strain_over_stroke(own, designs, self.file.wish, self.room), ROUND_OFF)
        with np.errstate(divide="ignore"):
            apart = np.minimum(np.log(gaps / self.file.wish.gap), np.log(spare)) / 3
        score = np.minimum(apart, margins.min(axis=0, initial=1.0))
        best = np.argsort(-np.where(np.isfinite(score), score, -np.inf), kind="stable")[:BEST_OF_EACH]
        columns = {"values": values[best], "margins": margins[:, best].T, "gap": gaps[best], "score": score[best]}
        return columns | {"count": np.array(float(len(values)))}


def _margins(plan: Plan, relations: Sequence[Relation], designs: Mapping[str, Array]) -> Array:
    """Margins (relations, n) of designs, with what is asked in all relations worked out at once."""
    asked = tuple(dict.fromkeys(quantity for own in relations for quantity in own.quantities))
    answers = Questions(plan, asked).values(designs)
    values = {quantity.text: answers.value[:, k] for k, quantity in enumerate(asked)}
    return np.array([own.evaluate(values) for own in relations])


def _in_cube(n: int, samples: int, seed: int) -> Array:
    """Points (k, n) of a unit cube: so many of Halton's sequence, and its corners, since what is required often leads
    to limits of sizes; of many corners some."""
    points = qmc.Halton(n, seed=np.random.default_rng(seed)).random(samples + CORNERS)
    every = 2**n <= CORNERS
    corners = np.array(list(product((0.0, 1.0), repeat=n))) if every else np.round(points[samples:])
    return np.concatenate([points[:samples], corners])


@dataclass(frozen=True)
class OverStroke:
    """Some designs of topologies over their strokes, with rigid bodies: what a worker is sent.

    `chosen` are numbers of topologies with designs (k, p) of each. A block has the least margin (k,) of all that is
    required, nan where there is none, and whether solids of a design are `clear` of each other.
    """

    at_rest: AtRest
    chosen: tuple[tuple[int, Array], ...]

    @property
    def blocks(self) -> int:
        """How many topologies there are."""
        return len(self.chosen)

    def designs(self, *numbers: int) -> str:
        """Topologies in words."""
        return self.at_rest.designs(*(self.chosen[n][0] for n in numbers))

    def __call__(self, number: int) -> dict[str, Array]:
        """What the designs of a topology come to."""
        topology, values = self.chosen[number]
        of = self.at_rest
        mechanism = draft(of.listed[topology], of.file, of.room, "draft")
        plan = plan_of(with_rigid_bodies(mechanism))
        designs = dict(zip(mechanism.parameters, values.T, strict=True))
        margins = np.ones((1, len(values)))
        for text in mechanism.requirements.values():
            try:
                margins = np.vstack([margins, relation(plan, text).margin(designs)])
            except FlexuraError:  # where no pose is found
                margins = np.vstack([margins, np.full(len(values), np.nan)])
        each = [dict(zip(mechanism.parameters, own, strict=True)) for own in values]
        clear = [not clashes_of(with_values(mechanism, own)) for own in each]
        return {"margin": margins.min(axis=0), "clear": np.array(clear, dtype=float)}


COMPLIANCES = [f"compliance(about.{a}, about.{b})" for i, a in enumerate(DOFS) for b in DOFS[i:]]
_AT = [(i, j) for i in range(6) for j in range(i, 6)]


def gap_of(compliances: Array, room: Room) -> Array:
    """How many times as compliant the stiffest wished freedom is as the softest of what is not wished (n,), of
    designs with compliances (n, 21) of the point of the wish, rotations counted at a quarter of the larger edge of the
    envelope; infinite where nothing is wished, and 0 at poses that are unstable."""
    free, rest, scale = bases_of(room)
    C = matrices_of(compliances) * scale[:, None] * scale
    bad = ~np.isfinite(C).all(axis=(1, 2))
    C[bad] = 0.0
    softest = np.abs(np.linalg.eigvalsh(rest.T @ C @ rest)).max(axis=1) if rest.size else np.zeros(len(C))
    stiffest = np.linalg.eigvalsh(free.T @ C @ free)[:, 0] if free.size else np.full(len(C), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(bad, np.nan, np.maximum(stiffest, 0.0) / np.maximum(softest, 1e-300))


def matrices_of(compliances: Array) -> Array:
    """Compliances (n, 21) as matrices (n, 6, 6)."""
    C = np.zeros((len(compliances), 6, 6))
    for (i, j), own in zip(_AT, compliances.T, strict=True):
        C[:, i, j] = C[:, j, i] = own
    return C


def bases_of(room: Room) -> tuple[Array, Array, Array]:
    """Orthonormal motions of the point of the wish that are wished (6, f), and all others (6, 6 - f), and what their
    components are times to be m and rad (6,)."""
    scale = np.repeat([1.0, room.freedoms.length / 2], 3)
    U, s, _ = np.linalg.svd(_twists_about(room) * scale[:, None])
    k = int((s > 1e-9).sum())
    return U[:, :k], U[:, k:], scale


def _twists_about(room: Room) -> Array:
    """The wished freedoms (6, f) as twists of the point of the wish, global frame."""
    units = np.repeat([room.freedoms.length, 1.0], 3)[:, None]
    F = room.freedoms.basis * units
    v = F[:3] + np.cross(F[3:], room.about, axisa=0, axisc=0)
    return np.concatenate([room.turn @ v, room.turn @ F[3:]])


def is_at_rest(text: str) -> bool:
    """Whether a requirement asks nothing at poses, of strokes or stresses."""
    return not any(word in text for word in (" at ", " over ", "margin", "stress", "reach", "buckling", " under "))


def clashes_of(mechanism: Mechanism) -> tuple[str, ...]:
    """Solids that share space, in words; blocks of the base are one where they do."""
    found = (own for own in check(mechanism).clashes if own.kind == "clash")
    return tuple(own.text for own in found if not all(_is_base(name) for name in (own.first, own.second)))


def _is_base(name: str) -> bool:
    return name.rsplit(".", maxsplit=1)[-1].startswith("base")
