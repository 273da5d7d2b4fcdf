"""Freedoms and over-constraints beside counts by hand (Maxwell 1864; Gruebler), misfits beside closed forms."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flexura as fx
from flexura.errors import OptionError
from helpers.counted_stages import B, E, L, T, crossed, folded, guide, hexapod, stage
from helpers.over import over

GALLERY = Path(fx.__file__).parent / "gallery"
EXAMPLES = Path(__file__).parents[2] / "examples"
TURNED = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
PLACES = [{}, {"scale": 1e-4}, {"scale": 1e3}, {"Q": TURNED, "shift": (5.0, -70.0, 3.0)}, {"E": 1e3}, {"E": 1e15}]

BY_HAND = {  # freedoms of the bodies and over-constraints: leaves have 3 constraints, wires 1, notches 4
    "parallelogram": (1, 1),  # 2 x 3 - (6 - 1)
    "butterfly": (2, 2),  # two pivots of two leaves in series
    "double_parallelogram": (2, 2),  # two guides in series
    "cross_spring": (1, 4),  # three leaves: 9 - (6 - 1)
    "four_bar": (1, 1),  # 18 - 4 x 4 = 1 + 2 - 1 with the twist of either bar
    "wire_hexapod": (0, 0),  # six wires
    "tip_tilt": (2, 0),  # four wires
    "z_stage": (1, 13),  # six leaves: 18 - (6 - 1)
}


def counts(found):
    return len(found.freedoms), found.internal, found.over


@over("name", BY_HAND)
def test_mechanisms_of_the_gallery_by_hand(name):
    found = fx.constraints(fx.load(GALLERY / f"{name}.yaml"))
    assert (len(found.freedoms), found.over) == BY_HAND[name]
    assert sum(own.share for own in found.competitors) == pytest.approx(found.over, abs=0.01)
    assert found.least_constrained > 100 and found.most_constrained < 1e-6
    assert not found.warnings


@over("count", (1, 2, 3, 4))
def test_parallel_leaves(count):
    found = fx.constraints(guide(count))
    assert counts(found) == ((3, 0, 0) if count == 1 else (1, 0, 3 * count - 5))
    assert [own.stiff for own in found.members] == [("stretch", "shear in its plane", "bending in its plane")] * count


@over("count", (3, 5, 6, 7))
def test_wires(count):
    found = fx.constraints(hexapod(count))
    assert counts(found) == (max(6 - count, 0), 0, max(count - 6, 0))
    assert all(own.stiff == ("stretch",) for own in found.members)


@over("count", (1, 4, 5, 6))
def test_folded_leaves_hold_along_their_folds_alone(count):
    """Every fold may turn about itself while the stage is at rest."""
    assert counts(fx.constraints(folded(count))) == (6 - count, count, 0)


@over("make", (guide, crossed, hexapod))
@over("how", PLACES)
def test_counts_do_not_depend_on_size_place_or_material(make, how):
    first, found = fx.constraints(make()), fx.constraints(make(**how))
    assert counts(found) == counts(first)
    assert found.least_constrained == pytest.approx(first.least_constrained, rel=1e-6)
    assert [own.gap for own in found.members] == pytest.approx([own.gap for own in first.members], rel=1e-6)


def test_two_leaves_compete_in_bending_in_their_planes():
    """A guide of two leaves is over-constrained once; a misfit bends both, in series, by E t w^3 / 12 L each."""
    found = fx.constraints(guide())
    assert [(own.member, own.deformation, own.along) for own in found.competitors] == [
        ("leaf0", "bending in its plane", "about x"),
        ("leaf1", "bending in its plane", "about x"),
    ]
    assert [own.share for own in found.competitors] == pytest.approx([0.5, 0.5])
    assert [own.force for own in found.competitors] == pytest.approx([E * T * B**3 / 12 / L / 2] * 2, rel=1e-6)
    notch = "add a notch across its middle"
    assert {(own.member, own.change, own.left) for own in found.releases} == {("leaf0", notch, 0), ("leaf1", notch, 0)}
    assert [own.left for own in found.exact] == [0]


def test_crossed_leaves_compete_side_by_side():
    """Two leaves that do not lie in one plane twist each other: once over-constrained."""
    assert counts(fx.constraints(crossed())) == (1, 0, 1)


def test_what_is_released_is_exact():
    """A guide whose second leaf has become a wire, and one with a leaf left out."""
    leaf = (("g0", (0, 0, 0)), ("e0", (0, 0, L)), (1, 0, 0))
    one = stage({"leaf0": leaf})
    changes = {(own.member, own.change): own for own in fx.constraints(guide(3)).releases}
    assert changes["leaf1", "thin it to a wire"].left == 2
    assert counts(fx.constraints(one)) == (3, 0, 0)
    assert counts(fx.constraints(guide(2))) == (1, 0, 1)
    assert changes["leaf1", "leave it out"].left == 1


def test_between_two_bodies():
    """Two guides in series: relative to the first stage, the second has one freedom and over-constraint of its own."""
    ends = {f"leaf{k}": ((f"g{k}", (0.025 * k, 0, 0)), (f"c{k}", (0.025 * k, 0, L)), (1, 0, 0)) for k in range(2)}
    ends |= {f"upper{k}": ((f"d{k}", (0, 0.025 * k, L)), (f"e{k}", (0, 0.025 * k, 2 * L)), (0, 1, 0)) for k in range(3)}
    own = stage(ends, bodies={"lower": ("c*", "d*"), "stage": ("e*",)})
    assert counts(fx.constraints(own)) == (2, 0, 5)
    assert counts(fx.constraints(own, between=("lower", "stage"))) == (1, 0, 4)
    assert counts(fx.constraints(own, between=("stage", "lower"))) == (1, 0, 4)
    assert counts(fx.constraints(own, between=("ground", "lower"))) == (1, 0, 1)
    for pair in (("ground", "stage"), ("stage", "ground")):
        found = fx.constraints(own, between=pair)
        assert counts(found) == (2, 0, 5) and {name.partition(".")[0] for name in found.freedoms} == {"stage"}
    for pair, why in (
        (("stage",), "between two bodies"),
        (("stage", "e0"), "one body"),
        (("stage", "nothing"), "no node 'nothing'"),
    ):
        with pytest.raises(OptionError, match=why):
            fx.constraints(own, between=pair)


def test_a_mechanism_that_nothing_holds_moves_relative_to_one_of_its_bodies():
    own = guide(bodies={"base": ("g*",), "stage": ("e*",)}, ground=())
    found = fx.constraints(own)
    assert found.held == "base" and counts(found) == (1, 0, 1) and found.freedoms == ("stage.tx",)
    with pytest.raises(OptionError, match="nothing is held"):
        fx.constraints(own, between=("ground", "stage"))


def test_pieces_of_one_leaf_are_one_flexure():
    """A leaf described in three pieces that go on from each other."""
    at = np.linspace(0, L, 4)
    names = ["g0", "m1", "m2", "e0"]
    pieces = {f"piece{k}": ((names[k], (0, 0, at[k])), (names[k + 1], (0, 0, at[k + 1])), (1, 0, 0)) for k in range(3)}
    [whole] = fx.constraints(stage({"leaf": (("g0", (0, 0, 0)), ("e0", (0, 0, L)), (1, 0, 0))})).members
    [joined] = fx.constraints(stage(pieces)).members
    assert joined.name == "piece0 to piece2" and joined.stiff == whole.stiff
    assert joined.stiffness == pytest.approx(whole.stiffness, rel=1e-6)


def test_where_stiff_and_soft_are_not_apart_it_says_so():
    """A cube on one thick, short bar: no deformation is much softer than others."""
    thick = fx.describe.Leaf(width=0.01, thickness=0.008)
    own = stage({"bar": (("g0", (0, 0, 0)), ("e0", (0, 0, 0.012)), (1, 0, 0))})
    own = own.model_copy(update={"flexures": {"bar": own.flexures["bar"].model_copy(update={"profile": thick})}})
    found = fx.constraints(own)
    assert any(own.kind == "no gap" for own in found.warnings)


def test_springs_are_soft_and_nothing_elastic_is_refused():
    soft = fx.describe.Spring(nodes=("stage",), stiffness=fx.describe.DiagonalStiffness(tx=1e3, ry=1.0))
    found = fx.constraints(guide(springs={"coil": soft}))
    assert counts(found) == (1, 0, 1) and any("springs count as soft" in note for note in found.notes)
    nothing = fx.Mechanism(
        bodies={"b": fx.describe.RigidBody(centre=(0, 0, 0), mass=1.0, inertia=(1.0,) * 3)},
    )
    with pytest.raises(OptionError, match="nothing in this mechanism is elastic"):
        fx.constraints(nothing)


def test_superelements_count_by_what_lies_between_their_nodes():
    """Leaves as matrices of another program, and a thin wire with a tip that is no described body."""
    found = fx.constraints(fx.load(EXAMPLES / "imported" / "guide.yaml"))
    assert counts(found) == (1, 5, 1) and found.freedoms == ("carriage.tx",)
    assert {(own.member, own.along) for own in found.competitors} == {(f"leaf{k}.part", "about x") for k in (1, 2)}
    assert [own.left for own in found.releases] == [0, 0]


def test_a_rod_on_two_diaphragms_may_not_be_twisted_in():
    plates = {
        name: f"{{nodes: [rim{k}, hub{k}], rim_diameter: 40 mm, hub_diameter: 10 mm, thickness: 0.2 mm, "
        "material: steel, normal: z}"
        for k, name in enumerate(("low", "high"))
    }
    own = fx.loads(
        f"""
materials: {{steel: {{E: 200 GPa, nu: 0.3, rho: 7800 kg/m^3}}}}
nodes: {{rim0: [0, 0, 0], hub0: [0, 0, 0], rim1: [0, 0, 40 mm], hub1: [0, 0, 40 mm]}}
diaphragms: {{low: {plates["low"]}, high: {plates["high"]}}}
bodies:
  rod: {{centre: [0, 0, 20 mm], mass: 10 g, inertia: [1 kg*mm^2, 1 kg*mm^2, 1 kg*mm^2], carries: ["hub*"]}}
ground: {{"rim*": clamped}}
"""
    )
    found = fx.constraints(own)
    assert counts(found) == (1, 0, 1) and found.freedoms == ("rod.tz",)
    assert {(own.member, own.along) for own in found.competitors} == {("low", "about z"), ("high", "about z")}


def test_supports_of_single_dofs_compete_as_members_do():
    """A stage on a leaf whose far side is held in one direction: along the leaf's width it is held twice."""
    leaf = (("g0", (0, 0, 0)), ("e0", (0, 0, L)), (1, 0, 0))
    for dof, twice in (("tx", 0), ("ty", 1)):
        own = stage({"leaf": leaf}, ground=("g0",))
        held = own.model_copy(update={"ground": {**own.ground, "stage": fx.describe.Support(fixed=(dof,))}})
        found = fx.constraints(held)
        assert (len(found.freedoms), found.over) == (2 + twice, twice)
        if twice:
            assert "stage" in {own.member for own in found.competitors}
