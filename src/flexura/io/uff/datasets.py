"""Reading universal files: functions (58, 58b), modes (55), nodes (15, 2411), traces (82), axes (18, 2420), units."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import ExpressionError, OptionError, need
from flexura.files import read_bytes, scratch_folder
from flexura.sizes import within
from flexura.testing.measurement import (
    ChannelDescriptions,
    MeasuredChannel,
    Trace,
    dimension,
    frequency_factor,
    quantity_of,
    split_response,
)
from flexura.units import parse_unit

MOTIONS = {8: "displacement", 11: "velocity", 12: "acceleration"}
FORCES = (9, 13)
TURNING = {
    "displacement": "rotation",
    "velocity": "angular_velocity",
    "acceleration": "angular_acceleration",
    "force": "moment",
}
AXIS_NAMES = ("tx", "ty", "tz", "rx", "ry", "rz")
_LENGTHS: dict[str, int] = dict.fromkeys(("displacement", "velocity", "acceleration", "moment"), 1)
_FORCES = {"force": 1, "moment": 1}
TIME_AXIS, FREQUENCY_AXIS = 17, 18
NOTHING = ("", "NONE", "NULL")

_NUMBERS = re.compile(rb"^[ \t\d.+\-EeDd]*\d[Dd][+-]?\d[ \t\d.+\-EeDd]*\r?$", re.MULTILINE)
_EXPONENT = re.compile(rb"(?<=\d)[Dd](?=[+-]?\d)|(?<=\d\.)[Dd](?=[+-]?\d)")
_HEAD = re.compile(rb"^ *-1 *\r?\n +58b?\b[^\n]*\n(?:[^\n]*\n){5}([^\n]*)\n", re.MULTILINE)
_ENDS = re.compile(r".{30} *(\S.*?)\s+(-?\d+)\s+(-?\d+)\s+(\S.*?)\s+(-?\d+)\s+(-?\d+)\s*")
_COLUMNS = 80


@dataclass(frozen=True)
class NodeFrames:
    """Positions, m, and axes (3, 3), rows, of nodes by number, and factors of length and force to SI."""

    positions: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    axes: dict[int, Array] = field(default_factory=dict)
    length: float | None = None
    force: float | None = None


def read_sets(path: Path) -> list[dict[str, Any]]:
    """All datasets of a universal file, as pyuff reads them. Raises OptionError when it cannot."""
    pyuff = need("pyuff", "experiment")
    content = read_bytes(path)
    if not re.match(rb"\s*-1\s*[\r\n]", content[:400]):
        raise OptionError(f"{path}: not a universal file: its first line is not -1")
    _refuse_counts(path, content)
    with _readable(path, content) as text:
        sets = _parsed(pyuff, text, path)
    if not sets:
        raise OptionError(f"{path}: no datasets in the file")
    _restore_names(sets, content, path)
    return sets


def _parsed(pyuff: Any, text: Path, path: Path) -> list[dict[str, Any]]:
    """The datasets of a text, which stands for that of the path."""
    sets: list[dict[str, Any]] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            file = pyuff.UFF(str(text))
            count = int(file.get_n_sets())
        except Exception as error:  # the package raises nothing more particular
            raise OptionError(f"{path}: not a universal file: {error}") from None
        kinds = [int(t) for t in file.get_set_types()] if count else []
        for k, kind in enumerate(kinds):
            try:
                sets.append(file.read_sets(k) if kind in _KNOWN else {"type": kind})
            except Exception:
                raise OptionError(
                    f"{path}: dataset {k + 1} of {count}, type {kind}, cannot be read: is the file complete? "
                    "a 58b whose end mark stands on a line of its own can be mended by pyuff.fix_58b"
                ) from None
    return sets


_FUNCTION = re.compile(rb"^    -1[ \t]*\r?\n {4}58.*\n(?:.*\n){6} *\d+ +(\d+)", re.MULTILINE)
"""Up to the number of points of a function, in its record 7."""


def _refuse_counts(path: Path, content: bytes) -> None:
    """Refuse datasets and points beyond the limits of size, and points that the file cannot hold."""
    within("arrays", content.count(b"    -1") / 2, str(path))
    for match in _FUNCTION.finditer(content):
        count = int(match[1][:18])
        if count > len(content):
            line = content.count(b"\n", 0, match.end()) + 1
            raise OptionError(f"{path}:{line}: {count} points, in a file of {len(content)} bytes: is it complete?")


@contextmanager
def _readable(path: Path, content: bytes) -> Iterator[Path]:
    """The path itself, or of a file in ASCII with exponents such as 1.0D+01 one of a copy that has E in their place."""
    if b"58b" in content or not _NUMBERS.search(content):
        yield path
        return
    with scratch_folder() as folder:
        copy = folder / path.name
        copy.write_bytes(_NUMBERS.sub(lambda line: _EXPONENT.sub(b"E", line[0]), content))
        yield copy


def _restore_names(sets: list[dict[str, Any]], content: bytes, path: Path) -> None:
    """Put right the ends of datasets 58 whose names of more than ten letters have moved what stands behind them.

    Raises OptionError for a line of ends that is too long in any other way.
    """
    lines = [match[1].decode("utf-8", "replace").rstrip() for match in _HEAD.finditer(content)]
    functions = [(k, s) for k, s in enumerate(sets) if s["type"] == 58]
    if len(lines) != len(functions):
        return
    for line, (k, s) in zip(lines, functions, strict=True):
        if len(line) <= _COLUMNS:
            continue
        ends = _ENDS.fullmatch(line)
        if ends is None:
            raise OptionError(
                f"{path}: dataset {k + 1}: its response and reference are not readable: {line[30:].strip()!r}"
            )
        for at, which in ((1, "rsp"), (4, "ref")):
            s[f"{which}_ent_name"] = ends[at]
            s[f"{which}_node"], s[f"{which}_dir"] = int(ends[at + 1]), int(ends[at + 2])


_KNOWN = (15, 18, 55, 58, 82, 151, 164, 2411, 2420)


def geometry_of(sets: list[dict[str, Any]]) -> NodeFrames:
    """Nodes, axes and units of a file."""
    units = next((s for s in sets if s["type"] == 164), None)
    length = force = None
    if units is not None and units["length"] > 0 and units["force"] > 0:
        length, force = 1 / units["length"], 1 / units["force"]
    frames = _frames(sets)
    nodes = NodeFrames(length=length, force=force)
    for s in sets:
        if s["type"] in (15, 2411):
            points = np.stack([np.asarray(s[a], dtype=float) for a in "xyz"], axis=1) * (length or 1.0)
            if not np.isfinite(points).all():
                raise ValueError("coordinates of nodes that are no finite numbers")
            for number, at, system in zip(s["node_nums"], points, s["disp_cs"], strict=True):
                x, y, z = (float(v) for v in at)
                nodes.positions[int(number)] = (x, y, z)
                if int(system) in frames:
                    nodes.axes[int(number)] = frames[int(system)]
    return nodes


def traces_of(sets: list[dict[str, Any]], geometry: NodeFrames) -> tuple[Trace, ...]:
    """Trace lines (82) as points, m; a node 0 lifts the pen, and so do nodes without a place."""
    traces: list[Trace] = []
    for s in sets:
        if s["type"] == 82:
            places = [geometry.positions.get(int(number)) for number in s["nodes"]]
            runs = [[at for at in run if at is not None] for _, run in groupby(places, key=lambda at: at is not None)]
            traces += [tuple(run) for run in runs if len(run) > 1]
    return tuple(traces)


def _frames(sets: list[dict[str, Any]]) -> dict[int, Array]:
    """Cartesian axes (3, 3), rows, by number."""
    frames: dict[int, Array] = {}
    for s in sets:
        if s["type"] == 18:
            for k, number in enumerate(s["cs_num"]):
                if int(s["cs_type"][k]) == 0 and int(s["ref_cs_num"][k]) == 0:
                    frames[int(number)] = _frame(s["ref_o"][k], s["x_point"][k], s["xz_point"][k])
        if s["type"] == 2420:
            for number, kind, matrix in zip(s["CS_sys_labels"], s["CS_types"], s["CS_matrices"], strict=True):
                if int(kind) == 0:
                    frames[int(number)] = np.array(matrix[:3], dtype=float)
    return frames


def _frame(origin: Array, on_x: Array, on_xz: Array) -> Array:
    """Axes (3, 3), rows, from three points. Raises ValueError when they are on a line."""
    x = np.asarray(on_x) - origin
    y = np.cross(np.asarray(on_xz) - origin, x)
    if not np.linalg.norm(y) > 0:
        raise ValueError("the three points of a coordinate system are on one line")
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def node_name(entity: str, number: int) -> str:
    """Name of a node: `entity:number`, or whichever of the two there is."""
    known = "" if entity.upper() in NOTHING else entity
    return ":".join(filter(None, (known, str(number) if number else "")))


def direction_of(code: int, node: int, geometry: NodeFrames) -> tuple[float, float, float] | None:
    """Unit vector of a direction code, +-1 to +-3 along and +-4 to +-6 about the axes of a node; None for a scalar."""
    if not 1 <= abs(code) <= 6:
        return None
    frame = geometry.axes.get(node, np.eye(3))
    x, y, z = (float(v) + 0.0 for v in np.sign(code) * frame[(abs(code) - 1) % 3])
    return x, y, z


@dataclass(frozen=True)
class _End:
    """The response or the reference of a dataset 58: its name, and what its codes and labels say, if anything."""

    channel: str
    node: str
    number: int
    code: int
    quantity: str | None
    kind: str
    label: str


def _end(dataset: dict[str, Any], which: str, axis: str, descriptions: ChannelDescriptions) -> _End:
    number, code = int(dataset[f"{which}_node"]), int(dataset[f"{which}_dir"])
    node = node_name(str(dataset[f"{which}_ent_name"]).strip(), number)
    line, word, key = {"rsp": ("id2", "response", "at"), "ref": ("id3", "reference", "from")}[which]
    written = re.fullmatch(word + r" (\S.*?) \[[^\]]*\]", str(dataset.get(line, "")).strip())
    dof = AXIS_NAMES[abs(code) - 1] if 1 <= abs(code) <= 6 else ""
    exact = exact_of(dataset)
    if written is not None:
        title = written[1]
        if {"role", "by", "df"} & exact.keys():
            node = exact.get(key, "")
        elif title.endswith(f".{dof}") and dof:
            node = title.removesuffix(f".{dof}")
    else:
        label = str(dataset.get(f"{axis}_axis_lab", "")).strip()
        title = ".".join(filter(None, (node, f"-{dof}" if code < 0 else dof))) or label or "channel"
    unit, kind = (str(dataset.get(f"{axis}_{what}", "")).strip() for what in ("axis_units_lab", "spec_data_type"))
    quantity = MOTIONS.get(int(kind), "force" if int(kind) in FORCES else None)
    if quantity is not None and abs(code) >= 4:
        quantity = TURNING[quantity]
    described = descriptions.get(title)
    given = None if described is None else described.unit_of(which == "ref")
    unit = given or ("" if unit.upper() in NOTHING else unit)
    return _End(title, node, number, code, quantity, kind, unit)


def channel_of(
    dataset: dict[str, Any], geometry: NodeFrames, where: str, descriptions: ChannelDescriptions
) -> tuple[MeasuredChannel, float, bool]:
    """The response of a dataset 58, its factor to SI, and whether its unit is known.

    A unit of `descriptions` counts before that of the file. Raises OptionError for units that are not of the quantity.
    """
    end = _end(dataset, "rsp", "ordinate", descriptions)
    return _measured(end, geometry, where)


def response_of(
    dataset: dict[str, Any], geometry: NodeFrames, where: str, descriptions: ChannelDescriptions
) -> tuple[MeasuredChannel, MeasuredChannel, float, bool]:
    """Response and reference of a frequency response, its factor to SI, and whether both units are known.

    The unit of the whole, as (m/s^2)/N, may stand at the response. Raises OptionError as `channel_of`.
    """
    out, into = _end(dataset, "rsp", "ordinate", descriptions), _end(dataset, "ref", "orddenom", descriptions)
    whole = split_response(out.label, out.quantity)
    if whole is not None:
        out, cause = replace(out, label=whole[0]), replace(into, label=whole[1])
        if into.label and _measured(into, geometry, where)[1] != _measured(cause, geometry, where)[1]:
            raise OptionError(
                f"{where}: {out.channel} is per {whole[1]} by its label, but its reference in {into.label}"
            )
        into = cause
    (a, up, known), (b, down, sure) = (_measured(end, geometry, where) for end in (out, into))
    return a, b, up / down, known and sure


def _measured(end: _End, geometry: NodeFrames, where: str) -> tuple[MeasuredChannel, float, bool]:
    what, quantity = f"{where}: {end.channel}", end.quantity
    if end.label:
        known = True
        try:
            quantity, factor = quantity_of(end.label, quantity, what)
        except OptionError as error:
            raise OptionError(f"{error}; a file of channels may give it: {end.channel}: {{unit: ...}}") from None
    elif quantity is None:
        raise OptionError(
            f"{what} says neither its unit nor what it measures (data type {end.kind}); a file of channels may:"
            f" {end.channel}: {{unit: ...}}"
        )
    else:
        length, force = _LENGTHS.get(quantity, 0), _FORCES.get(quantity, 0)
        factor = (geometry.length or 1.0) ** length * (geometry.force or 1.0) ** force
        known = geometry.length is not None
    at, along = geometry.positions.get(end.number), direction_of(end.code, end.number, geometry)
    return MeasuredChannel(end.channel, quantity, end.node or None, along, at), factor, known


def abscissa(dataset: dict[str, Any], exact: dict[str, str], where: str) -> Array:
    """Frequencies, Hz, of a dataset 58, exact where the file says so in an ID line.

    Raises OptionError for an abscissa that is no frequency, and for units that are not known.
    """
    n = len(dataset["data"])
    if "k0" in exact and "df" in exact:
        return float(exact["df"]) * (int(exact["k0"]) + np.arange(n, dtype=float))
    return frequency_unit(dataset, where)[1] * np.asarray(dataset["x"], dtype=float)[:n]


def frequency_unit(dataset: dict[str, Any], where: str) -> tuple[str, float]:
    """Unit of the frequencies of a dataset 58 and its factor to Hz; the label counts before the data type."""
    label, kind = str(dataset.get("abscissa_axis_units_lab", "")).strip(), int(dataset["abscissa_spec_data_type"])
    if kind not in _ABSCISSAE:
        raise OptionError(f"{where}: a response over frequency is expected; its abscissa has the data type {kind}")
    if label.upper() in NOTHING:
        label = _ABSCISSAE[kind]
    return label, frequency_factor(label, f"{where}: abscissa")


_ABSCISSAE = {0: "Hz", 1: "Hz", FREQUENCY_AXIS: "Hz", 19: "rpm"}
"""Units of abscissae that have no label, by data type."""


def rate_of(dataset: dict[str, Any], where: str, exact: dict[str, str]) -> float:
    """Sample rate, Hz, of a time record: the roundest one that gives the step with its 6 digits.

    Raises OptionError for uneven times.
    """
    if "rate" in exact:
        return float(exact["rate"])
    factor = _seconds(str(dataset.get("abscissa_axis_units_lab", "")).strip(), where)
    if int(dataset["abscissa_spacing"]):
        step = factor * float(dataset["abscissa_inc"])
    else:
        steps = factor * np.diff(np.asarray(dataset["x"], dtype=float))
        step = float(np.mean(steps)) if len(steps) else 0.0
        if not len(steps) or np.ptp(steps) > 1e-3 * step:
            raise OptionError(f"{where}: times are not evenly spaced: resample the record")
    if not step > 0:
        raise OptionError(f"{where}: the sampling interval is {step:g} s")
    half = 0.5000001 * 10.0 ** (np.floor(np.log10(step)) - 5)
    for digits in range(1, 13):
        rate = float(f"{1 / step:.{digits}g}")
        if abs(1 / rate - step) <= half:
            return rate
    return 1 / step


def _seconds(label: str, where: str) -> float:
    """Seconds in the unit of an abscissa. Raises OptionError for what is no unit of time."""
    if label.upper() in NOTHING:
        return 1.0
    try:
        factor, exponents = parse_unit(label.lower())
    except ExpressionError:
        factor, exponents = Fraction(1), ()
    if exponents != dimension("s"):
        raise OptionError(f"{where}: abscissa: a record is over time, in s or ms, not in {label!r}")
    return float(factor)


def exact_of(dataset: dict[str, Any]) -> dict[str, str]:
    """What ID lines 4 and 5 say as `key=value; key=value` below a line `response NAME [UNIT]`."""
    if not str(dataset.get("id2", "")).startswith("response "):
        return {}
    parts = (part.partition("=") for line in ("id4", "id5") for part in str(dataset.get(line, "")).split(";"))
    entries = {key.strip(): value.strip() for key, equals, value in parts if equals}
    return {k: v for k, v in entries.items() if k not in _FORMS or re.fullmatch(_FORMS[k], v)}


_FORMS = {"k0": r"\d{1,9}", "n": r"\d{1,9}"} | dict.fromkeys(("rate", "decay", "df"), r"\d+\.?\d*(e[-+]?\d{1,2})?")


def data_of(dataset: dict[str, Any], where: str, is_time: bool = False) -> NDArray[Any]:
    """Values of a dataset 58. Raises OptionError when there are fewer than the header says, or not finite ones.

    Those of time records are left to be judged with their hit.
    """
    data = np.asarray(dataset["data"])
    wanted = int(dataset["num_pts"])
    if len(data) < wanted:
        raise OptionError(f"{where}: {len(data)} values, but its header says {wanted}: is the file complete?")
    data = data[:wanted]
    if not is_time and not np.isfinite(data).all():
        raise OptionError(f"{where}: value {int(np.argmin(np.isfinite(data))) + 1} is no finite number")
    return data
