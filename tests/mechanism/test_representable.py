"""Sizes that double precision cannot hold beside others are refused by name, and nothing else is heard."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.structure import Plan

ROOT = Path(__file__).parents[2]
LEAF = {"material": "spring-steel", "reference": "y"}


def cantilever(**changes) -> fx.Mechanism:
    leaf = fx.describe.Flexure(nodes=("a", "b"), profile=fx.describe.Leaf(width=10e-3, thickness=1e-3), **LEAF)
    described = {
        "nodes": {"a": (0, 0, 0), "b": (0.1, 0, 0)},
        "flexures": {"leaf": leaf},
        "ground": {"a": "clamped"},
    }
    return fx.Mechanism(**(described | changes))


@pytest.mark.parametrize("size", [1e10, 1e148, 1e-13, 1e-150])
def test_sizes_out_of_reach_are_refused_where_they_stand(size) -> None:
    with pytest.raises(fx.ModelError, match=r"width: a length must be at least 1e-12 and at most 1e\+09"):
        fx.describe.Leaf(width=size, thickness=1e-3)


def test_the_same_of_expressions_and_replaced_parameters() -> None:
    parameters = {"wide": fx.describe.Parameter(value=10e-3, unit="m")}
    leaf = fx.describe.Flexure(nodes=("a", "b"), profile=fx.describe.Leaf(width="1e6*wide", thickness=1e-3), **LEAF)
    plan = Plan(cantilever(parameters=parameters, flexures={"leaf": leaf}))
    with pytest.raises(fx.ModelError, match=r"leaf.*width: a length must be"):
        fx.modes(plan, {"wide": 1e20})


def test_coordinates_may_be_as_small_as_round_off() -> None:
    assert fx.modes(cantilever(nodes={"a": (0, 0, 1e-40), "b": (0.1, 0, 0)}), n=1).frequency_hz[0] > 0


@pytest.mark.parametrize("call", [fx.modes, fx.assemble, fx.reduce])
def test_matrices_that_are_not_finite_name_what_they_belong_to(call, monkeypatch) -> None:
    block = fx.describe.RigidBody(centre=(0.1, 0, 0), mass=1.0, inertia=(1, 1, 1), carries=("b",))
    discrete_elements = import_module("flexura.structure.discrete_elements")
    monkeypatch.setattr(discrete_elements, "rigid_mass", lambda mass, *_: np.full((*np.shape(mass), 6, 6), np.inf))
    with pytest.raises(fx.ModelError, match=r"bodies\.block: stiffness or mass is not finite") as caught:
        call(cantilever(bodies={"block": block}))
    assert len(caught.value.problems) == 1


def test_a_tapered_member_of_impossible_shape_is_named() -> None:
    """So wide beside its thickness that its flexibility cannot be inverted."""
    notch = fx.describe.Notch(width=8e8, contour=fx.describe.CornerFilletedContour(fillet_radius=1e-3, web=0.6e-3))
    flexure = fx.describe.Flexure(nodes=("a", "b"), profile=notch, integration="tapered", **LEAF)
    with pytest.raises(fx.ModelError, match=r"flexures\.leaf: stiffness or mass is not finite"):
        fx.modes(cantilever(flexures={"leaf": flexure}))


def test_the_terminal_shows_the_error_and_no_noise(tmp_path) -> None:
    text = (ROOT / "examples" / "guide" / "guide.yaml").read_text(encoding="utf-8")
    assert "thickness: {value: 0.5 mm" in text
    path = tmp_path / "guide.yaml"
    path.write_text(text.replace("thickness: {value: 0.5 mm", "thickness: {value: 5e+150 mm"), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "flexura", "modes", str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2 and done.stdout == ""
    assert "thickness: a length must be" in done.stderr
    assert "Warning" not in done.stderr and "Traceback" not in done.stderr and "On entry" not in done.stderr
