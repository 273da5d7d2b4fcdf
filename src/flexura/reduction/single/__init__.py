"""One design reduced: substructures, their coordinates, and the last steps to very few."""

from flexura.lazy import face

face(__name__)
