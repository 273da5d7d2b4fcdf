"""The stiffness about a displaced state follows from an energy, whatever the mechanism."""

from __future__ import annotations

import numpy as np
from hypothesis import given

import flexura as fx
from flexura.analysis.strain.tangent import tangent_stiffness
from flexura.beam import skew
from flexura.structure.assembly import full_order
from helpers.random_mechanisms import FEW, mechanisms


def hat(model, u):
    """W (n, n): W v is the cross product of the rotations in u with those in v, node by node."""
    dof = model.plan.topology.dof[:, 3:]
    W = np.zeros((model.order + 1, model.order + 1))
    for own in dof[(dof >= 0).any(axis=1)]:
        W[np.ix_(own, own)] = skew(np.append(u, 0.0)[own])
    return W[:-1, :-1]


@FEW
@given(mechanisms())
def test_tangents_follow_from_an_energy(mechanism):
    follow_from_an_energy(mechanism)


def test_tangents_follow_from_an_energy_where_stubby_members_meet_askew():
    """Their roots couple stretching with bending."""
    nodes = {"a": (-0.0008, 0.0017, 0.0201), "b": (0.0014, 0.0191, 0.0214), "c": (0.0185, 0.0187, -0.0017)}
    bar, tube = (
        fx.describe.Rectangle(width=2e-3, thickness=3e-3),
        fx.describe.Tube(outer_diameter=5.4e-3, inner_diameter=3.7e-3),
    )
    made = {"ab": (bar, (0.47, 0.02, -0.88)), "ac": (bar, (-0.54, 0.79, 0.29)), "bc": (tube, (-0.85, -0.51, -0.1))}
    links = {
        name: fx.describe.Link(nodes=tuple(name), material="Al-7075-T6", reference=reference, section=section)
        for name, (section, reference) in made.items()
    }
    follow_from_an_energy(fx.Mechanism(nodes=nodes, links=links, ground={"a": "clamped"}))


def follow_from_an_energy(mechanism):
    """K_t(0) = K, K_t is symmetric, and its first-order change is a third derivative: symmetric in u and v.

    Rotations about the displaced state change the rotation vector by a + (a x u)/2, which is taken off. Springs, and
    what strips share, stay as they are.
    """
    try:
        model = fx.assemble(mechanism)
        K = model.K.toarray()
        d = 1 / np.sqrt(K.diagonal())
        at_rest = tangent_stiffness(model, np.zeros(model.order)).toarray()
    except fx.OptionError as error:
        assert "off a body's centre" in str(error)
        return
    np.testing.assert_allclose(d[:, None] * at_rest * d, d[:, None] * K * d, atol=1e-12)
    springs = full_order(model.plan).with_shared_warping(model.design)[0].toarray()
    u, v = np.random.default_rng(1).normal(size=(2, model.order)) * d
    step = 1e-4 / np.abs(u).max()

    def change(state, other):
        ahead, behind = (tangent_stiffness(model, s * step * state).toarray() for s in (1, -1))
        np.testing.assert_array_equal(ahead, ahead.T)
        turned = (K - springs) @ hat(model, state)
        return ((ahead - behind) / (2 * step) + (turned + turned.T) / 2) @ other

    one, other = change(u, v), change(v, u)
    assert np.abs(d * (one - other)).max() < 1e-5 * np.abs(d * one).max()
