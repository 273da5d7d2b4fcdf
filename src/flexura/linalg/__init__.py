"""Factorisations, eigenvalue solvers, inertia counts and proven bounds; no physics."""

from flexura.lazy import face

face(__name__)
