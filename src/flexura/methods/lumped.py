"""The lumped-parameter model in kinematic DOFs: the few motions that the flexures leave easy.

Everything is condensed statically to the rigid bodies; members contribute the share of their mass that moves with this
static shape, by Rayleigh's principle (Lobontiu 2002). Of the bodies' motions only the freedoms are kept, those below
the gap in the stiffness spectrum, as flexure systems are designed by freedoms and constraints (Hopkins and Culpepper
2010).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from flexura.arrays import Array, Index
from flexura.errors import OptionError, SolverError
from flexura.linalg import factorise, is_definite, lowest
from flexura.methods.solution import Solution
from flexura.reduction import reduce
from flexura.structure import FullOrderModel

GAP = 100.0
"""Constraints are so many times stiffer than freedoms, at least; an order of magnitude in frequency."""

ZERO = 1e-9
"""A scaled stiffness below this part of the largest is a free motion."""

NOISE = 1e-11
"""A scaled stiffness below this part of the largest before condensation is round-off."""

ALONG = 0.2
"""Scaled share from which a coordinate is said to go along with another."""


@dataclass(frozen=True)
class LumpedModel:
    """K and M (r, r) of the kinematic DOFs; `recovery` (full order, r).

    `spectrum` (b,) are all scaled stiffnesses of the bodies, ascending, rad^2/s^2, of which the first r are kept;
    `names` are the coordinates of the bodies that determine the kinematic DOFs, e.g. `platform.tz`.
    """

    K: Array
    M: Array
    recovery: Array
    spectrum: Array
    names: tuple[str, ...]
    note: str


def lumped_parameter(model: FullOrderModel, count: int) -> Solution:
    """The `count` lowest natural frequencies of the lumped-parameter model in kinematic DOFs (theory eqs. L7-L10).

    Frequencies are never below the full-order model's of the same rank. Good for the working motions of a mechanism
    whose members are light; blind to every motion that leaves the bodies at rest. Raises OptionError when nothing can
    move or has mass, and SolverError when something moves freely beside the bodies.
    """
    own = lumped_model(model)
    pairs = lowest(own.K, own.M, count)
    hz = np.sqrt(np.maximum(pairs.values, 0.0)) / (2 * np.pi)
    shapes = model.node_displacements(own.recovery @ pairs.vectors)
    return Solution("lumped parameter", len(own.K), hz, shapes, own.note)


def lumped_model(model: FullOrderModel) -> LumpedModel:
    """K, M and recovery of the lumped-parameter model.

    Without rigid bodies the nodes that the low-order model keeps stand in their place. Raises OptionError when nothing
    can move or has mass, and SolverError when something moves freely beside the bodies.
    """
    low = reduce(model.plan, model.parameters)
    names = np.array(low.coordinate_names, dtype=object)
    owners = np.array([name.rsplit(".", 1)[0] for name in names], dtype=object)
    kept = np.flatnonzero(np.isin(owners, _bodies(model)))
    kept = kept if len(kept) else np.arange(len(names))
    if not len(kept):
        raise OptionError("every rigid body and every node that could stand in for one is held")
    K, M, T = _condensed(low.K, low.M, kept)
    scale = _scale(M, names[kept], owners[kept], float(np.ptp(model.geometry.positions, axis=0).max()))
    spectrum, V = la.eigh(K * scale[:, None] * scale)
    noise = NOISE * float((low.K.diagonal()[kept] * scale**2).max())
    spectrum[spectrum <= max(ZERO * spectrum[-1], noise)] = 0.0
    r, reason = _freedoms(spectrum)
    motions = scale[:, None] * V[:, :r]
    labels = _labels(V[:, :r], list(names[kept]))
    note = f"kinematic DOFs: {', '.join(labels)}; {reason}" if r < len(kept) else reason
    recovery = np.asarray(low.recover(T @ motions))
    return LumpedModel(np.diag(spectrum[:r]), motions.T @ M @ motions, recovery, spectrum, labels, note)


def _bodies(model: FullOrderModel) -> list[str]:
    """Names of the nodes whose DOFs are those of the rigid bodies."""
    topology = model.plan.topology
    at = [
        offset + node
        for name, placed in topology.copies.items()
        for offset in placed.offset
        for node, _ in model.plan.parts[name].bodies.values()
    ]
    return [topology.node_names[n] for n in topology.root[np.array(at, dtype=np.intp)]]


def _condensed(K: Any, M: Any, kept: Index) -> tuple[Array, Array, Array]:
    """K, M (b, b) condensed statically to the kept coordinates, and T (n, b) to all of them (Guyan 1965)."""
    n = K.shape[0]
    rest = np.setdiff1d(np.arange(n), kept)
    T = np.zeros((n, len(kept)))
    T[kept] = np.eye(len(kept))
    K, M = sp.csr_matrix(K), sp.csr_matrix(M)
    if len(rest):
        inner = K[rest][:, rest].tocsc()
        if not is_definite(inner):
            raise SolverError("something moves freely beside the rigid bodies: no static shape follows from theirs")
        T[rest] = -factorise(inner).solve(K[rest][:, kept].toarray())
    Kb, Mb = K[kept] @ T, T.T @ (M @ T)
    return (Kb + Kb.T) / 2, (Mb + Mb.T) / 2, T


def _scale(M: Array, names: Any, owners: Any, size: float) -> Array:
    """Scale (b,) of the coordinates: 1/sqrt(m) and 1/(l sqrt(m)) with the mass and the radius of gyration of each body
    (theory eq. L8)."""
    turns = np.array([name.rsplit(".", 1)[1].startswith("r") for name in names])
    inertia = np.empty(len(names))
    for owner in dict.fromkeys(owners):
        own = owners == owner
        mass = float(np.diagonal(M)[own & ~turns].mean()) if (own & ~turns).any() else 0.0
        turning = float(np.diagonal(M)[own & turns].mean()) if (own & turns).any() else 0.0
        inertia[own & ~turns] = mass
        inertia[own & turns] = turning if turning > 0 else mass * size**2
    if not (inertia > 0).all():
        raise OptionError(f"{owners[np.argmin(inertia)]} has no mass: no stiffness can be called high or low there")
    return 1 / np.sqrt(inertia)


def _freedoms(spectrum: Array) -> tuple[int, str]:
    """Number of scaled stiffnesses below the first gap, and how it was found. Free motions always count."""
    free = int((spectrum == 0).sum())
    ratio = spectrum[free + 1 :] / spectrum[free:-1]
    gaps = np.flatnonzero(ratio >= GAP)
    if len(gaps):
        return free + int(gaps[0]) + 1, f"constraints are {ratio[gaps[0]]:.3g} times stiffer"
    largest = f" (largest step {ratio.max():.3g})" if len(ratio) else ""
    return len(
        spectrum
    ), f"no gap in the stiffness spectrum{largest}: all {len(spectrum)} motions of the bodies are kept"


def _labels(V: Array, names: list[str]) -> tuple[str, ...]:
    """The r coordinates that determine orthonormal motions V (b, r) best, each with those of its body that go along."""
    _, R, pivots = la.qr(V.T, pivoting=True, mode="economic")
    r = V.shape[1]
    along = la.solve_triangular(R[:, :r], R[:, r:])
    said = []
    for k in np.argsort(pivots[:r]):
        owner = names[pivots[k]].rsplit(".", 1)[0]
        others = [names[pivots[r + i]].rsplit(".", 1) for i in np.flatnonzero(np.abs(along[k]) > ALONG)]
        said.append("+".join([names[pivots[k]], *(dof for body, dof in others if body == owner)]))
    return tuple(said)
