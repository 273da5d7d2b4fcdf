"""Beam models of a mechanism held against its solid."""
