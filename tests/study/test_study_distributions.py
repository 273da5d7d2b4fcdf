"""Distributions of sizes against SciPy's and numerical moments; tolerances as text; what cannot be meant."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats as st

import flexura as fx
from flexura.errors import OptionError
from flexura.study.tolerances.distributions import Measured, Normal, Triangular, Uniform, distribution_of
from helpers.shell import GUIDE

SHARES = np.array([1e-9, 1e-4, 0.025, 0.3, 0.5, 0.77, 0.999, 1 - 1e-9])
PAIRS = [
    (Uniform(2e-4, 5e-4), st.uniform(2e-4, 3e-4)),
    (Triangular(-1.0, 0.5, 3.0), st.triang(1.5 / 4, -1.0, 4.0)),
    (Triangular(1.0, 1.0, 2.0), st.triang(0.0, 1.0, 1.0)),
    (Normal(3.0, 0.2), st.norm(3.0, 0.2)),
    (Normal(3.0, 0.2, 2.9, 3.4), st.truncnorm(-0.5, 2.0, 3.0, 0.2)),
    (Normal(0.0, 1.0, 2.0, np.inf), st.truncnorm(2.0, np.inf)),
]


@pytest.mark.parametrize(("own", "theirs"), PAIRS)
def test_quantiles_and_moments_are_those_of_scipy(own: Normal, theirs: st.rv_continuous) -> None:
    np.testing.assert_allclose(own.quantile(SHARES), theirs.ppf(SHARES), rtol=1e-9, atol=1e-12)
    assert own.mean == pytest.approx(theirs.mean(), rel=1e-9, abs=1e-12)
    assert own.deviation == pytest.approx(theirs.std(), rel=1e-9)


def test_measured_sizes_keep_their_mean_and_never_go_beyond() -> None:
    own = Measured((3.0, 1.0, 1.5, 7.0))
    shares = (np.arange(400_000) + 0.5) / 400_000
    sizes = own.quantile(shares)
    assert own.mean == pytest.approx(3.125)
    assert sizes.mean() == pytest.approx(3.125, rel=1e-9)
    assert own.deviation == pytest.approx(sizes.std(), rel=1e-6)
    assert (sizes.min(), sizes.max()) == (1.0, 7.0) == (own.low, own.high)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("± 0.02 mm", Uniform(4.8e-4, 5.2e-4)),
        ("±0.02mm", Uniform(4.8e-4, 5.2e-4)),
        ("+-20um", Uniform(4.8e-4, 5.2e-4)),
        ("uniform +/- 20 um", Uniform(4.8e-4, 5.2e-4)),
        ("± 2 %", Uniform(4.9e-4, 5.1e-4)),
        ("+0.01/-0.03 mm", Uniform(4.7e-4, 5.1e-4)),
        ("+10um -30um", Uniform(4.7e-4, 5.1e-4)),
        ("-0.03/+0 mm", Uniform(4.7e-4, 5e-4)),
        ("triangular ± 0.02 mm", Triangular(4.8e-4, 5e-4, 5.2e-4)),
        ("normal 5 um", Normal(5e-4, 5e-6)),
        ("normal 1 %", Normal(5e-4, 5e-6)),
        ("normal ± 15 um", Normal(5e-4, 5e-6)),
        ("normal 5 um within 2", Normal(5e-4, 5e-6, 4.9e-4, 5.1e-4)),
        ("normal 5 um within 10 um", Normal(5e-4, 5e-6, 4.9e-4, 5.1e-4)),
        ("normal 5 um within ± 10 um", Normal(5e-4, 5e-6, 4.9e-4, 5.1e-4)),
        ("measured 0.49, 0.5, 0.52 mm", Measured((4.9e-4, 5e-4, 5.2e-4))),
    ],
)
def test_tolerances_as_text(text: str, expected: Uniform) -> None:
    found = distribution_of(fx.load(GUIDE), "thickness", text, {"thickness": 5e-4})
    assert type(found) is type(expected)
    ours, theirs = found.describe(), expected.describe()
    assert ours.keys() == theirs.keys()
    for key, value in theirs.items():
        assert ours[key] == (value if key == "kind" else pytest.approx(value, rel=1e-12))


@pytest.mark.parametrize(
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
        Normal(0.0, 1.0, 30.0, 31.0)
