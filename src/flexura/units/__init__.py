"""Text with units to SI floats, and back."""

from flexura.lazy import face

face(__name__)
