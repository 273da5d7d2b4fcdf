"""Identify modes from the frequency responses of a test, or from records of its outputs alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from flexura.analysis import FrequencyResponse
from flexura.arguments import verb
from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.mechanism import DOF_NAMES
from flexura.structure import Channel
from flexura.testing.identification.multi_setup import merged
from flexura.testing.identification.one_setup import UNSURE, Options, SetupPoles, modes_of
from flexura.testing.identification.outputs_alone import UNKNOWN
from flexura.testing.identification.stabilisation import picks_of
from flexura.testing.measurement import (
    Correlations,
    IdentifiedModes,
    MeasuredChannel,
    MeasuredFRF,
    Measurement,
    ResponseMatrix,
    Trace,
    correlations_of,
    estimate_frf,
    fill_reciprocal,
    half_spectra,
    response_matrices,
)
from flexura.testing.substructuring import ScatteredResponse

Data = Measurement | MeasuredFRF | FrequencyResponse | Sequence[MeasuredFRF]
Setups = Literal["each", "together"]
Method = Literal["plscf", "ssi"]
Select = Sequence[float | tuple[float, int]]
"""What a user picks: frequencies, Hz, or poles of the stabilisation diagram, as pairs of a frequency and an order."""

LEAST_CONFIDENCE = 0.3
"""Confidence below which a mode is not taken unless it is picked: no true mode in noise of 20 dB had so little."""


@verb
def identify(
    data: Data,
    *,
    band: tuple[float, float] | None = None,
    order: int | None = None,
    select: Select | None = None,
    setups: Setups = "each",
    refine: bool = True,
    most_damped: float = 0.2,
    least_confidence: float = LEAST_CONFIDENCE,
    method: Method | None = None,
    reciprocal: bool = False,
) -> IdentifiedModes:
    """Poles, damping, shapes and participation of the modes in a band (from, to), Hz (theory eqs. I1-I18).

    Poly-reference least squares of every order up to `order`, modes chosen where poles are stable over the orders, or
    nearest to the frequencies `select`, Hz, which then are all that is returned, though other stable poles still take
    part in the fit; a frequency given twice asks for two modes. A pair (frequency, order) picks the nearest pole of
    that order in the stabilisation diagram, and the fit starts from it. `refine` then fits poles, participation and
    shapes together to the responses. `setups`: each is identified by itself, since sensors in other places shift
    frequencies, and shapes are merged by the inputs (or else the outputs) that all setups share; or all are taken
    together as one matrix. Damping that an exponential window has added is not in the result. Poles with a damping
    ratio above `most_damped` are no modes. Those with less than `least_confidence` are left out and named, unless they
    are picked.

    Where no pole is stable at all and a peak stands 30 dB above the median, it is returned, with its width as the most
    of its damping, without confidence, and with a note.

    Records of outputs alone, none of whose channels is an input, are identified from their correlations (theory eqs.
    I27-I35): inputs are then taken for white noise, shapes are not scaled, setups are merged by the outputs that all
    share, and without `refine` poles are those of the subspaces, with standard deviations of their own. `method`: poles
    by least squares (plscf, that of frequency responses) or by stochastic subspaces (ssi, that of outputs alone).
    `reciprocal`: responses that are not measured are those from the other end, as of `testing.fill_reciprocal`.

    Repeated modes take as many inputs (or outputs) as there are of them. Raises OptionError for bad options, bad or
    incomplete data, and when there is no mode; SolverError when there are too few lines for the order.
    """
    poles = stabilisation(
        data, band=band, order=order, setups=setups, most_damped=most_damped, method=method, reciprocal=reciprocal
    )
    return poles.modes(select=select, refine=refine, least_confidence=least_confidence)


@dataclass(frozen=True)
class Stabilisation:
    """Poles of all orders in every setup of a test, from which modes are taken again and again."""

    setting: Setting
    setups: Sequence[SetupPoles]
    most_damped: float

    def modes(
        self, select: Select | None = None, *, refine: bool = True, least_confidence: float = LEAST_CONFIDENCE
    ) -> IdentifiedModes:
        """Modes chosen by themselves, or picked, as `identify` returns them. Raises OptionError as it does."""
        if not 0 <= least_confidence < 1:
            raise OptionError(f"least_confidence is at least 0 and below 1, not {least_confidence:g}")
        options = Options(None if select is None else picks_of(select), refine, self.most_damped, least_confidence)
        test = self.setting
        modes, missing = zip(*(modes_of(test.name, setup, options) for setup in self.setups), strict=True)
        nowhere = [why for pick, why in missing[0].items() if all(pick in lost for lost in missing)]
        if nowhere:
            raise OptionError(f"{'; '.join(nowhere)}; see the stabilisation diagram")
        if not any(len(setup.poles) for setup in modes):
            unsure = "".join(f"; {note}" for setup in modes for note in setup.notes if UNSURE in note)
            raise OptionError(
                "no mode is stable over the orders: leave lines that are noise out of the band, raise the order, or"
                f" pick frequencies where the responses have peaks{unsure}"
            )
        if len(modes) == 1:
            return replace(modes[0], notes=(*test.notes, *modes[0].notes), traces=test.traces)
        return replace(merged(test.name, modes, test.matrices, test.notes), traces=test.traces)


def stabilisation(
    data: Data,
    *,
    band: tuple[float, float] | None = None,
    order: int | None = None,
    setups: Setups = "each",
    most_damped: float = 0.2,
    method: Method | None = None,
    reciprocal: bool = False,
) -> Stabilisation:
    """Poles of all orders of a test, of which `identify` makes modes, with its options and errors."""
    if setups not in get_args(Setups):
        raise OptionError(f"setups is each or together, not {setups!r}")
    if not 0 < most_damped < 1:
        raise OptionError(f"most_damped is a damping ratio between 0 and 1, not {most_damped:g}")
    if order is not None and not 2 <= order <= 500:
        raise OptionError(f"an order is between 2 and 500, not {order}")
    if method is not None and method not in get_args(Method):
        raise OptionError(f"method is plscf or ssi, not {method!r}")
    test = matrices_of(data, band, together=setups == "together", reciprocal=reciprocal)
    if method == "ssi" and not test.is_output_only:
        raise OptionError("ssi takes records of outputs alone; frequency responses are identified by plscf")
    by_subspaces = test.is_output_only and method != "plscf"
    pairs = zip(test.matrices, test.correlations, strict=True)
    return Stabilisation(test, [SetupPoles.of(*own, order, most_damped, by_subspaces) for own in pairs], most_damped)


@dataclass(frozen=True)
class Setting:
    """What is identified: a matrix for every setup, its correlations where it is of outputs alone, and notes."""

    name: str
    matrices: Sequence[ResponseMatrix]
    correlations: Sequence[Correlations | None]
    notes: tuple[str, ...]
    traces: tuple[Trace, ...] = ()

    @property
    def is_output_only(self) -> bool:
        """Whether the matrices are half spectra of outputs."""
        return any(known is not None for known in self.correlations)


def matrices_of(
    data: Data, band: tuple[float, float] | None = None, *, together: bool = False, reciprocal: bool = False
) -> Setting:
    """The matrix of every setup of data in a band: frequency responses, or half spectra of outputs alone."""
    if isinstance(data, Measurement) and has_outputs_alone(data):
        if reciprocal:
            raise OptionError("outputs alone have no reciprocals: that takes forces")
        each = correlations_of(data.recordings, band, together)
        return Setting(data.name, [half_spectra(one) for one in each], each, (*data.notes, UNKNOWN), data.traces)
    name, frfs, notes = frfs_of(data, reciprocal)
    matrices = response_matrices(frfs, band, together)
    traces = data.traces if isinstance(data, Measurement) else ()
    return Setting(name, matrices, [None] * len(matrices), notes, traces)


def has_outputs_alone(data: Measurement) -> bool:
    """Whether a measurement has records and no input in any of them."""
    return bool(data.recordings) and not data.frfs and not any(r.inputs for r in data.recordings)


def frfs_of(data: Data, reciprocal: bool = False) -> tuple[str, Sequence[MeasuredFRF], tuple[str, ...]]:
    """Name, frequency responses and notes of data; those of a measurement that has only records are estimated (H1).

    Records of outputs alone have none. `reciprocal`: those that are not measured are filled from the other end.
    """
    if reciprocal and not (isinstance(data, Measurement) and data.recordings and not data.frfs):
        name, frfs, notes = frfs_of(data)
        frfs = fill_reciprocal(frfs)
        return name, frfs, tuple(dict.fromkeys((*notes, *(note for frf in frfs for note in frf.notes))))
    if isinstance(data, Measurement):
        is_given = data.frfs or not data.recordings or has_outputs_alone(data)
        frfs = data.frfs if is_given else estimate_frf(data, reciprocal=reciprocal)
        return data.name, frfs, (*data.notes, *(note for frf in frfs for note in frf.notes))
    if isinstance(data, FrequencyResponse):
        inputs, outputs = (tuple(_placed(c) for c in channels) for channels in (data.inputs, data.outputs))
        decay = data.decay if isinstance(data, ScatteredResponse) else 0.0
        return data.name, (MeasuredFRF(data.frequency_hz, data.response, inputs, outputs, decay=decay),), ()
    if isinstance(data, MeasuredFRF):
        return data.setup or "measurement", (data,), data.notes
    return "measurement", tuple(data), tuple(note for frf in data for note in frf.notes)


def _placed(channel: Channel) -> MeasuredChannel:
    """A channel of a computed response; one that is a DOF has a node and a direction."""
    if channel.node is not None and channel.against is None:
        return MeasuredChannel(channel.name, channel.quantity, channel.node, channel.direction)
    node, dot, dof = channel.name.partition(":")[0].rpartition(".")
    if not dot or dof not in DOF_NAMES:
        return MeasuredChannel(channel.name, channel.quantity)
    x, y, z = np.eye(3)[DOF_NAMES.index(dof) % 3].tolist()
    return MeasuredChannel(channel.name, channel.quantity, node, (x, y, z))


def mode_indicators(matrix: ResponseMatrix) -> Array:
    """Complex mode indicator functions (f, min(p, m)): singular values of the responses, scaled to comparable size.

    Each mode is a peak of the first; where a second one peaks at the same place, modes are repeated (theory eq. I23;
    Shih, Tsuei, Allemang and Brown 1988, Mechanical Systems and Signal Processing 2).
    """
    return np.asarray(np.linalg.svd(matrix.scaled, compute_uv=False), dtype=np.float64)
