"""Members as solids: geometry, meshes, finite elements, and the superelements reduced from them."""

from flexura.lazy import face

face(__name__)
