"""What pages hold before their script fills it: of a mechanism with sliders, and of a test whose modes are picked."""

MODEL = """<div class="live">
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
<div class="live-sliders"><section aria-label="requirements" id="live-requirements" hidden></section>
<section aria-label="parameters" id="live-sliders"></section></div>
<main class="live-stage" aria-label="mechanism">
  <div id="live-viewer" class="live-viewer"></div>
  <p id="live-notes" class="soft"></p>
</main>
<section class="live-results" aria-label="results" id="live-results"></section>
</div>"""
"""That of a mechanism, by its name and that of its file."""

TEST = """<div class="live live-test">
<header class="live-head">
  <h1 id="live-title">{name}</h1>
  <p class="soft" id="live-file">{file}</p>
  <p id="live-status" role="status">The page is connecting.</p>
  <div class="live-tools" role="toolbar" aria-label="modes">
    <button type="button" id="live-save" disabled>Save as…</button>
    <button type="button" id="live-theme" aria-label="dark or light">◐</button>
  </div>
</header>
<div class="live-extra">
  <noscript><p class="bad">This page needs scripts, which are turned off.</p></noscript>
  <section id="live-problems" class="live-problems" aria-label="problems" hidden></section>
  <form id="live-saving" class="live-saving" aria-label="save the modes" hidden></form>
</div>
<main class="live-diagram" aria-label="poles">
  <form class="live-fields" id="test-options" aria-label="how poles are found"></form>
  <figure id="test-diagram" aria-label="stabilisation diagram"></figure>
  <form class="live-fields" id="test-picks" aria-label="picks"></form>
  <section id="test-modes" aria-label="modes"></section>
</main>
<section class="live-results" aria-label="results" id="live-results">
  <section aria-label="shapes"><h2>Shapes</h2><div id="live-viewer" class="live-viewer"></div>
  <p id="test-shapes" class="soft"></p></section>
  <section aria-label="measured and given back"><h2>Measured, and given back by the modes</h2>
  <div class="live-fields" id="test-pair"></div><figure id="test-synthesis"></figure></section>
</section>
</div>"""
"""That of a test."""
