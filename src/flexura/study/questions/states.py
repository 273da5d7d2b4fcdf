"""One design in the states that it is asked in, and which of its modes moves something most.

States are that of reference, at rest or about the load or the pose that is described, and poses; what each is asked is
worked out from one assembly, one factorisation and one equilibrium.

In modes of unit modal mass a displacement x has a part m x^2 of the kinetic energy of each, m being what would move by
it alone, and a part x^2 / omega^2 of the static compliance there. The mode with the largest geometric mean of the two,
x^2 / omega, is the one that moves it: of a rigid body the one that has most of its energy, of a beam, whose tip has as
much in every mode, the lowest. That is a property of the design by itself, whichever designs stand beside it and
however its modes have crossed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from flexura.analysis import ModelError, Statics, Stresses, errors_of, preload, statics, worst_stresses
from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import counted_intervals, factorise, is_definite
from flexura.mechanism import at
from flexura.modal import REPEATED, close_groups
from flexura.motion import Holding, Pose, PosedDesign, at_pose, buckling_factor, reached
from flexura.reduction import HERTZ, certificate, chained, flexibility, lowest_pairs
from flexura.structure import Design, FullOrderModel, InputPort, Plan, Ports, full_order_model
from flexura.study.questions.blocks import Bounded, without_round_off
from flexura.study.questions.reading import Freedom, Members, Port, pose_text
from flexura.thresholds import REPEATED_EIGENVALUES, STATIC_ROUND_OFF, STILL

MODES_FOLLOWED = 12
"""So many of the lowest modes are looked at."""

AMBIGUOUS = 0.8
"""Share of a displacement, over that of the leading mode, from which another mode has nearly as much."""

CLEARLY_STILL_MOTION = 1e-4
"""The same, of modes that are a little off."""

CLEARLY_LESS = 0.5
"""Share of a displacement, over that of the leading mode, that others close to one another have at most."""

ORDERED = 2e-3
"""Least gap of others, relative, with which it is sure which of them is the lower one."""

MIXING_GAP, MIXING_SHARE = 0.02, 1e-2
"""Modes closer than this may mix, which matters where the other one has more than this share of the displacement."""

SLOWEST = 1e-9
"""Part of the highest frequency below which a motion is rigid, and counts as one of this frequency."""


class ModalMotion(NamedTuple):
    """A displacement in the lowest modes of unit modal mass: frequencies `hertz` (k,), the displacement `moved` (k,),
    and the `largest` one of its kind, translation or rotation, of any node in any of them."""

    hertz: Array
    moved: Array
    largest: float


def leading_mode(motion: ModalMotion, name: str) -> tuple[int, str]:
    """The number, from 0, of the mode that has most of a displacement, and in words which others have nearly as much.

    Frequencies that are equal count as one. Raises SolverError where it does not move.
    """
    hertz, moved, largest = motion
    groups = close_groups(hertz, REPEATED)
    squares = np.array([(moved[group] ** 2).sum() for group in groups])
    if not squares.max(initial=0.0) > (STILL * largest) ** 2:
        raise SolverError(f"{name} does not move in the lowest {len(hertz)} modes")
    shares = squares / np.maximum([hertz[group[0]] for group in groups], SLOWEST * hertz.max())
    leading = int(np.argmax(shares))
    number = int(groups[leading][0])
    near = [k for k in range(len(groups)) if k != leading and shares[k] >= AMBIGUOUS * shares[leading]]
    if not near:
        return number, ""
    others = ", ".join(f"f{groups[k][0] + 1} has {shares[k] / shares[leading]:.0%}" for k in near)
    return number, f"{name} moves in several modes: of its part in f{number + 1}, {others}"


def clear_mode(motion: ModalMotion, name: str) -> int | None:
    """The number, from 0, of the mode that has most of a displacement, from modes that are a little off, as
    `leading_mode`; None where the right ones may say otherwise, or warn that others have nearly as much."""
    hertz, moved, largest = motion
    if not np.isfinite(hertz).all() or not np.abs(moved).max(initial=0.0) > CLEARLY_STILL_MOTION * largest:
        return None
    number, _ = leading_mode(motion, name)
    gap, share = abs(hertz / hertz[number] - 1), moved**2 / hertz
    is_equal = gap <= REPEATED_EIGENVALUES
    others, leading = np.where(is_equal, 0.0, share), share[is_equal].sum()
    gap = np.where(is_equal, np.inf, gap)
    together = max(others[group].sum() for group in close_groups(hertz, MIXING_GAP))
    mixes = (gap < MIXING_GAP) & (others > MIXING_SHARE * leading)
    is_clear = together <= CLEARLY_LESS * leading and gap.min(initial=np.inf) > ORDERED and not mixes.any()
    return number if is_clear else None


def _modal_motion(model: FullOrderModel, hertz: Array, vectors: Array, freedom: Freedom) -> ModalMotion:
    """A displacement in modes with DOF vectors (n, k)."""
    u = model.node_displacements(vectors)[model.plan.topology.has_position]
    of_kind = np.linalg.norm(u[:, 3:] if freedom.turns else u[:, :3], axis=1)
    row = _row_of(model, freedom)
    return ModalMotion(hertz, row @ vectors, float(of_kind.max(initial=0.0)))


def _row_of(model: FullOrderModel, freedom: Freedom) -> Array:
    """The row (n,) that reads a displacement."""
    number = model.plan.topology.numbers([freedom.node])
    return model.design.node_rows(number).toarray()[freedom.component]


UNKNOWN_STRESS = "no stress is known of sections that are given by constants"


class ReferenceState:
    """A design as its description leaves it: at rest, or about the state of load or the pose that is described."""

    def __init__(self, plan: Plan, parameters: Mapping[str, float]) -> None:
        self.plan = plan
        self.parameters = parameters
        self._solved: dict[str, tuple[Array, Array]] = {}

    @property
    def free(self) -> ReferenceState:
        """The state with nothing held but by forces that stay as they are: itself."""
        return self

    @cached_property
    def model(self) -> FullOrderModel:
        """Its full-order model."""
        return full_order_model(at_pose(Design.of(self.plan, self.parameters)))

    @cached_property
    def _ports(self) -> Ports:
        return Ports(self.model.design)

    @cached_property
    def _solve(self) -> Any:
        return flexibility(self.model).held

    def _input(self, actuator: Port) -> InputPort:
        return self._ports.inputs([actuator.known])[0]

    def _row(self, end: Freedom | InputPort) -> tuple[Array, Array]:
        """The row (n,) that reads a motion, and displacements (n,) by a unit force along it."""
        name = end.name if isinstance(end, Freedom) else f"{end.channel.name} as an input"
        if name not in self._solved:
            row = _row_of(self.model, end) if isinstance(end, Freedom) else end.row
            self._solved[name] = row, self._solve(np.ascontiguousarray(row[:, None]))[:, 0]
        return self._solved[name]

    def _between(self, one: Freedom | InputPort, other: Freedom | InputPort) -> float:
        """Displacement along one by a unit force along the other, symmetric to the last digit."""
        (a, by_a), (b, by_b) = self._row(one), self._row(other)
        return float((a @ by_b + b @ by_a) / 2)

    def _bound(self, one: Freedom | InputPort, other: Freedom | InputPort) -> float:
        return self._between(one, one) * self._between(other, other)

    def compliance(self, to: Freedom, by: Freedom) -> float:
        """Displacement per force or moment."""
        return float(without_round_off(self._between(to, by), self._bound(to, by)))

    def coupling(self, actuator: Port, to: Freedom) -> float:
        """Displacement per unit command."""
        command = self._input(actuator)
        return float(without_round_off(self._between(to, command), self._bound(to, command)) * command.gain)

    def amplification(self, actuator: Port, to: Freedom) -> float:
        """Displacement per elongation of the actuator that makes it."""
        command = self._input(actuator)
        return self.coupling(actuator, to) / abs(self._between(command, command) * command.gain)

    def largest_possible(self, kind: str, actuator: Port, to: Freedom) -> float:
        """The coupling, or amplification, that the flexibility of both ends allows (Cauchy and Schwarz)."""
        command = self._input(actuator)
        most = float(np.sqrt(abs(self._bound(to, command))))
        return most * abs(command.gain) if kind == "coupling" else most / abs(self._between(command, command))

    def model_errors(
        self, pairs: Sequence[tuple[Freedom | Port, Freedom | Port]], read: Callable[[Array, Array], Array]
    ) -> ModelError:
        """Model errors of n numbers that are read of displacements (p,) along one by a force along the other of each
        pair, NaN where these are zero, and of those along the force itself."""
        names = list(dict.fromkeys(end for pair in pairs for end in pair))
        ends = [self._input(end) if isinstance(end, Port) else end for end in names]
        states = np.column_stack([self._row(end)[1] for end in ends])
        to, by = np.array([[names.index(end) for end in pair] for pair in pairs]).T
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
        if not self.plan.is_posed:
            return preload(self.plan, self.parameters).buckling_factor
        factor = buckling_factor(reached(Design.of(self.plan, self.parameters)).pose)
        return np.inf if factor is None else factor

    def frequencies(self, count: int) -> Bounded:
        """The lowest natural frequencies with proven bounds."""
        full = chained(self.model)
        proof = certificate(full, lowest_pairs(full, count), count)
        lower = np.where(proof.is_indexed, proof.lower_hz, 0.0)[:count]
        upper = np.where(proof.is_indexed, proof.upper_hz, np.inf)[:count]
        return Bounded(np.clip(proof.frequency_hz[:count], lower, upper), lower, upper)

    def modal_motion(self, freedom: Freedom, count: int) -> ModalMotion:
        """A displacement in so many of the lowest modes."""
        full = chained(self.model)
        pairs = lowest_pairs(full, count)
        hertz = np.sqrt(np.maximum(pairs.values[:count], 0)) / HERTZ
        return _modal_motion(self.model, hertz, full.recover(pairs.vectors[:, :count]), freedom)


class PosedState:
    """A design at a pose with large displacements; the displacements of the pose hold it."""

    def __init__(self, plan: Plan, parameters: Mapping[str, float], pose: Sequence[tuple[str, float]]) -> None:
        self.text: str = pose_text(pose)
        self.plan: Plan = plan.prepared.once(("posed", tuple(pose)), lambda: Plan(at(plan.mechanism, dict(pose))))
        self.parameters = parameters

    @cached_property
    def _posed(self) -> PosedDesign:
        posed = reached(Design.of(self.plan, self.parameters))
        if not is_definite(posed.pose.matrices(held=True)[0]):
            raise SolverError(f"at {self.text} it is unstable")
        return posed

    @property
    def _pose(self) -> Pose:
        return self._posed.pose

    @cached_property
    def free(self) -> ReferenceState:
        """What is linear about the pose with nothing held but by forces that stay as they are."""
        return ReferenceState(self.plan, self.parameters)

    @cached_property
    def _model(self) -> FullOrderModel:
        design = replace(Design.of(self.plan, self.parameters), pose=self._posed)
        return FullOrderModel(design, self._posed.K, self._posed.M)

    def compliance(self, to: Freedom, by: Freedom) -> float:
        """Displacement per force or moment, the displacements of the pose held but for those asked of.

        Raises SolverError where the pose holds one of them.
        """
        pose, numbers = self._pose, self.plan.topology.numbers([to.node, by.node])
        rows = np.stack([pose.rows(int(n))[end.component] for n, end in zip(numbers, (to, by), strict=True)])
        others = [k for k, drive in enumerate(pose.equations.drives) if drive.name not in (to.name, by.name)]
        scale = pose.equations.scale
        holding = Holding.of(pose.state.tangent.rows[others], scale)
        free_rows = holding.rows(rows)
        free_sizes = np.linalg.norm(free_rows / scale[holding.left], axis=1)
        for end, free, whole in zip((to, by), free_sizes, np.linalg.norm(rows / scale, axis=1), strict=True):
            if not free > STATIC_ROUND_OFF * whole:
                raise SolverError(f"{end.name} is held by the pose")
        C = free_rows @ factorise(holding.matrix(pose.K)).solve(np.ascontiguousarray(free_rows.T))
        return float(without_round_off((C[0, 1] + C[1, 0]) / 2, C[0, 0] * C[1, 1]))

    @cached_property
    def stresses(self) -> Stresses:
        """Stresses at the pose."""
        return worst_stresses(self._model, self._posed.end_forces.__getitem__)

    def force(self, along: Freedom) -> float:
        """Force or moment that holds a displacement of the pose."""
        names = [drive.name for drive in self._pose.equations.drives]
        return float(self._pose.state.drive[names.index(along.name)])

    @property
    def buckling(self) -> float:
        """Factor on all loads and on the forces that hold the pose; infinite where nothing buckles."""
        factor = buckling_factor(self._pose)
        return np.inf if factor is None else factor

    def frequencies(self, count: int) -> Bounded:
        """The lowest natural frequencies with proven bounds, nothing held but by forces that stay as they are."""
        pose, pairs = self._pose, self._modes(count)
        *squares, is_proven = counted_intervals(pose.K, pose.M, pairs.values, pairs.vectors)
        lower, upper = (np.sqrt(np.maximum(x, 0)) / HERTZ if is_proven else x * np.nan for x in squares)
        return Bounded(np.sqrt(pairs.values) / HERTZ, lower, upper)

    def modal_motion(self, freedom: Freedom, count: int) -> ModalMotion:
        """A displacement in so many of the lowest modes."""
        pairs = self._modes(count)
        return _modal_motion(self._model, np.sqrt(pairs.values) / HERTZ, pairs.vectors, freedom)

    def _modes(self, count: int) -> Any:
        pairs = self._pose.modes(count)
        if len(pairs.values) and pairs.values[0] < 0:
            raise SolverError(f"at {self.text} it is unstable under the forces that hold it")
        return pairs


State = ReferenceState | PosedState


def largest_stress(state: State, of: Members | None = None) -> float:
    """Largest von Mises stress, Pa, notch factors included, of all members or of some; of sections that are known."""
    members = [member for member in state.stresses.members if of is None or member.name in of.members]
    known = [member.von_mises for member in members if member.von_mises is not None]
    if not known:
        raise SolverError(UNKNOWN_STRESS)
    return max(known)


def least_margin(state: State, of: Members | None = None) -> float:
    """Least yield stress over stress of all members or of some, of those whose yield stress is known."""
    members = [member for member in state.stresses.members if of is None or member.name in of.members]
    return min((m.factor_to_yield for m in members if m.factor_to_yield is not None), default=np.inf)
