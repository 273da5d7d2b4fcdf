"""A mechanism as sliders vary it: its plan, its sliders, and the design that is described, as it is first seen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexura.errors import OptionError
from flexura.full_order import assemble
from flexura.linalg import Eigenpairs
from flexura.mechanism import Mechanism, has_solid_members
from flexura.pages.live.followed import lowest_shapes
from flexura.pages.live.sliders import Slider, sliders_of
from flexura.pages.viewer import Buffer, Drawing, Scene, ShownMotion, scene_and_drawing, to_message
from flexura.structure import FullOrderModel, Plan


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
    return tuple(notes)


def scene_message(scene: Scene) -> bytes:
    """The message that gives a page a scene, with one motion: that of the mode that is shown.

    Parts are named alone: what there is to know of them changes with the sliders, and comes by itself.
    """
    still = Buffer.field(np.zeros(scene.points.stored.shape))
    parts = tuple(replace(part, facts=()) for part in scene.parts)
    motion = ShownMotion("mode", "modes", "mode", still, "vibration", 1.0, None)
    return to_message({"type": "scene", "scene": replace(scene, motions=(motion,), parts=parts)})
