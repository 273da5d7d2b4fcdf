"""Steps in float32 as C: compiled with every warning an error, run here and on an emulated Arm processor, and held
against the double model in exact arithmetic and the bound that was proven."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.structure import Channel
from flexura.systems.state_space import StateSpace
from helpers.compiled_c import ARM, FLAGS, NATIVE, has, run
from helpers.export_models import example_modes, modal_model
from helpers.over import over

STEP = 1e-4


def stage(damping: float = 0.01) -> StateSpace:
    """Two inputs, and three outputs of which one is an acceleration."""
    return modal_model(example_modes("xy_stage", 6), "table", damping)


def mixed() -> StateSpace:
    """The same in coordinates in which nothing is in blocks, with two real poles and a third."""
    own = stage(0.05)
    n = own.order
    A = np.zeros((n + 3, n + 3))
    A[:n, :n] = own.A
    A[n:, n:] = np.diag([-300.0, -2000.0, -9000.0])
    scale = np.concatenate([np.tile([1e-4, 1.0], n // 2), np.ones(3)])
    T = np.linalg.qr(np.random.default_rng(0).standard_normal((n + 3, n + 3)))[0] / scale
    B, C = np.vstack([own.B, np.ones((3, 2))]), np.hstack([own.C, 1e-6 * np.ones((3, 3))])
    names = tuple(f"x{k}" for k in range(n + 3))
    return replace(own, A=np.linalg.solve(T, A) @ T, B=np.linalg.solve(T, B), C=C @ T, state_names=names)


def critical() -> StateSpace:
    """Poles that coincide."""
    w = 2 * np.pi * 30
    A, B, C = np.array([[0, 1], [-(w**2), -2 * w]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
    ends = (Channel("a", "force"),), (Channel("a", "displacement"),)
    return StateSpace(A, B, C, np.zeros((1, 1)), *ends, ("x", "v"))


MODELS = {
    "modal": lambda: stage().discretised(STEP),
    "short step": lambda: stage().discretised(STEP / 20),
    "damped": lambda: stage(0.2).discretised(STEP),
    "delay of a part of a step": lambda: stage(0.05).discretised(STEP, delay=1.3 * STEP),
    "delay of steps": lambda: stage(0.05).discretised(STEP, delay=3 * STEP),
    "mixed": lambda: mixed().discretised(STEP),
    "critical": lambda: critical().discretised(STEP),
    "triangle hold": lambda: stage(0.05).discretised(STEP, "foh"),
}


def exact(model: StateSpace, inputs: np.ndarray) -> np.ndarray:
    """Outputs in extended precision."""
    A, B, C, D = (np.asarray(X, dtype=np.longdouble) for X in (model.A, model.B, model.C, model.D))
    x, found = np.zeros(model.order, dtype=np.longdouble), []
    for u in inputs.astype(np.float32).astype(np.longdouble):
        found.append(C @ x + D @ u)
        x = A @ x + B @ u
    return np.array(found)


def driven(model: StateSpace, output: int, steps: int = 3000) -> np.ndarray:
    """Inputs between -1 and 1 that make an output as large as it can be in so many steps, then noise."""
    x, response = model.B, [model.D[output]]
    for _ in range(steps - 1):
        response.append(model.C[output] @ x)
        x = model.A @ x
    noise = np.random.default_rng(1).uniform(-1, 1, (steps // 8, len(model.inputs)))
    return np.concatenate([np.where(np.array(response)[::-1] < 0, -1.0, 1.0), noise])


@over("name", MODELS)
def test_the_difference_is_below_its_bound_which_is_no_more_than_a_hundred_times_wider(name, tmp_path: Path):
    model = MODELS[name]()
    found = fx.models.single_precision(model)
    fx.export(found, tmp_path / "plant.c")
    for k in range(len(model.outputs)):
        u = driven(model, k)
        off = np.abs(run(tmp_path / "plant.c", u, len(model.outputs)) - exact(model, u)).max(axis=0)
        allowed = found.bound.sum(axis=1) + found.floor
        assert (off <= allowed).all()
        assert allowed[k] < 100 * off[k]


def test_coefficients_rounded_without_care_are_beyond_the_bound():
    model = stage().discretised(STEP / 20)
    found, u = fx.models.single_precision(model), driven(model, 0, 8000)
    plain = replace(model, **{name: getattr(model, name).astype(np.float32).astype(float) for name in "ABCD"})
    off = np.abs(exact(plain, u) - exact(model, u)).max(axis=0)
    assert (off > found.bound.sum(axis=1)).any()


def test_the_bound_of_one_real_pole_is_that_of_its_closed_form():
    """Of x' = a x + u, y = x with a = 1/2 exactly: the largest x is 2, and a change of x counts twice. Products with a
    power of two and one are exact, but what is proven does not know that: 5 and 4 units of rounding at most for
    changes, two and one to read them."""
    one = (Channel("a", "force"),), (Channel("a", "force"),)
    model = StateSpace(np.array([[0.5]]), np.eye(1), np.eye(1), np.zeros((1, 1)), *one, ("x",), 1.0)
    found = fx.models.single_precision(model)
    unit = 2.0**-24
    changes = 5 * 0.5 * 2 + 4 * 1
    assert found.bound[0, 0] == pytest.approx((2 * changes + (1 + 3) * 2) * unit, rel=0.05)
    assert found.size[0, 0] == pytest.approx(2.0)


def test_sums_carry_what_they_lose():
    """A plain sum of float32 rests where changes are below half of its last digit, here 3e-5 before the end."""
    w, ends = 1.0, ((Channel("a", "force"),), (Channel("a", "displacement"),))
    slow = StateSpace(np.array([[-w]]), np.array([[w]]), np.eye(1), np.zeros((1, 1)), *ends, ("x",)).discretised(1e-3)
    y = fx.models.single_precision(slow).run(np.ones((16_000, 1)))
    assert y[-1, 0] == pytest.approx(1.0, abs=5e-7)


@pytest.mark.skipif(not has(ARM), reason="no C compiler for Arm, or qemu-user to run its programs, is installed")
@over("name", ("modal", "delay of a part of a step", "mixed"))
def test_an_arm_processor_takes_the_same_steps(name, tmp_path: Path):
    model = MODELS[name]()
    u = driven(model, 0, 3000)
    fx.export(model, tmp_path / "plant.c")
    here, there = (run(tmp_path / "plant.c", u, len(model.outputs), target=of) for of in (NATIVE, ARM))
    assert here.tobytes() == there.tobytes()


def test_what_is_written(tmp_path: Path):
    model = stage().discretised(STEP, delay=STEP)
    written = fx.export(model, tmp_path / "my_stage.c")
    assert [path.name for path in written] == ["my_stage.c", "my_stage.h"]
    source, header = (path.read_text() for path in written)
    bound = fx.models.single_precision(model)
    assert bound.text in header and "y[2]  table.accelerometer, acceleration [m/s^2]" in header
    assert not re.search(r"malloc|math\.h|\bdouble\b|\breturn\b|\bgoto\b|while|\bint\b", source)
    numbers = re.findall(r"-?\d[\d.e+-]*f\b", source)
    assert {np.float32(x[:-1]) for x in numbers} >= {*bound.change.ravel(), *bound.C.ravel()}
    assert source == (fx.export(model, tmp_path / "my_stage.c"), written[0].read_text())[1]


def test_names_do_not_end_comments(tmp_path: Path):
    odd = Channel("*/ int x; /* µm ° \\", "force")
    model = replace(stage(), inputs=(odd, Channel("//", "moment"))).discretised(STEP)
    fx.export(model, tmp_path / "a.c")
    assert run(tmp_path / "a.c", np.ones((5, 2)), 3).shape == (5, 3)


def test_sums_that_may_be_reordered_do_not_compile(tmp_path: Path):
    fx.export(MODELS["modal"](), tmp_path / "a.c")
    command = [NATIVE[0], "-ffast-math", "-c", "a.c"]
    assert "-ffast-math" in subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False).stderr


SENSED = """
name: sensed
bodies:
  block: {centre: [0, 0, 0], mass: 2 kg, inertia: [1e-3 kg*m^2, 1e-3 kg*m^2, 1e-3 kg*m^2]}
springs:
  spring: {nodes: [block], stiffness: {tx: 80 N/mm}}
ground:
  block: {free: [tx]}
damping: 2 %
sensors:
  x: {type: displacement, nodes: [block], direction: x}
disturbances:
  air: {input: block.tx, density: 1 mN/sqrt(Hz)}
  noise: {sensor: x, density: 1 nm/sqrt(Hz)}
"""


def test_an_observer_takes_its_steps_in_c(tmp_path: Path):
    found = fx.observer(fx.loads(SENSED), dt=STEP, inputs=["block.tx"], delay=1.5 * STEP)
    header = fx.export(found, tmp_path / "observer.c")[1].read_text()
    assert re.search(
        r"observer_step\(observer_state \*self, const float u\[.*\],\s+const float y\[.*\],\s+float xhat", header
    )
    own = fx.models.single_precision(found.estimator)
    u = np.random.default_rng(0).uniform(-1, 1, (4000, 2)) * [5.0, 1e-4]
    off = np.abs(run(tmp_path / "observer.c", u, 2, parts=[1, 1]) - exact(found.estimator, u)).max(axis=0)
    allowed = own.bound @ np.abs(u).max(axis=0) + own.floor
    assert (off <= allowed).all() and (allowed < 1000 * off).all()


SHAPED = """
#include "shaper.h"
#include <stdio.h>
int main(void)
{
    static shaper_state one;
    float in;
    shaper_init(&one, 0.5f);
    while (fread(&in, sizeof in, 1, stdin) == 1) {
        const float out = shaper_step(&one, in);
        fwrite(&out, sizeof out, 1, stdout);
    }
    return 0;
}
"""


def test_a_shaper_takes_its_steps_in_c_and_rests_where_it_began(tmp_path: Path):
    found = fx.shaper(fx.loads(SENSED), dt=STEP, kind="ZVD")
    header = fx.export(found, tmp_path / "shaper.c")[1].read_text()
    (tmp_path / "main.c").write_text(SHAPED)
    command = [NATIVE[0], *FLAGS, "-o", tmp_path / "run", tmp_path / "shaper.c", tmp_path / "main.c"]
    subprocess.run(command, check=True)
    u = np.concatenate([np.full(50, 0.5), np.random.default_rng(0).uniform(-1, 1, 3000)]).astype(np.float32)
    done = subprocess.run([tmp_path / "run"], input=u.tobytes(), capture_output=True, check=True)
    y = np.frombuffer(done.stdout, dtype=np.float32)
    fir = np.zeros(found.steps[-1] + 1)
    fir[found.steps] = found.weights
    before = np.concatenate([np.full(len(fir) - 1, 0.5), u.astype(float)])
    allowed = float(re.findall(r"at\s+\*?\s*most (\S+) of the largest command", header)[0])
    off = np.abs(y - np.convolve(before, fir, "valid")).max()
    assert off <= allowed < 20 * off


def floating() -> StateSpace:
    return replace(critical(), A=np.array([[0.0, 1.0], [0.0, 0.0]])).discretised(STEP)


def coinciding() -> StateSpace:
    A = np.diag([0.5] * 4) + np.eye(4, k=1)
    return replace(critical(), A=A, B=np.ones((4, 1)), C=np.ones((1, 4)), state_names=tuple("abcd"), dt=STEP)


REFUSED = {
    "discretise the model first": stage,
    "does not decay within": floating,
    "poles all but coincide": coinciding,
    "a model without inputs, outputs or states": lambda: replace(stage(), inputs=(), dt=STEP),
}


@over("rule", REFUSED)
def test_models_without_steps_or_a_proof(rule):
    with pytest.raises(fx.FlexuraError, match=rule):
        fx.models.single_precision(REFUSED[rule]())


@over("name", ("my-plant.c", "1a.c", "_a.c", "a_very_long_name_of_c.c", "a.cc"))
def test_names_that_are_none_in_c(name, tmp_path: Path):
    with pytest.raises(fx.OptionError, match="names in C begin with that of the file"):
        fx.export(MODELS["modal"](), tmp_path / name, format="c")
    assert not list(tmp_path.iterdir())


def test_a_bound_that_is_wide_is_a_warning():
    found = fx.models.single_precision(stage(5e-5).discretised(STEP))
    [warning] = found.warnings
    assert warning.value == found.share > 0.01 and "float32 differs from double" in str(warning)
