"""Several setups: roving sensors whose mass shifts frequencies, roving hammers, and shapes on one scale."""

from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexura.testing.identification.multi_setup import _between, _weighted
from helpers.modal_systems import System, measured, modal

HZ = np.arange(0.0, 90.0, 0.125)
FREQUENCIES, RATIOS = [11.0, 19.0, 32.0, 47.0, 71.0], [0.01, 0.008, 0.012, 0.006, 0.01]


def roved(mass=0.0, decibels=40.0, placements=((0, 1), (2, 3), (4, 5), (6, 7)), seed=0):
    """Two sensors in four placements, their mass only where they are; hits at two points in all of them."""
    system = modal(FREQUENCIES, RATIOS, seed=3)
    found = []
    for k, at in enumerate(placements):
        M = system.M.copy()
        M[at, at] += mass * np.diag(system.M).mean()
        loaded = System(M, system.C, system.K)
        found.append(
            (loaded, measured(loaded, HZ, outputs=at, decibels=decibels, seed=seed + k, setup=f"step {k + 1}"))
        )
    return system, found


def test_shapes_of_four_placements_have_one_scale():
    system, found = roved()
    result = fx.identify([frf for _, frf in found])
    assert result.frequency_hz == pytest.approx(FREQUENCIES, rel=1e-3)
    assert result.damping_ratio == pytest.approx(RATIOS, rel=0.05)
    assert [c.node for c in result.outputs] == [f"n{k}" for k in range(8)]
    phi = system.normal_modes()[:, :5]
    assert np.diag(fx.modal.mac(result.real_shapes, phi)).min() > 0.999
    assert np.abs(np.abs(result.real_shapes) - np.abs(phi)).max() < 0.02 * np.abs(phi).max()
    assert [e.setups for e in result.evidence] == [4] * 5


def test_each_setup_has_the_frequencies_of_its_own_masses():
    _, found = roved(mass=5e-5)
    result = fx.identify([frf for _, frf in found])
    assert [own.name for own in result.setups] == ["step 1", "step 2", "step 3", "step 4"]
    for own, (loaded, _) in zip(result.setups, found, strict=True):
        assert own.frequency_hz == pytest.approx(loaded.frequency_hz[:5], rel=5e-4)
    mean = np.mean([loaded.poles[:5] for loaded, _ in found], axis=0)
    assert result.frequency_hz == pytest.approx(np.abs(mean) / (2 * np.pi), rel=1e-3)
    spread = np.std([loaded.frequency_hz[:5] for loaded, _ in found], axis=0) / np.array(FREQUENCIES)
    assert spread.max() > 2e-3
    assert [e.frequency_scatter for e in result.evidence] == pytest.approx(spread, rel=0.2, abs=2e-4)
    assert (result.frequency_hz < FREQUENCIES).all()


def test_taken_together_they_are_one_matrix():
    _, found = roved()
    result = fx.identify([replace(frf, setup="") for _, frf in found])
    same = fx.identify([frf for _, frf in found], setups="together")
    assert not result.setups and not same.setups
    assert same.poles == pytest.approx(result.poles, rel=1e-12)
    assert result.frequency_hz == pytest.approx(FREQUENCIES, rel=1e-3)


def test_more_hits_than_sensors_and_a_hit_that_one_placement_lacks():
    system = modal(FREQUENCIES, RATIOS, seed=3)
    steps = {"a": ((0, 1), (0, 1, 5)), "b": ((2, 3), (5, 1, 0)), "c": ((4, 5), (0, 5, 1, 2)), "d": ((6, 7), (5, 0, 2))}
    each = [measured(system, HZ, hits, at, 40, k, setup=s) for k, (s, (at, hits)) in enumerate(steps.items())]
    result = fx.identify(each)
    assert [c.name for c in result.inputs] == ["hit0", "hit5"]
    assert "not in all setups, and not used to merge them: hit1, hit2" in result.notes
    assert result.frequency_hz == pytest.approx(FREQUENCIES, rel=1e-3)
    phi = system.normal_modes()[:, :5]
    assert np.abs(np.abs(result.real_shapes) - np.abs(phi)).max() < 0.02 * np.abs(phi).max()


def test_a_sensor_that_stays_is_one_channel():
    system, found = roved(placements=((0, 1, 2), (0, 3, 4), (0, 5, 6, 7)))
    result = fx.identify([frf for _, frf in found])
    assert [c.node for c in result.outputs] == [f"n{k}" for k in range(8)]
    assert np.diag(fx.modal.mac(result.real_shapes, system.normal_modes()[:, :5])).min() > 0.999


def test_a_roving_hammer_is_the_same_turned_round():
    system = modal(FREQUENCIES, RATIOS, seed=3)
    groups = ((0, 1), (2, 3), (4, 5), (6, 7))
    each = [measured(system, HZ, at, (0, 1), 40, k, setup=str(k)) for k, at in enumerate(groups)]
    result = fx.identify(each)
    assert result.participation.shape == (8, 5) and result.shapes.shape == (2, 5)
    assert result.frequency_hz == pytest.approx(FREQUENCIES, rel=1e-3)
    turned = result.participation * np.exp(-1j * np.angle((result.participation**2).sum(axis=0)) / 2)
    assert np.diag(fx.modal.mac(turned.real, system.normal_modes()[:, :5])).min() > 0.999
    assert result.scaling == ("unit modal mass",) * 5


def test_a_mode_that_a_placement_does_not_see():
    system = modal(FREQUENCIES, RATIOS, seed=3)
    shapes = system.normal_modes().copy()
    shapes[6:, 2] = 0.0
    inverse = np.linalg.inv(shapes)
    w = 2 * np.pi * system.frequency_hz
    M, C, K = (inverse.T @ np.diag(d) @ inverse for d in (np.ones(8), 2 * system.damping_ratio * w, w**2))
    blind = System(M, C, K)
    groups = ((0, 1), (2, 3), (4, 5), (6, 7))
    each = [measured(blind, HZ, outputs=at, decibels=40, seed=k, setup=str(k)) for k, at in enumerate(groups)]
    result = fx.identify(each)
    assert result.frequency_hz == pytest.approx(FREQUENCIES, rel=1e-3)
    assert result.evidence[2].setups == 3
    assert any("found in 3 of 4 setups" in note for note in result.notes)
    assert np.abs(result.real_shapes[6:, 2]).max() < 0.01 * np.abs(result.real_shapes[:, 2]).max()
    assert np.diag(fx.modal.mac(result.real_shapes, shapes[:, :5])).min() > 0.999


def seen_through(faint, seed, decibels=40.0):
    """Three placements, the last of which sees `faint` of the third mode's motion."""
    system = modal(FREQUENCIES, RATIOS, seed=3)
    shapes = system.normal_modes().copy()
    shapes[6:, 2] *= faint
    inverse = np.linalg.inv(shapes)
    w = 2 * np.pi * system.frequency_hz
    own = System(*(inverse.T @ np.diag(d) @ inverse for d in (np.ones(8), 2 * system.damping_ratio * w, w**2)))
    groups = ((6, 7), (0, 1, 2), (3, 4, 5))
    each = [measured(own, HZ, (0, 1), at, decibels, 10 * seed + k, setup=str(k)) for k, at in enumerate(groups)]
    return fx.identify(each), np.abs(shapes[:, 2])


@pytest.mark.parametrize("seed", range(3))
def test_a_placement_near_a_node_hardly_counts(seed):
    result, shape = seen_through(0.2, seed)
    faint, *clear = (own.evidence[2].damping_sigma for own in result.setups)
    assert faint > 20 * max(clear) and result.evidence[2].setups == 3
    off = [own.damping_ratio[2] / RATIOS[2] - 1 for own in result.setups]
    sigma = result.evidence[2].damping_sigma
    assert abs(result.damping_ratio[2] / RATIOS[2] - 1) < 3 * sigma < 0.003
    assert sigma == pytest.approx(1 / np.sqrt(sum(1 / s**2 for s in (faint, *clear))), rel=0.1)
    assert abs(off[0]) < 4 * faint
    at = [int(c.name.removeprefix("acc")) for c in result.outputs]
    assert np.abs(result.real_shapes[:, 2]) == pytest.approx(shape[at], abs=0.02 * shape.max())
    assert result.evidence[2].setup_shift < 2e-4


def test_weights_of_setups_in_closed_form():
    x, variance = np.array([10.0, 10.3, 10.6]), np.array([0.01, 0.04, 0.04])
    mean, sigma, weight = _weighted(x, variance, 0.0)
    assert mean == pytest.approx((100 * 10 + 25 * 10.3 + 25 * 10.6) / 150)
    assert sigma == pytest.approx(150**-0.5) and weight == pytest.approx([4 / 6, 1 / 6, 1 / 6])
    assert _between(x, variance) == 0.0
    assert _between(x, variance / 100) == pytest.approx(0.09 - 0.0003)
    mean, sigma, weight = _weighted(x, variance, 1e6)
    assert mean == pytest.approx(10.3, abs=1e-6) and sigma == pytest.approx(np.sqrt(0.09) / 3, rel=1e-6)
    lost = np.array([0.01, np.inf, 0.04])
    assert _weighted(x, lost, 0.0)[0] == pytest.approx((4 * 10 + 10.6) / 5)
    assert _weighted(x, np.full(3, np.inf), 0.0)[0] == pytest.approx(10.3)
    assert _between(x, np.array([0.01, np.inf, np.inf])) == 0.0


def test_shifts_by_masses_are_told_from_noise():
    _, found = roved(mass=5e-5)
    result = fx.identify([frf for _, frf in found])
    true = np.array([loaded.frequency_hz[:5] for loaded, _ in found])
    spread = true.std(axis=0, ddof=1) / true.mean(axis=0)
    assert [e.setup_shift for e in result.evidence] == pytest.approx(spread, rel=0.05, abs=1e-4)
    assert max(e.frequency_sigma for e in result.evidence) < 1e-4
    (note,) = (note for note in result.notes if "sensors' masses" in note)
    assert [f"{f:.5g} Hz" in note for f in result.frequency_hz] == [bool(x > 1e-3) for x in spread]
    _, still = roved()
    assert not any("sensors' masses" in note for note in fx.identify([frf for _, frf in still]).notes)


def test_a_place_is_a_node_and_a_position_and_a_direction():
    """Eight sensors of one name each at two nodes: only positions and directions tell them apart."""
    system, found = roved()

    def moved(channel):
        k = int(channel.name.removeprefix("acc"))
        direction = (0.0, 0.0, 1.0) if k % 2 else (1.0, 0.0, 0.0)
        return replace(
            channel, name="acc", node="body", position=(0.1 * (k // 4), 0.1 * (k // 2 % 2), 0.0), direction=direction
        )

    each = [replace(frf, outputs=tuple(moved(c) for c in frf.outputs)) for _, frf in found]
    result = fx.identify(each)
    assert len(result.outputs) == 8
    assert np.diag(fx.modal.mac(result.real_shapes, system.normal_modes()[:, :5])).min() > 0.999
    near = [
        replace(c, name=f"acc{k}", node="body", position=(0.1 * k, 0.0, 0.0)) for k, c in enumerate(found[0][1].outputs)
    ]
    same = [replace(found[0][1], outputs=tuple(replace(c, name="acc") for c in near))]
    assert fx.identify(same).shapes.shape[0] == 2


def test_a_repeated_pair_in_all_placements():
    system = modal([11.0, 32.0, 32.0, 71.0], [0.01] * 4, seed=2)
    groups = ((0, 1), (2, 3), (4, 5), (6, 7))
    each = [measured(system, HZ, outputs=at, decibels=40, seed=k, setup=str(k)) for k, at in enumerate(groups)]
    result = fx.identify(each)
    assert result.frequency_hz == pytest.approx([11, 32, 32, 71], rel=1e-3)
    true, pair = system.normal_modes()[:, 1:3], result.real_shapes[:, 1:3]
    assert pair @ pair.T == pytest.approx(true @ true.T, abs=0.05 * np.abs(true @ true.T).max())


def test_what_is_picked_is_picked_in_every_setup():
    _, found = roved(mass=5e-5)
    result = fx.identify([frf for _, frf in found], select=[18.9, 46.5])
    assert result.frequency_hz == pytest.approx([19, 47], rel=0.02)
    assert all(len(own.poles) == 2 for own in result.setups)
    with pytest.raises(fx.OptionError, match="no pole near 88 Hz"):
        fx.identify([frf for _, frf in found], select=[88.0])


def test_setups_without_anything_in_common_are_refused():
    system = modal(FREQUENCIES, RATIOS, seed=3)
    each = [measured(system, HZ, at, at, 40, setup=str(at)) for at in ((0, 1), (2, 3))]
    with pytest.raises(fx.OptionError, match="share neither inputs nor outputs"):
        fx.identify(each)
