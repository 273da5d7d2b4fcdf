"""Derivatives of eigenpairs and responses with respect to the parameters of a mechanism."""
