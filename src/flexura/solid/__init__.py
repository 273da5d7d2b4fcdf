"""Three-dimensional solids of the same mechanism: geometry, meshes, finite elements, and parts reduced from them."""

from flexura.lazy import face

face(__name__)
