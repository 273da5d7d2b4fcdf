"""What a limb of each kind bears by screw theory is what it is stiff against, and its strain is about that of its
stroke."""

import numpy as np
import pytest

import flexura as fx
from flexura.full_order import plan_of
from flexura.mechanism import with_rigid_bodies
from flexura.study.questions import questions
from flexura.synthesis import Topology, WishFile, room_of
from flexura.synthesis.bending import _strains
from flexura.synthesis.drafts import draft
from flexura.synthesis.limbs import KINDS
from flexura.synthesis.patterns import Pattern, sites
from flexura.synthesis.screening import COMPLIANCES
from synthesis.test_classics import wish
from synthesis.test_drafts import slim

THINNEST = 1e-4
HELD = 0.06
YOUNG = 71.7e9
SIZE = 0.05
"""Length over which rotations are counted, m."""


def alone(kind):
    """A limb below the middle of a platform, leading down, with its room and mechanism."""
    own = wish([], (0.0, 0.0, 0.12))
    make = own.make.model_copy(update={"thinnest": THINNEST})
    own = own.model_copy(update={"envelope": (0.2, 0.2, 0.15), "make": make})
    room = room_of(own)
    (site,) = (own for own in sites(room, 1) if not own.reach)
    axes = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
    topology = Topology((Pattern(kind, site, axes, 1, 0.12, 0.1, np.zeros((6, 0)), held=HELD),), 0, kind.name)
    np.testing.assert_allclose(site.head(room), room.about)
    return topology, draft(topology, WishFile(wish=own), room, "alone")


def compliance_at_head(topology, plan):
    """Compliance (6, 6) of the head along (m, e, d)."""
    C = np.zeros((6, 6))
    C[np.triu_indices(6)] = questions(plan, ", ".join(COMPLIANCES)).values({}).value[0]
    axes = np.kron(np.eye(2), topology.patterns[0].axes)
    return axes.T @ (C + np.triu(C, 1).T) @ axes


def freedoms(kind, sizes):
    """Free twists (6, f) and the others of the head, rotations times the length."""
    W = kind.bears(sizes) / np.repeat([1.0, SIZE], 3)[:, None]
    U = np.linalg.svd(W)[0]
    return U[:, W.shape[1] :], U[:, : W.shape[1]]


def sizes_of(kind, mechanism):
    sizes = {name: float(mechanism.parameters[f"a_{name}"].value) for name in kind.sizes if name != kind.pinned}
    return sizes | ({kind.pinned: HELD} if kind.pinned else {})


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda own: own.name)
def test_limbs_are_soft_in_what_they_leave_free_and_in_nothing_else(kind):
    topology, mechanism = alone(kind)
    thin = slim(with_rigid_bodies(mechanism))
    C = compliance_at_head(topology, plan_of(thin))
    free, rest = freedoms(kind, sizes_of(kind, thin))
    scale = np.repeat([1.0, SIZE], 3)
    C = C * scale[:, None] * scale
    assert np.linalg.eigvalsh(free.T @ C @ free)[0] > 10 * np.linalg.eigvalsh(rest.T @ C @ rest)[-1]


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda own: own.name)
def test_strains_are_those_of_statics(kind):
    """Within a third, of each freedom, where the first has the concentration of notches and stiffer plates."""
    topology, mechanism = alone(kind)
    plan = plan_of(with_rigid_bodies(mechanism))
    C = compliance_at_head(topology, plan)
    sizes = sizes_of(kind, mechanism)
    of_twist = _strains(topology.patterns[0], {name: np.array([own]) for name, own in sizes.items()})
    free, _ = freedoms(kind, sizes)
    axes = np.kron(np.eye(2), topology.patterns[0].axes)
    for twist in (1e-6 * free / np.repeat([1.0, SIZE], 3)[:, None]).T:
        load = axes @ np.linalg.solve(C, twist)
        strain = fx.statics(plan, loads={"about": load}).stresses().members[0].von_mises / YOUNG
        assert strain == pytest.approx(np.abs(of_twist @ twist).sum(axis=-1).max(), rel=1 / 3)
