"""Large displacements and rotations: equilibria of a mechanism over its stroke, and the models about them."""
