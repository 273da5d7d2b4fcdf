"""Strain energy, forces, stress and motions of a state."""

from flexura.lazy import face

face(__name__)
