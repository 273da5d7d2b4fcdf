"""Parts coupled and decoupled by their frequency responses, measured or computed, at channels and at virtual points."""

from flexura.lazy import face

face(__name__)
