"""Solid finite elements, ties and solvers against closed forms and dense algebra.

Closed forms: masses and inertias of boxes; integrals of barycentric coordinates over a tetrahedron; elastic waves
standing between frictionless rigid walls, an exact solution of three-dimensional elasticity; an end-loaded bar.
The leaf with a block stands on frequencies of meshes of quadratic tetrahedra made and solved apart from this project.
"""

from __future__ import annotations

from itertools import product
from math import factorial

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp

import flexura as fx
from flexura.errors import OptionError, SolverError
from flexura.fem.geometry import SolidMaterial
from flexura.fem.matrices import averaged_rows, elastic_matrices, face_products, mesh_mass
from flexura.fem.reduced import constraint_modes
from flexura.fem.solid_mesh import CELLS, SolidMesh, face_rule, faces_of, quadrature, rigid_motions, shape_of
from flexura.linalg import Pencil, factor, residuals
from flexura.linalg.eigen import ShiftInvert
from flexura.linalg.factor import available_memory, factorise_large
from flexura.mechanism import Flexure, Leaf, Material, Mechanism, RigidBody
from helpers.direct_solids import lowest_modes, negative_count
from helpers.solid_boxes import ALUMINIUM, KUHN, box, distorted, leaf_and_block, mesh_of
from helpers.solid_wholes import set_ties, with_discrete_elements

KINDS = [*CELLS]


def dofs(points):
    return (3 * np.asarray(points)[:, None] + np.arange(3)).ravel()


def without(mesh, K, M, held):
    free = np.setdiff1d(np.arange(mesh.order), held)
    return K[free][:, free], M[free][:, free]


def one_cell(kind, curved, seed=3):
    """Return a skewed cell, with its points moved off their straight places where `curved`."""
    rng = np.random.default_rng(seed)
    points = shape_of(kind).points @ (np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3))) + [0.3, -0.2, 0.5]
    points = points + curved * 0.04 * rng.uniform(-1, 1, points.shape)
    return mesh_of(kind, points, np.arange(len(points))[None])


@pytest.mark.parametrize("kind", KINDS)
def test_shapes_are_one_at_their_own_point_and_sum_to_one(kind):
    shape = shape_of(kind)
    assert np.allclose(shape.values(shape.points), np.eye(CELLS[kind]), atol=1e-13)
    xi = np.random.default_rng(0).uniform(0, 0.5, (5, 3))
    assert np.allclose(shape.values(xi).sum(axis=1), 1, atol=1e-13)
    step = 1e-6
    for k, e in enumerate(np.eye(3)):
        slope = (shape.values(xi + step * e) - shape.values(xi - step * e)) / (2 * step)
        assert np.allclose(shape.gradients(xi)[:, k], slope, atol=1e-8)


@pytest.mark.parametrize("points", [2, 3, 4, 5])
def test_tetrahedral_rules_integrate_polynomials_of_their_degree(points):
    xi, w = quadrature("tetra10", points)
    degree = 2 * points - 1 if points > 2 else 2
    for a, b, c in product(range(degree + 1), repeat=3):
        if a + b + c <= degree:
            exact = factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3)
            assert w @ (xi[:, 0] ** a * xi[:, 1] ** b * xi[:, 2] ** c) == pytest.approx(exact, rel=1e-12)


def test_mass_of_a_straight_tetrahedron_is_that_of_barycentric_integrals():
    corners = np.random.default_rng(1).uniform(-1, 1, (4, 3))
    six_volumes = np.linalg.det(corners[1:] - corners[0])
    corners = corners if six_volumes > 0 else corners[[1, 0, 2, 3]]
    pairs = [(0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    points = np.array([(corners[a] + corners[b]) / 2 for a, b in pairs])

    def polynomial(a, b):
        """Terms of a shape function: factor and powers of the barycentric coordinates."""
        power = np.zeros(4, int)
        if a == b:
            single = power.copy()
            single[a] = 1
            return [(2.0, 2 * single), (-1.0, single)]
        power[[a, b]] = 1
        return [(4.0, power)]

    def integral(power):
        return np.prod([factorial(p) for p in power]) / factorial(power.sum() + 3) * abs(six_volumes)

    exact = np.array(
        [
            [sum(f * g * integral(p + q) for f, p in polynomial(*one) for g, q in polynomial(*two)) for two in pairs]
            for one in pairs
        ]
    )
    _, M = elastic_matrices(mesh_of("tetra10", points, np.arange(10)[None]))
    assert np.allclose(M.toarray()[1::3, 1::3], ALUMINIUM.rho * exact, rtol=0, atol=1e-12 * ALUMINIUM.rho * exact.max())
    assert not M.toarray()[::3, 1::3].any()


@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_cell_has_six_zero_motions_and_its_mass_and_inertia(kind, curved):
    mesh = one_cell(kind, curved)
    K, M = elastic_matrices(mesh)
    assert isinstance(K, sp.csc_matrix) and isinstance(M, sp.csc_matrix)
    assert abs(K - K.T).max() == 0 and abs(M - M.T).max() == 0
    values = np.linalg.eigvalsh(K.toarray()) / abs(K).max()
    assert np.abs(values[:6]).max() < 1e-14 and values[6] > 1e-3
    assert np.linalg.eigvalsh(M.toarray())[0] > 0
    R = rigid_motions(mesh.points)
    assert np.abs(K @ R).max() < 1e-14 * abs(K).max()
    body = mesh_mass(mesh)
    about = rigid_motions(mesh.points, body.centre)
    expected = np.zeros((6, 6))
    expected[:3, :3], expected[3:, 3:] = body.mass * np.eye(3), body.inertia
    assert np.allclose(about.T @ (M @ about), expected, rtol=0, atol=1e-12 * body.mass)


@pytest.mark.parametrize("kind", KINDS)
def test_box_has_the_mass_and_inertia_of_a_box(kind):
    a, b, c = 0.3, 0.2, 0.1
    body = mesh_mass(distorted(box(kind, (a, b, c), (3, 2, 2)), 0.2))
    mass = ALUMINIUM.rho * a * b * c
    assert body.volume == pytest.approx(a * b * c, rel=1e-13)
    assert body.mass == pytest.approx(mass, rel=1e-13)
    assert body.centre == pytest.approx([a / 2, b / 2, c / 2], rel=1e-13)
    inertia = mass / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert np.allclose(body.inertia, inertia, rtol=0, atol=1e-13 * inertia.max())


@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_patch_of_distorted_cells_carries_constant_stress(kind, curved):
    mesh = distorted(box(kind, (1.0, 0.8, 0.6), (2, 2, 2)), 0.3)
    surface = np.unique(np.concatenate([*mesh.point_sets.values()]))
    inner = np.setdiff1d(np.arange(len(mesh.points)), surface)
    if curved:
        moved = mesh.points.copy()
        moved[inner] += 0.01 * np.random.default_rng(5).uniform(-1, 1, (len(inner), 3))
        mesh = SolidMesh(moved, mesh.cells, mesh.cell_materials, mesh.materials, mesh.point_sets)
    slope = np.random.default_rng(2).uniform(-1e-3, 1e-3, (3, 3))
    exact = (mesh.points @ slope.T).ravel()
    K, _ = elastic_matrices(mesh)
    fixed, free = dofs(surface), dofs(inner)
    u = exact.copy()
    u[free] = -factorise_large(K[free][:, free]).solve(K[free][:, fixed] @ exact[fixed])
    assert np.abs(u - exact).max() < 1e-12 * np.abs(exact).max()


def walls(mesh):
    """DOFs that frictionless walls around a box hold."""
    return np.concatenate([3 * mesh.point_sets[axis + end] + k for k, axis in enumerate("xyz") for end in "01"])


@pytest.mark.parametrize("kind", KINDS)
def test_standing_waves_between_frictionless_walls_converge_with_order_four(kind):
    # shear waves of two and three half waves, pressure waves of one: 2, 2, 2, 3, 3 and 2 (1 - nu) / (1 - 2 nu), thrice
    side, errors = 0.1, []
    shear = ALUMINIUM.E / 2 / (1 + ALUMINIUM.nu)
    pressure = 2 * (1 - ALUMINIUM.nu) / (1 - 2 * ALUMINIUM.nu)
    exact = np.sqrt(np.array([2, 2, 2, 3, 3, pressure, pressure, pressure]) * shear / ALUMINIUM.rho) / (2 * side)
    for n in (2, 4):
        mesh = box(kind, (side,) * 3, (n, n, n))
        found = lowest_modes(*without(mesh, *elastic_matrices(mesh), walls(mesh)), 8)
        assert found.missing == 0 and found.residuals.max() < 1e-8
        errors.append(found.frequency_hz / exact - 1)
    assert (errors[1] > 0).all() and errors[1].max() < 1.5e-2
    order = np.log2(errors[0] / errors[1])
    assert order.min() > 3.0


@pytest.mark.parametrize("kind", KINDS)
def test_bar_under_tension_stretches_by_closed_form(kind):
    L, side, force = 0.1, 0.02, 300.0
    mesh = distorted(box(kind, (L, side, side), (3, 2, 2)), 0.2)
    K, _ = elastic_matrices(mesh)
    load = np.zeros(mesh.order)
    load[::3] = face_products(mesh, mesh.point_sets["x1"]) @ np.ones(len(mesh.points)) * force / side**2
    assert load.sum() == pytest.approx(force, rel=1e-13)
    held = np.concatenate([3 * mesh.point_sets[axis + "0"] + k for k, axis in enumerate("xyz")])
    free = np.setdiff1d(np.arange(mesh.order), held)
    u = np.zeros(mesh.order)
    u[free] = factorise_large(K[free][:, free]).solve(load[free])
    strain = force / side**2 / ALUMINIUM.E
    assert np.allclose(u.reshape(-1, 3), mesh.points * strain * [1, -0.33, -0.33], rtol=0, atol=1e-11 * strain * L)


@pytest.mark.slow
def test_leaf_with_a_block_converges_to_its_known_frequencies():
    known = np.array([127.1, 607.0, 1399.0, 3696.0])
    found = []
    for leaf, layers in (((6, 6, 1), 2), ((12, 12, 1), 4), ((18, 20, 1), 4)):
        mesh = leaf_and_block("hexahedron20", leaf, layers)
        assert mesh_mass(mesh).mass == pytest.approx(2810 * (10e-3 * 10e-3 * 8.3e-3), rel=1e-12)
        K, M = without(mesh, *elastic_matrices(mesh), dofs(mesh.point_sets["clamped"]))
        found.append(lowest_modes(K, M, 4).frequency_hz)
    error = np.array(found) / known - 1
    assert (error[0] > error[1]).all() and (error[1] > error[2]).all()
    assert np.abs(error[2]).max() < 3e-3


def test_mixed_kinds_add_up():
    a, b = (box(kind, (1, 1, 1), (1, 1, 1)) for kind in ("tetra10", "hexahedron20"))
    shifted = b.points + np.array([2.0, 0, 0])
    stiff = SolidMaterial("steel", 2e11, 0.3, 7800.0)
    both = SolidMesh(
        np.vstack([a.points, shifted]),
        {"tetra10": a.cells["tetra10"], "hexahedron20": b.cells["hexahedron20"] + len(a.points)},
        {"tetra10": np.zeros(len(KUHN), int), "hexahedron20": np.ones(1, int)},
        (ALUMINIUM, stiff),
    )
    alone = elastic_matrices(mesh_of("hexahedron20", shifted, b.cells["hexahedron20"], material=stiff))
    for whole, one, two in zip(elastic_matrices(both), elastic_matrices(a), alone, strict=True):
        assert abs(whole - sp.block_diag([one, two])).max() <= 1e-15 * abs(whole).max()


def test_impossible_meshes_are_refused():
    good = box("tetra10", (1, 1, 1), (1, 1, 1))
    cells = good.cells["tetra10"]
    with pytest.raises(OptionError, match="turned over"):
        elastic_matrices(mesh_of("tetra10", good.points * [1, 1, -1], cells))
    with pytest.raises(OptionError, match="belong to no cell"):
        elastic_matrices(mesh_of("tetra10", np.vstack([good.points, [2.0, 2, 2]]), cells))
    with pytest.raises(OptionError, match="outside"):
        elastic_matrices(mesh_of("tetra10", good.points[:-1], cells))
    with pytest.raises(OptionError, match="shape"):
        elastic_matrices(mesh_of("hexahedron20", good.points, cells))
    with pytest.raises(OptionError, match="at least one cell"):
        elastic_matrices(mesh_of("tetra10", good.points, cells[:0]))
    with pytest.raises(OptionError, match=r"nu 0\.5"):
        elastic_matrices(mesh_of("tetra10", good.points, cells, material=SolidMaterial("rubber", 1e6, 0.5, 1e3)))
    with pytest.raises(OptionError, match="kinds"):
        shape_of("wedge15")


@pytest.mark.parametrize("kind", KINDS)
def test_faces_close_the_cell(kind):
    # the area vectors of all faces sum to zero, and a third of the flux of x is the volume
    mesh = one_cell(kind, True)
    total, flux, shape = np.zeros(3), 0.0, shape_of(kind)
    for number, local in enumerate(faces_of(kind)):
        xi, tangents, w = face_rule(kind, number)
        one, two = np.einsum("ti,qij->tqj", tangents, shape.gradients(xi) @ mesh.points)
        x, n = shape.values(xi)[:, local] @ mesh.points[local], np.cross(one, two)
        n *= np.sign(np.einsum("qi,qi->", n, x - mesh.points.mean(axis=0)))
        total += w @ n
        flux += w @ np.einsum("qi,qi->q", n, x)
    assert np.abs(total).max() < 1e-13
    assert flux / 3 == pytest.approx(mesh_mass(mesh).volume, rel=1e-12)


@pytest.mark.parametrize("name", ["x1", "a block of points"])
@pytest.mark.parametrize("kind", KINDS)
def test_averages_of_rigid_motions_are_these(kind, name):
    mesh = box(kind, (0.1, 0.02, 0.01), (2, 2, 1))
    points = mesh.point_sets["x1"] if name == "x1" else np.arange(1, 5)
    about = np.array([0.11, 0.02, -0.01])
    C = averaged_rows(mesh, points, about)
    assert np.allclose(C @ rigid_motions(mesh.points, about), np.eye(6), rtol=0, atol=1e-10)
    assert set(C.nonzero()[1] // 3) <= set(points)


def test_average_of_a_face_is_the_mean_over_its_area():
    # of u_z = y^2 over 0 < y < b: mean b^2 / 3; rotation about x, moment b^3 / 12 over the second moments of the face
    b = 0.02
    mesh = box("hexahedron20", (0.1, b, 0.01), (1, 3, 2))
    u = np.zeros((len(mesh.points), 3))
    u[:, 2] = mesh.points[:, 1] ** 2
    found = averaged_rows(mesh, mesh.point_sets["x1"], (0.1, b / 2, 0.005)) @ u.ravel()
    assert found == pytest.approx([0, 0, b**2 / 3, b * b**2 / 12 / (b**2 / 12 + 0.01**2 / 12), 0, 0], abs=1e-15)


def test_points_on_a_line_are_refused():
    mesh = box("tetra10", (1, 1, 1), (1, 1, 1))
    line = np.flatnonzero((mesh.points[:, 0] == 0) & (mesh.points[:, 1] == 0))
    with pytest.raises(OptionError, match="line"):
        averaged_rows(mesh, line, (0, 0, 0))


@pytest.mark.parametrize("how", ["rigid", "averaged"])
def test_ties_keep_rigid_motions_and_the_rest_free(how):
    mesh = box("tetra10", (0.1, 0.02, 0.01), (3, 2, 1))
    places = {"x0": (-0.01, 0.0, 0.0), "x1": (0.1, 0.01, 0.02)}
    ties = set_ties(mesh, places, how)
    q = np.zeros((ties.T.shape[1], 6))
    R = rigid_motions(mesh.points)
    q[: len(ties.free)] = R[ties.free]
    for k, place in enumerate(places.values()):
        six = np.eye(6)
        six[:3, 3:] = rigid_motions(np.array([place]))[:, 3:]
        q[ties.boundary[6 * k : 6 * k + 6]] = six
    assert np.allclose(ties.T @ q, R, rtol=0, atol=1e-12)
    assert np.array_equal((ties.T @ q)[ties.free], q[: len(ties.free)])
    tied = 2 * 3 * len(mesh.point_sets["x0"]) if how == "rigid" else 12
    assert len(ties.free) == mesh.order - tied
    if how == "averaged":
        rng = np.random.default_rng(0).uniform(-1, 1, ties.T.shape[1])
        for k, (name, place) in enumerate(places.items()):
            mean = averaged_rows(mesh, mesh.point_sets[name], place) @ (ties.T @ rng)
            assert np.allclose(mean, rng[ties.boundary[6 * k : 6 * k + 6]], rtol=0, atol=1e-10)


def test_a_rigid_face_is_stiffer_than_an_averaged_one():
    mesh = box("hexahedron20", (0.02, 0.02, 0.01), (3, 3, 1))
    K, M = elastic_matrices(mesh)
    lowest = {}
    for how in ("rigid", "averaged"):
        ties = set_ties(mesh, {"x1": (0.02, 0.01, 0.005)}, how)
        hold = np.searchsorted(ties.free, dofs(mesh.point_sets["x0"]))
        T = ties.T[:, np.setdiff1d(np.arange(ties.T.shape[1]), hold)]
        lowest[how] = lowest_modes(T.T @ K @ T, T.T @ M @ T, 3).frequency_hz
    free = lowest_modes(*without(mesh, K, M, dofs(mesh.point_sets["x0"])), 3).frequency_hz
    assert (lowest["rigid"] > lowest["averaged"] * (1 + 1e-6)).all()
    assert lowest["averaged"] == pytest.approx(free, rel=1e-9)


def test_shared_points_follow_the_first_rigid_face_and_no_other():
    mesh = box("tetra10", (1, 1, 1), (1, 1, 1))
    places = {"x0": (0, 0, 0), "y0": (1, 0, 0)}
    ties = set_ties(mesh, places)
    shared = dofs(np.intersect1d(*(mesh.point_sets[name] for name in places)))
    assert len(shared) and not ties.T[shared][:, ties.boundary[6:]].nnz
    with pytest.raises(OptionError, match="share points"):
        set_ties(mesh, places, "averaged")
    with pytest.raises(OptionError, match="rigid, averaged or flexible"):
        set_ties(mesh, places, "loose")


def stage(theory="timoshenko"):
    """A slender bar from a clamped node to a body whose centre lies beyond and beside its end."""
    bar = Flexure(nodes=("a", "b"), material="metal", reference=(0, 0, 1), profile=Leaf(width=4e-3, thickness=3e-3))
    body = RigidBody(centre=(0.112, 0.004, 0.003), carries=("b", "far"), mass=0.05, inertia=(2e-5, 3e-5, 4e-5))
    E, nu = ALUMINIUM.E, ALUMINIUM.nu
    return Mechanism(
        theory=theory,
        corrections="none",
        materials={"metal": Material(E=E, G=E / 2 / (1 + nu), rho=ALUMINIUM.rho)},
        nodes={"a": (0, 0, 0), "b": (0.1, 0, 0), "far": (0.13, 0.01, 0)},
        flexures={"bar": bar.model_copy(update={"elements": 20})},
        bodies={"stage": body},
        ground={"a": "clamped"},
    )


def stage_mesh():
    mesh = box("hexahedron20", (0.1, 4e-3, 3e-3), (12, 2, 2))
    return SolidMesh(mesh.points - [0, 2e-3, 1.5e-3], mesh.cells, mesh.cell_materials, mesh.materials, mesh.point_sets)


@pytest.mark.parametrize("how", ["rigid", "averaged"])
def test_solid_bar_with_the_discrete_elements_of_the_beam_model_has_its_frequencies(how):
    model = fx.assemble(stage())
    system = with_discrete_elements(stage_mesh(), model, {"x0": "a", "x1": "b"}, how)
    assert system.K.shape == (system.n_free + 6,) * 2
    found = lowest_modes(system.K, system.M, 5)
    beam = fx.modes(stage(), n=5, order="full")
    error = found.frequency_hz / beam.frequency_hz - 1
    # faces that cannot warp stiffen torsion, the third mode; rigid ones the bar by about a tenth of its thickness
    assert (error > 0).all() and error.max() < (0.02 if how == "rigid" else 0.01)
    if how == "averaged":
        assert error[[0, 1, 3, 4]].max() < 2e-3
    names = list(model.plan.topology.node_names)
    shapes = system.node_displacements(model, found.pairs.vectors)
    assert not shapes[names.index("a")].any()
    for node in ("b", "far"):
        k = names.index(node)
        solid, line = shapes[k], beam.shapes[k]
        sign = np.sign(np.sum(solid * line, axis=0))
        assert np.abs(solid * sign - line).max() < 0.02 * np.abs(line).max()
    assert np.isnan(shapes).any()
    end = (system.T @ found.pairs.vectors).reshape(-1, 3, 5)[stage_mesh().point_sets["x1"]]
    at_b = shapes[names.index("b"), :3]
    assert np.abs(end.mean(axis=0) - at_b).max() < 0.02 * np.abs(at_b).max()


def clamped(kind="hexahedron20", size=(0.1, 0.02, 0.02), counts=(5, 2, 2)):
    mesh = box(kind, size, counts)
    return without(mesh, *elastic_matrices(mesh), dofs(mesh.point_sets["x0"]))


@pytest.fixture(params=["pardiso", "superlu"])
def solver(request, monkeypatch):
    """Both factorisations; the first only where it is installed."""
    if request.param == "superlu":
        monkeypatch.setattr(factor, "_pardiso_solver", lambda: None)
    elif factor._pardiso_solver() is None:
        pytest.skip("pypardiso is not installed")
    return request.param


def test_lowest_modes_are_those_of_dense_algebra(solver):
    K, M = clamped()  # a square bar, whose bending modes come in pairs
    dense = np.sqrt(la.eigh(M.toarray(), K.toarray(), eigvals_only=True)[::-1][:9] ** -1) / (2 * np.pi)
    found = lowest_modes(K, M, 9)
    assert found.solver == solver and found.missing == 0
    assert found.frequency_hz == pytest.approx(dense, rel=1e-9)
    assert residuals(Pencil.of(K, M), found.pairs).max() < 1e-8 and found.residuals.max() < 1e-8
    X = found.pairs.vectors
    assert np.allclose(X.T @ (M @ X), np.eye(9), rtol=0, atol=1e-10)


def test_free_solid_has_six_zeros_then_its_elastic_modes(solver):
    mesh = box("tetra10", (0.1, 0.03, 0.02), (4, 2, 1))
    K, M = elastic_matrices(mesh)
    found = lowest_modes(K, M, 8)
    dense = np.sqrt(np.abs(la.eigh(K.toarray(), M.toarray(), eigvals_only=True)[:8])) / (2 * np.pi)
    assert not found.frequency_hz[:6].any() and found.missing == 0
    assert found.frequency_hz[6:] == pytest.approx(dense[6:], rel=1e-8)
    assert not lowest_modes(K, M, 3).frequency_hz.any()


def test_missed_copies_are_found(solver, monkeypatch):
    # a search that returns every second mode stands for one that loses copies of repeated ones
    K, M = clamped()
    whole = lowest_modes(K, M, 6).frequency_hz
    run = ShiftInvert.nearest
    first = []

    def forgetful(self, n, known=None):
        found = run(self, n + 1 if not first else n, known)
        if not first:
            first.append(True)
            keep = [0, *range(2, n + 1)]
            return type(found)(found.values[keep], found.vectors[:, keep])
        return found

    monkeypatch.setattr(ShiftInvert, "nearest", forgetful)
    found = lowest_modes(K, M, 6)
    assert first and found.missing == 0
    assert found.frequency_hz == pytest.approx(whole, rel=1e-9)


def test_negative_count_is_that_of_the_eigenvalues(solver):
    K, M = clamped(counts=(4, 1, 1))
    values = np.sort(1 / la.eigh(M.toarray(), K.toarray(), eigvals_only=True))
    for k in (0, 4, 7, 20):
        between = np.sqrt(values[k] * values[k + 1]) if values[k + 1] > values[k] * 1.001 else values[k + 1] * 1.001
        assert negative_count(K, M, between) == (values < between).sum()


def test_memory_is_refused_before_the_start(solver):
    K, M = clamped()
    with pytest.raises(SolverError, match="GB can be had"):
        lowest_modes(K, M, 4, memory=1e5)
    assert available_memory() > 1e8
    K = clamped(counts=(12, 4, 4))[0]
    with pytest.raises(SolverError, match="coarser mesh"):
        factorise_large(K, memory=0.5 * factorise_large(K).memory)


def test_progress_is_told_and_can_interrupt(solver):
    K, M = clamped()
    told = []
    lowest_modes(K, M, 4, progress=lambda stage, fraction: told.append((stage, fraction)))
    assert {"iterate", "count"} <= {stage for stage, _ in told}
    assert all(0 <= fraction <= 1 for _, fraction in told)

    def stop(stage, fraction):
        if stage == "iterate" and fraction > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lowest_modes(K, M, 4, progress=stop)


def test_indefinite_and_impossible_systems_are_refused(solver):
    K, M = clamped(counts=(2, 1, 1))
    with pytest.raises(OptionError, match="modes of a system"):
        lowest_modes(K, M, K.shape[0])
    A = K.tolil()
    A[:, 0] = A[0, :] = 0
    with pytest.raises(SolverError):
        factorise_large(A.tocsc())


def test_constraint_modes_are_exact_in_statics_and_bound_frequencies(solver):
    K, M = clamped()
    boundary = np.arange(K.shape[0] - 9, K.shape[0])
    inner = np.arange(K.shape[0] - 9)
    reduced = constraint_modes(K, M, boundary, 6)
    dense = K.toarray()
    schur = dense[-9:, -9:] - dense[-9:, :-9] @ np.linalg.solve(dense[:-9, :-9], dense[:-9, -9:])
    assert np.allclose(reduced.K[:9, :9], schur, rtol=0, atol=1e-9 * np.abs(dense).max())
    fixed = lowest_modes(K[inner][:, inner], M[inner][:, inner], 6).frequency_hz
    assert reduced.fixed_frequency_hz == pytest.approx(fixed, rel=1e-9)
    assert np.diagonal(reduced.K)[9:] == pytest.approx((2 * np.pi * fixed) ** 2, rel=1e-8)
    exact = lowest_modes(K, M, 4).frequency_hz
    found = np.sqrt(la.eigh(reduced.K, reduced.M, eigvals_only=True)[:4]) / (2 * np.pi)
    guyan = constraint_modes(K, M, boundary)
    coarse = np.sqrt(la.eigh(guyan.K, guyan.M, eigvals_only=True)[:4]) / (2 * np.pi)
    assert (found >= exact * (1 - 1e-9)).all() and (coarse >= found * (1 - 1e-9)).all()
    assert np.abs(found / exact - 1).max() < 0.01
    with pytest.raises(OptionError, match="boundary"):
        constraint_modes(K, M, np.array([0, 0]))
