"""What a correlation has found: pairs of modes and channels, expanded shapes, responses laid over each other.

SEREP expansion, mass matrices over the sensors, and measured responses over those of the model between the same points.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array, Complex, Index
from flexura.errors import OptionError, SolverError
from flexura.linalg import is_definite, scaled, unit_scale
from flexura.modal import DEPENDENT_SHAPES, frac
from flexura.reduction import stored_flexibility
from flexura.results import Tabular
from flexura.structure import Channel, FullOrderModel
from flexura.systems import system
from flexura.tables import Facts, Item, Line, Table, percent, quantity
from flexura.testing.measurement import MeasuredFRF, Trace
from flexura.testing.rig import ChannelMatch, ChannelPairing, UnmatchedChannel, between, pair_channels

ReducedMass = Literal["serep", "guyan"]


@dataclass(frozen=True)
class Expansion:
    """Test shapes as a sum of model shapes: coefficients (k, n).

    `error` (n,) is the part of each test shape at the sensors that no sum of the model's shapes has, relative; where
    there are no more sensors than model shapes it is zero and proves nothing. `condition` is the condition number of
    the model's shapes, each of length one, at the sensors.
    """

    coefficients: Array
    error: Array
    condition: float
    sensors: int

    @property
    def is_determined(self) -> bool:
        """True where sensors outnumber the shapes and tell them apart."""
        return self.sensors >= len(self.coefficients) and self.condition < 1 / DEPENDENT_SHAPES


def serep(test_shapes: ArrayLike, model_shapes: ArrayLike) -> Expansion:
    """Expand test shapes (p, n) in model shapes (p, k) at the sensors by least squares: SEREP.

    O'Callahan, Avitabile and Riemer (1989); theory eq. Q9. The whole mechanism follows with the model's shapes there
    times the coefficients. Raises OptionError for arrays that do not fit together.
    """
    x, y = np.asarray(test_shapes, dtype=float), np.asarray(model_shapes, dtype=float)
    if x.ndim != 2 or y.ndim != 2 or len(x) != len(y):
        raise OptionError(f"shapes are arrays (sensors, modes) over the same sensors, not {x.shape} and {y.shape}")
    size = np.linalg.norm(y, axis=0)
    size[size == 0] = 1.0
    s = np.linalg.svd(y / size, compute_uv=False)
    c = np.linalg.lstsq(y / size, x, rcond=DEPENDENT_SHAPES)[0] / size[:, None]
    length = np.linalg.norm(x, axis=0)
    error = np.linalg.norm(x - y @ c, axis=0) / np.where(length > 0, length, 1.0)
    low = s[-1] if len(s) and len(x) >= y.shape[1] else 0.0
    condition = float(s[0] / low) if low > 0 else np.inf if len(s) else 1.0
    return Expansion(c, error, condition, len(x))


def sensor_mass(
    model: FullOrderModel, rows: ArrayLike, shapes: ArrayLike | None = None, method: ReducedMass = "serep"
) -> Array:
    """Mass matrix (p, p) over the readings of sensors, `rows` (p, n) of the DOFs: the test-analysis model.

    serep: Phi^+T Phi^+ of mass-normalised model shapes (n, k), exact for these and blind to everything else (Kammer
    1987; theory eq. Q10). guyan: T^T M T with the displacements T of least strain energy that have the readings
    (Guyan 1965; theory eq. Q11), which needs no modes. Raises OptionError for another method, and SolverError for
    guyan of a mechanism that can move freely.
    """
    B = np.asarray(rows, dtype=float)
    if method not in get_args(ReducedMass):
        raise OptionError(f"the reduced mass is {' or '.join(get_args(ReducedMass))}, not {method!r}")
    if method == "serep":
        if shapes is None:
            raise OptionError("a reduced mass by SEREP needs the model's shapes")
        P = np.linalg.pinv(B @ np.asarray(shapes, dtype=float), rcond=DEPENDENT_SHAPES)
        return P.T @ P
    if not is_definite(model.K):
        raise SolverError("static reduction to the sensors needs a mechanism that is held; take serep")
    X = stored_flexibility(model.K, model.M, 0.0)(B.T)
    F = B @ X
    d = unit_scale(F)
    F = scaled(F, d)
    T = X @ (d[:, None] * np.linalg.pinv((F + F.T) / 2, rcond=DEPENDENT_SHAPES, hermitian=True) * d)
    mass = T.T @ (model.M @ T)
    return (mass + mass.T) / 2


SUMMED_UP_TO = 4.0
"""Modes up to so many times the highest frequency compared are summed; others enter as their static part."""


@dataclass(frozen=True)
class FRFOverlay:
    """Measured responses of the matched channels and those of the model, `response` (f, p, m), at the same frequencies.

    `frac` (p, m) is the frequency response assurance criterion; `damping` says where the model's damping comes from.
    """

    measured: MeasuredFRF
    response: Complex
    frac: Array
    damping: str


def overlay(
    model: FullOrderModel, frf: MeasuredFRF, ratios: tuple[float, ...], top: float, *, within: float | None = None
) -> FRFOverlay | None:
    """The model's responses under measured ones up to `top`, Hz; None where no input or no output is in the model.

    Where the description has no damping, modes get the `ratios`. What an exponential window has added to the measured
    decay is added to the model's.
    """
    outputs, inputs = (pair_channels(model, c, within=within) for c in (frf.outputs, frf.inputs))
    lines = np.flatnonzero((frf.frequency_hz > 0) & (frf.frequency_hz <= top))
    if not (outputs.matched and inputs.matched and len(lines)):
        return None
    measured = _part(frf, lines, outputs.at, inputs.at)
    built, damping = system(model, inputs=[], outputs=[]), "as described"
    if not built.is_damped:
        law: dict[str, Any] = {"ratio": float(np.median(ratios)), "ratios": ratios}
        built, damping = system(model, inputs=[], outputs=[], damping=law), "as identified"
    ends = ([Channel(c.name, c.quantity) for c in channels] for channels in (measured.inputs, measured.outputs))
    modes = replace(between(built, *ends), B=inputs.rows.T, rows=outputs.rows).modal(up_to=SUMMED_UP_TO * top)
    modes = replace(modes, damping=modes.damping + 2 * frf.decay * np.eye(modes.order))
    H = modes.response(measured.frequency_hz)
    finite = np.flatnonzero((np.isfinite(measured.response) & np.isfinite(H)).all(axis=(1, 2)))
    measured = _part(measured, finite, np.arange(len(measured.outputs)), np.arange(len(measured.inputs)))
    return FRFOverlay(measured, H[finite], frac(measured.response, H[finite]), damping)


def _part(frf: MeasuredFRF, lines: Index, outputs: Index, inputs: Index) -> MeasuredFRF:
    """Some frequencies, outputs and inputs of measured responses."""
    at = np.ix_(lines, outputs, inputs)
    return replace(
        frf,
        frequency_hz=frf.frequency_hz[lines],
        response=frf.response[at],
        coherence=None if frf.coherence is None else frf.coherence[at],
        partial_coherence=None if frf.partial_coherence is None else frf.partial_coherence[at],
        sigma=None if frf.sigma is None else frf.sigma[at],
        outputs=tuple(frf.outputs[k] for k in outputs),
        inputs=tuple(frf.inputs[k] for k in inputs),
    )


@dataclass(frozen=True)
class ModePair:
    """A mode of the test and its counterpart in the model, both numbered from 1.

    `error` is the model's frequency over that of the test, less one. `mac` compares the two shapes; `space_mac` is the
    share of the one within the space of the other's close modes `test_space` and `model_space`, equal to `mac` where
    there are none. `expansion_error` is what the model's shapes cannot represent of the test shape, relative.
    """

    test: int
    model: int
    test_hz: float
    model_hz: float
    error: float
    damping_ratio: float
    mac: float
    space_mac: float
    test_space: tuple[int, ...]
    model_space: tuple[int, ...]
    expansion_error: float


MOST_CHANNELS = 40
"""Channels that are listed."""


@dataclass(frozen=True, repr=False)
class Correlation(Tabular):
    """A test against a model of the mechanism.

    Shapes at the q matched sensors: `test_shapes` (q, n) complex, `model_shapes` (q, k), rotations times `reach`, m.
    A channel that is not `used` (q,) is faulty, see `notes`, and takes no part in what follows but `comac` and `gain`.
    `mac` (n, k), `auto_mac_test` (n, n), `auto_mac_model` (k, k). Over the pairs: `comac` and `gain` (q,) of the
    channels, `self_orthogonality` (r, r) of the r paired test shapes and `cross_orthogonality` (r, r) with those of the
    model. `expanded` (n_nodes, 6, n) are the test shapes on the whole mechanism and `counterparts` (n_nodes, 6, r) the
    model's, in m and rad and of the same size; close modes are turned within their space to be nearest to the test's.
    `modes` (n_nodes, 6, k) are the model's own. `measured` (q, n) are the real test shapes at the sensors, of the size
    of `expanded`, m and rad, and `traces` lines of the part to draw them on.
    """

    name: str
    test_name: str
    pairs: tuple[ModePair, ...]
    matched: tuple[ChannelMatch, ...]
    unmatched: tuple[UnmatchedChannel, ...]
    test_hz: Array
    test_damping: Array
    model_hz: Array
    test_shapes: Complex
    model_shapes: Array
    used: NDArray[np.bool_]
    reach: float
    mac: Array
    auto_mac_test: Array
    auto_mac_model: Array
    comac: Array
    gain: Array
    reduced_mass: str
    self_orthogonality: Array
    cross_orthogonality: Array
    expanded: Array
    counterparts: Array
    modes: Array
    expansion: Expansion
    frfs: tuple[FRFOverlay, ...]
    model: FullOrderModel
    sensors: ChannelPairing
    measured: Array
    traces: tuple[Trace, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def unpaired_test(self) -> tuple[int, ...]:
        """Numbers of test modes without a counterpart."""
        return tuple(sorted(set(range(1, len(self.test_hz) + 1)) - {p.test for p in self.pairs}))

    @property
    def unpaired_model(self) -> tuple[int, ...]:
        """Numbers of the model's modes below the highest test frequency that the test has not."""
        below = {int(k) + 1 for k in np.flatnonzero(self.model_hz <= self.test_hz.max(initial=0.0))}
        return tuple(sorted(below - {p.model for p in self.pairs}))

    def _data(self) -> dict[str, Any]:
        """Everything but the shapes over the mechanism."""
        numbers = ("test_hz", "test_damping", "model_hz", "mac", "auto_mac_test", "auto_mac_model")
        tables = ("self_orthogonality", "cross_orthogonality")
        return {
            "name": self.name,
            "test": self.test_name,
            "pairs": self.pairs,
            "unpaired_test": self.unpaired_test,
            "unpaired_model": self.unpaired_model,
            "channels": [
                {"name": m.channel.name, "node": m.node, "how": m.how, "distance": m.distance, "gain": g, "used": u}
                for m, g, u in zip(self.matched, self.gain, self.used, strict=True)
            ],
            "unmatched": [
                {"name": u.channel.name, "reason": u.reason, "nearest": u.nearest, "distance": u.distance}
                for u in self.unmatched
            ],
            **{name: getattr(self, name) for name in (*numbers, *tables)},
            "comac": self.comac,
            "reduced_mass": self.reduced_mass,
            "frac": [{"setup": o.measured.setup, "frac": o.frac} for o in self.frfs],
        }

    def _title(self) -> str:
        return f"{self.test_name} against it, {len(self.pairs)} of {len(self.test_hz)} test modes paired"

    def presentation(self) -> Iterator[Item]:
        """Pairs of modes, what has no counterpart, channels and responses."""
        pairs = self.pairs
        columns = {
            "test": [pair.test for pair in pairs],
            "measured [Hz]": [pair.test_hz for pair in pairs],
            "damping": [percent(pair.damping_ratio, 2) for pair in pairs],
            "model": [pair.model for pair in pairs],
            "computed [Hz]": [pair.model_hz for pair in pairs],
            "difference": [f"{100 * pair.error:+.2f} %" for pair in pairs],
            "MAC": [f"{pair.mac:.3f}" for pair in pairs],
            "in space": [
                f"{pair.space_mac:.3f}" if max(len(pair.model_space), len(pair.test_space)) > 1 else ""
                for pair in pairs
            ],
            "not represented": [percent(pair.expansion_error, 2) for pair in pairs],
        }
        yield Table(columns, "pairs")
        for words, numbers, hz in (
            ("test modes without a counterpart", self.unpaired_test, self.test_hz),
            ("modes of the model that the test has not", self.unpaired_model, self.model_hz),
        ):
            if numbers:
                listed = ", ".join(f"{k} ({quantity(hz[k - 1], 'Hz')})" for k in numbers)
                yield Line(f"{words}: {listed}", "bad")
        if len(pairs) > 1:
            of = {"test": self.self_orthogonality, "test and model": self.cross_orthogonality}
            off = {name: float((values - np.diag(np.diagonal(values))).max()) for name, values in of.items()}
            text = f"orthogonality, mass reduced by {self.reduced_mass}, of"
            yield Facts({text: {name: f"at most {value:.2f} off the diagonal" for name, value in off.items()}})
        matched = self.matched
        gains = zip(self.gain, self.used, strict=True)
        columns = {
            "channel": [match.channel.name for match in matched],
            "reads": [match.node for match in matched],
            "found by": [match.how for match in matched],
            "away [m]": [match.distance for match in matched],
            "CoMAC": [f"{comac:.3f}" for comac in self.comac],
            "gain": [f"{gain:.2f}" + ("" if used else "  left out") for gain, used in gains],
        }
        yield Table(columns, "channels", most=MOST_CHANNELS)
        for lost in self.unmatched:
            near = (
                "" if lost.distance is None else f"; nearest is {lost.nearest}, {quantity(lost.distance, 'm', 3)} away"
            )
            yield Line(f"{lost.channel.name} is left out: {lost.reason}{near}", "bad")
        for overlay in self.frfs:
            frac, setup = overlay.frac, f" ({overlay.measured.setup})" if overlay.measured.setup else ""
            span = f"{frac.min():.2f} to {frac.max():.2f}"
            yield Line(f"FRAC of {frac.size} responses{setup}: {span}, damping {overlay.damping}")

    def _columns(self) -> dict[str, Any]:
        """A row for each pair of modes."""
        pairs = self.pairs
        return {
            "test mode": [p.test for p in pairs],
            "model mode": [p.model for p in pairs],
            "test frequency [Hz]": [p.test_hz for p in pairs],
            "model frequency [Hz]": [p.model_hz for p in pairs],
            "relative error": [p.error for p in pairs],
            "damping ratio": [p.damping_ratio for p in pairs],
            "mac": [p.mac for p in pairs],
            "space mac": [p.space_mac for p in pairs],
        }
