"""Pictures of mechanisms and mode shapes."""

from flexura.lazy import face

face(__name__)
