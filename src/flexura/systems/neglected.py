"""What a state space lacks of its mechanism in the band that it is for: modes left out, and damping made viscous."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.linalg import leading
from flexura.results import Result
from flexura.systems.channel import Channel
from flexura.tables import Facts, Table, ends, in_hz, percent

if TYPE_CHECKING:
    pass


WORTH = 0.01
"""Share of a channel's largest response that may be neglected without a warning."""

FAINT = 0.01
"""Least size of a channel beside what it would reach if all modes added up: one that responds with less, as across a
symmetry, is held against so much."""


@dataclass(frozen=True, repr=False)
class Neglected(Result):
    """Bound (f, p, m) on what a model lacks of the responses of its mechanism at `frequency_hz` (f,), over its band.

    What first-order inertia and damping of the modes left out would add is worked out, with what damping that was made
    viscous and balanced truncation change, and what is left of these modes is bounded (theory eq. T28). `scale` (p, m)
    is the size of every channel: its largest response in the band, and at least 1 % of what modes could add up to.
    """

    _shown = ("text",)

    frequency_hz: Array
    bound: Array
    scale: Array
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz."""
        return float(self.frequency_hz[0]), float(self.frequency_hz[-1])

    @property
    def shares(self) -> Array:
        """The bound over the size of each channel (p, m), at its worst frequency."""
        return np.asarray((self.bound / self.scale).max(axis=0))

    @property
    def share(self) -> float:
        """The largest of the shares."""
        return float(self.shares.max(initial=0.0))

    @property
    def worst(self) -> str:
        """The pair of channels with the largest share, as `output / input`."""
        k, j = np.unravel_index(int(leading(self.shares.ravel())), self.shares.shape)
        return f"{self.outputs[k].name} / {self.inputs[j].name}"

    @property
    def holds_up_to(self) -> float:
        """Highest frequency, Hz, up to which no share is above 1 %; zero without any."""
        beyond = np.flatnonzero((self.bound / self.scale).max(axis=(1, 2)) > WORTH)
        if not len(beyond):
            return self.band[1]
        return float(self.frequency_hz[beyond[0] - 1]) if beyond[0] else 0.0

    @property
    def text(self) -> str:
        """One sentence."""
        top = in_hz(self.band[1])
        if not np.isfinite(self.share):
            said = f"what is left out of {self.worst} has no bound up to {top}"
        else:
            said = f"at most {rounded_up(self.share, 2)} of the largest responses is left out up to {top}"
        if self.share <= WORTH:
            return said
        said += f", most of {self.worst}" if np.isfinite(self.share) else ""
        limit = f"up to {in_hz(self.holds_up_to, 4)}" if self.holds_up_to else "at no frequency"
        return f"{said}; no more than {WORTH:g} {limit}"

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """One, when more than 1 % of a channel is left out."""
        if self.share <= WORTH:
            return ()
        advice = "keep more modes, add residual modes, or state the band that it is for"
        return (Diagnostic("tolerance", self.worst, self.share, WORTH, "1", f"{self.text}: {advice}"),)

    def selected(self, inputs: list[int], outputs: list[int]) -> Neglected:
        """With some of the inputs and outputs, by position."""
        at = np.ix_(range(len(self.frequency_hz)), outputs, inputs)
        ends = tuple(self.inputs[k] for k in inputs), tuple(self.outputs[k] for k in outputs)
        return replace(self, bound=self.bound[at], scale=self.scale[at[1:]][0], inputs=ends[0], outputs=ends[1])

    def _view(self) -> Iterator[Facts | Table]:
        low, high = self.band
        yield Facts(
            {
                "band": ends((low, high), "Hz", 5),
                "at most": percent(self.share),
                "of": self.worst,
                "holds up to": in_hz(self.holds_up_to),
            }
        )

    def _data(self) -> dict[str, Any]:
        return {"band_hz": self.band, "shares": self.shares, "holds_up_to_hz": self.holds_up_to, "text": self.text}


def rounded_up(bound: float, digits: int = 3) -> str:
    """A bound to a few digits that are not below it."""
    if not (np.isfinite(bound) and bound > 0):
        return f"{bound:g}"
    digit = 10.0 ** (np.floor(np.log10(bound)) - digits + 1)
    return f"{np.ceil(bound / digit * (1 - 1e-12)) * digit:.{digits}g}"
