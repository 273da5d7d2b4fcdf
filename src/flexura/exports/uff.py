"""Universal files: geometry (15, 82), mode shapes (55) and frequency responses (58), with headers (151, 164)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flexura._version import __version__
from flexura.analysis.modes import Modes
from flexura.errors import OptionError
from flexura.exports.contents import Array, Response
from flexura.exports.lines import lines_of
from flexura.extras import need
from flexura.files import write_file
from flexura.mechanism.substructure import DOF_NAMES
from flexura.structure import FullOrderModel
from flexura.systems.channel import Channel

# specific data type, exponents of length and force (universal file dataset 58, record 9)
_DATA_TYPES = {
    "displacement": (8, 1, 0),
    "rotation": (8, 0, 0),
    "velocity": (11, 1, 0),
    "angular_velocity": (11, 0, 0),
    "acceleration": (12, 1, 0),
    "angular_acceleration": (12, 0, 0),
    "force": (13, 0, 1),
    "moment": (13, 1, 1),
    "expansion": (8, 1, 0),
    "stress": (2, -2, 1),
}
_GENERAL = (1, 0, 0)
_LINE = 80
_LONGEST_TRACE = 250
_SMALLEST = 1e-90


def write_uff(what: Any, path: str | Path, geometry: Modes | FullOrderModel | None = None) -> Path:
    """Write modes, a frequency response, or several of them as an ASCII universal file in SI units.

    Nodes are numbered from 1 in the order of `Modes.node_names`. A channel whose name begins with NODE.DOF is at that
    node and direction (1 to 3 along, 4 to 6 about x, y, z) if the node is known from modes or from `geometry`, and
    otherwise at a number of its own, in direction 0 unless its name ends in a DOF; its name stands in ID lines. Modes
    have unit modal mass; responses are complex, in double precision. Coordinates, shapes and unevenly spaced
    frequencies have 6 digits, as the format has them. Raises OptionError without pyuff, for other objects, for numbers
    that are not finite and when the file cannot be written.
    """
    pyuff = need("pyuff", "export")
    things = list(what) if isinstance(what, Sequence) else [what]
    for thing in things:
        if not isinstance(thing, Modes | Response):
            raise OptionError(f"a universal file is of modes and frequency responses, not of a {type(thing).__name__}")
    if not things:
        raise OptionError("a universal file needs modes or a frequency response")
    model = _model(geometry, things)
    numbers = {} if model is None else {name: k + 1 for k, name in enumerate(model.plan.topology.node_names)}
    sets = _headers(things[0].name)
    if model is not None:
        sets += _geometry(model)
    for thing in things:
        sets += _modes(thing) if isinstance(thing, Modes) else _response(thing, numbers)

    def write(file: Path) -> None:
        pyuff.UFF(str(file)).write_sets(sets, mode="overwrite")

    return write_file(path, write)


def _model(geometry: Any, things: list[Any]) -> FullOrderModel | None:
    """The one model that numbers the nodes. Raises OptionError for several."""
    models = [m for m in (geometry, *things) if isinstance(m, Modes | FullOrderModel)]
    found = [m.model if isinstance(m, Modes) else m for m in models]
    if geometry is not None and not isinstance(geometry, Modes | FullOrderModel):
        raise OptionError(f"geometry is that of modes or of a full-order model, not of a {type(geometry).__name__}")
    if any(m.plan.topology.node_names != found[0].plan.topology.node_names for m in found[1:]):
        raise OptionError("modes in one universal file are of one mechanism; write a file for each")
    return found[0] if found else None


def _headers(name: str) -> list[dict[str, Any]]:
    about = {"type": 151, "model_name": _text(name), "description": "low-order model of a compliant mechanism"}
    program = f"flexura {__version__}"
    units = {"type": 164, "units_code": 1, "units_description": "SI: m, N, kg, s", "temp_mode": 1}
    return [
        {**about, "db_app": program, "program": program},
        {**units, "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15},
    ]


def _geometry(model: FullOrderModel) -> list[dict[str, Any]]:
    """Nodes, and a trace along every member and to every node that a body carries."""
    mesh = lines_of(model)
    x, y, z = np.round(mesh.points, 12).T
    label, zero = (mesh.node + 1).tolist(), [0] * len(mesh.node)
    nodes = {"type": 15, "node_nums": label, "def_cs": zero, "disp_cs": zero, "color": zero}
    sets: list[dict[str, Any]] = [{**nodes, "x": x.tolist(), "y": y.tolist(), "z": z.tolist()}]
    ends = mesh.node[mesh.lines] + 1
    for k, name in enumerate(mesh.names):
        trace = _trace(ends[mesh.part == k])
        for start in range(0, max(len(trace) - 1, 0), _LONGEST_TRACE - 1):
            piece = trace[start : start + _LONGEST_TRACE]
            if len(piece) > 1:
                sets.append({"type": 82, "trace_num": len(sets), "color": 0, "id": _text(name), "nodes": piece})
    return sets


def _trace(ends: np.ndarray) -> np.ndarray:
    """Nodes along lines (e, 2); 0 lifts the pen."""
    found: list[int] = []
    for a, b in ends.tolist():
        found += [b] if found and found[-1] == a else [*([0] if found else []), a, b]
    return np.array(found, dtype=int)


def _modes(modes: Modes) -> list[dict[str, Any]]:
    has_place = modes.model.plan.topology.has_place
    shapes = modes.shapes[has_place]
    _refuse_infinite(shapes)
    shapes = np.where(np.abs(shapes) < _SMALLEST, 0.0, shapes)
    common = {"type": 55, "model_type": 1, "analysis_type": 2, "data_ch": 3, "spec_data_type": 8, "load_case": 0}
    ids = {"id1": _text(modes.name), "id2": "mode shape, displacement m, rotation rad, modal mass 1 kg"}
    return [
        {
            **common,
            **ids,
            "id3": _text(f"order {modes.order} of {modes.full_order}"),
            "id4": f"mode {mode.number}, {mode.frequency_hz:.6g} Hz",
            "node_nums": (np.flatnonzero(has_place) + 1).tolist(),
            **{f"r{i + 1}": shapes[:, i, k] for i in range(6)},
            "mode_n": k + 1,
            "freq": float(mode.frequency_hz),
            "modal_m": 1.0,
            "modal_damp_vis": 0.0,
            "modal_damp_his": 0.0,
        }
        for k, mode in enumerate(modes.modes)
    ]


def _response(response: Response, numbers: dict[str, int]) -> list[dict[str, Any]]:
    hz, H = np.asarray(response.frequency_hz, dtype=float), np.asarray(response.response, dtype=complex)
    _refuse_infinite(H)
    if len(hz) < 2:
        raise OptionError("a frequency response in a universal file has at least two frequencies")
    numbers = dict(numbers)
    outs = [_place(channel, numbers) for channel in response.outputs]
    ins = [_place(channel, numbers) for channel in response.inputs]
    sets = []
    for i, (out, (node, direction)) in enumerate(zip(response.outputs, outs, strict=True)):
        for j, (inp, (at, along)) in enumerate(zip(response.inputs, ins, strict=True)):
            sets.append(
                {
                    "type": 58,
                    "binary": 0,
                    "func_type": 4,
                    "id1": _text(response.name),
                    "id2": _text(f"response {out}"),
                    "id3": _text(f"reference {inp}"),
                    "rsp_ent_name": _text(out.name.rpartition(".")[0] or out.name, 10),
                    "rsp_node": node,
                    "rsp_dir": direction,
                    "ref_ent_name": _text(inp.name.rpartition(".")[0] or inp.name, 10),
                    "ref_node": at,
                    "ref_dir": along,
                    "abscissa_spacing": int(_evenly_spaced(hz)),
                    "abscissa_spec_data_type": 18,
                    "abscissa_axis_lab": "frequency",
                    "abscissa_axis_units_lab": "Hz",
                    **_axis("ordinate", out),
                    **_axis("orddenom", inp),
                    "x": hz,
                    "data": H[:, i, j],
                }
            )
    return sets


def _axis(which: str, channel: Channel) -> dict[str, Any]:
    kind, length, force = _DATA_TYPES.get(channel.quantity, _GENERAL)
    return {
        f"{which}_spec_data_type": kind,
        f"{which}_len_unit_exp": length,
        f"{which}_force_unit_exp": force,
        f"{which}_axis_lab": channel.quantity[:20],
        f"{which}_axis_units_lab": channel.unit,
    }


def _place(channel: Channel, numbers: dict[str, int]) -> tuple[int, int]:
    """Node number and direction of a channel; a name that is new gets the next number."""
    name = channel.name.partition(":")[0]
    node, _, dof = name.rpartition(".")
    if dof not in DOF_NAMES or not node:
        node, dof = channel.name, ""
    numbers.setdefault(node, max(numbers.values(), default=0) + 1)
    return numbers[node], DOF_NAMES.index(dof) + 1 if dof else 0


def _evenly_spaced(hz: Array) -> bool:
    """True when first frequency and step with 6 digits, as the format has them, give all frequencies."""
    first, step = (float(f"{v:.5e}") for v in (hz[0], hz[1] - hz[0]))
    return step > 0 and bool(np.allclose(first + step * np.arange(len(hz)), hz, rtol=1e-9, atol=1e-9 * step))


def _refuse_infinite(values: np.ndarray) -> None:
    if not np.isfinite(values).all():
        raise OptionError("there are numbers that are not finite, which universal files cannot hold")


def _text(text: str, length: int = _LINE) -> str:
    """One line of ASCII of at most so many characters."""
    return " ".join(text.encode("ascii", "replace").decode().split())[:length] or "NONE"
