"""Strokes at low order: within what they say of the full order, finer where it is needed, and told where it is not."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.strokes import low_order_motion
from flexura.deadline import OutOfTime
from flexura.motion import Equations, Equilibrium, MovingModel
from flexura.structure import Design, Plan

EXAMPLES = Path(__file__).parents[2] / "examples"
GUIDE = fx.load(EXAMPLES / "guide/guide.yaml")


def test_the_platform_over_its_workspace() -> None:
    """An edge of what the stacks reach: displacements prescribed, forces and frequencies to be found."""
    model = fx.load(EXAMPLES / "rpr/rpr.yaml")
    move = {"platform.z": (0.0, 3e-4), "platform.rx": (0.0, 4e-3), "platform.ry": (0.0, -4e-3)}
    low, full = (fx.stroke(model, move=move, steps=3, n=4, order=order) for order in ("low", "full"))
    assert low.low_order is not None and full.low_order is None
    assert low.low_order.coordinates < 70 and low.low_order.full == 1062
    assert low.low_order.error < 1e-4
    for own, reference in zip(low.poses, full.poses, strict=True):
        for name in move:
            assert own.reaction[name] == pytest.approx(reference.reaction[name], rel=1e-4, abs=1e-9)
        assert own.frequency_hz == pytest.approx(reference.frequency_hz, rel=1e-3)
        assert own.energy == pytest.approx(reference.energy, rel=1e-4, abs=1e-15)
        if reference.energy:
            assert own.stress_margin == pytest.approx(reference.stress_margin, rel=1e-4)
        assert own.buckling_factor is None
    assert np.abs(low.frames[-1].x - full.frames[-1].x).max() < 1e-4 * 3e-4
    assert any("62 coordinates instead of 1062" in note for note in low.notes)


def test_loads_are_taken() -> None:
    loads = {"carriage": [2.0, 0, 0, 0, 0, 0]}
    low, full = (fx.stroke(GUIDE, loads=loads, nodes=["carriage"], n=2, order=order) for order in ("low", "full"))
    own, reference = (r.poses[0].displacement["carriage"] for r in (low, full))
    assert own[0] == pytest.approx(reference[0], rel=1e-3)


def test_what_bends_far_is_made_finer() -> None:
    low = fx.stroke(GUIDE, move={"carriage.x": (0.0, 0.012)}, steps=4, n=2, order="low")
    full = fx.stroke(GUIDE, move={"carriage.x": (0.0, 0.012)}, steps=4, n=2)
    assert low.low_order is not None
    assert {"leaf1.blade", "leaf2.blade"} <= set(low.low_order.finer)
    forces = [[pose.reaction["carriage.x"] for pose in own.poses[1:]] for own in (low, full)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)
    worst = max(low.low_order.error, low.low_order.frequency_error)
    assert (worst > 5e-3) == any(own.kind == "reduction" for own in low.warnings)


def test_what_is_out_of_time_tries_nothing_finer() -> None:
    runs = []

    def run(equations: Equations) -> list[Equilibrium]:
        runs.append(equations)
        raise OutOfTime(1.0)

    equations = Equations(MovingModel.of(Design.of(Plan(GUIDE))))
    with pytest.raises(OutOfTime):
        low_order_motion(equations, [], run, 1)
    assert len(runs) == 1


def test_order_is_full_or_low() -> None:
    with pytest.raises(fx.OptionError, match="order is full or low"):
        fx.stroke(GUIDE, move={"carriage.x": 1e-3}, order="middling")  # type: ignore[arg-type]


@pytest.mark.parametrize("force", [[30.0, 0, 0], [60.0, 0, 0], [30.0, 5, 200]])
def test_loads_that_the_coarsest_does_not_bear_make_it_finer(force: list[float]) -> None:
    loads = {"carriage": [*force, 0, 0, 0]}
    low, full = (fx.stroke(GUIDE, loads=loads, nodes=["carriage"], n=1, order=order) for order in ("low", "full"))
    own, reference = (r.poses[0].displacement["carriage"] for r in (low, full))
    assert own[0] == pytest.approx(reference[0], rel=1e-3)


def test_where_series_end_leaves_of_few_elements_go_on() -> None:
    plain = GUIDE.replaced({"corrections": "none"})
    loads = {"carriage": ([0.0] * 6, [60.0, 0, 0, 0, 0, 0])}
    low, full = (
        fx.stroke(plain, loads=loads, steps=2, n=1, nodes=["carriage"], order=order) for order in ("low", "full")
    )
    assert len(low.poses) == len(full.poses) == 2
    assert low.low_order is not None and low.low_order.leaves
    own, reference = (path.poses[-1].displacement["carriage"] for path in (low, full))
    assert reference[0] > 0.01
    assert own[0] == pytest.approx(reference[0], rel=1e-3)
