"""The same questions of many designs."""

from flexura.lazy import face

face(__name__)
