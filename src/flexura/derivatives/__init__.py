"""What a design is in a state, and exact derivatives of that, of eigenpairs and of responses by the parameters."""

from flexura.lazy import face

face(__name__)
