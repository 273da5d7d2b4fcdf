"""Coupling, decoupling and virtual points from the shell, of a measured block and a described bar."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from helpers.coupled_parts import DOFS
from helpers.shell import flexura as run

FUZZ = Path(__file__).parents[1] / "fuzz"
BLOCK, BAR = FUZZ / "interface.csv", FUZZ / "corpus" / "model" / "floating.yaml"
"""A free block of 0.5 kg and 40 kg mm^2 about every axis of its corner, hit where it is read; a free bar."""

MASS = np.diag([0.5, 0.5, 0.5, 4e-5, 4e-5, 4e-5])
POINT = ["--point", "block.top=0,0,0"]
JOINED = ["couple", f"block={BLOCK}", f"bar={BAR}", "--join", "block.top=bar.a"]


def document(*arguments):
    return json.loads(run(*arguments, "--json").stdout)


def matrix(found):
    return np.array(found["real"]) + 1j * np.array(found["imaginary"])


def test_the_block_at_its_virtual_point():
    found = document("virtual-points", BLOCK, "--point", "top=0,0,0")
    assert [c["name"] for c in found["outputs"]] == [f"top.{dof}" for dof in DOFS]
    assert np.allclose(matrix(found), np.linalg.inv(MASS))
    assert found["counts"] == {"top": [6, 6, 6]}


def test_a_measured_block_on_a_described_bar_is_both_as_one_mechanism(tmp_path):
    pytest.importorskip("pyuff")
    out = tmp_path / "both.uff"
    found = document(*JOINED, *POINT, "--out", out)
    bar = BAR.read_text(encoding="utf-8")
    inertia = "[40 kg*mm^2, 40 kg*mm^2, 40 kg*mm^2]"
    body = f"bodies: {{block: {{centre: [0, 0, 0], carries: [a], mass: 0.5 kg, inertia: {inertia}}}}}"
    names = [f"a.{dof}" for dof in DOFS]
    whole = fx.frequency_response(
        *(fx.loads(f"{bar}{body}\n"),),
        frequency_hz=[10.0, 20.0, 30.0],
        inputs=names,
        outputs=names,
        quantity="accelerance",
    )
    assert np.allclose(matrix(found), whole.response, rtol=1e-5, atol=1e-5)
    (back,) = fx.read_measurement(out).frfs
    assert [c.name for c in back.outputs] == [f"block.top.{dof}" for dof in DOFS]
    assert np.allclose(back.response, matrix(found))


def test_what_was_coupled_is_taken_out_again(tmp_path):
    out = tmp_path / "both.csv"
    assert run(*JOINED, *POINT, "--out", out).returncode == 0
    found = document("decouple", out, BAR, "--join", "block.top=a")
    assert np.allclose(matrix(found), np.linalg.inv(MASS), rtol=1e-6, atol=1e-6)


def test_a_spring_between_and_noise():
    arguments = ["couple", f"A={BLOCK}", f"B={BLOCK}", "--noise", "A=1e-4", "-o", "A.s1", "-i", "A.s1"]
    found = document(*arguments, "--join", "A.s1=B.s1,2 N/mm", "--quantity", "receptance")
    w2 = (2 * np.pi * np.array([10.0, 20.0, 30.0])) ** 2
    Z = np.array([[[2e3 - 0.5 * x, -2e3], [-2e3, 2e3 - 0.5 * x]] for x in w2])
    assert np.allclose(matrix(found)[:, 0, 0], np.linalg.inv(Z)[:, 0, 0])
    assert np.array(found["sigma"]).shape == (3, 1, 1)


@pytest.mark.parametrize("name", ["both.npz", "both.csv", "both.uff"])
def test_scatter_stays_in_what_is_written(name, tmp_path):
    if name == "both.uff":
        pytest.importorskip("pyuff")
    out = tmp_path / name
    joined = ["couple", f"A={BLOCK}", f"B={BLOCK}", "--join", "A.s1=B.s1,2 N/mm", "-o", "A.s1", "-i", "A.s1"]
    found = document(*joined, "--noise", "A=1e-4", "--out", out)
    (back,) = fx.read_measurement(out).frfs
    lost = f"{out.suffix} holds no scatter, as .npz, .h5, .hdf5, .hdf, .csv, .txt do: it is not kept"
    if name == "both.uff":
        assert back.sigma is None and lost in found["notes"]
        return
    assert np.allclose(back.sigma, found["sigma"], rtol=1e-12) and lost not in found["notes"]
    again = document("couple", f"A={out}", f"B={BLOCK}", "--join", "A.A.s1=B.s1,2 N/mm", "-o", "B.s1", "-i", "B.s1")
    known = fx.couple(
        {"A": fx.read_measurement(out), "B": fx.read_measurement(BLOCK)},
        joins=[fx.Join("A.A.s1", "B.s1", 2e3)],
        inputs=["B.s1"],
        outputs=["B.s1"],
    )
    assert (np.array(again["sigma"]) > 0).all() and np.allclose(again["sigma"], known.sigma, rtol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["couple", str(BLOCK)], "a part is NAME=FILE"),
        (["couple", f"a={BLOCK}", f"a={BLOCK}", "--join", "a.s1=a.s2"], "a is the name of two parts"),
        (["couple", f"a={BAR}", f"b={BAR}", "--join", "a.a=b.a"], "no part is measured"),
        (["couple", f"a={BLOCK}", f"b={BLOCK}", "--join", "a.s1"], "--join 'a.s1': A=B is expected"),
        (["couple", f"a={BLOCK}", f"b={BLOCK}", "--join", "a.s1=b.s1,2 mm"], "'2 mm' is no quantity"),
        ([*JOINED, "--point", "top=0,0,0"], "'top' is PART.NAME"),
        ([*JOINED, "--point", "bar.a=0,0,0"], "bar is described"),
        ([*JOINED, "--point", "block.top=0,0"], "NAME=X,Y,Z is expected"),
        ([*JOINED, *POINT, "--noise", "block"], "NAME=RATIO is expected"),
        (["virtual-points", str(BLOCK)], "there is no virtual point"),
        (["virtual-points", str(BLOCK), "--point", "tip=0,0,0"], "no output is at a node of this name; nodes: top"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments, text):
    more = ["--join", "a.s1=b.s1"] if arguments == ["couple", str(BLOCK)] else []
    done = run(*arguments, *more)
    assert done.returncode == 2 and text in done.stderr
