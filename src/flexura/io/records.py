"""Records of what acquisition systems write: TDMS by npTDMS, and WAV by SciPy; one record of signals by name."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError, need
from flexura.files import read_bytes, refuse_unreadable
from flexura.testing.measurement import (
    FORCES,
    ChannelDescription,
    ChannelDescriptions,
    MeasuredChannel,
    Measurement,
    Recording,
    quantity_of,
)

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "units", "Unit")
"""Properties of a channel of a TDMS file that name its unit, by whom has written it."""

SAME_STEP = 1e-6
"""Sample rates of one group that differ by no more, relative, are the same."""


def unit_of(name: str, unit: str, where: str, descriptions: ChannelDescriptions) -> str:
    """The unit of a channel as described, else of the file. Raises OptionError where neither says one."""
    found = descriptions.get(name, ChannelDescription()).unit or unit.strip()
    if not found:
        raise OptionError(
            f"{where}: {name} has no unit in the file: a file of channels says it, as {name}: {{unit: m/s^2}}"
        )
    return found


def refuse_ragged(where: str, lengths: Mapping[str, int]) -> None:
    """Raise OptionError where channels have different numbers of samples."""
    short, long = min(lengths, key=lengths.__getitem__), max(lengths, key=lengths.__getitem__)
    if lengths[short] != lengths[long]:
        raise OptionError(
            f"{where}: {short} has {lengths[short]} samples and {long} has {lengths[long]}: channels of a record have"
            " the same"
        )


def record_of(
    where: str, name: str, rate: float, signals: Mapping[str, tuple[str, Array]], descriptions: ChannelDescriptions
) -> Recording:
    """A record of signals (N,) by name, each with its unit or that which is described; forces are inputs.

    Raises OptionError without signals, for different lengths, and for units that are missing or of something else.
    """
    if not signals:
        raise OptionError(f"{where}: there are no signals")
    if not (np.isfinite(rate) and rate > 0):
        raise OptionError(f"{where}: the sample rate is {rate:g} Hz")
    refuse_ragged(where, {key: len(values) for key, (_, values) in signals.items()})
    channels, rows = [], []
    for key, (unit, values) in signals.items():
        described = descriptions.get(key, ChannelDescription())
        quantity, factor = quantity_of(unit_of(key, unit, where, descriptions), described.quantity, f"{where}: {key}")
        channels.append(MeasuredChannel(key, quantity))
        rows.append(np.asarray(values, dtype=float) * factor)
    inputs = tuple(k for k, c in enumerate(channels) if c.quantity in FORCES)
    return Recording(rate, np.array(rows), tuple(channels), inputs, "", name)


def read_tdms(path: Path, descriptions: ChannelDescriptions) -> Measurement:
    """Read a TDMS file of LabVIEW: every group of waveforms is a record, with its rate and the units of its channels.

    Raises OptionError without npTDMS, for files that are damaged or cut off, for rates that are missing or differ
    within a group, and for units that are missing.
    """
    refuse_unreadable(path)
    nptdms = need("nptdms", "experiment")
    level = logging.root.manager.disable
    logging.disable(logging.WARNING)  # damage is reported once, below
    try:
        file = nptdms.TdmsFile.read(path)
        cut_off = file.file_status.incomplete_final_segment
    except Exception as error:  # the library has one for every kind of damage
        raise OptionError(f"{path}: not a TDMS file, or damaged: {error or type(error).__name__}") from None
    finally:
        logging.disable(level)
    if cut_off:
        raise OptionError(f"{path}: the file ends within its last segment: is it complete?")
    groups = [(group, [c for c in group.channels() if len(c) and c.dtype.kind in "iuf"]) for group in file.groups()]
    records = []
    for group, channels in groups:
        if channels:
            where = f"{path}: {group.name}"
            signals = {c.name: (_property(c, _UNITS), np.asarray(c[:], dtype=float)) for c in channels}
            records.append(record_of(where, group.name, _rate(channels, where), signals, descriptions))
    if not records:
        raise OptionError(f"{path}: there are no signals in the file")
    return Measurement(path.stem, tuple(records))


def _property(channel: Any, names: tuple[str, ...]) -> str:
    return next((str(channel.properties[name]) for name in names if channel.properties.get(name)), "")


def _rate(channels: list[Any], where: str) -> float:
    """Sample rate, Hz, of a group."""
    steps = {c.name: float(c.properties.get("wf_increment", 0.0)) for c in channels}
    for name, step in steps.items():
        if not (np.isfinite(step) and step > 0):
            raise OptionError(f"{where}: {name} has no sample rate (wf_increment): record it as a waveform")
    slow, fast = max(steps, key=steps.__getitem__), min(steps, key=steps.__getitem__)
    if steps[slow] - steps[fast] > SAME_STEP * steps[fast]:
        raise OptionError(
            f"{where}: {slow} is sampled at {1 / steps[slow]:g} Hz and {fast} at {1 / steps[fast]:g} Hz: resample, or"
            " make groups of them"
        )
    return 1 / steps[slow]


def read_wav(path: Path, descriptions: ChannelDescriptions) -> Measurement:
    """Read a WAV file, whose channels have the names of `descriptions` in their order, and their full scales.

    Integers are shares of the full scale; floating-point numbers are values in the described unit where no full scale
    is. Raises OptionError for files that are damaged or cut off, and for channels that are not described.
    """
    from scipy.io import wavfile

    content = read_bytes(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rate, data = wavfile.read(BytesIO(content))
    except Exception as error:  # a struct that is too short, and others
        raise OptionError(f"{path}: not a WAV file, or damaged: {error or type(error).__name__}") from None
    _refuse_cut_off(content, str(path))
    data = data[:, None] if data.ndim == 1 else data
    names = list(descriptions)
    if len(names) != data.shape[1]:
        raise OptionError(
            f"{path}: a WAV file names no channels: a file of channels names its {data.shape[1]} in their order, each"
            f" as hammer: {{full_scale: 50 N}}; there are {len(names)}"
        )
    signals = {}
    middle = 128 if data.dtype.kind == "u" else 0
    for name, values in zip(names, data.T, strict=True):
        scale, unit = descriptions[name].full_scale or (1.0, "")
        if data.dtype.kind in "iu":
            if not unit:
                raise OptionError(f"{path}: {name}: integers are shares of a full scale: {name}: {{full_scale: 50 N}}")
            scale /= 2.0 ** (8 * data.dtype.itemsize - 1)
        signals[name] = (unit, scale * (values.astype(float) - middle))
    return Measurement(path.stem, (record_of(str(path), path.stem, float(rate), signals, descriptions),))


def _refuse_cut_off(content: bytes, place: str) -> None:
    """Raise OptionError where the samples end before the size that their chunk claims; 0 and all ones are streams."""
    order = "big" if content[:4] == b"RIFX" else "little"
    at = 12
    while at + 8 <= len(content):
        size = int.from_bytes(content[at + 4 : at + 8], order)
        if content[at : at + 4] == b"data" and size != 0xFFFFFFFF and at + 8 + size > len(content):
            raise OptionError(f"{place}: the file ends {at + 8 + size - len(content)} bytes too soon: is it complete?")
        at += 8 + size + size % 2
