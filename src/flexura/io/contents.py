"""What models and results consist of, as named arrays and texts, and names that tell their signals apart."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
import scipy.sparse as sp

from flexura.analysis import ScheduledPlant, model_errors_of_modes
from flexura.errors import OptionError, SolverError
from flexura.full_order import assemble
from flexura.reduction import LowOrderModel, NestedModel
from flexura.structure import Channel, FullOrderModel
from flexura.systems import StateSpace
from flexura.tables import in_hz

MODES = 12
"""Modes of which it is told how far the part may be from them."""

ROUNDED = 1e-6
"""How far above the end of its range the highest frequency of a state space may lie, relative."""


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
    """Whether a matrix is sparse; without telling type checkers which of many classes it then is."""
    return sp.issparse(A)


def second_order(what: Any, damping: Any | None = None) -> SecondOrder:
    """The matrices of a full-order, low-order or nested model, or of a system; `damping` is its C (n, n), N s/m.

    Modal damping ratios of a system are in C as its `damping_matrix` has them. Raises OptionError for other things, for
    systems with structural damping, which is in no C, and for a C of another size.
    """
    model = what.model if isinstance(what, NestedModel) else what
    described = None
    if not isinstance(model, FullOrderModel | LowOrderModel):
        whole: Any = what
        model = getattr(what, "model", None)
        if not isinstance(model, FullOrderModel | LowOrderModel) or not hasattr(what, "C"):
            raise OptionError(
                f"K and M are of a full-order or low-order model or a system, not of a {type(what).__name__}"
            )
        if damping is None and getattr(what, "H", None) is not None:
            raise OptionError(
                "structural damping is in no matrix C of this system: export its state space, or give `damping`"
            )
        described = whole.damping_matrix() if damping is None and whole.is_damped else None
    names = model.dof_names if isinstance(model, FullOrderModel) else list(model.coordinate_names)
    C = described if damping is None else damping
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
    if isinstance(what, ScheduledPlant):
        return {
            "kind": "scheduled plant",
            "name": what.name,
            "parameter": what.family.parameter,
            **what.arrays(),
            "error": what.error,
            "up_to_hz": what.up_to,
            **_channels("input", what.inputs),
            **_channels("output", what.outputs),
            "state_names": list(what.state_names),
            "notes": [*what.notes, *(f"warning: {w}" for w in what.warnings)],
        }
    if isinstance(what, Response) and not isinstance(what, FullOrderModel | LowOrderModel):
        modes = getattr(what, "modes", None)
        errors = [] if modes is None else model_error_notes(modes.system.model, float(np.max(what.frequency_hz)))
        return {
            "kind": "frequency response",
            "name": what.name,
            "frequency_hz": np.asarray(what.frequency_hz, dtype=float),
            "response": np.asarray(what.response, dtype=complex),
            **({} if getattr(what, "sigma", None) is None else {"sigma": np.asarray(getattr(what, "sigma", None))}),
            **_channels("input", what.inputs),
            **_channels("output", what.outputs),
            "notes": [*getattr(what, "notes", ()), *(f"warning: {w}" for w in getattr(what, "warnings", ())), *errors],
        }
    second = second_order(what, damping)
    matrices = {"K": second.K, "M": second.M} | ({} if second.C is None else {"C": second.C})
    notes = [*getattr(second.model, "steps", ()), *model_error_notes(second.model)]
    texts = {"coordinate_names": second.coordinate_names, "notes": notes}
    return {"kind": "second-order model", "name": second.name, **matrices, **texts}


def notes_of(model: StateSpace) -> list[str]:
    """The notes of a model, its warnings, and how far the part may be from its frequencies."""
    if model.model is None:
        return [*model.notes, *(f"warning: {w}" for w in model.warnings)]
    poles = model.poles()
    speed = np.abs(poles if model.dt is None else np.log(poles[poles != 0]) / model.dt)
    kept = float(speed.max(initial=0.0)) / (2 * np.pi) if model.neglected is None else model.neglected.band[1]
    errors = model_error_notes(model.model, kept * (1 + ROUNDED))
    return [*model.notes, *(f"warning: {w}" for w in model.warnings), *errors]


def model_error_notes(model: FullOrderModel | LowOrderModel, highest: float = np.inf) -> list[str]:
    """How far the part may be from the frequencies of a model up to a highest one, Hz, of MODES modes at most, in
    words; none without a mode there."""
    full = model if isinstance(model, FullOrderModel) else assemble(model.plan, model.parameters)
    if not full.order:
        return []
    try:
        errors, hz = model_errors_of_modes(full, min(MODES, full.order))
    except SolverError as error:
        return [f"model error, how far the part may be from these frequencies: not known, {error}"]
    named = [f"{in_hz(f)} {text}" for f, text in zip(hz, errors.texts, strict=False) if 0 < f <= highest]
    named += ["of higher ones not worked out"] * (len(errors.texts) == MODES and bool(hz[MODES - 1] <= highest))
    return [f"model error, how far the part may be from these frequencies: {', '.join(named)}"] * bool(named)


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


class Names(NamedTuple):
    """Names of inputs, outputs and states, no two equal."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]


def signal_names(model: StateSpace | ScheduledPlant) -> Names:
    """A channel's name, and its quantity behind a dot when another channel or a state has the same name:
    a force and the displacement at `stage.tx` become `stage.tx.force` and `stage.tx.displacement`.

    Raises OptionError when names are still equal, or not one line of text.
    """
    count = Counter([c.name for c in (*model.inputs, *model.outputs)]) + Counter(set(model.state_names))

    def name(channel: Channel) -> str:
        return channel.name if count[channel.name] == 1 else f"{channel.name}.{channel.quantity}"

    names = Names(tuple(map(name, model.inputs)), tuple(map(name, model.outputs)), tuple(model.state_names))
    refuse_clashes([*names.inputs, *names.outputs, *names.states])
    return names


def refuse_clashes(names: list[str], what: str = "") -> None:
    """Raise OptionError when two names are equal or one is not a line of text; `what` says how they were made."""
    twice = [name for name, k in Counter(names).items() if k > 1]
    if twice:
        raise OptionError(
            f"two signals are called {twice[0]!r}{what}; rename a channel, or take one of them with `selected`"
        )
    odd = [name for name in names if not name.strip() or not name.isprintable()]
    if odd:
        raise OptionError(f"{odd[0]!r} is no name: a name is one line of text")


def plain_name(name: str) -> str:
    """A name of letters, digits and underscores alone."""
    return re.sub(r"\W+", "_", name).strip("_") or "signal"
