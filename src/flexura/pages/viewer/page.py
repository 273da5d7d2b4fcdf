"""Pages as one HTML file that asks nothing of any network, and a mechanism with its results shown by one of them."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, cached_property
from html import escape
from pathlib import Path
from typing import Any, Literal, cast

from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.fem import Drawing
from flexura.files import write_file
from flexura.pages.viewer.faces import scene_of_faces
from flexura.pages.viewer.measured_shapes import scene_of_test
from flexura.pages.viewer.scene import Fact, Scene, ShownMotion, to_json
from flexura.pages.viewer.scenes import Shown, scene_of
from flexura.testing.measurement import IdentifiedModes

_HERE = Path(__file__).parent
_SCRIPT = _HERE.parent / "web" / "dist" / "flexura.js"


def page(
    title: str,
    body: str,
    kind: Literal["viewer", "report", "live", "test"],
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


HEIGHT = 640
"""Height of the viewer in a notebook, pixels."""


class View:
    """A scene that shows itself at the end of a notebook's cell, and that can be saved as a page.

    `scene` is what is shown, as data.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def __repr__(self) -> str:
        count = len(self.scene.motions)
        told = f"{self.scene.name!r}, {count} motion{'s' if count != 1 else ''}"
        return f"View({told}): notebooks show it; elsewhere .save('view.html') and open that file in a browser"

    @cached_property
    def html(self) -> str:
        """The whole page: it needs no network and nothing beside it."""
        title = self.scene.name or "mechanism"
        body = f"<main>\n<h1>{escape(title)}</h1>\n{figure('scene', self.scene)}\n</main>"
        return page(title, body, "viewer", {"viewer": {"scene": to_json(self.scene)}})

    def _repr_html_(self) -> str:
        return (
            f'<iframe title="{escape(self.scene.name)} in three dimensions" sandbox="allow-scripts allow-downloads" '
            f'allow="fullscreen" style="width:100%;height:{HEIGHT}px;border:0" srcdoc="{escape(self.html)}"></iframe>'
        )

    def save(self, path: Path | str) -> Path:
        """Write the page as one HTML file, complete or not at all; returns its path. Raises OptionError where it cannot
        be written."""
        return write_file(path, lambda file: file.write_text(self.html, encoding="utf-8"))


@verb
def show(shown: Shown | Drawing | IdentifiedModes, results: Shown | Sequence[Shown] = ()) -> View:
    """A mechanism and results of it in three dimensions, moving, with every number at hand; or the faces of a part.

    shown: a mechanism, a plan or a full-order model, or a result that holds its model, as in
    `fx.show(fx.modes(mechanism))`, or what `fx.faces` has read, alone: a click on a face copies what chooses it in a
    file; or the modes of a test, alone, on its own points and lines; results: one or several of one design of it:
    modes, statics, a stroke, preload, kinetostatics, freedom spaces, drift, a check, a correlation, a placement of
    sensors, a verification. What it returns shows itself at the end of a cell in Jupyter, VS Code and marimo, without
    a network, and is saved as one HTML file by `save`. Of mechanisms that are too large parts are left out, which the
    page says.

    Raises OptionError for what cannot be shown, results without a mechanism, and results of several designs; ModelError
    as `assemble`.
    """
    if isinstance(shown, Drawing | IdentifiedModes):
        if results:
            raise OptionError("faces of a part and modes of a test are shown alone, as in show(faces(path))")
        return View(scene_of_faces(shown) if isinstance(shown, Drawing) else scene_of_test(shown))
    more = results if isinstance(results, list | tuple) else (cast(Shown, results),)
    return View(scene_of(shown, *more, picture=True))


def figure(key: str, scene: Scene, motion: str = "") -> str:
    """A scene as HTML that can be read and printed where nothing moves: its picture, and a table of its motions.

    The script of the page puts the viewer in its place, with the data under that key in `viewer`. motion: the id of
    what is shown first.
    """
    first = f' data-motion="{escape(motion)}"' if motion else ""
    name = escape(scene.name)
    image = f'<img src="{scene.picture}" alt="picture of {name}">' if scene.picture else ""
    told = "".join(f"<li>{escape(note)}</li>" for note in scene.notes)
    notes = f"<ul>{told}</ul>" if told else ""
    marks = "".join(f"<li>{escape(mark.text)}</li>" for mark in scene.marks)
    doubts = f"<p>warnings:</p><ul>{marks}</ul>" if marks else ""
    return (
        f'<figure data-viewer="{escape(key)}"{first}>{image}<div>{_table(scene.motions)}{doubts}{notes}</div></figure>'
    )


def _table(motions: Iterable[ShownMotion]) -> str:
    """Motions, what they are, and what is wrong with them."""
    rows = [_row(own) for own in motions]
    if not rows:
        return ""
    head = "<thead><tr><th>motion</th><th>what it is</th></tr></thead>"
    return f'<div class="scroll"><table>{head}<tbody>{"".join(rows)}</tbody></table></div>'


def _row(own: ShownMotion) -> str:
    flag = f' <span class="warning">{escape(own.flag)}</span>' if own.flag else ""
    warnings = "".join(f'<p class="warning">{escape(text)}</p>' for text in own.warnings)
    return f"<tr><th>{escape(own.title)}{flag}</th><td>{escape(own.subtitle)}{_facts(own.facts)}{warnings}</td></tr>"


def _facts(facts: Iterable[Fact]) -> str:
    told = "".join(f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in facts)
    return f"<details><summary>numbers</summary><table>{told}</table></details>" if told else ""
