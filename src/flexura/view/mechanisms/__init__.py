"""Pictures of mechanisms that are deformed, move or are in doubt."""
