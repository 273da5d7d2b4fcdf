"""What a per cent of each parameter does to what is asked, against closed forms; in Python and in the shell."""

from __future__ import annotations

import json

import numpy as np
import pytest

import flexura as fx
from helpers.shell import GUIDE, flexura

BAR = """
flexura: 1
name: square bar
parameters: {b: 10 mm, h: 10 mm, length: 1 m, offset: 0 mm, double: 2*b}
corrections: none
nodes: {foot: [offset, 0, 0], tip: [offset, 0, length]}
links:
  bar:
    nodes: [foot, tip]
    material: spring-steel
    reference: x
    elements: 4
    section: {shape: rectangle, width: b, thickness: h}
ground: {foot: clamped}
"""


def test_mass_and_frequency_of_a_leaf_spring_guide() -> None:
    """A leaf is rho L w t heavy; a guide's stiffness goes as w t^3/L^3."""
    found = fx.sensitivity(fx.load(GUIDE), ask="mass, stiffness(carriage.x)")
    of = dict(zip(found.parameters, found.relative.T, strict=True))
    leaves = 2 * 7850 * 60e-3 * 20e-3 * 0.5e-3
    assert of["thickness"][0] == pytest.approx(leaves / found.value[0], rel=1e-9)
    assert of["length"][0] == pytest.approx(leaves / found.value[0], rel=1e-9)
    assert of["width"][0] == pytest.approx(1.0, rel=1e-9)
    np.testing.assert_allclose([of["thickness"][1], of["length"][1]], [3, -3], rtol=0.02)
    assert found.is_exact.all()
    assert found.ranked("mass") == ["width", "distance", "length", "thickness"]


def test_frequencies_that_coincide_part() -> None:
    """A square bar bends in both directions at one frequency; to first order f goes as its size across the axis that it
    bends about, so that a per cent of one side moves one of the two by a per cent and leaves the other."""
    found = fx.sensitivity(fx.loads(BAR), ask="f1, f2, mass", free=["b", "length"])
    assert found.repeated == ((0, 1),)
    b = found.parameters.index("b")
    scale = found.nominal[b] / found.value[0]
    for row in (0, 1):
        assert found.lowest[row, b] * scale == pytest.approx(0.0, abs=1e-3)
        assert found.highest[row, b] * scale == pytest.approx(1.0, abs=1e-3)
        assert found.relative[row] == pytest.approx([0.5, -2.0], abs=2e-3)
    assert any("coincide" in note for note in found.notes)
    np.testing.assert_array_equal(found.lowest[2], found.highest[2])


def test_what_is_zero_has_slopes_and_no_per_cent_and_what_follows_is_left_out() -> None:
    found = fx.sensitivity(fx.loads(BAR), ask="mass")
    assert found.parameters == ("b", "h", "length", "offset")
    assert np.isnan(found.relative[0, 3])
    assert found.slope[0, 3] == pytest.approx(0.0, abs=1e-15)
    assert any(note.startswith("offset is zero") for note in found.notes)
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False)) == found.to_dict()
    assert len(found.to_columns()["slope [SI]"]) == 4


def test_slopes_that_are_differences_say_so() -> None:
    """All do that are, and no others; the stiffness of a guide across its motion goes as the width of its leaves."""
    ask = "mass, stiffness(carriage.x) at carriage.x = 1 mm, reach(carriage.x)"
    found = fx.sensitivity(fx.load(GUIDE), ask=ask, free=["width"])
    said = " ".join(note for note in found.notes if "differences" in note)
    assert found.is_exact[0]
    for text, is_exact in zip(found.quantities, found.is_exact, strict=True):
        assert (text in said) is not bool(is_exact)
    assert found.relative[1, 0] == pytest.approx(1.0, abs=0.05)


def test_what_has_no_answer_is_a_warning() -> None:
    found = fx.sensitivity(fx.load(GUIDE), ask="f1, stress(leaf1) at carriage.x = 300 mm", free=["length"])
    (warning,) = found.warnings
    assert (warning.kind, warning.place) == ("study", found.quantities[1])
    assert "no equilibrium" in warning.text and np.isnan(found.value[1]) and np.isfinite(found.slope[0]).all()
    with pytest.raises(fx.LimitError):
        found.raise_warnings()


def test_the_mass_of_tapered_elements_has_slopes() -> None:
    """A bar with fillets is as heavy as it is wide, and gains rho w L with its thickness."""
    section = "section: {shape: rectangle, width: b, thickness: h}"
    notch = "profile: {type: notch, width: b, contour: {shape: corner_filleted, fillet_radius: 1 mm, web: h}}"
    text = BAR.replace("links:", "flexures:").replace(section, f"{notch}\n    integration: tapered")
    found = fx.sensitivity(fx.loads(text), ask="mass", free=["b", "h"])
    assert found.is_exact.all()
    assert found.relative[0, 0] == pytest.approx(1.0, rel=1e-9)
    assert found.slope[0, 1] == pytest.approx(7850 * 10e-3 * 1.0, rel=1e-9)


def test_names_that_are_unknown_or_follow_are_refused() -> None:
    model = fx.loads(BAR)
    with pytest.raises(fx.OptionError, match="double follows"):
        fx.sensitivity(model, ask="mass", free=["double"])
    with pytest.raises(fx.OptionError, match="not a parameter"):
        fx.sensitivity(model, ask="mass", free=["c"])
    with pytest.raises(fx.OptionError, match="known"):
        fx.sensitivity(model, ask="weight")


def test_the_command(tmp_path) -> None:
    path = tmp_path / "bar.yaml"
    path.write_text(BAR, encoding="utf-8")
    out = tmp_path / "slopes.csv"
    done = flexura("sensitivity", path, "--ask", "f1, f2, mass", "--out", out)
    assert done.returncode == 0, done.stderr
    row = next(line for line in done.stdout.splitlines() if line.startswith("b "))
    assert "0 to +1 %" in row or "to +1 %" in row
    assert "kg per m" in next(line for line in done.stdout.splitlines() if line.startswith("offset"))
    assert len(out.read_text(encoding="utf-8").splitlines()) == 1 + 3 * 4
    data = json.loads(flexura("sensitivity", path, "--ask", "mass", "--free", "b", "--json").stdout)
    assert data["parameters"] == ["b"]
    assert data["relative"][0][0] == pytest.approx(1.0)


def test_parameters_have_derived_units(tmp_path) -> None:
    text = GUIDE.read_text(encoding="utf-8").replace("parameters:", "parameters:\n  push: 0 N\n  young: 200 GPa")
    (tmp_path / "guide.yaml").write_text(text, encoding="utf-8")
    done = flexura("sensitivity", tmp_path / "guide.yaml", "--ask", "f1")
    assert "200 GPa" in done.stdout and "Hz per N" in done.stdout, done.stderr
    done = flexura("sweep", tmp_path / "guide.yaml", "--vary", "push=0N:2N:2", "--ask", "f1, young", "--json")
    assert list(json.loads(done.stdout)["table"])[1:3] == ["push [N]", "f1 [Hz]"]
    assert "young [Pa]" in json.loads(done.stdout)["table"]


def test_what_a_part_is_made_for_does_not_vary() -> None:
    """Sizes of imported and solid parts change nothing in these: a slope by them would be that of another mechanism."""
    model = fx.load(GUIDE.parents[1] / "imported" / "guide.yaml")
    found = fx.sensitivity(model, ask="f1, mass")
    assert found.parameters == ("width", "distance")
    assert any(note.startswith("length left out: held") for note in found.notes)
    assert fx.models.mode_sensitivities(model, n=1).free == ("width", "distance")
    for refused in (
        lambda: fx.sensitivity(model, ask="f1", free=["length"]),
        lambda: fx.sweep(model, vary={"length": [0.06]}, ask="f1"),
        lambda: fx.optimize(model, vary=["length"], minimise="mass"),
        lambda: fx.tolerance(model, vary={"length": "± 0.1 mm"}, ask="f1"),
    ):
        with pytest.raises(fx.OptionError, match="length is held"):
            refused()


def test_a_design_that_cannot_be_is_refused() -> None:
    guide = fx.load(GUIDE)
    for study in (
        lambda: fx.sensitivity(guide, {"width": 0.0}, ask="f1"),
        lambda: fx.tolerance(guide, {"width": 0.0}, vary={"thickness": "± 0.01 mm"}, ask="f1"),
    ):
        with pytest.raises(fx.ModelError, match="a length must be positive"):
            study()


def test_stress_inside_superelements_is_said_to_be_unknown() -> None:
    model = fx.load(GUIDE.parents[1] / "imported" / "guide.yaml")
    asked, said = (
        "stress at carriage.x = 1 mm",
        "not of leaf1.part, leaf2.part, superelements, of whose stress nothing is",
    )
    vary = {"width": (10e-3, 20e-3)}
    notes = [
        fx.sweep(model, vary={"width": [10e-3]}, ask=asked).notes,
        fx.sensitivity(model, ask=asked, free=["width"]).notes,
        fx.tolerance(model, vary={"width": "± 1 mm"}, ask=asked, samples=32, workers=1).notes,
        fx.optimize(model, vary=vary, minimise="mass", subject_to="stress <= 1 MPa at x = 1 mm", starts=1).notes,
    ]
    assert all(any(said in note for note in own) for own in notes)
    assert fx.questions(model, "stress(stylus) at x = 1 mm, f1").notes == ()
    assert fx.questions(fx.load(GUIDE), asked).notes == ()
