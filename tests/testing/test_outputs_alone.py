"""Modes are found again in records of outputs alone, of systems of known poles under white noise.

Modal states are driven by white noise from sample to sample, so that the sampled outputs have exactly the poles of
reference. Standard deviations are held against the errors of many records, and against the uncertainty law of Au
(2014), Mechanical Systems and Signal Processing 48: (sigma of a pole)^2 = decay rate / duration.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.testing.identification.subspaces import Subspaces
from flexura.testing.measurement import Correlations, half_spectra

RATE, SAMPLES = 100.0, 30000
HZ, RATIO = np.array([6.0, 11.0, 11.6, 22.0]), np.array([0.01, 0.02, 0.01, 0.005])
POLES = 2 * np.pi * HZ * (-RATIO + 1j * np.sqrt(1 - RATIO**2))
SHAPES = np.random.default_rng(4).standard_normal((5, 4))


def channels(count=5, quantity="acceleration"):
    return tuple(fx.testing.MeasuredChannel(f"a{k}", quantity, f"n{k}", (0.0, 0.0, 1.0)) for k in range(count))


def record(seed, samples=SAMPLES, noise=0.05, shapes=SHAPES, power=2):
    """Outputs that read displacements, or their derivatives, of modes under white noise of random direction."""
    rng = np.random.default_rng(seed)
    force = np.random.default_rng(8).standard_normal((4, 4)) @ rng.standard_normal((4, samples + 2000))
    states = np.array([lfilter([0, 1], [1, -np.exp(s / RATE)], f + 0j) for s, f in zip(POLES, force, strict=True)])
    moved = (POLES[:, None] ** power * states / (2j * POLES.imag[:, None])).real[:, 2000:]
    y = shapes @ (moved / moved.std(axis=1, keepdims=True))
    return y + noise * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)


def measured(y, setup="", which=None, quantity="acceleration"):
    named = channels(len(y), quantity) if which is None else tuple(channels()[k] for k in which)
    return fx.testing.Recording(RATE, y, named, (), setup)


def identified(*records, **options):
    return fx.identify(fx.Measurement("ambient", records), **options)


def exact():
    """Correlations of the modes in closed form: R_k = sum of shape participation^T exp(s k T), real part."""
    g = np.random.default_rng(1).standard_normal((5, 4)) + 1j * np.random.default_rng(2).standard_normal((5, 4))
    lags = np.exp(np.arange(401)[:, None] / RATE * POLES)
    R = np.einsum("kr,pr,mr->kpm", lags, SHAPES, g).real
    hz = np.linspace(0, RATE / 2, 9)
    return Correlations(
        *("", 1 / RATE, np.array([R, R]), channels(), np.arange(5), (2.0, 40.0), 300.0, np.ones((4, 9, 5), complex), hz)
    )


def test_exact_correlations_give_exact_poles():
    C = exact()
    matrix = half_spectra(C)
    orders = Subspaces.of(C, matrix).orders(None, 0.2)
    by_subspaces = orders[len(POLES) - 1]
    assert by_subspaces.poles == pytest.approx(POLES, rel=1e-8)
    assert np.diag(fx.modal.mac(by_subspaces.shapes * matrix.row_scale[:, None], SHAPES)).min() > 1 - 1e-9
    from flexura.testing.identification.residues import fit_modes

    fit = fit_modes(matrix, by_subspaces.poles * (1.001 - 0.0005j), by_subspaces.participation)
    assert fit.poles == pytest.approx(POLES, rel=1e-7)
    assert fit.error < 1e-6


def test_of_a_continuous_system_half_spectra_would_be_biased():
    """Samples are not the continuous system: without their step the fit of the same data is off."""
    from flexura.testing.identification.residues import fit_modes

    C = exact()
    matrix = half_spectra(C)
    start = Subspaces.of(C, matrix).orders(8, 0.2)[3]
    fit = fit_modes(replace(matrix, step=0.0), start.poles, start.participation)
    assert np.abs(fit.poles / POLES - 1).max() > 1e-4


@pytest.mark.parametrize(
    "options, seeds, missed, false", [({}, 8, 0, 0), ({"refine": False}, 4, 1, 0), ({"method": "plscf"}, 4, 1, 1)]
)
def test_errors_are_as_large_as_their_standard_deviations(options, seeds, missed, false):
    off, surplus = [], 0
    for seed in range(seeds):
        modes = identified(measured(record(seed)), **options)
        assert modes.output_only
        nearest = np.argmin(np.abs(modes.frequency_hz - HZ[:, None]), axis=0)
        for j, (k, e) in enumerate(zip(nearest, modes.evidence, strict=True)):
            if abs(modes.frequency_hz[j] / HZ[k] - 1) > 0.02:
                surplus += 1
                continue
            assert fx.modal.mac(modes.shapes[:, [j]], SHAPES[:, [k]]).item() > 0.98
            off.append((modes.frequency_hz[j] / HZ[k] - 1) / e.frequency_sigma)
            off.append((modes.damping_ratio[j] / RATIO[k] - 1) / e.damping_sigma)
            law = np.sqrt(-POLES[k].real * RATE / SAMPLES)
            assert 0.6 * law < e.frequency_sigma * abs(POLES[k]) < 5 * law
    off = np.array(off)
    assert len(off) >= 2 * (4 * seeds - missed) and surplus <= false
    assert 0.8 < np.sqrt(np.mean(off**2)) < 1.25
    assert abs(off.mean()) < 3 / np.sqrt(len(off))
    assert np.mean(np.abs(off) < 1.96) > 0.88


def test_longer_records_know_more():
    short, long = (identified(measured(record(3, samples))) for samples in (12000, 120000))
    gained = [a.damping_sigma / b.damping_sigma for a, b in zip(short.evidence[-2:], long.evidence[-2:], strict=True)]
    assert np.sqrt(np.prod(gained)) == pytest.approx(np.sqrt(10), rel=0.4)


def test_shapes_are_displacements_whatever_sensors_read():
    still = identified(measured(record(5, power=0), quantity="displacement"))
    shaken = identified(measured(record(5)))
    assert np.diag(fx.modal.mac(still.shapes, shaken.shapes)).min() > 0.98
    mixed = record(5)
    mixed[:2] = record(5, power=0)[:2]
    both = fx.testing.Recording(RATE, mixed, (*channels(quantity="displacement")[:2], *channels()[2:]), ())
    ratio = np.abs(POLES) ** 2 / np.abs(POLES**2)
    assert ratio == pytest.approx(np.ones(4))
    assert np.abs(identified(both).shapes).max(axis=0) == pytest.approx(np.ones(4))


def test_a_tone_is_named_and_is_no_mode():
    y = record(1)
    tone = y.std(axis=1, keepdims=True) * np.sin(2 * np.pi * 16.37 * np.arange(SAMPLES) / RATE + np.arange(5)[:, None])
    modes = identified(measured(y + tone))
    assert modes.frequency_hz == pytest.approx(HZ, rel=0.005)
    assert any("tones of constant amplitude" in note and "16.37 Hz" in note for note in modes.notes)
    assert not any("tones" in note for note in identified(measured(y)).notes)


def test_a_tone_upon_a_mode_leaves_its_damping():
    y, time = record(2), np.arange(SAMPLES) / RATE
    modes = identified(measured(y + y.std(axis=1, keepdims=True) * np.sin(2 * np.pi * 22.02 * time)))
    evidence = modes.evidence[3]
    assert modes.damping_ratio[3] == pytest.approx(RATIO[3], rel=4 * evidence.damping_sigma)


def test_a_tone_that_wanders_is_named():
    """One whose frequency moves cannot be taken out as a sine."""
    time = np.arange(SAMPLES) / RATE
    phase = 2 * np.pi * np.cumsum(16.4 + 0.05 * np.sin(2 * np.pi * time / 41)) / RATE
    y = record(1)
    modes = identified(measured(y + 2 * y.std(axis=1, keepdims=True) * np.sin(phase + np.arange(5)[:, None])))
    assert any("a tone near 16.3" in note and "wanders" in note for note in modes.notes)


def test_setups_are_merged_by_the_outputs_that_they_share():
    setups = measured(record(1)[:4], "one", range(4)), measured(3 * record(2)[[0, 1, 4]], "two", (0, 1, 4))
    modes = identified(*setups)
    assert modes.output_only and modes.inputs == () and modes.participation.shape == (0, 4)
    assert [c.name for c in modes.outputs] == [f"a{k}" for k in range(5)]
    assert np.diag(fx.modal.mac(modes.shapes, SHAPES)).min() > 0.98
    with pytest.raises(fx.OptionError, match="share no output"):
        identified(measured(record(1)[:2], "one", (0, 1)), measured(record(2)[2:], "two", (2, 3, 4)))


def test_two_records_of_one_setup_are_one_test():
    y = record(6)
    parts = identified(measured(y[:, :14000]), measured(y[:, 14000:]))
    assert parts.frequency_hz == pytest.approx(HZ, rel=0.005)
    with pytest.raises(fx.OptionError, match="different channels"):
        identified(measured(y), measured(y[:3]))
    with pytest.raises(fx.OptionError, match="100 and 50 Hz"):
        identified(measured(y), replace(measured(y), sample_rate=50.0))


def test_channels_that_are_bad_are_left_out_and_named():
    y = np.vstack([record(1), np.zeros(SAMPLES), np.full(SAMPLES, np.nan), record(1)[0]])
    y[6, :9] = 1.0
    force = replace(channels(1)[0], name="shaker", quantity="force")
    data = fx.testing.Recording(RATE, np.vstack([y, y[0]]), (*channels(8), force), ())
    modes = identified(data)
    assert modes.frequency_hz == pytest.approx(HZ, rel=0.005)
    assert [c.name for c in modes.outputs] == ["a0", "a1", "a2", "a3", "a4", "a7"]
    for name, why in (("a5", "is it connected"), ("a6", "not finite"), ("shaker", "a force is no output")):
        assert any(f"{name} is left out" in note and why in note for note in modes.notes)
    with pytest.raises(fx.OptionError, match="no channel is an output that can be used"):
        identified(measured(np.zeros((2, SAMPLES))))


def test_many_channels_have_six_references():
    shapes = np.random.default_rng(2).standard_normal((12, 4))
    modes = identified(measured(record(1, shapes=shapes)))
    assert len(modes.inputs) == 6 and len(modes.outputs) == 12
    assert modes.frequency_hz == pytest.approx(HZ, rel=0.005)


def test_drift_is_filtered_out_and_named():
    y = record(1)
    walk = np.cumsum(np.random.default_rng(3).standard_normal(y.shape), axis=1)
    modes = identified(measured(y + 5 * walk / walk.std(axis=1, keepdims=True)))
    assert modes.frequency_hz == pytest.approx(HZ, rel=0.005)
    assert any("is drift below" in note for note in modes.notes)


def test_a_band_thins_the_samples():
    modes = identified(measured(record(1, 60000)), band=(3.0, 16.0))
    assert modes.frequency_hz == pytest.approx(HZ[:3], rel=0.005)
    for band, why in (((5.0, 4.0), "a band is"), ((60.0, 70.0), "a band is")):
        with pytest.raises(fx.OptionError, match=why):
            identified(measured(record(1)), band=band)


def test_what_is_refused_and_what_cannot_be_known():
    with pytest.raises(fx.OptionError, match="are too short"):
        identified(measured(record(1, 1000)))
    with pytest.raises(fx.OptionError, match="no mode is stable"):
        identified(measured(np.random.default_rng(0).standard_normal((3, 8000))))
    with pytest.raises(fx.OptionError, match="method is plscf or ssi, not 'era'"):
        identified(measured(record(1)), method="era")
    with pytest.raises(fx.OptionError, match="up to order"):
        identified(measured(record(1)), order=500)
    frf = fx.testing.MeasuredFRF(np.arange(1.0, 99), np.ones((98, 1, 1), complex), channels(1, "force"), channels(1))
    with pytest.raises(fx.OptionError, match="ssi takes records of outputs alone"):
        fx.identify(frf, method="ssi")
    modes = identified(measured(record(1)))
    assert set(modes.scaling) == {"not scaled"}
    assert "alone" in str(modes._title()) and any("modal masses not known" in note for note in modes.notes)
    with pytest.raises(fx.OptionError, match="no receptance"):
        modes.receptance([6.0])


def test_from_the_shell_with_pictures(tmp_path):
    data = tmp_path / "ambient.npz"
    fx.write_measurement(fx.Measurement("ambient", (measured(record(1, 12000)[:3]),)), data)
    assert fx.read_measurement(data).recordings[0].inputs == ()
    pictures = tmp_path / "pictures"
    done = CliRunner().invoke(app, ["identify", str(data), "--plot", str(pictures), "--method", "plscf"])
    assert done.exit_code == 0, done.output
    assert "modal masses not known" in " ".join(done.output.split())
    assert {f.name for f in pictures.iterdir()} == {"stabilisation.png", "synthesis.png"}
