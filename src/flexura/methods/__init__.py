"""Other models of the same mechanism: every method reads one description and answers the same question."""

from flexura.methods.compare import Comparison, ComparisonRow, compare
from flexura.methods.solution import Solution

__all__ = ["Comparison", "ComparisonRow", "Solution", "compare"]
