"""Damping of a mechanism as a whole: ratios of modes, Rayleigh's coefficients, what replaces what."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from helpers.oscillators import DOFS, body, dashes, natural, oscillator, pair, stiffness
from helpers.over import over

HZ = sorted(natural(d) / (2 * np.pi) for d in DOFS)
"""Six frequencies from 16 to 60 Hz."""


def ratios(damping, described=None, **parameters):
    """Damping ratios of the modes of the oscillator."""
    return fx.system(described or oscillator(), damping=damping, parameters=parameters).modal().total_ratios


def test_one_ratio_bands_and_lists():
    """Above the last band the common ratio holds, and ratios of the lowest modes go before bands."""
    middle, high = (HZ[1] + HZ[2]) / 2, HZ[4]
    bands = [{"up_to": middle, "ratio": 0.01}, {"up_to": high, "ratio": 0.02}]
    assert ratios(0.03) == pytest.approx([0.03] * 6)
    assert ratios({"ratio": 0.05, "bands": bands}) == pytest.approx([0.01, 0.01, 0.02, 0.02, 0.02, 0.05], rel=1e-9)
    assert ratios({"bands": bands}) == pytest.approx([0.01, 0.01, 0.02, 0.02, 0.02, 0.0], rel=1e-9)
    assert ratios({"bands": bands, "ratios": [0.5, 0.0, 0.3]}) == pytest.approx([0.5, 0, 0.3, 0.02, 0.02, 0], rel=1e-9)
    assert ratios({"ratios": [0.1] * 9}) == pytest.approx([0.1] * 6)


def test_rayleigh_meets_both_ratios():
    """zeta(f) = zeta1 f1/f ... as the two-point formula says; equal ratios give 2 zeta w1 w2/(w1 + w2)."""
    own = {"rayleigh": {"frequencies": (HZ[0], HZ[5]), "ratios": (0.02, 0.03)}}
    found = ratios(own)
    assert found[[0, 5]] == pytest.approx([0.02, 0.03], rel=1e-10)
    law = fx.system(oscillator(), damping={"rayleigh": {"frequencies": (20.0, 80.0), "ratios": (0.03, 0.03)}}).law
    one, two = 2 * np.pi * 20, 2 * np.pi * 80
    assert law.alpha == pytest.approx(2 * 0.03 * one * two / (one + two), rel=1e-12)
    assert law.beta == pytest.approx(2 * 0.03 / (one + two), rel=1e-12)


def test_everything_acts_together():
    """Modal ratio, Rayleigh, half the loss factor and dashpots add up mode by mode."""
    c = 1.5
    described = oscillator((c,) * 3 + (0,) * 3)
    all_ = {"ratio": 0.01, "loss_factor": 0.02, "rayleigh": {"frequencies": (10.0, 100.0), "ratios": (0.02, 0.02)}}
    law = fx.system(described, damping=all_).law
    found = {}
    for dof in ("tx", "ty", "tz"):
        w = natural(dof)
        found[w] = 0.01 + 0.01 + (law.alpha / w + law.beta * w) / 2 + c / (2 * 0.4 * w)
    modes = fx.system(described, damping=all_).modal()
    for w, zeta in found.items():
        k = np.abs(modes.omega - w).argmin()
        assert modes.total_ratios[k] == pytest.approx(zeta, rel=1e-9)
        assert modes.loss_factors[k] == pytest.approx(0.02, rel=1e-9)


@pytest.mark.parametrize("rayleigh", [(0.01, 0.2), (0.2, 0.01)])
def test_negative_rayleigh_is_refused(rayleigh):
    """Ratios so far apart need negative mass or stiffness damping."""
    with pytest.raises(fx.OptionError, match="negative"):
        ratios({"rayleigh": {"frequencies": (10.0, 15.0), "ratios": rayleigh}})


def test_arguments_replace_the_description():
    """All of it: a ratio, keys, or a Damping; None leaves it, and zero takes it away. Dashpots stay."""
    described = oscillator((1.0, 0, 0, 0, 0, 0), damping={"ratio": 0.05, "loss_factor": 0.1})
    plain = fx.system(described).modal()
    c = 1.0 / (2 * 0.4 * natural("tx"))
    x = np.abs(plain.omega - natural("tx")).argmin()
    assert plain.total_ratios[x] == pytest.approx(0.1 + c, rel=1e-9)
    for given, zeta in (
        (0.02, 0.02),
        ({"loss_factor": 0.3}, 0.15),
        (fx.describe.Damping(ratio=0.07), 0.07),
        (0, 0),
        ({}, 0),
    ):
        assert ratios(given, described)[x] == pytest.approx(zeta + c, rel=1e-9)


def test_expressions_over_parameters():
    """Damping, dashpots and what replaces them take parameters of the mechanism."""
    zeta, c = fx.describe.parameter("zeta"), fx.describe.parameter("c")
    more = {"parameters": {"zeta": fx.describe.Parameter(value=0.02), "c": fx.describe.Parameter(value=1.0)}}
    bands = [{"up_to": 1e-3, "ratio": 0.9}]
    described = oscillator((2 * c, 0, 0, 0, 0, 0), damping={"ratio": zeta, "bands": bands}, **more)
    x = np.abs(np.array(HZ) - natural("tx") / (2 * np.pi)).argmin()
    for parameters, z, damping in (({}, 0.02, 2.0), ({"zeta": 0.04, "c": 3.0}, 0.04, 6.0)):
        found = ratios(None, described, **parameters)
        assert found[x] == pytest.approx(z + damping / (2 * 0.4 * natural("tx")), rel=1e-9)
    assert ratios("3*zeta", described, zeta=0.01)[5] == pytest.approx(0.03)
    for damping, value in (
        (None, 1.5),
        (None, -0.1),
        ("3*zeta", 0.4),
        ({"bands": [{"up_to": 9, "ratio": 2 * zeta}]}, 0.5),
    ):
        with pytest.raises(fx.ModelError if damping is None else fx.OptionError, match="damping"):
            ratios(damping, described, zeta=value)
    falling = {"bands": [{"up_to": 100 * zeta, "ratio": 0.1}, {"up_to": 10.0, "ratio": 0.1}]}
    assert ratios(falling, described, zeta=0.05)[5] == 0
    with pytest.raises(fx.OptionError, match="in order"):
        ratios(falling, described, zeta=0.2)


def test_loss_factors_of_parts():
    """The loss factor of everything also holds for springs and stacks; none for dashpots."""
    bodies = {"one": body(), "two": body((0.05, 0, 0))}
    springs = {"a": fx.describe.Spring(nodes=("one",), stiffness=stiffness())}
    stack = {
        "s": fx.describe.PiezoStack(nodes=("one", "two"), stiffness=4e3, section=fx.describe.Circle(diameter=0.01))
    }
    described = fx.Mechanism(bodies=bodies, springs=springs, actuators=stack, damping={"loss_factor": 0.04})
    modes = fx.system(described, inputs="two.tx").modal()
    assert modes.loss_factors == pytest.approx(np.full(12, 0.04), rel=1e-9)
    assert modes.is_proportional


def test_equivalent_viscous_damping():
    """The same loss per cycle at each resonance: 2 zeta w = eta w."""
    modes = fx.system(oscillator(damping={"loss_factor": 0.06})).modal()
    assert modes.viscous().ratios == pytest.approx(np.full(6, 0.03), rel=1e-12) and modes.viscous().loss is None
    plain = fx.system(oscillator(damping=0.02)).modal()
    assert plain.viscous() is plain


def test_dashpots_turned_and_off_their_nodes():
    """A dashpot acts at a place, in axes of its own: C = D' R c R' D."""
    turn, at, c = fx.describe.Rotation(axis=(0, 0, 1), angle=np.pi / 2), (0.0, 0.1, 0.0), (2.0, 3.0, 5.0, 0.1, 0.2, 0.3)
    damper = fx.describe.Dashpot(nodes=("mass",), damping=dashes(c), at=at, rotate=turn)
    built = fx.system(oscillator(dashpots={"d": damper}), order="full")
    own = np.diag([3.0, 2.0, 5.0, 0.2, 0.1, 0.3])
    arm = np.eye(6)
    arm[:3, 3:] = [[0, 0, -0.1], [0, 0, 0], [0.1, 0, 0]]
    assert built.C.toarray() == pytest.approx(arm.T @ own @ arm, abs=1e-14)
    two = fx.system(pair(3.0, 0.0), order="full").C.toarray()
    assert two.sum() == pytest.approx(3.0)


@over(
    "damping",
    [
        1.0, 1.5, -0.01, np.nan, np.inf, "much", True, {"ratio": 1.0}, {"ratios": [0.1, 1.0]}, {"ratios": 0.1},
        {"loss_factor": -0.1}, {"bands": [{"up_to": 10.0}]}, {"bands": [{"up_to": 0.0, "ratio": 0.1}]},
        {"bands": [{"up_to": 20.0, "ratio": 0.1}, {"up_to": 10.0, "ratio": 0.1}]},
        {"rayleigh": {"frequencies": (20.0, 10.0), "ratios": (0.1, 0.1)}},
        {"rayleigh": {"frequencies": (20.0, 20.0), "ratios": (0.1, 0.1)}},
        {"rayleigh": {"frequencies": (20.0,), "ratios": (0.1, 0.1)}}, {"rayleigh": 0.1}, {"zeta": 0.1},
        [0.1], "zeta",
    ])  # fmt: skip
def test_impossible_damping(damping):
    """Ratios lie from zero to one, one excluded; limits rise; keys are known."""
    with pytest.raises(fx.OptionError) as caught:
        ratios(damping)
    assert str(caught.value).startswith("damping") or "zeta" in str(caught.value)
