"""Elastic parts for Simscape Multibody, read back by scipy and put to ground as the block would."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.linalg as la

import flexura as fx
from flexura.io import export
from helpers.export_models import EXAMPLES

LENGTH, WIDTH, THICKNESS = 0.1, 0.01, 0.002
STEEL = fx.describe.CATALOGUE["spring-steel"]


def bar(**more: object) -> fx.Mechanism:
    nodes = {"left": (0.02, 0.01, 0.0), "right": (0.02 + LENGTH, 0.01, 0.0)}
    section = fx.describe.Rectangle(width=WIDTH, thickness=THICKNESS)
    links = {
        "bar": fx.describe.Link(
            nodes=("left", "right"), material="spring-steel", section=section, reference=(0.0, 0.0, 1.0), elements=16
        )
    }
    return fx.Mechanism(
        name="bar",
        theory="euler_bernoulli",
        corrections="none",
        nodes=nodes,
        links=links,
        interface=("left", "right"),
        **more,
    )


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict:
    low = fx.reduce(bar(), keep=20)
    path = tmp_path_factory.mktemp("simscape") / "bar.mat"
    export(low, path, format="simscape", damping_ratio=0.02)
    return scipy.io.loadmat(path)


def hz(K: np.ndarray, M: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(la.eigh(K, M, eigvals_only=True), 0)) / (2 * np.pi)


def test_frames_and_sizes(found: dict) -> None:
    assert [cell[0] for cell in found["FrameName"][:, 0]] == ["left", "right"]
    assert found["Origins"].tolist() == [[0.02, 0.01, 0.0], [0.02 + LENGTH, 0.01, 0.0]]
    assert found["K"].shape == found["M"].shape == found["C"].shape == (32, 32)
    names = [cell[0] for cell in found["CoordinateName"][:, 0]]
    assert names[:7] == ["left.tx", "left.ty", "left.tz", "left.rx", "left.ry", "left.rz", "right.tx"]
    assert names[12] == "amplitude 1"
    note, first = found["Notes"][0, 0][0], found["FrequencyHz"][0, 0]
    assert note.startswith(f"model error, how far the part may be from these frequencies: {first:.5g} Hz ")


def test_rigid_motions_strain_nothing_and_have_the_mass_of_the_bar(found: dict) -> None:
    mass = STEEL.rho * LENGTH * WIDTH * THICKNESS
    x = found["Origins"]
    for axis in np.eye(3):
        turn, shift = np.zeros(32), np.zeros(32)
        for k in range(2):
            shift[6 * k : 6 * k + 3] = axis
            turn[6 * k : 6 * k + 3], turn[6 * k + 3 : 6 * k + 6] = np.cross(axis, x[k]), axis
        for rigid in (shift, turn):
            assert np.abs(found["K"] @ rigid).max() < 1e-13 * np.abs(found["K"]).max() * np.abs(rigid).max()
            assert np.abs(found["C"] @ rigid).max() < 1e-9 * np.abs(found["C"]).max()
        assert shift @ found["M"] @ shift == pytest.approx(mass, rel=1e-9)
    spin = np.zeros(32)
    for k in range(2):
        spin[6 * k : 6 * k + 3], spin[6 * k + 5] = np.cross([0, 0, 1], x[k]), 1.0
    about = mass * (LENGTH**2 / 12 + (0.02 + LENGTH / 2) ** 2 + 0.01**2)
    assert spin @ found["M"] @ spin == pytest.approx(about, rel=1e-9)


def test_free_and_clamped_frequencies_are_those_of_the_bar(found: dict) -> None:
    speed = np.sqrt(STEEL.E / STEEL.rho * THICKNESS**2 / 12)
    free = (4.7300407 / LENGTH) ** 2 * speed / (2 * np.pi)
    clamped = (1.8751041 / LENGTH) ** 2 * speed / (2 * np.pi)
    assert found["FrequencyHz"][0, 0] == pytest.approx(free, rel=1e-4)
    held = slice(6, None)
    assert hz(found["K"][held, held], found["M"][held, held])[0] == pytest.approx(clamped, rel=1e-4)


def test_damping_gives_every_elastic_mode_its_ratio(found: dict) -> None:
    n = len(found["K"])
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-la.solve(found["M"], np.hstack([found["K"], found["C"]]))]])
    poles = la.eigvals(A)
    first = 2 * np.pi * found["FrequencyHz"][0, 0]
    own = poles[np.argmin(np.abs(np.abs(poles) - first) + 1e9 * (poles.imag <= 0))]
    assert -own.real / abs(own) == pytest.approx(0.02, rel=1e-3)


def test_held_parts_and_frames_that_move_together_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.mat"
    guide = fx.reduce(fx.load(EXAMPLES / "guide" / "guide.yaml"))
    held = fx.describe.Support(fixed=fx.describe.DOF_NAMES)
    soft = fx.describe.Spring(nodes=("left",), stiffness=fx.describe.DiagonalStiffness(tx=1e-9))
    for low in (guide, fx.reduce(bar(ground={"left": held})), fx.reduce(bar(springs={"soft": soft}))):
        with pytest.raises(fx.OptionError, match="a flexible body for Simscape floats"):
            export(low, path, format="simscape")
    with pytest.raises(fx.OptionError, match="no node 'nowhere'"):
        export(fx.reduce(bar()), path, format="simscape", frames=["nowhere"])
    with pytest.raises(fx.OptionError, match="damping ratio"):
        export(fx.reduce(bar()), path, format="simscape", damping_ratio=1.5)
    with pytest.raises(fx.OptionError, match="frames and amplitudes already"):
        export(fx.models.nested(fx.reduce(bar())), path, format="simscape", keep=3)
    assert not list(tmp_path.iterdir())


def test_a_nested_model_is_taken_as_it_is(tmp_path: Path) -> None:
    part = fx.models.nested(fx.reduce(bar(), keep=8), {"left": "hub", "right": "rim"}, keep=4)
    (path,) = export(part, tmp_path / "part.mat", format="simscape")
    found = scipy.io.loadmat(path)
    assert found["K"].shape == (16, 16) and "C" not in found
