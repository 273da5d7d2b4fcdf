"""Factorisations, eigenvalue solvers, inertia counts and proven bounds; no physics."""

from flexura.linalg.assignment import assignment
from flexura.linalg.buckling import critical_factors
from flexura.linalg.eigen import (
    Eigenpairs,
    factorise,
    is_definite,
    least_pivot,
    lowest,
    lowest_modes,
    residual_intervals,
    residuals,
    ritz_pairs,
    static_response,
)
from flexura.linalg.enclosures import Enclosures, enclose, upper_bounds
from flexura.linalg.inertia import Bracket, bracket, count_below
from flexura.linalg.pencil import Pencil
from flexura.linalg.ranking import leading, ranked, turned

__all__ = [
    "Bracket",
    "Eigenpairs",
    "Enclosures",
    "Pencil",
    "assignment",
    "bracket",
    "count_below",
    "critical_factors",
    "enclose",
    "factorise",
    "is_definite",
    "leading",
    "least_pivot",
    "lowest",
    "lowest_modes",
    "ranked",
    "residual_intervals",
    "residuals",
    "ritz_pairs",
    "static_response",
    "turned",
    "upper_bounds",
]
