"""Tests on the real thing and before it: measured data, identified modes, correlation with the model, calibration."""
