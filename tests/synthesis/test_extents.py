"""No design leaves the envelope: its solids, in numbers, are in it, whatever its sizes; posts are as stout as there is
room; a frame around the envelope holds what leads sideways."""

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import assemble, plan_of
from flexura.modelfile import read_as
from flexura.structure import solids_of
from flexura.study.questions import questions, relation
from flexura.synthesis import WishFile, room_of, topologies
from flexura.synthesis.drafts import draft, with_values
from flexura.synthesis.extents import Extents, beyond_envelope, extents_of
from flexura.synthesis.fitting import limits_of
from flexura.synthesis.topologies import with_stout_posts

WISHES = {
    "tilts and piston": """
  freedoms: {platform: [rx, ry, z]}
  envelope: [60 mm, 60 mm, 30 mm]
""",
    "in a frame": """
  freedoms: {platform: [x]}
  envelope: [50 mm, 10 mm, 152 mm]
  base: {plane: y-, frame: true}
  platform: {shape: box, size: [30 mm, 10 mm, 40 mm], at: [0, 5 mm, 0]}
  make: {process: wire-cut}
""",
    "on the x face": """
  freedoms: {platform: [ry]}
  about: [20 mm, 0, 0]
  envelope: [40 mm, 30 mm, 50 mm]
  base: {plane: x-}
""",
    "piston in a frame": """
  freedoms: {platform: [z]}
  envelope: [54 mm, 54 mm, 30 mm]
  base: {frame: true}
  platform: {size: [30 mm, 30 mm]}
""",
}
MOST = 6


def read(text):
    file = read_as(WishFile, f"wish:{text}", "wish")
    return file, room_of(file.wish)


def listed(text):
    file, room = read(text)
    found = topologies(room, file.wish.make.process, 0.3e-3)[:MOST]
    return file, room, [with_stout_posts(own, room, 0.3e-3) for own in found]


def furthest(mechanism, room):
    """How far solids are outside of the envelope, m, by their own corners."""
    points = np.concatenate(
        [solids.pieces(n).reshape(-1, 3) for solids in solids_of(assemble(mechanism)) for n in range(len(solids.names))]
    )
    return room.outside(points @ room.turn).max()


def designs(mechanism, seed):
    """The first sizes (p,), and others at random and at corners of their limits (n, p)."""
    own = mechanism.parameters.values()
    first, low, high = (np.array([float(getattr(p, end)) for p in own]) for end in ("value", "minimum", "maximum"))
    unit = np.random.default_rng(seed).random((5, len(low)))
    return first, low + np.concatenate([unit[:3], np.round(unit[3:]), [np.ones(len(low))]]) * (high - low)


@pytest.mark.parametrize("name", WISHES)
def test_no_design_is_beyond_the_envelope(name):
    file, room, every = listed(WISHES[name])
    assert every
    beyond = 0
    for n, own in enumerate(every):
        mechanism = draft(own, file, room, "draft")
        extents = extents_of(own, room, mechanism)
        first, values = designs(mechanism, n)
        assert furthest(mechanism, room) < 2e-6
        for before, inside in zip(values, extents.within(first, values), strict=True):
            made = with_values(mechanism, dict(zip(mechanism.parameters, inside, strict=True)))
            assert furthest(made, room) < 1e-3 * room.size and beyond_envelope(assemble(made), room) == ()
            columns = dict(zip(mechanism.parameters, before[:, None], strict=True))
            is_within = all(relation(mechanism, text).margin(columns)[0] >= 0 for text in extents.limits())
            if is_within:
                assert (
                    furthest(with_values(mechanism, dict(zip(columns, before, strict=True))), room) < 1e-3 * room.size
                )
            beyond += not is_within
    assert beyond  # of sizes that are not led back


def test_stout_posts_make_designs_stiffer():
    file, room = read(WISHES["tilts and piston"])
    every = topologies(room, "assembled", 0.3e-3)
    stiffer = 0
    for own in every[:6]:
        stout = with_stout_posts(own, room, 0.3e-3)
        plain, thick = (plan_of(draft(each, file, room, "draft")) for each in (own, stout))
        one, other = (questions(plan, "stiffness(about.x)").values({}).value[0, 0] for plan in (plain, thick))
        assert other > 0.999 * one
        stiffer += other > 1.02 * one
        assert fx.check(draft(stout, file, room, "draft")).clashes == ()
    assert stiffer >= 3


def test_a_frame_holds_what_leads_sideways():
    text = WISHES["piston in a frame"]
    for frame in (True, False):
        file, room = read(text.replace("frame: true", f"frame: {str(frame).lower()}"))
        held = set()
        for own in topologies(room, "assembled", 0.3e-3)[:MOST]:
            mechanism = draft(own, file, room, "draft")
            parts = [body for part in mechanism.substructures.values() for body in (part.bodies or {}).values()]
            held |= {body.held.face for body in parts if body.held}
        assert ("z+" in held) is frame  # behind, as blocks are drawn


def test_last_digits_of_a_design_do_not_hold_others_back():
    """Of one that reaches 0.1 um beyond by them others go as far; where it is inside they are led back to the edge."""
    own = Extents(("a", "b"), np.array([-1e-2, -2e-2]), np.eye(2), 1e-9)
    led = own.within(np.array([1e-2 + 1e-7, 1e-3]), np.array([[9e-3, 1e-2], [8e-3, 3e-2], [1.1e-2, 1e-3]]))
    assert led[0] == pytest.approx([9e-3, 1e-2], rel=1e-12)
    assert led[1, 1] == pytest.approx(2e-2, abs=2e-9)
    assert led[2, 0] == pytest.approx(1e-2 + 1e-7, abs=2e-9)


def test_heads_at_a_flat_side_are_no_farther_apart_than_it_is_broad():
    """Of crossed guides around a plate of 40 mm in a large frame, which may be farther apart than that."""
    text = """
  freedoms: {platform: [x, y]}
  envelope: [200 mm, 200 mm, 10 mm]
  base: {frame: true}
  platform: {shape: box, size: [40 mm, 40 mm, 10 mm], at: [0, 0, 5 mm]}
  make: {process: wire-cut}
"""
    file, room = read(text)
    found = [own.patterns[0] for own in topologies(room, file.wish.make.process, 0.3e-3)]
    flat = [own for own in found if own.flat]
    assert {own.kind.name for own in flat} == {"crossed guides"} and not any(own.has_lug for own in flat)
    for own in flat:
        assert limits_of(own, room, 0.3e-3)["spacing"][1] == pytest.approx(40e-3, rel=1e-5)
        assert 0.9 * own.across > 40e-3


def test_limbs_that_are_right_at_any_distance_are_drawn_where_they_fit():
    """Leaves that fold on the axis of a hinge, 20 mm below, lead outward by as much: from 12.8 mm, where limbs are
    drawn first, they would be beyond 33 mm by the clearance that they need, and from 11.2 mm they are not."""
    text = """
  freedoms: {platform: [ry]}
  about: [20 mm, 0, 0]
  envelope: [70 mm, 66 mm, 12 mm]
  base: {plane: x-}
  platform: {shape: box, size: [30 mm, 32 mm, 12 mm], at: [55 mm, 0, 0]}
  make: {thinnest: 0.2 mm}
"""
    file, room = read(text)
    found = []
    for own in topologies(room, file.wish.make.process, 0.2e-3):
        last = own.patterns[-1]
        outward = last.site.axes[:, 0] @ last.axes[:, 2] > 0.5 and not last.site.azimuth
        if last.kind.name == "leaf folded on the axis" and last.count == 2 and outward:
            found.append(own)
    assert found
    for own in found:
        last = own.patterns[-1]
        assert not last.pinned and last.site.out == 0.7
        mechanism = draft(own, file, room, "draft")
        first = np.array([float(p.value) for p in mechanism.parameters.values()])
        extents = extents_of(own, room, mechanism)
        assert (extents.constants + extents.slopes @ first <= 0).all()
        assert float(mechanism.parameters["b_radius"].value) == pytest.approx(0.7 * 16e-3)
        model = assemble(plan_of(mechanism))
        heads = [k for k, name in enumerate(model.plan.topology.node_names) if name.endswith("b1.head")]
        assert np.abs(model.positions[heads][:, 1]) == pytest.approx(0.7 * 16e-3)
