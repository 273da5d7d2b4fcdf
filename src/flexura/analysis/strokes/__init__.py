"""Equilibria over a stroke, and what is read of them."""

from flexura.lazy import face

face(__name__)
