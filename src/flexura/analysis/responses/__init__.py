"""Responses over frequency and time."""

from flexura.lazy import face

face(__name__)
