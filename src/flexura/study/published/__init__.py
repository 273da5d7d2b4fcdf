"""What is asked of a mechanism beside the numbers that others give of it."""

from flexura.lazy import face

face(__name__)
