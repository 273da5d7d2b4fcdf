"""A part to be coupled: its responses, measured or computed, as one matrix of receptances, with the noise in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flexura.analysis import FrequencyResponse
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError
from flexura.structure import DERIVATIVE, Channel
from flexura.tables import ends, in_hz, percent
from flexura.testing.measurement import (
    MeasuredChannel,
    MeasuredFRF,
    Measurement,
    estimate_frf,
    filled,
    key_of,
    refuse_infinite,
    refuse_other_lines,
)

Responses = Measurement | MeasuredFRF | FrequencyResponse | Sequence[MeasuredFRF]
"""What a part may be given as."""

SAME_LINE = 1e-6
"""Lines that differ by less, relative, are one: files have six digits."""

LEAST_COHERENCE = 1e-3
"""Coherence below which the scatter of a response grows no more."""

MOST_CURVED = 0.01
"""Error of straight lines between lines, over the root mean square of a response, that is told."""


@dataclass(frozen=True)
class Scatter:
    """The standard deviations `sigma` (f, p, m) of complex responses, independent of each other, and the `rows` (n, p)
    and `columns` (m, k) by which they become those of a part, as at virtual points; None where they are its own."""

    sigma: Array
    rows: Array | None = None
    columns: Array | None = None

    def spread(self, left: NDArray[Any], right: NDArray[Any]) -> Array:
        """Variances (f, q, r) of left (f, q, n) H right (f, k, r), to first order (theory eq. H20)."""
        left = left if self.rows is None else left @ self.rows
        right = right if self.columns is None else self.columns @ right
        return np.asarray(np.abs(left) ** 2 @ self.sigma**2 @ np.abs(right) ** 2)


@dataclass(frozen=True, repr=False)
class ScatteredResponse(FrequencyResponse):
    """A frequency response that knows the `scatter` of its values, None where no noise is known, all motions being
    displacements in it; `decay`, 1/s, is what an exponential window has added to its parts."""

    scatter: Scatter | None = field(default=None, repr=False)
    decay: float = 0.0

    @property
    def sigma(self) -> Array | None:
        """Standard deviations (f, p, m) of the complex values, of which real and imaginary part have a half of the
        variance each; None where no noise is known."""
        if self.scatter is None:
            return None
        p, m = self.response.shape[1:]
        size = np.abs(laplace(self.frequency_hz, self.decay))[:, None, None] ** powers_of(self.outputs)[:, None]
        return np.sqrt(self.scatter.spread(np.eye(p)[None], np.eye(m)[None])) * size


def as_measured(response: ScatteredResponse) -> MeasuredFRF:
    """The response as one of a test, for files of measured data and for `identify`."""
    inputs, outputs = (
        tuple(MeasuredChannel(c.name, c.quantity, c.node, c.direction, c.position) for c in channels)
        for channels in (response.inputs, response.outputs)
    )
    return MeasuredFRF(
        response.frequency_hz, response.response, inputs, outputs, decay=response.decay, sigma=response.sigma
    )


@dataclass(frozen=True)
class Part:
    """Receptances Y (f, p, m) of a part at s (f,), 1/s: its `outputs` of motions are all displacements in it.

    `scatter` is in the same receptances; `decay`, 1/s, is what an exponential window has added.
    """

    name: str
    frequency_hz: Array
    s: Complex
    Y: Complex
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    scatter: Scatter | None
    decay: float = 0.0
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()


def laplace(hz: Array, decay: float) -> Complex:
    """s (f,), 1/s, at which responses are known that an exponential window has damped."""
    return np.asarray(2j * np.pi * hz + decay, dtype=np.complex128)


def powers_of(outputs: Sequence[Channel]) -> Array:
    """By how many powers of s each output is above a displacement (p,); none for what is no motion."""
    return np.array([DERIVATIVE.get(c.quantity, 0) for c in outputs], dtype=float)


ReadAs = Literal["receptance", "mobility", "accelerance"]
"""What motions may be read as, by their power of s."""


def read_alike(part: Part) -> ReadAs:
    """What most motions of a part are read as."""
    powers = [DERIVATIVE[c.quantity] for c in part.outputs if c.quantity in DERIVATIVE]
    return get_args(ReadAs)[max(set(powers), key=powers.count, default=0)]


def is_turning(quantity: str) -> bool:
    """Whether a motion or a load turns."""
    return quantity in ("rotation", "angular_velocity", "angular_acceleration", "moment")


def motion(power: int, turns: bool) -> str:
    """The quantity of a motion, so many powers of s above a displacement or a rotation."""
    return next(name for name, order in DERIVATIVE.items() if order == power and is_turning(name) == turns)


def part_of(name: str, data: Responses, noise: float | None = None) -> Part:
    """The part of this name. `noise` is the standard deviation of every response over its root mean square.

    Without it the scatter is that of the coherence (theory eq. H21), where the number of averages is known. Raises
    OptionError for responses that are missing, given twice or not finite, and for two channels of one name.
    """
    response = data if isinstance(data, FrequencyResponse) else _measured(name, data)
    hz, H = response.frequency_hz, response.response
    refuse_infinite(H, response.inputs, response.outputs, hz, f"{name}: ")
    _refuse_twice(name, response)
    moving = hz > 0
    if not moving.any():
        raise OptionError(f"{name}: there is no line above 0 Hz")
    decay = response.decay if isinstance(response, MeasuredFRF | ScatteredResponse) else 0.0
    s = laplace(hz[moving], decay)
    scale = s[:, None, None] ** -powers_of(response.outputs)[:, None]
    Y = H[moving] * scale
    notes = [f"{name}: {note}" for note in response.notes]
    notes += [] if moving.all() else [f"{name}: the line at 0 Hz is left out"]
    return Part(
        *(name, hz[moving], s, Y, response.inputs, response.outputs),
        _scatter_of(name, response, moving, np.abs(scale), noise),
        *(decay, tuple(notes), response.warnings),
    )


def _scatter_of(
    name: str, response: FrequencyResponse | MeasuredFRF, lines: NDArray[np.bool_], scale: Array, noise: float | None
) -> Scatter | None:
    """The scatter of receptances: by the noise that is given, else as it is known."""
    if noise is not None:
        if not 0 <= noise < 1:
            raise OptionError(f"{name}: noise is a share of the responses, at least 0 and below 1, not {noise:g}")
        H = response.response[lines]
        return Scatter(noise * np.sqrt((np.abs(H) ** 2).mean(axis=0)) * scale)
    if isinstance(response, ScatteredResponse):
        return response.scatter
    if isinstance(response, MeasuredFRF) and response.sigma is not None:
        return Scatter(response.sigma[lines] * scale)
    if isinstance(response, FrequencyResponse) or response.coherence is None or (response.averages or 0) < 2:
        return None
    coherence = np.clip(np.nan_to_num(response.coherence), LEAST_COHERENCE, 1.0)
    sigma = np.abs(response.response) * np.sqrt((1 - coherence) / ((response.averages or 0) * coherence))
    return Scatter(sigma[lines] * scale)


def _refuse_twice(name: str, response: FrequencyResponse | MeasuredFRF) -> None:
    """Raise OptionError for two inputs, or two outputs, of one name."""
    for what, channels in (("output", response.outputs), ("input", response.inputs)):
        names = [c.name for c in channels]
        twice = next((n for n in names if names.count(n) > 1), None)
        if twice is not None:
            raise OptionError(f"{name}: two {what}s are called {twice!r}; rename one of them")


def _measured(name: str, data: Measurement | MeasuredFRF | Sequence[MeasuredFRF]) -> MeasuredFRF:
    """All responses of a measurement as one matrix, of as many averages as the fewest have."""
    if isinstance(data, Measurement):
        frfs: Sequence[MeasuredFRF] = data.frfs if data.frfs or not data.recordings else estimate_frf(data)
    else:
        frfs = [data] if isinstance(data, MeasuredFRF) else list(data)
    if not frfs:
        raise OptionError(f"{name}: there is no frequency response in the data")
    where = f"{name}: "
    refuse_other_lines(frfs, where)
    inputs = {key_of(c): c for frf in frfs for c in frf.inputs}
    outputs = {key_of(c): c for frf in frfs for c in frf.outputs}
    H, coherence, sigma = filled(frfs, inputs, outputs, where)
    known = all(frf.coherence is not None for frf in frfs)
    return replace(
        frfs[0],
        response=H,
        sigma=sigma,
        inputs=tuple(inputs.values()),
        outputs=tuple(outputs.values()),
        coherence=coherence if known else None,
        averages=min((frf.averages or 0 for frf in frfs), default=0),
        notes=tuple(dict.fromkeys(note for frf in frfs for note in frf.notes)),
    )


def on_the_same_lines(parts: Sequence[Part], interpolate: bool) -> list[Part]:
    """The parts at one set of lines, those of the first part within all others, if they are to be interpolated.

    Raises OptionError for lines that differ where they are not, and for bands without a line in common.
    """
    first = parts[0]
    if all(_same(first.frequency_hz, part.frequency_hz) for part in parts):
        return list(parts)
    other = next(part for part in parts if not _same(first.frequency_hz, part.frequency_hz))
    spans = "; ".join(f"{own.name}: {_span(own)}" for own in (first, other))
    low, high = max(own.frequency_hz[0] for own in parts), min(own.frequency_hz[-1] for own in parts)
    kept = (first.frequency_hz >= low * (1 - SAME_LINE)) & (first.frequency_hz <= high * (1 + SAME_LINE))
    if not kept.any():
        raise OptionError(f"the bands of the parts have no line in common: {spans}")
    if not interpolate:
        raise OptionError(
            f"the parts have different lines: {spans}; compute a described part at those of the measured one"
            " (frequency_hz), or give interpolate=True"
        )
    return [_at(part, first.frequency_hz[kept]) for part in parts]


def _same(a: Array, b: Array) -> bool:
    return len(a) == len(b) and bool(np.allclose(a, b, rtol=SAME_LINE, atol=0))


def _span(part: Part) -> str:
    hz = part.frequency_hz
    return f"{len(hz)} from {ends((float(hz[0]), float(hz[-1])), 'Hz', 6)}"


def _at(part: Part, hz: Array) -> Part:
    """A part between its lines, by straight lines, with what these may be off (theory eq. H23)."""
    own = part.frequency_hz
    if _same(own, hz):
        return part
    right = np.clip(np.searchsorted(own, hz), 1, len(own) - 1) if len(own) > 1 else np.zeros(len(hz), dtype=int)
    left = np.maximum(right - 1, 0)
    step = own[right] - own[left]
    share = np.clip(np.where(step > 0, (hz - own[left]) / np.where(step > 0, step, 1.0), 0.0), 0.0, 1.0)[:, None, None]
    Y = part.Y[left] * (1 - share) + part.Y[right] * share
    off = _curvature(part.Y)
    apart = in_hz(float(np.median(np.diff(own))) if len(own) > 1 else 0.0, 3)
    note = f"{part.name} is interpolated by straight lines between lines {apart} apart"
    warnings = part.warnings
    if off > MOST_CURVED:
        text = f"{note}: responses bend by up to {percent(off)} of their size from line to line; take finer lines"
        warnings = (*warnings, Diagnostic("lines", part.name, off, MOST_CURVED, "1", text))
    scatter = part.scatter
    if scatter is not None:
        sigma = np.sqrt((scatter.sigma[left] * (1 - share)) ** 2 + (scatter.sigma[right] * share) ** 2)
        scatter = replace(scatter, sigma=sigma)
    changed = {"Y": Y, "scatter": scatter, "notes": (*part.notes, note), "warnings": warnings}
    return replace(part, frequency_hz=hz, s=laplace(hz, part.decay), **changed)


def _curvature(Y: Complex) -> float:
    """The largest error of a straight line between three lines, over the root mean square of its response."""
    if len(Y) < 3:
        return np.inf
    size = np.sqrt((np.abs(Y) ** 2).mean(axis=0))
    bend = np.abs(Y[2:] - 2 * Y[1:-1] + Y[:-2]).max(axis=0) / 8
    return float((bend / np.where(size > 0, size, 1.0)).max())
