"""Lines between the points of a test, in universal files and in files of channels."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from helpers.tested_frame import measured_frame

DATA = Path(__file__).parent / "data"
pyuff = pytest.importorskip("pyuff")

CHANNELS = """
channels:
  c.tx: {node: c, direction: x, position: [0 mm, 0 mm, 150 mm]}
  d.tx: {node: d, direction: x, position: [100 mm, 0 mm, 150 mm]}
nodes: {corner: [200 mm, 0 mm, 150 mm]}
traces: [[c.tx, d, corner], [corner, c]]
"""


def test_lines_are_written_and_read(tmp_path):
    own = measured_frame()
    again = fx.read_measurement(fx.write_measurement(own, tmp_path / "frame.uff"))
    assert again.traces == own.traces
    assert fx.identify(again).traces == own.traces


def test_a_zero_lifts_the_pen_and_nodes_without_a_place_do(tmp_path):
    """Nodes 1 to 4 at x = 1 to 4 mm, in a file in millimetres."""
    x = np.arange(1.0, 5.0)
    flat = np.zeros(4)
    units = {"type": 164, "units_code": 5, "units_description": "mm", "temp_mode": 1, "length": 1e3, "force": 1.0}
    path = fx.write_measurement(measured_frame(), tmp_path / "frame.uff")
    data = path.read_bytes()
    file = pyuff.UFF(str(tmp_path / "nodes.uff"))
    nodes = {"type": 15, "node_nums": [1, 2, 3, 4], "def_cs": flat, "disp_cs": flat, "color": flat}
    trace = {"type": 82, "trace_num": 1, "color": 0, "id": "edge", "nodes": np.array([1, 2, 0, 3, 4, 99, 1, 0, 2])}
    file.write_sets([{**units, "temp": 1.0, "temp_offset": 0.0}, {**nodes, "x": x, "y": flat, "z": flat}, trace], "add")
    both = tmp_path / "both.uff"
    both.write_bytes((tmp_path / "nodes.uff").read_bytes() + data[data.index(b"    -1\n    58b") :])
    assert fx.read_measurement(both).traces == (
        ((0.001, 0.0, 0.0), (0.002, 0.0, 0.0)),
        ((0.003, 0.0, 0.0), (0.004, 0.0, 0.0)),
    )


def test_a_file_of_channels_names_lines(tmp_path):
    path = fx.write_measurement(measured_frame(), tmp_path / "frame.uff")
    (tmp_path / "table.yaml").write_text(CHANNELS)
    traces = fx.read_measurement(path, tmp_path / "table.yaml").traces
    c, d, corner = (0.0, 0.0, 0.15), (0.1, 0.0, 0.15), (0.2, 0.0, 0.15)
    assert traces[1:] == ((c, d, corner), (corner, c))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("traces: [[c.tx, nowhere]]", r"table.yaml:6: traces: 'nowhere' is no channel or node with a position"),
        ("traces: [[c.tx]]", "lists of two names or more"),
        ("traces: c.tx", "lists of two names or more"),
        ("nodes: {corner: [200, 0, 150]}", "node corner"),
        ("nodes: [corner]", "nodes is a mapping"),
        ("lines: [[c, d]]", "unknown key 'lines'; keys: channels, columns, nodes, traces"),
    ],
)
def test_what_is_wrong_in_it_is_named(tmp_path, line, said):
    path = fx.write_measurement(measured_frame(), tmp_path / "frame.uff")
    lines = [own for own in CHANNELS.splitlines() if not own.startswith(line.partition(":")[0] + ":")]
    (tmp_path / "table.yaml").write_text("\n".join([*lines, line, ""]))
    with pytest.raises(fx.FlexuraError, match=said):
        fx.read_measurement(path, tmp_path / "table.yaml")
