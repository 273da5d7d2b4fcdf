"""Parts of meshes that others made: what is read, what it answers, and what is refused.

Bars against E A / L, areas and volumes of cylinders, and CalculiX (Dhondt and Wittig) on the very same mesh.
"""

import json
import shutil

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla

import flexura as fx
from flexura.analysis import Modes
from flexura.errors import ModelError, OptionError, SolverError
from flexura.fem import curved, monoliths, two_orders
from flexura.fem.curved import CurvedElements
from flexura.fem.geometry import SolidMaterial
from flexura.fem.given_meshes import given_mesh
from flexura.records import Kept
from flexura.solid.interchange.calculix import run_calculix
from helpers.calculix import read_frequencies
from helpers.shell import flexura
from helpers.solid_meshes import Made, bulk, by_netgen, calculated, deck, grid
from helpers.step_files import leaf_guide

ng = pytest.importorskip("ngsolve")
meshio = pytest.importorskip("meshio")
occ = pytest.importorskip("netgen.occ")

E, NU, RHO = 71.7e9, 0.33, 2810.0
METAL = f"E: 71.7 GPa, nu: {NU}, rho: 2810 kg/m^3"
SHAPES = ("tetra", "hexahedron", "wedge", "pyramid")


def bar(shape="tetra", quadratic=True, counts=(4, 1, 1)) -> Made:
    """20 x 3 x 2 mm along x."""
    return grid(shape, (20.0, 3.0, 2.0), counts, quadratic=quadratic)


def ring(x):
    """A quarter of a ring, radii 2 and 3 mm, 1 mm high, from a block 1 x pi/2 x 1."""
    r, angle = 2 + x[:, 0], x[:, 1]
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), x[:, 2]])


def lowest(result: Modes) -> list[float]:
    """How far below its frequency each mode of the part may be, relative, negative."""
    return [own[0] for own in result.model_error or () if own is not None]


@pytest.mark.parametrize("quadratic", [False, True])
@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_of_cells_stretches_as_a_bar_does(tmp_path, shape, quadratic):
    made = bar(shape, quadratic)
    file = deck(tmp_path / "bar.inp", made, {"LEFT": made.on(0, 0.0), "TIP": made.on(0, 20.0)})
    drawing = fx.faces(file, unit="mm")
    assert sorted(face.name for face in drawing.faces) == ["", "", "", "", "LEFT", "TIP"]
    assert np.ptp(drawing.box, axis=0) == pytest.approx([20e-3, 3e-3, 2e-3], abs=1e-12)
    material = "E: 71.7 GPa, nu: 0, rho: 2810 kg/m^3"
    described = fx.part_model(file, unit="mm", material=material, hold="LEFT", interface="TIP", mesh_tolerance="9 %")
    part = fx.with_solid_parts(described)
    u = fx.statics(part, loads={"bar.TIP": [1.0, 0, 0, 0, 0, 0]}).displacement("bar.TIP")
    assert u[0] == pytest.approx(20e-3 / E / 6e-6, rel=1e-8)
    assert fx.check(part).mass.mass == pytest.approx(RHO * 120e-9, rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_curved_edges_keep_the_form(tmp_path, shape):
    made = grid(shape, (1.0, np.pi / 2, 1.0), (1, 6, 1), ring)
    drawing = fx.faces(deck(tmp_path / "ring.inp", made), unit="mm")
    volume = ng.Integrate(1.0, drawing.shape.mesh([""] * len(drawing.faces)))
    assert volume == pytest.approx(np.pi / 4 * 5, rel=1e-4)  # straight cells are 1 % off
    radii = {round(1e3 * face.radius, 6): face.area for face in drawing.faces if face.radius}
    assert radii == {2.0: pytest.approx(np.pi * 1e-6, rel=1e-4), 3.0: pytest.approx(1.5 * np.pi * 1e-6, rel=1e-4)}
    assert len(drawing.faces) == 6


def test_sides_of_other_cells_are_outside(tmp_path):
    """Outer triangles look outwards: they enclose the volume, also of cells that are all left-handed."""
    for shape in SHAPES:
        made = bar(shape, False)
        mirrored = Made(made.points * [-1, 1, 1], made.cells)
        for own in (made, mirrored):
            faces = fx.faces(deck(tmp_path / "bar.inp", own), unit="mm").faces
            a, b, c = np.moveaxis(np.concatenate([face.triangles for face in faces]), 1, 0)
            assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(120e-9, rel=1e-9)


@pytest.fixture(scope="module")
def notch():
    """A bar 60 x 6 x 4 mm with a circular notch, as a shape and its mesh."""
    shape = occ.Box((0, 0, 0), (60, 6, 4)) - occ.Cylinder(occ.Pnt(30, 6, -1), occ.Z, 2.5, 7)
    return shape, by_netgen(shape, 2.0)


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_has_the_same_frequencies_on_the_same_mesh(notch, tmp_path):
    made = notch[1]
    file = deck(tmp_path / "notch.inp", made, {"LEFT": made.on(0, 0.0)}, more=calculated(E, NU, RHO))
    run_calculix(file)
    known = read_frequencies(tmp_path / "notch.dat")[:6]
    given = given_mesh(file, 1e-3)
    mesh = given.mesh(["held" if name == "LEFT" else "" for name in given.face_names])
    metal = dict.fromkeys(given.solids, SolidMaterial("", E, NU, RHO))
    same = CurvedElements(mesh, 2, metal, held="held")
    values = np.sort(spla.eigsh(same.K, 6, M=same.M, sigma=0.0)[0])
    assert np.sqrt(values) / (2 * np.pi) == pytest.approx(known, rel=1e-5)
    # elements of order 3 on it are softer
    described = fx.part_model(file, unit="mm", material=METAL, hold="LEFT", mesh_tolerance="5 %")
    assert (fx.modes(described).frequency_hz < known).all()


def test_a_mesh_and_the_step_file_it_is_of_agree_within_their_margins(notch, tmp_path):
    shape, made = notch
    shape.WriteStep(str(tmp_path / "notch.step"))
    file = deck(tmp_path / "mesh.inp", made, {"LEFT": made.on(0, 0.0)})
    mesh = fx.modes(fx.part_model(file, unit="mm", material=METAL, hold="LEFT"))
    cad = fx.modes(fx.part_model(tmp_path / "notch.step", material=METAL, hold="plane x = 0 mm"))
    for one, other, low, from_cad in zip(mesh.modes, cad.modes, lowest(mesh), lowest(cad), strict=True):
        difference = other.frequency_hz / one.frequency_hz - 1
        assert low - 2e-4 < difference < -from_cad + 2e-4
        assert one.mesh_error and one.mesh_error < 0.015


def test_margins_hold_where_stresses_are_infinite(tmp_path):
    """Two blocks and two leaves with sharp corners on a mesh that is coarse there; NGSolve with order 4, refined, known
    from above."""
    made = by_netgen(occ.OCCGeometry(str(leaf_guide(tmp_path / "leaf.step"))).shape, 3.0, 2.0)
    result = fx.modes(
        fx.part_model(deck(tmp_path / "leaf.inp", made), unit="mm", material=METAL, hold="plane x = 0 mm")
    )
    known = [290.7, 2222.9, 5250.0, 6513.0, 6558.0, 9483.0]
    for mode, low, hz in zip(result.modes, lowest(result), known, strict=True):
        assert 0 < mode.frequency_hz / hz - 1 < -low


def test_all_formats_have_the_same_numbers(notch, tmp_path):
    made = by_netgen(notch[0], 5.0)
    made = Made(made.points.round(6), made.cells)
    files = [deck(tmp_path / "notch.inp", made)]
    files += [bulk(tmp_path / f"{form}.bdf", made, form) for form in ("small", "large", "free")]
    for suffix in ("med", "vtu"):
        mesh = meshio.Mesh(made.points, [("tetra10", made.cells)])
        meshio.write(files[0].with_suffix(f".{suffix}"), mesh)
        files.append(files[0].with_suffix(f".{suffix}"))
    found = []
    for file in files:
        described = fx.part_model(file, unit="mm", material=METAL, hold="plane x = 0 mm", mesh_tolerance="9 %")
        found.append(fx.modes(described).frequency_hz)
    for own in found:
        assert own == pytest.approx(found[0], rel=1e-5 if own is found[1] else 1e-9)  # five decimals


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("form", ["small", "free"])
def test_elements_of_nastran_have_their_points_in_place(tmp_path, shape, form):
    made = grid(shape, (1.0, np.pi / 2, 1.0), (1, 4, 1), ring)
    drawing = fx.faces(bulk(tmp_path / "ring.nas", made, form), unit="mm")
    assert ng.Integrate(1.0, drawing.shape.mesh([""] * len(drawing.faces))) == pytest.approx(np.pi / 4 * 5, rel=5e-4)
    assert drawing.solids == ("property 7",)


def test_sets_of_all_kinds_name_faces(tmp_path):
    made = bar("hexahedron", quadratic=False)
    middle = made.cells[:, [3, 2, 6, 7]]  # sides at y = 3
    more = ["*ELSET, ELSET=LAST", "4,", "*SURFACE, NAME=end, TYPE=ELEMENT", "LAST, S4", "*SURFACE, NAME=LOW", "1, S1"]
    skin = [f"{9 + k}," + ",".join(map(str, row + 1)) for k, row in enumerate(middle)]
    more += ["*ELEMENT, TYPE=S4, ELSET=SKIN", *skin]
    more += ["*NSET, NSET=END", "1,", "*NSET, NSET=CORNER", "1,", "*NSET, NSET=BOTH", "LEFT, CORNER"]
    more.append("*INCLUDE, INPUT=more.inp")
    (tmp_path / "more.inp").write_text("*NSET, NSET=ROW, GENERATE\n1, 4, 1\n*SURFACE, NAME=NODES, TYPE=NODE\nLEFT,\n")
    drawing = fx.faces(deck(tmp_path / "bar.inp", made, {"LEFT": made.on(0, 0.0)}, more="\n".join(more)), unit="mm")

    def area(name):
        return sum(face.area for face in drawing.chosen(fx.describe.Interface(face=name))) * 1e6

    assert area("LEFT") == area("BOTH") == area("NODES") == area("ROW") == pytest.approx(6.0)
    assert [area("END"), area("LOW"), area("SKIN")] == pytest.approx([6.0, 15.0, 40.0])
    assert drawing.notes == ("4 S4 are no solids and are left out",)
    for name, why in (("CORNER", "none of its 1 points"), ("ALL", "it is of 4 solid cells")):
        with pytest.raises(OptionError, match=f"the set {name} has no outer side of the mesh: {why}"):
            area(name)
    with pytest.raises(OptionError, match=r"no face is called 'LEFF'; did you mean 'LEFT'\?"):
        area("LEFF")


def test_groups_of_med_and_data_of_vtu_name_faces_and_solids(tmp_path):
    made = bar("hexahedron", quadratic=False)
    sides = np.array([made.cells[0][[0, 3, 7, 4]]])
    cells = [("hexahedron", made.cells), ("quad", sides)]
    tags = [np.array([-6, -6, -7, -7]), np.array([-8])]
    mesh = meshio.Mesh(made.points, cells, cell_data={"cell_tags": tags})
    mesh.cell_tags, mesh.point_tags = {-6: ["steel"], -7: ["soft", "right"], -8: ["foot"]}, {2: ["head"]}
    mesh.point_data["point_tags"] = np.where(made.points[:, 0] > 19.9, 2, 0)
    meshio.write(tmp_path / "bar.med", mesh)
    drawing = fx.faces(tmp_path / "bar.med", unit="mm")
    assert sorted(drawing.solids) == ["soft + right", "steel"]
    assert {"foot", "head"} <= {face.name for face in drawing.faces}
    data = {"part": [np.array([1, 1, 2, 2]), np.array([3])]}
    mesh = meshio.Mesh(made.points, cells, {"tip": (made.points[:, 0] > 19.9).astype(np.int32)}, data)
    meshio.write(tmp_path / "bar.vtu", mesh)
    drawing = fx.faces(tmp_path / "bar.vtu", unit="mm")
    assert sorted(drawing.solids) == ["part 1", "part 2"]
    assert {"part 3", "tip"} <= {face.name for face in drawing.faces}


def two_materials(file, solids):
    interfaces = {"base": {"x": "0 mm", "follow": "rigid"}, "tip": {"x": "20 mm"}}
    part = {"mesh": str(file), "unit": "mm", "material": "soft", "solids": solids, "interfaces": interfaces}
    values = {"hard": (200, 7800), "soft": (70, 2700)}
    metals = {name: {"E": f"{e} GPa", "nu": 0, "rho": f"{rho} kg/m^3"} for name, (e, rho) in values.items()}
    return json.dumps({"materials": metals, "parts": {"bar": part}, "ground": {"bar.base": "clamped"}})


def test_solids_of_a_mesh_have_materials_by_their_sets(tmp_path):
    made = bar()
    steel = np.flatnonzero(made.points[made.cells[:, :4]].mean(axis=1)[:, 0] < 10)
    sets = {"STEEL": steel, "FIRST": steel[:3]}
    file = deck(tmp_path / "bar.inp", made, elsets=sets)
    model = fx.with_solid_parts(fx.loads(two_materials(file, {"STEEL": "hard"})))
    assert fx.check(model).mass.mass == pytest.approx((7800 + 2700) * 60e-9, rel=1e-9)
    u = fx.statics(model, loads={"bar.tip": [1.0, 0, 0, 0, 0, 0]}).displacement("bar.tip")
    assert u[0] == pytest.approx(10e-3 / 6e-6 * (1 / 200e9 + 1 / 70e9), rel=1e-8)
    with pytest.raises(ModelError, match="some of its cells have the material hard already"):
        fx.with_solid_parts(fx.loads(two_materials(file, {"STEEL": "hard", "FIRST": "soft"})))
    with pytest.raises(ModelError, match="the file has no such solid"):
        fx.with_solid_parts(fx.loads(two_materials(file, {"STEAL": "hard"})))


def test_a_mesh_that_is_too_coarse_says_so_and_is_taken(tmp_path):
    """Six tetrahedra bend too little: the margin and a warning say by how much."""
    made = grid("tetra", (20.0, 3.0, 2.0), (1, 1, 1), quadratic=False)
    file = deck(tmp_path / "bar.inp", made)
    result = fx.modes(fx.part_model(file, unit="mm", material=METAL, hold="plane x = 0 mm", mesh_tolerance=1e-4), n=2)
    for mode, low in zip(result.modes, lowest(result), strict=True):
        assert (mode.mesh_error or 0.0) > 1e-4 and low < -1e-4
    (warning,) = (own for own in result.warnings if "and 0.01 % was asked" in str(own))
    assert warning.limit == 1e-4 < warning.value < 0.1
    exact = fx.modes(fx.part_model(deck(tmp_path / "fine.inp", bar(counts=(16, 3, 2))), unit="mm", material=METAL,
                                   hold="plane x = 0 mm"), n=2)  # fmt: skip
    for mode, fine in zip(result.modes, exact.modes, strict=True):
        assert 0 < mode.frequency_hz / fine.frequency_hz - 1 < 1.1 * warning.value


def wrong(path, **changes):
    """What is said of a deck of a bar of four hexahedra with changes."""
    made = bar("hexahedron", quadratic=False)
    points, cells = made.points.copy(), made.cells.copy()
    changes.pop("change", lambda *_: None)(points, cells)
    file = deck(path / "bar.inp", Made(points, cells), more=changes.pop("more", ""))
    with pytest.raises(OptionError) as refused:
        fx.faces(file, **{"unit": "mm", **changes})
    return str(refused.value)


def test_what_is_wrong_with_a_mesh_is_said_with_its_place(tmp_path):
    def inside_out(points, cells):
        cells[2] = cells[2][[4, 5, 6, 7, 0, 1, 2, 3]]

    def twice(points, cells):
        cells[1, 3] = cells[1, 2]

    def flat(points, cells):
        points[:, 1] = 0

    def folded(points, cells):
        points[cells[3, 6]] = points[cells[3, 0]] + [0.2, 0.1, 0.1]

    def doubled(points, cells):
        cells[1] = cells[0]

    def infinite(points, cells):
        points[cells[3, 1]] = np.nan

    rule = "cells are inside out (negative Jacobian), where others are not: cell 3 near 12.5, 1.5, 1 mm"
    assert rule in wrong(tmp_path, change=inside_out)
    assert "cells have the same point twice" in wrong(tmp_path, change=twice)
    assert "cells have no volume: cell 1 near" in wrong(tmp_path, change=flat)
    assert "cells are folded (negative Jacobian in a part of them): cell 4 near" in wrong(tmp_path, change=folded)
    assert "cells make 2 pieces that share no side" in wrong(tmp_path, change=doubled)
    assert "a point of a cell is farther away than 1e+06 m, or nowhere" in wrong(tmp_path, change=infinite)
    rule = "a mesh has a unit of length, um, mm, cm, m, in: its file does not say it; most are in mm"
    assert rule in wrong(tmp_path, unit=None)
    with pytest.raises(OptionError, match="a unit belongs to a mesh"):
        fx.faces(tmp_path / "bar.step", unit="mm")
    assert "'yard' is none" in wrong(tmp_path, unit="yard")
    assert "a thickness belongs to a drawing" in wrong(tmp_path, thickness=1e-3)
    more = "*ELEMENT, TYPE=C3D11\n99,1,2,3,4,5,6,7,8,9,10,11"
    assert "elements of the type C3D11 are not known" in wrong(tmp_path, more=more)
    assert "has a node that is not defined" in wrong(tmp_path, more="*ELEMENT, TYPE=C3D4\n99,1,2,3,4000")
    assert "*NGEN is not followed" in wrong(tmp_path, more="*NGEN\n1,4,1")
    assert "has the side 'S9', of S1 to S6" in wrong(tmp_path, more="*SURFACE, NAME=A\n1, S9")
    assert "write a flat deck" in wrong(tmp_path, more="*INSTANCE, NAME=A, PART=B")


def test_a_wrong_unit_is_told_by_the_size(tmp_path):
    made = bar("hexahedron", quadratic=False)
    file = deck(tmp_path / "bar.inp", Made(made.points * 3, made.cells))
    with pytest.raises(OptionError, match=r"the part would be 61 m long; .*: its unit of length is not m"):
        fx.faces(file, unit="m")


def test_meshes_in_pieces_are_refused_and_loose_points_noted(tmp_path):
    one, other = bar(), bar()
    cells = np.vstack([one.cells, other.cells + len(one.points)])
    apart = Made(np.vstack([one.points, other.points + np.array([20.0, 0, 0])]), cells)
    rule = r"its cells make 2 pieces that share no side: 24 cells about .* merge points"
    with pytest.raises(OptionError, match=rule):
        fx.faces(deck(tmp_path / "apart.inp", apart), unit="mm")
    loose = Made(np.vstack([one.points, [[500.0, 0, 0]]]), one.cells)
    drawing = fx.faces(deck(tmp_path / "loose.inp", loose), unit="mm")
    assert drawing.notes == ("1 points belong to no cell and are left out",) and drawing.size < 0.03


def test_files_that_are_no_solid_meshes_are_refused(tmp_path):
    def said(name, text=None, mesh=None):
        file = tmp_path / name
        if text is not None:
            file.write_text(text)
        if mesh is not None:
            meshio.write(file, mesh)
        with pytest.raises(OptionError) as refused:
            fx.faces(file, unit="mm")
        return str(refused.value)

    assert "does not exist" in said("absent.inp")
    assert "it has no *NODE with nodes" in said("empty.inp", "")
    assert "meshio says" in said("broken.vtu", "<VTKFile")
    assert "meshio says" in said("broken.med", "HDF")
    assert "meshio says" in said("strange.xyz", "1 2 3")
    assert "it has no GRID" in said("empty.bdf", "BEGIN BULK\nENDDATA\n")
    assert "CTETRA 1 has 5 of 4 or 10 points" in said("short.bdf", "GRID,1,,0.,0.,0.\nCTETRA,1,1,1,2,3,4,5\n")
    assert "is given in the system 3" in said("system.bdf", "GRID,1,3,0.,0.,0.\n")
    assert "which no GRID defines" in said("missing.bdf", "GRID,1,,0.,0.,0.\nCTETRA,1,1,1,2,3,4\n")
    plane = meshio.Mesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [("triangle", [[0, 1, 2]])])
    rule = "it has no solid cells, but 1 triangle: mesh the volume"
    assert rule in said("shell.vtu", mesh=plane)
    tall = meshio.Mesh(np.random.default_rng(1).random((64, 3)), [("VTK_LAGRANGE_HEXAHEDRON", [list(range(64))])])
    assert "cells of the kind VTK_LAGRANGE_HEXAHEDRON are not known" in said("tall.vtu", mesh=tall)


def test_numbers_of_nastran_need_no_letter(tmp_path):
    text = "GRID,1,,0.,0.,0.\nGRID,2,,1.5+1,0.,0.\nGRID,3,,0.,1.D1,0.\nGRID,4,,0.,0.,200.-1\nCTETRA,1,1,1,2,3,4\n"
    (tmp_path / "one.dat").write_text(text)
    assert np.ptp(fx.faces(tmp_path / "one.dat", unit="mm").box, axis=0) == pytest.approx([15e-3, 10e-3, 20e-3])


def test_damaged_files_are_read_or_refused(tmp_path):
    """Nothing but what flexura raises on purpose comes of bytes that are changed, left out or put in."""
    made = bar(counts=(2, 1, 1))
    files = [deck(tmp_path / "a.inp", made, {"LEFT": made.on(0, 0.0)}, more="*SURFACE, NAME=S\n1, S1")]
    files += [bulk(tmp_path / f"{form}.bdf", made, form) for form in ("small", "large", "free")]
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(made.points, [("tetra10", made.cells)]))
    meshio.write(tmp_path / "a.med", meshio.Mesh(made.points, [("tetra10", made.cells)]))
    files += [tmp_path / "a.vtu", tmp_path / "a.med"]
    random = np.random.default_rng(7)
    pieces = [b"", b"-1", b"1e400", b"nan", b",", b"*", b"\n", b"*NODE", b"*ELEMENT, TYPE=C3D8", b"$", b"\0", 20 * b"9"]
    refused = 0
    for k in range(150):
        content = files[k % len(files)].read_bytes()
        at = int(random.integers(len(content)))
        piece = pieces[random.integers(len(pieces))]
        (damaged := tmp_path / f"damaged{files[k % len(files)].suffix}").write_bytes(
            content[:at] + piece + content[at + int(random.integers(30)) :]
        )
        try:
            fx.faces(damaged, unit="mm")
        except OptionError:
            refused += 1
    assert 20 < refused < 150


def test_what_does_not_fit_into_memory_is_refused_before_it_is_made(tmp_path, monkeypatch):
    monkeypatch.setenv("FLEXURA_CACHE", "off")
    monkeypatch.setattr(curved, "available_memory", lambda: 1e5)
    file = deck(tmp_path / "bar.inp", bar())
    with pytest.raises(OptionError, match=r"DOFs, which take some .* GB are free"):
        fx.with_solid_parts(fx.part_model(file, unit="mm", material=METAL, hold="plane x = 0 mm"))


@pytest.mark.parametrize(("shape", "follow"), [("tetra", "rigid"), ("tetra", "averaged"), ("hexahedron", "rigid")])
def test_what_is_not_factorised_is_solved_by_conjugate_gradients(tmp_path, monkeypatch, shape, follow):
    """Order 3 by factors of order 2 has the frequencies and the compliance that it has by its own."""
    monkeypatch.setenv("FLEXURA_CACHE", "off")
    made, said = bar(shape, counts=(6, 2, 2)), []
    deck(tmp_path / "bar.inp", made, {"LEFT": made.on(0, 0.0), "TIP": made.on(0, 20.0)})
    interfaces = {"base": {"face": "LEFT", "follow": follow}, "tip": {"face": "TIP", "follow": "averaged"}}
    part = {"mesh": str(tmp_path / "bar.inp"), "unit": "mm", "material": "Al-7075-T6", "interfaces": interfaces}

    def found():
        monkeypatch.setattr(monoliths, "IN_MEMORY", Kept(most=1))
        free, held = (
            fx.with_solid_parts(
                fx.loads(json.dumps({"parts": {"bar": part}, **ground})), progress=lambda *told: said.append(str(told))
            )
            for ground in ({}, {"ground": {"bar.base": "clamped"}})
        )
        return fx.modes(free, n=12, order="full").frequency_hz[6:], fx.compliance(held, nodes=["bar.tip"])

    known, compliance = found()
    assert not any("conjugate gradients" in text for text in said)
    monkeypatch.setattr(curved, "memory_of", lambda dofs: np.inf)
    hz, other = found()
    assert sum("conjugate gradients" in text for text in said) == 2
    assert hz == pytest.approx(known, rel=1e-6)
    size = np.sqrt(compliance.diagonal())
    assert other / np.outer(size, size) == pytest.approx(compliance / np.outer(size, size), abs=1e-6)


def test_iterations_that_do_not_end_say_so(tmp_path, monkeypatch):
    monkeypatch.setenv("FLEXURA_CACHE", "off")
    monkeypatch.setattr(curved, "memory_of", lambda dofs: np.inf)
    monkeypatch.setattr(two_orders, "MOST_STEPS", 2)
    made = bar(counts=(6, 2, 2))
    file = deck(tmp_path / "bar.inp", made, {"LEFT": made.on(0, 0.0)})
    with pytest.raises(
        SolverError, match=r"squared frequencies .* off after 2 steps; a mesh whose cells are less dist"
    ):
        fx.with_solid_parts(fx.part_model(file, unit="mm", material=METAL, hold="LEFT"))


def test_a_poor_preconditioner_makes_no_solution():
    """What is not definite, and steps that lose digits, end in an error and not in numbers that are wrong."""
    K = sp.csr_matrix(np.diag([2.0, 3.0, 5.0]))
    equations = two_orders.TwoOrders(K, np.ones(3, dtype=bool), np.arange(3))
    forces = np.ones((3, 2))
    assert equations.solve(forces) == pytest.approx(forces / K.diagonal()[:, None], rel=1e-6)
    for poor in (lambda r: -r, lambda r: r * np.array([[1.0], [-1.0], [1.0]]), lambda r: r * np.nan):
        equations.precondition = poor
        with pytest.raises(SolverError, match="conjugate gradients are"):
            equations.solve(forces)


def test_descriptions_say_what_is_wrong_with_meshes(tmp_path):
    file = deck(tmp_path / "bar.inp", bar())

    def said(**changes):
        part = {"mesh": str(file), "unit": "mm", "material": "Al-7075-T6", "interfaces": {"base": {"x": "0 mm"}}}
        part = {key: value for key, value in (part | changes).items() if value is not None}
        with pytest.raises(ModelError) as refused:
            fx.with_solid_parts(fx.loads(json.dumps({"parts": {"bar": part}, "ground": {"bar.base": "clamped"}})))
        return str(refused.value)

    assert "a mesh has a unit of length" in said(unit=None) and "unit: mm, as most have" in said(unit=None)
    assert "'um', 'mm', 'cm', 'm' or 'in'" in said(unit="yard")
    assert "a part has one of these" in said(step="stage.step")
    assert "a drawing or an outline has a thickness" in said(thickness="1 mm")
    assert "an outline has an offset" in said(offset="1 mm")
    missing = said(interfaces={"base": {"face": "LEFT"}})
    assert "no face is called 'LEFT'" in missing and "parts.bar.interfaces.base" in missing
    assert "does not exist" in said(mesh="absent.inp")


def test_the_shell_lists_faces_and_makes_a_model_of_a_mesh(tmp_path):
    made = bar("hexahedron", counts=(6, 1, 1))
    file = deck(tmp_path / "bar.inp", made, {"LEFT": made.on(0, 0.0), "TIP": made.on(0, 20.0)})
    listed = json.loads(flexura("faces", file, "--unit", "mm", "--plot", tmp_path, "--json").stdout)
    assert {"{face: LEFT}", "{face: TIP}"} <= {face["text"] for face in listed["faces"]}
    assert (tmp_path / "faces.png").stat().st_size > 10_000
    out = tmp_path / "bar.yaml"
    words = ("--unit", "mm", "--material", METAL, "--hold", "LEFT", "--interface", "TIP")
    done = flexura("model", file, *words, "-n", "2", "--json", "--out", out)
    data = json.loads(done.stdout)
    first = 1.8751**2 / (2 * np.pi) * np.sqrt(E / RHO) / 20e-3**2 * 2e-3 / np.sqrt(12)
    assert data["modes"][0]["frequency_hz"] == pytest.approx(first, rel=2e-2)
    assert fx.modes(fx.load(out), n=2).frequency_hz[0] == pytest.approx(data["modes"][0]["frequency_hz"], rel=1e-9)


def test_nafems_fv32_tapered_membrane(tmp_path):
    """NAFEMS Selected Benchmarks for Natural Frequency Analysis (1987), FV32: 10 m long, 5 m high where it is held,
    1 m at the other end, 0.05 m thick; plane stress, so that of a solid the modes within the plane count."""

    def tapered(x):
        return np.column_stack([x[:, 0], (x[:, 1] - 2.5) * (1 - 0.08 * x[:, 0]), x[:, 2]])

    made = grid("hexahedron", (10.0, 5.0, 0.05), (8, 4, 1), tapered, quadratic=False)
    file = deck(tmp_path / "taper.inp", made, {"ROOT": made.on(0, 0.0), "TIP": made.on(0, 10.0)})
    metal = "E: 200 GPa, nu: 0.3, rho: 8000 kg/m^3"
    described = fx.part_model(file, unit="m", material=metal, hold="ROOT", interface="TIP", up_to=400.0)
    result = fx.modes(described, n=90)
    u = np.abs(result.shapes[result.model.plan.topology.node_names.index("taper.TIP")])
    is_flat = u[[0, 1, 5]].max(axis=0) > 1e3 * u[2:5].max(axis=0)
    known = np.array([44.623, 130.03, 162.70, 246.05, 379.90, 391.44])
    assert result.frequency_hz[is_flat][: len(known)] == pytest.approx(known, rel=5e-3)


def test_faces_part_where_the_outer_side_bends(tmp_path):
    """Two sides at 45 degrees: with straight edges they are two faces, with curved ones one."""
    for quadratic, count in ((False, 8), (True, 6)):
        made = grid("hexahedron", (1.0, np.pi / 2, 1.0), (1, 2, 1), ring, quadratic)
        assert len(fx.faces(deck(tmp_path / "pie.inp", made), unit="mm").faces) == count
