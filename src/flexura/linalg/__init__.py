"""Factorisations, eigenvalue solvers, inertia counts and proven bounds; no physics."""

from flexura.linalg.buckling import critical_factors
from flexura.linalg.eigen import Eigenpairs, factorise, is_definite, lowest, residual_intervals, residuals
from flexura.linalg.enclosures import Enclosures, enclose
from flexura.linalg.inertia import ShiftedFactors, count_below, shifted_factors
from flexura.linalg.ranking import leading, ranked, turned

__all__ = [
    "Eigenpairs",
    "Enclosures",
    "ShiftedFactors",
    "count_below",
    "critical_factors",
    "enclose",
    "factorise",
    "is_definite",
    "leading",
    "lowest",
    "ranked",
    "residual_intervals",
    "residuals",
    "shifted_factors",
    "turned",
]
