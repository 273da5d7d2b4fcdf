"""How far a state of equilibrium is from buckling."""

from __future__ import annotations

from flexura.errors import SolverError
from flexura.linalg import critical_factors, scaled, unit_scale
from flexura.motion.clusters import Superelements
from flexura.motion.pose import Pose

MOST = 1e6
"""Factors beyond this are round-off: nothing buckles."""

UNLOADED = 1e-12
"""Entries of the geometric stiffness, beside a diagonal of ones of the other, that are round-off."""


def buckling_factor(pose: Pose) -> float | None:
    """The factor on all loads and drive forces of a state at which it would buckle with the drives held, linear from
    the state (theory eqs. G16-G17).

    None where nothing buckles, and where the state has no stiffness of its own without these forces. None at low
    order, whose superelements do not tell these apart.
    """
    groups = pose.equations.model.elements
    if any(isinstance(own, Superelements) and own.energy.cubic.size for own in groups):
        return None
    total, _ = pose.matrices(held=True)
    material = pose.holding.matrix(pose.equations.model.material(pose.state.frames, pose.state.loads.actuators))
    geometric = total - material
    if not material.shape[0] or abs(scaled(geometric, unit_scale(material))).max() < UNLOADED:
        return None
    try:
        factors = critical_factors(material, geometric, 1)
    except SolverError:
        return None
    return float(factors[0]) if len(factors) and factors[0] < MOST else None
