"""What poses hold and tables of them: compliances, proven intervals, parasitic motion, files."""

import json
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.strain.stress import YieldRatios
from flexura.analysis.strokes.pose import PathState, stroke_poses
from flexura.mechanism import DOF_NAMES
from helpers.shell import flexura, refused

EXAMPLES = Path(__file__).parents[2] / "examples"
GUIDE = EXAMPLES / "guide" / "guide.yaml"
MOVE = {"carriage.x": (-0.01, 0.01)}


@pytest.fixture(scope="module")
def guide():
    nodes = ["carriage", "leaf1.head"]
    return fx.stroke(fx.load(GUIDE), move=MOVE, steps=3, n=4, nodes=nodes, compliance=True)


def test_at_rest_compliance_is_that_of_linear_statics(guide):
    rest = guide.poses[1]
    for node, C in rest.compliance.items():
        linear = fx.compliance(fx.load(GUIDE), nodes=[node])
        d = np.sqrt(np.diag(linear))
        assert np.abs((C - linear) / np.outer(d, d)).max() < 1e-8


def test_a_held_drive_takes_its_direction_out_of_the_compliance(guide):
    for pose in guide.poses:
        C, held = pose.compliance["carriage"], pose.compliance_held["carriage"]
        rest = C - np.outer(C[:, 0], C[0]) / C[0, 0]
        d = np.sqrt(np.diag(C))
        assert np.abs((held - rest) / np.outer(d, d)).max() < 1e-8
        assert np.isnan(pose.stiffness_held["carriage"]).all()
        assert 1 / C[0, 0] == pytest.approx(pose.drive_stiffness["carriage.x"], rel=1e-8)
        assert 1 / np.diag(held)[1:] == pytest.approx(pose.support_stiffness[1:], rel=1e-8)


def test_stiffness_is_the_inverse_of_the_compliance(guide):
    for pose in guide.poses:
        for C, K in zip(pose.compliance.values(), pose.stiffness.values(), strict=True):
            d = np.sqrt(np.diag(C))
            assert np.abs(K @ C * d / d[:, None] - np.eye(6)).max() < 1e-6


def test_compliances_are_not_there_unless_asked_for():
    pose = fx.stroke(fx.load(GUIDE), move={"carriage.x": 0.001}, n=1).poses[0]
    assert not pose.compliance
    assert not pose.stiffness_held


@pytest.mark.parametrize(
    ("file", "move"),
    [
        ("guide/guide.yaml", {"carriage.x": (-0.012, 0.012)}),
        ("pivot/pivot.yaml", {"arm.ry": (-0.3, 0.3)}),
        ("rpr/rpr.yaml", {"platform.rx": (0.0, 0.1)}),
        ("guide/guide.yaml", {"carriage.z": (-1e-4, 1e-4)}),
    ],
)
def test_frequencies_of_poses_are_proven(file, move):
    """The last pushes the leaves far beyond buckling; its fifth and sixth are a pair, which six modes keep whole."""
    found = fx.stroke(fx.load(EXAMPLES / file), move=move, steps=3, n=6)
    for pose in found.poses:
        assert pose.proven
        interval, hertz = np.array(pose.frequency_interval_hz), np.array(pose.frequency_hz)
        assert (interval[:, 0] <= hertz).all()
        assert (hertz <= interval[:, 1]).all()
        assert (interval[:, 1] - interval[:, 0] < 1e-6 * np.abs(hertz)).all()


def test_a_frequency_that_is_left_out_is_told(monkeypatch):
    from flexura.motion import Pose

    modes = Pose.modes

    def without_the_first(self, n):
        found = modes(self, n + 1)
        return type(found)(found.values[1:], found.vectors[:, 1:])

    monkeypatch.setattr(Pose, "modes", without_the_first)
    found = fx.stroke(fx.load(GUIDE), move={"carriage.x": 0.004}, n=2)
    assert not found.poses[0].proven
    assert [own.kind for own in found.warnings] == ["proof"]
    assert "at carriage.x = 0.004 m natural frequencies are not proven" in str(found.warnings[0])


def test_columns_have_parasitic_motion_and_compliance(guide):
    table = guide.to_columns()
    assert all(len(column) == 3 for column in table.values())
    for k, dof in enumerate(DOF_NAMES):
        unit = "m" if k < 3 else "rad"
        assert table[f"leaf1.head {dof} [{unit}]"] == [p.displacement["leaf1.head"][k] for p in guide.poses]
    # shortening of a guide, Awtar, Slocum, Sevincer (2007): -0.6 x^2 / L
    assert table["carriage tz [m]"][2] == pytest.approx(-0.6 * 0.01**2 / 0.06, rel=0.03)
    assert table["compliance leaf1.head tx ry [1/N]"] == [p.compliance["leaf1.head"][0, 4] for p in guide.poses]


def test_files_hold_the_table(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    options = ("--move", "carriage.x=-4mm:4mm", "--steps", "3", "-n", "2", "--node", "leaf1.head", "--compliance")
    told = json.loads(flexura("stroke", GUIDE, *options, "--out", tmp_path / "poses.parquet", "--json").stdout)
    own = fx.stroke(
        fx.load(GUIDE), move={"carriage.x": (-0.004, 0.004)}, steps=3, n=2, nodes=["leaf1.head"], compliance=True
    )
    assert told["poses"] == own.to_dict()["poses"]
    found = parquet.read_table(tmp_path / "poses.parquet").to_pydict()
    assert list(found) == list(own.to_columns())
    assert found["proven"] == [True] * 3
    assert found["f2 upper [Hz]"] == [pose.frequency_interval_hz[1][1] for pose in own.poses]
    refused(flexura("stroke", GUIDE, *options, "--out", tmp_path / "poses.xlsx"), "must be named .csv or .parquet")


def test_parquet_needs_pyarrow(monkeypatch, tmp_path):
    import sys

    from flexura.files import write_table

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(fx.OptionError, match=r"pip install 'flexura\[parquet\]'"):
        write_table([{"a": [1.0]}], tmp_path / "a.parquet")
    assert not list(tmp_path.iterdir())


def test_a_mode_that_leaves_the_lowest_ones_is_not_joined_to_the_one_that_comes():
    """Three modes of four coordinates: the third is along e3, and e4 takes its place at the second pose; at the third
    pose e3 is back."""
    pose = fx.stroke(fx.load(GUIDE), move={"carriage.x": 1e-3}, n=1).poses[0]
    shapes, mass = np.eye(4), np.eye(4)
    steps = [(shapes[:, [0, 1, 2]], (1.0, 2.0, 3.0)), (shapes[:, [0, 1, 3]], (1.0, 2.0, 3.1))]
    found = [PathState(None, pose, np.array(values), own, mass) for own, values in (*steps, steps[0])]
    nothing = YieldRatios((), np.empty((0, 0)), np.empty((0, 0)), np.empty((0, 0, 3)))
    assert [own.tracked for own in stroke_poses(found, nothing)] == [(0, 1, 2), (0, 1, -1, 2), (0, 1, 2, -1)]


def test_driven_nodes_shift_where_they_are_not_driven(guide):
    """Leaves of length L that stay parallel shorten by 0.6 x^2 / L: the carriage comes down by that."""
    shift = guide.parasitic_shifts["carriage"]
    assert shift[1] == pytest.approx(0, abs=1e-9)
    assert shift[[0, 2]] == pytest.approx(0.6 * 0.01**2 / 0.06, rel=0.02)
    assert guide.frequency_changes[1] == pytest.approx(0, abs=1e-12) and abs(guide.frequency_changes[0, 0]) > 1e-4
