"""Linear models of examples, put together from their modes by hand."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

import flexura as fx
from flexura.analysis.natural_modes.modes import Modes
from flexura.structure import Channel
from flexura.systems.state_space import StateSpace

EXAMPLES = Path(__file__).parents[2] / "examples"


@cache
def example_modes(name: str, n: int = 6) -> Modes:
    """The lowest modes of an example."""
    return fx.modes(fx.load(EXAMPLES / name / f"{name}.yaml"), n=n, order="full")


def modal_model(modes: Modes, node: str, damping: float = 0.01) -> StateSpace:
    """Force and moment at a node to its displacement, rotation and acceleration, two states per mode."""
    w, n = modes.angular_frequency, len(modes.modes)
    shape = modes.shapes[modes.node_names.index(node)]
    A, B, C = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2)), np.zeros((3, 2 * n))
    at, rate = np.arange(0, 2 * n, 2), np.arange(1, 2 * n, 2)
    A[at, rate], A[rate, at], A[rate, rate] = 1.0, -(w**2), -2 * damping * w
    B[rate] = shape[[0, 4]].T
    C[0, at], C[1, at] = shape[0], shape[4]
    C[2] = shape[0] @ A[rate]
    D = np.vstack([np.zeros((2, 2)), shape[0] @ B[rate]])
    return StateSpace(
        A,
        B,
        C,
        D,
        (Channel(f"{node}.tx", "force"), Channel(f"{node}.ry", "moment")),
        (
            Channel(f"{node}.tx", "displacement"),
            Channel(f"{node}.ry", "rotation"),
            Channel(f"{node}.accelerometer", "acceleration"),
        ),
        tuple(name for k in range(n) for name in (f"mode{k + 1}.position", f"mode{k + 1}.velocity")),
        name=modes.name,
        notes=("modal damping 1 %",),
    )
