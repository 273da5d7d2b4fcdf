"""Modes identified from frequency responses, of one setup or of several merged."""
