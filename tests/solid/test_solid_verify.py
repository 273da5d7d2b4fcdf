"""`verify`: counterparts by shape, errors against the solid, and what the command prints."""

import itertools
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from flexura.cli import main, terminal
from flexura.errors import OptionError
from flexura.fem.reduced import MOST_MODES
from flexura.full_order import assemble
from flexura.mechanism import Leaf, Material, Mechanism, RigidBody
from flexura.mechanism.body import Box
from flexura.mechanism.member import Flexure
from flexura.mechanism.section import CircularContour, Notch
from flexura.modelfile import load
from flexura.solid.modes import SURE, solid_modes
from flexura.solid.verification import progressively, verify
from flexura.view import draw_mode_pair
from helpers.over import over

module = sys.modules[verify.__module__]
EXAMPLES = Path(__file__).parents[2] / "examples"
GUIDE = EXAMPLES / "guide" / "guide.yaml"


@pytest.fixture(scope="module")
def guide():
    return verify(load(GUIDE), n=6, size=1.4)


def rows(result):
    return {row.model: row for row in result.rows}


def test_counterparts_are_found_by_shape_and_not_by_number(guide):
    low = rows(guide)["corrected, low order"]
    assert low.number == (1, None, None, 2, None, None)
    assert low.frequency_hz[1] is None
    assert low.error[3] == pytest.approx(low.frequency_hz[3] / guide.frequency_hz[3] - 1)
    full = rows(guide)["corrected, full order"]
    assert None not in full.number
    assert min(full.mac) > 0.99


def test_corrected_beams_are_nearer_to_the_solid_than_plain_ones(guide):
    plain, corrected = (rows(guide)[f"{kind}, full order"] for kind in ("plain", "corrected"))
    assert abs(plain.worst_error) > 0.15
    assert abs(corrected.worst_error) < 0.05
    assert abs(corrected.error[0]) < 0.01


def test_each_mesh_lies_below_the_coarser_ones(guide):
    coarse, fine = guide.solids
    assert coarse.size == pytest.approx(2 * fine.size)
    assert coarse.dofs < fine.dofs
    assert (np.array(coarse.frequency_hz) > fine.frequency_hz).all()
    assert guide.frequency_hz == fine.frequency_hz  # two meshes do not tell the order
    assert guide.uncertainty[0] == pytest.approx(coarse.frequency_hz[0] / fine.frequency_hz[0] - 1)


@over("order", [1.0, 1.5, 2.0, 3.0, 4.0, 6.0])
@over("coefficient", [1e-5, 1e-3, 0.1, 1.0])
@over("noise", [0.0, 2e-5, -2e-5])
def test_extrapolation_never_leads_further_from_the_limit(order, coefficient, noise):
    """Frequencies that converge at a known order, fast ones on smooth solids, with what uneven meshes add."""
    h = np.array([4.0, 2.0, 1.0]) / 4
    meshes = [np.array([100 * (1 + coefficient * x**order + noise * (-1) ** k)]) for k, x in enumerate(h)]
    limit, off = module.extrapolated(meshes)
    assert abs(limit[0] - 100) <= abs(meshes[-1][0] - 100) + 200 * abs(noise) + 1e-9
    assert abs(limit[0] - 100) / 100 <= 1.01 * off[0] + 4 * abs(noise)
    two, off = module.extrapolated(meshes[1:])
    assert two[0] == meshes[-1][0]
    assert order < 1.5 or abs(two[0] - 100) / 100 <= 1.01 * off[0] + 4 * abs(noise)


def test_singular_solids_are_extrapolated():
    meshes = [np.array([100 * (1 + 0.1 * x**1.5)]) for x in (1.0, 0.5, 0.25)]
    limit, _ = module.extrapolated(meshes)
    assert limit[0] == pytest.approx(100, rel=1e-9)


@pytest.mark.slow
def test_many_high_modes_end_with_a_word():
    """A block on one notch has six modes below those within the notch, at hundreds of kHz."""
    mechanism = Mechanism(
        materials={"own": Material(E=206e9, nu=0.3, rho=7850.0)},
        nodes={"foot": (0, 0, 0), "head": (6e-3, 0, 0)},
        flexures={
            "notch": Flexure(
                nodes=("foot", "head"),
                material="own",
                reference=(0, 0, 1),
                profile=Notch(width=8e-3, contour=CircularContour(radius=3e-3, web=0.5e-3)),
            )
        },
        bodies={
            "block": RigidBody(
                centre=(0.016, 0, 0), solid=Box(size=(0.02, 0.008, 0.0065), material="own"), carries=("head",)
            )
        },
        ground={"foot": "clamped"},
    )
    model = assemble(mechanism)
    told = []
    found = solid_modes(model, 8, 2.5, announce=told.append)
    assert found.order <= 6 + MOST_MODES
    hz = found.solution.frequency_hz
    assert len(hz) >= 6
    assert (hz <= found.complete_hz / SURE).all()
    assert ((found.truncation >= 0) & (found.truncation < 0.01)).all()
    result = verify(mechanism, n=24, size=2.5)
    assert len(result.frequency_hz) == len(result.uncertainty) < 24
    assert f"{len(result.frequency_hz)} of 24 modes" in result.notes[0]


@pytest.mark.slow
def test_a_mesh_half_as_fine_again_lies_within_the_uncertainty(guide):
    finer = solid_modes(assemble(load(GUIDE)), 6, 0.7).solution.frequency_hz[:6]
    assert (np.abs(finer / guide.frequency_hz - 1) < guide.uncertainty).all()
    assert (finer < guide.solids[1].frequency_hz).all()


@pytest.mark.slow
def test_a_frequency_that_rises_is_not_extrapolated():
    """Cells as large as the round notches cut their tips short, so that the coarse mesh is too soft."""
    result = verify(load(EXAMPLES / "tip_tilt" / "tip_tilt.yaml"), n=4, size=2.0)
    coarse, fine = (solid.frequency_hz[3] for solid in result.solids)
    assert coarse < fine == result.frequency_hz[3]
    assert result.uncertainty[3] == pytest.approx(1 - coarse / fine)
    assert abs(7235 / fine - 1) < result.uncertainty[3]


def test_masses_agree(guide):
    assert guide.solid_mass == pytest.approx(2 * 7850 * 0.06 * 0.02 * 0.0005, rel=0.02)
    assert abs(guide.mass_error) < 1e-6


def test_results_are_plain_data(guide):
    data = json.loads(json.dumps(guide.to_dict(), allow_nan=False))
    assert data["name"] == guide.name
    assert data["rows"][0]["number"][1] is None
    assert "corrected" in repr(guide)


def test_rows_come_before_the_solid():
    told = []
    steps = progressively(load(GUIDE), n=3, size=2.0, progress=told.append)
    first = next(steps)
    assert [row.model for row in first.rows] == ["plain, low order"]
    assert list(map(str, told)) == ["plain, low order"]
    assert first.rows[0].number == (1, 2, 3)
    assert not first.solids
    *_, one_mesh, last = steps
    assert len(one_mesh.solids) == 1
    assert not one_mesh.uncertainty
    assert len(last.solids) == 2


def test_a_leaf_with_a_rigid_block_against_one_with_a_solid_block():
    """Solid quadratic tetrahedra of leaf and block together, 192 000 DOFs: 127.1, 607.0, 1399, 3696 Hz.

    A rigid block is stiffer and holds the leaf flat, by less than 1.5 %.
    """
    mechanism = Mechanism(
        materials={"own": Material(E=71.7e9, nu=0.33, rho=2810.0)},
        nodes={"foot": (0, 0, 0), "head": (0.01, 0, 0)},
        flexures={
            "leaf": Flexure(
                nodes=("foot", "head"), material="own", reference=(0, 0, 1), profile=Leaf(width=0.01, thickness=0.3e-3)
            )
        },
        bodies={
            "block": RigidBody(
                centre=(0.015, 0, 0), solid=Box(size=(0.01, 0.01, 0.008), material="own"), carries=("head",)
            )
        },
        ground={"foot": "clamped"},
    )
    result = verify(mechanism, n=4, size=0.8)
    np.testing.assert_allclose(result.frequency_hz, [127.1, 607.0, 1399, 3696], rtol=0.015)
    assert max(result.uncertainty) < 0.005
    assert abs(rows(result)["corrected, exact"].worst_error) < 0.02
    assert abs(rows(result)["plain, full order"].worst_error) > 0.2


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_makes_the_same_solid():
    mechanism = load(EXAMPLES / "pivot" / "pivot.yaml")
    theirs = verify(mechanism, n=3, size=2.5, solver="calculix")
    ours = solid_modes(assemble(mechanism), 5, 2.5, hexahedra=False)
    np.testing.assert_allclose(theirs.solids[1].frequency_hz, ours.solution.frequency_hz[:3], rtol=1e-6)
    assert theirs.solver == "calculix"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [({"n": 0}, "whole number"), ({"size": -1.0}, "from 0.05 to 2.5"), ({"solver": "other"}, "flexura or calculix")],
)
def test_bad_arguments_are_refused(arguments, words):
    with pytest.raises(OptionError, match=words):
        verify(load(GUIDE), **arguments)


def test_plans_are_refused():
    with pytest.raises(OptionError, match="load reads a file"):
        verify("guide.yaml")


@pytest.fixture(scope="module", autouse=True)
def cache(tmp_path_factory):
    """A cache of these tests' own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FLEXURA_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def command(monkeypatch, capsys):
    """Run the command in this process; exit status, stdout and stderr."""

    def call(*arguments, file=GUIDE):
        monkeypatch.setattr(sys, "argv", ["flexura", "verify", str(file), *map(str, arguments)])
        try:
            main()
            status = 0
        except SystemExit as end:
            status = end.code
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return call


@pytest.mark.parametrize(
    ("name", "n", "size", "plain", "corrected", "mass"),
    [
        ("amplifier", 2, 2.0, (0.3, 0.6), 0.05, 0.0),
        ("pivot", 2, 2.0, (0.005, 0.02), 0.01, 0.0),
        # the stacks hold the lowest three; what the rods bend in comes fourth
        pytest.param("tip_tilt", 4, 1.4, (0.04, 0.08), 0.03, 0.0, marks=pytest.mark.slow),
        ("xy_stage", 2, 1.4, (0.05, 0.2), 0.03, -0.001),
        pytest.param("rpr", 2, 2.0, (0.04, 0.08), 0.03, -0.005, marks=pytest.mark.slow),
    ],
)
def test_every_example_is_verified(command, name, n, size, plain, corrected, mass):
    """The lowest modes on coarse meshes, which are further from the limit than those of the default."""
    status, out, err = command("-n", n, "--size", size, "--json", file=EXAMPLES / name / f"{name}.yaml")
    assert status == 0, err
    result = json.loads(out)
    worst = {row["model"]: abs(row["worst_error"]) for row in result["rows"]}
    least, most = plain
    assert least < worst["plain, full order"] < most
    assert worst["corrected, full order"] < corrected
    assert result["mass_error"] == pytest.approx(mass, abs=0.005)
    assert all(row["mac"][0] > 0.9 for row in result["rows"])


def test_the_command_prints_a_table(command):
    status, out, err = command("-n", "2", "--size", "2.3")
    assert status == 0
    for words in ("corrected, exact", "solid, limit", "uncertain by", "mass of members", "as in the corrected rows"):
        assert words in out
    assert "solid of leaf1.blade" in err


@pytest.mark.parametrize("width", [80, 100, 120, 160])
def test_no_cell_is_cut_short(guide, capsys, monkeypatch, width):
    monkeypatch.setattr(terminal, "console_of_width", lambda: Console(width=width, highlight=False))
    terminal.print_all(guide.presentation())
    out = capsys.readouterr().out
    assert "\u2026" not in out
    assert max(map(len, out.splitlines())) <= width
    table = out.split("members of the file")[0]
    for k, hz in enumerate(guide.frequency_hz, 1):
        assert f"mode {k}" in table and f"{hz:.5g}" in table
    assert table.count("corrected, exact") == table.count("solid, limit") >= (2 if width < 120 else 1)


def test_rows_say_what_the_file_itself_has(tmp_path):
    text = (EXAMPLES / "pivot" / "pivot.yaml").read_text()
    before = "    profile: {type: leaf"
    for change, described, more in (
        (text.replace(before, "    corrections: none\n" + before), "plain", []),
        (text, "corrected", []),
        (text.replace(before, "    corrections: none\n" + before, 1), "as described", ["low order", "full order"]),
    ):
        file = tmp_path / "changed.yaml"
        file.write_text(change)
        first = next(progressively(load(file), n=2))
        assert first.described == described
        *_, last_beams = itertools.islice(progressively(load(file), n=2), 5 + len(more))
        assert [row.model for row in last_beams.rows][5:] == [f"as described, {order}" for order in more]
        assert not last_beams.solids


@pytest.mark.slow
def test_solid_members_of_a_description_are_nearest(tmp_path):
    text = (EXAMPLES / "pivot" / "pivot.yaml").read_text()
    file = tmp_path / "solid.yaml"
    file.write_text(text.replace("    profile: {type: leaf", "    fidelity: solid\n    profile: {type: leaf"))
    result = verify(load(file), n=4, size=1.5)
    own, beams = (rows(result)[f"{kind}, full order"] for kind in ("as described", "corrected"))
    assert result.described == "as described"
    assert min(own.mac) > 0.99
    assert abs(own.error[1]) < 0.5 * abs(beams.error[1])
    assert abs(own.error[1]) < 5e-4


def test_pictures_and_step_file(command, tmp_path):
    pytest.importorskip("netgen.occ")
    status, out, _ = command(
        "-n", 2, "--size", 2, "--json", "--plot", tmp_path / "out", "--out", tmp_path / "guide.step"
    )
    assert status == 0
    names = ["guide.step", "solid_mode_01.png", "solid_mode_02.png", "errors.png"]
    assert [Path(file).name for file in json.loads(out)["files"]] == names
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(names[1:])
    assert (tmp_path / "guide.step").read_text().startswith("ISO-10303-21")


def test_both_pictures_of_a_pair_move_the_same_way(guide):
    pairs = guide.shapes
    assert pairs.beams.shape == (pairs.model.plan.topology.n_nodes, 6, 6)
    scale = np.repeat([1.0, 0.06], 3)
    for k in range(6):
        nodes, beams = (scale * own[:, :, k] for own in (pairs.solid.solution.shapes, pairs.beams))
        assert (nodes * beams).sum() > 0.99 * np.linalg.norm(nodes) * np.linalg.norm(beams)
    picture = draw_mode_pair(guide, 1)
    assert [text.get_text() for text in picture.texts][2:] == ["corrected beams", "solid"]
    with pytest.raises(OptionError, match="modes 1 to 6"):
        draw_mode_pair(guide, 7)


def test_surfaces_move_with_their_nodes(guide):
    """At the moving end of a leaf every point of the surface has the rigid motion of the node there."""
    pairs = guide.shapes
    node = pairs.model.plan.topology.node_names.index("leaf1.head")
    place = pairs.model.geometry.positions[node]
    motion = pairs.solid.solution.shapes[node, :, 0]
    surface = next(own for own in pairs.solid.surfaces if own.name.startswith("leaf1"))
    at = np.abs(surface.points[:, 2] - place[2]) < 1e-9
    assert at.sum() >= 8
    rigid = motion[:3] + np.cross(motion[3:], surface.points[at] - place)
    np.testing.assert_allclose(surface.displacement[at, :, 0], rigid, atol=1e-5 * np.abs(motion[:3]).max())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--size", "0"], "from 0.05 to 2.5"),
        (["--set", "nothing=1 mm"], "nothing"),
        (["--out", "guide.txt"], "named .step"),
        (["--size", "1e-4"], "size"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_written(command, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    status, _, err = command(*arguments, "--plot", "pictures")
    assert status in (1, 2)
    assert words in err and "Traceback" not in err
    assert not list(tmp_path.iterdir())


def test_broken_files_are_named(command, tmp_path):
    file = tmp_path / "broken.yaml"
    file.write_text(GUIDE.read_text().replace("profile:", "profil:"))
    status, _, err = command(file=file)
    assert status == 2
    assert "broken.yaml" in err and "profil" in err


def test_missing_programs_are_named(command, monkeypatch):
    monkeypatch.setenv("PATH", "")
    status, _, err = command("--solver", "calculix")
    assert status == 2
    assert "calculix-ccx" in err and "plain" not in err


def test_members_along_and_across_need_no_netgen_and_others_name_it(command, monkeypatch):
    monkeypatch.setitem(sys.modules, "netgen.occ", None)
    assert command("-n", 1, "--size", 2)[0] == 0
    monkeypatch.setenv("FLEXURA_CACHE", "off")
    status, _, err = command("-n", 1, "--size", 2.4, file=EXAMPLES / "tip_tilt" / "tip_tilt.yaml")
    assert status == 2
    assert "flexura[solid]" in err


def test_what_is_done_is_kept_on_interruption(command, monkeypatch):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "solid_modes", stop)
    status, out, err = command("-n", "2")
    assert status == 130
    assert "corrected, exact" in out
    assert "no solid yet" in out
    assert "interrupted" in err
