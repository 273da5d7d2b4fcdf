"""Models with named inputs and outputs: second-order systems, their modal form, and state space."""

from flexura.lazy import face

face(__name__)
