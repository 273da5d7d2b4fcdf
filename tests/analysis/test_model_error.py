"""How far the part may be from the model: against closed forms, whole monoliths of another program, and by symmetry."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.analysis.model_error.model_error import model_errors_of_modes
from flexura.full_order import assemble
from flexura.mechanism import with_rigid_bodies

E, NU, RHO = 206e9, 0.3, 7850.0
CLAMPED = fx.describe.Support(fixed=fx.describe.DOF_NAMES)


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


MONOLITHS = {
    "leaf guide": (
        """
flexura: 1
materials: {al: {E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3}}
nodes:
  foot: [0, 15 mm, 6 mm]
  a1: [8 mm, 2.25 mm, 6 mm]
  b1: [28 mm, 2.25 mm, 6 mm]
  a2: [8 mm, 27.75 mm, 6 mm]
  b2: [28 mm, 27.75 mm, 6 mm]
flexures:
  l1: {nodes: [a1, b1], material: al, reference: y, profile: {type: leaf, width: 12 mm, thickness: 0.5 mm}}
  l2: {nodes: [a2, b2], material: al, reference: y, profile: {type: leaf, width: 12 mm, thickness: 0.5 mm}}
bodies:
  fixed: {centre: [4 mm, 15 mm, 6 mm], solid: {shape: box, size: [8 mm, 30 mm, 12 mm], material: al},
    carries: [foot, a1, a2]}
  table: {centre: [32 mm, 15 mm, 6 mm], solid: {shape: box, size: [8 mm, 30 mm, 12 mm], material: al},
    carries: [b1, b2]}
ground: {foot: clamped}
""",
        (290.7, 2222.9, 5250, 6513, 6558, 9483),
    ),
    "notch guide": (
        """
flexura: 1
materials: {al: {E: 71.7 GPa, nu: 0.33, rho: 2810 kg/m^3}}
sections: {arm: {shape: rectangle, width: 10 mm, thickness: 6.3 mm}}
substructures:
  side:
    nodes: {a: [10 mm, 0, 0], b: [13 mm, 0, 0], c: [19 mm, 0, 0], d: [41 mm, 0, 0], e: [47 mm, 0, 0], g: [50 mm, 0, 0]}
    links:
      u: {nodes: [a, b], material: al, reference: y, section: arm}
      v: {nodes: [c, d], material: al, reference: y, section: arm}
      w: {nodes: [e, g], material: al, reference: y, section: arm}
    flexures:
      h: {nodes: [b, c], material: al, reference: y,
        profile: {type: notch, width: 10 mm, contour: {shape: circular, radius: 3 mm, web: 0.3 mm}}}
      k: {nodes: [d, e], material: al, reference: y,
        profile: {type: notch, width: 10 mm, contour: {shape: circular, radius: 3 mm, web: 0.3 mm}}}
    interface: [a, g]
nodes: {foot: [0, 0, 0]}
instances: {s: {of: side, at: [0, 16.85 mm, 0], pattern: [{type: mirror, normal: y}]}}
bodies:
  fixed: {centre: [5 mm, 0, 0], solid: {shape: box, size: [10 mm, 40 mm, 10 mm], material: al}, carries: [foot, s*.a]}
  table: {centre: [55 mm, 0, 0], solid: {shape: box, size: [10 mm, 40 mm, 10 mm], material: al}, carries: [s*.g]}
ground: {foot: clamped}
""",
        (115.04, 1035.4, 2280.5, 6388, 6430, 6536),
    ),
}
"""Blocks of aluminium held at one face, and their frequencies, Hz, by curved tetrahedra of order 4 (NGSolve)."""


@pytest.mark.parametrize("name", MONOLITHS)
def test_the_part_lies_within_the_model_error(name: str) -> None:
    text, truth = MONOLITHS[name]
    found = fx.modes(fx.loads(text), n=len(truth))
    for hz, own, part in zip(found.frequency_hz, found.model_error, truth, strict=True):
        assert own is not None and 1 + own[0] <= part / hz <= 1 + own[1]
        assert own[1] - own[0] < (0.25 if hz < 8000 else 0.7)  # leaves that twist by themselves


def test_what_makes_the_model_error_is_said_with_its_mode() -> None:
    """The third mode of the leaf guide turns the table about the leaves' direction and bends both blocks."""
    doubts = fx.check(with_rigid_bodies(fx.loads(MONOLITHS["leaf guide"][0]))).warnings
    body = next(d for d in doubts if d.kind == "body")
    assert body.place == "table" and "moves mode 3 (59" in body.text and "Hz) by -1" in body.text
    ground = next(d for d in doubts if d.kind == "ground")
    assert ground.place == "fixed" and "clamped face" in ground.text


def test_ground_that_is_not_drawn_is_in_doubt() -> None:
    """The same guide with its leaves clamped: the block is a guess, and the truth still lies inside."""
    text, truth = MONOLITHS["leaf guide"]
    bare = "\n".join(line for line in text.splitlines() if "fixed:" not in line and "carries: [foot" not in line)
    bare = bare.replace("  foot: [0, 15 mm, 6 mm]\n", "").replace("{foot: clamped}", "{a1: clamped, a2: clamped}")
    found = fx.modes(fx.loads(bare), n=5)
    for hz, own, part in zip(found.frequency_hz, found.model_error, truth, strict=False):
        assert own is not None and 1 + own[0] <= part / hz <= 1 + own[1]
    assert any(d.kind == "ground" and "not drawn" in d.text for d in fx.check(fx.loads(bare)).warnings)


def effect(mechanism: fx.Mechanism, kind: str, n: int = 6) -> np.ndarray:
    """The lower ends (n,) of what the assumptions of a kind make of frequencies, worst first."""
    errors, _ = model_errors_of_modes(assemble(mechanism), n)
    return np.sum([own.low for own in errors.effects if own.kind == kind], axis=0)


def test_a_block_on_a_notch_gives_as_solids_do() -> None:
    """Solid against rigid block, both solid notches (benchmarks/elastic_bodies.py): -0.1 -5.1 -2.7 -7.1 -9.4 -20 %."""
    errors, _ = model_errors_of_modes(assemble(with_rigid_bodies(on_block((20e-3, 8e-3, 6.5e-3)))), 6)
    (body,) = (own for own in errors.effects if own.kind == "body")
    measured = -np.array([0.001, 0.051, 0.027, 0.071, 0.094, 0.204])
    assert np.all(body.low < measured + 0.01) and np.all(body.high > measured - 0.01)


def test_bodies_of_mass_alone_and_very_stiff_ones_do_not_give() -> None:
    assert np.all(effect(on_block((20e-3, 8e-3, 6.5e-3), mass=0.01), "body") == 0)
    stiff = on_block((20e-3, 8e-3, 6.5e-3), material="stiff")
    stiff = stiff.model_copy(update={"materials": {"stiff": fx.describe.Material(E=2e15, nu=0.3, rho=7850.0)}})
    assert np.abs(effect(stiff, "body")).max() < 1e-3


def test_where_a_mechanism_stands_does_not_matter() -> None:
    one = on_block((20e-3, 8e-3, 6.5e-3))
    wanted = effect(one, "body")
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
        twice = 2 if pattern else 1
        found = effect(placed, "body", 6 * twice)
        # with its mirror image every mode comes twice, and the space of lowest modes holds half as many kinds
        np.testing.assert_allclose(found, np.repeat(wanted, twice), rtol=0.02 if pattern else 1e-6)


def test_members_without_evidence_have_no_model_error() -> None:
    """A section given by constants says nothing of its form."""
    section = fx.describe.SectionConstants(A=5e-6, Iy=1e-13, Iz=4e-11, J=4e-13)
    link = fx.describe.Link(nodes=("a", "b"), material="spring-steel", reference=(0, 0, 1), section=section)
    body = fx.describe.RigidBody(mass=0.1, inertia=(1e-5,) * 3, carries=("b",))
    mechanism = fx.Mechanism(
        nodes={"a": (0, 0, 0), "b": (0.02, 0, 0)},
        links={"link": link},
        bodies={"body": body},
        ground={"a": CLAMPED},
    )
    found = fx.modes(mechanism, n=3)
    assert found.model_error == (None, None, None)
    assert "constants" in found.to_dict()["modes"][0]["model_error_reason"]
    assert any(doubt.kind == "evidence" for doubt in fx.check(mechanism).warnings)


def _pivot(ratio: float, elements: int) -> fx.Mechanism:
    """A body on a right-circular notch of radius 5 mm."""
    return fx.loads(
        f"""flexura: 1
materials: {{m: {{E: 70 GPa, nu: 0.3, rho: 2700 kg/m^3}}}}
nodes: {{a: [0, 0, 0], b: [10 mm, 0, 0]}}
flexures:
  h:
    nodes: [a, b]
    material: m
    reference: z
    profile: {{type: notch, width: 10 mm, contour: {{shape: circular, radius: 5 mm, web: {5 / ratio} mm}}}}
    elements: {elements}
bodies: {{p: {{centre: [10 mm, 0, 0], mass: 1 kg, inertia: [100 kg*mm^2, 100 kg*mm^2, 100 kg*mm^2], carries: [b]}}}}
ground: {{a: clamped}}
corrections: none
"""
    )


@pytest.mark.parametrize(("ratio", "elements", "size"), [(10, 3, 0.3), (20, 4, 0.4), (200, 20, 0.14)])
def test_too_few_elements_are_said_also_without_evidence(ratio: float, elements: int, size: float) -> None:
    """A notch of which beams were not measured, radius over web 200, among them."""
    few, many = (fx.modes(_pivot(ratio, n), n=3) for n in (elements, 400))
    text = f"right-circular notch in {elements} elements, where more are needed"
    (effect,) = (own for own in few.model_errors.effects if own.text == text)
    assert abs(effect.low[0]) > size
    assert few.frequency_hz[0] * (1 + effect.low[0]) == pytest.approx(many.frequency_hz[0], rel=2e-3)
    assert not [own for own in many.model_errors.effects if own.kind == "elements" and own.low.min() < -1e-3]


def test_short_elements_cost_static_responses_no_digits() -> None:
    """Rotation of a thin notch, in 400 stiff elements but for a few: the integral of 12 / (E b h^3)."""
    R, b, E, t = 5e-3, 10e-3, 70e9, 5e-3 / 50
    theta = np.linspace(-np.pi / 2, np.pi / 2, 200_001)
    exact = np.trapezoid(12 * R * np.cos(theta) / (E * b * (t + 2 * R * (1 - np.cos(theta))) ** 3), theta)
    found = fx.kinetostatics(_pivot(50, 400), platform="p").compliance[4, 4]
    assert found == pytest.approx(float(exact), rel=1e-6)


def test_modes_that_cannot_be_found_again_have_no_model_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise fx.SolverError("no convergence")

    found = fx.modes(_pivot(20, 10), n=2)
    monkeypatch.setattr("flexura.analysis.model_error.model_error.lowest_pairs", fails)
    assert found.model_error == (None, None) and found.model_errors.reason == ("no convergence",) * 2


def test_rigid_motions_hold_no_energy_in_what_was_not_measured() -> None:
    floating = fx.loads(
        """flexura: 1
materials: {m: {E: 70 GPa, nu: 0.3, rho: 2700 kg/m^3}}
sections: {own: {shape: constants, A: 1 mm^2, Iy: 1 mm^4, Iz: 2 mm^4, J: 1 mm^4}}
nodes: {a: [0, 0, 0], b: [50 mm, 0, 0]}
links: {rod: {nodes: [a, b], material: m, section: own, reference: z}}
"""
    )
    (unknown,) = fx.modes(floating, n=8).model_errors.unknown
    assert np.array_equal(unknown.share > 0.1, [False] * 6 + [True] * 2)


def test_resonances_have_the_model_error_of_their_modes() -> None:
    """In a band that leaves out the first mode, at low and full order; a time response notes those below a tenth
    of its sampling rate."""
    guide = fx.loads(MONOLITHS["leaf guide"][0])
    own = fx.modes(guide)
    given = {"band": (2000.0, 5000.0), "inputs": ["table.ty"], "outputs": ["table.ty"], "points": 2}
    for order in ("low", "full"):
        found = fx.frequency_response(guide, order=order, damping=0.01, **given)
        numbers = [int(np.abs(own.frequency_hz - hz).argmin()) for hz in found.resonances_hz]
        assert numbers and 0 not in numbers and len(set(numbers)) == len(numbers)
        for number, error in zip(numbers, found.model_error, strict=True):
            assert error == pytest.approx(own.model_error[number], rel=1e-6)
        assert found.to_dict()["model_error"][0] == list(found.model_error[0] or ())
    time = fx.time_response(guide, inputs={"table.ty": np.ones(20)}, dt=2e-5, damping=0.01)
    (note,) = time.model_error_notes
    assert note.count("Hz") == np.count_nonzero(own.frequency_hz < 5000)
    assert f"{own.frequency_hz[0]:.5g} Hz {own.model_errors.texts[0]}" in note
