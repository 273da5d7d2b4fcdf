"""A stroke in curves: what they show is what the poses hold."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

import flexura as fx
from flexura.errors import OptionError
from flexura.view import draw_stroke, save_stroke

PIVOT = Path(__file__).parents[2] / "examples" / "pivot" / "pivot.yaml"


@pytest.fixture(scope="module")
def stroke():
    return fx.stroke(fx.load(PIVOT), move={"arm.ry": (-0.2, 0.2)}, steps=5, n=3)


def test_curves_are_those_of_the_poses(stroke, tmp_path):
    figure = draw_stroke(stroke)
    force, frequency, change, translation, rotation, shift, *_ = figure.axes
    degrees = np.degrees([pose.move["arm.ry"] for pose in stroke.poses])
    assert force.lines[0].get_xdata() == pytest.approx(degrees)
    size = {"moment to hold, N m": 1.0, "moment to hold, mN m": 1e-3}[force.get_ylabel()]
    assert size * force.lines[0].get_ydata() == pytest.approx([pose.reaction["arm.ry"] for pose in stroke.poses])
    hertz = stroke.frequencies_hz[:, 0]
    assert change.lines[0].get_ydata() == pytest.approx(100 * (hertz / hertz[2] - 1)), "from the unstrained pose"
    assert shift.get_ylabel().startswith("parasitic shift") and shift.lines[0].get_ydata()[2] == pytest.approx(0)
    assert frequency.lines[0].get_ydata() == pytest.approx(stroke.frequencies_hz[:, 0])
    assert len(translation.lines) == 3
    assert len(rotation.lines) == 2, "the driven rotation has no support stiffness"
    plt.close(figure)
    written = save_stroke(stroke, tmp_path)
    assert [path.name for path in written] == ["stroke.png", "poses.png"]
    assert all(plt.imread(path).std() > 0.05 for path in written)


def test_one_pose_is_no_curve():
    single = fx.stroke(fx.load(PIVOT), move={"arm.ry": 0.1}, n=1)
    with pytest.raises(OptionError, match="at least two poses"):
        draw_stroke(single)
