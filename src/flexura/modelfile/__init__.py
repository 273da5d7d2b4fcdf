"""Model files: YAML with units and expressions, to and from a Mechanism."""

from flexura.lazy import face

face(__name__)
