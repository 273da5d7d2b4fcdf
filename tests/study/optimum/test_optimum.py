"""Optima of mechanisms with closed forms: what is best, what holds it, and what giving way buys."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flexura as fx
from flexura.deadline import Progress
from flexura.results import plain
from flexura.study.questions import Questions, questions
from helpers.shell import flexura, refused

GUIDE = "examples/guide/guide.yaml"
E, RHO, TIP = 200e9, 7800.0, 2.0


def cantilever(pieces: int = 1, width: str = "w{k}", thickness: str = "t") -> fx.Mechanism:
    """A light cantilever of `pieces` equal lengths, Bernoulli beams, with a heavy point mass at the tip: the first
    frequency is sqrt(k / m) / 2 pi, of the tip's bending stiffness about the thin axis, but for some 1e-5."""
    names = [f"w{k}" for k in range(pieces)]
    widths = "\n".join(f"  {name}: {{value: 10 mm, minimum: 0.1 mm, maximum: 100 mm}}" for name in names)
    total = " + ".join(names)
    nodes = "\n".join(f"  n{k}: [length * {k} / {pieces}, 0, 0]" for k in range(pieces + 1))
    links = "\n".join(
        f"  l{k}: {{nodes: [n{k}, n{k + 1}], material: m, reference: z,"
        f" section: {{shape: rectangle, width: {width.format(k=k)}, thickness: {thickness.format(k=k)}}}}}"
        for k in range(pieces)
    )
    return fx.loads(
        f"""
flexura: 1
name: cantilever
theory: euler_bernoulli
corrections: none
parameters:
  length: {{value: 100 mm, minimum: 20 mm, maximum: 400 mm}}
  t: {{value: 1 mm, minimum: 0.1 mm, maximum: 5 mm}}
{widths}
  mean_width: {{value: ({total}) / {pieces}}}
materials:
  m: {{E: {E} Pa, nu: 0.3, rho: 1e-3 kg/m^3}}
nodes:
{nodes}
links:
{links}
masses:
  tip: {{node: n{pieces}, mass: {TIP} kg}}
ground:
  n0: clamped
"""
    )


def stiffest(power: int, pieces: int) -> tuple[np.ndarray, float]:
    """Widths or depths, over their mean, and stiffness over that of the uniform cantilever, of the stepped one of least
    deflection under a tip force with a given volume.

    With I ~ A^n the deflection is the sum of m_j / A_j^n, m_j the integral of x^2 over piece j from the tip, so that
    A_j ~ m_j^(1 / (n + 1)) (from stationarity; the continuous limits are (L - x)^(2 / (n + 1)), as of Karihaloo and
    Niordson 1973 where the tip mass is large). By hand, n = 1: stiffer by 4/3 in the limit.
    """
    ends = np.linspace(0, 1, pieces + 1)
    m = np.diff(ends**3)[::-1] / 3
    area = m ** (1 / (power + 1))
    area /= area.mean()
    return area, (1 / 3) / float((m / area**power).sum())


@pytest.mark.parametrize("power", [1, 3])
def test_the_stiffest_stepped_cantilever(power):
    """The greatest frequency under a given volume: widths (I ~ A) or depths (I ~ A^3) in closed form."""
    pieces = 4
    mechanism = cantilever(pieces) if power == 1 else cantilever(pieces, "30 mm", "w{k} / 10")
    names = [f"w{k}" for k in range(pieces)]
    found = fx.optimize(
        mechanism,
        vary=dict.fromkeys(names, (0.002, 0.04)),
        maximise="f1",
        subject_to="mean_width <= 10 mm",
        starts=2,
    )
    area, stiffer = stiffest(power, pieces)
    assert isinstance(found, fx.Optimum)
    assert [found.optimum[name] for name in names] == pytest.approx(1e-2 * area, rel=1e-3)
    uniform = fx.modes(mechanism, n=1, order="full").modes[0].frequency_hz
    assert found.value / uniform == pytest.approx(np.sqrt(stiffer), rel=1e-5)
    # f ~ volume^(n / 2): 1 % more of it buys n / 2 per cent
    assert found.active[0].per_percent == pytest.approx(power / 2 * 0.01 * found.value, rel=1e-3)
    assert found.kkt_residual < 1e-3 and not found.warnings


def test_stiffness_in_the_limit_of_many_pieces():
    """The stepped closed form goes to 4/3 and 27/16, by hand from (L - x)^(2 / (n + 1))."""
    assert stiffest(1, 2000)[1] == pytest.approx(4 / 3, rel=1e-3)
    assert stiffest(3, 2000)[1] == pytest.approx(27 / 16, rel=1e-3)


def test_two_axes_whose_frequencies_meet():
    """A tip on a leaf w x t whose section has a given area: bending about both axes is best where w = t, and there the
    two lowest frequencies are one, sqrt(3 E w^4 / 12 / (L^3 m)) / 2 pi; each alone would go on growing."""
    found = fx.optimize(
        cantilever(), vary={"w0": (1e-3, 1e-2), "t": (1e-3, 5e-3)}, maximise="f1", subject_to="w0 * t <= 9 [mm^2]"
    )
    assert isinstance(found, fx.Optimum)
    assert found.optimum["w0"] == pytest.approx(3e-3, rel=1e-5) and found.optimum["t"] == pytest.approx(3e-3, rel=1e-5)
    own = np.sqrt(3 * E * 3e-3**4 / 12 / 0.1**3 / TIP) / (2 * np.pi)
    assert found.value == pytest.approx(own, rel=1e-5)
    # f ~ area at w = t
    assert found.active[0].per_percent == pytest.approx(0.01 * own, rel=1e-3)
    assert any("coincide" in note for note in found.notes)
    assert found.kkt_residual < 1e-4


def test_bounds_and_limits_in_the_words_of_the_user():
    """f ~ t w^(1/2) with a mass t w: t at its bound, w where the area ends; f^2 = 3 E w t^3 / 12 / (L^3 m)."""
    found = fx.optimize(
        cantilever(),
        vary={"w0": (5e-3, 2e-2), "t": (0.5e-3, 1e-3)},
        maximise="f1",
        subject_to=["w0 * t <= 10 [mm^2]"],
        starts=3,
    )
    assert isinstance(found, fx.Optimum)
    hz = np.sqrt(3 * E * 1e-2 * 1e-3**3 / 12 / 0.1**3 / TIP) / (2 * np.pi)
    assert found.optimum == pytest.approx({"w0": 1e-2, "t": 1e-3}, rel=1e-6)
    assert found.value == pytest.approx(hz, rel=1e-5)
    area, thickness = found.active
    # at t held: f ~ area^(1/2); along the area f ~ t
    assert area.multiplier == pytest.approx(hz / 2 / 1e-5, rel=1e-3)
    assert thickness.text == "t <= 1 mm" and thickness.multiplier == pytest.approx(hz / 1e-3, rel=1e-3)
    assert thickness.per_percent == pytest.approx(0.01 * hz, rel=1e-3)
    assert "1 % more buys" in str(area) and "Hz per mm" in str(thickness)
    assert found.variables[1].at_bound == "high"
    data = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert data["optimum"]["t"] == pytest.approx(1e-3) and data["multipliers"]["t <= 1 mm"] == thickness.multiplier
    assert {"optimum", "value", "active", "multipliers", "proof"} <= data.keys()


def test_the_proof_is_that_of_the_verbs():
    mechanism = fx.load(GUIDE)
    found = fx.optimize(
        mechanism,
        vary=["thickness=0.3mm:0.6mm", "length"],
        maximise="f1",
        subject_to=["f2 <= 800 Hz", "mass <= 44 g"],
        starts=2,
    )
    assert isinstance(found, fx.Optimum)
    own = fx.modes(mechanism, found.optimum, n=2)
    proofs = {one.text: one for one in found.proof}
    low, high = own.modes[0].interval_hz
    assert proofs["f1"].checked == pytest.approx(own.modes[0].full_frequency_hz, rel=1e-9)
    assert proofs["f1"].interval == pytest.approx((low, high), rel=1e-9)
    assert proofs["mass"].checked == pytest.approx(own.evidence.model_mass.mass, rel=1e-9)
    assert proofs["f2"].value == pytest.approx(800, rel=1e-5)


def guided(E: float) -> dict[str, float]:
    """By hand: the greatest frequency of the guide with leaves of a modulus E, 0.2 to 0.6 mm thick, below 400 MPa at 2
    mm; and what 1 % more of the limits buys.

    Leaves that are guided have 3 E t d / L^2 of stress at their ends, so that L = sqrt(3 E t d / S) on the limit, and
    (2 pi f)^2 = 2 E w t^3 / L^3 / (M + 2 (13 / 35) rho w t L), as 3 x^2 - 2 x^3 is the shape of a leaf. With m the
    leaves' share of that mass, f ~ t^(3/4 (1 - m)) S^(3/4 + m / 4): t ends at its bound.
    """
    rho, w, t, d, S, M = 7850.0, 20e-3, 0.6e-3, 2e-3, 400e6, 2700 * 70e-3 * 20e-3 * 10e-3
    L = np.sqrt(3 * E * t * d / S)
    leaves = 2 * 13 / 35 * rho * w * t * L
    share = leaves / (M + leaves)
    hz = np.sqrt(2 * E * w * t**3 / L**3 / (M + leaves)) / (2 * np.pi)
    return {
        "length": L,
        "hz": hz,
        "stress": 0.01 * hz * (0.75 + share / 4),
        "thickness": 0.01 * hz * 0.75 * (1 - share),
    }


def test_the_first_question_has_its_answer():
    """Leaves bend between the moduli of beams and of plates; what is left is the carriage that turns on leaves that
    stretch, and the displacement of a twentieth of the length, of 1 % together."""
    found = fx.optimize(fx.load(GUIDE))
    assert isinstance(found, fx.Optimum)
    beam, plate = guided(206e9), guided(206e9 / (1 - (206 / 79.5 / 2 - 1) ** 2))
    assert found.optimum["thickness"] == 0.6e-3 and found.variables[0].at_bound == "high"
    assert beam["length"] < found.optimum["length"] < plate["length"]
    assert 0.99 * plate["hz"] < found.value < beam["hz"]
    stress, thickness = found.active
    assert 0.98 * plate["stress"] < stress.per_percent < 1.01 * beam["stress"]
    assert 0.98 * plate["thickness"] < thickness.per_percent < 1.01 * beam["thickness"]
    assert found.kkt_residual < 1e-6 and not found.warnings


def test_the_first_question_of_beams():
    """Without corrections the modulus is that of beams, and 1 % of the length is left to the parts above."""
    text = Path(GUIDE).read_text(encoding="utf-8") + "\ncorrections: none\ntheory: euler_bernoulli\n"
    found = fx.optimize(fx.loads(text), starts=1)
    assert isinstance(found, fx.Optimum)
    beam = guided(206e9)
    assert found.optimum["length"] == pytest.approx(beam["length"], rel=0.01)
    assert found.value == pytest.approx(beam["hz"], rel=0.015)
    assert found.active[0].per_percent == pytest.approx(beam["stress"], rel=0.02)
    assert found.active[1].per_percent == pytest.approx(beam["thickness"], rel=0.02)


def test_both_sides_of_the_first_question_are_one():
    """The guide is symmetric: at -2 mm its leaves are stressed as at 2 mm."""
    both = questions(fx.load(GUIDE), "stress at carriage.x = 2 mm, stress at carriage.x = -2 mm").values({})
    assert both.value[0, 0] == pytest.approx(both.value[0, 1], rel=1e-9)


def test_the_proof_of_members_by_a_pattern():
    """Of `leaf*` it is the largest stress of all of them, as the verb has it."""
    mechanism = fx.load(GUIDE)
    found = fx.optimize(
        mechanism,
        vary="thickness=0.3mm:0.6mm",
        maximise="thickness",
        subject_to="stress(leaf*) <= 200 MPa at carriage.x = 2 mm",
        starts=1,
    )
    assert isinstance(found, fx.Optimum)
    (own,) = [one for one in found.proof if "stress" in one.text]
    pose = fx.stroke(mechanism, found.optimum, move={"carriage.x": 2e-3}, steps=2)
    members = pose.stresses(len(pose.poses) - 1).members
    assert own.by == "stroke" and own.value == pytest.approx(200e6, rel=1e-6)
    assert own.checked == pytest.approx(max(m.von_mises for m in members if m.von_mises is not None), rel=1e-12)
    assert not found.warnings


def test_slopes_that_are_differences_are_said(monkeypatch):
    exact = Questions.slopes

    def differenced(self: Questions, parameters: Any, names: Any) -> Any:
        found = exact(self, parameters, names)
        return replace(found, is_exact=np.array([own.kind != "mass" for own in found.quantities]))

    given = {"vary": "thickness=0.3mm:0.6mm", "minimise": "mass", "subject_to": "f1 >= 50 Hz", "starts": 1}
    said = "slopes of mass are differences of high order, not exact"
    assert said not in fx.optimize(fx.load(GUIDE), **given).notes
    monkeypatch.setattr(Questions, "slopes", differenced)
    assert said in fx.optimize(fx.load(GUIDE), **given).notes


def test_limits_that_nothing_meets():
    """f1 of the guide stays above 5 Hz and the gap below 400 Hz where it is low: never called an optimum."""
    found = fx.optimize(
        fx.load(GUIDE), vary=["thickness=0.2mm:0.6mm", "length=30mm:100mm"], minimise="mass", subject_to="f1 <= 5 Hz"
    )
    assert isinstance(found, fx.Optimum)
    assert not found.is_feasible and found.optimum == {} and found.active == ()
    lowest = fx.modes(fx.load(GUIDE), {"thickness": 0.2e-3, "length": 0.1}, n=1, order="full").modes[0].frequency_hz
    assert found.nearest == pytest.approx({"thickness": 0.2e-3, "length": 0.1})
    assert found.violations[0].by == pytest.approx(lowest - 5, rel=1e-4)
    assert "no design was found that meets the limits" in str(found.warnings[0])
    with pytest.raises(fx.OptionError, match="no design meets the limits"):
        found.save("never.yaml", base=GUIDE)
    with pytest.raises(fx.LimitError):
        found.raise_warnings()


def test_lists_are_tried_one_by_one():
    told = []
    found = fx.optimize(
        fx.load(GUIDE),
        vary={"thickness": [5e-4, 2e-4, 3e-4], "length": (30e-3, 100e-3)},
        minimise="f1",
        subject_to="f2 >= 300 Hz",
        starts=2,
        progress=told.append,
    )
    assert isinstance(found, fx.Optimum)
    rounds = [(own.words, own.done, own.of) for own in told]
    assert rounds == [*(("combinations", k, 3) for k in range(3)), ("proof", 0, None)]
    assert found.optimum["thickness"] == 2e-4 and "each of 3 combinations was solved" in found.notes
    alone = fx.optimize(fx.load(GUIDE), vary={"thickness": [5e-4, 2e-4, 3e-4]}, maximise="f1", subject_to="f1 <= 40 Hz")
    each = [
        fx.modes(fx.load(GUIDE), {"thickness": t}, n=1, order="full").modes[0].frequency_hz for t in (5e-4, 2e-4, 3e-4)
    ]
    assert isinstance(alone, fx.Optimum)
    assert alone.value == pytest.approx(max(hz for hz in each if hz <= 40), rel=1e-5)
    assert "all 3 combinations were worked out" in alone.notes


def test_a_front_is_the_same_again_and_its_designs_are_saved(tmp_path):
    """Thinner leaves alone lower f1, so that the front of f1 and mass over the thickness is all of it."""

    told: list[Progress] = []

    def front() -> fx.Pareto:
        vary = "thickness=0.3mm:0.6mm"
        found = fx.optimize(fx.load(GUIDE), vary=vary, maximise="f1", minimise="mass", points=3, progress=told.append)
        assert isinstance(found, fx.Pareto)
        return found

    found = front()
    assert [own.words for own in told][59:61] == ["generations", "designs of the front"]
    assert np.array_equal(found.values, front().values) and len(found) >= 3
    middle = fx.modes(found.mechanism, found.pick(len(found) // 2), n=1).model_error[0]
    assert found.model_error["f1"] == pytest.approx(middle, abs=1e-5) and found.model_error["mass"] is None
    assert found.designs[[0, -1], 0] == pytest.approx([0.3e-3, 0.6e-3], rel=1e-6)
    for row in (0, len(found) - 1):
        hz = fx.modes(fx.load(GUIDE), found.pick(row), n=1, order="full").modes[0].frequency_hz
        assert found.values[row, 0] == pytest.approx(hz, rel=1e-5)
    path = found.save(tmp_path / "front.yaml", base=GUIDE, row=1)
    assert fx.load(path).parameters["thickness"].value == found.pick(1)["thickness"]
    with pytest.raises(fx.OptionError, match="there is no 99"):
        found.pick(99)
    assert plain(found)["goals"] == ["maximise f1", "minimise mass"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"maximise": "f1"}, "say what may vary"),
        ({"vary": "thickness=0.2mm:0.3mm"}, "name a goal"),
        ({"vary": "thickness=0.2mm:0.3mm", "maximise": "2 * 3"}, "a number for every design"),
        ({"vary": "thicknes=0.2mm:0.3mm", "maximise": "f1"}, "is not a parameter"),
        ({"vary": ["width"], "maximise": "f1"}, "width has no minimum and maximum"),
        ({"vary": "thickness=0.3mm:0.2mm", "maximise": "f1"}, "thickness"),
        ({"vary": "thickness=0.3mm:0.3mm", "maximise": "f1"}, "thickness"),
        ({"vary": "thickness=0.2mm:0.3mm", "maximise": "frequency"}, "frequency"),
        ({"vary": "thickness=0.2mm:0.3mm", "maximise": "f1", "subject_to": "mass <= 3 Hz"}, "one dimension"),
        ({"vary": "thickness=0.2mm:0.3mm", "maximise": "f1", "starts": 0}, "starts is a whole number"),
        ({"vary": "thickness=0.2mm:0.3mm", "maximise": "f1", "method": "newton"}, "method is slsqp"),
        ({"study": "best"}, "there is no study 'best'"),
    ],
)
def test_what_makes_no_sense_is_said_before_work_starts(given, said):
    with pytest.raises(fx.OptionError, match=said):
        fx.optimize(fx.load(GUIDE).model_copy(update={"studies": {}}), **given)


def test_the_shell_writes_a_model_of_the_optimum(tmp_path):
    out = tmp_path / "best.yaml"
    limit = ["--vary", "thickness=0.2mm:0.6mm", "--maximise", "f1", "--subject-to", "f1 <= 50 Hz", "--starts", "2"]
    done = flexura("optimize", GUIDE, *limit, "--out", str(out), "--json")
    data = json.loads(done.stdout)
    assert data["value"] == pytest.approx(50, rel=1e-5) and data["files"] == [str(out)]
    best = fx.load(out)
    assert fx.modes(best, n=1, order="full").modes[0].frequency_hz == pytest.approx(50, rel=1e-4)
    assert best.parameters["thickness"].source == "optimised: maximise f1; was 0.5 mm (example)"
    flexura("optimize", out, *limit, "--set", "width=15mm", "--out", tmp_path / "again.yaml")
    again = fx.load(tmp_path / "again.yaml").parameters
    assert again["width"].value == 15e-3 and again["width"].source == "given; was 20 mm (example)"
    before = best.parameters["thickness"]
    assert again["thickness"].source == f"optimised: maximise f1; was {1e3 * before.value:.9g} mm ({before.source})"
    text = flexura("optimize", GUIDE, *limit).stdout
    assert "f1 <= 50 Hz: 1 % more buys 0.5 Hz of f1" in text and "proven within" in text
    assert Path(out).read_text(encoding="utf-8").startswith("flexura: 1\nextends: ")


def test_the_shell_tells_the_nearest_design_where_there_is_no_model_to_write(tmp_path):
    out = tmp_path / "never.yaml"
    limit = ["--vary", "thickness=0.2mm:0.6mm", "--minimise", "mass", "--subject-to", "f1 <= 5 Hz", "--starts", "1"]
    done = flexura("optimize", GUIDE, *limit, "--out", out)
    refused(done, "no design meets the limits")
    assert not out.exists()
    assert "nearest" in done.stdout and "0.2 mm (at its lower bound)" in done.stdout


def test_the_largest_of_several_is_a_limit_of_each_of_them():
    """A limit of `max` is two limits, whose multipliers add up per cent by per cent; both hold at the optimum, where
    `max` itself has no slope."""
    given: dict[str, Any] = {"vary": ["thickness=0.2mm:0.6mm", "length=30mm:100mm"], "maximise": "f1", "starts": 1}
    apart = fx.optimize(fx.load(GUIDE), subject_to=["mass <= 43 g", "f2 <= 700 Hz"], **given)
    for text in ("max(mass/43 g, f2/700 Hz) <= 1", "3 >= 1 - -2*max(mass/43 g, f2/700 Hz)"):
        joined = fx.optimize(fx.load(GUIDE), subject_to=text, **given)
        assert isinstance(apart, fx.Optimum) and isinstance(joined, fx.Optimum)
        assert joined.optimum == pytest.approx(apart.optimum, rel=1e-6)
        assert joined.kkt_residual < 1e-8 and joined.evaluations <= 2 * apart.evaluations
        per_cent = sum(own.per_percent for own in apart.active)
        assert len(apart.active) == 2
        assert 100 * joined.active[0].multiplier * (2 if "-2" in text else 1) == pytest.approx(1e4 * per_cent, rel=1e-4)


def test_the_least_of_several_is_made_as_large_as_can_be():
    """At the best of `min` parts pull against each other: of x and 4 - x it is 2, whatever the third does above."""
    goal = "min(min(t/1 mm, 100 mm/length), 4 - t/1 mm)"
    given: dict[str, Any] = {"vary": {"t": (0.5e-3, 4e-3), "length": (40e-3, 200e-3)}, "starts": 2}
    found = fx.optimize(cantilever(), maximise=goal, **given)
    assert isinstance(found, fx.Optimum)
    assert found.value == pytest.approx(2) and found.optimum["t"] == pytest.approx(2e-3, rel=1e-6)
    assert found.kkt_residual < 1e-8 and any("parts of the goal coincide" in own for own in found.notes)


def test_a_goal_that_nothing_changes_and_goals_against_each_other_are_said() -> None:
    still = fx.optimize(cantilever(), vary={"t": (0.5e-3, 2e-3)}, maximise="length", starts=2)
    assert [own.place for own in still.warnings if own.kind == "goal"] == ["maximise length"]
    against = fx.optimize(cantilever(), vary={"t": (0.5e-3, 2e-3)}, maximise="mass", minimise="mass", points=2)
    assert ["both large and small" in own.text for own in against.warnings if own.kind == "goal"] == [True]


def test_a_model_file_is_not_written_over_those_that_it_would_extend(tmp_path):
    base, upper = tmp_path / "base.yaml", tmp_path / "upper.yaml"
    base.write_text(Path(GUIDE).read_text(encoding="utf-8"), encoding="utf-8")
    upper.write_text("flexura: 1\nextends: base.yaml\n", encoding="utf-8")
    (tmp_path / "link.yaml").symlink_to(base)
    before = [base.read_bytes(), upper.read_bytes()]
    found = fx.optimize(fx.load(upper), vary={"thickness": (3e-4, 5e-4)}, maximise="mass", starts=1)
    for target in (upper, base, tmp_path / "link.yaml"):
        with pytest.raises(fx.OptionError, match="is the model file that is read, or one that it extends"):
            found.save(target, base=upper)
    refused(flexura("optimize", upper, "--out", tmp_path / "." / "base.yaml"), "base.yaml", "give another name")
    refused(flexura("calibrate", upper, "no.csv", "--free", "width", "--out", upper), "upper.yaml", "another name")
    assert [base.read_bytes(), upper.read_bytes()] == before


@pytest.mark.parametrize(
    "asked",
    [
        {"maximise": "f1/(thickness - thickness)"},
        {"maximise": "sqrt(mass - 1 kg)"},
        {"maximise": "f1", "subject_to": "mass/(thickness - thickness) <= 3 [kg/m]"},
    ],
)
def test_formulas_without_a_finite_value_are_designs_without_an_answer(asked):
    with pytest.raises(fx.SolverError, match="the goal or a limit, or its derivative, is not finite"):
        fx.optimize(fx.load(GUIDE), vary={"thickness": (2e-4, 6e-4)}, **asked)


def test_a_formula_that_has_no_value_in_some_designs():
    """sqrt(t - 0.4 mm) has none below 0.4 mm, and is largest at the end of the range."""
    found = fx.optimize(fx.load(GUIDE), vary={"thickness": (2e-4, 6e-4)}, maximise="sqrt(thickness - 0.4 mm)")
    assert found.optimum == {"thickness": 6e-4} and found.value == pytest.approx(np.sqrt(2e-4), rel=1e-12)
    assert found.active[0].multiplier == pytest.approx(0.5 / np.sqrt(2e-4), rel=1e-6)
    assert "m^(1/2)" in str(found.active[0])
