"""What every reduction promises: exact statics, frequencies from above, and the full model when everything is kept."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from hypothesis import assume, given
from hypothesis import strategies as st

import flexura as fx
from flexura.linalg import lowest
from helpers.random_mechanisms import FEW, mechanisms

EXAMPLES = Path(__file__).parents[2] / "examples"
EVERY_MODE = 10_000
METHODS = ("guyan", "irs", "iterated_irs", "serep", "modal")


def hertz(model, count):
    """The lowest frequencies, Hz."""
    return np.sqrt(lowest(model.K, model.M, count).values) / (2 * np.pi)


def full_compliance(model, low):
    """Compliance of the full-order model at the static nodes, and what round-off of the solve may change."""
    B = model.design.node_rows(model.plan.topology.numbers(low.static_nodes)).toarray()
    K = model.K.toarray()
    d = 1 / np.sqrt(K.diagonal())
    factor = la.cho_factor(K * d[:, None] * d)
    flexible = B @ (d[:, None] * la.cho_solve(factor, d[:, None] * B.T))
    scale = np.sqrt(np.abs(np.outer(flexible.diagonal(), flexible.diagonal()))) + 1e-300
    return flexible, scale


def variants(low):
    """Every further step from a reduced model."""
    yield low
    if low.order > 3:
        yield fx.models.interface_reduction(low, n=max(1, len(low.basis.assembler.physical) // 2))
        yield fx.models.condense(low, min(4, low.order), method="modal")
        for method in ("guyan", "irs", "serep"):
            try:
                yield fx.models.condense(low, min(3, low.order), method=method)
            except fx.OptionError as error:
                assert "coordinates" in str(error)


@FEW
@given(mechanisms(), st.sampled_from(["craig_bampton", "rubin"]), st.integers(0, 3))
def test_statics_stay_exact_through_every_step(mechanism, method, keep):
    low, model = fx.reduce(mechanism, keep=keep, reduction=method), fx.assemble(mechanism)
    assume(low.static_nodes)
    exact, scale = full_compliance(model, low)
    for step in variants(low):
        assert step.static_nodes == low.static_nodes
        assert np.abs(step.compliance() - exact).max() <= 1e-7 * scale.max()
        assert (np.abs(step.compliance() - exact) <= 1e-5 * scale).all()


@FEW
@given(mechanisms(), st.integers(0, 4))
def test_free_interface_frequencies_come_from_above_and_fall(mechanism, keep):
    full = hertz(fx.assemble(mechanism), 8)
    few, more = (fx.reduce(mechanism, keep=k, reduction="rubin") for k in (keep, keep + 2))
    n = min(8, few.order)
    assert (hertz(few, n) >= full[:n] * (1 - 1e-7)).all()
    assert (hertz(more, n) <= hertz(few, n) * (1 + 1e-7)).all()


@FEW
@given(mechanisms())
def test_free_interface_with_every_mode_is_the_full_model(mechanism):
    full = hertz(fx.assemble(mechanism), 10)
    every = fx.reduce(mechanism, keep=EVERY_MODE, reduction="rubin")
    np.testing.assert_allclose(hertz(every, len(full)), full, rtol=1e-6)


@FEW
@given(mechanisms())
def test_without_modes_both_methods_are_the_constraint_modes(mechanism):
    one, other = fx.reduce(mechanism), fx.reduce(mechanism, reduction="rubin")
    np.testing.assert_array_equal(one.K, other.K)
    np.testing.assert_array_equal(one.M, other.M)


def test_rubin_s_method_is_reproduced_by_its_own_formulas():
    """Residual flexibility by Rubin's formulas for a substructure that is held, against the basis built otherwise."""
    rng = np.random.default_rng(1)
    n, b, k = 14, 4, 3
    A = rng.normal(size=(n, n))
    K, M = A @ A.T + n * np.eye(n), np.diag(rng.uniform(1, 2, n))
    from flexura.reduction import CraigBampton
    from flexura.reduction.parts import free_interface

    values, phi = la.eigh(K, M)
    residual = np.linalg.inv(K)[:, :b] - phi[:, :k] / values[:k] @ phi[:b, :k].T
    at = np.linalg.inv(residual[:b])
    T = np.hstack([residual @ at, phi[:, :k] - residual @ at @ phi[:b, :k]])
    own = free_interface(CraigBampton(K, M, np.arange(b, n), np.arange(b)), k)
    reference = la.eigh(T.T @ K @ T, T.T @ M @ T, eigvals_only=True)
    np.testing.assert_allclose(la.eigh(own.K, own.M, eigvals_only=True), reference, rtol=1e-9)


def test_six_coordinates_of_the_platform_show_its_six_modes():
    mechanism = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    full = hertz(fx.assemble(mechanism), 6)
    low = fx.reduce(mechanism, keep=2)
    for method, error in (("guyan", 2e-2), ("irs", 1e-4), ("iterated_irs", 2e-6), ("serep", 2e-6)):
        small = fx.models.condense(low, ["platform"], method=method)
        assert small.order == 6 and small.coordinate_names[0] == "platform.tx"
        np.testing.assert_allclose(hertz(small, 6), full, rtol=error)
        np.testing.assert_allclose(small.node_rows(["platform"]), np.eye(6), atol=1e-9)
        assert small.recovery.shape == (1062, 6)


def test_chosen_modes_are_kept_exactly():
    low = fx.reduce(fx.load(EXAMPLES / "rpr" / "rpr.yaml"), keep=2)
    for method in ("serep", "modal"):
        small = fx.models.condense(low, 3, method=method, modes=[2, 5, 9])
        np.testing.assert_allclose(hertz(small, 3), hertz(low, 9)[[1, 4, 8]], rtol=1e-8)
    assert small.coordinate_names == ["mode 2", "mode 5", "mode 9"]


def test_coordinates_are_chosen_among_the_bodies():
    low = fx.reduce(fx.load(EXAMPLES / "rpr" / "rpr.yaml"), keep=2)
    assert {name.partition(".")[0] for name in fx.models.condense(low, 6).coordinate_names} == {"platform"}
    twelve = fx.models.condense(low, 12)
    np.testing.assert_allclose(hertz(twelve, 12), hertz(low, 12), rtol=1e-6)


def test_physical_coordinates_of_a_certified_model():
    mechanism = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    low = fx.reduce(mechanism, tolerance=1e-3, up_to=24.0, coordinates="physical")
    assert low.order == 6 and low.certificate.is_complete
    assert all(name.startswith("platform.") for name in low.coordinate_names)
    np.testing.assert_allclose(hertz(low, 6), low.certificate.frequency_hz, rtol=1e-6)


def test_interface_reduction_converges_from_above():
    mechanism = fx.load(EXAMPLES / "rpr" / "rpr.yaml")
    low = fx.reduce(mechanism, keep=2)
    before = None
    for count in (8, 16, 32, 54):
        small = fx.models.interface_reduction(low, n=count)
        assert small.order == count + low.order - 54
        hz = hertz(small, 6)
        assert (hz >= hertz(low, 6) * (1 - 1e-7)).all()
        assert before is None or (hz <= before * (1 + 1e-9)).all()
        before = hz
    np.testing.assert_allclose(before, hertz(low, 6), rtol=1e-7)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        (lambda low: fx.models.condense(low, ["nowhere"]), "no coordinate"),
        (lambda low: fx.models.condense(low, ["platform", "platform.tx"]), "only once"),
        (lambda low: fx.models.condense(low, 0), "between 1"),
        (lambda low: fx.models.condense(low, 99), "between 1"),
        (lambda low: fx.models.condense(low, 3, method="magic"), "method is one of"),
        (lambda low: fx.models.condense(low, ["rpu1.a.bottom"]), "no coordinate"),
        (lambda low: fx.models.condense(low, ["platform.tz"], method="serep", modes=[1, 2]), "1 coordinates have 1"),
        (lambda low: fx.models.condense(low, 2, method="irs", modes=[1, 2]), "finds its own"),
        (lambda low: fx.models.condense(low, 2, method="modal", modes=[1, 1]), "different modes"),
        (lambda low: fx.models.condense(low, 2, method="modal", modes=[0, 1]), "numbered from 1"),
        (fx.models.interface_reduction, "how many"),
        (lambda low: fx.models.interface_reduction(fx.models.condense(low, 6), n=3), "before other steps"),
        (lambda low: low.compliance(["upr1.b.top"]), "static_at"),
        (
            lambda low: fx.models.condense(low, [f"platform.{dof}" for dof in ("tx", "ty", "tz", "rx", "ry")]),
            "do not distinguish the lowest modes",
        ),
    ],
)
def test_impossible_steps_are_refused(step, words):
    low = fx.reduce(fx.load(EXAMPLES / "rpr" / "rpr.yaml"))
    with pytest.raises(fx.OptionError, match=words):
        step(low)


def test_unknown_reduction_methods_are_refused():
    with pytest.raises(fx.OptionError, match="reduction is one of"):
        fx.reduce(fx.load(EXAMPLES / "pivot" / "pivot.yaml"), reduction="magic")


def test_the_command_line_takes_the_method_of_reduction(capsys):
    import json

    from flexura.cli.app import app

    file = str(EXAMPLES / "pivot" / "pivot.yaml")
    orders = {}
    for method in ("craig_bampton", "rubin"):
        app(["modes", file, "--keep", "1", "--reduction", method, "--json"], standalone_mode=False)
        orders[method] = json.loads(capsys.readouterr().out)["order"]
    mechanism = fx.load(file)
    assert orders == {method: fx.reduce(mechanism, keep=1, reduction=method).order for method in orders}
    assert orders["rubin"] > orders["craig_bampton"]
