"""Derivatives of frequencies alone: those of sensitivities, and matrices of repeated ones along any direction."""

import numpy as np
import pytest

import flexura as fx
from flexura.derivatives import frequency_slopes
from flexura.structure import Design
from helpers import samples


def test_slopes_are_those_of_sensitivities():
    plan = fx.Plan(samples.beam())
    names = ["thickness", "length", "tip_mass"]
    whole, light = (
        fx.models.mode_sensitivities(plan, free=names, n=4),
        frequency_slopes(Design.with_slopes(plan, {}, names), 4),
    )
    np.testing.assert_allclose(light.frequency_hz[:4], whole.frequency_hz, rtol=1e-12)
    np.testing.assert_allclose(light.slope[:4], whole.derivative, rtol=1e-9)
    assert light.repeated == () and light.kinks == ()


def test_a_repeated_frequency_parts_along_any_direction():
    """A square beam: f is across the thickness as the thickness, across the width as the width."""
    mechanism = samples.beam(thickness=2e-3, width=2e-3, tip_mass=1e-3).model_copy(update={"masses": {}})
    found = frequency_slopes(Design.with_slopes(fx.Plan(mechanism), {}, ["thickness", "width"]), 1)
    f = found.frequency_hz[0]
    assert found.repeated == ((0, 1),) and len(found.frequency_hz) == 2
    (space,) = found.directional
    for step in ((1.0, 0.0), (0.3, -2.0), (1.0, 1.0)):
        along = np.linalg.eigvalsh(space @ step)
        assert along == pytest.approx(sorted(f / 2e-3 * np.array(step)), abs=1e-6 * f / 2e-3)


def test_no_number_of_frequencies_below_one():
    with pytest.raises(fx.OptionError, match="at least 1"):
        frequency_slopes(Design.with_slopes(fx.Plan(samples.beam()), {}, ["width"]), 0)


def test_loads_that_are_described_count():
    """Gravity across the leaves of a guide, which stiffens some and weakens others, against differences."""
    mechanism = fx.load("examples/guide/guide.yaml").replaced({"gravity": (1.0, -2.0, -500.0)})
    plan, names = fx.Plan(mechanism), ["length", "thickness", "distance"]
    found = frequency_slopes(Design.with_slopes(plan, {}, names), 4)
    assert (
        abs(
            found.slope
            - frequency_slopes(Design.with_slopes(fx.Plan(fx.load("examples/guide/guide.yaml")), {}, names), 4).slope
        ).max()
        > 1
    )
    for p, name in enumerate(names):
        value, table = float(plan.parameter_values()[name]), []
        for step in (1e-3 * value, 5e-4 * value):
            up, down = (
                frequency_slopes(Design.with_slopes(plan, {name: value + s * step}, [name]), 4).frequency_hz
                for s in (1, -1)
            )
            table.append((up - down) / (2 * step))
        expected = (4 * table[1] - table[0]) / 3
        assert abs(found.slope[:, p] - expected).max() < 1e-7 * found.frequency_hz.max() / value


def test_a_kink_is_said():
    """A notch whose depth is that of a limit: max() of equal parameters has no derivative by either."""
    text = """
    flexura: 1
    parameters: {first: 4 N/m, second: 4 N/m, heavy: 1 kg}
    bodies: {stage: {centre: [0, 0, 0], mass: heavy, inertia: [1 kg*m^2, 1 kg*m^2, 1 kg*m^2]}}
    springs: {k: {nodes: [stage], stiffness: {tx: "max(first, second)", ty: 9 N/m, tz: 16 N/m, rx: 100 N*m/rad,
      ry: 100 N*m/rad, rz: 100 N*m/rad}}}
    """
    mechanism = fx.loads(text)
    found = frequency_slopes(Design.with_slopes(fx.Plan(mechanism), {}, ["first", "heavy"]), 1)
    assert found.kinks == (0,) and np.isnan(found.slope[:, 0]).all()
    assert found.slope[0, 1] == pytest.approx(-found.frequency_hz[0] / 2)
    told = fx.models.mode_sensitivities(mechanism, free=["first", "heavy"], n=1)
    assert "first: the design is at a kink" in told.notes[0] and np.isnan(told.derivative[0, 0])
