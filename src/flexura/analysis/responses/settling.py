"""How long points ring after moves, until what is left is within what disturbances make of them, or within a band."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.records import Record
from flexura.structure import Channel, channel_positions
from flexura.systems import PoleForm, decay, settling_time
from flexura.tables import SHOWN_AS_ZERO, quantity


class Moves(NamedTuple):
    """Moves of inputs, each `by` so much over so many seconds, and bands by output, SI; three sigma for others."""

    by: Mapping[str, float]
    over: float
    within: Mapping[str, float]

    @staticmethod
    def of(by: Mapping[str, float] | None, over: float, within: Mapping[str, float] | None) -> Moves:
        """What is asked for. Raises OptionError for numbers that are none."""
        by, within = dict(by or {}), dict(within or {})
        if not by and (over or within):
            raise OptionError("over and within belong to moves, e.g. moves={'servo.reference': 1e-6}")
        if not (np.isfinite(over) and over >= 0):
            raise OptionError(f"a move lasts a time in s, not {over}")
        for what, given in (("a move is by a finite number that is not zero", by), ("a band is positive", within)):
            for name, value in given.items():
                if not np.isfinite(value) or value == 0 or (given is within and value < 0):
                    raise OptionError(f"{name}: {what}, not {value}")
        return Moves(by, float(over), within)


@dataclass(frozen=True, repr=False)
class Settling(Record):
    """How long the output `point` rings after a move of the input `move`, `by` so much in its `unit` over `over_s`.

    From the end of the move until it stays within `within` of where it ends, `final`, `time_s` pass; infinite where it
    never does, NaN where no band is known.
    """

    _shown = ("move", "point", "time_s")

    move: str
    by: float
    unit: str
    over_s: float
    point: str
    final: float
    within: float
    time_s: float

    @property
    def words(self) -> str:
        """The move in words."""
        over = f" over {quantity(self.over_s, 's', 3)}" if self.over_s else ""
        return f"{self.move} by {quantity(self.by, self.unit, 4)}{over}"


def settled(
    form: PoleForm, inputs: Sequence[Channel], outputs: Sequence[Channel], moves: Moves, three_sigma: Array
) -> tuple[Settling, ...]:
    """Of every move and output. Raises OptionError for bands of outputs that are not there."""
    bands = three_sigma.copy()
    bands[channel_positions(outputs, list(moves.within))] = list(moves.within.values())
    found = list[Settling]()
    for name, by in moves.by.items():
        weights, [at] = np.zeros((len(inputs), 1)), channel_positions(inputs, [name])
        weights[at] = by
        own = form.driven_by(weights, np.zeros((len(outputs), 1)))
        final, (amplitudes, poles) = own.response(np.zeros(1))[0, :, 0].real, decay(own, moves.over)
        final[np.abs(final) < SHOWN_AS_ZERO * np.abs(amplitudes).sum(axis=1)] = 0.0
        for k, channel in enumerate(outputs):
            end, band = float(final[k]), float(bands[k])
            time = settling_time(amplitudes[k], poles, band)
            found.append(Settling(name, by, inputs[at].unit, moves.over, channel.name, end, band, time))
    return tuple(found)
