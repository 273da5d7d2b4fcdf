"""Every rule of the file format: where it is reported, what was found, which rule it breaks, how to mend it."""

from __future__ import annotations

import pytest

from flexura.errors import ModelError
from flexura.modelfile import load, loads
from helpers.modelfile_samples import AMPLIFIER, BEAM, only_problem_in, problems_in
from helpers.over import over


def changed(old: str, new: str, text: str = BEAM) -> str:
    assert text.count(old) == 1
    return text.replace(old, new)


def in_amplifier(old: str, new: str) -> str:
    return changed(old, new, AMPLIFIER)


# text, line, place, value, part of the rule, part of the hint
CASES = {
    "duplicate key": (changed("  b: [100", "  a: [100"), 4, "nodes.a", "", "the same key twice", "line 3"),
    "tab": ("nodes:\n\ta: 1\n", 2, "mechanism", "", "not valid YAML", "spaces, not tabs"),
    "empty": ("# nothing\n", 1, "mechanism", "", "the file is empty", "nodes"),
    "list": ("- 1\n", 1, "mechanism", "", "mapping of keys to values", "nodes"),
    "two documents": (BEAM + "---\na: 1\n", 8, "mechanism", "", "one document", "---"),
    "version": ("flexura: 2\n" + BEAM, 1, "flexura", "2", "version 1", "flexura: 1"),
    "tag": ("nodes: !!set {a}\n", 1, "nodes", "!!set", "tags are not accepted", "remove"),
    "no anchor": ("nodes: *x\n", 1, "nodes", "", "does not exist", ""),
    "alias in itself": ("nodes:\n  a: &x [*x]\n", 2, "nodes.a.0", "", "inside its own anchor", ""),
    "key that is a list": ("nodes: {[1]: 2}\n", 1, "nodes", "", "a key is plain text", "base"),
    "bare number": (changed("100 mm", "100"), 4, "nodes.b.0", "100", "a length carries a unit", "write 100 mm"),
    "bare angle": (
        in_amplifier("angle: 90 deg", "angle: 90"),
        *(32, "instances.amp.rotate.angle", "90", "an angle carries a unit", "write 90 deg"),
    ),
    "computed bare angle": (
        in_amplifier("angle: 90 deg", "angle: 2*45"),
        *(32, "instances.amp.rotate.angle", "'2*45'", "an angle carries a unit", "90 deg"),
    ),
    "dimension": (changed("100 mm", "100 kg"), 4, "nodes.b.0", "'100 kg'", "in m; this is in kg", "10 mm"),
    "dimension of a computed number": (
        changed("100 mm", "2 mm * 3 mm"),
        *(4, "nodes.b.0", "'2 mm * 3 mm'", "in m; this is in m**2", "10 mm"),
    ),
    "dimension of an expression": (
        changed("diameter: t", "diameter: 2*t^2"),
        *(6, "links.beam.section.diameter", "2*t^2", "in m; this is in m**2", "10 mm"),
    ),
    "clash in a sum": (
        changed("diameter: t", "diameter: t + 1"),
        6,
        "links.beam.section.diameter",
        "t + 1",
        "one dimension",
        "unit",
    ),
    "unit": (
        changed("100 mm", "100 Mm/kmm"),
        4,
        "nodes.b.0",
        "'100 Mm/kmm'",
        "kmm is neither a unit nor a parameter",
        "mm",
    ),
    "misspelt unit": (changed("100 mm", "100 mmm"), 4, "nodes.b.0", "'100 mmm'", "'mmm' is not a unit", "mm"),
    "offset unit": (changed("100 mm", "100 degC"), 4, "nodes.b.0", "'100 degC'", "has an offset", "K"),
    "boolean": (changed("100 mm", "true"), 4, "nodes.b.0", "True", "a length is expected", "10 mm"),
    "null": (changed("100 mm", "null"), 4, "nodes.b.0", "None", "a length is expected", "10 mm"),
    "list for a number": (changed("100 mm", "[1 mm]"), 4, "nodes.b.0", "['1 mm']", "a length is expected", "10 mm"),
    "nan": (changed("100 mm", ".nan"), 4, "nodes.b.0", "nan", "must be finite", ""),
    "infinity": (changed("100 mm", "-.inf"), 4, "nodes.b.0", "-inf", "must be finite", ""),
    "overflow": (changed("100 mm", "1e999 mm"), 4, "nodes.b.0", "'1e999 mm'", "must be finite", ""),
    "division by zero": (changed("100 mm", "1 mm / 0"), 4, "nodes.b.0", "'1 mm / 0'", "must be finite", ""),
    "sign": (
        changed("diameter: t", "diameter: -1 mm"),
        6,
        "links.beam.section.diameter",
        "'-1 mm'",
        "must be positive",
        "",
    ),
    "undefined": (
        changed("diameter: t", "diameter: 2*tt"),
        6,
        "links.beam.section.diameter",
        "2*tt",
        "'tt' is not defined",
        "did you mean t?",
    ),
    "forgotten operator": (
        changed("diameter: t", "diameter: 2 phi").replace("{t:", "{phi: 1 mm, t:"),
        6,
        "links.beam.section.diameter",
        "'2 phi'",
        "a parameter, not a unit",
        "2*phi",
    ),
    "pi for a unit": (
        changed("diameter: t", "diameter: 2 pi"),
        6,
        "links.beam.section.diameter",
        "'2 pi'",
        "pi is a number",
        "2*pi",
    ),
    "syntax": (changed("diameter: t", "diameter: 2*(t"), 6, "links.beam.section.diameter", "'2*(t'", "not closed", ""),
    "code": (
        changed("diameter: t", "diameter: __import__('os')"),
        6,
        "links.beam.section.diameter",
        "",
        "cannot stand in an expression",
        "",
    ),
    "unknown key": (
        changed("section:", "sectoin: 1, section:"),
        6,
        "links.beam.sectoin",
        "",
        "unknown key",
        "did you mean section?",
    ),
    "unknown key of a kind": (
        changed("diameter: t", "diameter: t, radius: t"),
        6,
        "links.beam.section.radius",
        "",
        "unknown key",
        "allowed: shape, diameter",
    ),
    "unknown key at the top": (BEAM + "node: {}\n", 8, "node", "", "unknown key", "did you mean nodes"),
    "missing key": (changed("material: Al-6061-T6, ", ""), 6, "links.beam.material", "", "required, but missing", ""),
    "kind": (changed("shape: circle", "shape: circel"), 6, "links.beam.section", "'circel'", "shape is one of", ""),
    "no kind": (changed("shape: circle, ", ""), 6, "links.beam.section", "", "needs a key shape", ""),
    "two coordinates": (changed("[0, 0, 0]", "[0, 0]"), 3, "nodes.a", "", "a list of 3 entries", ""),
    "four coordinates": (changed("[0, 0, 0]", "[0, 0, 0, 0]"), 3, "nodes.a", "[0, 0, 0, 0]", "3 entries", ""),
    "no list": (changed("[0, 0, 0]", "0"), 3, "nodes.a", "0", "a list is expected", ""),
    "text for a number of elements": (
        changed("section:", "elements: few, section:"),
        6,
        "links.beam.elements",
        "'few'",
        "a whole number",
        "",
    ),
    "no elements": (changed("section:", "elements: 0, section:"), 6, "links.beam.elements", "0", "at least 1", ""),
    "theory": (BEAM + "theory: bernoulli\n", 8, "theory", "'bernoulli'", "one of 'rayleigh'", ""),
    "corrections": (BEAM + "corrections: plat\n", 8, "corrections", "'plat'", "corrections are auto, none", "plate?"),
    "list of corrections": (
        BEAM + "corrections: [shear, bending]\n",
        8,
        "corrections",
        "['shear', 'bending']",
        "corrections are auto, none",
        "'bending'",
    ),
    "correction without meaning": (
        changed("section:", "corrections: [notch], section:"),
        6,
        "links.beam.corrections",
        "notch",
        "contour",
        "possible",
    ),
    "ends": (changed("section:", "ends: clamped, section:"), 6, "links.beam.ends", "'clamped'", "two of", ""),
    "support": (changed("clamped", "fixd"), 7, "ground.a", "'fixd'", "a support is clamped", ""),
    "name": (
        changed("b: [100", "1b: [100").replace(", b]", ", a]").replace("nodes: [a, a]", "nodes: [a, 1b]"),
        4,
        "nodes.1b",
        "'1b'",
        "a name starts with a letter",
        "dots",
    ),
    "direction": (
        in_amplifier("axis: z, angle", "axis: w, angle"),
        32,
        "instances.amp.rotate.axis",
        "'w'",
        "a direction is x, y, z",
        "",
    ),
    "null direction": (
        in_amplifier("axis: z, angle", "axis: [0, 0, 0], angle"),
        32,
        "instances.amp.rotate.axis",
        "[0, 0, 0]",
        "not zero",
        "",
    ),
    "unit of a parameter apart": (
        changed("{t: 1 mm}", "{t: {value: 0.3, unit: mm}}"),
        1,
        "parameters.t.unit",
        "",
        "stands beside the number",
        "0.3 mm",
    ),
    "bound of another dimension": (
        in_amplifier("minimum: 5 mm", "minimum: 5 g"),
        8,
        "parameters.L.minimum",
        "'5 g'",
        "m; this is in kg",
        "",
    ),
    "below the minimum": (
        in_amplifier("minimum: 5 mm", "minimum: 15 mm"),
        8,
        "parameters.L.value",
        "0.01 m",
        "below the minimum 0.015 m",
        "",
    ),
    "above the maximum": (
        in_amplifier("maximum: 50 g", "maximum: half/L*30 g"),
        7,
        "parameters.m.value",
        "0.02 kg",
        "above the maximum 0.015 kg",
        "",
    ),
    "nu and G": (
        in_amplifier("nu: 0.33,", "nu: 0.33, G: 26 GPa,"),
        13,
        "materials.mine",
        "",
        "exactly one of nu and G",
        "E = 2 G",
    ),
    "catalogue": (
        in_amplifier("al: Al-7075-T6", "al: Al-7075"),
        12,
        "materials.al",
        "Al-7075",
        "the catalogue has no such",
        "Al-7075-T6",
    ),
    "material": (
        changed("Al-6061-T6", "Al-6061"),
        6,
        "links.beam.material",
        "Al-6061",
        "no such material",
        "Al-6061-T6",
    ),
    "section": (
        in_amplifier("section: bar", "section: bra"),
        29,
        "substructures.amp.links.bar.section",
        "bra",
        "no such section",
        "bar",
    ),
    "substructure": (
        in_amplifier("{of: amp,", "{of: apm,"),
        32,
        "instances.amp.of",
        "apm",
        "no such substructure",
        "amp",
    ),
    "node": (
        changed("nodes: [a, b]", "nodes: [a, bb]") + "masses: {m: {node: b, mass: 1 g}}\n",
        6,
        "links.beam.nodes.1",
        "bb",
        "no such node",
        "did you mean b?",
    ),
    "node inside an instance": (
        in_amplifier("node: stage", "node: amp1.b"),
        40,
        "masses.tip.node",
        "amp1.b",
        "no such node",
        "interface of substructure amp",
    ),
    "pattern copy without number": (
        in_amplifier("node: stage", "node: amp.a"),
        40,
        "masses.tip.node",
        "amp.a",
        "no such node",
        "amp1.a",
    ),
    "wildcard": (
        in_amplifier('"amp*.a": clamped', '"amp*.a": clamped, "x*": clamped'),
        43,
        "ground.x*",
        "x*",
        "no node matches",
        "",
    ),
    "inertia entries": (
        in_amplifier("1e-4 kg*m^2, 1e-4 kg*m^2, 1.5e-4", "1e-4 kg*m^2, 1.5e-4"),
        37,
        "bodies.stage.inertia",
        "",
        "3 entries",
        "",
    ),
    "inertia of no body": (
        in_amplifier("1.5e-4", "2.5e-4"),
        37,
        "bodies.stage.inertia",
        "principal moments 0.0001, 0.0001, 0.00025 kg*m^2",
        "larger than the sum",
        "Ixx",
    ),
}


@over("case", CASES)
def test_problem(case):
    text, line, place, value, rule, hint = CASES[case]
    problem = only_problem_in(text)
    assert problem.where == f"model.yaml:{line}"
    assert problem.place == place
    if value:
        assert problem.value == value
    assert rule in problem.rule
    assert hint in problem.hint


EVERYTHING_WRONG = """\
flexura: 1
thoery: timoshenko
parameters:
  t: {value: 0.3 mm, maximum: 0.1 mm}
  u: v
  v: 2*u
  w: 3 mmm
materials:
  al: {E: 70 GPa, rho: 2700, nu: 0.3}
nodes:
  a: [0, 0, 0]
  b: [10 mm, 0, 0]
  c: [20 mm, 0]
  d: [30 mm, 0, 0]
links:
  one: {nodes: [a, b], material: al, section: {shape: circle, diameter: t}}
  two: {nodes: [b, c], material: steel, section: {shape: circle, diameter: tt}}
  three: {nodes: [d, d], material: silicon, section: {shape: rectangle, width: 1 mm, thickness: w}}
  four: {nodes: [b, d], material: silicon, section: {shape: tube, outer_diameter: t, inner_diameter: 2*t}}
  five: {nodes: [b, e], material: silicon, section: {shape: circle, diameter: 1 kg}}
joints:
  - [a, 3]
  - [a, f]
  - [a, b]
instances:
  x: {of: nowhere}
masses:
  m: {node: x.top, mass: 1 g}
ground: {a: clamped, "*": clamped}
"""


def test_everything_that_is_wrong_is_reported_at_once():
    problems = problems_in(EVERYTHING_WRONG)
    lines = [int(p.where.rpartition(":")[2]) for p in problems]
    assert lines == sorted(lines)
    assert len(set(problems)) == len(problems)
    found = {(line, problem.place): problem.rule for line, problem in zip(lines, problems, strict=True)}
    expected = {
        (2, "thoery"): "unknown key",
        (4, "parameters.t"): "above the maximum",
        (5, "parameters.u"): "depends on itself: u -> v -> u",
        (7, "parameters.w"): "'mmm' is not a unit",
        (9, "materials.al.rho"): "a density carries a unit",
        (13, "nodes.c"): "a list of 3 entries",
        (17, "links.two.material"): "no such material",
        (17, "links.two.section.diameter"): "'tt' is not defined",
        (18, "links.three.nodes"): "the node d is named twice",
        (18, "links.three.reference"): "required for a section that is not round",
        (19, "links.four.section"): "the inner diameter of a tube",
        (20, "links.five.section.diameter"): "in m; this is in kg",
        (20, "links.five.nodes.1"): "no such node",
        (22, "joints.0.1"): "text is expected",
        (23, "joints.1.1"): "no such node",
        (24, "joints.2"): "10 mm apart",
        (26, "instances.x.of"): "no such substructure",
        (29, "ground.*"): "already held by a",
    }
    for key, rule in expected.items():
        matching = [
            r
            for (line, place), r in found.items()
            if (line, place) == key or (line, place.removesuffix(".value")) == key
        ]
        assert any(rule in r for r in matching), (key, found)
    assert len(found) == len(expected), found.keys() - expected.keys()


def test_what_was_refused_is_not_missed_elsewhere():
    """A node, material, parameter or instance with an error of its own is not reported as unknown as well."""
    text = AMPLIFIER.replace("E: 70 GPa", "E: 70").replace("b: [L, 0, 0]", "b: [L, 0]").replace("count: 3", "count: 0")
    assert [p.place for p in problems_in(text)] == [
        "materials.mine.E",
        "substructures.amp.nodes.b",
        "instances.amp.pattern.count",
    ]


def test_an_error_inside_a_substructure_that_an_instance_gives_sizes_of_its_own():
    text = AMPLIFIER.replace("axis: z}, rotate", "axis: z}, with: {t: 0.4 mm}, rotate")
    assert only_problem_in(text.replace("b: [L, 0, 0]", "b: [L, 0]")).place == "substructures.amp.nodes.b"
    text = text.replace("nodes: [b, c], material: mine", "nodes: [b, d], material: mine")
    assert [p.place for p in problems_in(text)] == ["substructures.amp.links.bar.nodes.1"]


LEGS = """\
substructures:
  leg:
    nodes: {foot: [20 mm, 0, 0], head: [20 mm, 0, 10 mm]}
    links: {rod: {nodes: [foot, head], material: 17-4PH, section: {shape: circle, diameter: d}, elements: 1}}
    interface: [foot, head]
instances: {leg: {of: leg, pattern: {type: circular, count: 82}}}
bodies: {top: {centre: [0, 0, 12 mm], mass: 1 kg, inertia: [1 g*m^2, 1 g*m^2, 1 g*m^2], carries: ["leg*.head"]}}
ground: {"leg*.foot": clamped}
parameters: {d: 1 mm}
"""


@pytest.mark.parametrize(
    ("old", "new", "place", "rule", "more"),
    [
        ('"leg*.foot": clamped', '"leg*.foot": clamped, "*": clamped', "ground.*", "leg1.foot is already held", 81),
        ('["leg*.head"]', '["leg*.head", "*.head"]', "bodies.top.carries.1", "leg1.head is already carried", 81),
        (
            "parameters:",
            'loads: {"leg*.head": {force: [1 N, 0, 0]}, "*.head": {force: [1 N, 0, 0]}}\nparameters:',
            "loads.*.head",
            "leg1.head is already",
            81,
        ),
        (
            "count: 82}",
            f"count: 82}}, copies: {{{', '.join(f'leg{k}: {{d: {k} kg}}' for k in range(1, 83))}}}",
            *("instances.leg.copies.leg1.d", "in m; this is in kg", 81),
        ),
        (
            "parameters:",
            f"joints: [{', '.join(f'[leg{k}.head, leg{k}.foot]' for k in range(1, 83))}]\nparameters:",
            *("joints.0", "these are 10 mm apart", 81),
        ),
        ("{foot:", f"{{{', '.join(f'n{k}: [{k}, 0, 0]' for k in range(1, 83))}, foot:", "n1.0", "carries a unit", 81),
    ],
)
def test_one_mistake_in_a_pattern_is_one_problem_with_its_count_and_first_place(old, new, place, rule, more):
    problem = only_problem_in(LEGS.replace(old, new))
    assert problem.place.endswith(place) and rule in problem.rule and problem.more == more
    assert f", and {more} more like it" in str(problem)


def test_a_few_places_with_the_same_problem_are_all_named():
    text = BEAM.replace("  b: [100 mm", "  c1: [1, 0, 0]\n  c2: [2, 0, 0]\n  c3: [3, 0, 0]\n  b: [100 mm")
    assert [p.place for p in problems_in(text)] == ["nodes.c1.0", "nodes.c2.0", "nodes.c3.0"]


def test_a_whole_section_that_is_refused_is_not_missed_elsewhere():
    assert only_problem_in(BEAM.replace("nodes:\n  a: [0, 0, 0]\n  b: [100 mm, 0, 0]", "nodes: 7")).place == "nodes"


def test_disconnected_parts_are_named():
    text = BEAM + "bodies: {ball: {mass: 1 kg, inertia: [1 kg*m^2, 1 kg*m^2, 1 kg*m^2]}}\n"
    problem = only_problem_in(text)
    assert "disconnected parts" in problem.rule
    assert (problem.where, problem.value) == ("model.yaml:8", "ball")


@pytest.mark.parametrize(
    "content", [b"\xff\xfe\x00", "nodes: {ä: [0, 0, 0]}".encode("latin-1"), b"nodes:\n  a\x00: 1\n"]
)
def test_what_is_not_text(tmp_path, content):
    file = tmp_path / "m.yaml"
    file.write_bytes(content)
    with pytest.raises(ModelError, match=r"m\.yaml:\d"):
        load(file)


def test_a_file_that_is_not_there(tmp_path):
    (tmp_path / "model.yaml").write_text(BEAM)
    with pytest.raises(ModelError, match="does not exist") as caught:
        load(tmp_path / "modle.yaml")
    assert caught.value.problems[0].hint == "did you mean model.yaml?"
    assert caught.value.problems[0].where == str(tmp_path / "modle.yaml")


def test_a_directory_is_not_a_model_file(tmp_path):
    with pytest.raises(ModelError, match="directory"):
        load(tmp_path)


def test_a_name_that_no_file_can_have():
    with pytest.raises(ModelError, match="cannot be read"):
        load("a\0b")


def test_problems_of_text_say_so():
    with pytest.raises(ModelError, match="<text>:1"):
        loads("[]")


def test_what_is_missing_is_one_problem_wherever_it_is_used():
    nodes = ", ".join(f"n{k}: [{10 * k} mm, 0, 0]" for k in range(8))
    links = "\n".join(
        f"  l{k}: {{nodes: [n{k}, n{k + 1}], material: steal, section: bra, reference: z}}" for k in range(7)
    )
    text = f"nodes: {{{nodes}}}\nsections: {{bar: {{shape: circle, diameter: 1 mm}}}}\nlinks:\n{links}\n"
    with pytest.raises(ModelError) as caught:
        loads(text + "ground: {n0: clamped}\n")
    material, section = caught.value.problems
    assert (material.place, section.place) == ("links.l0.material", "links.l0.section")
    assert material.rule == "there is no such material; also used in links.l1, links.l2, links.l3 and 3 more"
    assert section.rule.startswith("there is no such section; also used in links.l1") and "bar" in section.hint
    # a member that is wrong in another way still counts
    with pytest.raises(ModelError) as caught:
        loads(
            text.replace("reference: z", "reference: [0, 0]", 1).replace("steal", "silicon") + "ground: {n0: clamped}\n"
        )
    assert any(p.rule.startswith("there is no such section; also used in") for p in caught.value.problems)
