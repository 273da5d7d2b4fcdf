"""Freedoms of mechanisms without actuators: what constraint theory says, in any unit, size and orientation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flexura as fx
from flexura.mechanism import with_rigid_bodies

EXAMPLES = Path(__file__).parents[2] / "examples"
E, G, YIELD = 200e9, 77e9, 500e6
L, B, T = 60e-3, 20e-3, 0.3e-3
UPRIGHT = np.eye(3)
TURNED = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()


def held(nodes, pairs, *, round_wires=False, scale=1.0, Q=UPRIGHT, shift=(0, 0, 0), reference=(1, 0, 0), **more):
    """A platform `stage` on leaves or round wires from g* to e*, of any size, orientation and place."""

    def put(x):
        return tuple(float(c) for c in scale * (Q @ np.array(x, dtype=float)) + shift)

    diameter = scale * 0.5e-3
    round_web = fx.describe.RoundNotch(contour=fx.describe.StraightContour(web=diameter))
    profile = round_web if round_wires else fx.describe.Leaf(width=scale * B, thickness=scale * T)
    own = {"profile": profile, "material": "steel", "reference": None if round_wires else tuple(Q @ reference)}
    return fx.Mechanism(
        corrections="none",
        materials={"steel": fx.describe.Material(E=E, G=G, rho=7800.0, yield_stress=YIELD)},
        nodes={k: put(x) for k, x in nodes.items()},
        flexures={f"f{a}": fx.describe.Flexure(nodes=(a, b), **own) for a, b in pairs},
        bodies={
            "stage": fx.describe.RigidBody(
                centre=put((0, 0, L)), mass=scale**3, inertia=(1e-3 * scale**5,) * 3, carries=("e*",)
            )
        },
        ground={"g*": "clamped"},
        **more,
    )


def guide(**how):
    """Two leaves 50 mm apart that let the stage go along x."""
    nodes = {f"{end}{k}": (x, 0.0, z) for end, z in (("g", 0.0), ("e", L)) for k, x in enumerate((-25e-3, 25e-3))}
    return held(nodes, [("g0", "e0"), ("g1", "e1")], **how)


def wires(n=4, radius=20e-3, **how):
    """Vertical wires on a circle: two translations and the yaw are free."""
    angles = 2 * np.pi * np.arange(n) / n
    nodes = {
        f"{end}{k}": (radius * np.cos(a), radius * np.sin(a), z)
        for end, z in (("g", 0.0), ("e", L))
        for k, a in enumerate(angles)
    }
    return held(nodes, [(f"g{k}", f"e{k}") for k in range(n)], round_wires=True, **how)


def blade(**how):
    """One leaf along z: it bends along x, turns about y and twists about z."""
    return held({"g0": (0, 0, 0), "e0": (0, 0, L)}, [("g0", "e0")], **how)


KINDS = [(guide, "1T"), (wires, "1R2T"), (blade, "2R1T")]
PLACES = [{}, {"scale": 1e-3}, {"scale": 1e3}, {"Q": TURNED}, {"Q": TURNED, "scale": 40.0, "shift": (5.0, -70.0, 3.0)}]


@pytest.mark.parametrize(("make", "kind"), KINDS)
@pytest.mark.parametrize("how", PLACES)
def test_freedoms_are_those_of_constraint_theory_in_any_size_and_frame(make, kind, how):
    """A leaf constrains three motions and a wire one (Blanding 1999). Compliances grow as 1 / scale, the length as the
    scale, and axes turn with the mechanism."""
    Q, scale = how.get("Q", np.eye(3)), how.get("scale", 1.0)
    first, found = fx.kinetostatics(make()), fx.kinetostatics(make(**how))
    assert found.kind == first.kind == kind and found.is_clear
    assert found.spectrum.length == pytest.approx(scale * first.spectrum.length, rel=1e-9)
    np.testing.assert_allclose(found.spectrum.compliance * scale, first.spectrum.compliance, rtol=1e-5)
    assert found.spectrum.gap == pytest.approx(first.spectrum.gap, rel=1e-5)
    for name in ("R", "T"):
        was, now = (np.array([f.axis.direction for f in k.freedoms if f.kind == name]) for k in (first, found))
        if len(was):
            np.testing.assert_allclose(now.T @ now, Q @ was.T @ was @ Q.T, atol=1e-6)


def test_the_length_is_that_of_the_platform_and_its_members():
    """Guide: 25 mm to either side, leaves of 60 mm; wires: a circle of 20 mm; blade: where a leaf is as compliant in
    translation, l^3 / 12 EI, as in rotation about its middle, l / EI."""
    for make, radius in ((guide, 25e-3), (wires, 20e-3), (blade, 0.0)):
        spectrum = fx.kinetostatics(make()).spectrum
        assert spectrum.length == pytest.approx(np.sqrt(radius**2 + L**2 / 12), rel=1e-9)
        assert spectrum.centre == pytest.approx((0, 0, L / 2), abs=1e-12)


@pytest.mark.parametrize("make", [guide, wires, blade])
def test_it_does_not_matter_which_node_of_the_platform_is_named(make):
    far = make()
    far = fx.Mechanism(**{**dict(far), "nodes": {**far.nodes, "ear": (0.05, -0.1, L), "e9": (0.3, 0, 0.2)}})
    with_ear = fx.kinetostatics(far, platform="e9")
    first = fx.kinetostatics(make(), platform="stage")
    assert with_ear.kind == first.kind
    np.testing.assert_allclose(with_ear.spectrum.compliance, first.spectrum.compliance, rtol=1e-6)


def test_compliances_are_those_of_beams():
    """Compliance of wires along x and y: L^3 / (12 E I n) with their tops held level, which wires do but for 1 %."""
    spectrum = fx.kinetostatics(wires()).spectrum
    I = np.pi * (0.5e-3) ** 4 / 64  # noqa: E741
    assert spectrum.compliance[1:3] == pytest.approx(L**3 / (12 * E * I * 4), rel=1e-2)


def test_a_blade_has_the_compliances_of_its_middle():
    """l^3 / 12 EI twice, as a translation and as a rotation, and the twist, l L^2 / GJ with L^2 = l^2 / 12."""
    spectrum = fx.kinetostatics(blade()).spectrum
    EI, GJ = E * B * T**3 / 12, G * B * T**3 / 3 * (1 - 0.63 * T / B)
    assert spectrum.compliance[:3] == pytest.approx(L**3 / 12 / np.array([EI, EI, GJ]), rel=1e-3)
    assert spectrum.compliance[3:5] == pytest.approx(L**3 / 12 / (EI * (B / T) ** 2), rel=1e-6)


def test_stroke_of_the_guide_at_yield():
    """Roots of guided leaves, pushed at half their height: 3 E t d / L^2."""
    (slide,) = fx.kinetostatics(guide()).freedoms
    assert slide.yield_stroke == pytest.approx(YIELD * L**2 / (3 * E * T), rel=1e-6)


def test_yaw_of_wires_at_yield():
    """A yaw of one radian moves wires by their radius and twists them: both make stress at their ends."""
    turn = next(f for f in fx.kinetostatics(wires()).freedoms if f.kind == "R")
    assert turn.axis.point[:2] == pytest.approx((0, 0), abs=1e-9)
    d = 0.5e-3
    sigma, tau = 6 * E * 20e-3 * (d / 2) / L**2, G * (d / 2) / L
    assert turn.yield_stroke == pytest.approx(YIELD / np.sqrt(sigma**2 + 3 * tau**2), rel=1e-2)


def test_repeated_freedoms_lie_along_the_axes():
    """Two equal translations of four wires: along x and y, whatever the eigenvectors are."""
    slides = [f.axis.direction for f in fx.kinetostatics(wires()).freedoms if f.kind == "T"]
    np.testing.assert_allclose(slides, [[1, 0, 0], [0, 1, 0]], atol=1e-9)


def xy_stage(springs="5 N/um", angle=0.0):
    text = (EXAMPLES / "xy_stage" / "xy_stage.yaml").read_text(encoding="utf-8")
    text = text.replace("value: 5 N/um", f"value: {springs}")
    turned = f"    of: leg\n    rotate: {{axis: z, angle: {angle} deg}}\n    pattern"
    return with_rigid_bodies(fx.loads(text.replace("    of: leg\n    pattern", turned)))


@pytest.mark.parametrize(("springs", "angle"), [("0 N/um", 0.0), ("0 N/um", 30.0), ("5 N/um", 0.0)])
def test_xy_stage_has_two_translations_along_its_leaves(springs, angle):
    """Turned by 30 degrees, its repeated freedoms turn with its leaves. Stiff springs at its blocks hide the freedoms
    (it is softer along z than along x), and it is said that they are left out."""
    found = fx.kinetostatics(xy_stage(springs, angle), platform="table")
    assert found.kind == "2T"
    a = np.radians(angle)
    axes = [[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0]]
    directions = np.transpose([f.axis.direction for f in found.freedoms])
    np.testing.assert_allclose(np.abs(axes @ directions), np.eye(2), atol=1e-6)
    assert any("without springs" in note for note in found.notes) == (springs == "5 N/um")
    stiff = 1 / found.compliance[0, 0] > 5e6
    assert stiff == (springs == "5 N/um")  # the stiffness itself is with springs
    assert all(f.yield_stroke and 1e-3 < f.yield_stroke < 3e-3 for f in found.freedoms)


def test_tip_tilt_is_free_in_its_plane_alone_and_driven_in_tilts_and_piston():
    """Three upright struts hold tilts and piston, which their stacks drive; the other three motions are soft."""
    mirror = fx.load(EXAMPLES / "tip_tilt" / "tip_tilt.yaml")
    driven, alone = fx.kinetostatics(mirror), fx.kinetostatics(mirror, actuators=[])
    assert (driven.kind, alone.kind) == ("2R1T", "1R2T")
    np.testing.assert_allclose([f.axis.direction for f in driven.freedoms], np.eye(3), atol=1e-6)
    np.testing.assert_allclose([f.axis.direction for f in alone.freedoms], np.eye(3)[[2, 0, 1]], atol=1e-6)


def test_freedoms_that_are_not_clear_are_not_named():
    """A short beam: nothing is much softer than the rest."""
    stubby = held({"g0": (0, 0, 0), "e0": (0, 0, L)}, [("g0", "e0")])
    block = fx.describe.Leaf(width=B, thickness=0.9 * B)
    flexures = {k: f.model_copy(update={"profile": block}) for k, f in stubby.flexures.items()}
    found = fx.kinetostatics(fx.Mechanism(**{**dict(stubby), "flexures": flexures}))
    assert found.kind == "unclear" and found.freedoms == () and "no clear freedoms" in found.notes[0]
    data = found.to_dict()
    assert data["kind"] == "unclear" and len(data["spectrum"]["compliance"]) == 6
    assert data["spectrum"]["characteristic_length"] == pytest.approx(L / np.sqrt(12))


def test_a_platform_that_is_partly_held():
    """A guide whose stage is held along y as well keeps its one freedom."""
    found = fx.kinetostatics(fx.Mechanism(**{**dict(guide()), "ground": {"g*": "clamped", "e0": {"fixed": ["ty"]}}}))
    assert found.kind == "1T"
    assert np.abs(found.freedoms[0].axis.direction) == pytest.approx((1, 0, 0), abs=1e-3)
    assert found.freedoms[0].yield_stroke


def test_a_point_on_springs_alone_has_the_length_of_its_compliances():
    spring = fx.describe.DiagonalStiffness(tx=1e3, ty=1e6, tz=1e6, rx=100, ry=100, rz=100)
    found = fx.kinetostatics(
        fx.Mechanism(
            bodies={"mass": fx.describe.RigidBody(mass=0.1, inertia=(1e-4,) * 3)},
            springs={"s": fx.describe.Spring(nodes=("mass",), stiffness=spring)},
        )
    )
    assert found.spectrum.length == pytest.approx(np.sqrt((1e-3 + 2e-6) / 3e-2), rel=1e-9)
    assert found.spectrum.compliance[0] == pytest.approx(1e-3, rel=1e-9)
