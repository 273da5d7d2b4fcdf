"""Functional mock-up units of linear models."""

from flexura.lazy import face

face(__name__)
