"""What is described: materials, sections, members, bodies, substructures and how they are put together."""

from flexura.lazy import face

face(__name__)
