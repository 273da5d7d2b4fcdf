"""What is done with models and matrices beside the verbs: certificates, condensation, rows of forces and stresses,
slopes of modes and responses."""

from flexura.lazy import face

face(__name__)
