"""`show`: what notebooks put into a cell, and what is saved, hold the whole scene and nothing else."""

import html
import re

import numpy as np
import pytest

import flexura as fx
from flexura.pages.viewer import json_text, to_json
from helpers.browser import PHONE, pixels
from helpers.every_result import NAME, guide
from helpers.shell import flexura


@pytest.fixture(scope="module")
def view() -> fx.View:
    mechanism = guide()
    return fx.show(mechanism, [fx.check(mechanism), fx.modes(mechanism, n=3)])


def test_a_saved_page_opens_without_a_network(view, opened, tmp_path):
    path = view.save(tmp_path / "view.html")
    opened.page.goto(path.as_uri())
    opened.page.wait_for_selector("canvas")
    assert opened.page.inner_text("h1") == NAME
    assert opened.page.get_by_role("radio", name=view.scene.motions[0].title).count() == 1
    opened.page.wait_for_timeout(300)
    seen = pixels(opened.page.locator("canvas").first.screenshot())
    assert len({tuple(colour) for colour in seen.reshape(-1, 3)[::17]}) > 20
    assert opened.errors == [] and opened.outside == []


def test_a_cell_shows_it_in_a_frame_of_its_own(view, opened):
    cell = view._repr_html_()
    assert cell.startswith("<iframe") and cell.count("<") == 2
    assert html.unescape(re.search(r'srcdoc="([^"]*)"', cell)[1]) == view.html
    opened.page.set_content(f"<p>before</p>{cell}<p>after</p>")
    frame = opened.page.frame_locator("iframe")
    frame.locator("canvas").first.wait_for()
    assert frame.locator("h1").inner_text() == NAME
    assert opened.page.evaluate("document.querySelector('iframe').contentDocument") is None
    assert opened.errors == [] and opened.outside == []


def test_it_can_be_read_where_no_script_runs(view, browser, tmp_path):
    path = view.save(tmp_path / "view.html")
    with browser.new_context(java_script_enabled=False, viewport=PHONE) as context:
        page = context.new_page()
        page.goto(path.as_uri())
        for motion in view.scene.motions:
            assert page.get_by_text(motion.title, exact=True).is_visible()
        image = page.locator("img")
        assert image.bounding_box()["width"] <= PHONE["width"]
        assert pixels(image.screenshot()).std() > 5


def test_names_are_text_everywhere(view):
    assert "<script>alert" not in view.html and "<script>alert" not in view._repr_html_()
    assert json_text(to_json(view.scene)) in view.html


def test_pages_of_the_same_are_the_same(view):
    mechanism = guide()
    assert fx.show(mechanism, [fx.check(mechanism), fx.modes(mechanism, n=3)]).html == view.html


def test_one_line_says_what_to_do(view):
    assert "\n" not in repr(view) and ".save(" in repr(view) and "3 motions" in repr(view)


def test_a_page_that_cannot_be_written_leaves_nothing(view, tmp_path):
    with pytest.raises(fx.OptionError, match="no folder"):
        view.save(tmp_path / "missing" / "view.html")
    old = tmp_path / "old.html"
    old.write_text("before", encoding="utf-8")
    with pytest.raises(fx.OptionError):
        view.save(tmp_path)
    assert old.read_text(encoding="utf-8") == "before" and [own.name for own in tmp_path.iterdir()] == ["old.html"]


def test_a_single_result_may_stand_alone():
    modes = fx.modes(guide(), n=1)
    assert fx.show(modes).html == fx.show(modes, []).html


def test_what_cannot_be_shown_is_said():
    with pytest.raises(fx.OptionError, match="no place in a scene"):
        fx.show(guide(), 3)
    with pytest.raises(fx.OptionError, match="no place in a scene"):
        fx.show("guide.yaml")
    with pytest.raises(fx.OptionError, match="holds no mechanism"):
        fx.show(fx.check(guide()))


def test_the_shell_writes_the_same_page(tmp_path):
    file = "examples/guide/guide.yaml"
    out = tmp_path / "guide.html"
    done = flexura("view", file, "--out", str(out), "-n", "2", "--set", "thickness=0.4 mm")
    assert done.returncode == 0 and done.stdout == f"{out}\n"
    mechanism, parameters = fx.load(file), {"thickness": 0.4e-3}
    model = fx.assemble(mechanism, parameters)
    assert out.read_text(encoding="utf-8") == fx.show(model, fx.modes(mechanism, parameters, n=2)).html
    assert [own.name for own in tmp_path.iterdir()] == ["guide.html"]


def test_a_pose_is_shown_where_it_is(tmp_path):
    mechanism = fx.load("examples/guide/guide.yaml")
    there = fx.show(fx.at(mechanism, {"carriage.x": 5e-3}))
    rest = fx.show(mechanism)
    ends = [np.array(own.scene.bounds[1])[0] for own in (rest, there)]
    assert ends[1] - ends[0] == pytest.approx(5e-3, rel=1e-2)
