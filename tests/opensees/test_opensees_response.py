"""Statics and time response against OpenSeesPy (McKenna 2011) on the same meshes, as in test_opensees_same_mesh.

Static displacements differ by round-off. In time a cantilever is compared: OpenSees' transient analysis of the frame
grows without bound, although its own frequencies of the same mesh agree with ours. OpenSees integrates with the
trapezoidal rule (Newmark 1959, gamma 1/2, beta 1/4), which is generalised-alpha with rho_infinity = 1 (Chung and
Hulbert 1993): both programs take the same steps, and what they find differs by round-off too. Against the exact time
response the trapezoidal rule has an error of order (omega dt)^2: tolerance 1e-3 of the largest displacement at 1/300 of
the first period.
"""

from __future__ import annotations

import numpy as np
import pytest

import flexura as fx
from helpers.verification_report import Case

try:
    from helpers.opensees_mesh import OpenSeesMesh, ops
except (ImportError, RuntimeError) as error:  # openseespy raises RuntimeError where a system library is missing
    pytest.skip(f"OpenSeesPy cannot be imported ({error})", allow_module_level=True)

from helpers.frames import cantilever, frame

SOURCE = "OpenSeesPy, elasticBeamColumn with -cMass, on the same mesh"
CASE = Case("Spatial frame under loads in OpenSees", SOURCE, "Euler-Bernoulli, consistent mass")
LOAD = (3.0, -2.0, 5.0, 0.02, 0.05, -0.04)
ALPHA, BETA = 4.0, 2e-5


@pytest.fixture(scope="module")
def mesh():
    mesh = OpenSeesMesh(fx.assemble(frame()))
    mesh.build()
    return mesh


def node_tag(name: str) -> int:
    return int(fx.assemble(frame()).plan.topology.numbers([name])[0]) + 1


def test_static_displacements(mesh, verify) -> None:
    mesh.build()
    tag = node_tag("block")
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(tag, *LOAD)
    ops.system("BandGeneral")
    ops.numberer("RCM")
    ops.integrator("LoadControl", 1.0)
    ops.algorithm("Linear")
    ops.analysis("Static")
    assert ops.analyze(1) == 0
    reference = [ops.nodeDisp(tag, k + 1) for k in range(6)]
    ours = fx.statics(frame(), loads={"block": LOAD}).displacement("block")
    verify(CASE, "translation of the block, x y z", list(1e3 * ours[:3]), [1e3 * x for x in reference[:3]], 1e-9, "mm")
    verify(CASE, "rotation of the block, x y z", list(1e3 * ours[3:]), [1e3 * x for x in reference[3:]], 1e-9, "mrad")


def newmark(signal: np.ndarray, dt: float) -> np.ndarray:
    """Displacement (N,) of the cantilever's tip along z under a force along z there."""
    model = fx.assemble(cantilever())
    OpenSeesMesh(model).build()
    tag = int(model.plan.topology.numbers(["b"])[0]) + 1
    ops.rayleigh(ALPHA, BETA, 0.0, 0.0)
    ops.timeSeries("Path", 1, "-dt", dt, "-values", *map(float, signal))
    ops.pattern("Plain", 1, 1)
    ops.load(tag, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    ops.system("BandGeneral")
    ops.numberer("RCM")
    ops.algorithm("Linear")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    found = [0.0]
    for _ in range(len(signal) - 1):
        assert ops.analyze(1, dt) == 0
        found.append(ops.nodeDisp(tag, 3))
    return np.array(found)


def test_time_response(verify) -> None:
    first = fx.modes(cantilever(), n=1, order="full").frequency_hz[0]
    dt = 1 / (300 * first)
    signal = fx.signals.half_sine(20.0, 0.3 / first, at=dt)(dt * np.arange(1500))
    reference = newmark(signal, dt)
    omega = 2 * np.pi * first * np.array([1.0, 6.0])
    zeta = (ALPHA / omega + BETA * omega) / 2
    how = {
        "outputs": ["b.tz"],
        "dt": dt,
        "damping": {"rayleigh": {"frequencies": tuple(omega / (2 * np.pi)), "ratios": tuple(zeta)}},
    }
    model = fx.assemble(cantilever())
    same = fx.time_response(model, inputs={"b.tz": signal}, method="generalised_alpha", rho_infinity=1.0, **how).of(
        "b.tz"
    )
    exact = fx.time_response(model, inputs={"b.tz": signal}, **how).of("b.tz")
    largest = np.abs(reference).max()
    at = [200, 700, 1499]
    case = Case("Cantilever under a pulse in OpenSees", SOURCE, "Euler-Bernoulli, consistent mass")
    verify(case, "tip after 200, 700, 1499 steps", list(1e3 * same[at]), list(1e3 * reference[at]), 1e-9, "mm")
    assert np.abs(same - reference).max() < 1e-10 * largest
    assert np.abs(exact - reference).max() < 1e-3 * largest
