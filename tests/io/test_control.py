"""State spaces handed to python-control."""

from __future__ import annotations

import sys
from dataclasses import replace

import control
import numpy as np
import pytest

import flexura as fx
from flexura.io import to_control
from flexura.structure import Channel
from flexura.systems.state_space import StateSpace
from helpers.export_models import example_modes, modal_model


@pytest.fixture(scope="module")
def model() -> StateSpace:
    return modal_model(example_modes("xy_stage", 4), "table")


def test_response_and_names(model: StateSpace) -> None:
    found = to_control(model)
    assert found.input_labels == ["table_tx_force", "table_ry_moment"]
    assert found.output_labels == ["table_tx_displacement", "table_ry_rotation", "table_accelerometer"]
    assert found.state_labels[:2] == ["mode1_position", "mode1_velocity"]
    assert found.isctime(strict=True) and found.nstates == model.order
    modes = example_modes("xy_stage", 4)
    w, natural = np.geomspace(10, 1e4, 30), modes.angular_frequency
    shape = modes.shapes[modes.node_names.index("table")]
    denominator = natural**2 - w[:, None] ** 2 + 0.02j * natural * w[:, None]
    assert np.allclose(found(1j * w)[1, 0], (shape[4] * shape[0] / denominator).sum(axis=1), rtol=1e-8, atol=1e-20)


def test_discrete_models_keep_their_step(model: StateSpace) -> None:
    found = to_control(replace(model, delay=2e-3).discretised(1e-3))
    assert found.dt == 1e-3 and found.nstates == model.order + 4
    _, y = control.impulse_response(found, 0.004, input=0, output=0)
    assert np.allclose(y[:2], 0, atol=1e-15) and abs(y[3]) > 0


def test_a_loop_is_closed_by_names(model: StateSpace) -> None:
    """interconnect finds signals by their names, so these must tell force and displacement apart."""
    plant = to_control(model.selected([model.inputs[0].name], [model.outputs[0].name]))
    signals = [*plant.output_labels, "disturbance"]
    gain = control.ss([], [], [], [[-1e3, 1.0]], inputs=signals, outputs=plant.input_labels, name="gain")
    loop = control.interconnect([plant, gain], inputs=["disturbance"], outputs=plant.output_labels)
    closed = loop.poles()
    expected = np.linalg.eigvals(model.A - 1e3 * model.B[:, :1] @ model.C[:1])
    # equal modes have equal real parts
    assert np.allclose(closed[np.argsort(closed.imag)], expected[np.argsort(expected.imag)], rtol=1e-8)


def test_states_that_do_nothing_are_kept(model: StateSpace) -> None:
    idle = replace(model, B=0 * model.B)
    assert to_control(idle).nstates == model.order


def test_what_is_refused(model: StateSpace, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(fx.OptionError, match=r"python-control has no dead time.*discretised"):
        to_control(replace(model, delay=1e-3))
    alike = (Channel("a.b", "rotation"), Channel("a_b", "rotation"), model.outputs[2])
    with pytest.raises(fx.OptionError, match="'a_b' once dots have become underscores"):
        to_control(replace(model, outputs=alike))
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(fx.OptionError, match=r"pip install 'flexura\[control\]'"):
        to_control(model)
