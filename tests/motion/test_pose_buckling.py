"""Buckling factors of poses against closed forms.

Timoshenko, Gere, Theory of elastic stability (1961): Euler columns; lateral buckling of a cantilever strip, sec. 6.3.
Argyris, Comput. Methods Appl. Mech. Engrg. 20 (1979) 105: right-angle frame under end moments.
"""

import numpy as np
import pytest

import flexura as fx
from flexura.motion import buckling_factor
from helpers.large_motion import Moved, straight_beams


@pytest.mark.parametrize(
    ("top", "ends"),
    [(None, 0.25), ("{fixed: [ty, tz, rx, ry, rz]}", 4.0), ("{fixed: [ty, tz, rx]}", 2.0457483)],
)
@pytest.mark.parametrize("share", [0.01, 0.5, 0.95])
def test_columns_driven_along_their_axis(top, ends, share):
    """Clamped columns whose top is free, clamped, hinged; axially driven to a share of Euler's load."""
    section = "A: 1e-4 m^2, Iy: 3e-10 m^4, Iz: 1e-10 m^4, J: 1e-10 m^4, ky: 1e6, kz: 1e6"
    ground = {"p0": "clamped"} | ({} if top is None else {"p1": top})
    moved = Moved(straight_beams([(0, 0, 0), (1, 0, 0)], section, 10, E=2e11, G=8e10, ground=ground), "p1.x")
    euler = ends * np.pi**2 * 2e11 * 1e-10
    (pose,) = moved.through([[-share * euler / (2e11 * 1e-4)]])
    assert buckling_factor(pose) == pytest.approx(1 / share, rel=3e-4)


def test_lateral_buckling_of_a_strip():
    """Errors fall with the square of the length of elements, and towards buckling itself."""
    E, G, weak, strong, J = 2e11, 8e10, 1e-10, 1e-6, 4e-10
    critical = 4.012599 * np.sqrt(E * weak * G * J)
    section = f"A: 1e-2 m^2, Iy: {weak} m^4, Iz: {strong} m^4, J: {J} m^4, ky: 1e6, kz: 1e6"
    errors = {}
    for elements in (4, 8, 16):
        moved = Moved(straight_beams([(0, 0, 0), (1, 0, 0)], section, elements, E=E, G=G, ground={"p0": "clamped"}))
        poses = moved.loaded([{"p1": [0, -share * critical, 0, 0, 0, 0]} for share in (0.01, 0.9)])
        for share, pose in zip((0.01, 0.9), poses, strict=True):
            factor = buckling_factor(pose)
            assert factor is not None
            errors[elements, share] = factor * share - 1
    assert abs(errors[16, 0.01]) < 1.2e-3
    assert abs(errors[16, 0.9]) < 3e-4
    assert np.log2(errors[4, 0.01] / errors[8, 0.01]) == pytest.approx(2, abs=0.1)


@pytest.mark.parametrize("share", [-0.9, 0.9])
def test_right_angle_frame_under_end_moments(share):
    L, h, t, E, nu = 240.0, 30.0, 0.6, 71240.0, 0.31
    G, weak, strong, J = E / (2 + 2 * nu), h * t**3 / 12, t * h**3 / 12, h * t**3 / 3
    critical = np.pi / L * np.sqrt(E * weak * G * J)
    assert critical == pytest.approx(622.21, abs=0.01)
    half, foot = L * 0.5**0.5, "{fixed: [ty, tz, rx, ry]}"
    section = f"A: {h * t} m^2, Iy: {weak} m^4, Iz: {strong} m^4, J: {J} m^4"
    ground = {"p0": foot, "p1": "{fixed: [tx]}", "p2": foot}
    points = [(-half, 0, 0), (0, half, 0), (half, 0, 0)]
    moved = Moved(straight_beams(points, section, 16, E=E, G=G, ground=ground))
    M = share * critical
    (pose,) = moved.loaded([{"p0": [0, 0, 0, 0, 0, M], "p2": [0, 0, 0, 0, 0, -M]}])
    assert buckling_factor(pose) == pytest.approx(1 / abs(share), rel=3e-4)


def test_nothing_buckles_at_rest_nor_under_tension():
    section = "A: 1e-4 m^2, Iy: 3e-10 m^4, Iz: 1e-10 m^4, J: 1e-10 m^4"
    column = straight_beams([(0, 0, 0), (1, 0, 0)], section, 4, E=2e11, G=8e10, ground={"p0": "clamped"})
    for pose in fx.stroke(column, move={"p1.x": (0.0, 1e-5)}, steps=2, n=1).poses:
        assert pose.buckling_factor is None
