"""The verb that asks the same of many designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from flexura.arguments import verb
from flexura.deadline import Listener
from flexura.errors import OptionError
from flexura.mechanism import Mechanism, SweepStudy
from flexura.structure import Plan, one_design, plan_of
from flexura.study.engine import StudyTable, run
from flexura.study.questions import Margins, questions
from flexura.study.space import Sampling, Space, Varied, variables
from flexura.study.sweeps.described import described_sweep


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
    folder: str | Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Listener | None = None,
) -> StudyTable:
    """What is asked, by name, of every design of a grid or a sample, a row for each.

    `vary` gives ranges and values by parameter: text with units such as `thickness=0.2mm:0.6mm:50`, or in SI a
    tuple (low, high, count) or a list of values; `sampling` is `grid` (all with all), `list` (values side by side),
    `latin hypercube` or `sobol` with so many `samples` that `seed` names. `study` takes all of these from a sweep
    that the description has under that name, where they are not given; without `vary` its only one. Designs are
    shared among `workers`, processes of this machine, or those of the dask cluster of a `scheduler`. With a
    `folder` results are kept there as Parquet files, and a study that was interrupted goes on. A design that cannot
    be worked out is a row with a reason. `progress` is told of every block. Raises OptionError for what cannot be
    varied, sampled or asked and for a folder or a scheduler that cannot be used, ModelError for a description that
    cannot be, and SolverError when workers die.
    """
    plan = plan_of(model, parameters)
    fixed = one_design(parameters)
    plan.values(fixed)
    known = [name for name, own in plan.mechanism.studies.items() if isinstance(own.own, SweepStudy)]
    if study is None and vary is None and len(known) == 1:
        study = known[0]
    told = described_sweep(plan.mechanism, study, fixed) if study is not None else {}
    given = {"vary": vary, "ask": ask, "sampling": sampling, "samples": samples, "seed": seed}
    told |= {name: value for name, value in given.items() if value is not None}
    for name, example in (("vary", "vary='thickness=0.2mm:0.6mm:50'"), ("ask", "ask='f1, mass'")):
        if name not in told:
            described = f", or a study of the description: {', '.join(known)}" if known else ""
            raise OptionError(f"what to {name} is missing, e.g. {example}{described}")
    own = variables(plan.mechanism, told["vary"], fixed)
    space = Space(own, told.get("sampling", "grid"), told.get("samples"), told.get("seed", 0))
    asked = questions(plan, told["ask"])
    table = run(asked, space, fixed, folder=folder, workers=workers, scheduler=scheduler, progress=progress)
    margins = Margins(plan, fixed, asked.quantities)
    return replace(table, remarks=(*table.remarks, *asked.notes), margins=margins)
