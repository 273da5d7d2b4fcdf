"""Reciprocity of measured responses: how far measured pairs are from it, and responses filled by it.

A motion at i per force at j is the motion at j per force at i (Maxwell 1864), of what is linear and does not turn.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.results import Tabular
from flexura.tables import Item, Table, percent
from flexura.testing.measurement.channels import FORCES, MeasuredChannel
from flexura.testing.measurement.measurement import MeasuredFRF, Measurement, grouped
from flexura.testing.measurement.response_matrices import POWER, Key, key_of, refuse_other_lines

TURNS = ("moment", "rotation", "angular_velocity", "angular_acceleration")
"""Quantities about an axis; all others that have a reciprocal are along one."""

ALONG = ("force", "displacement", "velocity", "acceleration")

SAME_DIRECTION = 6
"""Decimals to which components of directions are the same."""

FAR = 0.05
"""Deviation from which a pair is named, where it is also beyond its scatter."""

BEYOND_SCATTER = 3.0
"""Times its scatter from which a deviation is none of noise."""

Place = tuple[Any, ...]


@dataclass(frozen=True)
class _Response:
    """A measured response: as motion of the highest order, in directions that both ends share with its reciprocal."""

    name: str
    values: Complex
    variance: Array | None
    coherence: Array | None


@dataclass(frozen=True)
class ReciprocalPair:
    """Two responses that reciprocity makes equal.

    `deviation` is the rms of their difference over that of their mean, `scatter` what noise by their coherence makes of
    it (None without coherence), `gain` the rms of the first over that of the second, negative where they have opposite
    signs, and `worst_hz` the line of the largest difference.
    """

    setup: str
    first: str
    second: str
    deviation: float
    scatter: float | None
    gain: float
    worst_hz: float

    @property
    def is_far(self) -> bool:
        """Whether the deviation is noticeable and not one of noise."""
        return self.deviation > max(FAR, BEYOND_SCATTER * (self.scatter or 0.0))


@dataclass(frozen=True, repr=False)
class Reciprocity(Tabular):
    """How far every pair of responses that are measured both ways is from reciprocity, the farthest first."""

    pairs: tuple[ReciprocalPair, ...]
    notes: tuple[str, ...] = ()

    def presentation(self) -> Iterator[Item]:
        columns = {
            "setup": [p.setup for p in self.pairs],
            "response": [p.first for p in self.pairs],
            "reciprocal": [p.second for p in self.pairs],
            "deviation": [percent(p.deviation, 3) for p in self.pairs],
            "by noise": ["" if p.scatter is None else percent(p.scatter, 2) for p in self.pairs],
            "gain": [f"{p.gain:.3f}" for p in self.pairs],
            "worst at [Hz]": [p.worst_hz for p in self.pairs],
        }
        yield Table(columns, "pairs")

    def _columns(self) -> dict[str, Any]:
        return {
            "setup": [p.setup for p in self.pairs],
            "response": [p.first for p in self.pairs],
            "reciprocal": [p.second for p in self.pairs],
            "deviation": [p.deviation for p in self.pairs],
            "scatter": [np.nan if p.scatter is None else p.scatter for p in self.pairs],
            "gain": [p.gain for p in self.pairs],
            "worst [Hz]": [p.worst_hz for p in self.pairs],
        }


Data = Measurement | MeasuredFRF | Sequence[MeasuredFRF]


@verb
def reciprocity(data: Data) -> Reciprocity:
    """How far measured responses are from reciprocity, for every pair that is measured both ways.

    Channels have one place where their position, or else their node, and their direction, or its opposite, are the
    same, and where the motion is that which the load works on. Pairs that differ by more than 5 %, and by more than
    thrice what noise makes, are named in notes, with what they hint at: opposite signs, or another sensitivity. Raises
    OptionError without responses, for lines or windows that differ within a setup, and where no pair is measured both
    ways.
    """
    pairs = [pair for setup, frfs in _setups(data).items() for pair in _pairs(setup, frfs)]
    if not pairs:
        raise OptionError(
            "no response is measured both ways: it takes sensors and forces at the same two places, with node or"
            " position, and direction, of every channel"
        )
    pairs.sort(key=lambda pair: -pair.deviation)
    return Reciprocity(tuple(pairs), tuple(map(_note, (pair for pair in pairs if pair.is_far))))


def _note(pair: ReciprocalPair) -> str:
    hint = "look for what is not linear, slips or turns, and for channels that are elsewhere than described"
    if pair.gain < 0:
        hint = "their signs are opposite: look at the directions of the channels"
    elif abs(abs(pair.gain) - 1) > pair.deviation / 2:
        hint = f"one is {max(pair.gain, 1 / pair.gain):.3g} times the other: look at sensitivities"
    where = f"setup {pair.setup!r}: " if pair.setup else ""
    return f"{where}{pair.first} and {pair.second} differ by {percent(pair.deviation, 2)}; {hint}"


@verb
def fill_reciprocal(data: Data) -> tuple[MeasuredFRF, ...]:
    """One complete response matrix for every setup, with responses that are not measured taken from their reciprocals.

    What is filled is named in `notes`, with the pairs that are measured both ways and differ. Raises OptionError as
    `reciprocity`, for responses that are given twice, and for those that are measured neither way.
    """
    return tuple(_filled(setup, frfs) for setup, frfs in _setups(data).items())


def _setups(data: Data) -> dict[str, list[MeasuredFRF]]:
    frfs = data.frfs if isinstance(data, Measurement) else [data] if isinstance(data, MeasuredFRF) else list(data)
    if not frfs:
        raise OptionError("there are no frequency responses")
    by_setup = grouped(frfs, lambda frf: frf.setup)
    for setup, own in by_setup.items():
        refuse_other_lines(own, f"setup {setup!r}: " if setup else "")
    return by_setup


def _place(channel: MeasuredChannel) -> tuple[Place, int] | None:
    """Where a channel is, and the sign of its direction there; None where that is not known."""
    kind = channel.quantity in TURNS
    if channel.direction is None or channel.location == (None, None) or channel.quantity not in (*ALONG, *TURNS):
        return None
    along = np.round(channel.direction, SAME_DIRECTION) + 0.0
    sign = -1 if along[np.flatnonzero(along)[0]] < 0 else 1
    node, position = channel.location
    return (position or node, tuple((sign * along + 0.0).tolist()), kind), sign


def _s(frf: MeasuredFRF) -> Complex:
    return np.asarray(2j * np.pi * frf.frequency_hz + frf.decay, dtype=np.complex128)


def _measured(frfs: Sequence[MeasuredFRF]) -> dict[tuple[Place, Place], _Response]:
    """Responses by the places of output and input, as accelerances along the common directions."""
    found: dict[tuple[Place, Place], _Response] = {}
    for frf in frfs:
        for (i, out), (j, into) in ((a, b) for a in enumerate(frf.outputs) for b in enumerate(frf.inputs)):
            above, below = _place(out), _place(into)
            if above is None or below is None or into.quantity not in FORCES or out.quantity in FORCES:
                continue
            size = above[1] * below[1] * _s(frf) ** (2 - POWER.get(out.quantity, 0))
            gamma = None if frf.coherence is None else frf.coherence[:, i, j]
            values = frf.response[:, i, j] * size
            variance = None
            if frf.sigma is not None:
                variance = (np.abs(size) * frf.sigma[:, i, j]) ** 2
            elif gamma is not None and frf.averages:
                variance = np.abs(values) ** 2 * (1 - gamma) / np.maximum(gamma, 1e-12) / frf.averages
            found.setdefault((above[0], below[0]), _Response(f"{out.name} / {into.name}", values, variance, gamma))
    return found


def _pairs(setup: str, frfs: Sequence[MeasuredFRF]) -> Iterator[ReciprocalPair]:
    measured = _measured(frfs)
    order = {place: k for k, place in enumerate(dict.fromkeys(place for ends in measured for place in ends))}
    for (out, into), a in measured.items():
        b = measured.get((into, out))
        if b is None or order[out] >= order[into]:
            continue
        difference, size = a.values - b.values, _power((a.values + b.values) / 2) or np.finfo(float).tiny
        is_opposite = np.vdot(a.values, b.values).real < 0
        size = max(size, _power(a.values - b.values) / 4) if is_opposite else size
        noise = None if a.variance is None or b.variance is None else float(np.sum(a.variance + b.variance))
        yield ReciprocalPair(
            setup,
            a.name,
            b.name,
            float(np.sqrt(_power(difference) / size)),
            None if noise is None else float(np.sqrt(noise / size)),
            (-1 if is_opposite else 1) * float(np.sqrt(_power(a.values) / max(_power(b.values), np.finfo(float).tiny))),
            float(frfs[0].frequency_hz[np.abs(difference).argmax()]),
        )


def _power(values: Complex) -> float:
    return float(np.sum(np.abs(values) ** 2))


def _filled(setup: str, frfs: Sequence[MeasuredFRF]) -> MeasuredFRF:
    where = f"setup {setup!r}: " if setup else ""
    outputs: dict[Key, MeasuredChannel] = {key_of(c): c for frf in frfs for c in frf.outputs}
    inputs: dict[Key, MeasuredChannel] = {key_of(c): c for frf in frfs for c in frf.inputs}
    rows, columns = list(outputs), list(inputs)
    shape = (len(frfs[0].frequency_hz), len(rows), len(columns))
    H, gamma, count = np.zeros(shape, dtype=complex), np.zeros(shape), np.zeros(shape[1:], dtype=int)
    is_known, is_scattered = (
        all(x is not None for x in each) for each in zip(*((f.coherence, f.sigma) for f in frfs), strict=True)
    )
    sigma = np.zeros(shape)
    for frf in frfs:
        at = np.ix_([rows.index(key_of(c)) for c in frf.outputs], [columns.index(key_of(c)) for c in frf.inputs])
        H[:, at[0], at[1]] = frf.response
        gamma[:, at[0], at[1]] = 1.0 if frf.coherence is None else frf.coherence
        sigma[:, at[0], at[1]] = 0.0 if frf.sigma is None else frf.sigma
        np.add.at(count, at, 1)
    if (count > 1).any():
        i, j = np.argwhere(count > 1)[0]
        raise OptionError(f"{where}{outputs[rows[i]].name} / {inputs[columns[j]].name} is given {count[i, j]} times")
    measured, filled = _measured(frfs), []
    for i, j in np.argwhere(count == 0).tolist():
        out, into = outputs[rows[i]], inputs[columns[j]]
        above, below = _place(out), _place(into)
        known = None if above is None or below is None else measured.get((below[0], above[0]))
        if known is None or above is None or below is None:
            raise OptionError(f"{where}{out.name} / {into.name} is not measured, and no reciprocal of it either")
        size = above[1] * below[1] / _s(frfs[0]) ** (2 - POWER.get(out.quantity, 0))
        H[:, i, j] = known.values * size
        sigma[:, i, j] = 0.0 if known.variance is None else np.sqrt(known.variance) * np.abs(size)
        gamma[:, i, j] = 1.0 if known.coherence is None else known.coherence
        filled.append(f"{out.name} / {into.name} from {known.name}")
    notes = [note for frf in frfs for note in frf.notes]
    notes += [f"by reciprocity: {', '.join(filled)}"] if filled else []
    notes += [_note(pair) for pair in _pairs(setup, frfs) if pair.is_far]
    counts, estimators = [frf.averages for frf in frfs if frf.averages], {frf.estimator for frf in frfs}
    return MeasuredFRF(
        frfs[0].frequency_hz,
        H,
        tuple(inputs.values()),
        tuple(outputs.values()),
        gamma if is_known else None,
        min(counts) if counts else None,
        estimators.pop() if len(estimators) == 1 else "",
        frfs[0].decay,
        setup,
        tuple(dict.fromkeys(notes)),
        sigma=sigma if is_scattered else None,
    )
