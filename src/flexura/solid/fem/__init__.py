"""Finite elements of solids: matrices, ties, reduced pieces, the mechanisms that these make, and modes."""

from flexura.lazy import face

face(__name__)
