"""Serial chains of elements, and the full order in coordinates that keep their digits."""

from flexura.lazy import face

face(__name__)
