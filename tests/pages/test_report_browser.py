"""A report in a browser: offline, alive, read out rightly, accessible, and printed."""

from __future__ import annotations

import re
import zlib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from helpers.browser import PHONE, Opened, serious_findings, shot

ROOT = Path(__file__).parents[2]
PIEZO = ROOT / "examples/rpr/rpr_piezo.yaml"


@cache
def mechanism() -> fx.Mechanism:
    return fx.load(PIEZO)


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    fx.report(mechanism(), file=PIEZO, out=path)
    return path


def number(text: str) -> float:
    """A number as a chart shows it, perhaps with a power of ten."""
    factor, _, power = text.partition("·10") if "·10" in text else (text, "", "")
    digits = power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    return float(factor) * 10.0 ** int(digits or 0)


def read_out(page, chart: str) -> tuple[float, dict[str, list[float]]]:
    """Where the crosshair is, and the values of all curves there."""
    legend = page.locator(f"figure[data-chart={chart}] .chart-legend")
    x = re.fullmatch(r"at (\S+) Hz", legend.locator("thead th").first.inner_text())
    assert x is not None
    rows = legend.locator("tbody tr").all()
    return number(x[1]), {
        row.locator("th").inner_text(): [number(cell) for cell in row.locator("td").all_inner_texts()] for row in rows
    }


def test_it_is_alive_without_a_network(opened, report):
    opened.page.context.set_offline(True)
    opened.page.goto(report.as_uri())
    opened.page.locator("#scene figure").scroll_into_view_if_needed()
    opened.page.locator("#scene canvas").first.wait_for()
    opened.page.locator("#scene canvas").first.scroll_into_view_if_needed()
    opened.page.wait_for_timeout(500)
    seen = shot(opened.page, "report_desktop")
    box = opened.page.locator("#scene canvas").first.bounding_box()
    inside = seen[int(box["y"]) : int(box["y"] + box["height"]), int(box["x"]) : int(box["x"] + box["width"])]
    assert len(np.unique(inside.reshape(-1, 3), axis=0)) > 40  # a blank picture has one colour
    assert opened.errors == [] and opened.outside == []


def test_the_first_screen_has_the_numbers_and_the_moving_mechanism(opened, report):
    page = opened.page
    page.goto(report.as_uri())
    canvas, nav = page.locator("#scene canvas").first, page.locator("nav")
    canvas.wait_for()
    box = canvas.bounding_box()
    assert box["y"] + box["height"] <= 800 and box["height"] > 300
    assert page.locator("#summary a").last.bounding_box()["y"] < box["y"]
    page.locator("#absent").scroll_into_view_if_needed()
    assert 0 <= nav.bounding_box()["y"] <= 1 and nav.get_by_text("Stress and margins").is_visible()


def test_a_row_shows_its_motion(opened, report):
    opened.page.goto(report.as_uri())
    opened.page.get_by_role("button", name="show mode-4 in 3-D").click()
    frequency = fx.modes(mechanism()).modes[3].frequency_text
    opened.page.locator("#scene figure").get_by_text(f"mode 4: {frequency}").first.wait_for()


def test_charts_read_out_what_frequency_response_finds(opened, report):
    page = opened.page
    page.goto(report.as_uri())
    area = page.locator("figure[data-chart=response-2] .chart-area")
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    for share in (0.3, 0.62, 0.9):
        page.mouse.move(box["x"] + share * box["width"], box["y"] + 0.4 * box["height"])
        hz, shown = read_out(page, "response-2")
        found = fx.frequency_response(mechanism(), frequency_hz=[hz])
        for name, (size, angle) in shown.items():
            H = found.of(*name.partition(", and ")[0].split(" / "))[0]
            assert size == pytest.approx(1e6 * abs(H), rel=2e-3)  # the frequency itself is read in six digits
            assert abs((angle - np.degrees(np.angle(H)) + 180) % 360 - 180) < 0.3


def test_charts_zoom_and_come_back(opened, report):
    page = opened.page
    page.goto(report.as_uri())
    figure = page.locator("figure[data-chart=response-1]")
    area = figure.locator(".chart-area")
    area.scroll_into_view_if_needed()
    box = area.bounding_box()
    reset = figure.get_by_role("button", name="reset")

    def span() -> list[str]:
        return figure.locator("svg.chart-plot text.chart-tick[text-anchor=middle]").all_inner_texts()

    whole = span()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 150)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 150, steps=3)
    page.mouse.up()
    assert span() != whole and reset.is_enabled()
    page.mouse.dblclick(box["x"] + 300, box["y"] + 150)
    assert span() == whole and reset.is_disabled()
    page.mouse.wheel(0, -300)
    page.wait_for_function("button => !button.disabled", arg=reset.element_handle())
    reset.click()
    area.focus()
    page.keyboard.press("+")
    assert span() != whole
    page.keyboard.press("0")
    page.keyboard.press("ArrowRight")
    first, _ = read_out(page, "response-1")
    page.keyboard.press("ArrowRight")
    assert read_out(page, "response-1")[0] > first
    assert "Hz" in figure.get_by_role("status").inner_text()


def test_labels_do_not_collide(opened, report):
    opened.page.goto(report.as_uri())
    for chart in opened.page.locator("figure[data-chart] svg.chart-plot").all():
        boxes = [label.bounding_box() for label in chart.locator("text.chart-label").all()]
        assert boxes
        for k, one in enumerate(boxes):
            for other in boxes[:k]:
                beside = one["x"] >= other["x"] + other["width"] - 1 or other["x"] >= one["x"] + one["width"] - 1
                assert beside or abs(one["y"] - other["y"]) >= 12


def test_it_is_accessible_in_both_colours(opened, report):
    opened.page.goto(report.as_uri())
    assert serious_findings(opened.page) == []
    opened.page.get_by_role("button", name="dark").click()
    assert opened.page.evaluate("document.documentElement.dataset.theme") == "dark"
    assert serious_findings(opened.page) == []


def test_a_phone_needs_no_sideways_scroll(browser, report):
    with browser.new_context(viewport=PHONE, has_touch=True, color_scheme="dark") as context:
        own = Opened(context)
        own.page.goto(report.as_uri())
        own.page.wait_for_timeout(300)
        assert own.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        shot(own.page, "report_phone")
        assert own.errors == []


def test_long_names_need_no_sideways_scroll(browser, tmp_path):
    text = (ROOT / "examples/guide/guide.yaml").read_text(encoding="utf-8")
    file = tmp_path / "long.html"
    fx.report(fx.loads(text.replace("carriage", "carriage_" + 50 * "w")), out=file)
    with browser.new_context(viewport=PHONE) as context:
        own = Opened(context)
        own.page.goto(file.as_uri())
        assert own.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]


def test_without_scripts_it_can_be_read(browser, report):
    with browser.new_context(java_script_enabled=False) as context:
        own = Opened(context)
        own.page.goto(report.as_uri())
        assert own.page.locator("svg.chart-static").first.is_visible()
        assert own.page.locator("#scene figure > img").is_visible()
        own.page.locator("#modes summary").first.click()
        assert own.page.locator("#modes dl").first.is_visible()


def test_it_prints(opened, report, tmp_path):
    opened.page.goto(report.as_uri())
    opened.page.locator("#scene figure").scroll_into_view_if_needed()
    opened.page.locator("#scene canvas").first.wait_for()
    assert not opened.page.locator("#scene figure > img").is_visible()
    pdf = opened.page.pdf(path=tmp_path / "report.pdf")
    assert 4 <= len(re.findall(rb"/Type\s*/Page\b", pdf)) <= 20
    opened.page.emulate_media(media="print")
    opened.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert opened.page.locator("svg.chart-static").first.is_visible()
    assert opened.page.locator("#scene figure > img").is_visible()
    assert not opened.page.locator(".chart-tools").first.is_visible()
    assert not opened.page.locator("button.theme").is_visible()
    assert opened.page.locator("#modes > .numbers > details pre").is_visible()
    assert any(b"Tf" in own for own in _streams(pdf))


def _streams(pdf: bytes) -> list[bytes]:
    """Unpacked contents of a PDF."""
    found = []
    for own in re.findall(rb"stream\r?\n(.*?)endstream", pdf, re.DOTALL):
        try:
            found.append(zlib.decompress(own))
        except zlib.error:
            continue
    return found
