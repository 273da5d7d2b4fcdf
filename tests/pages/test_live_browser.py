"""The live page in a browser: what the hand does, what follows, and what is said when something is wrong."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

import flexura as fx
from helpers.browser import DESKTOP, PHONE, Opened, serious_findings, shot
from helpers.live_page import ROOT, Served, served

GUIDE = ROOT / "examples" / "guide" / "guide.yaml"
SETTLED = 20_000
"""Milliseconds that a loaded machine may take."""


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    return Path(shutil.copy(GUIDE, tmp_path_factory.mktemp("live")))


@pytest.fixture(scope="module")
def guide(file) -> Iterator[Served]:
    """One server for all pages; a test that changes its file puts it back."""
    with served(file, "--keep") as own:
        yield own


@pytest.fixture
def live(guide, opened) -> Iterator[Page]:
    """The page of the guide, standing still; at the end nothing else was asked for and no script has failed."""
    start(opened.page, guide)
    yield opened.page
    assert {url.split("?")[0] for url in opened.asked} == {guide.url}
    assert [text for text in opened.errors if "WebSocket" not in text] == []


def start(page: Page, own: Served) -> None:
    page.emulate_media(reduced_motion="reduce")
    page.goto(own.url)
    expect(page.locator(".live-hz").first).to_have_text(re.compile(r"\d"), timeout=SETTLED)
    expect(page.locator(".live-viewer canvas").first).to_be_visible(timeout=SETTLED)


def slider(page: Page, name: str):
    return page.locator(f'[data-name="{name}"] input[type="range"]')


def number(page: Page, name: str):
    return page.locator(f'[data-name="{name}"] input[type="text"]')


def value(page: Page, name: str) -> float:
    return float(number(page, name).input_value())


def shown(page: Page) -> list[str]:
    """The frequencies, ascending: rows stay with their modes where these cross."""
    return sorted(page.locator(".live-hz").all_inner_texts(), key=float)


def truth(**millimetres: float) -> list[str]:
    parameters = {name: own * 1e-3 for name, own in millimetres.items()}
    return [f"{hz:.5g}" for hz in fx.modes(fx.load(GUIDE), parameters, order="full").frequency_hz]


SHOWS = """wanted => wanted.every(
  (text, k) => text === [...document.querySelectorAll(".live-hz")].map(own => own.textContent).sort((a, b) => a - b)[k])
"""


def follows(page: Page, **millimetres: float) -> None:
    page.wait_for_function(SHOWS, arg=truth(**millimetres), timeout=SETTLED)


def settles(page: Page) -> None:
    """Everything that was asked for is shown."""
    expect(page.locator("#live-results")).to_have_attribute("aria-busy", "false", timeout=SETTLED)


def typed(page: Page, name: str, text: str) -> None:
    number(page, name).fill(text)
    number(page, name).press("Enter")


def test_frequencies_follow_the_keys(live):
    follows(live)
    slider(live, "thickness").focus()
    for key in ("ArrowRight", "ArrowRight", "PageUp", "ArrowLeft"):
        live.keyboard.press(key)
    assert value(live, "thickness") > 0.6
    follows(live, thickness=value(live, "thickness"))
    live.keyboard.press("Home")
    assert value(live, "thickness") == 0.1
    follows(live, thickness=0.1)


def test_frequencies_and_the_picture_follow_the_mouse(live):
    before = shot(live, "live_desktop")
    box = slider(live, "length").bounding_box()
    live.mouse.move(box["x"] + box["width"] * 0.3, box["y"] + box["height"] / 2)
    live.mouse.down()
    for part in np.linspace(0.3, 0.8, 12):
        live.mouse.move(box["x"] + box["width"] * part, box["y"] + box["height"] / 2)
    live.mouse.up()
    assert value(live, "length") > 120
    follows(live, length=value(live, "length"))
    expect(live.locator("#live-time")).to_have_text(re.compile(r"\d m?s"), timeout=SETTLED)
    after = shot(live, "live_desktop_moved")
    place = live.locator(".live-viewer canvas").first.bounding_box()
    y, x = slice(int(place["y"]) + 90, int(place["y"] + place["height"])), slice(int(place["x"]), int(place["x"]) + 500)
    assert np.ptp(before[y, x]) > 60 and (np.abs(before[y, x] - after[y, x]).max(axis=2) > 30).mean() > 0.01


def test_what_takes_longer_follows(live):
    expect(live.locator(".live-modes")).to_contain_text("carriage moves along x", timeout=SETTLED)
    expect(live.locator(".live-results svg").first).to_be_visible(timeout=SETTLED)
    expect(live.locator(".live-margin")).to_contain_text("Factor to yield", timeout=SETTLED)
    expect(live.locator(".live-results")).to_contain_text("the stroke is assumed")
    live.get_by_label("how far").fill("2")
    live.get_by_label("how far").press("Enter")
    model = fx.assemble(fx.load(GUIDE))
    force = 2e-3 / fx.compliance(model, nodes=["carriage"])[0, 0]
    factor = fx.statics(model, loads={"carriage": [force, 0, 0, 0, 0, 0]}).stresses().factor_to_yield
    expect(live.locator(".live-margin")).to_contain_text(f"Factor to yield {factor:.3g}", timeout=SETTLED)
    expect(live.locator(".live-results")).not_to_contain_text("the stroke is assumed")


def test_requirements_stand_beside_the_sliders_and_follow(tmp_path, opened):
    file = tmp_path / "required.yaml"
    wanted = {
        "stiff": "f1 >= 53.5 Hz",
        "light": "mass <= 48 g",
        "close": "f1 >= 54.5 Hz",
        "moves": "shift(x) >= 1 mm under 10 N along x",
    }
    lines = [f"  {name}: {text}" for name, text in wanted.items()]
    file.write_text("\n".join([f"extends: {GUIDE.as_posix()}", "requirements:", *lines, ""]))
    with served(file, "--keep") as own:
        page = opened.page
        start(page, own)

        def verdicts() -> list[str]:
            settles(page)
            return [row.get_attribute("data-verdict") for row in page.locator(".live-requirements li").all()]

        expect(page.locator(".live-requirements li")).to_have_count(4, timeout=SETTLED)
        expect(page.locator(".live-requirements")).to_contain_text("stiff: f1 >= 53.5 Hz 54.345 Hz", timeout=SETTLED)
        assert verdicts() == ["not known", "met", "not known", "met"]
        shot(page, "live_requirements")
        typed(page, "thickness", "0.6")
        expect(page.locator(".live-requirements")).to_contain_text("70.5", timeout=SETTLED)
        assert verdicts() == ["met", "missed", "met", "met"]
        own_row = page.locator(".live-requirements li").nth(1)
        expect(own_row).to_have_attribute("title", "model error none: exact for the description")
        assert serious_findings(page) == []


def test_model_errors_are_those_of_the_design_at_which_the_hand_rests(live):
    column = live.locator(".live-modes th", has_text="model error")
    expect(column).to_have_attribute("title", re.compile("physics"))
    typed(live, "thickness", "1.2")
    follows(live, thickness=1.2)
    expect(live.locator("#live-results")).to_have_attribute("aria-busy", "false", timeout=SETTLED)
    wanted = fx.modes(fx.load(GUIDE), {"thickness": 1.2e-3}, order="full").model_errors
    assert sorted(live.locator(".live-error").all_inner_texts()) == sorted(wanted.texts)
    assert live.locator(".live-before").count() == 0
    assert live.locator(".live-error").first.get_attribute("title") in wanted.causes
    shot(live, "live_model_errors")


def test_help_opens_wherever_the_page_is_focused(live):
    live.locator("body").press("?")
    expect(live.locator("dialog[open]")).to_have_count(1)
    live.keyboard.press("Escape")
    expect(live.locator("dialog[open]")).to_have_count(0)
    number(live, "thickness").press("?")
    expect(live.locator("dialog[open]")).to_have_count(0)


def test_undo_and_redo(live):
    typed(live, "thickness", "0.4")
    follows(live, thickness=0.4)
    typed(live, "thickness", "0,6 mm")
    follows(live, thickness=0.6)
    live.click("#live-undo")
    follows(live, thickness=0.4)
    slider(live, "thickness").focus()
    live.keyboard.press("Control+z")
    follows(live)
    expect(live.locator("#live-undo")).to_be_disabled()
    live.keyboard.press("Control+y")
    follows(live, thickness=0.4)
    live.click('[aria-label^="reset thickness"]')
    follows(live)


def test_a_pinned_design_is_compared_with(live):
    live.click("#live-pin")
    typed(live, "thickness", "1")
    follows(live, thickness=1)
    ratio = fx.modes(fx.load(GUIDE), {"thickness": 1e-3}, n=1).frequency_hz / fx.modes(fx.load(GUIDE), n=1).frequency_hz
    percent = f"+{100 * (ratio[0] - 1):.3g} %"
    expect(live.locator('.live-modes [data-mode="1"]')).to_contain_text(percent, timeout=SETTLED)
    expect(live.locator(".live-modes thead")).to_contain_text("to A")
    live.get_by_role("button", name=re.compile("go to A")).click()
    follows(live)
    live.get_by_role("button", name="remove A").click()
    expect(live.locator(".live-modes thead")).not_to_contain_text("to A")


def test_an_error_stands_at_its_slider_and_the_last_picture_stays(live):
    typed(live, "thickness", "0.4")
    follows(live, thickness=0.4)
    typed(live, "thickness", "5")
    wrong = live.locator('[data-name="thickness"] .live-wrong')
    expect(wrong).to_contain_text("above its maximum", timeout=SETTLED)
    assert shown(live) == truth(thickness=0.4)
    expect(live.locator("#live-status")).to_contain_text("cannot be")
    assert live.evaluate("document.body.classList.contains('live-stale')")
    shot(live, "live_error")
    typed(live, "width", "wide")
    expect(live.locator('[data-name="width"] .live-wrong')).to_contain_text("a number in mm is expected")
    live.click("#live-undo")
    follows(live, thickness=0.4)
    expect(wrong).to_be_hidden()


def test_a_design_is_saved(live, file):
    typed(live, "thickness", "0.41")
    live.click("#live-save")
    live.get_by_label("name of the new file").fill("thin.yaml")
    live.keyboard.press("Enter")
    expect(live.locator("#live-saving")).to_contain_text("thin.yaml is written", timeout=SETTLED)
    assert fx.load(file.with_name("thin.yaml")).parameters["thickness"].value == 0.41e-3
    live.get_by_role("button", name="Save", exact=True).click()
    expect(live.locator("#live-saving")).to_contain_text("exists already", timeout=SETTLED)
    live.get_by_role("button", name="Replace it").click()
    expect(live.locator("#live-saving")).to_contain_text("is written", timeout=SETTLED)


def test_the_page_follows_the_file(live, file):
    text = file.read_text(encoding="utf-8")
    typed(live, "length", "80")
    file.write_text(text.replace("thickness: {value: 0.5 mm", "thickness: {value: 0.6 mm"), encoding="utf-8")
    follows(live, length=80, thickness=0.6)
    file.write_text(text.replace("thickness: thickness", "thickness: thicknes"), encoding="utf-8")
    expect(live.locator("#live-problems")).to_contain_text(re.compile(r"guide\.yaml:\d+"), timeout=SETTLED)
    assert shown(live) == truth(length=80, thickness=0.6)
    file.unlink()
    expect(live.locator("#live-status")).to_contain_text("gone", timeout=SETTLED)
    file.write_text(text, encoding="utf-8")
    follows(live, length=80)
    expect(live.locator("#live-problems")).to_be_hidden()


def test_a_connection_that_is_cut_is_said_and_restored_with_its_state(guide, browser):
    with browser.new_context(viewport=DESKTOP) as context:
        page = Opened(context).page
        links = []

        def joined(own) -> None:
            links.append(own)
            own.connect_to_server()

        page.route_web_socket(re.compile("socket$"), joined)
        start(page, guide)
        typed(page, "thickness", "0.4")
        follows(page, thickness=0.4)
        links[-1].close(code=1011)
        expect(page.locator("#live-status")).to_contain_text("cut", timeout=SETTLED)
        expect(page.locator("#live-status")).not_to_contain_text("cut", timeout=SETTLED)
        assert len(links) == 2
        follows(page, thickness=0.4)
        typed(page, "thickness", "0.6")
        follows(page, thickness=0.6)


def test_two_tabs_have_sliders_of_their_own(live, guide, browser):
    with browser.new_context(viewport=DESKTOP) as context:
        other = Opened(context).page
        start(other, guide)
        typed(live, "thickness", "0.4")
        typed(other, "thickness", "0.7")
        follows(live, thickness=0.4)
        follows(other, thickness=0.7)


MOVES = """name => {
  const own = document.querySelector(`[data-name="${name}"] input[type="range"]`);
  for (let k = 1; k <= 500; k++) {
    own.value = String(k + 10);
    own.dispatchEvent(new Event("input", {bubbles: true}));
  }
}"""


def test_of_500_rapid_moves_the_last_one_wins(live):
    live.evaluate(MOVES, "thickness")
    assert slider(live, "thickness").input_value() == "510"
    follows(live, thickness=value(live, "thickness"))
    settles(live)
    assert shown(live) == truth(thickness=value(live, "thickness"))


def test_facts_of_a_part_follow(live):
    settles(live)
    live.get_by_role("button", name="controls", exact=True).click()
    live.get_by_label("Selected part").select_option(label="leaf1.blade")
    facts = live.locator(".fx-panel .fx-facts").last
    expect(facts).to_contain_text("0.5 x 20 mm", timeout=SETTLED)
    typed(live, "thickness", "0.4")
    expect(facts).to_contain_text("0.4 x 20 mm", timeout=SETTLED)


def test_rigid_motions_are_folded(tmp_path, opened):
    file, text = tmp_path / "free.yaml", GUIDE.read_text(encoding="utf-8")
    file.write_text(text[: text.index("ground:")], encoding="utf-8")
    with served(file) as own:
        page = opened.page
        start(page, own)
        rows = page.locator(".live-modes [data-mode]")
        settles(page)
        assert [row.is_visible() for row in rows.all()] == [False] * 6 + [True] * 6
        shot(page, "live_rigid")
        page.get_by_role("button", name="6 rigid motions").click()
        page.get_by_label("show mode 2").check()
        page.get_by_role("button", name="6 rigid motions").click()
        expect(page.locator(".fx-title")).to_contain_text("mode 2: rigid motion", timeout=SETTLED)
        assert [row.is_visible() for row in rows.all()[:3]] == [False, True, False]
        assert serious_findings(page) == [] and opened.errors == []


def test_another_mode_is_shown(live):
    live.get_by_label("show mode 2").check()
    expect(live.locator(".fx-title")).to_contain_text("mode 2", timeout=SETTLED)


@pytest.mark.parametrize(("name", "size", "scheme"), [("desktop_dark", DESKTOP, "dark"), ("phone", PHONE, "light")])
def test_it_can_be_read_by_all(guide, browser, name, size, scheme):
    with browser.new_context(viewport=size, color_scheme=scheme) as context:
        page = Opened(context).page
        start(page, guide)
        expect(page.locator(".live-modes")).to_contain_text("carriage", timeout=SETTLED)
        shot(page, f"live_{name}")
        assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        assert serious_findings(page) == []


HOSTILE = """flexura: 1
name: "<script>document.title='taken'</script> {0} </script>"
parameters:
  t: {value: 0.5 mm, source: "\\"><img src=x onerror=alert(1)>"}
nodes: {a: [0, 0, 0], "b": [0, 0, 5 cm]}
flexures:
  leaf: {nodes: [a, b], material: spring-steel, reference: x, profile: {type: leaf, width: 1 cm, thickness: t}}
ground: {a: clamped}
"""


def test_names_are_text_alone(tmp_path, opened):
    file = tmp_path / "<i>x.yaml"
    file.write_text(HOSTILE, encoding="utf-8")
    with served(file) as own:
        start(opened.page, own)
        assert "<script>" in opened.page.locator("#live-title").inner_text()
        assert opened.page.title() != "taken" and opened.page.locator("img[src='x']").count() == 0
        assert opened.errors == []
