"""Derivatives of eigenpairs and responses with respect to the parameters of a mechanism."""

from flexura.lazy import face

face(__name__)
