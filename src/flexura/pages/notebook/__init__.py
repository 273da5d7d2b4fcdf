"""The viewer and sliders in notebooks."""

from flexura.lazy import face

face(__name__)
