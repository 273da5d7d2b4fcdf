from flexura.study.optimum.optimize import optimize as optimize
from flexura.study.optimum.results import ActiveLimit as ActiveLimit
from flexura.study.optimum.results import Optimum as Optimum
from flexura.study.optimum.results import OptimumStart as OptimumStart
from flexura.study.optimum.results import OptimumVariable as OptimumVariable
from flexura.study.optimum.results import Pareto as Pareto
from flexura.study.optimum.results import Proof as Proof
from flexura.study.optimum.results import Violation as Violation
