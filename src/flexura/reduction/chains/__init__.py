"""Serial chains of elements, and the full order in coordinates that keep their digits."""
