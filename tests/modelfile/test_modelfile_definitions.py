"""A wrong unit is one problem, at its definition; merge keys join mappings."""

from __future__ import annotations

import pytest

import flexura as fx

BEAM = """\
parameters:
  w: {w}
  t: 1 mm
  half: {half}
nodes:
  a: [0, 0, 0]
  b: [100 mm, w, half]
  c: [200 mm, -w, 2*half]
flexures:
  one: {nodes: [a, b], material: spring-steel, reference: [1, 2, 3], profile: {type: leaf, width: w, thickness: t}}
  two: {nodes: [b, c], material: spring-steel, reference: [1, 2, 3], profile: {type: leaf, width: 3*w, thickness: t}}
ground: {a: clamped}
"""


def beam(w: str = "12 mm", half: str = "20 mm*cos(45 deg)", text: str = BEAM) -> str:
    return text.replace("{w}", w).replace("{half}", half)


def problems_of(text: str) -> list[fx.types.Problem]:
    with pytest.raises(fx.ModelError) as caught:
        fx.loads(text, "beam.yaml")
    return list(caught.value.problems)


def test_a_wrong_unit_is_told_once_at_its_definition() -> None:
    (problem,) = problems_of(beam("12 N"))
    assert (problem.where, problem.place, problem.value) == ("beam.yaml:2", "parameters.w", "12 N")
    assert "in m; this is in N" in problem.rule
    assert "nodes.b.1 and 3 other places" in problem.rule
    assert problem.hint == "e.g. 10 mm"


def test_what_follows_from_a_wrong_unit_is_told_with_it() -> None:
    (problem,) = problems_of(beam("12 N", "w/2"))
    assert problem.place == "parameters.w" and "5 other places" in problem.rule


def test_two_wrong_units_are_two_problems() -> None:
    found = problems_of(beam("12 N", "20 mm").replace("t: 1 mm", "t: 1 kg"))
    assert [p.place for p in found] == ["parameters.w", "parameters.t"]


def test_a_wrong_unit_at_one_use_is_told_there() -> None:
    text = beam().replace("width: 3*w", "width: 3*w^2")
    (problem,) = problems_of(text)
    assert problem.place == "flexures.two.profile.width" and problem.where == "beam.yaml:11"


def test_a_unit_that_is_right_elsewhere_is_told_at_the_uses() -> None:
    text = beam(half="20 mm").replace("c: [200 mm, -w, 2*half]", "c: [200 mm, w^2, half*w]")
    assert [p.place for p in problems_of(text)] == ["nodes.c.1", "nodes.c.2"]


MERGED = """\
nodes: {a: [0, 0, 0], b: [100 mm, 0, 0], c: [200 mm, 0, 0]}
flexures:
  one: &leaf
    nodes: [a, b]
    material: spring-steel
    reference: z
    profile: &profile {type: leaf, width: 10 mm, thickness: 1 mm}
  two:
    nodes: [b, c]
    <<: *leaf
    profile: {thickness: 2 mm, <<: *profile}
ground: {a: clamped}
"""


def test_merge_keys_join_mappings_and_own_keys_win() -> None:
    flexures = fx.loads(MERGED).flexures
    two = flexures["two"]
    assert two.nodes == ("b", "c") and two.material == "spring-steel"
    assert two.profile == fx.describe.Leaf(width=10e-3, thickness=2e-3)
    assert flexures["one"].profile.thickness == 1e-3


def test_of_several_merged_mappings_the_first_wins() -> None:
    text = MERGED.replace("<<: *leaf", "<<: [{material: Invar-36}, *leaf]")
    assert fx.loads(text).flexures["two"].material == "Invar-36"


def test_problems_in_merged_keys_are_told_where_they_are_written() -> None:
    (problem,) = problems_of(MERGED.replace("material: spring-steel", "material: {}"))[:1]
    assert problem.where == "beam.yaml:5"


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("nodes: {<<: 3}\n", "<< takes a mapping"),
        ("nodes: {<<: [{a: [0, 0, 0]}, 3]}\n", "<< takes a mapping"),
        ("nodes: {<<: {a: [0, 0, 0]}, <<: {b: [0, 0, 0]}}\n", "the same key twice"),
        ("nodes: &n {<<: *n}\n", "inside its own anchor"),
        ('nodes: {"<<": [0, 0, 0]}\n', "letters, digits"),
    ],
)
def test_other_merge_keys_are_refused(text: str, rule: str) -> None:
    assert rule in problems_of(text)[0].rule


def test_merged_mappings_count_as_often_as_they_are_used() -> None:
    lines = ["a0: &a0 {" + ", ".join(f"k{i}: 0" for i in range(100)) + "}"]
    lines += [f"a{n}: &a{n} {{x: *a{n - 1}, y: *a{n - 1}, z: {{<<: *a{n - 1}}}}}" for n in range(1, 12)]
    assert "at most 500 000 values" in problems_of("\n".join(lines))[0].rule
