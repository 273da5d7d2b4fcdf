"""Numbers that depend on parameters: expressions as trees, evaluated, with physical dimensions, and never executed."""

from flexura.lazy import face

face(__name__)
