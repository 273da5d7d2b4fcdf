"""Stacks of designs in which some parts move and others stay: against each design by itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.reduction import independent_frequencies

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("name", ["rpr/rpr.yaml", "tip_tilt/tip_tilt.yaml", "xy_stage/xy_stage.yaml"])
def test_parts_that_move_beside_parts_that_stay(name):
    """Of every parameter, and of all of them."""
    plan = fx.Plan(fx.load(EXAMPLES / name))
    defaults = {key: p.value for key, p in plan.mechanism.parameters.items()}
    own = {key: value * np.array([1.0, 1.02]) for key, value in defaults.items() if isinstance(value, float)}
    assert own
    for some in [own, *({key: both} for key, both in own.items())]:
        alone = [fx.unproven_frequencies(plan, {key: both[k] for key, both in some.items()}) for k in range(2)]
        np.testing.assert_allclose(fx.unproven_frequencies(plan, some), alone, rtol=1e-9)


@pytest.mark.parametrize("names", [("arm_length", "leaf_thickness"), ("u_length",), ("platform_thickness", "plate")])
def test_the_same_to_the_last_bit_in_any_block(names):
    """Also where no geometry, or that of some parts, happens to be the same in a whole block."""
    plan = fx.Plan(fx.load(EXAMPLES / "rpr" / "rpr.yaml"))
    default = {key: plan.mechanism.parameters[key].value for key in names}
    own = {key: value * np.array([1.0, 1.0, 1.01, 0.99, 1.02]) for key, value in default.items()}
    whole = independent_frequencies(plan, own, n=4)
    for block in (slice(0, 1), slice(0, 2), slice(1, 4), slice(4, 5)):
        part = independent_frequencies(plan, {key: value[block] for key, value in own.items()}, n=4)
        for bound, all_of_them in zip(part, whole, strict=True):
            assert np.array_equal(bound, all_of_them[block])
