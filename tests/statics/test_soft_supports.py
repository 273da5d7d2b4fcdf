"""Supports that are softer than what they hold by many decades: static answers keep their digits or say so."""

import numpy as np
import pytest

import flexura as fx


def suspended(k: float) -> fx.Mechanism:
    """A heavy base on a spring of stiffness k in all directions carries a head on a stiff leaf."""
    leaf = fx.describe.Flexure(
        nodes=("a", "b"),
        material="spring-steel",
        reference="x",
        elements=100,
        profile=fx.describe.Leaf(width=20e-3, thickness=0.5e-3),
    )
    inertia = (1e-2, 1e-2, 1e-2)
    return fx.Mechanism(
        nodes={"a": (0, 0, 0), "b": (0, 0, 50e-3)},
        flexures={"leaf": leaf},
        bodies={
            "base": fx.describe.RigidBody(centre=(0, 0, -5e-3), mass=10.0, inertia=inertia, carries=("a",)),
            "head": fx.describe.RigidBody(centre=(0, 0, 55e-3), mass=1.0, inertia=inertia, carries=("b",)),
        },
        springs={
            "mount": fx.describe.Spring(
                nodes=("base",), stiffness=dict.fromkeys(("tx", "ty", "tz", "rx", "ry", "rz"), k)
            )
        },
    )


@pytest.mark.parametrize("k", [1e6, 1e2, 1.0, 1e-2, 1e-4])
def test_a_suspended_mass_moves_as_its_spring_says(k):
    design = suspended(k)
    load = {"base": (0, 0, 1.0, 0, 0, 0)}
    assert fx.statics(design, loads=load).displacement("base")[2] == pytest.approx(1 / k, rel=1e-6)
    assert fx.compliance(design, nodes=["base"])[2, 2] == pytest.approx(1 / k, rel=1e-6)
    still = 1e-6 * np.sqrt(k)
    for how in ({"order": "full"}, {"order": "full", "method": "direct"}):
        found = fx.frequency_response(design, frequency_hz=[still], inputs=["base.tz"], outputs=["base.tz"], **how)
        off = abs(found.response.item() * k - 1)
        assert off < 1e-6 or off < sum(w.value for w in found.warnings if w.kind == "proof")
        assert how.get("method") == "direct" or off < 1e-6


def test_what_round_off_hides_is_refused():
    with pytest.raises(fx.SolverError, match="move freely"):
        fx.statics(suspended(1e-9), loads={"base": (0, 0, 1.0, 0, 0, 0)})


def test_soft_modes_of_a_full_order_system_are_not_zero():
    """Along the leaf everything moves as one on the mount."""
    design = suspended(1e-3)
    hz = fx.system(design, order="full").modal(6).frequency_hz
    expected = np.sqrt(1e-3 / fx.check(design).mass.mass) / (2 * np.pi)
    assert np.abs(hz / expected - 1).min() < 1e-6
    np.testing.assert_allclose(hz, fx.modes(design, n=6).frequency_hz, rtol=1e-6)


def test_forces_on_coordinates_are_the_adjoint_of_displacements():
    from flexura.reduction.chained_model import chained

    model = fx.assemble(suspended(1e3))
    own, rng = chained(model), np.random.default_rng(3)
    f, y = rng.standard_normal((model.order, 2)), rng.standard_normal((own.pencil.order, 2))
    np.testing.assert_allclose(own.forces(f).T @ y, f.T @ own.recover(y), rtol=1e-10)
