from flexura.mechanism.checks.problems import problems as problems
from flexura.mechanism.checks.survey import suggestion as suggestion
