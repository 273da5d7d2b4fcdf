"""The JSON Schema for editors agrees with what the reader accepts."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

from flexura.modelfile import dumps, loads, schema
from helpers.modelfile_samples import AMPLIFIER, BEAM

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.yaml"))
VALIDATOR = Draft202012Validator(schema())


def errors(text: str) -> list[str]:
    data = YAML(typ="safe", pure=True).load(text)
    return [f"{'.'.join(map(str, e.path))}: {e.message}" for e in VALIDATOR.iter_errors(data)]


def test_the_schema_is_one():
    Draft202012Validator.check_schema(schema())
    assert json.loads(json.dumps(schema())) == schema()


@pytest.mark.parametrize("text", [AMPLIFIER, BEAM, dumps(loads(AMPLIFIER))], ids=["amplifier", "beam", "written"])
def test_it_accepts_what_the_reader_accepts(text):
    loads(text)
    assert errors(text) == []


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda f: f.name)
def test_it_accepts_the_examples(file):
    assert errors(file.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "piece",
    [
        "instances: {i: {of: s, rotate: {axis: x, angle: 90 deg}, pattern: {type: mirror, normal: '-y'}}}",
        "instances: {i: {of: s, rotate: [{axis: [0, 0, 1], angle: phi}]}}",
        "instances: {i: {of: s, with: {t: 1 mm, n: 2}, copies: {i2: {t: 2*t}}}}",
        "instances: {i: {of: s, pattern: [{type: linear, count: 2, step: [1 mm, 0, 0]}]}}",
        "superelements: {p: {nodes: [a], units: {length: mm}, stiffness: {file: K.mtx}, mass: [[1, 0], [0, 1]]}}",
        "parameters: {a: 1 mm, b: 2, c: {value: a/2, minimum: 0, source: guess}}",
        "materials: {x: silicon}",
        "ground: {a: clamped, b: {fixed: [tx]}, 'c*': {free: [rx, ry]}}",
    ],
)
def test_it_knows_the_conveniences(piece):
    assert errors(piece) == []


@pytest.mark.parametrize(
    "piece",
    [
        "nodes: {a: [0, 0]}",
        "nodes: {a: [1, 0, 0]}",
        "node: {}",
        "flexura: 2",
        "parameters: {t: {value: 0.3, unit: mm}}",
        "ground: {a: fixd}",
        "theory: bernoulli",
        "corrections: all",
        "corrections: [plate, bending]",
        "links: {l: {nodes: [a, b], material: x, section: bar, ends: [clamped]}}",
        "links: {l: {nodes: [a, b], material: x, section: bar, ends: [clamped, held]}}",
        "links: {l: {nodes: [a, b], material: x, section: {shape: circel, diameter: 1 mm}}}",
        "links: {l: {nodes: [a], material: x, section: bar}}",
        "dashpots: {d: {nodes: [a, b, c], damping: {tx: 1 N*s/m}}}",
        "instances: {i: {of: s, pattern: {type: circular, count: 0}}}",
    ],
)
def test_it_refuses_what_the_reader_refuses(piece):
    assert errors(piece)


def test_every_key_has_a_type_or_alternatives():
    for name, part in schema()["$defs"].items():
        for key, value in part.get("properties", {}).items():
            assert value.keys() & {"type", "anyOf", "$ref", "const", "enum", "oneOf"}, (name, key)
