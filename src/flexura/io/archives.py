"""Measurements as NumPy archives and HDF5 files, with the same names in both."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flexura._version import __version__
from flexura.arrays import Array
from flexura.errors import OptionError, need
from flexura.files import read_arrays
from flexura.io.hdf5 import read_datasets
from flexura.testing.measurement import (
    ChannelDescription,
    ChannelDescriptions,
    MeasuredChannel,
    MeasuredFRF,
    Measurement,
    Recording,
    quantity_of,
    split_heading,
)

Arrays = dict[str, Any]


def read_npz(path: Path, descriptions: ChannelDescriptions) -> Measurement:
    """Read a NumPy archive; see docs/testing.md for the names of its arrays. Raises OptionError."""
    return measurement_of(path, read_arrays(path), descriptions)


def read_hdf5(path: Path, descriptions: ChannelDescriptions) -> Measurement:
    """Read an HDF5 file with the same names, groups for the dots. Raises OptionError, also without h5py."""
    return measurement_of(path, read_datasets(path), descriptions)


def measurement_of(path: Path, arrays: Mapping[str, Any], descriptions: ChannelDescriptions) -> Measurement:
    """The measurement of arrays whose names begin with `recordingN.` or `frfN.`, or stand alone for a single one."""
    groups: dict[str, Arrays] = {}
    for name, value in arrays.items():
        lead, dot, rest = name.partition(".")
        is_grouped = dot and lead.rstrip("0123456789") in ("recording", "frf")
        groups.setdefault(lead if is_grouped else "", {})[rest if is_grouped else name] = value
    bare = groups.pop("", {})
    if "samples" in bare or "response" in bare:
        groups["single"] = bare
    recordings, frfs = [], []
    for label in sorted(groups, key=lambda g: (len(g), g)):
        arrays_of, where = groups[label], f"{path}: {label}" if label != "single" else str(path)
        if "response" in arrays_of:
            frfs.append(_frf(arrays_of, where, descriptions))
        else:
            recordings += _recordings(arrays_of, where, descriptions)
    if not recordings and not frfs:
        raise OptionError(f"{path}: neither `samples` of a time record nor a `response` is in the file")
    notes = tuple(str(n) for n in np.atleast_1d(bare.get("notes", np.array([], dtype=str))))
    return Measurement(_text(bare, "name") or path.stem, tuple(recordings), tuple(frfs), notes)


def _get(arrays: Arrays, name: str, where: str) -> Any:
    if name not in arrays:
        raise OptionError(f"{where}: there is no array {name!r}; found {', '.join(sorted(arrays))}")
    return arrays[name]


def _text(arrays: Arrays, name: str) -> str:
    value = arrays.get(name)
    return "" if value is None else value.decode() if isinstance(value, bytes) else str(np.asarray(value)[()])


def _channels(
    arrays: Arrays, prefix: str, where: str, descriptions: ChannelDescriptions
) -> tuple[tuple[MeasuredChannel, ...], Array]:
    """Channels from `channels`, texts `name [unit]`, with `quantities`, `nodes`, `directions` and `positions`."""
    texts = [str(t) for t in np.atleast_1d(_get(arrays, f"{prefix}channels", where))]
    channels, factors = [], []

    def entry(name: str, k: int) -> Any:
        values = arrays.get(f"{prefix}{name}")
        return None if values is None or len(values) != len(texts) else values[k]

    for k, text in enumerate(texts):
        name, unit = split_heading(text, where)
        described = descriptions.get(name, ChannelDescription())
        quantity, factor = quantity_of(
            described.unit or unit,
            described.quantity or (str(entry("quantities", k) or "") or None),
            f"{where}: {name}",
        )
        channel = MeasuredChannel(
            name,
            quantity,
            str(entry("nodes", k) or "") or None,
            _vector(entry("directions", k), f"{where}: {name}", True),
            _vector(entry("positions", k), f"{where}: {name}", False),
        )
        channels.append(channel)
        factors.append(factor)
    return tuple(channels), np.array(factors)


def _vector(value: Any, where: str, unit: bool) -> tuple[float, float, float] | None:
    if value is None or not np.all(np.isfinite(value)):
        return None
    v = np.asarray(value, dtype=float)
    if v.shape != (3,) or (unit and not np.linalg.norm(v) > 0):
        raise OptionError(f"{where}: a direction or position is three numbers")
    if unit and abs(np.linalg.norm(v) - 1) > 1e-12:
        v = v / np.linalg.norm(v)
    x, y, z = (float(c) for c in v)
    return x, y, z


def _recordings(arrays: Arrays, where: str, descriptions: ChannelDescriptions) -> Iterator[Recording]:
    """Records of `samples` (c, N), or (n, c, N) of n hits."""
    samples = np.asarray(_get(arrays, "samples", where), dtype=float)
    channels, factors = _channels(arrays, "", where, descriptions)
    if samples.ndim not in (2, 3) or samples.shape[-2] != len(channels):
        raise OptionError(f"{where}: samples of shape {samples.shape} are not those of {len(channels)} channels")
    if "sample_rate" in arrays:
        rate = float(arrays["sample_rate"])
    else:
        time = np.asarray(_get(arrays, "time", where), dtype=float)
        if len(time) != samples.shape[-1]:
            raise OptionError(f"{where}: {len(time)} times are not those of {samples.shape[-1]} samples")
        rate = rate_of(time, where)
    if not (np.isfinite(rate) and rate > 0):
        raise OptionError(f"{where}: the sample rate is {rate:g} Hz")
    given = arrays.get("inputs")
    chosen = [k for k, c in enumerate(channels) if c.quantity in ("force", "moment")] if given is None else given
    inputs = tuple(int(k) for k in np.atleast_1d(chosen))
    if any(not 0 <= k < len(channels) for k in inputs):
        raise OptionError(f"{where}: inputs {inputs} are not positions of its {len(channels)} channels")
    hits = samples[None] if samples.ndim == 2 else samples
    title = _text(arrays, "name")
    for k, hit in enumerate(hits):
        name = title if len(hits) == 1 else f"{title or 'hit'} {k + 1}"
        yield Recording(rate, hit * factors[:, None], channels, inputs, _text(arrays, "setup"), name)


def rate_of(time: Array, where: str) -> float:
    """Sample rate, Hz, of times (N,), s. Raises OptionError where they are not evenly spaced."""
    steps = np.diff(time)
    if len(steps) < 1 or not (np.isfinite(steps).all() and np.ptp(steps) <= 1e-3 * abs(steps.mean())):
        raise OptionError(f"{where}: time is not evenly spaced: resample the record")
    return 1 / float(steps.mean())


def _frf(arrays: Arrays, where: str, descriptions: ChannelDescriptions) -> MeasuredFRF:
    hz = np.atleast_1d(np.asarray(_get(arrays, "frequency_hz", where), dtype=float))
    H = np.asarray(_get(arrays, "response", where), dtype=complex)
    inputs, below = _channels(arrays, "input_", where, descriptions)
    outputs, above = _channels(arrays, "output_", where, descriptions)
    if H.shape != (len(hz), len(outputs), len(inputs)):
        raise OptionError(
            f"{where}: a response of shape {H.shape} is not that of {len(hz)} frequencies, {len(outputs)} outputs and "
            f"{len(inputs)} inputs"
        )
    if np.any(np.diff(hz) <= 0) or not np.isfinite(H).all():
        raise OptionError(f"{where}: frequencies increase and responses are finite numbers; these are not")
    shares = [
        None if (g := arrays.get(f"{kind}coherence")) is None else np.asarray(g, float) for kind in ("", "partial_")
    ]
    averages = arrays.get("averages")
    response: Any = H * (above[:, None] / below)
    return MeasuredFRF(
        hz,
        response,
        inputs,
        outputs,
        shares[0],
        None if averages is None else int(averages),
        _text(arrays, "estimator"),
        float(arrays.get("decay", 0.0)),
        _text(arrays, "setup"),
        tuple(str(n) for n in np.atleast_1d(arrays.get("notes", np.array([], dtype=str)))),
        shares[1],
        None if (sigma := arrays.get("sigma")) is None else np.asarray(sigma, float) * (above[:, None] / below),
    )


def _described(channels: tuple[MeasuredChannel, ...], prefix: str) -> Arrays:
    nothing = (np.nan,) * 3
    return {
        f"{prefix}channels": np.array([str(c) for c in channels]),
        f"{prefix}quantities": np.array([c.quantity for c in channels]),
        f"{prefix}nodes": np.array([c.node or "" for c in channels]),
        f"{prefix}directions": np.array([nothing if c.direction is None else c.direction for c in channels]).reshape(
            -1, 3
        ),
        f"{prefix}positions": np.array([nothing if c.position is None else c.position for c in channels]).reshape(
            -1, 3
        ),
    }


def contents(measurement: Measurement) -> Arrays:
    """All arrays of a measurement by name, SI. Raises OptionError for modes, which these files do not hold."""
    if measurement.modes is not None:
        raise OptionError("identified modes are written to universal files")
    arrays: Arrays = {"flexura": np.array(__version__), "name": np.array(measurement.name)}
    arrays["notes"] = np.array(measurement.notes, dtype=str)
    for k, r in enumerate(measurement.recordings):
        group: Arrays = {
            "sample_rate": np.array(float(r.sample_rate)),
            "samples": r.samples,
            "inputs": np.array(r.inputs),
        }
        group |= {"setup": np.array(r.setup), "name": np.array(r.name), **_described(r.channels, "")}
        arrays |= {f"recording{k}.{name}": value for name, value in group.items()}
    for k, f in enumerate(measurement.frfs):
        group = {"frequency_hz": f.frequency_hz, "response": f.response, "decay": np.array(float(f.decay))}
        group |= {"setup": np.array(f.setup), "estimator": np.array(f.estimator), "notes": np.array(f.notes, dtype=str)}
        group |= {} if f.coherence is None else {"coherence": f.coherence}
        group |= {} if f.partial_coherence is None else {"partial_coherence": f.partial_coherence}
        group |= {} if f.sigma is None else {"sigma": f.sigma}
        group |= {} if f.averages is None else {"averages": np.array(f.averages)}
        group |= _described(f.inputs, "input_") | _described(f.outputs, "output_")
        arrays |= {f"frf{k}.{name}": value for name, value in group.items()}
    return arrays


def write_measured_npz(measurement: Measurement, path: Path) -> None:
    """Write a NumPy archive, which needs no pickling to be read."""
    with path.open("wb") as stream:
        np.savez_compressed(stream, **contents(measurement))


def write_measured_hdf5(measurement: Measurement, path: Path) -> None:
    """Write an HDF5 file. Raises OptionError without h5py."""
    h5py = need("h5py", "experiment")
    with h5py.File(path, "w") as root:
        for name, value in contents(measurement).items():
            at = name.replace(".", "/")
            if np.asarray(value).dtype.kind == "U":
                root.create_dataset(at, np.shape(value), h5py.string_dtype(), np.asarray(value).astype(object))
            else:
                root[at] = value
