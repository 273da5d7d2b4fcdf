"""What may not be meant in a description, and what it takes for granted."""

from flexura.lazy import face

face(__name__)
