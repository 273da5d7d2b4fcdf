"""Pictures of mechanisms that are deformed, move or have warnings."""

from flexura.lazy import face

face(__name__)
