"""How it is drawn: cameras, pixels, lettering, axes, charts."""
