"""What poses of mechanisms in large motion cost: equilibria, frequencies about them, and everything that is told.

    python benchmarks/stroke.py

One BLAS thread, a minute. Times are medians of repeated runs. Guide (over +-10 mm) and pivot (over +-20 degrees) are
those of tests/motion/test_large_motion_cases.py with mass in their leaves, 41 poses, with ten elements a leaf and, for
the guide, more; the platform is examples/rpr/rpr.yaml, 21 poses of its lift.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import time
from collections.abc import Callable
from pathlib import Path as File
from statistics import median
from typing import NamedTuple

import numpy as np

import flexura as fx
from flexura.motion import NO_LOADS, Drive, Equations, Equilibrium, MovingModel, Path, Point, Pose, Stopped

MODES, RUNS = 12, 5

GUIDE = """
flexura: 1
name: guide
theory: timoshenko
corrections: none
materials: {steel: {E: 210 GPa, nu: 0.3, rho: 7800 kg/m^3, yield_stress: 1 GPa}}
sections: {leaf: {shape: rectangle, width: 30 mm, thickness: 0.5 mm}}
nodes: {a: [0, 0, 0], b: [0, 60 mm, 0], c: [100 mm, 0, 0], d: [100 mm, 60 mm, 0]}
links:
  left: {nodes: [a, c], material: steel, section: leaf, reference: y, elements: ELEMENTS}
  right: {nodes: [b, d], material: steel, section: leaf, reference: y, elements: ELEMENTS}
bodies:
  carriage:
    centre: [100 mm, 30 mm, 0]
    mass: 0.3 kg
    inertia: [4e-4 kg*m^2, 2e-4 kg*m^2, 4e-4 kg*m^2]
    carries: [c, d]
ground: {a: clamped, b: clamped}
"""

PIVOT = """
flexura: 1
name: pivot
theory: timoshenko
corrections: none
materials: {steel: {E: 210 GPa, nu: 0.3, rho: 7800 kg/m^3, yield_stress: 1 GPa}}
sections: {leaf: {shape: rectangle, width: 20 mm, thickness: 0.3 mm}}
parameters: {s: 35.3553 mm}
nodes: {a: [-s, -s, 0], b: [-s, s, 0], c: [s, s, 0], d: [s, -s, 0]}
links:
  up: {nodes: [a, c], material: steel, section: leaf, reference: [-1, 1, 0], elements: ELEMENTS}
  down: {nodes: [b, d], material: steel, section: leaf, reference: [1, 1, 0], elements: ELEMENTS}
bodies:
  carriage: {centre: [0, 0, 0], mass: 1 kg, inertia: [1e-3 kg*m^2, 1e-3 kg*m^2, 1e-3 kg*m^2], carries: [c, d]}
ground: {a: clamped, b: clamped}
"""

PLATFORM = File(__file__).parents[1] / "examples" / "rpr" / "rpr.yaml"


class Case(NamedTuple):
    """A mechanism, and the node and the component whose displacement is driven to both sides, m or rad."""

    name: str
    mechanism: fx.Mechanism
    node: str
    component: int
    reach: float
    poses: int


def cases() -> list[Case]:
    """What is measured."""
    guides = [
        Case(f"guide, {n} elements a leaf", fx.loads(GUIDE.replace("ELEMENTS", str(n))), "carriage", 1, 0.01, 41)
        for n in (10, 20, 40)
    ]
    pivot = fx.loads(PIVOT.replace("ELEMENTS", "10"))
    return [
        *guides,
        Case("pivot, 10 elements a leaf", pivot, "carriage", 5, np.radians(20), 41),
        Case("platform", fx.load(PLATFORM), "platform", 2, 1e-3, 21),
    ]


def seconds(run: Callable[[], object]) -> float:
    """Median time of a call."""
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return median(times)


def equilibria(equations: Equations, case: Case) -> list[Equilibrium]:
    """States from rest to both sides."""
    rest = Point(np.zeros(1), NO_LOADS)
    start = equations.solve(equations.model.rest, NO_LOADS, rest.targets)
    found = []
    for side in (-1.0, 1.0):
        points = [Point(np.array([side * s]), NO_LOADS) for s in np.linspace(0, case.reach, case.poses // 2 + 1)]
        states = list(Path(equations, start, rest).through(points))
        assert not any(isinstance(state, Stopped) for state in states)
        found += [state for state in states if not isinstance(state, Stopped)]
    return found[1:]


def frequencies(equations: Equations, case: Case, held: bool) -> None:
    """The lowest modes of all states, drives free, and held too."""
    for state in equilibria(equations, case):
        pose = Pose(equations, state)
        pose.modes(MODES)
        if held:
            pose.held_values(MODES)


def measure(case: Case) -> None:
    """Print what one case costs."""
    model = fx.assemble(case.mechanism)
    moving = MovingModel.of(model.design)
    node = int(model.plan.topology.numbers([case.node])[0])
    name = f"{case.node}.{('x', 'y', 'z', 'rx', 'ry', 'rz')[case.component]}"
    equations = Equations(moving, [Drive(name, node, int(moving.root[node]), case.component)])
    move = {name: (-case.reach, case.reach)}
    runs = {
        "equilibria": lambda: equilibria(equations, case),
        "and frequencies, drive free": lambda: frequencies(equations, case, held=False),
        "and frequencies, drive held as well": lambda: frequencies(equations, case, held=True),
        "everything": lambda: fx.stroke(model, move=move, steps=case.poses, n=MODES),
    }
    print(f"{case.name}: {case.poses} poses, {model.order} DOFs, {MODES} modes")
    for what, run in runs.items():
        print(f"  {what:36}{1e3 * seconds(run):6.0f} ms")


def main() -> None:
    for case in cases():
        measure(case)


if __name__ == "__main__":
    main()
