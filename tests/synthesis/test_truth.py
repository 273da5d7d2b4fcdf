"""Freedoms by screw theory are those that stiffness shows: the thinner the webs, the further they are from the rest.

Screw theory is the limit of thin webs. Of every topology the gap grows without end as they are thinned, by four where
leaves and wires hold it, whose bending goes with the square of their thickness more than their stretch, by less where
necks or wires hold against leaves. The softest directions are then the wished ones, within an angle whose tangent is
one over the root of the gap: a positive matrix of two by two with a and b on its diagonal is turned by at most half
the angle of tangent 2 sqrt(a b) / (a - b).
"""

import numpy as np
import pytest

from flexura.full_order import assemble, plan_of
from flexura.mechanism import with_rigid_bodies
from flexura.study.questions import questions
from flexura.synthesis import WishFile, room_of, topologies
from flexura.synthesis.drafts import draft
from flexura.synthesis.limbs import PROFILES
from flexura.synthesis.screening import COMPLIANCES, _twists_about, clashes_of, gap_of
from synthesis.test_classics import wish

THINNER = (0.01, 0.0025)
MANY = 12


def apart(mechanism, room):
    """Gap, and the sine of the largest principal angle between the softest directions and those that are wished."""
    values = questions(plan_of(mechanism), ", ".join(COMPLIANCES)).values({}).value
    C, upper = np.zeros((6, 6)), np.triu_indices(6)
    C[upper] = C.T[upper] = values[0]
    scale = np.repeat([1.0, room.freedoms.length / 2], 3)
    wished, _ = np.linalg.qr(_twists_about(room) * scale[:, None])
    _, directions = np.linalg.eigh(C * scale[:, None] * scale)
    others = directions[:, : 6 - wished.shape[1]]
    return float(gap_of(values, room)[0]), float(np.linalg.norm(others.T @ wished, 2))


def has_links(kind):
    """Whether some of its members are thicker, by as many times however thin webs are."""
    return not all(PROFILES[profile].free for *_, profile in kind.members.values())


def thinned(mechanism, by):
    """The same with flexures that are so many times as thin as the thinnest."""
    sizes = {
        name: own.model_copy(update={"value": by * float(own.minimum), "minimum": None})
        if name.endswith(("_thickness", "_diameter", "_web"))
        else own
        for name, own in mechanism.parameters.items()
    }
    return mechanism.replaced({"parameters": sizes})


@pytest.mark.parametrize("process", ["assembled", "milled"])
@pytest.mark.parametrize(
    ("freedoms", "height"),
    [(["x"], 0.0), (["z"], 0.0), (["ry"], 0.02), (["rx", "ry", "z"], 0.036), (["rz"], 0.0), (["x", "y", "rz"], 0.0)],
    ids=lambda own: "-".join(own) if isinstance(own, list) else f"at {own}",
)
def test_wished_freedoms_are_the_softest_directions(freedoms, height, process):
    own = wish(freedoms, (0.0, 0.0, height), process=process)
    room = room_of(own)
    listed = topologies(room, process, 3e-4)
    listed = [own for own in listed if not any(has_links(p.kind) for p in own.patterns)]
    for topology in listed[:: len(listed) // MANY + 1]:
        drawn = with_rigid_bodies(draft(topology, WishFile(wish=own), room, "draft"))
        (gap, _), (wider, sine) = (apart(thinned(drawn, by), room) for by in THINNER)
        assert wider > 1.4 * gap, topology.name
        assert sine**2 * wider < 1 or wider < 1.5, topology.name


@pytest.mark.parametrize(
    ("freedoms", "height", "shape"),
    [
        (["rx", "ry", "z"], 0.036, "box"),
        (["x", "ry"], 0.0, "box"),
        (["x", "y", "rz"], 0.0, "cylinder"),
        (["z"], 0.0, "box"),
    ],
    ids=lambda own: "-".join(own) if isinstance(own, list) else str(own),
)
def test_mirrored_pairs_are_images_and_leave_free_what_is_wished(freedoms, height, shape):
    own = wish(freedoms, (0.0, 0.0, height), shape)
    room = room_of(own)
    found = [each for each in topologies(room, "assembled", 3e-4) if any(p.mirrored for p in each.patterns)]
    found = [each for each in found if not any(has_links(p.kind) for p in each.patterns)]
    assert found
    for topology in found[:: len(found) // MANY + 1]:
        assert " mirrored " in topology.name
        mechanism = draft(topology, WishFile(wish=own), room, "draft")
        assert clashes_of(mechanism) == (), topology.name
        plan = plan_of(with_rigid_bodies(mechanism))
        model, names = assemble(plan), list(plan.topology.node_names)
        for letter, pattern in zip("abc", topology.patterns, strict=False):
            if not pattern.mirrored:
                continue
            normal = room.turn @ pattern.site.axes[:, 0]
            image = np.eye(3) - 2 * np.outer(normal, normal)
            nodes = [name.removeprefix(f"{letter}1.") for name in names if name.startswith(f"{letter}1.")]
            one, other = (model.positions[[names.index(f"{letter}{k}.{node}") for node in nodes]] for k in (1, 2))
            assert np.abs(one @ image - other).max() < 1e-12 and np.abs(one - other).max() > 1e-3
        (gap, _), (wider, sine) = (apart(thinned(with_rigid_bodies(mechanism), by), room) for by in THINNER)
        assert wider > 1.4 * gap, topology.name
        assert sine**2 * wider < 1 or wider < 1.5, topology.name
