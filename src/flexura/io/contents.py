"""What models and results consist of, as named arrays and texts: the ground of the array formats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexura.errors import OptionError
from flexura.reduction import LowOrderModel, NestedModel
from flexura.structure import FullOrderModel
from flexura.systems import Channel, StateSpace

Array = NDArray[np.float64]


@runtime_checkable
class Response(Protocol):
    """A frequency response: `response` (f, p, m), complex, at `frequency_hz` (f,)."""

    name: str
    frequency_hz: Any
    response: Any
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]


@dataclass(frozen=True)
class SecondOrder:
    """M q'' + C q' + K q = f: matrices (n, n), dense or CSC, and names of the coordinates; C is None when not given."""

    name: str
    K: Any
    M: Any
    C: Any | None
    coordinate_names: list[str]
    model: FullOrderModel | LowOrderModel


def is_sparse(A: Any) -> bool:
    """True for sparse matrices."""
    return sp.issparse(A)


def second_order(what: Any, damping: Any | None = None) -> SecondOrder:
    """The matrices of a full-order, low-order or nested model, or of a system; `damping` is its C (n, n), N s/m.

    Modal damping ratios of a system are in C as its `damping_matrix` has them. Raises OptionError for other things, for
    systems with structural damping, which is in no C, and for a C of another size.
    """
    model = what.model if isinstance(what, NestedModel) else what
    own = None
    if not isinstance(model, FullOrderModel | LowOrderModel):
        whole: Any = what
        model = getattr(what, "model", None)
        if not isinstance(model, FullOrderModel | LowOrderModel) or not hasattr(what, "C"):
            raise OptionError(f"K and M are of a full-order or low-order model or a system, not of {_kind(what)}")
        if damping is None and getattr(what, "H", None) is not None:
            raise OptionError(
                "structural damping is in no matrix C of this system: export its state space, or give `damping`"
            )
        own = whole.damping_matrix() if damping is None and whole.is_damped else None
    names = model.dof_names if isinstance(model, FullOrderModel) else list(model.coordinate_names)
    C = own if damping is None else damping
    K, M, C = (None if A is None else _symmetric(A, len(names)) for A in (model.K, model.M, C))
    return SecondOrder(model.plan.mechanism.name, K, M, C, names, model)


def _symmetric(A: Any, n: int) -> Any:
    """A dense, or CSC with sorted rows, and equal to its transpose to the last bit."""
    A = sp.csc_matrix(A) if is_sparse(A) else np.asarray(A, dtype=float)
    if A.shape != (n, n):
        raise OptionError(f"a damping matrix of this model is {n} x {n}, not {' x '.join(map(str, A.shape))}")
    if abs(A - A.T).max() > 1e-9 * abs(A).max():
        raise OptionError("a damping matrix is symmetric")
    A = (A + A.T) / 2
    if is_sparse(A):
        A = sp.csc_matrix(A)
        A.sort_indices()
    return A


def contents(what: Any, damping: Any | None = None) -> dict[str, Any]:
    """Arrays (dense, or CSC), numbers, texts and lists of texts by name.

    Raises OptionError for things that have no such form.
    """
    if isinstance(what, StateSpace):
        return _of_state_space(what)
    if isinstance(what, Response) and not isinstance(what, FullOrderModel | LowOrderModel):
        return {
            "kind": "frequency response",
            "name": what.name,
            "frequency_hz": np.asarray(what.frequency_hz, dtype=float),
            "response": np.asarray(what.response, dtype=complex),
            **_channels("input", what.inputs),
            **_channels("output", what.outputs),
            "notes": [*getattr(what, "notes", ()), *(f"warning: {w}" for w in getattr(what, "warnings", ()))],
        }
    own = second_order(what, damping)
    matrices = {"K": own.K, "M": own.M} | ({} if own.C is None else {"C": own.C})
    notes = list(getattr(own.model, "steps", ()))
    texts = {"coordinate_names": own.coordinate_names, "notes": notes}
    return {"kind": "second-order model", "name": own.name, **matrices, **texts}


def notes_of(model: StateSpace) -> list[str]:
    """The notes of a model, and its warnings."""
    return [*model.notes, *(f"warning: {w}" for w in model.warnings)]


def _of_state_space(model: StateSpace) -> dict[str, Any]:
    return {
        "kind": "state space",
        "name": model.name,
        "A": model.A,
        "B": model.B,
        "C": model.C,
        "D": model.D,
        "dt": 0.0 if model.dt is None else model.dt,
        "delay": model.delay,
        **_channels("input", model.inputs),
        **_channels("output", model.outputs),
        "state_names": list(model.state_names),
        "notes": notes_of(model),
    }


def _channels(what: str, channels: Sequence[Channel]) -> dict[str, list[str]]:
    return {
        f"{what}_names": [c.name for c in channels],
        f"{what}_quantities": [c.quantity for c in channels],
        f"{what}_units": [c.unit for c in channels],
    }


def _kind(what: Any) -> str:
    return f"a {type(what).__name__}"
