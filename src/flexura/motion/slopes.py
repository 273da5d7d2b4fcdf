"""Exact derivatives of states of equilibrium, and of what a mechanism is there, by the parameters of its design.

Forces of a design whose numbers have slopes are worked out in a state by the code that found it. What they miss of
equilibrium says how the state moves (theory eq. V5); at the state that moves along, whatever is worked out has its
total derivative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.beam import skew
from flexura.duals import Dual, plain, slope_of
from flexura.linalg import factorise
from flexura.modal import close_groups
from flexura.motion.elements import Frames
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.model import Loads, MovingModel
from flexura.motion.pose import Holding, Pose, critical_state, lowest_of_any, material_at
from flexura.structure import Design
from flexura.thresholds import REPEATED_EIGENVALUES

GUARD = 3
"""Eigenvalues worked out beyond those wanted, to see whether the last one is repeated."""


class Repeated(NamedTuple):
    """An eigenvalue of multiplicity m, numbers `at` (m,), with the derivatives (P, m, m) of its space: their
    eigenvalues are the slopes of the branches into which it goes as a parameter moves (theory eq. K5)."""

    at: list[int]
    value: float
    slope: Array


@dataclass(frozen=True)
class SlopedPose:
    """A pose, and the same of a design with slopes, `moving` along, of which what is read has exact derivatives.

    Without slopes there is none, and derivatives are those by no parameters. `missing` (n,) is what round-off leaves
    missing of its equilibrium, with slopes, N and N m.
    """

    pose: Pose
    moving: Pose | None = None
    missing: Any = None

    @staticmethod
    def of(pose: Pose, design: Design, loads: Loads, targets: Array) -> SlopedPose:
        """The pose of a `design` whose values have slopes, those of the pose being its values.

        `loads` and the `targets` (d,) of the drives, m and rad, are those of the pose, and may have slopes. Raises
        SolverError where the mechanism has lost its stiffness: there the state has no derivative.
        """
        state, equations = pose.state, pose.equations
        sloped = Equations(MovingModel.of(design), equations.drives)
        frames = _carried(sloped.model.rest, state.frames, len(slope_of(design.values)))
        tangent, missing = sloped.tangent(frames, loads, state.drive)
        missing = missing + state.drive @ tangent.rows
        gap = targets - sloped.travelled(frames)
        step, drive = equations.solver(state.tangent)(slope_of(missing).T, slope_of(gap).T)
        frames = _stepped(frames, np.stack([equations.displacements(column) for column in step.T]))
        force: Any = Dual(state.drive, drive.T)
        tangent, missing = sloped.tangent(frames, loads, force)
        at = Equilibrium(frames, force, loads, tangent, state.iterations)
        return SlopedPose(pose, Pose(sloped, at), missing + force @ tangent.rows)

    @property
    def best(self) -> Pose:
        """The pose with slopes where it has some."""
        return self.moving or self.pose

    def compliance(self, node: int, held: bool = False) -> Any:
        """Displacements (6, 6) of a node per force and moment on it, with slopes, actuators free or locked (theory eq.
        V6). Raises SolverError where the state has lost its stiffness."""
        if self.moving is None:
            return self.pose.compliance(node, held)
        held_drives = range(len(self.pose.equations.drives)) if held else ()
        return self._flexible(self.moving.rows(node), self.pose.pushed(node, held), held_drives)

    def flexibility(self, rows: Any, held: Sequence[int]) -> Any:
        """Motions (k, k) along `rows` (k, n) per unit force along each, with slopes, the drives numbered `held` held
        and the others free (theory eq. V6). Raises SolverError as `compliance`."""
        pose = self.pose
        holding = Holding.of(pose.state.tangent.rows[list(held)], pose.equations.scale)
        forces = np.ascontiguousarray(holding.rows(plain(rows)).T)
        return self._flexible(rows, holding.motions(factorise(holding.matrix(pose.K)).solve(forces)), held)

    def _flexible(self, rows: Any, x: Array, held: Sequence[int]) -> Any:
        """Motions along rows (k, n), which may have slopes, in displacements x (n, k) by unit forces along them."""
        G = plain(rows)
        C = G @ x
        moved = slope_of(rows) if isinstance(rows, Dual) else np.zeros((1, *G.shape))
        change = moved @ x - self._form(self._stiffness, x) / 2
        if len(held):
            change = change + self._pulled(x, self.pose.K @ x - G.T, held)
        return Dual((C + C.T) / 2, change + np.swapaxes(change, 1, 2))

    def eigenvalues(self, n: int, held: bool = False) -> list[Repeated]:
        """The n lowest eigenvalues, (rad/s)^2, and further copies of the last, with slopes (theory eq. V7)."""
        K, M = self.pose.matrices(held)
        pairs = lowest_of_any(K, M, min(n + GUARD, K.shape[0]))
        X = self.pose.holding.motions(pairs.vectors) if held else pairs.vectors
        groups = []
        masses = [] if self.moving is None else self.moving.equations.model.mass_blocks(self.moving.state.frames)
        for at in close_groups(pairs.values, REPEATED_EIGENVALUES):
            if at[0] >= n:
                break
            value, x = float(np.mean(pairs.values[at])), X[:, at]
            slope = self._form(self._stiffness, x) - value * self._form(masses, x)
            if held:
                pull = self._pulled(x, self.pose.K @ x - value * (self.pose.M @ x))
                slope = slope - pull - np.swapaxes(pull, 1, 2)
            groups.append(Repeated(at.tolist(), value, slope))
        return groups

    def buckling_factor(self) -> Repeated | None:
        """The factor on all loads and drive forces at which the state would buckle with actuators locked, with slopes
        (theory eq. V8); None where `flexura.motion.buckling_factor` is."""
        critical = critical_state(self.pose, 1 + GUARD)
        if critical is None:
            return None
        factors, shapes = critical
        at = close_groups(factors, REPEATED_EIGENVALUES)[0].tolist()
        value, x = float(np.mean(factors[at])), self.pose.holding.motions(shapes[:, at])
        rest, whole = (self._form(blocks, x) for blocks in (self._material, self._stiffness))
        force = (1 - value) * (material_at(self.pose) @ x) + value * (self.pose.K @ x)
        pull = self._pulled(x, force)
        slope = value * ((1 - value) * rest + value * whole - pull - np.swapaxes(pull, 1, 2))
        return Repeated(at, value, slope)

    @property
    def _stiffness(self) -> Sequence[Array]:
        """Blocks of the tangent stiffness with slopes."""
        return self.best.state.tangent.forces.blocks

    @property
    def _material(self) -> Sequence[Array]:
        """Blocks of the stiffness without forces, with slopes."""
        state = self.best.state
        return self.best.equations.model.material_blocks(state.frames, state.loads.actuators)

    def _form(self, blocks: Sequence[Array], x: Array) -> Array:
        """Slopes (P, k, k) of x' A x, x (n, k), for the symmetric part A of a sum of blocks."""
        if self.moving is None:
            return np.zeros((0, x.shape[1], x.shape[1]))
        return slope_of(self.moving.equations.model.form(blocks, x))

    def _pulled(self, x: Array, forces: Array, held: Sequence[int] | None = None) -> Array:
        """Work (P, k, k), on motions x (n, k), of slopes of the rows that hold the drives, all or those `held`, under
        forces (n, k) that these exert."""
        if self.moving is None:
            return np.zeros((0, x.shape[1], x.shape[1]))
        whole: Any = self.moving.state.tangent.rows
        rows = whole if held is None else whole[list(held)]
        pull = np.linalg.lstsq(rows.value.T, forces, rcond=None)[0]
        return np.swapaxes(rows.slope @ x, 1, 2) @ pull


def _carried(rest: Frames, at: Frames, count: int) -> Frames:
    """Frames `at` a state with the slopes that they have where displacements from rest stay as they are."""
    moved = slope_of(rest.x) if isinstance(rest.x, Dual) else np.zeros((count, *at.x.shape))
    R, z = (np.zeros((count, *field.shape)) for field in (at.R, at.z))
    return _frames(at, moved, R, z)


def _stepped(frames: Frames, step: Array) -> Frames:
    """Frames with slopes (P, n, 6) of displacements added to theirs."""
    moves = frames.placed[:, None]
    turned = skew(np.where(moves, step[..., 3:], 0.0)) @ plain(frames.R)
    slopes = np.where(moves, step[..., :3], 0.0), turned, np.where(moves, 0.0, step)
    return _frames(frames, *(slope_of(field) + more for field, more in zip(frames, slopes, strict=False)))


def _frames(at: Frames, *slopes: Array) -> Frames:
    """Frames with slopes of positions, rotations and amplitudes."""
    x, R, z = (Dual(plain(field), slope) for field, slope in zip(at, slopes, strict=False))
    return at._replace(x=x, R=R, z=z)
