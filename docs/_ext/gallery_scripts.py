"""The gallery: of every mechanism of the gallery a script, which sphinx-gallery runs and shows, and a report."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

import flexura as fx

ROOT = Path(__file__).parents[2]
FILES = ROOT / "src" / "flexura" / "gallery"
SCRIPTS = ROOT / "docs" / "_build" / "gallery_scripts"
REPORTS = ROOT / "docs" / "_build" / "reports"

SCRIPT = '''"""
{title}
{line}

{description}

`The report of it <{name}.report.html>`_, with modes and strokes that move · :download:`{name}.yaml <{file}>`
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
# The file:
#
# .. literalinclude:: {file}
#    :language: yaml
'''


HEAD = """Gallery
=======

Mechanisms that people build, each in one file, beside the numbers that others give for it.
"""


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


def make() -> None:
    """Write the script of every mechanism, as far as it is another than before."""
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    files = sorted(FILES.glob("*.yaml"))
    wanted = {"README.txt": HEAD}
    for file in files:
        mechanism = fx.load(file)
        wanted[f"plot_{file.stem}.py"] = SCRIPT.format(
            name=file.stem,
            title=mechanism.name,
            line="=" * len(mechanism.name),
            description=mechanism.description.strip(),
            file=f"/../src/flexura/gallery/{file.name}",
        )
        shutil.copyfile(file, SCRIPTS / file.name)
    for name, text in wanted.items():
        path = SCRIPTS / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for path in SCRIPTS.glob("plot_*.py"):
        if path.name not in wanted:
            path.unlink()


def setup(_app: Any) -> dict[str, Any]:
    """Called by Sphinx."""
    make()
    return {"parallel_read_safe": True}
