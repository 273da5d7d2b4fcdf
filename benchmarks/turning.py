"""The low order that turns beside the full one: the paper's platform at the edges of its actuators, and over time.

    python benchmarks/turning.py
    python benchmarks/turning.py --gallery [NAME ...]

One BLAS thread, a minute. First the four bonded stacks of examples/rpr/rpr_piezo.yaml at none or all of their stroke,
all 15 ways: the largest differences of the platform's displacement, rotation and first six frequencies from the full
order, over the largest of all, with forces of first, second and third order in the deformation of substructures. Then
the same time response of examples/rpr/rpr.yaml in both orders, and what a step costs.

With --gallery, four minutes: mechanisms of leaves moved by a fifth of the length of a leaf, or by 0.2 rad, a line for
each: coordinates of the low order and of the full one, and at the end of the stroke the largest relative errors of
where bodies are (of pivots, how far their centre has moved), of the force and of the first three frequencies; what the
low order tells of itself, undeformed and actuators locked as well; and elements of leaves, those that are equal once.
"""

from __future__ import annotations

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"

import pathlib
import sys
import time
from itertools import product

import numpy as np
from numpy.typing import NDArray

import flexura as fx
from flexura.motion import (
    NO_LOADS,
    Damping,
    Equations,
    Integrator,
    Loads,
    MovingModel,
    Path,
    Point,
    Pose,
    Stopped,
    TurningModel,
    kept_frames,
)

Array = NDArray[np.float64]

STROKE, PARTS = 36e-6, 4

FIFTHS = {
    "guide": ("carriage.x", 12e-3),
    "pivot": ("arm.ry", 0.2),
    "parallelogram": ("stage.x", 10e-3),
    "cross_spring": ("table.ry", 0.2),
    "butterfly": ("holder.ry", 0.2),
    "cartwheel": ("holder.ry", 0.2),
    "rcm_pivot": ("tip.ry", 0.2),
    "infinity_hinge": ("arm.ry", 0.2),
    "zero_stiffness": ("beam.ry", 0.2),
    "inverted_pendulum": ("centre.x", 4e-3),
    "double_parallelogram": ("stage.x", 12e-3),
    "folded_parallelogram": ("shuttle.x", 10e-3),
    "folded_mems": ("shuttle.x", 100e-6),
    "comb_drive": ("shuttle.x", 40e-6),
    "z_stage": ("column.z", 5e-3),
    "xy_parallel": ("table.x", 10e-3),
    "xy_serial": ("table.x", 5e-3),
    "delta": ("table.x", 6e-3),
}
"""What is moved, by a fifth of the length of a leaf in m, or by 0.2 rad."""

GALLERY = pathlib.Path(fx.__file__).parent / "gallery"
STEPS, DT = 200, 2e-3


def edges(model: MovingModel) -> tuple[Array, Array, float]:
    """Displacements (15, 6) of the platform and frequencies (15, 6) with stacks at none or all of their stroke, and
    seconds for the states alone; NaN where none is found."""
    equations = Equations(model)
    platform = int(model.design.plan.topology.numbers(["platform"])[0])
    none = np.empty(0)
    moved, hertz, seconds = [], [], 0.0
    for on in list(product((0.0, 1.0), repeat=4))[1:]:
        commands = dict(zip(model.actuators, (STROKE * np.array(on)).tolist(), strict=True))
        end = Point(none, Loads({}, {}, np.zeros(3), commands))
        rest = Point(none, NO_LOADS)
        points = [rest.between(end, k / PARTS) for k in range(1, PARTS + 1)]
        start = time.perf_counter()
        *_, state = Path(equations, equations.solve(model.rest), rest).through(points)
        seconds += time.perf_counter() - start
        if isinstance(state, Stopped):
            moved.append(np.full(6, np.nan))
            hertz.append(np.full(6, np.nan))
            continue
        pose = Pose(equations, state)
        values = pose.modes(6).values
        moved.append(pose.displacement(platform))
        hertz.append(np.sign(values) * np.sqrt(np.abs(values)) / (2 * np.pi))
    return np.array(moved), np.array(hertz), seconds


def over_time(model: MovingModel) -> tuple[Array, float]:
    """Positions (200, 3) of the platform under forces and moments that swing, and milliseconds of processor time a
    step."""
    platform = int(model.design.plan.topology.numbers(["platform"])[0])
    root = int(model.root[platform])

    def loads(number: float) -> Loads:
        at = 2 * np.pi * DT * number * np.array([4.0, 3.0, 2.0])
        wrench = np.append([0.0, 0.0], [5.0, 0.02, 0.02] * np.sin(at))
        return Loads({platform: np.append(wrench, 0.0)}, {}, np.zeros(3))

    integrator = Integrator(Equations(model), Damping(0.0, 0.0), DT, 0.8)
    start = time.process_time()
    states = integrator.through(model.rest, np.zeros(model.n_dof), loads, STEPS)
    x = np.array([np.append(state.frames.x[root], state.frames.R[root, 2]) for state in states])
    return x - x[0], 1e3 * (time.process_time() - start) / STEPS


def a_fifth(name: str) -> str:
    """What the low order of a mechanism takes at the end of a long stroke, and how far it is off."""
    move, end = FIFTHS[name]
    path = GALLERY / f"{name}.yaml"
    mechanism = fx.load(path if path.exists() else f"examples/{name}/{name}.yaml")
    start = time.perf_counter()
    try:
        full, low = (
            fx.stroke(mechanism, move={move: (0.0, end)}, steps=3, n=3, order=order) for order in ("full", "low")
        )
    except fx.SolverError as error:
        return f"{name}: {move} to {end:g}: {error}"
    assert low.low_order is not None
    one, other = low.poses[-1], full.poses[-1]
    force = abs(one.reaction[move] / other.reaction[move] - 1)
    places = [np.array([*pose.displacement.values()])[..., :3] for pose in (one, other)]
    moved = np.abs(places[0] - places[1]).max() / np.abs(places[1]).max()
    hertz = np.abs(np.divide(one.frequency_hz, other.frequency_hz) - 1).max()
    pieces, seconds = [*low.low_order.leaves.values()], time.perf_counter() - start
    return (
        f"{name}: {move} to {end:g}, {low.low_order.coordinates} coordinates of {low.low_order.full}: position"
        f" {moved:.1e}, force {force:.1e}, frequencies {hertz:.1e}, told {low.low_order.error:.1e} and"
        f" {low.low_order.frequency_error:.1e}; leaves of {pieces}; {seconds:.0f} s"
    )


def main() -> None:
    if "--gallery" in sys.argv:
        for name in sys.argv[2:] or FIFTHS:
            print(a_fifth(name), flush=True)
        return
    full = MovingModel.of(fx.assemble(fx.load("examples/rpr/rpr_piezo.yaml")).design)
    moved, hertz, seconds = edges(full)
    print(f"stacks at {1e6 * STROKE:.0f} um, 15 ways: full order, {full.n_dof} coordinates, {seconds:.2f} s")
    print(f"  up to {1e6 * np.abs(moved[:, :3]).max():.0f} um, {1e3 * np.abs(moved[:, 3:]).max():.2f} mrad")
    for order, name in ((1, "linear"), (2, "quadratic"), (3, "cubic")):
        begin = time.perf_counter()
        low = TurningModel.of(full, kept_frames(full), order).low
        made = time.perf_counter() - begin
        own, f, seconds = edges(low)
        parts = [(own[:, part], moved[:, part]) for part in (slice(3), slice(3, 6))]
        off = [np.abs(a - b).max() / np.abs(b).max() for a, b in parts]
        print(
            f"  {name} forces, {low.n_dof} coordinates: displacements {off[0]:.1e}, rotations {off[1]:.1e}, frequencies"
            f" {np.abs(f / hertz - 1).max():.1e}; made in {made:.2f} s, {seconds:.2f} s"
        )
    full = MovingModel.of(fx.assemble(fx.load("examples/rpr/rpr.yaml")).design)
    low = TurningModel.of(full, kept_frames(full)).low
    x, slow = over_time(full)
    y, quick = over_time(low)
    print(f"{STEPS} steps of {1e3 * DT:g} ms, low order beside full:")
    for name, part in (("displacements", slice(3)), ("rotations", slice(3, 6))):
        print(f"  {name} {np.abs(y[:, part] - x[:, part]).max() / np.abs(x[:, part]).max():.1e}")
    print(f"  {slow:.2f} ms a step in full, {quick:.2f} ms at low order, {slow / quick:.1f} times as quick")


if __name__ == "__main__":
    main()
