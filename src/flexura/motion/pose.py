"""What a mechanism is about a state of equilibrium: stiffness, compliance, modes, and where everything is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.beam import rigid_arm
from flexura.errors import SolverError
from flexura.linalg import Eigenpairs, Factor, Matrix, factorise, is_definite, next_to
from flexura.motion.equilibrium import Equations, Equilibrium
from flexura.motion.se3 import rotation_vector

SHIFTS = 60
"""Doublings of the shift below the lowest eigenvalue of a state that is unstable."""


class Holding(NamedTuple):
    """The displacements that are `left` (n - d,) where d combinations of all (n,) are held: those at `pivots` (d,) are
    `ratio` (d, n - d) times them."""

    left: Index
    pivots: Index
    ratio: Array

    @staticmethod
    def of(rows: Array, scale: Array) -> Holding:
        """With rows (d, n) held at zero; displacements times `scale` (n,) have one unit."""
        found, pivots = rows / scale, np.zeros(len(rows), dtype=np.intp)
        for i in range(len(rows)):
            pivots[i] = pivot = int(np.argmax(np.abs(found[i])))
            found[i] /= found[i, pivot]
            for j in range(len(rows)):
                if j != i:
                    found[j] -= found[j, pivot] * found[i]
        left = np.delete(np.arange(rows.shape[1]), pivots)
        return Holding(left, pivots, -found[:, left] * scale[left] / scale[pivots, None])

    def matrix(self, A: Matrix) -> Matrix:
        """A symmetric matrix (n, n) by what is left (n - d, n - d)."""
        ratio = self.ratio if isinstance(A, np.ndarray) else sp.csr_matrix(self.ratio)
        B = A[:, self.left] + A[:, self.pivots] @ ratio
        return B[self.left] + ratio.T @ B[self.pivots]

    def rows(self, G: Array) -> Array:
        """Rows (k, n) by what is left (k, n - d)."""
        return G[:, self.left] + G[:, self.pivots] @ self.ratio

    def motions(self, x: Array) -> Array:
        """All displacements (n, k) of those that are left (n - d, k)."""
        out = np.empty((len(self.left) + len(self.pivots), x.shape[1]))
        out[self.left], out[self.pivots] = x, self.ratio @ x
        return out


@dataclass(frozen=True)
class Pose:
    """A state of equilibrium, with everything that is linear about it.

    Displacements are those of frames, m and rotation vectors, rad, global axes, from the state.
    """

    equations: Equations
    state: Equilibrium

    @cached_property
    def K(self) -> Matrix:
        """Tangent stiffness (n, n) with loads and drives on, N/m, N, N m; symmetric, as `MovingModel.matrix`.

        Of moments about fixed axes the part counts that derives from an energy: half of it turns with what it acts on
        (Argyris, Dunne, Scharpf 1978).
        """
        return self.equations.model.matrix(self.state.tangent.forces.blocks)

    @cached_property
    def M(self) -> Matrix:
        """Mass (n, n), kg, kg m, kg m^2."""
        return self.equations.model.mass(self.state.frames)

    @cached_property
    def holding(self) -> Holding:
        """What is left where the actuators are locked."""
        return Holding.of(self.state.tangent.rows, self.equations.scale)

    def matrices(self, held: bool) -> tuple[Matrix, Matrix]:
        """K and M, with actuators locked or free."""
        return self._held if held else (self.K, self.M)

    @cached_property
    def _held(self) -> tuple[Matrix, Matrix]:
        return self.holding.matrix(self.K), self.holding.matrix(self.M)

    @cached_property
    def _free_factor(self) -> Factor:
        return factorise(self.K)

    @cached_property
    def _held_factor(self) -> Factor:
        return factorise(self._held[0])

    def modes(self, n: int) -> Eigenpairs:
        """The n lowest eigenpairs with actuators free, none missed: values, (rad/s)^2, negative where the state is not
        stable, and vectors (n_dof, n), orthonormal by M."""
        return lowest_of_any(self.K, self.M, min(n, self.K.shape[0]))

    def held_values(self, n: int) -> Array:
        """The n lowest eigenvalues with actuators locked, (rad/s)^2, none missed."""
        K, M = self._held
        return lowest_of_any(K, M, min(n, K.shape[0]), shapes=False).values

    def rows(self, node: int) -> Array:
        """Displacements (6, n) of a node from the free displacements."""
        model = self.equations.model
        root = int(model.root[node])
        G = rigid_arm(self.state.frames.R[root] @ model.arm[node])
        dof = model.dof[root]
        out = np.zeros((6, model.n_dof), like=G)
        out[:, dof[dof >= 0]] = G[:, dof >= 0]
        return out

    def compliance(self, node: int, held: bool = False) -> Array:
        """Displacements (6, 6) of a node per force and moment on it: m/N, 1/N and 1/(N m).

        Raises SolverError where the state has lost its stiffness.
        """
        C = self.rows(node) @ self.pushed(node, held)
        return (C + C.T) / 2

    def pushed(self, node: int, held: bool = False) -> Array:
        """Free displacements (n, 6) per force and moment on a node. Raises SolverError as `compliance`."""
        G = self.rows(node)
        if not held:
            return self._free_factor.solve(np.ascontiguousarray(G.T))
        return self.holding.motions(self._held_factor.solve(np.ascontiguousarray(self.holding.rows(G).T)))

    def drive_stiffness(self) -> Array:
        """Derivatives (d,) of the forces of the drives by their own displacements, the others held."""
        return np.diag(self._following[0])

    def following(self, drive: int) -> Array:
        """How the node of a drive moves (6,) per displacement of this drive, the others held (theory eq. G18)."""
        motion = self._following[1][:, drive]
        return np.asarray(self.rows(self.equations.drives[drive].node) @ motion, dtype=float)

    @cached_property
    def _following(self) -> tuple[Array, Array]:
        """Derivatives by the driven displacements of the forces of the drives (d, d), and of all free displacements
        (n, d)."""
        rows = self.state.tangent.rows
        flexible = self._free_factor.solve(np.ascontiguousarray(rows.T))
        stiffness = np.asarray(np.linalg.inv(rows @ flexible), dtype=float)
        return stiffness, flexible @ stiffness

    def displacement(self, node: int) -> Array:
        """Displacement (6,) of a node from rest: m, and its rotation vector, rad."""
        model, frames = self.equations.model, self.state.frames
        root = int(model.root[node])
        moved = frames.x[root] - model.rest.x[root] + (frames.R[root] - np.eye(3)) @ model.arm[node]
        return np.concatenate([moved, rotation_vector(frames.R[root])])


def lowest_of_any(K: Matrix, M: Matrix, n: int, shapes: bool = True) -> Eigenpairs:
    """The n lowest eigenpairs of K x = lambda M x, M positive semidefinite, K of any inertia; as `next_to`.

    Raises SolverError when there is no shift that makes K definite.
    """
    if is_definite(K):
        return next_to(K, M, n, 0.0, shapes=shapes)
    shift = 1e-6 * float(K.diagonal().max()) / max(float(M.diagonal().max()), 1e-300)
    for _ in range(SHIFTS):
        if is_definite(K + shift * M):
            return next_to(K, M, n, -shift, shapes=shapes)
        shift *= 2
    raise SolverError("something without mass is unstable")
