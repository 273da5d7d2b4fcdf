"""Many designs at once, with intervals."""

from flexura.lazy import face

face(__name__)
