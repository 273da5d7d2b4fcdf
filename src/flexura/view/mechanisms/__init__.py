"""Pictures of mechanisms that are deformed, move or are in doubt."""

from flexura.lazy import face

face(__name__)
