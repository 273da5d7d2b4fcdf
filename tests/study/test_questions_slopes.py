"""Derivatives of what is asked, against closed forms and against differences of high order of the verbs."""

import re
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.study.questions import formula, questions, relation

EXAMPLES = Path(__file__).parents[2] / "examples"
TEXT = (EXAMPLES / "guide" / "guide.yaml").read_text().replace("    carries:", "    elastic: false\n    carries:")
GUIDE = fx.loads(TEXT)
HUNG = fx.loads(TEXT + "\ngravity: [0, 0, -9.81 m/s^2]\nloads: {carriage: {force: [1 N, 0, -20 N]}}\n")
NAMES = ("length", "width", "thickness", "distance")
AT = {"thickness": 4.8e-4}
"""Where differences of the width and thickness do not leave the widths over thickness that roots are known of."""

BLOCK = """
flexura: 1
parameters:
  kx: {value: 200 N/mm}
  ky: {value: 200 N/mm}
  m: {value: 2 kg}
bodies:
  stage: {centre: [0, 0, 0], mass: m, inertia: [4 g*m^2, 4 g*m^2, 4 g*m^2]}
springs:
  all:
    nodes: [stage]
    stiffness: {tx: kx, ty: ky, tz: 500 N/mm, rx: 901 N*m/rad, ry: 1200 N*m/rad, rz: 1500 N*m/rad}
"""


def eighth_order(value, at, step):
    """The derivative of a function by differences of eighth order (Fornberg 1988)."""
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    return sum(w * (value(at + k * step) - value(at - k * step)) for k, w in weights.items()) / step


@pytest.mark.parametrize("model", [GUIDE, HUNG], ids=["bare", "hung"])
def test_slopes_of_frequencies_are_those_of_full_order_modes(model):
    found = questions(model, "f1, f4, f(carriage.x)").slopes(AT, NAMES)
    assert found.is_exact.all()
    at = {"length": 0.06, "width": 0.02, "thickness": 4.8e-4, "distance": 0.05}
    for p, name in enumerate(NAMES):

        def hertz(value, name=name):
            own = fx.modes(model, {**AT, name: value}, n=4, order="full").modes
            return np.array([own[k].frequency_hz for k in (0, 3, 0)])

        np.testing.assert_allclose(found.slope[:, p], eighth_order(hertz, at[name], 0.01 * at[name]), rtol=2e-6)


@pytest.mark.parametrize("model", [GUIDE, HUNG], ids=["bare", "hung"])
def test_slopes_of_stiffness_and_compliance_are_those_of_the_verb(model):
    asked = "stiffness(x), compliance(carriage.x, carriage.ry), compliance(leaf1.head.z, ry)"
    found = questions(model, asked).slopes(AT, NAMES)
    assert found.is_exact.all()
    at = {"length": 0.06, "width": 0.02, "thickness": 4.8e-4, "distance": 0.05}
    for p, name in enumerate(NAMES):

        def read(value, name=name):
            C = fx.compliance(model, {**AT, name: value}, nodes=["carriage", "leaf1.head"])
            return np.array([1 / C[0, 0], C[0, 4], C[8, 4]])

        wanted = eighth_order(read, at[name], 0.01 * at[name])
        np.testing.assert_allclose(found.slope[:, p], wanted, rtol=1e-5, atol=1e-9 * abs(found.value).max())


def test_slopes_of_masses_are_those_of_density_times_volume():
    found = questions(GUIDE, "mass, mass(carriage), thickness, parameter(length)").slopes({}, ["thickness", "length"])
    rho, w, L, t = 7850, 0.02, 0.06, 5e-4
    np.testing.assert_allclose(found.slope, [[2 * rho * w * L, 2 * rho * w * t], [0, 0], [1, 0], [0, 1]], rtol=1e-12)
    assert found.is_exact.all()


def test_frequencies_of_a_block_on_springs_have_closed_slopes():
    """f = sqrt(k / m) / 2 pi."""
    found = questions(fx.loads(BLOCK), "f(stage.x), f(stage.y)").slopes({"ky": 3e5}, ["kx", "ky", "m"])
    fx_, fy = (np.sqrt(k / 2) / (2 * np.pi) for k in (2e5, 3e5))
    np.testing.assert_allclose(found.slope, [[fx_ / 4e5, 0, -fx_ / 4], [0, fy / 6e5, -fy / 4]], rtol=1e-9, atol=1e-12)
    assert found.repeated == ()


def test_frequencies_that_coincide_are_one_group():
    model = fx.loads(BLOCK)
    found = questions(model, "mass, f2, f1, f(stage.x)").slopes({}, ["kx", "ky", "m"])
    assert found.repeated == ((1, 2, 3),)
    [space] = found.directional
    f = np.sqrt(2e5 / 2) / (2 * np.pi)
    for direction, wanted in (
        ([1, 0, 0], [0, f / 4e5]),
        ([0, 1, 0], [0, f / 4e5]),
        ([1, 1, 0], [f / 4e5, f / 4e5]),
        ([1, -1, 0], [-f / 4e5, f / 4e5]),
        ([0, 0, 1], [-f / 4, -f / 4]),
    ):
        np.testing.assert_allclose(np.linalg.eigvalsh(space @ np.array(direction)), wanted, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(found.slope[2, :2], [0, 0], atol=1e-15)
    assert np.isnan(found.slope[3]).all()
    assert "no derivative by itself" in found.reason[3]


def test_slopes_of_formulas_follow_the_chain_rule():
    model = fx.loads(BLOCK)
    names, at = ["kx", "ky", "m"], {"ky": 3e5}
    parts = questions(model, "f1, f2, mass").slopes(at, names)
    (f1, f2, m), (d1, d2, dm) = parts.value, parts.slope
    for text, value, slope in (
        ("f2 - f1", f2 - f1, d2 - d1),
        ("2*f1*mass", 2 * f1 * m, 2 * (d1 * m + f1 * dm)),
        ("sqrt(f1^2 + f2^2)", np.hypot(f1, f2), (f1 * d1 + f2 * d2) / np.hypot(f1, f2)),
        ("min(f1, f2) + max(mass, 1 kg)/1 kg*1 Hz", f1 + m, d1 + dm),
        ("3 Hz", 3.0, np.zeros(3)),
    ):
        found = formula(model, text).slopes(at, names)
        assert found.value == pytest.approx(value, rel=1e-12)
        np.testing.assert_allclose(found.slope, slope, rtol=1e-9, atol=1e-18)
    own = relation(model, "f1 >= 20 Hz").slopes(at, names)
    assert own.value == pytest.approx(f1 / 20 - 1)
    np.testing.assert_allclose(own.slope, d1 / 20, rtol=1e-12)


def test_a_choice_between_equal_numbers_has_no_slope_by_what_parts_them():
    found = formula(fx.loads(BLOCK), "max(kx, ky)").slopes({}, ["kx", "m"])
    assert np.isnan(found.slope[0])
    same = formula(fx.loads(BLOCK), "max(2*m, m + m)").slopes({}, ["kx", "m"])
    np.testing.assert_allclose(same.slope, [0, 2])


def test_names_that_cannot_move_are_errors():
    asked = questions(GUIDE, "f1")
    for names, said in ((["thicknes"], "not a parameter"), (["width", "width"], "twice"), ([], "at least one")):
        with pytest.raises(fx.OptionError, match=said):
            asked.slopes({}, names)


UNDAMPED = "\n".join(line for line in TEXT.splitlines() if not line.startswith("damping"))
RESPONSES = (("carriage.tx", 30.0), ("carriage.tx", 47.2), ("carriage.tx:velocity", 60.0), ("carriage.ry", 300.0))


def solved(model, at, asked, into):
    """Magnitudes of responses (output, Hz) to an input by the verb, solved directly at full order."""
    outputs, hz = list(dict.fromkeys(out for out, _ in asked)), [hz for _, hz in asked]
    own = fx.frequency_response(
        model, at, frequency_hz=hz, inputs=[into], outputs=outputs, order="full", method="direct"
    )
    return np.array([abs(own.response[k, outputs.index(out), 0]) for k, (out, _) in enumerate(asked)])


def test_slopes_of_responses_are_those_of_the_dynamic_stiffness():
    damping = "{loss_factor: 0.02, rayleigh: {frequencies: [40 Hz, 400 Hz], ratios: [0.01, 0.02]}}"
    model = fx.loads(f"{UNDAMPED}\ndamping: {damping}\n")
    found = questions(model, [f"frf({out}, x, {hz} Hz)" for out, hz in RESPONSES]).slopes(AT, NAMES)
    assert found.is_exact.all()
    at = {"length": 0.06, "width": 0.02, "thickness": 4.8e-4, "distance": 0.05}
    for p, name in enumerate(NAMES):
        read = lambda x, name=name: solved(model, {**AT, name: x}, RESPONSES, "carriage.tx")  # noqa: E731
        wanted = eighth_order(read, at[name], 2e-4 * at[name])
        size = abs(found.value / at[name])
        assert (abs(found.slope[:, p] - wanted) < 1e-6 * np.maximum(abs(wanted), size)).all()


def test_the_peak_of_one_mode_has_the_slopes_of_its_closed_form():
    """A block of mass m on a spring k with a ratio z peaks at F / (2 k z sqrt(1 - z^2))."""
    model = fx.loads(BLOCK + "damping: {ratio: 0.05}\n")
    found = questions(model, "frf_peak(stage.x, stage.x, 20 Hz, 100 Hz), frf(x, x, 30 Hz)").slopes(
        {}, ["kx", "m", "ky"]
    )
    assert found.is_exact.all()
    peak = 1 / (2 * 2e5 * 0.05 * np.sqrt(1 - 0.05**2))
    assert found.value[0] == pytest.approx(peak, rel=1e-9)
    np.testing.assert_allclose(found.slope[0], [-peak / 2e5, 0, 0], rtol=1e-9, atol=1e-9 * peak / 2)


def test_the_peak_at_the_end_of_a_band_has_the_slope_there():
    model = fx.loads(BLOCK + "damping: {ratio: 0.05}\n")
    found = questions(model, "frf_peak(x, x, 20 Hz, 30 Hz), frf(x, x, 30 Hz)").slopes({}, ["kx", "m"])
    np.testing.assert_allclose(found.slope[0], found.slope[1], rtol=1e-12)


DAMPED = BLOCK.replace("parameters:", "parameters:\n  c: {value: 20 kg/s}\n  kp: {value: 80 N/mm}\n  z: {value: 0.05}")
STACK = """
nodes: {wall: [-20 mm, 0, 0]}
ground: {wall: clamped}
actuators: {stack: {type: piezo, nodes: [wall, stage], stiffness: kp, free_stroke: 10 um}}
sensors: {force: {type: force, actuator: stack}}
dashpots: {d: {nodes: [stage], damping: {tx: c}}}
"""
W = 2 * np.pi * 30


def block_on(x):
    """Dynamic stiffness of the block of DAMPED along x."""
    return x["kx"] + 1j * W * x["c"] - W**2 * x["m"]


@pytest.mark.parametrize(
    ("more", "asked", "known"),
    [
        (STACK, "frf(x, x, 30 Hz)", lambda x: 1 / (block_on(x) + x["kp"])),
        (STACK, "frf(x, stack, 30 Hz)", lambda x: x["kp"] / (block_on(x) + x["kp"])),
        (STACK, "frf(force, stack, 30 Hz)", lambda x: x["kp"] - x["kp"] ** 2 / (block_on(x) + x["kp"])),
        (STACK, "frf(force, x, 30 Hz)", lambda x: x["kp"] / (block_on(x) + x["kp"])),
        (
            "dashpots: {d: {nodes: [stage], damping: {tx: c}}}",
            "frf(x:acceleration, ground.tx, 30 Hz)",
            lambda x: 1 + W**2 * x["m"] / block_on(x),
        ),
        (
            "damping: {ratio: z}",
            "frf_peak(x, x, 20 Hz, 99 Hz)",
            lambda x: 1 / (2 * x["kx"] * x["z"] * np.sqrt(1 - x["z"] ** 2)),
        ),
        (
            "damping: {loss_factor: 2*z}",
            "frf(x, x, 30 Hz)",
            lambda x: 1 / (x["kx"] * (1 + 2j * x["z"]) - W**2 * x["m"]),
        ),
    ],
)
def test_responses_of_one_mass_have_the_slopes_of_their_closed_forms(more, asked, known):
    at, names = {"kx": 2e5, "m": 2.0, "c": 20.0, "kp": 8e4, "z": 0.05}, ["kx", "m", "c", "kp", "z"]
    names = names if "stack" in more else ["kx", "m", *(n for n in ("c", "z") if n in more.replace("dashpots", ""))]
    found = questions(fx.loads(DAMPED + more), asked).slopes({}, names)
    assert found.is_exact.all()
    assert found.value[0] == pytest.approx(abs(known(at)), rel=1e-9)
    for p, name in enumerate(names):
        wanted = eighth_order(lambda value, name=name: abs(known({**at, name: value})), at[name], 1e-2 * at[name])
        size = abs(found.value[0]) / at[name]
        assert found.slope[0, p] == pytest.approx(wanted, rel=1e-8, abs=1e-9 * size)


LOSSY = (
    TEXT.replace(
        "parameters:\n", "parameters:\n  c: {value: 3 N*s/m}\n  eta: {value: 0.03}\n  z: {value: 0.01}\n"
    ).replace("        reference: x\n", "        reference: x\n        loss_factor: eta\n")
    + """
gravity: [0, 0, -9.81 m/s^2]
loads: {carriage: {force: [1 N, 0, -20 N]}}
springs: {soft: {nodes: [carriage], stiffness: {tx: 900 N/m, ry: 2 N*m/rad}}}
dashpots:
  between: {nodes: [leaf1.head, carriage], damping: {tx: c, rz: 0.1 N*m*s/rad}}
  ground: {nodes: [carriage], damping: {tx: c}}
damping: {loss_factor: eta/10, rayleigh: {frequencies: [40 Hz, 400 Hz], ratios: [z, 2*z]}}
"""
)


def test_slopes_of_responses_with_all_that_damps_are_those_of_the_dynamic_stiffness():
    """Of the verb with a direct solution: dashpots, loss factors of members and of the rest under loads, Rayleigh's."""
    model = fx.loads(LOSSY)
    at = {"length": 0.06, "thickness": 4.8e-4, "distance": 0.05, "c": 3.0, "eta": 0.03, "z": 0.01}
    asked = (("carriage.tx", 47.2), ("carriage.ry:velocity", 300.0))
    found = questions(model, [f"frf({out}, ground.tx, {hz} Hz)" for out, hz in asked]).slopes(AT, list(at))
    assert found.is_exact.all()
    for p, name in enumerate(at):
        read = lambda x, name=name: solved(model, {**AT, name: x}, asked, "ground.tx")  # noqa: E731
        wanted = eighth_order(read, at[name], 1e-3 * at[name])
        size = abs(found.value / at[name])
        assert (abs(found.slope[:, p] - wanted) < 1e-7 * np.maximum(abs(wanted), size)).all()


def test_slopes_of_responses_by_ratios_are_those_of_their_values():
    """Also where stiffer modes, which the modal sum takes as static, have part in them."""
    own = questions(
        fx.loads(f"{UNDAMPED}\ndamping: {{ratio: 0.01}}\n"), "frf(ry, x, 300 Hz), frf_peak(x, x, 20 Hz, 80 Hz)"
    )
    found = own.slopes(AT, ["length", "thickness"])
    for p, (name, value) in enumerate({"length": 0.06, "thickness": 4.8e-4}.items()):
        wanted = eighth_order(lambda x, name=name: own.values({**AT, name: x}).value[0], value, 5e-4 * value)
        size = abs(found.value / value)
        assert (abs(found.slope[:, p] - wanted) < 1e-7 * np.maximum(abs(wanted), size)).all()


def test_a_response_of_zero_has_no_slope_and_says_so():
    found = questions(GUIDE, "frf(x, y, 30 Hz), frf(x, x, 30 Hz)").slopes({}, ["thickness"])
    assert found.value[0] == 0
    assert np.isnan(found.slope[0, 0])
    assert np.isfinite(found.slope[1, 0])
    assert "it is zero, and has no derivative" in found.reason[0]
    assert not found.reason[1]


def test_slopes_that_are_differences_say_so():
    found = questions(fx.loads(BLOCK + "damping: {ratio: 0.05}\n"), "frf(x, x, 30 Hz) at x = 0 mm, mass").slopes(
        {}, ["kx"]
    )
    assert list(found.is_exact) == [False, True]
    w, f1 = 2 * np.pi * 30, np.sqrt(2e5 / 2)
    Z = 2e5 - 2 * w**2 + 1j * w * 2 * 2 * 0.05 * f1
    slope = (1 + 1j * w * 0.05 / f1) / -(Z**2)
    assert found.slope[0, 0] == pytest.approx((slope * np.conj(1 / Z)).real * abs(Z), rel=1e-6)


@pytest.mark.parametrize("model", [GUIDE, HUNG], ids=["bare", "hung"])
def test_a_reach_moves_so_that_its_stress_stays_that_of_yield(model):
    """The stress at the stroke of other designs is that of the verb."""
    found = questions(model, "reach(x)").slopes(AT, NAMES)
    assert found.is_exact.all()
    at, h = {"length": 0.06, "width": 0.02, "thickness": 4.8e-4, "distance": 0.05}, 1e-3
    for p, name in enumerate(NAMES):

        def excess(step, p=p, name=name):
            stroke = found.value[0] + step * at[name] * found.slope[0, p]
            design = {**AT, name: at[name] * (1 + step)}
            both = [fx.stroke(model, design, move={"carriage.x": own}).stresses(0) for own in (stroke, -stroke)]
            return 1 / min(own.factor_to_yield for own in both) - 1

        assert abs(excess(0.0)) < 1e-8
        assert abs(excess(h) - excess(-h)) / (2 * h) < 1e-5


def test_a_reach_that_yields_at_once_stays_zero():
    text = TEXT + "\nloads: {carriage: {force: [0, 2 kN, 0]}}\n"
    found = questions(fx.loads(text), "reach(x)").slopes({}, ["thickness"])
    assert found.value[0] == 0
    assert found.slope[0, 0] == 0


AMPLIFIER = fx.load(EXAMPLES / "amplifier" / "amplifier.yaml")


@pytest.mark.parametrize("pose", [None, -3e-5], ids=["rest", "pose"])
def test_slopes_of_couplings_are_those_of_kinetostatics(pose):
    names, at = ["rise", "leaf_thickness", "piezo_stiffness"], {"rise": 1.5e-3, "leaf_thickness": 5e-4}
    values = {**at, "piezo_stiffness": 2e7}
    words = "" if pose is None else " at output.z = -30 um"
    asked = [f"{own}(piezo, output.z){words}" for own in ("coupling", "amplification")]
    found = questions(AMPLIFIER, asked).slopes(at, names)
    assert found.is_exact.all()
    posed = questions(AMPLIFIER, asked)
    for p, name in enumerate(names):

        def read(value, name=name):
            if pose is not None:
                return posed.values({**at, name: value}).value[0]
            own = fx.kinetostatics(AMPLIFIER, {**at, name: value}, platform="output", actuators=["piezo"])
            moved = own.coupling[2, 0]
            return np.array([moved, moved / abs(own.elongation[0, 0])])

        np.testing.assert_allclose(found.value, read(values[name]), rtol=1e-9)
        wanted = eighth_order(read, values[name], 2e-3 * values[name])
        atol = 1e-7 * abs(found.value / values[name])
        assert (abs(found.slope[:, p] - wanted) < 1e-6 * abs(wanted) + atol).all()


def test_slopes_along_what_drives_a_pose_are_those_of_strokes():
    asked = ("stiffness(x)", "compliance(x, ry)", "compliance(z, ry)", "stiffness(y)")
    found = questions(GUIDE, [f"{text} at x = 3 mm, y = 0.02 mm" for text in asked]).slopes(AT, NAMES)
    assert found.is_exact.all()
    at = {"length": 0.06, "width": 0.02, "thickness": 4.8e-4, "distance": 0.05}
    for p, name in enumerate(NAMES):

        def read(value, name=name):
            move = {"carriage.x": 3e-3, "carriage.y": 2e-5}
            own = fx.stroke(GUIDE, {**AT, name: value}, move=move, compliance=True).poses[0]
            k = own.drive_stiffness
            return np.array([k["carriage.x"], k["carriage.y"], own.compliance_held["carriage"][2, 4]])

        wanted = eighth_order(read, at[name], 0.01 * at[name])
        got = found.slope[[0, 3, 2], p]
        size = abs(found.value[[0, 3, 2]] / at[name])
        assert (abs(got - wanted) < 1e-6 * abs(wanted) + 1e-5 * size).all()


POSE = "at x = 3 mm, y = 0.02 mm"


def test_slopes_at_a_pose_are_those_of_strokes():
    texts = ("force(y)", "stress(leaf1)", "margin", "stiffness(z)", "compliance(ry, z)", "buckling", "f1", "f3")
    found = questions(GUIDE, [f"{text} {POSE}" for text in texts]).slopes(AT, NAMES)
    assert found.is_exact.all()
    at = {"length": 0.06, "width": 0.02, "thickness": 4.8e-4, "distance": 0.05}
    for p, name in enumerate(NAMES):

        def read(value, name=name):
            move = {"carriage.x": 3e-3, "carriage.y": 2e-5}
            own = fx.stroke(GUIDE, {**AT, name: value}, move=move, n=3, compliance=True)
            [pose], C = own.poses, own.poses[0].compliance_held["carriage"]
            stress = own.stresses(0)
            hertz = np.array(pose.frequency_hz)[[0, 2]]
            numbers = (pose.reaction["carriage.y"], stress["leaf1.blade"].von_mises, stress.factor_to_yield)
            return np.array([*numbers, 1 / C[2, 2], C[4, 2], pose.buckling_factor, *hertz])

        wanted = eighth_order(read, at[name], 0.01 * at[name])
        size = abs(found.value / at[name])
        off = abs(found.slope[:, p] - wanted) / np.maximum(abs(wanted), 1e-3 * size)
        assert off[[0, 1, 2, 3, 6, 7]].max() < 1e-5
        assert off[[4, 5]].max() < 1e-3, "of small differences of large numbers"


def test_slopes_at_a_pose_that_is_not_reached_are_told():
    found = questions(GUIDE, "stress at x = 70 mm, force(x) at x = 70 mm, f1").slopes({}, ["thickness"])
    assert np.isnan(found.value[:2]).all()
    assert np.isnan(found.slope[:2]).all()
    assert all("no equilibrium" in why for why in found.reason[:2])
    assert np.isfinite(found.slope[2]).all()


@pytest.mark.parametrize("pose", ["z = 0.1 mm", "rx = 10 mrad"])
def test_round_off_makes_no_kink_of_members_that_symmetry_stresses_alike(pose):
    plan = fx.Plan(fx.load(EXAMPLES / "rpr" / "rpr.yaml"))
    asked, names = questions(plan, f"stress at platform.{pose}"), ("platform_thickness", "plate", "r_radius", "u_to_r")
    [stress], [slope] = asked.slopes({}, names).value, asked.slopes({}, names).slope
    at = np.array([float(plan.parameter_values()[name]) for name in names])
    side = np.array([-1.0, 1.0]) * 0.01
    designs = {name: np.tile(at[k], 6) for k, name in enumerate(names)}
    for k, name in enumerate(names[1:]):
        designs[name][2 * k : 2 * k + 2] += side * at[k + 1]
    low, high = asked.values(designs).value.reshape(3, 2).T
    assert slope[0] * at[0] == pytest.approx(0, abs=1e-5 * stress), "a rigid platform, as thick as it may be"
    np.testing.assert_allclose(slope[1:] * at[1:], (high - low) / 0.02, atol=3e-4 * stress)


ALIKE = TEXT.replace("centre: [0, 0, length + 5 mm]", "centre: [aside, 0, length + 5 mm]").replace(
    "source: example}\n\nsubst", "source: example}\n  aside: {value: 0 mm}\n  force: {value: 5 N}\n\nsubst"
)


def test_equal_leaves_stressed_alike_have_slopes_where_they_agree_and_sides_where_they_part():
    model = fx.loads(ALIKE + "\nloads: {carriage: {force: [0 N, 0 N, -force]}}\n")
    names = ("width", "thickness", "length", "distance", "force", "aside")
    found = questions(model, "stress, margin").slopes({}, names)
    stress = 5 / (2 * 0.02 * 0.0005)
    np.testing.assert_allclose(found.value[0], stress, rtol=1e-10)
    expected = [-stress / 0.02, -stress / 0.0005, 0, 0, stress / 5]
    np.testing.assert_allclose(found.slope[0, :5], expected, rtol=1e-9)
    np.testing.assert_allclose(found.slope[1, :5] / found.value[1], -np.array(expected) / stress, rtol=1e-9)
    assert np.isnan(found.slope[:, 5]).all()
    assert all("part with aside" in reason and "leaf1.blade, leaf2.blade" in reason for reason in found.reason)


IN_A_ROW = """
flexura: 1
parameters: {t1: 0.5 mm, t2: 0.5 mm, b: 10 mm}
nodes: {a: [0, 0, 0], c: [0, 0, 50 mm]}
bodies:
  m: {centre: [0, 0, 30 mm], mass: 1 g, inertia: [1 g*mm^2, 1 g*mm^2, 1 g*mm^2]}
flexures:
  one: {nodes: [a, m], material: spring-steel, reference: x, profile: {type: leaf, width: b, thickness: t1}}
  two: {nodes: [m, c], material: spring-steel, reference: x, profile: {type: leaf, width: b, thickness: t2}}
ground: {a: clamped}
loads: {c: {force: [0 N, 0 N, 7 N]}}
"""


def test_members_that_part_have_a_slope_on_either_side():
    found = questions(fx.loads(IN_A_ROW), "stress, margin, stress(two)").slopes({}, ("t1", "b", "t2"))
    stress = 7 / (0.01 * 0.0005)
    np.testing.assert_allclose(found.value[[0, 2]], stress, rtol=1e-9)
    np.testing.assert_allclose(found.slope[0, 1], -stress / 0.01, rtol=1e-9)
    assert np.isnan(found.slope[:2, [0, 2]]).all()
    np.testing.assert_allclose(found.slope[2], [0, -stress / 0.01, -stress / 0.0005], rtol=1e-9, atol=1e-9 * stress)
    sides = [
        [float(x) for x in re.findall(r"t1 it is (\S+) upwards and (\S+) downwards", r)[0]] for r in found.reason[:2]
    ]
    np.testing.assert_allclose(sides[0], [0, -stress / 0.0005], rtol=1e-5)
    np.testing.assert_allclose(sides[1], [0, found.value[1] / 0.0005], rtol=1e-5)
    assert "one, two are stressed alike" in found.reason[0]
    assert found.reason[2] == ""


def test_what_cannot_be_answered_leaves_the_rest_its_slopes():
    column = """
flexura: 1
corrections: none
theory: euler_bernoulli
parameters: {L: {value: 100 mm}}
materials: {m: {E: 70 GPa, nu: 0.3, rho: 2700 kg/m^3}}
nodes: {a: [0, 0, 0], b: [L, 0, 0]}
links:
  bar:
    nodes: [a, b]
    material: m
    reference: z
    elements: 4
    section: {shape: constants, A: 20 mm^2, Iy: 2 mm^4, Iz: 600 mm^4, J: 6 mm^4}
ground: {a: clamped}
loads: {b: {force: [-1 N, 0 N, 0 N]}}
"""
    found = questions(fx.loads(column), "stress, buckling").slopes({}, ["L"])
    assert "no stress is known" in found.reason[0] and not found.reason[1]
    assert found.slope[1, 0] * 0.1 / found.value[1] == pytest.approx(-2.0, rel=1e-6)


LIMITED = """
flexura: 1
parameters:
  k: {value: 2 N/mm, minimum: 1 N/mm, maximum: 3 N/mm}
  m: {value: 20 g, minimum: 20 g, maximum: 40 g}
bodies:
  stage: {centre: [0, 0, 0], mass: m, inertia: [4 g*m^2, 4 g*m^2, 4 g*m^2]}
springs:
  all:
    nodes: [stage]
    stiffness: {tx: k, ty: 500 N/mm, tz: 500 N/mm, rx: 901 N*m/rad, ry: 1200 N*m/rad, rz: 1500 N*m/rad}
motion: {move: {stage: {x: [-1 mm, 1 mm]}}, steps: 3}
"""


@pytest.mark.parametrize("k", [1e3, 2e3, 3e3])
def test_slopes_at_a_limit_of_a_parameter_do_not_go_beyond_it(k):
    """f = sqrt(k / m) / 2 pi and, held at a pose, F = k x, at limits of stiffness and mass as between them."""
    found = questions(fx.loads(LIMITED), "worst f1 over stroke, force(stage.x) over stroke")
    own = found.slopes({"k": k, "m": 0.02}, ("k", "m"))
    f = np.sqrt(k / 0.02) / (2 * np.pi)
    assert not any(own.reason)
    np.testing.assert_allclose(own.slope[0], [f / (2 * k), -f / (2 * 0.02)], rtol=1e-5)
    np.testing.assert_allclose(np.abs(own.slope[1]), [1e-3, 0.0], rtol=1e-5, atol=1e-9)
