"""A mechanism as sliders vary it: what designs start from, and modes that keep their identity from design to design."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.errors import OptionError, SolverError
from flexura.full_order import assemble
from flexura.linalg import Eigenpairs, factorise
from flexura.mechanism import Mechanism, composites, has_solid_members
from flexura.modal import track_modes
from flexura.pages.live.sliders import Slider, sliders_of
from flexura.pages.viewer import Buffer, Drawing, Scene, ShownMotion, scene_and_drawing, to_message
from flexura.reduction import full_order_modes
from flexura.structure import FullOrderModel, Plan

SPARE = 4
"""Modes beyond those shown that are followed, so that one that rises out of them is known when it comes back."""

ROUNDS = 12
SETTLED = 1e-7
"""Relative change of squared frequencies at which shapes have settled."""

CLOSE = 0.02
"""Relative distance of squared frequencies of modes that may have mixed."""

LIKE = 0.5
"""MAC from which a mode that was gone is the same again."""

MOST = 40
"""Modes whose identity is remembered."""


def lowest_shapes(model: FullOrderModel, count: int, near: Array | None) -> Eigenpairs:
    """The `count` lowest modes of a model and up to SPARE more, which need not have settled, by subspace iteration from
    shapes (n, count + SPARE) of one `near` it (Bathe and Wilson 1972), or without these by a search that loses none."""
    wanted = min(count + SPARE, model.order)
    if near is not None and near.shape == (model.order, wanted):
        found = _iterated(model, min(count, model.order), near)
        if found is not None:
            return found
    return full_order_modes(model, wanted)


def _iterated(model: FullOrderModel, count: int, X: Array) -> Eigenpairs | None:
    try:
        factor = factorise(model.K)
        before, MX = np.zeros(count), model.M @ X
        for _ in range(ROUNDS):
            Y = factor.solve(MX)
            MY = model.M @ Y
            m = Y.T @ MY
            values, Z = la.eigh(Y.T @ MX, (m + m.T) / 2, check_finite=False)
            X, MX = Y @ Z, MY @ Z
            if (values <= 0).any() or not np.isfinite(values).all():
                return None
            if (np.abs(values[:count] - before) <= SETTLED * values[:count]).all():
                return Eigenpairs(values, X)
            before = values[:count]
    except (SolverError, np.linalg.LinAlgError):
        pass
    return None


@dataclass(frozen=True)
class Identified:
    """Of the modes of a design, from the lowest: the `number` by which each is known, from 1, and how `like` its shape
    is that of the design before (MAC); shapes (n, k) with the sign that they had."""

    number: list[int]
    like: list[float]
    shapes: Array


class FollowedModes:
    """Modes of the designs that one page has shown, known by number."""

    def __init__(self) -> None:
        self._known = np.zeros((0, 0))
        self._last: list[int] = []

    def follow(self, model: FullOrderModel, found: Eigenpairs) -> Identified:
        """Which of the modes known so far those of a design are; what none of them is gets the next number."""
        own, x = found.vectors, self._known
        k = own.shape[1]
        number, like = [0] * k, [1.0] * k
        if x.shape[0] != own.shape[0]:
            x = np.zeros((own.shape[0], 0))
        if x.shape[1]:
            tracked, sense = track_modes(x, found.values, own, model.M, close=CLOSE), np.ones(k)
            for known, j in enumerate(tracked.number):
                if j >= 0 and (tracked.mac[known] >= LIKE or known + 1 in self._last):
                    number[j], like[j], sense[j] = known + 1, float(tracked.mac[known]), tracked.sense[known]
            own = tracked.shapes * sense
        new = [j for j in range(k) if not number[j]]
        for known, j in enumerate(new, x.shape[1]):
            number[j] = known + 1
        x = np.column_stack([x, own[:, new]])
        x[:, [known - 1 for known in number]] = own
        self._known = x if x.shape[1] <= MOST else own.copy()
        if self._known is not x:
            number = list(range(1, k + 1))
        self._last = number
        return Identified(number, like, own)


@dataclass(frozen=True)
class Described:
    """What designs start from: a plan, how many modes of each design are shown beside rigid ones, and notes on what the
    sliders leave as it is; `revision` counts readings."""

    plan: Plan
    modes: int
    notes: tuple[str, ...]
    revision: int

    @cached_property
    def sliders(self) -> dict[str, Slider]:
        """A slider of each parameter, by name."""
        return sliders_of(self.plan)

    @cached_property
    def reference(self) -> tuple[FullOrderModel, Eigenpairs]:
        """The design that is described, and its modes. Raises OptionError where nothing can move."""
        model = assemble(self.plan)
        if model.order == 0:
            raise OptionError("nothing in this mechanism can move: every node is held")
        found, asked = lowest_shapes(model, self.modes, None), self.modes
        while (wanted := self.modes + _rigid(found)) > asked and len(found.values) < model.order:
            found, asked = lowest_shapes(model, wanted, None), wanted
        return model, found

    @property
    def rigid(self) -> int:
        """How many motions of the design that is described need no force."""
        return _rigid(self.reference[1])

    @cached_property
    def drawn(self) -> tuple[Scene, Drawing]:
        """The same as it is first seen."""
        return scene_and_drawing(self.reference[0], picture=True)

    @cached_property
    def scene(self) -> bytes:
        """The message that gives this to a page."""
        return scene_message(self.drawn[0])


def _rigid(found: Eigenpairs) -> int:
    return int((found.values == 0).sum())


def notes_of(mechanism: Mechanism, plan: Plan) -> tuple[str, ...]:
    """What sliders leave as it is described."""
    notes = []
    if plan.is_posed:
        notes.append("everything is about the pose that is described")
    elif plan.is_loaded:
        notes.append("everything is about the state under the loads and gravity that are described")
    if has_solid_members(mechanism):
        notes.append("solid members are as reduced at the values that are described: they do not follow the sliders")
    if any(composites(mechanism, name) for name in ("", *mechanism.substructures)):
        notes.append("composites are as meshed at the values that are described: they do not follow the sliders")
    return tuple(notes)


def scene_message(scene: Scene) -> bytes:
    """The message that gives a page a scene, with one motion: that of the mode that is shown.

    Parts are named alone: what there is to know of them changes with the sliders, and comes by itself.
    """
    still = Buffer.field(np.zeros(scene.points.stored.shape))
    parts = tuple(replace(part, facts=()) for part in scene.parts)
    motion = ShownMotion("mode", "modes", "mode", still, "vibration", 1.0, None)
    return to_message({"type": "scene", "scene": replace(scene, motions=(motion,), parts=parts)})
