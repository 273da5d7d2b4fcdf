"""The best design under limits.

Optima that a model file describes under `studies`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.deadline import Listener, Progress, unheard
from flexura.errors import OptionError, SolverError
from flexura.expressions import Expression
from flexura.mechanism import Mechanism, OptimumStudy, Range, bounds
from flexura.structure import Plan, one_design, plan_of
from flexura.study.optimum.climb import Method, best_of
from flexura.study.optimum.discrete import Chosen, chosen_alone, chosen_with_others
from flexura.study.optimum.front import front
from flexura.study.optimum.outcome import optimum_of, pareto_of
from flexura.study.optimum.results import Optimum, Pareto
from flexura.study.optimum.task import task_of
from flexura.study.space import Variable, Varied


def described(plan: Plan, name: str | None, fixed: Mapping[str, float]) -> dict[str, Any]:
    """What the study of a name, or the only one that is an optimum, says: arguments of the verb by their names; none
    where there is no such study and none is named. Raises OptionError for unknown names, and several without one."""
    studies = plan.mechanism.studies
    known = [key for key, own in studies.items() if isinstance(own.own, OptimumStudy)]
    if name is None:
        if len(known) > 1:
            raise OptionError(f"the file describes {len(known)} optima; name a study: {', '.join(known)}")
        if not known:
            return {}
        name = known[0]
    if name not in known:
        kind = f"{name!r} is a {studies[name].kind}" if name in studies else f"there is no study {name!r}"
        raise OptionError(f"{kind}; optima: {', '.join(known) or 'none'}")
    own = studies[name].own
    assert isinstance(own, OptimumStudy)
    goals = own.goals or ()
    values = {key: float(value) for key, value in plan.parameter_values(dict(fixed)).items()}
    return {
        "vary": [_variable(plan, key, variation, values) for key, variation in own.vary.items()],
        "maximise": [text for text in (own.maximise, *(goal.maximise for goal in goals)) if text],
        "minimise": [text for text in (own.minimise, *(goal.minimise for goal in goals)) if text],
        "subject_to": list(own.subject_to),
        "starts": own.starts,
        "seed": own.seed,
    }


def _variable(plan: Plan, name: str, variation: Any, values: Mapping[str, float]) -> Variable:
    parameter = plan.mechanism.parameters[name]

    def number(value: Any) -> float:
        return float(value.evaluate(values)) if isinstance(value, Expression) else float(value)

    if not isinstance(variation, Range):
        return Variable.of(name, [number(own) for own in variation], parameter.unit)
    low, high = (float(end) for end in bounds(name, parameter, values))
    low = low if variation.from_ is None else number(variation.from_)
    high = high if variation.to is None else number(variation.to)
    if not np.isfinite(low + high):
        raise OptionError(f"{name} has no minimum and maximum in the file; give its range both ends")
    kind = "integer" if variation.integer else "continuous"
    return Variable(name, low, high, kind, scale=variation.scale, unit=parameter.unit)


STARTS = 8
"""Designs that searches may start from, the first the design as it is."""

POINTS = 24
"""Designs of a Pareto front."""


@verb
def optimize(
    model: Mechanism | Plan,
    parameters: Mapping[str, ArrayLike] | None = None,
    *,
    vary: Varied | None = None,
    maximise: str | Sequence[str] | None = None,
    minimise: str | Sequence[str] | None = None,
    subject_to: str | Sequence[str] | None = None,
    study: str | None = None,
    starts: int | None = None,
    points: int = POINTS,
    method: Method = "slsqp",
    seed: int | None = None,
    progress: Listener | None = None,
) -> Optimum | Pareto:
    """The design that makes a formula as large or as small as can be under limits, or the front of several.

    `maximise` and `minimise` are formulas over asked names, `subject_to` relations between such, as in `stress(leaf) <=
    400 MPa at stroke 2 mm`; `vary` are parameters with ranges, as of `sweep`, from their minimum to their maximum where
    no range is given, integers, or lists of values. The search is SciPy's SLSQP (Kraft 1988) or trust-constr (Byrd,
    Hribar and Nocedal 1999) on exact gradients, of the design as it is and of `starts` - 1 Sobol points, but for those
    with a better design beside them (multi level single linkage: Rinnooy Kan and Timmer 1987). Frequencies that
    coincide are bounded together (Olhoff 1989; Seyranian, Lund and Olhoff 1994). Of integers and lists every
    combination is solved where there are few, else those around the optimum between them. What is not given is that
    of the `study` of this name among those that the mechanism describes, or of its only optimum: 8 starts, seed 0.

    The optimum is local in each start; multipliers, how far the conditions of an optimum are missed, and every quantity
    worked out anew at full order come with it. Several goals give a `Pareto` of about so many `points`. Raises
    ModelError, OptionError for what cannot be asked, and SolverError when no start has an answer.
    """
    if method not in get_args(Method):
        raise OptionError(f"method is slsqp or trust-constr, not {method!r}")
    points = _count("points", points, 2)
    fixed = one_design(parameters)
    plan = plan_of(model, fixed)
    has_goal = maximise is not None or minimise is not None
    of_file = described(plan, study, fixed) if study is not None or vary is None or not has_goal else {}
    starts = _count("starts", of_file.get("starts", STARTS) if starts is None else starts, 1)
    seed = _count("seed", of_file.get("seed", 0) if seed is None else seed, 0)
    if not has_goal:
        maximise, minimise = of_file.get("maximise"), of_file.get("minimise")
    vary = of_file.get("vary") if vary is None else vary
    subject_to = of_file.get("subject_to") if subject_to is None else subject_to
    task = task_of(plan, fixed, vary, maximise, minimise, subject_to)
    plan.verify(fixed)
    from_where = task.starts(starts, seed)
    mixed, goals, judged = task.mixed(from_where)
    told = progress or unheard
    if len(goals) > 1:
        found = front(mixed, goals, points, seed, method, told)
        return pareto_of(task, mixed, found, seed)
    if not len(mixed.at):
        solved = best_of(mixed.land, list(task.box.positions(from_where)), method, told, judged)
        chosen = None
        if solved is not None:
            chosen = Chosen(task.box.values(solved.best.z), solved, mixed.land, "", False)
    elif not len(mixed.others):
        chosen = chosen_alone(mixed, from_where, told)
    else:
        chosen = chosen_with_others(mixed, from_where, method, told)
    if chosen is None:
        raise SolverError(f"no design could be worked out: {_most(mixed.land.failures)}")
    told(Progress("proof"))
    return optimum_of(task, mixed, chosen, method, seed)


def _count(name: str, value: Any, least: int) -> int:
    """A whole number that an argument is. Raises OptionError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise OptionError(f"{name} is a whole number from {least}, not {value!r}")
    return int(value)


def _most(failures: Mapping[str, int]) -> str:
    """The most frequent reason why designs failed."""
    return max(failures, key=lambda own: failures[own], default="no reason is known")
