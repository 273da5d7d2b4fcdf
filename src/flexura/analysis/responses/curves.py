"""Responses as curves: those of one unit that matter, equal ones as one, and their chart."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.analysis.responses.backbone import Backbone
from flexura.analysis.responses.budget import Budget
from flexura.analysis.responses.frequency_response import SILENT, FrequencyResponse
from flexura.analysis.responses.nonlinear_response import NonlinearResponse
from flexura.charts import Axis, Chart, Curve, Mark, Panel
from flexura.structure import unit_of_response
from flexura.tables import counted, in_hz, quantity

MOST_CURVES = 8
"""Curves of one unit."""

MOST_PAIRS = 100
"""Pairs, the largest ones, that are looked at for curves that are equal."""

MATTERS = 1e-3
"""Responses whose largest magnitude is a smaller share of the largest of their unit are left out."""

SAME = 1e-3
"""Responses that differ by a smaller share of the largest are one curve."""

LONGEST = 44
"""Characters of the label of a resonance."""

Pair = tuple[str, str]
"""An output and an input, by name."""


class ResponseCurve(NamedTuple):
    """A response (f,), the pairs that have it, and its unit where the curves of a group have several."""

    pairs: list[Pair]
    H: NDArray[np.complex128]
    unit: str = ""

    @property
    def label(self) -> str:
        """The first pair, and how many are like it."""
        output, input_ = self.pairs[0]
        more = len(self.pairs) - 1
        return f"{output} / {input_}" + (f", and {more} equal" if more else "") + self.unit


class ResponseGroup(NamedTuple):
    """Responses of one unit, none where pairs of several are asked for, and what is left out."""

    unit: str
    curves: list[ResponseCurve]
    left_out: list[Pair]


def heard(result: FrequencyResponse) -> NDArray[np.bool_]:
    """Which responses (p, m) are more than the round-off of others."""
    size = np.abs(result.response).max(axis=0)
    least = np.sqrt(size.max(axis=1)[:, None] * size.max(axis=0))
    units = np.array([[unit_of_response(o, i) for i in result.inputs] for o in result.outputs])
    for unit in np.unique(units):
        of_unit = units == unit
        least[of_unit] = np.maximum(least[of_unit], size[of_unit].max())
    return size > SILENT * least


def response_units(result: FrequencyResponse) -> list[str]:
    """Units of the responses, each once."""
    return list(dict.fromkeys(unit_of_response(o, i) for o in result.outputs for i in result.inputs))


def response_group(result: FrequencyResponse, unit: str) -> ResponseGroup:
    """The responses of a unit that matter: at most eight different curves, none below a thousandth of the largest."""
    size, sounds = np.abs(result.response).max(axis=0), heard(result)
    every, peaks, wanted = list[Pair](), dict[Pair, float](), list[Pair]()
    for (i, output), (j, input_) in itertools.product(enumerate(result.outputs), enumerate(result.inputs)):
        if unit_of_response(output, input_) == unit:
            pair = (output.name, input_.name)
            every.append(pair)
            peaks[pair] = float(size[i, j])
            wanted += [pair] if sounds[i, j] else []
    largest = max(peaks.values())
    wanted = [pair for pair in wanted if peaks[pair] >= MATTERS * largest]
    curves: list[ResponseCurve] = []
    for pair in sorted(wanted, key=lambda pair: -round(peaks[pair] / largest, 6))[:MOST_PAIRS]:
        H = result.of(*pair)
        alike = next((c for c in curves if np.abs(c.H - H).max() <= SAME * peaks[pair]), None)
        if alike is not None:
            alike.pairs.append(pair)
        elif len(curves) < MOST_CURVES:
            curves.append(ResponseCurve([pair], H))
    curves = curves or [ResponseCurve(every[:1], result.of(*every[0]))]
    shown = {pair for curve in curves for pair in curve.pairs}
    return ResponseGroup(unit, curves, [pair for pair in every if pair not in shown])


def phase_in_degrees(H: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Phase of a response, unwrapped; where it is beyond a turn, moved by whole turns to where most of it is within."""
    phase = np.degrees(np.unwrap(np.angle(H)))
    shift = 360 * np.round(np.median(phase) / 360) if abs(np.median(phase)) > 360 else 0.0
    return phase - shift


def response_chart(result: FrequencyResponse, group: ResponseGroup, platform: str | None = None) -> Chart:
    """Magnitude over phase of responses of one unit, resonances marked with what moves in them; the platform without
    its name."""
    hz, frequency = result.frequency_hz, Axis("frequency", "Hz", log=True)
    marks = []
    for k, (at, words) in enumerate(
        itertools.zip_longest(result.resonances_hz, result.resonance_motions, fillvalue="")
    ):
        moves = words.partition(" (")[0].removeprefix(f"{platform} ")
        label = f"{in_hz(float(at), 4)} {moves}".strip()
        marks.append(Mark(float(at), label if len(label) <= LONGEST else f"{label[: LONGEST - 1]}…", str(k + 1)))
    magnitude = [Curve(hz, np.abs(curve.H), curve.label) for curve in group.curves]
    phase = [Curve(hz, phase_in_degrees(curve.H), curve.label) for curve in group.curves]
    resonances = ", ".join(f"{at:.4g}" for at in result.resonances_hz)
    said = f"{counted(len(magnitude), 'curve')}, {counted(len(marks), 'resonance')}"
    said += f": {resonances} Hz" if marks else ""
    panels = [
        Panel(magnitude, frequency, Axis("magnitude", group.unit, log=True), marks=marks),
        Panel(phase, frequency, Axis("phase", "deg"), marks=marks),
    ]
    return Chart("response", f"Frequency responses in {group.unit}", said, panels)


def budget_chart(result: Budget, output: int) -> Chart:
    """Amplitude density of one output, by number, under all sources, over its cumulative amplitude, that of every
    source as well."""
    channel, hz, frequency = result.outputs[output], result.frequency_hz, Axis("frequency", "Hz", log=True)
    density = Curve(hz, result.amplitude_density[:, output], "all")
    whole = Curve(hz, result.cumulative[:, output], "all")
    each = [
        Curve(hz, np.sqrt(own[:, output]), name, "dashed")
        for name, own in zip(result.sources, result.up_to, strict=True)
        if own[-1, output] > SILENT**2 * result.up_to[:, -1, output].sum()
    ]
    said = f"rms {quantity(float(result.rms[output]), channel.unit, 4)} of {counted(len(result.sources), 'source')}"
    panels = [
        Panel([density], frequency, Axis("density", f"{channel.unit}/sqrt(Hz)", log=True)),
        Panel([whole, *each], frequency, Axis("cumulative", channel.unit)),
    ]
    return Chart(f"budget-{output + 1}", f"Error budget of {channel.name}", said, panels)


def backbone_chart(result: Backbone) -> Chart:
    """The amplitude of an output over the frequency of free motions; dashed where these are unstable."""
    whole = Curve(result.frequency_hz, result.amplitude, "stable")
    panel = Panel(_by_stability(whole, result.stable), Axis("frequency", "Hz"), Axis("amplitude", result.output.unit))
    title = f"Backbone of mode {result.mode}, {result.output.name}"
    said = f"{result.kind} from {in_hz(result.linear_hz, 5)} to {in_hz(float(result.frequency_hz[-1]), 5)}"
    return Chart("backbone", title, said, [panel])


def nonlinear_response_chart(result: NonlinearResponse) -> Chart:
    """The largest value in a period of every output over the frequency; dashed where motions are unstable."""
    panels = []
    for channel, largest in zip(result.outputs, result.largest.T, strict=True):
        whole = Curve(result.frequency_hz, largest, "stable")
        curves, unit = _by_stability(whole, result.stable), channel.unit
        panels.append(Panel(curves, Axis("frequency", "Hz"), Axis("largest value", unit), channel.name))
    said = f"{counted(len(result.folds), 'fold')}"
    return Chart("nonlinear-response", f"Steady response of {result.name}", said, panels)


def _by_stability(whole: Curve, stable: NDArray[np.bool_]) -> list[Curve]:
    """The curve where it is stable, and dashed the steps at whose ends it is not."""
    broken = ~stable | np.append(False, ~stable[:-1]) | np.append(~stable[1:], False)
    curves = [replace(whole, y=np.where(stable, whole.y, np.nan))]
    if broken.any():
        curves.append(replace(whole, y=np.where(broken, whole.y, np.nan), name="unstable", line="dashed"))
    return curves
