"""Factorisations, eigenvalue solvers and inertia counts; no physics."""

from flexura.linalg.eigen import Eigenpairs, factorise, is_definite, lowest, residuals
from flexura.linalg.inertia import count_below

__all__ = ["Eigenpairs", "count_below", "factorise", "is_definite", "lowest", "residuals"]
