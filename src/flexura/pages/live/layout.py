"""The page as it stands before its script fills it."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from flexura.pages.live.opened import Opened
from flexura.pages.viewer import page

_BODY = """<div class="live">
<header class="live-head">
  <h1 id="live-title">{name}</h1>
  <p class="soft" id="live-file">{file}</p>
  <p id="live-status" role="status">The page is connecting.</p>
  <p class="soft" id="live-time" title="from the hand to the picture"></p>
  <div class="live-tools" role="toolbar" aria-label="design">
    <button type="button" id="live-undo" title="Ctrl+Z" disabled>Undo</button>
    <button type="button" id="live-redo" title="Ctrl+Y" disabled>Redo</button>
    <button type="button" id="live-reset" disabled>Reset all</button>
    <button type="button" id="live-pin" disabled>Pin</button>
    <button type="button" id="live-save" disabled>Save as…</button>
    <button type="button" id="live-theme" aria-label="dark or light">◐</button>
  </div>
</header>
<div class="live-extra">
  <noscript><p class="bad">This page needs scripts, which are turned off.</p></noscript>
  <section id="live-problems" class="live-problems" aria-label="problems" hidden></section>
  <form id="live-saving" class="live-saving" aria-label="save as a new file" hidden></form>
  <section id="live-pins" class="live-pins" aria-label="pinned designs"></section>
</div>
<section class="live-sliders" aria-label="parameters" id="live-sliders"></section>
<main class="live-stage" aria-label="mechanism">
  <div id="live-viewer" class="live-viewer"></div>
  <p id="live-notes" class="soft"></p>
</main>
<section class="live-results" aria-label="results" id="live-results"></section>
</div>"""


def live_page(opened: Opened, connect: Sequence[str]) -> str:
    """The HTML of the page of a file; it may connect to the addresses given, and nowhere else."""
    body = _BODY.format(name=escape(opened.plan.name), file=escape(opened.path.name))
    return page(f"{opened.plan.name}: live", body, "live", connect=" ".join(connect))


def redirection(address: str) -> str:
    """A page that leads to an address."""
    return f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={escape(address)}">'
