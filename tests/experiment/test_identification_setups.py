"""Several setups: roving sensors whose mass shifts frequencies, roving hammers, and shapes on one scale."""

from dataclasses import replace

import numpy as np
import pytest
from modal_systems import System, measured, modal

import flexura as fx

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
    assert np.diag(fx.mac(result.real_shapes, phi)).min() > 0.999
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
    assert "not in all setups, and not used to join them: hit1, hit2" in result.notes
    assert result.frequency_hz == pytest.approx(FREQUENCIES, rel=1e-3)
    phi = system.normal_modes()[:, :5]
    assert np.abs(np.abs(result.real_shapes) - np.abs(phi)).max() < 0.02 * np.abs(phi).max()


def test_a_sensor_that_stays_is_one_channel():
    system, found = roved(placements=((0, 1, 2), (0, 3, 4), (0, 5, 6, 7)))
    result = fx.identify([frf for _, frf in found])
    assert [c.node for c in result.outputs] == [f"n{k}" for k in range(8)]
    assert np.diag(fx.mac(result.real_shapes, system.normal_modes()[:, :5])).min() > 0.999


def test_a_roving_hammer_is_the_same_turned_round():
    system = modal(FREQUENCIES, RATIOS, seed=3)
    groups = ((0, 1), (2, 3), (4, 5), (6, 7))
    each = [measured(system, HZ, at, (0, 1), 40, k, setup=str(k)) for k, at in enumerate(groups)]
    result = fx.identify(each)
    assert result.participation.shape == (8, 5) and result.shapes.shape == (2, 5)
    assert result.frequency_hz == pytest.approx(FREQUENCIES, rel=1e-3)
    turned = result.participation * np.exp(-1j * np.angle((result.participation**2).sum(axis=0)) / 2)
    assert np.diag(fx.mac(turned.real, system.normal_modes()[:, :5])).min() > 0.999
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
    assert np.diag(fx.mac(result.real_shapes, shapes[:, :5])).min() > 0.999


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
