"""Many designs at once, with intervals."""
