"""What a state space lacks of its mechanism in the band that it is for: modes left out, and damping made viscous."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexura.errors import Exceeded, OptionError, SolverError
from flexura.linalg import leading
from flexura.systems.channel import Channel
from flexura.systems.modal import ModalSystem
from flexura.systems.remainder import neglected_bound

if TYPE_CHECKING:
    from flexura.systems.state_space import StateSpace

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

WORTH = 0.01
"""Share of a channel's largest response that may be neglected without a warning."""

FAINT = 0.01
"""Least size of a channel beside what it would reach if all modes added up: one that responds with less, as across a
symmetry, is held against so much."""

POINTS = 60
"""Frequencies at which a band is looked at, beside those at resonances."""

DECADES = 2.0
"""Decades of frequency below the highest of a band that are looked at where it has no lowest."""

BESIDE = np.array([-0.3, -0.1, -0.03, -0.01, 0.01, 0.03, 0.1, 0.3])
"""Relative distances from resonances without damping that are looked at."""

WIDTHS = np.array([-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0])
"""Distances from damped resonances that are looked at, in half-power widths."""

BARE = 1e-9
"""Damping ratio below which there is none."""

PRECISION = 1e-7
"""Relative round-off of natural frequencies, which moves a response by so much over the damping ratio."""


@dataclass(frozen=True)
class Neglected:
    """Bound (f, p, m) on what a model lacks of the responses of its mechanism at `frequency_hz` (f,), over its band.

    What first-order inertia and damping of the modes left out would add is worked out, with what damping that was made
    viscous and balanced truncation change, and what is left of these modes is bounded (theory eq. T28). `scale` (p, m)
    is the size of every channel: its largest response in the band, and at least 1 % of what modes could add up to.
    """

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
        top = f"{self.band[1]:.5g} Hz"
        if not np.isfinite(self.share):
            said = f"what is left out of {self.worst} has no bound up to {top}"
        else:
            said = f"at most {rounded_up(self.share, 2)} of the largest responses is left out up to {top}"
        if self.share <= WORTH:
            return said
        said += f", most of {self.worst}" if np.isfinite(self.share) else ""
        limit = f"up to {self.holds_up_to:.4g} Hz" if self.holds_up_to else "at no frequency"
        return f"{said}; no more than {WORTH:g} {limit}"

    @property
    def warnings(self) -> tuple[Exceeded, ...]:
        """One, when more than 1 % of a channel is left out."""
        if self.share <= WORTH:
            return ()
        advice = "keep more modes, add residual modes, or state the band that it is for"
        return (Exceeded("tolerance", self.worst, self.share, WORTH, "1", f"{self.text}: {advice}"),)

    def selected(self, inputs: list[int], outputs: list[int]) -> Neglected:
        """With some of the inputs and outputs, by position."""
        at = np.ix_(range(len(self.frequency_hz)), outputs, inputs)
        ends = tuple(self.inputs[k] for k in inputs), tuple(self.outputs[k] for k in outputs)
        return replace(self, bound=self.bound[at], scale=self.scale[at[1:]][0], inputs=ends[0], outputs=ends[1])

    def to_dict(self) -> dict[str, Any]:
        """Plain data; infinite numbers as None."""
        shares = [[float(x) if np.isfinite(x) else None for x in row] for row in self.shares]
        return {"band_hz": list(self.band), "shares": shares, "holds_up_to_hz": self.holds_up_to, "text": self.text}


def channel_scale(modes: ModalSystem, hz: Array, H: Complex) -> Array:
    """Sizes (p, m) of channels with responses H (f, p, m) at frequencies hz (f,): their largest response, and at least
    1 % of what input and output would reach if all modes added up (theory eq. T28); infinite where nothing responds."""
    w, rest = 2 * np.pi * hz, modes.remainder
    Z = modes.omega**2 - w[:, None] ** 2 + 2j * modes.total_ratios * modes.omega * w[:, None]
    ends = []
    for k, shares in enumerate((modes.B, modes.C.T)):
        with np.errstate(divide="ignore"):
            own = (1 / np.abs(Z)) @ shares**2
        ends.append(own if rest is None else own + rest.stiff.diagonal()[rest.places[k]])
    coherent = np.sqrt(ends[1][:, :, None] * ends[0][:, None, :]) * w[:, None, None] ** modes.derivative[:, None]
    coherent = np.where(np.isfinite(coherent), coherent, 0.0)
    scale = np.maximum(np.abs(H).max(axis=0), FAINT * coherent.max(axis=0))
    return np.where(scale > 0, scale, np.inf)


def rounded_up(bound: float, digits: int = 3) -> str:
    """A bound to a few digits that are not below it."""
    if not (np.isfinite(bound) and bound > 0):
        return f"{bound:g}"
    digit = 10.0 ** (np.floor(np.log10(bound)) - digits + 1)
    return f"{np.ceil(bound / digit * (1 - 1e-12)) * digit:.{digits}g}"


def neglected(modes: ModalSystem, model: StateSpace, band: tuple[float, float] | None) -> Neglected | None:
    """What a continuous `model` lacks of `modes`, of which it was made, over a band (from, to), Hz.

    By default up to the highest mode kept; None without a band where no mode is left out, and where there is no mode or
    no channel. Infinite for what floats. Raises OptionError for impossible bands.
    """
    if band is not None and not (np.isfinite(band[1]) and 0 <= band[0] < band[1]):
        raise OptionError(f"a band is two frequencies in Hz, 0 <= from < to, not {band[0]:g}, {band[1]:g}")
    if not modes.order or not model.D.size or (band is None and not np.isfinite(modes.next_omega)):
        return None
    hz = _frequencies(modes, band or (0.0, float(modes.frequency_hz[-1])))
    H = modes.response(hz)
    plain = replace(model, delay=0.0).frequency_response(hz)
    try:
        bound = neglected_bound(modes, hz) * (2 * np.pi * hz)[:, None, None] ** modes.derivative[:, None]
    except SolverError:
        bound = np.full(H.shape, np.inf)
    scale = channel_scale(modes, hz, H)
    sharpest = np.where(modes.total_ratios < BARE, np.abs(BESIDE).min(), modes.total_ratios).min()
    moved = PRECISION / float(sharpest) * np.where(scale < np.inf, scale, 0.0)
    return Neglected(hz, bound + np.abs(H - plain) + moved, scale, modes.inputs, modes.outputs)


def _frequencies(modes: ModalSystem, band: tuple[float, float]) -> Array:
    """Frequencies over a band, Hz, more of them around resonances, and none at those that nothing damps."""
    low, high = band
    found = [np.geomspace(low or high / 10**DECADES, high, POINTS)]
    bare = np.zeros(0)
    own = (modes.frequency_hz > 0) & (modes.frequency_hz < 1.5 * high)
    for f, zeta in zip(modes.frequency_hz[own], modes.total_ratios[own], strict=True):
        if zeta < BARE:
            bare = np.append(bare, f)
            found.append(f * (1 + BESIDE))
        else:
            found.append(f * (1 + zeta * WIDTHS))
    hz = np.unique(np.concatenate(found))
    hz = hz[(hz >= found[0][0]) & (hz <= high)]
    near = np.abs(hz[:, None] / bare - 1).min(axis=1, initial=np.inf) < 0.99 * np.abs(BESIDE).min()
    kept = hz[~near]
    return kept if len(kept) else high * np.array([1 - 1e-3])
