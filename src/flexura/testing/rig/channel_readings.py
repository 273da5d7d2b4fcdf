"""What the channels of a test read of a model: points that move rigidly with its nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexura.errors import OptionError
from flexura.sensitivity import Reading
from flexura.structure import FullOrderModel
from flexura.testing.measurement import MeasuredChannel
from flexura.testing.rig.channel_pairing import pair_channels


def readings_of(model: FullOrderModel, channels: Sequence[MeasuredChannel]) -> list[Reading]:
    """Where channels sit on a mechanism: sensors stay where they are on their node while sizes change.

    Raises OptionError for channels that have no counterpart in the model.
    """
    pairing = pair_channels(model, channels)
    if pairing.unmatched:
        lost = "; ".join(f"{u.channel.name}: {u.reason}" for u in pairing.unmatched[:3])
        more = len(pairing.unmatched) - 3
        raise OptionError(lost + (f"; and {more} more" if more > 0 else ""))
    found = []
    for k, match in enumerate(pairing.matched):
        if np.isfinite(pairing.positions[k]).all():
            at = model.geometry.positions[model.plan.topology.numbers([match.node])[0]]
            arm = pairing.positions[k] - at
            found.append(Reading(match.node, pairing.directions[k], bool(pairing.turns[k]), arm))
        else:
            found.append(Reading(match.node, np.zeros(3), False, np.zeros(3), pairing.rows[k]))
    return found
