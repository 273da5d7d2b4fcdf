"""Leaves of layers: closed forms of bimorphs, bimetals and sandwiches, what they tend to, and what is refused.

Bimorph: Smits, Dalke and Cooney, Sens. Actuators A 28 (1991) 41-61; bimetal: Timoshenko, J. Opt. Soc. Am. 11 (1925)
233-255; sandwich: Allen, Analysis and Design of Structural Sandwich Panels (1969), ch. 2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flexura as fx
from flexura.full_order import assemble

D = fx.describe
L, B = 30e-3, 5e-3
MATERIALS = {
    "piezo": D.Material(E=61e9, nu=0.31, rho=7750.0, expansion=4e-6),
    "brass": D.Material(E=100e9, nu=0.31, rho=8400.0, expansion=19e-6),
    "core": D.Material(E=70e6, G=25e6, rho=100.0),
}
PIEZO, SHIM, D31 = 0.2e-3, 0.1e-3, -190e-12
BIMORPH = (
    D.Layer(material="piezo", thickness=PIEZO, free_strain=-D31 / PIEZO),
    D.Layer(thickness=SHIM),
    D.Layer(material="piezo", thickness=PIEZO, free_strain=D31 / PIEZO),
)
BIMETAL = (D.Layer(material="piezo", thickness=0.2e-3), D.Layer(thickness=0.15e-3))
DRIVE = {"drive": D.StrainActuator(member="leaf")}
HEAT = {"drive": D.StrainActuator(member="leaf", by="temperature")}


def leaf(layers: tuple[D.Layer, ...], actuators: Any = None, material: str = "brass", **more: Any) -> fx.Mechanism:
    """A leaf of layers along x, clamped at its first node, b at the other."""
    profile = D.Layered(width=B, layers=layers)
    own = {"nodes": ("a", "b"), "material": material, "reference": "z"}
    return fx.Mechanism(
        materials=MATERIALS,
        nodes={"a": (0, 0, 0), "b": (L, 0, 0)},
        flexures={"leaf": D.Flexure(profile=profile, **own)},
        actuators=actuators or {},
        **{"ground": {"a": "clamped"}, "corrections": "none", **more},
    )


def rigidity(*layers: tuple[float, float]) -> tuple[float, float]:
    """EIy and neutral axis from the lower face of layers (E, t), by integrals over their faces."""
    E, t = np.array(layers).T
    z = np.concatenate([[0.0], np.cumsum(t)])
    first, second = E * np.diff(z**2) / 2, E * np.diff(z**3) / 3
    z0 = first.sum() / (E * t).sum()
    return B * (second.sum() - z0 * first.sum()), z0


def test_a_bimorph_bends_and_pushes_as_published() -> None:
    """With the blocked moment M = d31 V E b (t_p + t_s), L^2 M/2EI free, 3M/2L of force where the tip is held."""
    volts = 40.0
    EI, _ = rigidity((61e9, PIEZO), (100e9, SHIM), (61e9, PIEZO))
    M = -D31 * volts * 61e9 * B * (PIEZO + SHIM)
    free = fx.statics(leaf(BIMORPH, DRIVE), actuators={"drive": volts}).displacement("b")
    assert_allclose(free, [0, 0, M * L**2 / (2 * EI), 0, -M * L / EI, 0], rtol=1e-9, atol=1e-15)
    held = leaf(BIMORPH, DRIVE, springs={"s": D.Spring(nodes=("b",), stiffness=D.DiagonalStiffness(tz=1e9))})
    force = 1e9 * fx.statics(held, actuators={"drive": volts}).displacement("b")[2]
    assert_allclose(force, 1.5 * M / L, rtol=1e-5)
    response = fx.frequency_response(leaf(BIMORPH, DRIVE), inputs="drive", outputs="b.tz", frequency_hz=[1e-3])
    assert_allclose(np.ravel(response.response).real * volts, free[2], rtol=1e-6)


def test_a_bimorph_follows_an_arc_over_its_stroke() -> None:
    """A moment alone bends a leaf to an arc of the angle M L/EI, however large."""
    EI, _ = rigidity((61e9, PIEZO), (100e9, SHIM), (61e9, PIEZO))
    angle = 0.5
    volts = angle / (-D31 * 61e9 * B * (PIEZO + SHIM) * L / EI)
    stroke = fx.stroke(leaf(BIMORPH, DRIVE), actuators={"drive": (0.0, volts)}, steps=3, nodes=["b"])
    moved = np.array(stroke.poses[-1].displacement["b"])
    assert_allclose(
        moved[[0, 2, 4]], [L * (np.sin(angle) / angle - 1), L * (1 - np.cos(angle)) / angle, -angle], rtol=1e-3
    )


def test_a_bimetal_curls_as_timoshenko_has_it() -> None:
    kelvins, (E1, t1, a1), (E2, t2, a2) = 20.0, (61e9, 0.2e-3, 4e-6), (100e9, 0.15e-3, 19e-6)
    m, n, h = t1 / t2, E1 / E2, t1 + t2
    curl = 6 * (a2 - a1) * kelvins * (1 + m) ** 2 / (h * (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))))
    moved = fx.statics(leaf(BIMETAL, HEAT), actuators={"drive": kelvins}).displacement("b")
    assert_allclose(moved[[2, 4]], [-curl * L**2 / 2, curl * L], rtol=1e-9)


def test_a_mirrored_copy_curls_the_other_way() -> None:
    described = leaf(BIMETAL, HEAT)
    fields = {name: getattr(described, name) for name in ("nodes", "flexures", "actuators")}
    pair = fx.Mechanism(
        materials=MATERIALS,
        substructures={"leaf": D.Substructure(**fields, interface=("a", "b"))},
        instances={"leaf": D.Instance(of="leaf", pattern=D.MirrorPattern(normal="z"))},
        bodies={"block": D.RigidBody(centre=(0, 0, 0), mass=1.0, inertia=(1.0, 1.0, 1.0), carries=("leaf*.a",))},
        ground={"block": "clamped"},
        corrections="none",
    )
    one, other = (fx.statics(pair, actuators={"*.drive": 20.0}).displacement(f"leaf{k}.b") for k in (1, 2))
    assert one[2] < 0
    assert_allclose(other, one * [1, 1, -1, 1, -1, 1], rtol=1e-9, atol=1e-18)


def test_unlike_layers_bend_about_their_neutral_axis() -> None:
    """A pull on the middle of the section bends the leaf, L^2/2 F e/EI, and a moment moves the middle along."""
    EI, z0 = rigidity((61e9, 0.2e-3), (100e9, 0.15e-3))
    off = 0.175e-3 - z0  # of the middle from the neutral axis
    mass = B * (7750 * 0.2e-3 + 8400 * 0.15e-3)
    hz = fx.modes(leaf(BIMETAL, theory="euler_bernoulli"), n=1, order="full").frequency_hz
    assert_allclose(hz, 1.8751040687**2 / (2 * np.pi * L**2) * np.sqrt(EI / mass), rtol=5e-6)
    C = fx.compliance(leaf(BIMETAL), nodes=["b"])
    assert_allclose(C[2, 2], L**3 / (3 * EI), rtol=1e-6)
    assert_allclose([C[2, 0], C[0, 4]], [-off * L**2 / (2 * EI), off * L / EI], rtol=1e-6)


def test_a_soft_core_shears() -> None:
    """L^3/3EI + L c/(G b d^2), d between the middles of the faces; the core is stiff enough to carry little itself."""
    face, core = 0.1e-3, 4e-3
    layers = (D.Layer(thickness=face), D.Layer(thickness=core, material="core"), D.Layer(thickness=face))
    EI, _ = rigidity((100e9, face), (70e6, core), (100e9, face))
    C = fx.compliance(leaf(layers, corrections=("shear",)), nodes=["b"])
    assert_allclose(C[2, 2], L**3 / (3 * EI) + L * core / (25e6 * B * (face + core) ** 2), rtol=2e-3)


def test_layers_of_one_material_are_a_leaf() -> None:
    whole = leaf(tuple(D.Layer(thickness=t) for t in (0.1e-3, 0.25e-3, 0.15e-3)), corrections=("warping",))
    one = {
        "leaf": D.Flexure(nodes=("a", "b"), material="brass", reference="z", profile=D.Leaf(width=B, thickness=0.5e-3))
    }
    plain = whole.model_copy(update={"flexures": one})
    expected = fx.modes(plain, n=8, order="full").frequency_hz
    assert_allclose(fx.modes(whole, n=8, order="full").frequency_hz, expected, rtol=1e-9)


def test_every_layer_has_its_stress() -> None:
    """E_i z M/EI at the faces of each; the largest is told of the member."""
    EI, _ = rigidity((61e9, PIEZO), (100e9, SHIM), (61e9, PIEZO))
    model = assemble(leaf(BIMORPH))
    state = fx.statics(model, loads={"b": (0, 0, 1.0, 0, 0, 0)})
    stress = (fx.models.stress_rows(model, "leaf", position=0.0) @ state.displacement_vector).reshape(3, 4)
    upper, lower = np.array([-0.05, 0.05, 0.25]) * 1e-3, np.array([-0.25, -0.05, 0.05]) * 1e-3
    E = np.array([61e9, 100e9, 61e9])
    for corners, z in (((0, 3), upper), ((1, 2), lower)):
        for k in corners:
            assert_allclose(stress[:, k], -E * z * L / EI, rtol=1e-6)
    assert_allclose(state.stresses()["leaf"].von_mises, abs(stress).max(), rtol=1e-6)
    assert fx.statics(leaf(BIMORPH, DRIVE), loads={"b": (0, 0, 1.0, 0, 0, 0)}).stresses()["leaf"].von_mises is None


def test_batches_and_slopes_are_those_of_single_designs() -> None:
    text = fx.dumps(leaf(BIMETAL, HEAT)).replace("{thickness: 0.2 mm,", "{thickness: t,")
    mechanism = fx.loads(text.replace("materials:", "parameters: {t: 0.2 mm}\nmaterials:", 1))
    asked, step = "f1, f3, coupling(drive, b.z), stiffness(b.x), mass", 1e-5
    many = np.array([0.1e-3, 0.2e-3, 0.4e-3])
    batch = fx.natural_frequencies(mechanism, {"t": many}, n=3).frequency_hz
    full = [fx.modes(mechanism, {"t": t}, n=3, order="full").frequency_hz for t in many]
    assert_allclose(batch, full, rtol=5e-5)
    sizes = 0.2e-3 * np.array([1 - step, 1 + step])
    low, high = (fx.questions(mechanism, asked).values({"t": t}).value[0] for t in sizes)
    found = fx.sensitivity(mechanism, ask=asked)
    assert found.is_exact.all()
    assert_allclose(found.relative[:, 0], (high - low) / (high + low) / step, rtol=2e-4)


@pytest.mark.parametrize(
    ("what", "rule"),
    [
        (lambda: fx.stroke(leaf(BIMETAL, HEAT), actuators={"drive": (0.0, 5.0)}), "stretches its member"),
        (lambda: fx.verify(leaf(BIMORPH)), "layers are not meshed"),
        (lambda: fx.Plan(leaf(BIMETAL, DRIVE)), "none of its layers has a free strain"),
        (lambda: fx.Plan(leaf(BIMETAL, {"d": D.StrainActuator(member="leav")})), "there is no such flexure"),
        (lambda: fx.Plan(leaf((D.Layer(thickness=1e-3, material="brss"),))), "there is no such material"),
        (lambda: fx.Plan(named("plate")), "only a strip can be wide"),
    ],
)
def test_what_layers_cannot_do_is_refused(what: Any, rule: str) -> None:
    with pytest.raises(fx.FlexuraError, match=rule):
        what()


def named(correction: str) -> fx.Mechanism:
    """A leaf of layers with a correction by name."""
    described = leaf(BIMETAL)
    return described.model_copy(
        update={"flexures": {"leaf": described.flexures["leaf"].model_copy(update={"corrections": (correction,)})}}
    )
