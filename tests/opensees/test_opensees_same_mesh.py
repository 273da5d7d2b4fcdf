"""The same meshes in OpenSeesPy (McKenna 2011), an independent finite-element code.

Euler-Bernoulli beams with consistent mass. OpenSees gives its beams the torsional inertia rho J, which for rectangles is
far too small; so the sections compared here have J = Iy + Iz, where both codes mean the same. With the right J the
modes without twist agree as well, which the last test shows.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flexura as fx
from flexura.structure import sections

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


@pytest.fixture
def polar_torsion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give rectangles the torsion constant J = Iy + Iz."""
    exact = sections._FORMULAS["rectangle"]

    def rectangle(*sizes: np.ndarray) -> sections.SectionProperties:
        properties = exact(*sizes)
        return properties._replace(J=properties.Iy + properties.Iz)

    monkeypatch.setitem(sections._FORMULAS, "rectangle", rectangle)


def both(mechanism: fx.Mechanism, n: int) -> tuple[np.ndarray, np.ndarray]:
    model = fx.assemble(mechanism)
    return fx.modes(mechanism, n=n, order="full").frequency_hz, OpenSeesMesh(model).frequencies(n)


def frame() -> fx.Mechanism:
    """A spatial frame with a closed loop, members off their nodes, and a rigid body on two arms."""
    bar = fx.Rectangle(width=0.02, thickness=0.01)
    corners = {"a": (0, 0, 0), "b": (0.3, 0, 0.1), "c": (0.3, 0.25, 0.2), "d": (0, 0.2, 0.3), "e": (0.1, 0.1, 0.5)}

    def link(i: str, j: str, **more: object) -> fx.Link:
        return fx.Link(
            nodes=(i, j), material="Al-6061-T6", section=bar, reference=(0.2, -0.5, 1.0), elements=4, **more
        )

    return fx.Mechanism(
        theory="euler_bernoulli",
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


@pytest.mark.usefixtures("polar_torsion")
def test_spatial_frame_with_loop_and_offsets(verify) -> None:
    own, other = both(frame(), 12)
    verify(Case("Spatial frame with a loop and offsets", SOURCE, THEORY), "mode", own, other, 1e-7)


@pytest.mark.usefixtures("polar_torsion")
def test_rpr_mechanism(verify) -> None:
    """184 elements, 177 nodes, offset leaves, four branches on a rigid platform."""
    mechanism = fx.load(RPR).model_copy(update={"theory": "euler_bernoulli"})
    own, other = both(mechanism, 24)
    case = Case("RPR mechanism with J = Iy + Iz", SOURCE, THEORY, "examples/rpr/rpr.yaml, full-order model")
    verify(case, "mode", own, other, 1e-7)


def test_modes_without_twist_agree_with_the_true_torsion_constant(verify) -> None:
    """The lift of the platform, and the amplifiers' own in-plane modes, do not twist anything."""
    mechanism = fx.load(RPR).model_copy(update={"theory": "euler_bernoulli"})
    own, other = both(mechanism, 12)
    untwisted = [3, 10, 11]
    case = Case("RPR mechanism, modes without twist", SOURCE, THEORY, "examples/rpr/rpr.yaml, full-order model")
    verify(case, "mode 4, 11, 12:", own[untwisted], other[untwisted], 1e-7)
