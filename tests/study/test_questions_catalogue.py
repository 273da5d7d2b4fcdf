"""Every name that may be asked gives what the verb itself returns."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import plan_of
from flexura.study.questions import questions
from helpers.over import over

EXAMPLES = Path(__file__).parents[2] / "examples"


def load(name):
    return fx.load(EXAMPLES / f"{name}.yaml")


TEXT = (EXAMPLES / "guide" / "guide.yaml").read_text()
GUIDE = load("guide/guide")
HUNG = fx.loads(TEXT + "\ngravity: [0, 0, -9.81 m/s^2]\nloads: {carriage: {force: [1 N, 0, -20 N]}}\n")
POSE = "at carriage.x = 2 mm, carriage.y = 0 mm"


def one(model, asked, parameters=None):
    found = questions(model, asked).values(parameters or {})
    assert found.reason[0] == ""
    return float(found.value[0, 0])


def node_compliance(model, node="carriage"):
    return fx.compliance(model, nodes=[node])


@pytest.mark.parametrize("model", [GUIDE, HUNG], ids=["bare", "hung"])
def test_stiffness_and_compliance_are_those_of_the_verb(model):
    C = node_compliance(model)
    for k, axis in enumerate(("x", "y", "z", "rx", "ry", "rz")):
        assert one(model, f"compliance(carriage.{axis})") == pytest.approx(C[k, k], rel=1e-9)
        assert one(model, f"stiffness({axis})") == pytest.approx(1 / C[k, k], rel=1e-9)
    assert one(model, "compliance(carriage.x, carriage.ry)") == pytest.approx(C[0, 4], rel=1e-9)
    both = fx.compliance(model, nodes=["carriage", "leaf1.head"])
    assert one(model, "compliance(leaf1.head.z, carriage.ry)") == pytest.approx(both[8, 4], rel=1e-9)


def test_units_of_compliances_and_couplings():
    asked = questions(load("rpr/rpr_piezo"), "compliance(platform.rx,platform.z),compliance(platform.x, platform.rz)")
    assert [own.unit for own in asked.quantities] == ["rad/N", "m/(N*m)"]
    asked = questions(load("tip_tilt/tip_tilt"), ["stiffness(mirror.rx)", "stiffness(mirror.z)"])
    assert [own.unit for own in asked.quantities] == ["N*m/rad", "N/m"]


def test_coupling_and_amplification_are_those_of_kinetostatics():
    model = load("rpr/rpr_piezo")
    verb = fx.kinetostatics(model)
    assert len(verb.inputs) == 4
    for k, into in enumerate(verb.inputs[:2]):
        for c, axis in enumerate(("x", "y", "z", "rx", "ry", "rz")):
            found = one(model, f"coupling({into.name}, {verb.platform}.{axis})")
            assert found == pytest.approx(verb.coupling[c, k], rel=1e-8, abs=0)
        command = np.eye(len(verb.inputs))[k]
        wanted = verb.amplification(command)
        found = [one(model, f"amplification({into.name}, {verb.platform}.{axis})") for axis in ("x", "y", "z", "rx")]
        np.testing.assert_allclose(found, wanted[:4], rtol=1e-8)


def test_stresses_and_margins_are_those_of_statics():
    verb = fx.statics(HUNG).stresses()
    assert one(HUNG, "stress") == pytest.approx(max(m.von_mises for m in verb.members), rel=1e-12)
    assert one(HUNG, "margin") == pytest.approx(verb.factor_to_yield, rel=1e-12)
    for name in ("leaf1", "leaf1.blade"):
        assert one(HUNG, f"stress({name})") == pytest.approx(verb["leaf1.blade"].von_mises, rel=1e-12)
        assert one(HUNG, f"margin({name})") == pytest.approx(verb["leaf1.blade"].factor_to_yield, rel=1e-12)
    assert one(HUNG, "stress(leaf*)") == one(HUNG, "stress")
    assert one(HUNG, "stress('leaf*')") == one(HUNG, 'stress("leaf*")') == one(HUNG, "stress(leaf*)")


def test_loads_change_frequencies_and_buckle():
    assert one(HUNG, "buckling") == pytest.approx(fx.preload(HUNG).buckling_factor, rel=1e-9)
    found = questions(HUNG, "f1, f2").values({})
    verb = fx.modes(HUNG, n=2, order="full")
    np.testing.assert_allclose(found.value[0], [mode.frequency_hz for mode in verb.modes], rtol=1e-9)
    assert found.is_proven[0]
    assert one(HUNG, "f1") < 0.999 * one(GUIDE, "f1")


def test_what_is_asked_at_a_pose_is_that_of_a_stroke():
    pose = fx.stroke(GUIDE, move={"carriage.x": 2e-3, "carriage.y": 0.0}, n=3, nodes=["carriage"], compliance=True)
    [at], stresses = pose.poses, pose.stresses(0)
    assert one(GUIDE, f"force(x) {POSE}") == pytest.approx(at.reaction["carriage.x"], rel=1e-9)
    assert one(GUIDE, f"stiffness(carriage.x) {POSE}") == pytest.approx(at.drive_stiffness["carriage.x"], rel=1e-7)
    held = at.compliance_held["carriage"]
    assert one(GUIDE, f"stiffness(z) {POSE}") == pytest.approx(1 / held[2, 2], rel=1e-8)
    assert one(GUIDE, f"compliance(rx, z) {POSE}") == pytest.approx(
        held[3, 2], rel=1e-6, abs=1e-6 * np.sqrt(held[3, 3] * held[2, 2])
    )
    assert one(GUIDE, f"stress {POSE}") == pytest.approx(max(m.von_mises for m in stresses.members), rel=1e-8)
    assert one(GUIDE, f"margin(leaf2) {POSE}") == pytest.approx(stresses["leaf2.blade"].factor_to_yield, rel=1e-8)
    assert one(GUIDE, f"buckling {POSE}") == pytest.approx(at.buckling_factor, rel=1e-6)
    found = questions(GUIDE, f"f1 {POSE}, f3 {POSE}, f(carriage.x) {POSE}").values({})
    np.testing.assert_allclose(found.value[0], np.array(at.frequency_hz)[[0, 2, 0]], rtol=1e-9)
    assert found.is_proven[0]
    assert (found.lower[0] <= found.value[0]).all()
    assert (found.value[0] <= found.upper[0]).all()


def test_a_compliance_at_a_pose_holds_its_other_displacements():
    """Of the flexibility with all free, by the formula of condensation."""
    there = fx.at(GUIDE, {"carriage.x": 2e-3, "carriage.y": 1e-5})
    pose = "at x = 2 mm, y = 0.01 mm"
    C = node_compliance(there)
    of_x = C[0, 0] - C[0, 1] ** 2 / C[1, 1]
    assert one(GUIDE, f"compliance(x) {pose}") == pytest.approx(of_x, rel=1e-6)
    assert one(GUIDE, f"compliance(x, y) {pose}") == pytest.approx(C[0, 1], rel=1e-6)
    held = C[4, 4] - C[4, [0, 1]] @ np.linalg.solve(C[np.ix_([0, 1], [0, 1])], C[[0, 1], 4])
    assert one(GUIDE, f"compliance(ry) {pose}") == pytest.approx(held, rel=1e-6)


def test_what_a_pose_holds_has_no_compliance():
    rigid = fx.loads(TEXT.replace("    carries:", "    elastic: false\n    carries:"))
    found = questions(rigid, "stiffness(leaf1.head.y) at y = 0.01 mm, rx = 0 mrad, rz = 0 mrad").values({})
    assert np.isnan(found.value[0, 0])
    assert "held" in found.reason[0]


def test_couplings_and_responses_at_a_pose_are_about_it():
    there = fx.at(GUIDE, {"carriage.x": 2e-3})
    assert one(GUIDE, "coupling(carriage.z, x) at x = 2 mm") == pytest.approx(node_compliance(there)[0, 2], rel=1e-8)
    ends = {"inputs": ["carriage.tx"], "outputs": ["carriage.tz"], "order": "full", "method": "direct"}
    verb = fx.frequency_response(there, frequency_hz=[30.0], **ends)
    assert one(GUIDE, "frf(z, x, 30 Hz) at x = 2 mm") == pytest.approx(abs(verb.response[0, 0, 0]), rel=1e-9)


def test_responses_at_a_pose_where_parts_are_too_stiff_for_low_orders():
    model = load("rpr/rpr_piezo")
    asked = "frf(platform.x, upr1.c.piezo, 20 Hz) at platform.x = 0.1 mm"
    there = fx.at(model, {"platform.x": 1e-4})
    ends = {"inputs": ["upr1.c.piezo"], "outputs": ["platform.tx"]}
    verb = fx.frequency_response(there, frequency_hz=[20.0], order="full", **ends)
    assert one(model, asked) == pytest.approx(abs(verb.response[0, 0, 0]), rel=1e-6)


def test_a_stroke_is_along_the_described_motion():
    model = fx.loads(TEXT + "\nmotion: {move: {carriage: {x: [-3 mm, 3 mm]}}, steps: 7}\n")
    asked = questions(model, "stress(leaf1) at stroke 2 mm, force(x) at stroke = -2 mm")
    assert asked.columns == ("stress(leaf1) at carriage.x = 2 mm [Pa]", "force(carriage.x) at carriage.x = -2 mm [N]")
    assert asked.values({}).value[0, 0] == one(GUIDE, "stress(leaf1) at carriage.x = 2 mm")


def test_responses_are_those_of_the_verb():
    damped = fx.loads(TEXT + "\ndamping: {ratio: 0.01}\n")
    verb = fx.frequency_response(
        damped, frequency_hz=[40.0, 55.0], inputs=["carriage.tx"], outputs=["carriage.tx:acceleration"], order="full"
    )
    for f, value in zip((40, 55), abs(verb.response[:, 0, 0]), strict=True):
        assert one(damped, f"frf(carriage.x:acceleration, carriage.x, {f} Hz)") == pytest.approx(value, rel=1e-7)
    f1, k = one(damped, "f1"), one(damped, "stiffness(x)")
    peak = one(damped, "frf_peak(x, x, 0.03 kHz, 100 Hz)")
    # one mode of ratio z: 1 / (2 z sqrt(1 - z^2)) over its stiffness, which is nearly all of it
    assert peak == pytest.approx(1 / (k * 2 * 0.01 * np.sqrt(1 - 1e-4)), rel=0.01)
    around = fx.frequency_response(
        damped,
        frequency_hz=f1 * (1 + np.linspace(-5e-3, 5e-3, 401)),
        inputs=["carriage.tx"],
        outputs=["carriage.tx"],
        order="full",
    )
    assert peak == pytest.approx(abs(around.response).max(), rel=1e-5)
    assert [own.unit for own in questions(damped, "frf(x,x,1 Hz), frf(x:acceleration,rz,1 Hz)").quantities] == [
        *("m/N", "(m/s^2)/(N*m)")
    ]


def test_a_peak_that_nothing_damps_is_infinite_and_no_number():
    found = questions(GUIDE, "frf_peak(x, x, 30 Hz, 100 Hz), f1").values({})
    assert np.isnan(found.value[0, 0])
    assert "nothing damps" in found.reason[0]
    assert np.isfinite(found.value[0, 1])


def test_at_its_reach_something_yields():
    found = one(GUIDE, "reach(carriage.x)")
    [pose] = fx.stroke(GUIDE, move={"carriage.x": found}, n=1).poses
    assert pose.stress_margin == pytest.approx(1, rel=1e-6)
    [pose] = fx.stroke(GUIDE, move={"carriage.x": -0.999 * found}, n=1).poses
    assert 1 < pose.stress_margin < 1.01


def test_a_reach_is_found_where_stress_does_not_rise_at_first():
    """A bar on the carriage that its own forces stretch is stressed most until the leaves are."""
    bar = """
nodes: {tail: [0, 0, length + 5 mm], nose: [30 mm, 0, length + 5 mm]}
links:
  bar:
    nodes: [tail, nose]
    material: spring-steel
    section: {shape: rectangle, width: 5 mm, thickness: 5 mm}
    reference: z
    elements: 1
loads: {nose: {force: [2 kN, 0, 0]}, tail: {force: [-2 kN, 0, 0]}}
"""
    found = one(fx.loads(TEXT.replace('["leaf*.head"]', '["leaf*.head", tail]') + bar), "reach(carriage.x)")
    assert found == pytest.approx(one(GUIDE, "reach(carriage.x)"), rel=2e-3)


def test_a_reach_without_a_yield_stress_is_told():
    bare = fx.loads(
        TEXT.replace("material: spring-steel", "material: plain")
        + "\nmaterials: {plain: {E: 200 GPa, nu: 0.3, rho: 7800 kg/m^3}}\n"
    )
    for asked in ("reach(x)", "margin at x = 1 mm", "margin(leaf1) at x = 1 mm"):
        with pytest.raises(fx.OptionError, match="yield stress"):
            questions(bare, asked)


def test_a_pose_that_is_not_reached_fails_by_itself():
    found = questions(GUIDE, "f1, stress at x = 70 mm").values({"thickness": [4e-4, 5e-4]})
    assert np.isfinite(found.value[:, 0]).all()
    assert np.isnan(found.value[:, 1]).all()
    assert all("no equilibrium" in why for why in found.reason)


def test_loads_that_buckle_a_design_fail_it_alone():
    heavy = fx.loads(TEXT + "\nloads: {carriage: {force: [0, 0, -100 N]}}\n")
    found = questions(heavy, "f1, stress, buckling, mass").values({"thickness": [1e-4, 5e-4]})
    assert np.isnan(found.value[0, :2]).all()
    assert found.value[0, 2] < 1
    assert "buckl" in found.reason[0]
    assert np.isfinite(found.value[1]).all()
    assert found.reason[1] == ""


@pytest.mark.parametrize(
    "asked", ["f(x), stiffness(x), compliance(x, ry)", "stress at x = 1 mm, f1 at x = 1 mm, frf(x, x, 20 Hz), reach(x)"]
)
def test_answers_one_by_one_do_not_depend_on_neighbours(asked):
    plan = plan_of(GUIDE)
    designs = {"thickness": np.array([4e-4, 5e-4, 6e-4]), "length": np.array([0.05, 0.06, 0.07])}
    together = questions(plan, asked).values(designs).value
    for order in ([2, 0], [1], [0, 0, 1]):
        some = questions(plan, asked).values({name: own[order] for name, own in designs.items()}).value
        assert np.array_equal(some, together[order])


@over(
    ("text", "said"),
    [
        ("stress", "nothing loads"),
        ("margin(leaf1)", "nothing loads"),
        ("buckling", "nothing loads"),
        ("stress(leaf3) at x = 1 mm", "did you mean"),
        ("force(x)", "is of a pose"),
        ("force(y) at x = 1 mm", "along its own displacements, carriage.x"),
        ("reach(x) at x = 1 mm", "not known at a pose"),
        ("mass at x = 1 mm", "same at every pose"),
        ("frf(x, x)", r"frf\(OUTPUT, INPUT, HZ\)"),
        ("frf(x, x, 20)", "unit of '20' is missing; write 20 Hz"),
        ("frf(x, x, 20 rad/s)", "in Hz or kHz"),
        ("frf(x, x, 2 mm)", "in Hz or kHz"),
        ("frf(x, motor, 20 Hz)", "no input"),
        ("frf(x:speed, x, 20 Hz)", "displacement, velocity, acceleration"),
        ("frf_peak(x, x, 20 Hz, 10 Hz)", "lower frequency"),
        ("coupling(ground.tx, x)", "accelerates the base"),
        ("parameter(thicknes)", "did you mean thickness"),
        ("compliance(x, y, z)", r"compliance\(NODE.DOF\[, NODE.DOF\]\)"),
    ],
)
def test_what_cannot_be_asked_is_told_why(text, said):
    with pytest.raises(fx.OptionError, match=said):
        questions(GUIDE, text)


def test_amplitudes_of_superelements_are_no_displacements():
    with pytest.raises(fx.OptionError, match=r"amplitudes 1 to 2 holds .* nodes: carriage, tip, leaf1\.head"):
        questions(load("imported/guide"), "compliance(leaf1.part amplitudes 1 to 2.x)")


def test_a_design_without_a_finite_size_fails_alone():
    model = fx.loads(TEXT.replace("width: width,", "width: width*sqrt(1 - (length/70 mm)^2),"))
    asked = "f1, stiffness(x), force(x) at x = 1 mm"
    found = questions(model, asked).values({"length": [0.05, 0.08, 0.06]})
    assert np.isnan(found.value[1]).all()
    assert found.reason[1]
    assert np.isfinite(found.value[[0, 2]]).all()
    assert list(found.reason[[0, 2]]) == ["", ""]
    alone = questions(model, asked).values({"length": [0.05]})
    assert np.array_equal(alone.value[0], found.value[0])
