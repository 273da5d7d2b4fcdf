"""Faces of a part as a page: a click on one copies what chooses it in a file."""

import pytest

import flexura as fx
from flexura.errors import OptionError
from flexura.modelfile import loads
from helpers.browser import DESKTOP, Opened, shot
from helpers.shell import flexura
from helpers.step_files import METAL, written
from helpers.viewer_page import press, settle

occ = pytest.importorskip("netgen.occ")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A plate 30 x 20 x 5 mm with two bores and a V groove, one end called as no plain text, one face red."""
    plate = occ.Box((0, 0, 0), (30, 20, 5)) - occ.Cylinder(occ.Pnt(10, 10, -1), occ.Z, 3, 7)
    plate = plate - occ.Cylinder(occ.Pnt(20, 10, -1), occ.Z, 3, 7)
    plate = plate - occ.Box((0, 0, 0), (4, 4, 20)).Rotate(occ.Axis((0, 0, 0), occ.Z), 45).Move((0, -2, -1))
    for face in plate.faces:
        if abs(face.center.y - 20) < 1e-6:
            face.col = (1, 0, 0)
    name = {"table: 1": ("x", 30.0)}
    return fx.faces(written(plate, tmp_path_factory.mktemp("plate") / "plate.step", **name))


def test_what_is_copied_chooses_the_face_and_says_how_many_others(drawn):
    """By the reader of files."""
    parts = fx.show(drawn).scene.parts
    told = set()
    for face, part in zip(drawn.faces, parts, strict=True):
        assert part.choices[0] == (face.text, "this face")
        for text, many in part.choices:
            file = f"parts: {{plate: {{step: '{drawn.path}', material: {METAL}, interfaces: {{own: {text}}}}}}}"
            chosen = drawn.chosen(loads(f"name: plate\n{file}\n").parts["plate"].interfaces["own"])
            assert face in chosen
            assert many == ("this face" if len(chosen) == 1 else f"{len(chosen)} faces")
            told.add(text)
    assert {'{face: "table: 1"}', "{x: 30 mm, normal: +x}", "{radius: 3 mm}", "{y: 20 mm, normal: +y}"} <= told
    assert sum(text.startswith("{normal: [") for text in told) == 2
    assert [many for part in parts for text, many in part.choices if text == "{radius: 3 mm}"] == ["2 faces"] * 2


def test_a_click_on_a_face_copies_what_chooses_it(drawn, browser, tmp_path):
    page_file = tmp_path / "faces.html"
    flexura("faces", drawn.path, "--out", page_file)
    context = {"viewport": DESKTOP, "reduced_motion": "reduce", "permissions": ["clipboard-read", "clipboard-write"]}
    with browser.new_context(**context) as own:
        opened = Opened(own)
        page = opened.page
        page.goto(page_file.as_uri())
        page.wait_for_selector("canvas")
        press(page, "o", "5")  # from above
        settle(page)
        canvas = page.locator(".fx-picture > canvas").first
        top = next(face for face in drawn.faces if face.form == "plane +z")
        canvas.hover()
        page.get_by_text("click to copy").wait_for()
        assert page.locator(".fx-tip strong").inner_text() == f"face {top.number}"
        canvas.click()
        page.get_by_text("copied", exact=True).wait_for()
        clipboard = "() => navigator.clipboard.readText()"
        assert page.evaluate(clipboard) == top.text == f"{{face: {top.number}}}"
        shot(page, "faces")
        page.get_by_role("button", name="{z: 5 mm, normal: +z} this face").click()
        page.get_by_text("copied {z: 5 mm").wait_for(state="attached")
        assert page.evaluate(clipboard) == "{z: 5 mm, normal: +z}"
        assert opened.errors == [] and opened.outside == []


def test_where_there_is_no_clipboard_the_text_can_be_read(drawn, browser, tmp_path):
    path = fx.show(drawn).save(tmp_path / "faces.html")
    with browser.new_context(viewport=DESKTOP, reduced_motion="reduce") as own:
        page = own.new_page()
        page.add_init_script("Object.defineProperty(navigator, 'clipboard', {value: undefined})")
        page.goto(path.as_uri())
        page.wait_for_selector("canvas")
        press(page, "n")
        page.get_by_role("button", name=f"{drawn.faces[0].text} this face").click()
        said = page.get_by_text(f"the clipboard is not to be had: {drawn.faces[0].text}")
        said.wait_for(state="attached")


def test_results_are_of_mechanisms(drawn):
    with pytest.raises(OptionError, match="shown alone"):
        fx.show(drawn, [drawn])


def test_names_of_other_files_are_refused(drawn, tmp_path):
    done = flexura("faces", drawn.path, "--out", tmp_path / "faces.txt")
    assert done.returncode and "page or a table" in done.stderr and not (tmp_path / "faces.txt").exists()
