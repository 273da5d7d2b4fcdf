"""What stands at the end of a cell is shown there, once."""

import base64
import io

import nbformat
import numpy as np
import pytest
from PIL import Image

import flexura as fx
from helpers.every_result import GUIDE, GUIDE_TEXT, NAME, NODE
from helpers.notebooks import executed, run, shown

DRAWN = {
    "without a backend": "",
    "with pyplot": "import matplotlib.pyplot as plt",
    "with agg": "%matplotlib agg",
    "inline": "%matplotlib inline",
    "for sharp screens": "%config InlineBackend.figure_format = 'retina'",
}
"""What comes before a figure, one after another in one notebook."""

CELLS = {
    "load": f"import flexura as fx\nguide = fx.load({str(GUIDE)!r})\nfound = fx.modes(fx.loads({GUIDE_TEXT!r}), n=3)",
    **{name: f"{before}\nfx.view.draw_mechanism(fx.assemble(guide))" for name, before in DRAWN.items()},
    "curves": "fx.view.draw_bode(fx.frequency_response(guide, band=(9, 99)))",
    "pyplot": "plt.plot([0, 1], [0, 1]);",
    "modes": "found",
    "mode": "found.modes[0]",
    "plan": "fx.Plan(guide)",
    "mechanism": "guide",
    "statics": f"fx.statics(guide, loads={{'{NODE}': [60, 0, 0, 0, 0, 0]}})",
}


@pytest.fixture(scope="module")
def outputs() -> dict[str, list[dict[str, str]]]:
    """What every cell shows, by MIME type."""
    return {name: shown(own) for name, own in zip(CELLS, run(*CELLS.values()), strict=True)}


def picture(data: dict[str, str]) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(data["image/png"]))).convert("RGB"))


@pytest.mark.parametrize("cell", [*DRAWN, "curves"])
def test_figures_show_themselves_once(outputs, cell) -> None:
    (only,) = outputs[cell]
    assert set(only) == {"image/png", "text/plain"}
    pixels = picture(only)
    assert min(pixels.shape[:2]) > 300 and len(np.unique(pixels.reshape(-1, 3), axis=0)) > 50
    assert (pixels == 255).all(axis=2).mean() < 0.98


def test_figures_of_pyplot_are_left_alone(outputs) -> None:
    assert len(outputs["pyplot"]) == 1


def test_the_example_runs_and_everything_in_it_shows() -> None:
    path = GUIDE.with_suffix(".ipynb")
    stored = nbformat.read(path, 4)
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in stored["cells"])
    cells = [cell for cell in executed(stored, path.parent)["cells"] if cell["cell_type"] == "code"]
    found = {cell["source"].splitlines()[-1]: shown(cell["outputs"]) for cell in cells}
    assert all(len(own) == 1 for own in found.values())
    kinds = {name: set(own[0]) - {"text/plain"} for name, own in found.items()}
    assert kinds["design"] == {"application/vnd.jupyter.widget-view+json"}
    assert kinds["fx.view.draw_bode(response)"] == kinds["fx.view.draw_poses(stroke)"] == {"image/png"}
    assert "<iframe" in found["fx.show(found)"][0]["text/html"]
    assert {"text/html"} == kinds["guide"] == kinds["found"] == kinds["stroke"]
    assert (
        f"{fx.modes(fx.load(GUIDE), {'thickness': 0.6e-3}, n=3).frequency_hz[0]:.5g}"
        in found["fx.modes(guide, design.parameters, n=3)"][0]["text/html"]
    )


def test_results_show_their_tables(outputs) -> None:
    for name in ("modes", "plan", "mechanism", "statics"):
        (only,) = outputs[name]
        assert {"text/html", "text/plain"} == set(only) and "\n" not in only["text/plain"]
    table, described = outputs["modes"][0]["text/html"], outputs["mechanism"][0]["text/plain"]
    assert "carriage moves along x" in table and NAME not in table and "&lt;script&gt;" in table
    assert outputs["mode"][0]["text/plain"].startswith("Mode(number=1")
    assert described.startswith("Mechanism('parallel leaf-spring guide'")


def test_statics_at_the_end_of_a_cell_has_its_warnings(outputs) -> None:
    warnings = fx.statics(fx.load(GUIDE), loads={NODE: [60, 0, 0, 0, 0, 0]}).warnings
    assert warnings and all(own.text in outputs["statics"][0]["text/html"] for own in warnings[:3])
