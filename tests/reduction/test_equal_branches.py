"""Equal branches split off exactly: the same spectrum, counts and modes as the undivided problem."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import assemble
from flexura.linalg import count_below, lowest
from flexura.reduction.equal_branches import split
from flexura.reduction.model import STATE

MODULE = import_module("flexura.reduction.equal_branches")
LEAF = {"material": "spring-steel", "reference": "y", "profile": fx.describe.Leaf(width=12e-3, thickness=0.4e-3)}


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small models are split too."""
    monkeypatch.setattr(MODULE, "SPLIT_FROM", 0)
    monkeypatch.setattr(MODULE, "SPLIT_GAIN", 1)


def wheel(copies: int = 9, **changes) -> fx.Mechanism:
    """A platform on equal branches of two leaves at right angles with a block between them."""
    branch = fx.describe.Substructure(
        nodes={"foot": (60e-3, 0, 0), "knee": (60e-3, 0, 40e-3), "top": (25e-3, 0, 40e-3)},
        flexures={
            "post": fx.describe.Flexure(nodes=("foot", "knee"), elements=4, **LEAF),
            "arm": fx.describe.Flexure(nodes=("knee", "top"), elements=3, **LEAF),
        },
        masses={"block": fx.describe.PointMass(node="knee", mass=5e-3)},
        interface=("foot", "top"),
    )
    described = {
        "substructures": {"branch": branch},
        "instances": {"leg": fx.describe.Instance(of="branch", pattern=(fx.describe.CircularPattern(count=copies),))},
        "bodies": {
            "platform": fx.describe.RigidBody(
                centre=(0, 0, 45e-3), mass=0.3, inertia=(1e-4, 1e-4, 2e-4), carries=("leg*.top",)
            )
        },
        "ground": {"leg*.foot": "clamped"},
    }
    return fx.Mechanism(**(described | changes))


def test_the_same_spectrum_as_undivided() -> None:
    model = assemble(wheel())
    apart = split(model)
    assert apart is not None
    assert apart.K.shape[0] < model.order
    whole = lowest(model.K, model.M, 40)
    pairs = apart.lowest(40)
    np.testing.assert_allclose(pairs.values, whole.values, rtol=1e-7)
    X = pairs.vectors
    np.testing.assert_allclose(X.T @ (model.M @ X), np.eye(40), atol=1e-9)
    rayleigh = np.einsum("ik,ik->k", X, model.K @ X)
    np.testing.assert_allclose(rayleigh, pairs.values, rtol=1e-7)
    for value in whole.values[[3, 12, 30]]:
        assert apart.count_below(1.00001 * value) == count_below(model.K, model.M, 1.00001 * value)


def test_the_whole_spectrum_is_there() -> None:
    """Every eigenvalue of the dense problem, as often as it is repeated."""
    model = assemble(wheel(8))
    apart = split(model)
    assert apart is not None
    count = model.order
    expected = lowest(model.K.toarray(), model.M.toarray(), count).values
    found = np.sort(np.concatenate([np.repeat(lowest(K, M, count).values, times) for K, M, times in apart.blocks]))
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_the_rest_moves_in_few_combinations() -> None:
    """With a platform alone: those of one, cos and sin of the angle."""
    apart = split(assemble(wheel(20)))
    assert apart is not None
    (own,) = apart.branches
    assert own.space.shape == (20, 3) and own.copies == 17
    at_rest = own.apart(5)
    np.testing.assert_allclose(at_rest.T @ at_rest, np.eye(5), atol=1e-12)
    np.testing.assert_allclose(own.space.T @ at_rest, 0, atol=1e-12)


def test_mirrored_branches_are_equal() -> None:
    pattern = (fx.describe.CircularPattern(count=8), fx.describe.MirrorPattern(normal=(0, 1, 0)))
    model = assemble(wheel(instances={"leg": fx.describe.Instance(of="branch", pattern=pattern)}))
    apart = split(model)
    assert apart is not None and len(apart.branches[0].dofs) == 16
    np.testing.assert_allclose(apart.lowest(20).values, lowest(model.K, model.M, 20).values, rtol=1e-7)


def test_branches_with_something_of_their_own_are_left_in_one_piece() -> None:
    """A spring to ground at two feet: the others are split off, these two stay with the rest."""
    held = {f"leg{k}.foot": "clamped" for k in range(1, 11)} | {"leg11.foot": "clamped"}
    del held["leg3.foot"]
    springs = {"own": fx.describe.Spring(nodes=("leg3.foot",), stiffness=dict.fromkeys(fx.describe.DOF_NAMES, 1e3))}
    model = assemble(wheel(11, ground=held, springs=springs))
    apart = split(model)
    assert apart is not None and len(apart.branches[0].dofs) == 10
    np.testing.assert_allclose(apart.lowest(15).values, lowest(model.K, model.M, 15).values, rtol=1e-7)


def test_branches_that_are_not_alike_in_numbers_are_not_split() -> None:
    """As under axial forces, which differ from branch to branch."""
    model = assemble(wheel())
    dof = np.flatnonzero([name.startswith("leg4.post") for name in model.dof_names])[0]
    K = model.K.tolil()
    K[dof, dof] *= 1.001
    assert split(replace(model, K=K.tocsc())) is None
    assert split(model) is not None


def test_a_loaded_state_is_said(monkeypatch) -> None:
    """Gravity along the axis presses all branches alike, across it does not."""
    result = fx.modes(wheel(gravity=(0, 0, -9.81)), n=8, order="full")
    assert "equal branches" in result.steps[0] and STATE in result.steps
    sideways = fx.modes(wheel(gravity=(9.81, 0, 0)), n=8, order="full")
    assert sideways.steps == (STATE,)
    monkeypatch.setattr(MODULE, "SPLIT_FROM", 10**9)
    undivided = fx.modes(wheel(gravity=(0, 0, -9.81)), n=8, order="full")
    np.testing.assert_allclose(result.frequency_hz, undivided.frequency_hz, rtol=1e-7)


def test_nothing_to_split() -> None:
    assert split(assemble(wheel(4))) is None
    assert split(assemble(wheel(9, ground={}))) is None  # moves freely


def test_modes_of_the_full_order_are_proven(monkeypatch) -> None:
    result = fx.modes(wheel(), n=12, order="full")
    assert "equal branches" in result.steps[0]
    monkeypatch.setattr(MODULE, "SPLIT_FROM", 10**9)
    undivided = fx.modes(wheel(), n=12, order="full")
    assert not undivided.steps
    np.testing.assert_allclose(result.frequency_hz, undivided.frequency_hz, rtol=1e-7)
    for mode in result.modes:
        low, high = mode.interval_hz
        assert low <= mode.frequency_hz <= high and mode.is_indexed
        assert high - low < 1e-4 * mode.frequency_hz
    for mode, other in zip(result.modes, undivided.modes, strict=True):
        assert mode.interval_hz[0] <= other.frequency_hz <= mode.interval_hz[1]
    assert result.evidence.complete and result.evidence.sturm_count >= 12
    assert result.evidence.full_residual < 1e-6


def test_branches_that_share_nothing_that_moves(monkeypatch) -> None:
    """With the platform held only copies of one branch remain; a low-order model of so many says so."""
    held = {"leg*.foot": "clamped", "platform": "clamped"}
    result = fx.modes(wheel(40, ground=held), n=3, order="full")
    one = fx.modes(wheel(1, ground=held), n=1, order="full")
    np.testing.assert_allclose(result.frequency_hz, one.frequency_hz[0], rtol=1e-9)
    monkeypatch.setattr(import_module("flexura.reduction.certificates"), "MOST_COPIES", 20)
    with pytest.raises(fx.SolverError, match="more than 20 of nearly one frequency"):
        fx.modes(wheel(40, ground=held), n=3)


def test_what_is_not_proven_is_flagged(monkeypatch) -> None:
    proven = fx.modes(wheel(), n=4, order="full")
    assert proven.warnings == () and not any(m.missed or m.is_rigid for m in proven.modes)
    assert proven.tolerance == 1e-3

    def blind(own, n):
        found = certificate(own, n)
        return replace(found, lower_hz=0 * found.lower_hz, is_indexed=found.is_indexed & False, count=found.count + 2)

    certificate = MODULE.SplitModel.certificate
    monkeypatch.setattr(MODULE.SplitModel, "certificate", blind)
    result = fx.modes(wheel(), n=4, order="full")
    assert all(m.missed and m.flag == "not proven" for m in result.modes)
    assert [w.place for w in result.warnings] == ["mode 1", "mode 2", "mode 3", "mode 4", ""]
