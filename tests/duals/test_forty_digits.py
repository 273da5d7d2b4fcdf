"""Derivatives of frequencies against differences at 40 digits of the same formulas, for every parameter."""

from pathlib import Path

import mpmath
import numpy as np
import pytest

import flexura as fx
from flexura.sensitivity import free_names, frequency_slopes
from flexura.sensitivity.eigenpairs import whole_clusters
from flexura.sensitivity.variation import FullOrderFamily
from helpers.forty_digits import Precise

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = ["guide/guide", "pivot/pivot"]
SLOW = ["amplifier/amplifier", "rpr/start_corrected", "tip_tilt/tip_tilt", "xy_stage/xy_stage"]


def differences(plan, name, X):
    """X' K' X and X' M' X (k, k) for fixed vectors (n, k), by central differences with a step of 1e-12."""
    with mpmath.workdps(40), np.errstate(all="ignore"):
        family, value = FullOrderFamily(plan), mpmath.mpf(float(plan.parameter_values()[name]))
        step = (abs(value) or 1) * mpmath.mpf(10) ** -12
        up, down = (family.products({name: Precise(value + side * step)}, X)[:2] for side in (1, -1))
        return [np.asarray((X.T @ (a - b)) / (2 * step)) for a, b in zip(up, down, strict=True)]


def expected_slopes(plan, names, n):
    """f' (k, P), Hz per SI unit, of the branches that frequencies go into."""
    model = FullOrderFamily(plan).model({})
    pairs = whole_clusters(model.K, model.M, n)
    found = np.zeros((len(pairs.values), len(names)))
    groups = np.split(np.arange(len(pairs.values)), 1 + np.flatnonzero(np.diff(pairs.values) > 1e-6 * pairs.values[1:]))
    for p, name in enumerate(names):
        K, M = differences(plan, name, pairs.vectors)
        for at in groups:
            value = pairs.values[at].mean()
            S = K[np.ix_(at, at)] - value * M[np.ix_(at, at)]
            found[at, p] = np.linalg.eigvalsh((S + S.T) / 2) / (4 * np.pi * np.sqrt(value))
    return found


@pytest.mark.parametrize("example", [*QUICK, *(pytest.param(e, marks=pytest.mark.slow) for e in SLOW)])
def test_frequencies_of_examples(example):
    mechanism = fx.load(EXAMPLES / f"{example}.yaml")
    free = {name: p.replaced({"minimum": None, "maximum": None}) for name, p in mechanism.parameters.items()}
    plan = fx.Plan(mechanism.replaced({"parameters": free}))
    names = free_names(plan, None)
    found = frequency_slopes(plan, {}, names, 6)
    expected = expected_slopes(plan, names, 6)
    size = np.abs(expected).max(axis=0)
    assert (np.abs(found.slope - expected) <= 1e-7 * np.where(size, size, 1.0)).all()
