"""Loads and gravity of the description in every verb, against closed forms."""

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
EI, LINE = 200e9 * B * T**3 / 12, 7800 * B * T
PINNED = {"a": fx.describe.Support(fixed=("tx", "ty", "tz", "rx")), "b": fx.describe.Support(fixed=("ty", "tz"))}
GREENHILL = 9 / 4 * brentq(lambda x: jv(-1 / 3, x), 1.5, 2.2) ** 2 * EI / LINE


def bar(elements=16, length=L, **more):
    link = fx.describe.Link(
        nodes=("a", "b"), material="steel", section=fx.describe.Rectangle(width=B, thickness=T), reference=(0, 0, 1),
        elements=elements, theory="euler_bernoulli",
    )  # fmt: skip
    data = {"nodes": {"a": (0, 0, 0), "b": (length, 0, 0)}, "ground": PINNED}
    return fx.Mechanism(corrections="none", materials={"steel": STEEL}, links={"bar": link}, **(data | more))


def pull(force):
    return {"b": fx.describe.Load(force=(force, 0, 0))}


@pytest.mark.parametrize("force", [5e3, -100.0])
def test_every_order_of_a_pinned_beam_under_axial_force(force):
    k = np.array([1, 2, 3]) * np.pi / L
    exact = np.sqrt((EI * k**4 + force * k**2) / LINE) / (2 * np.pi)
    beam = bar(24, loads=pull(force))
    low = fx.modes(beam, tolerance=1e-6, up_to=1.1 * exact[2])
    assert low.evidence.complete
    assert (low.certificate.error_bound < 1e-6).all()
    for found in (fx.modes(beam, n=8, order="full"), low):
        nearest = [found.frequency_hz[np.argmin(abs(found.frequency_hz - f))] for f in exact]
        assert nearest == pytest.approx(exact, rel=4e-5)


def test_a_taut_wire_is_a_string():
    wire = bar(40, ground={**PINNED}, loads=pull(2e4), length=2.0)
    string = np.sqrt(2e4 / LINE) / (2 * 2.0)
    stiffening = np.sqrt(1 + EI * (np.pi / 2.0) ** 2 / 2e4)
    assert stiffening < 1.001
    assert fx.modes(wire, n=1, order="full").frequency_hz[0] == pytest.approx(string * stiffening, rel=1e-6)


def test_statics_of_a_beam_column():
    """A pinned beam under thrust P and a force Q in its middle: Q (tan u - u) / (4 u^3) L^3 / (4 EI) ... (Timoshenko
    and Gere 1961, eq. 1-7): v = Q L^3/(48 EI) * 3 (tan u - u)/u^3, u = (L/2) sqrt(P/EI)."""
    P, Q = 0.7 * (np.pi / L) ** 2 * EI, 2.0
    half = {"nodes": ("a", "m"), "material": "steel", "section": fx.describe.Rectangle(width=B, thickness=T)}
    links = {
        name: fx.describe.Link(**{**half, "nodes": ends}, reference=(0, 0, 1), elements=8, theory="euler_bernoulli")
        for name, ends in {"one": ("a", "m"), "two": ("m", "b")}.items()
    }
    nodes = {"a": (0, 0, 0), "m": (L / 2, 0, 0), "b": (L, 0, 0)}
    beam = fx.Mechanism(
        corrections="none", materials={"steel": STEEL}, links=links, nodes=nodes, ground=PINNED, loads=pull(-P)
    )
    u = L / 2 * np.sqrt(P / EI)
    exact = L**3 / (48 * EI) * 3 * (np.tan(u) - u) / u**3
    side = (0, 0, Q, 0, 0, 0)
    assert fx.statics(beam, loads={"m": side}).displacement("m")[2] / Q == pytest.approx(exact, rel=2e-5)
    assert fx.compliance(beam, nodes=["m"])[2, 2] == pytest.approx(exact, rel=2e-5)
    low = fx.reduce(beam, static_at=["m"])
    assert low.compliance()[2, 2] == pytest.approx(exact, rel=2e-5)
    modal = fx.reduce(beam, static_at=["m"], tolerance=1e-3, up_to=500.0)
    assert modal.compliance()[2, 2] == pytest.approx(exact, rel=2e-5)
    response = fx.frequency_response(beam, frequency_hz=[1e-3], inputs=["m.tz"], outputs=["m.tz"])
    assert response.response.ravel()[0].real == pytest.approx(exact, rel=2e-5)
    both = beam.model_copy(update={"loads": {**pull(-P), "m": fx.describe.Load(force=(0, 0, Q))}})
    assert fx.statics(both).displacement("m")[2] / Q == pytest.approx(exact, rel=2e-5)
    assert fx.statics(both, loads={"m": side}).displacement("m")[2] / Q == pytest.approx(2 * exact, rel=2e-5)
    moment = fx.statics(both).stresses()["one"].moment
    assert abs(moment[1]) == pytest.approx(Q * L / 4 * np.tan(u) / u, rel=3e-3)


def test_a_load_may_go_through_zero():
    """f^2 of a pinned beam falls linearly with its thrust, and is that of the beam by itself where there is none."""
    force = {"F": fx.describe.Parameter(value=0.0, unit="N")}
    beam = bar(24, loads={"b": fx.describe.Load(force=("F", 0, 0))}, parameters=force)
    euler, free = (np.pi / L) ** 2 * EI, np.pi / (2 * L**2) * np.sqrt(EI / LINE)
    forces = euler * np.array([-0.5, -0.25, 0.0, 0.25, 0.5])
    found = fx.sweep(beam, vary={"F": forces}, ask="f1, buckling, stress").to_frame()
    assert found["f1 [Hz]"].to_numpy() == pytest.approx(free * np.sqrt(1 + forces / euler), rel=4e-5)
    assert found["buckling"].to_numpy() == pytest.approx([2, 4, *3 * [np.inf]], rel=1e-4)
    assert found["stress [Pa]"].to_numpy() == pytest.approx(abs(forces) / (B * T), rel=1e-6, abs=1e-6)
    assert fx.preload(beam).buckling_factor == np.inf
    assert fx.modes(bar(24), n=1).frequency_hz == pytest.approx(fx.modes(beam, n=1).frequency_hz, rel=1e-9)


@pytest.mark.parametrize("force", [(0, 0, 0), ("F", 0, 0)], ids=["number", "parameter"])
def test_a_load_that_is_zero_is_none(force):
    """What knows no loads answers as without them, until the parameter is another."""
    own = {"F": fx.describe.Parameter(value=0.0, unit="N")}
    bare, loaded = bar(4), bar(4, loads={"b": fx.describe.Load(force=force)}, parameters=own)
    assert fx.natural_frequencies(loaded, n=2).frequency_hz.tolist() == pytest.approx(
        fx.natural_frequencies(bare, n=2).frequency_hz.tolist(), rel=1e-12
    )
    assert fx.unproven_frequencies(loaded, n=2) == pytest.approx(fx.unproven_frequencies(bare, n=2), rel=1e-12)
    exact = [fx.compare(own, n=2, methods=["dynamic_stiffness"]).rows[0].frequency_hz for own in (bare, loaded)]
    assert exact[0] == pytest.approx(exact[1], rel=1e-12)
    if force[0] == "F":
        for refused in (fx.natural_frequencies, fx.unproven_frequencies, fx.compare, fx.verify):
            with pytest.raises(fx.OptionError, match="not under the loads"):
                refused(loaded, {"F": 1.0})
        with pytest.raises(fx.OptionError, match="not under the loads"):
            fx.natural_frequencies(loaded, {"F": [0.0, 1.0]})


@pytest.mark.parametrize(
    "zero", [{"force": (0, 0, 0)}, {"moment": (0, 0, 0)}, {"force": (0, 0, 0), "moment": (0, 0, 0)}]
)
def test_a_zero_load_is_written_and_read_again(zero):
    beam = bar(4, loads={"b": fx.describe.Load(**zero)})
    again = fx.loads(fx.dumps(beam))
    assert again == beam
    assert fx.dumps(again) == fx.dumps(beam)
    assert again.loads["b"].model_fields_set == set(zero)
    assert fx.Mechanism.model_validate_json(beam.model_dump_json()) == beam


def test_gravity_stands_and_hangs():
    for sign in (-1, 1):
        column = bar(24, length=1.0, ground={"a": "clamped"}, gravity=(sign * 0.5 * GREENHILL, 0, 0))
        free = bar(24, length=1.0, ground={"a": "clamped"})
        loaded, plain = (fx.modes(m, n=1, order="full").frequency_hz[0] for m in (column, free))
        assert sign * (loaded - plain) > 0.2 * plain


def test_beyond_greenhill_s_height_the_column_has_buckled():
    g = {"g": fx.describe.Parameter(value=0.99 * GREENHILL, unit="m/s^2")}
    column = bar(24, length=1.0, ground={"a": "clamped"}, parameters=g, gravity=("-g", 0, 0))
    assert fx.modes(column, n=1, order="full").frequency_hz[0] > 0
    for verb in (fx.modes, fx.reduce, fx.assemble, fx.statics, fx.check):
        with pytest.raises(fx.SolverError, match=r"buckles at 0\.9901\d* times"):
            verb(column, parameters={"g": 1.01 * GREENHILL})
    state = fx.preload(column, {"g": 2 * GREENHILL})
    assert state.buckling_factor == pytest.approx(0.5, rel=1e-6)


def pendulum(**more):
    """A rigid bar that hangs from a torsion spring at its upper end."""
    return fx.Mechanism(
        nodes={"pivot": (0, 0, 0), "low": (0, 0, -0.3)},
        bodies={
            "bob": fx.describe.RigidBody(centre=(0, 0, -0.2), mass=1.5, inertia=(2e-3,) * 3, carries=("pivot", "low"))
        },
        springs={
            "hinge": fx.describe.Spring(
                nodes=("pivot",),
                stiffness=dict.fromkeys(("tx", "ty", "tz"), 1e8) | dict.fromkeys(("rx", "ry", "rz"), 0.4),
            )
        },
        **more,
    )


def test_a_pendulum():
    """Swings by its spring and its weight: the spring is on an arm of the body, and carries the weight."""
    inertia = 2e-3 + 1.5 * 0.2**2
    for g, load in ((9.81, {}), (0.0, {}), (9.81, {"low": fx.describe.Load(force=(0, 0, -5.0))})):
        expected = np.sqrt((0.4 + 1.5 * g * 0.2 + (5.0 * 0.3 if load else 0.0)) / inertia) / (2 * np.pi)
        found = fx.modes(pendulum(gravity=(0, 0, -g), loads=load), n=3).frequency_hz
        assert found[:2] == pytest.approx([expected] * 2, rel=1e-6)


def test_a_spring_that_holds_a_bar_up_by_its_upper_end():
    """A force F up at the top of a standing bar, through a guided spring, restores as F times the height."""
    k_turn, height, weight = 50.0, 0.2, 40.0
    stiff = {"tx": 1e9, "ty": 1e9, "tz": 1e5, "rx": k_turn, "ry": k_turn, "rz": k_turn}
    bar = fx.Mechanism(
        nodes={"foot": (0, 0, 0), "top": (0, 0, height)},
        bodies={"bar": fx.describe.RigidBody(centre=(0, 0, 0), mass=1e-3, inertia=(0.4,) * 3, carries=("foot", "top"))},
        springs={
            "joint": fx.describe.Spring(nodes=("bar",), stiffness=stiff),
            "rope": fx.describe.Spring(nodes=("top",), stiffness={"tz": 3e5}),
        },
        loads={"bar": fx.describe.Load(force=(0, 0, -weight))},
    )
    expected = np.sqrt((k_turn + 0.75 * weight * height) / 0.4) / (2 * np.pi)
    assert fx.modes(bar, n=3).frequency_hz[1:] == pytest.approx([expected] * 2, rel=1e-6)


def test_what_cannot_feel_loads_says_so():
    beam = bar(loads=pull(10.0))
    for verb in (fx.natural_frequencies, fx.compare, fx.verify):
        with pytest.raises(fx.OptionError, match="described"):
            verb(beam)
    with pytest.raises(fx.OptionError, match="described"):
        fx.models.nested(fx.reduce(bar(ground={"a": "clamped"}, loads=pull(1.0)), static_at=["b"]), ["b"])


def test_arguments_beside_what_is_described():
    column = bar(16, length=1.0, ground={"a": "clamped"}, gravity=(-9.81, 0, 0), loads=pull(-0.1))
    one = fx.preload(column, gravity=(0, 0, 0), loads={"b": (-0.4, 0, 0, 0, 0, 0)})
    assert one.buckling_factor == pytest.approx((np.pi / 2) ** 2 * EI / 0.5, rel=1e-5)
    with pytest.raises(fx.OptionError, match="change it there"):
        fx.statics(column, gravity=(0, 0, -9.81))


SOURCE = """
flexura: 1
parameters: {w: 30 N, half: 100 mm}
materials: {steel: {E: 200 GPa, nu: 0.3, rho: 7800 kg/m^3}}
substructures:
  arm:
    nodes: {root: [0, 0, 0], tip: [half, 0, 0]}
    links:
      bar: {nodes: [root, tip], material: steel, section: {shape: circle, diameter: 2 mm}, elements: 8}
    interface: [root, tip]
instances:
  left: {of: arm}
  right: {of: arm, pattern: {type: linear, count: 2, step: [0, 20 mm, 0]}}
bodies: {base: {centre: [0, 0, 0], mass: 1 kg, inertia: [1 kg*m^2, 1 kg*m^2, 1 kg*m^2], carries: ["*.root"]}}
ground: {base: clamped}
"""


def test_loads_of_a_file(tmp_path):
    file = tmp_path / "arms.yaml"
    file.write_text(SOURCE + "gravity: -z\nloads:\n  right*.tip: {force: [-w/2, 0, 0], moment: [0, 0, 2 N*mm]}\n")
    described = fx.load(file)
    assert described.gravity == (0.0, 0.0, -9.80665)
    assert fx.loads(fx.dumps(described)) == described
    state = fx.preload(described)
    assert state.axial_force["right2.bar"] == pytest.approx((-15, -15))
    assert state.axial_force["left.bar"] == pytest.approx((0, 0), abs=1e-9)
    done = CliRunner().invoke(app, ["modes", str(file), "--order", "full", "-n", "2", "--json", "--set", "w=0 N"])
    assert done.exit_code == 0, done.stderr
    more = CliRunner().invoke(app, ["modes", str(file), "--order", "full", "-n", "2", "--json"])
    first = [json.loads(out.stdout)["modes"][0]["frequency_hz"] for out in (done, more)]
    # the square of the frequency falls almost linearly to zero at Euler's load
    euler = (np.pi / 0.2) ** 2 * 200e9 * np.pi * 2e-3**4 / 64
    assert first[1] / first[0] == pytest.approx(np.sqrt(1 - 15 / euler), rel=0.02)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("gravity: 9.81", "a list is expected"),
        ("gravity: [0, 0, -9.81]", r"write -9.81 m/s\^2"),
        ("gravity: down", "a direction is x, y, z"),
        ("gravity: [0, 0, -3 kg]", "an acceleration is expected here"),
        ("loads: {left.end: {force: [1 N, 0, 0]}}", "there is no such node"),
        ("loads: {base: {force: [1 N, 0, 0]}}", "base is clamped"),
        ("loads: {left.tip: {}}", "a load has a force or a moment"),
        ("loads: {left.tip: {force: [1, 0, 0]}}", "a force carries a unit"),
        ("loads: {left.tip: {force: [half, 0, 0]}}", "a force is expected here"),
        ("loads: {left.tip: {force: [1 N, 0, 0]}, 'l*.tip': {force: [1 N, 0, 0]}}", "already loaded by left.tip"),
    ],
)
def test_mistakes_are_refused_with_their_line(text, words):
    with pytest.raises(fx.ModelError, match=words) as raised:
        fx.loads(SOURCE + text, "arms.yaml")
    line = SOURCE.count("\n") + 1
    assert f"arms.yaml:{line}: {text[:5]}" in str(raised.value)


def test_responses_and_low_orders_of_every_kind_feel_the_loads(monkeypatch):
    """Static compliance of a taut pinned beam's middle through every kind of model."""
    links = {
        name: fx.describe.Link(
            nodes=ends,
            material="steel",
            section=fx.describe.Rectangle(width=B, thickness=T),
            reference=(0, 0, 1),
            elements=6,
        )
        for name, ends in {"one": ("a", "m"), "two": ("m", "b")}.items()
    }
    nodes = {"a": (0, 0, 0), "m": (L / 2, 0, 0), "b": (L, 0, 0)}
    beam = fx.Mechanism(
        theory="euler_bernoulli", corrections="none", materials={"steel": STEEL}, links=links, nodes=nodes,
        ground=PINNED, loads=pull(2e3), damping=0.02,
    )  # fmt: skip
    u = L / 2 * np.sqrt(2e3 / EI)
    exact = L**3 / (48 * EI) * 3 * (u - np.tanh(u)) / u**3
    ports = {"inputs": ["m.tz"], "outputs": ["m.tz"]}
    for order, options in (("low", {}), ("low", {"keep": 2}), ("low", {"reduction": "rubin", "keep": 2}), ("full", {})):
        model = fx.assemble(beam) if order == "full" else fx.reduce(beam, **options)
        space = fx.state_space(fx.system(model, **ports), n=2)
        gain = space.D - space.C @ np.linalg.solve(space.A, space.B)
        assert gain.item() == pytest.approx(exact, rel=1e-4)
    dense = fx.reduce(beam, keep=2)
    monkeypatch.setattr("flexura.reduction.model.DENSE_ORDER", 1)
    sparse = fx.reduce(beam, keep=2)
    assert not isinstance(sparse.K, np.ndarray)
    np.testing.assert_allclose(sparse.K.toarray(), dense.K, rtol=1e-12, atol=1e-9 * abs(dense.K).max())
    step = fx.time_response(beam, inputs={"m.tz": np.ones(1001)}, outputs=["m.tz"], dt=1e-3)
    assert np.asarray(step.response).ravel()[-1] == pytest.approx(exact, rel=1e-3)


def test_modes_say_what_state_they_are_about():
    for order in ("low", "full"):
        assert any("loads and gravity" in step for step in fx.modes(bar(loads=pull(1.0)), n=1, order=order).steps)
