"""Shapes of a test on its own points and lines: what moves, what does not, and what is said of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexura.pages.viewer import Scene, scene_of, scene_of_test
from flexura.testing.measurement import IdentifiedModes, MeasuredChannel, ModeEvidence
from helpers.tested_frame import POINTS, frame, measured_frame

MOVED = np.array([[1.0, -2.0, 0.5], [0.3, 0.0, -0.7]])
"""How two points move, m."""

ASKEW = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]


def modes_of(channels, readings, traces=()) -> IdentifiedModes:
    """One mode of which channels read so much."""
    shape = np.asarray(readings, dtype=float)[:, None]
    sure = ModeEvidence(1.0, 0.0, 0.0, 1.0, 0.0)
    pole, none = np.array([-1 + 100j]), np.zeros((0, 1), dtype=complex)
    return IdentifiedModes("t", pole, shape + 0j, shape, none, (), tuple(channels), (sure,), (), 0.0, traces=traces)


def channels_at(point: int, directions) -> list[MeasuredChannel]:
    place = (0.1 * point, 0.0, 0.02)
    return [
        MeasuredChannel(f"p{point}.{k}", "acceleration", f"p{point}", tuple(d), place) for k, d in enumerate(directions)
    ]


def motion(scene: Scene, name: str) -> np.ndarray:
    own = next(each for each in scene.motions if each.id == name).displacement
    return own.stored * (own.scale or 1.0)


def test_local_directions_askew_give_the_motion_in_global_ones():
    channels = [*channels_at(0, np.eye(3)), *channels_at(1, ASKEW)]
    scene = scene_of_test(modes_of(channels, [*MOVED[0], *ASKEW @ MOVED[1]]))
    assert scene.points.stored[:2] == pytest.approx(np.array([[0, 0, 0.02], [0.1, 0, 0.02]]), abs=1e-7)
    assert motion(scene, "mode-1") == pytest.approx(np.tile(MOVED, (2, 1)), abs=1e-4)
    arrows = scene.motions[-1].arrows
    assert [own.label for own in arrows] == [c.name for c in channels]
    assert np.array([own.direction for own in arrows[3:]]) == pytest.approx(ASKEW, abs=1e-12)


def test_a_point_moves_in_the_directions_that_were_measured_alone():
    scene = scene_of_test(modes_of([*channels_at(0, np.eye(3)[:2]), *channels_at(1, ASKEW[:1])], [1.0, 2.0, 3.0]))
    assert motion(scene, "mode-1")[:2] == pytest.approx(np.array([[1, 2, 0], 3 * ASKEW[0]]), abs=1e-3)
    assert "2 of 2 points move in the directions that were measured alone" in scene.notes


def test_two_sensors_along_one_direction_are_their_mean():
    scene = scene_of_test(modes_of(channels_at(0, [(1, 0, 0), (1, 0, 0)]), [1.0, 3.0]))
    assert motion(scene, "mode-1")[0] == pytest.approx([2, 0, 0], abs=1e-3)


def test_lines_go_through_points_without_a_sensor_which_rest():
    trace = ((0.0, 0.0, 0.02), (0.1, 0.0, 0.02), (0.1, 0.0, 0.0))
    channels = [*channels_at(0, np.eye(3)), *channels_at(1, np.eye(3))]
    scene = scene_of_test(modes_of(channels, MOVED.ravel(), (trace,)))
    assert scene.lines.stored.tolist() == [[0, 1], [1, 2]] and scene.dots.stored.tolist() == [3, 4, 5]
    assert motion(scene, "mode-1")[2] == pytest.approx([0, 0, 0], abs=0)
    assert scene.notes == ("1 points of the lines have no sensor: they are drawn at rest",)
    assert [part.kind for part in scene.parts] == ["trace", "measured", "measured", "unmeasured"]


def test_rotations_have_no_part_and_channels_without_a_place_are_refused():
    turning = replace(channels_at(0, np.eye(3))[2], quantity="angular_acceleration")
    scene = scene_of_test(modes_of([*channels_at(0, np.eye(3)[:2]), turning], [1.0, 2.0, 50.0]))
    assert motion(scene, "mode-1")[0] == pytest.approx([1, 2, 0], abs=1e-3)
    lost = [replace(c, position=None) for c in channels_at(0, np.eye(3))]
    with pytest.raises(fx.OptionError, match="no channel has a position and a direction to show shapes at"):
        fx.show(modes_of(lost, MOVED[0]))
    with pytest.raises(fx.OptionError, match="shown alone"):
        fx.show(modes_of(channels_at(0, np.eye(3)), MOVED[0]), fx.modes(frame()))


def test_in_a_correlation_measured_points_move_with_the_model_that_they_were_measured_on():
    """One of fifteen channels is along an oblique direction, and the noise is at a half per cent."""
    correlation = fx.correlate(frame(), test=measured_frame())
    scene = scene_of(correlation)
    drawn = scene_of(frame())
    first = len(drawn.points.stored)
    places = scene.points.stored[first : first + len(POINTS)]
    names = correlation.model.plan.topology.node_names
    nodes = [names.index(name) for name in POINTS]
    assert places == pytest.approx(correlation.model.positions[nodes], abs=1e-7)
    for k, pair in enumerate(correlation.pairs[:4]):  # the others are less well determined, near the end of the band
        truth = correlation.counterparts[nodes, :3, k]
        for what in ("test", "model"):
            moved = motion(scene, f"{what}-{pair.test}")[first : first + len(POINTS)]
            assert np.linalg.norm(moved - truth) < 0.03 * np.linalg.norm(truth)
    assert len(scene.motions[0].displacement.stored) == len(scene.points.stored)
    own = scene.parts[len(drawn.parts)]
    assert own.kind == "trace" and scene.lines.stored[own.lines[0]].tolist() == [first + 5, first]


def test_other_results_keep_their_colours_beside_a_correlation():
    correlation = fx.correlate(frame(), test=measured_frame())
    alone, both = scene_of(fx.modes(frame(), order="full")), scene_of(fx.modes(frame(), order="full"), correlation)
    for own, other in zip(alone.motions[0].colours, both.motions[0].colours, strict=True):
        if own.values is not None and other.values is not None:
            assert len(other.values.stored) == len(both.points.stored)
            assert (other.values.stored[: len(own.values.stored)] == own.values.stored).all()
    assert {len(by.values) for by in both.motions[0].by_part} == {len(both.parts)}
