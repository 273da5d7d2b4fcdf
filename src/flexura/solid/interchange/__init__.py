"""Solids of other programs: STEP files, CalculiX, Ansys, and superelements of their matrices."""

from flexura.lazy import face

face(__name__)
