"""Modes identified from measured frequency responses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Complex
from flexura.results import Tabular
from flexura.tables import Facts, Table, percent
from flexura.testing.measurement.channels import MeasuredChannel


@dataclass(frozen=True)
class ModeEvidence:
    """The confidence in one identified mode.

    `confidence` is between 0 and 1 (theory eq. I14). `frequency_scatter` and `damping_scatter` are relative standard
    deviations over the model orders (and setups) in which the pole was found. `modal_phase_collinearity` (MPC) is one
    and `mean_phase_deviation_deg` (MPD) zero for a real shape (theory eqs. I16, I17). `frequency_sigma` and
    `damping_sigma` are relative standard deviations by the misfit of the non-linear fit (theory eq. I13), zero where it
    was not made. `share` is the share of model orders that have the mode, `setups` the number of setups that do.
    `setup_shift` is the part of the scatter of frequency over setups, relative, that these do not explain: it is there
    in a repeated test, as sensors' masses in other places are (theory eq. I21). `frequency_bias` and `damping_bias` are
    how far both may be off by what is no noise, relative: leakage, modes that were not found, lines wider than the mode
    (theory eqs. I25, I26).
    """

    confidence: float
    frequency_scatter: float
    damping_scatter: float
    modal_phase_collinearity: float
    mean_phase_deviation_deg: float
    frequency_sigma: float = 0.0
    damping_sigma: float = 0.0
    share: float = 1.0
    setups: int = 1
    setup_shift: float = 0.0
    frequency_bias: float = 0.0
    damping_bias: float = 0.0

    @property
    def frequency_spread(self) -> float:
        """How far the frequency may be off, relative: the largest of scatter, noise and bias."""
        return max(self.frequency_scatter, self.frequency_sigma, self.frequency_bias)

    @property
    def damping_spread(self) -> float:
        """How far the damping ratio may be off, relative: the largest of scatter, noise and bias."""
        return max(self.damping_scatter, self.damping_sigma, self.damping_bias)


@dataclass(frozen=True)
class Poles:
    """All poles of a stabilisation diagram: model order, frequency, Hz, damping ratio, and how stable each is.

    `stable` holds the bits 1 frequency, 2 damping, 4 shape or participation.
    """

    order: NDArray[np.intp]
    frequency_hz: Array
    damping_ratio: Array
    stable: NDArray[np.intp]


@dataclass(frozen=True, repr=False)
class IdentifiedModes(Tabular):
    """Modes of a test: `poles` (n,), rad/s, ascending in frequency, with `shapes` (p, n) and `participation` (m, n).

    The residue of mode r from input j to output i is shapes[i, r] participation[j, r]. Shapes are displacements.
    `real_shapes` (p, n) are the real ones nearest to them, the largest entry positive. `scaling` says of each mode
    whether its shape has unit modal mass, which takes a driving point, or unit participation. `lower` and `upper`
    (p, m) are what modes below and above the band add, over s^2 and constant. `synthesis_error` is the relative error
    of the frequency responses that the fit gives back in the `band`, Hz. `decay`, 1/s, was taken out of the poles.
    With several setups, `setups` has the modes of each, whose frequencies differ as their sensors' masses do, and
    `poles` are weighted means.
    """

    _shown = ("name", "setup", "frequency_hz", "outputs")

    name: str
    poles: Complex
    shapes: Complex
    real_shapes: Array
    participation: Complex
    inputs: tuple[MeasuredChannel, ...]
    outputs: tuple[MeasuredChannel, ...]
    evidence: tuple[ModeEvidence, ...]
    diagram: tuple[Poles, ...]
    synthesis_error: float
    notes: tuple[str, ...] = ()
    scaling: tuple[str, ...] = ()
    lower: Array | None = None
    upper: Array | None = None
    decay: float = 0.0
    band: tuple[float, float] | None = None
    setup: str = ""
    setups: tuple[IdentifiedModes, ...] = ()

    @property
    def frequency_hz(self) -> Array:
        """Undamped natural frequencies |s| / (2 pi) (n,), Hz."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def damping_ratio(self) -> Array:
        """Damping ratios -Re s / |s| (n,)."""
        return -self.poles.real / np.abs(self.poles)

    @property
    def confidence(self) -> Array:
        """Confidence in every mode (n,), 0 to 1."""
        return np.array([e.confidence for e in self.evidence])

    def receptance(self, frequency_hz: ArrayLike) -> Complex:
        """Displacements per unit input (f, p, m) of modes and residuals, at frequencies, Hz (theory eq. I1).

        No exponential window is in it.
        """
        s = 2j * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float))
        return responses(s, self.poles, self.shapes, self.participation, self.lower, self.upper)

    def _title(self) -> str:
        return f"fits responses within {percent(self.synthesis_error)}"

    def _view(self) -> Iterator[Facts | Table]:
        own = self.evidence
        columns = {
            "mode": range(1, len(self.poles) + 1),
            "frequency [Hz]": self.frequency_hz,
            "±": [percent(e.frequency_spread) for e in own],
            "damping": [percent(float(z)) for z in self.damping_ratio],
            "± of it": [percent(e.damping_spread) for e in own],
            "confidence": [f"{x:.2f}" for x in self.confidence],
            "MPC": [f"{e.modal_phase_collinearity:.3f}" for e in own],
        }
        yield Table(columns, "modes")

    def _data(self) -> dict[str, Any]:
        """Everything but diagrams."""
        return {
            "name": self.name,
            "setup": self.setup,
            "frequency_hz": self.frequency_hz,
            "angular_frequency": np.abs(self.poles),
            "damping_ratio": self.damping_ratio,
            "shapes": self.shapes,
            "real_shapes": self.real_shapes,
            "participation": self.participation,
            "scaling": self.scaling,
            "inputs": self.inputs,
            "outputs": self.outputs,
            "evidence": self.evidence,
            "synthesis_error": self.synthesis_error,
            "setups": self.setups,
        }

    def _columns(self) -> dict[str, Any]:
        return {
            "mode": np.arange(1, len(self.poles) + 1),
            "frequency [Hz]": self.frequency_hz,
            "damping ratio": self.damping_ratio,
            "confidence": self.confidence,
            "frequency spread": [e.frequency_spread for e in self.evidence],
            "damping spread": [e.damping_spread for e in self.evidence],
            "modal phase collinearity": [e.modal_phase_collinearity for e in self.evidence],
            "mean phase deviation [deg]": [e.mean_phase_deviation_deg for e in self.evidence],
        }


def responses(
    s: Complex,
    poles: Complex,
    shapes: Complex,
    participation: Complex,
    lower: Array | None = None,
    upper: Array | None = None,
) -> Complex:
    """Displacements per unit input (f, p, m) at s (f,), 1/s, from modes and residuals (theory eq. I1)."""
    q = np.concatenate([1 / (s[:, None] - poles), 1 / (s[:, None] - poles.conj())], axis=1)
    left, right = (np.concatenate([x, x.conj()], axis=1) for x in (shapes, participation))
    H = np.einsum("fr,pr,mr->fpm", q, left, right, optimize=True)
    if upper is not None:
        H = H + upper
    return H if lower is None else H + lower / s[:, None, None] ** 2


Setups = tuple[tuple[str, tuple[MeasuredChannel, ...]], ...]


def setups_of(data: IdentifiedModes) -> Setups:
    """Names and outputs of the setups in which modes were measured."""
    return tuple((one.setup, one.outputs) for one in data.setups or (data,))
