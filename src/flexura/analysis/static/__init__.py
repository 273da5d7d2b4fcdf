"""Linear statics and kinetostatics."""

from flexura.lazy import face

face(__name__)
