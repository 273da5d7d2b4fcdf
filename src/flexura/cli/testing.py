"""Commands of tests: estimate, identify, simulate, correlate, calibrate, and where to put sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import Console
from rich.progress import Progress

from flexura.cli.amounts import band_of, names_of, quantity_of, selected, time_of
from flexura.cli.options import (
    Answer,
    Channels,
    Data,
    File,
    IdentifiedBand,
    Ratio,
    Repeated,
    Settings,
    command,
    read,
    say,
)
from flexura.errors import OptionError

if TYPE_CHECKING:
    from flexura.mechanism import Mechanism
    from flexura.testing.measurement import MeasuredFRF
    from flexura.testing.updating import Calibration, Sample

ShowPairs = Annotated[
    bool, typer.Option("--reciprocity", help="Show how far responses that are measured both ways are from each other.")
]
Reciprocal = Annotated[
    bool, typer.Option("--reciprocal", help="Fill responses that are not measured by their reciprocals.")
]

LISTS = (".yaml", ".yml")
"""Suffixes of files that hold a plain list of frequencies."""


@command(reads=False)
def estimate_frf_command(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Time records (UFF, CSV, npz, HDF5, mat, TDMS, WAV).")],
    *,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the responses here, by suffix.")] = None,
    estimator: Annotated[
        Literal["H1", "H2", "Hv"], typer.Option(help="Noise is in the outputs, input, or both.")
    ] = "H1",
    exponential: Annotated[
        float | None, typer.Option(metavar="VALUE", help="Exponential window: its value at the end of the record.")
    ] = None,
    force_window: Annotated[
        str | None, typer.Option(metavar="TIME", help="The force counts for so long after the pulse began, e.g. 8ms.")
    ] = None,
    stretch: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Lasting excitation (random, sweeps): stretches so long, e.g. 2s."),
    ] = None,
    band: Annotated[
        str | None, typer.Option(metavar="FROM,TO", help="Keep the lines in this band, e.g. '5,200 Hz'.")
    ] = None,
    duration: Annotated[str | None, typer.Option(metavar="TIME", help="Cut records to this, e.g. 4s.")] = None,
    accept: Annotated[
        list[str] | None, typer.Option(metavar="DEFECT", help="Use records with this defect. May be repeated.")
    ] = None,
    reciprocal: Reciprocal = False,
    reciprocity: ShowPairs = False,
    reference: Annotated[
        list[str] | None,
        typer.Option(metavar="CHANNEL", help="Excites the loop that the plant is in. May be repeated."),
    ] = None,
    channels: Channels = None,
) -> Answer:
    """Frequency responses from hits: windows, averages, coherence; bad records are named and left out."""
    from flexura.io import read_measurement, write_measurement
    from flexura.testing.measurement import estimate_frf

    measurement = read_measurement(data, channels)
    frfs = estimate_frf(
        measurement,
        estimator=estimator,
        exponential=exponential,
        force_window=time_of("--force-window", force_window, "8ms"),
        stretch=time_of("--stretch", stretch, "2s"),
        band=band_of(band),
        duration=time_of("--duration", duration, "4s"),
        accept=accept or (),
        reciprocal=reciprocal,
        references=reference or (),
    )
    result = replace(measurement, frfs=frfs, modes=None)
    responses = result.to_dict()["responses"]
    each = tuple(note for row in responses for note in row["notes"])
    answer = Answer(
        replace(result, notes=tuple(dict.fromkeys((*result.notes, *each)))),
        write=lambda: [] if out is None else [write_measurement(replace(result, recordings=(), notes=()), out)],
        data=result.to_dict,
    )
    return _with_pairs(answer, frfs, reciprocal) if reciprocity else answer


def _with_pairs(answer: Answer, frfs: Sequence[MeasuredFRF], reciprocal: bool) -> Answer:
    """An answer, with the pairs that are measured both ways. Raises OptionError for filled ones, which are equal."""
    from flexura.testing.measurement import reciprocity

    if reciprocal:
        raise OptionError("--reciprocity compares what is measured, --reciprocal fills what is not: take one of them")
    found, result = reciprocity(frfs), answer.result
    return answer._replace(
        result=replace(result, notes=tuple(dict.fromkeys((*result.notes, *found.notes)))),
        text=[*result.presentation(), *found.presentation()],
        data=lambda: {**(answer.data or result.to_dict)(), "reciprocity": found.to_dict()},
    )


@command("plot", reads=False)
def identify_command(
    data: Data,
    *,
    band: Annotated[str | None, typer.Option(metavar="FROM,TO", help="Only in this band, e.g. '5,200 Hz'.")] = None,
    select: Annotated[
        str | None,
        typer.Option(
            metavar="F1,F2",
            help="The modes nearest to these frequencies, or poles of an order, and no others: '12,40@24 Hz'.",
        ),
    ] = None,
    order: Annotated[int | None, typer.Option(min=2, max=500, help="Order of the largest model.")] = None,
    setups: Annotated[
        Literal["each", "together"],
        typer.Option(help="Each placement of sensors by itself, then merged; or all as one."),
    ] = "each",
    refine: Annotated[
        bool, typer.Option("--refine/--no-refine", help="Fit poles and shapes together to the responses.")
    ] = True,
    most_damped: Annotated[float, typer.Option(metavar="RATIO", help="Poles above this damping ratio are none.")] = 0.2,
    least_confidence: Annotated[
        float, typer.Option(metavar="NUMBER", help="Modes of less confidence are left out, unless picked.")
    ] = 0.3,
    method: Annotated[
        Literal["plscf", "ssi"] | None,
        typer.Option(help="Poles by least squares (of responses), or subspaces (of outputs alone)."),
    ] = None,
    reciprocal: Reciprocal = False,
    reciprocity: ShowPairs = False,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the modes here: .json, .csv, .parquet or .uff.")
    ] = None,
    channels: Channels = None,
    repeated: Repeated = None,
) -> Answer:
    """Modes of a test: frequencies, damping, complexity of shapes, and the confidence in each."""
    from flexura.io import read_measurement, write_modes
    from flexura.testing.identification import frfs_of, identify

    measurement = read_measurement(data, channels=channels, repeated=repeated)
    result = identify(
        measurement,
        band=band_of(band),
        order=order,
        select=selected(select),
        setups=setups,
        refine=refine,
        most_damped=most_damped,
        least_confidence=least_confidence,
        method=method,
        reciprocal=reciprocal,
    )
    drawn = {"data": frfs_of(measurement, reciprocal=True)[1] if reciprocal else measurement}
    write = lambda: [] if out is None else [write_modes(result, out)]  # noqa: E731
    answer = Answer(result, pictures="save_identification", drawn=drawn, write=write)
    return _with_pairs(answer, frfs_of(measurement)[1], reciprocal) if reciprocity else answer


@command("plot", reads=False)
def virtual_test_command(
    file: File,
    *,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write records and responses here, e.g. test.uff.")
    ] = None,
    measured: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Measured frequencies (CSV, YAML) to stand beside.")
    ] = None,
    band: IdentifiedBand = None,
    damping: Ratio = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the noise and the peaks of the hits.")] = 0,
    double_hits: Annotated[int, typer.Option(min=0, help="So many more hits at every point bounce.")] = 0,
    set: Settings = None,
) -> Answer:
    """Simulate the hammer test that a file describes, identify its modes, and compare them with the truth."""
    from flexura.io import write_measurement
    from flexura.testing.updating import read_frequencies
    from flexura.testing.virtual import virtual_test

    mechanism, parameters = read(file, set)
    beside = None if measured is None else read_frequencies(measured)
    if mechanism.test is None:
        raise OptionError(f"{file} describes no test: add the key test")
    result = virtual_test(
        mechanism, parameters, band=band_of(band), damping=damping, seed=seed, double_hits=double_hits, progress=say
    )
    known = {} if beside is None else beside.by_number
    more = {} if beside is None else {"measured_hz": [known.get(n) for n in range(1, max(known) + 1)]}
    return Answer(
        replace(result, notes=() if result.identified is None else tuple(dict.fromkeys(result.notes))),
        result.presentation(None if beside is None else beside.by_number),
        "save_virtual_test",
        {"measured": beside},
        write=lambda: [] if out is None else [write_measurement(result.measurement, out)],
        data=lambda: result.to_dict() | more,
    )


@command("plot")
def correlate_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    data: Data,
    n: Annotated[int | None, typer.Option("-n", min=1, max=200, help="Modes of the model that are compared.")] = None,
    within: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Farthest a sensor may be from the model, e.g. '2 mm'.")
    ] = None,
    close: Annotated[
        float, typer.Option(min=0.0, max=0.5, help="Modes nearer than this, relative, are compared as a space.")
    ] = 0.02,
    reduced_mass: Annotated[
        Literal["serep", "guyan"], typer.Option(help="Mass matrix over the sensors: by the modes, or static.")
    ] = "serep",
    band: IdentifiedBand = None,
    select: Annotated[
        str | None,
        typer.Option(metavar="F1,F2", help="Identify the modes nearest to these frequencies, e.g. '12,40 Hz'."),
    ] = None,
    channels: Channels = None,
    repeated: Repeated = None,
) -> Answer:
    """Test against model: pairs of modes with MAC and frequency error, channels that disagree, FRFs, pictures."""
    from flexura.io import read_measurement
    from flexura.testing.correlation import correlate, identified_modes

    measurement = read_measurement(data, channels=channels, repeated=repeated)
    result = correlate(
        mechanism,
        test=identified_modes(measurement, band=band_of(band), select=selected(select)),
        measurement=measurement,
        parameters=parameters,
        n=n,
        within=None if within is None else quantity_of("--within", within, "m", "'2 mm'"),
        close=close,
        reduced_mass=reduced_mass,
    )
    return Answer(result, pictures="save_correlation")


@command("plot")
def place_sensors_command(
    mechanism: Mechanism,
    parameters: dict[str, float],
    *,
    sensors: Annotated[int, typer.Option(min=1, help="Number of sensors.")],
    n: Annotated[int, typer.Option("-n", min=1, max=200, help="Modes that they have to distinguish.")] = 6,
    candidate: Annotated[
        list[str] | None,
        typer.Option("--candidate", metavar="NAME", help="Sensor or DOF, e.g. 'platform.t*'. May be repeated."),
    ] = None,
) -> Answer:
    """The best places for so many sensors among the candidates, by effective independence."""
    from flexura.testing.virtual import place_sensors

    result = place_sensors(mechanism, sensors=sensors, n=n, candidates=candidate, parameters=parameters)
    return Answer(result, pictures="draw_sensors")


Compared = Literal["modes", "frequencies", "responses"]


@command("strict", plot="Write a picture of the outcome here.", reads=False)
def calibrate_command(
    file: File,
    data: Annotated[
        Path, typer.Argument(metavar="DATA", help="Measured data, or a YAML or CSV list of natural frequencies.")
    ],
    *,
    free: Annotated[str, typer.Option(metavar="A,B,C", help="Parameters that may move.")],
    also: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE=DATA", help="Another mechanism with data of its own; parameters of one name are one. Repeat."
        ),
    ] = None,
    method: Annotated[
        Literal["map", "least_squares"], typer.Option(help="With priors (map), or with bounds alone.")
    ] = "map",
    on: Annotated[
        Compared, typer.Option(help="Of measured data: identified modes, their frequencies alone, or responses.")
    ] = "modes",
    sigma: Annotated[
        float, typer.Option(metavar="REL", help="Relative standard deviation of frequencies that bring none.")
    ] = 0.01,
    damping: Annotated[float, typer.Option(metavar="RATIO", help="Damping ratio of all modes in responses.")] = 0.01,
    pairing: Annotated[
        Literal["tracked", "in_order"],
        typer.Option(help="Frequencies belong to the start's modes, or to those of the same number."),
    ] = "tracked",
    draws: Annotated[
        int, typer.Option(min=0, help="Draws of the posterior, by Metropolis, that check the intervals.")
    ] = 0,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the calibrated mechanism here.")] = None,
    set: Settings = None,
) -> Answer:
    """Parameters with which the mechanism meets a measurement, and their uncertainties."""
    from flexura.modelfile import refuse_base
    from flexura.testing.updating import calibrate, save_calibrated

    files, measured = [file], [data]
    for pair in also or []:
        other, equals, its = pair.partition("=")
        if not (other and equals and its):
            raise OptionError(f"--also takes FILE=DATA, e.g. --also loaded.yaml=loaded.csv, not {pair!r}")
        files.append(Path(other))
        measured.append(Path(its))
    targets = [] if out is None else _targets(out, files)
    for target in targets:
        for base in files:
            refuse_base(target, base)
    (mechanism, *others), parameters = _read_all(files, set)
    first, *more = [read_data(path, on) for path in measured]
    result = calibrate(
        mechanism,
        data=first,
        free=names_of(free) or [],
        parameters=parameters,
        also=list(zip(others, more, strict=True)),
        method=method,
        sigma=sigma,
        damping=damping,
        pairing=pairing,
    )
    sample = _sample(result, draws) if draws else None
    return Answer(
        result,
        [*result.presentation(), *(() if sample is None else sample.presentation())],
        "save_calibration",
        write=lambda: [
            save_calibrated(result, target, base=base, configuration=k)
            for k, (target, base) in enumerate(zip(targets, files, strict=False))
        ],
        data=lambda: result.to_dict() | ({} if sample is None else {"sampled": sample.to_dict()}),
    )


def _read_all(files: list[Path], settings: list[str] | None) -> tuple[list[Any], dict[str, float]]:
    """The mechanisms of files, and the parameters that are replaced in those that have them."""
    if len(files) == 1:
        mechanism, parameters = read(files[0], settings)
        return [mechanism], parameters
    from flexura.modelfile import load

    known = [load(file).parameters for file in files]
    mechanisms: list[Any] = []
    replaced: dict[str, float] = {}
    for k, (file, names) in enumerate(zip(files, known, strict=True)):
        named = {text: text.partition("=")[0].strip() for text in settings or []}
        mine = [t for t, n in named.items() if n in names or (k == 0 and not any(n in other for other in known))]
        mechanism, parameters = read(file, mine)
        mechanisms.append(mechanism)
        replaced |= parameters
    return mechanisms, replaced


def _targets(out: Path, files: list[Path]) -> list[Path]:
    """Where each calibrated file is written: the first as it is asked for, others with their own name after it."""
    targets = [out]
    for file in files[1:]:
        names = [f"{out.stem}-{file.stem}{k or ''}{out.suffix}" for k in range(len(files))]
        targets.append(next(path for name in names if (path := out.with_name(name)) not in targets))
    return targets


def read_data(path: Path, on: Compared = "modes") -> Any:
    """Frequencies of a list, or what is compared of a measurement. Raises OptionError for what cannot be read."""
    from flexura.testing.updating import MeasuredFrequencies, read_frequencies

    if path.suffix.lower() in LISTS or (path.suffix.lower() == ".csv" and _is_list(path)):
        return read_frequencies(path)
    import flexura
    from flexura.testing.updating import setups_of

    measurement = flexura.read_measurement(path)
    if on == "responses":
        return measurement
    identified = flexura.identify(measurement)
    if on == "frequencies":
        return replace(MeasuredFrequencies.of(identified.frequency_hz, None, path.stem), setups=setups_of(identified))
    return identified


def _is_list(path: Path) -> bool:
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as stream:
            first = stream.readline()
    except OSError as error:
        raise OptionError(f"{path} cannot be read: {error.strerror or error}") from None
    return "frequency" in [cell.strip() for cell in first.split(",")]


def _sample(result: Calibration, draws: int) -> Sample:
    """Draws, with their progress on a terminal; an interrupt keeps those that there are."""
    with Progress(console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task("drawing", total=None)
        return result.sample(draws, progress=lambda at: shown.update(task, completed=at.done, total=at.of))
