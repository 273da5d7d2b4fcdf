"""A parallel guide over its stroke beside exudyn's geometrically exact beams: time at equal error, and agreement.

    pip install 'exudyn>=1.13'
    python benchmarks/stroke_exudyn.py

Two leaves 100 x 30 x 0.5 mm with a carriage of 0.3 kg, 41 poses over +-10 mm, six frequencies about each with the
carriage free. Errors are those of the six frequencies at 10 mm against the equations of rods integrated without
elements (the same as in tests/motion/test_large_motion_cases.py). exudyn (J. Gerstmayr, github.com/jgerstmayr/EXUDYN)
moves the carriage by a constraint, one static solution a pose, and finds eigenvalues by its ComputeODE2Eigenvalues,
sparse, which is quicker than dense and loses no digits of the first one. Its joints add no stiffness by their forces
there, so that the arms of the carriage are beams too, very stiff ones; what they give way is extrapolated away where
converged numbers are compared. Leaves have next to no mass, as in the reference. One BLAS thread; times are medians of
repeated runs.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import sys
import time
from collections.abc import Callable
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

import flexura as fx
from flexura.motion import NO_LOADS, Drive, Equations, MovingModel, Path, Point, Pose, Stopped

try:
    import exudyn as exu
    import exudyn.itemInterface
except ImportError:
    sys.exit("skipped: exudyn is not installed; pip install 'exudyn>=1.13' gets it")

Array = NDArray[np.float64]

REACH, SIDE, MODES, RUNS = 0.01, 20, 6, 5
LENGTH, WIDTH, THICKNESS, APART = 0.1, 0.03, 0.0005, 0.06
E, NU, SHEAR, J, DENSITY = 210e9, 0.3, 5 / 6, 1.236875e-12, 0.1
ARMS = 1e9
"""Stiffness, N, of the arms; their bending stiffness is a thousandth of it, N m^2."""

REFERENCE = np.array([11.609, 123.344, 168.487, 537.053, 670.926, 823.899])
"""Hz, at 10 mm."""

GUIDE = f"""
flexura: 1
name: guide
theory: timoshenko
corrections: none
materials: {{steel: {{E: {E} Pa, nu: {NU}, rho: {DENSITY} kg/m^3}}}}
sections:
  leaf: {{shape: constants, A: 15 mm^2, Iy: 1125 mm^4, Iz: 0.3125 mm^4, J: {J} m^4, ky: {SHEAR}, kz: {SHEAR}}}
nodes: {{a: [0, 0, 0], b: [0, 60 mm, 0], c: [100 mm, 0, 0], d: [100 mm, 60 mm, 0]}}
links:
  left: {{nodes: [a, c], material: steel, section: leaf, reference: z, elements: ELEMENTS}}
  right: {{nodes: [b, d], material: steel, section: leaf, reference: z, elements: ELEMENTS}}
bodies:
  carriage:
    centre: [100 mm, 30 mm, 0]
    mass: 0.3 kg
    inertia: [4e-4 kg*m^2, 2e-4 kg*m^2, 4e-4 kg*m^2]
    carries: [c, d]
ground: {{a: clamped, b: clamped}}
"""


class Flexura:
    """The guide with so many elements a leaf."""

    def __init__(self, elements: int) -> None:
        design = fx.assemble(fx.loads(GUIDE.replace("ELEMENTS", str(elements)))).design
        moving = MovingModel.of(design)
        node = int(design.plan.topology.numbers(["carriage"])[0])
        self.equations = Equations(moving, [Drive("carriage.y", node, int(moving.root[node]), 1)])

    def stroke(self) -> Array:
        """Frequencies (6,) at the last pose, Hz, of all that are found on both sides."""
        rest = Point(np.zeros(1), NO_LOADS)
        start = self.equations.solve(self.equations.model.rest, NO_LOADS, rest.targets)
        hertz = np.zeros(MODES)
        for side in (-REACH, REACH):
            points = [Point(np.array([side * s]), NO_LOADS) for s in np.linspace(0, 1, SIDE + 1)]
            for state in Path(self.equations, start, rest).through(points):
                assert not isinstance(state, Stopped)
                hertz = np.sqrt(Pose(self.equations, state).modes(MODES).values) / (2 * np.pi)
        return hertz


class Exudyn:
    """The same of exudyn."""

    def __init__(self, elements: int, arms: float = ARMS) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        add = self.system.AddObject
        area, wide, thin = WIDTH * THICKNESS, THICKNESS * WIDTH**3 / 12, WIDTH * THICKNESS**3 / 12
        shear = SHEAR * E / (2 + 2 * NU) * area
        stiffness = [E * area, shear, shear, E / (2 + 2 * NU) * J, E * wide, E * thin]
        leaf = self._section(stiffness, DENSITY * area, DENSITY * np.diag([wide + thin, wide, thin]))
        arm = self._section([arms] * 3 + [arms / 1000] * 3, 1e-6, 1e-9 * np.eye(3))
        carriage = self._node(LENGTH, APART / 2)
        add(exu.itemInterface.ObjectRigidBody(nodeNumber=carriage, mass=0.3, inertia=[4e-4, 2e-4, 4e-4, 0, 0, 0]))
        roots = []
        for y in (0.0, APART):
            nodes = [self._node(x, y) for x in np.linspace(0, LENGTH, elements + 1)]
            for pair in pairwise(nodes):
                add(
                    exu.itemInterface.ObjectBeamGeometricallyExact(
                        nodeNumbers=list(pair), length=LENGTH / elements, sectionData=leaf
                    )
                )
            pair = [nodes[-1], carriage]
            add(exu.itemInterface.ObjectBeamGeometricallyExact(nodeNumbers=pair, length=APART / 2, sectionData=arm))
            roots.append(nodes[0])
        ground = self.system.AddNode(exu.itemInterface.NodePointGround())
        self.ground = self.system.AddMarker(exu.itemInterface.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
        for root in roots:
            for coordinate in range(6):
                self._hold(root, coordinate)
        self.drive = self._hold(carriage, 1)
        self.system.Assemble()
        self.clamped = [self.system.GetNodeODE2Index(root) + k for root in roots for k in range(6)]
        self.settings = exu.SimulationSettings()
        self.settings.solution.file.write = False
        self.settings.staticSolver.verboseMode = 0
        self.settings.staticSolver.newton.absoluteTolerance = 1e-6  # N; stiff arms leave that much round-off
        self.settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse

    @staticmethod
    def _section(stiffness: list[float], mass: float, inertia: Array) -> Any:
        section = exu.BeamSection()
        section.stiffnessMatrix, section.massPerLength, section.inertia = np.diag(stiffness), mass, inertia
        return section

    def _node(self, x: float, y: float) -> Any:
        return self.system.AddNode(exu.itemInterface.NodeRigidBodyRxyz(referenceCoordinates=[x, y, 0, 0, 0, 0]))

    def _hold(self, node: Any, coordinate: int) -> Any:
        marker = self.system.AddMarker(exu.itemInterface.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        return self.system.AddObject(exu.itemInterface.CoordinateConstraint(markerNumbers=[self.ground, marker]))

    def stroke(self, poses: int = SIDE) -> Array:
        """Frequencies (6,) at the last pose, Hz, of all that are found on both sides."""
        hertz = np.zeros(MODES)
        for side in (-REACH, REACH):
            self.system.systemData.SetODE2Coordinates(
                np.zeros(self.system.systemData.ODE2Size()), exu.ConfigurationType.Initial
            )
            for share in np.linspace(0, 1, poses + 1):
                self.system.SetObjectParameter(self.drive, "offset", side * share)
                self.system.SolveStatic(self.settings, updateInitialValues=True)
                hertz, _ = self.system.ComputeODE2Eigenvalues(
                    self.settings,
                    useSparseSolver=True,
                    numberOfEigenvalues=MODES,
                    constrainedCoordinates=self.clamped,
                    ignoreAlgebraicEquations=True,
                    convert2Frequencies=True,
                )
        return np.asarray(hertz)


def timed(run: Callable[[], Array]) -> tuple[float, float]:
    """Median processor time, s, and the largest error of the frequencies at 10 mm."""
    times, hertz = [], np.zeros(MODES)
    for _ in range(RUNS):
        start = time.process_time()
        hertz = run()
        times.append(time.process_time() - start)
    return median(times), float(np.abs(hertz / REFERENCE - 1).max())


def main() -> None:
    print(f"{2 * SIDE + 1} poses of a guide over +-10 mm, six frequencies each")
    print("                  elements a leaf   time ms   largest error at 10 mm")
    own = {n: timed(Flexura(n).stroke) for n in (2, 3, 4, 6, 10)}
    for n, (seconds, error) in own.items():
        print(f"  flexura         {n:15d} {1e3 * seconds:9.0f} {error:15.1e}")
    other = {n: timed(Exudyn(n).stroke) for n in (10, 20, 40, 80)}
    for n, (seconds, error) in other.items():
        print(f"  exudyn {exu.__version__:8} {n:15d} {1e3 * seconds:9.0f} {error:15.1e}")
    for n, (seconds, error) in other.items():
        enough = next(k for k, (_, least) in own.items() if least <= error)
        ratio = seconds / own[enough][0]
        print(f"exudyn with {n} takes {ratio:.0f} times as long as flexura with {enough}, whose error is no larger")
    rough, soft, fine = Exudyn(20).stroke(4), Exudyn(40, ARMS / 10).stroke(4), Exudyn(40).stroke(4)
    converged = fine + (fine - rough) / 3 + (fine - soft) / 9
    apart = np.abs(converged / Flexura(20).stroke() - 1)
    print(f"both converged, frequencies at 10 mm differ by {np.array2string(apart, precision=1)}")


if __name__ == "__main__":
    main()
