"""Tests on the real thing and before it: measured data, identified modes, correlation with the model, calibration."""

from flexura.lazy import face

face(__name__)
