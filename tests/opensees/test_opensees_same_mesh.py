"""The same meshes in OpenSeesPy (McKenna 2011), an independent finite-element code.

Euler-Bernoulli beams with consistent mass in both programs, which so solve the same matrix eigenproblem and differ
by round-off only. How the torsional inertia is made the same is said in `opensees_mesh`.

Tolerances: 1e-9, and 1e-6 for the RPR mechanism. Its diagonally scaled stiffness has a condition number of 1.3e10, so
that rounding the entries of K, which the two programs form in different ways, may move the lowest frequencies by some
1e-7 (1.4e-7 is seen in the second, 1e-8 and less from the seventh on).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.linalg import lowest
from flexura.reduction.low_order import reduce

try:
    from opensees_mesh import OpenSeesMesh
except (ImportError, RuntimeError) as error:  # openseespy raises RuntimeError where a system library is missing
    pytest.skip(
        f"OpenSeesPy cannot be imported ({error}); on Debian it needs: apt-get install libblas3 liblapack3",
        allow_module_level=True,
    )

from verification_report import Case

RPR = Path(__file__).parents[2] / "examples" / "rpr" / "rpr.yaml"
SOURCE = "OpenSeesPy, elasticBeamColumn with -cMass, eigen -genBandArpack, on the same mesh"
THEORY = "Euler-Bernoulli, consistent mass"


def both(mechanism: fx.Mechanism, n: int) -> tuple[np.ndarray, np.ndarray]:
    model = fx.assemble(mechanism)
    return fx.modes(mechanism, n=n, order="full").frequency_hz, OpenSeesMesh(model).frequencies(n)


def frame() -> fx.Mechanism:
    """A spatial frame with a closed loop, members off their nodes, and a rigid body on two arms."""
    bar = fx.Rectangle(width=0.02, thickness=0.01)
    corners = {"a": (0, 0, 0), "b": (0.3, 0, 0.1), "c": (0.3, 0.25, 0.2), "d": (0, 0.2, 0.3), "e": (0.1, 0.1, 0.5)}

    def link(i: str, j: str, **more: object) -> fx.Link:
        return fx.Link(nodes=(i, j), material="Al-6061-T6", section=bar, reference=(0.2, -0.5, 1.0), elements=4, **more)

    return fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        nodes=corners,
        links={
            "ab": link("a", "b", end_offset=(0.0, 0.01, 0.02)),
            "bc": link("b", "c", start_offset=(0.0, 0.0, 0.015), end_offset=(-0.01, 0.0, 0.0)),
            "cd": link("c", "d"),
            "da": link("d", "a", start_offset=(0.0, 0.0, -0.01)),
            "ce": link("c", "e"),
        },
        bodies={"block": fx.RigidBody(centre=(0.1, 0.1, 0.56), mass=0.4, inertia=(3e-4, 2e-4, 4e-4), carries=("e",))},
        ground={"a": fx.Support(fixed=fx.DOF_NAMES), "d": fx.Support(free=("rx", "rz"))},
    )


def cantilever() -> fx.Mechanism:
    """A beam that lies skew in space, its section turned about its axis."""
    bar = fx.Rectangle(width=0.012, thickness=0.005)
    return fx.Mechanism(
        theory="euler_bernoulli",
        corrections="none",
        nodes={"a": (0, 0, 0), "b": (0.2, 0.1, 0.05)},
        links={
            "bar": fx.Link(nodes=("a", "b"), material="Al-6061-T6", section=bar, reference=(0.2, -0.4, 1), elements=10)
        },
        ground={"a": fx.Support(fixed=fx.DOF_NAMES)},
    )


def test_cantilever(verify) -> None:
    own, other = both(cantilever(), 12)
    verify(Case("Cantilever in OpenSees", SOURCE, THEORY), "mode", own, other, 1e-9)


def test_spatial_frame_with_loop_and_offsets(verify) -> None:
    own, other = both(frame(), 12)
    verify(Case("Spatial frame with a loop and offsets in OpenSees", SOURCE, THEORY), "mode", own, other, 1e-9)


def test_rpr_mechanism(verify) -> None:
    """184 elements, offset leaves, four branches on a rigid platform."""
    mechanism = fx.load(RPR).model_copy(update={"theory": "euler_bernoulli"})
    own, other = both(mechanism, 24)
    case = Case("RPR mechanism in OpenSees", SOURCE, THEORY, "examples/rpr/rpr.yaml, full-order model")
    verify(case, "mode", own, other, 1e-6)
    every = reduce(mechanism, keep=1_000_000)
    assert every.order == fx.assemble(mechanism).order
    reduced = np.sqrt(lowest(every.K, every.M, 12).values) / (2 * np.pi)
    np.testing.assert_allclose(reduced, own[:12], rtol=1e-6)
