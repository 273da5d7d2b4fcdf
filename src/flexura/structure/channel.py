"""Inputs and outputs by name, with what they are, their unit, and what inputs act along."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.mechanism import is_pattern

UNITS = {
    "force": "N",
    "moment": "N*m",
    "expansion": "m",
    "voltage": "V",
    "temperature": "K",
    "share": "1",
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "rotation": "rad",
    "angular_velocity": "rad/s",
    "angular_acceleration": "rad/s^2",
    "stress": "Pa",
}
"""SI unit of every quantity that a channel may be."""

MOST_NAMED = 4
"""Channels that a notebook names."""


@dataclass(frozen=True)
class Channel:
    """An input or an output: its name, e.g. `platform.tz` or `rpu1.piezo`, its quantity, a key of `UNITS`, and place.

    `node` is the name of the node that it acts on or reads, and `against` that of the one that it does so against, the
    first of two. `direction` (3,) is the unit vector along or about which it counts as positive, and `position` (3,)
    where the single node is, m, both in global axes. None where there is none: motion of the base has no node. Channels
    are equal when their names and quantities are.
    """

    name: str
    quantity: str
    node: str | None = field(default=None, compare=False)
    direction: tuple[float, float, float] | None = field(default=None, compare=False)
    position: tuple[float, float, float] | None = field(default=None, compare=False)
    against: str | None = field(default=None, compare=False, kw_only=True)

    @property
    def unit(self) -> str:
        """SI unit, e.g. `m/s^2`."""
        return UNITS[self.quantity]

    def __str__(self) -> str:
        return f"{self.name} [{self.unit}]"

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {**asdict(self), "unit": self.unit}


def unit_of_response(output: Channel, input: Channel) -> str:
    """Unit of an output per input, e.g. `m/N`; `1` where both have the same."""
    above, below = output.unit, input.unit
    if above == below:
        return "1"
    above = f"({above})" if "/" in above else above
    return f"{above}/({below})" if {"*", "/"} & set(below) else f"{above}/{below}"


def response_columns(
    frequency_hz: Any, response: Any, inputs: Sequence[Channel], outputs: Sequence[Channel]
) -> dict[str, Any]:
    """Columns of responses (f, p, m): frequency, then magnitude with its unit and phase of every pair."""
    columns = {"frequency [Hz]": frequency_hz}
    for i, out in enumerate(outputs):
        for j, into in enumerate(inputs):
            pair = f"{out.name} / {into.name}"
            columns[f"{pair} [{unit_of_response(out, into)}]"] = np.abs(response[:, i, j])
            columns[f"phase of {pair} [deg]"] = np.degrees(np.angle(response[:, i, j]))
    return columns


def matched(names: Iterable[str], known: Sequence[str]) -> dict[str, list[str]]:
    """Names with the known ones that each stands for: those that match its wildcards, or itself.

    Raises OptionError for a pattern that nothing matches.
    """
    matches = {}
    for name in names:
        matches[name] = [k for k in known if fnmatchcase(k, name)] if is_pattern(name) and name not in known else [name]
        if not matches[name]:
            raise OptionError(f"nothing matches {name!r}; known: {', '.join(known) or 'none'}")
    return matches


def channel_positions(channels: Sequence[Channel], names: Sequence[str] | None) -> list[int]:
    """Positions of channels by name, wildcards allowed; all for None. Raises OptionError for others."""
    known = [c.name for c in channels]
    if names is None:
        return list(range(len(known)))
    wanted = [n for matches in matched([names] if isinstance(names, str) else names, known).values() for n in matches]
    unknown = [name for name in wanted if name not in known]
    if unknown:
        raise OptionError(f"there is no channel {unknown[0]!r}; known: {', '.join(known) or 'none'}")
    return [known.index(name) for name in wanted]


def ends_of(inputs: Sequence[Channel], outputs: Sequence[Channel]) -> dict[str, str]:
    """Inputs and outputs of a model by name and unit, the first few of each."""

    def listed(channels: Sequence[Channel]) -> str:
        more = f" and {len(channels) - MOST_NAMED} more" if len(channels) > MOST_NAMED else ""
        return ", ".join(map(str, channels[:MOST_NAMED])) + more

    return {"inputs": listed(inputs), "outputs": listed(outputs)}


def wrenches_along(direction: Array, turns: bool, count: int) -> Array:
    """Forces and moments (..., k, 6) of size one along or about a direction (..., 3): on one node, or on the second of
    two and the opposite on the first."""
    none = np.zeros_like(direction)
    wrench = np.concatenate([none, direction] if turns else [direction, none], axis=-1)
    return wrench[..., None, :] if count == 1 else np.stack([-wrench, wrench], axis=-2)


class Action(NamedTuple):
    """What an input acts along: global `nodes`, one, or two of which the second moves against the first, forces and
    moments on them (..., k, 6), global axes, that work on its motion, and what it exerts of these per unit, `gain`."""

    nodes: list[int]
    wrenches: Array
    gain: Any

    def row(self, B: Array) -> Array:
        """The motion (..., n) that it works on, from the displacements B (..., k, 6, n) of its nodes."""
        along = (self.wrenches[..., None, :] @ B)[..., 0, :]
        return np.asarray(sum(along[..., k, :] for k in range(len(self.nodes))))
