"""The lumped-parameter model against Rayleigh's principle by hand, and its choice of kinematic DOFs."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import Link, Material, Mechanism, Rectangle, RigidBody
from flexura.methods.discrete_models import GAP, lumped_model, lumped_parameter
from helpers.stages import EI, INERTIA, RHO, STAGE_MASS, B, L, T, guide, hertz, leaf, on_leaves, pivot

OWN = RHO * L * B * T
"""Mass of a leaf, kg."""


def load(name):
    return fx.load(Path(__file__).parents[2] / "examples" / name / f"{name}.yaml")


def test_parallel_leaf_guide():
    """13/35 of each leaf moves with the carriage: the static shape between parallel ends, squared and integrated."""
    found = lumped_parameter(assemble(guide(RHO)), 6)
    assert found.order == 1
    assert found.frequency_hz[0] == pytest.approx(hertz(24 * EI / L**3, STAGE_MASS + 2 * OWN * 13 / 35), rel=1e-6)


def test_cross_pivot():
    """Each leaf bends to a circle, v = theta x^2/2L, and adds m L^2/20 to the inertia."""
    found = lumped_parameter(assemble(pivot(RHO)), 6)
    assert found.order == 1
    assert found.frequency_hz[0] == pytest.approx(hertz(2 * EI / L, INERTIA[1] + 2 * OWN * L**2 / 20), rel=1e-6)


@pytest.mark.parametrize(("describe", "name"), [(guide, "stage.tx"), (pivot, "stage.ry")])
def test_kinematic_dofs_are_named(describe, name):
    model = lumped_model(assemble(describe()))
    assert model.names == (name,)
    assert f"kinematic DOFs: {name};" in lumped_parameter(assemble(describe()), 1).note


def test_remote_axis_is_named_with_what_goes_along():
    """The arm of the example turns about the crossing of the leaves, 24 mm below its centre of mass."""
    assert lumped_model(assemble(load("pivot"))).names == ("arm.tx+ry",)


def wire_stage():
    """A stage on three thin round wires along z: x, y and the rotation about z are easy."""
    angles = np.deg2rad([90, 210, 330])
    nodes = {f"{end}{k}": (0.02 * np.cos(a), 0.02 * np.sin(a), z) for end, z in (("g", 0.0), ("e", L))
             for k, a in enumerate(angles)}  # fmt: skip
    wires = {f"wire{k}": leaf((f"g{k}", f"e{k}"), "x", width=0.5e-3, thickness=0.5e-3) for k in range(3)}
    return on_leaves(nodes, wires, (0.0, 0.0, L / 2))


def test_three_wires_leave_three_motions():
    """Hopkins and Culpepper (2010): parallel wire constraints leave two translations and the rotation about them.

    By hand: 3 times 12 EI/L^3, and about z this at 20 mm plus the torsion of the wires.
    """
    found = lumped_parameter(assemble(wire_stage()), 6)
    assert found.order == 3
    assert "stage.tx, stage.ty, stage.rz" in found.note
    stiffness = 36 * 70e9 * 0.5e-3**4 / 12 / L**3
    torsion = 3 * 27e9 * 0.1405770 * 0.5e-3**4 / L  # Timoshenko and Goodier 1970, sec. 109
    expected = [
        hertz(stiffness, STAGE_MASS),
        hertz(stiffness, STAGE_MASS),
        hertz(stiffness * 0.02**2 + torsion, INERTIA[2]),
    ]
    np.testing.assert_allclose(found.frequency_hz, np.sort(expected), rtol=1e-5)


def test_without_a_gap_all_motions_are_kept():
    found = lumped_parameter(assemble(load("rpr")), 6)
    assert found.order == 6
    assert "no gap in the stiffness spectrum" in found.note


@pytest.mark.parametrize("name", ["guide", "pivot", "tip_tilt"])
def test_the_gap_is_where_it_is_said_to_be(name):
    model = lumped_model(assemble(load(name)))
    r, steps = len(model.K), model.spectrum[1:] / model.spectrum[:-1]
    assert (steps[: r - 1] < GAP).all()
    assert r == len(model.spectrum) or steps[r - 1] >= GAP


@pytest.mark.parametrize("name", ["guide", "pivot", "tip_tilt", "xy_stage", "amplifier", "rpr"])
def test_frequencies_are_upper_bounds(name):
    """Every vector of the model is one of the full-order model's (Rayleigh; Courant and Fischer)."""
    full = assemble(load(name))
    found = lumped_parameter(full, 6)
    exact = np.sqrt(lowest(full.K, full.M, len(found.frequency_hz)).values) / (2 * np.pi)
    assert (found.frequency_hz >= exact * (1 - 1e-6)).all()
    x = lumped_model(full)
    np.testing.assert_allclose(x.recovery.T @ (full.M @ x.recovery), x.M, rtol=1e-6, atol=1e-6 * np.abs(x.M).max())


def test_units_of_length_do_not_matter():
    """The same guide a thousand times as large has all frequencies a thousandth."""
    small = guide(RHO)
    large = small.model_copy(
        update={
            "nodes": {k: tuple(1e3 * c for c in v) for k, v in small.nodes.items()},
            "flexures": {
                k: v.model_copy(update={"profile": fx.describe.Leaf(width=1e3 * B, thickness=1e3 * T)})
                for k, v in small.flexures.items()
            },
            "bodies": {
                "stage": small.bodies["stage"].model_copy(
                    update={
                        "centre": tuple(1e3 * c for c in small.bodies["stage"].centre),
                        "mass": 1e9 * STAGE_MASS,
                        "inertia": tuple(1e15 * c for c in INERTIA),
                    }
                )
            },
        }
    )
    one, other = (lumped_model(assemble(m)) for m in (small, large))
    np.testing.assert_allclose(other.spectrum, one.spectrum * 1e-6, rtol=1e-6)
    assert one.names == other.names


def cantilever(**more):
    return Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        materials={"metal": Material(E=70e9, nu=0.3, rho=RHO)},
        nodes={"a": (0, 0, 0), "b": (0.1, 0, 0)},
        links={
            "bar": Link(
                nodes=("a", "b"),
                material="metal",
                section=Rectangle(width=4e-3, thickness=3e-3),
                reference="z",
                elements=4,
            )
        },
        **more,
    )


def test_without_bodies_the_kept_nodes_stand_in():
    """A bare beam: its end. Guyan's reduction to both DOFs of the end gives 3.5327 for 3.5160 (Blevins 1979)."""
    found = lumped_parameter(assemble(cantilever(ground={"a": "clamped"})), 1)
    factor = found.frequency_hz[0] * 2 * np.pi / np.sqrt(70e9 * 4e-3 * 3e-3**3 / 12 / (RHO * 12e-6 * 0.1**4))
    K, M = np.array([[12, -6], [-6, 4]]), np.array([[156, -22], [-22, 4]]) / 420
    exact = np.sqrt(lowest(K.astype(float), M, 1).values[0])
    assert exact == pytest.approx(3.5327, abs=1e-4)
    assert factor == pytest.approx(exact, rel=1e-2)
    assert factor >= 3.5160


def test_a_free_mechanism_keeps_its_rigid_motions():
    found = lumped_parameter(assemble(load("guide").model_copy(update={"ground": {}})), 6)
    assert (found.frequency_hz[:6] == 0).all()


def test_what_moves_freely_beside_the_bodies_is_refused():
    """A body on ground by a spring, and a bar tied to it by a hinge alone."""
    stage = {"stage": RigidBody(centre=(0, 0, 0), mass=1.0, inertia=(1e-3, 1e-3, 1e-3))}
    springs = {
        "k": fx.describe.Spring(
            nodes=("stage",), stiffness=fx.describe.DiagonalStiffness(tx=1, ty=1, tz=1, rx=1, ry=1, rz=1)
        ),
        "hinge": fx.describe.Spring(
            nodes=("stage", "a"), stiffness=fx.describe.DiagonalStiffness(tx=1, ty=1, tz=1, rx=1, ry=1)
        ),
    }
    with pytest.raises(fx.SolverError, match="moves freely beside the rigid bodies"):
        lumped_parameter(assemble(cantilever(bodies=stage, springs=springs)), 1)


def test_everything_held_is_refused():
    held = {"a": "clamped", "b": "clamped"}
    with pytest.raises(fx.OptionError, match="is held"):
        lumped_parameter(assemble(cantilever(ground=held)), 1)
