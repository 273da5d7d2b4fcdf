"""Freedom and constraint spaces of mechanisms beside what is known of leaves and wires, and beside their stiffness."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flexura as fx
from flexura.errors import OptionError
from flexura.gallery import entries, entry
from helpers.counted_stages import B, E, G, L, T, crossed, folded, guide, hexapod, on_a_complex, stage
from helpers.over import over

EXAMPLES = Path(__file__).parents[2] / "examples"
TURNED = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
PLACES = [{}, {"scale": 1e-4}, {"scale": 1e3}, {"Q": TURNED, "shift": (5.0, -70.0, 3.0)}, {"E": 1e3}, {"E": 1e15}]


@cache
def of_gallery(name):
    return fx.free(fx.load(entry(name).path))


def leaf(**how):
    return stage({"leaf": (("g0", (0, 0, 0)), ("e0", (0, 0, L)), (1, 0, 0))}, **how)


def test_a_leaf_is_held_by_forces_along_the_lines_of_its_plane():
    [own] = fx.free(leaf()).bodies
    assert own.freedom.name == "all rotations in a plane, with the translation along its normal"
    assert own.constraint.name == "forces along all lines of a plane" and own.is_parallel
    assert own.energy[:3] == (0, 0, 0) and min(own.energy[3:]) > 1e10
    for screw in own.freedom.screws[:2]:
        assert screw.kind == "rotation" and screw.axis.direction[0] == 0 and screw.axis.point[0] == pytest.approx(0)
        assert (screw.offset, screw.tilt) == (0, 0)
    assert [screw.kind for screw in own.constraint.screws] == ["force", "force", "couple"]
    assert own.constraint.screws[2].axis.direction == pytest.approx((1, 0, 0))


def test_how_pure_a_leaf_is_by_closed_form():
    """Counted at L / sqrt(12), the least of what is free is twist, L / G J (Saint-Venant), and the most of what is held
    bending in the plane, L^3 / 12 E I, without shear as it is described."""
    [own] = fx.free(leaf()).bodies
    assert own.length == pytest.approx(L / np.sqrt(12)) and own.centre == pytest.approx((0, 0, L / 2))
    twist = L / (G * B * T**3 / 3 * (1 - 0.63 * T / B)) * L**2 / 12
    in_plane, bending, stretch = L**3 / (E * T * B**3), L**3 / (E * B * T**3), L / (E * B * T)
    assert own.compliance == pytest.approx((bending, bending, twist, in_plane, in_plane, stretch), rel=1e-4)
    assert own.gap == pytest.approx(twist / in_plane, rel=1e-4)
    rest = 2 * in_plane + stretch
    assert own.outside == pytest.approx(rest / (2 * bending + twist + rest), rel=1e-4)
    assert own.counted == 3


@over("count", (3, 4, 5, 6, 7))
def test_wires(count):
    """As many forces along wires as there are wires; three bipods leave nothing free."""
    found = fx.free(hexapod(count))
    [own] = found.bodies
    assert own.constraint.dimension == min(count, 6) and own.freedom.dimension == max(6 - count, 0)
    assert found.over == max(count - 6, 0) and own.is_parallel


@over("pitch", (2e-3, 10e-3, -5e-3))
def test_five_wires_on_a_complex_leave_one_screw(pitch):
    [own] = fx.free(on_a_complex(pitch)).bodies
    [screw] = own.freedom.screws
    assert (own.freedom.name, screw.kind) == ("screw", "screw") and screw.axis.pitch == pytest.approx(pitch, rel=1e-6)
    assert screw.axis.direction == pytest.approx((0, 0, 1), abs=1e-6)
    assert screw.axis.point[:2] == pytest.approx((0, 0), abs=1e-8)
    assert own.constraint.name == "forces along all lines of a linear complex" and own.is_parallel
    assert screw.elastic is not None and screw.elastic.pitch == pytest.approx(pitch, rel=0.05)
    assert screw.told == f"screw, {1e3 * pitch:.4g} mm"


@over("count", (1, 4, 6))
def test_folded_leaves_hold_along_their_folds(count):
    found = fx.free(folded(count))
    [own] = found.bodies
    assert own.constraint.dimension == count and own.is_parallel
    if count == 1:
        assert own.freedom.name == "all motions but along a line" and own.constraint.name == "force"


def test_two_leaves_that_cross_turn_about_where_they_cross():
    [own] = fx.free(crossed()).bodies
    [screw] = own.freedom.screws
    assert screw.kind == "rotation" and screw.axis.direction == pytest.approx((0, 1, 0), abs=1e-9)
    assert np.delete(screw.axis.point, 1) == pytest.approx((0, L / 2), abs=1e-9)
    assert own.constraint.name == "forces along all lines that meet a line"
    assert screw.offset == pytest.approx(0, abs=1e-9) and screw.tilt == pytest.approx(0, abs=1e-6)


@over("make", (leaf, guide, crossed, hexapod, folded))
@over("how", PLACES)
def test_spaces_do_not_depend_on_size_place_or_material(make, how):
    [first], [found] = (fx.free(own).bodies for own in (make(), make(**how)))
    assert (found.freedom.name, found.constraint.name) == (first.freedom.name, first.constraint.name)
    if found.gap is not None:
        assert found.gap == pytest.approx(first.gap, rel=1e-6)
    assert found.outside == pytest.approx(first.outside, rel=1e-6, abs=1e-12)


def in_series():
    ends = {f"leaf{k}": ((f"g{k}", (0.025 * k, 0, 0)), (f"c{k}", (0.025 * k, 0, L)), (1, 0, 0)) for k in range(2)}
    ends |= {f"upper{k}": ((f"d{k}", (0, 0.025 * k, L)), (f"e{k}", (0, 0.025 * k, 2 * L)), (0, 1, 0)) for k in range(3)}
    return stage(ends, bodies={"lower": ("c*", "d*"), "stage": ("e*",)})


def test_between_two_bodies():
    """Two guides in series, across each other."""
    own = in_series()
    for pair, kinds, along in (
        (("lower", "stage"), ["translation"], [(0, 1, 0)]),
        (("stage", "lower"), ["translation"], [(0, 1, 0)]),
        (("ground", "lower"), ["translation"], [(1, 0, 0)]),
        (("lower", "ground"), ["translation"], [(1, 0, 0)]),
        (("ground", "stage"), ["translation"] * 2, [(0, 1, 0), (1, 0, 0)]),
    ):
        found = fx.free(own, between=pair)
        [body] = found.bodies
        assert (found.held, body.body) == pair == found.between
        assert [screw.kind for screw in body.freedom.screws] == kinds
        directions = sorted(screw.axis.direction for screw in body.freedom.screws)
        assert np.allclose(directions, sorted(along), atol=1e-6)
        assert body.counted == len(kinds) and (body.gap or 0) > 10
    lower, upper = (body for body in fx.free(own).bodies)
    assert (lower.freedom.name, upper.freedom.name) == ("translation", "two translations")
    assert lower.is_parallel and not upper.is_parallel and upper.constraint.by_lines == 3


@over("pair", [("stage",), ("stage", "e0"), ("stage", "nothing")])
def test_bodies_that_are_none(pair):
    with pytest.raises(OptionError, match=r"two bodies|one body|no node"):
        fx.free(guide(), between=pair)


def test_what_is_relative_to_the_ground_or_to_a_body_that_nothing_holds():
    """Springs that hold one body of it take no part."""
    floating = fx.free(guide(bodies={"base": ("g*",), "stage": ("e*",)}, ground=()))
    [own], [held] = floating.bodies, fx.free(guide()).bodies
    assert floating.held == "base" and any("nothing is held" in note for note in floating.notes)
    assert own.compliance == pytest.approx(held.compliance, rel=1e-6)
    assert own.gap == pytest.approx(held.gap, rel=1e-6)


def test_what_is_loose_has_no_compliance():
    """A stage on a spring that pulls along one line alone, beside nothing else."""
    hung = fx.loads(
        """
nodes: {a: [0, 0, 0], b: [0, 0, 20 mm]}
springs: {coil: {nodes: [a, b], stiffness: {tx: 1 N/mm}}}
bodies: {stage: {centre: [0, 0, 30 mm], mass: 10 g, inertia: [1 kg*mm^2, 1 kg*mm^2, 1 kg*mm^2], carries: [b]}}
ground: {a: clamped}
"""
    )
    found = fx.free(hung)
    [own] = found.bodies
    assert own.freedom.name == "all motions" and own.constraint.name == "nothing" and own.compliance is None
    assert any("no compliances" in note for note in found.notes) and own.freedom.screws[0].elastic is None
    with pytest.raises(OptionError, match="nothing in this mechanism is elastic"):
        fx.free(fx.Mechanism(bodies={"b": hung.bodies["stage"].model_copy(update={"carries": ()})}))


def test_parts_of_other_programs_and_wires_of_solids():
    [own] = fx.free(fx.load(EXAMPLES / "imported" / "guide.yaml")).bodies
    assert own.freedom.name == "translation" and own.freedom.screws[0].axis.direction == pytest.approx(
        (1, 0, 0), abs=1e-3
    )
    [own] = fx.free(fx.load(EXAMPLES / "guide" / "guide.yaml")).bodies
    assert own.freedom.name == "translation" and (own.gap or 0) > 10


def test_where_the_elastic_axis_is():
    """Of the softest motion at the body, by its compliance about the global origin: the axis, and how far off it is."""
    mechanism = fx.load(entry("rcm_pivot").path)
    [own] = of_gallery("rcm_pivot").bodies
    [screw] = own.freedom.screws
    model = fx.assemble(mechanism)
    at = model.positions[model.plan.topology.numbers([own.body])[0]]
    C = fx.compliance(model, nodes=[own.body])
    arm = np.eye(6)
    arm[:3, 3:] = np.array([np.cross(e, np.subtract(own.centre, at)) for e in np.eye(3)]).T
    scale = np.repeat([1.0, own.length], 3)
    values, axes = np.linalg.eigh(scale[:, None] * (arm @ C @ arm.T) * scale)
    assert own.compliance == pytest.approx(values[::-1], rel=1e-6)
    v, w = np.split(axes[:, -1] / scale, 2)
    point = np.add(own.centre, np.cross(w, v) / (w @ w))
    off = np.linalg.norm(np.cross(np.subtract(point, screw.axis.point), w / np.linalg.norm(w)))
    assert screw.offset == pytest.approx(off, rel=1e-3) and 1e-7 < off < 1e-5
    assert own.gap is not None and own.gap < values[-1] / values[-2] * (1 + 1e-9)


NOT_CLEAR = {
    "bistable": "its arched leaves are stretched by the stroke, which takes 29 times as much energy as bending them",
    "bridge": "short notches as wide as the part are as stiff in bending out of the plane as others are in shear",
    "bridge_lever": "notches, as those of the bridge",
    "delta": "what the notches of its bars leave free is no softer than what else gives way beside them",
    "folded_mems": "beams side by side hold its fold by their stretch alone, at a small distance from each other",
    "gripper": "notches, as those of the bridge",
    "lever": "its stack counts as rigid, and is not",
    "rhombic": "inclined arms between notches, as those of the bridge",
    "scott_russell": "notches, as those of the bridge",
    "xy_theta": "its stacks count as rigid, and are not",
}
"""Mechanisms of the gallery that are free by their constraints in what they are not by their stiffness, or not clearly
so, and why."""


@pytest.mark.parametrize("name", [own.name for own in entries()])
def test_freedoms_by_screws_constraints_and_stiffness(name):
    """Spaces have as many dimensions as `constraints` has freedoms of each body, and as compliances have above a gap of
    ten, or a warning says that they do not."""
    found = of_gallery(name)
    mechanism = fx.load(entry(name).path)
    for own in found.bodies:
        counted = fx.constraints(mechanism, between=("ground", own.body))
        assert len(counted.freedoms) == own.freedom.dimension == 6 - own.constraint.dimension
    assert found.over == fx.constraints(mechanism).over
    if name in NOT_CLEAR:
        assert found.warnings
        return
    assert not found.warnings
    for own in found.bodies:
        assert own.gap is None or own.gap >= 10
        assert own.counted in (None, own.freedom.dimension)
        free, held = own.energy[: own.freedom.dimension], own.energy[own.freedom.dimension :]
        assert max(free, default=0) < 0.05
        assert min(held, default=np.inf) > 10
        for screw in own.freedom.screws:
            assert (screw.tilt or 0) < 0.02 and not (screw.offset or 0) > 0.02 * own.length


def test_known_spaces_of_the_gallery():
    for name, body, free, parallel in (
        ("parallelogram", "stage", "translation", True),
        ("cross_spring", "block", "rotation", True),
        ("tip_tilt", "wire1.lug", "two rotations that intersect", True),
        ("xy_serial", "table", "two translations", False),
        ("xy_parallel", "table", "two translations", False),
        ("delta", "table", "three translations", False),
        ("wire_hexapod", "plate", "no motion", True),
        ("z_stage", "leaf1.lug", "translation", True),
    ):
        [own] = [own for own in of_gallery(name).bodies if own.body == body]
        assert (own.freedom.name, own.is_parallel) == (free, parallel)


def test_columns_and_plain_data():
    found = fx.free(guide())
    columns = found.to_columns()
    assert columns["screw"] == ["translation", "force", "force", "couple", "couple", "couple"]
    assert columns["direction x"][0] == 1 and len({len(own) for own in columns.values()}) == 1
    told = found.to_dict()["bodies"][0]
    assert told["freedom"]["screws"][0]["pitch"] is None and told["constraint"]["screws"][0]["pitch"] == 0
