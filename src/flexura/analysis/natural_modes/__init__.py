"""Natural frequencies and modes with their evidence."""
