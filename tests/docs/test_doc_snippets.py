"""Every snippet of the documentation runs and prints what the page says."""

import pytest

from helpers.doc_snippets import PAGES, ROOT, Block, Page, blocks, mismatch, same_token, workshop

EXISTING = [page for page in PAGES if page.exists()]


@pytest.mark.parametrize("path", EXISTING, ids=lambda path: str(path.relative_to(ROOT)))
def test_snippets_of_page(path):
    with workshop():
        found = list(Page(path).run())
    assert not found, "\n\n".join(found)


def test_pages_that_must_have_snippets():
    counts = {path.name: len(blocks(path.read_text(encoding="utf-8"))) for path in EXISTING}
    assert min(counts.get(name, 0) for name in ("verbs.md", "file-format.md", "architecture.md", "tutorial.md")) >= 3


def test_comparison_of_numbers():
    assert same_token("54.077", "54.0771")
    assert same_token("2e-16", "7e-17")
    assert same_token("+0.0079", "+0.0080")
    assert not same_token("54.077", "54.3")
    assert not same_token("6", "7")
    assert not same_token("spoke1", "spoke2")
    assert not same_token("mass", "masses")


def test_comparison_of_output():
    assert not mismatch(["a  1.00", "b"], "a 1.001\n  b\n")
    assert not mismatch(["a", "...", "c"], "a\nb b\nc\n")
    assert not mismatch(["...", "c"], "a\nc\n")
    assert not mismatch(["a", "..."], "a\nc\n")
    assert not mismatch(["still; p2.a, p1.b vibrate"], "still; p1.b, p2.a vibrate")
    assert mismatch(["a"], "a\nb\n")
    assert mismatch(["a", "...", "d"], "a\nb\nc\n")
    assert mismatch(["a", "...", "b"], "a\nb\nc\n")
    assert mismatch(["a 1.0 b"], "a 1.2 b")


def test_failures_are_noticed(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "```python\nprint(1)\n```\n```text\n2\n```\n```python\n1 / 0\n```\n"
        "```yaml\nflexura: 1\n```\n```yaml fragment\nlinks: {ab: {nodes: [a, nowhere]}}\n```\n"
        "```sh\nflexura modes nowhere.yaml\n```\n```console\n$ flexura --version\nflexura 99\n```\n"
    )
    with workshop():
        assert len(list(Page(page).run())) == 6


def test_blocks():
    found = blocks("text\n```yaml fragment\na: 1\n```\n```\nplain\n```\n")
    assert found == [Block("yaml", ("fragment",), "a: 1\n", 3), Block("", (), "plain\n", 6)]
