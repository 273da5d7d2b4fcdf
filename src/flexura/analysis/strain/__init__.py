"""Strain energy, forces, stress and motions of a state."""
