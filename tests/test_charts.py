"""Charts are data that pictures and pages draw alike: values in the unit that suits them, over what only grows."""

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.analysis import response_chart, response_group, response_units, stroke_chart
from flexura.charts import Axis, Chart, Curve, Mark, Panel, is_wide
from flexura.pages.report.chart import chart_data, chart_svg
from flexura.view import draw_bode, draw_stroke
from flexura.view.drawing import draw_panel, new_chart

PIVOT = Path(__file__).parents[1] / "examples" / "pivot" / "pivot.yaml"
X = np.linspace(0.0, 1.0, 5)


def test_a_panel_is_shown_in_the_unit_that_suits_its_curves() -> None:
    band = Curve(X, 1e-6 * X, "band", upper=2e-6 * X)
    shown = Panel([band], y=Axis("shift", "m")).suited()
    assert shown.y.label == "shift, µm"
    assert shown.curves[0].y == pytest.approx(X) and shown.curves[0].upper == pytest.approx(2 * X)


def test_an_axis_is_logarithmic_where_positive_values_are_far_apart() -> None:
    wide, across = Curve(X, 10.0 ** (2 * X)), Curve(X, X - 0.5)
    assert is_wide([wide]) and not is_wide([across]) and not is_wide([wide, across]) and not is_wide([])


def test_pictures_and_pages_draw_lines_bands_and_marks() -> None:
    curves = [Curve(X, X + 1, "a"), Curve(X, X + 2, "b", "dashed"), Curve(X, X, "c", upper=X + 1)]
    panel = Panel(curves, Axis("time", "s"), Axis("force", "N"), marks=[Mark(0.5, "half", "h")])
    axes = new_chart((4, 3)).subplots()
    draw_panel(axes, panel)
    assert [line.get_linestyle() for line in axes.lines[:2]] == ["-", "--"] and len(axes.collections) == 1
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time, s", "force, N")
    chart = Chart("id", "title", "said", [panel])
    data = chart_data(chart)
    assert [own["style"] for own in data["panels"][0]["curves"]] == ["line", "pinned", "bound"]
    assert data["panels"][0]["marks"] == [{"x": 0.5, "label": "half", "short": "h"}]
    assert {"half", "force, N", "time, s"} <= set(chart_svg(chart).replace("<", ">").split(">"))


def test_a_stroke_has_one_chart_for_pictures_and_pages() -> None:
    stroke = fx.stroke(fx.load(PIVOT), move={"arm.ry": (0.2, -0.2)}, steps=3, n=2)
    chart = stroke_chart(stroke)
    assert chart.x == pytest.approx(np.degrees([pose.move["arm.ry"] for pose in stroke.poses]))
    drawn = [axes.get_ylabel() for axes in draw_stroke(stroke).axes if axes.get_visible()]
    assert drawn == [panel.y.label for panel in chart.suited().panels]


def test_a_stroke_of_which_nothing_varies_is_drawn_pose_by_pose() -> None:
    stroke = fx.stroke(fx.load(PIVOT), move={"arm.ry": (0.1, 0.1)}, steps=3, n=2)
    assert draw_stroke(stroke).axes[0].get_xlabel() == "pose"


def test_a_response_has_one_chart_for_pictures_and_pages() -> None:
    result = fx.frequency_response(fx.load(PIVOT), band=(1, 500), points=40, damping=0.01)
    group = response_group(result, response_units(result)[0])
    magnitude, phase = response_chart(result, group).panels
    upper, lower = draw_bode(result).axes
    assert upper.get_ylabel() == magnitude.y.label and lower.get_ylabel() == phase.y.label == "phase, deg"
    assert upper.lines[0].get_ydata() == pytest.approx(magnitude.curves[0].y)
    assert [mark.x for mark in magnitude.marks] == result.resonances_hz.tolist()
