"""Natural frequencies of many designs: every interval is held against the full order in extended precision."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.gallery import entry
from flexura.linalg import lowest
from flexura.reduction import independent_frequencies
from helpers.extended_eigen import wide_frequencies
from helpers.random_mechanisms import FEW, mechanisms

EXAMPLES = Path(__file__).parents[2] / "examples"


def holds(found: fx.NaturalFrequencies, true: np.ndarray) -> bool:
    inside = (found.lower_hz <= true) & (true <= found.upper_hz)
    own = (found.lower_hz <= found.frequency_hz) & (found.frequency_hz <= found.upper_hz)
    return bool(inside.all() and own.all())


def legs(inner_mass: float = 0.0, thickness: str = "t") -> fx.Mechanism:
    """Three legs of two wires, with a mass between them that constraint modes of the legs do not see."""
    wire = {
        "material": "spring-steel",
        "section": fx.describe.Circle(diameter=fx.describe.parameter(thickness)),
        "elements": 5,
    }
    leg = fx.describe.Substructure(
        nodes={"foot": (0.03, 0, 0), "knee": (fx.describe.parameter("x"), 0, 0.02), "head": (0.02, 0, 0.05)},
        links={
            "low": fx.describe.Link(nodes=("foot", "knee"), **wire),
            "high": fx.describe.Link(nodes=("knee", "head"), **wire),
        },
        masses={"knee": fx.describe.PointMass(node="knee", mass=inner_mass)} if inner_mass else {},
        interface=("foot", "head"),
    )
    inertia = (2e-5, 2e-5, 4e-5)
    return fx.Mechanism(
        parameters={"t": fx.describe.Parameter(value=0.8e-3), "x": fx.describe.Parameter(value=0.028)},
        substructures={"leg": leg},
        instances={"leg": fx.describe.Instance(of="leg", pattern=fx.describe.CircularPattern(count=3))},
        bodies={"top": fx.describe.RigidBody(centre=(0, 0, 0.055), mass=0.1, inertia=inertia, carries=("leg*.head",))},
        ground={"leg*.foot": "clamped"},
    )


@settings(FEW, max_examples=60)
@given(mechanisms(), st.integers(1, 12))
def test_intervals_hold_for_random_mechanisms(mechanism, count):
    plan = fx.Plan(mechanism)
    assume(0 < plan.topology.n_dof < 300)
    found = fx.natural_frequencies(plan, n=count)
    assert holds(found, wide_frequencies(plan, count=len(found.frequency_hz)))


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("guide/guide", 6),
        ("amplifier/amplifier", 6),
        ("pivot/pivot", 6),
        ("imported/guide", 6),
        ("tip_tilt/tip_tilt", 9),
    ],
)
def test_intervals_hold_for_the_examples(name, count):
    plan = fx.Plan(fx.load(EXAMPLES / f"{name}.yaml"))
    found = fx.natural_frequencies(plan, n=count)
    assert holds(found, wide_frequencies(plan, count=count))
    assert found.is_proven and found.error_bound.max() < 1e-3


@pytest.mark.parametrize("geometry", [False, True])
def test_intervals_hold_over_sections_and_geometry(geometry):
    plan = fx.Plan(legs(inner_mass=0.02))
    t = np.geomspace(0.3e-3, 2e-3, 7)
    sweep = {"t": t, "x": np.linspace(0.02, 0.04, 7)} if geometry else {"t": t}
    found = fx.natural_frequencies(plan, sweep, n=9)
    assert len(found.missed) == 0
    for k in range(7):
        one = {name: float(v[k]) for name, v in sweep.items()}
        true = wide_frequencies(plan, one, 9)
        assert (found.lower_hz[k] <= true).all() and (true <= found.upper_hz[k]).all()
        full = fx.assemble(plan, one)
        np.testing.assert_allclose(
            found.frequency_hz[k], np.sqrt(lowest(full.K, full.M, 9).values) / (2 * np.pi), rtol=3e-4
        )


@pytest.mark.parametrize("contrast", [1e-6, 1e-3, 1e3, 1e6])
def test_intervals_hold_where_stiffness_is_widely_spread(contrast):
    mechanism = legs(inner_mass=0.02)
    steel = mechanism.material("spring-steel")
    soft = fx.describe.Material(E=steel.E * contrast, nu=0.3, rho=steel.rho)
    leg = mechanism.substructures["leg"]
    high = leg.links["high"].model_copy(update={"material": "soft"})
    leg = leg.model_copy(update={"links": {**leg.links, "high": high}})
    mechanism = mechanism.model_copy(update={"substructures": {"leg": leg}, "materials": {"soft": soft}})
    plan = fx.Plan(mechanism)
    assert holds(fx.natural_frequencies(plan, n=8), wide_frequencies(plan, count=8))


def test_motions_inside_substructures_are_seen():
    """Constraint modes of the legs are 10 % and more too high here, and say nothing."""
    plan = fx.Plan(legs(inner_mass=0.02))
    full = fx.assemble(plan)
    true = np.sqrt(lowest(full.K, full.M, 6).values) / (2 * np.pi)
    assert (fx.unproven_frequencies(plan) / true - 1).max() > 0.1
    found = fx.natural_frequencies(plan)
    assert found.is_proven
    np.testing.assert_allclose(found.frequency_hz, true, rtol=1e-6)


def test_certificates_of_one_design_agree():
    plan = fx.Plan(fx.load(EXAMPLES / "rpr" / "rpr.yaml"))
    for count in (6, 12):
        found = fx.natural_frequencies(plan, n=count)
        proof = fx.models.certify(fx.reduce(plan, keep=3), n=count)
        # the assembled stiffness of the certificate has lost some 2e-8
        assert (found.lower_hz <= proof.upper_hz[:count] * (1 + 1e-7)).all()
        assert (proof.lower_hz[:count] * (1 - 1e-7) <= found.upper_hz).all()
        assert found.error_bound.max() < 1e-4


def test_one_design_is_a_batch_of_one():
    plan = fx.Plan(legs(inner_mass=0.02))
    one, many = fx.natural_frequencies(plan, {"t": 1e-3}), fx.natural_frequencies(plan, {"t": np.array([1e-3])})
    assert one.frequency_hz.shape == (6,) and many.frequency_hz.shape == (1, 6)
    assert one.is_proven.shape == () and many.is_proven.shape == (1,)
    for name in ("frequency_hz", "lower_hz", "upper_hz"):
        np.testing.assert_allclose(getattr(one, name), getattr(many, name)[0], rtol=1e-12)


def test_floating_mechanisms_have_six_zeros():
    mechanism = legs(inner_mass=0.02).model_copy(update={"ground": {}})
    plan = fx.Plan(mechanism)
    found = fx.natural_frequencies(plan, {"t": np.array([0.5e-3, 1e-3])}, n=9)
    assert len(found.missed) == 0
    assert (found.frequency_hz[:, :6] == 0).all() and (found.lower_hz[:, :6] == 0).all()
    true = wide_frequencies(plan, {"t": 0.5e-3}, 9, shift=1e6)
    assert (found.lower_hz[0, 6:] <= true[6:]).all() and (true[6:] <= found.upper_hz[0, 6:]).all()
    assert fx.natural_frequencies(plan, n=1).frequency_hz == [0.0]


def test_missed_designs_are_said_and_resolved():
    plan = fx.Plan(legs(inner_mass=0.02))
    found = fx.natural_frequencies(plan, {"t": np.array([0.5e-3, 1e-3])}, tolerance=1e-13)
    assert found.missed.tolist() == [0, 1]
    assert "2 of 2 NOT proven within 1e-13" in repr(found)
    told = []
    loose = fx.natural_frequencies(plan, {"t": np.array([0.5e-3, 1e-3])})
    assert repr(loose) == "<NaturalFrequencies: 6 of 2 designs, all proven within 0.001>"
    again = found.resolved(lambda at: told.append((at.done, at.of)))
    assert told == [(1, 2), (2, 2)]
    np.testing.assert_allclose(again.frequency_hz, loose.frequency_hz, rtol=1e-6)
    assert (again.lower_hz <= again.frequency_hz).all() and (again.frequency_hz <= again.upper_hz).all()


def test_designs_solved_one_by_one_from_the_start(monkeypatch):
    plan = fx.Plan(legs(inner_mass=0.02))
    stacked = fx.natural_frequencies(plan, {"t": np.array([0.5e-3, 1e-3])})
    monkeypatch.setattr("flexura.reduction.batch.LARGEST_STACKED", 5)
    alone = fx.natural_frequencies(fx.Plan(plan.mechanism), {"t": np.array([0.5e-3, 1e-3])})
    assert len(alone.missed) == 0
    np.testing.assert_allclose(alone.frequency_hz, stacked.frequency_hz, rtol=1e-6)


@pytest.mark.parametrize("ask", [fx.natural_frequencies, fx.unproven_frequencies])
@pytest.mark.parametrize("wrong", [0.0, -0.5e-3])
def test_impossible_designs_are_named(ask, wrong):
    plan = fx.Plan(legs())
    t = np.full(40, 1e-3)
    t[37] = wrong
    with pytest.raises(fx.OptionError, match=rf"design 37 \(t = {wrong:g}, x = 0.03\)"):
        ask(plan, {"t": t, "x": 0.03})


def test_options_that_cannot_be():
    plan = fx.Plan(legs())
    with pytest.raises(fx.OptionError, match="at least 1"):
        fx.natural_frequencies(plan, n=0)
    with pytest.raises(fx.OptionError, match="between 0 and 1"):
        fx.natural_frequencies(plan, tolerance=0.0)


@pytest.mark.parametrize("length", [0.05, 0.1, 0.3])
@pytest.mark.parametrize("count", [2, 3, 6])
def test_a_point_mass_on_a_leaf_of_nearly_no_mass(length, count):
    """f^2 = 3 E I / (m L^3) of the lower bending mode; those without the point mass lie some ten decades above."""
    width, mass, thickness = 0.01, 1.0, np.linspace(3e-3, 5e-3, 9)
    section = fx.describe.Rectangle(width=width, thickness=fx.describe.parameter("t"))
    leaf = fx.describe.Link(
        nodes=("root", "tip"), material="light", section=section, reference=(0, 0, 1), elements=8,
        theory="euler_bernoulli",
    )  # fmt: skip
    plan = fx.Plan(
        fx.Mechanism(
            corrections="none",
            parameters={"t": fx.describe.Parameter(value=5e-3, unit="m")},
            materials={"light": fx.describe.Material(E=210e9, nu=0.3, rho=1e-6)},
            nodes={"root": (0, 0, 0), "tip": (length, 0, 0)},
            links={"leaf": leaf},
            masses={"tip": fx.describe.PointMass(node="tip", mass=mass)},
            ground={"root": "clamped"},
        )
    )
    exact = np.sqrt(3 * 210e9 * width * thickness**3 / 12 / (mass * length**3)) / (2 * np.pi)
    together = fx.natural_frequencies(plan, {"t": thickness}, n=count)
    frequency, lower, upper = independent_frequencies(plan, {"t": thickness}, n=count)
    assert frequency[:, 0] == pytest.approx(exact, rel=1e-6)
    for low, high in ((lower, upper), (together.lower_hz, together.upper_hz)):
        assert (low[:, 0] <= exact * (1 + 1e-9)).all() and (exact * (1 - 1e-9) <= high[:, 0]).all()


def test_a_core_of_one_coordinate_is_solved_in_a_batch():
    """A bistable beam on a guide: its core is one translation, of which matrices and bounds are of one size."""
    mechanism = fx.loads(entry("bistable").text)
    spans = mechanism.parameters["span"].value * np.array([1.0, 1.01, 1.02, 1.03])
    batch = fx.natural_frequencies(mechanism, {"span": spans}, n=3)
    single = [fx.modes(mechanism, {"span": span}, n=3, order="full").frequency_hz for span in spans]
    assert np.all(batch.lower_hz <= np.array(single)) and np.all(np.array(single) <= batch.upper_hz)
    assert batch.frequency_hz == pytest.approx(np.array(single), rel=1e-4)
