"""What 41 poses of a parallel guide in large motion cost: equilibria, frequencies about them, and everything.

    python benchmarks/stroke.py

One BLAS thread, half a minute. Times are medians of repeated runs. The guide is that of
tests/motion/test_large_motion_cases.py with four and with ten elements a leaf, over +-10 mm.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import time
from collections.abc import Callable
from statistics import median

import numpy as np

import flexura as fx
from flexura.motion import NO_LOADS, Drive, Equations, Equilibrium, MovingModel, Path, Point, Pose, Stopped

POSES, REACH, MODES, RUNS = 41, 0.01, 6, 7

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


def seconds(run: Callable[[], object]) -> float:
    """Median time of a call."""
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return median(times)


def equilibria(equations: Equations) -> list[Equilibrium]:
    """States from rest to both sides."""
    rest = Point(np.zeros(1), NO_LOADS)
    start = equations.solve(equations.model.rest, NO_LOADS, rest.targets)
    found = []
    for side in (-1.0, 1.0):
        points = [Point(np.array([side * s]), NO_LOADS) for s in np.linspace(0, REACH, POSES // 2 + 1)]
        states = list(Path(equations, start, rest).through(points))
        assert not any(isinstance(state, Stopped) for state in states)
        found += [state for state in states if not isinstance(state, Stopped)]
    return found[1:]


def frequencies(equations: Equations) -> None:
    """The lowest modes of all states, drives free and held."""
    for state in equilibria(equations):
        pose = Pose(equations, state)
        pose.modes(MODES)
        pose.modes(MODES, held=True)


def main() -> None:
    for elements in (4, 10):
        model = fx.assemble(fx.loads(GUIDE.replace("ELEMENTS", str(elements))))
        moving = MovingModel.of(model.design)
        node = int(model.plan.topology.numbers(["carriage"])[0])
        equations = Equations(moving, [Drive("carriage.y", node, int(moving.root[node]), 1)])
        own = seconds(lambda equations=equations: equilibria(equations))
        modes = seconds(lambda equations=equations: frequencies(equations))
        move = {"carriage.y": (-REACH, REACH)}
        everything = seconds(lambda model=model, move=move: fx.stroke(model, move=move, steps=POSES, n=MODES))
        print(f"{POSES} poses, {elements} elements a leaf, {model.order} DOFs")
        print(f"  equilibria                {1e3 * own:7.0f} ms")
        print(f"  and frequencies           {1e3 * modes:7.0f} ms")
        print(f"  everything                {1e3 * everything:7.0f} ms, {everything / modes:.2f} times")


if __name__ == "__main__":
    main()
