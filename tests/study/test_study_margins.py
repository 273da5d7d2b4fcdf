"""Model errors of what studies ask: those of `modes`, laws of physics between them, and limits that they straddle."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.study.questions import Margins, formula, margins, questions
from helpers.shell import GUIDE, flexura

BEAM = """
flexura: 1
parameters: {length: 40 mm}
nodes: {foot: [0, 0, 0], tip: [length, 0, 0]}
flexures:
  leaf:
    nodes: [foot, tip]
    material: spring-steel
    reference: z
    elements: 8
    profile: {type: leaf, width: 10 mm, thickness: 0.5 mm}
ground: {foot: clamped}
"""
VARY = "thickness=0.3mm:0.5mm:2"


def of(text: str, ask: str, *formulas: str) -> Margins:
    asked = questions(fx.loads(text), ask)
    own = [formula(asked.plan, one) for one in formulas]
    found = asked.values({})
    values = {one.text: float(found.value[0, k]) for k, one in enumerate(asked.quantities)}
    return Margins(asked.plan, {}, asked.quantities, formulas=own, values=values)


def test_frequencies_have_the_model_error_of_modes() -> None:
    found = fx.sweep(fx.load(GUIDE), vary=VARY, ask="f1, f4, f(carriage.y), mass").model_error
    own = fx.modes(fx.load(GUIDE)).model_error
    assert own[0] is not None and own[3] is not None
    assert found["f1"] == pytest.approx(own[0], rel=1e-6)
    assert found["f4"] == pytest.approx(own[3], rel=1e-6) and found["f(carriage.y)"] == found["f4"]
    assert found["mass"] is None


def test_of_a_heavy_carriage_the_frequency_goes_as_the_root_of_the_stiffness() -> None:
    """f = sqrt(k / m) / (2 pi), and a compliance is one over the stiffness, which is that of `kinetostatics`."""
    text = GUIDE.read_text(encoding="utf-8")
    found = of(text, "f1, stiffness(carriage.x), compliance(carriage.x)").intervals
    f, k, c = (found[name] for name in ("f1", "stiffness(carriage.x)", "compliance(carriage.x)"))
    assert f is not None and k is not None and c is not None and k[1] - k[0] > 0.01
    second = max(map(abs, k)) ** 2  # what follows is meant to first order
    np.testing.assert_allclose(np.sqrt(1 + np.array(k)) - 1, f, atol=second)
    np.testing.assert_allclose((1 + np.array(k)) * (1 + np.array(c[::-1])), 1.0, atol=2 * second)
    np.testing.assert_allclose(k, fx.kinetostatics(fx.load(GUIDE)).model_error["stiffness"][0], rtol=1e-6)


def test_assumptions_move_all_numbers_of_a_formula_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ratio of frequencies of a leaf is that of a beam, whatever its stiffness; a product moves twice as far; what
    a force at the tip moves the tip by is its own elongation."""
    monkeypatch.setattr("flexura.analysis.model_error.model_error.LEFT", 0.0)  # what every number has by itself
    found = of(BEAM, "f1, f2, amplification(tip.z, tip.z), coupling(tip.z, tip.z)", "f2 / f1", "f1 * f1").intervals
    one, ratio, product = (found[name] for name in ("f1", "f2 / f1", "f1 * f1"))
    assert one is not None and ratio is not None and product is not None
    assert ratio[1] - ratio[0] < 0.5 * (one[1] - one[0])
    np.testing.assert_allclose(1 + np.array(product), (1 + np.array(one)) ** 2, rtol=1e-12)
    still, moved = found["amplification(tip.z, tip.z)"], found["coupling(tip.z, tip.z)"]
    assert still == pytest.approx((0.0, 0.0), abs=1e-12) and moved is not None and moved[1] - moved[0] > 0.01


def test_what_has_no_model_error_has_a_reason() -> None:
    pose = "at carriage.x = 2 mm"
    asked = f"mass, stress {pose}, f1 {pose}, stiffness(carriage.x) {pose}"
    own = of(GUIDE.read_text(encoding="utf-8"), asked, f"2 * stress / f1 {pose}")
    said = {name.partition(" at")[0]: why for name, why in own.reasons.items()}
    assert said["mass"] == "exact for the description" and said["stress"] == "no evidence for this stress"
    assert said["2 * stress / f1"] == said["stress"] and "pose holds" in said["stiffness(carriage.x)"]
    assert [name for name, interval in own.intervals.items() if interval is not None] == ["f1 at carriage.x = 2 mm"]


def test_stresses_at_rest_have_the_error_of_statics() -> None:
    text = BEAM + "gravity: [0, 0, -9.81 m/s^2]\n"
    found, own = of(text, "stress, margin").intervals, fx.statics(fx.loads(text)).stress_error
    assert own is not None and found["stress"] == pytest.approx(own) and found["margin"] is not None
    assert found["margin"][0] == pytest.approx(1 / (1 + own[1]) - 1)


def test_a_batch_waits_for_no_model_error(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    worked_out = margins.model_errors_of_modes
    monkeypatch.setattr(margins, "model_errors_of_modes", lambda model, n: asked.append(n) or worked_out(model, n))
    found = fx.sweep(fx.load(GUIDE), vary=VARY, ask="f1, f2, mass")
    assert not asked
    assert found.to_dict()["model_error"] == {**found.to_dict()["model_error"], "mass": None} and len(asked) == 1


def test_limits_that_the_part_may_miss_are_said() -> None:
    given = {"vary": "thickness=0.2mm:0.6mm", "minimise": "mass", "starts": 2}
    held = fx.optimize(fx.load(GUIDE), subject_to=["f1 >= 40 Hz", "f1 <= 45 Hz"], **given)
    said = [note for note in held.notes if "the part may miss it" in note]
    assert len(said) == 1 and said[0].startswith("f1 >= 40 Hz") and held.margins is not None
    assert held.margins.texts["f1"] in said[0]
    at_optimum = fx.modes(fx.load(GUIDE), held.optimum).model_error[0]
    assert at_optimum is not None and held.model_error["f1"] == pytest.approx(at_optimum, rel=1e-6)
    assert held.model_error["mass"] is None


@pytest.mark.parametrize(
    "command",
    [
        ("sweep", GUIDE, "--vary", VARY, "--ask", "f1, mass"),
        ("sensitivity", GUIDE, "--ask", "f1, mass", "--free", "thickness"),
        ("tolerance", GUIDE, "--vary", "thickness=± 0.01 mm", "--ask", "f1, mass", "--samples", 64, "--no-indices"),
        ("optimize", GUIDE, "--vary", "thickness=0.45mm,0.6mm", "--minimise", "mass", "--subject-to", "f1 >= 1 Hz"),
    ],
)
def test_the_shell_has_a_line_for_each_question(command: tuple[object, ...]) -> None:
    at = {"thickness": 0.45e-3} if command[0] == "optimize" else {}
    done, own = flexura(*command), fx.modes(fx.load(GUIDE), at).model_errors.texts[0]
    if command[0] == "optimize":  # beside what is proven of each
        rows = [line.rstrip() for line in done.stdout.splitlines()]
        assert any(row.startswith("f1  ") and row.endswith(f"  {own}") for row in rows), done.stdout
        assert any(row.startswith("mass  ") and row.endswith("  exact for the description") for row in rows)
        return
    assert f"f1: model error {own} (nominal design)" in done.stdout, done.stderr
    assert "mass: no model error, exact for the description" in done.stdout
