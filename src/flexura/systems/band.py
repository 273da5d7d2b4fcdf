"""Up to where a frequency response is known: modes that a model lacks, and resonances without damping."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, FlexuraError, SolverError
from flexura.reduction import LowOrderModel, certify
from flexura.systems.bounds import channel_scale, neglected_bound
from flexura.systems.modal import ModalSystem
from flexura.systems.neglected import WORTH, rounded_up
from flexura.systems.second_order import SecondOrder
from flexura.systems.state_space import StateSpace
from flexura.tables import in_hz

NEAR = 1e-3
"""Relative distance to an undamped resonance within which a response is mostly its error: frequencies are proven to
1e-4, so that the response is off by a tenth there."""

UNDAMPED = 1e-9
"""Damping ratio below which there is none: round-off of poles."""

PROVEN = 0.01
"""Relative error of a frequency up to which it counts as proven, where no tolerance was given."""

ADVICE = "reduce with a tolerance up to the highest frequency, or keep more modes"


def resonance_limits(hz: Array, resonances: Array, ratios: Array) -> tuple[Diagnostic, ...]:
    """Undamped resonances that frequencies hz (f,) come within reach of."""
    bare = resonances[ratios < UNDAMPED]
    if not len(bare) or not len(hz):
        return ()
    own = np.sort(hz)
    at = np.searchsorted(own, bare)
    beside = np.stack([own[np.clip(at - 1, 0, len(own) - 1)], own[np.clip(at, 0, len(own) - 1)]])
    distance = np.abs(beside / bare - 1).min(axis=0)
    near = bare[distance < NEAR]
    if not len(near):
        return ()
    listed = ", ".join(f"{f:.5g}" for f in near[:5]) + (", ..." if len(near) > 5 else "")
    text = (
        f"nothing damps the resonance{'s' if len(near) > 1 else ''} at {listed} Hz: the response is infinite there, and"
        f" its peak says how near to it a frequency lies"
    )
    return (Diagnostic("resonance", "", float(distance.min()), NEAR, "1", text),)


def proof_limits(system: SecondOrder, top: float) -> tuple[Diagnostic, ...]:
    """What a low-order model is not proven to contain up to the frequency `top`, Hz."""
    model = system.model
    if not isinstance(model, LowOrderModel):
        return ()
    proof = model.certificate
    if proof is None or proof.below_hz < top:
        try:
            proof = certify(model, system.full_order, up_to=top)
        except FlexuraError as reason:
            text = f"the model of order {model.order} is not proven up to {in_hz(top)}: {reason}"
            return (Diagnostic("proof", "", top, 0.0, "Hz", text),)
    if proof.missing:
        known = proof.frequency_hz[proof.is_indexed & (proof.error_bound < PROVEN)]
        limit = float(known.max(initial=0.0))
        text = (
            f"{proof.missing} of the {proof.count} modes below {in_hz(proof.below_hz)} are missing from the model of"
            f" order {model.order}: {ADVICE}"
        )
        return (Diagnostic("proof", "", top, limit, "Hz", text),)
    off = np.flatnonzero((proof.error_bound > PROVEN) & (proof.frequency_hz <= top))
    if not len(off):
        return ()
    first, worst = float(proof.frequency_hz[off[0]]), float(proof.error_bound[off].max())
    bound = f"{100 * worst:.2g} %" if np.isfinite(worst) else "nothing"
    text = (
        f"resonances of the model of order {model.order} are proven to no better than {bound} from {in_hz(first)} on:"
        f" {ADVICE}"
    )
    return (Diagnostic("proof", "", top, first, "Hz", text),)


def truncation_limits(modes: ModalSystem, top: float) -> tuple[Diagnostic, ...]:
    """Modes left out of a system below the frequency `top`, Hz."""
    first = modes.next_omega / (2 * np.pi)
    if not first < top:
        return ()
    text = f"modes from {in_hz(first)} on are left out, and frequencies up to {in_hz(top)} are asked for"
    return (Diagnostic("proof", "", top, first, "Hz", text),)


def band_limits(model: StateSpace, top: float) -> tuple[Diagnostic, ...]:
    """What a state space lacks, and the frequency `top`, Hz, where it lies beyond the band that the model is for."""
    lost = model.neglected
    if lost is None or top <= lost.band[1] * (1 + NEAR):
        return model.warnings
    first = lost.band[1]
    text = (
        f"what the state space leaves out is known up to {in_hz(first)}, and frequencies up to {in_hz(top)} are asked"
        " for: state its band"
    )
    return (*model.warnings, Diagnostic("proof", "", top, first, "Hz", text))


def remainder_of_response(modes: ModalSystem, H: Complex, hz: Array) -> tuple[list[str], tuple[Diagnostic, ...]]:
    """What the modes left out can add to responses H (f, p, m) at frequencies hz (f,), and a warning if it is much."""
    below = 2 * np.pi * hz < modes.next_omega
    if not np.isfinite(modes.next_omega) or not H.size or not below.any():
        return [], ()
    hz, H = hz[below], H[below]
    try:
        bound = neglected_bound(modes, hz) * (2 * np.pi * hz)[:, None, None] ** modes.derivative[:, None]
    except SolverError:
        return ["what modes left out add is not bounded: something floats"], ()
    scale = channel_scale(modes, hz, H)
    shares = (bound / scale).max(axis=(1, 2))
    share = float(shares.max())
    if np.isfinite(share):
        text = f"modes left out add at most {rounded_up(share, 2)} of the largest responses up to {in_hz(hz[-1])}"
    else:
        text = (
            f"what modes left out add has no bound at {np.count_nonzero(~np.isfinite(shares))} of {len(hz)} frequencies"
        )
    if share <= WORTH:
        return [text], ()
    return [text], (Diagnostic("tolerance", "", share, WORTH, "1", f"{text}: keep more modes, or take method direct"),)
