"""Factorisations, eigenvalue solvers, inertia counts and proven bounds; no physics."""

from flexura.linalg.buckling import critical_factors
from flexura.linalg.eigen import lowest, lowest_modes, ritz_pairs
from flexura.linalg.enclosures import Enclosures, enclose, upper_bounds
from flexura.linalg.factor import Factor, SingularError, factorise, is_definite, least_pivot
from flexura.linalg.inertia import Bracket, bracket, count_below
from flexura.linalg.pencil import Pencil
from flexura.linalg.ranking import leading, ranked, turned
from flexura.linalg.residual_bounds import residual_intervals, residuals, static_response
from flexura.linalg.scaling import inverse_roots, scaled, unit_scale
from flexura.linalg.search import Eigenpairs

__all__ = [
    "Bracket",
    "Eigenpairs",
    "Enclosures",
    "Factor",
    "Pencil",
    "SingularError",
    "bracket",
    "count_below",
    "critical_factors",
    "enclose",
    "factorise",
    "inverse_roots",
    "is_definite",
    "leading",
    "least_pivot",
    "lowest",
    "lowest_modes",
    "ranked",
    "residual_intervals",
    "residuals",
    "ritz_pairs",
    "scaled",
    "static_response",
    "turned",
    "unit_scale",
    "upper_bounds",
]
