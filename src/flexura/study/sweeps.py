"""The same questions of many designs: a row for each, and what a model file describes of such a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from flexura.arguments import verb
from flexura.deadline import Listener
from flexura.errors import OptionError, did_you_mean
from flexura.full_order import plan_of
from flexura.mechanism import Mechanism, SweepStudy, parameter_values
from flexura.structure import Plan, one_design
from flexura.study.engine import StudyTable, run
from flexura.study.questions import Margins, questions
from flexura.study.requirements import described_relations, with_required
from flexura.study.space import Sampling, Space, Variable, Varied, variables


@verb
def sweep(
    model: Mechanism | Plan,
    parameters: Mapping[str, float] | None = None,
    *,
    vary: Varied | None = None,
    ask: str | Sequence[str] | None = None,
    sampling: Sampling | None = None,
    samples: int | None = None,
    seed: int | None = None,
    study: str | None = None,
    requirements: bool = True,
    folder: str | Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Listener | None = None,
) -> StudyTable:
    """What is asked, by name, of every design of a grid or a sample, a row for each.

    `vary` gives ranges and values by parameter: text with units such as `thickness=0.2mm:0.6mm:50`, or in SI a
    tuple (low, high, count) or a list of values; `sampling` is `grid` (all with all), `list` (values side by side),
    `latin hypercube` or `sobol` with so many `samples` that `seed` names. `study` takes all of these from a sweep
    that the description has under that name, where they are not given; without `vary` its only one. How many designs
    meet each of the `requirements` of the description is counted, unless they are not wanted. Designs are
    shared among `workers`, processes of this machine, or those of the dask cluster of a `scheduler`. With a
    `folder` results are kept there as Parquet files, and a study that was interrupted goes on. A design that cannot
    be worked out is a row with a reason. `progress` is told of every block. Raises OptionError for what cannot be
    varied, sampled or asked and for a folder or a scheduler that cannot be used, ModelError for a description that
    cannot be, and SolverError when workers die.
    """
    plan = plan_of(model, parameters)
    fixed = one_design(parameters)
    plan.values(fixed)
    known = [name for name, described in plan.mechanism.studies.items() if isinstance(described.own, SweepStudy)]
    if study is None and vary is None and len(known) == 1:
        study = known[0]
    options = {} if study is None else described_sweep(plan.mechanism, study, fixed)
    given = {"vary": vary, "ask": ask, "sampling": sampling, "samples": samples, "seed": seed}
    options |= {name: value for name, value in given.items() if value is not None}
    for name, example in (("vary", "vary='thickness=0.2mm:0.6mm:50'"), ("ask", "ask='f1, mass'")):
        if name not in options:
            listed = f", or a study of the description: {', '.join(known)}" if known else ""
            raise OptionError(f"what to {name} is missing, e.g. {example}{listed}")
    varied = variables(plan.mechanism, options["vary"], fixed)
    space = Space(varied, options.get("sampling", "grid"), options.get("samples"), options.get("seed", 0))
    required = described_relations(plan) if requirements else {}
    asked = with_required(questions(plan, options["ask"]), required.values())
    table = run(asked, space, fixed, folder=folder, workers=workers, scheduler=scheduler, progress=progress)
    margins = Margins(plan, fixed, asked.quantities, required=required)
    return replace(table, remarks=(*table.remarks, *asked.notes), margins=margins)


def described_sweep(mechanism: Mechanism, name: str, parameters: Mapping[str, float]) -> dict[str, Any]:
    """The arguments `vary`, `ask`, `sampling`, `samples` and `seed` of a study of the description, by its name.

    Raises OptionError where there is no such study, or one of another kind.
    """
    known = mechanism.studies
    if name not in known:
        hint = did_you_mean(str(name), known, f"studies: {', '.join(known) or 'none'}")
        raise OptionError(f"{name!r} is not a study of the description; {hint}")
    study = known[name].own
    if not isinstance(study, SweepStudy):
        raise OptionError(f"the study {name!r} is no sweep; {known[name].words}")
    values = {key: float(value) for key, value in parameter_values(mechanism, parameters).items()}
    vary = [Variable.described(mechanism, key, variation, values) for key, variation in study.vary.items()]
    return {"vary": vary, "ask": study.ask, "sampling": study.sampling, "samples": study.samples, "seed": study.seed}
