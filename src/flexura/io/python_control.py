"""State spaces of the python-control package."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.extras import need
from flexura.io.names import refuse_clashes, signal_names
from flexura.systems import StateSpace

if TYPE_CHECKING:
    import control


@verb
def to_control(model: StateSpace) -> control.StateSpace:
    """The model as `control.StateSpace`, with its step and the names of its inputs, outputs and states.

    python-control allows no dots in names: `stage.tx` becomes `stage_tx`, and what is no letter or digit an underscore.
    Names that inputs and outputs share get their quantity behind them (`stage_tx_force`), since python-control connects
    signals of equal names. Raises OptionError without the package, for names that clash, and for a continuous model
    with dead time: `discretised` has it inside.
    """
    library: Any = need("control", "control")
    if model.delay and not model.is_discrete:
        raise OptionError(
            f"python-control has no dead time, and this model has {model.delay} s: export model.discretised(step),"
            " which contains it, or set the delay to zero"
        )
    plain = [tuple(_plain(name) for name in names) for names in signal_names(model)]
    refuse_clashes([name for names in plain for name in names], " once dots have become underscores")
    inputs, outputs, states = plain
    matrices = (model.A, model.B, model.C, model.D)
    time = model.dt if model.dt is not None else 0
    names = {"name": _plain(model.name), "inputs": inputs, "outputs": outputs, "states": states}
    return library.StateSpace(*matrices, time, **names, remove_useless_states=False)


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name).strip("_") or "signal"
