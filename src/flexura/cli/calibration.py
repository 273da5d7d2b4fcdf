"""The command that finds parameters from a measurement."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress

from flexura.cli.options import File, Json, Settings, Strict, print_result, read
from flexura.cli.tables import columns_table, console_of_width
from flexura.errors import OptionError
from flexura.tables import quantity

if TYPE_CHECKING:
    from flexura.testing.updating import CalibratedParameter, Calibration, Sample

LISTS = (".yaml", ".yml")
"""Suffixes of files that hold a plain list of frequencies."""


class Method(StrEnum):
    """How parameters are weighed."""

    map = "map"
    least_squares = "least_squares"


class Pairing(StrEnum):
    """Which mode a frequency without a shape belongs to."""

    tracked = "tracked"
    in_order = "in_order"


class Compared(StrEnum):
    """What of a measurement is compared with the model."""

    modes = "modes"
    frequencies = "frequencies"
    responses = "responses"


def calibrate_command(
    file: File,
    data: Annotated[
        Path, typer.Argument(metavar="DATA", help="Measured data, or a YAML or CSV list of natural frequencies.")
    ],
    free: Annotated[str, typer.Option(metavar="A,B,C", help="Parameters that may move.")],
    also: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE=DATA", help="Another mechanism with data of its own; parameters of one name are one. Repeat."
        ),
    ] = None,
    method: Annotated[Method, typer.Option(help="With priors (map), or with bounds alone.")] = Method.map,
    on: Annotated[
        Compared, typer.Option(help="Of measured data: identified modes, their frequencies alone, or responses.")
    ] = Compared.modes,
    sigma: Annotated[
        float, typer.Option(metavar="REL", help="Relative standard deviation of frequencies that bring none.")
    ] = 0.01,
    damping: Annotated[float, typer.Option(metavar="RATIO", help="Damping ratio of all modes in responses.")] = 0.01,
    pairing: Annotated[
        Pairing, typer.Option(help="Frequencies belong to the start's modes, or to those of the same number.")
    ] = Pairing.tracked,
    draws: Annotated[
        int, typer.Option(min=0, help="Draws of the posterior, by Metropolis, that check the intervals.")
    ] = 0,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the calibrated mechanism here.")] = None,
    plot: Annotated[Path | None, typer.Option(metavar="DIR", help="Write a picture of the outcome here.")] = None,
    set: Settings = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Parameters with which the mechanism meets a measurement, and their uncertainties."""
    from flexura.modelfile import refuse_base
    from flexura.testing.updating import calibrate, save_calibrated

    files, measured = [file], [data]
    for pair in also or []:
        own, equals, its = pair.partition("=")
        if not (own and equals and its):
            raise OptionError(f"--also takes FILE=DATA, e.g. --also loaded.yaml=loaded.csv, not {pair!r}")
        files.append(Path(own))
        measured.append(Path(its))
    for target, _ in _targets(out, files) if out is not None else ():
        for own in files:
            refuse_base(target, own)
    (mechanism, *others), parameters = _read_all(files, set)
    first, *more = [read_data(path, on) for path in measured]
    names = [name.strip() for name in free.split(",") if name.strip()]
    result = calibrate(
        mechanism,
        data=first,
        free=names,
        parameters=parameters,
        also=list(zip(others, more, strict=True)),
        method=method.value,
        sigma=sigma,
        damping=damping,
        pairing=pairing.value,
    )
    if strict:
        result.raise_warnings()
    sampled = _sampled(result, draws) if draws else None
    written = (
        []
        if out is None
        else [save_calibrated(result, t, base=f, configuration=k) for k, (t, f) in enumerate(_targets(out, files))]
    )
    if plot is not None:
        from flexura.view import save_calibration

        written += save_calibration(result, plot)
    if as_json:
        print_result(result.to_dict() | ({} if sampled is None else {"sampled": sampled.to_dict()}), written)
        return
    print_calibration(result)
    if sampled is not None:
        _print_sampled(result, sampled)
    for path in written:
        typer.echo(f"wrote {path}")


def _read_all(files: list[Path], settings: list[str] | None) -> tuple[list[Any], dict[str, float]]:
    """The mechanisms of files, and the parameters that are replaced in those that have them."""
    if len(files) == 1:
        mechanism, parameters = read(files[0], settings)
        return [mechanism], parameters
    from flexura.modelfile import load

    known = [load(file).parameters for file in files]
    mechanisms: list[Any] = []
    replaced: dict[str, float] = {}
    for k, (file, own) in enumerate(zip(files, known, strict=True)):
        named = {text: text.partition("=")[0].strip() for text in settings or []}
        mine = [t for t, n in named.items() if n in own or (k == 0 and not any(n in other for other in known))]
        mechanism, parameters = read(file, mine)
        mechanisms.append(mechanism)
        replaced |= parameters
    return mechanisms, replaced


def _targets(out: Path, files: list[Path]) -> list[tuple[Path, Path]]:
    """Where each calibrated file is written: the first as it is asked for, others with their own name after it."""
    found = [(out, files[0])]
    for file in files[1:]:
        names = [f"{out.stem}-{file.stem}{k or ''}{out.suffix}" for k in range(len(files))]
        taken = {path for path, _ in found}
        found.append((next(p for n in names if (p := out.with_name(n)) not in taken), file))
    return found


def read_data(path: Path, on: Compared = Compared.modes) -> Any:
    """Frequencies of a list, or what is compared of a measurement. Raises OptionError for what cannot be read."""
    from flexura.testing.updating import MeasuredFrequencies, read_frequencies

    if path.suffix.lower() in LISTS or (path.suffix.lower() == ".csv" and _is_list(path)):
        return read_frequencies(path)
    import flexura
    from flexura.testing.updating import setups_of

    measurement = flexura.read_measurement(path)
    if on is Compared.responses:
        return measurement
    identified = flexura.identify(measurement)
    if on is Compared.frequencies:
        return replace(MeasuredFrequencies.of(identified.frequency_hz, None, path.stem), setups=setups_of(identified))
    return identified


def _is_list(path: Path) -> bool:
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as stream:
            first = stream.readline()
    except OSError as error:
        raise OptionError(f"{path} cannot be read: {error.strerror or error}") from None
    return "frequency" in [cell.strip() for cell in first.split(",")]


def print_calibration(result: Calibration) -> None:
    """Print parameters with intervals, frequencies before and after, and what the data cannot determine."""
    console = console_of_width()
    how = "maximum of the posterior" if result.method == "map" else "least squares"
    together = ", with ".join(m.name for m in (result.mechanism, *result.also))
    console.print(f"{together}: calibrated, {how}", style="bold", markup=False)
    parameters = {
        "parameter": [p.name for p in result.parameters],
        "start": [_size(p, p.start) for p in result.parameters],
        "calibrated": [_size(p, p.value) + (" at bound" if p.at_bound else "") for p in result.parameters],
        "95 % interval": [_range(p, p.interval) for p in result.parameters],
        "variance reduction": [f"{100 * p.variance_reduction:.0f} %" for p in result.parameters],
        "prior from": [p.reason for p in result.parameters],
    }
    console.print(columns_table(parameters))
    if result.modes:
        console.print(columns_table(_mode_columns(result)))
    chi = f"chi-square {result.start_chi_square:.4g} before, {result.chi_square:.4g} after"
    console.print(f"{chi}, {result.residuals} data; {result.evaluations} evaluations")
    if result.unresolved:
        console.print("the data cannot determine (weights in prior standard deviations):")
        for d in result.unresolved:
            console.print(f"  {d}  ({100 * d.variance_reduction:.0f} % variance reduction)", markup=False)
    for own in result.misfits:
        if own.is_testable:
            said = f"{own.kind}: missed by {own.ratio:.2g} standard deviations, {own.spare:.2g} of {own.data} to spare"
            console.print(f"{said}, probability {own.probability:.2g}", markup=False)
    for warning in result.warnings:
        console.print(f"warning: {warning}", style="yellow", markup=False)
    for note in result.notes:
        console.print(f"note: {note}", markup=False)


def _sampled(result: Calibration, draws: int) -> Sample:
    """Draws, with their progress on a terminal; an interrupt keeps those that there are."""
    with Progress(console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task("drawing", total=None)
        return result.sample(draws, progress=lambda at: shown.update(task, completed=at.done, total=at.of))


def _print_sampled(result: Calibration, sampled: Sample) -> None:
    console = console_of_width()
    chains, count = sampled.values.shape[:2]
    text = f"{chains} chains of {count} draws, worth {sampled.effective:.0f}"
    console.print(f"{text} independent ones; R-hat {sampled.r_hat:.3f}, {100 * sampled.acceptance:.0f} % accepted")
    if not sampled.is_whole:
        console.print("drawing was interrupted")
    if any(own.is_testable and own.ratio > 1 for own in result.misfits):
        console.print("draws take sigma as it is: they do not have the error of the model that widens the intervals")
    if not sampled.is_settled:
        console.print("these are too few to check the intervals: more draws, or fewer free parameters")
        return
    drawn = [_range(p, own) for p, own in zip(result.parameters, sampled.interval, strict=True)]
    console.print(
        columns_table({"parameter": [p.name for p in result.parameters], "95 % interval of the draws": drawn})
    )


def _mode_columns(result: Calibration) -> dict[str, list[Any]]:
    modes = result.modes
    columns: dict[str, list[Any]] = {
        "mode": [m.number for m in modes],
        "measured [Hz]": [m.measured_hz for m in modes],
        "start": [f"{100 * m.start_error:+.2f} %" for m in modes],
        "calibrated [Hz]": [m.calibrated_hz for m in modes],
        "error": [f"{100 * m.error:+.2f} %" for m in modes],
        "in sigma": [f"{m.error / m.sigma:+.1f}" for m in modes],
    }
    if any(m.mac is not None for m in modes):
        columns["MAC"] = ["" if m.mac is None else f"{m.mac:.3f}" for m in modes]
    if result.also:
        columns["of"] = [m.configuration for m in modes]
    return columns


def _range(p: CalibratedParameter, interval: tuple[float, float]) -> str:
    return f"{_size(p, interval[0])} to {_size(p, interval[1])}"


def _size(p: CalibratedParameter, value: float) -> str:
    return quantity(value, p.unit, 4)
