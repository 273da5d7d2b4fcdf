"""Large displacements and rotations: equilibria of a mechanism over its stroke, and the models about them."""

from flexura.lazy import face

face(__name__)
