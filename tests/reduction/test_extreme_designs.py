"""Designs of nearly no mass, nearly no stiffness and members of all sizes: no interval without its frequency, against
inertia counts with 80 digits."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import flexura as fx
from flexura.reduction.batch_bounds import enclosed
from helpers.exact_model import ExactModel

INERTIA = 10.0 ** -np.array([6, 10, 14, 16, 18, 20, 22, 26, 30, 30])
DENSITY = 10.0 ** -np.array([0, 20, 5, 10, 15, 18, 30, 10, 25, 30])

DEFAULTS = {
    "inertia": 1e-4,
    "mass": 0.2,
    "density": 7800.0,
    "modulus": 200e9,
    "low": 1e-3,
    "high": 1e-3,
    "knee": 1e-12,
    "push": 1e-12,
    "turn": 1e-12,
}
DECADES = {
    "inertia": (-30, 3),
    "mass": (-30, 10),
    "density": (-30, 10),
    "modulus": (-3, 14),
    "low": (-7, -2),
    "high": (-7, -2),
    "knee": (-30, 10),
    "push": (-20, 15),
    "turn": (-20, 15),
}


def table(knees: bool, **defaults: float) -> fx.Mechanism:
    """A platform of 0.2 kg on three slender legs, whose frequencies 23, 23 and 1060 Hz hardly hang on its inertia and
    their density; with knees each leg is two wires, which may be unequal and carry something between them."""
    own = fx.describe.parameter
    nodes = {"foot": (0.03, 0, 0), "knee": (0.025, 0, 0.025), "head": (0.02, 0, 0.05)}
    ends = {"low": ("foot", "knee"), "high": ("knee", "head")} if knees else {"low": ("foot", "head")}
    carried = "knee" in defaults
    leg = fx.describe.Substructure(
        nodes={name: at for name, at in nodes.items() if knees or name != "knee"},
        links={
            name: fx.describe.Link(
                nodes=both, material="wire", section=fx.describe.Circle(diameter=own(name)), elements=3, root="rigid"
            )
            for name, both in ends.items()
        },
        masses={"knee": fx.describe.PointMass(node="knee", mass=own("knee"))} if carried else {},
        interface=("foot", "head"),
    )
    stiffness = {"tx": own("push"), "ty": own("push"), "tz": own("turn"), "rx": own("push"), "ry": own("turn")}
    held = "push" in defaults
    top = fx.describe.RigidBody(
        centre=(0, 0, 0.05), mass=own("mass"), inertia=(own("inertia"),) * 3, carries=("leg*.head",)
    )
    unused = {name for name, used in (("high", knees), ("knee", carried), ("push", held), ("turn", held)) if not used}
    return fx.Mechanism(
        parameters={
            name: fx.describe.Parameter(value=value)
            for name, value in (DEFAULTS | defaults).items()
            if name not in unused
        },
        materials={"wire": fx.describe.Material(E=own("modulus"), nu=0.3, rho=own("density"))},
        substructures={"leg": leg},
        instances={"leg": fx.describe.Instance(of="leg", pattern=fx.describe.CircularPattern(count=3))},
        bodies={"top": top},
        springs={"mount": fx.describe.Spring(nodes=("top",), stiffness=stiffness)} if held else {},
        ground={"leg*.foot": "clamped"},
    )


def contradicted(plan: fx.Plan, found: fx.NaturalFrequencies, designs: Mapping[str, np.ndarray]) -> list[str]:
    """What intervals say that counts contradict."""
    wrong = []
    for d in range(len(found.lower_hz)):
        one = {name: float(own[d]) for name, own in designs.items()}
        exact = ExactModel(fx.assemble(plan, one))
        for k, (low, up) in enumerate(zip(found.lower_hz[d], found.upper_hz[d], strict=True)):
            if not low <= up:
                wrong.append(f"{one}: {low} to {up}")
            if low > 0 and exact.count_below(low) > k:
                wrong.append(f"{one}: frequency {k + 1} lies below {low}")
            if np.isfinite(up) and exact.count_below(up) < k + 1:
                wrong.append(f"{one}: frequency {k + 1} lies above {up}")
    return wrong


@pytest.mark.parametrize("count", [1, 2, 3, 6])
@pytest.mark.parametrize("knees", [False, True])
def test_intervals_hold_whatever_has_nearly_no_mass(knees, count):
    """The two lowest frequencies, of the heavy platform, are proven in all designs; those 12 decades and more above the
    lowest ones may not be, as round-off in stiffness and mass hides some."""
    plan = fx.Plan(table(knees))
    designs = {"inertia": np.append(1e-4, INERTIA), "density": np.append(7800.0, DENSITY)}
    found = fx.natural_frequencies(plan, designs, n=count)
    assert not contradicted(plan, found, designs)
    assert (found.frequency_hz > 0).all()  # nothing moves freely
    assert found.is_proven[:3].all() or count == 6
    if count <= 2:
        assert len(found.missed) == 0
        np.testing.assert_allclose(found.frequency_hz[1:], 23.33, rtol=0.07)


@pytest.mark.parametrize("light", [0, 4, 8])
def test_a_default_design_of_nearly_no_mass(light):
    plan = fx.Plan(table(False, inertia=float(INERTIA[light]), density=float(DENSITY[light])))
    designs = {"inertia": INERTIA[[0, light]], "density": DENSITY[[0, light]]}
    found = fx.natural_frequencies(plan, designs, n=3)
    assert not contradicted(plan, found, designs)
    assert (found.frequency_hz > 0).all()


def test_designs_by_themselves_agree():
    """Batches, modes of the full order and rows of a sweep: 23.33, 23.33 and 1060.9 Hz, each within its interval."""
    plan = fx.Plan(table(False))
    light = {"inertia": 1e-30, "density": 1e-25}
    designs = {name: np.array([own]) for name, own in light.items()}
    many = fx.natural_frequencies(plan, designs, n=3).resolved()
    alone = fx.modes(plan, light, n=3, order="full")
    assert len(many.missed) == 0 and not contradicted(plan, many, designs)
    exact = ExactModel(fx.assemble(plan, light))
    for k, mode in enumerate(alone.modes):
        lower, upper = mode.interval_hz
        assert mode.is_indexed and exact.count_below(lower) <= k < exact.count_below(upper)
        assert lower <= many.upper_hz[0, k] and many.lower_hz[0, k] <= upper
    rows = fx.sweep(plan, {"density": 1e-25}, vary={"inertia": [1e-4, 1e-30]}, ask="f1, f2, f3").to_frame()
    np.testing.assert_allclose([rows[f"f{k} [Hz]"].iloc[1] for k in (1, 2, 3)], [23.33, 23.33, 1060.9], rtol=1e-4)


@pytest.mark.parametrize(("low", "high"), [(2e-6, 1e-3), (1e-3, 2e-6), (1e-5, 1e-2)])
def test_wires_that_are_hundreds_of_times_as_thick_as_the_next(low, high):
    """Kept motions of the thick wires would strain them by what round-off leaves in those of the thin ones."""
    plan = fx.Plan(table(True))
    designs = {"low": np.array([low]), "high": np.array([high]), "modulus": np.array([5.5e5])}
    assert not contradicted(plan, fx.natural_frequencies(plan, designs, n=6), designs)


@pytest.mark.parametrize("seed", range(8))
def test_intervals_hold_over_thirty_decades(seed):
    rng = np.random.default_rng(seed)
    carried, held = ({"knee": 1e-3} if seed % 2 else {}), ({"push": 1e3, "turn": 10.0} if seed % 4 > 1 else {})
    plan = fx.Plan(table(True, **carried, **held))
    names = [name for name in plan.mechanism.parameters if rng.random() < 0.7]
    designs = {name: 10.0 ** rng.uniform(*DECADES[name], 4) for name in names}
    found = fx.natural_frequencies(plan, designs, n=int(rng.choice([1, 2, 3, 6])))
    assert not contradicted(plan, found, designs)


def test_a_soft_suspension_is_no_zero():
    """Frequencies that round-off hides are zeros only where they are far below all others."""
    designs = {"modulus": np.array([0.0134]), "low": np.array([5e-7]), "mass": np.array([4.8e-6])}
    designs |= {"push": np.array([0.033]), "turn": np.array([2e6])}
    plan = fx.Plan(table(False, push=1e3, turn=10.0))
    found = fx.natural_frequencies(plan, designs, n=3)
    assert not contradicted(plan, found, designs)
    zero = np.atleast_2d(found.frequency_hz) == 0
    assert (found.upper_hz[zero] < 1e-3 * found.frequency_hz[~zero].min()).all()


def test_bounds_that_contradict_each_other_are_dropped():
    none = np.zeros((2, 2), dtype=bool)
    lower, upper = np.array([[1.0, 3.0], [1.0, 3.0]]), np.array([[1.1, 3.1], [1.1, 2.9]])
    found = enclosed(lower, upper, np.array([[1.05, 3.2], [1.0, 3.0]]), none, np.zeros(2))
    assert found.lower.tolist() == [[1.0, 3.0], [0.0, 0.0]]
    assert found.upper.tolist() == [[1.1, 3.1], [np.inf, np.inf]]
    assert found.best.tolist() == [[1.05, 3.1], [np.inf, np.inf]]
