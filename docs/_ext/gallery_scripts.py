"""The gallery: of every mechanism a script, which sphinx-gallery runs and shows, a report, and a row of a table.

The environment variable FLEXURA_REPORTS names the mechanisms of which reports are made, with commas between them; all
if it is not set.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path
from typing import Any

import gallery_table
from sphinx_gallery.scrapers import figure_rst

import flexura as fx
from flexura.gallery import entries
from flexura.tables import quantity

ROOT = Path(__file__).parents[2]
SCRIPTS = ROOT / "docs" / "_build" / "gallery_scripts"
REPORTED = os.environ.get("FLEXURA_REPORTS")

HEAD = """Gallery
=======

Mechanisms that people build, each in one file with the sources of its sizes, beside the numbers that papers, handbooks
and closed forms give for it (``flexura published``). ``flexura new NAME`` writes the file. A click on a heading sorts
the table. Freedoms are those of what is moved, such as 1R2T for a rotation and two translations; none stands out where
the six compliances, rotations counted at the size of the mechanism, have no clear gap between them. The stroke is the
described one; of what actuators drive, what comes out at the end of theirs.

.. list-table::
   :header-rows: 1
   :class: sortable

   * - mechanism
     - freedoms
     - stroke
     - first frequency
     - numbers of others
"""

SCRIPT = '''"""
{title}
{line}

{description}
{report}
"""

import flexura as fx

mechanism = fx.load("{name}.yaml")
figure = fx.view.draw_mechanism(fx.assemble(mechanism))

# %%
# What others give for it, beside what it has here:

fx.published(mechanism)

{driven}# %%
# Its modes, of which the picture shows the first:

found = fx.modes(mechanism, n=4)
first = found.modes[0]
title, moving = f"mode 1: {{first.frequency_hz:.5g}} Hz", first.motion.summary
figure = fx.view.draw_mode(found.model, found.shapes[:, :, 0], title=title, subtitle=moving)
found

# %%
# The file, which ``flexura new {name}`` writes:
#
# .. literalinclude:: /../src/flexura/gallery/{name}.yaml
#    :language: yaml
'''

DRIVEN = """# %%
# What a piezo does, {name} at {told}, motion and stress:

driven = fx.statics(mechanism, actuators={{"{name}": {command!r}}})
figure = fx.view.draw_statics(driven)
driven

"""

DOUBTED = "\nWhat ``flexura check`` warns about: :doc:`what to do with each warning </how-to/doubts>`.\n"

REPORT = "\n`Its report <{name}.report.html>`_: modes and strokes that move, with the evidence of every number.\n"


class Figures:
    """Takes the picture that a block of a script leaves as `figure`."""

    def __repr__(self) -> str:
        return "Figures"

    def __call__(self, _block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
        figure = block_vars["example_globals"].pop("figure", None)
        if figure is None:
            return ""
        path = next(block_vars["image_path_iterator"])
        figure.savefig(path)
        told = [" ".join(text.get_text().split()) for text in figure.texts]
        title, *rest = told
        subtitle = rest[0] if rest else "the mechanism with its flexures, links, bodies and supports"
        return figure_rst([path], gallery_conf["src_dir"], f"{title}: {subtitle}")


def is_reported(name: str) -> bool:
    """Whether a report of the mechanism is made."""
    return REPORTED is None or name in REPORTED.split(",")


def make() -> None:
    """Write the script of every mechanism, as far as it is another than before."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    head, wanted = [HEAD], dict[str, str]()
    for file in (own.path for own in entries()):
        mechanism = fx.load(file)
        wanted[f"plot_{file.stem}.py"] = SCRIPT.format(
            name=file.stem,
            title=mechanism.name,
            line="=" * len(mechanism.name),
            description=mechanism.description.strip().replace("\\", "\\\\"),
            driven=_driven(mechanism),
            report=(DOUBTED if "Warning `" in mechanism.description else "")
            + (REPORT.format(name=file.stem) if is_reported(file.stem) else ""),
        )
        head.append(gallery_table.row(file.stem, mechanism))
        shutil.copyfile(file, SCRIPTS / file.name)
    wanted["README.txt"] = "".join(head)
    for name, text in wanted.items():
        path = SCRIPTS / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for path in SCRIPTS.glob("plot_*.py"):
        if path.name not in wanted:
            path.unlink()


def _driven(mechanism: fx.Mechanism) -> str:
    """The block of the script that drives the first piezo to the end of its stroke; nothing without piezos."""
    plan = fx.Plan(mechanism)
    found = fx.kinetostatics(plan, platform=gallery_table.platform(plan))
    for channel, (_, most) in zip(found.inputs, found.limits, strict=True):
        if channel.quantity in ("expansion", "voltage"):
            return DRIVEN.format(name=channel.name, told=quantity(most, channel.unit), command=round(most, 12))
    return ""


def _reports(app: Any, failed: Exception | None) -> None:
    """Write the reports of mechanisms whose file has changed into the built site."""
    if failed is not None or app.builder.format != "html":
        return
    for file in (own.path for own in entries()):
        path = Path(app.outdir) / "gallery" / f"{file.stem}.report.html"
        if is_reported(file.stem) and not (path.exists() and path.stat().st_mtime >= file.stat().st_mtime):
            with contextlib.chdir(file.parent):
                fx.report(fx.load(file), out=path, file=file.name)


def setup(app: Any) -> dict[str, Any]:
    """Called by Sphinx."""
    make()
    app.connect("build-finished", _reports)
    return {"parallel_read_safe": True}
