"""Equilibria over a stroke, and what is read of them."""
