"""Beam models of a mechanism held against its solid."""

from flexura.lazy import face

face(__name__)
