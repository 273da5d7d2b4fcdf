"""The live page of a test: what is picked there gives the modes that Python gives, and is saved as these."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect

import flexura as fx
from flexura.tables import Table
from flexura.testing.identification import modes_of_setup, stabilisation
from helpers.browser import serious_findings, shot
from helpers.live_page import Served, served, talk
from helpers.tested_frame import frame, measured_frame

PICKS = [(72.88, 24), (337.55, 50), (1000.2, 40)]
SETTLED = 30_000
"""Milliseconds that a loaded machine may take."""


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    return fx.write_measurement(measured_frame(), tmp_path_factory.mktemp("picks") / "frame.uff")


@pytest.fixture(scope="module")
def rig(file) -> Iterator[Served]:
    with served(file, "--keep") as own:
        yield own


@pytest.fixture(scope="module")
def modes(file) -> fx.IdentifiedModes:
    """What Python makes of the same picks."""
    return fx.identify(fx.read_measurement(file), select=PICKS)


def table_of(modes: fx.IdentifiedModes) -> dict[str, Any]:
    """Columns of the table that the shell prints."""
    return dict(next(item for item in modes.presentation() if isinstance(item, Table)).columns)


def choose(own: Any, serial: int, picks: object = PICKS, **others: Any) -> dict[str, Any]:
    own.say({"type": "choose", "serial": serial, "picks": picks, **others})
    return own.until("modes", "no modes")


def floats(message: dict[str, Any], place: dict[str, Any]) -> np.ndarray:
    data = np.frombuffer(message["bytes"], "<f4", place["bytes"] // 4, place["offset"])
    return data.reshape(place["shape"])


def test_the_modes_of_a_pick_are_those_of_python(rig, modes):
    with talk(rig) as (own, opened):
        assert opened["name"] == "portal frame" and opened["file"] == "frame.uff"
        found = choose(own, 1)
        assert found["columns"] == {name: list(column) for name, column in table_of(modes).items()}
        assert found["hz"] == pytest.approx(modes.frequency_hz, rel=1e-15)
        assert found["notes"] == list(modes.notes)
        assert found["command"] == "flexura identify frame.uff --select '72.88@24,337.55@50,1000.2@40 Hz'"
        matrix = stabilisation(measured_frame()).setups[0].matrix
        i, j = found["pair"]
        hz, size, _, back, _ = floats(found, found["curves"])
        assert hz == pytest.approx(matrix.frequency_hz, rel=1e-6)
        assert size == pytest.approx(np.abs(matrix.response[:, i, j]), rel=1e-6)
        assert back == pytest.approx(np.abs(modes_of_setup(modes, matrix)[:, i, j]), rel=1e-3)
        motions = [motion["title"] for motion in found["scene"]["motions"]]
        assert motions == ["mode 1: 72.88 Hz", "mode 2: 337.55 Hz", "mode 3: 1000.2 Hz", "directions of the channels"]


def test_options_are_those_of_identify(rig, file):
    with talk(rig) as (own, _):
        found = choose(own, 1, None, options={"band": [60.0, 500.0], "order": 30}, refine=False)
        modes = fx.identify(fx.read_measurement(file), band=(60, 500), order=30, refine=False)
        assert found["hz"] == pytest.approx(modes.frequency_hz, rel=1e-15)
        assert found["command"] == "flexura identify frame.uff --band '60,500 Hz' --order 30 --no-refine"


@pytest.mark.parametrize(
    "picks", [[(72.88, 24), (72.88, 30)], [(250.0, 24)], [(72.88, 300)], [(-1.0, None)], [(72.88, 24), (72.88, 34)]]
)
def test_bad_picks_are_refused_in_the_words_of_python(rig, file, picks):
    select = [hz if order is None else (hz, order) for hz, order in picks]
    with pytest.raises(fx.OptionError) as refused:
        fx.identify(fx.read_measurement(file), select=select)
    with talk(rig) as (own, _):
        told = choose(own, 1, picks)
        assert (told["type"], told["text"]) == ("no modes", str(refused.value))
        own.say({"type": "save", "file": "none.json", "serial": 1})
        assert own.until("not saved")["text"] == "there are no modes of these picks to be saved"
        assert choose(own, 2)["type"] == "modes"
    assert not (file.parent / "none.json").exists()


def test_what_is_saved_is_what_identify_gives(rig, file, modes):
    with talk(rig) as (own, _):
        choose(own, 1)
        own.say({"type": "save", "file": "picked.json", "serial": 1})
        assert own.until("saved")["file"] == "picked.json"
        assert json.loads((file.parent / "picked.json").read_text()) == json.loads(json.dumps(modes.to_dict()))
        own.say({"type": "save", "file": "picked.json", "serial": 1})
        assert own.until("exists", "saved")["type"] == "exists"
        own.say({"type": "save", "file": "picked.uff", "serial": 1})
        own.until("saved")
        again = fx.read_measurement(file.parent / "picked.uff").modes
        assert again is not None and again.frequency_hz == pytest.approx(modes.frequency_hz, rel=1e-4)
        for name in ("frame.uff", "../out.json", "out.exe", ".hidden.json"):
            own.say({"type": "save", "file": name, "serial": 1, "overwrite": True})
            assert own.until("saved", "not saved")["type"] == "not saved"


def test_messages_of_the_other_page_are_not_understood(rig):
    with talk(rig) as (own, _):
        for message in (
            {"type": "design", "serial": 1, "values": {}},
            {"type": "choose", "serial": 1, "picks": [["a", 1]]},
        ):
            own.say(message)
            assert "not understood" in own.until("misunderstood")["text"]


def test_data_and_options_that_do_not_go_together_are_refused(file, tmp_path):
    with pytest.raises(fx.OptionError, match="n is the number of modes of a mechanism"):
        fx.live(file, n=4)
    with pytest.raises(fx.OptionError, match=r"for measured data; guide\.yaml is read as a mechanism"):
        fx.live("examples/guide/guide.yaml", channels=tmp_path / "channels.yaml")
    modes_alone = fx.write_modes(fx.identify(measured_frame()), tmp_path / "modes.uff")
    with pytest.raises(fx.OptionError, match="no frequency response to identify modes from"):
        fx.live(modes_alone)


def start(page: Page, own: Served, count: int) -> None:
    page.emulate_media(reduced_motion="reduce")
    page.goto(own.url)
    expect(page.locator("#live-status")).to_contain_text(f"{count} modes, chosen by themselves", timeout=SETTLED)
    expect(page.locator(".live-viewer canvas").first).to_be_visible(timeout=SETTLED)


def shown(page: Page) -> list[str]:
    return page.locator("#test-modes tbody tr td:nth-child(2)").all_inner_texts()


def click_pole(page: Page, hz: float, order: int) -> None:
    """Click where a pole is drawn, by the scales of the chart."""
    at = page.evaluate(
        """([hz, order]) => {
            const svg = document.querySelector("#test-diagram svg.chart-plot"), box = svg.getBoundingClientRect();
            const ticks = [...svg.querySelectorAll("text.chart-tick")].map(own => ({
                value: Number(own.textContent), x: Number(own.getAttribute("x")), y: Number(own.getAttribute("y")) - 4,
                across: own.getAttribute("text-anchor") === "middle"}));
            const on = (all, key, value) => all[0][key]
                + (value - all[0].value) / (all[1].value - all[0].value) * (all[1][key] - all[0][key]);
            const x = ticks.filter(own => own.across), y = ticks.filter(own => !own.across);
            return [box.left + on([x[0], x.at(-1)], "x", hz), box.top + on([y[0], y.at(-1)], "y", order)];
        }""",
        [hz, order],
    )
    page.mouse.click(*at)


def test_poles_are_picked_by_a_click_and_let_go_by_another(rig, file, opened):
    page = opened.page
    whole = fx.identify(fx.read_measurement(file))
    start(page, rig, len(whole.poles))
    poles = stabilisation(fx.read_measurement(file)).setups[0].diagram
    for count, (hz, order) in enumerate(PICKS, start=1):
        of_order = np.flatnonzero(poles.order == order)
        k = of_order[np.argmin(np.abs(poles.frequency_hz[of_order] - hz))]
        click_pole(page, float(poles.frequency_hz[k]), order)
        expect(page.locator("#live-status")).to_contain_text(re.compile(rf"^{count} modes?, picked"), timeout=SETTLED)
    modes = fx.identify(fx.read_measurement(file), select=PICKS)
    assert shown(page) == list(table_of(modes)["frequency [Hz]"])
    assert re.fullmatch(r"7[23]\.\d+@24, 337\.5\d+@50, 1000\.\d+@40", page.locator("#test-picks input").input_value())
    page.locator("#test-modes tbody tr").nth(1).click()
    expect(page.locator(".live-viewer .fx-viewer")).to_contain_text("mode 2: 337.55 Hz")
    shot(page, "picked_test")
    click_pole(page, float(poles.frequency_hz[(poles.order == 50) & (np.abs(poles.frequency_hz - 337.5) < 1)][0]), 50)
    expect(page.locator("#live-status")).to_contain_text("2 modes, picked", timeout=SETTLED)
    field = page.locator("#test-picks input")
    field.fill("72.88@24, 72.88@30")
    field.press("Enter")
    expect(page.locator("#live-problems")).to_contain_text("are one mode", timeout=SETTLED)
    expect(page.locator("#live-save")).to_be_disabled()
    assert {url.split("?")[0] for url in opened.asked} == {rig.url} and opened.errors == []


def test_it_is_accessible(rig, opened):
    start(opened.page, rig, 7)
    assert serious_findings(opened.page) == []


def test_the_file_is_read_again_when_it_is_written(tmp_path, opened, file):
    copy = Path(shutil.copy(file, tmp_path))
    with served(copy, "--keep") as own:
        start(opened.page, own, 7)
        frf = measured_frame().frfs[0]
        low = frf.frequency_hz < 600
        fx.write_measurement(
            fx.Measurement(
                "low", (), (fx.testing.MeasuredFRF(frf.frequency_hz[low], frf.response[low], frf.inputs, frf.outputs),)
            ),
            copy,
        )
        below = fx.modes(frame(), n=8, order="full").frequency_hz
        expect(opened.page.locator("#live-status")).to_contain_text(
            f"{int((below < 600).sum())} modes", timeout=SETTLED
        )
