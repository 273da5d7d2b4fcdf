"""Where linear theory ends: rotations, stress, buckling, stiffening."""

from flexura.lazy import face

face(__name__)
