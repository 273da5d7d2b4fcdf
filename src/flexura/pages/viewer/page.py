"""A page as one HTML file that asks nothing of any network: text first, then the script that lets it move."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping
from functools import cache
from html import escape
from pathlib import Path
from typing import Any, Literal

_HERE = Path(__file__).parent
_SCRIPT = _HERE.parent / "web" / "dist" / "flexura.js"


def page(
    title: str,
    body: str,
    kind: Literal["viewer", "report", "live"],
    data: Mapping[str, Mapping[str, Any]] | None = None,
    *,
    style: str = "",
    connect: str = "'none'",
) -> str:
    """The text of a whole HTML page.

    title: plain text. body: HTML that can be read and printed without scripts, its text escaped by whoever made it.
    kind: what the script starts. data: what figures show, such as {"viewer": {ID: scene}, "chart": {ID: chart}}, plain
    data as JSON has it; names in it may hold anything. style: more CSS, without `<`. connect: what the
    page may connect to, as a Content Security Policy says it; nothing otherwise. No other script runs in the page, and
    none is loaded from anywhere.
    """
    script = bundle()
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data: blob:; "
        f"connect-src {connect}; base-uri 'none'; form-action 'none'"
    )
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{escape(policy)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="flexura">
<title>{escape(title)}</title>
<style>
{_style()}{style}</style>
</head>
<body data-page="{kind}">
{body}
<script type="application/json" id="flexura-data">{json_text(data or {})}</script>
<script type="module">{script}</script>
</body>
</html>
"""


def json_text(data: object) -> str:
    """Plain data as JSON that may stand in a script element: nothing in it ends the element or begins a comment.

    Raises ValueError for numbers that are not finite.
    """
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def bundle() -> str:
    """The script of all pages, as it may stand in a script element."""
    text = _SCRIPT.read_text(encoding="utf-8")
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")


@cache
def _style() -> str:
    return (_HERE / "page.css").read_text(encoding="utf-8")
