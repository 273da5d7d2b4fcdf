"""Reduction to a tolerance, with a certificate of every frequency."""

from flexura.lazy import face

face(__name__)
