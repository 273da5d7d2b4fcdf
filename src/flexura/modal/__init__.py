"""How alike modes are, and which is which: pure functions of arrays."""

from flexura.lazy import face

face(__name__)
