"""Mechanisms that people build, each described in one file with the sources of its sizes: what a user begins with."""

from flexura.lazy import face

face(__name__)
