"""The full-order model of one design in extended precision, assembled from the flexibility of every element.

No digits of the low frequencies cancel in the assembly: every element's stiffness is the inverse of its flexibility,
acting on the relative twist of its ends, evaluated to some 1e-18. Eigenvalues are Rayleigh quotients of LAPACK's
vectors, refined by inverse iteration, whose error is the square of the vectors'.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from flexura.beam import rigid_arm
from flexura.reduction.assembly import low_order
from flexura.structure.design import Design

Wide = np.longdouble


def wide_inverse(A: np.ndarray) -> np.ndarray:
    """Inverse of stacks of small symmetric positive definite matrices, by Newton's iteration in extended precision."""
    d = 1 / np.sqrt(np.einsum("...ii->...i", A))
    B = A * d[..., :, None] * d[..., None, :]
    X = np.linalg.inv(B.astype(float)).astype(Wide)
    for _ in range(4):
        X = X @ (2 * np.eye(A.shape[-1], dtype=Wide) - B @ X)
    return X * d[..., :, None] * d[..., None, :]


def _arm(x: np.ndarray) -> np.ndarray:
    out = np.zeros((*x.shape[:-1], 6, 6), dtype=Wide)
    out[...] = np.eye(6)
    exact = x.astype(Wide)
    pattern = rigid_arm(np.eye(3))
    for k in range(3):
        out[..., :3, 3:] += exact[..., k, None, None] * pattern[k, :3, 3:]
    return out


def wide_model(plan, parameters=None) -> tuple[np.ndarray, np.ndarray]:
    """K and M (n, n) of the full order in extended precision."""
    design = Design.of(plan, parameters)
    topology = plan.topology
    n = topology.n_dof + 1
    K, M = np.zeros((n, n), dtype=Wide), np.zeros((n, n), dtype=Wide)
    for name, reducer in low_order(plan).reducers.items():
        part, own = reducer.part, design.matrices[name]
        every = np.arange(part.n_nodes)
        G = design.node_transforms(name, every).astype(Wide)
        x = design.geometry.parts[name].positions
        number = np.array(topology.copies[name].offset)[:, None] + every
        dofs = topology.dof[topology.root[number]]

        def add(out, nodes, A, G=G, dofs=dofs):
            for copy in range(len(dofs)):
                T = np.zeros((6 * len(nodes), 6 * len(nodes)), dtype=Wide)
                for a, node in enumerate(nodes):
                    T[6 * a : 6 * a + 6, 6 * a : 6 * a + 6] = G[copy, node]
                at = dofs[copy, nodes].ravel()
                np.add.at(out, np.ix_(at, at), T.T @ A @ T)

        T = own.T.astype(Wide)
        if len(part.connectivity):
            ends = x[part.connectivity].astype(Wide)
            arm = _arm(ends[:, 0] - ends[:, 1])  # motion at j carried to i, and back
            turned = T[:, 6:, 6:]
            inverse = turned.copy()
            inverse[...] = np.linalg.inv(turned.astype(float))
            for _ in range(3):
                inverse = inverse @ (2 * np.eye(6, dtype=Wide) - turned @ inverse)
            stiff = wide_inverse(own.elements.C.astype(Wide))
            at_j = np.swapaxes(turned, -1, -2) @ stiff @ turned
            back = _arm(ends[:, 1] - ends[:, 0])
            relative = np.concatenate([-back, np.broadcast_to(np.eye(6, dtype=Wide), arm.shape)], axis=-1)
            k = np.swapaxes(relative, -1, -2) @ at_j @ relative
            m = np.swapaxes(T, -1, -2) @ own.elements.M.astype(Wide) @ T
            together = set()
            for elements, S in own.elements.couplings:
                n_e = elements.shape[1]
                for strip, shared in zip(elements, S, strict=True):
                    F, D = np.zeros((6 * n_e, 6 * n_e), dtype=Wide), np.zeros((6 * n_e, 6 * n_e + 6), dtype=Wide)
                    F[3::6, 3::6] = -shared
                    for at, e in enumerate(strip):
                        F[6 * at : 6 * at + 6, 6 * at : 6 * at + 6] += own.elements.C[e]
                        D[6 * at : 6 * at + 6, 6 * at : 6 * at + 12] = turned[e] @ relative[e]
                    nodes = [*part.connectivity[strip, 0], part.connectivity[strip[-1], 1]]
                    add(K, nodes, D.T @ wide_inverse(F) @ D)
                    together.update(strip.tolist())
            for e, nodes in enumerate(part.connectivity):
                if e not in together:
                    add(K, list(nodes), k[e])
                add(M, list(nodes), m[e])
        for discrete in own.discrete_elements:
            for out, A in ((K, discrete.K), (M, discrete.M)):
                if A is not None:
                    add(out, list(discrete.nodes), A.astype(Wide))
    return K[:-1, :-1], M[:-1, :-1]


def wide_frequencies(plan, parameters=None, count: int = 6, shift: float = 0.0) -> np.ndarray:
    """The `count` lowest natural frequencies, Hz; `shift` (rad/s)^2 for mechanisms that float."""
    K, M = wide_model(plan, parameters)
    A = K + shift * M
    d = 1 / np.sqrt(np.einsum("ii->i", A))
    A, B = A * d[:, None] * d, M * d[:, None] * d
    low, rough = A.astype(float), B.astype(float)
    n = len(d)
    p = min(count + 6, n)
    _, X = la.eigh(rough, low, subset_by_index=[n - p, n - 1])
    X = X.astype(Wide)
    factor = la.cho_factor(low)
    for _ in range(3):  # inverse iteration with residuals in extended precision
        right = B @ X
        Y = la.cho_solve(factor, right.astype(float)).astype(Wide)
        for _ in range(3):
            Y += la.cho_solve(factor, (right - A @ Y).astype(float)).astype(Wide)
        a, b = (Y.T @ right).astype(float), (Y.T @ (B @ Y)).astype(float)
        s = 1 / np.sqrt(np.diagonal(b))
        _, Z = la.eigh(a * s[:, None] * s, b * s[:, None] * s)
        X = Y @ (s[:, None] * Z).astype(Wide)
        X = X / np.sqrt(np.einsum("ik,ik->k", X, B @ X))
    # rotations among the vectors that double precision has left cancel to second order
    quotients = np.einsum("ik,ik->k", X, A @ X) / np.einsum("ik,ik->k", X, B @ X)
    values = np.sort(quotients)[:count] - Wide(shift)
    return np.sqrt(np.maximum(values, 0)).astype(float) / (2 * np.pi)
