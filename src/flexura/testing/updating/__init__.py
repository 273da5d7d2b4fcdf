"""Parameters of a mechanism found from measured frequencies, shapes and responses."""

from flexura.lazy import face

face(__name__)
