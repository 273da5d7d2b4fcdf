"""Measured data: channels, records, frequency responses estimated from them, and the modes that are measured."""

from flexura.lazy import face

face(__name__)
