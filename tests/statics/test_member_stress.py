"""Stresses of members against closed forms, tables, crack solutions and strain energy."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.strain.internal_forces import internal_force_rows
from flexura.analysis.strain.stress import member_stresses, stress_rows
from flexura.beam.section import (
    flat_notch_factors,
    rectangle_torsion_stress,
    rectangle_von_mises,
    round_notch_factors,
    round_von_mises,
)
from flexura.gallery import entry
from helpers.frames import mirrored_frame

STEEL = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0, yield_stress=400e6)
L, B, T = 0.05, 0.01, 0.001


def bar(section=None, elements=4, ground=None, **more):
    """A link from a to b along x, local z along global y."""
    link = fx.describe.Link(
        nodes=("a", "b"),
        material="steel",
        section=section or fx.describe.Rectangle(width=B, thickness=T),
        reference=(0, 1, 0),
        elements=elements,
    )
    data = {"nodes": {"a": (0, 0, 0), "b": (L, 0, 0)}, "links": {"bar": link}, "ground": ground or {"a": "clamped"}}
    return fx.Mechanism(corrections="none", **({"materials": {"steel": STEEL}} | data | more))


def hinge(profile, **more):
    """A flexure from a to b along x, thickness along global y."""
    flexure = fx.describe.Flexure(nodes=("a", "b"), material="steel", profile=profile, reference=(0, 1, 0), **more)
    return bar(links={}, flexures={"bar": flexure})


def stressed(mechanism, gravity=None, **loads):
    """Stresses under loads by node."""
    state = fx.preload(mechanism, gravity=gravity, loads=loads)
    return member_stresses(state.model, state.displacement_vector, gravity=gravity)


@pytest.mark.parametrize("elements", [1, 5])
def test_cantilever_under_everything(elements):
    """Corner stress at the clamp: N/A + M c/I of both planes."""
    Fx, Fy, Fz = 30.0, 2.0, 5.0
    found = stressed(bar(elements=elements), b=(Fx, Fy, Fz, 0, 0, 0))["bar"]
    exact = Fx / (B * T) + 6 * Fy * L / (B * T**2) + 6 * Fz * L / (B**2 * T)
    assert found.von_mises == pytest.approx(exact, rel=1e-9)
    assert found.nominal == found.von_mises
    assert found.position == 0 and found.state == 0 and not found.is_flexure
    np.testing.assert_allclose(found.force, (Fx, -Fz, Fy), rtol=1e-7)
    np.testing.assert_allclose(found.moment, (0, -Fy * L, -Fz * L), rtol=1e-7, atol=1e-9)
    assert found.factor_to_yield == pytest.approx(400e6 / exact)


def test_signs_along_the_member():
    """On the section at x the outer part, loaded at b, pulls by F and turns by (b - x) x F."""
    F, M = np.array([3.0, 4.0, 5.0]), np.array([0.1, 0.2, 0.3])
    state = fx.preload(bar(), loads={"b": (*F, *M)})
    to_local = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    for x in (0.0, 0.2, 0.25, 0.9, 1.0):
        moment = M + np.cross([(1 - x) * L, 0, 0], F)
        got = internal_force_rows(state.model, "bar", position=x) @ state.displacement_vector
        np.testing.assert_allclose(got, np.hstack([to_local @ F, to_local @ moment]), rtol=1e-6, atol=1e-7)


def test_fibres_give_the_corner_stress():
    state = fx.preload(bar(), loads={"b": (9.0, 2.0, 5.0, 0, 0, 0)})
    worst = member_stresses(state.model, state.displacement_vector)["bar"]
    fibres = stress_rows(state.model, "bar", position=worst.position) @ state.displacement_vector
    assert np.abs(fibres).max() == pytest.approx(worst.nominal, rel=1e-9)
    assert fibres.mean() == pytest.approx(9.0 / (B * T), rel=1e-6)
    # the load along +y pulls on the lower side, local -z, and that along +z on the lower side, local +y
    assert int(np.argmax(fibres)) == 1


def test_fibres_of_a_round_bar():
    D = 0.004
    state = fx.preload(bar(fx.describe.Circle(diameter=D)), loads={"b": (0, 2.0, 0, 0, 0, 0)})
    bending = 32 * 2.0 * L / (np.pi * D**3)
    rows = stress_rows(state.model, "bar", position=0.0)
    np.testing.assert_allclose(rows @ state.displacement_vector, [0, -bending, 0, bending], atol=1e-6 * bending)


@pytest.mark.parametrize(("ratio", "k"), [(1, 0.208), (1.5, 0.231), (2, 0.246), (3, 0.267), (4, 0.282), (10, 0.312)])
def test_torsion_of_rectangles(ratio, k):
    """tau = T / (k a^2 b), Timoshenko & Goodier (1970), table of Sec. 109."""
    a = 0.003
    for sides in ((ratio * a, a), (a, ratio * a)):
        found = rectangle_torsion_stress(*sides)
        on_long = found[0] if sides[1] <= sides[0] else found[1]
        assert on_long * a**2 * ratio * a == pytest.approx(1 / k, rel=2.5e-3)
    if ratio == 1:
        assert found[0] == pytest.approx(found[1], rel=1e-9)
    if ratio == 10:
        assert min(found) / max(found) == pytest.approx(0.743, abs=1e-3)


def test_torsion_of_a_leaf():
    found = stressed(bar(), b=(0, 0, 0, 0.02, 0, 0))["bar"]
    assert found.von_mises == pytest.approx(np.sqrt(3) * 0.02 / (0.312 * B * T**2), rel=2.5e-3)


def test_round_bar_in_oblique_bending_and_torsion():
    D, d = 0.006, 0.004
    Fy, Fz, Mx = 3.0, 4.0, 0.2
    found = stressed(bar(fx.describe.Tube(outer_diameter=D, inner_diameter=d)), b=(0, Fy, Fz, Mx, 0, 0))["bar"]
    W = np.pi * (D**4 - d**4) / (32 * D)
    assert found.von_mises == pytest.approx(np.sqrt((5 * L / W) ** 2 + 3 * (Mx / (2 * W)) ** 2), rel=1e-9)


def test_transverse_shear():
    """1.5 V/A, 4/3 V/A, and 2 V/A of a thin tube; torsion adds on one side."""
    shear = np.array([0, 3.0, 4.0, 0, 0, 0])
    assert rectangle_von_mises(shear, 2.0, 3.0) == pytest.approx(np.sqrt(3) * 1.5 * 5 / 6)
    A = np.pi / 4
    assert round_von_mises(shear, 1.0, 0.0) == pytest.approx(np.sqrt(3) * 4 / 3 * 5 / A)
    thin = np.pi / 4 * (1 - 0.998**2)
    assert round_von_mises(shear, 1.0, 0.998) == pytest.approx(np.sqrt(3) * 2 * 5 / thin, rel=2e-3)
    both = shear + np.array([0, 0, 0, 0.7, 0, 0])
    assert round_von_mises(both, 1.0, 0.0) == pytest.approx(np.sqrt(3) * (4 / 3 * 5 / A + 16 * 0.7 / np.pi))
    twisted = np.array([0, 3.0, 0, 0.7, 0, 0])
    assert rectangle_von_mises(twisted, 1.0, 1.0) == pytest.approx(np.sqrt(3) * (4.5 + 0.7 / 0.208), rel=1e-3)


def test_neuber_factors_of_sharp_notches():
    """Deep cracks: stress 2 K_I / sqrt(pi rho) and K_III / sqrt(pi rho) with the intensities of deep external cracks.

    Tada, Paris & Irwin: flat ligament 2a, K_I = 2 s sqrt(a/pi) in tension and 4/3 s sqrt(a/pi) in bending; round
    neck a, K_I = s sqrt(pi a)/2 in tension, 3/8 in bending, K_III = 3/8 t sqrt(pi a) in torsion.
    """
    q = 1e10
    np.testing.assert_allclose(np.array(flat_notch_factors(q)) / np.sqrt(q), [4 / np.pi, 8 / (3 * np.pi)], rtol=1e-4)
    np.testing.assert_allclose(np.array(round_notch_factors(q, 0.3)) / np.sqrt(q), [1, 3 / 4, 3 / 8], rtol=1e-4)


def test_neuber_factors_of_shallow_curvature():
    np.testing.assert_allclose([*flat_notch_factors(0.0), *round_notch_factors(0.0, 0.3)], 1.0, rtol=1e-14)
    steps = np.array([0.99e-5, 1.01e-5])
    for factor in flat_notch_factors(steps):
        assert 0 < np.diff(factor)[0] < 1e-6
    assert np.isinf([*flat_notch_factors(np.inf), *round_notch_factors(np.inf, 0.3)]).all()


@pytest.mark.parametrize(("R", "t", "within"), [(4e-3, 0.3e-3, 0.002), (2e-3, 1e-3, 0.01), (1e-3, 2e-3, 0.025)])
def test_circular_notch_in_bending(R, t, within):
    """Nominal 6 M/(b t^2), raised as Smith, Chetwynd & Bowen (1987) fitted: (1 + t/2R)^(9/20)."""
    profile = fx.describe.Notch(width=B, contour=fx.describe.CircularContour(radius=R, web=t))
    M = 0.01
    found = stressed(
        hinge(profile, elements=11).model_copy(update={"nodes": {"a": (0, 0, 0), "b": (2 * R, 0, 0)}}),
        b=(0, 0, 0, 0, 0, M),
    )["bar"]
    nominal = 6 * M / (B * t**2)
    assert found.nominal == pytest.approx(nominal, rel=1e-8)
    assert found.von_mises / nominal == pytest.approx((1 + t / (2 * R)) ** 0.45, rel=within)
    assert found.position == 0.5 and found.is_flexure


@pytest.mark.parametrize(
    ("contour", "radius"),
    [
        (fx.describe.EllipticalContour(depth=2e-3, web=1e-3), (L / 2) ** 2 / 2e-3),
        (fx.describe.ParabolicContour(depth=2e-3, web=1e-3), None),
        (fx.describe.HyperbolicContour(depth=2e-3, web=1e-3), None),
        (fx.describe.CornerFilletedContour(fillet_radius=2e-3, web=1e-3), 2e-3),
        (fx.describe.VShapedContour(angle=0.5, root_radius=1.5e-3, web=1e-3), 1.5e-3),
        (fx.describe.StraightContour(web=1e-3), np.inf),
        (fx.describe.CornerFilletedContour(fillet_radius=0.0, web=1e-3), np.inf),
    ],
    ids=lambda c: getattr(c, "shape", ""),
)
def test_radius_at_the_root(contour, radius):
    """The factor is that of the curvature of the contour, from its formula or from its thickness near the root."""
    mechanism = hinge(fx.describe.Notch(width=B, contour=contour))
    found = stressed(mechanism, b=(100.0, 0, 0, 0, 0, 0))["bar"]
    if radius is None:
        x = 1e-4 * L
        rise = {"parabolic": 2e-3 * (2 * x / L) ** 2}
        rise["hyperbolic"] = (np.hypot(1e-3, np.sqrt(4 * 2e-3 * 3e-3) * 2 * x / L) - 1e-3) / 2
        radius = x**2 / (2 * rise[contour.shape])
    assert found.nominal == pytest.approx(100 / (B * 1e-3), rel=1e-8)
    q = 0.5e-3 / radius
    assert found.von_mises / found.nominal == pytest.approx(float(flat_notch_factors(q)[0]), rel=1e-6)
    assert (found.von_mises > found.nominal) == np.isfinite(radius)


def test_sharp_notch_has_no_finite_stress():
    found = stressed(
        hinge(fx.describe.Notch(width=B, contour=fx.describe.VShapedContour(angle=0.5, root_radius=0.0, web=T))),
        b=(1, 0, 0, 0, 0, 0),
    )
    assert np.isinf(found["bar"].von_mises) and np.isfinite(found["bar"].nominal)
    assert found.factor_to_yield == 0


def test_round_notch():
    contour = fx.describe.CircularContour(radius=L / 2, web=2e-3)
    found = stressed(hinge(fx.describe.RoundNotch(contour=contour), elements=11), b=(0, 0, 0, 0, 3e-3, 4e-3))["bar"]
    assert found.nominal == pytest.approx(32 * 5e-3 / (np.pi * 8e-9), rel=1e-7)
    q = 1e-3 / (L / 2)
    c = np.sqrt(1 + q)
    factor = 0.75 * (c + 1) * (3 * q - 0.4 * c + 4.3) / (3 * (q + 1) + 2.2 * c + 1.3 / (1 + c))
    assert found.von_mises / found.nominal == pytest.approx(factor, rel=1e-9)


def test_shifted_two_axis_notch_raises_each_axis_in_its_own_notch():
    contour = fx.describe.CircularContour(radius=L / 4, web=2e-3)
    profile = fx.describe.TwoAxisNotch(y_contour=contour, z_contour=contour, shift=L / 2)
    thick = 2e-3 + L / 2
    bend = float(flat_notch_factors(1e-3 / (L / 4))[1])
    found = stressed(hinge(profile, elements=21), b=(0, 0, 0, 0, 0, 0.1))["bar"]
    assert found.nominal == pytest.approx(0.6 / (thick * 4e-6), rel=2e-2)
    assert found.von_mises / found.nominal == pytest.approx(bend, rel=1e-9)
    assert found.position == pytest.approx(0.75, abs=0.03)


def test_least_thickness_of_a_table_is_not_missed():
    positions, thicknesses = (0.0, 0.37 * L, 0.372 * L, L), (4e-3, 1e-3, 2e-3, 4e-3)
    profile = fx.describe.Notch(
        width=B, contour=fx.describe.TabulatedContour(positions=positions, thicknesses=thicknesses)
    )
    found = stressed(hinge(profile), b=(0, 0, 0, 0, 0, 0.1))["bar"]
    assert found.nominal == pytest.approx(0.6 / (B * 1e-6), rel=1e-8)
    assert found.position == pytest.approx(0.37)


@pytest.mark.parametrize("elements", [1, 3])
def test_own_weight(elements):
    """Cantilever: w L^2/2 at the clamp."""
    g = (0.0, -9.81, 0.0)
    state = fx.preload(bar(elements=elements), gravity=g)
    found = member_stresses(state.model, state.displacement_vector, gravity=g)["bar"]
    w = 7800 * B * T * 9.81
    assert found.nominal == pytest.approx(6 * (w * L**2 / 2) / (B * T**2), rel=1e-9)


def test_own_weight_between_two_clamps():
    """w L^2/12 at the clamps, shear w L/2."""
    g = (0.0, 0.0, -9.81)
    state = fx.preload(bar(elements=2, ground={"a": "clamped", "b": "clamped"}), gravity=g)
    found = member_stresses(state.model, state.displacement_vector, gravity=g)["bar"]
    w = 7800 * B * T * 9.81
    assert abs(found.moment[2]) == pytest.approx(w * L**2 / 12, rel=1e-9)
    assert abs(found.force[1]) == pytest.approx(w * L / 2, rel=1e-9)


@pytest.mark.parametrize(("along", "modulus"), [((0.0, -9.81, 0.0), B * T**2 / 6), ((0.0, 0.0, 9.81), B**2 * T / 6)])
@pytest.mark.parametrize("elements", [1, 3])
def test_own_weight_between_two_pins(along, modulus, elements):
    """w L^2/8 in the middle, also of a single element."""
    ground = {"a": fx.describe.Support(fixed=("tx", "ty", "tz", "rx")), "b": fx.describe.Support(fixed=("ty", "tz"))}
    found = stressed(bar(elements=elements, ground=ground), gravity=along)["bar"]
    assert found.nominal == pytest.approx(7800 * B * T * 9.81 * L**2 / 8 / modulus, rel=1e-8)
    assert found.position == 0.5


def test_work_is_strain_energy_of_the_internal_forces():
    state = fx.preload(mirrored_frame(STEEL), loads={"seat": (30, 20, 10, 1, 2, 3)})
    u = state.displacement_vector
    E, G, b, t = 200e9, 200e9 / 2.6, 6e-3, 4e-3
    k = 10 * 1.3 / (12 + 11 * 0.3)
    J = b * t**3 * (1 / 3 - 0.21 * t / b * (1 - t**4 / (12 * b**4)))
    rigidity = np.array([E * b * t, k * G * b * t, k * G * b * t, G * J, E * b * t**3 / 12, E * b**3 * t / 12])
    energy = 0.0
    stressed_members = member_stresses(state.model, u).members
    assert len(stressed_members) == 4
    lengths = {"shin": np.linalg.norm([0.02, 0.012, 0.041]), "thigh": np.linalg.norm([-0.031, 0.01, 0.03])}
    x, w = np.polynomial.legendre.leggauss(3)
    for member in stressed_members:
        for at, weight in zip((x + 1) / 2, w / 2, strict=True):
            force = internal_force_rows(state.model, member.name, position=at) @ u
            energy += weight * lengths[member.name.split(".")[1]] * (force**2 / rigidity).sum() / 2
    assert energy == pytest.approx(state.load @ u / 2, rel=1e-3)


def test_mirror_images_are_stressed_alike():
    even = stressed(mirrored_frame(STEEL), seat=(0, 20, 10, 1, 0, 0))
    for part in ("shin", "thigh"):
        one, other = (m for m in even.members if m.name.endswith(part))
        assert one.nominal == pytest.approx(other.nominal, rel=1e-9)
        np.testing.assert_allclose(one.force, other.force, rtol=1e-6)
        np.testing.assert_allclose(one.moment, other.moment, rtol=1e-6)


def test_the_worst_of_several_states():
    state = fx.preload(bar(), loads={"b": (0, 1.0, 0, 0, 0, 0)})
    u = state.displacement_vector
    many = member_stresses(state.model, np.outer(u, [0.5, -3.0, 2.0]))["bar"]
    one = member_stresses(state.model, u)["bar"]
    assert many.state == 1
    assert many.von_mises == pytest.approx(3 * one.von_mises)
    np.testing.assert_allclose(many.moment, -3 * np.array(one.moment), rtol=1e-12)


def test_states_in_blocks(monkeypatch):
    state = fx.preload(mirrored_frame(STEEL), loads={"seat": (30, 20, 10, 1, 2, 3)})
    u = np.outer(state.displacement_vector, np.sin(np.arange(50)))
    whole = member_stresses(state.model, u)
    monkeypatch.setattr("flexura.analysis.strain.stress.BLOCK", 1)
    assert member_stresses(state.model, u) == whole


def test_order_and_factor_of_the_whole():
    found = stressed(mirrored_frame(STEEL), seat=(30, 20, 10, 1, 2, 3))
    sizes = [m.von_mises for m in found.members]
    assert sizes == sorted(sizes, reverse=True)
    assert found.factor_to_yield == pytest.approx(400e6 / sizes[0])


def test_yield_stress_may_follow_a_parameter():
    material = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0, yield_stress=2 * fx.describe.parameter("strength"))
    strength = fx.describe.Parameter(value=100e6, unit="Pa")
    mechanism = bar(materials={"steel": material}, parameters={"strength": strength})
    model = fx.assemble(mechanism, {"strength": 150e6})
    assert member_stresses(model, np.zeros(model.order))["bar"].yield_stress == pytest.approx(300e6)
    assert member_stresses(model, np.zeros(model.order)).factor_to_yield == np.inf


def test_sections_by_constants_have_no_stress():
    section = fx.describe.SectionConstants(A=1e-5, Iy=1e-12, Iz=1e-10, J=1e-12)
    found = stressed(bar(section), b=(1, 0, 0, 0, 0, 0))
    assert found["bar"].von_mises is None and found["bar"].nominal is None
    assert found["bar"].factor_to_yield is None and found.factor_to_yield is None
    model = fx.assemble(bar(section))
    with pytest.raises(fx.OptionError, match="constants"):
        stress_rows(model, "bar")
    assert internal_force_rows(model, "bar").shape == (6, model.order)


def test_unknown_yield_stress():
    steel = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0)
    found = stressed(bar(materials={"steel": steel}), b=(1, 0, 0, 0, 0, 0))
    assert found["bar"].yield_stress is None and found.factor_to_yield is None


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: member_stresses(m, np.zeros(3)), "displacements are"),
        (lambda m: member_stresses(m, np.full(m.order, np.nan)), "finite"),
        (lambda m: member_stresses(m, np.zeros(m.order))["nothing"], "no link or flexure 'nothing'"),
        (lambda m: stress_rows(m, "nothing"), "no link or flexure"),
        (lambda m: internal_force_rows(m, "bar", position=1.5), "fraction"),
        (lambda m: member_stresses(m, np.zeros(m.order), gravity=(1, 2)), "3 finite numbers"),
    ],
)
def test_what_cannot_be_is_refused(call, words):
    with pytest.raises(fx.OptionError, match=words):
        call(fx.assemble(bar()))


def test_round_off_is_no_stress():
    """A lever whose end beyond the push carries nothing: no stress there, and no factor to yield of 1e14."""
    model = fx.load(entry("lever").path)
    found = fx.statics(model, actuators={"piezo": 150.0}).stresses()
    assert found["lever"].von_mises == 0.0 and found["lever"].factor_to_yield == np.inf
    assert found["fulcrum.notch"].von_mises > 1e7
