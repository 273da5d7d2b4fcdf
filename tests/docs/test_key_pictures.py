"""Every key of the mechanism file has a picture, which shows what the file format means today."""

import importlib
import re
import xml.etree.ElementTree as ET

import pytest

from helpers.doc_snippets import ROOT

DOCS = ROOT / "docs"
PAGE = (DOCS / "file-format.md").read_text(encoding="utf-8")
SHOWN = dict(re.findall(r"^!\[([^\]]+)\]\(figures/keys/(\w+)\.svg\)$", PAGE, re.MULTILINE))
LARGEST = 50_000
"""Bytes of a picture."""
TOGETHER = {"Dashpots": "Springs", "Masses": "Bodies", "Sensors": "Actuators"}
"""Headings of keys that stand in the picture of another heading."""
WITHOUT = {
    *("A whole file", "Quantities", "Expressions", "Names and wildcards", "Extending files", "Errors", "Limits"),
    *("Editors", "Writing files"),
}
"""Headings of what is no key that a picture would tell of."""


def texts(svg):
    """The title and all words of a picture."""
    return [
        "".join(own.itertext()) for own in ET.fromstring(svg).iter() if own.tag.rpartition("}")[2] in ("title", "text")
    ]


@pytest.fixture(scope="module")
def pictures():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS / "figures"))
        yield importlib.import_module("file_keys").PICTURES


def test_every_key_has_a_picture():
    sections = dict(re.findall(r"^## (.+)\n((?:(?!^## ).*\n)*)", PAGE, re.MULTILINE))
    without = {name for name, text in sections.items() if "figures/keys/" not in text}
    assert without == WITHOUT | set(TOGETHER)


def test_every_picture_is_shown_once_with_what_it_shows(pictures):
    assert sorted(SHOWN.values()) == sorted(pictures) == sorted(own.stem for own in (DOCS / "figures/keys").iterdir())


@pytest.mark.parametrize("name", sorted(SHOWN.values()))
def test_a_picture_is_that_of_its_script_which_reads_the_piece_of_a_file(pictures, name):
    kept = (DOCS / "figures" / "keys" / f"{name}.svg").read_text(encoding="utf-8")
    drawn = pictures[name]()
    assert texts(kept) == texts(drawn.svg())
    assert SHOWN[drawn.title] == name
    assert len(kept) < LARGEST
