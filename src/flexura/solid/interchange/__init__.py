"""Solids of other programs: STEP files, CalculiX, Ansys, and superelements of their matrices."""
