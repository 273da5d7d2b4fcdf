"""What is asked of designs by name: read from text, with units, answered for blocks of designs, and exact slopes."""

from flexura.lazy import face

face(__name__)
