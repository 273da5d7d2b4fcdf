"""One browser for all tests of pages of a process; without chromium they say that they were skipped.

A browser without a graphics card takes seconds of processor time for a page: most of these tests are slow ones.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from playwright.sync_api import Page

from helpers.browser import CHROMIUM, DESKTOP, Opened, started
from helpers.viewer_page import viewer

IN_EVERY_RUN = {
    # the live page
    *("test_frequencies_follow_the_keys", "test_an_error_stands_at_its_slider_and_the_last_picture_stays"),
    "test_requirements_stand_beside_the_sliders_and_follow",
    "test_poles_are_picked_by_a_click_and_let_go_by_another",
    *("test_a_connection_that_is_cut_is_said_and_restored_with_its_state", "test_of_500_rapid_moves_the_last_one_wins"),
    # the viewer
    *(
        "test_parts_stand_where_they_are_in_their_colours",
        "test_a_mode_moves_what_it_moves",
        "test_far_from_the_origin",
    ),
    *("test_what_is_under_the_pointer_is_named_with_its_facts", "test_the_keyboard_is_enough"),
    *("test_a_stroke_is_interpolated_between_its_poses", "test_names_are_text", "test_new_shapes_move"),
    *("test_a_model_has_its_parts_in_metres_and_moves_as_shown", "test_a_scene_that_cannot_be_read_says_so"),
    # reports, notebooks, and pages of other commands
    *("test_it_is_alive_without_a_network", "test_charts_read_out_what_frequency_response_finds"),
    *("test_it_is_accessible_in_both_colours", "test_a_phone_needs_no_sideways_scroll", "test_no_other_script_runs"),
    *("test_frequencies_are_those_of_modes_and_proven", "test_keys_move_a_slider_and_the_frequencies_follow"),
    *("test_requests_and_errors_are_seen", "test_a_browser_reads_what_was_written"),
    *("test_a_saved_page_opens_without_a_network", "test_a_click_on_a_face_copies_what_chooses_it"),
}
"""Tests in a browser that are no slow ones."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the others."""
    for item in items:
        if (
            isinstance(item, pytest.Function)
            and "browser" in item.fixturenames
            and item.originalname not in IN_EVERY_RUN
        ):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def browser():
    if CHROMIUM is None:
        pytest.skip("no chromium: `make packages` installs it")
    with started() as own:
        yield own


@pytest.fixture
def opened(browser) -> Iterator[Opened]:
    """A page of a window of its own, at the size of a desktop."""
    with browser.new_context(viewport=DESKTOP) as context:
        yield Opened(context)


@pytest.fixture
def show(browser, tmp_path) -> Iterator[Callable[..., Page]]:
    """Opens the page of a scene, the two boxes unless given."""
    with ExitStack() as stack:
        yield lambda scene=None, **context: stack.enter_context(
            viewer(browser, tmp_path / "page.html", scene, **context)
        )
