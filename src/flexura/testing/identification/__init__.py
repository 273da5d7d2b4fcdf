"""Modes identified from frequency responses, of one setup or of several merged."""

from flexura.lazy import face

face(__name__)
