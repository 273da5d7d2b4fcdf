"""Solids of members, their STEP files and meshes, against closed forms of sizes, masses and inertias."""

import sys
from dataclasses import replace
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.integrate import quad

import flexura as fx
from flexura.errors import ModelError, OptionError, SolverError
from flexura.fem import meshing, occ
from flexura.fem.geometry import SolidMaterial, body_solids, joints, normalised, solids
from flexura.fem.matrices import elastic_matrices, face_products, mesh_mass
from flexura.fem.meshing import estimated_points, group_mesh, jacobians
from flexura.fem.occ import write_step
from helpers.direct_solids import lowest_modes
from helpers.solid_wholes import solid_mesh, tied_names

OCCGeometry = pytest.importorskip("netgen.occ").OCCGeometry
EXAMPLES = Path(__file__).parents[2] / "examples"
PLACES = [
    ("pivot/pivot.yaml", None),
    ("guide/guide.yaml", None),
    ("amplifier/amplifier.yaml", None),
    ("rpr/rpr.yaml", "rpu1"),
]
MM = 1e-3

tetra_mesh = partial(solid_mesh, hexahedra=False)


@pytest.fixture(scope="module")
def example():
    """Full-order models of the examples, by file."""
    known = {}

    def load(name):
        if name not in known:
            known[name] = fx.assemble(fx.load(EXAMPLES / name))
        return known[name]

    return load


def model(tmp_path, nodes, links="", flexures="", more=""):
    text = f"""
flexura: 1
name: parts
materials: {{al: {{E: 70 GPa, nu: 0.3, rho: 2700 kg/m^3}}, st: {{E: 210 GPa, nu: 0.3, rho: 7800 kg/m^3}}}}
nodes: {{{nodes}}}
links: {{{links}}}
flexures: {{{flexures}}}
ground: {{a: clamped}}
{more}
"""
    path = tmp_path / "parts.yaml"
    path.write_text(text)
    return fx.assemble(fx.load(path))


def bar(name, ends, width, thickness, material="al", more=""):
    section = f"{{shape: rectangle, width: {width} mm, thickness: {thickness} mm}}"
    return f"{name}: {{nodes: [{ends}], material: {material}, reference: z, section: {section}{more}}}, "


def flexure(profile):
    return f"hinge: {{nodes: [a, b], material: al, reference: z, profile: {profile}}}"


def one(tmp_path, profile, length):
    return model(tmp_path, f"a: [1 mm, 2 mm, 3 mm], b: [1 mm, {2 + length} mm, 3 mm]", flexures=flexure(profile))


CIRCULAR = "contour: {shape: circular, radius: 3 mm, web: 0.4 mm}"


def circular(x):
    return 0.4 + 2 * (3 - np.sqrt(9 - x * x))


def elliptical(x):
    return 0.5 + 2 * 4 * (1 - np.sqrt(1 - (x / 5) ** 2))


CLOSED = {
    "right circular": (f"{{type: notch, width: 7 mm, {CIRCULAR}}}", 6, 7 * (6.4 * 6 - 9 * np.pi)),
    "elliptical": (
        "{type: notch, width: 4 mm, contour: {shape: elliptical, depth: 2 mm, web: 1 mm}}",
        8,
        4 * (5 * 8 - 8 * np.pi),
    ),
    "parabolic": (
        "{type: notch, width: 4 mm, contour: {shape: parabolic, depth: 2 mm, web: 1 mm}}",
        8,
        4 * (8 + 2 * 2 * 8 / 3),
    ),
    "filleted": (
        "{type: notch, width: 4 mm, contour: {shape: corner_filleted, fillet_radius: 1.5 mm, web: 1 mm}}",
        8,
        4 * (8 + 4 * 1.5**2 * (1 - np.pi / 4)),
    ),
    "sharp V": (
        "{type: notch, width: 4 mm, contour: {shape: v_shaped, angle: 45 deg, root_radius: 0 mm, web: 1 mm}}",
        6,
        4 * (6 + 2 * 9),
    ),
    "table": (
        "{type: notch, width: 4 mm, contour: "
        "{shape: table, positions: [0 mm, 2 mm, 6 mm], thicknesses: [3 mm, 1 mm, 2 mm]}}",
        6,
        4 * (2 * 2 + 1.5 * 4),
    ),
    "round": (f"{{type: round, {CIRCULAR}}}", 6, quad(lambda x: np.pi / 4 * circular(x) ** 2, -3, 3)[0]),
    "two-axis": (
        "{type: two_axis, y_contour: {shape: elliptical, depth: 4 mm, web: 0.5 mm}, "
        "z_contour: {shape: elliptical, depth: 4 mm, web: 0.5 mm}}",
        10,
        quad(lambda x: elliptical(x) ** 2, -5, 5)[0],
    ),
    "shifted": (
        "{type: two_axis, shift: 4 mm, y_contour: {shape: circular, radius: 2 mm, web: 0.4 mm}, "
        "z_contour: {shape: circular, radius: 2 mm, web: 0.4 mm}}",
        8,
        2 * 4.4 * (4.4 * 4 - 4 * np.pi),
    ),
}


@pytest.mark.parametrize("name", CLOSED)
def test_volumes_of_solids_and_meshes_are_those_of_their_contours(tmp_path, name):
    profile, length, volume = CLOSED[name]
    parts = one(tmp_path, profile, length)
    (member,) = solids(parts)
    assert member.volume == pytest.approx(volume * MM**3, rel=1e-9)
    with occ.kernel() as kernel:
        assert occ.member_shape(kernel, member).mass == pytest.approx(volume, rel=1e-4)
    for mesh in (solid_mesh(parts), tetra_mesh(parts)):
        assert mesh_mass(mesh).mass == pytest.approx(2700 * volume * MM**3, rel=2e-3)
        assert mesh_mass(mesh).centre[[0, 2]] == pytest.approx([MM, 3 * MM], abs=1e-5)


@pytest.mark.parametrize(("hexahedra", "size"), [(True, 1.0), (False, 1.5)])
def test_bars_cylinders_and_tubes_have_their_mass_and_inertia(tmp_path, hexahedra, size):
    links = bar("beam", "a, b", 6, 2) + "rod: {nodes: [b, c], material: st, section: {shape: circle, diameter: 3 mm}}, "
    links += "pipe: {nodes: [a, d], material: st, section: {shape: tube, outer_diameter: 6 mm, inner_diameter: 4 mm}}"
    parts = model(tmp_path, "a: [0, 0, 0], b: [12 mm, 0, 0], c: [12 mm, 0, 15 mm], d: [-9 mm, 0, 0]", links)
    x, y, z = 12, 6, 2
    m = 2.7e-6 * x * y * z
    found = mesh_mass(solid_mesh(parts, size, only="beam", hexahedra=hexahedra))
    digits = 1e-11  # shapes are told apart to 12 digits
    assert found.mass == pytest.approx(m, rel=digits)
    expected = m / 12 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * MM**2
    assert np.abs(found.inertia - expected).max() < digits * expected.max()
    for name, outer, inner, length, axis in (("rod", 1.5, 0.0, 15, 2), ("pipe", 3, 2, 9, 0)):
        found = mesh_mass(solid_mesh(parts, size / 2, only=name))
        m = 7.8e-6 * np.pi * (outer**2 - inner**2) * length
        polar, across = m * (outer**2 + inner**2) / 2, m * (3 * (outer**2 + inner**2) + length**2) / 12
        expected = np.full(3, across)
        expected[axis] = polar
        assert found.mass == pytest.approx(m, rel=2e-3)
        assert np.diag(found.inertia) == pytest.approx(expected * MM**2, rel=3e-3)


@pytest.mark.parametrize(("file", "only"), PLACES)
def test_meshes_of_examples(example, file, only):
    parts = example(file)
    members = solids(parts, only)
    mesh = solid_mesh(parts, 1.5, only)
    volume = sum(m.material.rho * m.volume for m in members)
    assert mesh_mass(mesh).mass == pytest.approx(volume, rel=1e-3)
    for cells in mesh.cells.values():
        assert jacobians(mesh.points, cells)[0].min() > 0
    assert set(mesh.point_sets) == {f"{m.name} {end}" for m in members for end in ("start", "end")}
    groups = joints(parts, members).groups
    estimate = sum(estimated_points([members[k] for k in group], 1.5, True) for group in groups)
    assert 0.5 < estimate / len(mesh.points) < 2.5
    rows = np.concatenate([np.repeat(c[:, 0], c.shape[1]) for c in mesh.cells.values()])
    columns = np.concatenate([c.ravel() for c in mesh.cells.values()])
    graph = sp.coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(mesh.points),) * 2)
    assert sp.csgraph.connected_components(graph, directed=False)[0] == len(groups)


def read_back(path):
    """The solids in a STEP file by name."""
    made = OCCGeometry(str(path)).shape.solids
    assert len({solid.name for solid in made}) == len(made)
    return {solid.name: solid for solid in made}


@pytest.mark.parametrize(("file", "only"), [*PLACES, ("tip_tilt/tip_tilt.yaml", None), ("pivot/pivot.yaml", "rising")])
def test_step_files_read_back_with_the_same_names_and_volumes(example, file, only, tmp_path, capfd):
    parts = example(file)
    members = solids(parts, only)
    path = write_step(parts, tmp_path / "parts.step", only=only)
    assert capfd.readouterr().out == ""
    assert [p.name for p in tmp_path.iterdir()] == ["parts.step"]
    found = read_back(path)
    for group in joints(parts, members).groups:
        solid = found.pop(" + ".join(members[k].name for k in group))
        whole = sum(members[k].volume for k in group) / MM**3
        assert solid.mass == pytest.approx(whole, rel=1e-4)
    assert set(found) == {body.name for body in body_solids(parts, only)}


def test_bodies_are_solids_of_their_own_where_they_are(tmp_path):
    more = """
parameters: {side: 4 mm}
substructures:
  part:
    nodes: {foot: [20 mm, 0, 0], head: [30 mm, 0, 0]}
    links: {bar: {nodes: [foot, head], material: al, reference: z, section: {shape: circle, diameter: 1 mm}}}
    bodies:
      slab: {centre: [32 mm, 1 mm, 0], carries: [head], solid: {shape: box, size: [side, 2 mm, 3 mm], material: st},
        rotate: {axis: z, angle: 30 deg}}
      tür: {centre: [35 mm, 0, 0], solid: {shape: cylinder, diameter: 2 mm, length: 6 mm, axis: [3, 4, 0],
        material: st}, carries: [slab]}
      dot: {centre: [35 mm, 0, 0], carries: [tür], mass: 1 g, inertia: [1 g*mm^2, 1 g*mm^2, 1 g*mm^2]}
    interface: [foot]
instances:
  arm: {of: part, pattern: {type: mirror, normal: x}}
"""
    parts = model(
        tmp_path,
        "a: [0, 0, 0]",
        more=more + "bodies: {hub: {mass: 1 g, inertia: [1 g*mm^2, 1 g*mm^2, 1 g*mm^2], carries: [a, 'arm*.foot']}}",
    )
    assert {body.name for body in body_solids(parts)} == {"arm1.slab", "arm1.tür", "arm2.slab", "arm2.tür"}
    path = write_step(parts, tmp_path / "parts.step")
    assert path.read_bytes().isascii()
    found = read_back(path)
    assert {name: solid.mass for name, solid in found.items()} == pytest.approx(
        {
            **{f"arm{k}.bar": 2.5 * np.pi for k in (1, 2)},
            **{f"arm{k}.slab": 24 for k in (1, 2)},
            **{f"arm{k}.tür": 6 * np.pi for k in (1, 2)},
        },
        rel=1e-6,
    )
    corners = np.array([[4, 2, 3], [-4, 2, 3]]) / 2
    turned = corners @ np.array([[np.sqrt(0.75), 0.5, 0], [-0.5, np.sqrt(0.75), 0], [0, 0, 1]])
    box = {name: [list(corner) for corner in solid.bounding_box] for name, solid in found.items()}
    far = 32 + np.abs(turned[:, 0]).max()
    assert box["arm1.slab"][1][0] == pytest.approx(far, abs=1e-6)
    assert box["arm2.slab"][0][0] == pytest.approx(-far, abs=1e-6)
    assert box["arm2.tür"][1][1] == pytest.approx(3 * 0.8 + 0.6, abs=1e-6)


def test_end_faces_have_their_area(example):
    parts = example("amplifier/amplifier.yaml")
    mesh = solid_mesh(parts, 1.5, "quarter2")
    area = {name: face_products(mesh, points).sum() for name, points in mesh.point_sets.items()}
    assert area["quarter2.arm end"] == pytest.approx(30e-6, rel=1e-12)
    assert area["quarter2.inner_leaf start"] == pytest.approx(5e-6, rel=1e-12)
    assert area["quarter2.outer_leaf end"] == pytest.approx(5e-6, rel=1e-12)
    assert set(mesh.point_sets["quarter2.inner_leaf end"]) < set(mesh.point_sets["quarter2.arm start"])


def test_which_members_are_one_piece_and_which_ends_are_tied(example):
    parts = example("rpr/rpr.yaml")
    members = solids(parts, "rpu1.c.half1")
    found = joints(parts, members)
    names = [{members[k].name.rpartition(".")[2] for k in group} for group in found.groups]
    assert sorted(map(sorted, names)) == [["arm1", "leaf1", "leaf2"], ["arm2", "leaf3", "leaf4"], ["input"]]
    tied = {name.removeprefix("rpu1.c.half1.") for name in tied_names(parts, members)}
    assert tied == {"leaf1 start", "leaf2 end", "input start", "input end", "leaf3 start", "leaf4 end"}


def boundary_area(mesh):
    """Area of the facets of tetrahedra with straight sides that belong to one cell."""
    cells = mesh.cells["tetra10"][:, :4]
    facets = np.sort(np.concatenate([cells[:, list(c)] for c in combinations(range(4), 3)]), axis=1)
    facets, count = np.unique(facets, axis=0, return_counts=True)
    assert count.max() == 2
    a, b, c = np.moveaxis(mesh.points[facets[count == 1]], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.parametrize("turn", [0, 30])
def test_cells_match_where_a_thin_member_meets_the_side_of_another(tmp_path, turn):
    c, s = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    base, tip = [6 - 2 * s, 2 * c], [6 - 8 * s, 8 * c]
    nodes = f"a: [0, 0, 0], m: [6 mm, 0, 0], b: [12 mm, 0, 0], t: [{tip[0]} mm, 0, {tip[1]} mm]"
    more = f", start_offset: [{base[0] - 6 if turn == 0 else 0} mm, 0, {base[1] if turn == 0 else 0} mm]"
    leaf = bar("leaf", "m, t", 5, 1, more=more).replace("reference: z", "reference: x")
    parts = model(tmp_path, nodes, bar("one", "a, m", 5, 4) + bar("two", "m, b", 5, 4) + leaf)
    members = solids(parts)
    assert len(joints(parts, members).groups) == 1 + (turn == 0)
    if turn == 0:
        return
    mesh = tetra_mesh(parts, 1.5)
    buried = 2 / c + (0.5 * np.tan(np.deg2rad(turn)) if turn else 0) * 0
    expected = 12 * 4 * 5 + (8 - buried) * 5
    assert mesh_mass(mesh).volume == pytest.approx(expected * MM**3, rel=1e-6)
    around = 2 * (12 * 4 + (8 - buried)) + 5 * (2 * 12 + 2 * 4 - 1 / c + 2 * (8 - buried) + 1)
    assert boundary_area(mesh) == pytest.approx(around * MM**2, rel=1e-6)


def test_members_that_overlap_at_a_corner_are_one_piece(tmp_path):
    parts = model(
        tmp_path,
        "a: [0, 0, 0], m: [10 mm, 0, 0], b: [10 mm, 0, 8 mm]",
        bar("one", "a, m", 5, 2) + bar("two", "m, b", 5, 2, "st").replace("reference: z", "reference: x"),
    )
    tetrahedra, hexahedra = tetra_mesh(parts, 1.5), solid_mesh(parts, 1.5)
    for mesh in (tetrahedra, hexahedra):
        assert mesh_mass(mesh).volume == pytest.approx((20 + 16 - 1) * 5 * MM**3, rel=1e-9)
        assert mesh_mass(mesh).mass == pytest.approx((20 * 2700 + 15 * 7800) * 5 * MM**3, rel=1e-9)
    around = 2 * (20 + 15) + 5 * (2 * (10 + 8) + 2 * 2 - 2 + 2)
    assert boundary_area(tetrahedra) == pytest.approx(around * MM**2, rel=1e-9)
    assert list(hexahedra.cells) == ["hexahedron27"]


def test_a_leaf_on_a_block_vibrates_as_an_independent_mesh_says(tmp_path):
    """Reference: straight quadratic tetrahedra in scikit-fem on a mesh graded by hand, E = 71.7 GPa, nu = 0.33."""
    text = "materials: {al: {E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3}}"
    leaf = flexure("{type: leaf, width: 10 mm, thickness: 0.3 mm}")
    model(tmp_path, "a: [0, 0, 0], b: [10 mm, 0, 0], c: [20 mm, 0, 0]", bar("block", "b, c", 10, 8), leaf)
    path = tmp_path / "parts.yaml"
    lines = [text if line.startswith("materials") else line for line in path.read_text().splitlines()]
    path.write_text("\n".join(lines))
    mesh = solid_mesh(fx.assemble(fx.load(path)), 1.0)
    K, M = elastic_matrices(mesh)
    free = np.setdiff1d(np.arange(len(mesh.points)), mesh.point_sets["hinge start"])
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    found = lowest_modes(K[dof][:, dof], M[dof][:, dof], 4)
    assert found.frequency_hz == pytest.approx([127.1, 607.0, 1399, 3696], rel=3e-3)


def test_equal_input_makes_equal_meshes_and_copies_are_moved_ones(example):
    parts = example("rpr/rpr.yaml")
    one, two, other = (solid_mesh(parts, 2.0, name) for name in ("rpu1.b", "rpu1.b", "rpu2.b"))
    assert np.array_equal(one.points, two.points)
    assert all(np.array_equal(one.cells[kind], two.cells[kind]) for kind in one.cells)
    turned = one.points * [-1, -1, 1]
    assert np.abs(other.points - turned).max() < 1e-12
    assert np.array_equal(one.cells["hexahedron27"], other.cells["hexahedron27"])


def test_smaller_sizes_make_more_points(example):
    parts = example("guide/guide.yaml")
    counts = [len(solid_mesh(parts, size).points) for size in (2.0, 1.0, 0.5)]
    assert counts[0] < counts[1] < counts[2]


def test_members_that_cut_through_each_other_are_refused(tmp_path):
    nodes = "a: [-5 mm, 0, 0], b: [5 mm, 0, 0], c: [0, {} mm, -5 mm], d: [0, {} mm, 5 mm]"
    more = "springs: {tie: {nodes: [a, c], stiffness: {tx: 1 N/m}}}"
    crossing = bar("across", "a, b", 2, 1) + bar("up", "c, d", 2, 1).replace("reference: z", "reference: x")
    parts = model(tmp_path, nodes.format(0, 0), crossing, more=more)
    for act in (lambda: solid_mesh(parts), lambda: write_step(parts, tmp_path / "a.step")):
        with pytest.raises(ModelError, match=r"across: two members .* 2 mm\^3 in common with up"):
            act()
    assert not (tmp_path / "a.step").exists()
    touching = model(tmp_path, nodes.format(2, 2), crossing, more=more)
    assert set(solid_mesh(touching).parts["hexahedron27"]) == {"across", "up"}


BAD = {
    "web too thin for tetrahedra": (
        "{type: round, contour: {shape: circular, radius: 3 mm, web: 1 um}}",
        6,
        OptionError,
        "hinge: its least thickness is 0.00017 of the size of its solid",
    ),
    "too many points": ("{type: leaf, width: 10 mm, thickness: 1 nm}", 6, OptionError, r"hinge: about .* more than"),
}


@pytest.mark.parametrize("name", BAD)
def test_solids_that_cannot_be_meshed_are_refused(tmp_path, name):
    profile, length, error, message = BAD[name]
    with pytest.raises(error, match=message):
        tetra_mesh(one(tmp_path, profile, length))


@pytest.mark.parametrize(("tip", "common"), [((10, 0, 0), 20), ((9.9, 0, 0.5), 20), ((0, 0, 10), None)])
def test_members_that_lie_in_each_other_are_refused_although_they_meet(tmp_path, tip, common):
    nodes = "a: [0, 0, 0], b: [10 mm, 0, 0], c: [{} mm, {} mm, {} mm]".format(*tip)
    links = bar("one", "a, b", 2, 1) + bar("two", "a, c", 3, 2).replace("reference: z", "reference: y")
    parts = model(tmp_path, nodes, links)
    if common is None:
        assert len(solid_mesh(parts).points) > 0
        return
    for act in (lambda: solid_mesh(parts), lambda: write_step(parts, tmp_path / "a.step")):
        with pytest.raises(ModelError, match=rf"one: two members .* {common} mm\^3 in common with two"):
            act()
    assert [p.name for p in tmp_path.iterdir()] == ["parts.yaml"]


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt(), SolverError("no")])
def test_nothing_half_written_is_left(example, tmp_path, monkeypatch, failure):
    def fail(text, _):
        assert text.startswith("ISO-10303-21;")
        raise failure

    monkeypatch.setattr(occ, "_finished", fail)
    expected = OptionError if isinstance(failure, OSError) else type(failure)
    with pytest.raises(expected):
        write_step(example("guide/guide.yaml"), tmp_path / "parts.step")
    assert not [*tmp_path.iterdir()]


def test_meshes_that_are_not_their_solid_are_refused(tmp_path, monkeypatch):
    parts = one(tmp_path, f"{{type: notch, width: 7 mm, {CIRCULAR}}}", 6)
    (member,) = solids(parts)
    points, cells = meshing.shape_cells(member.shape)

    def change(points):
        monkeypatch.setattr(meshing, "shape_cells", lambda *_: (points, cells))

    change(points * [1, 1, 1.02])
    with pytest.raises(SolverError, match=r"hinge has 0 folded cells .* m³ where its solid has"):
        solid_mesh(parts)
    change(points * [1, 1, -1])
    with pytest.raises(SolverError, match=r"hinge has \d+ folded cells"):
        solid_mesh(parts)


def test_pieces_do_not_depend_on_place_size_and_metal(example):
    parts = example("amplifier/amplifier.yaml")
    members = solids(parts, "quarter2")
    arm, leaf = (next(m for m in members if m.name.endswith(name)) for name in ("arm", "inner_leaf"))
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

    def moved(member):
        steel = SolidMaterial("steel", 3 * member.material.E, member.material.nu, 2 * member.material.rho)
        start = 3 * member.start @ turn + [1.0, 2.0, 3.0]
        return replace(member, length=3 * member.length, start=start, axes=member.axes @ turn, material=steel)

    one, other = normalised([arm, leaf]), normalised([moved(arm), moved(leaf)])
    assert [m.key for m in one] == [m.key for m in other]
    assert one[0].length == one[0].material.E == one[0].material.rho == 1.0
    assert len({m.key for m in (*one, *normalised([leaf, arm]))}) == 4
    first, second = group_mesh([arm, leaf]), group_mesh([moved(arm), moved(leaf)])
    assert np.abs(3 * first.points @ turn + [1, 2, 3] - second.points).max() < 1e-12
    assert np.array_equal(first.cells["hexahedron27"], second.cells["hexahedron27"])
    assert mesh_mass(second).mass == pytest.approx(54 * mesh_mass(first).mass, rel=1e-9)


@pytest.mark.slow
def test_a_round_notch_on_a_box_bends_ever_more_easily_in_finer_cells(example):
    members = solids(example("tip_tilt/tip_tilt.yaml"), "leg1")
    found = []
    for size in (2.0, 1.4):
        mesh = group_mesh(members, size)
        assert mesh_mass(mesh).mass == pytest.approx(sum(m.material.rho * m.volume for m in members), rel=5e-4)
        K, M = elastic_matrices(mesh)
        free = np.setdiff1d(np.arange(len(mesh.points)), mesh.point_sets["leg1.stack start"])
        dof = (3 * free[:, None] + np.arange(3)).ravel()
        found.append(lowest_modes(K[dof][:, dof], M[dof][:, dof], 2).frequency_hz)
    assert (found[1] < found[0]).all()
    assert found[0] == pytest.approx(found[1], rel=0.01)


def test_arguments_that_make_no_sense_are_refused(example, tmp_path, monkeypatch):
    parts = example("guide/guide.yaml")
    for size in (0.0, -1.0, np.nan, 11.0):
        with pytest.raises(OptionError, match="size"):
            solid_mesh(parts, size)
    with pytest.raises(OptionError, match="no placed member is named 'leaf'"):
        solids(parts, "leaf")
    with pytest.raises(OptionError, match="points would be needed, more than 100"):
        solid_mesh(parts, limit=100)
    with pytest.raises(OptionError, match=r"\.step or \.stp"):
        write_step(parts, tmp_path / "parts.iges")
    with pytest.raises(OptionError, match="cannot be written"):
        write_step(parts, tmp_path / "none" / "parts.step")
    constants = (
        "odd: {nodes: [a, b], material: al, reference: z, "
        "section: {shape: constants, A: 1 mm^2, Iy: 1 mm^4, Iz: 1 mm^4, J: 1 mm^4}}"
    )
    with pytest.raises(OptionError, match="odd: a section given by constants has no solid"):
        solids(model(tmp_path, "a: [0, 0, 0], b: [5 mm, 0, 0]", constants))
    monkeypatch.setitem(sys.modules, "netgen.occ", None)
    assert len(solid_mesh(parts).points) > 0
    with pytest.raises(OptionError, match=r"flexura\[solid\]"):
        tetra_mesh(parts)


def test_what_netgen_reports_is_said():
    with (
        occ.kernel() as kernel,
        pytest.raises(SolverError, match="netgen: Meshing failed!; change the size of the mesh"),
    ):
        occ.tetrahedra(kernel, kernel.Box((0, 0, 0), (1e-5, 1, 1)), 0.5e-3, 12)
