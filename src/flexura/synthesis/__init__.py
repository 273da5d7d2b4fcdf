"""From wished freedoms to mechanisms: topologies by reciprocal screws, sizes by studies."""

from flexura.lazy import face

face(__name__)
