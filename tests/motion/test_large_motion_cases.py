"""Large displacements against closed forms, published cases, and the equations of rods integrated without elements.

"ODE": the strong form of the geometrically exact rod (Reissner 1972; Simo 1985), solved by shooting with Runge and
Kutta's method of fourth order, independent of any finite element; statics to about 1e-6, tangent stiffness 1e-4.

Simo, Vu-Quoc, Comput. Methods Appl. Mech. Engrg. 58 (1986) 79: roll-up, exact.
Bisshopp, Drucker, Quart. Appl. Math. 3 (1945) 272: elastica, exact.
Bathe, Bolourchi, Int. J. Numer. Meth. Engng 14 (1979) 961: 45-degree bend; ODE.
Dowell, Traybar (1975); Bauchau et al., J. Comput. Nonlinear Dyn. 11 (2016): Princeton beam; ODE.
Williams, Quart. J. Mech. Appl. Math. 17 (1964) 451: toggle; ODE.
Lee, Manuel, Rossow, J. Engng Mech. Div. ASCE 94 (1968) 525: frame; ODE.
Parallel leaf guide and crossed-leaf pivot over their strokes: ODE.
"""

import numpy as np
import pytest

from flexura.mechanism import Mechanism
from flexura.modelfile import loads
from helpers.large_motion import Moved, straight_beams

E_STEEL, NU = 210e9, 0.3
STIFF = "A: 1e3 m^2, Iy: 1 m^4, Iz: 1 m^4, J: 1 m^4"


def test_roll_up_through_two_full_turns():
    beam = straight_beams([(0, 0, 0), (1, 0, 0)], STIFF, 10, E=2.0, G=1.0, ground={"p0": "clamped"})
    moved = Moved(beam)
    moments = np.linspace(0, 8 * np.pi, 17)[1:]
    for M, pose in zip(moments, moved.loaded([{"p1": [0, 0, 0, 0, 0, M]} for M in moments]), strict=True):
        exact = np.array([np.sin(M / 2), 1 - np.cos(M / 2), 0]) * 2 / M
        assert np.abs(moved.position(pose, "p1") - exact).max() < 1e-9


@pytest.mark.parametrize(
    ("P", "w", "u", "angle"),
    [
        (1, 0.3017207738, 0.0564332363, 0.4613519497),
        (2, 0.4934574804, 0.1606417208, 0.7817498316),
        (5, 0.7137915236, 0.3876283607, 1.2153681176),
        (10, 0.8106090249, 0.5549955978, 1.4302855388),
    ],
)
def test_elastica(P, w, u, angle):
    slender = "A: 1e8 m^2, Iy: 1 m^4, Iz: 1 m^4, J: 1 m^4"
    errors = []
    for n in (8, 16):
        moved = Moved(straight_beams([(0, 0, 0), (1, 0, 0)], slender, n, E=1.0, G=0.5, ground={"p0": "clamped"}))
        *_, pose = moved.loaded([{"p1": [0, share * P, 0, 0, 0, 0]} for share in (0.25, 0.5, 1.0)])
        got = pose.displacement(moved.number("p1"))
        errors.append(np.abs(np.array([got[1] - w, got[0] + u, got[5] - angle])).max())
    assert errors[1] < 2e-6
    assert np.log2(errors[0] / errors[1]) > 3.7, "convergence is of fourth order"


@pytest.mark.parametrize(
    ("F", "tip"), [(300, (58.779122, 22.244781, 40.191892)), (600, (47.150439, 15.684801, 53.474859))]
)
def test_45_degree_bend(F, tip):
    """A polygon of straight members converges to the arc with the square of their length."""
    errors = []
    for n in (16, 32):
        angle = np.linspace(0, np.pi / 4, n + 1)
        points = np.stack([100 * np.sin(angle), 100 * (1 - np.cos(angle)), 0 * angle], axis=1)
        section = f"A: 1 m^2, Iy: {1 / 12!r} m^4, Iz: {1 / 12!r} m^4, J: {1 / 6!r} m^4"
        moved = Moved(straight_beams(points.tolist(), section, 1, E=1e7, G=5e6, ground={"p0": "clamped"}))
        *_, pose = moved.loaded([{f"p{n}": [0, 0, share * F, 0, 0, 0]} for share in (0.1, 0.3, 0.6, 1.0)])
        errors.append(moved.position(pose, f"p{n}") - tip)
    extrapolated = (4 * errors[1] - errors[0]) / 3
    assert np.abs(errors[1]).max() < 4e-3
    assert np.abs(extrapolated).max() < 1e-4 * 0.5


@pytest.mark.parametrize(
    ("P", "beta", "expected"),
    [
        (4.448, 0, (-3.40e-5, -0.005358, 0)),
        (4.448, 45, (-0.003748, -0.003976, 0.056064)),
        (4.448, 90, (-0.007259, 0, 0.078077)),
        (8.896, 0, (-1.36e-4, -0.010713, 0)),
        (8.896, 45, (-0.014412, -0.008979, 0.109113)),
        (8.896, 90, (-0.026021, 0, 0.146252)),
    ],
)
def test_princeton_beam(P, beta, expected):
    h, w, L, E = 12.3777e-3, 3.2024e-3, 0.508, 71.7e9
    section = f"A: {w * h!r} m^2, Iy: {h * w**3 / 12!r} m^4, Iz: {w * h**3 / 12!r} m^4, J: 1.0691e-10 m^4"
    moved = Moved(straight_beams([(0, 0, 0), (L, 0, 0)], section, 10, E=E, G=E / 2.62, ground={"p0": "clamped"}))
    force = P * np.array([0, -np.cos(np.radians(beta)), np.sin(np.radians(beta))])
    *_, pose = moved.loaded([{"p1": [*(share * force), 0, 0, 0]} for share in (0.25, 0.5, 1.0)])
    assert pose.displacement(moved.number("p1"))[:3] == pytest.approx(expected, abs=1e-6, rel=1e-4)


def test_williams_toggle_past_its_limit():
    """Driven by the displacement of the apex, half by symmetry; ODE values interpolated to 0.05 lb."""
    EA, EI = 1.885e6, 9.274e3
    section = f"A: {EA!r} m^2, Iy: {EI!r} m^4, Iz: {EI!r} m^4, J: {EI!r} m^4, ky: 1e6, kz: 1e6"
    points = [(0, 0, 0), (12.943, 0.386, 0), (25.886, 0, 0)]
    toggle = straight_beams(points, section, 8, E=1.0, G=0.5, ground={"p0": "clamped", "p2": "clamped"})
    moved = Moved(toggle, "p1.y")
    v = [0.1, 0.2, 0.3, 0.4]
    loads = [-float(pose.state.drive[0]) for pose in moved.through([[-own] for own in v])]
    assert loads == pytest.approx([25.205, 33.499, 32.847, 31.305], abs=0.06)
    fine = np.linspace(0.2, 0.44, 49)
    path = [-float(pose.state.drive[0]) for pose in moved.through([[-own] for own in fine])]
    top, bottom = int(np.argmax(path)), int(np.argmin(path))
    assert path[top] == pytest.approx(33.87, abs=0.02)
    assert fine[top] == pytest.approx(0.232, abs=0.01)
    assert path[bottom] == pytest.approx(31.28, abs=0.03)


def test_lee_frame_to_its_limit():
    EA, EI = 4.32e7, 1.44e7
    section = f"A: {EA!r} m^2, Iy: {EI!r} m^4, Iz: {EI!r} m^4, J: {EI!r} m^4, ky: 1e6, kz: 1e6"
    points = [(0, 0, 0), (0, 120, 0), (24, 120, 0), (120, 120, 0)]
    hinge = "{fixed: [tx, ty, tz, rx, ry]}"
    frame = straight_beams(points, section, 10, E=1.0, G=0.5, ground={"p0": hinge, "p3": hinge})
    moved = Moved(frame)
    expected = {5000: (0.310, 3.792), 10_000: (1.915, 10.709), 15_000: (8.011, 25.842)}
    poses = moved.loaded([{"p2": [0, -P, 0, 0, 0, 0]} for P in expected])
    for (u, v), pose in zip(expected.values(), poses, strict=True):
        # the figures lie between points of the ODE's path
        assert pose.displacement(moved.number("p2"))[:2] == pytest.approx((u, -v), abs=3e-3)
    driven = Moved(frame, "p2.y")
    v = np.linspace(48, 49.5, 16)
    path = [-float(pose.state.drive[0]) for pose in driven.through([[-own] for own in v])]
    top = int(np.argmax(path))
    assert path[top] == pytest.approx(18_556.9, rel=2e-5)
    assert v[top] == pytest.approx(48.5, abs=0.3)


def guide(elements: int) -> Mechanism:
    """Two leaves 100 x 30 x 0.5 mm, 60 mm apart, with a carriage of 0.3 kg."""
    return loads(f"""
flexura: 1
name: guide
theory: timoshenko
corrections: none
materials: {{steel: {{E: 210 GPa, nu: 0.3, rho: 1e-6 kg/m^3}}}}
sections:
  leaf: {{shape: constants, A: 15 mm^2, Iy: 1125 mm^4, Iz: 0.3125 mm^4, J: 1.236875 mm^4, ky: {5 / 6}, kz: {5 / 6}}}
nodes: {{a: [0, 0, 0], b: [0, 60 mm, 0], c: [100 mm, 0, 0], d: [100 mm, 60 mm, 0]}}
links:
  left: {{nodes: [a, c], material: steel, section: leaf, reference: z, elements: {elements}}}
  right: {{nodes: [b, d], material: steel, section: leaf, reference: z, elements: {elements}}}
bodies:
  carriage:
    centre: [100 mm, 30 mm, 0]
    mass: 0.3 kg
    inertia: [4e-4 kg*m^2, 2e-4 kg*m^2, 4e-4 kg*m^2]
    carries: [c, d]
ground: {{a: clamped, b: clamped}}
""")


GUIDE = {
    1: (1.574915, -5.99966e-6, 1.484e-6, 5.894633e7, 1.253403e6, 3694.45, 4510.87, 53058.5, 1575.190),
    2: (3.150711, -2.400111e-5, 3.542e-6, 4.940498e7, 1.079531e6, 3029.41, 3970.44, 44473.6, 1576.513),
    10: (15.896006, -6.020155e-4, 1.1107e-4, 7.908852e6, 1.988268e5, 450.888, 802.900, 7117.22, 1619.560),
}
GUIDE_HZ = {
    1: (11.532, 305.305, 483.676, 1457.251, 1833.006, 2231.130),
    2: (11.534, 284.049, 437.953, 1330.951, 1678.165, 2043.053),
    10: (11.609, 123.344, 168.487, 537.053, 670.926, 823.899),
}


@pytest.mark.parametrize(("elements", "close"), [(10, 1e-4), (4, 1e-3)])
def test_parallel_guide_over_its_stroke(elements, close):
    moved = Moved(guide(elements), "carriage.y")
    node = moved.number("carriage")
    for d, pose in zip(GUIDE, moved.through([[d * 1e-3] for d in GUIDE]), strict=True):
        F, ux, turn, *stiffness, drive = GUIDE[d]
        held = np.diag(pose.compliance(node, held=True))[[0, 2, 3, 4, 5]]
        assert float(pose.state.drive[0]) == pytest.approx(F, rel=close)
        u = pose.displacement(node)
        assert (u[0], u[5]) == (pytest.approx(ux, rel=close), pytest.approx(turn, rel=5 * close))
        assert 1 / held == pytest.approx(stiffness, rel=close)
        assert 1 / pose.compliance(node)[1, 1] == pytest.approx(drive, rel=close)
        frequencies = moved.frequencies(pose, "carriage", [0.3, 0.3, 0.3, 4e-4, 2e-4, 4e-4])
        assert frequencies == pytest.approx(GUIDE_HZ[d], rel=close)


def pivot(elements: int) -> Mechanism:
    """Two crossed leaves 100 x 20 x 0.3 mm at 45 degrees."""
    t, w = 0.3, 20.0
    J = w * t**3 * (1 / 3 - 0.21 * t / w * (1 - t**4 / (12 * w**4)))
    s = 100 / np.sqrt(8)
    return loads(f"""
flexura: 1
name: pivot
theory: timoshenko
corrections: none
materials: {{steel: {{E: 210 GPa, nu: 0.3, rho: 1e-6 kg/m^3}}}}
sections:
  leaf:
    {{shape: constants, A: 6 mm^2, Iy: 200 mm^4, Iz: 0.045 mm^4, J: {J!r} mm^4, ky: {5 / 6}, kz: {5 / 6}}}
nodes: {{a: [-{s} mm, -{s} mm, 0], b: [-{s} mm, {s} mm, 0], c: [{s} mm, {s} mm, 0], d: [{s} mm, -{s} mm, 0]}}
links:
  up: {{nodes: [a, c], material: steel, section: leaf, reference: z, elements: {elements}}}
  down: {{nodes: [b, d], material: steel, section: leaf, reference: z, elements: {elements}}}
bodies:
  platform: {{centre: [0, 0, 0], mass: 1 kg, inertia: [1e-3 kg*m^2, 1e-3 kg*m^2, 1e-3 kg*m^2], carries: [c, d]}}
ground: {{a: clamped, b: clamped}}
""")


PIVOT = {
    2: (0.00659868, 1.435588e-5, 2.5058e-7, 3.87007e6, 3.86818e6, 8.51183e5, 324.18, 324.34, 0.189068),
    10: (0.03315330, 3.566308e-4, 3.12012e-5, 2.20599e5, 2.17975e5, 3.78178e5, 49.999, 50.533, 0.191853),
    20: (0.06728545, 1.398585e-3, 2.466082e-4, 5.66805e4, 5.41713e4, 1.26629e5, 13.725, 14.273, 0.200122),
}


def test_crossed_pivot_over_its_angle():
    moved = Moved(pivot(10), "platform.rz")
    node = moved.number("platform")
    for angle, pose in zip(PIVOT, moved.through([[np.radians(a)] for a in PIVOT]), strict=True):
        M, x, y, *stiffness, tangent = PIVOT[angle]
        assert float(pose.state.drive[0]) == pytest.approx(M, rel=1e-4)
        u = pose.displacement(node)
        assert np.abs(u[:2]) == pytest.approx((x, y), rel=1e-3)
        assert 1 / np.diag(pose.compliance(node, held=True))[:5] == pytest.approx(stiffness, rel=1e-3)
        # the ODE's tangent at 2 degrees lies off the parabola through its own 0, 10 and 20 degrees by 2.5e-4
        assert 1 / pose.compliance(node)[5, 5] == pytest.approx(tangent, rel=1e-4 if angle > 2 else 3e-4)
