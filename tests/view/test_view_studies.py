"""Pictures of studies: curves, maps and bars have the numbers of the result, and failed designs are not drawn over."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.contour import ContourSet
from matplotlib.text import Text
from PIL import Image
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app
from flexura.errors import OptionError
from flexura.view import (
    draw_optimum,
    draw_sensitivity,
    draw_sweep,
    draw_tolerance,
    save_optimum,
    save_sensitivity,
    save_sweep,
    save_tolerance,
)
from helpers.pictures import assert_no_overlap
from helpers.shell import GUIDE


def table_of(parameters, asked, *, bounds=None, proven=None, sampling="grid", reason="it does not reach the pose"):
    """A study in memory: columns (n,) by heading of parameters and of what is asked, bounds by name."""
    n = len(next(iter(parameters.values())))
    bounded = {}
    for heading, (low, high) in (bounds or {}).items():
        name, unit = heading.split(" [")
        bounded |= {f"{name} lower [{unit}": low, f"{name} upper [{unit}": high}
    missing = np.any([np.isnan(own) for own in asked.values()], axis=0)
    columns = {
        "design": np.arange(n),
        **{name: np.asarray(own, dtype=float) for name, own in (parameters | asked | bounded).items()},
        "is proven": np.ones(n, dtype=bool) if proven is None else np.asarray(proven),
        "reason": np.where(missing, reason, ""),
    }
    variables = [
        {"name": name.split(" [")[0], "kind": "choice", "values": np.unique(own).tolist()}
        for name, own in parameters.items()
    ]
    return fx.StudyTable(
        name="made",
        designs=n,
        block=n,
        columns=tuple(columns),
        parameters=tuple(parameters),
        asked=tuple(asked),
        is_bounded=bool(bounds),
        fixed={},
        space={"sampling": sampling, "variables": variables},
        folder=None,
        numbers=(0,),
        read=lambda number, names: {name: columns[name] for name in names or columns},
    )


def by_gid(figure, gid, kind=object):
    """Everything drawn that is called so."""
    return [
        own for axes in figure.axes for own in axes.get_children() if own.get_gid() == gid and isinstance(own, kind)
    ]


def words(figure):
    return " ".join(text.get_text() for text in figure.findobj(Text)).replace("\n", " ")


THICKNESS = np.linspace(0.2e-3, 0.6e-3, 9)


@pytest.fixture(scope="module")
def curves():
    f1, stress = 4e4 * THICKNESS, 6e11 * THICKNESS
    f2 = np.where(np.arange(9) == 4, np.nan, 9 - 1e4 * THICKNESS)
    wide = np.where(np.arange(9) == 7, 0.1, 0.0)
    bounds = {"f1 [Hz]": (f1 * (1 - wide), f1 * (1 + wide)), "f2 [Hz]": (f2, f2)}
    asked = {"f1 [Hz]": f1, "f2 [Hz]": f2, "stress(leaf) [Pa]": stress}
    proven = ~np.isin(np.arange(9), (4, 7))
    return draw_sweep(table_of({"thickness [m]": THICKNESS}, asked, bounds=bounds, proven=proven))


def test_curves_are_the_columns_in_the_units_of_drawings(curves):
    hertz, pascal, *_ = curves.axes
    (f1,), (stress,) = by_gid(curves, "f1 [Hz]"), by_gid(curves, "stress(leaf) [Pa]")
    assert f1.axes is hertz and stress.axes is pascal
    np.testing.assert_allclose(f1.get_xdata(), 1e3 * THICKNESS)
    np.testing.assert_allclose(f1.get_ydata(), 4e4 * THICKNESS)
    np.testing.assert_allclose(stress.get_ydata(), 6e5 * THICKNESS)
    assert hertz.get_xlabel() == "thickness, mm"
    assert hertz.get_ylabel() == "natural frequency, Hz" and pascal.get_ylabel() == "stress, MPa"
    assert_no_overlap(curves)


def test_a_failed_design_is_a_gap_and_a_cross_and_others_are_none(curves):
    (f2,) = by_gid(curves, "f2 [Hz]")
    assert np.flatnonzero(np.isnan(f2.get_ydata())).tolist() == [4]
    (crosses,) = by_gid(curves, "failed")
    np.testing.assert_allclose(crosses.get_xdata(), [1e3 * THICKNESS[4]])
    assert crosses.axes is curves.axes[0] and crosses.get_marker() == "x"
    assert "1 of 9 designs could not be worked out" in words(curves)


def test_bands_are_the_proven_bounds_and_rings_where_they_are_wide(curves):
    (band,) = by_gid(curves, "bounds of f1 [Hz]")
    x, y = band.get_paths()[0].vertices.T
    at = np.isclose(x, 1e3 * THICKNESS[7])
    assert y[at].min() == pytest.approx(0.9 * 4e4 * THICKNESS[7])
    assert y[at].max() == pytest.approx(1.1 * 4e4 * THICKNESS[7])
    (rings,), (none,) = by_gid(curves, "not proven f1 [Hz]"), by_gid(curves, "not proven f2 [Hz]")
    np.testing.assert_allclose(rings.get_xdata(), [1e3 * THICKNESS[7]])
    assert not len(none.get_xdata())


def test_frequencies_that_are_followed_have_a_colour_each_and_numbers_are_behind_them():
    up, down = np.linspace(10, 30, 9), np.linspace(30, 10, 9)
    asked = {
        "f1 [Hz]": np.minimum(up, down),
        "f2 [Hz]": np.maximum(up, down),
        "f(stage.x) [Hz]": up,
        "f(stage.rz) [Hz]": down,
    }
    figure = draw_sweep(table_of({"thickness [m]": THICKNESS}, asked))
    colours = {heading: by_gid(figure, heading)[0].get_color() for heading in asked}
    assert len({*colours.values()}) == 3 and colours["f1 [Hz]"] == colours["f2 [Hz]"]
    order = [line.get_gid() for line in figure.axes[0].lines if line.get_gid() in asked]
    assert order[:2] == ["f1 [Hz]", "f2 [Hz]"]
    assert "by number" in words(figure)


def grid(values):
    x, y = np.meshgrid([1e-3, 2e-3, 3e-3, 4e-3], [0.1, 0.2, 0.3], indexing="ij")
    return table_of({"thickness [m]": x.ravel(), "mass [kg]": y.ravel()}, {"f1 [Hz]": values})


def test_a_curve_breaks_where_another_mode_takes_over():
    lengths = np.array([0.068, 0.069, 0.07, 0.071])
    table = fx.sweep(fx.load(GUIDE), vary={"length": lengths}, ask="f2, f(carriage.ry)", workers=1)
    heading = "f(carriage.ry) [Hz]"
    axes = draw_sweep(table).axes[0]
    lines = {line.get_gid(): line for line in axes.lines}
    y = lines[heading].get_ydata()
    assert np.isnan(y).tolist() == [False, False, True, False, False]
    found = table.to_columns()[heading]
    np.testing.assert_allclose(y[~np.isnan(y)], found)
    between = lines[f"other mode {heading}"]
    np.testing.assert_allclose(between.get_xdata(), [69, 70])
    np.testing.assert_allclose(between.get_ydata(), found[1:3])
    assert "goes over to another mode" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_a_map_has_level_lines_where_there_are_values_and_is_hatched_where_a_corner_failed():
    x, y = np.meshgrid([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0], indexing="ij")
    values = (10 * x + 3 * y).ravel()
    values[11] = np.nan  # thickness 4 mm, mass 300 g
    figure = draw_sweep(grid(values))
    (lost,) = by_gid(figure, "no value", PolyCollection)
    (path,) = lost.get_paths()
    assert path.vertices[:, 0].min() == pytest.approx(3) and path.vertices[:, 0].max() == pytest.approx(4)
    assert path.vertices[:, 1].min() == pytest.approx(200) and path.vertices[:, 1].max() == pytest.approx(300)
    assert lost.get_hatch() == "////"
    (crosses,) = by_gid(figure, "failed")
    assert (crosses.get_xdata()[0], crosses.get_ydata()[0]) == (pytest.approx(4), pytest.approx(300))
    lines = [own for own in figure.axes[0].get_children() if isinstance(own, ContourSet) and not own.filled]
    for level, own in zip(lines[0].levels, lines[0].get_paths(), strict=True):
        at = own.vertices
        if len(at):
            np.testing.assert_allclose(10 * at[:, 0] + 3 * at[:, 1] / 100, level)
            assert not ((at[:, 0] > 3 + 1e-9) & (at[:, 1] > 200 + 1e-9)).any()
    shown = {text.get_text() for text in figure.axes[0].texts}
    assert shown and shown <= {f"{level:.4g}" for level in lines[0].levels}
    (best,), (worst,) = by_gid(figure, "highest"), by_gid(figure, "lowest")
    assert (best.get_xdata()[0], best.get_ydata()[0]) == (pytest.approx(4), pytest.approx(200))
    assert (worst.get_xdata()[0], worst.get_ydata()[0]) == (pytest.approx(1), pytest.approx(100))
    assert "46 Hz" in figure.axes[0].get_title() and "13 Hz" in figure.axes[0].get_title()
    assert (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()) == ("thickness, mm", "mass, g")
    assert_no_overlap(figure)


@pytest.mark.parametrize("value", [np.nan, 7.0])
def test_a_map_without_values_or_of_one_value_has_no_lines(value):
    figure = draw_sweep(grid(np.full(12, value)))
    assert not any(isinstance(own, ContourSet) for own in figure.axes[0].get_children())
    hatched = by_gid(figure, "no value", PolyCollection)
    assert (len(hatched[0].get_paths()) == 6) if np.isnan(value) else not hatched
    assert ("no design has a value" in words(figure)) == np.isnan(value)


def test_samples_of_two_parameters_are_dots_with_nothing_between():
    x, y = np.linspace(1e-3, 2e-3, 7), np.linspace(2e-3, 1e-3, 7) ** 2
    values = np.where(np.arange(7) == 2, np.nan, np.linspace(5, 9, 7))
    table = table_of({"a [m]": x, "b [m]": y}, {"f1 [Hz]": values}, sampling="sobol")
    figure = draw_sweep(table)
    (dots,) = by_gid(figure, "designs")
    np.testing.assert_allclose(dots.get_offsets()[:, 0], 1e3 * np.delete(x, 2))
    np.testing.assert_allclose(dots.get_array(), np.delete(values, 2))
    (crosses,) = by_gid(figure, "failed")
    np.testing.assert_allclose(crosses.get_xdata(), [1e3 * x[2]])
    assert_no_overlap(figure)


def test_parallel_coordinates_have_a_line_for_each_design_that_did_not_fail():
    rng = np.random.default_rng(5)
    names = ("a [m]", "b [m]", "c [kg]")
    parameters = {name: rng.random(30) for name in names}
    f1 = parameters["a [m]"] + parameters["c [kg]"]
    f1[[3, 17]] = np.nan
    figure = draw_sweep(table_of(parameters, {"f1 [Hz]": f1, "mass [kg]": rng.random(30)}, sampling="sobol"))
    (lines,) = by_gid(figure, "designs", LineCollection)
    there = np.isfinite(f1)
    assert len(lines.get_segments()) == 28
    order = np.argsort(f1[there])
    np.testing.assert_allclose(lines.get_array(), f1[there][order])
    a = parameters["a [m]"][there][order]
    expected = (a - a.min()) / np.ptp(a)
    np.testing.assert_allclose([segment[0, 1] for segment in lines.get_segments()], expected, atol=1e-12)
    assert "2 failed designs left out" in words(figure)
    assert_no_overlap(figure)


def test_of_very_many_designs_one_of_so_many_is_drawn_and_said():
    x = np.linspace(0, 1, 5001)
    figure = draw_sweep(table_of({"a [m]": x}, {"f1 [Hz]": x}))
    (curve,) = by_gid(figure, "f1 [Hz]")
    assert len(curve.get_xdata()) == 1667
    assert "one of 3 designs is drawn" in words(figure)


def test_curves_without_values_have_no_numbers_beside_them():
    figure = draw_sweep(table_of({"a [m]": np.linspace(1, 2, 5)}, {"f1 [Hz]": np.full(5, np.nan)}))
    assert len(by_gid(figure, "failed")[0].get_xdata()) == 5
    assert not len(figure.axes[0].get_yticks())


def test_one_design_is_a_dot_and_none_is_refused():
    figure = draw_sweep(table_of({"a [m]": np.array([1e-3])}, {"f1 [Hz]": np.array([4.0])}))
    assert by_gid(figure, "f1 [Hz]")[0].get_ydata().tolist() == [4.0]
    whole = table_of({"a [m]": np.array([1e-3])}, {"f1 [Hz]": np.array([4.0])})
    with pytest.raises(OptionError, match="nothing to draw"):
        draw_sweep(replace(whole, numbers=()))


@pytest.fixture(scope="module")
def influence():
    return fx.sensitivity(fx.load(GUIDE), ask="f1, mass")


def test_bars_of_a_tornado_are_the_per_cent_and_sorted(influence):
    figure = draw_sensitivity(influence)
    for k, axes in enumerate(figure.axes[:2]):
        names = [text.get_text() for text in axes.get_yticklabels()]
        bars = [own.get_width() for own in axes.patches]
        assert names and len(names) == len(bars)
        sizes = np.abs(influence.relative[k])
        np.testing.assert_allclose(np.abs(bars), np.sort(sizes)[::-1][: len(bars)])
        expected = [influence.relative[k, influence.parameters.index(name)] for name in names]
        np.testing.assert_allclose(bars, expected)
        assert len({own.get_facecolor() for own in axes.patches}) == len({*np.sign(bars)})
    assert "−1.54 %" in words(figure) and "f1: 54.34 Hz" in words(figure)
    assert_no_overlap(figure)


def test_what_comes_after_twelve_bars_is_added_up_by_sign(influence):
    sizes = np.array([[*np.linspace(2, 1, 12), 0.5, -0.25, 0.125, np.nan]])
    many = replace(
        influence,
        quantities=("f1",),
        units=("Hz",),
        value=np.array([1.0]),
        parameters=tuple(f"p{k}" for k in range(16)),
        parameter_units=("m",) * 16,
        nominal=np.ones(16),
        slope=sizes,
        lowest=sizes,
        highest=sizes,
        is_exact=np.array([True]),
    )
    figure = draw_sensitivity(many)
    axes = figure.axes[0]
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert names == [*(f"p{k}" for k in range(12)), "3 others, added up"]
    assert [own.get_width() for own in axes.patches][12:] == pytest.approx([-0.25, 0.625])
    assert "+0.625 %, −0.25 %" in words(figure)
    assert_no_overlap(figure)


def test_frequencies_that_part_have_a_range(influence):
    apart = replace(influence, lowest=influence.slope * 0.5, highest=influence.slope * 1.5)
    figure = draw_sensitivity(apart)
    name = figure.axes[0].get_yticklabels()[0].get_text()
    own = influence.relative[0, influence.parameters.index(name)]
    whiskers = [line for line in figure.axes[0].lines if line.get_marker() == "|"]
    np.testing.assert_allclose(sorted(np.abs(whiskers[0].get_xdata())), [0.5 * abs(own), 1.5 * abs(own)])


@pytest.fixture(scope="module")
def scattered():
    return fx.tolerance(
        fx.load(GUIDE),
        vary=["thickness=± 0.02 mm", "width=normal 0.05 mm"],
        ask="mass, width",
        require=["mass <= 47.5 g", "2 * mass >= 0.09 kg"],
        samples=192,
        workers=1,
    )


def test_a_yield_curve_is_the_share_of_the_samples_with_its_interval(scattered):
    figure = draw_tolerance(scattered)
    mass = 1e3 * scattered.values[:, 0]
    curve, _ = by_gid(figure, "yield")
    for limit, share in zip(curve.get_xdata()[::20], curve.get_ydata()[::20], strict=True):
        assert share == pytest.approx(100 * np.mean(mass >= limit - 1e-9), abs=0.6)
    band, _ = by_gid(figure, "interval", PolyCollection)
    x, y = band.get_paths()[0].vertices.T
    low, high = scattered.yield_interval("mass", np.array([float(np.median(mass)) / 1e3]))
    at = np.abs(x - np.median(mass)) < 0.01 * np.ptp(mass)
    assert low[0] < 0.5 < high[0]
    assert y[at].min() == pytest.approx(100 * low[0], abs=3) and y[at].max() == pytest.approx(100 * high[0], abs=3)
    bars = by_gid(figure, "histogram")[0]
    assert bars.get_data().values.sum() == 192
    assert "mass, g" in words(figure) and "width, mm" in words(figure)
    assert_no_overlap(figure)


def test_limits_stand_where_they_are_asked_of_one_quantity_with_their_yield(scattered):
    assert [(own.quantity, own.limit) for own in scattered.yields] == [("mass", 0.0475), ("", None), ("", None)]
    figure = draw_tolerance(scattered)
    lines = by_gid(figure, "limit")
    assert len(lines) == 2 and {line.axes for line in lines} == {*figure.axes[:2]}
    assert [line.get_xdata()[0] for line in lines] == pytest.approx([47.5, 47.5])
    share = 100 * np.mean(scattered.values[:, 0] <= 0.0475)
    assert f"mass <= 47.5 g: {share:.4g} % of parts" in words(figure)


def test_shares_of_the_variance_are_bars_the_largest_first(scattered):
    figure = draw_tolerance(scattered)
    axes = figure.axes[2]
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert names == list(scattered.influence("mass"))
    total, first = ([own.get_width() for own in bars] for bars in axes.containers)
    places = [scattered.tolerances.index(name) for name in names]
    np.testing.assert_allclose(total, 100 * scattered.indices.total[places, 0])
    np.testing.assert_allclose(first, np.maximum(100 * scattered.indices.first[places, 0], 0))
    without = draw_tolerance(replace(scattered, indices=None))
    assert "no shares of the variance" in words(without)
    assert_no_overlap(without)


@pytest.mark.parametrize(("value", "told"), [(3.0, "does not scatter"), (np.nan, "no sample has a value")])
def test_what_does_not_scatter_has_no_curve(scattered, value, told):
    figure = draw_tolerance(replace(scattered, values=np.full_like(scattered.values, value)))
    assert told in words(figure) and not by_gid(figure, "yield")
    assert_no_overlap(figure)


@pytest.fixture(scope="module")
def best():
    ranges = {"thickness": (0.2e-3, 0.8e-3), "width": (10e-3, 30e-3)}
    return fx.optimize(fx.load(GUIDE), vary=ranges, maximise="mass", subject_to="mass <= 45 g", starts=2)


def test_an_optimum_shows_its_starts_its_variables_and_what_holds_it(best):
    figure = draw_optimum(best)
    (ends,) = by_gid(figure, "the design reported")
    expected = [own.value for own in best.starts if own.agrees]
    assert expected
    np.testing.assert_allclose(np.array(ends.get_ydata()) * 1e-3, expected)
    for own in best.variables:
        (found,), (before,) = by_gid(figure, f"found {own.name}"), by_gid(figure, f"before {own.name}")
        assert found.get_xdata()[0] == pytest.approx((own.value - own.low) / (own.high - own.low))
        assert before.get_xdata()[0] == pytest.approx((own.start - own.low) / (own.high - own.low))
        assert found.get_marker() == ("D" if own.at_bound else "o")
    bars = [own.get_width() for own in figure.axes[3].patches]
    gains = sorted((own.per_percent for own in best.active), reverse=True)
    assert gains[0] > 0
    ratio = np.array(bars) / gains
    assert "g" in figure.axes[3].get_xlabel()
    np.testing.assert_allclose(ratio, ratio[0])
    assert ratio[0] in (pytest.approx(1e3), pytest.approx(1e6))
    assert_no_overlap(figure)


def test_around_an_optimum_are_the_edges_of_limits_and_what_misses_them(best):
    figure = draw_optimum(best)
    around = figure.axes[0]
    assert (around.get_xlabel(), around.get_ylabel()) == ("thickness, mm", "width, mm")
    (edge,) = by_gid(figure, "mass <= 45 g", ContourSet)
    thickness, width = edge.get_paths()[0].vertices.T
    asked = fx.questions(fx.load(GUIDE), "mass").values({"thickness": 1e-3 * thickness, "width": 1e-3 * width})
    np.testing.assert_allclose(asked.value[:, 0], 0.045, rtol=1e-3)
    (missed,) = by_gid(figure, "missed", ContourSet)
    barred = missed.get_paths()[0]
    assert barred.contains_point((0.75, 29)) and not barred.contains_point((0.25, 11))
    (found,) = by_gid(figure, "found")
    assert (found.get_xdata()[0], found.get_ydata()[0]) == pytest.approx(
        (1e3 * best.optimum["thickness"], 1e3 * best.optimum["width"])
    )
    (search,) = by_gid(figure, "search 0")
    np.testing.assert_allclose(search.get_xdata()[0], 1e3 * best.starts[0].start["thickness"])
    assert "mass <= 45 g: 1 % buys 0.45 g" in words(figure)


def test_around_an_optimum_of_one_variable_is_a_curve_with_what_has_no_answer():
    limits = ["f1 <= 60 Hz", "sqrt(f1 / 1 Hz - 50) >= 0.5"]
    found = fx.optimize(fx.load(GUIDE), vary={"length": (50e-3, 70e-3)}, maximise="f1", subject_to=limits, starts=1)
    figure = draw_optimum(found)
    (curve,), (edge,) = by_gid(figure, "goal"), by_gid(figure, "f1 <= 60 Hz")
    known = np.isfinite(curve.get_ydata())
    assert np.array_equal(known, curve.get_xdata() <= curve.get_xdata()[known].max()) and not known.all()
    assert curve.get_ydata()[known].min() == pytest.approx(50, abs=0.3)
    assert edge.get_xdata()[0] == pytest.approx(1e3 * found.optimum["length"], rel=1e-6)
    (barred,) = [own for own in by_gid(figure, "missed") if own.get_x() == 50]
    assert barred.get_x() + barred.get_width() == pytest.approx(edge.get_xdata()[0])
    assert by_gid(figure, "no value") and "no answer" in words(figure)
    assert_no_overlap(figure)


def test_combinations_are_dots_without_searches():
    found = fx.optimize(fx.load(GUIDE), vary="length=50mm,60mm,80mm", maximise="f1", subject_to="f1 <= 70 Hz")
    figure = draw_optimum(found)
    (dots,) = by_gid(figure, "goal")
    np.testing.assert_allclose(dots.get_xdata(), [50, 60, 80])
    (barred,) = by_gid(figure, "missed")
    assert (barred.get_x(), barred.get_width()) == (50, pytest.approx(5))
    assert "no searches" in words(figure) and "no multipliers" in words(figure)
    assert_no_overlap(figure)


def test_starts_that_end_elsewhere_or_miss_limits_are_told_apart(best):
    first = replace(best.starts[0], agrees=False, value=0.9 * best.value)
    second = replace(best.starts[0], number=1, agrees=False, violation=0.1)
    figure = draw_optimum(replace(best, starts=(first, second), active=()))
    assert by_gid(figure, "elsewhere")[0].get_ydata()[0] == pytest.approx(900 * best.value)
    assert by_gid(figure, "limits missed")[0].get_xdata()[0] == 2
    assert "no limit holds it" in words(figure)
    assert_no_overlap(figure)


def front_of(best, values, goals=("f1", "mass"), units=("Hz", "kg")):
    n = len(values)
    return fx.Pareto(
        name="made",
        goals=goals,
        units=units,
        names=("thickness",),
        parameter_units=("m",),
        designs=np.linspace(1e-4, 2e-4, n)[:, None],
        values=np.array(values, dtype=float).reshape(n, len(goals)),
        residual=np.zeros(n),
        seed=0,
        evaluations=0,
        tried=0,
        failures={},
        mechanism=best.mechanism,
        parameters={},
    )


def test_a_front_of_two_goals_has_its_knee_and_more_goals_are_parallel(best):
    figure = draw_optimum(front_of(best, [[10, 0.1], [20, 0.11], [30, 0.12], [40, 0.2], [41, 0.3]]))
    (dots,), (knee,) = by_gid(figure, "front"), by_gid(figure, "knee")
    np.testing.assert_allclose(dots.get_ydata(), [100, 110, 120, 200, 300])
    assert (knee.get_xdata()[0], knee.get_ydata()[0]) == (pytest.approx(30), pytest.approx(120))
    assert_no_overlap(figure)
    assert not by_gid(draw_optimum(front_of(best, [[10, 0.1], [20, 0.2]])), "knee")
    three = front_of(best, [[1, 2, 3], [2, 1, 4], [3, 0, 5]], ("f1", "f2", "mass"), ("Hz", "Hz", "kg"))
    assert len(by_gid(draw_optimum(three), "designs", LineCollection)[0].get_segments()) == 3
    with pytest.raises(OptionError, match="no front to draw"):
        draw_optimum(front_of(best, np.empty((0, 2))))


def test_files_are_as_fine_as_asked_for(influence, scattered, best, tmp_path):
    table = table_of({"a [m]": THICKNESS}, {"f1 [Hz]": THICKNESS})
    written = [*save_sweep(table, tmp_path, dpi=60), *save_sensitivity(influence, tmp_path, dpi=60)]
    written += [*save_tolerance(scattered, tmp_path, dpi=60), *save_optimum(best, tmp_path, dpi=60)]
    assert [path.name for path in written] == ["sweep.png", "sensitivity.png", "tolerance.png", "optimum.png"]
    with Image.open(written[0]) as picture:
        assert picture.size == (480, 288)


def test_the_shell_draws_what_it_prints(tmp_path):
    vary = ("--vary", "thickness=0.3mm:0.6mm:4", "--ask", "f1, mass", "--workers", "1")
    scatter = ("--vary", "thickness=± 1 %", "--ask", "mass", "--samples", "48", "--workers", "1")
    commands = {
        "sweep": ("sweep", GUIDE, *vary),
        "sensitivity": ("sensitivity", GUIDE),
        "tolerance": ("tolerance", GUIDE, *scatter),
        "optimum": ("optimize", GUIDE, "--vary", "thickness=0.4mm:0.6mm", "--minimise", "mass", "--starts", "1"),
    }
    for name, command in commands.items():
        words = [str(word) for word in (*command, "--dpi", "60")]
        done = CliRunner().invoke(app, [*words, "--plot", str(tmp_path)])
        assert done.exit_code == 0 and f"wrote {tmp_path}/{name}.png" in done.stdout, done.stderr
        assert "belongs to --plot" in str(CliRunner().invoke(app, words).exception)
