"""The beam models that are held against the solid: plain, corrected, and as the description has its members."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexura.analysis import corrected
from flexura.errors import FlexuraError, OptionError
from flexura.linalg import Eigenpairs
from flexura.mechanism import Mechanism, has_solid_members
from flexura.methods import Solution, dynamic_stiffness
from flexura.reduction import full_order_modes, low_order_modes, reduce
from flexura.solid.fem import as_beams, with_rigid_faces, with_solid_parts
from flexura.structure import FullOrderModel, assemble

Solve = Callable[[FullOrderModel, int], Solution]
Described = Literal["plain", "corrected", "as described"]


@dataclass(frozen=True)
class BeamModel:
    """A row before and after it is solved: what is assembled, and how its modes are found.

    `solution` has the shapes of all nodes of `model`; `seconds` are those from a plan to it. A model that cannot
    answer has `failure` instead.
    """

    label: str
    model: FullOrderModel
    method: Solve
    solution: Solution | None = None
    seconds: float | None = None
    failure: str = ""

    def solved(self, n: int) -> BeamModel:
        """The same with its `n` lowest modes, or why it has none."""
        begin = time.perf_counter()
        try:
            fresh = assemble(self.model.plan, self.model.parameters)
            solution = self.method(fresh, n)
        except FlexuraError as error:
            return replace(self, failure=str(error))
        return replace(self, solution=solution, seconds=time.perf_counter() - begin)


def beam_models(mechanism: Mechanism, parameters: Mapping[str, float]) -> tuple[list[BeamModel], Described]:
    """The models, and which of them has the members as they are described.

    Rows of their own are there for descriptions that correct some members only, or have solid ones. Raises ModelError
    and OptionError.
    """
    plain, full = (assemble(with_rigid_faces(as_beams(mechanism, own)), parameters) for own in ("none", "auto"))
    models = [
        BeamModel("plain, low order", plain, low_order),
        BeamModel("plain, full order", plain, full_order),
        BeamModel("corrected, low order", full, low_order),
        BeamModel("corrected, full order", full, full_order),
        BeamModel("corrected, exact", full, dynamic_stiffness),
    ]
    if not has_solid_members(mechanism):
        own = corrected(assemble(with_rigid_faces(mechanism), parameters))[0]
        if own == corrected(full)[0]:
            return models, "corrected"
        if own == corrected(plain)[0]:
            return models, "plain"
    described = assemble(with_solid_parts(mechanism, parameters))
    models += [
        BeamModel("as described, low order", described, low_order),
        BeamModel("as described, full order", described, full_order),
    ]
    return models, "as described"


def low_order(model: FullOrderModel, n: int) -> Solution:
    """The `n` lowest modes by constraint modes alone, the order of the paper."""
    low = reduce(model.plan, model.parameters)
    if low.order == 0:
        raise OptionError("every node that the low-order model keeps is held")
    return _solution(model, low.order, low_order_modes(low, model, n))


def full_order(model: FullOrderModel, n: int) -> Solution:
    """The `n` lowest modes of all beam elements."""
    return _solution(model, model.order, full_order_modes(model, n))


def _solution(model: FullOrderModel, order: int, pairs: Eigenpairs) -> Solution:
    hz = np.sqrt(pairs.values) / (2 * np.pi)
    return Solution("beams", order, hz, model.node_displacements(pairs.vectors))
