"""Where linear theory ends: rotations, stress, buckling, stiffening."""
