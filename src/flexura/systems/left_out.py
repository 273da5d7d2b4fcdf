"""What models lack of their mechanism: bounds on modes left out and on damping made viscous, and warnings of these."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import Diagnostic, FlexuraError, OptionError, SolverError
from flexura.reduction import LowOrderModel, certify
from flexura.systems.modal import ModalSystem, coupled_response
from flexura.systems.second_order import Remainder, SecondOrder
from flexura.systems.state_space import FAINT, WORTH, Neglected, StateSpace, rounded_up
from flexura.tables import in_hz
from flexura.thresholds import STATIC_ROUND_OFF

BAND_POINTS = 60
"""Frequencies at which a band is looked at, beside those at resonances."""

BAND_DECADES = 2.0
"""Decades of frequency below the highest of a band that are looked at where it has no lowest."""

BESIDE_UNDAMPED = np.array([-0.3, -0.1, -0.03, -0.01, 0.01, 0.03, 0.1, 0.3])
"""Relative distances from resonances without damping that are looked at."""

BESIDE_DAMPED = np.array([-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0])
"""Distances from damped resonances that are looked at, in half-power widths."""

FREQUENCY_ROUNDING = 1e-7
"""Relative round-off of natural frequencies, which moves a response by so much over the damping ratio."""

NEAR = 1e-3
"""Relative distance to an undamped resonance within which a response is mostly its error: frequencies are proven to
1e-4, so that the response is off by a tenth there."""

UNDAMPED = 1e-9
"""Damping ratio below which there is none: round-off of poles."""

PROVEN_FREQUENCY = 0.01
"""Relative error of a frequency up to which it counts as proven, where no tolerance was given."""

ADVICE = "reduce with a tolerance up to the highest frequency, or keep more modes"


@verb
def neglected_bound(modes: ModalSystem, frequency_hz: ArrayLike) -> Array:
    """Bound (f, p, m) on the error of displacements of `modes.response` from modes left out, at frequencies (f,), Hz.

    What these modes add beyond first order in w^2 M, w C and H is at most the product of two norms, one of the inputs
    and one of the outputs, over 1 - (w/w_next)^2; no mode that is left out is computed (theory eq. T18). Damping ratios
    of these modes are in the bound and not in the response. Infinite from the first frequency left out. Raises
    SolverError for something that floats.
    """
    system = modes.system
    if system.flexibility.shift:
        raise SolverError("the bound needs a mechanism that is held")
    w = 2 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    shape = (len(w), len(modes.outputs), len(modes.inputs))
    remainder = modes.remainder
    if remainder is None:
        return np.zeros(shape) if not np.isfinite(modes.next_omega) else np.full(shape, np.inf)
    B, rows, *others = remainder.places
    if remainder.couples:
        _, load, reading = coupled_response(modes, w, remainder)
    else:
        m, p = len(B), len(rows)
        both = np.broadcast_to(np.eye(m + p), (len(w), m + p, m + p))
        load, reading = both[:, :, :m], both[:, :, m:]
    every = np.concatenate([B, rows, *others])
    sides = [_norms(modes, remainder, every, T, w) for T in (load, reading)]
    near = 1 - (w / modes.next_omega) ** 2
    second = sides[1][0][:, :, None] * sides[0][0][:, None, :]
    room = near - _spilled(modes, remainder, w)
    law, nearer = system.law, near[:, None, None]
    zeta = max([law.ratio, *(ratio for _, ratio in law.bands), *law.ratios])
    static = sides[1][1][:, :, None] * sides[0][1][:, None, :]
    plain = 2 * zeta * w[:, None, None] * _slow(modes, sides, static) / np.where(nearer > 0, nearer, 1.0) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = second / np.where(room > 0, room, 0.0)[:, None, None] + plain
    rounding = STATIC_ROUND_OFF * np.sqrt(np.outer(remainder.whole[rows], remainder.whole[B]))
    inside = ((w < modes.next_omega) & (room > 0))[:, None, None]
    return np.where(inside, np.where(second > 0, bound, plain) + rounding, np.inf)


def _slow(modes: ModalSystem, sides: list[tuple[Array, ...]], static: Array) -> Array:
    """Bound (f, p, m) on the sum of c b/omega^3 over the modes left out."""
    if modes.remainder is not None and modes.remainder.couples:
        return static / modes.next_omega
    (_, load, load_heavy), (_, reading, reading_heavy) = sides
    one = reading[:, :, None] * load_heavy[:, None, :]
    return np.minimum(one, reading_heavy[:, :, None] * load[:, None, :])


def _norms(modes: ModalSystem, remainder: Remainder, at: Any, T: Any, w: Array) -> tuple[Array, ...]:
    """Of loads W T (f, k, q) on the modes left out: |A K^-1 W T| and |W T| in the norm of K^-1, and |K^-1 W T| in that
    of M, each (f, q)."""
    i = np.ix_(at, at)
    stiff, heavy, viscous, lossy = (
        np.sqrt(np.maximum(np.einsum("fkq,fkq->fq", T.conj(), Y[i] @ T).real, 0.0))
        for Y in (remainder.stiff, remainder.heavy, remainder.viscous, remainder.lossy)
    )
    w = w[:, None]
    steepest, lossiest = remainder.largest
    first = (w**2 + w * modes.system.law.alpha) / modes.next_omega * heavy
    return first + w * np.sqrt(steepest) * viscous + np.sqrt(lossiest) * lossy, stiff, heavy


def _spilled(modes: ModalSystem, remainder: Remainder, w: Array) -> Array:
    """What the kept modes give back (f,) of the error that damping spills to them, as a share of it."""
    shares = np.zeros(len(w))
    if not remainder.couples or not modes.order:
        return shares
    r, damped = modes.order, np.concatenate(remainder.places[2:])
    i = np.ix_(damped, damped)
    gather = np.tile(np.eye(r), len(damped) // r)
    steepest, lossiest = remainder.largest
    loss = np.zeros((r, r)) if modes.loss is None else modes.loss
    for k, v in enumerate(w):
        size = (v**2 + v * modes.system.law.alpha) ** 2 / modes.next_omega**2 * remainder.heavy[i]
        size = 3 * (size + v**2 * steepest * remainder.viscous[i] + lossiest * remainder.lossy[i])
        q = remainder.forces(np.array([v]))[0].imag
        P = gather @ (q[:, None] * size * q) @ gather.T
        N = remainder.flexibility(modes.system, np.array([v]), (damped, damped))[0]
        Z = np.diag(modes.omega**2 - v**2) + 1j * (v * modes.damping + loss)
        Z = Z + gather @ (q[:, None] * N * q) @ gather.T
        Y = np.linalg.solve(Z, P)
        shares[k] = np.sqrt(np.abs(np.einsum("ij,ji->", Y, Y.conj())))
    return shares


def channel_scale(modes: ModalSystem, hz: Array, H: Complex) -> Array:
    """Sizes (p, m) of channels with responses H (f, p, m) at frequencies hz (f,): their largest response, and at least
    1 % of what input and output would reach if all modes added up (theory eq. T28); infinite where nothing responds."""
    w, rest = 2 * np.pi * hz, modes.remainder
    Z = modes.omega**2 - w[:, None] ** 2 + 2j * modes.total_ratios * modes.omega * w[:, None]
    ends = []
    for k, shares in enumerate((modes.B, modes.C.T)):
        with np.errstate(divide="ignore"):
            end = (1 / np.abs(Z)) @ shares**2
        ends.append(end if rest is None else end + rest.stiff.diagonal()[rest.places[k]])
    coherent = np.sqrt(ends[1][:, :, None] * ends[0][:, None, :]) * w[:, None, None] ** modes.derivative[:, None]
    coherent = np.where(np.isfinite(coherent), coherent, 0.0)
    scale = np.maximum(np.abs(H).max(axis=0), FAINT * coherent.max(axis=0))
    return np.where(scale > 0, scale, np.inf)


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
    sharpest = np.where(modes.total_ratios < UNDAMPED, np.abs(BESIDE_UNDAMPED).min(), modes.total_ratios).min()
    moved = FREQUENCY_ROUNDING / float(sharpest) * np.where(scale < np.inf, scale, 0.0)
    return Neglected(hz, bound + np.abs(H - plain) + moved, scale, modes.inputs, modes.outputs)


def _frequencies(modes: ModalSystem, band: tuple[float, float]) -> Array:
    """Frequencies over a band, Hz, more of them around resonances, and none at those that nothing damps."""
    low, high = band
    grids = [np.geomspace(low or high / 10**BAND_DECADES, high, BAND_POINTS)]
    bare = np.zeros(0)
    inside = (modes.frequency_hz > 0) & (modes.frequency_hz < 1.5 * high)
    for f, zeta in zip(modes.frequency_hz[inside], modes.total_ratios[inside], strict=True):
        if zeta < UNDAMPED:
            bare = np.append(bare, f)
            grids.append(f * (1 + BESIDE_UNDAMPED))
        else:
            grids.append(f * (1 + zeta * BESIDE_DAMPED))
    hz = np.unique(np.concatenate(grids))
    hz = hz[(hz >= grids[0][0]) & (hz <= high)]
    near = np.abs(hz[:, None] / bare - 1).min(axis=1, initial=np.inf) < 0.99 * np.abs(BESIDE_UNDAMPED).min()
    kept = hz[~near]
    return kept if len(kept) else high * np.array([1 - 1e-3])


def resonance_limits(hz: Array, resonances: Array, ratios: Array) -> tuple[Diagnostic, ...]:
    """Undamped resonances that frequencies hz (f,) come within reach of."""
    bare = resonances[ratios < UNDAMPED]
    if not len(bare) or not len(hz):
        return ()
    ascending = np.sort(hz)
    at = np.searchsorted(ascending, bare)
    beside = np.stack(
        [ascending[np.clip(at - 1, 0, len(ascending) - 1)], ascending[np.clip(at, 0, len(ascending) - 1)]]
    )
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
        known = proof.frequency_hz[proof.is_indexed & (proof.error_bound < PROVEN_FREQUENCY)]
        limit = float(known.max(initial=0.0))
        text = (
            f"{proof.missing} of the {proof.count} modes below {in_hz(proof.below_hz)} are missing from the model of"
            f" order {model.order}: {ADVICE}"
        )
        return (Diagnostic("proof", "", top, limit, "Hz", text),)
    off = np.flatnonzero((proof.error_bound > PROVEN_FREQUENCY) & (proof.frequency_hz <= top))
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
