"""The verb that finds the best design under limits, and what a model file describes of optima under `studies`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.deadline import Listener, Progress, no_listener, time_limit
from flexura.errors import OptionError, SolverError
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism, OptimumStudy
from flexura.structure import Plan, one_design
from flexura.study.optimum.climb import Method, best_of
from flexura.study.optimum.discrete import Chosen, chosen_alone, chosen_with_others
from flexura.study.optimum.front import front
from flexura.study.optimum.landscape import Landscape
from flexura.study.optimum.linear import Steps
from flexura.study.optimum.outcome import optimum_of, pareto_of
from flexura.study.optimum.results import Optimum, Pareto
from flexura.study.optimum.rows import BothDesigns
from flexura.study.optimum.task import Task, task_of
from flexura.study.space import Variable, Varied

STARTS = 8
"""Designs that searches may start from, the first the design as it is."""

FRONT_POINTS = 24
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
    requirements: bool = True,
    study: str | None = None,
    starts: int | None = None,
    points: int = FRONT_POINTS,
    method: Method = "slsqp",
    seed: int | None = None,
    progress: Listener | None = None,
) -> Optimum | Pareto:
    """The design that makes a formula as large or as small as can be under limits, or the front of several.

    `maximise` and `minimise` are formulas over asked names, `subject_to` relations between such, as in `stress(leaf) <=
    400 MPa at stroke 2 mm`, beside which the `requirements` of the description hold, unless they are not wanted; `vary`
    are parameters with ranges, as of `sweep`, from their minimum to their maximum where no range is given, integers, or
    lists of values. The search is SciPy's SLSQP (Kraft 1988) or trust-constr (Byrd, Hribar and Nocedal 1999) on exact
    gradients, of the design as it is and of `starts` - 1 Sobol points, but for those with a better design beside them
    (multi level single linkage: Rinnooy Kan and Timmer 1987). Frequencies that coincide are bounded together (Olhoff
    1989; Seyranian, Lund and Olhoff 1994). Of integers and lists every combination is solved where there are few, else
    those around the optimum between them. What is not given is that of the `study` of this name among those that the
    mechanism describes, or of its only optimum: 8 starts, seed 0.

    The optimum is local in each start; multipliers, how far the conditions of an optimum are missed, and every quantity
    worked out anew at full order come with it. Several goals give a `Pareto` of about so many `points`. Raises
    ModelError, OptionError for what cannot be asked, and SolverError when no start has an answer.
    """
    if method not in get_args(Method):
        raise OptionError(f"method is slsqp or trust-constr, not {method!r}")
    points = _count("points", points, 2)
    fixed = one_design(parameters)
    plan = plan_of(model, fixed)
    given = {"vary": vary, "maximise": maximise, "minimise": minimise, "subject_to": subject_to}
    given |= {"starts": starts, "seed": seed}
    has_goal = maximise is not None or minimise is not None
    options = dict.fromkeys(given) | {"starts": STARTS, "seed": 0}
    if study is not None or vary is None or not has_goal:
        options |= described(plan, study, fixed)
    if has_goal:
        options |= {"maximise": None, "minimise": None}
    options |= {name: value for name, value in given.items() if value is not None}
    starts, seed = _count("starts", options["starts"], 1), _count("seed", options["seed"], 0)
    task = task_of(plan, fixed, {**options, "requirements": requirements})
    plan.verify(fixed)
    first_designs = task.starts(starts, seed)
    mixed, goals, judged = task.mixed(first_designs)
    report = progress or no_listener
    if len(goals) > 1:
        return pareto_of(task, mixed, front(mixed, goals, points, seed, method, report=report), seed)
    chosen = None
    if not len(mixed.others):
        chosen = chosen_alone(mixed, first_designs, report)
    elif len(mixed.at):
        chosen = chosen_with_others(mixed, first_designs, method, report)
    elif solved := best_of(mixed.land, list(task.box.positions(first_designs)), method, report, judged):
        chosen = Chosen(task.box.values(solved.best.z), solved, mixed.land, "", False)
    if chosen is None:
        raise _no_design(mixed.land)
    report(Progress("proof"))
    return optimum_of(task, mixed, chosen, method, seed)


def _no_design(land: Landscape) -> SolverError:
    """That none of its designs has an answer, with the reason that most have."""
    why = max(land.failures, key=lambda reason: land.failures[reason], default="no reason is known")
    return SolverError(f"no design could be worked out: {why}")


def climbed(
    model: Mechanism | Plan,
    *,
    maximise: str,
    subject_to: Sequence[str],
    within: Sequence[str] = (),
    besides: tuple[Mechanism, Sequence[str]] | None = None,
    accuracy: float,
    seconds: float,
) -> tuple[dict[str, float], bool]:
    """The design that one search leads to from a design, over all its parameters within their limits, by name, SI, and
    whether the search came to its end in time.

    What is maximised is positive. A search begins with what is missed of `subject_to`, and of what is asked `besides`
    of another mechanism, whose parameters are among those of the first; it never leaves what is `within`. It ends when
    a step promises less than `accuracy`, over the goal, or with the best design after so many `seconds`; nothing of it
    is proven. The requirements of the description are left out. Raises as `optimize`.
    """
    task = _alone(plan_of(model), maximise, [*within, *subject_to])
    first = task.starts(1, 0)
    with time_limit(seconds):
        mixed, _, _ = task.mixed(first)
        land, limits = mixed.land, list(task.limits)
        if besides is not None and besides[1]:
            other = replace(_alone(plan_of(besides[0]), maximise, besides[1]), aims=())
            designs = BothDesigns(task.designs, other.designs)
            rows = other.limit_rows(designs.point(first[0]).value, task.wording.count)
            land = replace(land, designs=designs, limits=[*land.limits, *rows])
            limits += other.limits
        lower = np.array([own.sense < 0 and own.right.is_constant for own in limits], dtype=bool)
        kept = np.arange(len(limits)) < len(within)
        found = Steps(land, lower & ~kept, kept, positive=True).climb(task.box.positions(first)[0], accuracy)
    if found.best is None:
        raise _no_design(land)
    return dict(zip(task.names, task.box.values(found.best.z).tolist(), strict=True)), found.in_time


def _alone(plan: Plan, maximise: str, subject_to: Sequence[str]) -> Task:
    """What is asked of all parameters of a plan, but for the requirements of its description."""
    asked = {"vary": list(plan.mechanism.parameters), "maximise": maximise, "minimise": None, "subject_to": subject_to}
    return task_of(plan, {}, {**asked, "requirements": False})


def described(plan: Plan, name: str | None, fixed: Mapping[str, float]) -> dict[str, Any]:
    """What the study of a name, or the only one that is an optimum, says: arguments of the verb by their names; none
    where there is no such study and none is named. Raises OptionError for unknown names, and several without one."""
    studies = plan.mechanism.studies
    known = {key: study for key, entry in studies.items() if isinstance(study := entry.own, OptimumStudy)}
    if name is None:
        if len(known) > 1:
            raise OptionError(f"the file describes {len(known)} optima; name a study: {', '.join(known)}")
        if not known:
            return {}
        [name] = known
    if name not in known:
        kind = f"{name!r} is a {studies[name].kind}" if name in studies else f"there is no study {name!r}"
        raise OptionError(f"{kind}; optima: {', '.join(known) or 'none'}")
    study = known[name]
    goals = (study, *(study.goals or ()))
    values = {key: float(value) for key, value in plan.parameter_values(dict(fixed)).items()}
    return {
        "vary": [Variable.described(plan.mechanism, key, varied, values) for key, varied in study.vary.items()],
        "maximise": [goal.maximise for goal in goals if goal.maximise],
        "minimise": [goal.minimise for goal in goals if goal.minimise],
        "subject_to": list(study.subject_to),
        "starts": study.starts,
        "seed": study.seed,
    }


def _count(name: str, value: Any, least: int) -> int:
    """A whole number that an argument is. Raises OptionError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise OptionError(f"{name} is a whole number from {least}, not {value!r}")
    return int(value)
