"""What tolerances of sizes and mountings do to a mechanism: spread, yield, worst case, and which to tighten first."""

from flexura.lazy import face

face(__name__)
