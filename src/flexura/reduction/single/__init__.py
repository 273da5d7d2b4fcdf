"""One design reduced: substructures, their coordinates, and the last steps to very few."""
