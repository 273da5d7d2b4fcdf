"""Modal sums against direct solution of the same matrices, static gains, and the bound on what is left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from hypothesis import given, settings
from hypothesis import strategies as st

import flexura as fx
from helpers.oscillators import beam, dashes, dense, pair
from helpers.random_mechanisms import FEW, mechanisms

RPR = Path(__file__).parents[2] / "examples" / "rpr" / "rpr.yaml"
SOME = settings(FEW, max_examples=8)


def solved(built, hz):
    """H (f, p, m) of a System by a dense solution at every frequency; modal damping added from its definition,
    M V diag(2 zeta w) V^T M with all modes V."""
    M, C, K = (dense(A) for A in (built.M, built.C, built.K))
    H = 0 * K if built.H is None else dense(built.H)
    if built.law.is_modal:
        d = 1 / np.sqrt(M.diagonal())
        values, V = la.eigh(d[:, None] * K * d, d[:, None] * M * d)
        omega = np.sqrt(np.maximum(values, 0))
        MV = M @ (d[:, None] * V)
        C = C + (MV * (2 * built.law.modal_ratios(omega / (2 * np.pi)) * omega)) @ MV.T
    s = 1 / np.sqrt(np.abs(K.diagonal()))
    found = []
    for w in 2 * np.pi * np.asarray(hz):
        Z = K + 1j * H + 1j * w * C - w**2 * M
        q = s[:, None] * np.linalg.solve(s[:, None] * Z * s, s[:, None] * built.B.astype(complex))
        derivative = ((1j * w) ** built.derivative)[:, None]
        found.append((built.rows @ q + built.residual) * derivative + built.D)
    return np.array(found)


def off(found, reference):
    """The largest difference beside the largest entry of each frequency."""
    return float((np.abs(found - reference).max(axis=(1, 2)) / np.abs(reference).max(axis=(1, 2))).max())


RAYLEIGH = {"rayleigh": {"frequencies": (20.0, 300.0), "ratios": (0.02, 0.03)}}
LAWS = {
    "none": {},
    "modal": {"ratio": 0.02},
    "bands": {"ratio": 0.05, "bands": [{"up_to": 60.0, "ratio": 0.01}, {"up_to": 200.0, "ratio": 0.03}]},
    "lowest": {"ratio": 0.01, "ratios": (0.05, 0.04, 0.03)},
    "Rayleigh": RAYLEIGH,
    "structural": {"loss_factor": 0.03},
    "everything": {"ratio": 0.01, "loss_factor": 0.02, **RAYLEIGH},
}
HZ = np.array([2.0, 31.0, 77.0, 113.0, 251.0, 430.0])
SLEEVE = {"damper": fx.describe.Dashpot(nodes=("b",), damping=dashes((20.0, 3.0, 8.0, 1e-3, 2e-3, 1e-3)))}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("dashpots", [{}, SLEEVE], ids=["", "dashpot"])
@pytest.mark.parametrize("order", ["low", "full"])
def test_all_modes_are_the_system(law, dashpots, order):
    """With every mode kept the sum solves the equations, whatever the damping."""
    described = beam(6, damping=LAWS[law], dashpots=dashpots)
    nodes = ["b.ty", "b.tz", "b.ry"]
    built = fx.system(described, inputs=nodes, outputs=[*nodes, "b.tz:velocity", "b.ry:acceleration"], order=order)
    reference = solved(built, HZ)
    assert off(built.modal().response(HZ), reference) < 1e-9
    assert off(fx.frequency_response(built, frequency_hz=HZ, method="direct").response, reference) < 1e-9


def two_materials(*keys, ground="a"):
    """A beam of metal from a to b, and one of tape, with a loss factor of its own, from b to c."""
    section = fx.describe.Rectangle(width=10e-3, thickness=2e-3)
    ends = {"metal": ("a", "b"), "tape": ("b", "c")}
    nodes = {"a": (0, 0, 0), "b": (0.1, 0, 0), "c": (0.16, 0.02, 0)}
    return fx.Mechanism(
        nodes={n: nodes[n] for n in sorted({n for key in keys for n in ends[key]})},
        links={
            k: fx.describe.Link(nodes=ends[k], material=k, section=section, reference="z", elements=3) for k in keys
        },
        materials={
            "metal": fx.describe.Material(E=70e9, nu=0.3, rho=2700.0),
            "tape": fx.describe.Material(E=3e9, nu=0.4, rho=900.0, loss_factor=0.3),
        },
        ground={ground: "clamped"},
        damping={"loss_factor": 0.01},
        corrections="none",
    )


def test_structural_damping_by_material_and_by_default():
    """What has no loss factor of its own takes that of the mechanism: H = 0.3 K_tape + 0.01 K_metal."""
    built = fx.system(two_materials("metal", "tape"), inputs=["c.tz", "c.ty"], outputs=["c.tz", "c.ty"], order="full")
    assert not built.modal().is_proportional
    metal = fx.assemble(two_materials("metal"))
    names = built.model.dof_names
    inside = [names.index(name) for name in metal.dof_names]
    H, K = dense(built.H), dense(built.K)
    expected = 0.3 * K
    expected[np.ix_(inside, inside)] -= (0.3 - 0.01) * dense(metal.K)
    assert len(inside) == 18 < len(K)
    assert np.abs(H - expected).max() < 1e-12 * np.abs(K).max()
    assert off(built.modal().response(HZ), solved(built, HZ)) < 1e-9


@SOME
@given(mechanisms(), st.integers(0, 2**32 - 1))
def test_modal_sum_is_direct_solution_in_random_mechanisms(described, seed):
    """The full-order sum with its static gain, against a sparse solution, far below the first mode left out."""
    rng = np.random.default_rng(seed)
    model = fx.assemble(described)
    names = [name for name in model.dof_names if "." in name and not name.split(".")[0].startswith("link")]
    chosen = [str(n) for n in rng.choice(names, 3, replace=False)]
    first = fx.modes(described, n=1).frequency_hz[0]
    damping = {"rayleigh": {"frequencies": (first, 10 * first), "ratios": (0.02, 0.03)}}
    hz = first * np.array([0.2, 0.71, 1.3])
    built = fx.system(model, inputs=chosen, outputs=chosen, damping=damping)
    direct = fx.frequency_response(built, frequency_hz=hz, method="direct").response
    assert off(built.modal().response(hz), direct) < 1e-7


@pytest.fixture(scope="module")
def rpr():
    """The example's full-order model."""
    return fx.assemble(fx.load(RPR))


PLATFORM = [f"platform.{d}" for d in ("tx", "ty", "tz", "rx", "ry", "rz")]


@pytest.mark.parametrize("order", ["low", "full"])
def test_static_gain_of_three_modes_is_that_of_the_whole(rpr, order):
    """What modes left out add at frequency zero is there: compliance of the platform from K alone.

    Scaled, K has a condition number of some 1e9: that leaves eight digits.
    """
    built = fx.system(rpr if order == "full" else fx.load(RPR), inputs=PLATFORM, outputs=PLATFORM, order=order)
    whole = fx.compliance(rpr, nodes=["platform"])
    found = built.modal(3).response(1e-6)[0]
    scale = np.sqrt(np.outer(whole.diagonal(), whole.diagonal()))
    assert np.abs((found - whole) / scale).max() < 2e-8
    bare = fx.system(rpr, inputs=PLATFORM, outputs=PLATFORM).modal(3)
    assert np.abs(((bare.C / bare.omega**2) @ bare.B - whole) / scale).max() > 1e-3


@pytest.mark.parametrize("damping", [{"ratio": 0.02}, RAYLEIGH, {"loss_factor": 0.03}], ids=str)
def test_bound_holds_and_is_close_on_the_platform(rpr, damping):
    """The bound is never below the error of the sum of twelve modes, and on average within a factor of a hundred."""
    built = fx.system(rpr, inputs=PLATFORM, outputs=PLATFORM, damping=damping)
    few, many = built.modal(12), built.modal(200)
    hz = few.next_omega / (2 * np.pi) * np.array([0.1, 0.3, 0.6, 0.9])
    error = np.abs(few.response(hz) - many.response(hz))
    bound = fx.models.neglected_bound(few, hz)
    assert (error <= bound).all()
    diagonal = list(range(6))
    assert np.median(bound[:, diagonal, diagonal] / error[:, diagonal, diagonal]) < 100
    above = fx.models.neglected_bound(few, [1.0001 * few.next_omega / (2 * np.pi)])
    assert np.isinf(above).all()


@SOME
@given(mechanisms())
def test_inertia_of_what_is_carried_along(described):
    """Loads of moving ground and of gravity: rows of the mass matrix of the same mechanism that nothing holds."""
    described = described.model_copy(update={"corrections": "none"})  # they depend on where members are held
    held = fx.assemble(described)
    free = fx.assemble(described.model_copy(update={"ground": {}}))
    whole = free.M @ free.rigid_body_motions()
    rows = [free.dof_names.index(name) for name in held.dof_names]
    assert np.abs(held.base_inertia_forces - whole[rows]).max() < 1e-12 * np.abs(whole).max()


@SOME
@given(mechanisms(), st.integers(0, 2**32 - 1), st.sampled_from([{"ratio": 0.03}, {}, {"loss_factor": 0.05}]))
def test_bound_holds_in_random_mechanisms(described, seed, damping):
    """All modes against some of them."""
    model = fx.assemble(described)
    rng = np.random.default_rng(seed)
    chosen = [str(n) for n in rng.choice(model.dof_names, 3, replace=False)]
    built = fx.system(model, inputs=chosen, outputs=chosen, damping=damping)
    every = built.modal()
    count = int(rng.integers(1, min(8, every.order)))
    few = built.modal(count)
    hz = few.next_omega / (2 * np.pi) * np.array([0.05, 0.4, 0.77])
    error = np.abs(few.response(hz) - every.response(hz))
    noise = 1e-9 * np.abs(every.response(hz))
    assert (error <= fx.models.neglected_bound(few, hz) + noise).all()


def test_no_bound_where_there_is_none():
    """Something that floats; and nothing is left out where there is nothing."""
    floating = fx.system(pair(0, 0, grounded=False), inputs="one.tx", outputs="one.tx").modal(8)
    with pytest.raises(fx.SolverError, match="held"):
        fx.models.neglected_bound(floating, 1.0)
    everything = fx.system(pair(0, 0), inputs="one.tx", outputs="one.tx").modal()
    assert not fx.models.neglected_bound(everything, [1.0, 1e6]).any()


def standing(elements):
    """A beam with a stage at its end that is propped against the ground."""
    stage = fx.describe.RigidBody(centre=(0.13, 0.01, 0.0), carries=("b",), mass=0.05, inertia=(1e-5, 2e-5, 3e-5))
    prop = {"prop": fx.describe.Spring(nodes=("stage",), stiffness=fx.describe.DiagonalStiffness(ty=2e3, rz=1.0))}
    damping = {"loss_factor": 0.02, **RAYLEIGH}
    return beam(elements, bodies={"stage": stage}, springs=prop, damping=damping, theory="rayleigh")


def test_ground_motion_of_the_exact_and_the_full_model_agree():
    """Errors of the elements in motion of the ground fall with the fourth power of their length."""
    inputs, outputs = ["ground.tz", "ground.ry", "ground.tx"], ["stage.tz", "stage.rx", "stage.ry", "stage.ty"]
    errors = []
    for elements in (8, 16):
        exact, full = (
            fx.frequency_response(
                standing(elements),
                frequency_hz=HZ[:5],
                inputs=inputs,
                outputs=outputs,
                quantity="transmissibility",
                order=order,
                method=method,
            ).response
            for order, method in (("exact", "modal"), ("full", "direct"))
        )
        errors.append(off(full, exact))
    assert errors[1] < 1e-5 and 13 < errors[0] / errors[1] < 19


def test_exact_response_refuses_what_it_cannot_hold():
    """Loss factors that differ, and channels at nodes that are eliminated."""
    spring = {"s": fx.describe.Spring(nodes=("b",), stiffness=fx.describe.DiagonalStiffness(tz=1e3))}
    with pytest.raises(fx.OptionError, match="one loss factor"):
        fx.frequency_response(
            beam(2, eta=0.05, springs=spring), frequency_hz=HZ, inputs="b.tz", outputs="b.tz", order="exact"
        )
    branch = fx.load(RPR)
    with pytest.raises(fx.OptionError, match="eliminates"):
        fx.frequency_response(
            branch, frequency_hz=HZ, inputs="platform.tz", outputs="rpu1.c.half1.c5.tz", order="exact"
        )
    inside = {"d": fx.describe.Dashpot(nodes=("c5",), damping=dashes((1, 0, 0, 0, 0, 0)))}
    half = fx.describe.Substructure(**{**dict(branch.substructures["half_ring"]), "dashpots": inside})
    damped = branch.model_copy(update={"substructures": branch.substructures | {"half_ring": half}})
    with pytest.raises(fx.OptionError, match="a dashpot is at a node"):
        fx.frequency_response(damped, frequency_hz=HZ, inputs="platform.tz", outputs="platform.tz", order="exact")
    with pytest.raises(fx.OptionError, match="order exact needs the mechanism"):
        fx.frequency_response(fx.system(beam(2)), frequency_hz=HZ, order="exact")
    with pytest.raises(fx.OptionError, match="not a model reduced from it"):
        fx.frequency_response(fx.reduce(beam(2)), frequency_hz=HZ, order="exact")


def test_points_around_resonances():
    """A band resolves every peak to its height: modal damping 1e-4 on twelve modes."""
    built = fx.system(pair(0, 0), inputs="one.tx", outputs="one.tx", damping=1e-4)
    found = fx.frequency_response(built, band=(5.0, 30.0), points=20)
    modes = built.modal()
    own = [r for r in range(12) if abs(modes.C[0, r]) > 1e-6 and 5 < modes.frequency_hz[r] < 30]
    assert own
    for r in own:
        peak = modes.C[0, r] * modes.B[r, 0] / (2 * 1e-4 * modes.omega[r] ** 2)
        near = np.abs(found.frequency_hz / modes.frequency_hz[r] - 1) < 1e-3
        assert np.abs(found.response[near]).max() == pytest.approx(peak, rel=1e-3)
    assert not any("between the frequencies" in note for note in found.notes)
    coarse = fx.frequency_response(built, frequency_hz=[5.0, 30.0])
    assert any("between the frequencies" in note for note in coarse.notes)


def test_selected_channels_of_finished_systems():
    """A System, a ModalSystem and a StateSpace answer by name, and refuse what they do not have."""
    nodes = ["one.tx", "two.tx"]
    built = fx.system(pair(), inputs=nodes, outputs=nodes)
    whole = fx.frequency_response(built, frequency_hz=HZ)
    for held in (built, built.modal(), fx.state_space(built)):
        found = fx.frequency_response(held, frequency_hz=HZ, inputs="two.tx", outputs="one.tx")
        assert found.response[:, 0, 0] == pytest.approx(whole.of("one.tx", "two.tx"), rel=1e-10)
        with pytest.raises(fx.OptionError, match=r"no channel 'one\.ty'"):
            fx.frequency_response(held, frequency_hz=HZ, inputs="one.ty", outputs="one.tx")
    with pytest.raises(fx.OptionError, match="finished system"):
        fx.frequency_response(built, frequency_hz=HZ, damping=0.01)
    with pytest.raises(fx.OptionError, match="no output"):
        whole.of("one.ty", "one.tx")
    with pytest.raises(fx.OptionError, match="no input"):
        whole.of("one.tx", "one.ty")


@pytest.mark.parametrize(
    ("n", "up_to", "message"),
    [(0, None, "at least 1"), (3, 5.0, "not both"), (None, -1.0, "up_to"), (None, np.inf, "up_to")],
)
def test_impossible_numbers_of_modes(n, up_to, message):
    """Modes are counted from one."""
    with pytest.raises(fx.OptionError, match=message):
        fx.system(pair()).modal(n, up_to)


def test_example_with_stacks_three_ways():
    """Volts to motion and force: exact, full-order and low-order models between the modes; 26 elements a ring."""
    described = fx.load(RPR.with_name("rpr_piezo.yaml"))
    inputs, outputs = "rpu1.c.piezo", ["lift", "pitch", "rpu1.c.force"]
    hz = np.array([2.0, 30.0, 70.0])
    law = {"loss_factor": 0.01}
    exact, full, low = (
        fx.frequency_response(
            described, frequency_hz=hz, inputs=inputs, outputs=outputs, order=order, method=method, damping=law
        ).response
        for order, method in (("exact", "modal"), ("full", "direct"), ("low", "modal"))
    )
    assert (np.abs(full - exact) < 1e-3 * np.abs(exact).max(axis=0)).all()
    assert (np.abs(low - full) < 2e-2 * np.abs(full).max(axis=0)).all()
