"""Ways that loads drive: through limit points and snap-back, past forks, along buckled branches.

Lee, Manuel, Rossow, J. Engng Mech. Div. ASCE 94 (1968) 525: frame, its limit by the ODE of the geometrically exact rod.
Williams, Quart. J. Mech. Appl. Math. 17 (1964) 451: toggle, by that ODE.
Euler (1744): the elastica of a column, by complete elliptic integrals.
Timoshenko, Gere, Theory of elastic stability (1961), sec. 6.3: lateral buckling of a strip.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, root
from scipy.special import ellipe, ellipk

import flexura as fx
from flexura.deadline import OutOfTime, Progress, time_limit
from helpers.large_motion import straight_beams

STEPS = 60
"""Of Runge and Kutta's method in a leg of the frame."""

NOTHING = [0.0] * 6


def lee_frame() -> fx.Mechanism:
    """Stiff enough out of its plane, where it buckles otherwise long before its limit."""
    EA, EI = 4.32e7, 1.44e7
    section = f"A: {EA!r} m^2, Iy: {100 * EI!r} m^4, Iz: {EI!r} m^4, J: {100 * EI!r} m^4, ky: 1e6, kz: 1e6"
    points = [(0, 0, 0), (0, 120, 0), (24, 120, 0), (120, 120, 0)]
    hinge = "{fixed: [tx, ty, tz, rx, ry]}"
    return straight_beams(points, section, 10, E=1.0, G=0.5, ground={"p0": hinge, "p3": hinge})


def lee_ode(P: float, u: float, v: float, turn: float, moment: float) -> np.ndarray:
    """Displacement (u, v) of the loaded point by the strong form, nearest to one at which the first foot has nearly
    turned by `turn` and the ground exerts nearly a `moment` about it."""
    EA, EI = 4.32e7, 1.44e7

    def rod(forces: tuple[float, float], start: np.ndarray, length: float) -> np.ndarray:
        """x, y, angle and moment at the end of a rod under the force that its start exerts on it."""
        H, V = forces

        def slope(at: list[float]) -> list[float]:
            c, s = math.cos(at[2]), math.sin(at[2])
            stretch = 1 - (H * c + V * s) / EA
            return [stretch * c, stretch * s, at[3] / EI, stretch * (V * c - H * s)]

        at, h = start.tolist(), length / STEPS
        for _ in range(STEPS):
            k1 = slope(at)
            k2 = slope([x + h / 2 * k for x, k in zip(at, k1, strict=True)])
            k3 = slope([x + h / 2 * k for x, k in zip(at, k2, strict=True)])
            k4 = slope([x + h * k for x, k in zip(at, k3, strict=True)])
            at = [x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(at, k1, k2, k3, k4, strict=True)]
        return np.array(at)

    def legs(unknown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        H, V, turn = unknown[0] * 1e4, unknown[1] * 1e4, unknown[2]
        corner = rod((H, V), np.array([0, 0, np.pi / 2 + turn, 0]), 120)
        loaded = rod((H, V), corner - [0, 0, np.pi / 2, 0], 24)
        return loaded, rod((H, V - P), loaded, 96)

    def misses(unknown: np.ndarray) -> np.ndarray:
        end = legs(unknown)[1]
        return np.array([(end[0] - 120) / 120, (end[1] - 120) / 120, end[3] / 1e6])

    found = []
    for H in np.linspace(-2.5, 2.5, 21):
        own = root(misses, [H, P / 1e4 + H - moment / 120e4, turn], options={"xtol": 1e-10})
        if own.success and np.abs(misses(own.x)).max() < 1e-7:
            loaded = legs(own.x)[0]
            found.append(np.array([loaded[0] - 24, 120 - loaded[1]]))
            if np.hypot(*(found[-1] - [u, v])) < 0.5:
                break
    return min(found, key=lambda at: float(np.hypot(*(at - [u, v]))))


def test_lee_frame_through_its_snap_back():
    stroke = fx.stroke(
        lee_frame(), loads={"p2": (NOTHING, [0, -20_000.0, 0, 0, 0, 0])}, steps=21, n=1, nodes=["p2", "p0"]
    )
    limits = [w for w in stroke.warnings if w.kind == "limit point"]
    P = np.array([-pose.load["p2.Fy"] for pose in stroke.poses])
    u, v = np.array([pose.displacement["p2"][:2] for pose in stroke.poses]).T * [[1], [-1]]
    assert len(limits) == 2
    top, bottom = int(np.argmax(P[:40])), int(np.argmin(P))
    assert P[top] == pytest.approx(18_556.9, rel=2e-5)
    assert (u[top], v[top]) == pytest.approx((26.59, 48.5), abs=0.3)
    assert top < bottom
    assert P[-1] == 20_000
    assert v[top:bottom].max() > v[bottom] + 2, "it snaps back"
    unstable = np.array([pose.frequency_hz_held[0] < 0 for pose in stroke.poses])
    assert unstable[top + 1 : bottom].all()
    assert not unstable[:top].any()
    assert not unstable[bottom + 1 :].any()
    for k in [k for k in range(top, len(P)) if round(P[k]) in (0, 20_000)]:
        pose = stroke.poses[k]
        ode = lee_ode(P[k], u[k], v[k], pose.displacement["p0"][5], pose.ground_reaction[5])
        assert ode == pytest.approx((u[k], v[k]), abs=1e-4 * 120)


def test_williams_toggle_by_its_load():
    EA, EI = 1.885e6, 9.274e3
    section = f"A: {EA!r} m^2, Iy: {100 * EI!r} m^4, Iz: {EI!r} m^4, J: {100 * EI!r} m^4, ky: 1e6, kz: 1e6"
    points = [(0, 0, 0), (12.943, 0.386, 0), (25.886, 0, 0)]
    toggle = straight_beams(points, section, 8, E=1.0, G=0.5, ground={"p0": "clamped", "p2": "clamped"})
    stroke = fx.stroke(toggle, loads={"p1": (NOTHING, [0, -40.0, 0, 0, 0, 0])}, steps=9, n=1, nodes=["p1"])
    P = np.array([-pose.load["p1.Fy"] for pose in stroke.poses])
    v = np.array([-pose.displacement["p1"][1] for pose in stroke.poses])
    top = int(np.argmax(P[v < 0.3]))
    bottom = top + int(np.argmin(P[top:]))
    assert (P[top], v[top]) == (pytest.approx(33.87, abs=0.02), pytest.approx(0.232, abs=0.005))
    assert (P[bottom], v[bottom]) == (pytest.approx(31.28, abs=0.03), pytest.approx(0.390, abs=0.01))
    assert P[-1] == 40
    assert (np.diff(v) > 0).all()


def column(EA: float = 1e8) -> fx.Mechanism:
    section = f"A: {EA!r} m^2, Iy: 50 m^4, Iz: 1 m^4, J: 30 m^4, ky: 1e6, kz: 1e6"
    return straight_beams([(0, 0, 0), (1, 0, 0)], section, 10, E=1.0, G=0.5, ground={"p0": "clamped"})


@pytest.mark.parametrize("side", [1, -1])
def test_buckled_column_is_an_elastica(side):
    P = np.pi**2 / 4
    stroke = fx.stroke(
        column(), loads={"p1": (NOTHING, [-2 * P, 0, 0, 0, 0, 0])}, steps=11, n=2, nodes=["p1"], branch=side
    )
    assert [w.kind for w in stroke.warnings if w.kind == "bifurcation"] == ["bifurcation"]
    beyond = [pose for pose in stroke.poses if pose.share > 0.55]
    assert len(beyond) == 5
    for pose in beyond:
        k = brentq(lambda k, r=2 * pose.share: (2 * ellipk(k * k) / np.pi) ** 2 - r, 1e-6, 0.9999)
        K, E = ellipk(k * k), ellipe(k * k)
        x, y, angle = (pose.displacement["p1"][i] for i in (0, 1, 5))
        # the largest displacement of the critical mode is the turn of the end
        assert (x, y, angle) == pytest.approx((2 * E / K - 2, side * 2 * k / K, side * 2 * np.arcsin(k)), abs=2e-5)
        assert pose.frequency_hz[0] > 0


def test_a_perfect_column_goes_straight_on_and_says_so():
    stroke = fx.stroke(column(), loads={"p1": (NOTHING, [-6.0, 0, 0, 0, 0, 0])}, steps=7, n=2, nodes=["p1"])
    (fork,) = [w for w in stroke.warnings if w.kind == "bifurcation"]
    assert float(str(fork).split("p1.Fx = ")[1].split()[0]) == pytest.approx(-(np.pi**2) / 4, rel=1e-5)
    assert max(abs(pose.displacement["p1"][1]) for pose in stroke.poses) < 1e-9
    assert "branch = 1 or -1" in str(fork)


def test_a_column_that_is_pressed_together():
    """Its force stays near that of Euler, and the displacement at which it buckles is that force over its stiffness."""
    pressed = column(1e6)
    straight = fx.stroke(pressed, move={"p1.x": (0, -1e-5)}, steps=11, n=1)
    (fork,) = [w for w in straight.warnings if w.kind == "bifurcation"]
    assert float(str(fork).split("p1.x = ")[1].split()[0]) == pytest.approx(-(np.pi**2) / 4 / 1e6, rel=1e-3)
    buckled = fx.stroke(pressed, move={"p1.x": (0, -0.1)}, steps=11, n=1, branch=1)
    assert [pose.move["p1.x"] for pose in buckled.poses] == pytest.approx(np.linspace(0, -0.1, 11))
    assert all(pose.frequency_hz[0] > 0 for pose in buckled.poses)
    for pose in buckled.poses[1:]:
        force = -pose.reaction["p1.x"]
        k = brentq(lambda k, r=4 * force / np.pi**2: (2 * ellipk(k * k) / np.pi) ** 2 - r, 1e-6, 0.9999)
        bent = 2 - 2 * ellipe(k * k) / ellipk(k * k)
        assert -pose.move["p1.x"] == pytest.approx(bent + force / 1e6, abs=5e-5)


def test_a_column_that_is_pulled_does_not_buckle_where_it_does_pressed():
    stroke = fx.stroke(column(1e6), move={"p1.x": (-1e-5, 1e-5)}, steps=5, n=1)
    (fork,) = [w for w in stroke.warnings if w.kind == "bifurcation"]
    assert float(str(fork).split("p1.x = ")[1].split()[0]) == pytest.approx(-(np.pi**2) / 4 / 1e6, rel=1e-3)
    stroke = fx.stroke(column(1e6), move={"p1.x": (1e-5, -1e-5)}, steps=5, n=1)
    assert [str(fork)] == [str(w) for w in stroke.warnings if w.kind == "bifurcation"]


def test_lateral_buckling_of_a_strip():
    EI, GJ = 1.0, 1.0
    section = f"A: 1e6 m^2, Iy: {EI!r} m^4, Iz: 1e4 m^4, J: {2 * GJ!r} m^4, ky: 1e6, kz: 1e6"
    strip = straight_beams([(0, 0, 0), (1, 0, 0)], section, 16, E=1.0, G=0.5, ground={"p0": "clamped"})
    stroke = fx.stroke(strip, loads={"p1": (NOTHING, [0, -5.0, 0, 0, 0, 0])}, steps=6, n=1)
    fork = next(w for w in stroke.warnings if w.kind == "bifurcation")
    assert float(str(fork).split("p1.Fy = ")[1].split()[0]) == pytest.approx(-4.012599, rel=1e-3)
    sideways = fx.stroke(
        strip, loads={"p1": (NOTHING, [0, -5.0, 0, 0, 0, 0])}, steps=6, n=1, nodes=["p1"], branch=-1
    ).poses[-1]
    assert abs(sideways.displacement["p1"][2]) > 0.3
    assert sideways.frequency_hz[0] > 0


def test_an_interruption_leaves_what_was_found():
    def listener(progress: Progress) -> None:
        if progress.done == 3:
            raise KeyboardInterrupt

    moves = {"p1.y": (0, 0.4)}
    stroke = fx.stroke(column(), move=moves, steps=5, n=1, progress=listener)
    whole = fx.stroke(column(), move=moves, steps=5, n=1)
    assert len(stroke.poses) == 3
    assert stroke.interrupted
    assert not whole.interrupted
    assert [p.reaction for p in stroke.poses] == [p.reaction for p in whole.poses[:3]]
    assert "interrupted after 3 of 5 poses" in str(stroke.warnings[0])


def test_a_time_limit_leaves_what_was_found():
    with time_limit(1e-9), pytest.raises(OutOfTime, match="stopped after"):
        fx.stroke(column(), move={"p1.y": 0.1}, n=1)


def curved_beam() -> fx.Mechanism:
    """A beam with the shape of a cosine, clamped at both ends, whose rise is six times its thickness."""
    rise = [0.5 * 3.0 * (1 - np.cos(2 * np.pi * k / 16)) for k in range(17)]
    nodes = "\n".join(f"  p{k}: [{100 * k / 16!r} mm, 0, {float(z)!r} mm]" for k, z in enumerate(rise))
    links = "\n".join(
        f"  l{k}: {{nodes: [p{k}, p{k + 1}], material: spring-steel, reference: z,"
        " section: {shape: rectangle, width: 10 mm, thickness: 0.5 mm}}"
        for k in range(16)
    )
    ground = "ground: {p0: clamped, p16: clamped}\n"
    return fx.loads(f"flexura: 1\nname: curved\ncorrections: none\nnodes:\n{nodes}\nlinks:\n{links}\n{ground}")


@pytest.mark.parametrize("steps", [8, 15, 57])
def test_a_way_that_ends_is_not_left_for_another(steps):
    """The middle of a curved beam has to turn back at 4.945 mm; states beyond are of another way, at other energies."""
    found = fx.stroke(curved_beam(), move={"p8.z": (0, -7e-3), "p8.ry": (0, 0)}, steps=steps, n=1)
    travel = np.array([pose.move["p8.z"] for pose in found.poses])
    force = np.array([pose.reaction["p8.z"] for pose in found.poses])
    assert -4.95e-3 < travel[-1] < -4.945e-3 + 7e-3 / (steps - 1)
    (said,) = (own.text for own in found.warnings if own.kind == "equilibrium")
    assert "no equilibrium is found beyond p8.z = -0.00494" in said
    if steps > 50:
        gained = np.diff([pose.energy for pose in found.poses])
        assert gained == pytest.approx(np.diff(travel) * (force[1:] + force[:-1]) / 2, abs=1e-4)


def test_a_single_pose_beyond_the_end_of_the_way_is_not_found():
    found = fx.stroke(curved_beam(), move={"p8.z": -6e-3, "p8.ry": 0.0}, n=1)
    assert found.poses == ()
    assert any("no equilibrium is found beyond p8.z = -0.00494" in own.text for own in found.warnings)
