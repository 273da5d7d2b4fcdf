"""Commands of tests: estimate, identify, simulate, correlate, calibrate, and where to put sensors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import typer
from rich.console import Console, RenderableType
from rich.progress import Progress
from rich.text import Text

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
from flexura.cli.terminal import columns_table, heading, significant
from flexura.errors import OptionError
from flexura.tables import counted, ends, number, percent, quantity, scale_for

if TYPE_CHECKING:
    from flexura.mechanism import Mechanism
    from flexura.testing.correlation import Correlation, ModePair
    from flexura.testing.measurement import IdentifiedModes
    from flexura.testing.updating import CalibratedParameter, Calibration, MeasuredFrequencies, Sample
    from flexura.testing.virtual import SensorPlacement, VirtualTest

LISTS = (".yaml", ".yml")
"""Suffixes of files that hold a plain list of frequencies."""

MOST_CHANNELS = 40
"""Channels that are listed."""


@command(reads=False)
def estimate_frf_command(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Time records (UFF, CSV, npz, HDF5), or a folder.")],
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
    band: Annotated[
        str | None, typer.Option(metavar="FROM,TO", help="Keep the lines in this band, e.g. '5,200 Hz'.")
    ] = None,
    duration: Annotated[str | None, typer.Option(metavar="TIME", help="Cut records to this, e.g. 4s.")] = None,
    accept: Annotated[
        list[str] | None, typer.Option(metavar="DEFECT", help="Use records with this defect. May be repeated.")
    ] = None,
    channels: Channels = None,
) -> Answer:
    """Frequency responses from hits: windows, averages, coherence; bad records are named and left out."""
    from flexura.io import read_measurement, write_measurement
    from flexura.testing.measurement import Measurement, estimate_frf

    measurement = read_measurement(data, channels)
    frfs = estimate_frf(
        measurement,
        estimator=estimator,
        exponential=exponential,
        force_window=time_of("--force-window", force_window, "8ms"),
        band=band_of(band),
        duration=time_of("--duration", duration, "4s"),
        accept=accept or (),
    )
    name, records, notes = measurement.name, measurement.recordings, measurement.notes
    result = Measurement(name, records, frfs, notes)
    responses = result.to_dict()["responses"]
    each = tuple(note for row in responses for note in row["notes"])
    text = _responses_text(f"{name}: {counted(len(records), 'record')}", responses)
    return Answer(
        replace(result, notes=tuple(dict.fromkeys((*notes, *each)))),
        text,
        write=lambda: [] if out is None else [write_measurement(Measurement(name, (), frfs), out)],
        data=result.to_dict,
    )


def _responses_text(title: str, responses: Sequence[dict[str, Any]]) -> Iterator[RenderableType]:
    yield heading(title)
    coherence = [row["median_coherence"] for row in responses]
    yield columns_table(
        {
            "setup": [row["setup"] for row in responses],
            "inputs": [", ".join(row["inputs"]) for row in responses],
            "outputs": [", ".join(row["outputs"]) for row in responses],
            "lines": [row["lines"] for row in responses],
            "band": [ends((row["from_hz"], row["to_hz"]), "Hz") for row in responses],
            "averages": [row["averages"] for row in responses],
            "coherence": ["" if median is None else f"{median:.3f}" for median in coherence],
        },
        left=3,
    )


@command("plot", reads=False)
def identify_command(
    data: Data,
    *,
    band: Annotated[str | None, typer.Option(metavar="FROM,TO", help="Only in this band, e.g. '5,200 Hz'.")] = None,
    select: Annotated[
        str | None,
        typer.Option(metavar="F1,F2", help="The modes nearest to these frequencies, and no others, e.g. '12,40 Hz'."),
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
    channels: Channels = None,
    repeated: Repeated = None,
) -> Answer:
    """Modes of a test: frequencies, damping, complexity of shapes, and the confidence in each."""
    from flexura.io import read_measurement
    from flexura.testing.identification import identify

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
    )
    return Answer(result, identified_text(result), "save_identification", {"data": measurement})


def identified_text(result: IdentifiedModes) -> Iterator[RenderableType]:
    """The modes with their evidence, and those of every setup side by side."""
    n, p, m = len(result.poles), len(result.outputs), len(result.inputs)
    yield heading(f"{result.name}: {counted(n, 'mode')} from {counted(p, 'output')} and {counted(m, 'input')}")
    evidence = result.evidence
    scale = scale_for(result.frequency_hz, "Hz")
    hz = [f / scale.size for f in result.frequency_hz]
    off = [e.frequency_spread * f for e, f in zip(evidence, hz, strict=True)]
    columns: dict[str, list[Any]] = {
        "mode": list(range(1, n + 1)),
        scale.heading("frequency"): [significant(f, spread) for f, spread in zip(hz, off, strict=True)],
        scale.heading("+-"): [f"{spread:.1g}" for spread in off],
        "damping": [
            f"{significant(100 * zeta, 100 * zeta * e.damping_spread, 4)} %"
            for zeta, e in zip(result.damping_ratio, evidence, strict=True)
        ],
        "+- damping": [percent(e.damping_spread, 2) if e.damping_spread < 0.995 else "all of it" for e in evidence],
        "confidence": [f"{e.confidence:.2f}" for e in evidence],
        "MPC": [f"{e.modal_phase_collinearity:.3f}" for e in evidence],
        "MPD": [f"{e.mean_phase_deviation_deg:.2g}°" for e in evidence],
    }
    if len(result.setups) > 1:
        columns["setups"] = [f"{e.setups} of {len(result.setups)}" for e in evidence]
    yield columns_table(columns, left=0)
    if len(result.setups) > 1:
        each = [", ".join(number(f / scale.size, 6) for f in setup.frequency_hz) for setup in result.setups]
        yield columns_table({"setup": [setup.name for setup in result.setups], scale.heading("modes"): each}, 2)
    yield f"synthesis error {percent(result.synthesis_error, 2)}"


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
        virtual_test_text(result, beside),
        "save_virtual_test",
        {"measured": beside},
        write=lambda: [] if out is None else [write_measurement(result.measurement, out)],
        data=lambda: result.to_dict() | more,
    )


def virtual_test_text(result: VirtualTest, measured: MeasuredFrequencies | None = None) -> Iterator[RenderableType]:
    """True and identified modes, and what the sensors do in every placement."""
    placements = list(result.test.placed())
    title = f"{result.name}: {len(result.measurement.recordings)} hits, {counted(len(placements), 'placement')}"
    yield heading(f"{title}, {ends(result.band, 'Hz')}")
    if result.identified is None:  # what says why is said first
        yield from dict.fromkeys(result.notes)
    yield columns_table(_tested_modes(result, measured))
    if len(placements) > 1 and result.identified is not None:
        columns: dict[str, list[Any]] = {"mode": [mode.number for mode in result.modes]}
        pairs = {p: [mode.placement_hz[p] for mode in result.modes] for p in placements}
        columns |= {f"{p} [Hz]": [true for true, _ in pair] for p, pair in pairs.items()}
        for p, pair in pairs.items():
            columns[f"{p} off"] = ["missed" if f is None else f"{100 * (f / t - 1):+.3f} %" for t, f in pair]
        yield columns_table(columns)
    if result.false_hz:
        yield f"identified where there is no mode: {', '.join(quantity(f, 'Hz') for f in result.false_hz)}"


def _tested_modes(result: VirtualTest, measured: MeasuredFrequencies | None) -> dict[str, list[Any]]:
    """True and identified modes; damping that nothing was identified for is the true one, in brackets."""
    modes = result.modes
    columns: dict[str, list[Any]] = {
        "mode": [mode.number for mode in modes],
        "no sensors [Hz]": [mode.bare_hz for mode in modes],
        "sensors on [Hz]": [mode.mass_loaded_hz for mode in modes],
        "mass effect": [f"{100 * mode.mass_effect:+.2f} %" for mode in modes],
        "identified [Hz]": [mode.identified_hz for mode in modes],
        "off": [
            "" if result.identified is None else "missed" if mode.error is None else f"{100 * mode.error:+.3f} %"
            for mode in modes
        ],
        "damping": [
            f"({percent(mode.damping_ratio)})"
            if mode.identified_damping is None
            else f"{100 * mode.identified_damping:.3f} %"
            for mode in modes
        ],
        "its error": ["" if mode.damping_error is None else f"{100 * mode.damping_error:+.1f} %" for mode in modes],
        "MAC": ["" if mode.mac is None else f"{mode.mac:.3f}" for mode in modes],
        "confidence": ["" if mode.confidence is None else f"{mode.confidence:.2f}" for mode in modes],
    }
    if measured is not None:
        columns["measured [Hz]"] = [measured.by_number.get(k + 1) for k in range(len(modes))]
    return columns


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
    return Answer(result, correlation_text(result), "save_correlation")


def correlation_text(result: Correlation) -> Iterator[RenderableType]:
    """Pairs of modes, what has no counterpart, channels and responses."""
    paired = f"{len(result.pairs)} of {len(result.test_hz)} test modes paired"
    yield heading(f"{result.test_name} against {result.name}: {paired}")
    yield columns_table(_pair_columns(result.pairs), left=0)
    for words, numbers, hz in (
        ("test modes without a counterpart", result.unpaired_test, result.test_hz),
        ("modes of the model that the test has not", result.unpaired_model, result.model_hz),
    ):
        if numbers:
            listed = ", ".join(f"{k} ({quantity(hz[k - 1], 'Hz')})" for k in numbers)
            yield Text(f"{words}: {listed}", style="red")
    if len(result.pairs) > 1:
        for name, values in (("test", result.self_orthogonality), ("test and model", result.cross_orthogonality)):
            off = float((values - np.diag(np.diagonal(values))).max())
            yield f"orthogonality of {name}, mass reduced by {result.reduced_mass}: at most {off:.2f} off the diagonal"
    yield from _channels(result)
    for overlay in result.frfs:
        frac = overlay.frac
        setup = f" ({overlay.measured.setup})" if overlay.measured.setup else ""
        span = f"{frac.min():.2f} to {frac.max():.2f}"
        yield f"FRAC of {frac.size} responses{setup}: {span}, damping {overlay.damping}"


def _pair_columns(pairs: Sequence[ModePair]) -> dict[str, list[Any]]:
    is_space = [len(pair.model_space) > 1 or len(pair.test_space) > 1 for pair in pairs]
    return {
        "test": [pair.test for pair in pairs],
        "measured [Hz]": [pair.test_hz for pair in pairs],
        "damping": [percent(pair.damping_ratio, 2) for pair in pairs],
        "model": [pair.model for pair in pairs],
        "computed [Hz]": [pair.model_hz for pair in pairs],
        "difference": [f"{100 * pair.error:+.2f} %" for pair in pairs],
        "MAC": [f"{pair.mac:.3f}" for pair in pairs],
        "in space": [f"{pair.space_mac:.3f}" if space else "" for pair, space in zip(pairs, is_space, strict=True)],
        "not represented": [percent(pair.expansion_error, 2) for pair in pairs],
    }


def _channels(result: Correlation) -> Iterator[RenderableType]:
    """Where channels sit in the model, and which disagree."""
    columns = {
        "channel": [match.channel.name for match in result.matched],
        "reads": [match.node for match in result.matched],
        "found by": [match.how for match in result.matched],
        "away [m]": [match.distance for match in result.matched],
        "CoMAC": [f"{comac:.3f}" for comac in result.comac],
        "gain": [
            f"{gain:.2f}" + ("" if used else "  left out") for gain, used in zip(result.gain, result.used, strict=True)
        ],
    }
    yield columns_table(columns, left=3, most=MOST_CHANNELS)
    if len(result.matched) > MOST_CHANNELS:
        yield f"and {len(result.matched) - MOST_CHANNELS} more channels"
    for lost in result.unmatched:
        near = "" if lost.distance is None else f"; nearest is {lost.nearest}, {quantity(lost.distance, 'm', 3)} away"
        yield Text(f"{lost.channel.name} is left out: {lost.reason}{near}", style="red")


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
    return Answer(result, placement_text(result), "draw_sensors")


def placement_text(result: SensorPlacement) -> Iterator[RenderableType]:
    """The chosen sensors and how well they tell the modes apart."""
    count, modes = len(result.sensors), len(result.frequency_hz)
    yield heading(f"{result.name}: {count} of {len(result.candidates)} candidates for the first {modes} modes")
    turned = ["about " if turns else "" for turns in result.turns]
    columns = {
        "": [str(k + 1) for k in range(count)],
        "sensor": result.sensors,
        "at, mm": [_vector(position, 1e3) for position in result.positions],
        "direction": [turn + _vector(axis, 1.0) for turn, axis in zip(turned, result.directions, strict=True)],
        "independence": [f"{value:.3f}" for value in result.independence],
    }
    yield columns_table(columns, left=4)
    yield (
        f"largest MAC of two modes {result.worst_mac:.3f}, condition {result.condition:.3g};"
        f" {percent(result.information)} of the information of all candidates; {result.exchanges} exchanges"
    )


def _vector(values: Any, factor: float) -> str:
    """Three numbers; nothing where they are not known."""
    numbers = [round(factor * float(v), 6) + 0.0 for v in values]
    return ", ".join(f"{v:.4g}" for v in numbers) if all(map(math.isfinite, numbers)) else ""


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
        calibration_text(result, sample),
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


def calibration_text(result: Calibration, sample: Sample | None = None) -> Iterator[RenderableType]:
    """Parameters with intervals, frequencies before and after, what the data cannot determine, and draws."""
    method = "maximum of the posterior" if result.method == "map" else "least squares"
    together = ", with ".join(m.name for m in (result.mechanism, *result.also))
    yield heading(f"{together}: calibrated, {method}")
    parameters = {
        "parameter": [p.name for p in result.parameters],
        "start": [quantity(p.start, p.unit, 4) for p in result.parameters],
        "calibrated": [quantity(p.value, p.unit, 4) + " at bound" * p.at_bound for p in result.parameters],
        "95 % interval": [_interval(p, p.interval) for p in result.parameters],
        "variance reduction": [f"{100 * p.variance_reduction:.0f} %" for p in result.parameters],
        "prior from": [p.reason for p in result.parameters],
    }
    yield columns_table(parameters)
    if result.modes:
        yield columns_table(_calibrated_modes(result))
    chi = f"chi-square {result.start_chi_square:.4g} before, {result.chi_square:.4g} after"
    yield f"{chi}, {result.residuals} data; {result.evaluations} evaluations"
    if result.unresolved:
        yield "the data cannot determine (weights in prior standard deviations):"
    for direction in result.unresolved:
        yield f"  {direction}  ({100 * direction.variance_reduction:.0f} % variance reduction)"
    for misfit in result.misfits:
        if misfit.is_testable:
            missed = f"{misfit.ratio:.2g} standard deviations, {misfit.spare:.2g} of {misfit.data} to spare"
            yield f"{misfit.kind}: missed by {missed}, probability {misfit.probability:.2g}"
    if sample is not None:
        yield from _sample_text(result, sample)


def _sample_text(result: Calibration, sample: Sample) -> Iterator[RenderableType]:
    chains, count = sample.values.shape[:2]
    text = f"{chains} chains of {count} draws, worth {sample.effective:.0f}"
    yield f"{text} independent ones; R-hat {sample.r_hat:.3f}, {100 * sample.acceptance:.0f} % accepted"
    if not sample.is_whole:
        yield "drawing was interrupted"
    if any(misfit.is_testable and misfit.ratio > 1 for misfit in result.misfits):
        yield "draws take sigma as it is: they do not have the error of the model that widens the intervals"
    if not sample.is_settled:
        yield "these are too few to check the intervals: more draws, or fewer free parameters"
        return
    intervals = [_interval(p, interval) for p, interval in zip(result.parameters, sample.interval, strict=True)]
    yield columns_table({"parameter": [p.name for p in result.parameters], "95 % interval of the draws": intervals})


def _calibrated_modes(result: Calibration) -> dict[str, list[Any]]:
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


def _interval(p: CalibratedParameter, interval: tuple[float, float]) -> str:
    return " to ".join(quantity(end, p.unit, 4) for end in interval)
