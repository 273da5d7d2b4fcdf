"""Drawings understood: flexures, arms and blocks of a planar part, described as a mechanism and checked at once."""

from flexura.lazy import face

face(__name__)
