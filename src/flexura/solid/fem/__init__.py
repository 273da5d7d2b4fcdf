"""Finite elements of solids: matrices, ties, reduced pieces, the mechanisms that these make, and modes."""
