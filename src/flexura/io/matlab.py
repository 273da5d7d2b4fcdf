"""Measured data from MATLAB files.

A file holds the arrays of docs/testing.md, alone or as fields of structs, or one variable per channel.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from flexura.errors import OptionError
from flexura.io.archives import measurement_of, rate_of
from flexura.io.mat_variables import read_variables
from flexura.io.records import record_of, refuse_ragged, unit_of
from flexura.testing.measurement import ChannelDescriptions, Measurement, Recording

Arrays = dict[str, Any]

_SPELLINGS = {
    **dict.fromkeys(("fs", "samplerate", "sampling_rate"), "sample_rate"),
    **dict.fromkeys(("t",), "time"),
    **dict.fromkeys(("data",), "samples"),
    **dict.fromkeys(("names", "labels", "channel_names"), "channels"),
    **dict.fromkeys(("frequency", "freq", "f"), "frequency_hz"),
    **dict.fromkeys(("h", "frf"), "response"),
}
"""Names of arrays, in small letters, as they are often written."""


def read_mat(path: Path, descriptions: ChannelDescriptions) -> Measurement:
    """Read a MATLAB file: the arrays of docs/testing.md, alone or in structs, or `time` or `fs` and a variable for
    every channel, each with `units` or the units of `descriptions`.

    Raises OptionError for files that are damaged or cut off, without units or sample rate, and with variables of
    different lengths; for version 7.3 also without h5py.
    """
    groups: dict[str, Arrays] = {}
    for name, value in read_variables(path).items():
        struct, _, own = name.rpartition(".")
        groups.setdefault(struct, {})[_SPELLINGS.get(own.lower(), own)] = value
    arrays: Arrays = {}
    records: list[Recording] = []
    notes: list[str] = []
    for struct, own in groups.items():
        where = f"{path}: {struct}" if struct else str(path)
        if "samples" in own or "response" in own:
            kind = "frf" if "response" in own else "recording"
            filled = _responses(own) if kind == "frf" else _samples(own, where, descriptions)
            arrays |= {f"{kind}{len(arrays)}.{name}": value for name, value in ({"name": struct} | filled).items()}
        elif "sample_rate" in own or "time" in own:
            record, remarks = _by_variable(own, where, struct or path.stem, descriptions)
            records.append(record)
            notes += remarks
    if not arrays and not records:
        found = ", ".join(sorted(name for own in groups.values() for name in own)) or "nothing"
        raise OptionError(
            f"{path}: neither `samples` nor a `response` is in the file, nor `time` or `fs` beside variables of"
            f" channels; found {found}"
        )
    if not arrays:
        return Measurement(path.stem, tuple(records), notes=tuple(notes))
    measured = measurement_of(path, arrays, descriptions)
    return Measurement(measured.name, (*measured.recordings, *records), measured.frfs, (*measured.notes, *notes))


def _headings(own: Arrays, names: list[str], where: str, descriptions: ChannelDescriptions) -> list[str]:
    """`name [unit]` of every channel, from `units` or from what is described where the name has none."""
    units = [str(u) for u in np.atleast_1d(own["units"])] if "units" in own else [""] * len(names)
    if len(units) != len(names):
        raise OptionError(f"{where}: there are {len(units)} units for {len(names)} channels")
    return [
        name if name.endswith("]") and not unit else f"{name} [{unit_of(name, unit, where, descriptions)}]"
        for name, unit in zip(names, units, strict=True)
    ]


def _samples(own: Arrays, where: str, descriptions: ChannelDescriptions) -> Arrays:
    """Arrays of a record with headings, and with samples whose rows are channels."""
    samples = np.asarray(own["samples"])
    samples = samples[None] if samples.ndim == 1 else samples
    if "channels" in own:
        names = [str(t) for t in np.atleast_1d(own["channels"])]
    elif len(descriptions) in samples.shape:
        names = list(descriptions)
    else:
        raise OptionError(
            f"{where}: samples of shape {samples.shape} have no `channels`: give a file of channels that names them in"
            " their order"
        )
    rows = [axis for axis in range(max(samples.ndim - 2, 0), samples.ndim) if samples.shape[axis] == len(names)]
    if samples.ndim == 2 and len(rows) == 2:
        raise OptionError(
            f"{where}: {len(names)} samples of {len(names)} channels: which are rows cannot be told; record longer"
        )
    if samples.ndim == 2 and rows == [1]:
        samples = samples.T
    filled = {**own, "samples": samples, "channels": np.array(_headings(own, names, where, descriptions))}
    if "inputs" in own:
        filled["inputs"] = np.atleast_1d(own["inputs"]) - 1  # MATLAB counts from 1
    return filled


def _responses(own: Arrays) -> Arrays:
    """Arrays of responses in three dimensions: MATLAB drops those of size one at the end."""
    sides = [len(np.atleast_1d(own.get(f"{side}_channels", ""))) for side in ("output", "input")]
    shape = (np.size(own.get("frequency_hz", ())), *sides)
    H = np.asarray(own["response"])
    filled = {**own, "response": H.reshape(shape) if H.size == np.prod(shape) else H}
    beside = {name: np.asarray(own[name]) for name in ("coherence", "sigma") if name in own}
    return filled | {name: values.reshape(shape) for name, values in beside.items() if values.size == H.size}


def _by_variable(own: Arrays, where: str, name: str, descriptions: ChannelDescriptions) -> tuple[Recording, list[str]]:
    """A record whose channels are the vectors beside its time or sample rate, and a note on what is no vector."""
    numbers = {key: np.asarray(value) for key, value in own.items() if np.asarray(value).dtype.kind in "iufbc"}
    given = numbers.pop("sample_rate", None)
    signals = {
        key: ("s" if key == "time" else "", np.asarray(value, dtype=float))
        for key, value in numbers.items()
        if value.ndim == 1 and value.dtype.kind in "iuf"
    }
    if given is not None and given.size != 1:
        raise OptionError(f"{where}: a sample rate is one number, not {given.size}")
    rate = rate_of(signals["time"][1], where) if given is None else float(given.item())
    refuse_ragged(where, {key: len(values) for key, (_, values) in signals.items()})
    signals.pop("time", None)
    others = [key for key, value in numbers.items() if value.ndim > 1]
    notes = [f"{where}: left out, since no vectors of samples: {', '.join(others)}"] if others else []
    return record_of(where, name, rate, signals, descriptions), notes
