"""What a calibration is to meet: frequencies, shapes and responses, as weighted residuals with derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs
from flexura.modal import pair_modes
from flexura.sensitivity import Change, Cluster, Reader, clusters, modal_response
from flexura.systems import DERIVATIVE
from flexura.testing.measurement import IdentifiedModes, MeasuredChannel, MeasuredFRF, Measurement, Setups, setups_of
from flexura.testing.updating.frequency_list import MeasuredFrequencies

COHERENT = 0.5
"""Points of a frequency response with less coherence are left out."""

SILENT = 1e-3
"""Responses that stay below so much of the largest of their row and column are noise: symmetry makes them zero."""

MOST_POINTS = 240
"""Points of one frequency response that are compared, evenly chosen."""


@dataclass
class State:
    """The model at one design: modes, what the channels read of them (o, n), and derivatives where asked for.

    `moved` are the clusters of repeated frequencies, `changes` those of the vectors and of the static ones G after
    them.
    """

    family: Reader
    at: dict[str, float]
    pairs: Eigenpairs
    Y: Array
    tracked: NDArray[np.intp]
    G: Array
    moved: Sequence[Cluster]
    changes: Sequence[Change]

    @property
    def frequency_hz(self) -> Array:
        """Natural frequencies (n,), Hz."""
        return np.sqrt(np.maximum(self.pairs.values, 0.0)) / (2 * np.pi)


@dataclass(frozen=True)
class ModalTarget:
    """Frequencies (k,), Hz, with relative standard deviations `sigma` (k,), and shapes (p, k) at channels or None.

    `setups` have the names and the outputs of the setups in which they were measured; `number` (k,) counts modes
    without shapes from 1.
    """

    frequency_hz: Array
    sigma: Array
    shapes: Array | None
    channels: tuple[MeasuredChannel, ...]
    shape_sigma: float
    name: str = ""
    setups: Setups = ()
    number: tuple[int, ...] = ()

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers (k,) of the modes."""
        return self.number or tuple(range(1, len(self.frequency_hz) + 1))

    def partner(self, state: State, rows: slice) -> NDArray[np.intp]:
        """The model's mode (k,) for every measured one: by shape where there are shapes, else as tracked."""
        tracked = state.tracked[np.array(self.numbers) - 1]
        if self.shapes is None:
            return tracked
        found = pair_modes(
            self.frequency_hz, self.shapes, model_hz=state.frequency_hz, model_shapes=state.Y[rows]
        ).partner
        return np.where(found >= 0, found, tracked)

    def residual(self, state: State, rows: slice) -> Array:
        """ln(f/f_measured)/sigma, and what is left of every shape (theory eqs. K13-K14)."""
        partner = self.partner(state, rows)
        parts = [np.log(np.maximum(state.frequency_hz[partner], 1e-12) / self.frequency_hz) / self.sigma]
        if self.shapes is not None:
            parts += [self._left(state, rows, k, m)[0] for k, m in enumerate(partner)]
        return np.concatenate(parts)

    def jacobian(self, state: State, rows: slice) -> Array:
        """Derivatives (r, P) of the residual."""
        partner, P = self.partner(state, rows), len(state.changes)
        slope = np.zeros((len(partner), P))
        for cluster in state.moved:
            for k, mode in enumerate(partner):
                if mode in cluster.at:
                    j = cluster.at.index(mode)
                    slope[k] = cluster.slope[:, j, j] / (2 * max(cluster.value, 1e-300) * self.sigma[k])
        parts = [slope]
        if self.shapes is not None:
            parts += [self._left_slope(state, rows, k, m) for k, m in enumerate(partner)]
        return np.concatenate(parts)

    def _left(self, state: State, rows: slice, k: int, mode: int) -> tuple[Array, Array, Array, Array]:
        """(psi - Y Y+ psi)/(|psi| sigma) (p,) of a shape in the space of a mode's cluster; and Y, Y+, psi."""
        assert self.shapes is not None
        at = next(g for g in clusters(state.pairs.values) if mode in g)
        psi = self.shapes[:, k] / float(np.linalg.norm(self.shapes[:, k]))
        Y = state.Y[rows][:, at]
        inverse: Array = np.asarray(np.linalg.pinv(Y), dtype=np.float64)
        return (psi - Y @ (inverse @ psi)) / self.shape_sigma, Y, inverse, psi

    def _left_slope(self, state: State, rows: slice, k: int, mode: int) -> Array:
        left, Y, inverse, psi = self._left(state, rows, k, mode)
        cluster = next(c for c in state.moved if mode in c.at)
        found = np.empty((len(left), len(state.changes)))
        for q, own in enumerate(state.changes):
            dY = own.Y[rows][:, cluster.at] + state.family.readings(state.at, cluster.outer[q])[rows]
            across = dY @ (inverse @ psi)
            across = across - Y @ (inverse @ across) + inverse.T @ (dY.T @ (left * self.shape_sigma))
            found[:, q] = -across / self.shape_sigma
        return found

    def mac(self, state: State, rows: slice) -> list[float | None]:
        """Modal assurance criterion (k,) with the model's mode, or space of repeated ones."""
        if self.shapes is None:
            return [None] * len(self.frequency_hz)
        partner = self.partner(state, rows)
        left = [self._left(state, rows, k, m)[0] * self.shape_sigma for k, m in enumerate(partner)]
        return [float(1 - own @ own) for own in left]


@dataclass(frozen=True)
class ResponseTarget:
    """Measured frequency responses at some frequencies `hz` (f,), H (f, p, m), with standard deviations `sigma`
    (f, p, m) of ln H, infinite where they say nothing, and damping ratio and window decay, 1/s, in some setup."""

    hz: Array
    H: Complex
    sigma: Array
    outputs: tuple[MeasuredChannel, ...]
    inputs: tuple[MeasuredChannel, ...]
    damping: float
    decay: float
    setups: Setups = ()

    @property
    def channels(self) -> tuple[MeasuredChannel, ...]:
        """Outputs, then inputs."""
        return (*self.outputs, *self.inputs)

    def _model(self, state: State, rows: slice) -> tuple[Complex, Complex]:
        with np.errstate(divide="ignore"):
            ratios = self.damping + self.decay / np.sqrt(np.maximum(state.pairs.values, 1e-300))
        cut = _Cut(state.family, rows)
        own = [Change(c.K, c.M, c.Y[rows]) for c in state.changes]
        G = state.G[:, rows] if state.G.shape[1] else state.G
        keep = np.r_[: len(state.pairs.values), len(state.pairs.values) + np.arange(rows.start, rows.stop)]
        if state.G.shape[1]:
            own = [Change(c.K[:, keep], c.M[:, keep], c.Y[:, keep]) for c in own]
        H, dH = modal_response(
            cut,
            state.at,
            state.pairs,
            state.moved,
            static=G,
            changes=own,
            hz=self.hz,
            outputs=len(self.outputs),
            damping=ratios,
        )
        order = np.array([DERIVATIVE.get(c.quantity, 0) for c in self.outputs])
        factor = ((2j * np.pi * self.hz[:, None]) ** order)[:, :, None]
        return H * factor, dH * factor

    def residual(self, state: State, rows: slice) -> Array:
        """Real and imaginary part of ln(H/H_measured)/sigma (theory eq. K15)."""
        H, _ = self._model(state, rows)
        compared = self._is_compared(H)
        left = (
            np.where(compared, np.log(np.where(compared, H, 1.0) / np.where(compared, self.H, 1.0)), 0.0) / self.sigma
        )
        return np.concatenate([left.real.ravel(), left.imag.ravel()])

    def jacobian(self, state: State, rows: slice) -> Array:
        """Derivatives (r, P) of the residual."""
        H, dH = self._model(state, rows)
        compared = self._is_compared(H)
        slope = (np.where(compared, dH / np.where(compared, H, 1.0), 0.0) / self.sigma).reshape(len(dH), -1).T
        return np.concatenate([slope.real, slope.imag])

    def _is_compared(self, H: Complex) -> NDArray[np.bool_]:
        """Where there is something to compare (f, p, m): not where the model's response is zero by symmetry."""
        return np.isfinite(self.sigma) & (np.abs(H) > SILENT**2 * np.abs(self.H))


class _Cut:
    """A family that reads some of its rows only."""

    def __init__(self, family: Reader, rows: slice) -> None:
        self._family, self._rows = family, rows

    def readings(self, parameters: Mapping[str, float], X: Array) -> Array:
        return self._family.readings(parameters, X)[self._rows]


Target = ModalTarget | ResponseTarget


def targets_of(data: Any, sigma: float, shape_sigma: float, response_sigma: float, damping: float) -> list[Target]:
    """Targets from frequencies in Hz, identified modes, frequency responses, measurements, or a list of these.

    Raises OptionError for anything else.
    """
    if isinstance(data, MeasuredFrequencies):
        own = np.where(np.isnan(data.sigma), sigma, data.sigma)
        return [
            ModalTarget(
                data.frequency_hz, own, None, (), shape_sigma, data.name, data.setups, tuple(data.number.tolist())
            )
        ]
    if isinstance(data, IdentifiedModes):
        scatter = np.array([e.frequency_spread for e in data.evidence]) if data.evidence else np.zeros(1)
        own = np.maximum(np.where(np.isfinite(scatter), scatter, 0.0), sigma) * np.ones(len(data.poles))
        shapes = data.real_shapes if len(data.outputs) > 1 else None
        channels = data.outputs if shapes is not None else ()
        return [ModalTarget(data.frequency_hz, own, shapes, channels, shape_sigma, data.name, setups_of(data))]
    if isinstance(data, MeasuredFRF):
        return [_response_target(data, response_sigma, damping)]
    if isinstance(data, Measurement):
        if not data.frfs:
            raise OptionError(f"{data.name} holds no frequency responses; estimate or identify them first")
        return [_response_target(frf, response_sigma, damping) for frf in data.frfs]
    if isinstance(data, Sequence | np.ndarray) and len(data) and not isinstance(data, str):
        if all(x is None or isinstance(x, int | float | np.number) for x in data):
            return targets_of(MeasuredFrequencies.of(data), sigma, shape_sigma, response_sigma, damping)
        return [t for x in data for t in targets_of(x, sigma, shape_sigma, response_sigma, damping)]
    raise OptionError(
        "data are frequencies in Hz, identified modes, frequency responses, a measurement, or a list of these; not"
        f" {type(data).__name__}"
    )


def _response_target(frf: MeasuredFRF, sigma: float, damping: float) -> ResponseTarget:
    """Points that are finite, not zero and coherent; coherence widens sigma (Bendat and Piersol 2010, ch. 9)."""
    own = np.full(frf.response.shape, sigma)
    if frf.coherence is not None:
        gamma = np.clip(frf.coherence, 1e-6, 1.0)
        own = np.hypot(own, np.sqrt((1 - gamma) / (2 * gamma * max(frf.averages or 1, 1))))
        own = np.where(frf.coherence >= COHERENT, own, np.inf)
    good = np.isfinite(frf.response) & (np.abs(frf.response) > 0) & (frf.frequency_hz > 0)[:, None, None]
    peak = np.where(good, np.abs(frf.response), 0.0).max(axis=0)
    loud = peak > SILENT * np.sqrt(np.outer(peak.max(axis=1), peak.max(axis=0)))
    own = np.where(good & loud, own, np.inf)
    useful = np.flatnonzero(np.isfinite(own).any(axis=(1, 2)))
    if not len(useful):
        raise OptionError("the frequency responses have no point that is finite, not zero and coherent")
    at = useful[np.unique(np.linspace(0, len(useful) - 1, min(len(useful), MOST_POINTS)).round().astype(int))]
    H = np.where(np.isfinite(own), frf.response, 1.0)
    setups = ((frf.setup, frf.outputs),)
    return ResponseTarget(frf.frequency_hz[at], H[at], own[at], frf.outputs, frf.inputs, damping, frf.decay, setups)
