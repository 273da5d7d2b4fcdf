"""Links of pages to files outside `docs`, which stand in the repository: to the page that shows a file, or the file."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\((?!https?:|mailto:)([^)\s#]+)(#[^)\s]*)?\)")
CODE = re.compile(r"^(```+|~~~+).*?^\1|`[^`\n]+`", re.MULTILINE | re.DOTALL)
PAGES = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
"""Files of the repository that are pages of the site."""


def rewritten(text: str, origin: Path, page: Path, docs: Path) -> str:
    """The text of a file `origin` as the page `page`, with links out of `docs` led to pages, or made downloads."""

    def beside(file: Path) -> str:
        return Path(os.path.relpath(file, page.parent)).as_posix()

    def led(match: re.Match[str]) -> str:
        words, anchor = match[1], match[3] or ""
        file = (origin.parent / match[2]).resolve()
        if not file.exists():
            return match[0]
        if file.is_relative_to(docs):
            return f"[{words}]({beside(file)}{anchor})"
        inside = file.relative_to(docs.parent).as_posix()
        if inside in PAGES:
            return f"[{words}]({beside(docs / PAGES[inside])}{'' if inside == 'README.md' else anchor})"
        if file.is_dir():
            return f"{words} (`{inside}`)"
        return "{download}`" + f"{words.replace('`', '')} <{beside(file)}>`"

    spans = [match.span() for match in CODE.finditer(text)]
    return LINK.sub(lambda m: m[0] if any(a < m.start() < b for a, b in spans) else led(m), text)


def _read(app: Any, name: str, source: list[str]) -> None:
    docs = Path(app.srcdir)
    page = docs / f"{name}.md"
    if page.exists():
        source[0] = rewritten(source[0], page, page, docs)


def setup(app: Any) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("source-read", _read)
    return {"parallel_read_safe": True}
