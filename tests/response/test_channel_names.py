"""Names of inputs and outputs as users write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_names_may_hold_wildcards():
    """Signals, impulses and states to start from go to every actuator that a pattern stands for."""
    mechanism = fx.load(EXAMPLES / "rpr" / "rpr_piezo.yaml")
    stacks = ["rpu1.c.piezo", "rpu2.c.piezo", "upr1.c.piezo", "upr2.c.piezo"]
    how = {"outputs": ["lift"], "dt": 1e-3, "duration": 0.02}
    one = fx.time_response(mechanism, inputs={"*.piezo": fx.signals.step(3.0)}, **how)
    each = fx.time_response(mechanism, inputs=dict.fromkeys(stacks, fx.signals.step(3.0)), **how)
    assert np.array_equal(one.response, each.response)
    assert [c.name for c in one.inputs] == stacks
    with pytest.raises(fx.OptionError, match="nothing matches"):
        fx.time_response(mechanism, inputs={"*.coil": fx.signals.step(3.0)}, **how)
    static = fx.statics(mechanism, actuators={"*.piezo": 3.0}).readings["lift"]
    assert static == fx.statics(mechanism, actuators=dict.fromkeys(stacks, 3.0)).readings["lift"] != 0
