"""Drafts are mechanism files whose freedoms are those that were wished, and whose parts do not clash."""

import pytest

import flexura as fx
from flexura.full_order import plan_of
from flexura.mechanism import with_rigid_bodies
from flexura.modelfile import dumps, loads
from flexura.study.questions import questions
from flexura.synthesis import WishFile, room_of, topologies
from flexura.synthesis.drafts import draft
from flexura.synthesis.screening import COMPLIANCES, gap_of
from synthesis.test_classics import layer, wish

THINNEST = 1e-4
"""Web, m, that makes flexures slender in an envelope of 0.2 m."""

LAYER_WEB = 1e-6
"""Web, m, that makes flexures slender in a layer of 1 mm."""

INTERNAL = {"folded guide": 1, "folded leaf": 1}
"""Freedoms of a limb that leave platform and base at rest: of the block of a guide, and of a corner."""


def drafted(freedoms, about, process, most):
    """The first so many topologies, of each kinds and counts and places one, with their room and mechanism."""
    own = wish(freedoms, about, process=process)
    own = own.model_copy(
        update={"envelope": (0.2, 0.2, 0.15), "make": own.make.model_copy(update={"thinnest": THINNEST})}
    )
    room = room_of(own)
    seen = {}
    for topology in topologies(room, process, THINNEST):
        seen.setdefault(tuple((p.kind.name, p.count, p.site.where) for p in topology.patterns), topology)
    for topology in list(seen.values())[:most]:
        yield topology, room, draft(topology, WishFile(wish=own), room, "draft")


def slim(mechanism):
    """The same with its thinnest flexures; leaves, notches, which bend over so little, and leaves beside wires, which
    are as soft along themselves as leaves across, with a third, a thirtieth and a tenth of that."""
    sizes = mechanism.parameters

    def thin(name):
        letter, size = name.split("_", 1)
        beside = size == "thickness" and f"{letter}_diameter" in sizes
        return 1 / 30 if size == "web" else 0.1 if beside else 0.3 if size == "thickness" else 1.0

    least = {
        name: thin(name) * float(own.minimum)
        for name, own in sizes.items()
        if name.endswith(("_thickness", "_diameter", "_web"))
    }
    return mechanism.replaced(
        {
            "parameters": {
                k: p.model_copy(update={"value": least[k], "minimum": least[k]}) if k in least else p
                for k, p in sizes.items()
            }
        }
    )


WISHES = [
    (["x"], (0.0, 0.0, 0.135)),
    (["z"], (0.0, 0.0, 0.135)),
    (["ry"], (0.0, 0.0, 0.225)),
    (["rx", "ry", "z"], (0.0, 0.0, 0.135)),
    (["rx", "ry"], (0.0, 0.0, 0.12)),
    (["rz"], (0.0, 0.0, 0.0)),
    (["x", "y", "rz"], (0.0, 0.0, 0.135)),
    (["x", "y", "z"], (0.0, 0.0, 0.135)),
    (["ry"], (0.0, 0.0, 0.08)),
    (["rx", "ry", "rz"], (0.0, 0.0, 0.06)),
    ([], (0.0, 0.0, 0.0)),
]


@pytest.mark.parametrize("process", ["assembled", "milled"])
@pytest.mark.parametrize(("freedoms", "about"), WISHES, ids=lambda own: "-".join(map(str, own)) or "none")
def test_drafts_are_free_as_wished_and_clear_of_themselves(freedoms, about, process):
    for topology, room, mechanism in drafted(freedoms, about, process, 4):
        again = loads(dumps(mechanism))
        assert dumps(again) == dumps(mechanism)
        assert not [own.text for own in fx.check(again).clashes], topology.name
        names = {p.kind.name for p in topology.patterns}
        plan = plan_of(slim(with_rigid_bodies(again)))
        if freedoms:
            gap = gap_of(questions(plan, ", ".join(COMPLIANCES)).values({}).value, room)
            assert gap > 10, topology.name
        if names <= {"wire", "leaf", "folded leaf", "folded guide"}:
            found = fx.constraints(plan)
            internal = sum(INTERNAL.get(p.kind.name, 0) * p.count for p in topology.patterns)
            assert len(found.freedoms) + found.internal - internal == len(freedoms), topology.name


@pytest.mark.parametrize("freedoms", [["x"], ["x", "y", "rz"]])
def test_drafts_of_a_thin_layer_are_free_as_wished_and_clear_of_themselves(freedoms):
    own = layer(freedoms)
    own = own.model_copy(update={"make": own.make.model_copy(update={"thinnest": LAYER_WEB})})
    room = room_of(own)
    for topology in topologies(room, "printed", LAYER_WEB):
        leads_out = all(abs(p.site.axes[:, 0] @ p.axes[:, 2]) > 0.99 for p in topology.patterns)
        if leads_out and {p.kind.name for p in topology.patterns} <= {"leaf pair", "folded guide", "folded leaf pair"}:
            mechanism = draft(topology, WishFile(wish=own), room, "layer")
            assert not [each.text for each in fx.check(mechanism).clashes], topology.name
            plan = plan_of(slim(with_rigid_bodies(mechanism)))
            gap = gap_of(questions(plan, ", ".join(COMPLIANCES)).values({}).value, room)
            assert gap > 10, topology.name


def test_first_sizes_are_within_their_limits():
    for _, _, mechanism in drafted(["x", "y"], (0.0, 0.0, 0.0), "wire-cut", 4):
        for own in mechanism.parameters.values():
            low, value, high = (float(str(x)) for x in (own.minimum, own.value, own.maximum))
            assert low < value < high
