"""Numerical thresholds that several rooms share, by what they bound; those of one formula stand beside it."""

PROVEN = 1e-3
"""Relative error to which frequencies, and what follows from them, are proven where nothing else is asked for."""

ROUND_OFF = 1e-12
"""Relative difference of numbers that are the same, and size beside the largest of its kind that is none, after some
operations of double precision."""

STATIC_ROUND_OFF = 1e-9
"""Relative round-off of static solutions: of compliances, of sums over all modes and of what these lack of a static
response; so much of a compliance is left where supports, actuators or a pose hold."""

CROSS_COMPLIANCE = 1e-8
"""A compliance between two displacements below so much of its bound, sqrt(C_ii C_jj), is round-off."""

SAME_SIZE = 1e-9
"""Relative difference of lengths, sections and matrices of parts that are the same."""

SAME_PLACE = 1e-6
"""Distance, over the size of the mechanism or of the part, of points at one place, of a point on a face, and of parts
that touch."""

REPEATED_EIGENVALUES = 1e-6
"""Relative difference of eigenvalues, or of frequencies, up to which they are repeated."""

EQUAL_BY_SYMMETRY = 1e-6
"""Relative difference of other numbers up to which symmetry makes them equal: entries of vectors, determinants."""

STILL = 1e-7
"""Motion beside the largest of its kind up to which something does not move."""

FREE_MOTION = 1e-9
"""Stiffness of a motion beside the largest, where the matrix has a diagonal of ones, up to which the motion is free;
and how far supports hold it."""
