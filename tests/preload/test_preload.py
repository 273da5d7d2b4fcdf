"""Preloaded states against closed forms: columns, tensioned beams, guides, arms."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv
from typer.testing import CliRunner

import flexura as fx
from flexura.cli.app import app

STEEL = fx.describe.Material(E=200e9, nu=0.3, rho=7800.0)
B, T, L = 0.01, 0.004, 0.2
EI = 200e9 * B * T**3 / 12
PINNED = {"a": fx.describe.Support(fixed=("tx", "ty", "tz", "rx")), "b": fx.describe.Support(fixed=("ty", "tz"))}
GREENHILL = brentq(lambda x: jv(-1 / 3, x), 1.5, 2.2)
"""First zero of the Bessel function of order -1/3 (Greenhill 1881)."""
PUSH = (-1.0, 0, 0, 0, 0, 0)


def column(ground, elements=8, theory="euler_bernoulli", length=L, **more):
    """A straight bar from a to b along x."""
    link = fx.describe.Link(
        nodes=("a", "b"),
        material="steel",
        section=fx.describe.Rectangle(width=B, thickness=T),
        reference=(0, 0, 1),
        elements=elements,
    )
    nodes = {"a": (0, 0, 0), "b": (length, 0, 0)}
    data = {"materials": {"steel": STEEL}, "nodes": nodes, "links": {"bar": link}, "ground": ground}
    return fx.Mechanism(theory=theory, corrections="none", **(data | more))


def clamped(*free):
    """Ground for a clamped at a, with some freedoms at b."""
    return {"a": "clamped", **({"b": fx.describe.Support(free=free)} if free else {})}


@pytest.mark.parametrize(
    ("ground", "k"),
    [
        (clamped(), 2.0),
        (PINNED, 1.0),
        (clamped("tx", "ty", "tz"), 1.0),
        (clamped("tx"), 0.5),
        (clamped("tx", "ry", "rz"), np.pi / brentq(lambda x: np.tan(x) - x, 4.4, 4.6)),
    ],
    ids=["free", "pinned", "guided", "clamped", "propped"],
)
def test_euler_columns(ground, k):
    exact = (np.pi / (k * L)) ** 2 * EI
    errors = [fx.preload(column(ground, n), loads={"b": PUSH}).buckling_factor / exact - 1 for n in (8, 16)]
    assert 0 < errors[1] < 1e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.15)


def test_column_with_shear_buckles_at_engesser_s_load():
    length, n = 0.02, 64
    state = fx.preload(column(clamped(), n, "timoshenko", length), loads={"b": PUSH})
    k = 10 * 1.3 / (12 + 11 * 0.3)
    euler = (np.pi / (2 * length)) ** 2 * EI
    exact = euler / (1 + euler / (k * 200e9 / 2.6 * B * T))
    assert euler / exact > 1.02
    assert state.buckling_factor == pytest.approx(exact, rel=2e-4)


def test_column_under_its_own_weight():
    exact = 9 / 4 * GREENHILL**2 * EI / (7800 * B * T * 9.81 * 1.0**3)
    coarse, fine = (
        fx.preload(column(clamped(), n, length=1.0), gravity=(-9.81, 0, 0)).buckling_factor for n in (8, 16)
    )
    assert fine == pytest.approx(exact, rel=1e-6)
    assert abs(coarse / exact - 1) / abs(fine / exact - 1) == pytest.approx(16, abs=0.5)


@pytest.mark.parametrize("force", [5e3, -100.0])
def test_pinned_beam_under_axial_force(force):
    state = fx.preload(column(PINNED, 16), loads={"b": (force, 0, 0, 0, 0, 0)})
    k, m = np.pi / L, 7800 * B * T
    exact = np.sqrt((EI * k**4 + force * k**2) / m) / (2 * np.pi)
    assert state.natural_frequencies(1).frequency_hz[0] == pytest.approx(exact, rel=2e-5)
    assert state.axial_force["bar"] == pytest.approx((force, force))


def test_guided_column_loses_its_lateral_stiffness():
    push = 0.6 * (np.pi / L) ** 2 * EI
    loads = {"b": (-push, 0, 1e-3, 0, 0, 0)}
    state = fx.preload(column(clamped("tx", "ty", "tz"), 16), loads=loads)
    k = np.sqrt(push / EI)
    exact = push * k / (2 * np.tan(k * L / 2) - k * L)
    assert 1e-3 / state.displacement("b", 1.0)[2] == pytest.approx(exact, rel=1e-4)
    assert 1e-3 / state.displacement("b")[2] == pytest.approx(12 * EI / L**3, rel=1e-6)


@pytest.mark.parametrize("arm", [0.03, 0.1])
def test_load_on_a_rigid_arm_beyond_the_tip(arm):
    body = fx.describe.RigidBody(
        centre=(L + arm / 3, 0, 0), carries=("b", "end"), mass=1e-6, inertia=(1e-9, 1e-9, 1e-9)
    )
    nodes = {"a": (0, 0, 0), "b": (L, 0, 0), "end": (L + arm, 0, 0)}
    state = fx.preload(column(clamped(), 16, nodes=nodes, bodies={"head": body}), loads={"end": PUSH})
    k = brentq(lambda x: x * arm * np.tan(x * L) - 1, 1e-6, 0.999 * np.pi / (2 * L))
    assert state.buckling_factor == pytest.approx(k**2 * EI, rel=1e-5)


@pytest.mark.parametrize("arm", [0.02, 0.08])
def test_weight_of_a_body_counts_where_its_centre_is(arm):
    mass, g = 2.0, 9.81
    body = fx.describe.RigidBody(centre=(L + arm, 0, 0), carries=("b",), mass=mass, inertia=(1e-4, 1e-4, 1e-4))
    light = fx.describe.Material(E=200e9, nu=0.3, rho=1e-6)
    tower = column(clamped(), 16, bodies={"head": body}, materials={"steel": light})
    k = brentq(lambda x: x * arm * np.tan(x * L) - 1, 1e-6, 0.999 * np.pi / (2 * L))
    standing, hanging = (fx.preload(tower, gravity=(s * g, 0, 0)) for s in (-1, 1))
    assert standing.buckling_factor == pytest.approx(k**2 * EI / (mass * g), rel=1e-5)
    assert not len(hanging.buckling_factors(1)) or hanging.buckling_factor > 100 * standing.buckling_factor
    states = (hanging, 1), (hanging, 0), (standing, 1)
    first = [own.natural_frequencies(1, factor).frequency_hz[0] for own, factor in states]
    assert first[0] > first[1] > first[2]


def test_a_point_mass_beside_its_node_is_the_same_body():
    arm = 0.05
    point = fx.describe.PointMass(node="b", mass=2.0, offset=(arm, 0, 0), inertia=(1e-4, 1e-4, 1e-4))
    body = fx.describe.RigidBody(centre=(L + arm, 0, 0), carries=("b",), mass=2.0, inertia=(1e-4, 1e-4, 1e-4))
    states = [
        fx.preload(column(clamped(), 8, **part), gravity=(-9.81, 0, 3.0))
        for part in ({"masses": {"m": point}}, {"bodies": {"m": body}})
    ]
    np.testing.assert_allclose(*(s.natural_frequencies(4).frequency_hz for s in states), rtol=1e-7)
    np.testing.assert_allclose(*(s.buckling_factors(1) for s in states), rtol=1e-7)


def test_loads_scale_and_factors_with_them():
    one, three = (fx.preload(column(PINNED), loads={"b": (-f, 0, 0, 0, 0, 0)}) for f in (1.0, 3.0))
    assert one.buckling_factor == pytest.approx(3 * three.buckling_factor, rel=1e-9)
    np.testing.assert_allclose(
        one.natural_frequencies(3, 3.0).frequency_hz, three.natural_frequencies(3).frequency_hz, rtol=1e-9
    )


def test_beyond_buckling_is_refused():
    state = fx.preload(column(PINNED), loads={"b": PUSH})
    with pytest.raises(fx.SolverError, match="buckles at"):
        state.natural_frequencies(1, 2 * state.buckling_factor)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"loads": {"nowhere": PUSH}}, "there is no node"),
        ({"loads": {"b": (1, 2)}}, "6 finite numbers"),
        ({"gravity": (0, 0)}, "3 finite numbers"),
        ({"gravity": (0, 0, float("nan"))}, "3 finite numbers"),
    ],
)
def test_impossible_loads_are_refused(options, words):
    with pytest.raises(fx.OptionError, match=words):
        fx.preload(column(PINNED), **options)


def test_a_loose_mechanism_is_refused():
    with pytest.raises(fx.SolverError, match="move freely"):
        fx.preload(column({}), loads={"b": PUSH})


def test_command_line(tmp_path):
    file = tmp_path / "column.yaml"
    fx.save(column(clamped(), 8), file)
    done = CliRunner().invoke(app, ["buckling", str(file), "--load", "b=-1,0,0 N", "-n", "2", "--json"])
    assert done.exit_code == 0
    data = json.loads(done.stdout)
    assert data["buckling_factors"][0] == pytest.approx((np.pi / (2 * L)) ** 2 * EI, rel=1e-4)
    for state in ("loaded", "unloaded"):
        own = data[state]
        assert np.all(np.diff([own["lower_hz"], own["frequency_hz"], own["upper_hz"]], axis=0) >= 0)
    shown = CliRunner().invoke(app, ["buckling", str(file), "--gravity", "-9.81,0,0 m/s^2", "-n", "1"])
    assert "buckling factors on all loads" in shown.stdout and "least axial force [N]" in shown.stdout


def mac(one, other):
    return (one @ other) ** 2 / ((one @ one) * (other @ other))


@pytest.mark.parametrize(
    ("ground", "exact"),
    [
        (PINNED, lambda x, k: np.sin(k * np.pi * x)),
        (clamped(), lambda x, k: 1 - np.cos((k - 0.5) * np.pi * x)),
        (clamped("tx", "ty", "tz"), lambda x, k: 1 - np.cos(k * np.pi * x)),
    ],
    ids=["pinned", "free", "guided"],
)
@pytest.mark.parametrize("elements", [24, 240], ids=["dense", "sparse"])
def test_shapes_of_euler_columns(ground, exact, elements):
    """In the plane where it is four tenths as wide: the factors of the other are 6.25 times as large."""
    state = fx.preload(column(ground, elements), loads={"b": PUSH})
    shapes, factors = state.buckling_shapes(2), state.buckling_factors(2)
    expected = {"pinned": 4, "free": 6.25, "guided": 4}
    model = state.model
    u = model.node_displacements(shapes)
    x = model.positions[:, 0] / L
    order = np.argsort(x)
    assert np.abs(shapes).max(axis=0) == pytest.approx(1) and shapes.max(axis=0) == pytest.approx(1)
    lateral = u[order][:, 1:3, 0]
    plane = np.abs(lateral).max(axis=0).argmax()
    assert mac(lateral[:, plane], exact(x[order], 1)) > 0.999999
    assert np.abs(lateral[:, 1 - plane]).max() < 1e-6 * np.abs(lateral[:, plane]).max()
    ratio = factors[1] / factors[0]
    assert any(ratio == pytest.approx(own, rel=1e-3) for own in expected.values())
    if ratio < 5:
        assert mac(u[order][:, 1 + plane, 1], exact(x[order], 2)) > 0.999999
    assert np.array_equal(state.buckling_shape, state.buckling_shapes(1)[:, 0])


def test_equal_factors_have_shapes_that_span_both_planes():
    square = fx.describe.Rectangle(width=T, thickness=T)
    links = {"bar": column(clamped(), 16).links["bar"].model_copy(update={"section": square})}
    state = fx.preload(column(clamped(), 16, links=links), loads={"b": PUSH})
    factors, shapes = state.buckling_factors(2), state.buckling_shapes(2)
    assert factors[1] == pytest.approx(factors[0], rel=1e-9)
    tip = state.model.node_displacements(shapes)[state.model.plan.topology.numbers(["b"])[0], 1:3]
    assert abs(np.linalg.det(tip)) > 0.1 * np.abs(tip).max() ** 2


@pytest.mark.parametrize("elements", [4, 48])
def test_loads_without_axial_forces_buckle_nothing(elements):
    """Bending adds nothing to the geometric stiffness, as the theory says, however many unknowns there are."""
    state = fx.preload(column(clamped(), elements), loads={"b": (0, -1.0, 0, 0, 0, 0)})
    assert len(state.buckling_factors(2)) == 0 == state.buckling_shapes(2).shape[1]
    assert state.buckling_shape is None and state.buckling_factor == np.inf
