"""Three-dimensional solids of the same mechanism: geometry, meshes, finite elements, and parts reduced from them."""

from flexura.solid.geometry.members import SolidMaterial
from flexura.solid.mesh.solid_mesh import SolidMesh

__all__ = ["SolidMaterial", "SolidMesh"]
