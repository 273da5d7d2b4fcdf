"""Commands of many designs: `sweep`, `sensitivity`, `tolerance` and `optimize`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import RenderableType
from rich.table import Table

from flexura.cli.amounts import names_of
from flexura.cli.options import Answer, File, Settings, command, read, say
from flexura.cli.progress import designs_shown, rounds_shown
from flexura.cli.terminal import TABLES, console_of_width, grid, heading, write_table
from flexura.errors import OptionError
from flexura.tables import counted, quantity, text_columns

if TYPE_CHECKING:
    from flexura.mechanism import Mechanism
    from flexura.study.engine import StudyTable
    from flexura.study.influence import Sensitivity
    from flexura.study.optimum import Optimum, Pareto
    from flexura.study.questions import OfThePart
    from flexura.study.tolerances import Estimate, Tolerance

SHOWN = 5
"""Designs at either end of a study that are printed."""

MODELS = (".yaml", ".yml")
"""Suffixes of model files."""

Quantities = Annotated[
    list[str] | None, typer.Option("--ask", metavar="NAMES", help="Quantities, e.g. 'f1, mass'. May be repeated.")
]
Folder = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Keep results here, as Parquet files; the same command goes on where it was."),
]
Workers = Annotated[int | None, typer.Option(min=1, help="Processes: as many as there are processors.")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Work on a dask cluster, e.g. tcp://192.168.0.7:8786.")
]


@contextmanager
def _kept_when_interrupted(folder: Path | None) -> Iterator[None]:
    """Say what is kept of a study when it is interrupted."""
    try:
        yield
    except KeyboardInterrupt:
        if folder is not None:
            say(f"designs that are done are kept in {folder}; the same command goes on with the others")
        raise


def _model_errors(result: OfThePart) -> Iterator[str]:
    """A line for each quantity: how far the part may be from what is said of it."""
    yield from result.margins.lines if result.margins is not None else ()


@command("plot", "dpi", "strict", out="Write the table: .csv or .parquet.")
def sweep_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="NAME=LOW:HIGH[:COUNT]",
            help="What varies, e.g. web=0.2mm:0.6mm:50, :log or :integer behind, or a list web=0.3mm,0.4mm. May be"
            " repeated.",
        ),
    ] = None,
    ask: Quantities = None,
    sampling: Annotated[
        Literal["grid", "list", "latin-hypercube", "sobol"] | None,
        typer.Option(help="All with all (grid), side by side (list), or samples."),
    ] = None,
    samples: Annotated[int | None, typer.Option(min=1, help="Number of samples.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Names the samples: 0.")] = None,
    study: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="A sweep of the file's `studies`, with what is given here replaced."),
    ] = None,
    folder: Folder = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> Answer:
    """Many designs of a mechanism: a grid or a sample of parameters, and quantities of each, as a table."""
    from flexura.results import plain
    from flexura.study.sweeps import sweep

    chosen: Any = None if sampling is None else sampling.replace("-", " ")
    with designs_shown() as progress, _kept_when_interrupted(folder):
        result = sweep(
            mechanism,
            parameters,
            vary=vary,
            ask=ask,
            sampling=chosen,
            samples=samples,
            seed=seed,
            study=study,
            folder=folder,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
        )

    def data() -> dict[str, Any]:
        columns = (
            {name: plain(column.tolist()) for name, column in result.to_columns().items()} if folder is None else None
        )
        return {**result.to_dict(), "table": columns}

    return Answer(result, sweep_text(result), "save_sweep", data=data)


def sweep_text(table: StudyTable) -> Iterator[RenderableType]:
    """The first and the last designs, the extremes of what is asked, and what failed."""
    yield heading(f"{table.name}: {counted(table.done, 'design')}")
    rows = table.legible(0, SHOWN)
    last = table.legible(max(table.designs - SHOWN, SHOWN), table.designs)
    columns = text_columns({name: [*rows[name], *last[name]] for name in rows})
    columns, dropped = _fitting(columns, len(table.parameters), console_of_width().width)
    designs = grid(*columns, left=0)
    for k, cells in enumerate(zip(*columns.values(), strict=True)):
        if k == SHOWN and table.designs > 2 * SHOWN:
            designs.add_row(*["..."] * len(cells))
        designs.add_row(*cells)
    yield designs
    if dropped:
        yield f"{counted(dropped, 'more column')}: --out writes all of them"
    extremes = grid("quantity", "lowest", "in design", "highest", "in design")
    for name, lowest, low, highest, high in table.extremes():
        extremes.add_row(name, lowest, str(low), highest, str(high))
    if extremes.row_count:
        yield ""
        yield extremes
    yield from _model_errors(table)
    if table.folder is not None:
        yield f"kept in {table.folder}"


def _fitting(columns: dict[str, list[str]], parameters: int, width: int) -> tuple[dict[str, list[str]], int]:
    """The columns that fit into a width, of parameters and of quantities alike the first, and how many are left
    out; `columns` are the number of the design, that many parameters, and the quantities."""
    names = list(columns)
    sizes = {name: 2 + max(map(len, (name, *cells))) for name, cells in columns.items()}
    varied, asked = names[1 : 1 + parameters], names[1 + parameters :]
    turns = [name for pair in zip_longest(asked, varied) for name in pair if name is not None]
    taken = {names[0], *turns[:2]}
    for name in turns[2:]:
        if sum(sizes[kept] for kept in taken) + sizes[name] > width:
            break
        taken.add(name)
    return {name: cells for name, cells in columns.items() if name in taken}, len(names) - len(taken)


@command("plot", "dpi", "strict", out="Write the table of slopes: .csv or .parquet.")
def sensitivity_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    ask: Annotated[
        str, typer.Option(metavar="NAMES", help="Quantities, e.g. 'f1, stiffness(carriage.tx), mass'.")
    ] = "f1, f2, f3, mass",
    free: Annotated[
        str | None, typer.Option(metavar="A,B,C", help="Parameters, all that are numbers if none are named.")
    ] = None,
) -> Answer:
    """What a per cent of every parameter does to every quantity."""
    from flexura.study.influence import sensitivity

    result = sensitivity(mechanism, parameters, ask=ask, free=names_of(free))
    return Answer(result, sensitivity_text(result), "save_sensitivity")


def sensitivity_text(result: Sensitivity) -> Iterator[RenderableType]:
    """A row for each parameter, and a column for each quantity."""
    yield heading(f"{result.name}: change per +1 % of each parameter")
    values = zip(result.quantities, result.units, result.value, strict=True)
    table = grid("parameter", "is", *(f"{text}\n{quantity(float(value), unit)}" for text, unit, value in values))
    for p, name in enumerate(result.parameters):
        cells = [_per_cent(result, k, p) for k in range(len(result.quantities))]
        table.add_row(name, quantity(float(result.nominal[p]), result.parameter_units[p]), *cells)
    yield table
    yield from _model_errors(result)


def _per_cent(result: Sensitivity, k: int, p: int) -> str:
    """Per cent per per cent; the slope with its unit where one of the two is zero; `none` where a warning says why."""
    value, at = float(result.value[k]), float(result.nominal[p])
    low, high = float(result.lowest[k, p]), float(result.highest[k, p])
    if not math.isfinite(low):
        return "none"
    unit, least = f"{result.units[k]} per {result.parameter_units[p]}", 0.0
    if value and at:
        low, high = sorted((low * at / value, high * at / value))
        unit, least = "%", 5e-7
    first, last = (f"{end + 0.0:+.3g}" if abs(end) > least else "0" for end in (low, high))
    return f"{first if first == last else f'{first} to {last}'} {unit}"


@command("plot", "dpi", "strict", out="Write the table of spreads: .csv or .parquet.")
def tolerance_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    study: Annotated[str | None, typer.Option(metavar="NAME", help="Which tolerance study of the file.")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=TOLERANCE", help="Tolerance, e.g. 'thickness=± 0.02 mm'. May be repeated."),
    ] = None,
    ask: Quantities = None,
    require: Annotated[
        list[str] | None, typer.Option(metavar="RELATION", help="What a good part meets: 'f1 >= 20 Hz'. Repeat.")
    ] = None,
    samples: Annotated[int | None, typer.Option(metavar="N", help="Samples: 4096.")] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Names the samples: 0.")] = None,
    each: Annotated[
        str | None,
        typer.Option(metavar="A,B,C", help="Parameters of which each copy of a part has its own: all; or none."),
    ] = None,
    indices: Annotated[bool, typer.Option(help="Sobol indices, which take more designs.")] = True,
    confidence: Annotated[float, typer.Option(metavar="RATIO", help="Confidence of all intervals.")] = 0.95,
    folder: Folder = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> Answer:
    """What tolerances do: spread, share of good parts, worst case, and which tolerance to tighten first."""
    from flexura.study.tolerances import tolerance

    names = names_of(each)
    with designs_shown() as progress, _kept_when_interrupted(folder):
        result = tolerance(
            mechanism,
            parameters,
            vary=vary,
            ask=ask,
            require=require,
            study=study,
            samples=samples,
            seed=seed,
            each=True if names is None else [name for name in names if name != "none"],
            indices=indices,
            confidence=confidence,
            folder=folder,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
        )
    return Answer(result, tolerance_text(result), "save_tolerance")


def tolerance_text(result: Tolerance) -> Iterator[RenderableType]:
    """Yields, spreads, worst cases, and what each tolerance answers for."""
    count = f"{len(result.sizes)} independent sizes, {result.samples} samples"
    yield heading(f"{result.name}: {count}, intervals of {100 * result.confidence:g} %")
    for relation in result.yields:
        share = relation.share
        text = f"{relation.text}: {_percent(share.value)} of parts ({_percent(share.low)} to {_percent(share.high)}"
        text += f", by {share.method}); {relation.failing} of {result.samples} samples fail"
        text += "; the nominal design does, too" if relation.is_met_nominally is False else ""
        yield text + ("; met in the worst case" if relation.is_met_at_worst else "")
    yield _spreads(result)
    yield _influences(result)
    yield from _model_errors(result)


def _percent(share: float) -> str:
    """A share in per cent, with the digits that tell it from all and none."""
    off = min(share, 1 - share)
    return f"{100 * share:.{2 if off >= 1e-3 or off == 0 else 4}f} %"


def _spreads(result: Tolerance) -> Table:
    """A column for each quantity."""
    spreads = result.quantities
    table = grid("", *(spread.text for spread in spreads))
    table.add_row("nominal", *(quantity(spread.nominal, spread.unit) for spread in spreads))
    table.add_row("mean", *(_with_interval(spread.mean, spread.unit) for spread in spreads))
    table.add_row("standard deviation", *(quantity(spread.deviation, spread.unit, 3) for spread in spreads))
    for k, share in enumerate(result.shares):
        cells = [_with_interval(spread.percentiles[k], spread.unit) for spread in spreads]
        table.add_row(f"{_ordinal(100 * share)} percentile", *cells)
    for end, further in (("low", "less"), ("high", "more")):
        worst = [(getattr(spread, f"worst_{end}"), spread.unit) for spread in spreads]
        # there may be a worse one beyond what is no corner of the tolerances
        cells = [quantity(own.value, unit) + ("" if own.is_vertex else f" or {further}") for own, unit in worst]
        table.add_row(f"worst case, {end}", *cells)
    return table


def _ordinal(number: float) -> str:
    """A number with its ending: 1st, 2.5th, 11th."""
    text = f"{number:g}"
    plain = "." in text or text.endswith(("11", "12", "13"))
    return text + ("th" if plain else {"1": "st", "2": "nd", "3": "rd"}.get(text[-1], "th"))


def _with_interval(estimate: Estimate, unit: str) -> str:
    """A value, and how far its interval reaches."""
    value = quantity(estimate.value, unit)
    if estimate.low == -math.inf or estimate.high == math.inf:
        return f"{value}, no bound"
    return f"{value} ± {quantity(max(estimate.high - estimate.value, estimate.value - estimate.low), unit, 3)}"


def _influences(result: Tolerance) -> Table:
    """A row for each tolerance: what share of each variance it answers for, with its interval."""
    names = [spread.text for spread in result.quantities]
    table = grid("tolerance", "sizes", *(f"of the variance of {name}" for name in names))
    for g, name in enumerate(result.tolerances):
        cells = []
        for k, text in enumerate(names):
            share = result.influence(text)[name]
            off = "" if result.indices is None else f" ± {100 * result.indices.total_half[g, k]:.2g}"
            first = ", first" if result.tighten_first[text] == name and len(result.tolerances) > 1 else ""
            cells.append(f"{100 * share:.3g}{off} %{first}" if math.isfinite(share) else "")
        table.add_row(name, str(sum(size.tolerance == name for size in result.sizes)), *cells)
    return table


@command("plot", "dpi", "strict", reads=False)
def optimize_command(
    file: File,
    *,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="NAME=LOW:HIGH",
            help="What varies, with units; NAME alone has the bounds of the file, NAME=A,B,C is a list. Repeat.",
        ),
    ] = None,
    maximise: Annotated[
        list[str] | None, typer.Option(metavar="FORMULA", help="To be as large as can be, e.g. f1. May be repeated.")
    ] = None,
    minimise: Annotated[
        list[str] | None, typer.Option(metavar="FORMULA", help="To be as small as can be, e.g. mass. May be repeated.")
    ] = None,
    subject_to: Annotated[
        list[str] | None,
        typer.Option(metavar="RELATION", help="A limit, e.g. 'stress(leaf) <= 400 MPa at stroke 2 mm'. Repeat."),
    ] = None,
    study: Annotated[
        str | None, typer.Option(metavar="NAME", help="The study of the file, for what is not given here.")
    ] = None,
    starts: Annotated[int | None, typer.Option(min=1, help="Searches, the first from the design as it is: 8.")] = None,
    points: Annotated[int, typer.Option(min=2, help="Designs of the front of several goals.")] = 24,
    method: Annotated[
        Literal["slsqp", "trust-constr"], typer.Option(help="SciPy's method, on exact gradients.")
    ] = "slsqp",
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the starts: 0.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the optimum as a model file, or a front as .csv.")
    ] = None,
    set: Settings = None,
) -> Answer:
    """The best design under limits, its active limits and what relaxing them would gain, proven at full order."""
    from flexura.modelfile import refuse_base
    from flexura.study.optimum import Optimum, optimize

    front = OptionError(f"--out {str(out)!r}: several goals have a front; write it as .csv and pick a design")
    suffix = "" if out is None else out.suffix.lower()
    if out is not None and suffix not in (*MODELS, *TABLES):
        raise OptionError(f"--out {str(out)!r}: a model file .yaml, or a table .csv or .parquet")
    if suffix in MODELS and len([*(maximise or ()), *(minimise or ())]) > 1:
        raise front
    if out is not None and suffix in MODELS:
        refuse_base(out, file)
    mechanism, parameters = read(file, set)
    with rounds_shown() as progress:
        result = optimize(
            mechanism,
            parameters,
            vary=vary or None,
            maximise=maximise or None,
            minimise=minimise or None,
            subject_to=subject_to or None,
            study=study,
            starts=starts,
            points=points,
            method=method,
            seed=seed,
            progress=progress,
        )

    def write() -> list[Path]:
        if out is None:
            return []
        if suffix in TABLES:
            return [write_table([result.to_columns()], out)]
        return [result.save(out, base=file)] if isinstance(result, Optimum) and result.is_feasible else []

    def refuse() -> None:
        """Say why there is no model file."""
        if not isinstance(result, Optimum):
            raise front
        if not result.is_feasible:
            result.save(out or Path(), base=file)

    text = optimum_text(result) if isinstance(result, Optimum) else front_text(result)
    return Answer(result, text, "save_optimum", write=write, after=refuse if suffix in MODELS else None)


def optimum_text(result: Optimum) -> Iterator[RenderableType]:
    """The design, what holds it, and the proof."""
    value = quantity(result.value, result.unit, 6) if result.is_feasible else "no design meets the limits"
    yield heading(f"{result.name}: {result.goal}: {value}")
    table = grid("parameter", "before", "optimum" if result.is_feasible else "nearest", "from", "to")
    for variable in result.variables:
        unit = variable.unit
        mark = f" (at its {'lower' if variable.at_bound == 'low' else 'upper'} bound)" if variable.at_bound else ""
        values = quantity(variable.start, unit, 6), quantity(variable.value, unit, 6) + mark
        table.add_row(variable.name, *values, quantity(variable.low, unit, 4), quantity(variable.high, unit, 4))
    yield table
    if result.active:
        yield "what holds it"
    yield from (f"  {limit}" for limit in result.active)
    yield "proof"
    for proof in result.proof:
        within = ""
        if proof.interval is not None:
            half = (proof.interval[1] - proof.interval[0]) / 2 / abs(proof.checked) if proof.checked else math.nan
            within = f", proven within {100 * half:.2g} %"
        yield f"  {proof.text} = {quantity(proof.checked, proof.unit, 6)} by {proof.by}{within}"
    if result.is_feasible and not math.isnan(result.kkt_residual):
        yield f"  conditions of an optimum hold to {result.kkt_residual:.1g} of the gradient"
    yield from _rest(result)


def front_text(result: Pareto) -> Iterator[RenderableType]:
    """The designs of a front."""
    yield heading(f"{result.name}: {counted(len(result), 'design')} of {', '.join(result.goals)}")
    table = grid("design", *result.goals, *result.names)
    units = (*result.units, *result.parameter_units)
    for k in range(len(result)):
        values = zip((*result.values[k], *result.designs[k]), units, strict=True)
        table.add_row(str(k), *(quantity(float(value), unit) for value, unit in values))
    yield table
    yield from _rest(result)


def _rest(result: Optimum | Pareto) -> Iterator[str]:
    yield from _model_errors(result)
    yield f"{result.evaluations} designs with gradients, {result.tried} without"
