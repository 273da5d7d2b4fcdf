"""Mechanisms of published cases of large motion, and how to move them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from copy import copy

import numpy as np
import scipy.linalg as la

import flexura as fx
from flexura.motion.equilibrium import NO_LOADS, Drive, Equations, Loads
from flexura.motion.model import MovingModel
from flexura.motion.path import Path, Point, Stopped
from flexura.motion.pose import Pose


def straight_beams(
    points: Sequence[Sequence[float]],
    section: str,
    elements: int,
    *,
    E: float,
    G: float,
    ground: dict[str, object],
    reference: str = "[0, 0, 1]",
    rho: float = 1e-3,
) -> fx.Mechanism:
    """Links between consecutive points p0, p1, ... with constants of a section."""
    nodes = "\n".join(f"  p{k}: [{x!r} m, {y!r} m, {z!r} m]" for k, (x, y, z) in enumerate(points))
    links = "\n".join(
        f"  l{k}: {{nodes: [p{k}, p{k + 1}], material: m, section: s, reference: {reference}, elements: {elements}}}"
        for k in range(len(points) - 1)
    )
    held = "\n".join(f"  {node}: {text}" for node, text in ground.items())
    # isotropic materials have nu from 0 to 1/2: E and G of a case apart from that are put into J
    return fx.loads(
        "flexura: 1\nname: case\ntheory: timoshenko\ncorrections: none\n"
        f"materials:\n  m: {{E: {E!r} Pa, nu: {E / (2 * G) - 1!r}, rho: {rho!r} kg/m^3}}\n"
        f"sections:\n  s: {{shape: constants, {section}}}\n"
        f"nodes:\n{nodes}\nlinks:\n{links}\nground:\n{held}\n"
    )


class Moved:
    """A mechanism with driven displacements such as `p1.y`, and what is asked of its poses."""

    def __init__(self, mechanism: fx.Mechanism, *driven: str) -> None:
        self.design = fx.assemble(mechanism).design
        self.model = MovingModel.of(self.design)
        drives = []
        for name in driven:
            node, axis = name.rsplit(".", 1)
            number = self.number(node)
            component = ("x", "y", "z", "rx", "ry", "rz").index(axis)
            drives.append(Drive(name, number, int(self.model.root[number]), component))
        self.equations = Equations(self.model, drives)

    def at_low_order(self, low: MovingModel) -> Moved:
        """The same with another model of the mechanism."""
        found = copy(self)
        found.model, found.equations = low, Equations(low, self.equations.drives)
        return found

    def number(self, node: str) -> int:
        """Number of a node."""
        return int(self.design.plan.topology.numbers([node])[0])

    def through(self, targets: Iterable[Sequence[float]]) -> Iterator[Pose]:
        """Poses at targets of the driven displacements, one after another."""
        yield from self.along([Point(np.array(own, dtype=float), NO_LOADS) for own in targets])

    def loaded(self, wrenches: Iterable[dict[str, Sequence[float]]]) -> Iterator[Pose]:
        """Poses under dead loads by node, one after another."""
        loads = [{self.number(k): np.array(v, dtype=float) for k, v in own.items()} for own in wrenches]
        yield from self.along([Point(np.empty(0), Loads(own, {}, np.zeros(3))) for own in loads])

    def along(self, points: Sequence[Point]) -> Iterator[Pose]:
        """Poses at points from rest."""
        rest = Point(np.zeros(len(self.equations.drives)), NO_LOADS)
        path = Path(self.equations, self.equations.solve(self.model.rest, NO_LOADS, rest.targets), rest)
        for state in path.through(points):
            if isinstance(state, Stopped):
                raise AssertionError(f"stopped on the way to point {state.point} at {state.share}")
            yield Pose(self.equations, state)

    def position(self, pose: Pose, node: str) -> np.ndarray:
        """Where a node is, m."""
        return self.model.positions(pose.state.frames)[self.number(node)]

    def frequencies(self, pose: Pose, node: str, mass: Sequence[float]) -> np.ndarray:
        """Natural frequencies, Hz, of a body on the mechanism without mass: kg, kg m^2 about its axes, which turn."""
        R = pose.state.frames.R[self.model.root[self.number(node)]]
        inertia = la.block_diag(np.diag(mass[:3]), R @ np.diag(mass[3:]) @ R.T)
        K = np.linalg.inv(pose.compliance(self.number(node)))
        return np.sqrt(la.eigh((K + K.T) / 2, inertia, eigvals_only=True)) / (2 * np.pi)


def inside_strips(model: MovingModel) -> list[int]:
    """The displacements between the ends of members whose warping is held."""
    frames = [node[:, 1:-1].ravel() for group in model.elements for node in group.coupled]
    return [int(dof) for own in frames for dof in model.dof[own].ravel()]


def condensed(K: np.ndarray, inner: list[int]) -> np.ndarray:
    """K of the other displacements, with the inner ones free."""
    outer = np.setdiff1d(np.arange(len(K)), inner)
    follow = np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, outer)])
    return np.asarray(K[np.ix_(outer, outer)] - K[np.ix_(outer, inner)] @ follow)
