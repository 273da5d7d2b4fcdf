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

from flexura.analysis import LargestStresses, ModelError, Statics, errors_of, pose_limits, statics
from flexura.arrays import Array
from flexura.derivatives import DisplacedState, LinearState, without_round_off
from flexura.errors import Diagnostic, SolverError
from flexura.linalg import counted_intervals
from flexura.modal import REPEATED, close_groups
from flexura.motion import MovingModel, PosedDesign, reached
from flexura.reduction import HERTZ, certificate, chained, lowest_pairs
from flexura.structure import Design, FullOrderModel, Plan
from flexura.study.questions.blocks import Bounded
from flexura.study.questions.kinds import Pose, pose_text
from flexura.study.questions.reading import Freedom, Port
from flexura.study.questions.strokes import posed_design
from flexura.thresholds import REPEATED_EIGENVALUES, STILL

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
    row = model.design.dense_rows(model.plan.topology.numbers([freedom.node]))[freedom.component]
    return ModalMotion(hertz, row @ vectors, float(of_kind.max(initial=0.0)))


class ReferenceState(LinearState):
    """A design as its description leaves it: at rest, or about the state of load or the pose that is described."""

    def largest_possible(self, kind: str, actuator: Port, to: Freedom) -> float:
        """The coupling, or amplification, that the flexibility of both ends allows (Cauchy and Schwarz)."""
        command = self.input(actuator.known)
        C = self.flexibility(np.stack([self.row(to.name), command.row]))
        most = float(np.sqrt(abs(C[0, 0] * C[1, 1])))
        return most * abs(command.gain) if kind == "coupling" else most / abs(C[1, 1])

    def model_errors(
        self, pairs: Sequence[tuple[Freedom | Port, Freedom | Port]], read: Callable[[Array, Array], Array]
    ) -> ModelError:
        """Model errors of n numbers that are read of displacements (p,) along one by a force along the other of each
        pair, NaN where these are zero, and of those along the force itself."""
        names = list(dict.fromkeys(end for pair in pairs for end in pair))
        rows = [self.input(end.known).row if isinstance(end, Port) else self.row(end.name) for end in names]
        to, by = np.array([[names.index(end) for end in pair] for pair in pairs]).T
        S = self.flexibility(np.stack(rows))
        S = without_round_off(S, np.outer(np.diagonal(S), np.diagonal(S)))
        S[S == 0] = np.nan
        return errors_of(self.model, self.moved_by(rows), lambda E: read((S + E)[to, by], (S + E)[by, by]))

    @property
    def free(self) -> ReferenceState:
        """Itself."""
        return self

    @cached_property
    def stresses(self) -> LargestStresses:
        """The largest stresses under the loads and gravity, or at the pose, that are described."""
        known = [member for member in self._statics.stresses().members if member.von_mises is not None]
        sizes, limit = (
            np.array([getattr(own, name) for own in known], dtype=float) for name in ("von_mises", "yield_stress")
        )
        position = np.array([[getattr(own, "position", np.nan)] for own in known]).reshape(-1, 1)
        place = np.array([[getattr(own, "place", (np.nan,) * 3)] for own in known]).reshape(-1, 1, 3)
        return LargestStresses(tuple(member.name for member in known), sizes[:, None], position, place, limit)

    @property
    def stress_error(self) -> tuple[float, float] | None:
        """Where the part's stresses lie, relative to these."""
        return self._statics.stress_error

    @cached_property
    def _statics(self) -> Statics:
        return statics(self.model)

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
    """A design at a pose with large displacements: `held` by the displacements of the pose, and `free` under their
    forces."""

    def __init__(
        self,
        plan: Plan,
        parameters: Mapping[str, float],
        pose: Pose,
        near: PosedState | None = None,
        model: Callable[[], MovingModel] | None = None,
    ) -> None:
        self.pose = pose
        self.design: Design = posed_design(plan, parameters, pose, model and model().design)
        self._near, self._model_at_rest = near, model
        self._pairs: dict[int, Any] = {}

    @property
    def text(self) -> str:
        """The pose in words."""
        return pose_text(self.pose)

    @cached_property
    def there(self) -> PosedDesign:
        """What has moved there."""
        return reached(self.design, self._near and self._near.there, self._model_at_rest)

    @cached_property
    def held(self) -> DisplacedState:
        """The state that the displacements of the pose hold. Raises SolverError where that is unstable."""
        names = [drive.name for drive in self.there.pose.equations.drives]
        state = DisplacedState(self.design, dict.fromkeys(names), self.there.pose)
        if not state.is_stable:
            raise SolverError(f"{self.text} it is unstable")
        return state

    @cached_property
    def free(self) -> ReferenceState:
        """What is linear about the pose with nothing held but by forces that stay as they are. Raises SolverError where
        it is unstable under these."""
        if not self.there.is_stable:
            raise SolverError(f"{self.text} it is unstable under the forces that hold it")
        return ReferenceState(replace(self.design, pose=self.there))

    @cached_property
    def _model(self) -> FullOrderModel:
        return FullOrderModel(replace(self.design, pose=self.there), self.there.K, self.there.M)

    @property
    def limits(self) -> tuple[Diagnostic, ...]:
        """What is beyond its limit there, as `pose_limits` has it."""
        return pose_limits(self._model)

    def frequencies(self, count: int) -> Bounded:
        """The lowest natural frequencies with proven bounds, nothing held but by forces that stay as they are."""
        pose, pairs = self.held.pose, self._modes(count)
        *squares, is_proven = counted_intervals(pose.K, pose.M, pairs.values, pairs.vectors)
        lower, upper = (np.sqrt(np.maximum(x, 0)) / HERTZ if is_proven else x * np.nan for x in squares)
        return Bounded(np.sqrt(pairs.values) / HERTZ, lower, upper)

    def modal_motion(self, freedom: Freedom, count: int) -> ModalMotion:
        """A displacement in so many of the lowest modes."""
        pairs = self._modes(count)
        return _modal_motion(self._model, np.sqrt(pairs.values) / HERTZ, pairs.vectors, freedom)

    def _modes(self, count: int) -> Any:
        if count not in self._pairs:
            self._pairs[count] = self.held.pose.modes(count)
        pairs = self._pairs[count]
        if len(pairs.values) and pairs.values[0] < 0:
            raise SolverError(f"{self.text} it is unstable under the forces that hold it")
        return pairs
