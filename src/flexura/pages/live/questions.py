"""What a page asks of a mechanism when it is opened: responses, bands and loads that make sense for it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from flexura.analysis import motions
from flexura.linalg import Eigenpairs
from flexura.mechanism import DOF_NAMES
from flexura.reduction import HERTZ
from flexura.structure import FullOrderModel
from flexura.systems import Ports

BEYOND = 1.6
"""The band of a response ends so many times above the highest frequency shown, and begins as far below the lowest."""

STROKE = 0.01
"""Stroke that is assumed where none is described, over the longest side."""


def questions(model: FullOrderModel, found: Eigenpairs, n: int) -> dict[str, Any]:
    """Plain data: names of `inputs` and `outputs`, the `response` to begin with, `loads` that are described, and the
    DOF whose motion a stroke is, with its amplitude, `assumed` where the file has none."""
    ports = Ports(model.design)
    places = list(_dofs(model, found))
    free = places[0] if places else ""
    limited = [i.channel.name for i in ports.inputs() if np.isfinite(i.limits).any()]
    inputs, outputs = [*ports.actuators, *places], [*ports.sensors, *places]
    hz = np.sqrt(np.maximum(found.values[:n], 0)) / HERTZ
    elastic = hz[hz > 0]
    low, high = (elastic[0] / 3, elastic[-1] * BEYOND) if len(elastic) else (1.0, 1000.0)
    first = {
        "input": next(iter(inputs), ""),
        "output": next((name for name in _motion_sensors(ports)), free),
        "low": float(f"{low:.2g}"),
        "high": float(f"{high:.2g}"),
    }
    kinds = ["described"] * model.plan.is_loaded + ["actuators"] * bool(limited)
    described = _stroke(model)
    dof, amplitude = described or (free, _assumed_stroke(model, free))
    return {
        "inputs": inputs,
        "outputs": outputs,
        "response": first if first["input"] and first["output"] else None,
        "loads": kinds + ["move"] * bool(free),
        "stroke": {"dof": dof, "amplitude": amplitude, "assumed": described is None},
    }


def _motion_sensors(ports: Ports) -> Iterator[str]:
    return (out.channel.name for out in ports.outputs() if out.row.any())


def _dofs(model: FullOrderModel, found: Eigenpairs) -> Iterator[str]:
    """DOFs of bodies, else of nodes of the mechanism itself, that of the largest part in the first mode first."""
    plan = model.plan
    names = {name: k for k, name in reversed(list(enumerate(plan.topology.node_names)))}
    nodes = [name for name in plan.mechanism.bodies if name in names] or [
        name for name in plan.mechanism.nodes if name in names
    ]
    if not nodes:
        return
    u = model.node_displacements(found.vectors[:, :1])
    own = motions(model, u)[0].bodies
    first = next((body for body in own if body.body in nodes), None)
    size = np.ptp(model.positions, axis=0).max() or 1.0
    if first is not None:
        nodes = [first.body, *(name for name in nodes if name != first.body)]
    for k, name in enumerate(nodes):
        held = model.plan.topology.dof[plan.topology.root[names[name]]] < 0
        moved = np.abs(u[names[name], :, 0]) * [1, 1, 1, size, size, size]
        order = np.argsort(-moved, kind="stable") if k == 0 else range(6)
        yield from (f"{name}.{DOF_NAMES[d]}" for d in order if not held[d])


def _assumed_stroke(model: FullOrderModel, dof: str) -> float:
    """STROKE of the longest side, m, or as many radians, to two digits."""
    size = float(np.ptp(model.positions, axis=0).max())
    return float(f"{STROKE * (1.0 if dof[-2:] in ('rx', 'ry', 'rz') else size or 1e-3):.2g}")


def _stroke(model: FullOrderModel) -> tuple[str, float] | None:
    """The first DOF that the described motion moves, and how far, m or rad."""
    motion = model.plan.mechanism.motion
    for node, moved in (motion.move if motion is not None else {}).items():
        for axis in ("x", "y", "z", "rx", "ry", "rz"):
            ends = getattr(moved, axis)
            if ends is not None and all(isinstance(end, float) for end in ends):
                return f"{node}.{axis if axis[0] == 'r' else f't{axis}'}", max(map(abs, ends))
    return None
