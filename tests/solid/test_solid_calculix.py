"""CalculiX, an independent finite element program, on the same meshes.

Skipped where the program `ccx` (Debian package calculix-ccx) is not installed. Its mass of C3D10 is integrated at four
points; with the same rule ours agrees to its printed digits, with exact integration to O(h^4).
"""

from __future__ import annotations

import shutil

import numpy as np
import pytest
import scipy.sparse as sp

from flexura.errors import OptionError, SolverError
from flexura.fem.geometry import SolidMaterial
from flexura.fem.matrices import elastic_matrices
from flexura.fem.solid_mesh import SolidMesh, quadrature, shape_of
from flexura.solid.interchange.calculix import (
    calculix_matrices,
    run_calculix,
    write_calculix,
)
from helpers.calculix import calculix_frequencies, read_frequencies
from helpers.direct_solids import lowest_modes
from helpers.solid_boxes import box, distorted, mesh_of
from helpers.solid_wholes import set_ties

needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed (calculix-ccx)")

SIZE = (0.1, 0.02, 0.01)
PRINTED = 1e-6
"""CalculiX prints seven digits."""


def dofs(points):
    return (3 * points[:, None] + np.arange(3)).ravel()


def held(mesh, K, M, name="x0"):
    """K and M without the DOFs of a set."""
    free = np.setdiff1d(np.arange(mesh.order), dofs(mesh.point_sets[name]))
    return K[free][:, free], M[free][:, free]


def four_point_mass(mesh):
    """Mass of straight tetrahedra by the four-point rule, put together cell by cell."""
    xi, w = quadrature("tetra10", 2)
    N = shape_of("tetra10").values(xi)
    M = sp.lil_matrix((len(mesh.points),) * 2)
    for cell in mesh.cells["tetra10"]:
        a, b, c, d = mesh.points[cell[:4]]
        six_volumes = np.linalg.det([b - a, c - a, d - a])
        M[np.ix_(cell, cell)] += mesh.materials[0].rho * six_volumes * (N.T * w @ N)
    return sp.kron(M, sp.eye_array(3), format="csc")


@needs_ccx
@pytest.mark.parametrize("amount", [0.0, 0.2])
def test_frequencies_of_c3d20_agree_to_the_printed_digits(amount):
    mesh = distorted(box("hexahedron20", SIZE, (6, 3, 2)), amount)
    ours = lowest_modes(*held(mesh, *elastic_matrices(mesh)), 6).frequency_hz
    assert np.abs(calculix_frequencies(mesh, 6, fixed=["x0"]) / ours - 1).max() < PRINTED


@needs_ccx
def test_frequencies_of_c3d10_agree_with_its_rule_for_the_mass():
    mesh = distorted(box("tetra10", SIZE, (6, 3, 2)), 0.2)
    K, M = elastic_matrices(mesh)
    theirs = calculix_frequencies(mesh, 6, fixed=["x0"])
    same = lowest_modes(*held(mesh, K, four_point_mass(mesh)), 6).frequency_hz
    exact = lowest_modes(*held(mesh, K, M), 6).frequency_hz
    assert np.abs(theirs / same - 1).max() < PRINTED
    assert 1e-5 < np.abs(theirs / exact - 1).max() < 2e-4


@needs_ccx
def test_frequencies_of_c3d10_agree_with_exact_mass_on_finer_meshes():
    mesh = box("tetra10", (0.04, 0.02, 0.02), (6, 3, 3))
    ours = lowest_modes(*held(mesh, *elastic_matrices(mesh)), 4).frequency_hz
    assert np.abs(calculix_frequencies(mesh, 4, fixed=["x0"]) / ours - 1).max() < 1e-4


@needs_ccx
def test_rigid_bodies_and_two_materials_agree():
    mesh = box("hexahedron20", SIZE, (6, 2, 2))
    light = np.arange(24) % 2
    soft = SolidMaterial("soft", 3e9, 0.4, 1200.0)
    mesh = SolidMesh(mesh.points, mesh.cells, {"hexahedron20": light}, (*mesh.materials, soft), mesh.point_sets)
    place = (0.1, 0.013, 0.002)
    ties = set_ties(mesh, {"x1": place})
    hold = np.searchsorted(ties.free, dofs(mesh.point_sets["x0"]))
    T = ties.T[:, np.setdiff1d(np.arange(ties.T.shape[1]), hold)]
    K, M = elastic_matrices(mesh)
    ours = lowest_modes(T.T @ K @ T, T.T @ M @ T, 6).frequency_hz
    assert np.abs(calculix_frequencies(mesh, 6, fixed=["x0"], rigid={"x1": place}) / ours - 1).max() < PRINTED
    assert np.abs(calculix_frequencies(mesh, 6, fixed=["x0"]) / ours - 1).max() > 10 * PRINTED


@needs_ccx
@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20"])
def test_stored_matrices_agree_and_their_dofs_are_those_of_the_points(kind):
    mesh = box(kind, SIZE, (3, 2, 1))
    stored = calculix_matrices(mesh)
    at = 3 * (stored.node - 1) + stored.component
    assert np.array_equal(np.sort(at), np.arange(mesh.order))
    K, M = elastic_matrices(mesh)
    M = four_point_mass(mesh) if kind == "tetra10" else M
    for ours, theirs in ((K, stored.K), (M, stored.M)):
        assert abs(ours[at][:, at] - theirs).max() < 1e-12 * abs(ours).max()
        assert abs(theirs - theirs.T).max() == 0


@needs_ccx
def test_ungrounded_solid_has_six_rigid_modes():
    mesh = box("hexahedron20", SIZE, (4, 2, 1))
    found = calculix_frequencies(mesh, 8)
    assert np.abs(found[:6]).max() < 1e-4 * found[6]
    ours = lowest_modes(*elastic_matrices(mesh), 8).frequency_hz
    assert np.abs(found[6:] / ours[6:] - 1).max() < PRINTED


@needs_ccx
def test_failures_say_what_calculix_says(tmp_path):
    mesh = box("hexahedron20", SIZE, (1, 1, 1))
    with pytest.raises(SolverError, match="longer than"):
        calculix_frequencies(box("tetra10", SIZE, (8, 4, 4)), 6, timeout=0.01)
    deck = write_calculix(mesh, tmp_path / "solid.inp")
    deck.write_text(deck.read_text().replace("*ELASTIC", "*ELAST"))
    with pytest.raises(SolverError, match="ERROR"):
        run_calculix(deck)


def test_missing_program_names_its_package():
    with pytest.raises(OptionError, match="apt-get install calculix-ccx"):
        calculix_frequencies(box("tetra10", SIZE, (1, 1, 1)), program="no-such-ccx")


def test_decks_refuse_what_calculix_has_not(tmp_path):
    with pytest.raises(OptionError, match="hexahedron27"):
        write_calculix(box("hexahedron27", SIZE, (1, 1, 1)), tmp_path / "a.inp")
    with pytest.raises(OptionError, match="no set of points 'end'"):
        write_calculix(box("tetra10", SIZE, (1, 1, 1)), tmp_path / "a.inp", fixed=["end"])
    assert not [*tmp_path.iterdir()]


def test_deck_numbers_have_at_most_twenty_characters(tmp_path):
    mesh = box("hexahedron20", SIZE, (1, 1, 1))
    moved = mesh_of("hexahedron20", -mesh.points * 1e-7 / 3, mesh.cells["hexahedron20"][:, ::-1])
    deck = write_calculix(moved, tmp_path / "a.inp").read_text()
    numbers = [text for line in deck.splitlines() if line[:1].isdigit() for text in line.split(",")]
    assert max(map(len, numbers)) == 20


def test_missing_tables_are_named(tmp_path):
    (tmp_path / "a.dat").write_text("nothing\n")
    with pytest.raises(SolverError, match="no eigenvalues"):
        read_frequencies(tmp_path / "a.dat")
