"""From a mechanism to its plan, its design where it is described, and its full-order model.

Solid members become superelements, and composites are meshed, before there is a plan, and a design that is described at
a pose is brought there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from flexura import fem
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.mechanism import Mechanism, needs_meshes, refined
from flexura.motion import at_pose
from flexura.structure import (
    Design,
    FullOrderModel,
    Plan,
    checked_design,
    full_order,
    full_order_model,
)


def plan_of(mechanism: Mechanism | Plan, parameters: Mapping[str, ArrayLike] | None = None) -> Plan:
    """The plan of a mechanism; a plan is returned as it is.

    Solid members are reduced to superelements, and composites meshed, at `parameters`, those of them that are single
    numbers, as `with_solid_parts` does. Raises ModelError for a description that cannot be used and OptionError for
    anything else.
    """
    if isinstance(mechanism, Plan):
        return mechanism
    if not isinstance(mechanism, Mechanism):
        raise OptionError(
            f"a Mechanism or a Plan is expected, not a {type(mechanism).__name__}; flexura.load reads a file"
        )
    if needs_meshes(mechanism):
        single = {name: value for name, value in (parameters or {}).items() if np.ndim(value) == 0}
        mechanism = fem.with_solid_parts(mechanism, single)
    return Plan(mechanism)


def design_of(model: Mechanism | Plan | FullOrderModel, parameters: Mapping[str, ArrayLike] | None = None) -> Design:
    """The one design of a mechanism that is to be assembled, not yet at the pose that may be described, or of a model.

    Raises ModelError and OptionError as `assemble` does, and OptionError for parameters beside an assembled model.
    """
    if isinstance(model, FullOrderModel):
        if parameters:
            raise OptionError("parameters belong to a mechanism, not to an assembled model")
        return model.design
    return checked_design(plan_of(model, parameters), parameters)


@verb
def assemble(
    model: Mechanism | Plan | FullOrderModel, parameters: Mapping[str, ArrayLike] | None = None
) -> FullOrderModel:
    """Assemble the full-order model, for the default parameters or with some of them replaced, SI.

    A model that is assembled already is returned as it is, and takes no parameters.

    Raises ModelError for a description that cannot be used, OptionError for unknown parameters and what cannot be
    loaded, and SolverError when its loads and gravity buckle it.
    """
    design = design_of(model, parameters)
    return model if isinstance(model, FullOrderModel) else full_order_model(at_pose(design))


def at_rest(
    model: Mechanism | Plan | FullOrderModel, parameters: Mapping[str, ArrayLike] | None = None, refine: int = 1
) -> FullOrderModel:
    """The full-order model as `assemble` makes it, without the pose that may be described, members cut into `refine`
    times their elements. Raises as `assemble`."""
    design = design_of(model, parameters)
    plan = design.plan.at_rest()
    if refine > 1:
        plan = Plan(refined(plan.mechanism, refine))
    if plan is design.plan:
        return assemble(model, parameters)
    return full_order_model(Design.of(plan, design.parameters))


def unloaded(
    mechanism: Mechanism | Plan | FullOrderModel, parameters: Mapping[str, ArrayLike] | None = None
) -> FullOrderModel:
    """The full-order model as `assemble` makes it, with the elastic stiffness alone whatever loads are described.

    Raises OptionError where a pose is described, and for parameters beside a model that is assembled already.
    """
    design = design_of(mechanism, parameters)
    design.plan.refuse_pose("what linear loads do to stiffness")
    if not isinstance(mechanism, FullOrderModel):
        return FullOrderModel(design, *full_order(design.plan).elastic(design))
    return replace(mechanism, K=full_order(design.plan).elastic(design)[0]) if design.plan.is_loaded else mechanism
