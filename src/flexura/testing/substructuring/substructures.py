"""Parts coupled to an assembly, and taken out of one, by their frequency responses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, OptionError, SolverError
from flexura.structure import DERIVATIVE, Channel, channel_positions
from flexura.tables import Facts, Item, Table, counted, ends, in_hz, number, percent
from flexura.testing.substructuring.coupling import Block, Coupled, coupled
from flexura.testing.substructuring.joins import GROUND, Connection, Joins, connections_of, interface_of
from flexura.testing.substructuring.parts import (
    Part,
    ReadAs,
    Responses,
    Scatter,
    ScatteredResponse,
    is_turning,
    laplace,
    motion,
    on_the_same_lines,
    part_of,
    powers_of,
)

ILL_CONDITIONED = 1e9
"""Condition of interface receptances from which round-off is seen in the sixth digit."""

MOST_DISTURBED = 1 / 3
"""Noise in the interface receptances over their smallest singular value from which scatter is not of first order."""

ALIKE = 0.1
"""Part of the largest share in a direction of singular receptances from which a join is named."""

MOST_PAIRS = 12
"""Pairs of channels that are listed."""


@dataclass(frozen=True, repr=False)
class CoupledResponse(ScatteredResponse):
    """The frequency response of parts that were coupled, or of one from which a part was taken.

    By frequency (f,): the `condition` of the interface receptances, dimensionless, and their `rank`, how many of the
    `joins` they tell apart. `sigma` (f, p, m) is the scatter by the noise of the parts, to first order, and
    `amplification` (f,) how much more that is, over the responses, than in the noisiest part; None where no noise is
    known.
    """

    _shown = ("name", "frequency_hz", "inputs", "outputs", "joins")

    joins: tuple[str, ...] = ()
    condition: Array = field(default_factory=lambda: np.zeros(0))
    rank: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    amplification: Array | None = None

    def _title(self) -> str:
        p, m, hz = len(self.outputs), len(self.inputs), self.frequency_hz
        joined = counted(len(self.joins), "joined DOF")
        return f"{p} x {m} responses at {counted(len(hz), 'frequency')}, {ends((hz[0], hz[-1]), 'Hz')}, {joined}"

    def presentation(self) -> Iterator[Item]:
        """The joins, how well they are conditioned, what becomes of noise, and the pairs."""
        hz, worst = self.frequency_hz, int(self.condition.argmax())
        facts = {
            "joined": ", ".join(self.joins),
            "condition of the interface": f"median {np.median(self.condition):.3g}, at most "
            f"{self.condition[worst]:.3g} at {in_hz(float(hz[worst]))}",
        }
        sigma = self.sigma
        if sigma is None or self.amplification is None:
            facts["scatter"] = "not known: no noise and no coherence with averages"
        else:
            share = _share(sigma, self.response)
            most = int(self.amplification.argmax())
            facts["scatter"] = f"median {percent(float(np.median(share)))} of the responses"
            largest = f"{self.amplification[most]:.3g} at {in_hz(float(hz[most]))}"
            facts["noise of the parts times"] = f"{np.median(self.amplification):.3g}, at most {largest}"
        yield Facts(facts)
        yield Table(self.gain_columns(), "pairs", most=MOST_PAIRS)

    def _data(self) -> dict[str, Any]:
        own = {"joins": self.joins, "condition": self.condition, "rank": self.rank, "amplification": self.amplification}
        return {**super()._data(), "sigma": self.sigma, **own}


@verb
def couple(
    parts: Mapping[str, Responses],
    *,
    joins: Joins,
    quantity: ReadAs | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    noise: Mapping[str, float] | None = None,
    interpolate: bool = False,
    tolerance: float | None = None,
) -> CoupledResponse:
    """Parts coupled to one assembly by their frequency responses, measured or computed (theory eqs. H16-H23).

    `parts` by name; `joins` are pairs of channels `PART.CHANNEL`, of points `PART.POINT` with DOFs tx to rz, or `Join`,
    with `ground` where a part is held. A channel that is joined is read and is excited: its input has its name, or is
    at its place along its line. Channels are `PART.CHANNEL` in the result; of two that are rigidly one, the first.
    `inputs` and `outputs` choose some, wildcards allowed; `quantity` reads all motions alike.

    `noise` by part, over the root mean square of every response, or else the coherence of measured parts, becomes
    `sigma`. Lines that differ are refused unless they are to be interpolated. Interface receptances are inverted
    without singular values below `tolerance`, relative to the largest.

    Raises OptionError for unknown parts and channels, joins of motions that differ, and lines that differ; SolverError
    where joins cannot be told apart.
    """
    listed = _listed(parts, noise, interpolate)
    connections = connections_of(listed, joins, prefixed=True)
    ends = [c.second for c in connections if c.second is not None and c.is_rigid]
    all_outputs = [_prefixed(part, c) for part in listed for c in part.outputs]
    all_inputs = [_prefixed(part, c) for part in listed for c in part.inputs]
    rows = _chosen(all_outputs, outputs, _among(listed, [(end.part, end.output) for end in ends], "outputs"))
    columns = _chosen(all_inputs, inputs, _among(listed, [(end.part, end.input) for end in ends], "inputs"))
    coupling = Coupling(listed, [1.0] * len(listed), connections, rows, columns)
    sides = tuple(all_inputs[j] for j in columns), tuple(all_outputs[i] for i in rows)
    return coupling.result(" + ".join(parts), *sides, quantity, tolerance)


@verb
def decouple(
    whole: Responses,
    part: Responses,
    *,
    joins: Joins,
    quantity: ReadAs | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    noise: Mapping[str, float] | None = None,
    interpolate: bool = False,
    tolerance: float | None = None,
) -> CoupledResponse:
    """What is left of a whole when a part of it is taken out, by their frequency responses (theory eq. H19).

    `joins` are pairs of a channel, or a point, of the whole and of the part, without names of parts before them: those
    of the interface, and more inside the part where both have been measured there (extended interface), which then
    takes a `tolerance`. With the stiffness of a `Join` the joint is taken out, too. The result has the channels of
    the whole, of which those inside the part mean nothing any more. All else is as in `couple`; `noise` is that of
    `whole` and `part`.

    Raises OptionError and SolverError as `couple` does.
    """
    listed = _listed({"whole": whole, "part": part}, noise, interpolate)
    own = listed[0]
    rows, columns = _chosen(own.outputs, outputs, set()), _chosen(own.inputs, inputs, set())
    coupling = Coupling(listed, [1.0, -1.0], connections_of(listed, joins, prefixed=False), rows, columns)
    sides = tuple(own.inputs[j] for j in columns), tuple(own.outputs[i] for i in rows)
    names = [getattr(data, "name", "") or title for data, title in ((whole, "whole"), (part, "part"))]
    return coupling.result(" - ".join(names), *sides, quantity, tolerance)


def _listed(parts: Mapping[str, Responses], noise: Mapping[str, float] | None, interpolate: bool) -> list[Part]:
    """The parts at one set of lines. Raises OptionError for names that are none, and for a single part."""
    if not parts:
        raise OptionError("parts: there is no part to couple")
    wrong = next((name for name in parts if not name or "." in name or name == GROUND), None)
    if wrong is not None:
        raise OptionError(f"parts: {wrong!r} is no name of a part: it has no dot and is not {GROUND!r}")
    levels = dict(noise or {})
    unknown = next((name for name in levels if name not in parts), None)
    if unknown is not None:
        raise OptionError(f"noise: there is no part {unknown!r}; parts: {', '.join(parts)}")
    listed = [part_of(name, data, levels.get(name)) for name, data in parts.items()]
    return on_the_same_lines(listed, interpolate)


def _prefixed(part: Part, channel: Channel) -> Channel:
    """A channel behind the name of its part."""
    node = None if channel.node is None else f"{part.name}.{channel.node}"
    return replace(channel, name=f"{part.name}.{channel.name}", node=node)


def _among(parts: Sequence[Part], ends: Sequence[tuple[int, int]], side: Literal["inputs", "outputs"]) -> set[int]:
    """Places among the channels of all parts."""
    first = np.cumsum([0, *(len(getattr(part, side)) for part in parts)])
    return {int(first[part]) + k for part, k in ends}


def _chosen(channels: Sequence[Channel], names: Sequence[str] | None, left_out: set[int]) -> NDArray[np.intp]:
    """Places of the channels that are asked for, else of all but some."""
    at = channel_positions(channels, names)
    return np.array([k for k in at if names is not None or k not in left_out], dtype=np.intp)


@dataclass(frozen=True)
class Coupling:
    """Parts, their signs, -1 for one that is taken out, what is joined, and which of all outputs and inputs are asked
    for."""

    parts: Sequence[Part]
    signs: Sequence[float]
    connections: Sequence[Connection]
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]

    def result(
        self,
        name: str,
        inputs: tuple[Channel, ...],
        outputs: tuple[Channel, ...],
        quantity: ReadAs | None,
        tolerance: float | None,
    ) -> CoupledResponse:
        """The response at these inputs and outputs, with what is to be told of it."""
        if quantity is not None and quantity not in get_args(ReadAs):
            raise OptionError(f"quantity is one of {', '.join(get_args(ReadAs))}, not {quantity!r}")
        if tolerance is not None and not 0 <= tolerance < 1:
            raise OptionError(f"tolerance is a share of the largest singular value, below 1, not {tolerance:g}")
        blocks = [Block(p.Y, sign, p.scatter) for p, sign in zip(self.parts, self.signs, strict=True)]
        interface = interface_of(self.parts, self.connections, min(self.signs))
        found = coupled(blocks, interface, self.rows, self.columns, tolerance)
        if tolerance is None:
            self._refuse_singular(found)
        read = tuple(_read_as(c, quantity) for c in outputs)
        hz, decay = self.parts[0].frequency_hz, max(part.decay for part in self.parts)
        response = found.Y * laplace(hz, decay)[:, None, None] ** powers_of(read)[:, None]
        notes = dict.fromkeys(note for part in self.parts for note in part.notes)
        known = dict.fromkeys(warning for part in self.parts for warning in part.warnings)
        return CoupledResponse(
            *(name, hz, response, inputs, read, np.zeros(0), np.zeros(0), 0),
            notes=(*notes, *self._notes(found)),
            known=(*known, *self._window(), *self._limits(found, tolerance is not None)),
            scatter=None if found.sigma is None else Scatter(found.sigma),
            decay=decay,
            joins=tuple(c.text for c in self.connections),
            condition=found.condition,
            rank=found.rank,
            amplification=self._amplification(found),
        )

    def _refuse_singular(self, found: Coupled) -> None:
        """Raise SolverError where joins cannot be told apart at any line."""
        count = len(self.connections)
        if (found.rank == count).any():
            return
        weight = np.median(found.directions, axis=0)
        listed = ", ".join(c.text for c, w in zip(self.connections, weight, strict=True) if w > ALIKE * weight.max())
        raise SolverError(
            f"the interface receptances are singular at every line, of rank {found.rank.max()} for {count} joined DOFs:"
            f" these move as one, or not at all: {listed}; leave some out, or give a tolerance, below which singular"
            " values are left out"
        )

    def _amplification(self, found: Coupled) -> Array | None:
        """By line, the scatter over the responses of the result over that of the noisiest part."""
        if found.sigma is None:
            return None
        noisy: list[Array] = []
        for part in self.parts:
            if part.scatter is not None:
                p, m = part.Y.shape[1:]
                noisy.append(_share(np.sqrt(part.scatter.spread(np.eye(p)[None], np.eye(m)[None])), part.Y))
        before, after = np.max(noisy, axis=0), _share(found.sigma, found.Y)
        return np.divide(after, before, out=np.zeros_like(after), where=before > 0)

    def _notes(self, found: Coupled) -> Iterator[str]:
        """Parts without noise beside others, and what a tolerance has left out."""
        silent = [part.name for part in self.parts if part.scatter is None]
        if 0 < len(silent) < len(self.parts):
            yield f"taken as without noise: {', '.join(silent)}"
        least, most, count = found.rank.min(), found.rank.max(), len(self.connections)
        if least < count:
            kept = f"{least}" if least == most else f"{least} to {most}"
            yield f"of {count} joined DOFs {kept} are told apart; smaller singular values are left out"

    def _window(self) -> Iterator[Diagnostic]:
        """Damping that exponential windows have added is in the result, where nothing takes it out."""
        decays = {part.name: part.decay for part in self.parts}
        longest = max(decays, key=lambda name: decays[name])
        if decays[longest] > 0:
            each = ", ".join(f"{name} {number(decay)} 1/s" for name, decay in decays.items())
            text = f"exponential windows have added decay ({each}), which is in the responses; identify takes it out"
            text += "" if len({*decays.values()}) == 1 else "; parts that have not the same do not fit each other"
            yield Diagnostic("window", longest, decays[longest], 0.0, "1/s", text)

    def _limits(self, found: Coupled, is_asked: bool) -> Iterator[Diagnostic]:
        """Where the interface cannot be inverted well, and where noise is more than first order can tell."""
        hz, count = self.parts[0].frequency_hz, len(self.connections)
        short = np.flatnonzero(found.rank < count)
        if len(short) and not is_asked:
            least = int(found.rank.min())
            text = (
                f"the interface receptances have rank {least} for {count} joined DOFs {_at(hz, short)}: some of these"
            )
            yield Diagnostic("condition", "interface", least, count, "1", f"{text} move as one there, or not at all")
        ill = np.flatnonzero(found.condition > ILL_CONDITIONED)
        if len(ill):
            worst = float(found.condition.max())
            text = f"the interface receptances have a condition of up to {worst:.2g} {_at(hz, ill)}: round-off shows"
            yield Diagnostic("condition", "interface", worst, ILL_CONDITIONED, "1", text)
        loud = np.flatnonzero([] if found.disturbance is None else found.disturbance > MOST_DISTURBED)
        if found.disturbance is not None and len(loud):
            worst = float(found.disturbance.max())
            text = f"noise moves the inverse of the interface receptances by up to {percent(worst)} of itself"
            text += (
                f" {_at(hz, loud)}: there the result is noise, with more scatter than is told; measure the interface"
            )
            text += " better, join fewer DOFs, or give a tolerance"
            yield Diagnostic("noise", "interface", worst, MOST_DISTURBED, "1", text)


def _at(hz: Array, lines: NDArray[np.intp]) -> str:
    """Lines in words."""
    if len(lines) == len(hz):
        return "at every line"
    span = in_hz(float(hz[lines[0]])) if len(lines) == 1 else ends((float(hz[lines[0]]), float(hz[lines[-1]])), "Hz")
    return f"at {len(lines)} of {len(hz)} lines ({span})"


def _share(sigma: Array, H: Complex) -> Array:
    """By line (f,), root sums of squares of standard deviations over those of the responses, all channels on the scale
    of their largest: so a pair without a response of its own counts little, and units do not count."""
    squares = (np.abs(H) ** 2).mean(axis=0)
    scale = np.sqrt(squares.max(axis=1)[:, None] * squares.max(axis=0))
    weight = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0)
    noise, size = ((weight * np.abs(own) ** 2).sum(axis=(1, 2)) for own in (sigma, H))
    return np.sqrt(np.divide(noise, size, out=np.zeros_like(noise), where=size > 0))


def _read_as(channel: Channel, quantity: ReadAs | None) -> Channel:
    """An output as displacement, velocity or acceleration; what is no motion stays as it is."""
    if quantity is None or channel.quantity not in DERIVATIVE:
        return channel
    return replace(channel, quantity=motion(get_args(ReadAs).index(quantity), is_turning(channel.quantity)))
