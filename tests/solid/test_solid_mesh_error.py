"""Mesh sizes of solid members, and what their meshes leave uncertain.

References: the same pieces on finer meshes, which nothing in the estimate knows of. Errors of a mesh are never larger
than what is stated, to 0.01 % of the stiffness; a much finer mesh has a small part of them left, which is neglected.
"""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import scipy.linalg as la

import flexura as fx
from flexura.cli import main
from flexura.errors import LimitError, ModelError, OptionError
from flexura.fem import reduced
from flexura.fem.geometry import MemberShape, MemberSolid, SolidMaterial
from flexura.fem.parts import stiffness_error
from flexura.fem.reduced import EndTie, Piece, reduced_piece

AL = "Al-7075-T6"


@pytest.fixture(autouse=True, scope="module")
def own_cache(tmp_path_factory):
    """One cache for the tests of this module, apart from the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FLEXURA_CACHE", str(tmp_path_factory.mktemp("cache")))
        reduced.IN_MEMORY.clear()
        yield


def piece(*kind, nu=0.33, faces="rigid", **sizes):
    """Describe a member of unit length by itself."""
    shape = MemberShape(kind, tuple(sorted((name, (float(size),)) for name, size in sizes.items())))
    metal = SolidMaterial("unit", 1.0, nu, 1.0)
    member = MemberSolid("0", shape, 1.0, metal, np.zeros(3), np.eye(3), (0, 1), (0, 1))
    return Piece((member,), (EndTie(0, 0, 0, faces), EndTie(1, 0, 1, faces)), ())


LEAF = partial(piece, "leaf", width=1.0, thickness=0.03)
BLOCK = partial(piece, "leaf", width=0.5, thickness=0.3)
NOTCH = partial(piece, "notch", "circular", width=1.2, radius=0.5, web=0.08)


def leaf(**more):
    """Describe a leaf that carries a block."""
    own = fx.describe.Flexure(
        nodes=("a", "b"),
        material=AL,
        reference=(0.0, 0.0, 1.0),
        profile=fx.describe.Leaf(width=10e-3, thickness=0.3e-3),
        **{"fidelity": "solid", **more},
    )
    block = fx.describe.RigidBody(
        centre=(15e-3, 0, 0), solid=fx.describe.Box(size=(10e-3, 10e-3, 8e-3), material=AL), carries=("b",)
    )
    nodes = {"a": (0, 0, 0), "b": (10e-3, 0, 0)}
    return fx.Mechanism.model_validate(
        {"nodes": nodes, "flexures": {"leaf": own}, "bodies": {"block": block}, "ground": {"a": "clamped"}}
    )


def step(sizes=(None, None), above=None):
    """Describe a thin and a thick leaf, fused."""
    ends = (("a", "b"), ("b", "c"))
    own = {
        name: fx.describe.Flexure.model_validate(
            {
                "nodes": nodes,
                "material": AL,
                "reference": "z",
                "profile": fx.describe.Leaf(width=8e-3, thickness=t),
                "mesh_size": size,
            }
        )
        for name, nodes, t, size in zip(("thin", "thick"), ends, (1e-3, 2e-3), sizes, strict=True)
    }
    nodes = {"a": (0, 0, 0), "b": (10e-3, 0, 0), "c": (20e-3, 0, 0)}
    return fx.Mechanism.model_validate(
        {"fidelity": "solid", "mesh_size": above, "nodes": nodes, "flexures": own, "ground": {"a": "clamped"}}
    )


@pytest.mark.parametrize(
    ("form", "size", "fine"),
    [
        *(
            (LEAF, 1.0, 0.6),
            (LEAF, 2.0, 0.7),
            (LEAF, 5.0, 1.0),
            (BLOCK, 1.0, 0.6),
            (BLOCK, 2.0, 0.6),
            (BLOCK, 5.0, 0.6),
        ),
        *((partial(LEAF, nu=0.49), 2.0, 0.7), (NOTCH, 2.0, 1.0), (NOTCH, 4.0, 1.0)),
    ],
)
def test_errors_are_not_larger_than_stated(form, size, fine):
    own, best = reduced_piece(form(), size), reduced_piece(form(), fine)
    E = stiffness_error(form(), own, size, 2, lambda _: None)
    scale = 1 / np.sqrt(own.K.diagonal())
    K, true, stated = (scale[:, None] * A * scale for A in (own.K, own.K - best.K, E))
    values, vectors = la.eigh(K)
    V = vectors[:, values > 1e-9] / np.sqrt(values[values > 1e-9])
    assert V.shape[1] == 8
    for sign in (1, -1):
        assert np.linalg.eigvalsh(V.T @ (stated - sign * true) @ V)[0] > -1e-4
    assert np.linalg.eigvalsh(V.T @ true @ V)[-1] > 1e-3, "there is an error to be stated"
    assert np.abs(stated @ (V @ np.ones(8))).max() > 0
    rigid = vectors[:, values < 1e-9]
    assert rigid.shape[1] == 6
    assert np.abs(stated @ rigid).max() < 1e-10


def test_errors_of_flexible_faces_are_those_of_the_same_deformations():
    coarse, fine = (reduced_piece(LEAF(faces="flexible"), size, 0).K for size in (1.0, 0.7))
    assert len(coarse) == 36
    ratio = np.diag(coarse)[12:] / np.diag(fine)[12:]
    assert (ratio > 1 - 1e-6).all()
    assert (ratio < 1.4).all(), "those that tear at an edge converge slowly"


@pytest.mark.parametrize("size", [2.0, 4.0])
def test_frequencies_of_a_leaf_and_of_fused_ones(size):
    for mechanism, fine in ((leaf(), 0.7), (step(), 0.6)):
        own, best = (fx.with_solid_parts(mechanism, size=s) for s in (size, fine))
        found, wanted = fx.modes(own, n=3), fx.modes(best, n=3)
        off = np.array([mode.mesh_error for mode in found.modes])
        true = found.frequency_hz / wanted.frequency_hz - 1
        assert (true < off).all()
        assert (off < 12 * true).all(), "an estimate that is far too large says nothing"
        said = {w.place: w for w in found.warnings if w.kind == "mesh"}
        assert [m.number for m in found.modes if "meshes leave" in m.flag] == [
            k + 1 for k in np.flatnonzero(off > 0.02)
        ]
        assert set(said) == {f"mode {k + 1}" for k in np.flatnonzero(off > 0.02)}
        assert all("a smaller mesh_size" in str(w) for w in said.values())
        full = fx.modes(own, n=3, order="full")
        np.testing.assert_allclose([m.mesh_error for m in full.modes], off, rtol=0.02)


def test_a_fine_mesh_is_not_warned_of_and_beams_have_no_such_error():
    assert not [w for w in fx.modes(fx.with_solid_parts(leaf()), n=3).warnings if w.kind == "mesh"]
    assert fx.modes(leaf(fidelity="beam"), n=1).modes[0].mesh_error is None


def test_copies_that_are_turned_and_mirrored_have_the_same_error():
    single = fx.with_solid_parts(leaf(), size=2.0)
    arm = fx.describe.Substructure(nodes=leaf().nodes, flexures=leaf().flexures, bodies=leaf().bodies, interface=("a",))
    turn = fx.describe.Rotation(axis=(1.0, 2.0, 3.0), angle=1.0)
    pair = fx.Mechanism.model_validate(
        {
            "substructures": {"arm": arm},
            "nodes": {"base": (0, 0, 0)},
            "joints": [("base", "one.a"), ("base", "two1.a"), ("base", "two2.a")],
            "instances": {
                "one": fx.describe.Instance.model_validate({"of": "arm", "rotate": turn}),
                "two": fx.describe.Instance.model_validate(
                    {"of": "arm", "pattern": fx.describe.MirrorPattern(normal=(1.0, 1.0, 0.0))}
                ),
            },
            "ground": {"base": "clamped"},
        }
    )
    copies = fx.with_solid_parts(pair, size=2.0)
    wanted = [mode.mesh_error for mode in fx.modes(single, n=2, order="full").modes]
    found = [mode.mesh_error for mode in fx.modes(copies, n=6, order="full").modes]
    np.testing.assert_allclose(found, np.repeat(wanted, 3), rtol=1e-6)


def test_statics_and_responses_say_so():
    coarse = fx.with_solid_parts(leaf(mesh_size=4.0))
    fine = fx.with_solid_parts(leaf(mesh_size=0.7))
    load = {"block": (0, 0, 1e-3, 0, 0, 0)}
    band = {"inputs": ["block.tz"], "outputs": ["block.tz"]}
    for mechanism, kinds in ((coarse, {"mesh"}), (fine, set())):
        results = [
            fx.statics(mechanism, loads=load),
            fx.frequency_response(mechanism, band=(10, 300), damping=0.01, **band),
            fx.time_response(
                mechanism, inputs={"block.tz": 1e-3 * np.ones(200)}, outputs=["block.tz"], dt=5e-5, damping=0.01
            ),
        ]
        for result in results:
            assert {w.kind for w in result.warnings} & {"mesh"} == kinds
            json.dumps([w.to_dict() for w in result.warnings])
    moved = [fx.statics(m, loads=load).displacement("block")[2] for m in (coarse, fine)]
    warning = next(w for w in fx.statics(coarse, loads=load).warnings if w.kind == "mesh")
    assert 0 < moved[1] / moved[0] - 1 < warning.value
    assert {w.kind for w in fx.kinetostatics(coarse, platform="block").warnings} == {"mesh"}
    with pytest.raises(LimitError, match="for the mesh of leaf"):
        fx.statics(coarse, loads=load).raise_warnings()


def test_sizes_are_inherited_and_fused_members_take_the_smallest():
    for sizes, above, wanted in (((None, None), None, 1.0), ((None, None), 3.0, 3.0), ((2.0, 4.0), 3.0, 2.0)):
        found = fx.with_solid_parts(step(sizes, above)).superelements["thin"]
        assert found.mesh is not None
        assert found.mesh.size == wanted
    twice = fx.with_solid_parts(step((2.0, 4.0)), size=2.0).superelements["thin"]
    assert twice.mesh is not None
    assert twice.mesh.size == 4.0
    inner = fx.describe.Substructure(nodes=leaf().nodes, flexures=leaf().flexures, interface=("a", "b"))
    for own, above, wanted in ((None, 3.0, 3.0), (2.5, 3.0, 2.5)):
        described = fx.Mechanism.model_validate(
            {
                "mesh_size": above,
                "substructures": {"arm": inner.model_copy(update={"mesh_size": own})},
                "instances": {"arm": {"of": "arm"}},
                "ground": {"arm.a": "clamped"},
            }
        )
        part = fx.with_solid_parts(described).substructures["arm"].superelements["leaf"]
        assert part.mesh is not None
        assert part.mesh.size == wanted


def test_round_trip():
    described = step((0.7, None), 2.0)
    assert fx.loads(fx.dumps(described)) == described
    text = fx.dumps(described)
    assert "mesh_size: 2" in text
    assert "mesh_size: 0.7" in text
    found = fx.with_solid_parts(leaf(), size=4.0)
    again = fx.loads(fx.dumps(found))
    own, other = found.superelements["leaf"], again.superelements["leaf"]
    assert own.stiffness_error is not None
    assert other.stiffness_error is not None
    np.testing.assert_allclose(other.stiffness_error.array, own.stiffness_error.array, rtol=1e-12, atol=0)
    assert own.mesh == other.mesh
    errors = [[m.mesh_error for m in fx.modes(m, n=2).modes] for m in (found, again)]
    np.testing.assert_allclose(*errors, rtol=1e-6)


@pytest.mark.parametrize(
    ("value", "rule"),
    [
        (0, "at least 0.05 is expected here"),
        (-1, "at least 0.05 is expected here"),
        (7, "at most 5 is expected here"),
        ("fine", "a number is expected here"),
        ("1 mm", "a number is expected here"),
        (".nan", "is expected here"),
        ("true", "a number is expected here"),
    ],
)
@pytest.mark.parametrize("at", ["member", "mechanism"])
def test_sizes_that_mean_nothing(value, rule, at):
    lines = fx.dumps(leaf()).splitlines()
    inside = next(k for k, line in enumerate(lines) if "fidelity" in line)
    indent = lines[inside][: len(lines[inside]) - len(lines[inside].lstrip())]
    if "{" in lines[inside]:
        lines[inside] = lines[inside].replace("fidelity: solid", f"fidelity: solid, mesh_size: {value}")
    line = f"{indent if at == 'member' else ''}mesh_size: {value}"
    lines.insert(inside if at == "member" else 1, line)
    with pytest.raises(ModelError) as error:
        fx.loads("\n".join(lines))
    (problem,) = error.value.problems
    assert problem.path[-1] == "mesh_size"
    assert rule in problem.rule


def test_sizes_of_beams_are_refused():
    with pytest.raises(ModelError, match=r"flexures\.leaf\.mesh_size: the member is a beam(.|\n)*fidelity: solid"):
        fx.modes(leaf(fidelity="beam", mesh_size=0.5))
    for mechanism in (
        leaf(fidelity="beam").model_copy(update={"mesh_size": 0.5}),
        step().model_copy(update={"fidelity": None, "mesh_size": 0.5}),
    ):
        with pytest.raises(ModelError, match="mesh_size: none of the members that it is for has fidelity: solid"):
            fx.with_solid_parts(fx.Plan(mechanism).mechanism)
    mixed = step((None, 0.5))
    thick = mixed.flexures["thick"].model_copy(update={"fidelity": "beam"})
    with pytest.raises(ModelError, match=r"thick\.mesh_size"):
        fx.with_solid_parts(mixed.model_copy(update={"flexures": {**mixed.flexures, "thick": thick}}))
    for size in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(OptionError, match="size"):
            fx.with_solid_parts(leaf(), size=size)
    with pytest.raises(OptionError, match=r"between 0\.05 and 5"):
        fx.with_solid_parts(leaf(mesh_size=4.0), size=2.0)


def test_check_and_the_command_line(tmp_path, capsys, monkeypatch):
    report = fx.check(fx.with_solid_parts(leaf(), size=4.0))
    part = report.solid_parts["leaf"]
    assert part.size == 4.0
    assert part.dofs == 585
    assert 0.05 < part.stiffness_error < 0.5
    assert [doubt.place for doubt in report.warnings if doubt.kind == "mesh"] == ["leaf"]
    json.dumps(report.to_dict())
    path = tmp_path / "leaf.yaml"
    fx.save(leaf(mesh_size=4.0), path)
    shown = []
    for arguments in (["check"], ["modes", "-n", "2"], ["modes", "-n", "2", "--json"]):
        monkeypatch.setattr("sys.argv", ["flexura", *arguments[:1], str(path), *arguments[1:]])
        with pytest.raises(SystemExit):
            main()
        shown.append(capsys.readouterr().out)
    assert "solid part leaf: 585 DOFs, size 4, stiffness within" in shown[0]
    assert "meshes" in shown[1]
    assert "may be off by" in shown[1]
    assert json.loads(shown[2])["modes"][0]["mesh_error"] > 0.005


def test_an_error_that_a_user_gives_for_a_part_counts():
    found = fx.with_solid_parts(leaf(), size=4.0)
    own = found.superelements["leaf"]
    given = own.model_copy(update={"stiffness_error": fx.describe.Matrix(0.1 * own.stiffness.array), "mesh": None})
    result = fx.modes(found.model_copy(update={"superelements": {"leaf": given}}), n=3)
    np.testing.assert_allclose([mode.mesh_error for mode in result.modes], 0.05, rtol=1e-6)
    with pytest.raises(ModelError, match="stiffness_error is 14 x 14"):
        fx.describe.Superelement(**{**own.model_dump(), "stiffness_error": np.eye(12), "mesh": None})
    with pytest.raises(ModelError, match="stiffness_error of a superelement has no negative eigenvalue"):
        fx.describe.Superelement(**{**own.model_dump(), "stiffness_error": -np.eye(14), "mesh": None})


def test_a_mesh_without_a_second_one_is_refused_and_interrupted_work_stops():
    told = []

    def stop(at):
        text = str(at)
        told.append(text)
        if "coarser mesh" in text or "finer mesh" in text:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fx.with_solid_parts(leaf(mesh_size=2.3), progress=stop)
    assert told[0] == "solid of leaf, size 2.3: mesh"
    assert told[-1] == "solid of leaf, size 2.3: coarser mesh, size 4.6: mesh"
    own = reduced_piece(BLOCK(), 5.0)
    same = replace(own, amplitudes=own.amplitudes + 60)
    with pytest.raises(fx.SolverError, match="no second mesh"):
        stiffness_error(BLOCK(), same, 5.0, 2, lambda _: None)
