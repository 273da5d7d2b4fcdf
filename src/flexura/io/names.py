"""Names of inputs, outputs and states that tell all of them apart."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from flexura.errors import OptionError
from flexura.structure import Channel
from flexura.systems import StateSpace


class Names(NamedTuple):
    """Names of inputs, outputs and states, no two equal."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]


def signal_names(model: StateSpace) -> Names:
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
