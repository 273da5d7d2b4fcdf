"""Tests made from other designs, other bases and faulty sensors, held against the model."""

import json

import numpy as np
import pytest

import flexura as fx
import helpers.correlated as c
from flexura.errors import OptionError, SolverError
from flexura.testing.correlation.correlated import sensor_mass, serep
from flexura.testing.correlation.correlation import correlate
from flexura.testing.measurement.measurement import MeasuredFRF, Measurement

TURN = 0.6


@pytest.fixture(scope="module")
def bar():
    """The cantilever, its frequencies, vectors, channels, and what they read of eight modes."""
    full, hz, vectors = c.modes_of(c.cantilever(), 8)
    channels = c.grid()
    return full, hz, vectors, channels, fx.testing.pair_channels(full, channels).rows @ vectors


def turned_pairs(shapes, angle):
    """Repeated pairs 1-2, 3-4, ... in a basis turned by an angle."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.hstack([shapes[:, k : k + 2] @ turn for k in range(0, shapes.shape[1], 2)])


def test_repeated_modes_of_another_design(bar):
    """A thicker bar with an end mass in proportion has the same shapes at other frequencies; tested in another basis of
    every repeated pair."""
    full, hz, *_ = bar
    other, test_hz, vectors = c.modes_of(c.cantilever(diameter=3.15e-3, mass=0.005 * 1.05**2), 4)
    channels = c.grid()
    shapes = turned_pairs(fx.testing.pair_channels(other, channels).rows @ vectors, TURN)
    found = correlate(full, test=c.identified(test_hz * [1, 1.0005, 1, 1.0005], shapes, channels))
    assert [p.test for p in found.pairs] == [1, 2, 3, 4]
    assert [sorted(p.model for p in found.pairs[k : k + 2]) for k in (0, 2)] == [[1, 2], [3, 4]]
    for pair in found.pairs:
        assert pair.error == pytest.approx(hz[pair.model - 1] / pair.test_hz - 1, rel=1e-12)
        assert pair.space_mac > 1 - 1e-4
        assert pair.expansion_error < 0.01
    assert min(p.mac for p in found.pairs) < 0.9
    assert np.allclose(found.self_orthogonality, np.eye(4), atol=1e-3)
    assert np.allclose(found.cross_orthogonality, np.eye(4), atol=1e-3)
    beside = found.counterparts - found.expanded
    assert (np.abs(beside[:, :3]).max(axis=(0, 1)) < 0.01 * np.abs(found.expanded[:, :3]).max(axis=(0, 1))).all()
    assert np.allclose(found.comac, 1.0, atol=1e-3)
    assert not found.notes


def test_swapped_order_is_seen(bar):
    full, hz, _, channels, shapes = bar
    found = correlate(full, test=c.identified(hz[[0, 1, 2, 3]], shapes[:, [2, 3, 0, 1]], channels))
    assert [p.model for p in found.pairs[:2]] in ([3, 4], [4, 3])
    assert [p.model for p in found.pairs[2:]] in ([1, 2], [2, 1])


def test_low_order_and_full_order_models_say_the_same(bar):
    full, hz, _, channels, shapes = bar
    test = c.identified(hz[:4], shapes[:, :4], channels)
    a, b = correlate(full, test=test), correlate(fx.reduce(full.plan, tolerance=1e-6, up_to=2 * hz[3]), test=test)
    assert [p.model for p in a.pairs] == [p.model for p in b.pairs] or all(p.space_mac > 0.99 for p in b.pairs)
    assert [p.model_hz for p in b.pairs] == pytest.approx([p.model_hz for p in a.pairs], rel=1e-5)


def test_missing_modes_on_both_sides(bar):
    """The test has the second pair and a shape from elsewhere; the first pair is named as missing."""
    full, hz, _, channels, shapes = bar
    strange = np.random.default_rng(2).normal(size=len(channels))
    test = c.identified([hz[2], hz[3], 1.3 * hz[3]], np.column_stack([shapes[:, 2:4], strange]), channels)
    found = correlate(full, test=test)
    assert found.unpaired_model == (1, 2)
    assert found.unpaired_test == (3,)


@pytest.mark.parametrize(("factor", "words"), [(-1.0, "wrong way round"), (9.81, "unit or sensitivity")])
def test_a_faulty_channel_is_named(bar, factor, words):
    full, hz, _, channels, shapes = bar
    faulty = shapes[:, :6].copy()
    faulty[3] *= factor
    found = correlate(full, test=c.identified(hz[:6], faulty, channels))
    named = [note for note in found.notes if words in note]
    assert len(named) == 1
    assert named[0].startswith(channels[3].name)
    assert found.gain[3] == pytest.approx(factor, rel=0.35)


def test_modes_that_the_sensors_confuse_are_named(bar):
    """With sensors at the free end alone all bending modes in one plane read the same."""
    full, hz, *_ = bar
    channels = c.grid()[-2:]
    shapes = fx.testing.pair_channels(full, channels).rows @ bar[2][:, :2]
    found = correlate(full, test=c.identified(hz[:2], shapes, channels), n=4)
    assert sum("hardly tell" in note for note in found.notes) == 0 or found.pairs
    assert found.auto_mac_model[0, 2:4].max() > 0.3


def test_expansion_recovers_the_whole_mechanism(bar):
    """Readings of modes in any basis give back displacements and rotations of all nodes."""
    full, hz, vectors, channels, shapes = bar
    mixed = turned_pairs(vectors[:, :4], TURN)
    test = c.identified(hz[:4], turned_pairs(shapes[:, :4], TURN) * [3.0, -1.0, 2.0, -0.5], channels)
    found = correlate(full, test=test)
    expected = full.node_displacements(mixed)
    for k in range(4):
        own = found.expanded[:, :, k].ravel()
        cosine = own @ expected[:, :, k].ravel() / (np.linalg.norm(own) * np.linalg.norm(expected[:, :, k]))
        assert abs(cosine) == pytest.approx(1.0, abs=1e-9)
    assert found.expansion.is_determined


def test_too_few_sensors_are_said(bar):
    full, _, vectors, *_ = bar
    channels = c.grid()[:3]
    shapes = fx.testing.pair_channels(full, channels).rows @ vectors[:, :4]
    expansion = serep(shapes, shapes)
    assert not expansion.is_determined
    assert np.allclose(expansion.error, 0, atol=1e-12)


def test_static_mass_is_that_of_guyan(bar):
    """Against condensation by partition of K and M, sensors on DOFs."""
    full, *_ = bar
    names = full.dof_names
    own = [names.index(f"n{k}.t{a}") for k in (1, 3, 5) for a in "yz"]
    K, M = full.K.toarray(), full.M.toarray()
    rest = np.setdiff1d(np.arange(len(K)), own)
    T = np.zeros((len(K), len(own)))
    T[own] = np.eye(len(own))
    T[rest] = -np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, own)])
    rows = np.eye(len(K))[own]
    expected = T.T @ M @ T
    assert np.allclose(sensor_mass(full, rows, method="guyan"), expected, rtol=1e-6, atol=1e-8 * expected.max())


def test_static_mass_with_redundant_sensors(bar):
    """A sensor given twice shares its part: the mass of equal readings stays."""
    full, *_ = bar
    rows = fx.testing.pair_channels(full, c.grid()).rows
    once = sensor_mass(full, rows, method="guyan")
    twice = sensor_mass(full, rows[[*range(10), 4]], method="guyan")
    pick = np.eye(10)[[*range(10), 4]]
    assert np.allclose(pick.T @ twice @ pick, once, rtol=1e-6, atol=1e-8 * once.max())


def test_serep_mass_makes_its_modes_orthonormal(bar):
    full, _, vectors, _, shapes = bar
    mass = sensor_mass(full, fx.testing.pair_channels(full, c.grid()).rows, vectors[:, :6])
    assert np.allclose(shapes[:, :6].T @ mass @ shapes[:, :6], np.eye(6), atol=1e-9)


@pytest.mark.parametrize("method", ["serep", "guyan"])
def test_orthogonality_finds_a_mixture(method):
    """Two modes mixed by the angle t have cross-orthogonalities cos t and sin t; static mass is near to that."""
    full, hz, vectors = c.modes_of(c.cantilever(section=fx.describe.Rectangle(width=3e-3, thickness=2e-3)), 4)
    t, channels = 0.1, c.grid()
    shapes = fx.testing.pair_channels(full, channels).rows @ vectors
    x = shapes.copy()
    x[:, 0] = np.cos(t) * shapes[:, 0] + np.sin(t) * shapes[:, 2]
    x[:, 2] = np.cos(t) * shapes[:, 2] - np.sin(t) * shapes[:, 0]
    found = correlate(full, test=c.identified(hz, x, channels), reduced_mass=method)
    models = [p.model for p in found.pairs]
    cross, close = found.cross_orthogonality[0], 1e-6 if method == "serep" else 0.02
    assert found.pairs[0].test == 1
    assert cross[models.index(1)] == pytest.approx(np.cos(t), abs=close)
    assert cross[models.index(3)] == pytest.approx(np.sin(t), abs=close)


def measurement(mechanism, outputs, inputs, channels, hammer, hz, decay=0.0):
    """Responses of the model itself, solved directly at every frequency, as if measured."""
    H = fx.frequency_response(
        mechanism,
        frequency_hz=hz,
        inputs=inputs,
        outputs=outputs,
        order="full",
        method="direct",
        quantity="accelerance",
        damping={"loss_factor": 0.02},
    )
    frf = MeasuredFRF(H.frequency_hz, H.response, hammer, channels, setup="one", decay=decay)
    return Measurement("direct", frfs=(frf,))


def test_responses_lie_over_those_of_a_direct_solution(bar):
    """Loss factor 2 % solved directly over the DOFs by name, against modal damping of 1 % at channels found by
    position: equal at the resonances."""
    full, hz, _, _, _ = bar
    names = ["n5.tz", "n3.tz"]
    channels = (c.channel("a", c.Z, (0.1, 0, 0)), c.channel("b", (0, 0, -1.0), (0.06, 0, 0)))
    hammer = (c.channel("h", (0, 0, -1.0), (0.1, 0, 0), quantity="force"),)
    line = np.linspace(0.5 * hz[0], 1.2 * hz[2], 100)
    measured = measurement(c.cantilever(), names, ["n5.tz"], channels, hammer, line)
    grid = c.grid()
    shapes = fx.testing.pair_channels(full, grid).rows @ bar[2][:, :4]
    found = correlate(full, test=c.identified(hz[:4], shapes, grid), measurement=measured)
    overlay = found.frfs[0]
    expected = measured.frfs[0].response * np.array([-1.0, 1.0])[None, :, None]
    assert overlay.damping == "as identified"
    assert overlay.frac.min() > 0.9999
    scale = np.abs(expected).max(axis=0)
    assert (np.abs(overlay.response - expected) < 0.01 * scale).all()


@pytest.mark.parametrize("described", [False, True])
def test_the_decay_of_a_window_is_in_the_overlay(bar, described):
    """An exponential window adds its rate to every mode: the peak falls by zeta / (zeta + decay / omega)."""
    full, hz, _, channels, shapes = bar
    if described:
        full = fx.assemble(c.cantilever().replaced({"damping": fx.describe.Damping(ratio=0.01)}))
    hammer = (c.channel("h", c.Z, (0.1, 0, 0), quantity="force"),)
    one = (c.channel("a", c.Z, (0.1, 0, 0)),)
    decay = 0.01 * 2 * np.pi * hz[0]
    peaks = []
    for extra in (0.0, decay):
        frf = MeasuredFRF(hz[:1], np.ones((1, 1, 1), dtype=complex), hammer, one, decay=extra)
        test = c.identified(hz[:4], shapes[:, :4], channels)
        peaks.append(
            np.abs(correlate(full, test=test, measurement=Measurement("m", frfs=(frf,))).frfs[0].response[0, 0, 0])
        )
    assert peaks[1] / peaks[0] == pytest.approx(0.5, rel=0.01)


def test_shapes_at_the_inputs_where_the_hammer_moves(bar):
    full, hz, _, channels, shapes = bar
    inputs = tuple(c.MeasuredChannel(k.name, "force", k.node, k.direction, k.position) for k in channels)
    test = c.identified(hz[:4], shapes[:1, :4], channels[:1], inputs=inputs, participation=shapes[:, :4] * 1j)
    found = correlate(full, test=test)
    assert len(found.matched) == 10
    assert all(p.space_mac > 1 - 1e-9 for p in found.pairs)
    assert any("reciprocity" in note for note in found.notes)


def test_rotations_count_by_a_length(bar):
    full, hz, vectors, *_ = bar
    channels = (*c.grid(), c.channel("turn", c.Z, (0.1, 0, 0), quantity="angular_acceleration"))
    shapes = fx.testing.pair_channels(full, channels).rows @ vectors[:, :4]
    found = correlate(full, test=c.identified(hz[:4], shapes, channels))
    assert found.reach == pytest.approx(0.05)
    assert np.allclose(np.abs(found.test_shapes[-1]), 0.05 * np.abs(shapes[-1]))
    assert any("50 mm" in note for note in found.notes)


def test_channels_without_a_shape_are_left_out(bar):
    full, hz, _, channels, shapes = bar
    holes = shapes[:, :4].copy()
    holes[2, 1] = np.nan
    found = correlate(full, test=c.identified(hz[:4], holes, channels))
    assert len(found.matched) == 9
    assert any(channels[2].name in note for note in found.notes)


def test_plain_data(bar):
    full, hz, _, channels, shapes = bar
    found = correlate(full, test=c.identified(hz[:1], shapes[:1, :1], channels[:1]))
    data = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert data["pairs"][0]["test_hz"] == pytest.approx(hz[0])
    assert any("single channel" in note for note in data["notes"])


def test_what_is_refused(bar):
    full, hz, _, channels, shapes = bar
    test = c.identified(hz[:4], shapes[:, :4], channels)
    far = tuple(c.channel(k.name, k.direction, 1e3 * np.array(k.position)) for k in channels)
    with pytest.raises(OptionError, match=r"none of 10 channels.*read as mm"):
        correlate(full, test=c.identified(hz[:4], shapes[:, :4], far))
    with pytest.raises(OptionError, match="no modes"):
        correlate(full, test=c.identified([], shapes[:, :0], channels))
    with pytest.raises(OptionError, match="serep or guyan"):
        correlate(full, test=test, reduced_mass="irs")  # type: ignore[arg-type]
    with pytest.raises(OptionError, match="parameters"):
        correlate(full, test=test, parameters={"a": 1.0})
    with pytest.raises(OptionError, match="at least 1"):
        correlate(full, test=test, n=0)
    with pytest.raises(OptionError, match="not a list"):
        correlate(full, test=[1.0])  # type: ignore[arg-type]
    free = fx.assemble(c.floating())
    with pytest.raises(SolverError, match="held"):
        sensor_mass(free, np.eye(free.order)[:3], method="guyan")
