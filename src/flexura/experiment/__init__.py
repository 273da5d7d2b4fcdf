"""Tests on the real thing: measured data, identified modes, correlation with the model, calibration."""
