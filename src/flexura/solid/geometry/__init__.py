"""Members as solids: contours, placed solids, boundary representations."""

from flexura.lazy import face

face(__name__)
