"""Measured data: channels with their place and direction, time records, and frequency responses estimated from them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexura.testing.measurement.channels import MeasuredChannel
from flexura.testing.measurement.identified import IdentifiedModes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Recording:
    """One time record, such as one hit: `samples` (c, N) of the channels at `sample_rate`, Hz.

    `inputs` are the positions of the channels that excite, such as the hammer. `setup` tells placements of sensors
    apart, each of which has its sensors' mass in other places.
    """

    sample_rate: float
    samples: Array
    channels: tuple[MeasuredChannel, ...]
    inputs: tuple[int, ...] = (0,)
    setup: str = ""
    name: str = ""


@dataclass(frozen=True)
class MeasuredFRF:
    """H (f, p, m) at `frequency_hz` (f,): response of each output to a unit of each input, e^(+i omega t).

    `coherence` (f, p, m) from `averages` records, where known. `decay`, 1/s, is what an exponential window has added to
    the decay rate of every mode. `estimator`: H1, H2 or Hv.
    """

    frequency_hz: Array
    response: Complex
    inputs: tuple[MeasuredChannel, ...]
    outputs: tuple[MeasuredChannel, ...]
    coherence: Array | None = None
    averages: int | None = None
    estimator: str = ""
    decay: float = 0.0
    setup: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Measurement:
    """All that one test has given: time records, frequency responses, or both; SI.

    `modes` are those that a file of the test came with.
    """

    name: str
    recordings: tuple[Recording, ...] = ()
    frfs: tuple[MeasuredFRF, ...] = ()
    notes: tuple[str, ...] = field(default=())
    modes: IdentifiedModes | None = None
