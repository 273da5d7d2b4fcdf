"""Modes of mechanisms of solids: exact three-dimensional solutions, and reduction against whole solids."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from flexura.errors import OptionError
from flexura.fem.components import components
from flexura.full_order import assemble
from flexura.mechanism import (
    CircularPattern,
    Instance,
    Leaf,
    Link,
    Material,
    Mechanism,
    MirrorPattern,
    PointMass,
    RigidBody,
    Rotation,
    SectionConstants,
    Substructure,
)
from flexura.mechanism.member import Flexure
from flexura.mechanism.section import Circle, Rectangle
from flexura.modelfile import load
from flexura.solid import modes
from flexura.solid.modes import beam_mass, solid_modes
from helpers.solid_wholes import whole_frequencies

EXAMPLES = Path(__file__).parents[2] / "examples"
E, RHO = 70e9, 2700.0


def bar(section, nu, n_nodes=2, length=0.1, **more):
    """A cantilever along x of links of equal length."""
    x = np.linspace(0, length, n_nodes)
    names = [f"n{k}" for k in range(n_nodes)]
    return Mechanism(
        nodes={name: (float(a), 0.0, 0.0) for name, a in zip(names, x, strict=True)},
        materials={"own": Material(E=E, nu=nu, rho=RHO)},
        links={
            f"link{k}": Link(nodes=(a, b), material="own", section=section, reference=(0, 0, 1), elements=4)
            for k, (a, b) in enumerate(pairwise(names))
        },
        ground={"n0": "clamped"},
        **more,
    )


def of_motion(found, model, component):
    """Frequencies of the modes whose free end moves along one component alone."""
    tip = found.solution.shapes[model.plan.topology.numbers(["n1"])[0]] * np.array([1, 1, 1, 0.1, 0.1, 0.1])[:, None]
    return found.solution.frequency_hz[np.abs(tip[component]) > 0.99 * np.linalg.norm(tip, axis=0)]


def test_torsion_of_a_round_bar_is_exact_in_three_dimensions():
    model = assemble(bar(Circle(diameter=0.02), 0.3))
    found = of_motion(solid_modes(model, 6, 1.0), model, 3)
    G = E / 2.6
    assert found[0] == pytest.approx(np.sqrt(G / RHO) / 0.4, rel=2e-4)


def test_stretching_without_lateral_contraction_is_exact_in_three_dimensions():
    model = assemble(bar(Rectangle(width=0.02, thickness=0.01), 0.0))
    found = of_motion(solid_modes(model, 8, 1.0), model, 0)
    assert found[0] == pytest.approx(np.sqrt(E / RHO) / 0.4, rel=1e-4)


def test_a_tip_mass_is_that_of_the_beam_model():
    mass = 0.5
    mechanism = bar(Rectangle(width=0.02, thickness=0.01), 0.0, masses={"tip": PointMass(node="n1", mass=mass)})
    model = assemble(mechanism)
    found = of_motion(solid_modes(model, 6, 1.5), model, 0)
    ratio = RHO * 0.02 * 0.01 * 0.1 / mass
    x = np.sqrt(ratio)
    for _ in range(50):  # x tan x = ratio
        x -= (x * np.tan(x) - ratio) / (np.tan(x) + x / np.cos(x) ** 2)
    assert found[0] == pytest.approx(x * np.sqrt(E / RHO) / (2 * np.pi * 0.1), rel=1e-4)


@pytest.mark.parametrize("example", [pytest.param("amplifier", marks=pytest.mark.slow), "pivot"])
def test_components_reduced_once_equal_the_whole_solid(example):
    model = assemble(load(EXAMPLES / example / f"{example}.yaml"))
    found = solid_modes(model, 6, 2.5, hexahedra=False)
    whole = whole_frequencies(model, 6, 2.5)
    np.testing.assert_allclose(found.solution.frequency_hz, whole, rtol=1e-3)
    assert (found.solution.frequency_hz > whole * (1 - 1e-5)).all()


@pytest.mark.slow
def test_more_fixed_modes_come_closer_to_the_whole_solid(monkeypatch):
    model = assemble(load(EXAMPLES / "amplifier" / "amplifier.yaml"))
    whole = whole_frequencies(model, 4, 4.0)
    error = []
    for reach in (6.0, 60.0, 200.0):
        monkeypatch.setattr(modes, "REACH", reach)
        error.append(solid_modes(model, 4, 4.0, hexahedra=False).solution.frequency_hz / whole - 1)
    assert (np.diff(error, axis=0) < 1e-9).all()
    assert np.abs(error[-1]).max() < 1e-5


def test_turned_and_mirrored_copies_are_one_component():
    part = Substructure(
        nodes={"a": (0.01, 0, 0), "b": (0.05, 0.02, 0.01)},
        flexures={
            "leaf": Flexure(
                nodes=("a", "b"),
                material="own",
                reference=(0, 0, 1),
                start_offset=(0.001, 0.0, 0.002),
                profile=Leaf(width=0.008, thickness=0.001),
            )
        },
        interface=("a", "b"),
    )
    mechanism = Mechanism(
        materials={"own": Material(E=E, nu=0.3, rho=RHO)},
        substructures={"part": part},
        instances={
            "part": Instance(
                of="part",
                rotate=(Rotation(axis=(0, 0, 1), angle=0.3),),
                pattern=(MirrorPattern(normal=(0, 1, 0)), CircularPattern(count=2)),
            )
        },
        bodies={
            "hub": RigidBody(centre=(0.01, 0.002, 0.0), mass=0.2, inertia=(2e-5, 3e-5, 4e-5), carries=("part*.b",))
        },
        ground={"part*.a": "clamped"},
    )
    model = assemble(mechanism)
    (component,) = components(model)
    assert len(component.copies) == 4
    found = solid_modes(model, 8, 2.0, hexahedra=False)
    np.testing.assert_allclose(found.solution.frequency_hz, whole_frequencies(model, 8, 2.0), rtol=1e-3)
    assert found.mass == pytest.approx(beam_mass(model), rel=1e-6)


def test_shapes_at_nodes_of_a_beam_are_those_of_the_section():
    model = assemble(bar(Circle(diameter=0.004), 0.3))
    found = solid_modes(model, 1, 1.0)
    numbers = model.plan.topology.numbers(["n0", "link0[1]", "link0[2]", "link0[3]", "n1"])
    u = found.solution.shapes[numbers, :, 0]
    w = np.hypot(u[:, 1], u[:, 2])
    x, k = np.linspace(0, 1, 5), 1.875104068711961
    s = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    exact = np.cosh(k * x) - np.cos(k * x) - s * (np.sinh(k * x) - np.sin(k * x))
    np.testing.assert_allclose(w / w[-1], exact / exact[-1], atol=3e-3)
    slope = k * (np.sinh(k * x) + np.sin(k * x) - s * (np.cosh(k * x) - np.cos(k * x))) / 0.1
    theta = np.hypot(u[:, 4], u[:, 5])
    np.testing.assert_allclose(theta / w[-1], slope / exact[-1], atol=0.15)


def test_fused_members_share_their_faces():
    section = Rectangle(width=0.02, thickness=0.01)
    one, two = (assemble(bar(section, 0.0, n)) for n in (2, 3))
    (component,) = components(two)
    assert component.tied == {"link0 start", "link1 end"}
    found = solid_modes(two, 3, 0.7).solution.frequency_hz
    np.testing.assert_allclose(found, solid_modes(one, 3, 1.0).solution.frequency_hz, rtol=5e-3)


def test_sections_by_constants_are_refused():
    section = SectionConstants(A=1e-4, Iy=1e-9, Iz=1e-9, J=1e-9)
    with pytest.raises(OptionError, match="no solid"):
        solid_modes(assemble(bar(section, 0.3)))
