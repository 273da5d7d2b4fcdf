"""Modes are found again in responses of known systems, with noise of stated size.

Poles and shapes of reference are those of the dense state matrix, responses those of the inverted dynamic stiffness.
Signal-to-noise ratios are of root mean squares over the band, each response by itself.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.testing.identification.residues import fit_modes
from flexura.testing.measurement.response_matrices import response_matrices
from helpers.ema import poles_by_ema
from helpers.modal_systems import channels, measured, modal, noisy, random_modal

HZ = np.arange(0.0, 100.0, 0.125)
BAND = (3.0, 95.0)


def errors(result, system, count=6):
    """Relative errors of frequency and damping of the lowest modes; every one must be there, and no other."""
    assert len(result.poles) == count
    f, z = system.frequency_hz[:count], system.damping_ratio[:count]
    return np.abs(result.frequency_hz / f - 1), np.abs(result.damping_ratio / z - 1)


def in_space(shapes, space):
    """Squared share of every column that lies in a space."""
    q = np.linalg.qr(space)[0]
    return np.linalg.norm(q.conj().T @ shapes, axis=0) ** 2 / np.linalg.norm(shapes, axis=0) ** 2


@pytest.mark.parametrize("power", [0, 1, 2])
def test_without_noise_everything_comes_back(power):
    system = random_modal(1)
    result = fx.identify(measured(system, HZ, power=power), band=BAND)
    f, z = errors(result, system)
    assert f.max() < 1e-7 and z.max() < 1e-6
    assert result.scaling == ("unit modal mass",) * 6
    phi = system.normal_modes()[:, :6]
    assert np.abs(np.abs(result.real_shapes) - np.abs(phi)).max() < 1e-4 * np.abs(phi).max()
    assert result.synthesis_error < 1e-6
    assert result.receptance(HZ[100:400]) == pytest.approx(
        system.response(HZ[100:400], (0, 1), power=0), rel=2e-4, abs=1e-8
    )


@pytest.mark.parametrize("seed", range(6))
def test_at_40_db_frequencies_within_a_thousandth_and_damping_within_five_per_cent(seed):
    system = random_modal(seed)
    f, z = errors(fx.identify(measured(system, HZ, decibels=40, seed=seed), band=BAND), system)
    assert f.max() < 1e-3
    assert z.max() < 0.05


@pytest.mark.parametrize("seed", range(3))
def test_one_input_at_40_db(seed):
    system = random_modal(seed)
    f, z = errors(fx.identify(measured(system, HZ, (0,), decibels=40, seed=seed), band=BAND), system)
    assert f.max() < 1e-3
    assert z.max() < 0.05


@pytest.mark.parametrize("seed", range(3))
def test_modes_half_a_per_cent_apart_are_resolved_by_two_references(seed):
    system = modal([12.0, 40.0, 40.2, 70.0], [0.01, 0.01, 0.008, 0.01], seed=seed)
    result = fx.identify(measured(system, HZ, decibels=40, seed=seed), band=BAND)
    f, z = errors(result, system, 4)
    assert f.max() < 1e-3 and z.max() < 0.05
    assert np.diag(fx.modal.mac(result.real_shapes, system.normal_modes()[:, :4])).min() > 0.99


@pytest.mark.parametrize("decibels", [None, 40])
def test_a_repeated_pair_is_resolved_by_two_references_and_not_by_one(decibels):
    system = modal([12.0, 40.0, 40.0, 70.0], [0.01, 0.01, 0.01, 0.01], seed=2)
    result = fx.identify(measured(system, HZ, decibels=decibels), band=BAND)
    f, z = errors(result, system, 4)
    assert f.max() < 1e-3 and z.max() < 0.05
    pair = result.real_shapes[:, 1:3]
    assert in_space(pair, system.normal_modes()[:, 1:3]).min() > 0.999
    assert min(e.modal_phase_collinearity for e in result.evidence) > 0.99
    # unit modal mass: with any rotation of the pair, the sum of outer products is that of the true shapes
    true = system.normal_modes()[:, 1:3]
    assert pair @ pair.T == pytest.approx(true @ true.T, abs=0.02 * np.abs(true @ true.T).max())
    assert len(fx.identify(measured(system, HZ, (0,), decibels=decibels), band=BAND).poles) == 3


def test_stated_standard_deviations_are_those_of_repeated_tests():
    system = modal([20.0, 33.0, 60.0], [0.01, 0.006, 0.012], seed=4)
    found = [fx.identify(measured(system, HZ, decibels=30, seed=k), band=(8, 90), order=20) for k in range(24)]
    for name, true in (("frequency", system.frequency_hz[:3]), ("damping", system.damping_ratio[:3])):
        value = {"frequency": "frequency_hz", "damping": "damping_ratio"}[name]
        sigma = np.array([[getattr(e, f"{name}_sigma") for e in r.evidence] for r in found])
        off = np.array([getattr(r, value) / true - 1 for r in found]) / sigma
        assert 0.83 < np.sqrt(np.mean(off**2)) < 1.17  # of 72 numbers: 1 within 0.17 at two standard deviations
        assert np.abs(np.mean(off)) < 0.24


def test_refining_takes_out_the_bias_of_damping():
    system = random_modal(2)
    rough, fine = (fx.identify(measured(system, HZ, decibels=25), band=BAND, refine=r) for r in (False, True))
    assert errors(fine, system)[1].max() < 0.3 * errors(rough, system)[1].max()
    assert fine.synthesis_error < rough.synthesis_error


def test_damping_of_an_exponential_window_is_taken_out():
    system = random_modal(3)
    windowed = measured(system, HZ, decibels=40, decay=4.0)
    f, z = errors(fx.identify(windowed, band=BAND), system)
    assert f.max() < 1e-3 and z.max() < 0.05
    kept = fx.identify(replace(windowed, decay=0.0), band=BAND)
    assert kept.poles.real == pytest.approx(system.poles.real[:6] - 4.0, rel=0.1)


def test_windowed_free_decay_in_time():
    rate, N, d = 2048.0, 8192, 2.5
    t = np.arange(N) / rate
    poles = np.array([-0.6 + 2j * np.pi * 31.0, -0.9 + 2j * np.pi * 55.0])
    gain = np.array([[1.0, 0.7], [0.4, -1.2]]) / (2j * poles.imag)
    h = 2 * (gain @ np.exp(poles[:, None] * t)).real * np.exp(-d * t)
    h[:, 0] /= 2
    hz = np.fft.rfftfreq(N, 1 / rate)
    H = (np.fft.rfft(h) / rate).T[:, :, None]
    frf = fx.testing.MeasuredFRF(hz, H, channels((9,), "hit", "force"), channels((0, 1), "x", "displacement"), decay=d)
    result = fx.identify(frf, band=(20, 70))
    assert result.poles == pytest.approx(poles, rel=1e-5)
    assert result.damping_ratio == pytest.approx(-poles.real / np.abs(poles), rel=1e-3)


def test_complex_modes_of_a_dashpot():
    system = modal([12.0, 15.0, 24.0, 40.0], [0.01] * 4, outputs=4, seed=6)
    C = system.C.copy()
    C[3, 3] += 0.3 * np.abs(system.M[3, 3]) * 2 * np.pi * 10
    damped = type(system)(system.M, C, system.K)
    result = fx.identify(measured(damped, np.arange(0, 80, 0.125)), most_damped=0.5)
    assert result.poles == pytest.approx(damped.poles, rel=1e-6)
    true = damped.shapes
    mpc = np.abs((true**2).sum(axis=0)) ** 2 / (np.abs(true) ** 2).sum(axis=0) ** 2
    assert min(mpc) < 0.9
    assert [e.modal_phase_collinearity for e in result.evidence] == pytest.approx(mpc, abs=1e-4)
    likeness = np.abs((true.conj() * result.shapes).sum(axis=0)) / np.linalg.norm(true, axis=0)
    assert likeness / np.linalg.norm(result.shapes, axis=0) == pytest.approx(1, abs=1e-6)


def test_more_inputs_than_outputs_is_the_same_turned_round():
    system = random_modal(2)
    frf = measured(system, HZ, decibels=40)
    out, into = channels((0, 1), "acc", "acceleration"), channels(range(8), "hit", "force")
    turned = fx.identify(replace(frf, response=frf.response.transpose(0, 2, 1), inputs=into, outputs=out), band=BAND)
    straight = fx.identify(frf, band=BAND)
    assert turned.poles == pytest.approx(straight.poles, rel=1e-9)
    assert turned.shapes.shape == (2, 6) and turned.participation.shape == (8, 6)
    assert np.diag(fx.modal.mac(turned.participation, straight.shapes)) == pytest.approx(1, abs=1e-9)


def test_units_signs_and_order_of_channels_change_nothing():
    system = random_modal(7)
    frf = measured(system, HZ, decibels=40)
    result = fx.identify(frf, band=BAND)
    at, sizes = np.arange(8)[::-1], 10.0 ** np.arange(-4, 4) * (-1) ** np.arange(8)
    other = replace(frf, response=(frf.response * sizes[:, None])[:, at], outputs=tuple(frf.outputs[k] for k in at))
    again = fx.identify(other, band=BAND)
    assert again.poles == pytest.approx(result.poles, rel=1e-7)
    assert again.shapes[::-1] / sizes[:, None] / result.shapes == pytest.approx(
        np.ones((8, 1)) * (again.shapes[-1] / sizes[0] / result.shapes[0]), rel=1e-5
    )


def test_displacements_beside_accelerations():
    system = random_modal(8)
    acceleration, displacement = (
        measured(system, HZ, outputs=range(4)),
        measured(system, HZ, outputs=range(4, 8), power=0),
    )
    result = fx.identify([acceleration, displacement], band=BAND)
    assert errors(result, system)[0].max() < 1e-6
    assert np.diag(fx.modal.mac(result.real_shapes, system.normal_modes()[:, :6])).min() > 1 - 1e-6
    assert any("differentiated" in note for note in result.notes)


def test_a_user_overrules_the_choice():
    system = random_modal(1)
    frf = measured(system, HZ, decibels=40)
    f = system.frequency_hz
    result = fx.identify(frf, band=BAND, select=[1.01 * f[2], 0.995 * f[4]])
    assert result.frequency_hz == pytest.approx(f[[2, 4]], rel=1e-3)
    assert np.diag(fx.modal.mac(result.real_shapes, system.normal_modes()[:, [2, 4]])).min() > 0.999
    assert any("not picked" in note for note in result.notes)
    with pytest.raises(fx.OptionError, match="no pole near 96"):
        fx.identify(frf, band=BAND, select=[96.9])
    with pytest.raises(fx.OptionError, match="positive numbers"):
        fx.identify(frf, band=BAND, select=[-3.0])


def test_what_is_not_sure_is_left_out_and_named_and_can_be_picked():
    system = random_modal(1)
    frf = measured(system, HZ, decibels=40)
    every = fx.identify(frf, band=BAND, least_confidence=0.0)
    least = int(np.argmin(every.confidence))
    assert every.notes == () and len(every.poles) == 6
    sure = fx.identify(frf, band=BAND, least_confidence=every.confidence[least] + 1e-9)
    assert sure.poles == pytest.approx(np.delete(every.poles, least), rel=1e-12)
    assert np.abs(sure.shapes) == pytest.approx(np.abs(np.delete(every.shapes, least, axis=1)), rel=1e-9)
    (note,) = sure.notes
    assert "left out for want of confidence" in note and f"{every.frequency_hz[least]:.5g} Hz" in note
    assert "can be picked" in note
    picked = fx.identify(frf, band=BAND, select=[system.frequency_hz[least]], least_confidence=0.999999)
    assert picked.frequency_hz == pytest.approx([system.frequency_hz[least]], rel=1e-3)
    with pytest.raises(fx.OptionError, match=r"no mode is stable.*left out for want of confidence: .* Hz"):
        fx.identify(frf, band=BAND, least_confidence=0.9999999)


def test_a_fit_is_as_good_as_one_with_all_lines_written_out():
    """Misfit and gradient of the fit against least squares of the responses themselves, no basis of lines."""
    system = modal([20.0, 33.0], [0.01, 0.006], outputs=3, seed=4)
    matrix = response_matrices([measured(system, HZ, decibels=30)], BAND)[0]
    ell = np.linalg.inv(system.normal_modes()).T[:2, :2].T + 0j
    fit = fit_modes(matrix, 1.001 * system.poles[:2], ell)

    def misfit(poles, participation):
        left = 0.0
        s, root = matrix.s, np.sqrt(matrix.weight)
        for row in matrix.scaled.transpose(1, 0, 2):
            columns = []
            for pole, turn in zip(poles, participation.T, strict=True):
                a = np.outer(s**2 / (s - pole), turn)
                b = np.outer(s**2 / (s - np.conj(pole)), turn.conj())
                columns += [a + b, 1j * (a - b)]
            columns += [np.outer(c, e) for c in (s**2, np.ones(len(s))) for e in np.eye(2)]
            x = np.array([(root[:, None] * c).ravel() for c in columns]).T
            y = (root[:, None] * row).ravel()
            x, y = np.concatenate([x.real, x.imag]), np.concatenate([y.real, y.imag])
            size = np.linalg.norm(x, axis=0)
            left += np.linalg.norm(y - x @ (np.linalg.lstsq(x / size, y)[0] / size)) ** 2
        return left

    least = misfit(fit.poles, fit.participation)
    assert fit.error**2 * np.linalg.norm(matrix.scaled) ** 2 == pytest.approx(least, rel=0.02)  # ends weigh half
    for k in range(2):
        for part, sigma in zip((1.0, 1j), fit.pole_sigma[k], strict=True):
            step = np.eye(2)[k] * part * sigma
            up, down = (misfit(fit.poles + sign * step, fit.participation) for sign in (1, -1))
            assert up > least and down > least
            assert abs(up - down) < 0.02 * (up + down - 2 * least)


def test_a_hidden_neighbour_is_noted_and_found_when_it_is_picked():
    system = modal([12.0, 31.0, 40.0, 40.2, 70.0], [0.01, 0.02, 0.01, 0.008, 0.005], seed=3)
    frf = measured(system, HZ, decibels=25)
    first = fx.identify(frf, band=BAND)
    assert len(first.poles) == 4
    (note,) = first.notes
    assert "peaks at 40" in note and "a mode may be missing" in note
    result = fx.identify(frf, band=BAND, select=[12, 31, 40, 40, 70])
    f, z = errors(result, system, 5)
    assert f.max() < 1e-3 and z.max() < 0.05
    assert not result.notes


def test_a_computed_response_is_data():
    mechanism = fx.Mechanism(
        nodes={"root": (0, 0, 0), "tip": (0.1, 0, 0)},
        links={
            "bar": fx.describe.Link(
                nodes=("root", "tip"),
                material="Al-7075-T6",
                section=fx.describe.Rectangle(width=8e-3, thickness=2e-3),
                reference=(0, 0, 1),
                elements=8,
            )
        },
        ground={"root": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
    )
    ends = ["tip.tz", "tip.ty"]
    H = fx.frequency_response(
        mechanism, frequency_hz=np.arange(5, 1200, 1.0), inputs=ends, outputs=ends, order="full", damping=0.02
    )
    result = fx.identify(H)
    # bending modes from 2.9 kHz on are a constant to the fit, (1.2 / 2.9)^2 of which is missing at the end of the band
    assert result.frequency_hz == pytest.approx(fx.modes(mechanism, n=3, order="full").frequency_hz, rel=2e-5)
    assert result.damping_ratio == pytest.approx([0.02] * 3, rel=1e-3)
    assert result.scaling == ("unit modal mass",) * 3


def test_sdypy_ema_agrees():
    system = random_modal(2)
    frf = measured(system, HZ, (0,), decibels=60)
    result = fx.identify(frf, band=BAND)
    other = poles_by_ema(frf, BAND, 40)
    last = other.order == other.order.max()
    for f, z in zip(result.frequency_hz, result.damping_ratio, strict=True):
        k = np.flatnonzero(last)[np.argmin(np.abs(other.frequency_hz[last] - f))]
        assert other.frequency_hz[k] == pytest.approx(f, rel=1e-4)
        assert other.damping_ratio[k] == pytest.approx(z, rel=0.02)


def test_stabilisation_diagram_tells_modes_from_noise():
    system = random_modal(1)
    (poles,) = fx.identify(measured(system, HZ, decibels=40), band=BAND).diagram
    near = (np.abs(poles.frequency_hz[:, None] / system.frequency_hz[:6] - 1) < 2e-3).any(axis=1)
    late = poles.order > 20
    stable = poles.stable == 7
    assert stable[near & late].mean() > 0.9
    assert late.sum() > 150 and (near & late).sum() > 0.9 * late.sum()  # poles of noise are unstable, hence not there
    assert set(np.unique(poles.stable)) <= set(range(8))


def bad(change):
    """A measurement made worse."""
    return change(measured(random_modal(1), HZ))


def replaced(frf, at, value):
    H = frf.response.copy()
    H[at] = value
    return replace(frf, response=H)


INVALID = {
    "not finite at 10 Hz": lambda frf: replaced(frf, (80, 2, 1), np.nan),
    "acc3 has no signal": lambda frf: replaced(frf, (slice(None), 3), 0),
    "hit1 has no signal": lambda frf: replaced(frf, (slice(None), slice(None), 1), 0),
    "coherence is near zero": lambda frf: replace(frf, coherence=np.full(frf.response.shape, 0.1)),
    "not finite and ascending": lambda frf: replace(frf, frequency_hz=frf.frequency_hz[::-1]),
    "acc5 / hit1 is missing": lambda frf: [
        replace(frf, response=frf.response[:, :, :1], inputs=frf.inputs[:1]),
        replace(frf, response=frf.response[:, :5, 1:], inputs=frf.inputs[1:], outputs=frf.outputs[:5]),
    ],
    "acc0 / hit0 is given 2 times": lambda frf: [frf, frf],
    "different lines": lambda frf: [frf, replace(frf, frequency_hz=frf.frequency_hz * 1.1)],
    "exponential windows differ": lambda frf: [frf, replace(frf, decay=1.0)],
    "there is no frequency response": lambda frf: [],
}


@pytest.mark.parametrize("message", INVALID)
def test_bad_data_are_named_not_fitted(message):
    with pytest.raises(fx.OptionError, match=message):
        fx.identify(bad(INVALID[message]))


OPTIONS = {
    "0 <= from < to": {"band": (50, 20)},
    "spectral lines lie in the band": {"band": (10, 11)},
    "order is between": {"order": 1},
    "setups is each or together": {"setups": "all"},
    "damping ratio between 0 and 1": {"most_damped": 2.0},
    "least_confidence is at least 0": {"least_confidence": 1.0},
}


@pytest.mark.parametrize("message", OPTIONS)
def test_impossible_options(message):
    with pytest.raises(fx.OptionError, match=message):
        fx.identify(measured(random_modal(1), HZ), **OPTIONS[message])


def test_noise_alone_has_no_modes():
    frf = measured(random_modal(1), HZ)
    alone = noisy(np.ones_like(frf.response), -60) - 1
    with pytest.raises(fx.OptionError, match="no mode is stable"):
        fx.identify(replace(frf, response=alone), band=BAND)


PEAK = [
    *(-0.0514 - 0.2672j, -0.0384 - 0.2392j, 0.0905 - 0.328j, 1.849 - 0.187j, -0.628 + 2.465j, 0.257 + 1.888j),
    *(-0.071 + 0.944j, 0.466 + 1.195j, 0.012 + 0.512j),
]
"""Nine lines about 192.5 Hz, 0.3125 Hz apart, of a beam so lightly damped that its records end before it has decayed:
two peaks, and phases that turn the wrong way."""


@pytest.mark.parametrize("options", [{}, {"select": [192.5]}, {"band": (150.0, 250.0)}])
def test_a_peak_that_stands_alone_is_a_mode_with_doubtful_damping(options):
    hz = 0.3125 * np.arange(1601)
    frf = measured(modal([20.0], [0.01], outputs=1), hz, (0,), (0,))
    rng = np.random.default_rng(3)
    response = 2e-3 * rng.standard_normal((len(hz), 1, 1)) * np.exp(2j * np.pi * rng.random((len(hz), 1, 1)))
    response[612:621, 0, 0] += PEAK
    found = fx.identify(replace(frf, response=response), **options)
    assert found.frequency_hz == pytest.approx([192.5], abs=0.3125)
    (own,) = found.evidence
    assert own.confidence < 0.1 and own.damping_spread >= 1
    assert found.damping_ratio[0] == pytest.approx(3 * 0.3125 / 192.5 / 2, rel=0.01)
    assert "is that of a peak alone" in found.notes[0] and "record longer" in found.notes[0]
    with pytest.raises(fx.OptionError, match="no pole near 100 Hz"):
        fx.identify(replace(frf, response=response), select=[100.0])


def test_a_channel_without_coherence_is_left_out_and_named():
    frf = measured(random_modal(1), HZ, decibels=40)
    coherence = np.ones(frf.response.shape)
    coherence[:, 6] = 0.05
    result = fx.identify(replace(frf, coherence=coherence), band=BAND)
    assert len(result.outputs) == 7 and result.shapes.shape == (7, 6)
    assert "acc6 is left out: coherence near zero" in result.notes


def test_plain_data():
    data = fx.identify(measured(random_modal(1), HZ, decibels=40), band=BAND).to_dict()
    assert np.shape(data["shapes_real"]) == (8, 6)
    assert data["outputs"][2]["node"] == "n2" and data["evidence"][0]["confidence"] > 0.9


@pytest.mark.parametrize("spacing", [4.0, 8.0, 10.0, 20.0])
def test_both_modes_of_a_repeated_frequency_are_found(spacing):
    """Also where the orders of the stabilisation diagram show them once, for a mirror on three legs."""
    mirror = fx.load(Path(__file__).parents[2] / "examples" / "tip_tilt" / "tip_tilt.yaml")
    hits = ["leg1.ball.ty", "leg1.ball.tz", "leg2.ball.tx", "leg2.ball.tz"]
    sensors = [f"leg{k}.ball.t{axis}" for k in (1, 2, 3) for axis in "xyz"]
    hz = np.arange(800.0, 11000.0, spacing)
    H = fx.frequency_response(
        mirror, frequency_hz=hz, inputs=hits, outputs=sensors, quantity="accelerance", damping=0.01
    )
    found = fx.identify(H).frequency_hz
    own = fx.modes(mirror, n=8, order="full").frequency_hz
    np.testing.assert_allclose(found, own[own < 11000.0][: len(found)], rtol=3e-4)
    assert len(found) == 6
