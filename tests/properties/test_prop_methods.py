"""What the other methods must keep for every mechanism: refined elements in relative coordinates have the eigenvalues
of nodal ones, and pseudo-rigid bodies the mass and the rigid motions of the whole."""

import numpy as np
from hypothesis import assume, given

from flexura.beam import element_mass, element_stiffness, rigid_arm
from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.methods.discrete_models import chained, pseudo_rigid_body_model
from flexura.structure.segments import segments
from helpers.random_mechanisms import FEW, mechanisms

RIGID_ROOTS = ("plate", "warping", "shear", "notch")
"""Corrections without the roots, whose springs the nodal mesh has between nodes of their own."""

STEPS = 3
"""Uniform segments of a tapered element."""


def nodal(model):
    """Return K and M of all segments in the displacements of all nodes."""
    own = segments(model, 1, STEPS)
    T = own.transforms
    Tt = np.swapaxes(T, -1, -2)
    return (
        own.scatter().sparse([Tt @ of(own.beam)[own.kind] @ T]) + lumped
        for of, lumped in ((element_stiffness, own.K), (element_mass, own.M))
    )


@FEW
@given(mechanisms())
def test_relative_coordinates_have_the_same_eigenvalues(mechanism):
    model = assemble(mechanism.replaced({"corrections": RIGID_ROOTS}))
    own = chained(model, 1, STEPS)
    usual = lowest(*nodal(model), 10)
    np.testing.assert_allclose(lowest(own.pencil.K, own.pencil.M, 10).values, usual.values, rtol=1e-6)


@FEW
@given(mechanisms())
def test_cut_elements_lower_every_frequency(mechanism):
    """The displacements of a mesh contain those of the mesh it was cut from, and the structure is the same."""
    model = assemble(mechanism)
    whole, cut = (chained(model, pieces, STEPS) for pieces in (1, 2))
    before, after = (np.sqrt(lowest(own.pencil.K, own.pencil.M, 10).values) for own in (whole, cut))
    assert (after[: len(before)] <= before * (1 + 1e-8)).all()


@FEW
@given(mechanisms(grounded=False))
def test_pseudo_rigid_bodies_weigh_as_the_whole(mechanism):
    assume(mechanism.flexures)
    model = assemble(mechanism)
    own = pseudo_rigid_body_model(model)
    rigid = model.rigid_body_motions()
    motions = rigid_arm(model.geometry.positions[own.bodies.reference]).reshape(-1, 6)
    np.testing.assert_allclose(own.recovery @ motions, rigid, atol=1e-9)
    mass = rigid.T @ (model.M @ rigid)
    scale = np.sqrt(np.outer(np.diag(mass), np.diag(mass)))
    assert (np.abs(motions.T @ (own.M @ motions) - mass) <= 1e-2 * scale).all()  # tapered sections are stepped
    assert np.abs(own.K @ motions).max() <= 1e-9 * (abs(model.K) @ abs(rigid)).max()
