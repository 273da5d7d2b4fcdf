"""Measured frequency responses over those of the model, between the same points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.modal import ModePairing, frac
from flexura.structure import FullOrderModel
from flexura.systems import DERIVATIVE, Channel, System, system
from flexura.testing.measurement import IdentifiedModes, MeasuredFRF
from flexura.testing.rig import ChannelPairing, pair_channels

BAND = 1.25
"""Responses are compared up to so many times the highest identified frequency."""

MODES = 4.0
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


def overlays(
    model: FullOrderModel,
    frfs: Sequence[MeasuredFRF],
    identified: IdentifiedModes,
    pairing: ModePairing,
    model_hz: Array,
    within: float | None,
) -> tuple[FRFOverlay, ...]:
    """The model's responses under all measured ones of which inputs and outputs are found in the model.

    The band ends at 1.25 times the highest identified frequency. Where the description has no damping, modes get the
    identified ratios of their counterparts, and others the median. What an exponential window has added to the
    measured decay is added to the model's.
    """
    top = BAND * float(identified.frequency_hz.max())
    found = []
    for frf in frfs:
        outputs, inputs = (pair_channels(model, c, within=within) for c in (frf.outputs, frf.inputs))
        own = np.flatnonzero((frf.frequency_hz > 0) & (frf.frequency_hz <= top))
        if not (outputs.matched and inputs.matched and len(own)):
            continue
        measured = _part(frf, own, outputs, inputs)
        built, damping = _system(model, measured, outputs, inputs, _ratios(identified, pairing, model_hz))
        modes = built.modal(up_to=MODES * top)
        modes = replace(modes, damping=modes.damping + 2 * frf.decay * np.eye(modes.order))
        H = modes.response(measured.frequency_hz)
        finite = np.flatnonzero((np.isfinite(measured.response) & np.isfinite(H)).all(axis=(1, 2)))
        measured = _part(measured, finite, None, None)
        found.append(FRFOverlay(measured, H[finite], frac(measured.response, H[finite]), damping))
    return tuple(found)


def _part(frf: MeasuredFRF, own: Index, outputs: ChannelPairing | None, inputs: ChannelPairing | None) -> MeasuredFRF:
    """Some frequencies, outputs and inputs of measured responses."""
    o = np.arange(len(frf.outputs)) if outputs is None else outputs.at
    i = np.arange(len(frf.inputs)) if inputs is None else inputs.at
    at = np.ix_(own, o, i)
    return replace(
        frf,
        frequency_hz=frf.frequency_hz[own],
        response=frf.response[at],
        coherence=None if frf.coherence is None else frf.coherence[at],
        outputs=tuple(frf.outputs[k] for k in o),
        inputs=tuple(frf.inputs[k] for k in i),
    )


def _ratios(identified: IdentifiedModes, pairing: ModePairing, model_hz: Array) -> tuple[float, ...]:
    """Damping ratios of the model's modes from their counterparts in the test."""
    ratios = np.full(len(model_hz), float(np.median(identified.damping_ratio)))
    own = np.flatnonzero(pairing.partner >= 0)
    ratios[pairing.partner[own]] = identified.damping_ratio[own]
    return tuple(np.clip(ratios, 0.0, 0.99).tolist())


def _system(
    model: FullOrderModel,
    measured: MeasuredFRF,
    outputs: ChannelPairing,
    inputs: ChannelPairing,
    ratios: tuple[float, ...],
) -> tuple[System, str]:
    """The system between the places of the channels, and where its damping comes from."""
    built, damping = system(model, inputs=[], outputs=[]), "as described"
    if not built.is_damped:
        how: dict[str, Any] = {"ratio": float(np.median(ratios)), "ratios": ratios}
        built, damping = system(model, inputs=[], outputs=[], damping=how), "as identified"
    p, m = len(outputs.rows), len(inputs.rows)
    B, rows = inputs.rows.T, outputs.rows
    return (
        replace(
            built,
            B=B,
            rows=rows,
            derivative=np.array([DERIVATIVE.get(c.quantity, 0) for c in measured.outputs], dtype=np.intp),
            D=np.zeros((p, m)),
            residual=np.zeros((p, m)),
            inputs=tuple(Channel(c.name, c.quantity) for c in measured.inputs),
            outputs=tuple(Channel(c.name, c.quantity) for c in measured.outputs),
            limits=((-np.inf, np.inf),) * m,
        ),
        damping,
    )
