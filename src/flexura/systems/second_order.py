"""M q'' + C q' + (K + i H) q = B u with named inputs and outputs, and its static responses and lowest modes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, least_pivot, lowest, lowest_modes
from flexura.reduction import WELL, Flexibility, LowOrderModel, chained, flexibility, stored_flexibility
from flexura.results import Result
from flexura.structure import FullOrderModel, full_order_model
from flexura.systems.channel import Channel, ends_of, positions
from flexura.systems.damping import DampingLaw
from flexura.systems.ports import InputPort, OutputPort
from flexura.tables import Facts, Table

Model = FullOrderModel | LowOrderModel

MOST_MODES = 3000
"""Coordinates up to which all modes are found for a matrix of modal damping ratios."""

MOST_BY_ENERGIES = 400
"""Modes up to which those of a stiffness that loses digits are found by energies."""


@dataclass(frozen=True, repr=False)
class SecondOrder(Result):
    """M q'' + C q' + (K + i H) q = B u, and outputs y = (d/dt)^k (rows q + residual u) + D u.

    M, C, K (n, n) dense or sparse, SI; H (n, n) is structural damping, None without; B (n, m); rows (p, n) and the
    order k of differentiation, `derivative` (p,), of every output; D (p, m) reaches the outputs directly; `residual`
    (p, m) is the static gain that the coordinates q lack. `law` holds the modal damping ratios, which C does not
    contain and `damping_matrix` does. C is that of `dashpots` and Rayleigh damping, and H is `uniform_loss` times K
    unless that is None. `model` recovers physical displacements from q.
    """

    _shown = ("name", "order", "inputs", "outputs")
    _told = (
        "name",
        "order",
        "inputs",
        "outputs",
        "M",
        "C",
        "K",
        "H",
        "B",
        "rows",
        "derivative",
        "D",
        "residual",
        "limits",
    )

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
    input_ports: tuple[InputPort, ...]
    output_ports: tuple[OutputPort, ...]

    @property
    def order(self) -> int:
        """Number of coordinates."""
        return self.K.shape[0]

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.model.plan.mechanism.name

    def _view(self) -> Iterator[Facts | Table]:
        yield Facts({"order": self.order, **ends_of(self.inputs, self.outputs), "damped": self.is_damped})

    @cached_property
    def is_damped(self) -> bool:
        """True when anything dissipates."""
        has_C = bool(abs(self.C).max() > 0) if self.order else False
        return has_C or self.H is not None or self.law.is_modal

    @cached_property
    def full_order(self) -> FullOrderModel:
        """The full-order model behind `model`."""
        return full_order_of(self.model)

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

    def selected(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> Self:
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
            input_ports=tuple(self.input_ports[k] for k in i),
            output_ports=tuple(self.output_ports[k] for k in o),
        )


def full_order_of(model: Model) -> FullOrderModel:
    """The full-order model behind a model."""
    return model if isinstance(model, FullOrderModel) else full_order_model(model.design)
