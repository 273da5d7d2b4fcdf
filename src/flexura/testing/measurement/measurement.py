"""Measured data: channels with their place and direction, time records, and frequency responses estimated from them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.results import Result, Tabular
from flexura.systems import response_columns
from flexura.testing.measurement.channels import MeasuredChannel
from flexura.testing.measurement.identified import IdentifiedModes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, repr=False)
class Recording(Tabular):
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

    def _data(self) -> dict[str, Any]:
        own = {name: value for name, value in super()._data().items() if name != "sample_rate"}
        return {**own, "sample_rate_hz": self.sample_rate}

    def _columns(self) -> dict[str, Any]:
        time = {"time [s]": np.arange(self.samples.shape[1]) / self.sample_rate}
        return time | {str(c): x for c, x in zip(self.channels, self.samples, strict=True)}


@dataclass(frozen=True, repr=False)
class MeasuredFRF(Tabular):
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

    def _data(self) -> dict[str, Any]:
        numbers = {"frequency_hz": self.frequency_hz, "real": self.response.real, "imaginary": self.response.imag}
        ends = {"inputs": self.inputs, "outputs": self.outputs}
        return {**self._summary(), **ends, **numbers, "coherence": self.coherence, "estimator": self.estimator}

    def _summary(self) -> dict[str, Any]:
        """What the responses are of, without them."""
        return {
            "setup": self.setup,
            "inputs": [c.name for c in self.inputs],
            "outputs": [c.name for c in self.outputs],
            "lines": len(self.frequency_hz),
            "from_hz": self.frequency_hz[0],
            "to_hz": self.frequency_hz[-1],
            "averages": self.averages,
            "median_coherence": None if self.coherence is None else _median(self.coherence),
            "decay": self.decay,
            "notes": self.notes,
        }

    def _columns(self) -> dict[str, Any]:
        """Frequency, then magnitude and phase of every pair."""
        return response_columns(self.frequency_hz, self.response, self.inputs, self.outputs)


@dataclass(frozen=True, repr=False)
class Measurement(Result):
    """All that one test has given: time records, frequency responses, or both; SI.

    `modes` are those that a file of the test came with.
    """

    name: str
    recordings: tuple[Recording, ...] = ()
    frfs: tuple[MeasuredFRF, ...] = ()
    notes: tuple[str, ...] = field(default=())
    modes: IdentifiedModes | None = None

    def _data(self) -> dict[str, Any]:
        """Everything but samples and responses, which their own `to_dict` gives."""
        return {
            "name": self.name,
            "recordings": [
                {
                    "name": own.name,
                    "setup": own.setup,
                    "channels": [c.name for c in own.channels],
                    "inputs": own.inputs,
                    "sample_rate_hz": own.sample_rate,
                    "samples": own.samples.shape[1],
                }
                for own in self.recordings
            ],
            "responses": [own._summary() for own in self.frfs],
            "modes": self.modes,
        }


def _median(values: Array) -> float:
    """The upper median, one of the values."""
    return float(np.sort(values, axis=None)[values.size // 2])
