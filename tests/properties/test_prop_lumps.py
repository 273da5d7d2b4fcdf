"""Springs act where they say they act, and a superelement stands in for the substructure whose matrices it holds."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from flexura.full_order import assemble
from flexura.linalg import lowest
from flexura.mechanism import (
    Circle,
    CircularPattern,
    DiagonalStiffness,
    Instance,
    Link,
    Mechanism,
    MirrorPattern,
    RigidBody,
    Spring,
    Substructure,
    Superelement,
)
from flexura.reduction.low_order import reduce
from helpers.random_mechanisms import FEW, METALS, across, parts, section, vector

seeds = st.integers(0, 2**32 - 1)


def arm(d):
    """Return the matrix that carries a node's motion to the point at d from it: u + r x d, r."""
    D = np.eye(6)
    D[:3, 3:] = np.array([np.cross(r, d) for r in np.eye(3)]).T
    return D


@FEW
@given(seeds, st.booleans())
def test_a_spring_strains_at_its_point_which_is_midway_unless_given(seed, given_point):
    rng = np.random.default_rng(seed)
    a, b = np.array(vector(rng, 0.02)), np.array(vector(rng, 0.02))
    point = np.array(vector(rng, 0.02)) if given_point else (a + b) / 2
    bar = Link(
        nodes=("a", "b"), material="steel", section=section(rng, "tube"), reference=across(rng, b - a), elements=1
    )
    values = rng.uniform(1, 2, 6) * np.repeat([1e6, 1e2], 3)
    diagonal = DiagonalStiffness(**dict(zip(("tx", "ty", "tz", "rx", "ry", "rz"), values.tolist(), strict=True)))
    at = tuple(point.tolist()) if given_point else None
    plain = Mechanism(nodes={"a": tuple(a), "b": tuple(b)}, links={"bar": bar}, materials=METALS)
    spring = {"spring": Spring(nodes=("a", "b"), stiffness=diagonal, at=at)}
    sprung = Mechanism(nodes=plain.nodes, links=plain.links, springs=spring, materials=METALS)
    added = (assemble(sprung).K - assemble(plain).K).toarray()
    B = np.hstack([-arm(point - a), arm(point - b)])
    expected = B.T @ np.diag(values) @ B
    scale = 1 / np.sqrt(assemble(sprung).K.diagonal())
    assert abs((added - expected) * np.outer(scale, scale)).max() < 1e-12


@FEW
@given(parts(3, ()), seeds, st.sampled_from(["circular", "mirror"]))
def test_a_superelement_is_the_reduced_substructure_that_it_was_made_from(inside, seed, kind):
    """Copies are turned and mirrored, so that the matrices have to be turned and mirrored with them."""
    rng = np.random.default_rng(seed)
    ends = ("n0", "n2")
    rigid_roots = {"corrections": ("plate", "warping", "shear", "notch")}  # a superelement does not know its neighbours
    alone = reduce(Mechanism(**inside, materials=METALS, interface=ends, **rigid_roots))
    assert alone.order == 12
    K, M = (np.tril(A) + np.tril(A, -1).T for A in (alone.K, alone.M))
    block = Superelement(nodes=ends, stiffness=K.tolist(), mass=M.tolist())
    held = {name: inside["nodes"][name] for name in ends}
    pattern = {
        "circular": CircularPattern(count=3, axis=vector(rng, 1.0), centre=vector(rng, 0.01)),
        "mirror": MirrorPattern(normal=vector(rng, 1.0), point=vector(rng, 0.01)),
    }[kind]

    def around(part):
        rod = {"material": "steel", "section": Circle(diameter=3e-3), "elements": 2, "start_offset": (0, 0, 0.004)}
        return Mechanism(
            substructures={"part": part},
            instances={"part": Instance(of="part", at=(0.02, 0.01, 0.0), pattern=pattern)},
            nodes={"root": (0.1, 0.1, 0.1)},
            links={"rod": Link(nodes=("root", "part1.n2"), **rod)},
            bodies={"hub": RigidBody(carries=("part*.n0",), mass=0.05, inertia=(2e-6, 2e-6, 2e-6))},
            ground={"root": "clamped"},
            materials=METALS,
            **rigid_roots,
        )

    one = reduce(around(Substructure(**inside, interface=ends)))
    other = reduce(around(Substructure(nodes=held, superelements={"block": block}, interface=ends)))
    assert one.coordinate_names == other.coordinate_names
    values = [lowest(low.K, low.M, 10).values for low in (one, other)]
    np.testing.assert_allclose(values[0], values[1], rtol=1e-7)
