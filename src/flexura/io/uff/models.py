"""Universal files: geometry (15, 18, 82), mode shapes (55), frequency responses (58), with headers (151, 164)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flexura.analysis import Modes
from flexura.arrays import Array
from flexura.errors import OptionError, need
from flexura.files import write_file
from flexura.io.contents import Response
from flexura.io.meshes import lines_of
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
from flexura.mechanism import DOF_NAMES
from flexura.structure import Channel, FullOrderModel

_LONGEST_TRACE = 250
_SMALLEST = 1e-90

_STRAIGHT = 1e-9
"""A direction is along an axis when its other components are no larger: far below the 6 digits of the format."""


def write_results_uff(what: Any, path: str | Path, geometry: Modes | FullOrderModel | None = None) -> Path:
    """Write modes, a frequency response, or several of them as an ASCII universal file in SI units.

    Nodes are numbered from 1 in the order of `Modes.node_names`, when modes or `geometry` say it. A channel is at its
    node, in direction +-1 to +-3 along and +-4 to +-6 about x, y, z; one in an oblique direction is at a further node
    in the same place, along or about x of axes of its own. Between two nodes it is a scalar, direction 0, at the
    second, and ID lines 4 and 5 say between which; where nothing says where it is, it is a scalar at a node of its
    own. Modes have unit modal mass; responses are complex, in double precision. Coordinates, shapes and unevenly spaced
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
    responses = [thing for thing in things if not isinstance(thing, Modes)]
    numbers = ChannelNumbers(model, [c for r in responses for c in (*r.outputs, *r.inputs)])
    sets = headers(things[0].name, "low-order model of a compliant mechanism") + numbers.sets()
    if model is not None:
        sets += _traces(model)
    for thing in things:
        sets += _modes(thing) if isinstance(thing, Modes) else _response(thing, numbers)

    def write(file: Path) -> None:
        pyuff.UFF(str(file)).write_sets(sets, mode="overwrite")

    return write_file(path, write)


def _model(geometry: Any, things: list[Any]) -> FullOrderModel | None:
    """The one model that numbers the nodes. Raises OptionError for several."""
    models = [m for m in (geometry, *things) if isinstance(m, Modes | FullOrderModel)]
    full_models = [m.model if isinstance(m, Modes) else m for m in models]
    if geometry is not None and not isinstance(geometry, Modes | FullOrderModel):
        raise OptionError(f"geometry is that of modes or of a full-order model, not of a {type(geometry).__name__}")
    if any(m.plan.topology.node_names != full_models[0].plan.topology.node_names for m in full_models[1:]):
        raise OptionError("modes in one universal file are of one mechanism; write a file for each")
    return full_models[0] if full_models else None


_Key = tuple[str, tuple[float, ...] | None, tuple[float, ...] | None]
"""Node, or the name of a channel without one; its position and direction where a number of its own is due."""


class ChannelNumbers:
    """Numbers of nodes: those of a model from 1 in order, then those of channels that are at none or are oblique."""

    def __init__(self, model: FullOrderModel | None, channels: Sequence[Channel]) -> None:
        self._table: dict[_Key, int] = {}
        self._positions: dict[int, Array] = {}
        self._axes: dict[int, Array] = {}
        self._at: dict[str, Array] = {}
        if model is not None:
            topology, positions = model.plan.topology, model.positions
            for k, name in enumerate(topology.node_names):
                self._table[name, None, None], self._at[name] = k + 1, positions[k]
            self._positions = {int(k) + 1: positions[k] for k in np.flatnonzero(topology.has_position)}
        for channel in channels:
            if channel.position is not None:
                self._at.setdefault(_named(channel)[0], np.array(channel.position))
        for channel in channels:
            self._add(channel)

    def _add(self, channel: Channel) -> None:
        key = self._key(channel)
        if key in self._table:
            return
        number = self._table[key] = max(self._table.values(), default=0) + 1
        position = self._at.get(key[0]) if key[1] is None else np.array(key[1])
        if key[2] is not None:
            self._axes[number] = axes_along(np.array(key[2]))
            # axes belong to nodes, also those of a motion of the base, which is at no place
            position = np.zeros(3) if position is None else position
        if position is not None:
            self._positions[number] = position

    def _key(self, channel: Channel) -> _Key:
        node, _ = _named(channel)
        position, d = channel.position, channel.direction
        if position is not None and np.allclose(position, self._at[node], 0, 1e-9):
            position = None
        is_oblique = d is not None and channel.against is None and np.sum(np.abs(d) > _STRAIGHT) > 1
        return node, position, d if is_oblique else None

    def of(self, channel: Channel) -> tuple[int, int]:
        """Number of the node and code of the direction; 0 for a scalar."""
        key, d = self._key(channel), channel.direction
        number = self._table[key]
        if channel.against is not None:
            return number, 0
        if d is None:
            return number, _named(channel)[1]
        return number, direction_code(d, channel.quantity, key[2] is not None)

    def sets(self) -> list[dict[str, Any]]:
        """Datasets of axes and of all nodes."""
        datasets = axes_sets(self._axes)
        if self._positions:
            labels = list(self._positions)
            places = np.round(np.array(list(self._positions.values())), 12) + 0.0
            zero = [0] * len(labels)
            systems = [n if n in self._axes else 0 for n in labels]
            nodes = {"type": 15, "node_nums": labels, "def_cs": zero, "disp_cs": systems, "color": zero}
            datasets.append({**nodes, **dict(zip("xyz", places.T.tolist(), strict=True))})
        return datasets


def _named(channel: Channel) -> tuple[str, int]:
    """Node and direction code of a channel: its own node, and else what a name such as `platform.tz` says."""
    node, _, dof = channel.name.partition(":")[0].rpartition(".")
    if not node or dof not in DOF_NAMES:
        return channel.node or channel.name, 0
    return channel.node or node, DOF_NAMES.index(dof) + 1


def _traces(model: FullOrderModel) -> list[dict[str, Any]]:
    """A trace along every member and to every node that a body carries."""
    mesh = lines_of(model)
    sets: list[dict[str, Any]] = []
    ends = mesh.node[mesh.lines] + 1
    for k, name in enumerate(mesh.names):
        trace = _trace(ends[mesh.part == k])
        for start in range(0, max(len(trace) - 1, 0), _LONGEST_TRACE - 1):
            piece = trace[start : start + _LONGEST_TRACE]
            if len(piece) > 1:
                sets.append({"type": 82, "trace_num": len(sets) + 1, "color": 0, "id": text_of(name), "nodes": piece})
    return sets


def _trace(ends: np.ndarray) -> np.ndarray:
    """Nodes along lines (e, 2); 0 lifts the pen."""
    nodes: list[int] = []
    for a, b in ends.tolist():
        nodes += [b] if nodes and nodes[-1] == a else [*([0] if nodes else []), a, b]
    return np.array(nodes, dtype=int)


def _modes(modes: Modes) -> list[dict[str, Any]]:
    has_position = modes.model.plan.topology.has_position
    shapes = modes.shapes[has_position]
    refuse_infinite(shapes)
    shapes = np.where(np.abs(shapes) < _SMALLEST, 0.0, shapes)
    common = {"type": 55, "model_type": 1, "analysis_type": 2, "data_ch": 3, "spec_data_type": 8, "load_case": 0}
    ids = {"id1": text_of(modes.name), "id2": "mode shape, displacement m, rotation rad, modal mass 1 kg"}
    return [
        {
            **common,
            **ids,
            "id3": text_of(f"order {modes.order} of {modes.full_order}"),
            "id4": f"mode {mode.number}, {mode.frequency_hz:.6g} Hz",
            "id5": f"model error, how far the part may be from it: {error}",
            "node_nums": (np.flatnonzero(has_position) + 1).tolist(),
            **{f"r{i + 1}": shapes[:, i, k] for i in range(6)},
            "mode_n": k + 1,
            "freq": float(mode.frequency_hz),
            "modal_m": 1.0,
            "modal_damp_vis": 0.0,
            "modal_damp_his": 0.0,
        }
        for k, (mode, error) in enumerate(zip(modes.modes, modes.model_errors.texts, strict=True))
    ]


def _response(response: Response, numbers: ChannelNumbers) -> list[dict[str, Any]]:
    hz, H = np.asarray(response.frequency_hz, dtype=float), np.asarray(response.response, dtype=complex)
    refuse_infinite(H)
    if len(hz) < 2:
        raise OptionError("a frequency response in a universal file has at least two frequencies")
    outs = [numbers.of(channel) for channel in response.outputs]
    ins = [numbers.of(channel) for channel in response.inputs]
    sets = []
    for i, (out, (node, direction)) in enumerate(zip(response.outputs, outs, strict=True)):
        for j, (inp, (at, along)) in enumerate(zip(response.inputs, ins, strict=True)):
            sets.append(
                {
                    "type": 58,
                    "binary": 0,
                    "func_type": 4,
                    "id1": text_of(response.name),
                    "id2": text_of(f"response {out}"),
                    "id3": text_of(f"reference {inp}"),
                    "id4": text_of(_between("response", out)),
                    "id5": text_of(_between("reference", inp)),
                    "rsp_ent_name": text_of(_named(out)[0], 10),
                    "rsp_node": node,
                    "rsp_dir": direction,
                    "ref_ent_name": text_of(_named(inp)[0], 10),
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
    kind, length, force = DATA_TYPES.get(channel.quantity, GENERAL)
    return {
        f"{which}_spec_data_type": kind,
        f"{which}_len_unit_exp": length,
        f"{which}_force_unit_exp": force,
        f"{which}_axis_lab": channel.quantity[:20],
        f"{which}_axis_units_lab": channel.unit,
    }


def scalar_notes(what: Any) -> list[str]:
    """What a universal file cannot say of the channels of a response: that they act between two nodes."""
    things = [what] if isinstance(what, Response) else []
    channels = [c for thing in things for c in dict.fromkeys((*thing.outputs, *thing.inputs)) if c.against is not None]
    return [
        f"{c.name} acts between {c.against} and {c.node}: a universal file has one node for it, so it is written at "
        f"{c.node} as a scalar, direction 0, and its ID lines say between which"
        for c in channels
    ]


def _between(word: str, channel: Channel) -> str:
    """What a response or a reference is measured between, where that is two nodes."""
    return "" if channel.against is None else f"{word} from {channel.against} to {channel.node}"


def _evenly_spaced(hz: Array) -> bool:
    """True when first frequency and step with 6 digits, as the format has them, give all frequencies."""
    first, step = (float(f"{v:.5e}") for v in (hz[0], hz[1] - hz[0]))
    return step > 0 and bool(np.allclose(first + step * np.arange(len(hz)), hz, rtol=1e-9, atol=1e-9 * step))
