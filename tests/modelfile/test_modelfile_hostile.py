"""Whatever a file holds, reading it ends in a Mechanism or in a ModelError, soon, and runs nothing."""

from __future__ import annotations

import copy
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from flexura.errors import FlexuraError, ModelError
from flexura.mechanism import Mechanism
from flexura.modelfile import dumps, load, loads
from helpers.modelfile_samples import AMPLIFIER, BEAM, only_problem_in, problems_in


def reads_or_refuses(text: str) -> None:
    try:
        mechanism = loads(text)
    except ModelError as error:
        assert error.problems
        assert all(p.where.startswith("<text>:") and p.rule for p in error.problems)
    else:
        assert loads(dumps(mechanism)) == mechanism


@settings(max_examples=150, deadline=None)
@given(st.text(max_size=200) | st.text(alphabet="{}[]:,-&*!|>'\"#%@?~ \n\tabz019.", max_size=60))
def test_any_text(text):
    reads_or_refuses(text)


@settings(max_examples=80, deadline=None, suppress_health_check=[])
@given(content=st.binary(max_size=200))
def test_any_bytes(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("fuzz") / "m.yaml"
    file.write_bytes(content)
    with pytest.raises(FlexuraError):
        load(file)


@settings(max_examples=150, deadline=None)
@given(st.data(), st.sampled_from([AMPLIFIER, BEAM]))
def test_any_damage_to_a_good_file(data, text):
    start = data.draw(st.integers(0, len(text)))
    stop = min(len(text), start + data.draw(st.integers(0, 20)))
    piece = data.draw(
        st.text(max_size=5) | st.sampled_from(["0", "-1", "1e999", "t", " mm", "[", "]", "null", "\n", "*"])
    )
    reads_or_refuses(text[:start] + piece + text[stop:])


TREE = {text: YAML(typ="safe", pure=True).load(text) for text in (AMPLIFIER, BEAM)}
leaves = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(
        [
            "t",
            "1 mm",
            "2*t",
            "-1 mm",
            "x",
            "amp",
            "a",
            "stage",
            "amp1.a",
            "amp*.c",
            "1 kg",
            "0 mm",
            "nan",
            "t/0",
            "clamped",
            "bar",
            "*",
        ]
    )
)
values = st.recursive(
    leaves,
    lambda v: (
        st.lists(v, max_size=4) | st.dictionaries(st.sampled_from(["a", "t", "nodes", "file", "type"]), v, max_size=3)
    ),
)


def places(data, path=()):
    yield path
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield from places(value, (*path, key))


@settings(max_examples=250, deadline=None)
@given(st.data(), st.sampled_from([AMPLIFIER, BEAM]))
def test_anything_anywhere(data, text):
    """Replace, remove or add entries of the tree of a good file."""
    tree = copy.deepcopy(TREE[text])
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from([p for p in places(tree) if p]))
        holder = tree
        for key in path[:-1]:
            holder = holder[key]
        match data.draw(st.sampled_from(["replace", "remove", "add"])):
            case "replace":
                holder[path[-1]] = data.draw(values)
            case "remove":
                del holder[path[-1]]
            case _ if isinstance(holder, dict):
                names = ["x", "t", "a", "stage", "amp1", "nodes", "pi", "units", "min", "springs", "flexura", "joints"]
                holder[data.draw(st.sampled_from(names))] = data.draw(values)
        if not tree:
            break
    reads_or_refuses(as_yaml(tree))


def as_yaml(value) -> str:
    """Flow style, written by hand so that the tree arrives as it is."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{as_yaml(str(k))}: {as_yaml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(as_yaml, value)) + "]"
    if isinstance(value, str):
        return "'" + "".join(c for c in value if c.isprintable()).replace("'", "''") + "'"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return str(value).replace("inf", ".inf").replace("nan", ".nan")


@pytest.mark.parametrize(
    "text",
    [
        "nodes: !!python/object/apply:os.system ['touch pwned']\n",
        "!!python/object:os.system\na: 1\n",
        "!<tag:yaml.org,2002:python/name:os.system> a: 1\n",
        "nodes: {a: !!python/tuple [0, 0, 0]}\n",
        "%TAG ! tag:yaml.org,2002:python/\n---\nnodes: !object:os.system {}\n",
    ],
)
def test_tags_make_no_objects(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert any("tags are not accepted" in p.rule or "plain text" in p.rule for p in problems_in(text))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "value",
    [
        "__import__('os').system('x')",
        "().__class__",
        "t.__class__",
        "lambda: 0",
        "[x for x in t]",
        "t if t else t",
        "t; t",
    ],
)
def test_expressions_run_no_code(value):
    text = BEAM.replace("diameter: t", f'diameter: "{value}"')
    assert "links.beam" in only_problem_in(text).place


def test_a_billion_laughs():
    lines = ["a0: &a0 [1,1,1,1,1,1,1,1,1,1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    start = time.perf_counter()
    assert "at most 500 000 values" in only_problem_in("\n".join(lines)).rule
    assert time.perf_counter() - start < 2


def test_aliases_that_nest():
    lines = ["a0: &a0 [1]", *(f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, 200))]
    assert "nests at most" in only_problem_in("\n".join(lines)).rule


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        "{a: " * 50_000,
        "a:\n" + "".join(" " * i + "a:\n" for i in range(1, 500)),
        "- " * 20_000,
        "? " * 20_000,
    ],
)
def test_deep_nesting(text):
    start = time.perf_counter()
    problems_in(text)
    assert time.perf_counter() - start < 2


def test_a_huge_file(tmp_path):
    file = tmp_path / "m.yaml"
    file.write_bytes(b"#" * 30_000_000)
    with pytest.raises(ModelError, match="at most 20 000 000 bytes"):
        load(file)


@pytest.mark.parametrize(
    "value",
    [
        "9" * 5000,
        "1" + "0" * 400,
        "1e99999999",
        "1." + "3" * 5000,
        "0x" + "f" * 5000,
        f"'{'9' * 5000} mm'",
        "1e-999999999 mm",
        f"'{'1' * 900}e-900 mm'",
    ],
)
def test_numbers_of_any_size(value):
    try:
        loads(BEAM.replace("[100 mm, 0,", f"[100 mm, {value},"))
    except ModelError as error:
        assert error.problems[0].where == "<text>:4"


@pytest.mark.parametrize(
    "value",
    [
        "(" * 400 + "t" + ")" * 400,
        "-" * 900 + "t",
        "t" + "+t" * 450,
        "t^" * 100 + "t",
        "2^2^2^2^2^2*t",
        "sqrt(" * 70 + "t" + ")" * 70,
        "t*" * 290 + "t",
    ],
)
def test_expressions_of_any_size(value):
    try:
        loads(BEAM.replace("diameter: t", f"diameter: {value}"))
    except ModelError as error:
        assert {p.where for p in error.problems} == {"<text>:6"}


@pytest.mark.parametrize(
    "unit", ["m^99999999", "mm^12*mm^12*mm^12", "(((m^12)^12)^12)", "m" * 59, "m^(1/0)", "m^(1/3)", "µ", "%%", "m^-1"]
)
def test_units_of_any_kind(unit):
    reads_or_refuses(BEAM.replace("100 mm", f"'1 {unit}'"))
    reads_or_refuses(BEAM.replace("{t: 1 mm}", f"{{t: 1 mm, u: '1 {unit}'}}"))


def test_patterns_of_patterns_do_not_fill_the_memory():
    pattern = "[" + ", ".join(["{type: linear, count: 100000, step: [1 mm, 0, 0]}"] * 5) + "]"
    text = "substructures: {s: {nodes: {a: [0, 0, 0]}}}\ninstances: {i: {of: s, pattern: " + pattern + "}}\n"
    assert "at most 200 000 substructures" in only_problem_in(text).rule


def test_substructures_of_substructures_do_not_fill_the_stack():
    inner = [f"  s{i}: {{instances: {{x: {{of: s{i + 1}}}}}}}" for i in range(400)]
    text = "\n".join(["substructures:", *inner, "  s400: {nodes: {a: [0, 0, 0]}}", "instances: {x: {of: s0}}"])
    assert any("nest at most 100 deep" in p.rule for p in problems_in(text))


def test_long_chains_of_parameters():
    chain = ", ".join(f"p{i}: p{i + 1}" for i in range(2000))
    mechanism = loads(BEAM.replace("{t: 1 mm}", f"{{t: p0, {chain}, p2000: 1 mm}}"))
    assert isinstance(mechanism, Mechanism)
