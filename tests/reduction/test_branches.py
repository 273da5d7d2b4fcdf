"""Branches that are eliminated where many designs are proven: against the full order, and against one matrix."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import flexura as fx
from flexura.linalg import lowest
from flexura.reduction.arrow_bounds import _arrow_has_fewer, _ritz
from flexura.reduction.chain_assembler import chain_assembler
from flexura.structure import Design
from helpers.extended_eigen import wide_frequencies
from helpers.random_mechanisms import FEW, mechanisms

RPR = Path(__file__).parents[2] / "examples" / "rpr" / "rpr.yaml"
MOST = 300
"""Freedoms that are solved in extended precision in a moment."""


def table(**ground: Any) -> fx.Mechanism:
    """A table on legs of two kinds: two turned, two mirrored with a body inside that wires hang from."""
    wire = {
        "material": "spring-steel",
        "section": fx.describe.Circle(diameter=fx.describe.parameter("t")),
        "elements": 4,
    }
    thin = fx.describe.Substructure(
        nodes={"foot": (0.03, 0.001, 0), "knee": (fx.describe.parameter("x"), 0, 0.02), "head": (0.02, 0, 0.05)},
        links={
            "low": fx.describe.Link(nodes=("foot", "knee"), **wire),
            "high": fx.describe.Link(nodes=("knee", "head"), **(wire | {"elements": 3})),
        },
        masses={"knee": fx.describe.PointMass(node="knee", mass=2e-4)},
        interface=("foot", "head"),
    )
    block = fx.describe.RigidBody(centre=(0, 0.014, 0.02), mass=1e-4, inertia=(1e-9, 2e-9, 1e-9), carries=("a", "b"))
    thick = fx.describe.Substructure(
        nodes={
            "foot": (0.001, 0.01, 0),
            "a": (0.002, 0.01, 0.02),
            "b": (-0.002, 0.013, 0.021),
            "head": (0, 0.02, 0.05),
        },
        links={
            "low": fx.describe.Link(nodes=("foot", "a"), **wire),
            "high": fx.describe.Link(nodes=("b", "head"), **wire),
        },
        bodies={"block": block},
        interface=("foot", "head"),
    )
    mirrored = fx.describe.Instance(of="thick", pattern=fx.describe.MirrorPattern(normal=(0, 1, 0)))
    turned = fx.describe.Instance(of="thin", pattern=fx.describe.CircularPattern(count=2))
    top = fx.describe.RigidBody(
        centre=(0.001, 0, 0.055), mass=0.3, inertia=(2e-4, 3e-4, 4e-4), carries=("thin*.head", "thick*.head")
    )
    return fx.Mechanism(
        parameters={"t": fx.describe.Parameter(value=0.8e-3), "x": fx.describe.Parameter(value=0.028)},
        substructures={"thin": thin, "thick": thick},
        instances={"thin": turned, "thick": mirrored},
        bodies={"top": top},
        ground={"thin1.foot": "clamped", "thin2.foot": "clamped", "thick*.foot": "clamped", **ground},
    )


def holds(found: fx.NaturalFrequencies, true: np.ndarray) -> bool:
    lower, upper = np.atleast_2d(found.lower_hz), np.atleast_2d(found.upper_hz)
    return bool(((lower <= true) & (true <= upper)).all())


def test_equal_branches_are_found():
    chains = chain_assembler(fx.Plan(table()))
    assert [len(kind.instances) for kind in chains.branches.kinds] == [2, 2]
    assert chains.n_core == 6 and chains.is_arrow(6) and not chains.is_arrow(7)
    chains = chain_assembler(fx.Plan(fx.load(RPR)))
    assert [len(kind.instances) for kind in chains.branches.kinds] == [2, 2] and chains.order == 54


def test_branches_that_are_held_otherwise_are_another_kind():
    plan = fx.Plan(table(**{"thin2.foot": {"fixed": ["tx", "ty", "tz"]}}))
    chains = chain_assembler(plan)
    assert sorted(len(kind.instances) for kind in chains.branches.kinds) == [1, 1, 2]
    assert chains.n_core == 9  # and the foot, which may turn about axes that are not those of its leg
    assert holds(fx.natural_frequencies(plan, n=6), wide_frequencies(plan, count=6))


@settings(FEW, max_examples=40)
@given(mechanisms(nested=True), st.integers(1, 6))
def test_intervals_hold_for_random_branches(mechanism, count):
    plan = fx.Plan(mechanism)
    assume(0 < plan.topology.n_dof < MOST)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flexura.reduction.chain_assembler.STIFFER_BRANCHES", np.inf)
        found = fx.natural_frequencies(plan, n=count)
    assert holds(found, wide_frequencies(plan, count=len(found.frequency_hz)))


def test_intervals_hold_over_sections_and_geometry():
    plan = fx.Plan(table())
    sweep = {"t": np.geomspace(0.2e-3, 2e-3, 6), "x": np.linspace(0.01, 0.045, 6)}
    found = fx.natural_frequencies(plan, sweep)
    assert len(found.missed) == 0 and found.error_bound.max() < 1e-6
    for k in range(6):
        one = {name: float(v[k]) for name, v in sweep.items()}
        true = wide_frequencies(plan, one, 6)
        assert (found.lower_hz[k] <= true).all() and (true <= found.upper_hz[k]).all()


def test_a_frequency_that_is_not_below_is_never_proven():
    """Lower bounds that are a millionth of a millionth too high fail, for each of six modes."""
    plan = fx.Plan(table())
    chains = chain_assembler(plan)
    arrow = chains(Design.of(plan).stacked())
    true = (2 * np.pi * wide_frequencies(plan, count=6)) ** 2
    core = _ritz(arrow).core
    assert not _arrow_has_fewer(arrow, true[None] * (1 + 1e-12), core).any()
    assert _arrow_has_fewer(arrow, true[None] * (1 - 1e-5), core).all()


def test_branches_and_one_matrix_agree(monkeypatch):
    plan = fx.Plan(fx.load(RPR))
    rng = np.random.default_rng(3)
    sweep = {"leaf_thickness": 4e-4 * rng.uniform(0.5, 2, 40), "leaf_length": 5e-3 * rng.uniform(0.7, 1.5, 40)}
    found, quick = fx.natural_frequencies(plan, sweep), fx.unproven_frequencies(plan, sweep)
    monkeypatch.setattr("flexura.reduction.chain_assembler.STIFFER_BRANCHES", 0.0)
    whole = fx.natural_frequencies(fx.Plan(plan.mechanism), sweep)
    assert len(found.missed) == len(whole.missed) == 0
    assert (found.lower_hz <= whole.upper_hz).all() and (whole.lower_hz <= found.upper_hz).all()
    np.testing.assert_allclose(quick, fx.unproven_frequencies(fx.Plan(plan.mechanism), sweep), rtol=1e-9)


def test_designs_whose_branches_become_soft_are_solved_in_one_matrix():
    """Heavy knees bring modes of the legs among those asked for: the core alone cannot see them."""
    mechanism = table()
    legs = mechanism.substructures["thin"]
    heavy = fx.describe.PointMass(node="knee", mass=fx.describe.parameter("m"))
    legs = legs.model_copy(update={"masses": {"knee": heavy}})
    own = {"m": fx.describe.Parameter(value=2e-4)}
    mechanism = mechanism.model_copy(
        update={
            "parameters": {**mechanism.parameters, **own},
            "substructures": {**mechanism.substructures, "thin": legs},
        }
    )
    plan = fx.Plan(mechanism)
    assert chain_assembler(plan).is_arrow(6)
    sweep = {"m": np.array([2e-4, 5e-3, 0.1])}
    found = fx.natural_frequencies(plan, sweep)
    assert len(found.missed) == 0
    for k, m in enumerate(sweep["m"]):
        full = fx.assemble(plan, {"m": float(m)})
        true = np.sqrt(lowest(full.K, full.M, 6).values) / (2 * np.pi)
        np.testing.assert_allclose(found.frequency_hz[k], true, rtol=1e-4)


@pytest.mark.parametrize("light", [1e-14, 1e-16, 1e-21])
def test_a_platform_whose_rotations_have_nearly_no_mass(light):
    """Round-off makes the pencil of the core indefinite: f = 1/(2 pi sqrt(m c)), with its compliance c, lies within."""
    wire = {"material": "wire", "section": fx.describe.Circle(diameter=1e-3), "elements": 3}
    leg = fx.describe.Substructure(
        nodes={"foot": (0.03, 0, 0), "knee": (0.025, 0, 0.025), "head": (0.02, 0, 0.05)},
        links={
            "low": fx.describe.Link(nodes=("foot", "knee"), **wire),
            "high": fx.describe.Link(nodes=("knee", "head"), **wire),
        },
        masses={"knee": fx.describe.PointMass(node="knee", mass=1e-4 * fx.describe.parameter("light"))},
        interface=("foot", "head"),
    )
    inertia = 1e-4 * fx.describe.parameter("light")
    top = fx.describe.RigidBody(centre=(0, 0, 0.05), mass=0.2, inertia=(inertia,) * 3, carries=("leg*.head",))
    mechanism = fx.Mechanism(
        parameters={"light": fx.describe.Parameter(value=1.0)},
        materials={"wire": fx.describe.Material(E=200e9, nu=0.3, rho=7800 * fx.describe.parameter("light"))},
        substructures={"leg": leg},
        instances={"leg": fx.describe.Instance(of="leg", pattern=fx.describe.CircularPattern(count=3))},
        bodies={"top": top},
        ground={"leg*.foot": "clamped"},
    )
    plan = fx.Plan(mechanism)
    assert chain_assembler(plan).is_arrow(2)
    found = fx.natural_frequencies(plan, {"light": np.array([1.0, light])}, n=2)
    model = fx.assemble(plan)
    at = plan.topology.dof[plan.topology.numbers(["top"])[0], :3]
    compliance = np.linalg.eigvalsh(np.linalg.inv(model.K.toarray())[np.ix_(at, at)])[::-1]
    true = 1 / (2 * np.pi * np.sqrt(0.2 * compliance[:2]))
    assert (found.lower_hz[1] <= true * (1 + 1e-8)).all() and (true * (1 - 1e-8) <= found.upper_hz[1]).all()
