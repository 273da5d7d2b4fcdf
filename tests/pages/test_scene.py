"""Scenes are what the mechanism and its results are: cells of named parts, motions of nodes, energies and stresses."""

import base64
import json
import re
import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.pages.viewer import Buffer, json_text, quick, scene_and_drawing, scene_of, to_json, to_message
from flexura.pages.viewer.geometry import PAGE, Drawing
from helpers.every_result import guide

EXAMPLES = sorted(Path(__file__).parents[2].glob("examples/*/*.yaml"))
DTYPES = {"f32": "<f4", "u32": "<u4", "i16": "<i2", "u8": "u1"}


def example(name: str) -> fx.Mechanism:
    return fx.load(next(path for path in EXAMPLES if path.stem == name))


def cantilever(**keys) -> fx.Mechanism:
    """A leaf along x, held at its first end."""
    leaf = fx.describe.Leaf(width=5e-3, thickness=0.2e-3)
    own = fx.describe.Flexure(nodes=("root", "tip"), material="spring-steel", reference="y", profile=leaf, elements=20)
    nodes = {"root": (0.0, 0.0, 0.0), "tip": (0.05, 0.0, 0.0)}
    return fx.Mechanism(**({"name": "leaf"} | keys), nodes=nodes, flexures={"leaf": own}, ground={"root": "clamped"})


def decoded(buffer: dict, message: bytes = b"") -> np.ndarray:
    """What a buffer stands for, by the description of the format alone."""
    if "data" in buffer:
        raw = zlib.decompress(base64.b64decode(buffer["data"]))
    else:
        raw = message[buffer["offset"] : buffer["offset"] + buffer["bytes"]]
    stored = np.frombuffer(raw, DTYPES[buffer["dtype"]]).reshape(buffer["shape"])
    return stored * buffer["scale"] if "scale" in buffer else stored


@pytest.fixture(scope="module", params=EXAMPLES, ids=lambda path: path.stem)
def modes(request):
    return fx.modes(fx.load(request.param))


def test_every_cell_belongs_to_one_part(modes):
    scene = json.loads(json_text(to_json(scene_of(modes))))
    points = decoded(scene["points"])
    for cells in ("triangles", "lines", "dots"):
        own = decoded(scene[cells])
        ranges = sorted(part[cells] for part in scene["parts"])
        ends = np.cumsum([count for _, count in ranges if count])
        assert [first for first, count in ranges if count] == [0, *ends[:-1]] if len(ends) else len(own) == 0
        assert len(own) == (ends[-1] if len(ends) else 0)
        assert own.max(initial=0) < len(points)
    names = {(part["name"], part["kind"]) for part in scene["parts"]}
    assert len(names) == len(scene["parts"]) and {kind for _, kind in names} == {own["key"] for own in scene["kinds"]}


def test_every_member_and_body_is_there_by_name(modes):
    plan = modes.model.plan
    wanted = {
        ".".join((*path, key))
        for name, part in plan.parts.items()
        for path in plan.topology.copies[name].paths
        for key in (*part.members, *part.bodies, *part.springs, *part.points, *part.superelements)
    }
    names = {part.name for part in scene_of(modes).parts}
    assert wanted <= names


def test_energies_sum_to_one_and_pages_are_small(modes):
    scene = scene_of(modes)
    for motion in scene.motions:
        energy = motion.by_part[0]
        assert energy.label == "strain energy" and len(energy.values) == len(scene.parts)
        told = sum(float(text.split()[0]) for text in energy.values if text)
        unsaid = sum(not text for text in energy.values)
        assert 100 * (1 - 5e-4 * unsaid) - 0.5 < told < 100.5
    assert len(json_text(to_json(scene))) < 300_000


def test_named_nodes_move_as_the_mode_says(modes):
    scene = json.loads(json_text(to_json(scene_of(modes))))
    points, dots, names = decoded(scene["points"]), decoded(scene["dots"]), list(modes.node_names)
    seen = 0
    for k, motion in enumerate(scene["motions"]):
        moved = decoded(motion["displacement"])
        step = 0.51 * motion["displacement"]["scale"]
        for part in scene["parts"]:
            if part["kind"] == "node":
                at = dots[part["dots"][0]]
                node = names.index(part["name"])
                assert points[at] == pytest.approx(modes.model.positions[node], abs=1e-7)
                assert moved[at] == pytest.approx(modes.shapes[node, :3, k], abs=step)
                seen += 1
    assert seen or not any(part["kind"] == "node" for part in scene["parts"])


def test_frequencies_are_those_of_the_result():
    modes = fx.modes(example("rpr"))
    scene = scene_of(modes)
    for mode, error, motion in zip(modes.modes, modes.model_errors.texts, scene.motions, strict=True):
        assert dict(motion.facts)["model error"] == error
        assert motion.title == f"mode {mode.number}: {mode.frequency_text}" and motion.flag == mode.flag
        lower, upper = mode.interval_hz
        told = dict(motion.facts)["proven to be"]
        assert told == f"from {lower:.7g} to {upper:.7g} Hz, {(upper - lower) / upper:.1g} of it wide"


def test_what_is_not_proven_is_flagged():
    modes = fx.modes(example("guide"), n=3)
    first = replace(modes.modes[0], missed=True, interval_hz=(None, None), is_indexed=False)
    said = [fx.Diagnostic("proof", place, 1.0, 0.0, "1", f"of {place or 'all'}") for place in ("mode 1", "mode 3", "")]
    scene = scene_of(replace(modes, modes=(first, *modes.modes[1:]), warnings=tuple(said)))
    assert [motion.flag for motion in scene.motions] == ["not proven", "", ""]
    assert scene.motions[0].warnings == ("of mode 1", "of all") and scene.motions[1].warnings == ("of all",)
    facts = dict(scene.motions[0].facts)
    assert "(not proven)" in facts["frequency"] and "proven to be" not in facts


def test_a_rigid_translation_moves_everything_alike():
    model = fx.assemble(example("rpr"))
    u = np.zeros((model.plan.topology.n_nodes, 6))
    u[:, :3] = 1e-3, -2e-3, 3e-3
    moved = Drawing.of(model).moved(u).motions
    assert moved == pytest.approx(np.broadcast_to([1e-3, -2e-3, 3e-3], moved.shape), abs=1e-15)


def test_stress_is_that_of_the_members():
    mechanism = example("guide")
    state = fx.statics(mechanism, loads={"carriage": [1.0, 0, 0, 0, 0, 0]})
    scene = scene_of(state)
    motion = scene.motions[0]
    colour = next(own for own in motion.colours if own.key == "stress")
    most = max(member.von_mises for member in state.stresses().members)
    assert colour.largest == pytest.approx(most, rel=1e-12)
    told = dict(zip([part.name for part in scene.parts], motion.by_part[0].values, strict=True))
    assert motion.by_part[0].label == "largest stress"
    for member in state.stresses().members:
        number, unit = told[member.name].split()
        assert float(number) * {"MPa": 1e6, "kPa": 1e3, "Pa": 1.0}[unit] == pytest.approx(member.von_mises, rel=1e-3)
    assert motion.largest == pytest.approx(np.linalg.norm(state.displacement("carriage")[:3]), rel=0.05)
    arrow = motion.arrows[0]
    assert arrow.direction == (1.0, 0.0, 0.0) and arrow.label == "carriage: 1 N"


def test_energy_density_is_highest_where_a_cantilever_is_held():
    state = fx.statics(cantilever(), loads={"tip": [0, 0, 1.0, 0, 0, 0]})
    scene, drawing = scene_and_drawing(state)
    colour = next(own for own in scene.motions[0].colours if own.key == "energy")
    share = decoded(to_json(colour.values))
    x = drawing.solids.points[:, 0]
    known = colour.values.stored < 255
    held = share[known & (x < 1e-9)]
    tip = share[known & (x > x[known].max() - 1e-9)]
    assert held.min() == 1.0 and tip.max() < 0.05


def test_a_message_holds_the_same():
    scene = scene_of(fx.modes(example("guide")))
    message = to_message(vars(scene))
    length = struct.unpack("<I", message[:4])[0]
    header, told = json.loads(message[4 : 4 + length]), to_json(scene)
    assert length % 4 == 0
    for name in ("points", "triangles", "lines", "dots"):
        assert header[name]["offset"] % 4 == 0
        assert (decoded(header[name], message) == decoded(told[name])).all()
    own, other = header["motions"][0]["displacement"], told["motions"][0]["displacement"]
    assert (decoded(own, message) == decoded(other)).all()
    end = max(buffer["offset"] + buffer["bytes"] for buffer in (own, header["points"], header["dots"]))
    assert end <= len(message)
    assert to_message({"a": 1})[4:].strip() == b'{"a": 1}'


def test_fields_keep_what_they_hold():
    values = np.random.default_rng(3).normal(size=(50, 3)) * 1e-9
    own = to_json(Buffer.field(values))
    assert decoded(own) == pytest.approx(values, abs=0.51 * own["scale"])
    assert np.abs(values).max() / own["scale"] == pytest.approx(32767)
    nothing = to_json(Buffer.field(np.zeros((2, 3))))
    assert (decoded(nothing) == 0).all()
    shares = Buffer.shares(np.array([np.nan, 0.0, 2.0, 4.0]), 4.0)
    assert shares.stored.tolist() == [255, 0, 127, 254]


def test_other_sizes_go_the_quick_way():
    mechanism = example("amplifier")
    scene, drawing = scene_and_drawing(fx.modes(mechanism))
    modes = fx.modes(mechanism, {"leaf_thickness": 0.4e-3, "rise": 2e-3})
    found = quick(drawing, modes.model, modes.shapes[:, :, 0])
    assert found is not None
    own, buffers = found
    whole = scene_of(modes)
    assert (buffers["points"].stored == whole.points.stored).all()
    assert (buffers["displacement"].stored == whole.motions[0].displacement.stored).all()
    assert (whole.triangles.stored == scene.triangles.stored).all()
    assert (own.solids.points != drawing.solids.points).any()


def test_other_parts_want_a_scene_of_their_own():
    drawing = Drawing.of(fx.assemble(example("guide")))
    other = fx.assemble(example("pivot"))
    assert quick(drawing, other, np.zeros((other.plan.topology.n_nodes, 6))) is None


HOSTILE = ["</script><b>", "\"'{{x}}", "🙂", "a & b"]


@pytest.mark.parametrize("title", HOSTILE)
def test_names_come_through(title):
    own = json_text(to_json(scene_of(cantilever(name=title))))
    assert json.loads(own)["name"] == title and "<" not in own


@pytest.mark.parametrize(("push", "flag"), [(0.5, ""), (2.0, "loaded beyond")])
def test_the_shapes_in_which_it_buckles_are_motions(push, flag):
    """A column that is held at one end buckles in 1 - cos(pi x / 2 L), the next time in 1 - cos(3 pi x / 2 L)."""
    state = fx.preload(cantilever(), loads={"tip": (-1.0, 0, 0, 0, 0, 0)})
    state = fx.preload(cantilever(), loads={"tip": (-push * state.buckling_factor, 0, 0, 0, 0, 0)})
    scene = scene_of(state)
    preload, *motions = scene.motions
    points = decoded(json.loads(json_text(to_json(scene)))["points"])
    assert preload.id == "preload" and [own.group for own in motions] == ["buckling"] * 3
    assert f"{1 / push:.3g} times these loads" in motions[0].title and motions[0].flag == flag
    x = points[:, 0] / 0.05
    for k, own in enumerate(motions[:2]):
        u = decoded(json.loads(json_text(to_json(own)))["displacement"])[:, 1]
        shape = 1 - np.cos((k + 0.5) * np.pi * x)
        assert (u @ shape) ** 2 / ((u @ u) * (shape @ shape)) > 0.999
        assert own.nature == "vibration" and own.largest is None and own.factor > 0


def test_what_does_not_buckle_has_no_shapes():
    pulled = scene_of(fx.preload(cantilever(), loads={"tip": (1.0, 0, 0, 0, 0, 0)}))
    assert [own.id for own in pulled.motions] == ["preload"]


def test_modes_of_a_solid_stand_beside_those_of_the_beams():
    result = fx.verify(guide(), n=3, size=2.0)
    scene = scene_of(result)
    by_id = {own.id: own for own in scene.motions}
    row = next(own for own in result.rows if own.model == result.shapes.label)
    paired = [k + 1 for k, mac in enumerate(row.mac) if mac is not None]
    assert paired and set(by_id) == {*(f"solid-{k}" for k in (1, 2, 3)), *(f"beams-{k}" for k in paired)}
    for k in paired:
        one, other = (decoded(to_json(by_id[f"{what}-{k}"].displacement)).ravel() for what in ("solid", "beams"))
        assert one @ other > 0.95 * np.linalg.norm(one) * np.linalg.norm(other)
        assert f"{row.mac[k - 1]:.4f}" in by_id[f"solid-{k}"].subtitle
        assert float(by_id[f"solid-{k}"].title.split()[-2]) == pytest.approx(result.frequency_hz[k - 1], rel=1e-3)
    assert any("solid" in note for note in scene.notes)
    with pytest.raises(fx.OptionError, match="solid has not been solved"):
        scene_of(replace(result, shapes=None))


def zigzag(count: int) -> fx.Mechanism:
    """So many leaves, one after another."""
    leaf = fx.describe.Leaf(width=5e-3, thickness=0.2e-3)
    nodes = {f"p{k}": (0.01 * k, 0.0, 0.05 * (k % 2)) for k in range(count + 1)}
    flexures = {
        f"leaf{k}": fx.describe.Flexure(
            nodes=(f"p{k}", f"p{k + 1}"), material="spring-steel", reference="y", profile=leaf, elements=1
        )
        for k in range(count)
    }
    return fx.Mechanism(name="zigzag", nodes=nodes, flexures=flexures, ground={"p0": "clamped"})


def test_what_is_too_large_is_thinned_and_said():
    count = PAGE.most + 500
    scene = scene_of(zigzag(count))
    flexures = [part for part in scene.parts if part.kind == "flexure"]
    assert len(flexures) == PAGE.most
    assert scene.notes[0] == f"{PAGE.most} of {count} members are drawn"
    assert "lines" in scene.notes[1] and sum(part.triangles[1] for part in flexures) == 0
    assert len(json_text(to_json(scene))) < 1_500_000


def test_what_is_not_too_large_is_whole():
    assert scene_of(zigzag(40)).notes == ()


def test_doubts_stand_at_their_places():
    mechanism = fx.load(next(path for path in EXAMPLES if path.stem == "start"))
    report = fx.check(mechanism)
    scene = scene_of(mechanism, report)
    low, high = (np.array(corner) for corner in scene.bounds)
    margin = 0.1 * scene.size
    assert len(scene.marks) + sum(note.startswith("warning: ") for note in scene.notes) >= len(report.clashes)
    assert scene.marks
    for mark in scene.marks:
        assert (
            mark.severity == "doubt" and (np.array(mark.at) >= low - margin).all() and (mark.at <= high + margin).all()
        )
    flagged = {part.name for part in scene.parts if part.kind.startswith("flagged")}
    assert flagged
    told = {part.name: [value for name, value in part.facts if name == "warning"] for part in scene.parts}
    for mark in scene.marks:
        assert mark.text.partition(": ")[2] in " ".join(told[mark.part])
        first, said = re.split(r", | and |: ", mark.text)[0], mark.label.partition(": ")[2].rstrip("…")
        assert len(mark.label) <= 48 and mark.label.startswith(first) and said and said in mark.text


def test_freedoms_turn_about_their_axes():
    mechanism = example("rpr_piezo")
    found = fx.kinetostatics(mechanism)
    scene = scene_of(mechanism, found)
    assert [motion.axes[0].direction for motion in scene.motions] == [own.axis.direction for own in found.freedoms]
    assert scene.motions[0].title == "freedom 1: rotation of platform"
    assert [motion.axes[0].pitch is None for motion in scene.motions] == [own.kind == "T" for own in found.freedoms]


def test_spaces_have_axes_of_what_is_free_and_arrows_of_what_is_borne():
    found = fx.free(example("pivot"))
    [body], [motion] = found.bodies, scene_of(found).motions
    [axis] = motion.axes
    assert motion.title == "arm: rotation" and motion.nature == "vibration"
    assert (axis.direction, axis.pitch) == (body.freedom.screws[0].axis.direction, 0.0)
    assert [arrow.label for arrow in motion.arrows] == [own.kind for own in body.constraint.screws]
    assert ("free in", "rotation") in motion.facts
    between = scene_of(fx.free(example("pivot"), between=("arm", "ground")))
    assert [motion.nature for motion in between.motions] == ["displacement"]  # which does not move


def test_poses_of_a_stroke_are_true_to_scale():
    result = fx.stroke(example("guide"), move={"carriage.x": (0.0, 2e-3)}, steps=5, n=1)
    scene = scene_of(result)
    assert [motion.factor for motion in scene.motions] == [1.0] * 5
    assert scene.sequences[0].motions == tuple(motion.id for motion in scene.motions)
    assert scene.sequences[0].values == pytest.approx([0, 0.5, 1.0, 1.5, 2.0]) and scene.sequences[0].unit == "mm"
    assert scene.motions[-1].largest == pytest.approx(2e-3, rel=0.05)
    stress = [next((c for c in motion.colours if c.key == "stress"), None) for motion in scene.motions]
    assert len({own.largest for own in stress if own is not None}) == 1


def test_many_poses_are_fewer_and_said():
    result = fx.stroke(example("guide"), move={"carriage.x": (0.0, 1e-3)}, steps=25, n=1)
    scene = scene_of(result)
    assert len(scene.motions) < 25 and f"{len(scene.motions)} of 25 poses of the stroke are shown" in scene.notes
    assert scene.motions[0].title.startswith("pose 1:") and scene.motions[-1].title.startswith("pose 25:")


def test_what_has_no_place_is_refused():
    mechanism = example("guide")
    for wrong in (3, "guide.yaml", None, [mechanism]):
        with pytest.raises(fx.OptionError, match="no place in a scene"):
            scene_of(wrong)
    with pytest.raises(fx.OptionError, match="holds no mechanism"):
        scene_of(fx.check(mechanism))
    with pytest.raises(fx.OptionError, match="of one design"):
        scene_of(mechanism, fx.modes(example("rpr")))


def test_a_picture_stands_in():
    scene = scene_of(example("guide"), picture=True)
    assert scene.picture is not None and scene.picture.startswith("data:image/png;base64,")
    assert base64.b64decode(scene.picture.partition(",")[2]).startswith(b"\x89PNG")


def test_parts_of_one_name_tell_their_own_facts():
    d = fx.describe
    named = {
        "springs": {"tip_x": d.Spring(nodes=("tip",), stiffness=d.DiagonalStiffness(tx=2.0))},
        "dashpots": {"tip_x": d.Dashpot(nodes=("tip",), damping=d.DiagonalDamping(tx=3.0, ry=0.5))},
        "stops": {"tip_x": d.Stop(nodes=("tip",), direction="x", gap=1e-3, stiffness=2e6, damping=0.5)},
        "sensors": {"tip_x": d.MotionSensor(type="displacement", nodes=("tip",), direction="x")},
    }
    own = scene_of(cantilever(**named))
    labels = {kind.key: kind.label for kind in own.kinds}
    told = {labels[part.kind]: dict(part.facts) for part in own.parts if part.name == "tip_x"}
    assert told["spring"] == {"kind": "spring", "stiffness tx": "2 N/m", "between": "tip and ground"}
    damping = {"damping tx": "3 N s/m", "damping ry": "0.5 N m s/rad"}
    assert told["dashpot"] == {"kind": "dashpot", **damping, "between": "tip and ground"}
    stop = {"gap": "1 mm", "stiffness": "2 N/µm", "damping": "0.5 s/m"}
    assert told["stop"] == {"kind": "stop", **stop, "between": "tip and ground"}
    assert told["sensor"] == {"kind": "sensor: displacement", "at": "tip"}
