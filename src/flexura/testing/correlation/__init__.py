"""Test and model side by side."""

from flexura.lazy import face

face(__name__)
