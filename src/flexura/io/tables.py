"""Time records and frequency responses as CSV: one table per file, with a unit in every heading."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flexura.arrays import Array, Complex
from flexura.errors import ExpressionError, OptionError
from flexura.files import read_bytes, read_text
from flexura.tables import counted, quantity
from flexura.testing.measurement import (
    FORCES,
    ChannelDescription,
    ChannelDescriptions,
    MeasuredChannel,
    MeasuredFRF,
    Measurement,
    Recording,
    frequency_factor,
    quantity_of,
    split_heading,
)
from flexura.units import is_number, parse_unit

UNEVEN = 1e-3
"""Largest difference of steps of time, of their mean, in an evenly sampled record: times may be rounded."""

_LISTED = {"mode", "frequency", "hz", "unit", "sigma"}
"""Headings of a list of frequencies."""

_A_FREQUENCY = re.compile(r"[\d.]+(e[+-]?\d+)?\s*(k?hz|rad/s|rpm)?")

_PARTS = ("real", "imag", "magnitude", "phase", "coherence", "sigma")

TIMES, FREQUENCIES = ("time", "t"), ("frequency", "f")
"""Names of first columns, in small letters."""

_HEADED = re.compile(rf"\ufeff?\s*\"?({'|'.join((*TIMES, *FREQUENCIES))})\s*\[", re.IGNORECASE)


def read_csv(path: Path, descriptions: ChannelDescriptions, columns: Sequence[str] = ()) -> Measurement:
    """Read `time [s], NAME [UNIT], ...` as a record, or `frequency [Hz], OUT / IN [UNIT] real, ... imag` as responses.

    Responses may be `magnitude` and `[deg] phase`, too. Columns are separated by commas, semicolons or tabs, or, where
    `columns` gives the headings, by spaces; `-` leaves a column out. Numbers may have decimal commas where these do not
    separate. What stands above the table is left out, with a note; lines `# setup: NAME` and `# decay: RATE` (1/s)
    there are read. Forces are inputs where `descriptions` say nothing else. Raises OptionError, with the line, for
    anything else, empty cells, numbers that are not finite and uneven times.
    """
    text, notes = _text(path)
    remarks = dict(re.findall(r"^#\s*(\w+)\s*:\s*(.*?)\s*$", text, flags=re.MULTILINE))
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    table = _named(path, lines, columns) if columns else _headed(path, lines)
    headings, place = table.headings, f"{path}:{table.line}"
    values = _numbers(path, headings, table.rows)
    first, unit = split_heading(headings[0], place)
    if len(set(headings)) < len(headings) or len(headings) < 2:
        raise OptionError(f"{place}: every column has a heading of its own, at least one beside {first}")
    if first.lower() in TIMES:
        time, numbers = _seconds(unit, path) * values[:, 0], [n for n, _ in table.rows]
        read = _record(path, headings[1:], time, values[:, 1:], numbers, descriptions, remarks.get("setup", ""))
    elif first.lower() in FREQUENCIES:
        hz = frequency_factor(unit, f"{path}: {headings[0]}") * values[:, 0]
        read = _responses(path, headings[1:], hz, values[:, 1:], descriptions, remarks)
    else:
        raise OptionError(f"{place}: the first column is time [s] or frequency [Hz], not {headings[0]}")
    return replace(read, notes=(*notes, *table.notes))


@dataclass(frozen=True)
class _Table:
    """The cells of a table: its headings, in this line, and its rows with their lines."""

    line: int
    headings: list[str]
    rows: list[tuple[int, list[str]]]
    notes: tuple[str, ...]


def _text(path: Path) -> tuple[str, tuple[str, ...]]:
    """Text in UTF-8, UTF-16 with its mark, or else as Windows has it, which a note says."""
    if read_bytes(path)[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return read_text(path, encoding="utf-16"), ()
    try:
        return read_text(path), ()
    except OptionError:
        return read_text(path, encoding="cp1252"), (f"{path.name} is no UTF-8: read as Windows-1252",)


def _headed(path: Path, lines: Sequence[tuple[int, str]]) -> _Table:
    """The table below the first line that begins with a time or a frequency, or else with the first line."""
    _refuse_frequencies(path, lines[0][1] if lines else "")
    at = next((k for k, (_, line) in enumerate(lines) if _HEADED.match(line)), 0)
    if len(lines) - at < 3:
        raise OptionError(f"{path}: a header and at least two rows are expected")
    separator = max(",;\t", key=lines[at][1].count)
    rows = [(n, next(csv.reader([line], delimiter=separator))) for n, line in lines[at:]]
    found, notes = _with_points(rows[1:], separator)
    return _Table(rows[0][0], [cell.strip() for cell in rows[0][1]], found, (*_above(path, at), *notes))


def _named(path: Path, lines: Sequence[tuple[int, str]], columns: Sequence[str]) -> _Table:
    """The table from the first line of as many numbers on as there are `columns`, without those called `-`."""
    for at, (line, text) in enumerate(lines):
        for separator in (";", "\t", ",", None):
            cells = _split(text, separator)
            if len(cells) == len(columns) and all(is_number(c if separator == "," else _point(c)) for c in cells):
                kept = [k for k, name in enumerate(columns) if name != "-"]
                rows = [(n, _split(row, separator)) for n, row in lines[at:]]
                wrong = next(((n, len(own)) for n, own in rows if len(own) != len(columns)), None)
                if wrong is not None:
                    raise OptionError(f"{path}:{wrong[0]}: {len(columns)} columns are named, here are {wrong[1]}")
                found, notes = _with_points([(n, [own[k] for k in kept]) for n, own in rows], separator)
                return _Table(line, [columns[k] for k in kept], found, (*_above(path, at), *notes))
    raise OptionError(f"{path}: no line is {len(columns)} numbers, one for each of `columns`")


def _split(line: str, separator: str | None) -> list[str]:
    """The cells of a line, without an empty one behind the last separator."""
    cells = line.split() if separator is None else next(csv.reader([line], delimiter=separator))
    return cells[:-1] if len(cells) > 1 and not cells[-1].strip() else cells


def _point(cell: str) -> str:
    return cell.strip().replace(",", ".", 1)


def _with_points(
    rows: Sequence[tuple[int, list[str]]], separator: str | None
) -> tuple[list[tuple[int, list[str]]], tuple[str, ...]]:
    """Numbers with decimal points, where a table has commas in them and no point in any."""
    cells = [cell for _, own in rows for cell in own]
    if separator == "," or not any("," in cell for cell in cells) or any("." in cell for cell in cells):
        return list(rows), ()
    return [(n, [_point(cell) for cell in own]) for n, own in rows], ("commas in numbers are read as decimal signs",)


def _above(path: Path, count: int) -> tuple[str, ...]:
    return (f"{path.name}: {counted(count, 'line')} above the table left out",) if count else ()


def _refuse_frequencies(path: Path, header: str) -> None:
    """Raise OptionError for a list of frequencies, which begins with its headings or with the first of them."""
    words = [cell.partition("[")[0].strip().lower() for cell in re.split("[,;\t]", header)]
    if words != [""] and (set(words) <= _LISTED or (len(words) == 1 and _A_FREQUENCY.fullmatch(words[0]))):
        raise OptionError(
            f"{path} lists frequencies, and signals are expected: `time [s], NAME [UNIT], ...` or `frequency [Hz],"
            " OUT / IN [UNIT] real, OUT / IN [UNIT] imag`; calibrate and virtual-test take lists of frequencies"
        )


def _numbers(path: Path, headings: list[str], rows: Sequence[tuple[int, list[str]]]) -> Array:
    for n, cells in rows:
        if len(cells) != len(headings):
            raise OptionError(f"{path}:{n}: {len(headings)} columns are expected, here are {len(cells)}")
    try:
        values = np.array([cells for _, cells in rows]).astype(float)
        bad = np.argwhere(~np.isfinite(values))
    except ValueError:
        bad = np.array([(i, j) for i, (_, cells) in enumerate(rows) for j, c in enumerate(cells) if not is_number(c)])
    if len(bad):
        i, j = (int(k) for k in bad[0])
        raise OptionError(
            f"{path}:{rows[i][0]}: {headings[j]}: {rows[i][1][j].strip() or 'nothing'!r} is no finite number"
        )
    return values


def _seconds(unit: str, path: Path) -> float:
    try:
        factor, exponents = parse_unit(unit)
    except ExpressionError as error:
        raise OptionError(f"{path}: {error}") from None
    if exponents != parse_unit("s")[1]:
        raise OptionError(f"{path}: the first column is in s, not in {unit}")
    return float(factor)


def _channel(
    path: Path, name: str, unit: str, descriptions: ChannelDescriptions, is_reference: bool = False
) -> tuple[MeasuredChannel, float]:
    """A channel and its factor to SI; the reference of a driving point has the name of its response, not its unit."""
    described = descriptions.get(name, ChannelDescription())
    is_other_end = is_reference and described.force is not None
    known = (described.force, None) if is_other_end else (described.unit, described.quantity)
    quantity, factor = quantity_of(known[0] or unit, known[1], f"{path}: {name}")
    return MeasuredChannel(name, quantity), factor


def _record(
    path: Path,
    headings: list[str],
    time: Array,
    values: Array,
    lines: list[int],
    descriptions: ChannelDescriptions,
    setup: str,
) -> Measurement:
    steps = np.diff(time)
    step = float(steps.mean())
    if step <= 0:
        raise OptionError(f"{path}: time does not increase")
    # times are often written with few digits: judge against the straight line, and steps against gaps
    drift = np.abs(time - time[0] - step * np.arange(len(time)))
    if (
        np.any(steps <= 0.5 * step)
        or np.any(steps >= 1.5 * step)
        or drift.max() > max(UNEVEN * step * len(time), 0.5 * step)
    ):
        at = int(np.argmax(np.abs(steps - np.median(steps))))
        raise OptionError(
            f"{path}:{lines[at + 1]}: sampling is not even: a step of {quantity(steps[at], 's', 4)} among steps of "
            f"{quantity(np.median(steps), 's', 4)}: resample the record"
        )
    named = [split_heading(heading, str(path)) for heading in headings]
    missing = [name for name, described in descriptions.items() if described.is_input and name not in dict(named)]
    if missing:
        raise OptionError(f"{path}: there is no column {missing[0]!r}; columns: {', '.join(n for n, _ in named)}")
    channels, factors = zip(*(_channel(path, name, unit, descriptions) for name, unit in named), strict=True)
    inputs = tuple(k for k, c in enumerate(channels) if c.quantity in FORCES)
    rate = float(f"{1 / step:.6g}") if abs(float(f"{1 / step:.6g}") * step - 1) < 1e-6 else 1 / step
    samples = (values * np.array(factors)).T
    return Measurement(path.stem, (Recording(rate, samples, tuple(channels), inputs, setup, path.stem),))


def _responses(
    path: Path,
    headings: list[str],
    hz: Array,
    values: Array,
    descriptions: ChannelDescriptions,
    remarks: dict[str, str],
) -> Measurement:
    if np.any(np.diff(hz) <= 0):
        raise OptionError(f"{path}: frequencies do not increase")
    columns: dict[tuple[str, str], dict[str, tuple[str, Array]]] = {}
    for heading, column in zip(headings, values.T, strict=True):
        match = re.fullmatch(rf"(.+?) / (.+?)\s*(?:\[(.+)\])?\s+({'|'.join(_PARTS)})", heading)
        if match is None:
            raise OptionError(
                f"{path}: {heading!r}: a column is headed `OUT / IN [UNIT] real`, imag, magnitude or sigma, `OUT / IN"
                " [deg] phase` or `OUT / IN coherence`"
            )
        columns.setdefault((match[1], match[2]), {})[match[4]] = match[3] or "", column
    outs, ins = (list(dict.fromkeys(pair[k] for pair in columns)) for k in (0, 1))
    lacking = [
        f"{o} / {i} {part}"
        for o in outs
        for i in ins
        for part in (_PARTS[2:4] if _PARTS[2] in columns.get((o, i), {}) else _PARTS[:2])
        if part not in columns.get((o, i), {})
    ]
    if lacking:
        raise OptionError(f"{path}: there is no column {lacking[0]}")
    above_of: dict[str, tuple[MeasuredChannel, float]] = {}
    below_of: dict[str, tuple[MeasuredChannel, float]] = {}
    for (out, into), parts in columns.items():
        above, below = _units_of(parts.get("real", parts.get("magnitude", ("",)))[0], f"{path}: {out} / {into}")
        above_of.setdefault(out, _channel(path, out, above, descriptions))
        below_of.setdefault(into, _channel(path, into, below, descriptions, is_reference=True))
    H = np.empty((len(hz), len(outs), len(ins)), dtype=complex)
    beside = {name: np.empty(H.shape) for name in _PARTS[4:] if all(name in parts for parts in columns.values())}
    for (out, into), parts in columns.items():
        at = (slice(None), outs.index(out), ins.index(into))
        size = above_of[out][1] / below_of[into][1]
        H[at] = _complex(parts, f"{path}: {out} / {into}") * size
        for name, kept in beside.items():
            kept[at] = parts[name][1] * (size if name == "sigma" else 1.0)
    inputs, outputs = tuple(below_of[n][0] for n in ins), tuple(above_of[n][0] for n in outs)
    averages = int(remarks["averages"]) if remarks.get("averages", "").isdigit() else None
    try:
        decay = float(remarks.get("decay", 0.0))
    except ValueError:
        raise OptionError(f"{path}: decay is a rate in 1/s, not {remarks['decay']!r}") from None
    frf = MeasuredFRF(
        *(hz, H, inputs, outputs, beside.get("coherence"), averages, remarks.get("estimator", "")),
        *(decay, remarks.get("setup", "")),
        sigma=beside.get("sigma"),
    )
    return Measurement(path.stem, frfs=(frf,))


def _complex(parts: dict[str, tuple[str, Array]], what: str) -> Complex:
    """The complex values of two columns. Raises OptionError for a phase that is in no unit of an angle."""
    if "real" in parts:
        return np.asarray(parts["real"][1] + 1j * parts["imag"][1], dtype=np.complex128)
    unit, phase = parts["phase"]
    if unit not in ("deg", "rad"):
        raise OptionError(f"{what}: a phase is in deg or rad, written as `[deg] phase`, not {unit or 'without a unit'}")
    angle = np.deg2rad(phase) if unit == "deg" else phase
    return np.asarray(parts["magnitude"][1] * np.exp(1j * angle), dtype=np.complex128)


def _units_of(text: str, what: str) -> tuple[str, str]:
    """Units of output and input in `(m/s^2)/N`, `m/N` or `m/s^2/N`."""
    above, slash, below = text.rpartition("/")
    if not slash:
        raise OptionError(f"{what}: a response has a unit such as (m/s^2)/N, not {text!r}")
    return above.strip().removeprefix("(").removesuffix(")"), below.strip().removeprefix("(").removesuffix(")")


def write_csv(measurement: Measurement, path: Path) -> None:
    """Write the one record, or the one set of frequency responses, of a measurement.

    Raises OptionError for more, which the other formats hold.
    """
    if len(measurement.recordings) + len(measurement.frfs) != 1:
        raise OptionError("a CSV file holds one time record or one set of responses: write npz, HDF5 or UFF")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    if measurement.recordings:
        record = measurement.recordings[0]
        text.write(f"# setup: {record.setup}\n" if record.setup else "")
        writer.writerow(["time [s]", *map(str, record.channels)])
        time = np.arange(record.samples.shape[1]) / record.sample_rate
        writer.writerows(np.vstack([time, record.samples]).T.tolist())
    else:
        frf = measurement.frfs[0]
        for key in ("setup", "decay", "estimator", "averages"):
            text.write(f"# {key}: {getattr(frf, key)}\n" if getattr(frf, key) else "")
        headings, columns = ["frequency [Hz]"], [np.asarray(frf.frequency_hz, dtype=float)]
        for i, out in enumerate(frf.outputs):
            for j, into in enumerate(frf.inputs):
                pair = f"{out.name} / {into.name}"
                headings += [f"{pair} [({out.unit})/({into.unit})] {part}" for part in _PARTS[:2]]
                columns += [frf.response[:, i, j].real, frf.response[:, i, j].imag]
                if frf.coherence is not None:
                    headings.append(f"{pair} coherence")
                    columns.append(frf.coherence[:, i, j])
                if frf.sigma is not None:
                    headings.append(f"{pair} [({out.unit})/({into.unit})] sigma")
                    columns.append(frf.sigma[:, i, j])
        writer.writerow(headings)
        writer.writerows(np.stack(columns, axis=1).tolist())
    path.write_text(text.getvalue(), encoding="utf-8")
