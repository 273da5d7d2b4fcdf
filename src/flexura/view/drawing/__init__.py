"""How it is drawn: cameras, pixels, lettering, axes, charts."""

from flexura.lazy import face

face(__name__)
