"""Three-dimensional solids of the same mechanism: geometry, meshes, finite elements, and parts reduced from them."""
