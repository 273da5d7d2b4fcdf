"""Every mechanism of the gallery: sound, without doubts but those it tells itself, and beside what others give for it.

The numbers of others, with their sources, stand in the files, under `published`.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import pytest
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.gallery import Entry, entries, entry

ROOT = Path(__file__).parents[2]
ENTRIES = entries()
of_each = pytest.mark.parametrize("own", ENTRIES, ids=[own.name for own in ENTRIES])


@cache
def read(path: Path) -> fx.Mechanism:
    return fx.load(path)


ASSUMED = ("beam", "root", "body", "ground", "evidence")
"""Kinds of doubts that say by how much an assumption moves a frequency."""


def shell(*words: object) -> str:
    found = CliRunner().invoke(app, [str(word) for word in words])
    assert found.exit_code == 0 and not found.exception
    return found.stdout


@of_each
def test_a_file_says_first_what_it_is(own: Entry) -> None:
    lines = own.text.splitlines()
    assert lines[0] == f"name: {own.name.replace('_', ' ')}" and lines[1] == "description: |"
    assert own.line.endswith(".") and len(own.line) < 120
    description = " ".join(read(own.path).description.split())
    assert description.startswith(own.line) and len(description) > 2 * len(own.line)


@of_each
def test_sizes_have_bounds_and_a_source(own: Entry) -> None:
    typed = {name: one for name, one in read(own.path).parameters.items() if isinstance(one.value, float)}
    for name, parameter in typed.items():
        assert parameter.source, f"{name} has no source"
        if parameter.unit in ("m", "rad"):
            assert parameter.minimum is not None and parameter.maximum is not None, f"{name} has no bounds"


@of_each
def test_the_doubts_of_check_are_those_that_the_description_names(own: Entry) -> None:
    """By their kinds, in backticks: a sentence such as: Warning `mechanism`: it is meant to be all but free.

    Assumptions about beams, joints, bodies and the ground have their numbers, and are no mistakes.
    """
    mechanism = read(own.path)
    named = set(re.findall(r"Warning `(\w+)`", " ".join(mechanism.description.split())))
    doubts = [doubt for doubt in fx.check(mechanism).warnings if doubt.kind not in ASSUMED]
    assert {doubt.kind for doubt in doubts} == named, [str(doubt) for doubt in doubts]


@of_each
def test_it_has_what_others_give_for_it(own: Entry) -> None:
    found = fx.published(read(own.path))
    assert not found.warnings and found.is_met.all()
    assert len(set(found.asked)) >= 2 and len(set(found.source)) >= 2


def test_the_shell_says_the_same_of_what_others_give() -> None:
    path = entry("delta").path
    assert json.loads(shell("published", path, "--json")) == fx.published(read(path)).to_dict()


@of_each
def test_closed_forms_follow_a_thinner_flexure(own: Entry) -> None:
    """A number that is typed holds for the sizes of its source; a formula is to hold for others, too."""
    mechanism = read(own.path)
    forms = tuple(one for one in mechanism.published if set(re.findall(r"\w+", one.value)) & {*mechanism.parameters})
    sizes = [name for name in ("thickness", "web", "diameter") if name in mechanism.parameters]
    if not forms or not sizes:
        pytest.skip("without closed forms over a thickness")
    value = fx.Plan(mechanism).parameter_values()[sizes[0]]
    found = fx.published(mechanism.replaced({"published": forms}), {sizes[0]: 0.97 * float(value)})
    assert found.is_met.all(), [str(one) for one in found.warnings]


@of_each
def test_a_new_file_is_the_same_mechanism(own: Entry, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    shell("new", own.name, "--out", path)
    assert fx.load(path) == read(own.path)


def test_pages_name_mechanisms_that_there_are() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    texts = [page.read_text(encoding="utf-8") for page in pages if "_build" not in page.parts]
    named = {name for text in texts for name in re.findall(r"flexura new ([a-z]\w*)|gallery/(\w+)\.yaml", text)}
    for name in {one or other for one, other in named}:
        assert entry(name).path.exists()
