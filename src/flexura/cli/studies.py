"""Commands of many designs: `sweep`, `sensitivity`, `tolerance` and `optimize`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from flexura.cli.amounts import mounts_of, moves_of, names_of
from flexura.cli.options import Answer, File, Settings, command, read, say
from flexura.cli.progress import designs_shown, rounds_shown, steps_shown
from flexura.errors import OptionError
from flexura.files import TABLES, write_table

if TYPE_CHECKING:
    from flexura.mechanism import Mechanism


MODELS = (".yaml", ".yml")
"""Suffixes of model files."""

Quantities = Annotated[
    list[str] | None, typer.Option("--ask", metavar="NAMES", help="Quantities, e.g. 'f1, mass'. May be repeated.")
]
Required = Annotated[bool, typer.Option("--requirements/--no-requirements", help="With the requirements of the file.")]
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
    requirements: Required = True,
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
            requirements=requirements,
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

    return Answer(result, pictures="save_sweep", data=data)


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
    return Answer(result, pictures="save_sensitivity")


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
    requirements: Required = True,
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
            requirements=requirements,
            each=True if names is None else [name for name in names if name != "none"],
            indices=indices,
            confidence=confidence,
            folder=folder,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
        )
    return Answer(result, pictures="save_tolerance")


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
    requirements: Required = True,
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
            requirements=requirements,
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

    return Answer(result, pictures="save_optimum", write=write, after=refuse if suffix in MODELS else None)


@command("strict", out="Write the table of misalignments: .csv or .parquet.")
def misalignment_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    mount: Annotated[
        list[str] | None,
        typer.Option(
            "--mount",
            metavar="NODE=LENGTH,ANGLE",
            help="A clamped node (* allowed) and how far off it may be, e.g. 'leaf2.foot=0.1 mm,1 mrad', or"
            " X,Y,Z,RX,RY,RZ. May be repeated.",
        ),
    ] = None,
    node: Annotated[
        str | None, typer.Option(metavar="NODE", help="Whose support is looked at: the only body by default.")
    ] = None,
    move: Annotated[
        list[str] | None,
        typer.Option(
            "--move", metavar="NODE.AXIS=VALUE", help="Prescribed displacement, as in stroke. May be repeated."
        ),
    ] = None,
    n: Annotated[int, typer.Option("-n", min=1, help="Number of frequencies.")] = 3,
    samples: Annotated[int, typer.Option(min=0, help="Number of Sobol' points.")] = 64,
    seed: Annotated[int, typer.Option(min=0, help="Names the samples.")] = 0,
) -> Answer:
    """What mountings that are off by tolerances do: assembly loads, frequencies, buckling, stress and support."""
    from flexura.study.tolerances import misalignment

    moved: dict[str, Any] = dict(moves_of(move or []))
    result = misalignment(
        mechanism,
        parameters,
        mounts=mounts_of(mount),
        node=node,
        move=moved,
        n=n,
        samples=samples,
        seed=seed,
    )
    return Answer(result)


@command(reads=False)
def design_command(
    wish: Annotated[Path, typer.Argument(metavar="WISH", help="Wish file (YAML).")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Write mechanism files and the page here, and go on here.")],
    most: Annotated[int, typer.Option(min=1, help="Topologies that are worked out, the plainest first.")] = 300,
    samples: Annotated[int, typer.Option(min=1, help="Designs of each at rest.")] = 64,
    verify: Annotated[
        bool, typer.Option(help="The best as one solid at last: a minute or more, and some gigabytes of memory.")
    ] = True,
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> Answer:
    """From wished freedoms to mechanisms: every topology of limbs that leaves them free, sized, best first."""
    from flexura.pages.report import REPORTS, save_designs
    from flexura.synthesis import design

    with steps_shown() as progress, _kept_when_interrupted(out):
        result = design(
            wish,
            folder=out,
            most=most,
            samples=samples,
            verify=verify,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
            found=lambda found: save_designs(found, out, wish=wish),
        )
        save_designs(result, out, wish=wish, reports=REPORTS, progress=progress)
    return Answer(result, write=lambda: [out / "index.html", out / "design.json"])
