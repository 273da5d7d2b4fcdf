"""Multi-setup merging: mean poles, and shapes of all channels on one scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.errors import OptionError
from flexura.modal import best_pairs, mac
from flexura.tables import in_hz
from flexura.testing.identification.evidence import finished
from flexura.testing.identification.outputs_alone import motions
from flexura.testing.identification.residues import fit_shapes
from flexura.testing.measurement import (
    SAME_MODE_OF_SETUPS,
    IdentifiedModes,
    MeasuredChannel,
    ModeEvidence,
    ResponseMatrix,
    key_of,
    responses,
)

WORTH_OF_PAIR = 10.0
"""What a pair of modes of two setups counts before its differences are taken off: more pairs go before nearer ones."""

BEST_KNOWN = 1e-9
"""Frequencies and damping ratios are not known better than this, relative."""

NOISE_SIGMAS = 3.0
"""Values of setups within so many of their standard deviations from the mean do not differ by more than noise."""

NAMED_SHIFT = 1e-3
"""Frequencies that differ by more between setups, relative, and more than by noise, are named."""

LEAST_SETUPS = 0.5
"""A mode is found in so many of the setups at least."""

ONE_SPACE = 0.25
"""Modes nearer than so many half-power half-widths are merged as a space."""


def merged(
    name: str, setups: Sequence[IdentifiedModes], matrices: Sequence[ResponseMatrix], notes: Sequence[str]
) -> IdentifiedModes:
    """Modes of several setups that share their inputs, or else their outputs (theory eqs. I20-I22).

    A mode is taken that half of the setups have; its frequency and damping are weighted means, its shape is put
    together from the residues in all of them. Raises OptionError when no input and no output is shared, and when no
    mode is.
    """
    each = tuple(replace(one, name=one.setup or f"setup {k + 1}") for k, one in enumerate(setups))
    alone = setups[0].output_only
    by_inputs, common = (True, ()) if alone else _shared(setups)
    if alone:
        setups = _by_references(setups)
    else:
        if not by_inputs:
            setups, matrices = [_transposed(modes) for modes in setups], [matrix.transposed for matrix in matrices]
        left_out = sorted({c.name for modes in setups for c in modes.inputs if key_of(c) not in map(key_of, common)})
        if left_out:
            notes = (*notes, f"not in all setups, and not used to merge them: {', '.join(left_out)}")
        chosen = (_with_inputs(common, *pair) for pair in zip(setups, matrices, strict=True))
        setups, matrices = zip(*chosen, strict=True)
    members = _members(setups, 1.0 if alone else LEAST_SETUPS)
    if not len(members):
        share = "all" if alone else "half of the"
        raise OptionError(f"no mode is found in {share} setups; identify them one by one, or pick frequencies")
    means = sorted(((*_mean(setups, row), row) for row in members), key=lambda mean: abs(mean[0]))
    poles, members = np.array([pole for pole, _, _ in means]), np.array([row for _, _, row in means])
    shifts = [e.setup_shift for _, e, _ in means]
    groups = _groups(poles)
    lead = [_lead(setups, members[group]) for group in groups]
    equal = [g for g, s in zip(groups, lead, strict=True) if len(g) > 1 and _have_one_pole(setups[s], members[g, s])]
    for group in equal:
        poles[group] = poles[group].mean()
    base = _base(setups, members, groups, lead)
    every = zip(setups, matrices, members.T, strict=True)
    outputs, shapes = _stacked(setups, [_shapes(modes, matrix, at, poles, base, groups) for modes, matrix, at in every])
    modes = IdentifiedModes(
        name,
        poles,
        shapes,
        shapes.real,
        base[:0] if alone else base,
        () if alone else setups[0].inputs,
        outputs,
        tuple(e for _, e, _ in means),
        tuple(d for modes in setups for d in modes.diagram),
        float(np.sqrt(np.mean([modes.synthesis_error**2 for modes in setups]))),
        (*notes, *(note for modes in setups for note in modes.notes), *_notes(poles, members, shifts)),
        band=setups[0].band,
        setups=each,
        output_only=alone,
    )
    return finished(modes if by_inputs else _transposed(modes), [] if alone else [group.tolist() for group in equal])


def _by_references(setups: Sequence[IdentifiedModes]) -> list[IdentifiedModes]:
    """Modes of outputs alone, with the outputs that all setups share for inputs.

    Participation is the inverse of the shapes there, so that the scale of all setups becomes that of these (theory eq.
    I36). Raises OptionError for no such output.
    """
    keys = set.intersection(*({key_of(c) for c in modes.outputs} for modes in setups))
    shared = tuple(c for c in setups[0].outputs if key_of(c) in keys)
    if not shared:
        raise OptionError("setups share no output, so their shapes have no common scale; identify them one by one")
    scaled = []
    for modes in setups:
        names = [key_of(c) for c in modes.outputs]
        there = modes.shapes[[names.index(key_of(c)) for c in shared]]
        participation = np.zeros(there.shape, dtype=complex)
        for group in _groups(modes.poles):
            participation[:, group] = np.linalg.pinv(there[:, group], rcond=1e-6).T
        scaled.append(replace(modes, inputs=shared, participation=participation))
    return scaled


def modes_of_setup(modes: IdentifiedModes, matrix: ResponseMatrix) -> Complex:
    """Responses (f, p, m) that modes and residuals give back, in the quantity and with the window of a matrix."""
    shapes = modes.shapes * motions(modes.outputs, modes.poles) if modes.output_only else modes.shapes
    H = responses(matrix.s, modes.poles, shapes, modes.participation, modes.lower, modes.upper, matrix.step)
    return H * matrix.s[:, None, None] ** matrix.power


def _shared(setups: Sequence[IdentifiedModes]) -> tuple[bool, list[MeasuredChannel]]:
    """Whether setups are merged by their inputs, and the channels that all have.

    Inputs if all are shared, else outputs if all are, else some inputs, else some outputs. Raises OptionError for none.
    """
    sides = [[modes.inputs for modes in setups], [modes.outputs for modes in setups]]
    common = []
    for side in sides:
        keys = set.intersection(*({key_of(c) for c in channels} for channels in side))
        common.append([c for c in side[0] if key_of(c) in keys])
    whole = [all(len(channels) == len(shared) for channels in side) for side, shared in zip(sides, common, strict=True)]
    if not (common[0] or common[1]):
        raise OptionError(
            "setups share neither inputs nor outputs, so their shapes have no common scale; identify them one by one"
        )
    by_inputs = bool(common[0]) and (whole[0] or not (whole[1] and common[1]))
    return by_inputs, common[0 if by_inputs else 1]


def _transposed(modes: IdentifiedModes) -> IdentifiedModes:
    """Inputs and outputs in each other's place."""
    lower, upper = (None if part is None else part.T for part in (modes.lower, modes.upper))
    sides = {"inputs": modes.outputs, "outputs": modes.inputs}
    columns = {"shapes": modes.participation, "participation": modes.shapes}
    return replace(modes, lower=lower, upper=upper, **sides, **columns)


def _with_inputs(
    inputs: Sequence[MeasuredChannel], modes: IdentifiedModes, matrix: ResponseMatrix
) -> tuple[IdentifiedModes, ResponseMatrix]:
    """Modes and matrix of a setup with those inputs only, in their order."""
    keys = [key_of(c) for c in modes.inputs]
    at = [keys.index(key_of(c)) for c in inputs]
    kept = tuple(modes.inputs[k] for k in at)
    lower, upper = (None if part is None else part[:, at] for part in (modes.lower, modes.upper))
    return (
        replace(modes, participation=modes.participation[at], inputs=kept, lower=lower, upper=upper),
        replace(matrix, response=matrix.response[:, :, at], column_scale=matrix.column_scale[at], inputs=kept),
    )


def _members(setups: Sequence[IdentifiedModes], least: float) -> Index:
    """Which mode of each setup the merged modes are (n, setups), -1 for none; the richest setup is paired first."""
    count = len(setups)
    first = max(range(count), key=lambda s: (len(setups[s].poles), setups[s].confidence.sum()))
    rows: list[list[int]] = []
    for s in (first, *(s for s in range(count) if s != first)):
        modes = setups[s]
        partner = np.full(len(modes.poles), -1)
        if rows and len(modes.poles):
            lead = [next((q, k) for q, k in enumerate(row) if k >= 0) for row in rows]
            f = np.array([setups[q].frequency_hz[k] for q, k in lead])
            participation = np.array([setups[q].participation[:, k] for q, k in lead]).T
            far = np.abs(np.log(modes.frequency_hz / f[:, None])) / SAME_MODE_OF_SETUPS
            unlike = 0.5 * (1 - mac(participation, modes.participation))
            partner = best_pairs(np.where(far < 1, WORTH_OF_PAIR - far - unlike, 0.0).T)
        for k, row in enumerate(partner):
            if row >= 0:
                rows[row][s] = k
            else:
                rows.append([k if q == s else -1 for q in range(count)])
    members = np.array(rows, dtype=np.intp).reshape(-1, count)
    return members[(members >= 0).mean(axis=1) >= least]


def _mean(setups: Sequence[IdentifiedModes], row: Index) -> tuple[complex, ModeEvidence]:
    """Pole of one mode by weights of inverse variance (theory eq. I21), and evidence.

    Scatter over setups is added to that over orders.
    """
    having = [(setups[s], int(k)) for s, k in enumerate(row) if k >= 0]
    each = [modes.evidence[k] for modes, k in having]
    f, z = (np.array([getattr(modes, name)[k] for modes, k in having]) for name in ("frequency_hz", "damping_ratio"))
    var_f = np.array([_variance(e.frequency_sigma, e.frequency_scatter) for e in each]) * f**2
    var_z = np.array([_variance(e.damping_sigma, e.damping_scatter) for e in each]) * z**2
    between = _between(f, var_f)
    hz, sigma_f, weight_f = _weighted(f, var_f, between)
    ratio, sigma_z, weight_z = _weighted(z, var_z, _between(z, var_z))
    scatter_f = np.array([e.frequency_scatter for e in each])
    scatter_z = np.array([e.damping_scatter for e in each])
    evidence = ModeEvidence(
        confidence=float(np.mean([e.confidence for e in each]) * len(having) / len(row)),
        frequency_scatter=float(np.hypot(weight_f @ scatter_f, np.sqrt(weight_f @ (f - hz) ** 2) / hz)),
        damping_scatter=float(np.hypot(weight_z @ scatter_z, abs(np.sqrt(weight_z @ (z - ratio) ** 2) / ratio))),
        modal_phase_collinearity=1.0,
        mean_phase_deviation_deg=0.0,
        frequency_sigma=float(sigma_f / hz),
        damping_sigma=float(sigma_z / abs(ratio)),
        share=float(np.mean([e.share for e in each])),
        setups=len(having),
        setup_shift=float(np.sqrt(between) / hz),
        frequency_bias=float(weight_f @ [e.frequency_bias for e in each]),
        damping_bias=float(weight_z @ [e.damping_bias for e in each]),
    )
    size = 2 * np.pi * hz
    return complex(-ratio * size, size * np.sqrt(max(1 - ratio**2, 0.0))), evidence


def _variance(sigma: float, scatter: float) -> float:
    """Relative variance by the misfit, or over orders where there was no non-linear fit."""
    return (sigma or scatter) ** 2


def _between(x: Array, variance: Array) -> float:
    """Variance between setups beyond their own: the unweighted estimate by moments of Hedges and Olkin (1985).

    Zero where noise explains all differences.
    """
    sure = np.isfinite(variance)
    x, variance = x[sure], np.maximum(variance[sure], (BEST_KNOWN * x[sure]) ** 2)
    if len(x) < 2 or (np.abs(x - _weighted(x, variance, 0.0)[0]) <= NOISE_SIGMAS * np.sqrt(variance)).all():
        return 0.0
    return float(max(0.0, x.var(ddof=1) - variance.mean()))


def _weighted(x: Array, variance: Array, between: float) -> tuple[float, float, Array]:
    """Mean by inverse variance, the standard deviation that these variances give it, and weights of sum one."""
    whole = np.where(np.isfinite(variance), np.maximum(variance, (BEST_KNOWN * x) ** 2) + between, np.inf)
    least = whole.min()
    weight = least / whole if np.isfinite(least) else np.ones(len(x))
    weight = weight / weight.sum()
    used = weight > 0
    return float(weight @ x), float(np.sqrt((weight[used] ** 2) @ variance[used])), weight


def _lead(setups: Sequence[IdentifiedModes], members: Index) -> int:
    """The setup that determines the modes of a group, `members` (k, setups), best, of those that have most of them."""

    def rank(s: int) -> tuple[int, float]:
        evidence = [setups[s].evidence[k] for k in members[:, s] if k >= 0]
        return -len(evidence), sum(_variance(e.damping_sigma, e.damping_scatter) for e in evidence)

    return min(range(len(setups)), key=rank)


def _base(setups: Sequence[IdentifiedModes], members: Index, groups: Sequence[Index], lead: Sequence[int]) -> Complex:
    """Participation (m, n) to which all setups are scaled: that of the leading setup where it has the mode."""
    columns = []
    for group, first in zip(groups, lead, strict=True):
        for row in members[group]:
            s = first if row[first] >= 0 else int(np.argmax(row >= 0))
            column = setups[s].participation[:, row[s]]
            columns.append(column / np.linalg.norm(column))
    return np.array(columns).T


def _groups(poles: Complex) -> list[Index]:
    """Modes merged as a space: consecutive ones that lie nearer than a quarter of a half-power half-width."""
    decay = np.abs(poles.real)
    gap = np.abs(np.diff(poles)) > ONE_SPACE * np.minimum(decay[1:], decay[:-1])
    return [part for part in np.split(np.arange(len(poles)), np.flatnonzero(gap) + 1) if len(part)]


def _have_one_pole(modes: IdentifiedModes, at: Index) -> bool:
    """Whether some modes of a setup, all of which it has, are repeated."""
    return bool((at >= 0).all() and (modes.poles[at] == modes.poles[at[0]]).all())


def _shapes(
    modes: IdentifiedModes, matrix: ResponseMatrix, at: Index, poles: Complex, base: Complex, groups: Sequence[Index]
) -> Complex:
    """Shapes (p, n) of a setup that belong to a common participation (theory eq. I22).

    Modes that the setup does not have are fitted to what its own leave over.
    """
    has = at >= 0
    left, right = np.zeros((len(modes.outputs), len(poles)), dtype=complex), base.copy()
    left[:, has], right[:, has] = modes.shapes[:, at[has]], modes.participation[:, at[has]]
    if not has.all():
        rest = replace(matrix, response=matrix.response - modes_of_setup(modes, matrix))
        fit = fit_shapes(rest, poles[~has], base[:, ~has] / matrix.column_scale[:, None])
        left[:, ~has] = fit.shapes * matrix.row_scale[:, None]
        right[:, ~has] = fit.participation * matrix.column_scale[:, None]
    shapes = np.empty_like(left)
    for group in groups:
        common = base[:, group]
        shapes[:, group] = left[:, group] @ (right[:, group].T @ np.linalg.pinv(common.T, rcond=1e-6))
    return shapes


def _stacked(
    setups: Sequence[IdentifiedModes], parts: Sequence[Complex]
) -> tuple[tuple[MeasuredChannel, ...], Complex]:
    """All channels, each once, and their shapes, means where several setups have the channel at one place."""
    rows: dict[object, list[tuple[MeasuredChannel, Complex]]] = {}
    for s, (modes, part) in enumerate(zip(setups, parts, strict=True)):
        for channel, row in zip(modes.outputs, part, strict=True):
            known = channel.node is not None or channel.position is not None
            place = (channel.location, channel.direction, channel.quantity) if known else (s, channel.name)
            rows.setdefault(place, []).append((channel, row))
    shapes = np.array([np.mean([row for _, row in same], axis=0) for same in rows.values()])
    return tuple(same[0][0] for same in rows.values()), shapes


def _notes(poles: Complex, members: Index, shifts: Sequence[float]) -> list[str]:
    """Modes that some setups lack, and those whose frequencies differ between setups."""
    hz, count = [in_hz(abs(pole) / (2 * np.pi)) for pole in poles], members.shape[1]
    having = zip(hz, (members >= 0).sum(axis=1), strict=True)
    notes = [f"the mode at {f} is found in {n} of {count} setups" for f, n in having if n < count]
    moving = [f"{f} ({100 * shift:.2g} %)" for f, shift in zip(hz, shifts, strict=True) if shift > NAMED_SHIFT]
    if moving:
        why = "by more than their noise, as sensors' masses make them"
        notes.append(f"frequencies differ between setups {why}: {', '.join(moving)}")
    return notes
