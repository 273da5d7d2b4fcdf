"""The test before there is one: simulated hits, and where to put sensors."""

from flexura.lazy import face

face(__name__)
