from flexura.methods.compare import Comparison as Comparison
from flexura.methods.compare import ComparisonRow as ComparisonRow
from flexura.methods.compare import compare as compare
from flexura.methods.solution import Solution as Solution
