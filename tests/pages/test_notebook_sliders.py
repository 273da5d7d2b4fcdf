"""Sliders in a notebook: the widget's Python side here, its script in a browser with the interface of anywidget."""

import re
import sys
from typing import Any

import pytest

import flexura as fx
from flexura.errors import ModelError, OptionError
from helpers.browser import shot
from helpers.every_result import GUIDE, GUIDE_TEXT, NAME
from helpers.widgets import Notebook

EXAMPLES = GUIDE.parents[1]


@pytest.fixture
def guide() -> fx.Mechanism:
    return fx.load(GUIDE)


@pytest.fixture
def notebook(opened, guide) -> Notebook:
    return Notebook(opened.page, fx.sliders(guide, n=3))


def frequencies(mechanism: fx.Mechanism, parameters: dict[str, float], n: int = 3) -> Any:
    """As `fx.modes` of full order gives them, in hertz, to the tolerance of the low order."""
    return pytest.approx(
        [mode.frequency_hz for mode in fx.modes(mechanism, parameters, n=n, order="full").modes], rel=1e-4
    )


def slider(notebook: Notebook, name: str):
    return notebook.page.locator(f".live-row[data-name={name}] input[type=range]")


def number(notebook: Notebook, name: str):
    return notebook.page.locator(f".live-row[data-name={name}] input[type=text]")


def test_frequencies_are_those_of_modes_and_proven(notebook, guide, opened) -> None:
    rows = notebook.rows()
    assert [float(row[1]) for row in rows] == frequencies(guide, {})
    assert all(row[2].startswith("within") for row in rows)
    assert [row[3] for row in rows] == list(fx.modes(guide, n=3, order="full").model_errors.texts)
    assert rows[0][-1].startswith("carriage moves along x")
    assert opened.outside == [] and opened.errors == []


def test_sliders_have_units_and_bounds_of_the_description(notebook, guide) -> None:
    notebook.rows()
    for name, parameter in guide.parameters.items():
        row = notebook.page.locator(f".live-row[data-name={name}]").text_content()
        assert row.startswith(name) and re.search(r"[\d.]+ to [\d.]+ (mm|um)", row)
        assert ("assumed" in row) == (parameter.minimum is None or parameter.maximum is None)


def test_keys_move_a_slider_and_the_frequencies_follow(notebook, guide) -> None:
    before = notebook.rows()
    slider(notebook, "thickness").focus()
    for _ in range(5):
        notebook.page.keyboard.press("ArrowRight")
    after = notebook.rows()
    value = 1e-3 * float(number(notebook, "thickness").input_value())
    assert value > float(guide.parameters["thickness"].value) and after[0][1] != before[0][1]
    assert [float(row[1]) for row in after] == frequencies(guide, {"thickness": value})
    assert notebook.widget.parameters == {"thickness": pytest.approx(value, rel=1e-12)}


def test_the_mouse_drags_a_slider_and_the_last_place_wins(notebook, guide) -> None:
    notebook.rows()
    box = slider(notebook, "length").bounding_box()
    middle = box["y"] + box["height"] / 2
    notebook.page.mouse.move(box["x"] + box["width"] / 2, middle)
    notebook.page.mouse.down()
    for k in range(200):
        notebook.page.mouse.move(box["x"] + box["width"] * (0.2 + 0.6 * ((7 * k) % 200) / 200), middle)
    notebook.page.mouse.move(box["x"] + 0.3 * box["width"], middle)
    notebook.page.mouse.up()
    rows = notebook.rows()
    value = 1e-3 * float(number(notebook, "length").input_value())
    assert notebook.widget.parameters == {"length": pytest.approx(value, rel=1e-12)}
    assert [float(row[1]) for row in rows] == frequencies(guide, {"length": value})


def test_of_many_moves_at_once_the_last_wins_and_few_are_asked_for(notebook, guide) -> None:
    notebook.rows()
    asked = len(notebook.asked)
    slider(notebook, "length").evaluate(
        """(own) => {
          for (let k = 1; k <= 500; k++) {
            own.value = String(k);
            own.dispatchEvent(new Event("input", {bubbles: true}));
          }
          own.dispatchEvent(new Event("change", {bubbles: true}));
        }"""
    )
    rows = notebook.rows()
    value = 1e-3 * float(number(notebook, "length").input_value())
    assert notebook.widget.parameters == {"length": pytest.approx(value, rel=1e-12)}
    assert [float(row[1]) for row in rows] == frequencies(guide, {"length": value})
    designs = [own for own in notebook.asked[asked:] if own["type"] == "design"]
    assert len(designs) <= 3 and designs[-1]["serial"] >= 500


def test_python_sets_the_sliders(notebook, guide) -> None:
    notebook.rows()
    heard: list[dict[str, float]] = []
    notebook.widget.observe(lambda change: heard.append(change["new"]), "parameters")
    notebook.widget.parameters = {"thickness": 6e-4}
    rows = notebook.rows()
    assert float(number(notebook, "thickness").input_value()) in (0.6, 600.0)
    assert [float(row[1]) for row in rows] == frequencies(guide, {"thickness": 6e-4})
    assert heard == [{"thickness": 6e-4}] and notebook.widget.parameters == {"thickness": 6e-4}
    notebook.page.get_by_role("button", name="Undo").click()
    assert [float(row[1]) for row in notebook.rows()] == frequencies(guide, {}) and heard[-1] == {}


def test_what_breaks_the_description_is_said_at_its_slider(notebook, guide) -> None:
    before = notebook.rows()
    number(notebook, "thickness").fill("-1")
    number(notebook, "thickness").press("Enter")
    notebook.settle()
    row = notebook.page.locator(".live-row[data-name=thickness] .live-wrong")
    assert row.is_visible() and "thickness" in row.text_content()
    assert notebook.widget.parameters == {} and notebook.rows() == before
    number(notebook, "thickness").fill("abc")
    number(notebook, "thickness").press("Enter")
    assert "a number in" in row.text_content()
    number(notebook, "thickness").fill("0.56 mm")
    number(notebook, "thickness").press("Enter")
    assert [float(own[1]) for own in notebook.rows()] == frequencies(guide, {"thickness": 0.56e-3})
    assert not row.is_visible()


def test_the_mechanism_is_drawn_and_follows(notebook) -> None:
    notebook.rows()
    notebook.page.wait_for_selector(".fx-viewer canvas")
    notebook.page.emulate_media(reduced_motion="reduce")
    before = shot(notebook.page, "notebook-sliders")
    canvas = notebook.page.locator(".fx-picture > canvas").first.bounding_box()
    x, y, w, h = (int(canvas[key]) for key in ("x", "y", "width", "height"))
    own = before[y : y + h, x : x + w].reshape(-1, 3)
    assert len({tuple(pixel) for pixel in own[::7]}) > 100
    notebook.widget.parameters = {"length": 0.09}
    notebook.rows()
    after = shot(notebook.page, "notebook-sliders-longer")[y : y + h, x : x + w].reshape(-1, 3)
    assert (own != after).any(axis=1).mean() > 0.01


def test_two_views_show_the_same(notebook, guide) -> None:
    notebook.rows()
    slider(notebook, "thickness").focus()
    notebook.page.keyboard.press("End")
    rows = notebook.rows()
    value, again = notebook.widget.values["thickness"], notebook.widget.parameters
    notebook.page.evaluate("(values) => window.sync('values', values)", notebook.widget.values)
    assert notebook.rows() == rows and notebook.widget.parameters == again
    assert notebook.widget.values == {"thickness": value}


def test_names_are_text(opened) -> None:
    notebook = Notebook(opened.page, fx.sliders(fx.loads(GUIDE_TEXT), n=1))
    notebook.rows()
    assert opened.errors == [] and notebook.page.locator("script").count() == 0
    assert NAME in notebook.widget.described["name"]


@pytest.mark.parametrize("dark", [True, False])
def test_the_widget_is_dark_in_a_dark_notebook(opened, guide, dark) -> None:
    opened.page.emulate_media(color_scheme="dark" if dark else "light")
    notebook = Notebook(opened.page, fx.sliders(guide, n=2))
    notebook.rows()
    ground = notebook.page.evaluate("() => getComputedStyle(document.querySelector('.fx-sliders')).backgroundColor")
    light = [int(own) for own in re.findall(r"\d+", ground)[:3]]
    assert max(light) < 60 if dark else min(light) > 200
    shot(notebook.page, f"notebook-{'dark' if dark else 'light'}")


def test_an_ended_view_takes_its_element_away(notebook) -> None:
    notebook.rows()
    notebook.page.evaluate("() => window.end()")
    assert notebook.page.locator(".fx-sliders").count() == 0


def test_free_names_the_sliders(guide) -> None:
    widget = fx.sliders(guide, {"thickness": 6e-4}, free=["thickness"])
    assert [own["name"] for own in widget.described["sliders"] if not own["expression"]] == ["thickness"]
    assert widget.parameters == {"thickness": 6e-4} and "1 parameter" in repr(widget)


def test_wrong_arguments(guide) -> None:
    with pytest.raises(OptionError, match="free: 'height' is no parameter"):
        fx.sliders(guide, free=["height"])
    with pytest.raises(OptionError, match="from 1 to 30, not 0"):
        fx.sliders(guide, n=0)
    with pytest.raises((OptionError, ModelError), match="thickness"):
        fx.sliders(guide, {"thickness": -1.0})
    widget = fx.sliders(guide)
    with pytest.raises(OptionError, match="there is no slider 'nothing'"):
        widget.parameters = {"nothing": 1.0}
    assert widget.parameters == {} == widget.values


def test_without_anywidget_it_is_said_what_to_install(guide, monkeypatch) -> None:
    from flexura.pages.notebook import sliders

    monkeypatch.setitem(sys.modules, "anywidget", None)
    sys.modules[sliders.__module__]._widget.cache_clear()
    try:
        with pytest.raises(OptionError, match=re.escape("pip install 'flexura[notebook]'")):
            fx.sliders(guide)
    finally:
        sys.modules[sliders.__module__]._widget.cache_clear()
