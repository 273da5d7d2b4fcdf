"""Outlines of planar parts: loops of lines and circular arcs, read from drawings (DXF, SVG), checked and offset."""

from flexura.lazy import face

face(__name__)
