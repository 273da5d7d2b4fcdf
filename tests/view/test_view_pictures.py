"""Pictures: of the right size, showing what they should, with nothing on top of anything else."""

import io
import itertools
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv
from PIL import Image

from flexura.errors import OptionError
from flexura.full_order import assemble
from flexura.mechanism import Box, Link, Mechanism, Rectangle, RigidBody
from flexura.view import Kind, draw_mechanism, draw_mode, draw_sheet, solids
from flexura.view.drawing.figures import COLOURS, NAMES, new_figure
from flexura.view.drawing.labels import frame
from flexura.view.drawing.painting import Camera, good_camera, visible_flexures
from helpers.pictures import AL, assert_no_overlap, guide


@pytest.fixture(scope="module")
def model():
    return assemble(guide())


@pytest.fixture(scope="module")
def sideways(model):
    """The stage moves along x and the rest follows."""
    u = np.zeros((model.plan.topology.n_nodes, 6))
    u[:, 0] = np.clip(model.geometry.positions[:, 2] / 0.05, 0, 1)
    return u


def pixels(figure):
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3] / 255.0


def share_like(image, rgb):
    """Share of the pixels with the hue of a colour, and saturated."""
    hsv, own = rgb_to_hsv(image), rgb_to_hsv(np.array(rgb))
    return np.mean((np.abs(hsv[..., 0] - own[0]) < 0.03) & (hsv[..., 1] > 0.3))


def test_the_mechanism_shows_its_kinds_by_colour(model):
    figure = draw_mechanism(model)
    image = pixels(figure)
    assert image.shape == (900, 1200, 3)
    for kind in (Kind.FLEXURE, Kind.LINK):
        assert share_like(image, COLOURS[kind]) > 0.005
    np.testing.assert_allclose(image[[0, 0, -1, -1], [0, -1, 0, -1]], 1)
    labels = {t.get_text() for t in figure.legends[0].get_texts()}
    assert labels >= {NAMES[k] for k in (Kind.FLEXURE, Kind.LINK, Kind.BODY, Kind.CLAMP)}
    assert NAMES[Kind.SPRING] not in labels
    assert "Guide" in {t.get_text() for t in figure.texts}
    assert {t.get_text() for t in figure.axes[0].texts} >= {"x / mm", "y / mm", "z / mm", "0"}
    assert_no_overlap(figure)


def test_colours_of_kinds_are_told_apart():
    kinds = [k for k in Kind if k is not Kind.ARM and k is not Kind.CENTRE]
    for one, other in itertools.combinations(kinds, 2):
        assert np.linalg.norm(np.subtract(COLOURS[one], COLOURS[other])) > 0.14, (one, other)
    assert set(COLOURS) == set(NAMES) == set(Kind)


def test_a_mode_is_drawn_away_from_its_ghost(model, sideways):
    figure = draw_mode(model, sideways, title="mode 1: 32.8 Hz", subtitle="stage tx 97 %")
    image = pixels(figure)
    assert image.shape == (900, 1200, 3)
    texts = {t.get_text() for t in figure.texts}
    assert texts >= {"mode 1: 32.8 Hz", "stage tx 97 %"}
    picture = image[150:, :1000]
    coloured = rgb_to_hsv(picture)[..., 1] > 0.3
    ghost = (np.ptp(picture, axis=-1) < 0.05) & (picture.mean(axis=-1) > 0.75) & (picture.mean(axis=-1) < 0.95)
    assert coloured.mean() > 0.05
    assert ghost.mean() > 0.005
    columns = np.flatnonzero(coloured.any(axis=0)), np.flatnonzero(ghost.any(axis=0))
    assert columns[0].max() != columns[1].max()
    assert_no_overlap(figure)


def test_the_drawn_motion_goes_with_the_scale(model, sideways):
    small, large = (pixels(draw_mode(model, sideways, title="m", scale=s, elev=10, azim=-80)) for s in (0.0, 0.02))
    assert np.abs(small - large).mean() > 0.005
    flipped = pixels(draw_mode(model, -sideways, title="m", scale=-0.02, elev=10, azim=-80))
    np.testing.assert_allclose(flipped, large)


def test_a_still_mode_and_long_words_do_no_harm(model):
    u = np.zeros((model.plan.topology.n_nodes, 6))
    figure = draw_mode(model, u, title="mode 12: 1234.5 Hz, " + "long " * 12, subtitle="word " * 60)
    assert np.isfinite(pixels(figure)).all()
    assert_no_overlap(figure)


@pytest.mark.parametrize("word", ["W" * 300, "MOUNTING_PLATE_WITH_NAME_OF_FORTY_LETTERS; " * 9, "iii " * 400])
def test_lines_end_where_the_picture_ends(model, sideways, word):
    one = draw_mode(model, sideways, title=word, subtitle=word, warnings=[word])
    sheet = draw_sheet(model, np.stack([sideways] * 4, axis=-1), [word] * 4, [word] * 4, flags=[word] * 4)
    for figure in (one, sheet):
        assert_no_overlap(figure)
        assert any(text.get_text().endswith(" ...") for text in figure.texts)


@pytest.mark.slow
def test_the_sheet_shows_every_mode(model, sideways):
    shapes = np.stack([sideways * k for k in (1, -1, 2, 3)], axis=-1)
    titles, subtitles = [f"mode {k}" for k in range(4)], ["stage tx 84 %, ry 16 %, and more words " * 2] * 4
    figure = draw_sheet(model, shapes, titles, subtitles, elev=20, azim=-60)
    image = pixels(figure)
    assert image.shape == (1200, 1800, 3)
    assert {t.get_text() for t in figure.texts} >= set(titles)
    for row, column in ((0, 0), (0, 1), (0, 2), (1, 0)):
        cell = image[600 * row + 130 : 600 * row + 590, 560 * column + 30 : 560 * column + 550]
        assert np.mean(rgb_to_hsv(cell)[..., 1] > 0.3) > 0.03
    assert np.mean(rgb_to_hsv(image[700:, 700:1650])[..., 1] > 0.3) == 0
    assert_no_overlap(figure)


@pytest.mark.parametrize(("elev", "azim"), [(27.0, -51.0), (90.0, -90.0), (0.0, 0.0), (-30.0, 140.0)])
def test_ticks_stand_where_their_numbers_say(elev, azim):
    figure, camera = new_figure((8.0, 6.0)), Camera(elev, azim)
    low, high = np.array([-0.03, 0.01, 0.0]), np.array([0.05, 0.04, 0.1])
    view = frame(figure, camera, (low, high), (0.1, 0.15, 0.8, 0.7))
    drawn = [line.get_xydata() for line in figure.axes[0].lines if line.get_zorder() == 3]
    ticks = [line for line in drawn if np.linalg.norm(line[1] - line[0]) < 7]
    seen = [k for k in range(3) if np.linalg.norm(camera.axes[:2, k]) > 0.1]
    assert len(ticks) >= 2 * len(seen)
    assert sum(t.get_text().endswith("/ mm") for t in figure.axes[0].texts) == len(seen)
    corners = view.pixels(np.array(list(itertools.product(*zip(low, high, strict=True)))))[:, :2]
    assert (corners > [120, 135]).all() and (corners < [1080, 765]).all()
    for text in figure.axes[0].texts:
        if "/" not in text.get_text():
            near = min(np.linalg.norm(tick[0] - text.get_position()) for tick in ticks)
            assert near < 40
    assert_no_overlap(figure)


def test_ticks_follow_the_scale_of_the_view():
    figure = new_figure((8.0, 6.0))
    view = frame(figure, Camera(0.0, -90.0), (np.zeros(3), np.full(3, 0.1)), (0.1, 0.15, 0.8, 0.7))
    texts = [(t.get_text(), *t.get_position()) for t in figure.axes[0].texts if "/" not in t.get_text()]
    lowest = min(y for _, _, y in texts)
    places = {float(text): x for text, x, y in texts if y < lowest + 1}
    assert len(places) >= 4
    for millimetres, x in places.items():
        assert x == pytest.approx(view.pixels(np.array([millimetres / 1000, 0.0, 0.0]))[0])


@pytest.mark.parametrize(("elev", "azim"), [(90, -90), (0, 0), (25, 100), (10, -5), (60, 215)])
def test_no_view_pushes_text_out_of_the_picture(model, elev, azim):
    figure = draw_mechanism(model, elev=elev, azim=azim)
    assert_no_overlap(figure)


def test_a_view_from_above_gives_way_when_it_hides_the_flexures():
    roofed = guide().model_copy(
        update={
            "bodies": {
                "stage": RigidBody(
                    centre=(0.025, 0, 0.055), carries=("b", "f"), solid=Box(size=(0.14, 0.14, 0.004), material=AL)
                )
            }
        }
    )
    parts = solids(assemble(roofed))
    chosen = good_camera(parts)
    assert visible_flexures(parts, chosen) > visible_flexures(parts, Camera(26.0, -56.0)) + 0.05
    open_sky = Mechanism(nodes={"a": (0, 0, 0), "b": (0.02, 0, 0.05)}, flexures={"f": guide().flexures["leaf"]})
    assert good_camera(solids(assemble(open_sky))).elev == 26.0


def test_signs_of_mathematics_in_titles_are_only_signs(model, sideways):
    figure = draw_mode(model, sideways, title="cost $5 and $", subtitle="a_b $\\frac$ %", elev=20, azim=-60)
    assert "cost $5 and $" in {t.get_text() for t in figure.texts}
    assert np.isfinite(pixels(figure)).all()


@pytest.mark.parametrize("size", [1e-4, 1e2])
def test_small_and_large_mechanisms_are_drawn_alike(size):
    section = Rectangle(width=0.1 * size, thickness=0.05 * size)
    bar = Link(nodes=("a", "b"), material=AL, reference="z", section=section)
    mechanism = Mechanism(nodes={"a": (0, 0, 0), "b": (size, 0, 0)}, links={"bar": bar}, ground={"a": "clamped"})
    figure = draw_mechanism(assemble(mechanism))
    assert share_like(pixels(figure), COLOURS[Kind.LINK]) == pytest.approx(0.059, abs=0.02)
    assert_no_overlap(figure)


def test_a_scale_that_is_no_number_is_refused(model, sideways):
    with pytest.raises(OptionError, match="scale"):
        draw_mode(model, sideways, title="m", scale=np.inf)


def saved(figure, **how):
    """What `savefig` writes."""
    content = io.BytesIO()
    figure.savefig(content, **how)
    return content.getvalue()


def test_figures_are_saved_for_print_as_they_are_on_screens(model, sideways):
    figure = draw_mode(model, sideways, title="mode 1")
    assert saved(figure, format="pdf").startswith(b"%PDF")
    svg = saved(figure, format="svg").decode()
    assert "<svg" in svg and svg.count("data:image/png;base64,") >= 2  # the mechanism and the scale of colours
    small = np.asarray(Image.open(io.BytesIO(saved(figure, format="png"))).convert("RGB"), dtype=float)
    large = Image.open(io.BytesIO(saved(figure, format="png", dpi=300))).convert("RGB")
    fine = Image.open(io.BytesIO(saved(draw_mode(model, sideways, title="mode 1", dpi=300), format="png")))
    assert large.size == fine.size == (2400, 1800)
    for picture in (large, fine.convert("RGB")):
        assert np.abs(np.asarray(picture.resize((1200, 900), Image.Resampling.BOX), dtype=float) - small).mean() < 2


def test_a_png_is_as_small_as_is_asked(model):
    figure = draw_mechanism(model)
    assert len(saved(figure, format="png", pil_kwargs={"compress_level": 9})) < len(saved(figure, format="png"))


def test_pyplot_stays_out():
    code = (
        "import sys, flexura.view; assert 'matplotlib' not in sys.modules;"
        "from flexura.mechanism import *; from flexura.full_order import assemble;"
        "m = Mechanism(nodes={'a': (0, 0, 0), 'b': (0.1, 0, 0)}, ground={'a': 'clamped'}, links={'l': Link("
        "nodes=('a', 'b'), material='Al-7075-T6', section=Circle(diameter=0.01))});"
        "f = flexura.view.draw_mechanism(assemble(m)); f.canvas.draw();"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
