"""Time responses in large motion: the linear limit, the full order, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flexura as fx

EXAMPLES = Path(__file__).parents[2] / "examples"
GUIDE = fx.load(EXAMPLES / "guide/guide.yaml")
RPR = fx.load(EXAMPLES / "rpr/rpr.yaml")


def test_small_motion_is_the_linear_one_to_second_order() -> None:
    signal = {"carriage.tx": lambda t: 1e-4 * np.sin(2 * np.pi * 20 * t)}
    outputs = ["carriage.tx", "carriage.tx:velocity"]
    linear = fx.time_response(GUIDE, inputs=signal, outputs=outputs, dt=1e-3, duration=0.05, damping=0.0)
    off = []
    for dt in (5e-4, 2.5e-4):
        large = fx.time_response(
            GUIDE, inputs=signal, outputs=outputs, dt=dt, duration=0.05, damping=0.0, motion="large", order="full"
        )
        every = round(1e-3 / dt)
        off.append(
            np.abs(large.response[:, ::every] - linear.response).max(axis=1) / np.abs(linear.response).max(axis=1)
        )
    assert off[1].max() < 0.01
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.2)


def test_the_platform_at_low_order() -> None:
    """Its three freedoms driven to a good part of their range: within 0.1 % of the motion of the full order."""
    inputs = {
        "platform.tz": lambda t: 5.0 * np.sin(2 * np.pi * 4 * t),
        "platform.rx": lambda t: 0.02 * np.sin(2 * np.pi * 3 * t),
        "platform.ry": lambda t: 0.02 * np.sin(2 * np.pi * 2 * t),
    }
    outputs = ["platform.tz", "platform.rx", "platform.ry"]
    low, full = (
        fx.time_response(
            RPR, inputs=inputs, outputs=outputs, dt=2e-3, duration=0.12, motion="large", order=order, rho_infinity=0.8
        )
        for order in ("low", "full")
    )
    size = np.abs(full.response).max(axis=1, keepdims=True)
    assert np.abs((low.response - full.response) / size).max() < 1e-3
    assert any("54 coordinates instead of 1062" in note for note in low.notes)
    assert not low.warnings


def test_a_start_under_load_is_let_go() -> None:
    """The guide falls back from 12 mm with a quarter period of the integral of sqrt(m / 2 (V(A) - V(x))) dx over its
    static way, V the work of the force and m = k / (2 pi f)^2 there, which a stroke tells: other modes are six times as
    quick. The stiffening alone would make it 1.4 % shorter; m grows as the carriage moves down besides."""
    amplitude = 0.012
    poses = fx.stroke(GUIDE, move={"carriage.x": (0.0, amplitude)}, steps=13, n=1).poses
    x = np.array([pose.move["carriage.x"] for pose in poses])
    k = np.array([pose.drive_stiffness["carriage.x"] for pose in poses])
    mass = np.polynomial.Polynomial.fit(x, k / (2 * np.pi * np.array([pose.frequency_hz[0] for pose in poses])) ** 2, 6)
    force = np.polynomial.Polynomial.fit(x, [pose.reaction["carriage.x"] for pose in poses], 7)
    angle, weight = np.polynomial.legendre.leggauss(40)
    angle, weight = (angle + 1) * np.pi / 4, weight * np.pi / 4
    way, work = amplitude * np.sin(angle), force.integ()
    speed = np.sqrt(2 * (work(amplitude) - work(way)) / mass(way))
    quarter = float((weight * amplitude * np.cos(angle) / speed).sum())
    found = fx.time_response(
        GUIDE,
        start={"carriage.tx": poses[-1].reaction["carriage.x"]},
        outputs=["carriage.tx"],
        dt=quarter / 100,
        duration=3.2 * quarter,
        motion="large",
        order="full",
        damping=0.0,
        rho_infinity=0.5,
    )
    x = found.response[0]
    assert x[0] == pytest.approx(amplitude, rel=1e-6)
    zeros = np.flatnonzero(np.sign(x[:-1]) != np.sign(x[1:]))[:2]
    at = [found.time[k] - x[k] * (found.time[k + 1] - found.time[k]) / (x[k + 1] - x[k]) for k in zeros]
    assert (at[1] - at[0]) / 2 == pytest.approx(quarter, rel=1e-3)


def test_damping_ratios_become_rayleigh_damping() -> None:
    ways: list[dict[str, Any]] = [{}, {"motion": "large", "order": "full"}]
    signal = {"carriage.tx": lambda t: np.where(t < 0.01, 1e-4, 0.0)}
    both = [
        fx.time_response(GUIDE, inputs=signal, outputs=["carriage.tx"], dt=5e-4, duration=0.3, damping=0.02, **more)
        for more in ways
    ]
    late = [np.abs(own.response[0, -100:]).max() for own in both]
    assert late[1] == pytest.approx(late[0], rel=0.03)
    assert any("Rayleigh" in note for note in both[1].notes)


def test_dashpots_damp_as_in_small_motion() -> None:
    def brief(t: np.ndarray) -> np.ndarray:
        return np.where(t < 0.01, 1e-4, 0.0)

    ways: list[dict[str, Any]] = [{"order": "full"}, {"motion": "large", "order": "full", "rho_infinity": 0.5}]
    text = (EXAMPLES / "guide/guide.yaml").read_text()
    damped = fx.loads(text + "\ndashpots: {oil: {nodes: [carriage], damping: {tx: 2 N*s/m}}}\n")
    both = [
        fx.time_response(damped, inputs={"carriage.tx": brief}, outputs=["carriage.tx"], dt=2e-4, duration=0.1, **more)
        for more in ways
    ]
    late = [np.abs(own.response[0, -100:]).max() for own in both]
    assert late[1] == pytest.approx(late[0], rel=0.03)
    assert late[0] < 0.3 * np.abs(both[0].response).max()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"motion": "huge"}, "motion is small or large"),
        ({"motion": "large", "keep": 2}, "belong to small motion"),
        ({"motion": "large", "damping": {"loss_factor": 0.01}}, "structural damping"),
        ({"motion": "large", "rho_infinity": 2.0}, "between 0 and 1"),
        ({"motion": "large", "local_error": 0.0}, "share of the motion"),
        ({"local_error": 1e-4}, "large motion"),
        ({"motion": "large", "impulses": {"ground.rx": 1.0}}, "turns the base"),
    ],
)
def test_what_does_not_fit_is_refused(more: dict[str, Any], message: str) -> None:
    with pytest.raises(fx.OptionError, match=message):
        fx.time_response(GUIDE, inputs={"carriage.tx": np.zeros(3)}, dt=1e-3, outputs=["carriage.tx"], **more)


def test_coarse_steps_are_told() -> None:
    signal = {"carriage.tx": lambda t: 1e-3 * np.sin(2 * np.pi * 20 * t)}
    found = fx.time_response(GUIDE, inputs=signal, outputs=["carriage.tx"], dt=5e-3, duration=0.2, motion="large")
    assert any(own.kind == "step" for own in found.warnings)


def test_a_base_that_is_accelerated_is_that_of_small_motion() -> None:
    """Displacements relative to the base, accelerations with it."""
    signal = {"ground.tx": lambda t: 0.5 * np.sin(2 * np.pi * 15 * t)}
    outputs = ["carriage.tx", "carriage.tx:acceleration"]
    linear, large = (
        fx.time_response(GUIDE, inputs=signal, outputs=outputs, dt=1.25e-4, duration=0.015, damping=0.0, **more)
        for more in ({}, {"motion": "large", "order": "full", "rho_infinity": 0.8})
    )
    size = np.abs(linear.response).max(axis=1)
    assert (np.abs(large.response - linear.response).max(axis=1) / size < [2e-3, 4e-3]).all()


@pytest.mark.parametrize(("local_error", "why"), [(None, "did not settle"), (1e-3, "local error")])
def test_steps_that_were_halved_are_told(local_error: float | None, why: str) -> None:
    """Let go at once from a fifth of its length, in steps of a fifth of its period."""
    found = fx.time_response(
        GUIDE,
        start={"carriage.tx": 60.0},
        outputs=["carriage.tx"],
        dt=4e-3,
        duration=0.032,
        motion="large",
        rho_infinity=0.8,
        local_error=local_error,
    )
    (note,) = (own for own in found.notes if "were halved" in own)
    assert "for 8 samples" in note and why in note


@pytest.mark.parametrize("lighter", [1.0, 1e4])
def test_steps_settle_without_damping_of_what_they_do_not_resolve(lighter: float) -> None:
    """Let go from an eighth of the length, in steps 40 times as long as a period along the leaves: none is halved, and
    the energy is kept, so that the carriage comes back to where it was let go to within the phase of the samples."""
    steel = f"materials: {{steel: {{E: 200 GPa, nu: 0.29, rho: {7800 / lighter} kg/m^3}}}}\nsubstructures:"
    text = (EXAMPLES / "guide/guide.yaml").read_text().replace("spring-steel", "steel")
    found = fx.time_response(
        fx.loads(text.replace("substructures:", steel)),
        start={"carriage.tx": 40.0},
        outputs=["carriage.tx"],
        dt=1e-3,
        duration=0.06,
        motion="large",
        order="full",
        damping=0.0,
        rho_infinity=1.0,
    )
    x = found.response[0]
    assert not any("halved" in note for note in found.notes)
    assert np.abs(x[40:]).max() == pytest.approx(x[0], rel=0.02)
    assert any("rho_infinity" in warning.text for warning in found.warnings)


def test_what_does_not_settle_says_where_and_what_helps() -> None:
    """Unresolved for long, modes that nothing damps take energy from the steps until no step has a solution."""
    with pytest.raises(fx.SolverError, match=r"at \d+\.\d+ ms, in steps of .*leaf\d\.blade.*rho_infinity below 1"):
        fx.time_response(
            GUIDE,
            start={"carriage.tx": 150.0},
            outputs=["carriage.tx"],
            dt=6e-3,
            duration=0.3,
            motion="large",
            order="full",
            damping=0.0,
            rho_infinity=1.0,
        )
