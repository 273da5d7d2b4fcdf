"""Static results say where they stop holding: against closed forms of cantilevers, guides and columns."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from helpers.warned_statics import YIELD, E, cantilever, warned

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_cantilever_at_any_size(size):
    L, b, t = 0.1 * size, 0.01 * size, 0.001 * size
    EI = E * b * t**3 / 12  # reference y: local z, the thickness, is along global z or y
    model = fx.assemble(cantilever(size))
    C = fx.compliance(model, nodes=["b"])
    axis = int(np.argmax(np.diagonal(C)[1:3])) + 1
    assert C[axis, axis] == pytest.approx(L**3 / (3 * EI), rel=1e-9)

    def pushed(tip):
        return fx.statics(model, loads={"b": np.eye(6)[axis] * 3 * EI / L**3 * tip * L})

    assert not {"rotation", "displacement"} & set(warned(pushed(0.066)))
    found = warned(pushed(0.09))
    assert found["rotation"].value == pytest.approx(1.5 * 0.09, rel=1e-9)
    assert "displacement" not in found
    found = warned(pushed(-0.2))
    assert found["displacement"].place == "bar"
    assert (found["displacement"].value, found["displacement"].limit) == pytest.approx((0.2 * L, 0.1 * L), rel=1e-9)
    # sigma = 3 E t tip / (2 L)
    assert found["stress"].value == pytest.approx(1.5 * E * t / L * 0.2 / YIELD, rel=1e-9)


def test_rigid_turning_is_no_deflection():
    hinge = fx.describe.Spring(
        nodes=("a", "root"), stiffness=fx.describe.DiagonalStiffness(tx=1e9, ty=1e9, tz=1e9, rx=1.0, ry=1.0, rz=1.0)
    )
    plain = cantilever()
    turned = plain.model_copy(
        update={
            "nodes": {**plain.nodes, "root": (0, 0, 0)},
            "springs": {"hinge": hinge},
            "ground": {"root": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
        }
    )
    found = warned(fx.statics(turned, loads={"b": (0, 2e-3 / 0.1 * 10, 0, 0, 0, 0)}))
    assert found.keys() <= {"rotation"}
    found = warned(fx.statics(turned, loads={"b": (0, 3.0, 0, 0, 0, 0)}))
    assert found["rotation"].value > 0.2
    assert "displacement" not in found


def test_column_beyond_euler_s_load():
    L, b, t = 0.1, 0.01, 0.001
    euler = np.pi**2 * E * b * t**3 / 12 / (2 * L) ** 2
    assert "buckling" not in warned(fx.statics(cantilever(), loads={"b": (-0.99 * euler, 0, 0, 0, 0, 0)}))
    assert "buckling" not in warned(fx.statics(cantilever(), loads={"b": (5 * euler, 0, 0, 0, 0, 0)}))
    found = warned(fx.statics(cantilever(), loads={"b": (-2 * euler, 0, 0, 0, 0, 0)}))
    assert found["buckling"].value == pytest.approx(2, rel=1e-3)


def test_what_cannot_be_looked_at_is_noted():
    result = fx.statics(fx.load(EXAMPLES / "imported" / "guide.yaml"), gravity=(0, 0, -9.81))
    assert result.warnings == ()
    assert len(result.notes) == 1 and "superelement" in result.notes[0]
    assert fx.statics(fx.load(EXAMPLES / "xy_stage" / "xy_stage.yaml"), gravity=(0, 0, -9.81)).notes == ()


@pytest.mark.parametrize(
    ("command", "kinds"),
    [(10e-6, []), (30e-6, ["stiffness"]), (0.0, []), (30.1e-6, ["command", "stiffness"]), (-1e-6, ["command"])],
)
def test_free_stroke_on_both_sides(command, kinds):
    result = fx.statics(fx.load(EXAMPLES / "amplifier" / "amplifier.yaml"), actuators={"piezo": command})
    assert [w.kind for w in result.warnings] == kinds
    assert all(w.place == "piezo" and w.value == command for w in result.warnings if w.kind == "command")


def test_blocked_force_of_a_stack_that_is_not_driven():
    stack = fx.describe.PiezoStack(nodes=("c", "b"), stiffness=1e6, blocked_force=20.0)
    held = cantilever(actuators={"stack": stack})
    held = held.model_copy(
        update={
            "nodes": {**held.nodes, "c": (0.1, 0, -0.01)},
            "ground": {**held.ground, "c": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
        }
    )
    for force, beyond in ((-19.0, False), (-25.0, True), (25.0, True)):
        result = fx.statics(held, loads={"b": (0, 0, force, 0, 0, 0)})
        found = warned(result)
        assert ("force" in found) is beyond
        if beyond:
            assert found["force"].value == pytest.approx(result.actuators[0].force)
            assert np.sign(found["force"].value) == -np.sign(force)


def test_limit_of_a_force_on_both_sides():
    driven = cantilever(actuators={"coil": fx.describe.ForceActuator(nodes=("b",), direction="x", limit=2.0)})
    for command, beyond in ((2.0, False), (-2.0, False), (2.1, True), (-2.1, True)):
        assert ("command" in warned(fx.statics(driven, actuators={"coil": command}))) is beyond


@pytest.mark.parametrize("beyond", [2e-5, 1e-3])
def test_a_command_at_its_limit_but_for_the_digits_of_a_data_sheet(beyond):
    """A free stroke of 30 um, and a coil of 2 N; 120 V at 0.16667 um/V are 20 um but for 2e-5."""
    coil = {"coil": fx.describe.ForceActuator(nodes=("b",), direction="y", limit=2.0)}
    amplifier = fx.load(EXAMPLES / "amplifier" / "amplifier.yaml")
    told = [
        str(w)
        for model, command in ((amplifier, {"piezo": 30e-6}), (cantilever(actuators=coil), {"coil": -2.0}))
        for w in fx.statics(model, actuators={key: own * (1 + beyond) for key, own in command.items()}).warnings
        if w.kind == "command"
    ]
    if beyond < 1e-4:
        assert not told
        return
    assert "1.001 times what gives its free stroke" in told[0] and "1.001 times its limit" in told[1]


def test_warnings_as_errors():
    guide = fx.load(EXAMPLES / "guide" / "guide.yaml")
    small = fx.statics(guide, loads={"carriage": (1, 0, 0, 0, 0, 0)})
    assert small.raise_warnings() is small
    large = fx.statics(guide, loads={"carriage": (1e4, 0, 0, 0, 0, 0)})
    with pytest.raises(fx.LimitError, match="the theory is linear") as caught:
        large.raise_warnings()
    assert caught.value.warnings == large.warnings
    assert [w["kind"] for w in large.to_dict()["warnings"]] == [
        *("rotation", "displacement", "stiffness", "stress", "buckling")
    ]


def test_shell():
    run = ["statics", str(EXAMPLES / "amplifier" / "amplifier.yaml"), "--actuator", "piezo=3 mm"]
    result = CliRunner().invoke(app, run)
    assert result.exit_code == 0
    assert "warning: piezo is driven with 3 mm, 100 times what gives its free stroke, 30 µm" in result.stdout
    data = json.loads(CliRunner().invoke(app, [*run, "--json"]).stdout)
    assert {w["kind"] for w in data["warnings"]} >= {"command", "force", "rotation", "displacement", "stress"}
    strict = CliRunner().invoke(app, [*run, "--strict"])
    assert strict.exit_code == 1 and isinstance(strict.exception, fx.LimitError) and not strict.stdout
