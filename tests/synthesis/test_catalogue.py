"""Types of freedoms, wished for one after another: the 26 that parallel flexures may have (Hopkins and Culpepper 2010),
and some that only joints in a row leave.

Each is laid into the room as a designer would, its lines where limbs can begin, and wished for by its screws. What is
found bears the constraint space that is known of the type, by Plücker coordinates that are worked out in the tests.
"""

import numpy as np
import pytest

from flexura.full_order import plan_of
from flexura.mechanism import with_rigid_bodies
from flexura.screws import ScrewSpace
from flexura.study.questions import questions
from flexura.synthesis import Wish, WishFile, room_of, topologies
from flexura.synthesis.drafts import draft
from flexura.synthesis.screening import COMPLIANCES, gap_of
from geometry.test_screws import NOT_PARALLEL, PARALLEL, P, X, Y, Z
from synthesis.test_drafts import slim
from synthesis.test_topologies import SIZES, borne, limbs_of

THINNEST = 1e-4
MIDDLE, BELOW = np.array([0.0, 0.0, 0.15]), np.array([0.0, 0.0, 0.13])
"""Of the platform, 90 mm across and 40 mm high, and of its lower face."""

UPPER, LOWER = 0.164, 0.136
"""Heights at its side."""

SITE = 0.036
"""Distance of sites below it from its axis."""


def axes(x, y, z):
    """Where the axes of the catalogue are in the room."""
    return np.array([x, y, z]).T


AS_IS = axes(X, Y, Z)
PLACES = {  # the unit of the catalogue, m, where its axes are, which point of it is where
    "a line": (0.05, AS_IS, P, MIDDLE),
    "lines that intersect": (0.05, axes(X, Z, -Y), P, MIDDLE + 0.05 * Z),
    "skew lines": (2 * SITE, axes((Y + Z) / 2**0.5, (Z - Y) / 2**0.5, X), Z / 2, BELOW),
    "sphere": (0.05, AS_IS, P, MIDDLE + 0.05 * Z),
    "planar motion": (0.05, AS_IS, P, MIDDLE),
    "two pencils": (0.06, axes(Z, X, Y), 0 * X, BELOW + SITE * Z),
    "parallel lines of two directions": (UPPER - LOWER, AS_IS, Z, np.array([0, 0, UPPER])),
    "hyperboloid": (SITE, AS_IS, 0 * X, BELOW),
    "oblique cylinder": (0.045, axes(Y, Z, X), 0 * X, MIDDLE),
    "parallel screws of one pitch": (SITE / 1.5, axes(Z, X, Y), 0 * X, MIDDLE),
    "rotation": (0.05, AS_IS, P, MIDDLE),
    "screw": (SITE / 0.7, AS_IS, P, MIDDLE),
}
NOT_HELD = ("nothing held", "helical planar motion")
OVER = {
    "translation": 1,
    "two pencils": 1,
    "a pencil and parallel lines": 1,
    "parallel lines of two directions": 1,
    "cylinder": 2,
    "rotation": 1,
    "screw": 1,
    "universal with translations": 1,
}
"""Least constraints beyond those that are needed, of types that patterns of the grammar hold with some alone."""


def laid(name):
    """Freedoms and constraints of a type in the room."""
    twists, wrenches, *_ = (PARALLEL | NOT_PARALLEL)[name]
    unit, turn, point, to = PLACES.get(name, (0.045, AS_IS, np.zeros(3), MIDDLE))
    spaces = []
    for kind, screws, part in (("twists", twists, slice(3)), ("wrenches", wrenches, slice(3, 6))):
        columns = np.array(screws, dtype=float).reshape(-1, 6).T.copy()
        columns[part] *= unit
        spaces.append(ScrewSpace.of(kind, columns, 0.1).moved(turn, to - unit * turn @ point))
    return spaces


def asked(freedoms):
    """The wish for them, by screws."""
    screws = {
        f"s{k}": {"axis": tuple(own.direction), "point": tuple(own.point), "pitch": own.pitch}
        for k, own in enumerate(freedoms.simplest())
    }
    return Wish.model_validate(
        {
            "freedoms": {"screws": screws} if screws else {"platform": []},
            "about": tuple(MIDDLE),
            "envelope": (0.2, 0.2, 0.2),
            "platform": {"size": (0.09, 0.04), "at": tuple(MIDDLE)},
            "make": {"thinnest": THINNEST},
        }
    )


@pytest.mark.parametrize("name", [name for name in PARALLEL | NOT_PARALLEL if name not in NOT_HELD])
def test_a_type_is_held_as_it_is_known_to_be(name):
    freedoms, constraints = laid(name)
    wish = asked(freedoms)
    room = room_of(wish)
    assert room.freedoms.holds(freedoms) and freedoms.holds(room.freedoms)
    found = topologies(room, "assembled", THINNEST)
    for own in found[:100]:
        held = ScrewSpace.of("wrenches", np.concatenate([borne(*limb, SIZES) for limb in limbs_of(own, room)]).T, 0.1)
        assert held.dimension == constraints.dimension and held.holds(constraints), own.name
    assert min(own.over for own in found) == OVER.get(name, 0)
    drafts = (draft(own, WishFile(wish=wish), room, "draft") for own in found[: 3 if freedoms.dimension else 0])
    plans = [plan_of(slim(with_rigid_bodies(own))) for own in drafts]
    gaps = [gap_of(questions(own, ", ".join(COMPLIANCES)).values({}).value, room) for own in plans]
    assert max(gaps, default=np.inf) > 10, (found[0].name, gaps)


def test_a_wrench_beside_couples_is_borne_by_no_limb_of_the_grammar():
    assert topologies(room_of(asked(laid("helical planar motion")[0])), "assembled", THINNEST) == []
