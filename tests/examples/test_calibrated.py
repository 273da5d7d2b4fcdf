"""The calibrated mechanism against Table 5 and the paper's other statements of its modes."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx

RPR = Path(__file__).parents[2] / "examples" / "rpr"
MEASURED = np.array([46.861, 53.470, 75.364, 115.270, 129.333, 133.536])
"""RPR paper, Table 5, rad/s."""


@pytest.fixture(scope="module")
def modes():
    return fx.modes(fx.load(RPR / "calibrated.yaml"), n=6, order="full")


def test_six_frequencies_of_table_5(modes):
    assert fx.read_frequencies(RPR / "table5.csv").frequency_hz == pytest.approx(MEASURED / (2 * np.pi), rel=1e-12)
    assert abs(modes.angular_frequency / MEASURED - 1).max() < 0.005
    low = fx.modes(fx.load(RPR / "calibrated.yaml"), n=6)
    assert abs(low.angular_frequency / MEASURED - 1).max() < 0.01


def test_first_three_are_parasitic_and_last_three_working(modes):
    """Motion of the platform: in its plane (two translations, the turn about z), then the lift and two rotations.

    Rotations are compared at 50 mm, the reach of the branches.
    """
    platform = modes.shapes[modes.node_names.index("platform")] * np.array([1, 1, 1, 0.05, 0.05, 0.05])[:, None]
    share = platform**2 / (platform**2).sum(axis=0)
    in_plane = share[[0, 1, 5]].sum(axis=0)
    assert (in_plane[:3] > 0.5).all()
    assert (in_plane[3:] < 0.5).all()
    assert sorted(np.argmax(share[:, 3:], axis=0)) == [2, 3, 4]


def test_sensors_lower_the_frequencies(modes):
    bare = fx.modes(fx.load(RPR / "calibrated.yaml"), {"sensor_mass": 0.0}, n=6, order="full")
    assert (bare.frequency_hz > modes.frequency_hz * 1.001).all()


def test_sizes_are_marked_calibrated_and_within_their_bounds():
    mechanism = fx.load(RPR / "calibrated.yaml")
    calibrated = [n for n, p in mechanism.parameters.items() if p.source.startswith("calibrated to 6 measured")]
    assert len(calibrated) == 15
    for name in calibrated:
        p = mechanism.parameters[name]
        room = 0.01 * (p.maximum - p.minimum)
        assert p.minimum + room < p.value < p.maximum - room, name
    printed = fx.load(RPR / "rpr.yaml").parameters
    for name, p in printed.items():
        if p.source.startswith("paper"):
            assert mechanism.parameters[name] == p


def test_calibration_gives_the_file():
    """From a start at the calibrated sizes, moved by 5 %, the three that the frequencies tell best come back."""
    mechanism = fx.load(RPR / "calibrated.yaml")
    told = ["u_web", "platform_width", "arm_length", "leaf_thickness"]
    start = {name: 1.05 * mechanism.parameters[name].value for name in told}
    found = fx.calibrate(mechanism, fx.read_frequencies(RPR / "table5.csv"), told, start, method="least_squares")
    expected = {name: mechanism.parameters[name].value for name in told}
    assert found.values == pytest.approx(expected, rel=0.01)
    assert max(abs(m.error) for m in found.modes) < 0.005
