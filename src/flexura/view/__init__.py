"""Pictures of mechanisms and mode shapes."""

from flexura.lazy import face

face(__name__, former={"draw_doubts": "draw_warnings", "save_doubts": "save_warnings"})
