"""What is warmer expands: free, clamped, bent and buckled, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import flexura as fx
from flexura.errors import ModelError, OptionError
from helpers.over import over

ALPHA, E, L, B, H = 23e-6, 70e9, 0.1, 0.01, 1e-3
BAR = """
flexura: 1
name: bar
corrections: none
materials: {m: {E: 70 GPa, nu: 0.3, rho: 2700 kg/m^3, expansion: 23 um/m/K, softening: -400 um/m/K}}
sections: {s: {shape: rectangle, width: 10 mm, thickness: 1 mm}}
nodes: {a: [0, 0, 0], b: [100 mm, 0, 0]}
links: {bar: {nodes: [a, b], section: s, material: m, reference: z, elements: 12}}
ground: GROUND
temperatures:
  hot: {bar: 10 K}
  bowed: {bar: {gradient: [0, 0, 0.1 K/mm]}}
  along: {bar: {temperature: 2 K, gradient: [0.1 K/mm, 0, 0]}}
"""


def bar(ground="{a: clamped}"):
    return fx.loads(BAR.replace("GROUND", ground))


def asked(model, *texts):
    found = fx.questions(model, list(texts)).values({})
    assert not any(found.reason[0]) if hasattr(found, "reason") else True
    return found.value[0]


def test_a_free_bar_expands_without_stress():
    """Uniform, along it, and across it: elongation, and the circle that a gradient bends it to."""
    model = bar()
    x, along, z, turned = asked(
        model, "drift(b.x, hot)", "drift(b.x, along)", "drift(b.z, bowed)", "drift(b.ry, bowed)"
    )
    assert x == pytest.approx(ALPHA * 10 * L, rel=1e-7)
    assert along == pytest.approx(ALPHA * 2 * L, rel=1e-7)
    assert turned == pytest.approx(ALPHA * 100 * L, rel=1e-6)
    assert z == pytest.approx(-ALPHA * 100 * L**2 / 2, rel=1e-6)
    assert asked(model, "drift(b.x)")[0] == pytest.approx(ALPHA * L, rel=1e-7)
    for state in ("hot", "bowed", "along"):
        assert asked(model, f"stress at {state} = 1")[0] < 1.0  # Pa


def test_a_clamped_bar_is_stressed_and_buckles():
    """E alpha dT, at any length; and 4 pi^2 E I / L^2 (Timoshenko and Gere 1961, section 2.2)."""
    model = bar("{a: clamped, b: clamped}")
    stress, factor = asked(model, "stress at hot = 0.1", "buckling at hot = 0.1")
    assert stress == pytest.approx(E * (1 - 4e-4) * ALPHA, rel=1e-3)
    critical = 4 * np.pi**2 * H**2 / 12 / L**2 / ALPHA  # K
    assert factor == pytest.approx(critical, rel=5e-3)


def test_the_frequency_of_what_is_free_follows_moduli_and_size():
    """f is as the root of E times a length."""
    cold, hot = asked(bar(), "f1 at hot = 1e-6", "f1 at hot = 1")
    assert hot / cold == pytest.approx(np.sqrt((1 - 4e-3) * (1 + 10 * ALPHA)), rel=1e-6)


def test_the_frequency_of_what_is_clamped_falls_by_its_force():
    """E I w(4) + P w(2) = rho A omega^2 w between clamps, with P = E A alpha dT and E softer by 0.4 %."""
    modulus, inertia, area = E * (1 - 4e-3), B * H**3 / 12, B * H
    bending, force = modulus * inertia, modulus * area * ALPHA * 10

    def determinant(hz):
        middle = force / (2 * bending)
        root = np.hypot(middle, 2 * np.pi * hz * np.sqrt(2700 * area / bending))
        a, b = np.sqrt(root - middle) * L, np.sqrt(root + middle) * L
        return 2 * a * b * (1 - np.cosh(a) * np.cos(b)) + (a**2 - b**2) * np.sinh(a) * np.sin(b)

    expected = brentq(determinant, 150.0, 400.0)
    assert asked(bar("{a: clamped, b: clamped}"), "f1 at hot = 1")[0] == pytest.approx(expected, rel=2e-3)


BIMETAL = """
flexura: 1
name: bimetal
materials:
  steel: {E: 200 GPa, nu: 0, rho: 7800 kg/m^3, expansion: 11 um/m/K}
  brass: {E: 100 GPa, nu: 0, rho: 8500 kg/m^3, expansion: 19 um/m/K}
nodes: {a: [0, 0, 0], b: [100 mm, 0, 0]}
flexures:
  strip:
    nodes: [a, b]
    material: steel
    reference: z
    elements: 8
    profile:
      type: layered
      width: 10 mm
      layers: [{thickness: 1 mm, material: steel}, {thickness: 0.5 mm, material: brass}]
ground: {a: clamped}
temperatures: {hot: {strip: 10 K}}
"""


def test_a_bimetal_strip_bends():
    """1/rho = 6 (a2 - a1) dT (1 + m)^2 / (h (3 (1 + m)^2 + (1 + m n) (m^2 + 1/(m n)))) (Timoshenko 1925, eq. 4)."""
    m, n, h = 0.5 / 1.0, 100 / 200, 1.5e-3  # of brass over steel
    curvature = 6 * 8e-6 * 10 * (1 + m) ** 2 / (h * (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))))
    z, turned = asked(fx.loads(BIMETAL), "drift(b.z, hot)", "drift(b.ry, hot)")
    assert abs(turned) == pytest.approx(curvature * L, rel=1e-4)
    assert z == pytest.approx(-curvature * L**2 / 2, rel=1e-4)  # brass is on top


GUIDE = """
flexura: 1
name: guide
materials: {m: {E: 70 GPa, nu: 0.3, rho: 2700 kg/m^3, expansion: 23 um/m/K}}
sections: {s: {shape: rectangle, width: 10 mm, thickness: 0.3 mm}}
nodes: {a: [0, 0, 0], c: [60 mm, 0, 0], b: [0, 0, 50 mm], d: [60 mm, 0, 50 mm]}
links:
  one: {nodes: [a, b], section: s, material: m, reference: x, elements: 4}
  two: {nodes: [c, d], section: s, material: m, reference: x, elements: 4}
bodies:
  stage:
    centre: [30 mm, 0, 60 mm]
    carries: [b, d]
    solid: {shape: box, size: [80 mm, 10 mm, 20 mm], material: m}
    elastic: false
ground: {a: clamped, c: clamped}
GROUND
temperatures:
  leaves: {"one": 1 K, "two": 1 K}
  stage: {stage: 1 K}
"""


def guide(ground=""):
    return fx.loads(GUIDE.replace("GROUND", ground))


def test_a_symmetric_guide_stays_in_place():
    """Both leaves lengthen alike: the stage rises straight. The stage alone: it spreads the leaves, and stays."""
    x, z, turned = asked(guide(), "drift(stage.x, leaves)", "drift(stage.z, leaves)", "drift(stage.ry, leaves)")
    assert abs(x) < 1e-12 and abs(turned) < 1e-12
    assert z == pytest.approx(ALPHA * 0.05, rel=1e-7)
    x, z = asked(guide(), "drift(stage.x, stage)", "drift(stage.z, stage)")
    assert abs(x) < 1e-12
    assert z == pytest.approx(ALPHA * 0.01, rel=1e-6)  # from the ends of the leaves to its middle


def test_all_of_one_material_grows_alike():
    """With a ground of the same material everything keeps its shape: no stress, and every point goes outwards."""
    model = guide("ground_material: m")
    x, z = asked(model, "drift(stage.x)", "drift(stage.z)")
    assert x == pytest.approx(ALPHA * 0.03, rel=1e-6) and z == pytest.approx(ALPHA * 0.06, rel=1e-6)
    assert asked(model, "stress at temperature = 10 K")[0] < 2e3
    assert asked(guide(), "stress at temperature = 10 K")[0] > 1e5
    nodes = fx.at(model, {"temperature": 10.0})
    placed = fx.assemble(nodes).design.positions
    assert placed == pytest.approx(fx.assemble(model).design.positions * (1 + 10 * ALPHA), rel=1e-6, abs=1e-10)


def test_drift_is_the_shift_at_first():
    model = guide()
    drift, shift = asked(model, "drift(stage.z)", "shift(stage.z) at temperature = 0.1 K")
    assert shift == pytest.approx(0.1 * drift, rel=1e-4)
    posed = asked(
        model,
        "drift(stage.z) at stage.x = 2 mm",
        "shift(stage.z) at stage.x = 2 mm, temperature = 0.01 K",
        "shift(stage.z) at stage.x = 2 mm",
    )
    assert posed[0] == pytest.approx((posed[1] - posed[2]) / 0.01, rel=0.05)


@over(
    ("change", "error", "why"),
    [
        (("expansion: 23 um/m/K", ""), OptionError, "no coefficient of expansion is known"),
        (("stage: {stage: 1 K}", "stage: {stages: 1 K}"), ModelError, "there is no such member, body"),
    ],
)
def test_what_is_refused(change, error, why):
    text = GUIDE.replace("GROUND", "").replace(*change).replace(", }", "}")
    for refuses in (lambda: fx.check(fx.loads(text)), lambda: fx.assemble(fx.at(fx.loads(text), {"stage": 1.0}))):
        with pytest.raises(error, match=why):
            refuses()


ROD = """
flexura: 1
name: rod
corrections: none
materials:
  m:
    {E: 70 GPa, nu: 0.3, rho: 2700 kg/m^3, expansion: 23 um/m/K, conductivity: 167 W/(m*K), heat_capacity: 900 J/(kg*K)}
parameters: {width: {value: 10 mm, minimum: 1 mm, maximum: 20 mm}}
sections: {s: {shape: rectangle, width: width, thickness: 1 mm}}
nodes: {a: [0, 0, 0], b: [100 mm, 0, 0]}
links: {rod: {nodes: [a, b], section: s, material: m, reference: z, elements: 20}}
bodies:
  tip:
    centre: [100 mm, 0, 0]
    carries: [b]
    solid: {shape: box, size: [1 mm, 60 mm, 60 mm], material: m}
    elastic: false
thermal_contacts: {film: {between: [tip, air], conductance: FILM}}
ground: {a: clamped}
temperatures: {on: {tip: {power: 0.5 W}}, through: {rod: {power: 0.5 W}}, hot: {tip: 3 K, rod: {power: 0 W}}}
"""
LEADS = 167 * B * H / L  # W/K


def rod(film="1 nW/K"):
    return fx.loads(ROD.replace("FILM", film))


def test_heat_flows_to_the_ground():
    """P L / k A at the end of a rod, half of it on the mean; half as much where it goes in evenly, 2/3 on the mean."""
    found = fx.heat(rod(), n=1)
    on, through, hot = found.states
    assert on.temperatures["tip"] == pytest.approx(0.5 / LEADS, rel=1e-7)
    assert on.temperatures["rod"] == pytest.approx(0.25 / LEADS, rel=1e-7)
    assert on.drift["tip"][0] == pytest.approx(ALPHA * 0.25 / LEADS * L, rel=1e-6)
    assert through.temperatures["tip"] == pytest.approx(0.25 / LEADS, rel=1e-6)
    assert through.temperatures["rod"] == pytest.approx(2 / 3 * 0.25 / LEADS, rel=2e-3)  # elements: 1/n^2
    assert hot.temperatures["rod"] == pytest.approx(1.5, rel=1e-6)
    [film] = fx.heat(rod(f"{LEADS} W/K"), states=["on"], n=1).states
    assert film.temperatures["tip"] == pytest.approx(0.25 / LEADS, rel=1e-7)


def test_it_takes_its_time():
    """The slowest: x tan x = M_rod / M_tip of a rod with a mass at its end (Incropera and DeWitt 2007, section 5.5)."""
    ratio = 10e-3 * 1e-3 * 0.1 / (1e-3 * 0.06 * 0.06)
    root = brentq(lambda x: x * np.tan(x) - ratio, 1e-3, np.pi / 2 - 1e-3)
    expected = 2700 * 900 * L**2 / 167 / root**2
    assert fx.heat(rod(), states=["on"], n=1).time_constants_s[0] == pytest.approx(expected, rel=2e-3)


def test_the_way_back_is_in_what_is_asked_with_slopes():
    asked_for = ["drift(tip.x, on)", "drift(tip.x)", "f1 at on = 1", "shift(tip.x) at on = 1"]
    slopes = fx.questions(rod(), asked_for).slopes({}, ["width"])
    assert slopes.is_exact.all(), slopes.reason
    ask = fx.questions(rod(), asked_for)
    step = 1e-5
    high, low = (ask.values({"width": 0.01 + sign * step}).value[0] for sign in (1, -1))
    expected = (high - low) / (2 * step)
    assert slopes.slope[:, 0] == pytest.approx(expected, rel=1e-4, abs=1e-9 * np.abs(expected).max())
    assert slopes.slope[0, 0] == pytest.approx(-slopes.value[0] / 0.01, rel=1e-6)


def test_points_that_stay():
    """A stage on one leaf that is warmer: it grows from the leaf's end, which the leaf pushes up."""
    model = guide("ground_material: m")
    [uniform] = fx.heat(model, states=["temperature"], n=2).states
    assert uniform.athermal["stage"] == pytest.approx((0, 0, 0), abs=1e-8)  # all grows from the origin
    leaves, stage = fx.heat(guide(), states=["leaves", "stage"], n=2).states
    assert leaves.athermal["stage"] is None
    assert stage.athermal["stage"] == pytest.approx((0.03, 0, 0.05), abs=1e-6)  # between the ends of the leaves
    assert stage.frequency_hz is not None and uniform.frequency_hz is not None
    assert np.abs(stage.frequency_hz / uniform.frequency_hz - 1).max() < 0.05


PART = """
flexura: 1
name: slab
materials: {m: {E: 70 GPa, nu: 0.3, rho: 2700 kg/m^3, expansion: 23 um/m/K, softening: -400 um/m/K}}
parts:
  slab:
    outline: [[0, 0], [100 mm, 0], [100 mm, 10 mm], [0, 10 mm]]
    thickness: 10 mm
    material: m
    mesh_tolerance: 0.2
    interfaces: {left: {x: 0 mm}, right: {x: 100 mm}}
ground: {slab.left: clamped GROUND}
temperatures: {hot: {slab: 10 K}, bowed: {slab: {gradient: [0, 0.1 K/mm, 0]}}}
"""


def test_parts_expand():
    """A slab from a drawing: free, and bowed as a bar."""
    model = fx.with_solid_parts(fx.loads(PART.replace(" GROUND", "")))
    x, y, turned, cold, hot = asked(
        model,
        "drift(slab.right.x, hot)",
        "drift(slab.right.y, bowed)",
        "drift(slab.right.rz, bowed)",
        "f1 at hot = 1e-6",
        "f1 at hot = 1",
    )
    assert x == pytest.approx(ALPHA * 10 * L, rel=1e-6)
    assert turned == pytest.approx(-ALPHA * 100 * L, rel=1e-5)
    assert y == pytest.approx(-ALPHA * 100 * L**2 / 2, rel=1e-5)
    # its mass is told by one piece, and stays as it lies
    assert hot / cold == pytest.approx(np.sqrt((1 - 4e-3) * (1 + 10 * ALPHA)), rel=6e-5)
    assert asked(model, "stress at hot = 1")[0] < 1e3


def test_a_state_is_named_by_its_own_name():
    """No wildcard stands for one, and no actuator has the same."""
    with pytest.raises(OptionError, match="is no displacement"):
        fx.at(guide(), {"*": 1.0})
    coil = GUIDE.replace("GROUND", "actuators: {stage: {type: force, nodes: [stage], direction: x}}")
    with pytest.raises(ModelError, match="an actuator has this name"):
        fx.assemble(fx.loads(coil))
