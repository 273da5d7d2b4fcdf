"""A page on this machine: a mechanism whose parameters are sliders, or a test whose modes are picked."""

from flexura.lazy import face

face(__name__)
