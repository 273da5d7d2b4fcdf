"""A page on this machine whose sliders are the parameters of a mechanism."""

from flexura.lazy import face

face(__name__)
