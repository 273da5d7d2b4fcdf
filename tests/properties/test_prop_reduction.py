"""What a Craig-Bampton reduction must keep for every mechanism, and that its two routes agree.

Craig and Bampton (1968): constraint modes reproduce every static response to interface loads exactly, and a
Rayleigh-Ritz basis gives frequencies that are never below those of the full model and never rise when modes are added.
"""

import numpy as np
import scipy.linalg as la
from hypothesis import given
from hypothesis import strategies as st

from flexura.expressions import parameter
from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.linalg.subspaces import lowest_values
from flexura.mechanism import CircularPattern, Instance, Link, Mechanism, Parameter, Rectangle, RigidBody, Substructure
from flexura.reduction.assembly import low_order
from flexura.reduction.low_order import reduce
from flexura.reduction.unproven import unproven_frequencies
from flexura.structure import Plan
from flexura.structure.design import Design
from helpers.flat_meshes import scaled
from helpers.random_mechanisms import FEW, METALS, mechanisms

EVERY_MODE = 1_000_000


def omega2(model, count):
    """Return the lowest eigenvalues, all of them when there are fewer."""
    return lowest(model.K, model.M, min(count, model.order)).values


def scaled_difference(A, B, by):
    """Return the largest entry of A - B in units of the diagonal of `by`."""
    d = 1 / np.sqrt(np.diagonal(by))
    return abs((A - B) * np.outer(d, d)).max(initial=0.0)


@FEW
@given(mechanisms())
def test_interface_stiffness_is_the_schur_complement_of_the_full_one(mechanism):
    model, low = assemble(mechanism), reduce(mechanism)
    kept = [model.dof_names.index(name) for name in low.coordinate_names]
    rest = np.setdiff1d(np.arange(model.order), kept)
    K = model.K.toarray()
    schur = K[np.ix_(kept, kept)]
    if len(rest):
        schur = schur - K[np.ix_(kept, rest)] @ np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, kept)])
    assert scaled_difference(low.K, schur, K[np.ix_(kept, kept)]) < 1e-9


@FEW
@given(mechanisms(), st.integers(0, 3), st.integers(0, 2**32 - 1))
def test_static_response_to_interface_loads_is_exact_everywhere(mechanism, keep, seed):
    model, low = assemble(mechanism), reduce(mechanism, keep=keep)
    at = {name: k for k, name in enumerate(model.dof_names)}
    physical = [k for k, name in enumerate(low.coordinate_names) if name in at]
    force = np.zeros(low.order)
    d = np.sqrt(np.diagonal(low.K))
    force[physical] = np.random.default_rng(seed).normal(size=len(physical)) * d[physical]
    full_force = np.zeros(model.order)
    full_force[[at[low.coordinate_names[k]] for k in physical]] = force[physical]
    scale = np.sqrt(model.K.diagonal())
    recovered = scale * low.recover(np.linalg.solve(low.K / np.outer(d, d), force / d)[:, None] / d[:, None])[:, 0]
    expected = scale * np.linalg.solve(model.K.toarray(), full_force)
    assert np.linalg.norm(recovered - expected) <= 1e-6 * np.linalg.norm(expected)


@FEW
@given(mechanisms())
def test_frequencies_are_upper_bounds_and_fall_with_every_mode_kept(mechanism):
    model = assemble(mechanism)
    above = None
    for keep in (0, 1, 2, 5):
        low = reduce(mechanism, keep=keep)
        if low.order == 0:
            continue
        values = omega2(low, 12)
        assert (values >= omega2(model, 12)[: len(values)] * (1 - 1e-8)).all()
        if above is not None:
            assert (values[: len(above)] <= above * (1 + 1e-8)).all()
        above = values


@FEW
@given(mechanisms())
def test_with_every_mode_kept_the_reduced_model_is_the_full_one(mechanism):
    model, low = assemble(mechanism), reduce(mechanism, keep=EVERY_MODE)
    assert low.order == model.order
    count = model.order // 2
    np.testing.assert_allclose(omega2(low, count), omega2(model, count), rtol=1e-7)


@FEW
@given(mechanisms(), st.integers(0, 3))
def test_reduced_matrices_are_the_full_ones_projected(mechanism, keep):
    model, low = assemble(mechanism), reduce(mechanism, keep=keep)
    T = low.recovery.toarray()
    for own, full in ((low.K, model.K), (low.M, model.M)):
        assert scaled_difference(own, T.T @ (full @ T), abs(T).T @ (abs(full) @ abs(T))) < 1e-9


@FEW
@given(mechanisms())
def test_chains_and_factorisation_give_the_same_reduction(mechanism):
    plan = Plan(mechanism)
    low = reduce(plan)
    K, M = low_order(plan).stack(Design.of(plan))
    assert scaled_difference(K, low.K, low.K) < 1e-9
    assert scaled_difference(M, low.M, low.M) < 1e-9


@FEW
@given(mechanisms(), st.sampled_from([0.1, 3.0]))
def test_modes_kept_below_a_frequency_are_all_below_it_and_none_is_missing(mechanism, factor):
    first = np.sqrt(omega2(assemble(mechanism), 1)[0]) / (2 * np.pi)
    limit = 30 * factor * first
    low = reduce(mechanism, keep_below=limit)
    every = reduce(mechanism, keep=EVERY_MODE)
    for name, part in low.parts.items():
        expected = every.parts[name].frequencies
        expected = expected[expected < 2 * np.pi * limit]
        np.testing.assert_allclose(part.frequencies, expected, rtol=1e-7)


def cross(count):
    """Return a stage on equal branches whose leaves are `t` thick and `L` long."""
    leaf = {"section": Rectangle(width=8e-3, thickness=parameter("t")), "reference": (1, 0, 0)}
    branch = Substructure(
        nodes={"foot": (0, 0, 0), "knee": (parameter("L"), 0, 0), "top": (parameter("L"), 0, 0.03)},
        links={
            "lower": Link(nodes=("foot", "knee"), material="steel", elements=4, **leaf | {"reference": (0, 0, 1)}),
            "upper": Link(nodes=("knee", "top"), material="aluminium", elements=3, **leaf),
        },
        interface=("foot", "top"),
    )
    return Mechanism(
        materials=METALS,
        parameters={"t": Parameter(value=1e-3), "L": Parameter(value=0.02)},
        substructures={"branch": branch},
        instances={"branch": Instance(of="branch", at=(0.01, 0, 0), pattern=CircularPattern(count=count))},
        bodies={
            "stage": RigidBody(centre=(0, 0, 0.03), carries=("branch*.top",), mass=0.2, inertia=(1e-5, 2e-5, 3e-5))
        },
        ground={"branch*.foot": "clamped"},
    )


@FEW
@given(st.lists(st.tuples(st.floats(0.4e-3, 2e-3), st.floats(0.01, 0.05)), min_size=1, max_size=5))
def test_a_design_axis_gives_what_one_design_at_a_time_does(designs):
    plan = Plan(cross(3))
    t, L = (np.array(column) for column in zip(*designs, strict=True))
    together = unproven_frequencies(plan, {"t": t, "L": L}, n=6)
    fixed_L = unproven_frequencies(plan, {"t": t}, n=6)
    for k in range(len(designs)):
        low = reduce(plan, {"t": t[k], "L": L[k]})
        alone = np.sqrt(lowest(low.K, low.M, 6).values) / (2 * np.pi)
        np.testing.assert_allclose(together[k], alone, rtol=1e-7)
        np.testing.assert_allclose(together[k], unproven_frequencies(plan, {"t": t[k], "L": L[k]}), rtol=1e-9)
        np.testing.assert_allclose(fixed_L[k], unproven_frequencies(plan, {"t": t[k]}), rtol=1e-9)


@FEW
@given(mechanisms(), st.integers(1, 12))
def test_subspace_iteration_finds_the_lowest_eigenvalues(mechanism, count):
    low = reduce(mechanism, keep=2)
    count = min(count, low.order)
    if count:
        direct = la.eigh(low.M, low.K, eigvals_only=True)[::-1][:count]
        np.testing.assert_allclose(lowest_values(low.K[None], low.M[None], count)[0], 1 / direct, rtol=1e-7)


@FEW
@given(mechanisms())
def test_reduction_does_not_depend_on_units(mechanism):
    low, large = reduce(mechanism), reduce(scaled(mechanism, 1e3))
    np.testing.assert_allclose(omega2(low, 8), 1e6 * omega2(large, 8), rtol=1e-7)
