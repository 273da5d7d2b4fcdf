"""Pages that follow from the code: the commands of the shell, the names of Python, the schema of model files."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from api_examples import example
from outside_links import rewritten

import flexura
from flexura.cli.app import COMMANDS, loaded

FROM_ROOT = ("CHANGELOG.md", "CONTRIBUTING.md")
"""Files of the repository that are pages."""


def commands() -> str:
    """The page of all commands, from their help."""
    listed = [f"| [`{name}`](#flexura-{name}) | {own.line} |" for name, own in sorted(COMMANDS.items())]
    parts = [
        "# Commands\n\nEvery command as `flexura COMMAND --help` tells it, made from the code; what to do with them: "
        "[how to](../how-to/index.md).\n",
        "| command | what it is for |\n|---|---|\n" + "\n".join(listed) + "\n",
    ]
    for name in sorted(COMMANDS):
        command = loaded(name)
        context = command.make_context(f"flexura {name}", [], resilient_parsing=True)
        usage = re.sub(
            r"\{(\w+)\}|\[(\[\w+\])\]", r"\1\2", " ".join(command.get_usage(context).split())[len("Usage: ") :]
        )
        rows = [_row(record) for own in command.params if (record := own.get_help_record(context))]
        parts.append(f"## `flexura {name}`\n\n{command.help}\n\n```text\n{usage}\n```\n")
        if rows:
            parts.append(
                "| argument or option | what it says | default, bounds |\n|---|---|---|\n" + "\n".join(rows) + "\n"
            )
    return "\n".join(parts)


def _row(record: tuple[str, str]) -> str:
    """A row of a table: names, what it is, its default and bounds, which the help tells in brackets."""
    names, told = record
    found = re.fullmatch(r"(.*?)\s*(?:\[([^\]]*)\])?", told, re.DOTALL)
    what, more = (found[1], found[2] or "") if found else (told, "")
    cells = (f"`{names.replace(' range>', '>')}`", what.replace("*", "\\*"), more.removeprefix("default: "))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells).replace("\n", " ") + " |"


def kinds(page: str) -> Iterator[tuple[str, list[str]]]:
    """Headings of the page of the Python API, with functions and classes that are first named below each."""
    seen = set[str]()
    for section in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
        heading, _, rest = section.partition("\n")
        named = [name for name in re.findall(r"`([\w.]+)[`(]", rest) if name not in seen and callable(_public(name))]
        seen |= set(named)
        if named:
            yield heading, list(dict.fromkeys(named))


def _public(name: str) -> Any:
    """What a name of the package such as `view.draw_mode` stands for; None where there is none."""
    own: Any = flexura
    for part in name.split("."):
        own = getattr(own, part, None) if part in dir(own) else None  # not what has another name now
    return own


def names_of(heading: str, names: list[str]) -> str:
    """The page of one kind of names, from their docstrings."""
    parts = [
        f"# {heading}\n\nNames that examples do not make are those of `docs/_examples`, where they run one after "
        "another: `guide` and `mechanism` are `examples/guide/guide.yaml`.\n"
    ]
    for name in names:
        own = _public(name)
        directive = "autoclass" if inspect.isclass(own) else "autofunction"
        parts.append(f"```{{eval-rst}}\n.. {directive}:: flexura.{name}{_fields(own)}\n```\n")
        if (found := example(name)) is not None:
            parts.append(found.markdown())
    return "\n".join(parts)


def _fields(own: Any) -> str:
    """What a part of a description is called with; nothing for other names, which tell it themselves."""
    fields = getattr(own, "model_fields", None)
    if fields is None:
        return ""
    return f"({', '.join(name if field.is_required() else f'{name}=...' for name, field in fields.items())})"


def _made(app: Any) -> None:
    docs = Path(app.srcdir)
    made = docs / "reference"
    made.mkdir(exist_ok=True)
    pages = {made / "commands.md": commands()}
    api = (docs / "api.md").read_text(encoding="utf-8")
    listed = list(kinds(api))
    slugs = [re.sub(r"\W+", "-", heading.lower()) for heading, _ in listed]
    for slug, (heading, names) in zip(slugs, listed, strict=True):
        pages[made / "python" / f"{slug}.md"] = names_of(heading, names)
    intro = "What the code says of its own names, by kind, verbs and parts of descriptions with an example each."
    index = f"# Docstrings\n\n{intro}\n\n```{{toctree}}\n" + "\n".join(slugs) + "\n```\n"
    pages[made / "python" / "index.md"] = index
    for name in FROM_ROOT:
        origin, page = docs.parent / name, docs / name.lower()
        pages[page] = rewritten(origin.read_text(encoding="utf-8"), origin, page, docs)
    for path, text in pages.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    schema = docs / "_static" / "flexura.schema.json"
    schema.write_text(json.dumps(flexura.schema(), indent=1), encoding="utf-8")


class Docstrings:
    """Docstrings as pages: signs that reStructuredText reads otherwise stand for themselves, and equations that are
    named are led to."""

    CITED = re.compile(r"(theory,? eqs?\. )([A-Z]?\d+)")

    def __init__(self, docs: Path) -> None:
        self.page = {
            tag: page.relative_to(docs).with_suffix(".html").as_posix()
            for page in [docs / "theory.md", *(docs / "theory").glob("*.md")]
            for tag in re.findall(r"\\tag\{([A-Z]?\d+)\}", page.read_text(encoding="utf-8"))
        }

    def __call__(self, _app: Any, _what: str, _name: str, _own: Any, _options: Any, lines: list[str]) -> None:
        lines[:] = [self.line(line) for line in lines]

    def line(self, text: str) -> str:
        """A line of a docstring as reStructuredText."""
        return "`".join(self._escaped(part) if k % 2 == 0 else part for k, part in enumerate(text.split("`")))

    def _escaped(self, text: str) -> str:
        plain = re.sub(r"([|*\\]|(?<=\w)_(?!\w))", r"\\\1", text)
        return self.CITED.sub(self._led, plain)

    def _led(self, match: re.Match[str]) -> str:
        tag = match[2]
        return f"{match[1]}`{tag} <../../{self.page[tag]}#mjx-eqn%3A{tag}>`__" if tag in self.page else match[0]


def _headings(_app: Any, _page: str, _template: str, context: dict[str, Any], _tree: Any) -> None:
    """Captions of the sidebar are headings of the second level."""
    for key, text in context.items():
        if isinstance(text, str) and 'class="caption" role="heading"' in text:
            context[key] = text.replace('role="heading"', 'role="heading" aria-level="2"')


def setup(app: Any) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("builder-inited", _made)
    app.connect("html-page-context", _headings, priority=900)
    app.connect("autodoc-process-docstring", Docstrings(Path(app.srcdir)))
    return {"parallel_read_safe": True}
