"""Pictures of static states, of buckling and of freedoms: stress and forces as colour, loads as arrows, names."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import rgb_to_hsv
from matplotlib.text import Text
from PIL import Image
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.errors import OptionError
from flexura.full_order import assemble
from flexura.view import (
    Kind,
    draw_buckling,
    draw_free,
    draw_freedoms,
    draw_kinetostatics,
    draw_mechanism,
    draw_mode,
    draw_statics,
    save_free,
    save_kinetostatics,
    save_preload,
    save_statics,
)
from flexura.view.drawing.figures import COLOURS, force_colours
from flexura.view.drawing.labels import FORCE
from helpers.counted_stages import on_a_complex
from helpers.pictures import assert_no_overlap, guide
from helpers.shell import GUIDE

LOAD = {"stage": [2.0, 0, 0, 0, 0, 0]}


def pixels(figure):
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3] / 255.0


def near(image, colour, within=0.08):
    """Where the pixels of a picture, colour bar and words left out, have about a colour."""
    area = image[120:, :1040]
    return np.abs(area - np.asarray(colour)).max(axis=-1) < within


def said(figure):
    return " ".join(text.get_text() for text in figure.texts).replace("\n", " ")


def arrows(figure):
    """Annotations with an arrow, from tail to tip, pixels."""
    found = [a for axes in figure.axes for a in axes.texts if getattr(a, "arrowprops", None)]
    return [(np.array(a.xyann), np.array(a.xy)) for a in found]


@pytest.fixture(scope="module")
def pushed():
    return fx.statics(guide(), loads=LOAD)


def test_stress_is_the_colour_and_the_bar_is_in_megapascals(pushed):
    figure = draw_statics(pushed)
    image = pixels(figure)
    hue, saturation, _ = np.moveaxis(rgb_to_hsv(image[120:, :1040]), -1, 0)
    assert ((hue < 0.12) & (saturation > 0.6)).mean() > 0.001
    bar = next(axes for axes in figure.axes if "MPa" in axes.get_title())
    top = pushed.stresses().members[0].von_mises / 1e6
    shown = [float(text.get_text()) for text in bar.get_yticklabels()]
    assert 0.6 * top < max(shown) <= top
    assert_no_overlap(figure)


def test_displacements_are_drawn_by_the_factor_that_is_said(pushed):
    figure = draw_statics(pushed, scale=10.0, elev=0.0, azim=-90.0)
    assert "drawn 10 times as large as they are" in said(figure)
    moved = pushed.displacement("stage")[0]
    assert moved > 0
    at = {}
    for scale in (0.0, 100.0, 200.0):
        figure = draw_statics(pushed, scale=scale, elev=0.0, azim=-90.0)
        at[scale] = arrows(figure)[0][1][0]
    view_scale = (at[200.0] - at[100.0]) / (100 * moved)
    assert view_scale > 0
    assert "displacements to scale" in said(draw_statics(pushed, scale=1.0))
    with pytest.raises(OptionError, match="finite"):
        draw_statics(pushed, scale=np.nan)


def test_a_load_is_an_arrow_along_it_with_its_size(pushed):
    figure = draw_statics(pushed, elev=0.0, azim=-90.0)
    (tail, tip), *rest = arrows(figure)
    assert not rest
    assert tip[0] - tail[0] > 50 and abs(tip[1] - tail[1]) < 2
    texts = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert "2 N" in texts
    assert near(pixels(figure), [int(FORCE[k : k + 2], 16) / 255 for k in (1, 3, 5)]).sum() > 100
    turned = draw_statics(fx.statics(guide(), loads={"stage": [0, 0, 0, 0, 0, 0.01]}), elev=0.0, azim=-90.0)
    assert len(arrows(turned)) == 2
    away = draw_statics(pushed, elev=0.0, azim=0.0)
    assert not arrows(away)
    assert "2 N" in {text.get_text() for axes in away.axes for text in axes.texts}


def test_a_state_without_loads_is_drawn_too():
    still = fx.statics(guide())
    figure = draw_statics(still)
    assert "the largest is 0 m" in said(figure)
    assert not arrows(figure)
    assert np.ptp(pixels(figure)) > 0.5


def test_axial_force_is_the_colour_of_a_buckling_shape():
    state = fx.preload(guide(), loads={"stage": [0, 0, -20.0, 0, 0, 0]})
    figure = draw_buckling(state)
    assert f"buckles at {state.buckling_factor:.4g} times these loads" in said(figure)
    assert near(pixels(figure), 0.9 * force_colours(-1.0), 0.12).mean() > 0.002
    assert near(pixels(figure), force_colours(1.0), 0.06).mean() < 0.0005
    pulled = fx.preload(guide(), loads={"stage": [0, 0, 20.0, 0, 0, 0]})
    red = pixels(draw_buckling(pulled))
    hue, saturation, value = np.moveaxis(rgb_to_hsv(red[120:, :1040]), -1, 0)
    strong = (saturation > 0.7) & (value > 0.2)
    assert ((hue[strong] < 0.05) | (hue[strong] > 0.95)).mean() > 0.8
    assert_no_overlap(figure)


def test_the_buckling_shape_is_one_at_the_first_factor():
    state = fx.preload(guide(), loads={"stage": [0, 0, -20.0, 0, 0, 0]})
    shape = state.buckling_shape
    assert np.abs(shape).max() == pytest.approx(1)
    force = state.model.K @ shape
    left = force + state.buckling_factor * (state.K_g @ shape)
    assert np.linalg.norm(left) < 1e-6 * np.linalg.norm(force)
    assert fx.preload(guide()).buckling_shape is None


def test_without_loads_there_is_no_scale_of_forces():
    figure = draw_buckling(fx.preload(guide()))
    assert "no loads" in said(figure)
    assert not any("axial force" in text.get_text() for text in figure.findobj(Text))
    assert near(pixels(figure), COLOURS[Kind.FLEXURE], 0.12).mean() > 0.002


def test_freedoms_are_axes_and_matrices_have_their_numbers():
    model = assemble(guide())
    result = fx.kinetostatics(model)
    assert result.freedoms
    figure = draw_freedoms(model, result)
    assert result.kind in said(figure)
    assert len(arrows(figure)) >= len(result.freedoms)
    own = draw_kinetostatics(result)
    texts = {text.get_text() for text in own.axes[0].texts}
    assert f"{result.compliance[0, 0]:.3g}" in texts and len(own.axes) == 1
    piezo = fx.load(GUIDE.parents[1] / "tip_tilt" / "tip_tilt.yaml")
    driven = draw_kinetostatics(fx.kinetostatics(piezo))
    assert len(driven.axes) == 4
    assert {text.get_text() for text in driven.axes[0].get_yticklabels()} == {"tx", "ty", "tz", "rx", "ry", "rz"}


def test_screws_of_a_body_are_drawn_free_red_and_borne_blue(tmp_path):
    found = fx.free(on_a_complex(5e-3))
    [body] = found.bodies
    figure = draw_free(found)
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert "screw, 5 mm" in texts and texts.count("force") == 2 and texts.count("couple") == 2
    lines = [line for axes in figure.axes for line in axes.lines]
    assert {"#c8102e", "#1f5fa8"} <= {line.get_color() for line in lines}
    assert sum(len(np.asarray(line.get_xdata())) > 100 for line in lines) == 2  # helices of the screw and the wrench
    assert [path.name for path in save_free(found, tmp_path)] == [f"free_{body.body}.png"]
    with pytest.raises(OptionError, match="no spaces of nobody; there are those of stage"):
        draw_free(found, body="nobody")


def test_files_are_written_whole(pushed, tmp_path):
    model = assemble(guide())
    found = save_statics(pushed, tmp_path, scale=3.0)
    found += save_preload(fx.preload(guide(), loads=LOAD), tmp_path)
    found += save_kinetostatics(fx.kinetostatics(model), tmp_path, model=model)
    names = ["statics.png", "buckling.png", "freedoms.png", "kinetostatics.png"]
    assert [path.name for path in found] == names
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(OptionError, match="is a file"):
        save_statics(pushed, blocked)


def test_names_stand_beside_the_mechanism_and_none_over_another():
    model = assemble(guide())
    figure = draw_mechanism(model, names=True)
    texts = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert texts >= {"leaf", "low", "high", "bar", "stage", "a (clamped)", "c (clamped)"}
    assert_no_overlap(figure)
    few = draw_mechanism(model, names=["l*", "stage"])
    texts = {text.get_text() for axes in few.axes for text in axes.texts}
    assert texts >= {"leaf", "low", "stage"} and "bar" not in texts
    u = np.zeros((model.plan.topology.n_nodes, 6))
    u[:, 0] = 1.0
    assert "bar" in {t.get_text() for a in draw_mode(model, u, title="m", names=["bar"]).axes for t in a.texts}
    for wrong, told in ((["nothing"], "no part 'nothing'"), ("leaf", "True or a list"), ([3], "True or a list")):
        with pytest.raises(OptionError, match=told):
            draw_mechanism(model, names=wrong)


def test_of_many_names_so_many_are_shown_as_there_is_room_for():
    mechanism = fx.load(GUIDE.parents[1] / "rpr" / "rpr_piezo.yaml")
    figure = draw_mechanism(assemble(mechanism), names=True)
    assert "names are shown" in said(figure)
    boxes = [t.get_window_extent() for axes in figure.axes for t in axes.texts if "." in t.get_text()]
    assert len(boxes) > 40
    for a, b in itertools.combinations(boxes, 2):
        assert min(min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)) < 2


@pytest.mark.parametrize("dpi", [75, 300])
def test_pictures_are_as_fine_as_asked_for_and_show_the_same(dpi):
    model = assemble(guide())
    fine, plain = (pixels(draw_mechanism(model, dpi=own)) for own in (dpi, 150))
    assert fine.shape[:2] == (6 * dpi, 8 * dpi)
    assert fine.mean() == pytest.approx(plain.mean(), abs=0.004)
    share = [(rgb_to_hsv(image)[..., 1] > 0.3).mean() for image in (fine, plain)]
    assert share[0] == pytest.approx(share[1], rel=0.03)


def told(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_the_shell_draws_what_it_prints(tmp_path):
    load = ("--load", "carriage=2,0,0 N", "--plot", tmp_path)
    done = told("statics", GUIDE, *load, "--scale", "20")
    assert done.exit_code == 0 and f"wrote {tmp_path}/statics.png" in done.stdout, done.stderr
    done = told("buckling", GUIDE, *load)
    assert done.exit_code == 0 and f"wrote {tmp_path}/buckling.png" in done.stdout, done.stderr
    done = told("kinetostatics", GUIDE, "--plot", tmp_path)
    assert done.exit_code == 0 and f"wrote {tmp_path}/freedoms.png" in done.stdout, done.stderr
    assert "belongs to --plot" in str(told("statics", GUIDE, "--scale", "2").exception)


def test_the_shell_draws_as_fine_as_is_asked(tmp_path):
    commands = {
        "statics.png": ("statics", GUIDE, "--load", "carriage=2,0,0 N"),
        "buckling.png": ("buckling", GUIDE, "--load", "carriage=0,0,-2 N"),
        "kinetostatics.png": ("kinetostatics", GUIDE),
        "stroke.png": ("stroke", GUIDE, "--move", "carriage.x=0:2mm", "--steps", "2", "-n", "1"),
        "mode_01.png": ("modes", GUIDE, "-n", "1", "--names"),
    }
    for name, command in commands.items():
        sizes = []
        for dpi in (60, 120):
            done = told(*command, "--plot", tmp_path / str(dpi), "--dpi", dpi)
            assert done.exit_code == 0, done.stderr
            with Image.open(tmp_path / str(dpi) / name) as picture:
                sizes.append(np.array(picture.size))
        assert np.array_equal(2 * sizes[0], sizes[1]), name
    refused = told("kinetostatics", GUIDE, "--dpi", "300")
    assert refused.exit_code != 0 and "--dpi belongs to --plot DIR" in str(refused.exception)


def test_long_names_of_what_is_held_stay_in_the_picture():
    plain = guide()
    names = {"a": "mounting_plate_of_the_left_leaf_spring", "c": "mounting_plate_right_"}
    turned = {key: tuple(names.get(n, n) for n in flexure.nodes) for key, flexure in plain.flexures.items()}
    mechanism = plain.model_copy(
        update={
            "nodes": {names.get(name, name): at for name, at in plain.nodes.items()},
            "flexures": {k: f.model_copy(update={"nodes": turned[k]}) for k, f in plain.flexures.items()},
            "ground": dict.fromkeys(names.values(), plain.ground["a"]),
        }
    )
    figure = draw_mechanism(assemble(mechanism), names=True)
    assert "mounting_plate_right_ (clamped)" in {text.get_text() for text in figure.findobj(Text)}
    assert_no_overlap(figure)
