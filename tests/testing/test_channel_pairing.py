"""Channels of a test find what they read in the model, and say why when they do not."""

import numpy as np
import pytest

import flexura as fx
import helpers.correlated as c
from flexura.errors import OptionError
from flexura.testing.rig.channel_pairing import pair_channels


@pytest.fixture(scope="module")
def floating():
    return fx.assemble(c.floating())


@pytest.fixture(scope="module")
def bar():
    sensors = {
        "tip": fx.describe.MotionSensor(type="acceleration", nodes=("n5",), direction=(0, 1, 1)),
        "between": fx.describe.MotionSensor(type="displacement", nodes=("n2", "n4"), direction=(0, 0, 1)),
        "twist": fx.describe.MotionSensor(type="rotation", nodes=("n5",), direction=(1, 0, 0)),
    }
    return fx.assemble(c.cantilever(sensors=sensors))


def rigid_reading(x, d):
    """What a sensor at x along d reads in unit translations, and rotations about the origin: d and x cross d."""
    return np.concatenate([d, np.cross(x, d)])


def test_a_sensor_reads_rigid_motions_where_it_sits(floating):
    """On nodes, on bodies and near nodes, in mirrored and turned parts, rigid motions are read at the sensor."""
    model, rng = floating, np.random.default_rng(1)
    x = np.concatenate([model.geometry.positions, model.geometry.positions + 2e-4 * rng.normal(size=(1, 3))])
    d = rng.normal(size=x.shape)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    found = pair_channels(model, [c.channel(f"s{k}", tuple(d[k]), x[k]) for k in range(len(x))])
    assert not found.unmatched
    expected = np.array([rigid_reading(*pair) for pair in zip(x, d, strict=True)])
    assert np.allclose(found.rows @ model.rigid_body_motions(), expected, atol=1e-12)
    turns = pair_channels(model, [c.channel("r", tuple(d[0]), x[0], quantity="rotation")])
    assert np.allclose(turns.rows @ model.rigid_body_motions(), [[0, 0, 0, *d[0]]], atol=1e-12)
    assert turns.turns.all()


def corner(model, name, local):
    """A point of a body, given in the axes of its part about the body's centre."""
    number = int(model.plan.topology.numbers([name])[0])
    placed = model.plan.topology.copies["half"]
    copy = placed.paths.index((name.split(".")[0],))
    return model.geometry.positions[number] + model.geometry.Q[placed.number[copy]] @ np.asarray(local)


@pytest.mark.parametrize("copy", ["half1", "half2"])
def test_points_of_bodies_are_found_by_their_solids(floating, copy):
    turn = np.array([[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])
    edge = turn @ [0.0099, 0.0149, 0.0049]
    rim = [-0.005, 0.0099 * np.cos(2.0), 0.0099 * np.sin(2.0)]
    for body, local in (("box", edge), ("drum", rim)):
        x = corner(floating, f"{copy}.{body}", local)
        found = pair_channels(floating, [c.channel("s", c.X, x)], within=1e-6)
        assert [(m.node, m.how, m.distance) for m in found.matched] == [(f"{copy}.{body}", "body", 0.0)]


@pytest.mark.parametrize(
    ("body", "local", "distance"), [("drum", (0.0, 0.013, 0.0), 0.003), ("drum", (0.008, 0, 0), 0.003)]
)
def test_distance_from_a_body(floating, body, local, distance):
    x = corner(floating, f"half1.{body}", local)
    far = pair_channels(floating, [c.channel("s", c.X, x)], within=0.99 * distance)
    assert far.unmatched[0].distance == pytest.approx(distance)
    assert far.unmatched[0].nearest == f"half1.{body}"
    assert pair_channels(floating, [c.channel("s", c.X, x)], within=1.01 * distance).matched


def test_the_corner_of_a_box_is_not_on_the_drum(floating):
    """The corner of the square around a drum is outside of it by (sqrt 2 - 1) radii."""
    x = corner(floating, "half1.drum", (0.0, 0.01, 0.01))
    far = pair_channels(floating, [c.channel("s", c.X, x)], within=1e-4)
    assert far.unmatched[0].distance == pytest.approx((np.sqrt(2) - 1) * 0.01)


def test_by_the_name_of_the_node(bar):
    found = pair_channels(bar, [c.channel("a", (0, 0, -2.0), node="n3"), c.channel("b", c.Y, (0.06, 0, 0), "n3")])
    assert [(m.node, m.how) for m in found.matched] == [("n3", "node"), ("n3", "node")]
    assert np.allclose(found.rows[0], -bar.design.node_rows(bar.plan.topology.numbers(["n3"])).toarray()[2])


def test_a_node_that_is_elsewhere_is_not_taken(bar):
    found = pair_channels(bar, [c.channel("a", c.Y, (0.02, 0, 0), "n3")])
    assert "not where" in found.unmatched[0].reason
    assert found.unmatched[0].distance == pytest.approx(0.04)


def test_a_number_of_another_geometry_goes_by_position(bar):
    found = pair_channels(bar, [c.channel("a", c.Y, (0.0601, 0, 0), "17")])
    assert (found.matched[0].node, found.matched[0].how) == ("n3", "position")
    assert found.matched[0].distance == pytest.approx(1e-4)


def test_described_sensors_and_dofs_by_name(bar):
    names = ["tip", "between", "twist", "n4.tz", "n4.ry:velocity"]
    quantities = ["acceleration", "displacement", "rotation", "displacement", "angular_velocity"]
    channels = [c.MeasuredChannel(name, q) for name, q in zip(names, quantities, strict=True)]
    found = pair_channels(bar, channels)
    assert [m.how for m in found.matched] == ["name"] * 5
    assert np.allclose(found.rows, fx.system(bar, inputs=[], outputs=names).rows)
    assert found.turns.tolist() == [False, False, True, False, True]
    assert np.allclose(found.positions[0], (0.1, 0, 0)) and np.isnan(found.positions[1]).all()
    assert np.allclose(found.directions[[0, 3]], [(0, np.sqrt(0.5), np.sqrt(0.5)), (0, 0, 1)])


def test_what_is_left_out_and_why(bar):
    channels = [
        c.channel("far", c.Y, (0.05, 0.03, 0)),
        c.channel("held", c.Y, (0.0, 0, 0)),
        c.channel("lost", None, (0.1, 0, 0)),
        c.channel("placeless", c.Y),
        c.MeasuredChannel("twist", "acceleration"),
        c.channel("good", c.Y, (0.1, 0, 0)),
    ]
    found = pair_channels(bar, channels)
    reasons = {u.channel.name: u.reason for u in found.unmatched}
    assert set(reasons) == {"far", "held", "lost", "placeless", "twist"}
    assert "within 2 mm" in reasons["far"]
    assert "holds" in reasons["held"]
    assert "no direction" in reasons["lost"]
    assert "no position" in reasons["placeless"]
    assert "is not" in reasons["twist"]
    assert found.at.tolist() == [5]
    far = next(u for u in found.unmatched if u.channel.name == "far")
    assert far.distance == pytest.approx(np.hypot(0.03, 0.0), rel=1e-12)


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1e3), ("inches", 1 / 0.0254)])
def test_positions_in_other_units_are_recognised(bar, unit, factor):
    channels = [c.channel(f"s{k}", c.Y, (0.02 * k * factor, 0, 0)) for k in range(1, 6)]
    found = pair_channels(bar, channels)
    assert len(found.unmatched) == 5
    assert unit in found.notes[0]


def test_forces_find_where_they_act(bar):
    found = pair_channels(bar, [c.channel("hammer", (0, 0, -1.0), (0.1, 0, 0), quantity="force")])
    assert np.allclose(found.rows[0], -fx.system(bar, inputs=["n5.tz"], outputs=[]).B[:, 0])
    by_name = pair_channels(bar, [c.MeasuredChannel("n5.tz", "force")])
    assert np.allclose(by_name.rows, -found.rows)


@pytest.mark.parametrize(
    ("channel", "tolerance", "words"),
    [
        (c.channel("a", c.Y, (0.1, 0, 0)), 0.0, "positive length"),
        (c.channel("a", c.Y, (np.nan, 0, 0)), None, "not finite"),
        (c.channel("a", (0, 0, 0.0), (0.1, 0, 0)), None, "direction"),
    ],
)
def test_what_is_refused(bar, channel, tolerance, words):
    with pytest.raises(OptionError, match=words):
        pair_channels(bar, [channel], within=tolerance)
