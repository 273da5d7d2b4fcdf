"""Bad records are named, and not averaged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import flexura as fx
from flexura.testing.measurement.estimation import estimate_frf
from flexura.testing.measurement.hits import inspect
from helpers.hits import HAMMER, OUTPUTS, RATE, force, hit, receptance

WINDOW = {"exponential": 1e-3}


def kinds(record, **scales):
    return [(d.kind, d.channel) for d in inspect(record, scales)]


def changed(record, row, x):
    samples = record.samples.copy()
    samples[row] = x
    return replace(record, samples=samples)


def clipped(record, row=1, share=0.6):
    top = share * np.abs(record.samples[row]).max()
    return changed(record, row, np.clip(record.samples[row], -top, top))


def twice(record, share=0.3):
    time = np.arange(record.samples.shape[1]) / RATE
    return changed(record, 0, record.samples[0] + share * force(time, at=0.075))


def spoilt(record):
    x = record.samples[2].copy()
    x[100:103] = np.nan
    return changed(record, 2, x)


def early(record):
    time = np.arange(record.samples.shape[1]) / RATE
    peak = np.abs(record.samples[1]).max()
    return changed(record, 1, record.samples[1] + 0.5 * peak * np.cos(2 * np.pi * 12 * time) * np.exp(-time))


def test_a_good_hit_has_no_defects_with_noise_or_without():
    assert kinds(hit()) == []
    assert kinds(hit(noise=(3e-3, 3e-8))) == []
    coarse = hit()
    steps = np.abs(coarse.samples).max(axis=1, keepdims=True) / 2000
    assert kinds(replace(coarse, samples=np.round(coarse.samples / steps) * steps)) == []


@pytest.mark.parametrize(
    ("spoil", "kind", "channel"),
    [
        (clipped, "clipped", "p1.tz"),
        (lambda r: clipped(r, 0, 0.8), "clipped", "hammer"),
        (twice, "double hit", "hammer"),
        (lambda r: twice(r, 0.08), "double hit", "hammer"),
        (spoilt, "not finite", "p2.tz"),
        (early, "not at rest", "p1.tz"),
        (lambda r: changed(r, 2, 0.0), "silent", "p2.tz"),
    ],
)
def test_defects_are_found_and_left_out(spoil, kind, channel):
    bad = replace(spoil(hit()), name="the third")
    assert (kind, channel) in kinds(bad)
    good = [hit(seed=k) for k in range(2)]
    (frf,) = estimate_frf([*good, bad], **WINDOW)
    (reference,) = estimate_frf(good, **WINDOW)
    assert frf.averages == 2
    assert np.array_equal(frf.response, reference.response)
    assert any("left out 1 of 3 records: the third" in note and channel in note for note in frf.notes)
    with pytest.raises(
        fx.OptionError, match=f"none of the 1 records with hammer can be used:\n  the third: .*{channel}"
    ):
        estimate_frf([bad], **WINDOW)


def test_clipping_is_found_in_coarse_data_and_noise():
    rough = clipped(hit(noise=(1e-3, 1e-8)))
    step = np.abs(rough.samples[1]).max() / 500
    assert ("clipped", "p1.tz") in kinds(changed(rough, 1, np.round(rough.samples[1] / step) * step))


def test_overload_is_judged_by_the_full_scale():
    peak = np.abs(hit().samples[1]).max()
    assert kinds(hit(), **{"p1.tz": 1.01 * peak}) == []
    assert kinds(hit(), **{"p1.tz": peak}) == [("overload", "p1.tz")]
    with pytest.raises(fx.OptionError, match=r"p1\.tz: reaches .* its full scale is"):
        estimate_frf([hit()], full_scale={"p1.tz": peak}, **WINDOW)


def test_what_is_accepted_is_used():
    (frf,) = estimate_frf([twice(hit(40.0))], accept=("double hit",))
    # the second pulse is in the force alone
    exact = receptance(2j * np.pi * frf.frequency_hz)
    assert np.max(np.abs(frf.response[:, :, 0] / exact - 1)) > 0.2
    with pytest.raises(fx.OptionError, match="there is no defect 'leak'"):
        estimate_frf([hit()], accept=("leak",))
    with pytest.raises(fx.OptionError, match="not finite cannot be used"):
        estimate_frf([hit()], accept=("not finite",))


def test_too_short_for_the_decay():
    # exp(-0.01 2 pi 12 (2 - 0.05)) = 0.23 at the end
    with pytest.raises(fx.OptionError, match=r"still at 2\d% of its loudest at the end of 2 s: record longer, or give"):
        estimate_frf([hit(2.0)])
    # the last twentieth lies 4.5 to 4.75 s after the loudest: exp(-0.01 2 pi 12 4.5) = 0.034, exp(-... 4.75) = 0.028
    (frf,) = estimate_frf([hit(5.0)])
    assert any("hammer: 3% of the motion is left at the end" in note for note in frf.notes)
    (frf,) = estimate_frf([hit(2.0)], **WINDOW)
    assert not any("is left at the end" in note for note in frf.notes)
    assert frf.decay == pytest.approx(np.log(1e3) / 2)


def test_noise_at_the_end_is_no_leakage():
    (frf,) = estimate_frf([hit(30.0, noise=(0.0, 2e-6), seed=k) for k in range(2)], accept=("incoherent",))
    assert frf.averages == 2


def test_unrelated_signals_are_named():
    rng = np.random.default_rng(2)
    hits = [hit(seed=k, noise=(1e-4, 1e-9)) for k in range(5)]
    one = [changed(h, 2, 1e-5 * rng.normal(size=h.samples.shape[1])) for h in hits]
    (frf,) = estimate_frf(one, **WINDOW, accept=("leakage",))
    assert [c.name for c in frf.outputs] == ["p1.tz"] and frf.response.shape[1] == 1
    assert any("p2.tz left out: not coherent with any input" in note for note in frf.notes)
    both = [changed(h, 1, 1e-5 * rng.normal(size=h.samples.shape[1])) for h in one]
    with pytest.raises(fx.OptionError, match=r"coherence of p1\.tz, p2\.tz with hammer is that of unrelated signals"):
        estimate_frf(both, **WINDOW, accept=("leakage",))
    (frf,) = estimate_frf(both, **WINDOW, accept=("leakage", "incoherent"))
    assert len(frf.outputs) == 2


def test_rates_lengths_and_channels_that_differ():
    a = hit(name="one")
    with pytest.raises(fx.OptionError, match="sampled at 1024 and 2048 Hz"):
        estimate_frf([a, replace(a, sample_rate=1024.0)], **WINDOW)
    with pytest.raises(fx.OptionError, match="have 12288 to 16384 samples: give duration=6"):
        estimate_frf([a, hit(6.0)], **WINDOW)
    (frf,) = estimate_frf([a, hit(6.0)], **WINDOW, duration=6.0)
    assert frf.averages == 2
    less = replace(a, samples=a.samples[:2], channels=a.channels[:2], name="two")
    with pytest.raises(fx.OptionError, match=r"two of setup x has no channel p2\.tz, which other records have"):
        estimate_frf([replace(a, setup="x"), replace(less, setup="x")], **WINDOW)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"estimator": "H3"}, "H1, H2 or Hv"),
        ({"exponential": 1.5}, "exponential is between 0 and 1, not 1.5"),
        ({"exponential": 0.0}, "exponential is between 0 and 1, not 0"),
        ({"force_window": -1.0}, "force_window is a positive time in s"),
        ({"band": (10, 10.01)}, "there are no two lines between 10 and 10.01 Hz; they are 0.125 Hz apart"),
        ({"duration": 100.0}, "up to the 8 s that were recorded"),
        ({"delays": {"p3": 1e-3}}, "there is no channel 'p3'; known: hammer, p1.tz, p2.tz"),
        ({"full_scale": {"p1.tz": -1.0}}, r"full_scale of p1\.tz is a positive number"),
    ],
)
def test_arguments_that_make_no_sense(arguments, message):
    with pytest.raises(fx.OptionError, match=message):
        estimate_frf([hit()], **({} if "exponential" in arguments else WINDOW) | arguments)


def test_what_is_no_record():
    with pytest.raises(fx.OptionError, match="there are no time records"):
        estimate_frf(fx.Measurement("empty"))
    with pytest.raises(fx.OptionError, match="estimated from recordings"):
        estimate_frf([1.0])
    with pytest.raises(fx.OptionError, match="none of its channels is a force: of output-only data"):
        estimate_frf([replace(hit(), inputs=())])
    with pytest.raises(fx.OptionError, match=r"p1\.tz \[m\] is declared the excitation and hammer \[N\] the response"):
        estimate_frf([fx.testing.Recording(RATE, hit().samples[:2], (HAMMER, OUTPUTS[0]), (1,))])
