"""Mode shapes and responses in VTK and universal files, read back by meshio and pyuff."""

from __future__ import annotations

import csv
from pathlib import Path
from types import SimpleNamespace

import meshio
import numpy as np
import pytest
import pyuff

import flexura as fx
from flexura.cli import main
from flexura.io import export
from flexura.structure import Channel
from helpers.export_models import example_modes, modal_model


def table_of(path: Path) -> list[dict[str, str]]:
    with path.open() as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize("name", ["guide", "xy_stage"])
def test_vtu_has_the_mesh_and_the_shapes(name: str, tmp_path: Path) -> None:
    modes = example_modes(name)
    paths = export(modes, tmp_path / "shapes.vtu")
    found = meshio.read(paths[0])
    (lines,) = found.cells
    assert lines.type == "line" and len(lines.data) == len(found.cell_data["part"][0])
    placed = modes.model.plan.topology.has_position  # others hold amplitudes of bodies
    assert np.allclose(found.points, modes.model.geometry.positions[placed], atol=1e-12)
    assert np.allclose(found.point_data["mode_02_displacement"], modes.shapes[placed, :3, 1], rtol=1e-12, atol=1e-15)
    assert np.allclose(found.point_data["mode_06_rotation"], modes.shapes[placed, 3:, 5], rtol=1e-12, atol=1e-15)
    assert sorted(found.point_data)[-1] == "mode_06_rotation" and len(found.point_data) == 12
    rows = table_of(paths[1])
    flexures = [row["part"] for row in rows if row["kind_name"] == "flexure"]
    own = found.cell_data["kind"][0] == 1
    assert sorted(set(found.cell_data["part"][0][own])) == [int(part) for part in flexures]


def test_lines_of_the_guide_are_its_leaves_and_the_arms_of_its_carriage(tmp_path: Path) -> None:
    modes = example_modes("guide")
    paths = export(modes, tmp_path / "g.vtu")
    mesh, number = meshio.read(paths[0]), {row["name"]: int(row["part"]) for row in table_of(paths[1])}
    assert sorted(number) == ["carriage", "leaf1.blade", "leaf2.blade"]
    ends, part = mesh.cells[0].data, mesh.cell_data["part"][0]
    length = np.linalg.norm(np.diff(mesh.points[ends], axis=1)[:, 0], axis=1)
    # leaves of 60 mm; arms from the centre of the carriage to heads 25 mm aside and 5 mm below
    assert [length[part == number[f"leaf{k}.blade"]].sum() for k in (1, 2)] == pytest.approx([0.06, 0.06])
    assert length[part == number["carriage"]] == pytest.approx(2 * [np.hypot(0.025, 0.005)])


def test_shapes_of_a_chosen_size_and_the_mesh_alone(tmp_path: Path) -> None:
    modes = example_modes("guide")
    found = meshio.read(export(modes, tmp_path / "g.vtu", amplitude=0.01)[0])
    for k in range(1, 7):
        size = np.linalg.norm(found.point_data[f"mode_{k:02d}_displacement"], axis=1).max()
        assert size == pytest.approx(0.01)
    bare = meshio.read(export(modes.model, tmp_path / "g.vtu")[0])
    assert not bare.point_data and len(bare.points) == len(found.points)
    with pytest.raises(fx.OptionError, match="positive length"):
        export(modes, tmp_path / "h.vtu", amplitude=0.0)


def test_mechanisms_without_members(tmp_path: Path) -> None:
    held = fx.describe.Support(fixed=fx.describe.DOF_NAMES)
    box = fx.describe.Box(size=(0.01, 0.01, 0.01), material="Al-6061-T6")
    spring = fx.describe.Spring(
        nodes=("foot", "block"), stiffness=fx.describe.DiagonalStiffness(tx=1e3, ty=1e3, tz=1e3, rx=1, ry=1, rz=1)
    )
    one = fx.Mechanism(
        nodes={"foot": (0, 0, 0)},
        bodies={"block": fx.describe.RigidBody(centre=(0, 0, 0.02), solid=box)},
        springs={"spring": spring},
        ground={"foot": held},
    )
    found = meshio.read(export(fx.modes(one, n=2, order="full"), tmp_path / "one.vtu")[0])
    assert found.cells[0].data.tolist() == [[0, 1]]
    lonely = fx.Mechanism(bodies={"block": fx.describe.RigidBody(solid=box)})
    assert meshio.read(export(fx.assemble(lonely), tmp_path / "l.vtu")[0]).cells[0].type == "vertex"


def test_amplitudes_of_superelements_are_no_points(tmp_path: Path) -> None:
    section = fx.describe.Circle(diameter=0.002)
    nodes = {"a": (0.0, 0.0, 0.0), "b": (0.1, 0.0, 0.0)}
    wire = fx.Mechanism(
        nodes=nodes,
        links={"wire": fx.describe.Link(nodes=("a", "b"), material="Al-7075-T6", section=section, elements=10)},
        interface=("a", "b"),
    )
    part = fx.models.nested(fx.reduce(wire, keep=8))
    outside = fx.Mechanism(
        nodes={"o": (0.0, 0.1, 0.0), **nodes},
        links={"arm": fx.describe.Link(nodes=("o", "a"), material="Al-7075-T6", section=section, elements=2)},
        superelements={"wire": part.superelement},
        ground={"o": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
    )
    modes = fx.modes(outside, n=2, order="full")
    assert len(modes.node_names) > 4  # o, a, b, the middle of the arm, and nodes for the amplitudes
    found = meshio.read(export(modes, tmp_path / "o.vtu")[0])
    assert len(found.points) == 4
    sets = read_uff(export(modes, tmp_path / "o.uff")[0])
    numbers = [int(k) for k in sets[15][0]["node_nums"]]
    assert [modes.node_names[k - 1] for k in numbers] == ["o", "a", "b", "arm[1]"]
    assert sets[55][1]["r2"].tolist() == pytest.approx(modes.shapes[[k - 1 for k in numbers], 1, 1].tolist(), rel=1e-5)
    rows = table_of(export(modes.model, tmp_path / "o.mtx")[2])
    assert [row["coordinate"] for row in rows if not row["node"]] == [f"wire amplitude {k + 1}" for k in range(8)]


@pytest.fixture(scope="module")
def response() -> SimpleNamespace:
    model = modal_model(example_modes("guide"), "carriage")
    hz = np.linspace(1, 200, 399)
    return SimpleNamespace(
        name="guide", frequency_hz=hz, response=model.frequency_response(hz), inputs=model.inputs, outputs=model.outputs
    )


def read_uff(path: Path) -> dict[int, list[dict]]:
    sets: dict[int, list[dict]] = {}
    for one in pyuff.UFF(str(path)).read_sets():
        sets.setdefault(one["type"], []).append(one)
    return sets


def test_modes_in_a_universal_file(tmp_path: Path) -> None:
    modes = example_modes("xy_stage")
    (path,) = export(modes, tmp_path / "stage.uff")
    sets = read_uff(path)
    assert set(sets) == {151, 164, 15, 82, 55} and len(sets[55]) == 6
    assert sets[164][0]["units_code"] == 1 and sets[164][0]["length"] == 1.0
    numbers = np.array(sets[15][0]["node_nums"], dtype=int)
    placed = np.flatnonzero(modes.model.plan.topology.has_position)  # others hold amplitudes of bodies
    assert numbers.tolist() == (placed + 1).tolist()
    x = np.stack([sets[15][0][k] for k in "xyz"], axis=1)
    assert np.allclose(x, modes.model.geometry.positions[placed], rtol=1e-5, atol=1e-9)
    for k, shape in enumerate(sets[55]):
        assert (shape["mode_n"], shape["analysis_type"], shape["data_ch"], shape["spec_data_type"]) == (k + 1, 2, 3, 8)
        assert shape["freq"] == pytest.approx(modes.frequency_hz[k], rel=1e-5)
        assert shape["id5"].endswith(f"how far the part may be from it: {modes.model_errors.texts[k]}")
        assert shape["modal_m"] == 1.0 and shape["node_nums"].astype(int).tolist() == numbers.tolist()
        found = np.stack([shape[f"r{i}"] for i in range(1, 7)], axis=1)
        assert np.allclose(found, modes.shapes[placed, :, k], rtol=1e-5, atol=1e-12)


def test_traces_follow_members_and_bodies(tmp_path: Path) -> None:
    modes = example_modes("guide")
    traces = {one["id"].strip(): one["nodes"].astype(int) for one in read_uff(export(modes, tmp_path / "g.unv")[0])[82]}
    names = np.array(["", *modes.node_names])
    blade = names[traces["leaf1.blade"]].tolist()
    assert (blade[0], blade[1], blade[-1]) == ("leaf1.foot", "leaf1.blade[1]", "leaf1.head")
    assert names[traces["carriage"]].tolist().count("carriage") == 2
    x = modes.model.geometry.positions[traces["leaf2.blade"] - 1]
    assert np.all(np.diff(x[:, 2]) > 0)


def test_long_members_are_split_into_traces_of_250_nodes(tmp_path: Path) -> None:
    section = fx.describe.Circle(diameter=0.002)
    link = fx.describe.Link(nodes=("a", "b"), material="Al-7075-T6", section=section, elements=600)
    wire = fx.Mechanism(nodes={"a": (0, 0, 0), "b": (1, 0, 0)}, links={"wire": link})
    found = read_uff(export(fx.modes(wire, n=1, order="full"), tmp_path / "w.uff")[0])[82]
    assert [len(one["nodes"]) for one in found] == [250, 250, 103]
    ends = [one["nodes"][[0, -1]].astype(int).tolist() for one in found]
    assert ends[0][1] == ends[1][0] and ends[1][1] == ends[2][0]


def test_responses_in_a_universal_file(response: SimpleNamespace, tmp_path: Path) -> None:
    modes = example_modes("guide")
    (path,) = export(response, tmp_path / "frf.uff", geometry=modes)
    found = read_uff(path)[58]
    assert len(found) == 6
    number = modes.node_names.index("carriage") + 1
    places = [(one["rsp_node"], one["rsp_dir"], one["ref_node"], one["ref_dir"]) for one in found]
    assert places[:4] == [(number, d, number, e) for d in (1, 5) for e in (1, 5)]
    assert places[4][0] > len(modes.node_names) and places[4][1] == 0  # the accelerometer is at no node of the mesh
    for k, one in enumerate(found):
        assert one["func_type"] == 4 and one["abscissa_spec_data_type"] == 18
        assert np.allclose(one["x"], response.frequency_hz, rtol=1e-9)
        assert np.allclose(one["data"], response.response[:, k // 2, k % 2], rtol=1e-10, atol=0)
    acceleration = found[4]
    assert (acceleration["ordinate_spec_data_type"], acceleration["orddenom_spec_data_type"]) == (12, 13)
    assert acceleration["ordinate_axis_units_lab"] == "m/s^2" and acceleration["orddenom_axis_units_lab"] == "N"
    moment = found[1]
    assert (moment["orddenom_len_unit_exp"], moment["orddenom_force_unit_exp"]) == (1, 1)
    assert (moment["ordinate_len_unit_exp"], found[2]["ordinate_len_unit_exp"]) == (1, 0)
    assert "carriage.accelerometer" in acceleration["id2"]


def test_uneven_frequencies_and_several_things_in_one_file(response: SimpleNamespace, tmp_path: Path) -> None:
    modes = example_modes("guide")
    hz = np.geomspace(3, 300, 50)
    model = modal_model(modes, "carriage")
    uneven = SimpleNamespace(**vars(response) | {"frequency_hz": hz, "response": model.frequency_response(hz)})
    sets = read_uff(export([modes, uneven], tmp_path / "all.uff")[0])
    assert {kind: len(one) for kind, one in sets.items()} == {151: 1, 164: 1, 15: 1, 82: 3, 55: 6, 58: 6}
    assert np.allclose(sets[58][0]["x"], hz, rtol=1e-5)
    assert sets[58][0]["rsp_node"] == modes.node_names.index("carriage") + 1


def test_what_a_universal_file_cannot_hold(response: SimpleNamespace, tmp_path: Path) -> None:
    modes = example_modes("guide")
    nan = SimpleNamespace(**vars(response) | {"response": response.response * np.nan})
    with pytest.raises(fx.OptionError, match="not finite"):
        export(nan, tmp_path / "no.uff")
    with pytest.raises(fx.OptionError, match="at least two"):
        export(SimpleNamespace(**vars(response) | {"frequency_hz": [1.0]}), tmp_path / "no.uff")
    with pytest.raises(fx.OptionError, match="one mechanism"):
        export([modes, example_modes("xy_stage")], tmp_path / "no.uff")
    with pytest.raises(fx.OptionError, match="not of a FullOrderModel"):
        export([modes, modes.model], tmp_path / "no.uff")
    odd = SimpleNamespace(**vars(response) | {"name": "ä\n" * 90, "outputs": (Channel("µ", "voltage"),) * 3})
    assert read_uff(export(odd, tmp_path / "odd.uff")[0])[58][0]["ordinate_spec_data_type"] == 1
    assert [path.name for path in tmp_path.iterdir()] == ["odd.uff"]


SENSED = """
flexura: 1
name: sensed cantilever
damping: 0.02
nodes: {root: [0, 0, 0], tip: [100 mm, 0, 0], foot: [100 mm, 0, -20 mm]}
links:
  beam:
    nodes: [root, tip]
    material: Al-6061-T6
    section: {shape: rectangle, width: 10 mm, thickness: 2 mm}
    reference: z
    elements: 4
actuators:
  coil: {type: force, nodes: [tip], direction: -z}
  twist: {type: moment, nodes: [tip], direction: [0, 3, 4]}
  stack: {type: piezo, nodes: [foot, tip], stiffness: 1 N/um}
  floor: {type: base, direction: -z}
sensors:
  gap: {type: displacement, nodes: [tip], direction: z}
  slanted: {type: acceleration, nodes: [tip], direction: [0, 3, 4]}
  gyroscope: {type: angular_velocity, nodes: [tip], direction: -y}
  between: {type: displacement, nodes: [root, tip], direction: z}
  load_cell: {type: force, actuator: stack}
ground: {root: clamped, foot: clamped}
"""


def axes_of(dataset: dict, number: int) -> np.ndarray:
    """Axes of a node, rows, from the three points that dataset 18 has of them."""
    k = [int(n) for n in dataset["cs_num"]].index(number)
    o, x, z = (np.array(dataset[key][k]) for key in ("ref_o", "x_point", "xz_point"))
    y = np.cross(z - o, x - o)
    return np.stack([x - o, y, np.cross(x - o, y)])


@pytest.mark.parametrize("with_model", [True, False])
def test_described_channels_are_at_their_nodes_and_in_their_directions(with_model: bool, tmp_path: Path) -> None:
    mechanism = fx.loads(SENSED)
    model = fx.assemble(mechanism)
    inputs, outputs = (
        ["coil", "twist", "stack", "floor", "tip.ty"],
        ["gap", "slanted", "gyroscope", "between", "load_cell"],
    )
    response = fx.frequency_response(mechanism, frequency_hz=np.linspace(5, 50, 10), inputs=inputs, outputs=outputs)
    sets = read_uff(export(response, tmp_path / "s.uff", geometry=model if with_model else None)[0])
    found = {one["id2"].split()[1]: one for one in sets[58]}
    ends = {name: (one["rsp_node"], one["rsp_dir"]) for name, one in found.items()}
    ends |= {one["id3"].split()[1]: (one["ref_node"], one["ref_dir"]) for one in sets[58]}
    tip, n = ends["gap"][0], len(model.plan.topology.node_names)
    if with_model:
        assert tip == model.plan.topology.node_names.index("tip") + 1 and max(sets[15][0]["node_nums"]) == n + 1
    assert ends["gap"] == (tip, 3) and ends["coil"] == (tip, -3) and ends["tip.ty"] == (tip, 2)
    assert ends["gyroscope"] == (tip, -5)
    assert ends["between"] == ends["load_cell"] == ends["stack"] == (tip, 0)
    assert ends["floor"][0] != tip and ends["floor"][1] == -3
    # the two oblique ones share a direction, and so a node beside the tip: along its x, and about it
    assert ends["slanted"][0] == ends["twist"][0] != tip and (ends["slanted"][1], ends["twist"][1]) == (1, 4)
    own = ends["slanted"][0]
    axes = axes_of(sets[18][0], own)
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-5) and np.linalg.det(axes) > 0
    assert np.allclose(axes[0], [0, 0.6, 0.8], atol=1e-5)
    numbers = [int(k) for k in sets[15][0]["node_nums"]]
    at = {k: [sets[15][0][c][numbers.index(k)] for c in "xyz"] for k in (tip, own)}
    assert at[tip] == at[own] == pytest.approx([0.1, 0, 0])
    systems = dict(zip(numbers, (int(k) for k in sets[15][0]["disp_cs"]), strict=True))
    assert systems[own] == own and systems[tip] == 0
    assert found["between"]["id4"].startswith("response from root to tip")
    ids = [(one["id4"].strip(), one["id5"].strip()) for one in sets[58]]
    assert ids[0] == ("NONE", "NONE") and ids[2] == ("NONE", "reference from foot to tip")
    assert ids[-3] == ("response from foot to tip", "reference from foot to tip")


def test_a_response_reads_back_where_it_was(tmp_path: Path) -> None:
    response = fx.frequency_response(
        fx.loads(SENSED), frequency_hz=np.linspace(5, 50, 10), inputs=["coil", "twist"], outputs=["slanted", "gap"]
    )
    (frf,) = fx.read_measurement(export(response, tmp_path / "s.uff")[0]).frfs
    said = {c.name: c for c in (*frf.outputs, *frf.inputs)}
    for channel in (*response.outputs, *response.inputs):
        assert said[channel.name].quantity == channel.quantity
        assert said[channel.name].direction == pytest.approx(channel.direction, abs=1e-5)
        assert said[channel.name].position == pytest.approx((0.1, 0, 0), abs=1e-9)


def test_a_channel_between_two_nodes_is_announced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    (tmp_path / "s.yaml").write_text(SENSED, encoding="utf-8")
    words = [
        "export",
        str(tmp_path / "s.yaml"),
        "--out",
        str(tmp_path / "s.uff"),
        "--what",
        "response",
        "--band",
        "5,50 Hz",
    ]
    monkeypatch.setattr("sys.argv", ["flexura", *words, "-i", "coil", "-o", "gap", "-o", "between"])
    with pytest.raises(SystemExit, match="0"):
        main()
    out = " ".join(capsys.readouterr().out.split())
    assert "between acts between root and tip" in out and "gap acts" not in out


TURNED = """
flexura: 1
name: turned arm
substructures:
  arm:
    nodes: {a: [0, 0, 0], b: [50 mm, 0, 0]}
    interface: [a, b]
    links:
      l: {nodes: [a, b], material: Al-7075-T6, section: {shape: circle, diameter: 2 mm}, reference: z}
    sensors: {s: {type: displacement, nodes: [b], direction: x}}
instances:
  one: {of: arm, at: [100 mm, 0, 0], rotate: {axis: z, angle: 90 deg}}
ground: {one.a: clamped}
"""


def test_a_place_follows_its_instance() -> None:
    """A copy turned by a quarter turn about z, whose sensor along its own x is along y."""
    (channel,) = fx.system(fx.loads(TURNED), inputs=["one.b.tz"], outputs=["one.s"], order="full").outputs
    assert channel.node == "one.b" and channel.against is None
    assert channel.direction == pytest.approx((0, 1, 0), abs=1e-12)
    assert channel.position == pytest.approx((0.1, 0.05, 0), abs=1e-12)
    assert channel == Channel("one.s", "displacement")
