"""The gallery: of every mechanism a script, which sphinx-gallery runs and shows, a report, and a row of a table.

The environment variable FLEXURA_REPORTS names the mechanisms of which reports are made, with commas between them; all
if it is not set.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

import flexura as fx
from flexura.errors import FlexuraError
from flexura.gallery import entries
from flexura.mechanism import evaluated
from flexura.tables import quantity

ROOT = Path(__file__).parents[2]
SCRIPTS = ROOT / "docs" / "_build" / "gallery_scripts"
REPORTED = os.environ.get("FLEXURA_REPORTS")

MOVED = {"x": "m", "y": "m", "z": "m", "rx": "rad", "ry": "rad", "rz": "rad"}
MOVED |= {"expansion": "m", "voltage": "V", "force": "N", "moment": "N*m"}

HEAD = """Gallery
=======

Mechanisms that people build, each in one file with the sources of its sizes, beside the numbers that papers, handbooks
and closed forms give for it (``flexura published``). ``flexura new NAME`` writes the file. A click on a heading sorts
the table.

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

# %%
# How it moves:

found = fx.modes(mechanism, n=4)
figure = fx.view.draw_mode(found.model, found.shapes[:, :, 0], title=found.modes[0].motion.summary)
found

# %%
# The file, which ``flexura new {name}`` writes:
#
# .. literalinclude:: /../src/flexura/gallery/{name}.yaml
#    :language: yaml
'''

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
        return figure_rst([path], gallery_conf["src_dir"])


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
            report=REPORT.format(name=file.stem) if is_reported(file.stem) else "",
        )
        head.append(_row(file.stem, mechanism))
        shutil.copyfile(file, SCRIPTS / file.name)
    wanted["README.txt"] = "".join(head)
    for name, text in wanted.items():
        path = SCRIPTS / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for path in SCRIPTS.glob("plot_*.py"):
        if path.name not in wanted:
            path.unlink()


def _row(name: str, mechanism: fx.Mechanism) -> str:
    """The row of a mechanism in the table."""
    plan = fx.Plan(mechanism)
    cells = (
        f":doc:`{mechanism.name} </gallery/plot_{name}>`",
        _freedoms(plan),
        _stroke(plan),
        f"{fx.modes(plan, n=1).frequency_hz[0]:.4g} Hz",
        str(len(mechanism.published)),
    )
    return "\n   * - " + "\n     - ".join(cells) + "\n"


def _freedoms(plan: fx.Plan) -> str:
    """Such as 2R1T, of the body that the described motion moves, or else that the numbers of others name first."""
    motion, listed = plan.mechanism.motion, plan.mechanism.published
    words = re.findall(r"[\w.]+", " ".join([*(motion.move if motion else ()), *(own.ask for own in listed)]))
    bodies = [body for word in words for body in plan.body_names if word == body or word.startswith(f"{body}.")]
    try:
        found = fx.kinetostatics(plan, platform=(bodies or plan.body_names)[0])
    except (FlexuraError, IndexError):
        return ""
    kinds = [own.kind for own in found.freedoms] if found.is_clear else []
    return "".join(f"{kinds.count(kind)}{kind}" for kind in ("R", "T") if kind in kinds)


def _stroke(plan: fx.Plan) -> str:
    """The furthest ends of the described motion."""
    told = []
    values = {name: float(own) for name, own in plan.parameter_values().items()}
    for node, moved in (plan.mechanism.motion.move if plan.mechanism.motion else {}).items():
        for what, unit in MOVED.items():
            ends = getattr(evaluated(moved, values), what)
            if ends:
                sign = "± " if len(ends) == 2 and ends[0] == -ends[1] else ""
                furthest = max(ends, key=lambda end: (abs(end), end))
                of = f"{node}.{what}" if unit in ("m", "rad") else node
                told.append(f"{of} {sign}{quantity(furthest, unit, 3)}")
    return ", ".join(told)


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
