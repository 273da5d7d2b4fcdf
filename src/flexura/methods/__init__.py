"""Other models of the same mechanism: every method reads one description and answers the same question."""

from flexura.lazy import face

face(__name__)
