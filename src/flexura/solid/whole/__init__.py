"""The part itself as one solid: what it is made of, what holds it, its mesh and its modes."""

from flexura.lazy import face

face(__name__)
