"""One design in the states that it is asked in, and which of its modes moves something most."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from flexura.analysis import ModelError, Statics, Stresses, errors_of, preload, statics, worst_stresses
from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import counted_intervals, factorise, is_definite
from flexura.mechanism import at
from flexura.modal import REPEATED, close_groups
from flexura.motion import Holding, Pose, PosedDesign, buckling_factor, reached
from flexura.reduction import HERTZ, certificate, chained, flexibility, lowest_pairs
from flexura.structure import Design, FullOrderModel, Plan, full_order_model
from flexura.study.questions.blocks import Bounded, without_round_off
from flexura.study.questions.reading import Freedom, Members, Port, pose_text
from flexura.systems import InputPort, Ports

MODES = 12
"""So many of the lowest modes are looked at."""

AMBIGUOUS = 0.8
"""Share of a displacement, over that of the leading mode, from which another mode has nearly as much."""

STILL = 1e-7
"""Part of the largest motion of its kind below which something does not move."""

CLEARLY_STILL = 1e-4
"""The same, of modes that are a little off."""

CLEARLY = 0.5
"""Share of a displacement, over that of the leading mode, that others close to one another have at most."""

EXACTLY = 1e-6
"""Relative difference of frequencies that are equal in such modes."""

ORDERED = 2e-3
"""Least gap of others, relative, with which it is sure which of them is the lower one."""

APART, MIXED = 0.02, 1e-2
"""Modes closer than this may mix, which matters where the other one has more than this share of the displacement."""

SLOWEST = 1e-9
"""Part of the highest frequency below which a motion is rigid, and counts as one of this frequency."""


def leading_mode(hertz: Array, moved: Array, largest: float, name: str) -> tuple[int, str]:
    """The number, from 0, of the mode that has most of a displacement, and in words which others have nearly as much.

    Modes of frequencies (k,), Hz, have unit modal mass and the displacement (k,) in them; `largest` is the largest one
    of its kind anywhere. Frequencies that are equal count as one. Raises SolverError where it does not move.
    """
    groups = close_groups(hertz, REPEATED)
    squares = np.array([(moved[group] ** 2).sum() for group in groups])
    if not squares.max(initial=0.0) > (STILL * largest) ** 2:
        raise SolverError(f"{name} does not move in the lowest {len(hertz)} modes")
    shares = squares / np.maximum([hertz[group[0]] for group in groups], SLOWEST * hertz.max())
    first = int(np.argmax(shares))
    near = [k for k in range(len(groups)) if k != first and shares[k] >= AMBIGUOUS * shares[first]]
    if not near:
        return int(groups[first][0]), ""
    others = ", ".join(f"f{groups[k][0] + 1} has {shares[k] / shares[first]:.0%}" for k in near)
    return int(groups[first][0]), f"{name} moves in several modes: of its part in f{groups[first][0] + 1}, {others}"


def clear_mode(hertz: Array, moved: Array, largest: float, name: str) -> int | None:
    """The number, from 0, of the mode that has most of a displacement, from modes that are a little off, as
    `leading_mode`; None where the right ones may say otherwise, or say that there is doubt."""
    if not np.isfinite(hertz).all() or not np.abs(moved).max(initial=0.0) > CLEARLY_STILL * largest:
        return None
    number, _ = leading_mode(hertz, moved, largest, name)
    own, part = hertz[number], moved**2 / hertz
    alike = abs(hertz / own - 1) <= EXACTLY
    rest, most = np.where(alike, 0.0, part), part[alike].sum()
    gap = np.where(alike, np.inf, abs(hertz / own - 1))
    together = max(rest[group].sum() for group in close_groups(hertz, APART))
    mixes = (gap < APART) & (rest > MIXED * most)
    is_clear = together <= CLEARLY * most and gap.min(initial=np.inf) > ORDERED and not mixes.any()
    return number if is_clear else None


HELD = 1e-9
"""Part of the compliance of something free that is left of it where a pose holds it, by round-off."""


UNKNOWN = "no stress is known of sections that are given by constants"


class AtRest:
    """A design as its description leaves it: at rest, or about the state of load or the pose that is described."""

    def __init__(self, plan: Plan, parameters: Mapping[str, float]) -> None:
        self.plan = plan
        self.parameters = parameters
        self._moved: dict[str, tuple[Array, Array]] = {}

    @cached_property
    def model(self) -> FullOrderModel:
        """Its full-order model."""
        return full_order_model(Design.of(self.plan, self.parameters))

    @cached_property
    def _ports(self) -> Ports:
        return Ports(self.model.design)

    @cached_property
    def _solve(self) -> Any:
        return flexibility(self.model).held

    def _row(self, what: Freedom | InputPort) -> tuple[Array, Array]:
        """The row (n,) that reads a motion, and displacements (n,) by a unit force along it."""
        name = what.name if isinstance(what, Freedom) else f"{what.channel.name} as an input"
        if name not in self._moved:
            if isinstance(what, Freedom):
                number = self.plan.topology.numbers([what.node])
                row = self.model.design.node_rows(number).toarray()[what.component]
            else:
                row = what.row
            self._moved[name] = row, self._solve(np.ascontiguousarray(row[:, None]))[:, 0]
        return self._moved[name]

    def _between(self, one: Freedom | InputPort, other: Freedom | InputPort) -> float:
        """Displacement along one by a unit force along the other, symmetric to the last digit."""
        (a, by_a), (b, by_b) = self._row(one), self._row(other)
        return float((a @ by_b + b @ by_a) / 2)

    def _bound(self, one: Freedom | InputPort, other: Freedom | InputPort) -> float:
        return self._between(one, one) * self._between(other, other)

    def compliance(self, to: Freedom, by: Freedom) -> float:
        """Displacement per force or moment."""
        return float(without_round_off(self._between(to, by), self._bound(to, by)))

    def stiffness(self, of: Freedom) -> float:
        """Force or moment per displacement, everything else free."""
        return 1 / self.compliance(of, of)

    def _input(self, actuator: Port) -> InputPort:
        return self._ports.inputs([actuator.known])[0]

    def coupling(self, actuator: Port, to: Freedom) -> float:
        """Displacement per unit command."""
        into = self._input(actuator)
        return float(without_round_off(self._between(to, into), self._bound(to, into)) * into.gain)

    def most(self, kind: str, actuator: Port, to: Freedom) -> float:
        """The coupling, or amplification, that the flexibility of both ends allows (Cauchy and Schwarz)."""
        into = self._input(actuator)
        most = float(np.sqrt(abs(self._bound(to, into))))
        return most * abs(into.gain) if kind == "coupling" else most / abs(self._between(into, into))

    def amplification(self, actuator: Port, to: Freedom) -> float:
        """Displacement per elongation of the actuator that makes it."""
        into = self._input(actuator)
        return self.coupling(actuator, to) / abs(self._between(into, into) * into.gain)

    def model_errors(
        self, pairs: Sequence[tuple[Freedom | Port, Freedom | Port]], read: Callable[[Array, Array], Array]
    ) -> ModelError:
        """Model errors of n numbers that are read of displacements (p,) along one by a force along the other of each
        pair, NaN where these are zero, and of those along the force itself."""
        names = list(dict.fromkeys(own for pair in pairs for own in pair))
        ends = [self._input(own) if isinstance(own, Port) else own for own in names]
        states = np.column_stack([self._row(own)[1] for own in ends])
        to, by = np.array([[names.index(own) for own in pair] for pair in pairs]).T
        S = np.array([[self._between(one, other) for one in ends] for other in ends])
        S = without_round_off(S, np.outer(np.diagonal(S), np.diagonal(S)))
        S[S == 0] = np.nan
        return errors_of(self.model, states, lambda E: read((S + E)[to, by], (S + E)[by, by]))

    @cached_property
    def stresses(self) -> Stresses:
        """Stresses under the loads and gravity, or at the pose, that are described."""
        return self._statics.stresses()

    @property
    def stress_error(self) -> tuple[float, float] | None:
        """Where the part's stresses lie, relative to these."""
        return self._statics.stress_error

    @cached_property
    def _statics(self) -> Statics:
        return statics(self.model)

    @property
    def buckling(self) -> float:
        """Factor on all loads and gravity; infinite where they do not buckle it."""
        if self.plan.is_posed:
            return _pose_factor(reached(Design.of(self.plan, self.parameters)).pose)
        return preload(self.plan, self.parameters).buckling_factor

    def frequencies(self, count: int) -> Bounded:
        """The lowest natural frequencies with proven bounds."""
        full = chained(self.model)
        proof = certificate(full, lowest_pairs(full, count), count)
        lower = np.where(proof.is_indexed, proof.lower_hz, 0.0)[:count]
        upper = np.where(proof.is_indexed, proof.upper_hz, np.inf)[:count]
        return Bounded(np.clip(proof.frequency_hz[:count], lower, upper), lower, upper)

    def moved(self, of: Freedom, count: int) -> tuple[Array, Array, float]:
        """The lowest frequencies (k,), Hz, the displacement (k,) in each mode of unit modal mass, and the largest one
        of its kind, translation or rotation, of any node in any of them."""
        full = chained(self.model)
        pairs = lowest_pairs(full, count)
        hertz = np.sqrt(np.maximum(pairs.values[:count], 0)) / HERTZ
        return hertz, *_moved(self.model, full.recover(pairs.vectors[:, :count]), of)


class AtPose:
    """A design at a pose with large displacements; the displacements of the pose hold it."""

    def __init__(self, plan: Plan, parameters: Mapping[str, float], pose: Sequence[tuple[str, float]]) -> None:
        self.words: str = pose_text(pose)
        self.plan: Plan = plan.prepared.once(("posed", tuple(pose)), lambda: Plan(at(plan.mechanism, dict(pose))))
        self.parameters = parameters

    @cached_property
    def _posed(self) -> PosedDesign:
        found = reached(Design.of(self.plan, self.parameters))
        if not is_definite(found.pose.matrices(held=True)[0]):
            raise SolverError(f"at {self.words} it is unstable")
        return found

    @property
    def _pose(self) -> Pose:
        return self._posed.pose

    @cached_property
    def free(self) -> AtRest:
        """What is linear about the pose with nothing held but by forces that stay as they are."""
        return AtRest(self.plan, self.parameters)

    @cached_property
    def _model(self) -> FullOrderModel:
        return FullOrderModel(Design.of(self.plan, self.parameters), self._posed.K, self._posed.M)

    def _drive(self, of: Freedom) -> int | None:
        """Number of the displacement of the pose that this is."""
        names = [drive.name for drive in self._pose.equations.drives]
        return names.index(of.name) if of.name in names else None

    def compliance(self, to: Freedom, by: Freedom) -> float:
        """Displacement per force or moment, the displacements of the pose held but for those asked of.

        Raises SolverError where the pose holds one of them.
        """
        pose, numbers = self._pose, [self.plan.topology.numbers([own.node])[0] for own in (to, by)]
        rows = np.stack([pose.rows(int(n))[own.component] for n, own in zip(numbers, (to, by), strict=True)])
        others = [k for k in range(len(pose.equations.drives)) if k not in (self._drive(to), self._drive(by))]
        holding = Holding.of(pose.state.tangent.rows[others], pose.equations.scale)
        left = holding.rows(rows)
        scale = pose.equations.scale
        sizes = [np.linalg.norm(own / by_unit, axis=1) for own, by_unit in ((left, scale[holding.left]), (rows, scale))]
        for own, size, whole in zip((to, by), *sizes, strict=True):
            if not size > HELD * whole:
                raise SolverError(f"{own.name} is held by the pose")
        moved = factorise(holding.matrix(pose.K)).solve(np.ascontiguousarray(left.T))
        own = left @ moved
        return float(without_round_off((own[0, 1] + own[1, 0]) / 2, own[0, 0] * own[1, 1]))

    def stiffness(self, of: Freedom) -> float:
        """Force or moment per displacement, the other displacements of the pose held."""
        return 1 / self.compliance(of, of)

    def coupling(self, actuator: Port, to: Freedom) -> float:
        """Displacement per unit command, nothing held but by forces that stay as they are."""
        return self.free.coupling(actuator, to)

    def most(self, kind: str, actuator: Port, to: Freedom) -> float:
        """As `AtRest.most`, likewise."""
        return self.free.most(kind, actuator, to)

    def amplification(self, actuator: Port, to: Freedom) -> float:
        """Displacement per elongation of the actuator that makes it, likewise."""
        return self.free.amplification(actuator, to)

    @cached_property
    def stresses(self) -> Stresses:
        """Stresses at the pose."""
        return worst_stresses(self._model, self._posed.end_forces.__getitem__)

    def force(self, of: Freedom) -> float:
        """Force or moment that holds a displacement of the pose."""
        number = self._drive(of)
        assert number is not None
        return float(self._pose.state.drive[number])

    @property
    def buckling(self) -> float:
        """Factor on all loads and on the forces that hold the pose; infinite where nothing buckles."""
        return _pose_factor(self._pose)

    def frequencies(self, count: int) -> Bounded:
        """The lowest natural frequencies with proven bounds, nothing held but by forces that stay as they are."""
        pose = self._pose
        pairs = self._modes(count)
        lower, upper, proven = counted_intervals(pose.K, pose.M, pairs.values, pairs.vectors)
        lower, upper = (np.sqrt(np.maximum(own, 0)) / HERTZ if proven else own * np.nan for own in (lower, upper))
        return Bounded(np.sqrt(pairs.values) / HERTZ, lower, upper)

    def _modes(self, count: int) -> Any:
        pairs = self._pose.modes(count)
        if len(pairs.values) and pairs.values[0] < 0:
            raise SolverError(f"at {self.words} it is unstable under the forces that hold it")
        return pairs

    def moved(self, of: Freedom, count: int) -> tuple[Array, Array, float]:
        """As `AtRest.moved`."""
        pairs = self._modes(count)
        return np.sqrt(pairs.values) / HERTZ, *_moved(self._model, pairs.vectors, of)


State = AtRest | AtPose


def largest_stress(state: State, of: Members | None) -> float:
    """Largest von Mises stress, Pa, notch factors included, of all members or of some; of sections that are known."""
    chosen = None if of is None else set(of.members)
    found = [own.von_mises for own in state.stresses.members if chosen is None or own.name in chosen]
    known = [own for own in found if own is not None]
    if not known:
        raise SolverError(UNKNOWN)
    return max(known)


def least_margin(state: State, of: Members | None) -> float:
    """Least yield stress over stress of all members or of some, of those whose yield stress is known."""
    chosen = None if of is None else set(of.members)
    found = [own.factor_to_yield for own in state.stresses.members if chosen is None or own.name in chosen]
    return min((own for own in found if own is not None), default=np.inf)


def _moved(model: FullOrderModel, vectors: Array, of: Freedom) -> tuple[Array, float]:
    """A displacement (k,) in motions of DOF vectors (n, k), and the largest of its kind of any node in any of them."""
    u = model.node_displacements(vectors)[model.plan.topology.has_position]
    alike = np.linalg.norm(u[:, 3:] if of.turns else u[:, :3], axis=1)
    number = model.plan.topology.numbers([of.node])
    row = model.design.node_rows(number).toarray()[of.component]
    return row @ vectors, float(alike.max(initial=0.0))


def _pose_factor(pose: Pose) -> float:
    factor = buckling_factor(pose)
    return np.inf if factor is None else factor
