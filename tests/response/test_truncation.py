"""What modes left out do: damping that couples them, force sensors, damping ratios as a matrix, and what is said."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp

import flexura as fx
from flexura.io import export
from helpers.oscillators import AREA, LENGTH, RHO, E, beam, dashes, dense, oscillator, pair

EXAMPLES = Path(__file__).parents[2] / "examples"

RPR = Path(__file__).parents[2] / "examples" / "rpr" / "rpr_piezo.yaml"
RAYLEIGH = {"rayleigh": {"frequencies": (20.0, 400.0), "ratios": (0.01, 0.02)}}


def closed_rod(w, c):
    """Receptance at the end of a rod that is held at the other, with a dashpot there: 1/(EA k cot kL + i w c)."""
    k = w * np.sqrt(RHO / E)
    return 1 / (E * AREA * k / np.tan(k * LENGTH) + 1j * w * c)


def test_a_dashpot_at_the_end_of_a_rod():
    """Below the first mode that is left out a tenth of a rod's impedance in a dashpot, against the closed form."""
    c = 0.1 * AREA * np.sqrt(E * RHO)
    dashpot = {"d": fx.describe.Dashpot(nodes=("b",), damping=dashes((c, 0, 0, 0, 0, 0)))}
    built = fx.system(beam(30, dashpots=dashpot), inputs="b.tx", outputs="b.tx", order="full")
    first = np.sqrt(E / RHO) / (4 * LENGTH)
    few = built.modal(up_to=2 * first)  # the first mode along the rod, of which there are 30
    hz = np.linspace(0.01, 1.2, 40) * first
    found, exact = few.response(hz)[:, 0, 0], closed_rod(2 * np.pi * hz, c)
    mesh = np.abs(built.modal().response(hz)[:, 0, 0] - exact).max()
    assert mesh < 2e-3 * np.abs(exact).max()
    error = np.abs(found - exact)
    assert error.max() < 6e-3 * np.abs(exact).max()
    assert (error <= fx.models.neglected_bound(few, hz)[:, 0, 0] + mesh).all()


def frame(eta=0.0, c=8.0):
    """Three members, one of tape, a body off its node, a stack with a force sensor, and a dashpot to the ground."""
    section = fx.describe.Rectangle(width=10e-3, thickness=1.2e-3)
    nodes = {
        "a": (0, 0, 0),
        "b": (0.04, 0, 0),
        "c": (0.04, 0, 0.03),
        "s": (0.01, 0.003, -0.025),
        "e": (0.075, 0.01, 0.03),
    }
    ends = {"one": ("a", "b", "z"), "two": ("b", "c", "x"), "three": ("c", "e", "z")}
    return fx.Mechanism(
        nodes=nodes,
        corrections="none",
        materials={
            "metal": fx.describe.Material(E=70e9, nu=0.33, rho=2700.0),
            "tape": fx.describe.Material(E=70e9, nu=0.33, rho=2700.0, loss_factor=eta),
        },
        links={
            key: fx.describe.Link(
                nodes=(i, j), material="tape" if key == "two" else "metal", reference=ref, section=section, elements=3
            )
            for key, (i, j, ref) in ends.items()
        },
        bodies={
            "tip": fx.describe.RigidBody(
                centre=(0.08, 0.012, 0.034), mass=0.03, inertia=(2e-6, 3e-6, 4e-6), carries=("e",)
            )
        },
        dashpots={"d": fx.describe.Dashpot(nodes=("b",), damping=dashes((3.0, 0, c, 0, 0, 0)))},
        actuators={
            "pz": fx.describe.PiezoStack(nodes=("s", "b"), stiffness=3e6, free_stroke=20e-6, gain=0.2e-6, mass=6e-3)
        },
        sensors={"pf": fx.describe.ForceSensor(actuator="pz")},
        ground={"a": "clamped", "s": "clamped"},
    )


INPUTS, OUTPUTS = ["pz", "tip.tx", "ground.tz"], ["pf", "tip.tx", "tip.tx:velocity", "c.rx:acceleration"]


@pytest.mark.parametrize("damping", [RAYLEIGH, {"loss_factor": 0.02}, {}, 0.01], ids=str)
@pytest.mark.parametrize("eta", [0.0, 0.04])
def test_coupling_to_modes_that_are_left_out(damping, eta):
    """The sum of ten modes against a solution by numpy with all of them: right to 1e-3, and within its bound."""
    built = fx.system(frame(eta), inputs=INPUTS, outputs=OUTPUTS, order="full", damping=damping)
    few = built.modal(10)
    peaks = few.frequency_hz[:4] * (1.0 if damping else 1.001)  # without damping round-off is infinite there
    hz = np.concatenate([np.geomspace(1, 0.25 * few.next_omega / 2 / np.pi, 40), peaks])
    M, C, K, H = (0.0 if A is None else dense(A) for A in built.matrices())
    K = K + 1j * H
    w, exact = 2 * np.pi * hz, []
    for v in w:
        q = np.linalg.solve(K + 1j * v * C - v**2 * M, built.B.astype(complex))
        exact.append((built.rows @ q) * ((1j * v) ** built.derivative)[:, None] + built.D)
    error, size = np.abs(few.response(hz) - exact), np.abs(exact).max(axis=0)
    assert (error.max(axis=0) < (1e-3 if damping != 0.01 else 6e-3) * size).all()
    rounding = 1e-7 * size
    bound = fx.models.neglected_bound(few, hz) * w[:, None, None] ** built.derivative[:, None]
    assert (error <= bound + rounding).all()
    assert np.isfinite(bound).mean() > 0.9


def test_the_default_says_what_it_leaves_out():
    """A frequency response of the full-order model carries its bound, and it is true."""
    how = {"inputs": INPUTS, "outputs": OUTPUTS, "damping": RAYLEIGH, "order": "full"}
    hz = np.geomspace(1, 1000, 60)
    direct = fx.frequency_response(frame(0.04), frequency_hz=hz, method="direct", **how)
    found = fx.frequency_response(frame(0.04), frequency_hz=hz, **how)
    assert (np.abs(found.response - direct.response).max(axis=0) < 1e-3 * np.abs(direct.response).max(axis=0)).all()
    assert "modes left out add at most" in found.notes[-1] and not found.warnings
    poor = fx.frequency_response(
        fx.system(frame(0.04), inputs=INPUTS, outputs=OUTPUTS, order="full", damping=RAYLEIGH).modal(3), frequency_hz=hz
    )
    much = [w for w in poor.warnings if w.kind == "tolerance"]
    assert len(much) == 1 and much[0].value > 0.01 and much[0].limit == 0.01


def test_force_of_a_stack_with_rayleigh_damping():
    """The first-order term of damping in the static correction: force sensors of the example, pointwise to 1e-4."""
    built = fx.system(
        fx.load(RPR),
        inputs=["rpu1.c.piezo", "platform.tz"],
        outputs=["lift", "rpu1.c.force"],
        order="full",
        damping=RAYLEIGH,
    )
    hz = np.array([5.0, 60.0, 150.0, 190.0])
    direct = fx.frequency_response(built, frequency_hz=hz, method="direct").response
    found = built.modal(60).response(hz)
    assert np.abs(found / direct - 1).max() < 1e-4


MODAL = {"ratio": 0.01, "bands": [{"up_to": 60.0, "ratio": 0.03}], "ratios": (0.05, 0.02)}


@pytest.mark.parametrize("order", ["low", "full"])
def test_damping_ratios_are_the_same_by_every_route(order, tmp_path):
    """Modal sum, direct solution, exported matrices and state space: one frequency response, dashpot included."""
    built = fx.system(frame(), inputs=INPUTS[:2], outputs=OUTPUTS, order=order, damping=MODAL)
    hz = np.array([2.0, 26.0, 31.0, 150.0, 700.0])
    modal = built.modal().response(hz)
    scale = np.abs(modal).max(axis=0)
    direct = fx.frequency_response(built, frequency_hz=hz, method="direct").response
    states = fx.state_space(built).frequency_response(hz)
    with np.load(export(built, tmp_path / "own.npz")[0]) as file:
        M, C, K = (file[x] if x in file else by_columns(file, x) for x in ("M", "C", "K"))
    exported = []
    for s in 2j * np.pi * hz:
        q = la.solve(K + s * C + s**2 * M, built.B.astype(complex))
        exported.append((built.rows @ q + built.residual) * (s**built.derivative)[:, None] + built.D)
    for other in (direct, states, exported):
        assert (np.abs(other - modal).max(axis=0) < 1e-7 * scale).all()


def by_columns(file, name):
    """A matrix that is stored by columns, as an array."""
    own = [file[f"{name}.{part}"] for part in ("data", "indices", "indptr")]
    return sp.csc_matrix(tuple(own), shape=tuple(file[f"{name}.shape"])).toarray()


def test_a_matrix_of_damping_ratios():
    """2 zeta omega in every mode, dashpots beside it; of one body 2 zeta sqrt(k m) by hand; none for rigid motions."""
    built = fx.system(frame(), order="full", damping=MODAL)
    M, C, K, _ = built.matrices()
    values, V = la.eigh(K, M)
    omega = np.sqrt(values)
    own = V.T @ (C - built.dashpots.toarray()) @ V
    expected = 2 * built.law.modal_ratios(omega / (2 * np.pi)) * omega
    assert np.abs(own - np.diag(expected)).max() < 1e-6 * expected.max()
    one = fx.system(oscillator(), damping=0.02).damping_matrix()
    k, m = fx.system(oscillator()).K, fx.system(oscillator()).M
    np.testing.assert_allclose(one, np.diag(0.04 * np.sqrt(np.diag(k) * np.diag(m))), atol=1e-12 * np.abs(one).max())
    floating = fx.system(pair(0, 0, grounded=False), inputs="one.tx", outputs="one.tx", damping=0.05)
    assert np.abs(floating.damping_matrix() @ floating.full_order.rigid_body_motions()).max() < 1e-9
    plain = fx.system(frame(), order="full", damping=RAYLEIGH)
    assert plain.damping_matrix() is plain.C


def test_damping_ratios_in_step_by_step_integration():
    """Generalised-alpha with the matrix against the exact recursion: second order in the step."""
    built = fx.system(frame(), inputs=["tip.tx"], outputs=["tip.tx", "tip.ty:velocity"], damping=0.03)
    errors = []
    for dt in (2e-5, 1e-5):
        u = {"tip.tx": np.sin(2 * np.pi * 60 * dt * np.arange(round(0.02 / dt))) ** 2}
        exact = fx.time_response(built, inputs=u, dt=dt).response
        found = fx.time_response(built, inputs=u, dt=dt, method="generalised_alpha").response
        errors.append(np.abs(found - exact).max(axis=1) / np.abs(exact).max(axis=1))
    assert errors[1].max() < 1e-3 and (errors[0] / errors[1] > 3).all()


def test_too_many_modes_for_a_matrix(monkeypatch):
    """Refused with what to do instead."""
    monkeypatch.setattr(sys.modules["flexura.systems.second_order"], "MOST_MODES", 10)
    with pytest.raises(fx.OptionError, match="reduce the mechanism"):
        fx.system(frame(), order="full", damping=0.01).damping_matrix()


def test_a_files_tolerance_is_that_of_its_responses():
    """The platform's constraint modes do not suffice for 1e-4 up to 600 Hz, nor for 5 %, which takes fewer others."""
    mechanism = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    loose = mechanism.model_copy(update={"reduction": fx.describe.Reduction(tolerance=0.05)})
    orders = [fx.frequency_response(own, frequency_hz=[5.0, 300.0], damping=0.01).order for own in (mechanism, loose)]
    assert orders[1] < orders[0]
