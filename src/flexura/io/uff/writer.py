"""Universal files of measurements: 58b or 58 with 2411, 82, 18, 151 and 164, and 55 for modes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError, need
from flexura.io.uff.datasets import TURNING
from flexura.io.uff.writing import (
    DATA_TYPES,
    GENERAL,
    axes_along,
    axes_sets,
    direction_code,
    headers,
    refuse_infinite,
    text_of,
)
from flexura.testing.measurement import MeasuredChannel, MeasuredFRF, Measurement, Recording

_AXIS = "{:10d}{:5d}{:5d}{:5d} {:<20} {:<20}"
_FORM = "{:10d}{:10d}{:10d}{:13.5e}{:13.5e}{:13.5e}"
_ENDS = "{:5d}{:10d}{:5d}{:10d} {:<10}{:10d}{:4d} {:<10}{:10d}{:4d}"
_BINARY = "{:6d}b{:6d}{:6d}{:12d}{:12d}{:6d}{:6d}{:12d}{:12d}"
_NO_AXIS = _AXIS.format(0, 0, 0, 0, "NONE", "NONE")
_END = "    -1"


def write_uff(measurement: Measurement, path: Path, binary: bool = True) -> None:
    """Write time records, frequency responses, coherences and modes, in SI and double precision.

    Functions are 58b, or ASCII 58 without `binary`: 12 digits. Positions have 17 digits, steps of time and frequency
    6 as the format has them, and all of theirs in ID line 5. A direction that is not along an axis is along x of axes
    of its own (18, 6 digits). Names beyond 10 characters stand in ID lines. Raises OptionError without pyuff, for
    numbers that are not finite, and for complex modes with rotations.
    """
    pyuff = need("pyuff", "experiment")
    numbers = _Numbers(measurement)
    pyuff.UFF(str(path)).write_sets(
        headers(measurement.name, "test data") + numbers.sets() + _modes(measurement, numbers), "overwrite"
    )
    with path.open("ab") as stream:
        for record in measurement.recordings:
            for k in range(len(record.channels)):
                stream.write(_time_record(record, k, numbers, measurement.name).encoded(binary))
        for frf in measurement.frfs:
            for function in _responses(frf, numbers, measurement.name):
                stream.write(function.encoded(binary))


_Place = tuple[str, tuple[float, ...] | None, tuple[float, ...] | None]
"""Node, or name of a channel without one; direction if oblique; position."""


class _Numbers:
    """Node numbers: a node's own where its name is a number, else in order.

    Oblique directions, and further positions at a node, have numbers of their own.
    """

    def __init__(self, measurement: Measurement) -> None:
        self.table: dict[_Place, int] = {}
        self.positions: dict[int, tuple[float, float, float]] = {}
        self.axes: dict[int, Array] = {}
        channels = [c for r in measurement.recordings for c in r.channels]
        channels += [c for f in measurement.frfs for c in (*f.inputs, *f.outputs)]
        channels += list(measurement.modes.outputs) if measurement.modes else []
        self._traces = measurement.traces
        used = {int(c.node) for c in channels if c.node is not None and c.node.isdigit()}
        given: set[int] = set()
        for channel in dict.fromkeys(channels):
            key = self._key(channel)
            if key not in self.table:
                number = int(channel.node) if channel.node is not None and channel.node.isdigit() else 0
                if key[1] is not None or not number or number in given:
                    number = max(used, default=0) + 1
                given.add(number)
                used.add(number)
                self.table[key] = number
            number = self.table[key]
            if channel.position is not None:
                self.positions.setdefault(number, channel.position)
            if key[1] is not None:
                self.axes[number] = axes_along(np.array(key[1]))
        self._by_place: dict[tuple[float, ...], int] = {at: number for number, at in self.positions.items()}
        for point in (point for trace in measurement.traces for point in trace):
            if point not in self._by_place:
                number = max(used, default=0) + 1
                used.add(number)
                self._by_place[point] = number
                self.positions[number] = point

    def _key(self, channel: MeasuredChannel) -> _Place:
        oblique = channel.direction is not None and np.count_nonzero(channel.direction) > 1
        return channel.node or channel.name, channel.direction if oblique else None, channel.location[1]

    def of(self, channel: MeasuredChannel) -> tuple[int, int]:
        """Node number and direction code."""
        key = self._key(channel)
        if channel.direction is None:
            return self.table[key], 0
        return self.table[key], direction_code(channel.direction, channel.quantity, key[1] is not None)

    def sets(self) -> list[dict[str, Any]]:
        """Datasets of axes and nodes."""
        datasets = axes_sets(self.axes)
        numbers = sorted(set(self.positions) | set(self.axes))
        if numbers:
            places = np.array([self.positions.get(n, (0.0, 0.0, 0.0)) for n in numbers])
            systems = [n if n in self.axes else 0 for n in numbers]
            nodes = {"type": 2411, "node_nums": numbers, "def_cs": [0] * len(numbers), "disp_cs": systems}
            datasets.append({**nodes, "color": [0] * len(numbers), **dict(zip("xyz", places.T, strict=True))})
        for k, trace in enumerate(self._traces, 1):
            nodes = np.array([self._by_place[point] for point in trace])
            datasets.append({"type": 82, "trace_num": k, "color": 0, "id": f"trace {k}", "nodes": nodes})
        return datasets


def _id_line(**values: Any) -> str:
    """ID line of `key=value`, those that are known."""
    return "; ".join(f"{k}={str(v).replace(';', ',')}" for k, v in values.items() if v not in ("", None)) or "NONE"


def _axis_record(channel: MeasuredChannel, code: int) -> str:
    """Record 9 or 10: data type, exponents, label and unit."""
    kind, length, force = DATA_TYPES.get(channel.quantity, GENERAL)
    if code == 0 and channel.quantity in TURNING.values():  # a scalar of that type is read as a motion along an axis
        kind = GENERAL[0]
    return _AXIS.format(kind, length, force, 0, channel.quantity[:20], channel.unit)


@dataclass(frozen=True)
class _Function:
    """A dataset 58: ID lines, record 6, record 8, records 9 and 10, and the values; abscissae `x` when uneven."""

    ids: tuple[str, ...]
    ends: str
    axes: tuple[str, ...]
    data: Any
    start: float
    step: float
    x: Array | None = None

    def encoded(self, binary: bool) -> bytes:
        """The dataset as 58b, or as ASCII. Raises OptionError for numbers that are not finite."""
        data = np.asarray(self.data)
        refuse_infinite(data)
        parts: list[Any] = [np.real(data), np.imag(data)] if np.iscomplexobj(data) else [data]
        even = self.x is None
        values = np.stack(parts if self.x is None else [self.x, *parts], axis=1)
        first, step = (self.start, self.step) if even else (0.0, 0.0)
        form = _FORM.format(6 if len(parts) == 2 else 4, len(data), int(even), first, step, 0.0)
        raw = values.astype("<f8").tobytes() if binary else _ascii(values, not even).encode()
        mark = _BINARY.format(58, 1, 2, 11, len(raw), 0, 0, 0, 0) if binary else f"{58:6d}{'':74}"
        ids = (f"{text_of(line):<80}" for line in self.ids)
        head = [_END, mark, *ids, self.ends, form, *self.axes, _NO_AXIS]
        return "\n".join(head).encode() + b"\n" + raw + f"{_END}\n".encode()


def _ascii(values: Array, uneven: bool) -> str:
    """Record 12 in double precision: 4E20.12, 2(E13.5,E20.12) or E13.5,2E20.12."""
    if not uneven:
        flat = [f"{v:20.11e}" for v in values.ravel()]
        rows = ["".join(flat[k : k + 4]) for k in range(0, len(flat), 4)]
    else:
        cells = [f"{row[0]:13.5e}" + "".join(f"{v:20.11e}" for v in row[1:]) for row in values]
        per_line = 1 if values.shape[1] == 3 else 2
        rows = ["".join(cells[k : k + per_line]) for k in range(0, len(cells), per_line)]
    return "\n".join(rows) + "\n"


def _entity(channel: MeasuredChannel) -> str:
    return text_of(channel.node or channel.name)[:10].strip()


def _time_record(record: Recording, k: int, numbers: _Numbers, name: str) -> _Function:
    channel = record.channels[k]
    node, code = numbers.of(channel)
    role = "input" if k in record.inputs else "output"
    where = _id_line(at=channel.node, record=record.name, setup=record.setup)
    return _Function(
        (name, f"response {channel}", "NONE", where, _id_line(role=role, rate=repr(float(record.sample_rate)))),
        _ENDS.format(1, 0, 0, 0, _entity(channel), node, code, "NONE", 0, 0),
        (_AXIS.format(17, 0, 0, 0, "time", "s"), _axis_record(channel, code), _NO_AXIS),
        record.samples[k],
        0.0,
        1 / record.sample_rate,
    )


def _responses(frf: MeasuredFRF, numbers: _Numbers, name: str) -> Iterator[_Function]:
    """Every response, followed by its coherence."""
    hz = np.asarray(frf.frequency_hz, dtype=float)
    if len(hz) < 2:
        raise OptionError("a frequency response in a universal file has at least two frequencies")
    step = float(hz[-1] - hz[0]) / (len(hz) - 1)
    first = round(float(hz[0]) / step)
    even = bool(np.allclose(step * (first + np.arange(len(hz))), hz, rtol=1e-12, atol=0))
    lines = {"k0": first, "df": repr(step)} if even else {}
    decay = f"{frf.decay:.12g}" if frf.decay else ""
    how = _id_line(by=frf.estimator, n=frf.averages, decay=decay, **lines)
    for i, out in enumerate(frf.outputs):
        for j, into in enumerate(frf.inputs):
            (node, code), (at, along) = numbers.of(out), numbers.of(into)
            where = _id_line(**{"at": out.node, "from": into.node, "setup": frf.setup})
            ids = (name, f"response {out}", f"reference {into}", where, how)
            ends = (0, 0, 0, _entity(out), node, code, _entity(into), at, along)
            axis = _AXIS.format(18, 0, 0, 0, "frequency", "Hz")
            axes = (axis, _axis_record(out, code), _axis_record(into, along))
            x = None if even else hz
            yield _Function(ids, _ENDS.format(4, *ends), axes, frf.response[:, i, j], float(hz[0]), step, x)
            if frf.coherence is not None:
                gamma = frf.coherence[:, i, j]
                yield _Function(ids, _ENDS.format(6, *ends), (axis, _NO_AXIS, _NO_AXIS), gamma, float(hz[0]), step, x)


def _modes(measurement: Measurement, numbers: _Numbers) -> list[dict[str, Any]]:
    """Datasets 55, complex modes as eigenvalues of first order, real shapes as normal modes."""
    modes = measurement.modes
    if modes is None:
        return []
    codes = [numbers.of(c) for c in modes.outputs]
    nodes = sorted({n for n, _ in codes})
    columns = 6 if any(abs(c) > 3 for _, c in codes) else 3
    is_real = not np.iscomplexobj(modes.shapes) or bool(np.all(modes.shapes.imag == 0))
    if columns == 6 and not is_real:
        raise OptionError("complex modes with rotations cannot be written to a universal file")
    if any(c == 0 for _, c in codes):
        raise OptionError("modes can be written to a universal file when the direction of every channel is known")
    datasets = []
    for k, pole in enumerate(modes.poles):
        shape = np.zeros((columns, len(nodes)), dtype=float if is_real else complex)
        for (node, code), value in zip(codes, modes.shapes[:, k], strict=True):
            shape[abs(code) - 1, nodes.index(node)] = np.sign(code) * (value.real if is_real else value)
        common = {"type": 55, "model_type": 1, "data_ch": 3 if columns == 6 else 2, "spec_data_type": 8, "load_case": 0}
        ratio, hz = float(-pole.real / abs(pole)), float(abs(pole) / (2 * np.pi))
        kind = {"analysis_type": 2, "freq": hz, "modal_m": 0.0, "modal_damp_vis": ratio, "modal_damp_his": 0.0}
        if not is_real:
            kind = {"analysis_type": 3, "eig": complex(pole)}
        rows = {f"r{i + 1}": row for i, row in enumerate(shape)}
        ids = {"id1": text_of(modes.name), "id2": f"mode {k + 1}, {hz:.6g} Hz, damping ratio {ratio:.4g}"}
        datasets.append({**common, **kind, **ids, "mode_n": k + 1, "node_nums": nodes, **rows})
    return datasets
