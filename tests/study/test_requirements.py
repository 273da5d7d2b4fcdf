"""Requirements of a file, and what they ask: displacements by commands and forces, the worst of a stroke."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flexura as fx
from helpers.shell import flexura

GUIDE = """\
flexura: 1
name: guide
parameters: {length: {value: 60 mm, minimum: 20 mm}, thickness: {value: 0.5 mm, minimum: 0.1 mm}}
nodes: {a: [0, 0, 0], b: [0, 0, length], c: [50 mm, 0, 0], d: [50 mm, 0, length]}
flexures:
  left: &leaf
    {nodes: [a, b], material: spring-steel, reference: x, corrections: none, profile: {type: leaf, width: 20 mm,
    thickness: thickness}}
  right: {<<: *leaf, nodes: [c, d]}
bodies:
  carriage: {centre: [25 mm, 0, length], mass: 40 g, inertia: [10 kg*mm^2, 10 kg*mm^2, 10 kg*mm^2], carries: [b, d]}
ground: {a: clamped, c: clamped}
motion: {move: {carriage: {x: [-1 mm, 2 mm]}}, steps: 7}
"""


def guide(more: str = "") -> fx.Mechanism:
    return fx.loads(GUIDE + more)


def value(model, text, **parameters) -> float:
    found = fx.questions(model, text).values(parameters)
    assert not found.reason[0], found.reason[0]
    return float(found.value[0, 0])


def test_a_force_displaces_what_its_stiffness_says_and_more_as_far_as_the_path_goes():
    plain = guide()
    stiffness = value(plain, "stiffness(carriage.x)")
    assert value(plain, "shift(x) under 1 mN along x") == pytest.approx(1e-3 / stiffness, rel=1e-6)
    far = fx.stroke(plain, loads={"carriage": [[0.0] * 6, [20.0, 0, 3.0, 0, 0.1, 0]]}, steps=2).poses[-1]
    asked = "under 20 N along carriage.x, 3 N along carriage.z, 0.1 N*m along carriage.ry"
    for component, axis in enumerate(("x", "y", "z", "rx", "ry", "rz")):
        moved = value(plain, f"shift(carriage.{axis}) {asked}")
        assert moved == pytest.approx(far.displacement["carriage"][component], rel=1e-7, abs=1e-13)
    assert value(plain, f"f1 {asked}") == pytest.approx(far.frequency_hz[0], rel=1e-7)


def test_a_pose_of_a_file_may_be_that_of_a_force():
    posed = guide("at: {carriage: {Fx: 20 N, z: -0.02 mm}}\n")
    there = fx.stroke(
        guide(), move={"carriage.z": -2e-5}, loads={"carriage": [20.0, 0, 0, 0, 0, 0]}, n=2, steps=2
    ).poses[-1]
    assert fx.modes(posed, n=1, order="full").modes[0].frequency_hz == pytest.approx(there.frequency_hz[0], rel=1e-6)
    assert fx.loads(fx.dumps(posed)) == posed
    with pytest.raises(fx.ModelError, match="carriage2"):
        guide("at: {carriage2: {Fx: 20 N}}\n")


def test_a_guide_sinks_by_three_fifths_of_its_stroke_squared_over_its_length():
    """Awtar and Slocum 2007, J. Mech. Des. 129, eq. 16: of leaves that are clamped at both ends."""
    sunk = value(guide(), "parasitic(carriage.x) at x = 2 mm")
    assert sunk == pytest.approx(0.6 * 2e-3**2 / 60e-3, rel=5e-3)
    assert value(guide(), "parasitic(carriage.z) at x = 2 mm") == pytest.approx(sunk, rel=1e-12)
    heavy = guide("gravity: -z\n")  # what weight does is not what the drive does
    assert value(heavy, "parasitic(carriage.z) at x = 2 mm") == pytest.approx(sunk, rel=1e-2)


def test_a_pivot_goes_across_its_axis_as_the_point_where_its_leaves_cross():
    pivot = fx.load("examples/pivot/pivot.yaml")
    turned = fx.stroke(pivot, move={"arm.ry": 0.2}, nodes=["arm"], steps=2).poses[-1].displacement["arm"]
    arm = np.array([0.0, 0.0, -(20e-3 / np.sqrt(2) + 10e-3)])  # from the centre of the arm to where the leaves cross
    moved = np.array(turned[:3]) + (Rotation.from_rotvec(turned[3:]).as_matrix() - np.eye(3)) @ arm
    shift = value(pivot, "centre_shift(arm.ry) at arm.ry = 0.2 rad")
    assert shift == pytest.approx(float(np.hypot(moved[0], moved[2])), rel=1e-6)
    with pytest.raises(fx.OptionError, match="of a rotation"):
        fx.questions(pivot, "centre_shift(arm.x) at arm.ry = 0.2 rad")


def test_the_worst_of_a_stroke_is_that_of_its_poses():
    plain = guide()
    poses = fx.stroke(plain).poses
    margins = [pose.stress_margin for pose in poses if pose.stress_margin is not None]
    assert value(plain, "margin over stroke") == pytest.approx(min(margins), rel=1e-7)
    assert value(plain, "worst f1 over stroke") == pytest.approx(min(p.frequency_hz[0] for p in poses), rel=1e-7)
    largest = max(abs(pose.reaction["carriage.x"]) for pose in poses)
    assert abs(value(plain, "force(carriage.x) over stroke")) == pytest.approx(largest, rel=1e-7)


def test_the_worst_is_sought_between_poses():
    found = fx.formula(guide(), "shift(x) * (1.3 mm - shift(x)) over stroke")
    assert float(found.values({})[0]) == pytest.approx(0.65e-3**2, rel=1e-9)
    required = fx.requirements(guide("requirements: {far: shift(x) * (1.3 mm - shift(x)) <= 1 mm^2 over stroke}\n"))
    [own] = required.requirements
    assert own.where == "at carriage.x = 0.65 mm" and own.poses > 7 and own.unsettled < 1e-15


def test_the_worst_of_commands_is_at_one_of_their_corners():
    stage = fx.load("examples/amplifier/amplifier.yaml")
    ends = [value(stage, f"shift(output.z) at piezo = {x} um") for x in (0, 30)]
    assert value(stage, "shift(output.z) over commands") == pytest.approx(max(ends, key=abs), rel=1e-9)
    with pytest.raises(fx.OptionError, match="no actuator has a range"):
        fx.questions(guide(), "stress over commands")


@pytest.mark.parametrize(
    "text",
    [
        "shift(carriage.x) under 20 N along carriage.x",
        "stress under 20 N along carriage.x, 0.1 N*m along carriage.ry",
        "f2 under 20 N along carriage.x",
        "parasitic(carriage.x) at carriage.x = 1.5 mm",
        "stress over stroke",
        "f2 - 3 * f1 over stroke",
        "parasitic(carriage.z) over stroke",
    ],
)
def test_slopes_are_exact(text):
    asked, names = fx.formula(guide(), text), ["thickness", "length"]
    found = asked.slopes({}, names)
    assert asked.questions.slopes({}, names).is_exact.all()
    for slope, (name, size) in zip(found.slope, (("thickness", 5e-4), ("length", 6e-2)), strict=True):
        around = asked.values({name: size * (1 + 1e-3 * np.array([-2.0, -1.0, 1.0, 2.0]))})
        by_differences = (around @ np.array([1.0, -8.0, 8.0, -1.0])) / (12e-3 * size)
        assert slope == pytest.approx(by_differences, rel=2e-6)


def test_slopes_follow_a_stroke_that_its_parameters_move():
    moved = fx.loads(GUIDE.replace("[-1 mm, 2 mm]", "[-1 mm, length / 30]"))
    asked = fx.formula(moved, "shift(carriage.x) over stroke")
    assert asked.slopes({}, ["length"]).slope == pytest.approx([1 / 30], rel=1e-6)


def test_commands_have_exact_slopes():
    asked = fx.questions(
        fx.load("examples/amplifier/amplifier.yaml"), "shift(output.z) at piezo = 20 um, f1 at piezo = 20 um"
    )
    found = asked.slopes({}, ["leaf_thickness"])
    size = float(asked.plan.parameter_values({})["leaf_thickness"])
    around = asked.values({"leaf_thickness": size * (1 + 1e-3 * np.array([-2.0, -1.0, 1.0, 2.0]))}).value
    assert found.is_exact.all()
    assert found.slope[:, 0] == pytest.approx(np.array([1.0, -8.0, 8.0, -1.0]) @ around / (12e-3 * size), rel=1e-5)


REQUIRED = """\
requirements:
  first mode: f1 >= 20 Hz
  close: f1 >= 53.5 Hz
  light: 45 g >= mass
  straight: parasitic(carriage.x) <= 1 um over stroke
  ratio: stiffness(carriage.y) / stiffness(carriage.x) >= 10
  apart: f2 >= 3 * f1 over stroke
  buckles: buckling >= 3 under 5 kN along carriage.z
"""


def test_each_requirement_is_met_missed_or_not_known():
    mechanism = guide(REQUIRED)
    found = fx.requirements(mechanism)
    verdicts = {own.name: own.verdict for own in found.requirements}
    hertz = fx.modes(mechanism, n=1, order="full")
    low, high = hertz.model_errors.low[0], hertz.model_errors.high[0]
    f1 = hertz.modes[0].frequency_hz
    assert f1 * (1 + low) < 53.5 < f1 * (1 + high), "the example straddles its limit"
    expected = {"first mode": "met", "close": "not known", "straight": "missed", "ratio": "met", "apart": "met"}
    assert {name: verdicts[name] for name in expected} == expected
    assert verdicts["light"] == ("met" if fx.check(mechanism).mass.mass <= 0.045 else "missed")
    told = {own["name"]: own for own in found.to_dict()["requirements"]}
    assert told["straight"]["where"] == "at carriage.x = 2 mm" and told["straight"]["unit"] == "m"
    assert (
        told["straight"]["value"] == pytest.approx(0.6 * 2e-3**2 / 60e-3, rel=5e-3)
        and told["straight"]["limit"] == 1e-6
    )
    assert told["close"]["model_error"] == pytest.approx([low, high], rel=1e-6)
    lower, upper = told["close"]["interval"]
    assert lower <= f1 * (1 + 1e-9) and f1 * (1 - 1e-9) <= upper
    assert {w.place for w in found.warnings} == {name for name, verdict in verdicts.items() if verdict != "met"}


def test_what_cannot_be_worked_out_is_not_known():
    [own] = fx.requirements(guide("requirements: {far: margin >= 1 at x = 100 mm}\n")).requirements
    assert own.verdict == "not known" and own.reason
    assert fx.requirements(guide()).requirements == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("f1 >= 20", "one dimension"),
        ("f1 > 20 Hz", "is no relation"),
        ("speed >= 2 m", "is no quantity"),
        ("f1 >= 20 Hz over night", "`over` is followed by stroke or commands"),
        ("f1 >= 20 Hz over commands", "no actuator has a range"),
        ("f1 >= 20 Hz under 3 kg along carriage.x", "it is in N"),
        ("f1 >= 20 Hz under 3 N along wagon.x", "there is no node 'wagon'"),
        ("f1 >= 20 Hz at piezo = 3 V", "is no displacement"),
        ("f1 >= 20 Hz at carriage.x = 3 V", "a length is expected"),
        ("f1 >= 20 Hz at carriage.x = 1 mm over stroke", "one of a pose, `over` and a disturbance"),
        ("parasitic(x) <= 1 um", "is of a pose"),
        ("shift(x) <= 1 um", "nothing loads this mechanism"),
        ("reach(x) >= 1 mm at x = 1 mm", "is not known at a pose"),
        ("reach(x) >= 1 mm over stroke", "is not known at a pose; leave `over` out"),
    ],
)
def test_a_requirement_that_cannot_be_asked_is_refused_by_its_name(text, words):
    with pytest.raises(fx.OptionError, match="(?s)requirements, 'wrong'.*" + words.replace("(", "\\(")):
        fx.requirements(guide(f"requirements: {{wrong: {text!r}}}\n"))


def test_what_is_beyond_its_limit_where_something_is_required_is_said():
    asked = "requirements: {far: parasitic(x) <= 20 mm at x = 25 mm, over: f1 >= 1 Hz over stroke, rest: f1 >= 1 Hz}\n"
    found = fx.requirements(guide(asked))
    assert [own.verdict for own in found.requirements] == ["met"] * 3
    yields = [own for own in found.warnings if own.kind == "stress"]
    margin = value(guide(), "margin at x = 25 mm")
    assert margin < 1 and [own.value for own in yields] == [pytest.approx(1 / margin, rel=1e-6)]
    assert yields[0].text.startswith("far at carriage.x = 25 mm: ")


def test_requirements_that_contradict_each_other_are_refused():
    with pytest.raises(fx.OptionError, match="'fast' and 'slow' contradict"):
        fx.requirements(guide("requirements: {fast: f1 >= 60 Hz, slow: 50 Hz >= f1}\n"))
    fx.requirements(guide("requirements: {fast: f1 >= 50 Hz, slow: 60 Hz >= f1}\n"))


def test_studies_take_requirements_without_saying_them_twice():
    mechanism = guide("requirements: {first: f1 >= 60 Hz, straight: parasitic(x) <= 50 um at x = 2 mm}\n")
    table = fx.sweep(mechanism, vary="thickness=0.4mm:0.7mm:4", ask="mass")
    f1, parasitic = (table.to_columns()[name] for name in ("f1 [Hz]", "parasitic(carriage.x) at carriage.x = 2 mm [m]"))
    met = [own.met for own in table.requirement_counts]
    assert met == [int((f1 >= 60).sum()), int((parasitic <= 5e-5).sum()), int(((f1 >= 60) & (parasitic <= 5e-5)).sum())]
    assert 0 < met[0] < 4
    alone = fx.sweep(mechanism, vary="thickness=0.4mm:0.7mm:4", ask="mass", requirements=False)
    assert alone.requirements == alone.requirement_counts == ()
    spread = fx.tolerance(mechanism, vary="thickness=± 0.05 mm", require="f1 >= 60 Hz", samples=256, indices=False)
    assert [own.text for own in spread.yields] == ["f1 >= 60 Hz", "parasitic(x) <= 50 um at x = 2 mm", "all of them"]
    best = fx.optimize(mechanism, vary="length=40mm:80mm", minimise="mass - 1 kg * f1 / 1 GHz", starts=2)
    assert best.subject_to == tuple(mechanism.requirements.values())
    assert value(mechanism, "f1", length=best.variables[0].value) >= 60 * (1 - 1e-6)
    nominal = fx.requirements(mechanism).to_dict()["requirements"]
    for study in (table, spread):
        assert study.to_dict()["requirements"] == nominal
    [first, straight] = fx.requirements(mechanism, best.optimum).requirements
    assert best.requirements == (first, straight) and straight.value != nominal[1]["value"]


def test_a_check_ends_with_them_and_its_exit_says_whether_they_are_met(tmp_path):
    file = tmp_path / "guide.yaml"
    file.write_text(GUIDE + "requirements: {first: f1 >= 20 Hz, light: mass <= 1 g}\n")
    shown = flexura("check", file)
    assert shown.returncode == 0 and "light: mass <= 1 g" in shown.stdout and "missed" in shown.stdout
    strict = flexura("check", file, "--strict")
    assert strict.returncode == 1 and "light is missed" in strict.stderr
    data = json.loads(flexura("check", file, "--json").stdout)["requirements"]
    assert [own["verdict"] for own in data] == ["met", "missed"]
    file.write_text(GUIDE + "requirements: {first: f1 >= 20 Hz}\n")
    assert flexura("check", file, "--strict").returncode == 0


def test_relations_with_per_are_fractions():
    assert fx.relation(guide(), "compliance(x) <= 5 mm per 1 N").right.values({})[0] == pytest.approx(5e-3)
