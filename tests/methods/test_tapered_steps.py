"""Uniform steps that stand for tapered elements: as many as the section changes, never more than 16."""

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.methods.discrete_models import chained
from flexura.methods.dynamic_stiffness import dynamic_stiffness
from flexura.structure.elements import ElementSlice


def leaf(thicknesses, elements, **more):
    """A clamped leaf, 200 mm long, whose thickness (points,) is tabulated at equal distances."""
    positions = tuple(np.linspace(0.0, 0.2, len(thicknesses)))
    profile = fx.describe.Notch(
        width=0.01, contour=fx.describe.TabulatedContour(positions=positions, thicknesses=thicknesses)
    )
    flexure = fx.describe.Flexure(
        nodes=("a", "b"), material="m", reference="z", profile=profile, elements=elements, integration="tapered"
    )
    return fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        nodes={"a": (0, 0, 0), "b": (0.2, 0, 0)},
        materials={"m": fx.describe.Material(E=2e11, nu=0.3, rho=7800.0)},
        flexures={"leaf": flexure},
        ground={"a": "clamped"},
        **more,
    )


def steps(mechanism, pieces=1):
    (own,) = assemble(mechanism).matrices.values()
    assert isinstance(own.elements, ElementSlice)
    return own.elements.cut(pieces)


def test_a_uniform_element_is_one_step() -> None:
    assert steps(leaf((1e-3, 1e-3), 5)).counts.tolist() == [1] * 5


def test_steps_follow_the_change_of_section() -> None:
    """From 10 mm to 10 um in 600 elements: one step each at the thick end, the most at the thin one."""
    counts = steps(leaf((10e-3, 10e-6), 600)).counts
    assert counts[0] == 1 and counts[-1] == 16 and (np.diff(counts) >= 0).all()
    assert counts.sum() < 1200
    assert steps(leaf((10e-3, 10e-6), 4)).counts.tolist() == [16] * 4


def test_an_element_that_narrows_and_widens_again_is_seen() -> None:
    assert steps(leaf((3e-3, 1e-3, 3e-3), 1)).counts.tolist() == [16]


def test_more_pieces_are_of_the_same_structure() -> None:
    one, three = (steps(leaf((4e-3, 3e-3), 3), pieces) for pieces in (1, 3))
    assert three.counts.tolist() == (3 * one.counts).tolist()
    for field in ("EIz", "mass"):
        own = getattr(one.beam.take(one.kind), field)
        np.testing.assert_array_equal(getattr(three.beam.take(three.kind), field), np.repeat(own, 3))
    assert three.beam.take(three.kind).length.sum() == pytest.approx(0.2)


def test_a_material_without_mass_has_steps() -> None:
    light = leaf((4e-3, 3.9e-3), 8)
    material = light.materials["m"].replaced({"rho": 0.0})
    body = fx.describe.RigidBody(centre=(0.2, 0, 0), mass=1.0, inertia=(1e-3, 1e-3, 1e-3), carries=("b",))
    light = light.replaced({"materials": {"m": material}, "bodies": {"tip": body}})
    assert steps(light).counts.tolist() == steps(leaf((4e-3, 3.9e-3), 8)).counts.tolist()


@pytest.mark.parametrize(("thin", "elements"), [(9e-3, 10), (5e-3, 30), (1e-3, 30)])
def test_frequencies_keep_their_digits(thin, elements) -> None:
    """Against 240 finite elements with the section integrated along them, which know no steps: 2e-5."""
    found = dynamic_stiffness(assemble(leaf((10e-3, thin), elements)), 4).frequency_hz
    fine = assemble(leaf((10e-3, thin), 240))
    expected = np.sqrt(lowest(fine.K, fine.M, 4).values) / (2 * np.pi)
    np.testing.assert_allclose(found, expected, rtol=2e-5)


def test_refused_below_one_piece() -> None:
    with pytest.raises(fx.OptionError, match="at least one piece"):
        chained(assemble(leaf((2e-3, 1e-3), 2)), 1, 0)
