"""Orders, places and signs that round-off cannot change."""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from flexura.linalg import leading, ranked, turned


@pytest.mark.parametrize("noise", [0.0, 1e-9, -1e-9])
def test_equal_sizes_keep_their_order(noise):
    sizes = np.array([1 / 128, 0.5, 3.0, 0.5 * (1 + noise), 3.0 * (1 + noise), 1 / 128 * (1 + noise), 0.0, 0.0])
    assert ranked(sizes).tolist() == [2, 4, 1, 3, 0, 5, 6, 7]
    assert ranked(-sizes).tolist() == [6, 7, 0, 5, 1, 3, 2, 4]
    assert leading(sizes) == 2
    assert leading(-sizes[:6]) == 0
    assert leading(np.stack([sizes, sizes * (1 + noise), 2 * sizes]), axis=0).tolist() == [2] * 6 + [0, 0]


def test_unequal_sizes_are_sorted_and_nothing_is_nothing():
    assert ranked([1.0, 1.0 + 1e-5, 2.0]).tolist() == [2, 1, 0]
    assert ranked([]).tolist() == []


@pytest.mark.parametrize("noise", [0.0, 1e-9, -1e-9])
def test_signs_of_vectors(noise):
    v = np.array([[0.1, -0.2], [-1.0, 0.7], [1.0 + noise, 0.7 + noise]])
    assert np.array_equal(turned(v), v * [-1, 1])
    assert np.array_equal(turned(v[:, 0]), -v[:, 0])
    assert np.array_equal(turned(1j * v[:, 0] - v[:, 0]), 1j * v[:, 0] - v[:, 0])
    assert np.array_equal(turned(np.zeros(3)), np.zeros(3))


def parallel(names):
    """A table on equal leaves."""
    x = {name: 0.02 * k for k, name in enumerate(names)}
    blade = fx.describe.Leaf(width=0.02, thickness=0.5e-3)
    return fx.Mechanism(
        nodes={f"{n}_low": (at, 0, 0) for n, at in x.items()} | {f"{n}_high": (at, 0, 0.06) for n, at in x.items()},
        flexures={
            n: fx.describe.Flexure(
                nodes=(f"{n}_low", f"{n}_high"), material="spring-steel", reference=(1, 0, 0), profile=blade
            )
            for n in names
        },
        bodies={
            "table": fx.describe.RigidBody(
                centre=(0.01 * (len(names) - 1), 0, 0.06),
                mass=0.1,
                inertia=(1e-4, 1e-4, 1e-4),
                carries=tuple(f"{n}_high" for n in names),
            )
        },
        ground={f"{n}_low": "clamped" for n in names},
    )


@pytest.mark.parametrize("names", [("a", "b"), ("b", "a")])
def test_equal_leaves_are_told_in_the_order_of_the_description(names):
    mechanism = parallel(names)
    first, second = names
    said = fx.modes(mechanism, n=1).modes[0].motion.summary
    assert said == f"table moves along x ({first}: thickness bending 50%, {second}: thickness bending 50%)"
    state = fx.preload(mechanism, loads={"table": (1, 0, 0, 0, 0, 0)})
    stresses = fx.models.member_stresses(state.model, state.displacement_vector)
    assert [m.name for m in stresses.members] == list(names)
    assert stresses.members[0].position == 0.0  # as much at the other end
