"""Measured data from and to files, by suffix."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import FlexuraError, OptionError
from flexura.files import TABLES, write_file, write_table
from flexura.io.formats import FORMATS, MeasuredFormat, formats
from flexura.mechanism import Mechanism
from flexura.structure import Plan
from flexura.testing.measurement import (
    FORCES,
    ChannelDescription,
    ChannelDescriptions,
    IdentifiedModes,
    MeasuredChannel,
    MeasuredFRF,
    Measurement,
    Recording,
    Repeated,
    checked,
    described_channels,
    read_channel_descriptions,
    read_columns,
    read_traces,
    refuse_implausible,
    with_description,
)

SIDECAR = ".channels.yaml"


def measured_formats() -> dict[str, MeasuredFormat]:
    """Formats of measured data by suffix."""
    known = [(own, own.measured) for own in formats().values()]
    return {
        suffix: measured
        for own, measured in known
        if measured is not None
        for suffix in (*own.suffixes, *measured.more_suffixes)
    }


@verb
def read_measurement(
    path: str | Path | Sequence[str | Path],
    channels: str | Path | Mechanism | Plan | None = None,
    *,
    setup: str | None = None,
    repeated: Repeated | None = None,
) -> Measurement:
    """Read measured data: universal files (58, 58b, 55), CSV, NumPy archives, HDF5, MATLAB, TDMS or WAV, as SI.

    `path`: a file, several that belong together, or a folder of them. Where channels are, and in which direction, comes
    from the file; from `channels`: a file of channels (YAML), or a mechanism with sensors, actuators or nodes of the
    same names; and else from `NAME.channels.yaml` or `channels.yaml` beside the data. `setup` names the placement of
    the sensors where the files do not. Responses between the same channels that a universal file gives more than once
    are refused, or with `repeated` averaged, or the first or the last of them is used; notes say which.

    Raises OptionError for files, units and sampling that cannot be used, and for channels of `channels` that are not
    there; ModelError for a file of channels that is no YAML.
    """
    checked(repeated)
    files = _files(path)
    parts = [_read(file, channels, repeated) for file in files]
    if setup is not None:
        parts = [_in_setup(part, setup) for part in parts]
    if len(parts) == 1:
        measurement = parts[0]
    else:
        modes = [p.modes for p in parts if p.modes is not None]
        if len(modes) > 1:
            raise OptionError("several of the files hold modes: read them one by one")
        measurement = Measurement(
            files[0].parent.name or files[0].stem,
            tuple(r for p in parts for r in p.recordings),
            tuple(f for p in parts for f in p.frfs),
            tuple(dict.fromkeys(n for p in parts for n in p.notes)),
            modes[0] if modes else None,
            tuple(dict.fromkeys(t for p in parts for t in p.traces)),
        )
    if isinstance(channels, str | Path):
        _refuse_missing(measurement, read_channel_descriptions(channels), str(channels))
    return measurement


def is_measured(path: Path) -> bool:
    """Whether a file is one of measured data by its suffix, or a folder."""
    return path.is_dir() or path.suffix.lower() in measured_formats()


def _files(path: str | Path | Sequence[str | Path]) -> list[Path]:
    listed = [Path(path)] if isinstance(path, str | Path) else [Path(p) for p in path]
    if not listed:
        raise OptionError("no files to read measured data from")
    files: list[Path] = []
    for file in listed:
        if file.is_dir():
            inside = sorted(f for f in file.iterdir() if f.suffix.lower() in measured_formats())
            if not inside:
                raise OptionError(f"{file}: no measured data in the folder; suffixes: {', '.join(measured_formats())}")
            files += inside
        elif not file.exists():
            raise OptionError(f"{file}: the file does not exist")
        else:
            files.append(file)
    return files


def _read(file: Path, channels: str | Path | Mechanism | Plan | None, repeated: Repeated | None) -> Measurement:
    if not isinstance(channels, str | Path | Mechanism | Plan | None):
        raise OptionError(f"channels is a file or a mechanism, not a {type(channels).__name__}")
    known = described_in(file, channels)
    descriptions: ChannelDescriptions = {} if known is None else read_channel_descriptions(known)
    columns = () if known is None else read_columns(known)
    scaled = [name for name, described in descriptions.items() if described.full_scale is not None]
    if scaled and file.suffix.lower() != ".wav":
        raise OptionError(f"{file}: {scaled[0]} has a full scale, and only the samples of WAV files are shares of one")
    read = _format_of(file, f"{file}: ").read
    if columns and "columns" not in signature(read).parameters:
        raise OptionError(f"{known}: columns are those of a table of text, and {file.name} is none")
    given = {"repeated": repeated, "columns": columns}
    options: dict[str, Any] = {name: value for name, value in given.items() if name in signature(read).parameters}
    try:
        with np.errstate(all="ignore"):
            measurement = _with_descriptions(read(file, descriptions, **options), descriptions)
            refuse_implausible(measurement, str(file))
            if known is not None:
                traces = (*measurement.traces, *read_traces(known, _channels(measurement)))
                measurement = replace(measurement, traces=traces)
    except FlexuraError:
        raise
    except Exception as error:  # what is wrong in a file from anywhere shows in any way
        raise OptionError(f"{file}: not as its format has it: {error or type(error).__name__}") from None
    if isinstance(channels, Mechanism | Plan):
        measurement = _with_descriptions(
            measurement, described_channels(channels, [c.name for c in _channels(measurement)])
        )
    return measurement


def described_in(data: Path, channels: object = None) -> Path | None:
    """The file that describes the channels of data: one that is named, else one beside it; None without any."""
    if isinstance(channels, str | Path):
        return Path(channels)
    sidecars = (data.with_name(data.stem + SIDECAR), data.with_name("channels.yaml"))
    return next((p for p in sidecars if p.is_file()), None) if channels is None else None


def _channels(measurement: Measurement) -> list[MeasuredChannel]:
    channels = [c for r in measurement.recordings for c in r.channels]
    channels += [c for f in measurement.frfs for c in (*f.inputs, *f.outputs)]
    channels += list(measurement.modes.outputs) if measurement.modes else []
    return list(dict.fromkeys(channels))


def _with_descriptions(measurement: Measurement, descriptions: ChannelDescriptions) -> Measurement:
    """Channels with what is described of them, checked for what they measure."""

    def of(channels: tuple[MeasuredChannel, ...]) -> tuple[MeasuredChannel, ...]:
        return tuple(
            with_description(_checked(c, descriptions.get(c.name)), descriptions.get(c.name)) for c in channels
        )

    def record(r: Recording) -> Recording:
        channels, samples = of(r.channels), r.samples * _sizes(r.channels, descriptions)[:, None]
        is_input = {k: descriptions[c.name].is_input for k, c in enumerate(channels) if c.name in descriptions}
        forces = {k for k, c in enumerate(channels) if c.quantity in FORCES and r.channels[k].quantity not in FORCES}
        known = forces | set(r.inputs)
        inputs = [k for k in range(len(channels)) if is_input.get(k) or (is_input.get(k) is None and k in known)]
        return replace(r, channels=channels, samples=samples, inputs=tuple(inputs))

    def response(f: MeasuredFRF) -> MeasuredFRF:
        sizes = _sizes(f.outputs, descriptions)[:, None] / _sizes(f.inputs, descriptions)
        sigma = None if f.sigma is None else f.sigma * np.abs(sizes)
        return replace(f, response=f.response * sizes, sigma=sigma, inputs=of(f.inputs), outputs=of(f.outputs))

    if not descriptions:
        return measurement
    modes: Any = measurement.modes
    return replace(
        measurement,
        recordings=tuple(record(r) for r in measurement.recordings),
        frfs=tuple(response(f) for f in measurement.frfs),
        modes=None if modes is None else replace(modes, outputs=of(modes.outputs)),
    )


def _sizes(channels: tuple[MeasuredChannel, ...], descriptions: ChannelDescriptions) -> Array:
    """What a unit of each channel stands for in that of its quantity: of volts of a sensor, by its sensitivity."""
    found = [descriptions.get(c.name, ChannelDescription()).sensitivity for c in channels]
    return np.array([1.0 if sensitivity is None else 1 / sensitivity[0] for sensitivity in found])


def _checked(channel: MeasuredChannel, described: ChannelDescription | None) -> MeasuredChannel:
    """A channel, of volts as what its sensor senses. Raises OptionError where it is not what is described."""
    is_other_end = described is not None and described.force is not None and channel.quantity in FORCES
    if described is not None and described.quantity not in (None, channel.quantity) and not is_other_end:
        raise OptionError(
            f"{channel.name} is {channel.quantity} in the data, and {described.quantity} where it is described"
        )
    if described is None or described.sensitivity is None:
        return channel
    if channel.quantity != "voltage":
        raise OptionError(f"{channel.name} is {channel.quantity} in the data: a sensitivity is for a voltage")
    return replace(channel, quantity=described.sensitivity[1])


def _in_setup(measurement: Measurement, setup: str) -> Measurement:
    recordings = tuple(r if r.setup else replace(r, setup=setup) for r in measurement.recordings)
    return replace(
        measurement,
        recordings=recordings,
        frfs=tuple(f if f.setup else replace(f, setup=setup) for f in measurement.frfs),
    )


def _refuse_missing(measurement: Measurement, descriptions: ChannelDescriptions, where: str) -> None:
    known = [c.name for c in _channels(measurement)]
    missing = [name for name in descriptions if name not in known]
    if missing:
        raise OptionError(f"{where}: channel {missing[0]!r} is not in the data; there: {', '.join(known)}")


@verb
def write_measurement(measurement: Measurement, path: str | Path, *, binary: bool | None = None) -> Path:
    """Write measured data in the format of the suffix, SI; the file appears complete or not at all.

    Universal files alone may be `binary` (58b), and are unless it is False. Only they hold modes; a CSV file holds one
    record or one set of responses, with names and units of its channels only. Raises OptionError for other suffixes and
    options, and when the file cannot be written.
    """
    write = _format_of(Path(path), writes=True).write
    if write is None or (binary is not None and "binary" not in signature(write).parameters):
        raise OptionError(f"{Path(path).suffix.lower()} has no option 'binary'")
    if not isinstance(measurement, Measurement):
        raise OptionError(f"a measurement is written, not a {type(measurement).__name__}")
    options = {} if binary is None else {"binary": binary}
    return write_file(path, lambda file: write(measurement, file, **options))


@verb
def write_modes(modes: IdentifiedModes, path: str | Path) -> Path:
    """Write identified modes: all of them as JSON, their table (CSV, Parquet), or frequencies and shapes (UFF).

    JSON is that of `flexura identify --json`. Universal files have datasets 55, which other programs read and
    `read_measurement`, too. The file appears complete or not at all. Raises OptionError for other suffixes, for shapes
    that a format does not hold, and when the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".json":
        text = json.dumps(modes.to_dict(), indent=2, allow_nan=False) + "\n"
        return write_file(path, lambda file: file.write_text(text, encoding="utf-8"))
    if suffix in TABLES:
        return write_table([modes.to_columns()], Path(path))
    if suffix not in FORMATS["uff"].suffixes:
        known = ", ".join((".json", *TABLES, *FORMATS["uff"].suffixes))
        raise OptionError(f"{suffix or 'no suffix'} is no format of identified modes; known: {known}")
    return write_measurement(Measurement(modes.name, (), (), modes.notes, modes, modes.traces), path)


def _format_of(path: Path, place: str = "", writes: bool = False) -> MeasuredFormat:
    """What reads and writes files of the suffix of a path. Raises OptionError, which begins with the place."""
    suffix = path.suffix.lower()
    measured = {own: known for own, known in measured_formats().items() if known.write is not None or not writes}
    if suffix not in measured:
        known = ", ".join(measured)
        raise OptionError(
            f"{place}{suffix or 'no suffix'} is no format of measured data{' to write' * writes}; known: {known}"
        )
    return measured[suffix]
