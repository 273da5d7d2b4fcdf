"""Pictures of poses: everything is where the theory of large motion has it, and texts do not meet."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.backends.backend_agg import RendererAgg

import flexura as fx
from flexura.errors import OptionError
from flexura.mechanism import with_rigid_bodies
from flexura.motion.se3 import rotation_vector
from flexura.view import Kind, draw_poses, save_stroke, solids
from flexura.view.scene.solids import moved_solids

EXAMPLES = Path(__file__).parents[2] / "examples"

CANTILEVER = """
flexura: 1
name: strip
nodes: {a: [0, 0, 0], b: [100 mm, 0, 0]}
flexures:
  leaf:
    nodes: [a, b]
    material: spring-steel
    reference: z
    elements: 12
    profile: {type: leaf, width: 10 mm, thickness: 0.2 mm}
masses: {tip: {node: b, mass: 1 g}}
ground: {a: clamped}
corrections: none
"""


@pytest.fixture(scope="module")
def stage():
    return fx.stroke(fx.load(EXAMPLES / "xy_stage" / "xy_stage.yaml"), move={"table.x": (0, 5e-4)}, steps=3, n=2)


def scene(result, k):
    return moved_solids(result.model, result.frames[k], result.stress_profiles(k))


def test_a_strip_under_a_moment_is_an_arc():
    """A moment alone bends it to an arc of a circle, whose radius is the length over the angle."""
    angle = 1.5
    parts = scene(fx.stroke(fx.loads(CANTILEVER), move={"b.rz": angle}, n=1), 0)
    own = np.unique(parts.faces[parts.face_kinds == Kind.FLEXURE])
    middle, moved = parts.points[own], (parts.points + parts.motions)[own]
    on_axis = np.abs(middle[:, 1]) < 1e-9
    x, y = moved[on_axis, 0], moved[on_axis, 1]
    radius = 0.1 / angle
    assert np.hypot(x, y - radius) == pytest.approx(radius, rel=1e-4)


@pytest.mark.parametrize(
    ("file", "move"),
    [
        ("amplifier/amplifier.yaml", {"output.z": 1e-7}),
        ("guide/guide.yaml", {"carriage.x": 1e-7}),
        ("rpr/rpr.yaml", {"platform.rx": 1e-7}),
    ],
)
def test_small_motions_are_those_of_linear_pictures(file, move):
    """Mirrored copies, offsets and arms included. Along an element its stretch, which is small, is spread otherwise."""
    found = fx.stroke(fx.load(EXAMPLES / file), move=move, n=1)
    model, frames = found.model, found.frames[0]
    root, x = model.plan.topology.root, model.geometry.positions
    turn = rotation_vector(frames.R[root])
    shift = frames.x[root] - x[root] + np.cross(turn, x - x[root])
    linear, finite = solids(model, np.hstack([shift, turn])), scene(found, 0)
    assert finite.points == pytest.approx(linear.points, abs=1e-12)
    assert np.abs(finite.motions - linear.motions).max() < 1e-4 * linear.largest_motion()


def test_rigid_bodies_keep_their_shape_and_members_reach_them():
    rigid = with_rigid_bodies(fx.load(EXAMPLES / "pivot" / "pivot.yaml"))
    found = fx.stroke(rigid, move={"arm.ry": 0.6}, n=1)
    parts = scene(found, 0)
    body = np.unique(parts.faces[parts.face_kinds == Kind.BODY])
    before, after = parts.points[body], (parts.points + parts.motions)[body]
    apart = [np.linalg.norm(own[:, None] - own, axis=-1) for own in (before, after)]
    assert apart[1] == pytest.approx(apart[0], abs=1e-12)
    turned = np.linalg.lstsq(before - before.mean(axis=0), after - after.mean(axis=0), rcond=None)[0].T
    assert rotation_vector(turned) == pytest.approx(np.array(found.poses[0].displacement["arm"][3:]), abs=1e-9)


def test_colours_are_stresses(stage):
    for k in range(1, 3):
        largest = stage.stresses(k).members[0].von_mises
        assert np.nanmax(scene(stage, k).values) == pytest.approx(largest)


@pytest.mark.parametrize(
    "move", [{"table.x": (0, 5e-4)}, {"table.x": (0, 5e-4), "table.y": (0, 3e-4), "table.rz": 1e-4}]
)
def test_no_text_meets_another(move):
    stage = fx.stroke(fx.load(EXAMPLES / "xy_stage" / "xy_stage.yaml"), move=move, steps=3, n=1)
    figure = draw_poses(stage)
    canvas = RendererAgg(figure.bbox.width, figure.bbox.height, figure.dpi)
    texts = [text for text in figure.texts if text.get_text().strip()]
    boxes = [text.get_window_extent(canvas) for text in texts]
    boxes += [box for axes in figure.axes if axes.get_title() and (box := axes.get_tightbbox(canvas)) is not None]
    for i, box in enumerate(boxes):
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.width
        assert not any(box.overlaps(other) for other in boxes[i + 1 :])
    words = " ".join(text.get_text() for text in texts).replace("\N{NO-BREAK SPACE}", " ")
    assert "table.x = 0.25 mm" in words
    assert "e+" not in words


def test_a_single_pose_has_a_picture_alone(tmp_path):
    single = fx.stroke(fx.load(EXAMPLES / "pivot" / "pivot.yaml"), move={"arm.ry": 0.1}, n=1)
    (written,) = save_stroke(single, tmp_path)
    assert written.name == "poses.png"
    assert plt.imread(written).std() > 0.05


@pytest.mark.parametrize("poses", [[], [3], [-1], [0.5], [0] * 7])
def test_poses_that_are_not_there(stage, poses):
    with pytest.raises(OptionError, match="poses are drawn"):
        draw_poses(stage, poses)
