"""Test and model side by side."""
