"""Options that commands share, and what every command does around its verb: read the file, write and print."""

from __future__ import annotations

import inspect
import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_type_hints

import typer
from rich.console import RenderableType

from flexura.cli.amounts import add_once, named, prescribed_of
from flexura.cli.terminal import PAGES, heading, print_all, print_end
from flexura.deadline import announced, stage
from flexura.errors import OptionError
from flexura.files import TABLES, write_table
from flexura.tables import Item

File = Annotated[Path, typer.Argument(metavar="FILE", help="Mechanism file (YAML).")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Replace a parameter, e.g. --set 'web=0.4 mm'. May be repeated."),
]
Inputs = Annotated[
    list[str] | None,
    typer.Option("--input", "-i", metavar="NAME", help="Actuator (* allowed), DOF such as platform.tz, or ground.tx."),
]
Outputs = Annotated[
    list[str] | None,
    typer.Option("--output", "-o", metavar="NAME", help="Sensor (* allowed), or DOF such as platform.tz:velocity."),
]
Ratio = Annotated[
    float | None,
    typer.Option("--damping", metavar="RATIO", help="Damping ratio of all modes, in place of that of the file."),
]
Loop = Annotated[Literal["open", "closed"], typer.Option(help="Whether loops of the controllers described are closed.")]
Data = Annotated[Path, typer.Argument(metavar="DATA", help="Measured data (UFF, CSV, npz, HDF5).")]
Channels = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Where the channels are (YAML), if the data do not have it.")
]
Repeated = Annotated[
    Literal["average", "first", "last"] | None,
    typer.Option(help="Merge responses that a universal file gives more than once, which are refused else."),
]
IdentifiedBand = Annotated[
    str | None, typer.Option("--band", metavar="FROM,TO", help="Identify modes in this band, e.g. '5,200 Hz'.")
]
Gravity = Annotated[
    str | None, typer.Option(metavar="X,Y,Z", help="Acceleration with its unit, e.g. '0,0,-9.81 m/s^2'.")
]
Loads = Annotated[
    list[str] | None,
    typer.Option(
        "--load",
        metavar="NODE=FX,FY,FZ[,MX,MY,MZ]",
        help="Dead load at a node, with units, e.g. 'table=0,0,-5 N'. May be repeated.",
    ),
]
Commands = Annotated[
    list[str] | None,
    typer.Option(
        "--actuator",
        metavar="NAME=VALUE",
        help="Command with its unit, e.g. '*.piezo=75 V'. * allowed. May be repeated.",
    ),
]
At = Annotated[
    list[str] | None,
    typer.Option(
        "--at",
        metavar="NODE.AXIS=VALUE",
        help="About this pose, not undeformed, e.g. carriage.y=5mm, or an actuator's command. May be repeated.",
    ),
]
Plot = Annotated[Path | None, typer.Option("--plot", metavar="DIR", help="Write pictures here.")]
Dpi = Annotated[int | None, typer.Option("--dpi", min=50, max=1200, help="Dots per inch of pictures: 150.")]
Names = Annotated[bool, typer.Option("--names", help="Names of parts beside the mechanism.")]
Animate = Annotated[
    Literal["gif", "webp", "mp4"] | None,
    typer.Option(help="Animations in the folder of --plot; mp4 needs ffmpeg."),
]
Magnify = Annotated[
    float | None, typer.Option(metavar="FACTOR", help="Draw displacements so many times as large as is usual.")
]
DrawnScale = Annotated[
    float | None, typer.Option(metavar="FACTOR", help="Draw displacements so many times as large as they are.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
Strict = Annotated[bool, typer.Option("--strict", help="Make warnings errors: write and print nothing, exit with 1.")]

Order = Literal["low", "full"]
Hold = Literal["foh", "zoh"]

_OF_PICTURES: dict[str, tuple[Any, Any]] = {
    "animate": (Animate, None),
    "magnify": (Magnify, None),
    "scale": (DrawnScale, None),
    "names": (Names, False),
    "dpi": (Dpi, None),
}
_SHARED: dict[str, tuple[Any, Any]] = {
    "at": (At, None),
    "set": (Settings, None),
    "plot": (Plot, None),
    **_OF_PICTURES,
    "strict": (Strict, False),
    "as_json": (Json, False),
}
"""Options that `command` adds, each with its default."""


class Answer(NamedTuple):
    """What a command has worked out, and how it is shown."""

    result: Any
    text: Iterable[Item | RenderableType] | None = None
    """What is printed of the result, before its notes and warnings, where it is not all that it presents."""
    pictures: str | Callable[..., list[Path]] = ""
    """What writes pictures of the result into a folder: a function, or the name of one of `flexura.view`, or of one
    there that draws a picture."""
    drawn: Mapping[str, Any] = {}
    """What that function takes beside the result and the folder."""
    write: Callable[[], list[Path]] = list
    """Writes what was asked for, but the table and the pictures of the result."""
    data: Callable[[], Mapping[str, Any]] | None = None
    """What --json prints; else `to_dict` of the result."""
    are_warnings_shown: bool = False
    """Whether `text` has said what the notes and the warnings of the result say."""
    is_interrupted: bool = False
    after: Callable[[], None] | None = None
    """Raises what is still wrong once all is shown."""


def command(
    *options: str, out: str = "", page: bool = False, plot: str = "", reads: bool = True
) -> Callable[[Callable[..., Answer]], Callable[..., None]]:
    """Make a command of a function that works out an `Answer`.

    The command takes FILE and --set and hands the function the mechanism and the parameters, unless it `reads` none;
    it has the function's own options, those of `options`, --out for the table of the result where `out` says what is in
    it, or for what `show` makes of it where there is a `page`, --plot with a help of its own where `plot` is one, and
    --json. It writes the table and the pictures, and prints the answer.
    """
    table = Annotated[Path | None, typer.Option(metavar="FILE", help=out)]
    folder = Annotated[Path | None, typer.Option("--plot", metavar="DIR", help=plot)]
    taken = {*options, "as_json", *(["set"] if reads else []), *(["plot"] if plot else []), *(["out"] if out else [])}
    added = {"out": (table, None), **_SHARED, **({"plot": (folder, None)} if plot else {})}

    def wrap(function: Callable[..., Answer]) -> Callable[..., None]:
        hints = get_type_hints(function, localns={"Mechanism": Any}, include_extras=True)
        own = [
            inspect.Parameter(p.name, inspect.Parameter.KEYWORD_ONLY, default=p.default, annotation=hints[p.name])
            for p in list(inspect.signature(function).parameters.values())[2 if reads else 0 :]
        ]
        shared = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
            for name, (annotation, default) in added.items()
            if name in taken
        ]
        file = [inspect.Parameter("file", inspect.Parameter.KEYWORD_ONLY, annotation=File)] if reads else []

        def run(**given: Any) -> None:
            own_options = {p.name: given.pop(p.name) for p in own}
            path, folder = given.get("out"), given.get("plot")
            pictured = of_pictures(folder, **{name: given.get(name) for name in _OF_PICTURES})
            names = (*TABLES, *PAGES) if page else TABLES
            if path is not None and path.suffix.lower() not in names:
                what = "page or a table" if page else "table"
                raise OptionError(f"{path} is no name of a {what}: it must be named {' or '.join(names)}")
            source = read(given["file"], given["set"], given.get("at")) if reads else ()
            answer = function(*source, **own_options)
            if given.get("strict"):
                answer.result.raise_warnings()
            written = [] if path is None else [_table(answer.result, path)]
            written += answer.write()
            if folder is not None and answer.pictures and answer.result is not None:
                written += _pictures(answer, folder, pictured)
            _print(answer, written, given["as_json"])

        parameters = [*file, *own, *shared]
        run.__name__, run.__doc__ = function.__name__, function.__doc__
        run.__signature__ = inspect.Signature(parameters)  # pyright: ignore[reportFunctionMemberAccess]
        run.__annotations__ = {p.name: p.annotation for p in parameters}
        return run

    return wrap


def of_pictures(folder: Path | None, **options: object) -> dict[str, Any]:
    """Those options of pictures that are given; None and False are not. Raises OptionError when there is no --plot."""
    given = {name: value for name, value in options.items() if value is not None and value is not False}
    if folder is None and given:
        raise OptionError(f"--{next(iter(given))} belongs to --plot DIR, which is not given")
    return given


def _pictures(answer: Answer, folder: Path, options: dict[str, Any]) -> list[Path]:
    """Write the pictures of an answer."""
    from flexura import view

    if not isinstance(answer.pictures, str):
        return answer.pictures(answer.result, folder, **answer.drawn, **options)
    make = getattr(view, answer.pictures)
    if not answer.pictures.startswith("draw_"):
        return make(answer.result, folder, **answer.drawn, **options)
    name = f"{answer.pictures.removeprefix('draw_')}.png"
    return view.save_figures({name: make(answer.result, **answer.drawn, **options)}, folder)


def _table(result: Any, path: Path) -> Path:
    """Write the table of a result, that of a study block by block, or its page."""
    if path.suffix.lower() in PAGES:
        from flexura.pages.viewer import show

        return show(result).save(path)
    if not hasattr(result, "blocks"):
        return write_table([result.to_columns()], path)
    from flexura.study.engine import arrow_table

    blocks: Any = result.blocks()
    return write_table(blocks, path, arrow_table)


def _print(answer: Answer, written: list[Path], as_json: bool) -> None:
    """Print an answer, and what was written. Ends with the status of an interrupt where it was interrupted."""
    result = answer.result
    if as_json and result is not None:
        data = (answer.data or result.to_dict)()
        print_json({**data, "files": [str(path) for path in written]} if written else data)
    elif result is not None:
        print_all([heading(result.headline), *(result.presentation() if answer.text is None else answer.text)])
        notes, warnings = ((), ()) if answer.are_warnings_shown else (result.notes, result.warnings)
        print_end(notes, warnings, written)
    if answer.is_interrupted:
        sys.stderr.write("flexura: interrupted; what was done is shown\n")
        raise SystemExit(130)
    if answer.after is not None:
        answer.after()


def print_json(data: Any) -> None:
    """Print one JSON document."""
    sys.stdout.write(json.dumps(data, indent=2, allow_nan=False) + "\n")


def read(file: Path, settings: list[str] | None, pose: list[str] | None = None) -> tuple[Any, dict[str, float]]:
    """The mechanism of a file, solid members reduced to superelements and composites meshed, at the `pose` that is
    given beside it, and the parameters that are replaced."""
    from flexura.mechanism import at, needs_meshes
    from flexura.modelfile import load

    stage("reading the file")
    mechanism = load(file)
    parameters = settings_of(mechanism, settings)
    if pose:
        mechanism = at(mechanism, prescribed_of(mechanism, pose))
    if needs_meshes(mechanism):
        from flexura.fem import with_solid_parts

        # parts in the cache say nothing, and neither does a pipe
        mechanism = with_solid_parts(mechanism, parameters, progress=say if sys.stderr.isatty() else None)
    return mechanism, parameters


def settings_of(mechanism: Any, settings: list[str] | None) -> dict[str, float]:
    """The parameters that are replaced, SI. Raises ModelError and OptionError."""
    from flexura.modelfile import parse_override

    parameters: dict[str, float] = {}
    for text in settings or []:
        with named("--set", text):
            add_once(parameters, *parse_override(mechanism, text))
    return parameters


def say(words: object) -> None:
    """One line of progress."""
    sys.stderr.write(f"{words} ...\n")


QUIET = 2.0
"""Seconds that a command may take before it says what it is at."""


@contextmanager
def stages_shown() -> Iterator[None]:
    """Say on a terminal what a command is at, once it has taken more than a moment."""
    begun = time.monotonic()

    def later(words: str) -> None:
        if time.monotonic() - begun > QUIET:
            say(words)

    with announced(later) if sys.stderr.isatty() else nullcontext():
        yield
