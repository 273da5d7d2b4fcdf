"""On every example file each quantity that may be asked is what the verbs say, or it says why it has no value."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.study.questions.kinds import KINDS

EXAMPLES = Path(__file__).parents[2] / "examples"
AXES = ("x", "y", "z", "rx", "ry", "rz")

POSES = {  # displacement, size as asked and SI, a member
    "amplifier/amplifier": ("output.z", "20 um", 20e-6, "quarter1.arm"),
    "guide/guide": ("carriage.x", "1 mm", 1e-3, "leaf1"),
    "guide/servo": ("carriage.x", "0.3 mm", 0.3e-3, "leaf1"),
    "imported/guide": ("carriage.x", "0.5 mm", 0.5e-3, "stylus"),
    "pivot/pivot": ("arm.ry", "0.05 rad", 0.05, "rising"),
    "rpr/rpr": ("platform.z", "50 um", 50e-6, "rpu1"),
    "rpr/rpr_piezo": ("platform.z", "50 um", 50e-6, "upr2"),
    "rpr/rpr_test": ("platform.z", "50 um", 50e-6, "rpu1"),
    "rpr/start": ("platform.z", "50 um", 50e-6, "rpu1"),
    "rpr/start_corrected": ("platform.z", "50 um", 50e-6, "rpu1"),
    "tip_tilt/tip_tilt": ("mirror.rx", "0.5 mrad", 0.5e-3, "leg1"),
    "xy_stage/xy_stage": ("table.x", "50 um", 50e-6, "leg1"),
}


def test_every_example_is_asked():
    files = {str(file.relative_to(EXAMPLES).with_suffix("")) for file in EXAMPLES.rglob("*.yaml")}
    assert files == set(POSES)


@pytest.fixture(params=POSES, scope="module")
def example(request):
    return fx.load(EXAMPLES / f"{request.param}.yaml"), *POSES[request.param]


def answers(model, asked):
    found = fx.questions(model, list(asked)).values({})
    return dict(zip(asked, found.value[0], strict=True)), found


def same(found, wanted, rel):
    for name, value in wanted.items():
        assert found[name] == pytest.approx(value, rel=rel, abs=0), name


def test_at_rest(example):
    model, dof, *_ = example
    body = dof.partition(".")[0]
    C = fx.compliance(model, nodes=[body])
    wanted = {f"compliance({body}.{axis})": C[k, k] for k, axis in enumerate(AXES)}
    wanted |= {f"stiffness({body}.{axis})": 1 / C[k, k] for k, axis in enumerate(AXES)}
    verb = {"order": "full", "method": "direct"}
    hz, to = 20.0, f"{body}.t{dof[-1]}" if "r" not in dof.partition(".")[2] else dof
    response = fx.frequency_response(model, frequency_hz=[hz], inputs=[to], outputs=[to], **verb).response
    wanted[f"frf({dof}, {dof}, 20 Hz)"] = abs(response[0, 0, 0])
    wanted["mass"] = fx.check(model).mass.mass
    found, _ = answers(model, wanted)
    same(found, wanted, 1e-8)


def test_frequencies(example):
    model, dof, *_ = example
    body = dof.partition(".")[0]
    exact = np.array([mode.frequency_hz for mode in fx.modes(model, n=14, order="full").modes])
    numbered = [f"f{k}" for k in range(1, 9)]
    followed = [f"f({body}.{axis})" for axis in AXES]
    found, own = answers(model, [*numbered, *followed])
    assert fx.questions(model, numbered).values({}).is_proven[0]
    assert (own.lower[0, :8] * (1 - 1e-8) <= exact[:8]).all()
    assert (exact[:8] <= own.upper[0, :8] * (1 + 1e-8)).all()
    for name in followed:
        if np.isnan(found[name]):
            assert f"{name}: {body}" in own.reason[0]
        else:
            assert abs(exact / found[name] - 1).min() < 1e-3


def test_at_a_pose(example):
    model, dof, size, si, member = example
    body = dof.partition(".")[0]
    moved = fx.stroke(model, move={dof: si}, n=3, nodes=[body], compliance=True)
    [pose], stresses = moved.poses, moved.stresses(0)
    own = [one for one in stresses.members if one.name == member or one.name.startswith(f"{member}.")]
    across = f"{body}.{'y' if dof[-1] != 'y' else 'x'}"
    at = f"at {dof} = {size}"
    wanted = {
        f"stress {at}": max(one.von_mises for one in stresses.members),
        f"margin {at}": stresses.factor_to_yield,
        f"stress({member}) {at}": max(one.von_mises for one in own),
        f"stress('{member}*') {at}": max(one.von_mises for one in stresses.members if one.name.startswith(member)),
        f"margin({member}) {at}": min(one.factor_to_yield for one in own if one.factor_to_yield is not None),
        f"force({dof}) {at}": pose.reaction[dof],
        f"stiffness({dof}) {at}": pose.drive_stiffness[dof],
        f"stiffness({across}) {at}": 1 / pose.compliance_held[body][AXES.index(across[-1])][AXES.index(across[-1])],
        f"f1 {at}": pose.frequency_hz[0],
        f"f3 {at}": pose.frequency_hz[2],
        f"buckling {at}": pose.buckling_factor,
    }
    found, _ = answers(model, wanted)
    same(found, wanted, 1e-7)


def test_every_kind_answers_or_says_why(example):
    """Of all of the catalogue, with the first actuator and sensor where there are some."""
    model, dof, size, _, member = example
    body, at = dof.partition(".")[0], f"at {dof} = {size}"
    given = {"dof": dof, "body": body, "member": member, "actuator": next(iter(model.actuators), dof)}
    given |= {"output": next(iter(model.sensors), dof), "input": given["actuator"]}
    given["parameter"] = next(iter(model.parameters))
    given["disturbance"] = next(iter(model.disturbances), "floor")
    given["temperature"] = "temperature"
    for kind in KINDS.values():
        hertz = iter(("1 Hz", "2 Hz"))
        inside = ", ".join(next(hertz) if own == "hertz" else given[own] for own in kind.arguments)
        text = f"{kind.name}({inside}) {at}" if kind.poses == "needed" else f"{kind.name}({inside})"
        try:
            found = fx.questions(model, text).values({})
        except fx.OptionError as error:
            unasked = "stress margin buckling shift centre_shift amplification frf frf_peak rms"
            assert kind.name in unasked.split(), text
            assert kind.name in str(error)
            continue
        assert not np.isnan(found.value[0, 0]) or kind.name in found.reason[0], text
