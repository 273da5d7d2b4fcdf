"""What no instrument measures: numbers beyond all bounds, and arrays that do not fit together."""

from __future__ import annotations

import numpy as np

from flexura.errors import OptionError
from flexura.mechanism import CONTROL, LONGEST_TITLE
from flexura.testing.measurement.measurement import MeasuredFRF, Measurement, Recording

HIGHEST = 1e12
"""Highest frequency and sample rate, Hz: squares and powers of far higher ones overflow."""

LARGEST = 1e100
"""Largest value of a sample or a response."""


def refuse_implausible(found: Measurement, where: str) -> None:
    """Raise OptionError for numbers beyond all bounds, and for arrays of different sizes."""
    _refuse_names(found, where)
    for record in found.recordings:
        _refuse_record(record, f"{where}: {record.name or 'record'}")
    for frf in found.frfs:
        _refuse_response(frf, f"{where}: responses of setup {frf.setup!r}" if frf.setup else f"{where}: responses")


def _refuse_names(found: Measurement, where: str) -> None:
    """Names and setups are short and printable: they become parts of tables, pictures and messages."""
    channels = [c for r in found.recordings for c in r.channels]
    channels += [c for f in found.frfs for c in (*f.inputs, *f.outputs)]
    names = [found.name, *(t for c in channels for t in (c.name, c.node or ""))]
    names += [t for r in found.recordings for t in (r.name, r.setup)] + [f.setup for f in found.frfs]
    for name in names:
        if len(name) > LONGEST_TITLE or CONTROL.search(name):
            shown = repr(name if len(name) <= 40 else f"{name[:37]}...")
            raise OptionError(
                f"{where}: a name has at most {LONGEST_TITLE} characters and no control characters, not {shown}"
            )


def _refuse_record(record: Recording, where: str) -> None:
    if not 0 < record.sample_rate <= HIGHEST:
        raise OptionError(f"{where}: a sample rate is positive and at most {HIGHEST:g} Hz, not {record.sample_rate:g}")
    if not record.samples.shape[-1]:
        raise OptionError(f"{where}: there are no samples")
    _refuse_large(record.samples, where)


def _refuse_response(frf: MeasuredFRF, where: str) -> None:
    if not len(frf.frequency_hz):
        raise OptionError(f"{where}: there are no frequencies")
    if not (np.isfinite(frf.frequency_hz).all() and frf.frequency_hz.min() >= 0 and frf.frequency_hz.max() <= HIGHEST):
        span = f"{frf.frequency_hz.min():g} to {frf.frequency_hz.max():g}"
        raise OptionError(f"{where}: frequencies lie between 0 and {HIGHEST:g} Hz, these from {span}")
    if (np.diff(frf.frequency_hz) <= 0).any():
        at = int(np.argmax(np.diff(frf.frequency_hz) <= 0))
        pair = f"{frf.frequency_hz[at]:g} Hz comes before {frf.frequency_hz[at + 1]:g} Hz"
        raise OptionError(f"{where}: frequencies ascend, each is given once; {pair}")
    if not (np.isfinite(frf.decay) and 0 <= frf.decay <= HIGHEST):
        raise OptionError(f"{where}: the decay of a window is a rate in 1/s, not {frf.decay:g}")
    _refuse_large(frf.response, where)
    if frf.coherence is None:
        return
    if frf.coherence.shape != frf.response.shape:
        raise OptionError(f"{where}: coherence is {frf.coherence.shape}, responses are {frf.response.shape}")
    _refuse_large(frf.coherence, f"{where}: coherence")


def _refuse_large(values: np.ndarray, where: str) -> None:
    """Values that are no numbers are judged elsewhere."""
    size = np.abs(values)
    beyond = np.isfinite(size) & (size > LARGEST)
    if beyond.any():
        raise OptionError(f"{where}: a value of {size[beyond][0]:.3g}; at most {LARGEST:g} is expected")
