"""Time response against closed forms and against the matrix exponential in extended precision."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.responses.stepping import generalised_alpha
from flexura.linalg import Eigenpairs, lowest_modes
from flexura.systems.modal import modal_system
from helpers.extended_steps import stepped
from helpers.oscillators import INERTIA, K2, M1, M2, MASS, K, beam, body, dashes, natural, oscillator, pair, stiffness
from helpers.over import over

RPR = Path(__file__).parents[2] / "examples" / "rpr" / "rpr.yaml"
DT, COUNT = 2e-3, 400
TIME = DT * np.arange(COUNT)
ALL = ["mass.tx", "mass.tx:velocity", "mass.tx:acceleration"]


def kernels(m, c, k, t):
    """Response of m x'' + c x' + k x = 1 from rest: x, x', x''; from both roots of the characteristic polynomial."""
    half, root = c / (2 * m), np.sqrt(complex((c / (2 * m)) ** 2 - k / m))
    if k == 0 and c == 0:
        return t**2 / (2 * m), t / m, np.full_like(t, 1 / m)
    if k == 0:
        fall = np.exp(-c / m * t)
        return (t - m / c * (1 - fall)) / c, (1 - fall) / c, fall / m
    if root == 0:
        fall = np.exp(-half * t)
        return (1 - (1 + half * t) * fall) / k, t * fall / m, (1 - half * t) * fall / m
    one, two = -half + root, -half - root
    first, second = np.exp(one * t), np.exp(two * t)
    apart = one - two
    x = (1 - (one * second - two * first) / apart) / k
    return x.real, ((first - second) / apart / m).real, ((one * first - two * second) / apart / m).real


def near(found, reference, within):
    """Assert that two histories are the same beside the largest value."""
    scale = np.abs(reference).max()
    assert np.abs(found - reference).max() <= within * scale


ZETAS = [0.0, 1e-6, 0.02, 0.7, 0.999, 1.0, 1.001, 3.0, 50.0]


def damped(zeta, k=K[0], **more):
    """An oscillator with a damping ratio along x."""
    c = 2 * zeta * np.sqrt(k * MASS)
    return c, oscillator(
        (c, 0, 0, 0, 0, 0), springs={"s": fx.describe.Spring(nodes=("mass",), stiffness=stiffness((k, *K[1:])))}, **more
    )


@pytest.mark.parametrize("zeta", ZETAS)
@over("dt", [2e-5, 2e-3, 0.11])
def test_step_force(zeta, dt):
    """Underdamped, critical and overdamped, in steps that are fine and coarse beside the period of 63 ms."""
    c, described = damped(zeta)
    built = fx.system(described, inputs="mass.tx", outputs=ALL)
    t = dt * np.arange(COUNT)
    for hold, keep in (("zoh", False), ("foh", False), ("zoh", True), ("foh", True)):
        found = fx.time_response(built, inputs={"mass.tx": np.full(COUNT, 3.0)}, dt=dt, hold=hold, keep_modes=keep)
        for row, reference in zip(found.response, kernels(MASS, c, K[0], t), strict=True):
            near(row, 3 * reference, 1e-10)


@pytest.mark.parametrize("output", ["mass.tx", "mass.tx:velocity"])
@pytest.mark.parametrize("keep", [True, False])
def test_one_output_in_very_short_steps(output, keep):
    """A ten-thousandth of a radian per step: sums of some thousand steps keep their digits."""
    c, described = damped(0.3)
    t = 1e-6 * np.arange(6000)
    built = fx.system(described, inputs="mass.tx", outputs=output)
    found = fx.time_response(built, inputs={"mass.tx": np.ones(6000)}, dt=1e-6, keep_modes=keep)
    near(found.response[0], kernels(MASS, c, K[0], t)[output.endswith("velocity")], 1e-10)


@pytest.mark.parametrize("zeta", [1 - 1e-12, 1 + 1e-12, 1 - 3e-11, 1 + 4e-11, 1 - 1e-9, 1 + 1e-9])
def test_almost_critical(zeta):
    """Responses on both sides of critical damping go over into each other: they differ by order |zeta - 1|."""
    _, described = damped(zeta)
    found = fx.time_response(
        fx.system(described, inputs="mass.tx", outputs=ALL), inputs={"mass.tx": np.ones(COUNT)}, dt=DT
    )
    for row, reference in zip(found.response, kernels(MASS, 2 * np.sqrt(K[0] * MASS), K[0], TIME), strict=True):
        near(row, reference, 1e-8)


@pytest.mark.parametrize("zeta", ZETAS)
def test_impulse_and_release(zeta):
    """An impulse gives the derivative of the step response; letting go of a static state its complement."""
    c, described = damped(zeta)
    built = fx.system(described, inputs="mass.tx", outputs=ALL[:2])
    x, v, a = kernels(MASS, c, K[0], TIME)
    for keep in (False, True):
        struck = fx.time_response(
            built, inputs={"mass.tx": np.zeros(COUNT)}, dt=DT, impulses={"mass.tx": 0.3}, keep_modes=keep
        )
        near(struck.response, 0.3 * np.stack([v, a]), 1e-10)
        for k, row in enumerate(struck.response):
            near(row, 0.3 * (v, a)[k], 1e-10)
        let_go = fx.time_response(
            built, inputs={}, dt=DT, duration=DT * (COUNT - 1), start={"mass.tx": 2.0}, keep_modes=keep
        )
        near(let_go.response[0], 2 * (1 / K[0] - x), 1e-10)
        near(let_go.response[1], -2 * v, 1e-10)
    assert len(let_go.time) == COUNT


def test_ramp_is_exact_in_straight_lines():
    """F t: (t - 2 zeta/w + e^(-zeta w t)(2 zeta/w cos wd t + (2 zeta^2 - 1)/wd sin wd t))/k."""
    zeta, w = 0.15, natural("tx")
    _, described = damped(zeta)
    wd = w * np.sqrt(1 - zeta**2)
    for dt in (1e-4, 4e-3, 0.3):
        t = dt * np.arange(COUNT)
        fall = np.exp(-zeta * w * t)
        x = (t - 2 * zeta / w + fall * (2 * zeta / w * np.cos(wd * t) + (2 * zeta**2 - 1) / wd * np.sin(wd * t))) / K[0]
        found = fx.time_response(
            fx.system(described, inputs="mass.tx", outputs="mass.tx"), inputs={"mass.tx": t}, dt=dt, hold="foh"
        )
        near(found.response[0], x, 1e-11)


@pytest.mark.parametrize("hold", ["zoh", "foh"])
def test_result_does_not_depend_on_the_step(hold):
    """Inputs that are held or straight over five steps give the same in one step as in five."""
    rng = np.random.default_rng(3)
    coarse = rng.normal(size=(2, 60))
    t = np.arange(60 * 5 - 4)
    straight = np.stack([np.interp(t / 5, np.arange(60), row) for row in coarse])
    fine = straight if hold == "foh" else coarse[:, t // 5]
    nodes = ["one.tx", "two.tx"]
    built = fx.system(pair(), inputs=nodes, outputs=[*nodes, "two.tx:velocity"])
    one, five = (
        fx.time_response(built, inputs=dict(zip(nodes, u, strict=True)), dt=dt, hold=hold).response
        for u, dt in ((coarse, 5e-3), (fine, 1e-3))
    )
    near(five[:, ::5], one, 1e-11)


def test_ground_that_starts_to_accelerate():
    """Displacement relative to the ground, acceleration absolute."""
    c = 3.0
    built = fx.system(oscillator((0, c, 0, 0, 0, 0)), inputs="ground.ty", outputs=["mass.ty", "mass.ty:acceleration"])
    found = fx.time_response(built, inputs={"ground.ty": np.full(COUNT, 9.81)}, dt=DT)
    x, _, a = kernels(MASS, c, K[1], TIME)
    near(found.response[0], -9.81 * MASS * x, 1e-11)
    near(found.response[1], 9.81 * (1 - MASS * a), 1e-11)


@pytest.mark.parametrize("c", [0.0, 2.5])
def test_body_in_space(c):
    """F t^2/2 m, and with a dashpot to the ground F/c (t - m/c (1 - e^(-c t/m)))."""
    bodies = {"mass": body(), "rest": body((0.1, 0, 0))}
    springs = {"link": fx.describe.Spring(nodes=("mass", "rest"), stiffness=fx.describe.DiagonalStiffness(ty=1e3))}
    described = oscillator((c, 0, 0, 0, 0, 0), bodies=bodies, springs=springs)
    for order in ("low", "full"):
        built = fx.system(described, inputs="mass.tx", outputs=ALL, order=order)
        found = fx.time_response(built, inputs={"mass.tx": np.full(COUNT, 0.7)}, dt=DT)
        for row, reference in zip(found.response, kernels(MASS, c, 0.0, TIME), strict=True):
            near(row, 0.7 * reference, 1e-11)


def test_lone_body():
    """Nothing but one body: F t^2/2 m and M t^2/2 J."""
    found = fx.time_response(
        fx.Mechanism(bodies={"mass": body()}),
        inputs={"mass.ty": np.ones(COUNT), "mass.rz": np.ones(COUNT)},
        outputs=["mass.ty", "mass.rz"],
        dt=DT,
    )
    near(found.of("mass.ty"), TIME**2 / (2 * MASS), 1e-12)
    near(found.of("mass.rz"), TIME**2 / (2 * INERTIA[2]), 1e-12)


@pytest.mark.parametrize("c2", [0.0, 6.0, 2 * np.sqrt(2.5e3 * 0.4 * 0.15 / 0.55), 90.0])
def test_floating_pair(c2):
    """The centre of mass moves as a free body, the distance as an oscillator of the reduced mass."""
    m1, m2, k2 = 0.4, 0.15, 2.5e3
    described = pair(c2=c2, grounded=False)
    found = fx.time_response(
        described, inputs={"one.tx": np.ones(COUNT)}, outputs=["one.tx", "two.tx:velocity"], dt=DT, keep=0
    )
    reduced = m1 * m2 / (m1 + m2)
    r, rate, _ = (reduced / m1 * x for x in kernels(reduced, c2, k2, TIME))
    near(found.response[0], TIME**2 / (2 * (m1 + m2)) + m2 / (m1 + m2) * r, 1e-10)
    near(found.response[1], TIME / (m1 + m2) - m1 / (m1 + m2) * rate, 1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_round_off_in_modes_couples_none(seed, monkeypatch):
    """Modes that are mixed by some units in the last place are damped as before, and rigid motions not at all."""
    built = fx.system(pair(c2=6.0, grounded=False), inputs="one.tx", outputs="one.tx", order="full")
    rng = np.random.default_rng(seed)

    def mixed(pencil, count, rigid):
        pairs = lowest_modes(pencil, count, rigid)
        mix = np.eye(len(pairs.values)) + 1e-15 * rng.uniform(-1, 1, (len(pairs.values),) * 2)
        return Eigenpairs(pairs.values, pairs.vectors @ mix)

    monkeypatch.setattr(import_module("flexura.systems.second_order"), "lowest_modes", mixed)
    modes = modal_system(built)
    assert modes.is_proportional
    damped = modes.damping.diagonal() > 0
    assert modes.omega[damped] == pytest.approx([np.sqrt(K2 * (1 / M1 + 1 / M2))], rel=1e-9)


def reference(built, u, hold, start=None, rate=None):
    """Outputs (p, N) of a System by extended precision."""
    M, C, stiff = (A.toarray() if hasattr(A, "toarray") else A for A in (built.M, built.C, built.K))
    motion = stepped(M, C, stiff, built.B, u, DT_RPR, hold, start, rate)
    y = np.stack([built.rows[k] @ motion[order][:, :] for k, order in enumerate(built.derivative)])
    y[built.derivative == 0] += built.residual[built.derivative == 0] @ u
    return (y + built.D @ u).astype(float)


DT_RPR, STEPS = 1e-3, 2000
DAMPER = {
    "damper": fx.describe.Dashpot(
        nodes=("platform",), damping=dashes((30.0, 5.0, 80.0, 0.1, 0.02, 0.3)), at=(0.03, 0.0, 0.0)
    )
}


@pytest.fixture(scope="module")
def platform():
    """The example reduced to order 54, and with a dashpot that stands off the middle."""
    described = fx.load(RPR)
    return fx.reduce(described), fx.reduce(described.model_copy(update={"dashpots": DAMPER}))


needs_more_digits = pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="longdouble is double here")


@needs_more_digits
@pytest.mark.parametrize("hold", ["zoh", "foh"])
@pytest.mark.parametrize("coupled", [False, True])
def test_platform_of_order_54(platform, hold, coupled):
    """Displacement, velocity and acceleration over two thousand steps."""
    rng = np.random.default_rng(8)
    u = rng.normal(size=(3, STEPS)).cumsum(axis=1)
    inputs = ["platform.tx", "platform.tz", "platform.rx"]
    outputs = [
        "platform.tx",
        "platform.tz:velocity",
        "platform.ry:velocity",
        "platform.rx:acceleration",
        "platform.tx:acceleration",
    ]
    damping = {"rayleigh": {"frequencies": (8.0, 400.0), "ratios": (0.01, 0.02)}}
    built = fx.system(platform[coupled], inputs=inputs, outputs=outputs, damping=damping)
    assert built.order == 54
    assert built.modal().is_proportional is not coupled
    expected = reference(built, u, hold)
    for keep in (False, True):
        found = fx.time_response(built, inputs=dict(zip(inputs, u, strict=True)), dt=DT_RPR, hold=hold, keep_modes=keep)
        for row, exact in zip(found.response, expected, strict=True):
            near(row, exact, 1e-9)


@needs_more_digits
def test_floating_beam_with_dashpots():
    """Rigid motions beside modes that dashpots couple."""
    dampers = {"d": fx.describe.Dashpot(nodes=("a", "b"), damping=dashes((3, 4, 5, 1e-3, 2e-3, 3e-3)))}
    built = fx.system(
        beam(2, ground={}, dashpots=dampers),
        inputs=["a.tz", "b.ry"],
        outputs=["a.tz", "b.tz", "b.ry:velocity", "a.tz:acceleration"],
        order="full",
    )
    u = np.random.default_rng(4).normal(size=(2, 300))
    modes = built.modal()
    assert not modes.is_proportional and not modes.coupled[:6].any()
    found = fx.time_response(modes, inputs={"a.tz": u[0], "b.ry": u[1]}, dt=DT_RPR)
    for row, exact in zip(found.response, reference(built, u, "foh"), strict=True):
        near(row, exact, 1e-8)


@pytest.mark.parametrize("rho", [0.0, 0.5, 1.0])
def test_generalised_alpha_is_of_second_order(rho):
    """Halving the step quarters the error, with dashpots that couple modes, an impulse and a state to start from."""
    nodes = ["one.tx", "two.tx"]
    built = fx.system(pair(), inputs=nodes, outputs=[*nodes, "two.tx:velocity"])
    more = {"impulses": {"two.tx": 0.02}, "start": {"one.tx": 4.0}}
    errors = []
    for dt in (2e-3, 1e-3, 5e-4):
        n = round(0.2 / dt) + 1
        u = {"one.tx": np.linspace(1.0, 5.0, n), "two.tx": np.ones(n)}
        exact = fx.time_response(built, inputs=u, dt=dt, **more).response
        found = fx.time_response(built, inputs=u, dt=dt, method="generalised_alpha", rho_infinity=rho, **more).response
        errors.append(np.abs(found - exact).max(axis=1) / np.abs(exact).max(axis=1))
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert ((ratios > 3.5) & (ratios < 4.5)).all()
    assert errors[-1].max() < 5e-3


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.9])
def test_generalised_alpha_damps_what_it_does_not_resolve(rho):
    """At high frequency all three roots of a step are -rho (Chung and Hulbert 1993): (z + rho)^3 q = 0."""
    one = np.eye(1)
    q, v, a = generalised_alpha(
        one,
        0 * one,
        1e8 * one,
        one,
        np.zeros((1, 30)),
        dt=1.0,
        rho_infinity=rho,
        start=np.array([1e8]),
        impulses=np.array([0.0]),
    )
    for x in (q[0], v[0], a[0]):
        left = x[3:] + 3 * rho * x[2:-1] + 3 * rho**2 * x[1:-2] + rho**3 * x[:-3]
        assert np.abs(left).max() < 1e-6 * np.abs(x).max()


def test_generalised_alpha_on_sparse_matrices():
    """The full-order model of a beam against the modal recursion."""
    built = fx.system(
        beam(4, damping={"rayleigh": {"frequencies": (50.0, 500.0), "ratios": (0.02, 0.02)}}),
        inputs="b.tz",
        outputs=["b.tz", "b.tz:velocity"],
        order="full",
    )
    t = 1e-5 * np.arange(800)
    u = {"b.tz": np.sin(2 * np.pi * 150 * t) ** 2}
    exact = fx.time_response(built.modal(), inputs=u, dt=1e-5).response
    found = fx.time_response(built, inputs=u, dt=1e-5, method="generalised_alpha").response
    assert (np.abs(found - exact).max(axis=1) < 2e-3 * np.abs(exact).max(axis=1)).all()


def test_structural_damping_in_time():
    """The same energy is lost per cycle at resonance as with the ratio eta/2."""
    u = {"mass.tx": np.ones(COUNT)}
    lossy = fx.time_response(oscillator(damping={"loss_factor": 0.08}), inputs=u, outputs=ALL, dt=DT, keep=0)
    viscous = fx.time_response(oscillator(damping=0.04), inputs=u, outputs=ALL, dt=DT, keep=0)
    near(lossy.response, viscous.response, 1e-13)
    x = kernels(MASS, 2 * 0.04 * np.sqrt(K[0] * MASS), K[0], TIME)[0]
    near(lossy.response[0], x, 1e-11)
    assert any("structural damping" in note for note in lossy.notes)


def test_motion_of_everything():
    """Kept modes give back the static state at the start, and later the outputs."""
    described = beam(6, damping=0.01)
    for order in ("low", "full"):
        built = fx.system(described, inputs="b.tz", outputs=["b.tz", "b.ry"], order=order)
        found = fx.time_response(built.modal(), inputs={}, dt=1e-4, duration=0.02, start={"b.tz": 2.0}, keep_modes=True)
        model = fx.assemble(described)
        u = found.displacements([0, 7, 150])
        static = fx.statics(model, loads={"b": (0, 0, 2.0, 0, 0, 0)}).displacement_vector
        near(u[:, 0], static, 1e-9)
        rows = [model.dof_names.index(name) for name in ("b.tz", "b.ry")]
        near(u[rows], found.response[:, [0, 7, 150]], 1e-10)
    with pytest.raises(fx.OptionError, match="keep_modes"):
        fx.time_response(built.modal(), inputs={}, dt=1e-4, duration=0.02, start={"b.tz": 2.0}).displacements(0)


def test_functions_of_time_and_samples_are_the_same():
    """A function is sampled at 0, dt, 2 dt, ..., and longer samples are cut to the duration."""
    wave = fx.signals.sine(2.0, 12.0, 0.3)
    built = fx.system(oscillator(), inputs=["mass.tx", "mass.ty"], outputs=["mass.tx", "mass.ty"])
    called = fx.time_response(built, inputs={"mass.tx": wave, "mass.ty": lambda t: 3 * t}, dt=DT, duration=0.1)
    n = len(called.time)
    assert n == 51 and called.time[-1] == pytest.approx(0.1)
    assert np.array_equal(called.signals[0], 2 * np.sin(2 * np.pi * 12 * called.time + 0.3))
    sampled = fx.time_response(built, inputs={"mass.tx": wave(TIME), "mass.ty": 3 * TIME}, dt=DT, duration=0.1)
    assert np.array_equal(called.response, sampled.response)
    data = called.to_dict()
    assert data["outputs"]["mass.ty [m]"] == called.of("mass.ty").tolist() and data["time_s"][1] == DT
    with pytest.raises(fx.OptionError, match="no output"):
        called.of("mass.tz")


def test_coarse_steps_are_said():
    """Notes warn of a step that is coarse; residual modes give velocities what modes left out would."""
    built = fx.system(beam(8), inputs="b.tz", outputs=["b.tz", "b.tz:velocity"], order="full")
    coarse = fx.time_response(built.modal(4), inputs={"b.tz": np.ones(10)}, dt=0.1)
    assert any("coarse" in note for note in coarse.notes)
    assert coarse.notes[0].startswith("4 modes and 1 residual mode,") and not any("lack" in n for n in coarse.notes)
    fine = fx.time_response(built.modal(4).selected("b.tz", "b.tz"), inputs={"b.tz": np.ones(10)}, dt=1e-6)
    assert len(fine.notes) == 1


def test_modes_that_the_step_resolves():
    """A described mechanism is taken with modes up to a tenth of the sampling rate, and its static gain."""
    found = fx.time_response(beam(8, damping=0.05), inputs={"b.tz": np.ones(3000)}, outputs="b.tz", dt=1e-4)
    static = fx.compliance(beam(8), nodes=["b"])[2, 2]
    assert found.response[0, -1] == pytest.approx(static, rel=1e-6)


UNIT = {"mass.tx": np.ones(5)}


@over(
    ("inputs", "more", "message"),
    [
        (UNIT, {"dt": 0.0}, "dt is a positive"),
        (UNIT, {"dt": np.nan}, "dt is a positive"),
        (UNIT, {"hold": "soh"}, "hold is"),
        (UNIT, {"method": "newmark"}, "method is one of"),
        ({}, {}, "nothing acts"),
        ({"mass.tx": np.ones(5), "mass.ty": np.ones(6)}, {}, "mass.ty has 6"),
        ({"mass.tx": np.ones((2, 5))}, {}, "2x5"),
        ({"mass.tx": np.ones(1)}, {}, "at least two samples"),
        (UNIT, {"duration": 1.0}, "end after 5 samples"),
        (UNIT, {"duration": np.nan}, "duration"),
        (UNIT, {"duration": -1.0}, "duration"),
        ({"mass.tx": np.sin}, {}, "duration"),
        ({"mass.tx": np.sin}, {"duration": -1.0}, "duration"),
        ({"mass.tx": [1.0, np.nan, 2.0]}, {}, "mass.tx is not finite at sample 1"),
        ({"mass.tx": ["a", "b"]}, {}, "mass.tx"),
        ({"mass.tx": [[1.0], [1.0, 2.0]]}, {}, "mass.tx"),
        ({"mass.tx": lambda t: t[1:]}, {"duration": 0.1}, "mass.tx"),
        ({"mass.tx": lambda t: "no"}, {"duration": 0.1}, "mass.tx"),
        ({"mass.tq": np.ones(5)}, {}, "no input 'mass.tq'"),
        (UNIT, {"outputs": "mass.tq"}, "no output 'mass.tq'"),
        (UNIT, {"impulses": {"mass.tx": np.inf}}, "finite"),
        (UNIT, {"impulses": {"mass.tx": "strong"}}, "a number is expected"),
        (UNIT, {"start": {"mass.ty": [1, 2]}}, "a number is expected"),
        (UNIT, {"method": "generalised_alpha", "rho_infinity": 1.1}, "between 0 and 1"),
        (UNIT, {"method": "generalised_alpha", "damping": {"loss_factor": 0.1}}, "no causal"),
    ],
)
def test_impossible_arguments(inputs, more, message):
    """Each is refused with what is wrong with it."""
    with pytest.raises(fx.OptionError) as caught:
        fx.time_response(oscillator(), inputs=inputs, **({"dt": DT, "keep": 0} | more))
    assert message in str(caught.value)


def test_what_cannot_be():
    """No static state where something floats; no modal form to integrate step by step; no finished damping anew."""
    floating = fx.system(pair(0, 0, grounded=False), inputs="one.tx", outputs="one.tx")
    with pytest.raises(fx.OptionError, match="no static state"):
        fx.time_response(floating, inputs={}, dt=DT, duration=0.1, start={"one.tx": 1.0})
    held = fx.system(oscillator(), inputs="mass.tx", outputs="mass.tx")
    with pytest.raises(fx.OptionError, match="modal form"):
        fx.time_response(held.modal(), inputs=UNIT, dt=DT, method="generalised_alpha")
    with pytest.raises(fx.OptionError, match="finished system"):
        fx.time_response(held, inputs=UNIT, dt=DT, damping=0.1)
    with pytest.raises(fx.OptionError, match="no channel"):
        fx.time_response(held, inputs={"mass.ty": np.ones(5)}, dt=DT)
