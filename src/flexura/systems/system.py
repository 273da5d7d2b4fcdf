"""The second-order system: M, C, K of a model with named inputs and outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.full_order import assemble, plan_of
from flexura.mechanism import Damping, Mechanism
from flexura.reduction import (
    LowOrderModel,
    Reduction,
    flexibility,
    low_order,
    reduce,
    reduction_of,
    static_nodes,
    stored_flexibility,
)
from flexura.structure import (
    DERIVATIVE,
    FullOrderModel,
    InputPort,
    OutputPort,
    Plan,
    Ports,
    default_dofs,
    dissipation,
    one_design,
)
from flexura.systems.modal import ModalSystem, modal_system
from flexura.systems.second_order import Model, SecondOrder, damping_law, full_order_of
from flexura.thresholds import ROUND_OFF, STATIC_ROUND_OFF

Order = Literal["low", "full"]

PROVEN_MODES = 6
"""A system is reduced until so many of its lowest frequencies are proven, unless something else is asked for."""


@dataclass(frozen=True, repr=False)
class System(SecondOrder):
    __doc__ = SecondOrder.__doc__

    def modal(self, n: int | None = None, up_to: float | None = None) -> ModalSystem:
        """The system in modal coordinates; see `modal_system`."""
        return modal_system(self, n, up_to)


@verb
def system(
    model: Mechanism | Plan | FullOrderModel | LowOrderModel,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    order: Order = "low",
    damping: Damping | float | Mapping[str, Any] | None = None,
    static_correction: bool = True,
    keep: int | Mapping[str, int] | None = None,
    keep_below: float | None = None,
    reduction: Reduction | None = None,
    tolerance: float | None = None,
    up_to: float | None = None,
    n: int | None = None,
) -> System:
    """The second-order system of a mechanism or of a model of it, between named inputs and outputs.

    `inputs` and `outputs` name described actuators and sensors (wildcards allowed) or DOFs such as `platform.tz`
    (`platform.tz:velocity`, `ground.tx`); by default all that are described, or without any the DOFs at which static
    response stays exact: those of the mechanism's interface, or else of its rigid bodies. A mechanism is reduced with
    `keep`, `keep_below`, `reduction`, or `tolerance` and `up_to` or `n`, as by `reduce`; else as its own `reduction`
    says, else until its six lowest frequencies are proven within 1e-3; or taken at `order="full"`. `damping` replaces
    that of the description: a ratio for all modes, or the keys of `damping` in a file. With `static_correction` the
    static gain is that of the full-order model (theory eq. T8).

    Raises ModelError for a description that cannot be used and OptionError for impossible arguments.
    """
    given = {
        "keep": keep,
        "keep_below": keep_below,
        "reduction": reduction,
        "tolerance": tolerance,
        "up_to": up_to,
        "n": n,
    }
    model = _model(model, parameters, order, {name: value for name, value in given.items() if value is not None})
    plan = model.plan
    ports = Ports(model.design)
    ins, outs = _channels(ports, inputs, outputs)
    full = full_order_of(model)
    law = damping_law(plan.mechanism.damping, plan.parameter_values(model.parameters), damping)
    C_full, H_full = dissipation(model.design, law.loss_factor)
    recover = None if isinstance(model, FullOrderModel) else model.recovery
    C, H = (_projected(A, recover, model.K) for A in (C_full, H_full))
    loss = uniform_loss(H_full, full.K)
    loads = _loads(ins, full)
    all_rows = np.stack([o.row for o in outs]) if outs else np.zeros((0, plan.topology.n_dof))
    B = loads if recover is None else np.asarray(recover.T @ loads)
    rows = all_rows if recover is None else np.asarray(all_rows @ recover)
    residual = np.zeros((len(outs), len(ins)))
    if static_correction and recover is not None and residual.size:
        flexible = flexibility(full)
        whole = all_rows @ flexible(loads)
        lacking = whole - rows @ stored_flexibility(model.K, model.M, flexible.shift)(B)
        scale = np.abs(whole).max(axis=1, keepdims=True, initial=0.0)
        residual = np.where(np.abs(lacking) > STATIC_ROUND_OFF * scale, lacking, 0.0)
    return System(
        model,
        model.M,
        C + law.alpha * model.M + law.beta * model.K,
        model.K,
        None if loss == 0 else H,
        C,
        loss,
        B,
        rows,
        np.array([o.derivative for o in outs], dtype=np.intp),
        _direct(ins, outs),
        residual,
        law,
        tuple(i.channel for i in ins),
        tuple(o.channel for o in outs),
        tuple(i.limits for i in ins),
        tuple(ins),
        tuple(outs),
    )


QUANTITIES = {"receptance": 0, "mobility": 1, "accelerance": 2, "transmissibility": 2}


def as_quantity(built: System, quantity: str | None) -> System:
    """The system with all motions read as displacement, velocity or acceleration.

    Raises OptionError for unknown quantities, and for transmissibility from inputs that do not move the base.
    """
    if quantity is None:
        return built
    if quantity not in QUANTITIES:
        raise OptionError(f"quantity is one of {', '.join(QUANTITIES)}, not {quantity!r}")
    if quantity == "transmissibility" and not all(i.base is not None for i in built.input_ports):
        raise OptionError("transmissibility is from motion of the base: name inputs such as ground.tx")
    outs = [_read_as(out, QUANTITIES[quantity]) for out in built.output_ports]
    return replace(
        built,
        derivative=np.array([o.derivative for o in outs], dtype=np.intp),
        D=_direct(list(built.input_ports), outs),
        outputs=tuple(o.channel for o in outs),
        output_ports=tuple(outs),
    )


def _read_as(out: OutputPort, derivative: int) -> OutputPort:
    if out.channel.quantity not in DERIVATIVE:
        return out
    turns = out.channel.quantity.startswith(("rotation", "angular"))
    names = [q for q, order in DERIVATIVE.items() if order == derivative]
    return replace(out, derivative=derivative, channel=replace(out.channel, quantity=names[turns]))


def _model(model: Any, parameters: Mapping[str, ArrayLike] | None, order: str, given: dict[str, Any]) -> Model:
    if isinstance(model, FullOrderModel | LowOrderModel):
        if parameters or given:
            raise OptionError("parameters and methods of reduction belong to a mechanism, not to a finished model")
        return model
    if order not in ("low", "full"):
        raise OptionError(f"order is low or full, not {order!r}")
    if order == "full":
        if given:
            raise OptionError(f"{next(iter(given))} belongs to order low")
        return assemble(model, parameters)
    return reduced(plan_of(model, parameters), one_design(parameters), given)


def reduced(plan: Plan, parameters: Mapping[str, float], given: Mapping[str, Any]) -> LowOrderModel:
    """The low-order model of a mechanism, as is asked for, else in the coordinates of its substructures."""
    options = reduction_of(plan, given, PROVEN_MODES)
    if "tolerance" in options and not given:
        options = {"coordinates": "substructures", **options}
    return reduce(plan, parameters, **options)


def _channels(
    ports: Ports, inputs: Sequence[str] | None, outputs: Sequence[str] | None
) -> tuple[list[InputPort], list[OutputPort]]:
    if (inputs is None and not ports.actuators) or (outputs is None and not ports.sensors):
        dofs = default_dofs(ports.plan, static_nodes(low_order(ports.plan), None))
        inputs = dofs if inputs is None and not ports.actuators else inputs
        outputs = dofs if outputs is None and not ports.sensors else outputs
    return ports.inputs(inputs), ports.outputs(outputs)


def input_loads(system: SecondOrder) -> Array:
    """Loads (n, m) of one unit of each input on the DOFs of the full-order model."""
    return _loads(list(system.input_ports), system.full_order)


def _loads(ins: list[InputPort], full: FullOrderModel) -> Array:
    return np.stack([load_of(i, full) for i in ins], axis=1) if ins else np.zeros((full.order, 0))


def load_of(placed: InputPort, full: FullOrderModel) -> Array:
    """Load (n,) of one unit of an input; that of an accelerated base is the inertia of everything (theory eq. T3)."""
    if placed.base is None:
        return placed.load
    return -(full.base_inertia_forces @ placed.base)


def _direct(ins: list[InputPort], outs: list[OutputPort]) -> Array:
    """D (p, m): what force sensors and absolute accelerations get from inputs directly."""
    return np.array([[out.direct(driven) for driven in ins] for out in outs], dtype=float).reshape(len(outs), len(ins))


def uniform_loss(H: Any, K: Any) -> float | None:
    """The loss factor that is the same for everything elastic, zero without any; None where they differ."""
    total = float(H.diagonal().sum())
    if not total:
        return 0.0
    ratio = total / float(K.diagonal().sum())
    return ratio if abs(H - ratio * K).max() <= ROUND_OFF * abs(K).max() else None


def _projected(A: sp.csc_matrix, recover: Any, K: Any) -> Any:
    """A over the coordinates of a model, dense where its K is."""
    if recover is None:
        return A
    if not A.nnz:
        return 0 * K
    projected = recover.T @ (A @ recover)
    dense = projected.toarray() if hasattr(projected, "toarray") else np.asarray(projected)
    return (dense + dense.T) / 2 if isinstance(K, np.ndarray) else sp.csc_matrix(projected)
