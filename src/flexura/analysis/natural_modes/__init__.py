"""Natural frequencies and modes with their evidence."""

from flexura.lazy import face

face(__name__)
