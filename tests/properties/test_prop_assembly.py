"""What assembly must keep for every mechanism: symmetry, definiteness, rigid motions, inertia, and its many rewritings.

Frequencies of two descriptions of one mechanism agree to 1e-7: stiffnesses spread over ten decades, so that round-off
of the entries reaches the eighth digit.
"""

import numpy as np
import scipy.linalg as la
from hypothesis import assume, given
from hypothesis import strategies as st

from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import Instance, Mechanism, Rotation, Substructure, with_rigid_bodies
from helpers.flat_meshes import about, flatten, renamed, rigid_mass, scaled, split
from helpers.random_mechanisms import FEW, mechanisms, vector

SAME = 1e-7
angles = st.floats(-3, 3)
seeds = st.integers(0, 2**32 - 1)


def hertz(model, count=10):
    """Return the lowest frequencies, Hz."""
    return np.sqrt(lowest(model.K, model.M, count).values) / (2 * np.pi)


def unit_diagonal(A, by=None):
    """Return a dense matrix scaled by the square roots of its own, or another's, diagonal."""
    A = A.toarray()
    d = 1 / np.sqrt(np.diagonal(A if by is None else by.toarray()))
    return A * np.outer(d, d)


def same_frequencies(one, other, factor=1.0):
    """Assert that two mechanisms have the same frequencies, up to a factor."""
    np.testing.assert_allclose(hertz(assemble(one)), factor * hertz(assemble(other)), rtol=SAME)


@FEW
@given(mechanisms())
def test_matrices_are_symmetric_and_positive_definite(mechanism):
    model = assemble(mechanism)
    for A in (model.K, model.M):
        assert abs(A - A.T).max() <= 1e-12 * abs(A).max()
        assert la.eigvalsh(unit_diagonal(A)).min() > 0


@FEW
@given(mechanisms(grounded=False))
def test_ungrounded_stiffness_has_six_rigid_motions_and_no_more(mechanism):
    model = assemble(mechanism)
    rigid = model.rigid_body_motions()
    K = unit_diagonal(model.K)
    assert la.eigvalsh(K).min() > -1e-12
    d = np.sqrt(model.K.diagonal())[:, None]
    force = (model.K @ rigid) / d
    assert np.linalg.norm(force) <= 1e-9 * np.linalg.norm(d * rigid)
    values = lowest(model.K, model.M, 7).values
    assert (values[:6] == 0).all() and values[6] > 0


@FEW
@given(mechanisms(grounded=False))
def test_mass_and_inertia_of_rigid_motions_are_exact(mechanism):
    model = assemble(mechanism)
    rigid = model.rigid_body_motions()
    direct = rigid_mass(flatten(mechanism))
    scale = 1 / np.sqrt(np.diagonal(direct))
    difference = (rigid.T @ (model.M @ rigid) - direct) * np.outer(scale, scale)
    assert abs(difference).max() < 1e-9


def uncorrected(mechanism):
    """Leave corrections out: an interface holds end sections flat, the same node inside a part may not."""
    return mechanism.model_copy(update={"corrections": "none"})


@FEW
@given(mechanisms(nested=True))
def test_nested_instances_are_the_same_as_their_parts_laid_out_flat(mechanism):
    plain = with_rigid_bodies(uncorrected(mechanism))
    same_frequencies(plain, flatten(plain))


@FEW
@given(mechanisms(), angles, seeds)
def test_frequencies_do_not_depend_on_place_or_orientation(mechanism, angle, seed):
    rng = np.random.default_rng(seed)
    fields = {name: getattr(mechanism, name) for name in Substructure.model_fields}
    fields["interface"] = tuple(mechanism.ground)
    turn = Rotation(axis=vector(rng, 1.0), angle=angle)
    placed = Mechanism(
        instances={"placed": Instance(of="whole", rotate=turn, at=vector(rng, 0.3))},
        substructures={**mechanism.substructures, "whole": Substructure(**fields)},
        ground={f"placed.{node}": "clamped" for node in mechanism.ground},
        materials=mechanism.materials,
        theory=mechanism.theory,
    )
    same_frequencies(mechanism, placed)


@FEW
@given(mechanisms(), seeds)
def test_mirror_images_have_the_same_frequencies(mechanism, seed):
    rng = np.random.default_rng(seed)
    n = np.array(vector(rng, 1.0))
    mirror = np.eye(3) - 2 * np.outer(n, n) / (n @ n)
    plain = with_rigid_bodies(uncorrected(mechanism))
    same_frequencies(plain, flatten(plain, (mirror, np.array(vector(rng, 0.1)))))


@FEW
@given(mechanisms())
def test_frequencies_do_not_depend_on_names_and_order(mechanism):
    flat = flatten(mechanism)
    same_frequencies(flat, renamed(flat, lambda name: f"z_{name[::-1]}"))


@FEW
@given(mechanisms(), st.sampled_from([1e-3, 0.1, 25.4, 1e3]))
def test_frequencies_go_with_the_inverse_of_size(mechanism, s):
    same_frequencies(mechanism, scaled(mechanism, s), factor=s)


@FEW
@given(mechanisms(nested=False))
def test_a_link_may_be_split_in_two(mechanism):
    # corrections look at the members next to a flexure, which splitting changes
    flat = flatten(mechanism).model_copy(update={"corrections": "none"})
    even = [name for name, link in flat.links.items() if link.elements % 2 == 0]
    assume(even)
    same_frequencies(flat, split(flat, even[0]))


@FEW
@given(mechanisms(grounded=False), angles)
def test_rigid_motions_displace_every_node_rigidly(mechanism, angle):
    model = assemble(mechanism)
    u = model.node_displacements(model.rigid_body_motions())
    x = model.geometry.positions
    for axis in range(3):
        turned = np.cross(np.eye(3)[axis], x)
        np.testing.assert_allclose(u[:, :3, 3 + axis], turned, atol=1e-12)
        np.testing.assert_allclose(u[:, :3, axis], np.tile(np.eye(3)[axis], (len(x), 1)), atol=1e-12)


def test_the_rotation_of_the_rewriting_is_right_handed():
    np.testing.assert_allclose(about((0, 0, 1), np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)
