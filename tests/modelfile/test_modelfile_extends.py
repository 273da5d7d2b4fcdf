"""Model files that extend others: what is joined, what is taken out, and where errors are said to be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import mmwrite

import flexura as fx

EXAMPLES = Path(__file__).parents[2] / "examples"
BASE = """\
flexura: 1
name: base
parameters: {t: 1 mm, L: {value: 100 mm, source: drawing}}
nodes:
  a: [0, 0, 0]
  b: [L, 0, 0]
links:
  beam: {nodes: [a, b], material: Al-6061-T6, section: {shape: circle, diameter: t}, elements: 4}
masses:
  tip: {node: b, mass: 10 g}
ground: {a: clamped}
"""


def written(folder: Path, **files: str) -> Path:
    """Write files by name, __ for /, and return the folder."""
    for name, text in files.items():
        file = folder / (name.replace("__", "/") + ".yaml")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return folder


def refusal(file: Path) -> fx.types.Problem:
    """The one thing that is wrong with a file."""
    with pytest.raises(fx.ModelError) as caught:
        fx.load(file)
    assert len(caught.value.problems) == 1, str(caught.value)
    return caught.value.problems[0]


def test_nothing_added_is_the_same(tmp_path):
    """A file that only extends another describes the same."""
    folder = written(tmp_path, base=BASE, over="extends: base.yaml\n")
    assert fx.load(folder / "over.yaml") == fx.load(folder / "base.yaml")


def test_mappings_are_joined_key_by_key(tmp_path):
    """What is written again replaces, what is new is added, and the rest stays; lists are replaced whole."""
    over = """\
extends: base.yaml
name: longer
parameters: {L: {value: 200 mm}}
nodes:
  c: [0, L, 0]
links:
  beam: {elements: 5, section: {diameter: 2*t}}
  more: {nodes: [a, c], material: Al-6061-T6, section: {shape: circle, diameter: t}}
masses: {tip: {node: c}}
damping: 0.02
"""
    flat = """\
name: longer
parameters: {t: 1 mm, L: {value: 200 mm, source: drawing}}
nodes:
  a: [0, 0, 0]
  b: [L, 0, 0]
  c: [0, L, 0]
links:
  beam: {nodes: [a, b], material: Al-6061-T6, section: {shape: circle, diameter: 2*t}, elements: 5}
  more: {nodes: [a, c], material: Al-6061-T6, section: {shape: circle, diameter: t}}
masses:
  tip: {node: c, mass: 10 g}
damping: 0.02
ground: {a: clamped}
"""
    folder = written(tmp_path, base=BASE, over=over)
    assert fx.load(folder / "over.yaml") == fx.loads(flat)


def test_null_takes_out(tmp_path):
    """A part, a key of a part, and a whole kind of parts."""
    over = "extends: base.yaml\nmasses: {tip: null}\nlinks: {beam: {elements: ~}}\n"
    folder = written(tmp_path, base=BASE, over=over, all="extends: base.yaml\nmasses:\n")
    found = fx.load(folder / "over.yaml")
    assert not found.masses and found.links["beam"].elements == 3
    assert not fx.load(folder / "all.yaml").masses


def test_null_without_anything_to_take_out(tmp_path):
    """More likely a slip of the pen than a wish."""
    folder = written(tmp_path, base=BASE, over="extends: base.yaml\nlinks:\n  beem: null\n")
    problem = refusal(folder / "over.yaml")
    assert problem.where == f"{folder / 'over.yaml'}:3" and "nothing here to take out" in problem.rule


def test_anything_may_replace_anything(tmp_path):
    """A mapping replaces a number and the other way round."""
    over = "extends: base.yaml\nparameters: {L: 50 mm, t: {value: 2 mm, source: new}}\n"
    found = fx.load(written(tmp_path, base=BASE, over=over) / "over.yaml")
    assert found.parameters["L"].value == pytest.approx(0.05) and not found.parameters["L"].source
    assert found.parameters["t"].source == "new"


def test_files_extend_files_in_other_folders(tmp_path):
    """Each name is relative to the file that gives it."""
    folder = written(
        tmp_path,
        parts__base=BASE,
        parts__more__stiff="extends: ../base.yaml\nparameters: {t: 3 mm}\n",
        top="extends: parts/more/stiff.yaml\nname: top\n",
    )
    found = fx.load(folder / "top.yaml")
    assert found.name == "top" and found.parameters["t"].value == pytest.approx(3e-3)


def test_text_extends_files_of_the_working_directory(tmp_path, monkeypatch):
    """`loads` looks where the program runs."""
    monkeypatch.chdir(written(tmp_path, base=BASE))
    assert fx.loads("extends: base.yaml\nname: text\n").name == "text"


def superelement(folder: Path) -> np.ndarray:
    """Write matrices of a spring between two nodes."""
    folder.mkdir(parents=True, exist_ok=True)
    spring = 1e5 * np.kron([[1, -1], [-1, 1]], np.eye(6))
    mmwrite(folder / "K.mtx", spring)
    mmwrite(folder / "M.mtx", 1e-3 * np.eye(12))
    return spring


ELEMENT = "{nodes: [b, c], stiffness: {file: K.mtx}, mass: {file: M.mtx}}"
THREE_NODES = BASE.replace("  b: [L, 0, 0]\n", "  b: [L, 0, 0]\n  c: [L, 0, 0]\n")
WITH_ELEMENT = f"{THREE_NODES}superelements:\n  e: {ELEMENT}\n"


def test_superelements_are_found_beside_their_own_file(tmp_path):
    """Through two folders, at the top and in substructures; one of the file on top is beside that."""
    spring = superelement(tmp_path / "parts" / "deep")
    superelement(tmp_path)
    inner = f"""
substructures:
  unit:
    nodes: {{b: [0, 0, 0], c: [0, 0, 0]}}
    superelements: {{e: {ELEMENT}}}
"""
    folder = written(
        tmp_path,
        parts__deep__base=WITH_ELEMENT + inner,
        parts__middle="extends: deep/base.yaml\n",
        top=f"extends: parts/middle.yaml\nsuperelements: {{own: {ELEMENT}}}\n",
    )
    found = fx.load(folder / "top.yaml")
    for element in (*found.superelements.values(), found.substructures["unit"].superelements["e"]):
        assert np.array_equal(element.stiffness.array, spring)
    assert list(found.superelements) == ["e", "own"]


@pytest.mark.parametrize(
    "elements",
    [
        "superelements:\n  e: {nodes: [b, c], stiffness: &k {file: K.mtx}, mass: {file: M.mtx}}\n"
        "  f: {nodes: [b, c], stiffness: *k, mass: {file: M.mtx}}\n",
        f"superelements:\n  e: &e {ELEMENT}\n  f: *e\n",
        f"superelements: &all\n  e: {ELEMENT}\nsubstructures:\n"
        "  unit: {nodes: {b: [0, 0, 0], c: [0, 0, 0]}, superelements: *all}\n",
    ],
    ids=["matrix", "element", "all"],
)
def test_aliases_are_carried_once(tmp_path, elements):
    """A matrix that several superelements share by an alias."""
    superelement(tmp_path / "parts")
    base = THREE_NODES + elements
    folder = written(tmp_path, parts__base=base, top="extends: parts/base.yaml\n")
    assert fx.load(folder / "top.yaml") == fx.load(folder / "parts" / "base.yaml")


def test_errors_are_where_they_are_written(tmp_path):
    """In the file and on the line of either, those of the file on top first."""
    base = BASE.replace("material: Al-6061-T6", "material: cheese")
    over = "extends: base.yaml\nname: over\nmasses:\n  extra: {node: c, mass: 1 g}\n"
    folder = written(tmp_path, base=base, over=over)
    with pytest.raises(fx.ModelError) as caught:
        fx.load(folder / "over.yaml")
    places = [(problem.where, problem.path) for problem in caught.value.problems]
    assert places == [
        (f"{folder / 'over.yaml'}:4", ("masses", "extra", "node")),
        (f"{folder / 'base.yaml'}:8", ("links", "beam", "material")),
    ]


@pytest.mark.parametrize(
    ("base", "line", "rule"),
    [
        ("flexura: 2\n" + BASE.split("\n", 1)[1], 1, "version 1"),
        (BASE.replace("10 g", "10 mm"), 10, "mass"),
        (BASE + "grond: {b: clamped}\n", 12, "unknown key"),
        (BASE + "  x\n", 12, "not valid YAML"),
        (BASE + "ground: {}\n", 12, "same key twice"),
        ("", 1, "empty"),
    ],
    ids=["version", "unit", "key", "syntax", "twice", "empty"],
)
def test_errors_of_the_base(tmp_path, base, line, rule):
    """Of every kind, in the base."""
    folder = written(tmp_path, base=base, over="# on top\n\nextends: base.yaml\n")
    problem = refusal(folder / "over.yaml")
    assert problem.where == f"{folder / 'base.yaml'}:{line}"
    assert rule in problem.rule


def test_a_part_of_both_files(tmp_path):
    """A value of the base that is refused because of one on top is where the value is."""
    over = "extends: base.yaml\nnodes:\n  b: [0, 0, 0]\n"
    problem = refusal(written(tmp_path, base=BASE, over=over) / "over.yaml")
    assert problem.where in (f"{tmp_path / 'base.yaml'}:8", f"{tmp_path / 'over.yaml'}:3")
    assert "length" in problem.rule


@pytest.mark.parametrize(
    ("files", "line", "rule"),
    [
        ({"over": "name: x\nextends: none.yaml\n"}, 2, "does not exist"),
        ({"over": "extends: 3\n"}, 1, "name of a model file"),
        ({"over": "extends: [base.yaml]\n"}, 1, "name of a model file"),
        ({"over": "extends:\n"}, 1, "name of a model file"),
        ({"over": "extends: ''\n"}, 1, "does not exist"),
        ({"over": "extends: .\n"}, 1, "does not exist"),
    ],
    ids=["missing", "number", "list", "null", "no text", "folder"],
)
def test_impossible_bases(tmp_path, files, line, rule):
    """The line is that of the key."""
    problem = refusal(written(tmp_path, **files) / "over.yaml")
    assert problem.where == f"{tmp_path / 'over.yaml'}:{line}" and problem.path == ("extends",)
    assert rule in problem.rule


@pytest.mark.parametrize(
    ("files", "where"),
    [
        ({"over": "extends: over.yaml\n"}, "over.yaml:1"),
        ({"over": "extends: a.yaml\n", "a": "name: a\nextends: b.yaml\n", "b": "extends: a.yaml\n"}, "b.yaml:1"),
        ({"over": "extends: sub/a.yaml\n", "sub__a": "extends: ../sub/../over.yaml\n"}, "over.yaml:1"),
    ],
    ids=["itself", "two", "by another path"],
)
def test_circles(tmp_path, files, where):
    """Files that extend each other are found out, however they are written."""
    problem = refusal(written(tmp_path, **files) / "over.yaml")
    assert "in a circle" in problem.rule and problem.where.endswith(where)


def test_long_chains(tmp_path):
    """Ten bases are enough."""
    files = {f"m{k}": f"extends: m{k + 1}.yaml\n" for k in range(12)} | {"m12": BASE}
    folder = written(tmp_path, **files)
    assert fx.load(folder / "m2.yaml").name == "base"
    assert "at most 10 files" in refusal(folder / "m1.yaml").rule


def test_base_that_is_no_text(tmp_path):
    """A file that is not UTF-8 is refused by its own name."""
    folder = written(tmp_path, over="extends: base.yaml\n")
    (folder / "base.yaml").write_bytes(b"name: x\nnodes: \xff\n")
    assert refusal(folder / "over.yaml").where == f"{folder / 'base.yaml'}:2"


def test_the_example_with_stacks():
    """The input block of every amplifier gives way to two halves with a stack between; all else is the example."""
    plain, driven = (fx.load(EXAMPLES / "rpr" / name) for name in ("rpr.yaml", "rpr_piezo.yaml"))
    one, two = (m.substructures["half_ring"].links for m in (plain, driven))
    assert set(two) == set(one) - {"input"} | {"input_lower", "input_upper"}
    assert all(two[key] == one[key] for key in set(one) & set(two))
    assert list(driven.substructures["amplifier"].actuators) == ["piezo"]
    same = {"bodies", "ground", "instances", "materials", "sections", "joints"}
    assert all(getattr(plain, key) == getattr(driven, key) for key in same)
    assert driven.damping.ratio == 0.01 and len(fx.system(driven).inputs) == 4


def test_written_files_stand_alone(tmp_path):
    """What is saved does not extend anything."""
    folder = written(tmp_path, base=BASE, over="extends: base.yaml\ndamping: 0.01\n")
    found = fx.load(folder / "over.yaml")
    fx.save(found, folder / "alone.yaml")
    assert "extends" not in (folder / "alone.yaml").read_text(encoding="utf-8")
    assert fx.load(folder / "alone.yaml") == found
