"""Refined finite elements: the eigenvalues of usual nodal coordinates, more digits, and the order of convergence."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import flexura as fx
from flexura.beam import element_mass, element_stiffness
from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import (
    Flexure,
    Link,
    Material,
    Mechanism,
    Rectangle,
    RoundNotch,
    SectionConstants,
    with_rigid_bodies,
)
from flexura.methods.discrete_models import chained, convergence, finite_elements
from flexura.structure.segments import segments

E, G, RHO, LENGTH = 70e9, 26e9, 2700.0, 0.2
SECTION = SectionConstants(A=12e-6, Iy=4e-12, Iz=9e-12, J=6e-12)


def bar(elements, ground, theory="euler_bernoulli"):
    """A straight beam along x."""
    return assemble(
        Mechanism(
            theory=theory,
            corrections="none",
            materials={"metal": Material(E=E, G=G, rho=RHO)},
            nodes={"a": (0, 0, 0), "b": (LENGTH, 0, 0)},
            links={
                "bar": Link(nodes=("a", "b"), material="metal", section=SECTION, reference="z", elements=elements),
            },
            ground=ground,
        )
    )


def cantilever(count):
    """Bending frequencies of the cantilever about y: cos(b) cosh(b) = -1 (Blevins 1979, table 8-1)."""
    roots = [
        brentq(lambda b: np.cos(b) * np.cosh(b) + 1, max((k - 0.9) * np.pi, 1.0), (k - 0.1) * np.pi)
        for k in range(1, count + 1)
    ]
    return np.square(roots) / (2 * np.pi * LENGTH**2) * np.sqrt(E * SECTION.Iy / (RHO * SECTION.A))


def nodal(model, pieces, count, steps=16):
    """The same mesh in the usual coordinates: displacements of all nodes."""
    own = segments(model, pieces, steps)
    T = own.transforms
    Tt = np.swapaxes(T, -1, -2)
    K, M = (
        own.scatter().sparse([Tt @ of(own.beam)[own.kind] @ T]) + lumped
        for of, lumped in ((element_stiffness, own.K), (element_mass, own.M))
    )
    return np.sqrt(lowest(K, M, count).values) / (2 * np.pi), K.shape[0]


@pytest.mark.parametrize("name", ["guide", "pivot", "xy_stage", "amplifier"])
@pytest.mark.parametrize("pieces", [1, 3])
def test_same_frequencies_as_nodal_coordinates(name, pieces):
    text = (Path(__file__).parents[2] / "examples" / name / f"{name}.yaml").read_text()
    mechanism = fx.loads(text.replace("integration: tapered", "integration: stepped"))
    # elastic roots are springs between nodes of their own there
    model = assemble(mechanism.replaced({"corrections": ("plate", "warping", "shear", "notch")}))
    usual, order = nodal(model, pieces, 12)
    found = finite_elements(model, 12, pieces)
    assert found.order == order
    np.testing.assert_allclose(found.frequency_hz, usual, rtol=1e-6)


def test_clamped_bar_converges_to_order_four_in_bending():
    """Against the closed form; the mesh of 4 elements cut into 1, 2 and 4."""
    model = bar(4, {"a": "clamped"})
    exact = cantilever(1)[0]
    errors = [finite_elements(model, 1, pieces).frequency_hz[0] / exact - 1 for pieces in (1, 2, 4)]
    assert errors[0] > errors[1] > errors[2] > 0
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 4, atol=0.05)


def test_clamped_bar_converges_to_order_two_in_torsion():
    """Quarter wave, sqrt(G J/(rho (Iy + Iz)))/4 L, of a section that twists more easily than it bends."""
    stiff = SectionConstants(A=12e-6, Iy=4e-8, Iz=9e-8, J=6e-12)
    model = bar(4, {"a": "clamped"})
    link = model.plan.mechanism.links["bar"].model_copy(update={"section": stiff})
    model = assemble(model.plan.mechanism.model_copy(update={"links": {"bar": link}}))
    exact = np.sqrt(G * stiff.J / (RHO * (stiff.Iy + stiff.Iz))) / (4 * LENGTH)
    errors = [finite_elements(model, 1, pieces).frequency_hz[0] / exact - 1 for pieces in (1, 2, 4)]
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2, atol=0.05)


def test_refinement_costs_no_digits():
    """With 256 elements the error of the mesh, 2e-12, is below round-off, which is no larger."""
    fine = finite_elements(bar(4, {"a": "clamped"}), 1, 64).frequency_hz[0]
    assert fine == pytest.approx(cantilever(1)[0], rel=5e-11)


def test_digits_of_short_stiff_elements():
    """The paper's mechanism: refinement changes nothing that counts; nodal coordinates lose digits with each cut."""
    model = assemble(fx.load(Path(__file__).parents[2] / "examples" / "rpr" / "rpr.yaml"))
    coarse, fine = (finite_elements(model, 6, pieces).frequency_hz for pieces in (1, 4))
    np.testing.assert_allclose(fine, coarse, rtol=1e-9)
    usual, _ = nodal(model, 4, 6)
    assert np.abs(usual / coarse - 1).max() > 1e-7  # what the relative coordinates are for


def test_richardson_estimate_is_better_than_the_finest_mesh():
    model = bar(4, {"a": "clamped"})
    exact = cantilever(1)
    f1, f2, f4 = (finite_elements(model, 1, pieces).frequency_hz for pieces in (1, 2, 4))
    seen = convergence(f1, f2, f4)
    assert seen.order[0] == pytest.approx(4, abs=0.1)
    assert abs(seen.frequency_hz[0] / exact[0] - 1) < 0.05 * abs(f4[0] / exact[0] - 1)


def test_order_and_limit_of_a_known_sequence():
    h = np.array([1.0, 0.5, 0.25])[:, None]
    f = 100 * (1 + np.array([2e-3, -3e-4]) * h ** np.array([2.0, 4.0]))
    seen = convergence(*f)
    np.testing.assert_allclose(seen.order, [2, 4], rtol=1e-9)
    np.testing.assert_allclose(seen.frequency_hz, 100, rtol=1e-12)


def test_no_order_is_claimed_from_round_off_or_from_jumps():
    seen = convergence([100.0, 100.0, 100.0], [100.0, 99.0, 101.0], [100.0 * (1 + 1e-13), 97.0, 100.0])
    assert np.isnan(seen.order).all()
    np.testing.assert_array_equal(seen.frequency_hz, [100.0 * (1 + 1e-13), 97.0, 100.0])


def test_free_bar_has_six_rigid_motions():
    found = finite_elements(bar(4, {}), 8, 2)
    assert (found.frequency_hz[:6] == 0).all()
    # cos(b) cosh(b) = 1
    free = 4.730040744862704**2 / (2 * np.pi * LENGTH**2) * np.sqrt(E * SECTION.Iy / (RHO * SECTION.A))
    assert found.frequency_hz[6] == pytest.approx(free, rel=1e-4)


def test_shapes_are_those_of_the_nodes():
    """M-orthonormal, and stationary for the full-order matrices."""
    model = assemble(
        with_rigid_bodies(fx.load(Path(__file__).parents[2] / "examples" / "amplifier" / "amplifier.yaml"))
    )
    own = chained(model)
    pairs = lowest(own.pencil.K, own.pencil.M, 8)
    x = own.recover(pairs.vectors)
    np.testing.assert_allclose(x.T @ (model.M @ x), np.eye(8), atol=1e-7)
    np.testing.assert_allclose(x.T @ (model.K @ x), np.diag(pairs.values), atol=1e-6 * pairs.values[-1])
    names = model.plan.topology.node_names
    shapes = finite_elements(model, 8).shapes
    at = names.index("quarter1.arm[1]")
    rows = [model.dof_names.index(f"quarter1.arm[1].{dof}") for dof in fx.describe.DOF_NAMES]
    np.testing.assert_allclose(np.abs(shapes[at]), np.abs(x[rows]), rtol=1e-6, atol=1e-9)


def test_tapered_elements_keep_their_steps_when_cut():
    """All meshes stand for one structure: they converge to order 2, torsion with it, although sections vary."""
    contour = fx.describe.CircularContour(radius=2e-3, web=1e-3)
    notch = Flexure(nodes=("a", "b"), material="metal", profile=RoundNotch(contour=contour), elements=3)
    bar = Link(nodes=("b", "c"), material="metal", section=Rectangle(width=4e-3, thickness=5e-3), reference="x")
    mechanism = Mechanism(
        theory="timoshenko",
        corrections="none",
        materials={"metal": Material(E=E, G=G, rho=RHO)},
        nodes={"a": (0, 0, 0), "b": (0, 0, 4e-3), "c": (0, 0, 30e-3)},
        flexures={"notch": notch.model_copy(update={"integration": "tapered"})},
        links={"bar": bar},
        ground={"a": fx.describe.Support(fixed=fx.describe.DOF_NAMES)},
    )
    model = assemble(mechanism)
    seen = convergence(*(finite_elements(model, 6, pieces).frequency_hz for pieces in (2, 4, 8)))
    np.testing.assert_allclose(seen.order[3:], 2, atol=0.1)


def test_nothing_that_can_move():
    with pytest.raises(fx.OptionError, match="nothing in this mechanism can move"):
        finite_elements(bar(1, {"a": "clamped", "b": "clamped"}), 1)
    with pytest.raises(fx.OptionError, match="at least one piece"):
        finite_elements(bar(1, {"a": "clamped"}), 1, 0)
