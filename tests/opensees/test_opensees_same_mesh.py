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
from helpers.frames import cantilever, frame

try:
    from helpers.opensees_mesh import OpenSeesMesh
except (ImportError, RuntimeError) as error:  # openseespy raises RuntimeError where a system library is missing
    pytest.skip(
        f"OpenSeesPy cannot be imported ({error}); on Debian it needs: apt-get install libblas3 liblapack3",
        allow_module_level=True,
    )

from helpers.verification_report import Case

RPR = Path(__file__).parents[2] / "examples" / "rpr" / "rpr.yaml"
SOURCE = "OpenSeesPy, elasticBeamColumn with -cMass, eigen -genBandArpack, on the same mesh"
THEORY = "Euler-Bernoulli, consistent mass"


def both(mechanism: fx.Mechanism, n: int) -> tuple[np.ndarray, np.ndarray]:
    model = fx.assemble(mechanism)
    return fx.modes(mechanism, n=n, order="full").frequency_hz, OpenSeesMesh(model).frequencies(n)


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
