"""Topologies hold what they are to hold and nothing else, by Plücker coordinates that are worked out here."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flexura.synthesis import room_of, topologies
from flexura.synthesis.limbs import KINDS
from flexura.synthesis.search import _sane
from synthesis.test_classics import wish

DOFS = ("x", "y", "z", "rx", "ry", "rz")


def line(point, direction):
    """A force along a line."""
    return np.concatenate([direction, np.cross(point, direction)])


def couple(direction):
    return np.concatenate([np.zeros(3), direction])


def borne(kind, head, axes, held, sizes):
    """Wrenches of a limb about the origin of the room by what textbooks say of it (Blanding 1999); the centre of those
    that turn about a wished axis is as far along d as is held, of a pivot half as far."""
    m, e, d = axes.T
    centre = head + (0.5 if kind in ("crossed pivot", "cartwheel") else 1.0) * held * d
    middle = head + sizes.get("radius", 0.0) * d
    forces = [line(middle, own) for own in (m, e, d)]
    two = [head + s * 0.005 * m for s in (1, -1)]
    return np.array(
        {
            "wire": [line(head, d)],
            "necked rod": [line(head, d)],
            "leaf": [line(head, d), line(head, e), couple(m)],
            "folded leaf": [line(head + sizes.get("length", 0.0) * d, e)],
            "leaf folded on the axis": [line(centre, e)],
            "folded leaf pair": [line(own + sizes.get("length", 0.0) * d, e) for own in two],
            "leaf pair": [own for at in two for own in (line(at, d), line(at, e), couple(m))],
            "notch": [*forces, couple(m), couple(d)],
            "round neck": forces,
            "folded guide": [line(head, e), line(head, d), couple(m), couple(e), couple(d)],
            "crossed guides": [line(head, e), couple(m), couple(e), couple(d)],
            "notched link": [line(head, d), line(head, e), couple(m), couple(d)],
            "three-notch chain": [line(head, e), couple(m), couple(d)],
            "post on a notch": [*(line(centre, own) for own in (m, e, d)), couple(m), couple(d)],
            "post on a round neck": [line(centre, own) for own in (m, e, d)],
            "crossed pivot": [*(line(centre, own) for own in (m, e, d)), couple(m), couple(d)],
            "cartwheel": [*(line(centre, own) for own in (m, e, d)), couple(m), couple(d)],
            "delta arm": [couple(m)],
            "linear delta arm": [couple(m)],
        }[kind]
    )


def limbs_of(topology, room):
    """Each limb as kind, head, axes and what is held, turned about the middle of the platform."""
    centre = np.array([*room.middle[:2], 0.0])
    for p in topology.patterns:
        c, s = np.cos(p.site.azimuth), np.sin(p.site.azimuth)
        r = p.site.reach * p.site.out
        head = np.array([r * c, r * s, p.site.height])
        for k in range(p.count):
            a = 2 * np.pi * k / p.count
            turn = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
            if p.mirrored and k:  # in the plane across the way to the head
                turn = np.eye(3) - 2 * np.outer([c, s, 0.0], [c, s, 0.0])
            yield p.kind.name, centre + turn @ head, turn @ p.axes, p.held


def twists(names, about):
    own = []
    for name in names:
        d = np.eye(3)["xyz".index(name[-1])]
        own.append([*np.cross(about, d), *d] if name[0] == "r" else [*d, 0.0, 0.0, 0.0])
    return np.array(own).reshape(-1, 6)


def rounded(x):
    return np.round(np.ravel(x), 6) + 0.0


SIZES = {"length": 0.0113, "radius": 0.0017}

subsets = st.sets(st.sampled_from(DOFS), max_size=5)
planes = st.sampled_from(["z-", "z+", "x-", "x+", "y-", "y+"])
shapes = st.sampled_from(["cylinder", "box"])
processes = st.sampled_from(["assembled", "milled", "printed", "wire-cut"])
heights = st.sampled_from([0.0, 0.01, 0.032, 0.036, 0.08])


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(subsets, heights, st.sampled_from([0.0, 0.01, -0.05]), shapes, processes)
def test_limbs_bear_what_is_not_wished_and_nothing_else(freedoms, height, aside, shape, process):
    about = (aside, 0.0, height)
    room = room_of(wish(sorted(freedoms), about, shape, process=process))
    F = twists(sorted(freedoms), np.array(about))
    for own in topologies(room, process, 3e-4)[:200]:
        W = np.concatenate([borne(*limb, SIZES) for limb in limbs_of(own, room)])
        assert np.abs(F @ np.concatenate([W[:, :3], W[:, 3:]], axis=1).T).max(initial=0.0) < 1e-9, own.name
        size = np.repeat([1.0, 0.06], 3)
        assert np.linalg.matrix_rank(W / size, 1e-5) == 6 - len(freedoms), own.name
        assert own.over == len(W) - (6 - len(freedoms))


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(subsets, heights, planes, shapes, processes)
def test_any_wish_is_answered_and_the_same_when_it_is_turned(freedoms, height, plane, shape, process):
    """Permuted axes with another base plane are the same wish."""
    room = room_of(wish(sorted(freedoms), (0.0, 0.0, height), shape, process=process))
    to = {  # columns are the axes of the room in the global frame
        "z-": np.eye(3),
        "z+": np.diag([1.0, -1.0, -1.0]),
        "x-": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
        "x+": np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]]),
        "y-": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]),
        "y+": np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]]),
    }[plane]
    name = {own: "xyz"[int(np.argmax(np.abs(to[:, "xyz".index(own)])))] for own in "xyz"}
    turned = [own[:-1] + name[own[-1]] for own in sorted(freedoms)]
    edges = tuple(float(own) for own in np.abs(to @ np.array([0.06, 0.06, 0.04])))
    again = wish(turned, tuple(float(own) for own in to @ [0.0, 0.0, height]), shape, plane, process)
    again = again.model_copy(update={"envelope": edges})
    _sane(room)
    found = [own.name for own in topologies(room, process, 3e-4)]
    assert len(found) == len(set(found))
    assert found == [own.name for own in topologies(room_of(again), process, 3e-4)]


@pytest.mark.parametrize("freedoms", [["x"], ["rz"], ["x", "y", "rz"], ["ry"]])
def test_no_two_topologies_are_images_of_each_other(freedoms):
    """By rows of kinds, heads, axes and far ends in all quarter turns and mirrors that leave the freedoms alone."""
    room = room_of(wish(freedoms))
    F = twists(freedoms, np.zeros(3))
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    images = [np.linalg.matrix_power(quarter, k) @ np.diag([1.0, s, 1.0]) for k in range(4) for s in (1.0, -1.0)]

    def leaves_alone(S):
        moved = np.concatenate([F[:, :3] @ S.T, np.linalg.det(S) * F[:, 3:] @ S.T], axis=1)
        return np.linalg.matrix_rank(np.concatenate([F, moved]), 1e-9) == len(F)

    images = [S for S in images if leaves_alone(S)]
    assert len(images) > 1
    seen = {}
    for own in topologies(room, "assembled", 3e-4):
        rows = []
        of = [each for each in own.patterns for _ in range(each.count)]
        for p, (kind, head, axes, _) in zip(of, limbs_of(own, room), strict=True):
            sizes = {name: 1.0 + 0.1 * k for k, name in enumerate(KINDS[kind].sizes)}
            rows.append(
                (kind, p.site.where, head, axes @ p.kind.points(sizes)[p.kind.feet[0]], axes[:, 1], p.kind.width)
            )

        def key(S, rows=rows):
            return tuple(
                sorted(
                    (
                        kind,
                        where,
                        *np.round(S @ head, 6) + 0.0,
                        *np.round(S @ foot, 6) + 0.0,
                        *(np.round(np.outer(S @ e, S @ e), 6).ravel() + 0.0 if wide else ()),
                    )
                    for kind, where, head, foot, e, wide in rows
                )
            )

        keys = {key(S) for S in images}
        assert not keys & seen.keys(), (own.name, seen[next(iter(keys & seen.keys()))])
        seen |= dict.fromkeys(keys, own.name)
