"""What mountings that are not where they should be do to a mechanism: assembly loads, stress, frequencies, buckling and
support stiffness, with large displacements (theory eqs. Y10-Y11)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.analysis import driven_displacement, moved_deformations, ratios_to_yield
from flexura.arguments import verb
from flexura.arrays import Array, Index
from flexura.deadline import checkpoint
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.full_order import at_rest
from flexura.mechanism import DOF_NAMES, Mechanism, matching
from flexura.motion import (
    Equations,
    Equilibrium,
    MovingModel,
    Path,
    Point,
    Pose,
    Stopped,
    beyond,
    buckling_factor,
    described_loads,
    end_forces,
)
from flexura.records import Record
from flexura.results import Tabular
from flexura.structure import FullOrderModel, Plan
from flexura.study.space import Sobol
from flexura.tables import Facts, Item, Table, number, quantity

PERCENTILES = (5.0, 50.0, 95.0)

ALIKE = 1e-6
"""Difference of a quantity to both sides of a direction, over its largest, that points to neither."""


@dataclass(frozen=True, repr=False)
class Mount(Record):
    """A mounting by the node that the ground holds, and how far off it may be in each direction, m and rad (6,), plus
    or minus."""

    node: str
    tolerance: tuple[float, ...]


@dataclass(frozen=True, repr=False)
class MisalignedQuantity(Record):
    """A quantity over misalignments: its value when all is in place, its percentiles (5, 50, 95 %) over the samples,
    the worst that was found, at `offsets` of the mounts (6 m,), m and rad, and the largest effect of one direction of
    one mount alone, by its name."""

    name: str
    unit: str
    nominal: float
    percentiles: tuple[float, ...]
    worst: float
    offsets: tuple[float, ...]
    most_by: str


@dataclass(frozen=True, repr=False)
class Misalignment(Tabular):
    """What misaligned mountings do (theory eqs. Y10-Y11).

    `offsets` (k, 6 m) are those of all mounts that were looked at, m and rad, first none, then each direction to either
    side, then the samples, from number `first_sample` on, last the corners; `values` (k, q) are the quantities at
    these, NaN where there is no equilibrium. `quantities` say what each may come to.
    """

    _shown = ("name", "mounts", "quantities")

    name: str
    node: str
    mounts: tuple[Mount, ...]
    move: dict[str, float]
    quantities: tuple[MisalignedQuantity, ...]
    offsets: Array
    values: Array
    first_sample: int
    samples: int
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()

    def _title(self) -> str:
        return f"{self.samples} samples of {len(self.mounts)} misaligned mounts"

    def quantity(self, name: str) -> MisalignedQuantity:
        """One of the quantities by its name. Raises OptionError for others."""
        for own in self.quantities:
            if own.name == name:
                return own
        raise OptionError(f"there is no {name!r}; there are {', '.join(own.name for own in self.quantities)}")

    def presentation(self) -> Iterator[Item]:
        tolerances = {
            own.node: " ".join(
                f"± {quantity(max(part), unit, 3)}"
                for part, unit in ((own.tolerance[:3], "m"), (own.tolerance[3:], "rad"))
            )
            for own in self.mounts
        }
        yield Facts({"misaligned": tolerances, "node": self.node})
        shown = [(own, _shown_in(own)) for own in self.quantities]
        yield Table(
            {
                "quantity": [own.name for own, _ in shown],
                "in place": [text(own.nominal) for own, text in shown],
                **{
                    f"{share:g} %": [text(own.percentiles[k]) for own, text in shown]
                    for k, share in enumerate(PERCENTILES)
                },
                "worst found": [text(own.worst) for own, text in shown],
                "most by": [own.most_by for own, _ in shown],
            },
            "quantities",
        )

    def _columns(self) -> dict[str, Any]:
        names = [f"{m.node} {dof} [{'m' if k < 3 else 'rad'}]" for m in self.mounts for k, dof in enumerate(DOF_NAMES)]
        found = dict(zip(names, self.offsets.T, strict=True))
        heads = [f"{own.name} [{own.unit}]" if own.unit else own.name for own in self.quantities]
        return found | dict(zip(heads, self.values.T, strict=True))


def _shown_in(own: MisalignedQuantity) -> Any:
    return lambda value: "" if np.isnan(value) else (quantity(value, own.unit, 4) if own.unit else number(value, 4))


@verb
def misalignment(
    model: Mechanism | Plan | FullOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    mounts: Mapping[str, Sequence[float]],
    node: str | None = None,
    move: Mapping[str, float] | None = None,
    n: int = 3,
    samples: int = 64,
    seed: int = 0,
) -> Misalignment:
    """What mountings that are off by tolerances do to a mechanism, large displacements included (theory eqs. Y10-Y11).

    `mounts` are tolerances, plus or minus, of nodes that the ground clamps, wildcards allowed: of position, m, and of
    rotation, rad, or of six directions. All are put on at once, evenly spread in scrambled Sobol' points, and each
    direction alone; then corners to which these point. At each state: force and moment that a mount exerts more than
    when in place, the `n` lowest frequencies, what is left until it buckles and yields, and the support stiffness of
    `node`, by default the only body that moves, with the displacements of `move` prescribed as in `stroke`.

    Raises ModelError; OptionError for what is no mount, no tolerance, or cannot turn; SolverError where there is no
    equilibrium with everything in place.
    """
    for name, value, least in (("n", n, 1), ("samples", samples, 0), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            raise OptionError(f"{name} is a whole number, at least {least}, not {value!r}")
    full = at_rest(model, parameters)
    if not mounts:
        raise OptionError("mounts name at least one node that the ground clamps, with its tolerances")
    found = _mounts(full, mounts)
    work = _Assembly.of(full, found, _node(full, node), move or {}, n)
    tolerance = np.concatenate([own.tolerance for own in found])
    used = np.flatnonzero(tolerance)
    single = np.concatenate([[np.zeros(len(tolerance))], *([unit, -unit] for unit in np.diag(tolerance)[used])])
    drawn = np.zeros((samples, len(tolerance)))
    if samples:
        drawn[:, used] = (2 * Sobol.of(samples, len(used), seed)(0, samples) - 1) * tolerance[used]
    offsets = np.concatenate([single, drawn])
    values = work.values(offsets)
    corners = _corners(work.names, offsets, values, used, len(single))
    offsets, values = np.concatenate([offsets, corners]), np.concatenate([values, work.values(corners)])
    labels = [f"{own.node}.{dof}" for own in found for dof in DOF_NAMES]
    inside = slice(len(single), len(single) + samples)
    return Misalignment(
        name=full.name,
        node=work.node_name,
        mounts=found,
        move=dict(move or {}),
        quantities=tuple(_quantities(work.names, offsets, values, inside, [labels[k] for k in used])),
        offsets=offsets,
        values=values,
        first_sample=len(single),
        samples=samples,
        notes=("the worst found is that of the samples and of corners to which single directions point",),
        warnings=tuple(work.warned(values)),
    )


def _mounts(model: FullOrderModel, given: Mapping[str, Sequence[float]]) -> tuple[Mount, ...]:
    """The mounts with their tolerances. Raises OptionError."""
    topology = model.plan.topology
    names = topology.node_names
    held = [names[k] for k in np.flatnonzero(topology.is_clamped)]
    mounts: dict[str, Mount] = {}
    for text, tolerance in given.items():
        nodes = matching(text, held)
        if not nodes:
            raise OptionError(f"{text} is no mount: the ground clamps {', '.join(held[:8]) or 'nothing'}")
        own = np.asarray(tolerance, dtype=float).ravel()
        own = np.repeat(own, 3) if len(own) == 2 else own
        if own.shape != (6,) or not np.isfinite(own).all() or (own < 0).any():
            raise OptionError(f"a tolerance of {text} is m and rad, or six of them, none negative, not {tolerance!r}")
        for node in nodes:
            if node in mounts:
                raise OptionError(f"{node} is misaligned twice")
            mounts[node] = Mount(node, tuple(own.tolist()))
    roots = topology.root[topology.numbers(list(mounts))]
    if len(set(roots.tolist())) < len(roots):
        raise OptionError("two of these mounts are one body: give it the tolerance of one of them")
    if not any(any(own.tolerance) for own in mounts.values()):
        raise OptionError("no tolerance is more than zero: nothing is misaligned")
    return tuple(mounts.values())


def _node(model: FullOrderModel, node: str | None) -> str:
    """The node whose support is looked at. Raises OptionError."""
    if node is not None:
        model.plan.topology.numbers([node])
        return node
    bodies = model.plan.moving_bodies
    if not bodies:
        raise OptionError("name the node whose support stiffness is asked for: no body moves")
    if len(bodies) > 1:
        raise OptionError(f"name the node: there are {len(bodies)} moving bodies ({', '.join(bodies[:8])})")
    return bodies[0]


@dataclass(frozen=True)
class _Assembly:
    """A mechanism whose mounts are displaced: frames that the ground holds are put elsewhere."""

    full: FullOrderModel
    equations: Equations
    roots: Index
    node_name: str
    node: int
    at: Point
    count: int
    in_place: Equilibrium
    names: tuple[tuple[str, str, int], ...]
    states: list[Equilibrium] = field(default_factory=list)

    @staticmethod
    def of(full: FullOrderModel, mounts: Sequence[Mount], node: str, move: Mapping[str, float], n: int) -> _Assembly:
        """With everything in place. Raises OptionError and SolverError."""
        moving = MovingModel.of(full.design)
        equations = Equations(moving, [driven_displacement(moving, name) for name in move])
        equations.independent()
        for name, value in move.items():
            if np.ndim(value) or not np.isfinite(value):
                raise OptionError(f"{name} is moved by a finite number, m or rad, not {value!r}")
        targets = np.array(list(move.values()), dtype=float)
        at = Point(targets, described_loads(full.design))
        state = Path.from_rest(equations, at)
        if isinstance(state, Stopped):
            raise SolverError("there is no equilibrium with all mounts in place, under what loads and moves it")
        topology = full.plan.topology
        names = [
            (f"{what} at {own.node}", unit, 1) for own in mounts for what, unit in (("force", "N"), ("moment", "N*m"))
        ]
        names += [(f"f{k + 1}", "Hz", -1) for k in range(min(n, moving.n_dof))]
        names += [("factor to buckle", "", -1), ("factor to yield", "", -1)]
        names += [(f"stiffness {node}.{dof}", "N/m" if k < 3 else "N*m/rad", -1) for k, dof in enumerate(DOF_NAMES)]
        return _Assembly(
            full,
            equations,
            topology.root[topology.numbers([own.node for own in mounts])],
            node,
            int(topology.numbers([node])[0]),
            at,
            min(n, moving.n_dof),
            state,
            tuple(names),
        )

    def values(self, offsets: Array) -> Array:
        """Quantities (k, q) at offsets (k, 6 m); NaN where no equilibrium is found."""
        rows = np.full((len(offsets), len(self.names)), np.nan)
        for row, own in zip(rows, offsets, strict=True):
            checkpoint()
            state = self._state(own.reshape(-1, 6))
            if state is not None:
                self.states.append(state)
                row[:] = self._asked(state)
        return rows

    def _state(self, offsets: Array) -> Equilibrium | None:
        """The equilibrium with mounts at offsets (m, 6), put on little by little where it must be."""
        held = np.zeros(self.equations.model.dof.shape)
        held[self.roots] = offsets
        state = Path(self.equations, self.in_place, self.at).to(replace(self.at, held=held))
        return None if isinstance(state, Stopped) else state

    def _reactions(self, state: Equilibrium) -> Array:
        """Force and moment (m, 6) that the ground exerts at the mounts."""
        exerted = state.tangent.forces.force - state.loads.forces(self.equations.model, state.frames)
        return exerted[self.roots]

    def _asked(self, state: Equilibrium) -> Array:
        pose, has_drives = Pose(self.equations, state), bool(self.equations.drives)
        more = self._reactions(state) - self._reactions(self.in_place)
        loads = np.linalg.norm(more.reshape(-1, 2, 3), axis=2).ravel()
        values = pose.modes(self.count).values
        hertz = np.sign(values) * np.sqrt(np.abs(values)) / (2 * np.pi)
        flexible = np.diagonal(pose.compliance(self.node, held=has_drives))
        loose = np.diagonal(pose.compliance(self.node)) if has_drives else flexible
        stiffness = np.divide(1.0, flexible, out=np.full(6, np.nan), where=np.abs(flexible) > 1e-9 * np.abs(loose))
        buckles = buckling_factor(pose)
        moving = self.equations.model
        forces, deformed = end_forces(moving, [state]), moved_deformations(self.full, moving, [state])
        ratios = ratios_to_yield(self.full, forces.__getitem__, deformed, 1).ratio
        largest = float(np.nanmax(ratios)) if ratios.size else 0.0
        margins = [np.nan if buckles is None else buckles, 1 / largest if largest > 0 else np.nan]
        asked = np.concatenate([loads, hertz, margins, stiffness])
        if values[0] < 0:  # it has buckled, and is elsewhere
            asked[[unit != "Hz" and name != "factor to buckle" for name, unit, _ in self.names]] = np.nan
        return asked

    def warned(self, values: Array) -> Iterator[Diagnostic]:
        """Where there is no equilibrium, where it is not stable, and where motion is beyond its limits."""
        lost = int(np.isnan(values).all(axis=1).sum())
        if lost:
            text = f"{lost} of {len(values)} misalignments have no equilibrium that leads on from that in place:"
            text += " it buckles on the way, and what is worst is not known"
            yield Diagnostic("no equilibrium", "", lost, 0.0, "1", text)
        first = next(k for k, (name, _, _) in enumerate(self.names) if name == "f1")
        buckled = int((values[:, first] < 0).sum())
        if buckled:
            text = (
                f"in {buckled} of {len(values)} misalignments the mechanism has buckled: how it moves on is not known"
            )
            yield Diagnostic("buckling", "", buckled, 0.0, "1", text)
        yield from beyond(self.equations.model, [state.frames for state in self.states])


def _worst(names: Sequence[tuple[str, str, int]], values: Array) -> Index:
    """Where quantities (q,) are worst; zero where none is known."""
    sign = np.array([own[2] for own in names])
    known = np.where(np.isnan(values), -np.inf, values * sign)
    return np.argmax(known, axis=0)


def _corners(names: Sequence[tuple[str, str, int]], offsets: Array, values: Array, used: Index, singles: int) -> Array:
    """Corners of the tolerances (k, 6 m) to which the worst samples of quantities point, and single directions: where
    both sides are alike, the worst sample tells."""
    tolerance = np.abs(offsets[:singles]).max(axis=0)
    size = np.where(np.isnan(values), -np.inf, values * np.array([own[2] for own in names]))
    largest = size.max(axis=0)
    first = np.argmax(size >= largest - ALIKE * np.where(np.isfinite(largest), np.abs(largest), 0.0), axis=0)
    corners = list(np.where(offsets[first] >= 0, 1.0, -1.0) * tolerance)
    for q, (_, _, sign) in enumerate(names):
        up, down = np.nan_to_num(values[1:singles:2, q]), np.nan_to_num(values[2:singles:2, q])
        alike = ALIKE * max(np.abs(up).max(initial=0.0), np.abs(down).max(initial=0.0))
        points = np.where(sign * (up - down) > 0, 1.0, -1.0) * tolerance[used]
        corner = np.zeros_like(tolerance)
        corner[used] = np.where(np.abs(up - down) <= alike, corners[q][used], points)
        corners.append(corner)
    return np.unique(np.array(corners), axis=0)


def _quantities(
    names: Sequence[tuple[str, str, int]], offsets: Array, values: Array, inside: slice, labels: Sequence[str]
) -> Iterator[MisalignedQuantity]:
    worst = _worst(names, values)
    for q, (name, unit, _) in enumerate(names):
        drawn = values[inside, q]
        drawn = drawn[~np.isnan(drawn)]
        shares = np.percentile(drawn, PERCENTILES).tolist() if len(drawn) else [np.nan] * len(PERCENTILES)
        alone = np.nan_to_num(np.abs(values[1 : inside.start, q] - values[0, q])).reshape(-1, 2).max(axis=1)
        yield MisalignedQuantity(
            name,
            unit,
            float(values[0, q]),
            tuple(shares),
            float(values[worst[q], q]),
            tuple(offsets[worst[q]].tolist()),
            labels[int(np.argmax(alone))] if alone.any() else "",
        )
