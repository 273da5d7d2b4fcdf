"""Code has the words of the glossary: each name that it gives is defined, and none of the words that it leaves out is.

FORMER are names that still have such a word. The list only grows shorter: a name that is gone must be taken off it.
"""

import ast
import re
from collections.abc import Iterator

from helpers.doc_snippets import ROOT

SOURCE = ROOT / "src" / "flexura"
PAGE = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
LEFT_OUT = PAGE.split("## Words that are not used")[1]
WORDS = {word for row in re.findall(r"^\| ([a-z, ]+) \| ", LEFT_OUT, re.MULTILINE)[1:] for word in row.split(", ")}
WORDS |= {f"{word}s" for word in WORDS}
PUBLIC = {"FoundMode", "asked", "doubts", "found", "gives_way_upwards", "how", "said", "with_own_copies"}
"""Names on which users build: they go with a deprecation alone."""
FORMER = PUBLIC | {
    "Asked",
    "AskedDesigns",
    "BESIDE",
    "BESIDE_DAMPED",
    "BESIDE_UNDAMPED",
    "Doubts",
    "Found",
    "ONE_WAY",
    "Say",
    "_Asked",
    "_Found",
    "_asked",
    "_asked_at",
    "_beside",
    "_in_own_axes",
    "_one_way",
    "_own",
    "_own_flexibility",
    "_own_mass",
    "_own_sizes",
    "_refuse_own_values",
    "_said_once",
    "_say",
    "_told",
    "_way_out",
    "_write_beside",
    "beside",
    "check_own_values",
    "doubts_figure",
    "doubts_of",
    "heard",
    "own",
    "own_components",
    "own_nodes",
    "own_poles",
    "say",
    "tell",
    "told",
    "understood",
    "way_out",
}
"""And others, which wait for a better one."""


def defined() -> Iterator[str]:
    """Names of modules, functions, classes and their attributes, and of what modules define besides."""
    for path in sorted(SOURCE.rglob("*.py")):
        yield path.parent.name if path.stem == "__init__" else path.stem
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                yield node.name
            for own in node.body if isinstance(node, ast.ClassDef | ast.Module) else ():
                targets = [own.target] if isinstance(own, ast.AnnAssign) else getattr(own, "targets", [])
                yield from (target.id for target in targets if isinstance(target, ast.Name))


NAMES = set(defined())


def words_of(name: str) -> set[str]:
    """Words of a name in snake or camel case."""
    return {word.lower() for word in re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", name)}


def test_names_of_the_glossary_are_defined() -> None:
    rows = [row.split(" | ")[-2] for row in re.findall(r"^\| (.+) \|$", PAGE.split("## Words that")[0], re.MULTILINE)]
    named = [name for cell in rows for name in re.findall(r"`(\w+)`", cell)]
    assert len(named) > 80
    assert [name for name in named if name not in NAMES] == []


def test_no_name_has_a_word_that_the_glossary_leaves_out() -> None:
    assert len(WORDS) > 20
    assert sorted(name for name in NAMES - FORMER if words_of(name) & WORDS) == []


def test_the_list_of_former_names_grows_shorter() -> None:
    assert sorted(FORMER - NAMES) == []
    assert sorted(name for name in FORMER if not words_of(name) & WORDS) == []


def test_words_of_a_name() -> None:
    assert words_of("_told_apart") == {"told", "apart"}
    assert words_of("FoundMode") == {"found", "mode"}
    assert words_of("rejected_FRF") == {"rejected", "frf"}
