"""Distributions of sizes against closed forms and numerical moments; tolerances as text; what cannot be meant."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

import flexura as fx
from flexura.errors import OptionError
from flexura.study.tolerances.distributions import Distribution, distribution_of, measured, normal, triangular, uniform
from helpers.over import over
from helpers.shell import GUIDE

SHARES = np.array([1e-9, 1e-4, 0.025, 0.3, 0.5, 0.77, 0.999, 1 - 1e-9])
CLOSED_FORMS = [
    (uniform(2e-4, 5e-4), lambda u: 2e-4 + 3e-4 * u),
    (triangular(-1.0, 0.5, 3.0), lambda u: np.where(u < 1.5 / 4, -1 + np.sqrt(6 * u), 3 - np.sqrt(10 * (1 - u)))),
    (triangular(1.0, 1.0, 2.0), lambda u: 2 - np.sqrt(1 - u)),
    (normal(3.0, 0.2), lambda u: 3 + 0.2 * ndtri(u)),
    (normal(3.0, 0.2, 2.9, 3.4), lambda u: 3 + 0.2 * ndtri(ndtr(-0.5) + (ndtr(2.0) - ndtr(-0.5)) * u)),
    (normal(0.0, 1.0, 2.0, np.inf), lambda u: -ndtri(ndtr(-2.0) * (1 - u))),
]


@pytest.mark.parametrize(("own", "quantile"), CLOSED_FORMS)
def test_quantiles_and_moments_are_those_of_closed_forms(own: Distribution, quantile) -> None:
    np.testing.assert_allclose(own.quantile(SHARES), quantile(SHARES), rtol=1e-9, atol=1e-12)
    points, weights = np.polynomial.legendre.leggauss(400)  # over u = sin^2, which has no ends
    t = np.pi / 4 * (1 + points)
    sizes, weights = quantile(np.sin(t) ** 2), weights * np.pi / 4 * np.sin(2 * t)
    mean = weights @ sizes
    assert own.mean == pytest.approx(mean, rel=1e-6, abs=1e-9)
    assert own.deviation == pytest.approx(np.sqrt(weights @ (sizes - mean) ** 2), rel=1e-5)


def test_measured_sizes_keep_their_mean_and_never_go_beyond() -> None:
    own = measured((3.0, 1.0, 1.5, 7.0))
    shares = (np.arange(400_000) + 0.5) / 400_000
    sizes = own.quantile(shares)
    assert own.mean == pytest.approx(3.125)
    assert sizes.mean() == pytest.approx(3.125, rel=1e-9)
    assert own.deviation == pytest.approx(sizes.std(), rel=1e-6)
    assert (sizes.min(), sizes.max()) == (1.0, 7.0) == (own.low, own.high)


@over(
    ("text", "expected"),
    [
        ("± 0.02 mm", uniform(4.8e-4, 5.2e-4)),
        ("±0.02mm", uniform(4.8e-4, 5.2e-4)),
        ("+-20um", uniform(4.8e-4, 5.2e-4)),
        ("uniform +/- 20 um", uniform(4.8e-4, 5.2e-4)),
        ("± 2 %", uniform(4.9e-4, 5.1e-4)),
        ("+0.01/-0.03 mm", uniform(4.7e-4, 5.1e-4)),
        ("+10um -30um", uniform(4.7e-4, 5.1e-4)),
        ("-0.03/+0 mm", uniform(4.7e-4, 5e-4)),
        ("triangular ± 0.02 mm", triangular(4.8e-4, 5e-4, 5.2e-4)),
        ("normal 5 um", normal(5e-4, 5e-6)),
        ("normal 1 %", normal(5e-4, 5e-6)),
        ("normal ± 15 um", normal(5e-4, 5e-6)),
        ("normal 5 um within 2", normal(5e-4, 5e-6, 4.9e-4, 5.1e-4)),
        ("normal 5 um within 10 um", normal(5e-4, 5e-6, 4.9e-4, 5.1e-4)),
        ("normal 5 um within ± 10 um", normal(5e-4, 5e-6, 4.9e-4, 5.1e-4)),
        ("measured 0.49, 0.5, 0.52 mm", measured((4.9e-4, 5e-4, 5.2e-4))),
    ],
)
def test_tolerances_as_text(text: str, expected: Distribution) -> None:
    found = distribution_of(fx.load(GUIDE), "thickness", text, {"thickness": 5e-4})
    ours, theirs = found.describe(), expected.describe()
    assert ours.keys() == theirs.keys()
    for key, value in theirs.items():
        assert ours[key] == (value if key == "kind" else pytest.approx(value, rel=1e-12))


@over(
    "text",
    [
        "",
        "0.02 mm",
        "± 0.02",
        "± 2 N",
        "± 0 mm",
        "± -1 um",
        "+0.01/+0.01 mm",
        "normal",
        "normal 0 mm",
        "normal -5 um",
        "normal nan mm",
        "normal 5 um within 0",
        "normal 5 um within -1",
        "measured 0.5 mm",
        "measured 0.5, 0.5 mm",
        "measured 0.5, x mm",
        "triangular 3 mm",
        "± x %",
        "± inf %",
        "gauss 1 um",
        "± 0.02 mm ± 0.02 mm",
    ],
)
def test_what_is_no_tolerance_is_named(text: str) -> None:
    with pytest.raises(OptionError, match="thickness"):
        distribution_of(fx.load(GUIDE), "thickness", text, {"thickness": 5e-4})


def test_per_cent_of_zero_are_refused() -> None:
    with pytest.raises(OptionError, match="zero"):
        distribution_of(fx.load(GUIDE), "thickness", "± 2 %", {"thickness": 0.0})


def test_a_normal_distribution_cut_off_far_out_is_refused() -> None:
    with pytest.raises(OptionError, match="nothing of a normal"):
        normal(0.0, 1.0, 30.0, 31.0)
