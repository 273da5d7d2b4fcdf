"""Solids from other programs: what is proven of their matrices, and the superelements made of them.

Matrices come from our own elements, renumbered and shuffled as another program might, from files of CalculiX 2.20 in
examples/imported, and, where the package is installed, from a file of Ansys 15.0 that ships with ansys-mapdl-reader.
"""

from __future__ import annotations

import importlib.util
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from scipy.io import mmread
from scipy.sparse.linalg import eigsh

import flexura as fx
from flexura.errors import OptionError
from flexura.fem.matrices import Face, elastic_matrices, face_ties
from flexura.solid.interchange.calculix import calculix_matrices, read_deck
from helpers.solid_boxes import ALUMINIUM, box, distorted

needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed (calculix-ccx)")

EXAMPLE = Path(__file__).parents[2] / "examples" / "imported"
SIZE = (20e-3, 6e-3, 2e-3)
MASS = ALUMINIUM.rho * float(np.prod(SIZE))
ENDS = {"a": "x0", "b": "x1"}


def stored_box(kind="hexahedron20", counts=(3, 2, 1), seed=0, amount=0.0, cells=True):
    """Matrices of a box with shuffled rows and numbers of nodes that are not in order."""
    mesh = distorted(box(kind, SIZE, counts), amount)
    K, M = elastic_matrices(mesh)
    random = np.random.default_rng(seed)
    labels = 10 + 3 * random.permutation(len(mesh.points))
    row = random.permutation(mesh.order)
    sets = {name: labels[points] for name, points in mesh.point_sets.items()}
    return fx.solid.StoredMatrices(
        sp.csc_matrix(K[row][:, row]),
        sp.csc_matrix(M[row][:, row]),
        labels[row // 3],
        row % 3,
        labels,
        mesh.points,
        sets,
        mesh.cells if cells else {},
        MASS,
    )


@pytest.mark.parametrize("amount", [0.0, 0.3])
@pytest.mark.parametrize("kind", ["hexahedron20", "tetra10"])
def test_evidence_of_a_free_solid(kind, amount):
    found = stored_box(kind, amount=amount).proven(MASS)
    assert found.strain.max() < 1e-13
    assert found.mass == pytest.approx(3 * [MASS], rel=1e-12)
    assert found.cross < 1e-12
    E, nu, rho = ALUMINIUM.E, ALUMINIUM.nu, ALUMINIUM.rho
    pressure_wave = np.sqrt(E * (1 - nu) / ((1 + nu) * (1 - 2 * nu) * rho))
    assert found.wave_speed == pytest.approx(pressure_wave, rel=1e-9)


def without(stored, rows):
    """The matrices without some rows, as when these are held."""
    keep = np.setdiff1d(np.arange(len(stored.node)), rows)
    K, M = stored.K[keep][:, keep], stored.M[keep][:, keep]
    return replace(stored, K=K, M=M, node=stored.node[keep], component=stored.component[keep])


def exchanged(stored):
    """The matrices with the numbers of two nodes exchanged."""
    a, b = stored.labels[[0, -3]]
    return replace(stored, node=np.where(stored.node == a, b, np.where(stored.node == b, a, stored.node)))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (exchanged, r"strains the solid.*most at node \d+.*not in the places"),
        (lambda s: replace(s, component=(s.component + 1) % 3), "strains the solid.*not in the places"),
        (lambda s: replace(s, points=s.points[:, [1, 0, 2]]), "strains the solid.*not in the places"),
        (lambda s: replace(s, points=s.points * [1, 1, 1.01]), "strains the solid.*not in the places"),
        (lambda s: without(s, [5]), r"node \d+ has no row for [xyz]; leave out what holds it"),
        (lambda s: without(s, np.flatnonzero(np.isin(s.node, s.sets["x0"]))), r"\d+ of \d+ nodes have no rows"),
        (lambda s: replace(s, M=s.M[::-1][:, ::-1]), "M has not the rows of K"),
        (lambda s: replace(s, K=sp.triu(s.K, format="csc")), "differs from its transpose"),
        (lambda s: s.scaled(1e3, 1.0, 1.0), "pressure waves at .*units"),
        (lambda s: s.scaled(1e-3, 1.0, 1.0), "pressure waves at .*units"),
        (lambda s: s.scaled(1.0, 1.0, 1e-3), "pressure waves at .*units"),
        (lambda s: replace(s.scaled(1.0, 1e3, 1.0), density_mass=None), "g in a box"),
        (lambda s: replace(s, density_mass=2 * MASS), "density times volume"),
        (lambda s: replace(s, labels=s.labels[1:], points=s.points[1:]), r"node \d+ has rows .* no place"),
    ],
)
def test_wrong_matrices_are_refused_with_the_reason(spoil, message):
    with pytest.raises(OptionError, match=message):
        fx.solid.imported(spoil(stored_box()), ENDS)


@pytest.mark.parametrize(
    "changes",
    [
        lambda s: {"node": s.node[1:]},
        lambda s: {"component": s.component + 5},
        lambda s: {"component": 0 * s.component},
        lambda s: {"points": s.points[:, :2]},
        lambda s: {"labels": np.append(s.labels[:-1], s.labels[0])},
        lambda s: {"K": np.nan * s.K},
    ],
)
def test_arrays_that_do_not_fit_are_refused(changes):
    stored = stored_box()
    with pytest.raises(OptionError):
        replace(stored, **changes(stored))


def test_a_mass_from_elsewhere_is_compared():
    with pytest.raises(OptionError, match=r"given is 0\.8 g"):
        fx.solid.imported(stored_box(), ENDS, mass=0.8e-3)


def test_averaged_faces_give_the_closed_forms_of_a_bar():
    """Tension EA/L and pure bending EI/L, of which quadratic elements have the whole solution."""
    part = fx.solid.imported(stored_box(), ENDS, faces="averaged", keep=0)
    K = part.superelement.stiffness.array
    (L, b, h), E = SIZE, ALUMINIUM.E
    assert part.places == {"a": pytest.approx((0, b / 2, h / 2)), "b": pytest.approx((L, b / 2, h / 2))}
    stretch = np.zeros(12)
    stretch[6] = 1.0
    assert stretch @ K @ stretch == pytest.approx(E * b * h / L, rel=1e-9)
    for turn, inertia in ((4, b * h**3 / 12), (5, h * b**3 / 12)):
        bend = np.zeros(12)
        bend[turn], bend[6 + turn] = -0.5, 0.5
        assert bend @ K @ bend == pytest.approx(E * inertia / L, rel=1e-9)


@pytest.mark.parametrize("faces", ["rigid", "averaged", "flexible"])
def test_superelements_carry_the_mass_and_strain_in_no_rigid_motion(faces):
    part = fx.solid.imported(stored_box(), ENDS, faces=faces)
    K, M = part.superelement.stiffness.array, part.superelement.mass.array
    rigid = np.zeros((len(K), 6))
    rigid[:6] = rigid[6:12] = np.eye(6)
    rigid[10, 2], rigid[11, 1] = 0, 0
    L = SIZE[0]
    rigid[8, 4], rigid[7, 5] = -L, L
    assert abs(K @ rigid).max() < 1e-9 * abs(K).max()
    carried = rigid.T @ M @ rigid
    assert carried[:3, :3] == pytest.approx(MASS * np.eye(3), rel=1e-9, abs=1e-12 * MASS)
    about_face = MASS * (L**2 / 3 + np.array(SIZE)[[2, 1]] ** 2 / 12)
    assert np.diagonal(carried)[4:] == pytest.approx(about_face, rel=1e-9)
    assert part.order == len(stored_box().node)


def frequencies(part, n=4):
    """Frequencies with the first node clamped."""
    K, M = part.superelement.stiffness.array[6:, 6:], part.superelement.mass.array[6:, 6:]
    return np.sqrt(la.eigh(K, M, eigvals_only=True)[:n]) / (2 * np.pi)


def test_frequencies_of_a_clamped_bar_are_those_of_its_mesh():
    mesh = box("hexahedron20", SIZE, (3, 2, 1))
    ties = face_ties(mesh, [Face(mesh.point_sets["x1"], np.array([SIZE[0], 0, 0]), 0)])
    K, M = (ties.T.T @ A @ ties.T for A in elastic_matrices(mesh))
    held = (3 * mesh.point_sets["x0"][:, None] + np.arange(3)).ravel()
    free = np.flatnonzero(~np.isin(np.append(ties.free, np.full(6, -1)), held))
    values = eigsh(K.tocsc()[free][:, free], 4, M.tocsc()[free][:, free], sigma=0.0, return_eigenvectors=False)
    whole = np.sqrt(np.sort(values)) / (2 * np.pi)
    found = frequencies(fx.solid.imported(stored_box(), ENDS, keep=60))
    assert found == pytest.approx(whole, rel=2e-4)
    assert (found > whole * (1 - 1e-9)).all()


def test_numbering_sets_and_units_do_not_matter():
    first = fx.solid.imported(stored_box(), ENDS, keep=3).superelement
    other = stored_box(seed=7)
    numbers = {name: other.sets[key].tolist() for name, key in ENDS.items()}
    millimetres = other.scaled(1e3, 1e-3, 1.0)
    for stored, nodes in ((other, numbers), (millimetres.scaled(1e-3, 1e3, 1.0), {"a": "X0", "b": "X1"})):
        again = fx.solid.imported(stored, nodes, keep=3).superelement
        for key in ("stiffness", "mass"):
            ours, theirs = (abs(getattr(s, key).array) for s in (first, again))
            assert abs(ours - theirs).max() < 1e-8 * ours.max()


def test_reference_nodes_with_rotations_are_faces():
    """A face that another program has tied to a node of six DOFs is the face that we tie."""
    stored = stored_box(cells=False)
    mesh = box("hexahedron20", SIZE, (3, 2, 1))
    place = np.array([0.0, SIZE[1] / 2, SIZE[2] / 2])
    ties = face_ties(mesh, [Face(mesh.point_sets["x0"], place, 0)])
    K, M = (sp.csc_matrix(ties.T.T @ A @ ties.T) for A in elastic_matrices(mesh))
    reference = len(mesh.points) + 1
    node = np.append(ties.free // 3 + 1, np.full(6, reference))
    component = np.append(ties.free % 3, np.arange(6))
    labels, points = np.arange(1, reference + 1), np.vstack([mesh.points, place])
    tied = fx.solid.StoredMatrices(K, M, node, component, labels, points, {"x1": mesh.point_sets["x1"] + 1})
    found = fx.solid.imported(tied, {"a": [reference], "b": "x1"}, keep=0)
    expected = fx.solid.imported(stored, ENDS, keep=0)
    for key in ("stiffness", "mass"):
        ours, theirs = (getattr(s.superelement, key).array for s in (expected, found))
        assert abs(ours - theirs).max() < 1e-10 * abs(ours).max()
    loose = fx.solid.imported(tied, {"b": "x1"}, keep=2)
    assert loose.superelement.amplitudes == 2


@pytest.mark.parametrize(
    ("nodes", "options", "message"),
    [
        ({"a": "foot"}, {}, "node a: there is no set of nodes 'foot'; there are x0"),
        ({"a": "x0", "b": "y0"}, {}, r"nodes a and b share point \d+"),
        ({"a": [1]}, {}, "1 of the 1 points have no rows in the matrices, such as number 1"),
        ({}, {}, "at least one node"),
        (ENDS, {"at": {"c": (0, 0, 0)}}, "at least one node"),
        (ENDS, {"at": {"a": (0, 0)}}, "three numbers"),
        (ENDS, {"faces": "soft"}, "rigid, averaged"),
        (ENDS, {"keep": -1}, "whole number"),
    ],
)
def test_nodes_that_cannot_be_are_refused(nodes, options, message):
    with pytest.raises(OptionError, match=message):
        fx.solid.imported(stored_box(), nodes, **options)


@pytest.mark.parametrize("chosen", [lambda x: [0], lambda x: np.flatnonzero((x[:, 1:] == 0).all(axis=1))])
def test_points_without_a_rotation_are_refused(chosen):
    stored = stored_box()
    with pytest.raises(OptionError, match="no rotation of their own"):
        fx.solid.imported(stored, {"a": stored.labels[chosen(stored.points)].tolist()})


def test_the_part_stands_in_a_mechanism(tmp_path):
    """The part, placed twice end to end, bends as the beam of twice the length; the fourth mode is torsion, which rigid
    faces in the middle hold back."""
    part = fx.solid.imported(stored_box(counts=(10, 2, 1)), ENDS, keep=8)
    sub = part.substructure
    two = fx.Mechanism(
        substructures={"bar": sub},
        instances={
            "one": fx.describe.Instance(of="bar"),
            "two": fx.describe.Instance(of="bar", at=(SIZE[0], 0, 0)),
        },
        joints=(("one.b", "two.a"),),
        ground={"one.a": "clamped"},
    )
    section = fx.describe.Rectangle(width=SIZE[1], thickness=SIZE[2])
    beam = fx.Mechanism(
        nodes={"a": (0, 0, 0), "b": (2 * SIZE[0], 0, 0)},
        links={
            "bar": fx.describe.Link(
                nodes=("a", "b"),
                material="Al-7075-T6",
                reference="z",
                section=section,
                elements=8,
                root=("rigid", "rigid"),
            )
        },
        ground={"a": "clamped"},
    )
    models = [fx.assemble(mechanism) for mechanism in (two, beam)]
    found, expected = (la.eigh(m.K.toarray(), m.M.toarray(), eigvals_only=True)[:3] for m in models)
    assert np.sqrt(found) == pytest.approx(np.sqrt(expected), rel=0.03)
    for path, key in zip(part.write(tmp_path / "bar.mtx"), ("stiffness", "mass"), strict=True):
        assert np.array_equal(mmread(path, spmatrix=False), getattr(part.superelement, key).array)


def load_make():
    spec = importlib.util.spec_from_file_location("make_imported", EXAMPLE / "make.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def as_members(**changes):
    """The guide of the example with leaves of our own between rigid faces, as its are."""
    guide = fx.load(EXAMPLE / "guide.yaml")
    profile = fx.describe.Leaf(width=20e-3, thickness=0.5e-3)
    leaf = fx.describe.Flexure(
        nodes=("foot", "head"),
        material="spring-steel",
        reference="x",
        profile=profile,
        root=("rigid", "rigid"),
        **changes,
    )
    own = guide.substructures["leaf"].model_copy(update={"superelements": {}, "flexures": {"blade": leaf}})
    return fx.with_solid_parts(guide.model_copy(update={"substructures": {"leaf": own}}))


def test_the_example_agrees_with_solid_parts_and_beams():
    """16 C3D20R of CalculiX against 27-node hexahedra of another, finer mesh, and, but for torsion of leaves, beams."""
    guides = (fx.load(EXAMPLE / "guide.yaml"), as_members(fidelity="solid"), as_members())
    found, solid, beams = (fx.modes(guide, n=6, order="full").frequency_hz for guide in guides)
    assert found == pytest.approx(solid, rel=7e-3)
    assert found[:4] == pytest.approx(beams[:4], rel=15e-3)


def test_the_superelement_of_the_example_is_that_of_its_matrices():
    part = load_make().leaf()
    assert part.evidence.mass == pytest.approx(3 * [7850 * 60e-3 * 20e-3 * 0.5e-3], rel=1e-9)
    own = fx.load(EXAMPLE / "guide.yaml").substructures["leaf"].superelements["part"]
    assert own.amplitudes == part.superelement.amplitudes
    for key in ("stiffness", "mass"):
        ours, theirs = (abs(getattr(s, key).array) for s in (part.superelement, own))
        assert abs(ours - theirs).max() < 1e-7 * ours.max()


@needs_ccx
def test_the_matrices_of_the_example_are_made_again(tmp_path):
    make = load_make()
    make.run(tmp_path)
    assert (tmp_path / "leaf.inp").read_text() == (EXAMPLE / "leaf.inp").read_text()
    ours, theirs = (fx.solid.read_calculix(folder / "leaf.inp", units=make.UNITS) for folder in (tmp_path, EXAMPLE))
    for a, b in ((ours.K, theirs.K), (ours.M, theirs.M)):
        assert abs(a - b).max() < 1e-9 * abs(b).max()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["leaf.dof", "leaf.inp", "leaf.mas.gz", "leaf.sti.gz"]


def test_another_unit_than_that_of_the_deck_is_noticed():
    with pytest.raises(OptionError, match="pressure waves"):
        fx.solid.imported(fx.solid.read_calculix(EXAMPLE / "leaf.inp"), {"foot": "FOOT"})
    with pytest.raises(OptionError, match="pressure waves"):
        fx.solid.imported(fx.solid.read_calculix(EXAMPLE / "leaf.inp", units={"mass": "t"}), {"foot": "FOOT"})
    with pytest.raises(OptionError, match=r"mass of 4\.71 mg, given is 4\.71 g"):
        fx.solid.imported(
            fx.solid.read_calculix(EXAMPLE / "leaf.inp", units={"length": "mm"}), {"foot": "FOOT"}, mass=4.71e-3
        )
    with pytest.raises(OptionError, match="a unit of length is expected"):
        fx.solid.read_calculix(EXAMPLE / "leaf.inp", units={"length": "t"})


@needs_ccx
def test_rigid_bodies_of_calculix_are_rigid_faces():
    mesh = box("hexahedron20", SIZE, (3, 2, 1))
    places = {"x0": (0.0, SIZE[1] / 2, SIZE[2] / 2), "x1": (SIZE[0], SIZE[1] / 2, SIZE[2] / 2)}
    n = len(mesh.points)
    theirs = fx.solid.imported(calculix_matrices(mesh, rigid=places), {"a": [n + 1], "b": [n + 3]}, mass=MASS)
    ours = fx.solid.imported(stored_box(), ENDS)
    assert frequencies(theirs) == pytest.approx(frequencies(ours), rel=1e-9)


DECK = "*NODE, NSET=ALL\n4, 0, 0, 0\n10, 1, 0, 0\n"
STORED = {
    "inp": DECK,
    "sti": "1 1 2.0\n1 2 -1.0\n2 2 3.0\n",
    "mas": "1 1 1.0\n2 2 1.0\n",
    "dof": "4.1\n10.3\n",
}


def stored_files(folder, **changes):
    for suffix, text in (STORED | changes).items():
        (folder / f"job.{suffix}").write_text(text)
    return folder / "job"


def test_stored_matrices_are_read_from_one_triangle_or_both(tmp_path):
    expected = np.array([[2.0, -1.0], [-1.0, 3.0]])
    for text in (STORED["sti"], "1 1 2.0\n2 1 -1.0\n2 2 3.0\n", STORED["sti"] + "2 1 -1.0\n"):
        found = fx.solid.read_calculix(stored_files(tmp_path, sti=text))
        assert np.array_equal(found.K.toarray(), expected)
        assert found.node.tolist() == [4, 10] and found.component.tolist() == [0, 2]
    assert found.sets["ALL"].tolist() == [4, 10]


@pytest.mark.parametrize(
    "changes",
    [
        {"sti": STORED["sti"] + "2 1 -1.5\n"},
        {"sti": "1 1 2.0\n1 3 1.0\n"},
        {"sti": "1 1 2.0\n1 2\n"},
        {"mas": "1 1 x\n"},
        {"dof": "4.1\n10.4\n"},
        {"dof": "4.1\n4.1\n"},
        {"dof": "4.1\n"},
        {"dof": ""},
        {"inp": "*STEP\n"},
        {"inp": "*NODE\n1, 2\n"},
        {"inp": "*PART, NAME=A\n" + DECK},
    ],
)
def test_stored_matrices_that_do_not_fit_are_refused(tmp_path, changes):
    with pytest.raises(OptionError, match=r"job|component 0 of node 4 has 2 rows"):
        fx.solid.read_calculix(stored_files(tmp_path, **changes))


def test_missing_files_are_named(tmp_path):
    with pytest.raises(OptionError, match=r"job\.sti is missing"):
        fx.solid.read_calculix(tmp_path / "job.inp")
    with pytest.raises(OptionError, match="name the deck"):
        fx.solid.read_calculix(tmp_path / "part.mtx")
    with pytest.raises(OptionError, match="does not exist"):
        fx.solid.read_calculix(tmp_path / "part.mtx", deck=tmp_path / "job.inp")


def test_decks(tmp_path):
    """Inclusion, ranges, sets of sets, sections, lists over several lines, keywords over two."""
    (tmp_path / "nodes.inc").write_text("*node\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,.5,0,0\n6,.5,.5,0\n")
    more = "7,0,.5,0\n8,0,0,.5\n9,.5,0,.5\n10,0,.5,.5\n"
    text = (
        f"** a tetrahedron\n*INCLUDE, INPUT=nodes.inc\n*Node, nset=more\n{more}"
        "*ELEMENT, type=c3d10,\n ELSET=E1\n1, 1,2,3,4,5,\n6,7,8,9,10\n"
        "*NSET, NSET=some, GENERATE\n1,7,3\n*NSET, NSET=Both\nsome, 2,\n3\n"
        "*MATERIAL, NAME=m\n*ELASTIC\n1,.3\n*DENSITY\n12.,\n*SOLID SECTION, ELSET=e1, MATERIAL=M\n"
        "*RIGID BODY, NSET=SOME, REF NODE=9, ROT NODE=10\n*STEP\n*END STEP\n"
    )
    (tmp_path / "a.inp").write_text(text)
    deck = read_deck(tmp_path / "a.inp")
    assert deck.labels.tolist() == list(range(1, 11)) and deck.points[3].tolist() == [0, 0, 1]
    assert {key: own.tolist() for key, own in deck.sets.items()} == {
        "MORE": [7, 8, 9, 10],
        "SOME": [1, 4, 7],
        "BOTH": [1, 2, 3, 4, 7],
    }
    assert deck.mass == pytest.approx(12 / 6)
    assert deck.rotations == {10: 9}
    (tmp_path / "b.inp").write_text(text.replace("*DENSITY\n12.,\n", ""))
    assert read_deck(tmp_path / "b.inp").mass is None
    (tmp_path / "c.inp").write_text("*INCLUDE, INPUT=c.inp\n")
    with pytest.raises(OptionError, match="deep"):
        read_deck(tmp_path / "c.inp")
    (tmp_path / "d.inp").write_text(text.replace("some, 2,", "none, 2,"))
    with pytest.raises(OptionError, match="takes in none"):
        read_deck(tmp_path / "d.inp")


USER_ELEMENT = """**
** GENERATION OF SUBSTRUCTURE
*USER ELEMENT,NODES=          3,LINEAR
** ELEMENT NODES
**         4,         4,
**        10
         1
         2,         3
         3,         1
*MATRIX,TYPE=STIFFNESS
 0.2000000000000E+01,
-0.1000000000000E+01, 0.3000000000000E+01,
 0.5000000000000E+00,-0.2500000000000E+00,
 0.4000000000000E+01,
"""


def test_substructures_are_read(tmp_path):
    """The layout in which CalculiX 2.20 writes the matrix of retained DOFs."""
    (tmp_path / "a.inp").write_text(DECK)
    file = tmp_path / "part.mtx"
    file.write_text(USER_ELEMENT)
    found = fx.solid.read_calculix(file, tmp_path / "a.inp", units={"length": "mm", "mass": "t"})
    expected = 1e3 * np.array([[2, -1, 0.5], [-1, 3, -0.25], [0.5, -0.25, 4]])
    assert found.K.toarray() == pytest.approx(expected)
    assert found.node.tolist() == [4, 4, 10] and found.component.tolist() == [0, 2, 0]
    assert found.M.nnz == 0 and found.points[1].tolist() == [1e-3, 0, 0]
    file.write_text(USER_ELEMENT + "*MATRIX,TYPE=MASS\n1.,\n0.,1.,\n0.,0.,2.\n")
    assert fx.solid.read_calculix(file, tmp_path / "a.inp").M.diagonal().tolist() == [1, 1, 2]
    file.write_text(USER_ELEMENT.replace(" 0.4000000000000E+01,\n", ""))
    with pytest.raises(OptionError, match="no matrix of"):
        fx.solid.read_calculix(file, tmp_path / "a.inp")


def test_condensed_stiffness_makes_a_massless_part():
    stored = stored_box(cells=False)
    ends = np.flatnonzero(np.isin(stored.node, [*stored.sets["x0"], *stored.sets["x1"]]))
    rest = np.setdiff1d(np.arange(len(stored.node)), ends)
    K = stored.K.toarray()
    condensed = K[np.ix_(ends, ends)] - K[np.ix_(ends, rest)] @ np.linalg.solve(
        K[np.ix_(rest, rest)], K[np.ix_(rest, ends)]
    )
    nothing = sp.csc_matrix((len(ends), len(ends)))
    static = replace(
        stored, K=sp.csc_matrix(condensed), M=nothing, node=stored.node[ends], component=stored.component[ends]
    )
    for faces in ("rigid", "averaged"):
        found = fx.solid.imported(static, ENDS, faces=faces).superelement
        expected = fx.solid.imported(stored, ENDS, faces=faces, keep=0).superelement.stiffness.array
        assert found.amplitudes == 0 and not found.mass.array.any()
        assert abs(found.stiffness.array - expected).max() < 1e-9 * abs(expected).max()


def fake_ansys(stored, const=()):
    """A stand-in for the package, with matrices of one triangle, in mm, t and s."""
    own = stored.scaled(1e3, 1e-3, 1.0)
    dofs = np.column_stack([own.node, own.component]).astype(np.int32)
    full = SimpleNamespace(
        load_km=lambda sort: (dofs, sp.triu(own.K, format="csc"), sp.triu(own.M, format="csc")),
        const=np.array(const, dtype=np.int32).reshape(-1, 2),
    )
    nodes = SimpleNamespace(nnum=own.labels, nodes=own.points, node_components=own.sets)
    return SimpleNamespace(Archive=lambda path, parse_vtk: nodes, read_binary=lambda path: full)


def test_matrices_of_ansys_become_the_same_part(tmp_path, monkeypatch):
    for name in ("file.full", "file.cdb"):
        (tmp_path / name).touch()
    stored = stored_box(cells=False)
    units = {"length": "mm", "mass": "t"}
    monkeypatch.setattr("flexura.solid.interchange.calculix.need", lambda *_: fake_ansys(stored))
    found = fx.solid.imported(
        fx.solid.read_ansys(tmp_path / "file.full", tmp_path / "file.cdb", units=units), ENDS, mass=MASS
    )
    expected = fx.solid.imported(stored, ENDS)
    for key in ("stiffness", "mass"):
        ours, theirs = (abs(getattr(s.superelement, key).array) for s in (expected, found))
        assert abs(ours - theirs).max() < 1e-8 * ours.max()
    held = [(int(stored.node[0]), int(stored.component[0]))]
    monkeypatch.setattr("flexura.solid.interchange.calculix.need", lambda *_: fake_ansys(stored, held))
    with pytest.raises(OptionError, match=f"node {held[0][0]} has no row for {'xyz'[held[0][1]]}"):
        fx.solid.imported(fx.solid.read_ansys(tmp_path / "file.full", tmp_path / "file.cdb", units=units), ENDS)


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ansys.mapdl.reader", None)
    with pytest.raises(OptionError, match=r"flexura\[ansys\]"):
        fx.solid.read_ansys(tmp_path / "file.full", tmp_path / "file.cdb")


@pytest.mark.filterwarnings("ignore")
def test_a_file_of_ansys():
    """A beam of Ansys 15.0 that ships with ansys-mapdl-reader; frequencies as printed in the documentation of that."""
    pytest.importorskip("ansys.mapdl.reader")
    from ansys.mapdl.reader import examples

    stored = fx.solid.read_ansys(examples.fullfile, examples.hexarchivefile)
    values = eigsh(stored.K, 6, stored.M, sigma=1.0, return_eigenvectors=False)
    frequency = np.sqrt(np.sort(values)) / (2 * np.pi)
    assert frequency == pytest.approx([1283.200, 1283.200, 5781.975, 6919.399, 6919.399, 10172.615], rel=1e-6)
    with pytest.raises(OptionError, match="21 of 321 nodes have no rows"):
        fx.solid.imported(stored, {"tip": "NCOMP2"})
