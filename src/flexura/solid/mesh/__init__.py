"""Meshes of solids: points and cells, shape functions, meshers."""
