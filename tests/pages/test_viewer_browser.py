"""The viewer in a browser, on a scene written by hand whose colours, sizes and motions are known."""

from __future__ import annotations

import numpy as np
import pytest

from helpers.browser import PHONE, pixels, serious_findings, shot
from helpers.two_boxes import BODY, FLEXURE, buffer, two_boxes
from helpers.viewer_page import changed, extent, front, like, middle, picture, press, settle


def test_parts_stand_where_they_are_in_their_colours(show):
    page = show()
    shot(page, "viewer-two-boxes")
    front(page)
    image = picture(page)
    blue, orange = extent(like(image, BODY)), extent(like(image, FLEXURE))
    scale = (orange[1] - blue[0] + 1) / 100  # pixels for a millimetre
    assert scale > 4
    assert abs((blue[1] - blue[0] + 1) / scale - 45) < 1 and abs((orange[1] - orange[0] + 1) / scale - 45) < 1
    assert abs((blue[3] - blue[2] + 1) / scale - 40) < 1
    assert abs((orange[1] + blue[0]) / 2 - image.shape[1] / 2) < 3


@pytest.mark.parametrize(("key", "first"), [("1", BODY), ("2", FLEXURE)])
def test_front_and_back_are_mirrored(show, key, first):
    page = show()
    front(page)
    press(page, key)
    image = picture(page)
    left = min((BODY, FLEXURE), key=lambda colour: extent(like(image, colour))[0])
    assert left == first


@pytest.mark.parametrize(("key", "wide", "tall"), [("5", 100, 40), ("6", 100, 40)])
def test_from_above_and_below_widths_are_those_of_the_plan(show, key, wide, tall):
    page = show()
    front(page)
    press(page, key)
    both = like(image := picture(page), BODY) | like(image, FLEXURE)
    left, right, top, bottom = extent(both)
    assert (bottom - top + 1) / (right - left + 1) == pytest.approx(tall / wide, abs=0.02)


def test_a_mode_moves_what_it_moves(show):
    page = show(reduced_motion="no-preference")
    first = picture(page)
    assert page.get_by_role("button", name="pause").is_visible()
    page.wait_for_timeout(400)
    assert changed(picture(page), first) > 2000


def test_nothing_moves_for_who_prefers_less_motion(show):
    page = show()
    first = picture(page)
    page.wait_for_timeout(400)
    assert np.array_equal(picture(page), first)
    assert page.get_by_role("button", name="play").is_visible()


def test_steps_and_scale_move_by_what_is_said(show):
    """Mode 1 lifts the orange box by 20 mm at its largest, half of the height of both."""
    page = show()
    front(page)
    rest = extent(like(picture(page), FLEXURE))
    scale = (rest[1] - rest[0] + 1) / 45
    page.get_by_role("radio", name="mode 1").check()
    settle(page)
    high = extent(like(picture(page), FLEXURE))
    assert (rest[3] - high[3]) / scale == pytest.approx(20, abs=0.7)
    page.get_by_role("slider", name="scale of the displacement").fill("-0.3")
    settle(page)
    assert (rest[3] - extent(like(picture(page), FLEXURE))[3]) / scale == pytest.approx(20 * 10**-0.3, abs=0.7)
    page.get_by_role("slider", name="place within the motion").fill("0")
    settle(page)
    assert abs(rest[3] - extent(like(picture(page), FLEXURE))[3]) <= 1
    for _ in range(18):
        page.get_by_role("button", name="step on").click()
    settle(page)
    assert (rest[3] - extent(like(picture(page), FLEXURE))[3]) / scale == pytest.approx(-20 * 10**-0.3, abs=0.7)


def test_a_stroke_is_interpolated_between_its_poses(show):
    page = show()
    front(page)
    rest = extent(like(picture(page), FLEXURE))
    scale = (rest[1] - rest[0] + 1) / 45
    page.get_by_role("radio", name="stroke of arm").check()
    for place, value in ((0.0, -20.0), (1 / 3, -8.0), (0.5, 1.0), (1.0, 20.0)):
        page.get_by_role("slider", name="place within the motion").fill(f"{place:.3f}")
        settle(page)
        assert (rest[2] - extent(like(picture(page), FLEXURE))[2]) / scale == pytest.approx(value, abs=0.8)
        shown = float(page.locator(".fx-place").inner_text().split()[0])
        assert shown == pytest.approx(value, abs=0.05)


def test_what_is_under_the_pointer_is_named_with_its_facts(show):
    page = show()
    front(page)
    page.get_by_role("radio", name="1 N at arm").check()
    page.get_by_role("slider", name="place within the motion").fill("0.5")
    settle(page)
    x, y = middle(like(picture(page), FLEXURE))
    page.locator(".fx-picture > canvas").first.hover(position={"x": x, "y": y})
    tip = page.locator(".fx-tip")
    tip.wait_for()
    text = tip.inner_text()
    assert text.startswith("arm[1].leaf\nflexures") and "45 mm" in text and "40 x 10 mm" in text
    assert "up to 2 mm" in text and "up to 200 MPa" in text
    blue = middle(like(picture(page), BODY))
    page.locator(".fx-picture > canvas").first.hover(position={"x": blue[0], "y": blue[1]})
    settle(page)
    assert tip.inner_text().startswith("base\nbodies\n") and "0.2 g" in tip.inner_text()
    assert "up to 0 Pa" in tip.inner_text()
    page.locator(".fx-picture > canvas").first.hover(position={"x": 15, "y": 300})
    settle(page)
    assert not tip.is_visible()


def test_a_click_selects_and_outlines(show):
    page = show()
    front(page)
    before = picture(page)
    x, y = middle(like(before, FLEXURE))
    page.locator(".fx-picture > canvas").first.click(position={"x": x, "y": y})
    settle(page)
    assert page.get_by_label("Selected part").locator("option:checked").inner_text() == "arm[1].leaf"
    assert "selected arm[1].leaf" in page.locator(".fx-said").inner_text()
    assert changed(picture(page), before) > 400
    press(page, "Escape")
    assert page.get_by_label("Selected part").input_value() == "-1"


def test_the_legend_hides_and_shows(show):
    page = show()
    front(page)
    page.get_by_role("checkbox", name="bodies 1").uncheck()
    settle(page)
    image = picture(page)
    assert like(image, BODY).sum() < 50 and like(image, FLEXURE).sum() > 5000
    assert page.locator(".fx-said").inner_text() == "bodies hidden"
    page.get_by_role("checkbox", name="bodies 1").check()
    settle(page)
    assert like(picture(page), BODY).sum() > 5000


def test_a_section_cuts_away_what_lies_beyond_it(show):
    page = show()
    front(page)
    whole = extent(like(picture(page), FLEXURE))
    press(page, "x")
    assert page.get_by_label("section across").input_value() == "0"
    page.get_by_role("slider", name="place of the section").fill("0.76")
    settle(page)
    cut = extent(like(picture(page), FLEXURE))
    sides = {(cut[1] - cut[0] + 1) / (whole[1] - whole[0] + 1)}
    page.get_by_role("button", name="show the other side").click()
    settle(page)
    other = extent(like(picture(page), FLEXURE))
    sides.add((other[1] - other[0] + 1) / (whole[1] - whole[0] + 1))
    # at x = 26 mm of a box from 5 to 50 mm
    assert sorted(sides) == [pytest.approx(21 / 45, abs=0.02), pytest.approx(24 / 45, abs=0.02)]
    assert page.get_by_text("x = 26 mm").is_visible()


def test_colours_of_a_quantity_end_where_the_bar_ends(show):
    """Energy is 0 in the blue box, of which no light takes the hue; the bar says what the ends mean."""
    page = show()
    front(page)
    page.get_by_role("radio", name="mode 1").check()
    page.get_by_label("Colour").select_option("strain energy")
    settle(page)
    bar = page.locator(".fx-colours")
    assert bar.inner_text().split("\n")[:2] == ["strain energy", "2 mJ"]
    ramp = pixels(page.locator(".fx-colours-ramp").screenshot())[2:-2, 7]
    lowest = "#{:02x}{:02x}{:02x}".format(*ramp[-1])
    assert like(picture(page), lowest).sum() > 5000
    lightness = ramp @ [0.2126, 0.7152, 0.0722]
    assert np.all(np.diff(lightness) <= 1) and lightness[0] - lightness[-1] > 120


def test_values_that_are_not_known_are_grey(show):
    scene = two_boxes()
    scene["motions"][0]["colours"][1]["values"] = buffer(np.full(19, 255), "u8", 1 / 254)
    page = show(scene)
    front(page)
    page.get_by_role("radio", name="mode 1").check()
    page.get_by_label("Colour").select_option("strain energy")
    settle(page)
    image = picture(page)
    plain = (np.ptp(image, axis=-1) < 14) & (image.max(axis=-1) < 215) & (image.min(axis=-1) > 100)
    assert plain.sum() > 10000
    assert page.locator(".fx-colours-unknown").is_visible()


def test_axes_arrows_and_marks_are_labelled(show):
    page = show()
    assert page.locator(".fx-label:visible").all_inner_texts() == ["thickness in doubt"]
    page.get_by_role("radio", name="1 N at arm").check()
    settle(page)
    assert set(page.locator(".fx-label:visible").all_inner_texts()) == {
        "screw, pitch 1 mm",
        "1 N",
        "thickness in doubt",
    }
    with_axis = picture(page)
    page.get_by_role("radio", name="mode 2").check()
    settle(page)
    assert changed(with_axis, picture(page)) > 1000
    assert page.locator(".fx-warning").inner_text() == "the bound is 3 % wide"
    assert page.locator(".fx-title .fx-flag").inner_text() == "not proven"


def test_the_keyboard_is_enough(show):
    page = show()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.tagName") == "CANVAS"
    first = picture(page)
    page.keyboard.press("ArrowLeft")
    settle(page)
    turned = picture(page)
    assert changed(first, turned) > 2000
    page.keyboard.press("]")
    settle(page)
    assert page.get_by_role("radio", name="mode 2").is_checked()
    assert "mode 2: 31.4 Hz, not proven" in page.locator(".fx-said").inner_text()
    page.keyboard.press("n")
    settle(page)
    assert page.get_by_label("Selected part").input_value() == "0"
    page.keyboard.press("Space")
    assert page.get_by_role("button", name="pause").is_visible()
    page.keyboard.press("?")
    assert page.get_by_role("dialog", name="keys").is_visible()
    page.keyboard.press("Escape")
    assert not page.get_by_role("dialog", name="keys").is_visible()
    reached = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate("document.activeElement.ariaLabel || document.activeElement.labels?.[0]?.textContent")
        )
    assert {
        "save as PNG",
        "place within the motion",
        "scale of the displacement",
        "speed",
        "Colour",
        "bodies1",
    } <= reached


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("phone", [False, True])
def test_nothing_serious_is_in_the_way_of_anyone(show, scheme, phone):
    page = show(color_scheme=scheme, **({"viewport": PHONE, "has_touch": True} if phone else {}))
    if phone:
        assert not page.locator(".fx-panel").is_visible()
        page.get_by_role("button", name="controls").click()
        assert page.locator(".fx-panel").is_visible()
    page.get_by_role("radio", name="1 N at arm").check()
    page.get_by_label("Colour").select_option("stress")
    settle(page)
    shot(page, f"viewer-{scheme}-{'phone' if phone else 'desktop'}")
    assert serious_findings(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_dark_and_light_follow_the_page(show):
    page = show(color_scheme="dark")
    assert picture(page)[5, 5].max() < 60
    page.evaluate("document.documentElement.dataset.theme = 'light'")
    settle(page)
    assert picture(page)[5, 5].min() > 200


def test_names_are_text(show):
    page = show(two_boxes(name="</script><img src=x onerror=throw(1)>"))
    assert "</script><img" in page.locator(".fx-title").inner_text()
    press(page, "n", "n", "n")
    assert page.get_by_label("Selected part").locator("option:checked").inner_text() == "<b>spring</b>"


def test_bodies_can_be_seen_through(show):
    """From the left the blue body hides the orange flexure."""
    page = show()
    front(page)
    press(page, "3")
    before = picture(page)
    assert like(before, FLEXURE).sum() < 50 and ((before[..., 0] - before[..., 2]) > 30).sum() < 100
    press(page, "t")
    seen = picture(page)
    assert page.get_by_role("checkbox", name="see through bodies").is_checked()
    assert ((seen[..., 0] - seen[..., 2]) > 30).sum() > 1000, "nothing orange shines through"


def test_bodies_that_the_scene_has_translucent_can_be_made_solid(show):
    scene = two_boxes()
    scene["kinds"][0]["opacity"] = 0.3
    page = show(scene)
    front(page)
    assert page.get_by_role("checkbox", name="see through bodies").is_checked()
    pale = picture(page)
    page.get_by_role("checkbox", name="see through bodies").uncheck()
    settle(page)
    assert like(pale, BODY).sum() < 500 and like(picture(page), BODY).sum() > 5000


def test_poses_of_a_stroke_tell_their_own_facts(show):
    scene = two_boxes()
    for motion in scene["motions"]:
        motion["facts"] = [["force", f"{len(motion['title'])} N at {motion['id']}"]]
    page = show(scene)
    page.get_by_role("radio", name="stroke of arm").check()
    settle(page)
    assert "at pose-0" in page.locator(".fx-about").inner_text()
    page.get_by_role("button", name="step on").click()
    page.get_by_role("button", name="step on").click()
    settle(page)
    assert "at pose-2" in page.locator(".fx-about").inner_text()
