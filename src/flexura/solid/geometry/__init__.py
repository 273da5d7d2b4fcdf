"""Members as solids: contours, placed solids, boundary representations."""
