"""Meshes of solids: points and cells, shape functions, meshers."""

from flexura.lazy import face

face(__name__)
