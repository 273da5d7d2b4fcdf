"""Responses over frequency and time."""
