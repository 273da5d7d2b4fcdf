"""Freedoms, constraints and over-constraints of a mechanism, counted by singular values of its constraint matrix."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flexura.analysis.static.counting import Count, counted_between
from flexura.analysis.static.deformations import GROUND, LEAST_GAP, SUPPORT, Skeleton
from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.errors import Diagnostic
from flexura.full_order import unloaded
from flexura.mechanism import DOF_NAMES, Mechanism
from flexura.methods import motion_labels
from flexura.records import Record
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan
from flexura.tables import Facts, Item, Table, counted, number, quantity
from flexura.thresholds import STILL

COMPETES = 1e-3
"""Share of an over-constraint from which a deformation is named."""

DIRECTION = 1e-6
"""Components of a direction below this are none."""

SOFTEN = "make it soft in this"
"""What may be done to parts, diaphragms, stacks and supports."""

CHANGES = (
    (SOFTEN, ()),
    ("add a notch across its middle", ("bending",)),
    ("fold it across its middle", ("stretch", "bending")),
    ("thin it to a wire", ("shear", "bending", "twist")),
    ("leave it out", ("",)),
)
"""What may be done to a member, the least first, and its deformations that this makes soft."""


@dataclass(frozen=True, repr=False)
class MemberConstraints(Record):
    """What a member does: the names of the two bodies, or more, that it is between, and of its `stiff` deformations,
    its constraints, and its `soft` ones; `stiffness` of the stiff and then the soft ones, N/m or N m/rad, and the `gap`
    between both where rotations are counted as what they move at `length`, m."""

    name: str
    kind: str
    bodies: tuple[str, ...]
    stiff: tuple[str, ...]
    soft: tuple[str, ...]
    stiffness: tuple[float, ...]
    gap: float
    length: float

    @property
    def is_clear(self) -> bool:
        """Whether stiff and soft are far apart."""
        return self.gap >= LEAST_GAP


@dataclass(frozen=True, repr=False)
class Competitor(Record):
    """A stiff deformation of a member in which it competes with others.

    `share` is the part of the over-constraints that it takes up; over all deformations these add up to their number.
    `force`, N/m or N m/rad, is what a misfit in this deformation meets. `group` numbers those that compete with each
    other, `direction` (3,) is the axis of the deformation, global frame, and `turns` whether it is a rotation.
    """

    member: str
    deformation: str
    share: float
    force: float
    group: int
    direction: tuple[float, float, float]
    turns: bool

    @property
    def along(self) -> str:
        """The deformation's axis in words, such as `about x`."""
        d = np.array(self.direction)
        axis = int(np.argmax(np.abs(d)))
        is_axis = np.abs(np.delete(d, axis)).max() < 1e-3
        text = "xyz"[axis] if is_axis else "(" + ", ".join(f"{c:.3g}" for c in d) + ")"
        return f"{'about' if self.turns else 'along'} {text}"


@dataclass(frozen=True, repr=False)
class Release(Record):
    """A change of one member that takes away over-constraints and adds no freedom: what is done to it, the deformations
    that this makes soft, and how many over-constraints are `left`."""

    member: str
    change: str
    deformations: tuple[str, ...]
    left: int


@dataclass(frozen=True, repr=False)
class Constraints(Tabular):
    """Freedoms, constraints and over-constraints of a mechanism, or between two of its bodies (theory eqs. Y4-Y9).

    `held` is the body relative to which others move and `between` the two that were asked for, if any. `freedoms` of
    the described bodies are by the coordinates that determine them; `internal` freedoms leave these bodies at rest.
    `n_constraints` are all stiff deformations, of `n_motions` motions of bodies, so that `n_motions - n_constraints =
    freedoms + internal - over`. `over` counts over-constraints, states of self-stress in stiff deformations alone.

    `least_constrained` is the energy in stiff deformations over that in soft ones of the motion that is least of all
    constrained, and `most_constrained` that of the freedom that is most; between both is the `gap` by which they are
    told apart. `competitors` are who competes with whom, `releases` what makes it exact one by one, and `exact` some of
    them that together leave no over-constraint, if there are such.
    """

    _shown = ("name", "freedoms", "internal", "over")
    _listed = ("member", "between", "constraints", "gap")

    name: str
    held: str
    between: tuple[str, str] | None
    members: tuple[MemberConstraints, ...]
    n_motions: int
    n_constraints: int
    freedoms: tuple[str, ...]
    internal: int
    loose: int
    over: int
    least_constrained: float
    most_constrained: float
    competitors: tuple[Competitor, ...]
    releases: tuple[Release, ...]
    exact: tuple[Release, ...]
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    @property
    def gap(self) -> float:
        """How many times more the least constrained motion is constrained than the freedom that is most."""
        return self.least_constrained / self.most_constrained if self.most_constrained > 0 else np.inf

    def _title(self) -> str:
        exact = f"over-constrained {_times(self.over)}" if self.over else "exactly constrained"
        return f"{counted(len(self.freedoms), 'freedom')}, {exact}"

    def _data(self) -> dict[str, Any]:
        return {f: getattr(self, f) for f in self.__dataclass_fields__ if f not in ("notes", "warnings")} | {
            "gap": self.gap
        }

    def presentation(self) -> Iterator[Item]:
        moving = f"{self.between[1]} relative to {self.between[0]}" if self.between else f"relative to {self.held}"
        yield Facts(
            {
                "freedoms": f"{len(self.freedoms)} {moving}"
                + (f": {', '.join(self.freedoms)}" if self.freedoms else ""),
                "internal freedoms": self.internal or "",
                "motions without any stiffness": self.loose or "",
                "over-constraints": self.over,
                "count": f"{self.n_motions} motions - {counted(self.n_constraints, 'constraint')} = "
                f"{counted(len(self.freedoms) + self.internal, 'freedom')} - {counted(self.over, 'over-constraint')}",
                "energy, stiff over soft": f"at least {number(self.least_constrained, 3)} where constrained, "
                f"at most {number(self.most_constrained, 3)} where free",
            }
        )
        if self.competitors:
            yield Table(self.competing_columns(), "deformations", "who competes with whom")
        for title, own in (
            ("each of these takes away over-constraints", self.releases),
            ("these together", self.exact),
        ):
            if own:
                columns = {
                    "member": [r.member for r in own],
                    "change": [r.change for r in own],
                    "makes soft": [", ".join(r.deformations) for r in own],
                    "over-constraints left": [r.left for r in own],
                }
                yield Table(columns, "changes", title)
        yield from super().presentation()

    def competing_columns(self) -> dict[str, Any]:
        """Deformations that compete, by group."""
        own = self.competitors
        return {
            "group": [c.group for c in own],
            "member": [c.member for c in own],
            "deformation": [c.deformation for c in own],
            "axis": [c.along for c in own],
            "share": [number(c.share, 3) for c in own],
            "resists a misfit by": [quantity(c.force, "N*m/rad" if c.turns else "N/m", 3) for c in own],
        }

    def _columns(self) -> dict[str, Any]:
        own = self.members
        return {
            "member": [m.name for m in own],
            "between": [" - ".join(m.bodies) for m in own],
            "constraints": [", ".join(m.stiff) for m in own],
            "n constraints": [len(m.stiff) for m in own],
            "soft": [", ".join(m.soft) for m in own],
            "gap": [m.gap for m in own],
        }


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


@verb
def constraints(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    between: Sequence[str] | None = None,
) -> Constraints:
    """Freedoms, constraints and over-constraints of a mechanism, or `between` two of its bodies (theory eqs. Y4-Y9).

    Deformations of every member are divided into stiff ones, its constraints, and soft ones by a gap in its stiffness.
    Bodies and links are rigid. Motions of the bodies whose energy is in soft deformations are freedoms, and forces that
    stiff deformations exert on each other over-constraints (Maxwell 1864; Calladine 1978). Between two bodies, nodes or
    `ground`, only members count that lie between them, and the freedoms are those of the second, or of the one that is
    not the ground. `parameters` replace those of the description, SI.

    Raises ModelError; OptionError for unknown bodies, two that are one, a described pose, and where nothing is elastic.
    """
    own = unloaded(model, parameters)
    if between is not None and list(between[1:]) == [GROUND]:
        between = (GROUND, between[0])  # which is what others move against
    found, count, pair = counted_between(own, between)
    freedoms = _freedoms(found, count, pair)
    competitors = tuple(_competitors(found, count))
    releases = tuple(_releases(found, count, {c.member for c in competitors}))
    members = tuple(_member(found, k) for k in count.chosen)
    free, fixed = (float(own) for own in count.extremes)
    return Constraints(
        name=own.name,
        held=found.names[count.held],
        between=None if pair is None else (str(between[0]), str(between[1])),  # type: ignore[index]
        members=members,
        n_motions=6 * len(count.moving),
        n_constraints=len(count.owner),
        freedoms=freedoms,
        internal=count.freedoms - len(freedoms),
        loose=count.loose,
        over=count.over,
        least_constrained=fixed,
        most_constrained=free,
        competitors=competitors,
        releases=releases,
        exact=tuple(_exact(found, count, {c.member for c in competitors})),
        notes=found.notes,
        warnings=tuple(_unclear(members, fixed, free)),
    )


def _freedoms(found: Skeleton, count: Count, pair: tuple[int, int] | None) -> tuple[str, ...]:
    """Freedoms of the described bodies that move, or of the second of two, by the coordinates that determine them."""
    looked_at = [pair[1]] if pair else [b for b in found.described if b != count.held] or count.moving
    names = [f"{found.names[b]}.{dof}" for b in looked_at for dof in DOF_NAMES]
    motions = count.of_bodies(*looked_at).freedoms
    U, size, _ = la.svd(motions / np.linalg.norm(motions, axis=0), full_matrices=False)
    r = int((size > STILL).sum())
    return motion_labels(U[:, :r], names) if r else ()


def _member(found: Skeleton, k: int) -> MemberConstraints:
    """What one of them does."""
    own, d = found.elastic[k], found.divisions[k]
    turns = own.turns[d.coordinate]
    labels = [own.labels[c] for c in d.coordinate]
    stiffness = np.where(turns, d.level * d.length**2, d.level)
    bodies = tuple(found.names[b] for b in own.bodies)
    stiff, soft = tuple(labels[: d.count]), tuple(labels[d.count :])
    return MemberConstraints(own.name, own.kind, bodies, stiff, soft, tuple(stiffness.tolist()), d.gap, d.length)


def _unclear(members: Sequence[MemberConstraints], fixed: float, free: float) -> Iterator[Diagnostic]:
    """Where stiff and soft, constrained and free, are not far apart."""
    for m in members:
        if m.gap < LEAST_GAP:
            text = (
                f"{m.name} has no clear constraints: its deformations are at most {m.gap:.3g} times as stiff as others"
            )
            yield Diagnostic("no gap", m.name, m.gap, LEAST_GAP, "1", text)
    for value, of, text in (
        (
            1 / fixed,
            fixed,
            "motions that are constrained have only {:.3g} times as much energy in stiff deformations as in soft ones",
        ),
        (free, free, "motions that are free have {:.3g} times as much energy in stiff deformations as in soft ones"),
    ):
        if value > 1 / LEAST_GAP:
            yield Diagnostic("no gap", "", value, 1 / LEAST_GAP, "1", f"the count is not clear: {text.format(of)}")


def _competitors(found: Skeleton, count: Count) -> Iterator[Competitor]:
    """Deformations that take part in over-constraints, group by group."""
    P = count.stress @ count.stress.T
    shares = np.diagonal(P)
    support = np.array([found.elastic[k].kind == "support" for k in count.owner[:, 0]], dtype=bool)
    at = np.flatnonzero(shares > np.where(support, COMPETES / SUPPORT**2, COMPETES))
    label = connected_components(coo_array((np.abs(P) > COMPETES).astype(float)), directed=False)[1][at]
    groups = {own: k + 1 for k, own in enumerate(dict.fromkeys(label.tolist()))}
    for row, own in sorted(zip(at.tolist(), label.tolist(), strict=True), key=lambda pair: groups[pair[1]]):
        k, j = count.owner[row]
        member, d = found.elastic[k], found.divisions[k]
        c = d.coordinate[j]
        turns = bool(member.turns[c])
        force = float(shares[row] * d.level[j] * (d.length**2 if turns else 1.0))
        direction = np.where(np.abs(member.directions[c]) < DIRECTION, 0.0, member.directions[c])
        yield Competitor(
            member.name, member.labels[c], float(shares[row]), force, groups[own], tuple(direction.tolist()), turns
        )


def _changes(found: Skeleton, count: Count, members: Collection[str]) -> Iterator[tuple[str, str, Index]]:
    """Changes of members that compete, the least first: name, what is done, and the constraints that become soft."""
    for k in dict.fromkeys(count.owner[:, 0].tolist()):
        own = found.elastic[k]
        if own.name not in members:
            continue
        rows = np.flatnonzero(count.owner[:, 0] == k)
        labels = [own.labels[found.divisions[k].coordinate[j]] for j in count.owner[rows, 1]]
        for change, softened in CHANGES if own.kind == "member" else ():
            at = rows[[any(label.startswith(what) for what in softened) for label in labels]]
            if len(at) and (len(at) < len(rows) or change == CHANGES[-1][0]):
                yield own.name, change, at
        if own.kind != "member":
            for row in rows:
                yield own.name, SOFTEN, np.array([row])
            yield own.name, CHANGES[-1][0], rows


def _releases(found: Skeleton, count: Count, members: Collection[str]) -> Iterator[Release]:
    """Changes of one member that take away over-constraints and add no freedom (theory eq. Y9)."""
    seen = set()
    for member, change, rows in _changes(found, count, members):
        if (member, rows.tobytes()) not in seen and _adds_no_freedom(count.stress[rows]):
            seen.add((member, rows.tobytes()))
            yield _release(found, count, member, change, rows, count.over - len(rows))
    for k in dict.fromkeys(count.owner[:, 0].tolist()):
        own = found.elastic[k]
        if own.kind == "member" and own.name in members:
            turned = count.turned(found, k)
            if turned.over < count.over and turned.freedoms <= count.freedoms:
                yield Release(own.name, "turn it by 90 deg about its axis", (), turned.over)


def _exact(found: Skeleton, count: Count, members: Collection[str]) -> Iterator[Release]:
    """Changes that together leave no over-constraint; none where some are left."""
    stress, chosen = count.stress, {}
    order = [change for change, _ in CHANGES]
    changes = sorted(_changes(found, count, members), key=lambda own: order.index(own[1]))
    for member, change, rows in changes:
        softened = chosen[member][1] if member in chosen else rows[:0]
        more = np.setdiff1d(rows, softened)
        if len(more) and _adds_no_freedom(stress[more]):
            stress = stress @ la.null_space(stress[more], rcond=STILL)
            chosen[member] = change, np.union1d(rows, softened)
    left = count.over
    for member, (change, rows) in chosen.items() if not stress.shape[1] else ():
        left -= len(rows)
        yield _release(found, count, member, change, rows, left)


def _adds_no_freedom(stress: Array) -> bool:
    """Whether forces in these constraints, by states of self-stress (r, o), are independent of each other."""
    if len(stress) > stress.shape[1]:
        return False
    size = np.linalg.norm(stress, axis=1)
    return bool((size > STILL).all()) and la.svdvals(stress / size[:, None])[-1] > STILL


def _release(found: Skeleton, count: Count, member: str, change: str, rows: Index, left: int) -> Release:
    labels = [found.elastic[k].labels[found.divisions[k].coordinate[j]] for k, j in count.owner[rows]]
    return Release(member, change, tuple(labels), left)
