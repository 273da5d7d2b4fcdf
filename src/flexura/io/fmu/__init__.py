"""Functional mock-up units of linear models."""
