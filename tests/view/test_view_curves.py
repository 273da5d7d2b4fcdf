"""Curves: what is shown and what is left out, axes in plain numbers, legends beside the curves."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.transforms import Bbox

import flexura as fx
from flexura.charts import Axis, Curve, Panel
from flexura.errors import OptionError
from flexura.view import draw_bode, draw_nyquist, draw_response_matrix, draw_time, save_frequency_response
from flexura.view.drawing.charts import draw_panel, new_chart, plain, shortened
from helpers.pictures import guide

EXAMPLES = Path(__file__).parents[2] / "examples"
BANDS = {
    "amplifier/amplifier": (100, 5000),
    "guide/guide": (1, 3000),
    "pivot/pivot": (1, 500),
    "rpr/rpr": (3, 60),
    "rpr/rpr_piezo": (3, 200),
    "tip_tilt/tip_tilt": (10, 5000),
    "xy_stage/xy_stage": (10, 3000),
}


@pytest.fixture(scope="module")
def responses():
    return {}


@pytest.fixture(params=BANDS)
def response(request, responses):
    """The response of an example between all of its channels, or all that can be driven."""
    if request.param not in responses:
        mechanism = fx.load(EXAMPLES / f"{request.param}.yaml")
        responses[request.param] = fx.frequency_response(mechanism, band=BANDS[request.param], points=60, damping=0.01)
    return responses[request.param]


@pytest.fixture(scope="module")
def pushed():
    ends = ["stage.tx", "stage.ry"]
    return fx.frequency_response(guide(), band=(10, 2000), damping=0.01, inputs=ends, outputs=ends)


def assert_legends_are_beside_curves(figure):
    """No legend covers a vertex of a curve, a line between two, or a number of an axis."""
    figure.canvas.draw()
    legends = [own for own in [*figure.legends, *(a.get_legend() for a in figure.axes)] if own is not None]
    assert legends
    for legend in legends:
        box = legend.get_window_extent()
        assert box.x0 >= 0 and box.x1 <= figure.bbox.width and box.y1 <= figure.bbox.height
        for axes in figure.axes:
            inside = Bbox.intersection(axes.bbox, box)
            assert inside is None or inside.height < 1
            for line in axes.lines:
                at = line.get_transform().transform(np.asarray(line.get_xydata(), dtype=float))
                assert not _meets(at, box)
            for text in (*axes.get_xticklabels(), *axes.get_yticklabels(), axes.title, *axes.texts):
                if text.get_text() and text.get_visible():
                    own = text.get_window_extent()
                    assert Bbox.intersection(own, box) is None or not text.get_text().strip()


def _meets(at, box):
    """Whether a line through points (n, 2) crosses a box: its points and what lies between them, closely."""
    between = np.concatenate([at[:-1] + t * np.diff(at, axis=0) for t in np.linspace(0, 1, 9)])
    finite = between[np.isfinite(between).all(axis=1)]
    return bool(((finite > [box.x0, box.y0]) & (finite < [box.x1, box.y1])).all(axis=1).any())


def test_no_legend_lies_over_a_curve_in_any_example(response):
    units = {response.unit(o.name, i.name) for o in response.outputs for i in response.inputs}
    for unit in sorted(units):
        assert_legends_are_beside_curves(draw_bode(response, unit=unit))
        assert_legends_are_beside_curves(draw_nyquist(response, unit=unit))


def test_frequencies_stand_in_plain_numbers(response):
    for figure in (draw_bode(response), draw_response_matrix(response) if len(response.outputs) < 13 else None):
        if figure is None:
            continue
        figure.canvas.draw()
        axes = figure.axes[-1]
        low, high = axes.get_xlim()
        ticks = zip(axes.get_xticklabels(), axes.get_xticks(), strict=True)
        shown = [text.get_text() for text, at in ticks if low <= at <= high]
        assert len(shown) >= 3
        assert all(re.fullmatch(r"[125]0*( k)?", text) for text in shown), shown


def test_a_narrow_band_has_numbers_too(pushed):
    narrow = fx.frequency_response(guide(), band=(30, 37), damping=0.01, inputs=["stage.tx"], outputs=["stage.tx"])
    figure = draw_bode(narrow)
    figure.canvas.draw()
    texts = [t.get_text() for t in figure.axes[1].get_xticklabels() if t.get_text()]
    assert len(texts) >= 4 and all(30 <= float(text) <= 37 for text in texts)


def test_a_figure_shows_one_unit_and_says_what_it_leaves_out():
    every = [f"stage.{dof}" for dof in ("tx", "ty", "tz", "rx", "ry", "rz")]
    result = fx.frequency_response(guide(), band=(10, 2000), damping=0.01, inputs=every, outputs=every)
    figure = draw_bode(result, unit="m/N")
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert "stage.tx / stage.tx" in labels
    assert not any("r" in label.replace("stage", "") for label in labels)
    assert figure.axes[0].get_ylabel() == "magnitude, m/N"
    said = " ".join(text.get_text() for text in figure.texts).replace("\n", " ")
    assert "of 9 responses in m/N are left out" in said and "stage.ty / stage.tx" in said
    peak = {text.split(" / ")[0] for text in labels}
    assert peak <= {"stage.tx", "stage.ty", "stage.tz"}


def test_resonances_are_numbered_with_what_moves(pushed):
    assert len(pushed.resonance_motions) == len(pushed.resonances_hz) > 0
    assert "stage moves along x" in pushed.resonance_motions[0]
    figure = draw_bode(pushed)
    said = "\n".join(text.get_text() for text in figure.texts)
    assert f"1  {pushed.resonances_hz[0]:.4g} Hz  stage moves along x" in said
    assert "1" in {text.get_text() for text in figure.axes[1].texts}


def test_a_state_space_says_no_more_than_it_knows(pushed):
    built = fx.state_space(fx.system(guide(), inputs=["stage.tx"], outputs=["stage.tx"], damping=0.01), n=3)
    result = fx.frequency_response(built, band=(10, 500))
    assert result.resonance_motions == ()
    assert f"1  {result.resonances_hz[0]:.4g} Hz" in "\n".join(t.get_text() for t in draw_bode(result).texts)


def test_equal_responses_are_one_curve(pushed):
    ends = ["stage.tx", "stage.ry"]
    figure = draw_nyquist(pushed, [("stage.tx", "stage.tx")])
    assert len([line for line in figure.axes[0].lines if len(line.get_xdata()) > 2]) == 1
    mixed = draw_bode(pushed, [(end, end) for end in ends])
    labels = [text.get_text() for text in mixed.axes[0].get_legend().get_texts()]
    assert [label.partition("[")[2] for label in labels] == ["m/N]", "rad/(N*m)]"]


def test_circles_of_nyquist_are_round(pushed):
    first = pushed.resonances_hz[0]
    band = (0.7 * first, 1.4 * first)
    single = fx.frequency_response(guide(), band=band, damping=0.01, inputs=["stage.tx"], outputs=["stage.tx"])
    figure = draw_nyquist(single)
    figure.canvas.draw()
    axes = figure.axes[0]
    assert axes.get_aspect() == 1.0
    line = next(line for line in axes.lines if len(line.get_xdata()) > 2)
    at = axes.transData.transform(line.get_xydata())
    span = np.ptp(at, axis=0)
    assert span[0] == pytest.approx(span[1], rel=0.02)
    centre = (at.max(axis=0) + at.min(axis=0)) / 2
    outer = np.linalg.norm(at - centre, axis=1) > 0.97 * span.min() / 2
    turn = np.sort(np.unwrap(np.arctan2(*(at[outer] - centre).T[::-1])))
    assert np.degrees(np.diff(turn)).max() < 7
    assert np.linalg.norm(at[outer] - centre, axis=1) == pytest.approx(span.min() / 2, rel=0.03)


def test_a_matrix_has_one_scale_in_a_row_and_nothing_where_symmetry_is(pushed):
    every = [f"stage.{dof}" for dof in ("tx", "ty", "tz", "rx", "ry", "rz")]
    result = fx.frequency_response(guide(), band=(10, 2000), points=60, damping=0.01, inputs=every, outputs=every)
    figure = draw_response_matrix(result)
    figure.canvas.draw()
    panels = np.array(figure.axes).reshape(6, 6)
    for row in panels:
        assert len({axes.get_ylim() for axes in row}) == 1
        assert 2 <= len([t for t in row[0].get_yticklabels() if t.get_text()]) <= 9
    assert "0" in {text.get_text() for text in panels[1, 0].texts}
    with pytest.raises(OptionError, match="units are"):
        draw_bode(result, unit="N/V")
    with pytest.raises(OptionError, match="nothing to draw"):
        draw_bode(result, [])


def test_legends_of_time_responses_lie_beside_the_curves():
    result = fx.time_response(
        guide(),
        inputs={"stage.tx": fx.signals.step(1.0)},
        outputs=["stage.tx", "stage.ry"],
        dt=1e-3,
        duration=0.1,
        damping=0.02,
    )
    assert_legends_are_beside_curves(draw_time(result))


def test_names_are_only_names(tmp_path):
    mechanism = guide()
    name = "a_b_" + 11 * "long_"
    bodies = {name: mechanism.bodies["stage"]}
    strange = mechanism.model_copy(update={"bodies": bodies, "name": "cost $5 and $ <script>" + "long " * 50})
    ends = {"inputs": [f"{name}.tx"], "outputs": [f"{name}.tx"]}
    result = fx.frequency_response(strange, band=(10, 200), points=20, damping=0.01, **ends)
    figure = draw_bode(result)
    assert_legends_are_beside_curves(figure)
    assert shortened(f"{name}.tx / {name}.tx") in {text.get_text() for text in figure.axes[0].get_legend().get_texts()}
    names = {path.name for path in save_frequency_response(result, tmp_path)}
    assert names == {"bode.png", "nyquist.png", "matrix.png"}


@pytest.mark.parametrize(
    ("value", "text"),
    [(0, "0"), (1, "1"), (2000, "2000"), (5e4, "50 k"), (1.75e-5, "17.5 µ"), (1e-4, "100 µ"), (0.001, "0.001")],
)
def test_numbers_of_axes_have_no_exponent(value, text):
    assert plain(value) == text


def test_names_that_are_too_long_lose_their_middle():
    assert shortened("short") == "short"
    long = shortened("beginning" * 9 + "end")
    assert long.startswith("beginning") and long.endswith("end") and len(long) <= 44


def test_a_single_value_is_a_dot_and_markers_of_a_curve_are_its_own():
    axes = new_chart((3, 2)).subplots()
    gap = np.array([np.nan, 1.0, np.nan])
    curves = [
        Curve(np.arange(3.0), gap, "line"),
        Curve(np.arange(1.0), np.ones(1), "star", style={"marker": "x", "ms": 4}),
    ]
    draw_panel(axes, Panel(curves, Axis("x", ""), Axis("y", "")))
    line, star = axes.lines
    assert (line.get_marker(), line.get_markevery()) == ("o", [1])
    assert (star.get_marker(), star.get_markersize(), star.get_markevery()) == ("x", 4, None)
