"""Rigid bodies whose elasticity would matter are doubts, against closed forms, solids and published frequencies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.body_doubts import lowered_by_bodies
from flexura.analysis.elastic_solids import ElasticSolid, Patch
from flexura.structure import assemble

E, NU, RHO = 206e9, 0.3, 7850.0
CLAMPED = fx.describe.Support(fixed=fx.describe.DOF_NAMES)
FREE_BEAM = 4.730041  # first root of cos x cosh x = 1 (Blevins, Formulas for Natural Frequency and Mode Shape, 1979)


def test_a_slender_box_has_the_frequency_of_a_free_beam() -> None:
    L, h = 0.1, 0.002
    beam = FREE_BEAM**2 / (2 * np.pi * L**2) * np.sqrt(E * h**2 / 12 / RHO)
    assert ElasticSolid((L, 0.003, h), E, NU, RHO).first_hz == pytest.approx(beam, rel=5e-3)


def test_a_square_plate_has_the_frequencies_of_leissa() -> None:
    """A. W. Leissa, J. Sound Vib. 31 (1973) 257: thin free square plate, nu = 0.3; upper bounds from beam functions."""
    a, h = 0.1, 0.001
    D = E * h**3 / 12 / (1 - NU**2)
    squared, _ = ElasticSolid((a, a, h), E, NU, RHO).modes
    found = np.sqrt(squared[:3]) * a**2 * np.sqrt(RHO * h / D)
    leissa = np.array([13.489, 19.789, 24.432])
    assert np.all(found < leissa) and np.all(found > 0.989 * leissa)


def test_a_slender_cylinder_has_the_frequency_of_a_free_rod() -> None:
    L, d = 0.1, 0.004
    rod = FREE_BEAM**2 / (2 * np.pi * L**2) * np.sqrt(E * d**2 / 16 / RHO)
    assert ElasticSolid((d, d, L), E, NU, RHO, True).first_hz == pytest.approx(rod, rel=5e-3)


def test_a_box_yields_to_bending_as_a_beam_does() -> None:
    """Equal and opposite moments at the ends: energy M^2 L / (E I)."""
    L, b, h = 0.1, 0.004, 0.004
    sides = np.array([[0, b / 2, 0], [0, 0, h / 2]])
    patches = [Patch(np.array([x, 0.0, 0.0]), sides) for x in (-L / 2, L / 2)]
    wrenches = np.zeros((2, 6, 1))
    wrenches[:, 4, 0] = -1.0, 1.0
    got = ElasticSolid((L, b, h), E, NU, RHO).flexibility(patches, wrenches)[0, 0]
    assert got == pytest.approx(L / (E * b * h**3 / 12), rel=0.03)


def test_what_is_out_of_balance_is_balanced_by_inertia() -> None:
    """A force on one end accelerates the solid, and its inertia balances it."""
    solid = ElasticSolid((0.03, 0.02, 0.01), E, NU, RHO)
    sides = np.array([[0, 0.004, 0], [0, 0, 0.002]])
    force = np.zeros((1, 6, 1))
    force[0, 0, 0] = 1.0
    pushed = solid.flexibility([Patch(np.array([0.015, 0, 0]), sides)], force)[0, 0]
    assert 0 < pushed < 0.03 / (E * 0.02 * 0.01)  # a bar pushed at one end is strained by a third of its length


def on_block(size: tuple[float, ...], mass: float | None = None, material: str = "own") -> fx.Mechanism:
    """A right-circular notch, R 3, t 0.5, b 8 mm, that carries a block."""
    notch = fx.describe.Notch(width=8e-3, contour=fx.describe.CircularContour(radius=3e-3, web=0.5e-3))
    flexure = fx.describe.Flexure(nodes=("a", "b"), material="spring-steel", reference=(0, 0, 1), profile=notch)
    how = (
        {"solid": fx.describe.Box(size=size, material=material)}
        if mass is None
        else {"mass": mass, "inertia": (1e-6,) * 3}
    )
    return fx.Mechanism(
        materials={"own": fx.describe.Material(E=E, nu=NU, rho=RHO)},
        nodes={"a": (0, 0, 0), "b": (6e-3, 0, 0)},
        flexures={"notch": flexure},
        bodies={"block": fx.describe.RigidBody(centre=(6e-3 + size[0] / 2, 0, 0), carries=("b",), **how)},
        ground={"a": CLAMPED},
    )


def test_a_block_on_a_notch_is_a_doubt_by_what_solids_have() -> None:
    """Solid against rigid block, both solid notches (benchmarks/elastic_bodies.py): -0.1 -5.1 -2.7 -7.1 -9.4 -20 %."""
    mechanism = on_block((20e-3, 8e-3, 6.5e-3))
    lowering = lowered_by_bodies(assemble(mechanism)).lowering[:6]
    measured = np.array([0.001, 0.051, 0.027, 0.071, 0.094, 0.204])
    assert lowering[0] < 0.01
    assert np.all(lowering[1:] > measured[1:] / 3) and np.all(lowering[1:] < 2 * measured[1:])
    (doubt,) = (d for d in fx.check(mechanism).doubts if d.kind == "elastic")
    assert doubt.place == "block" and "mode 2" in doubt.text and "fidelity: solid" in doubt.text


def elastic(mechanism: fx.Mechanism) -> list[str]:
    return [d.place for d in fx.check(mechanism).doubts if d.kind in ("elastic", "reach")]


def test_the_shipped_stage_is_a_doubt_and_the_guide_is_none() -> None:
    stage = fx.check(fx.load("examples/xy_stage/xy_stage.yaml")).doubts
    own = {("elastic", "leg.foot"), ("elastic", "leg.block"), ("evidence", "pair.low")}
    assert {(d.kind, d.place) for d in stage} == own
    assert "(0 " not in str(stage)
    pivot = Path("examples/pivot/pivot.yaml").read_text(encoding="utf-8")
    far = fx.check(fx.loads(pivot.replace("half + 10 mm]", "half + 40 mm]"))).doubts
    assert {(d.kind, d.place) for d in far} == {("gap", "arm"), ("elastic", "arm")}
    probe = pivot.replace("nodes:\n  foot", "nodes:\n  probe: [0, 0, 300 mm]\n  foot").replace(
        "[head_left,", "[probe, head_left,"
    )
    (reach,) = (
        d for d in fx.check(fx.loads(probe.replace("half + 10 mm]", "half + 40 mm]"))).doubts if d.kind == "reach"
    )
    assert reach.text.startswith("probe lies")
    assert elastic(fx.load("examples/guide/guide.yaml")) == []
    assert elastic(fx.load("examples/pivot/pivot.yaml")) == []


def test_a_stiff_platform_on_soft_flexures_is_no_doubt() -> None:
    leaf = fx.describe.Leaf(width=0.02, thickness=0.3e-3)
    nodes, flexures = {}, {}
    for k, (x, y) in enumerate([(0, 0), (0.1, 0), (0, 0.1), (0.1, 0.1)]):
        nodes |= {f"f{k}": (x, y, 0), f"h{k}": (x, y, 0.08)}
        flexures[f"l{k}"] = fx.describe.Flexure(
            nodes=(f"f{k}", f"h{k}"), material="spring-steel", reference=(1, 0, 0), profile=leaf
        )
    table = fx.describe.RigidBody(
        centre=(0.05, 0.05, 0.1),
        solid=fx.describe.Box(size=(0.14, 0.14, 0.04), material="spring-steel"),
        carries=("h*",),
    )
    mechanism = fx.Mechanism(nodes=nodes, flexures=flexures, bodies={"table": table}, ground={"f*": CLAMPED})
    assert elastic(mechanism) == []


def test_bodies_of_mass_alone_and_very_stiff_ones_are_no_doubt() -> None:
    assert elastic(on_block((20e-3, 8e-3, 6.5e-3), mass=0.01)) == []
    stiff = on_block((20e-3, 8e-3, 6.5e-3), material="stiff")
    stiff = stiff.model_copy(update={"materials": {"stiff": fx.describe.Material(E=2e15, nu=0.3, rho=7850.0)}})
    assert elastic(stiff) == []


def test_softer_bodies_lower_frequencies_more() -> None:
    def first(modulus: float) -> np.ndarray:
        own = on_block((20e-3, 8e-3, 6.5e-3), material="own")
        materials = {"own": fx.describe.Material(E=modulus, nu=0.3, rho=7850.0)}
        return lowered_by_bodies(assemble(own.model_copy(update={"materials": materials}))).lowering

    soft, stiff = first(20e9), first(200e9)
    assert np.all(soft[1:6] > stiff[1:6]) and np.all(stiff >= -1e-12)


def test_where_a_mechanism_stands_does_not_matter() -> None:
    one = on_block((20e-3, 8e-3, 6.5e-3))
    inner = fx.describe.Substructure(nodes=one.nodes, flexures=one.flexures, bodies=one.bodies, interface=("a",))
    rotation = fx.describe.Rotation(axis=(1, 2, 3), angle=0.7)
    for pattern in ((), (fx.describe.MirrorPattern(normal=(1, 1, 0), point=(0.1, 0, 0)),)):
        placed = fx.Mechanism(
            materials=one.materials,
            substructures={"s": inner},
            instances={"i": fx.describe.Instance(of="s", at=(0.1, 0, 0), rotate=(rotation,), pattern=pattern)},
            bodies={"base": fx.describe.RigidBody(mass=1, inertia=(1, 1, 1), carries=("i*.a",))},
            ground={"base": CLAMPED},
        )
        found = lowered_by_bodies(assemble(placed))
        wanted = lowered_by_bodies(assemble(one))
        # with its mirror image every mode comes twice, and the space of twelve modes holds half as many kinds
        twice = 2 if pattern else 1
        np.testing.assert_allclose(found.frequency_hz, np.repeat(wanted.frequency_hz, twice)[:12], rtol=1e-6)
        rtol = 5e-3 if pattern else 1e-6
        np.testing.assert_allclose(found.lowering[: 6 * twice], np.repeat(wanted.lowering[:6], twice), rtol=rtol)
