"""The second-order system: M, C, K of a model with named inputs and outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, least_pivot, lowest, lowest_modes
from flexura.mechanism.damping import Damping
from flexura.mechanism.substructure import Mechanism
from flexura.reduction import LowOrderModel, reduce
from flexura.reduction.assembler import low_order
from flexura.reduction.chained import chained
from flexura.reduction.flexibility import WELL, Flexibility, flexibility, stored_flexibility
from flexura.reduction.low_order import reduction_of
from flexura.reduction.model import static_nodes
from flexura.structure import FullOrderModel, Plan, assemble
from flexura.structure.plan import one_design, plan_of
from flexura.systems.channel import Channel, positions
from flexura.systems.damping import DampingLaw, damping_law
from flexura.systems.placed import DERIVATIVE, PlacedInput, PlacedOutput, Placement, default_dofs

if TYPE_CHECKING:
    from flexura.systems.modal import ModalSystem

Array = NDArray[np.float64]
Model = FullOrderModel | LowOrderModel

MODES = 6
"""A system is reduced until so many of its lowest frequencies are proven, unless something else is asked for."""

UNIFORM = 1e-12
"""Relative difference of structural damping from one loss factor for everything that is round-off."""

ROUNDING = 1e-9
"""Relative size of a static correction that is round-off."""

MOST_MODES = 3000
"""Coordinates up to which all modes are found for a matrix of modal damping ratios."""

MOST_BY_ENERGIES = 400
"""Modes up to which those of a stiffness that loses digits are found by energies."""


@dataclass(frozen=True)
class System:
    """M q'' + C q' + (K + i H) q = B u, and outputs y = (d/dt)^k (rows q + residual u) + D u.

    M, C, K (n, n) dense or sparse, SI; H (n, n) is structural damping, None without; B (n, m); rows (p, n) and the
    order k of differentiation, `derivative` (p,), of every output; D (p, m) reaches the outputs directly; `residual`
    (p, m) is the static gain that the coordinates q lack. `law` holds the modal damping ratios, which C does not
    contain and `damping_matrix` does. C is that of `dashpots` and Rayleigh damping, and H is `uniform_loss` times K
    unless that is None. `model` recovers physical displacements from q.
    """

    model: Model
    M: Any
    C: Any
    K: Any
    H: Any | None
    dashpots: Any
    uniform_loss: float | None
    B: Array
    rows: Array
    derivative: NDArray[np.intp]
    D: Array
    residual: Array
    law: DampingLaw
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    limits: tuple[tuple[float, float], ...]
    placed_inputs: tuple[PlacedInput, ...]
    placed_outputs: tuple[PlacedOutput, ...]

    @property
    def order(self) -> int:
        """Number of coordinates."""
        return self.K.shape[0]

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.plan.mechanism.name

    @cached_property
    def is_damped(self) -> bool:
        """True when anything dissipates."""
        has_C = bool(abs(self.C).max() > 0) if self.order else False
        return has_C or self.H is not None or self.law.is_modal

    @cached_property
    def full_order(self) -> FullOrderModel:
        """The full-order model behind `model`."""
        return _Full(self.model).model

    def damping_matrix(self) -> Any:
        """C (n, n), N s/m, with modal damping ratios in it: C + M Phi diag(2 zeta omega) Phi' M (theory eq. T27).

        Over all modes of the system (Wilson and Penzien 1972, Earthquake Eng. Struct. Dyn. 1, 5): each gets the ratio
        that the law gives it, and none is left undamped but rigid motions and directions without mass. Dense where
        there are such ratios. Raises OptionError where there are too many modes for that.
        """
        if not self.law.is_modal:
            return self.C
        if self.order > MOST_MODES:
            raise OptionError(
                f"modal damping ratios as a matrix need all modes, of {self.order} coordinates; at most {MOST_MODES}:"
                " reduce the mechanism, or give Rayleigh damping, loss factors or dashpots"
            )
        pairs = self.lowest(self.order)
        own = np.isfinite(pairs.values)
        omega = np.sqrt(np.maximum(pairs.values[own], 0.0))
        forces = self.M @ pairs.vectors[:, own]
        modal = (forces * (2 * self.law.modal_ratios(omega / (2 * np.pi)) * omega)) @ forces.T
        C = self.C if isinstance(self.C, np.ndarray) else self.C.toarray()
        return C + (modal + modal.T) / 2

    @cached_property
    def flexibility(self) -> Flexibility:
        """Static responses in the coordinates of the system."""
        return flexibility(self.full_order) if self._is_full else stored_flexibility(self.K, self.M)

    @cached_property
    def full_flexibility(self) -> Flexibility:
        """Static responses of the full-order model."""
        return self.flexibility if self._is_full else flexibility(self.full_order)

    @property
    def _is_full(self) -> bool:
        return isinstance(self.model, FullOrderModel) and self.order == self.model.order

    def lowest(self, count: int) -> Eigenpairs:
        """The `count` lowest eigenpairs of K and M; those of a full-order model by energies, which keep the digits of
        soft modes beside stiff ones.

        With a mass or a stiffness that the model does not have, as that of sensors, they are those of K and M.
        """
        is_own = self._is_full and self.K is self.full_order.K and self.M is self.full_order.M
        if not is_own or count > MOST_BY_ENERGIES or least_pivot(self.K) > WELL:
            return lowest(self.K, self.M, count)
        own = chained(self.full_order)
        pairs = lowest_modes(own.pencil, count, own.rigid_motions)
        return Eigenpairs(pairs.values, own.recover(pairs.vectors))

    def matrices(self) -> tuple[Any, Any, Any, Any]:
        """M, C, K and H (None without) with the modal damping ratios in C; all dense, or all sparse."""
        C, others = self.damping_matrix(), (self.M, self.K, self.H)
        if isinstance(C, np.ndarray):
            others = tuple(A if A is None or isinstance(A, np.ndarray) else A.toarray() for A in others)
        M, K, H = others
        return M, C, K, H

    def modal(self, n: int | None = None, up_to: float | None = None) -> ModalSystem:
        """The system in modal coordinates; see `modal_system`."""
        from flexura.systems.modal import modal_system

        return modal_system(self, n, up_to)

    def selected(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> System:
        """The system with some of its inputs and outputs, by name. Raises OptionError for others."""
        i, o = positions(self.inputs, inputs), positions(self.outputs, outputs)
        return replace(
            self,
            B=self.B[:, i],
            rows=self.rows[o],
            derivative=self.derivative[o],
            D=self.D[np.ix_(o, i)],
            residual=self.residual[np.ix_(o, i)],
            inputs=tuple(self.inputs[k] for k in i),
            outputs=tuple(self.outputs[k] for k in o),
            limits=tuple(self.limits[k] for k in i),
            placed_inputs=tuple(self.placed_inputs[k] for k in i),
            placed_outputs=tuple(self.placed_outputs[k] for k in o),
        )


@verb
def system(
    mechanism: Mechanism | Plan | FullOrderModel | LowOrderModel,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    *,
    parameters: Mapping[str, ArrayLike] | None = None,
    order: str = "low",
    damping: Damping | float | Mapping[str, Any] | None = None,
    static_correction: bool = True,
    **how: Any,
) -> System:
    """The second-order system of a mechanism or of a model of it, between named inputs and outputs.

    `inputs` and `outputs` name described actuators and sensors (wildcards allowed) or DOFs such as `platform.tz`
    (`platform.tz:velocity`, `ground.tx`); by default all that are described, or without any the DOFs at which static
    response stays exact: those of the mechanism's interface, or else of its rigid bodies. A mechanism is reduced as
    `reduce` does with further arguments, else as its own `reduction` says, else until its six lowest frequencies are
    proven within 1e-3; or taken at `order="full"`. `damping` replaces that of the description: a
    ratio for all modes, or the keys of `damping` in a file. With `static_correction` the static gain is that of the
    full-order model (theory eq. T8).

    Raises ModelError for a description that cannot be used and OptionError for impossible arguments.
    """
    model = _model(mechanism, parameters, order, how)
    plan, values, geometry = model.plan, model.values, model.geometry
    place = Placement(plan, values, geometry)
    ins, outs = _channels(place, inputs, outputs)
    full = _Full(model)
    law = damping_law(plan.mechanism.damping, plan.parameter_values(model.parameters), damping)
    C_full, H_full = plan.full_order.dissipation(values, geometry, law.loss_factor)
    recover = None if isinstance(model, FullOrderModel) else model.recovery
    C, H = (_projected(A, recover, model.K) for A in (C_full, H_full))
    loss = uniform_loss(H_full, full.model.K)
    loads = _loads(ins, full)
    all_rows = np.stack([o.row for o in outs]) if outs else np.zeros((0, plan.topology.n_dof))
    B = loads if recover is None else np.asarray(recover.T @ loads)
    rows = all_rows if recover is None else np.asarray(all_rows @ recover)
    residual = np.zeros((len(outs), len(ins)))
    if static_correction and recover is not None and residual.size:
        residual = _lacking(full, all_rows, loads, model, rows, B)
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
    if quantity == "transmissibility" and not all(i.base is not None for i in built.placed_inputs):
        raise OptionError("transmissibility is from motion of the base: name inputs such as ground.tx")
    outs = [_read_as(out, QUANTITIES[quantity]) for out in built.placed_outputs]
    return replace(
        built,
        derivative=np.array([o.derivative for o in outs], dtype=np.intp),
        D=_direct(list(built.placed_inputs), outs),
        outputs=tuple(o.channel for o in outs),
        placed_outputs=tuple(outs),
    )


def _read_as(out: PlacedOutput, derivative: int) -> PlacedOutput:
    if out.channel.quantity not in DERIVATIVE:
        return out
    turns = out.channel.quantity.startswith(("rotation", "angular"))
    names = [q for q, order in DERIVATIVE.items() if order == derivative]
    return replace(out, derivative=derivative, channel=replace(out.channel, quantity=names[turns]))


def _model(mechanism: Any, parameters: Mapping[str, ArrayLike] | None, order: str, how: dict[str, Any]) -> Model:
    if isinstance(mechanism, FullOrderModel | LowOrderModel):
        if parameters or how:
            raise OptionError("parameters and ways of reduction belong to a mechanism, not to a finished model")
        return mechanism
    if order not in ("low", "full"):
        raise OptionError(f"order is low or full, not {order!r}")
    if order == "full":
        if how:
            raise OptionError(f"{next(iter(how))} belongs to order low")
        return assemble(mechanism, parameters)
    plan = plan_of(mechanism)
    asked = reduction_of(plan, how, MODES)
    if "tolerance" in asked and not how:
        asked = {"coordinates": "substructures", **asked}
    return reduce(plan, one_design(parameters), **asked)


class _Full:
    """The full-order model behind a model, assembled when first needed."""

    def __init__(self, model: Model) -> None:
        self._model = model

    @cached_property
    def model(self) -> FullOrderModel:
        if isinstance(self._model, FullOrderModel):
            return self._model
        m = self._model
        return FullOrderModel(m.plan, m.parameters, m.values, m.geometry, *m.plan.full_order(m.values, m.geometry))


def _channels(
    place: Placement, inputs: Sequence[str] | None, outputs: Sequence[str] | None
) -> tuple[list[PlacedInput], list[PlacedOutput]]:
    if (inputs is None and not place.actuators) or (outputs is None and not place.sensors):
        dofs = default_dofs(place.plan, static_nodes(low_order(place.plan), None))
        inputs = dofs if inputs is None and not place.actuators else inputs
        outputs = dofs if outputs is None and not place.sensors else outputs
    return place.inputs(inputs), place.outputs(outputs)


def input_loads(system: System) -> Array:
    """Loads (n, m) of one unit of each input on the DOFs of the full-order model."""
    return _loads(list(system.placed_inputs), _Full(system.full_order))


def _loads(ins: list[PlacedInput], full: _Full) -> Array:
    return np.stack([_load(i, full) for i in ins], axis=1) if ins else np.zeros((full.model.order, 0))


def _load(placed: PlacedInput, full: _Full) -> Array:
    """Load (n,) of one unit of an input; that of an accelerated base is the inertia of everything (theory eq. T3)."""
    if placed.base is None:
        return placed.load
    return -(full.model.carried @ placed.base)


def _direct(ins: list[PlacedInput], outs: list[PlacedOutput]) -> Array:
    """D (p, m): what force sensors and absolute accelerations get from inputs directly."""
    D = np.zeros((len(outs), len(ins)))
    for k, out in enumerate(outs):
        for j, own in enumerate(ins):
            D[k, j] = out.feed.get(own.channel.name, 0.0)
            if own.base is not None and out.derivative == 2:
                D[k, j] += float(out.absolute @ own.base)
    return D


def uniform_loss(H: Any, K: Any) -> float | None:
    """The loss factor that is the same for everything elastic, zero without any; None where they differ."""
    total = float(H.diagonal().sum())
    if not total:
        return 0.0
    ratio = total / float(K.diagonal().sum())
    return ratio if abs(H - ratio * K).max() <= UNIFORM * abs(K).max() else None


def _projected(A: sp.csc_matrix, recover: Any, K: Any) -> Any:
    """A over the coordinates of a model, dense where its K is."""
    if recover is None:
        return A
    if not A.nnz:
        return 0 * K
    found = recover.T @ (A @ recover)
    dense = found.toarray() if hasattr(found, "toarray") else np.asarray(found)
    return (dense + dense.T) / 2 if isinstance(K, np.ndarray) else sp.csc_matrix(found)


def _lacking(full: _Full, all_rows: Array, loads: Array, low: Any, rows: Array, B: Array) -> Array:
    """Static gain (p, m) of the full-order model less that of the coordinates; zero where it is round-off."""
    flexible = flexibility(full.model)
    whole = all_rows @ flexible(loads)
    lost = whole - rows @ stored_flexibility(low.K, low.M, flexible.shift)(B)
    scale = np.abs(whole).max(axis=1, keepdims=True, initial=0.0)
    return np.where(np.abs(lost) > ROUNDING * scale, lost, 0.0)
