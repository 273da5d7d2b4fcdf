"""How far a state of equilibrium is from buckling."""

from __future__ import annotations

from flexura.arrays import Array
from flexura.errors import SolverError
from flexura.linalg import Matrix, critical_factors, critical_shapes, scaled, unit_scale
from flexura.motion.clusters import Superelements
from flexura.motion.pose import Pose

MOST = 1e6
"""Factors beyond this are round-off: nothing buckles."""

UNLOADED = 1e-12
"""Entries of the geometric stiffness, beside a diagonal of ones of the other, that are round-off."""


def buckling_factor(pose: Pose) -> float | None:
    """The factor on all loads and drive forces of a state at which it would buckle with actuators locked, linear from
    the state (theory eqs. G16-G17).

    None where nothing buckles, and where the state has no stiffness of its own without these forces. None at low
    order, whose superelements do not tell these apart.
    """
    parts = _parts(pose)
    if parts is None:
        return None
    try:
        factors = critical_factors(*parts, 1)
    except SolverError:
        return None
    return float(factors[0]) if len(factors) and factors[0] < MOST else None


def critical_state(pose: Pose, n: int) -> tuple[Array, Array] | None:
    """The n lowest of these factors (k,), with shapes x (m, k) of what is left with actuators locked, x' K x = 1 of its
    stiffness K without forces; None where `buckling_factor` is. Raises SolverError where shapes are not found."""
    parts = _parts(pose)
    if parts is None or buckling_factor(pose) is None:
        return None
    return critical_shapes(*parts, min(n, parts[0].shape[0]))


def material_at(pose: Pose) -> Matrix:
    """The stiffness (n, n) at a state as if nothing were under force there, actuators free."""
    return pose.equations.model.material(pose.state.frames, pose.state.loads.actuators)


def _parts(pose: Pose) -> tuple[Matrix, Matrix] | None:
    """Stiffness at a state with actuators locked: what is there without forces, and what forces add."""
    groups = pose.equations.model.elements
    if any(isinstance(own, Superelements) and own.energy.cubic.size for own in groups):
        return None
    total, _ = pose.matrices(held=True)
    material = pose.holding.matrix(material_at(pose))
    geometric = total - material
    if not material.shape[0] or abs(scaled(geometric, unit_scale(material))).max() < UNLOADED:
        return None
    return material, geometric
