"""What a mechanism is described with in Python: its materials, sections, members, bodies, actuators and parameters."""

from flexura.lazy import face

face(__name__)
