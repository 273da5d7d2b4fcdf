"""`verify --whole`: the part as one solid.

Joints and monoliths of aluminium, E 71.7 GPa, nu 0.33, rho 2810 kg/m^3, one face held, were solved by NGSolve directly
from their own geometry with curved tetrahedra of orders 3 and 4 without refinement at corners. Those are upper bounds:
refinement at the sharp corners lowers leaf guides by up to 0.9 %, so that numbers here lie from 1.2 % below to 0.2 %
above; notches without corners are known to 0.2 %.
"""

import json

import numpy as np
import pytest

from flexura import verify
from flexura.errors import ModelError, OptionError
from flexura.fem import curved
from flexura.full_order import assemble
from flexura.mechanism import Mechanism
from flexura.solid.whole import ORDER, WholeModes, WholePart
from helpers.shell import flexura

ng = pytest.importorskip("ngsolve")

METAL = "Al-7075-T6"
MIDDLE = [1544.2, 9048.6, 15301.0, 18144.0]
EDGE = [1464.1, 7530.6, 14970.0, 15191.0]
NOTCHES = [115.04, 1035.4, 2280.5, 6388.0, 6430.0, 6536.0]


def joint(y: float, **changes) -> Mechanism:
    """A leaf 3 x 10 x 0.5 mm at height y between two blocks of 8 x 3 x 10 mm, the first held behind."""
    block = {"shape": "box", "size": (8e-3, 3e-3, 10e-3), "material": METAL}
    return Mechanism.model_validate(
        {
            "name": "joint",
            "nodes": {"foot": (8e-3, y, 5e-3), "head": (11e-3, y, 5e-3), "wall": (0.0, 1.5e-3, 5e-3)},
            "flexures": {
                "leaf": {
                    "nodes": ("foot", "head"),
                    "material": METAL,
                    "reference": (0.0, 1.0, 0.0),
                    "profile": {"type": "leaf", "width": 10e-3, "thickness": 0.5e-3},
                }
            },
            "bodies": {
                "block": {"centre": (4e-3, 1.5e-3, 5e-3), "solid": block, "carries": ("foot", "wall")},
                "free": {"centre": (15e-3, 1.5e-3, 5e-3), "solid": block, "carries": ("head",)},
            },
            "ground": {"wall": "clamped"},
            **changes,
        }
    )


def whole_modes(model: Mechanism, n: int = 6, order: int = ORDER, size: float = 1.0) -> WholeModes:
    return WholePart(assemble(model), order, size, lambda _: None).modes(n, order)


@pytest.mark.parametrize(
    ("y", "known"), [(1.5e-3, MIDDLE), pytest.param(2.75e-3, EDGE, marks=pytest.mark.slow)], ids=["middle", "edge"]
)
def test_joints_have_the_frequencies_of_solids_drawn_by_themselves(y, known):
    found = whole_modes(joint(y), n=4)
    off = found.frequency_hz / known - 1
    assert (off < 0.002).all() and (off > -0.012).all(), off
    assert found.mass == pytest.approx(2810 * (2 * 8 * 3 * 10 + 3 * 10 * 0.5) * 1e-9, rel=1e-9)
    assert found.notes == ("block: held on the face that wall lies on",)


def test_shapes_are_those_of_the_nodes():
    found = whole_modes(joint(1.5e-3), n=1, order=2)
    assert np.isfinite(found.shapes).all()
    foot, head, wall = found.shapes[:3, :, 0]
    assert np.abs(wall[:3]).max() < 1e-3 * np.abs(head[:3]).max()
    assert np.abs(foot[1]) < 0.2 * np.abs(head[1])
    assert np.abs(head[5]) > 0.5 * np.abs(head[1]) / 3e-3  # the block turns about z with the leaf's end


@pytest.mark.slow
def test_notches_have_the_frequencies_of_a_solid_drawn_by_itself():
    arm = {"material": METAL, "reference": (0.0, 1.0, 0.0)}
    section = {"shape": "rectangle", "width": 10e-3, "thickness": 6.3e-3}
    notch = {"type": "notch", "width": 10e-3, "contour": {"shape": "circular", "radius": 3e-3, "web": 0.3e-3}}
    x = {"foot": 10, "a": 13, "b": 19, "c": 41, "d": 47, "head": 50}
    block = {"shape": "box", "size": (10e-3, 40e-3, 10e-3), "material": METAL}
    guide = Mechanism.model_validate(
        {
            "substructures": {
                "arm": {
                    "nodes": {name: (own * 1e-3, 0.0, 0.0) for name, own in x.items()},
                    "links": {f"{p}{q}": {"nodes": (p, q), "section": section, **arm} for p, q in
                              (("foot", "a"), ("b", "c"), ("d", "head"))},
                    "flexures": {f"{p}{q}": {"nodes": (p, q), "profile": notch, **arm} for p, q in ("ab", "cd")},
                    "interface": ("foot", "head"),
                }
            },
            "instances": {
                "low": {"of": "arm", "at": (0.0, 3.15e-3, 5e-3)},
                "high": {"of": "arm", "at": (0.0, 36.85e-3, 5e-3)},
            },
            "nodes": {"wall": (0.0, 20e-3, 5e-3)},
            "bodies": {
                "block": {"centre": (5e-3, 20e-3, 5e-3), "solid": block, "carries": ("low.foot", "high.foot", "wall")},
                "table": {"centre": (55e-3, 20e-3, 5e-3), "solid": block, "carries": ("low.head", "high.head")},
            },
            "ground": {"wall": "clamped"},
        }
    )  # fmt: skip
    result = verify(guide, whole=True)
    found = np.array([mode.frequency_hz for mode in result.modes])
    known_to = np.array([mode.uncertainty for mode in result.modes])
    assert (np.abs(found / NOTCHES - 1) < known_to + 0.002).all(), found
    assert known_to.max() < 0.012
    assert abs(result.modes[2].bodies or 0) > 0.05  # the table bends in the third mode, and not in the first
    assert abs(result.modes[0].bodies or 0) < 0.005


@pytest.mark.slow
def test_more_order_is_softer_with_masses_and_stacks_too():
    """Displacements of order 3 contain those of order 2: a patch that means something else by order shows here."""
    mass = {"payload": {"node": "far", "mass": 2e-3}}
    piezo = {
        "stack": {
            "type": "piezo", "nodes": ("ground_side", "far"), "stiffness": 1e5, "free_stroke": 1e-5, "gain": 1e-7,
            "mass": 1e-3,
        }
    }  # fmt: skip
    loaded = joint(1.5e-3, masses=mass, actuators=piezo)
    nodes = {**loaded.nodes, "far": (19e-3, 1.5e-3, 5e-3), "ground_side": (19e-3, 20e-3, 5e-3)}
    bodies = {**loaded.bodies, "free": loaded.bodies["free"].replaced({"carries": ("head", "far")})}
    ground = {**loaded.ground, "ground_side": loaded.ground["wall"]}
    loaded = loaded.replaced({"nodes": nodes, "bodies": bodies, "ground": ground})
    low, high = (whole_modes(loaded, n=3, order=order, size=2.0).frequency_hz for order in (2, 3))
    assert (high < low * (1 + 1e-6)).all() and (high > 0.9 * low).all()


def test_what_is_too_large_is_refused_before_it_is_meshed(monkeypatch):
    monkeypatch.setattr(curved, "available_memory", lambda: 1e6)
    with pytest.raises(OptionError, match=r"DOFs, which take some .* GB are free: a larger size"):
        whole_modes(joint(1.5e-3))


def test_ends_in_the_air_are_refused_with_their_place():
    apart = joint(1.5e-3)
    nodes = {**apart.nodes, "end": (20e-3, 1.5e-3, 5e-3)}
    leaf = apart.flexures["leaf"]
    second = leaf.replaced({"nodes": ("head", "end"), "start_offset": (2e-3, 0.0, 0.0)})
    bodies = {"block": apart.bodies["block"]}
    apart = apart.replaced({"nodes": nodes, "flexures": {"leaf": leaf, "second": second}, "bodies": bodies})
    with pytest.raises(ModelError, match="touches what it is joined to"):
        whole_modes(apart, order=2)


@pytest.mark.slow
def test_the_shell_prints_what_each_assumption_makes(tmp_path):
    file = tmp_path / "joint.yaml"
    file.write_text(JOINT)
    out = flexura("verify", str(file), "--whole", "-n", "2", "--size", "2", "--json")
    modes = json.loads(out.stdout)["modes"]
    assert len(modes) == 2
    assert modes[0]["difference"] == pytest.approx(modes[0]["described_hz"] / modes[0]["frequency_hz"] - 1)
    assert modes[0]["roots"] < -0.02  # a short leaf between thick blocks: elastic roots are no detail
    assert modes[0]["bodies"] > 0


JOINT = """\
flexura: 1
name: joint
nodes: {foot: [8 mm, 1.5 mm, 5 mm], head: [11 mm, 1.5 mm, 5 mm], wall: [0, 1.5 mm, 5 mm]}
flexures:
  leaf:
    nodes: [foot, head]
    material: Al-7075-T6
    reference: y
    profile: {type: leaf, width: 10 mm, thickness: 0.5 mm}
bodies:
  block:
    centre: [4 mm, 1.5 mm, 5 mm]
    solid: {shape: box, size: [8 mm, 3 mm, 10 mm], material: Al-7075-T6}
    carries: [foot, wall]
  free:
    centre: [15 mm, 1.5 mm, 5 mm]
    solid: {shape: box, size: [8 mm, 3 mm, 10 mm], material: Al-7075-T6}
    carries: [head]
ground: {wall: clamped}
"""
