"""Measured data: channels with their place and direction, time records, and frequency responses estimated from them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flexura.arrays import Array, Complex
from flexura.results import Result, Tabular
from flexura.systems import response_columns, unit_of_response
from flexura.tables import Facts, Table, counted, ends, in_hz, quantity
from flexura.testing.measurement.channels import MeasuredChannel
from flexura.testing.measurement.identified import IdentifiedModes


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

    def _view(self) -> Iterator[Facts | Table]:
        length = self.samples.shape[1] / self.sample_rate
        yield Facts(
            {
                "duration": quantity(length, "s"),
                "sample rate": in_hz(self.sample_rate),
                "setup": self.setup,
            }
        )
        columns = {
            "channel": [c.name for c in self.channels],
            "": ["input" if k in self.inputs else "output" for k in range(len(self.channels))],
            "largest": [
                quantity(float(np.abs(x).max()), c.unit, 4) for c, x in zip(self.channels, self.samples, strict=True)
            ],
            "rms": [
                quantity(float(np.sqrt(np.mean(x**2))), c.unit, 4)
                for c, x in zip(self.channels, self.samples, strict=True)
            ],
        }
        yield Table(columns, "channels")

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

    def _title(self) -> str:
        lines = counted(len(self.frequency_hz), "line")
        return f"{lines} from {ends((self.frequency_hz[0], self.frequency_hz[-1]), 'Hz', 5)}"

    def _view(self) -> Iterator[Facts | Table]:
        facts = {"setup": self.setup, "estimator": self.estimator, "records": self.averages}
        yield Facts({**facts, "exponential window [1/s]": self.decay or None})
        pairs = [(i, j) for i in range(len(self.outputs)) for j in range(len(self.inputs))]
        ends = [(self.outputs[i], self.inputs[j], np.abs(self.response[:, i, j])) for i, j in pairs]
        columns: dict[str, Any] = {
            "output": [out.name for out, _, _ in ends],
            "input": [into.name for _, into, _ in ends],
            "peak": [quantity(float(H.max()), unit_of_response(out, into), 4) for out, into, H in ends],
            "peak at [Hz]": [float(self.frequency_hz[H.argmax()]) for _, _, H in ends],
        }
        if self.coherence is not None:
            columns["median coherence"] = [f"{_median(self.coherence[:, i, j]):.3f}" for i, j in pairs]
        yield Table(columns, "pairs")

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

    def _view(self) -> Iterator[Facts | Table]:
        setups = dict.fromkeys(own.setup for own in (*self.recordings, *self.frfs))
        counts = {"records": len(self.recordings), "frequency responses": len(self.frfs), "setups": ", ".join(setups)}
        yield Facts({**counts, "modes in the file": "" if self.modes is None else len(self.modes.poles)})
        own = [frf._summary() for frf in self.frfs]
        columns = {
            "responses of": [s["setup"] or str(k + 1) for k, s in enumerate(own)],
            "inputs": [", ".join(s["inputs"]) for s in own],
            "outputs": [", ".join(s["outputs"]) for s in own],
            "band": [ends((s["from_hz"], s["to_hz"]), "Hz", 5) for s in own],
            "median coherence": ["" if s["median_coherence"] is None else f"{s['median_coherence']:.3f}" for s in own],
        }
        yield Table(columns, "sets of responses")

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
