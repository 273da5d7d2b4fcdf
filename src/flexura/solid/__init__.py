"""Three-dimensional solids of the same mechanism: geometry, meshes, finite elements, and parts reduced from them."""

from flexura.solid.mesh import SolidMaterial, SolidMesh

__all__ = ["SolidMaterial", "SolidMesh"]
