"""What the tolerances of sizes do to a mechanism: spread, yield, worst case, and which to tighten first."""

from flexura.lazy import face

face(__name__)
