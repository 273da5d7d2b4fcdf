"""Pages that move: the 3-D viewer, reports, the live page and notebooks."""

from flexura.lazy import face

face(__name__)
