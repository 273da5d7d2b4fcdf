"""Reduction to a tolerance, with a certificate of every frequency."""
