"""No frequency outside its own interval, none missed, no wrong zero: against inertia counts with 32 digits.

The reference shares with flexura the sizes of a description and the formulas of its elements, and nothing else: it sums
K and M of all nodes in pairs of doubles (`exact_model`) and counts negative pivots of K - lambda M.
"""

from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import flexura as fx
from helpers.exact_model import ExactModel
from helpers.nasty import nasty, slender

QUICK = range(24)
MANY = range(24, 2060)


def contradictions(result: fx.Modes, exact: ExactModel) -> list[str]:
    """What a result says that counts with 32 digits contradict."""
    found = []
    for k, mode in enumerate(result.modes):
        lower, upper = mode.interval_hz
        if not (lower or 0.0) <= mode.frequency_hz <= (np.inf if upper is None else upper):
            found.append(f"mode {k + 1}: {mode.frequency_hz} outside {mode.interval_hz}")
        if mode.is_indexed and lower and exact.count_below(lower) > k:
            found.append(f"mode {k + 1} lies below {lower}")
        # a rigid motion strains the reference by the last digits of its nodes' positions
        if mode.is_indexed and upper is not None and not mode.is_rigid and exact.count_below(upper) < k + 1:
            found.append(f"mode {k + 1} lies above {upper}")
        if mode.is_rigid and upper is not None and upper > 1e-2 * result.modes[-1].frequency_hz > 0:
            found.append(f"mode {k + 1} is called rigid and may have {upper} Hz")
    proof = result.certificate
    count = exact.count_below(proof.below_hz)
    if proof.is_counted and count != proof.count:
        found.append(f"{count} and not {proof.count} modes below {proof.below_hz}")
    return found


def check(seeds) -> None:
    wrong, unproven = {}, 0
    for seed in seeds:
        plan = fx.Plan(nasty(seed))
        order = ("low", "full")[seed // 2 % 2]
        result = fx.modes(plan, n=3 + seed % 6, order=order)
        own = contradictions(result, ExactModel(fx.assemble(plan)))
        if own:
            wrong[seed, order] = own
        unproven += not result.certificate.is_counted
    assert not wrong, wrong
    assert unproven <= len(seeds) // 6  # said in the result, where contrasts exceed double precision


@pytest.mark.parametrize("threads", [1, 2])
def test_nasty_mechanisms(threads):
    with threadpool_limits(threads):
        check(QUICK[threads - 1 :: 2])


@pytest.mark.slow
@pytest.mark.parametrize("part", range(10))
def test_two_thousand_nasty_mechanisms(part):
    with threadpool_limits(1):
        check(MANY[part::10])


@pytest.mark.slow
def test_nasty_mechanisms_of_two_threads():
    with threadpool_limits(2):
        check(MANY[::40])


@pytest.mark.parametrize("elements", [1, 40, 400])
def test_a_very_soft_support_is_no_rigid_motion(elements):
    mechanism = slender(elements, 0.3908363342831385)
    result = fx.modes(mechanism)
    mass = 11.0 + 7850 * 20e-3 * 0.5e-3 * 50e-3
    expected = np.sqrt(0.3908363342831385 / mass) / (2 * np.pi)
    assert result.evidence.rigid_body_modes == 5
    assert [mode.is_rigid for mode in result.modes] == [True] * 5 + [False]
    assert result.frequency_hz[5] == pytest.approx(expected, rel=1e-3)
    lower, upper = result.modes[5].interval_hz
    assert lower < result.frequency_hz[5] <= upper < lower * (1 + 1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("support", [0.39, 1e-6])
def test_two_thousand_elements_in_a_member(support):
    mechanism = slender(2000, support)
    result = fx.modes(mechanism, n=8)
    assert not contradictions(result, ExactModel(fx.assemble(mechanism)))
    assert result.certificate.is_counted and result.evidence.rigid_body_modes == 5
    coarse = fx.modes(slender(40, support), n=8)
    np.testing.assert_allclose(result.frequency_hz, coarse.frequency_hz, rtol=1e-5)


def guide(shift) -> fx.Mechanism:
    """Two leaves and a carriage, moved."""
    at = {"f1": (0, 0, 0), "h1": (0, 0, 60e-3), "f2": (50e-3, 0, 0), "h2": (50e-3, 0, 60e-3)}
    moved = {name: tuple(np.add(x, shift)) for name, x in at.items()}
    leaf = {"material": "spring-steel", "reference": "x", "profile": fx.describe.Leaf(width=20e-3, thickness=0.5e-3)}
    centre = tuple(np.add((25e-3, 0, 65e-3), shift))
    return fx.Mechanism(
        nodes=moved,
        flexures={f"leaf{k}": fx.describe.Flexure(nodes=(f"f{k}", f"h{k}"), elements=20, **leaf) for k in "12"},
        bodies={
            "table": fx.describe.RigidBody(centre=centre, mass=0.1, inertia=(1e-5, 3e-5, 3e-5), carries=("h1", "h2"))
        },
        ground={"f1": "clamped", "f2": "clamped"},
    )


@pytest.mark.parametrize("order", ["low", "full"])
def test_the_same_mechanism_elsewhere_has_intervals_that_overlap(order):
    a, b = (fx.modes(guide(s), n=8, order=order).certificate for s in ((0, 0, 0), (1.2, -0.7, 0.3)))
    assert (np.maximum(a.lower_hz, b.lower_hz) <= np.minimum(a.upper_hz, b.upper_hz)).all()
    if order == "full":
        assert (b.upper_hz / b.lower_hz - 1).max() < 1e-9
