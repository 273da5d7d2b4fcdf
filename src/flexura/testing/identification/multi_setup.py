"""Multi-setup merging: mean poles, and shapes of all channels on one scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.errors import OptionError
from flexura.modal import best_pairs, mac
from flexura.tables import in_hz
from flexura.testing.identification.evidence import assembled
from flexura.testing.identification.residues import fit_shapes
from flexura.testing.measurement import (
    IdentifiedModes,
    MeasuredChannel,
    ModeEvidence,
    ResponseMatrix,
    key_of,
    responses,
)

SHIFT = 0.1
"""Frequencies of one mode differ by less between setups, relative."""

PAIR = 10.0
"""What a pair of modes of two setups counts before its differences are taken off: more pairs go before nearer ones."""

EXACT = 1e-9
"""Frequencies and damping ratios are not known better than this, relative."""

NOISE = 3.0
"""Values of setups within so many of their standard deviations from the mean do not differ by more than noise."""

MOVING = 1e-3
"""Frequencies that differ by more between setups, relative, and more than by noise, are named."""

LEAST_SETUPS = 0.5
"""A mode is found in so many of the setups at least."""

REPEATED = 0.25
"""Modes nearer than so many half-power half-widths are merged as a space."""


def merged(
    name: str, found: Sequence[IdentifiedModes], matrices: Sequence[ResponseMatrix], notes: Sequence[str]
) -> IdentifiedModes:
    """Modes of several setups that share their inputs, or else their outputs (theory eqs. I20-I22).

    A mode is taken that half of the setups have; its frequency and damping are weighted means, its shape is put
    together from the residues in all of them. Raises OptionError when no input and no output is shared, and when no
    mode is.
    """
    each = [replace(one, name=one.setup or f"setup {k + 1}") for k, one in enumerate(found)]
    by_inputs, common = _shared(found)
    if not by_inputs:
        found, matrices = [_flipped(own) for own in found], [own.transposed for own in matrices]
    left_out = sorted({c.name for own in found for c in own.inputs if key_of(c) not in map(key_of, common)})
    if left_out:
        notes = (*notes, f"not in all setups, and not used to merge them: {', '.join(left_out)}")
    pairs = [_ordered(common, own, matrix) for own, matrix in zip(found, matrices, strict=True)]
    found, matrices = [own for own, _ in pairs], [matrix for _, matrix in pairs]
    first = max(range(len(found)), key=lambda k: (len(found[k].poles), found[k].confidence.sum()))
    members = _members(found, first)
    if not len(members):
        raise OptionError("no mode is found in half of the setups; identify them one by one, or pick frequencies")
    poles, evidence = _averaged(found, members)
    at = np.argsort(np.abs(poles))
    poles, members, evidence = poles[at], members[at], [evidence[k] for k in at]
    groups = _groups(poles)
    lead = _leads(found, members, groups)
    equal = [g for g, s in zip(groups, lead, strict=True) if len(g) > 1 and _equal(found[s], members[g, s])]
    for group in equal:
        poles[group] = poles[group].mean()
    base = _base(found, members, groups, lead)
    every = zip(found, matrices, members.T, strict=True)
    parts = [_shapes(own, matrix, at, poles, base, groups) for own, matrix, at in every]
    outputs, shapes = _stacked([own.outputs for own in found], parts)
    channels = (found[0].inputs, outputs)
    if not by_inputs:
        shapes, base, channels = base, shapes, (outputs, found[0].inputs)
    diagrams = tuple(d for own in found for d in own.diagram)
    error = float(np.sqrt(np.mean([own.synthesis_error**2 for own in found])))
    said = (*notes, *(note for own in found for note in own.notes), *_absent(poles, members), *_moving(poles, evidence))
    repeated = [group.tolist() for group in equal]
    modes = assembled(name, (poles, shapes, base), channels, evidence, diagrams, error, said, repeated)
    return replace(modes, setups=tuple(each), band=found[0].band)


def modes_of_setup(own: IdentifiedModes, matrix: ResponseMatrix) -> Complex:
    """Responses (f, p, m) that modes and residuals give back, in the quantity and with the window of a matrix."""
    H = responses(matrix.s, own.poles, own.shapes, own.participation, own.lower, own.upper)
    return H * matrix.s[:, None, None] ** matrix.power


def _shared(found: Sequence[IdentifiedModes]) -> tuple[bool, list[MeasuredChannel]]:
    """Whether setups are merged by their inputs, and the channels that all have.

    Inputs if all are shared, else outputs if all are, else some inputs, else some outputs. Raises OptionError for none.
    """
    sides = [[own.inputs for own in found], [own.outputs for own in found]]
    common = []
    for side in sides:
        keys = set.intersection(*({key_of(c) for c in own} for own in side))
        common.append([c for c in side[0] if key_of(c) in keys])
    whole = [all(len(own) == len(shared) for own in side) for side, shared in zip(sides, common, strict=True)]
    if not (common[0] or common[1]):
        raise OptionError(
            "setups share neither inputs nor outputs, so their shapes have no common scale; identify them one by one"
        )
    by_inputs = bool(common[0]) and (whole[0] or not (whole[1] and common[1]))
    return by_inputs, common[0 if by_inputs else 1]


def _flipped(own: IdentifiedModes) -> IdentifiedModes:
    """Inputs and outputs in each other's place."""
    sides = {"inputs": own.outputs, "outputs": own.inputs, "shapes": own.participation, "participation": own.shapes}
    residuals = {
        "lower": None if own.lower is None else own.lower.T,
        "upper": None if own.upper is None else own.upper.T,
    }
    return replace(own, **sides, **residuals)


def _ordered(
    inputs: Sequence[MeasuredChannel], own: IdentifiedModes, matrix: ResponseMatrix
) -> tuple[IdentifiedModes, ResponseMatrix]:
    """Modes and matrix of a setup with those inputs only, in their order."""
    position = {key_of(c): k for k, c in enumerate(own.inputs)}
    at = [position[key_of(c)] for c in inputs]
    lists = {"inputs": tuple(own.inputs[k] for k in at)}
    columns = {"response": matrix.response[:, :, at], "column_scale": matrix.column_scale[at]}
    residuals = {
        "lower": None if own.lower is None else own.lower[:, at],
        "upper": None if own.upper is None else own.upper[:, at],
    }
    kept = replace(own, participation=own.participation[at], **residuals, **lists)
    return kept, replace(matrix, **columns, **lists)


def _members(found: Sequence[IdentifiedModes], first: int) -> Index:
    """Which mode of each setup the merged modes are (n, setups), -1 for none."""
    rows: list[list[int]] = [
        [k if s == first else -1 for s in range(len(found))] for k in range(len(found[first].poles))
    ]
    for s, own in enumerate(found):
        if s == first or not len(own.poles):
            continue
        lead = [next((q, k) for q, k in enumerate(row) if k >= 0) for row in rows]
        f = np.array([found[q].frequency_hz[k] for q, k in lead])
        turn = np.array([found[q].participation[:, k] for q, k in lead]).T
        partner = np.full(len(own.poles), -1)
        if rows:
            far = np.abs(np.log(own.frequency_hz / f[:, None])) / SHIFT
            partner = best_pairs(np.where(far < 1, PAIR - far - 0.5 * (1 - mac(turn, own.participation)), 0.0).T)
        for k, row in enumerate(partner):
            if row >= 0:
                rows[row][s] = k
            else:
                rows.append([k if q == s else -1 for q in range(len(found))])
    members = np.array(rows, dtype=np.intp).reshape(-1, len(found))
    return members[(members >= 0).mean(axis=1) >= LEAST_SETUPS]


def _averaged(found: Sequence[IdentifiedModes], members: Index) -> tuple[Complex, list[ModeEvidence]]:
    """Poles (n,) of the merged modes, and their evidence."""
    every = [_mean(found, row) for row in members]
    return np.array([pole for pole, _ in every], dtype=complex), [e for _, e in every]


def _mean(found: Sequence[IdentifiedModes], row: Index) -> tuple[complex, ModeEvidence]:
    """Pole of one mode by weights of inverse variance (theory eq. I21), and evidence.

    Scatter over setups is added to that over orders.
    """
    own = [(s, int(k)) for s, k in enumerate(row) if k >= 0]
    each = [found[s].evidence[k] for s, k in own]
    f, z = (np.array([getattr(found[s], name)[k] for s, k in own]) for name in ("frequency_hz", "damping_ratio"))
    var_f, var_z = (
        np.array([_variance(getattr(e, f"{name}_sigma"), getattr(e, f"{name}_scatter")) for e in each]) * x**2
        for name, x in (("frequency", f), ("damping", z))
    )
    between = _between(f, var_f)
    hz, sigma_f, weight_f = _weighted(f, var_f, between)
    ratio, sigma_z, weight_z = _weighted(z, var_z, _between(z, var_z))
    scatter = [np.array([getattr(e, f"{name}_scatter") for e in each]) for name in ("frequency", "damping")]
    spread = [np.sqrt(weight @ (x - mean) ** 2) / mean for weight, x, mean in ((weight_f, f, hz), (weight_z, z, ratio))]
    evidence = ModeEvidence(
        confidence=float(np.mean([e.confidence for e in each]) * len(own) / len(row)),
        frequency_scatter=float(np.hypot(weight_f @ scatter[0], spread[0])),
        damping_scatter=float(np.hypot(weight_z @ scatter[1], abs(spread[1]))),
        modal_phase_collinearity=1.0,
        mean_phase_deviation_deg=0.0,
        frequency_sigma=float(sigma_f / hz),
        damping_sigma=float(sigma_z / abs(ratio)),
        share=float(np.mean([e.share for e in each])),
        setups=len(own),
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
    x, variance = x[sure], np.maximum(variance[sure], (EXACT * x[sure]) ** 2)
    if len(x) < 2 or (np.abs(x - _weighted(x, variance, 0.0)[0]) <= NOISE * np.sqrt(variance)).all():
        return 0.0
    return float(max(0.0, x.var(ddof=1) - variance.mean()))


def _weighted(x: Array, variance: Array, between: float) -> tuple[float, float, Array]:
    """Mean by inverse variance, the standard deviation that these variances give it, and weights of sum one."""
    whole = np.where(np.isfinite(variance), np.maximum(variance, (EXACT * x) ** 2) + between, np.inf)
    least = whole.min()
    weight = least / whole if np.isfinite(least) else np.ones(len(x))
    weight = weight / weight.sum()
    used = weight > 0
    return float(weight @ x), float(np.sqrt((weight[used] ** 2) @ variance[used])), weight


def _leads(found: Sequence[IdentifiedModes], members: Index, groups: Sequence[Index]) -> list[int]:
    """The setup that determines the modes of each group best, of those that have most of them."""

    def rank(group: Index, s: int) -> tuple[int, float]:
        own = [found[s].evidence[k] for k in members[group, s] if k >= 0]
        return -len(own), sum(_variance(e.damping_sigma, e.damping_scatter) for e in own)

    return [min(range(len(found)), key=lambda s, group=group: rank(group, s)) for group in groups]


def _base(found: Sequence[IdentifiedModes], members: Index, groups: Sequence[Index], lead: Sequence[int]) -> Complex:
    """Participation (m, n) to which all setups are scaled: that of the leading setup where it has the mode."""
    columns = []
    for group, first in zip(groups, lead, strict=True):
        for row in members[group]:
            s = first if row[first] >= 0 else int(np.argmax(row >= 0))
            column = found[s].participation[:, row[s]]
            columns.append(column / np.linalg.norm(column))
    return np.array(columns).T


def _groups(poles: Complex) -> list[Index]:
    """Modes merged as a space: consecutive ones that lie nearer than a quarter of a half-power half-width."""
    gap = np.abs(np.diff(poles)) > REPEATED * np.minimum(np.abs(poles.real[1:]), np.abs(poles.real[:-1]))
    return [part for part in np.split(np.arange(len(poles)), np.flatnonzero(gap) + 1) if len(part)]


def _equal(own: IdentifiedModes, at: Index) -> bool:
    """Whether modes of a setup have one pole."""
    return bool((at >= 0).all() and (own.poles[at] == own.poles[at[0]]).all())


def _shapes(
    own: IdentifiedModes, matrix: ResponseMatrix, at: Index, poles: Complex, base: Complex, groups: Sequence[Index]
) -> Complex:
    """Shapes (p, n) of a setup that belong to a common participation (theory eq. I22).

    Modes that the setup does not have are fitted to what its own leave over.
    """
    has = at >= 0
    left, right = np.zeros((len(own.outputs), len(poles)), dtype=complex), base.copy()
    left[:, has], right[:, has] = own.shapes[:, at[has]], own.participation[:, at[has]]
    if not has.all():
        rest = replace(matrix, response=matrix.response - modes_of_setup(own, matrix))
        fit = fit_shapes(rest, poles[~has], base[:, ~has] / matrix.column_scale[:, None])
        left[:, ~has] = fit.shapes * matrix.row_scale[:, None]
        right[:, ~has] = fit.participation * matrix.column_scale[:, None]
    shapes = np.empty_like(left)
    for group in groups:
        common = base[:, group]
        shapes[:, group] = left[:, group] @ (right[:, group].T @ np.linalg.pinv(common.T, rcond=1e-6))
    return shapes


def _stacked(
    channels: Sequence[tuple[MeasuredChannel, ...]], parts: Sequence[Complex]
) -> tuple[tuple[MeasuredChannel, ...], Complex]:
    """All channels, each once, and their shapes, means where several setups have the channel at one place."""
    place: dict[object, int] = {}
    kept: list[MeasuredChannel] = []
    rows: list[list[Complex]] = []
    for s, (own, part) in enumerate(zip(channels, parts, strict=True)):
        for channel, row in zip(own, part, strict=True):
            known = channel.node is not None or channel.position is not None
            spot = (channel.location, channel.direction, channel.quantity) if known else (s, channel.name)
            if spot not in place:
                place[spot] = len(kept)
                kept.append(channel)
                rows.append([])
            rows[place[spot]].append(row)
    return tuple(kept), np.array([np.mean(own, axis=0) for own in rows])


def _absent(poles: Complex, members: Index) -> list[str]:
    count = (members >= 0).sum(axis=1)
    return [
        f"the mode at {in_hz(abs(pole) / (2 * np.pi))} is found in {n} of {members.shape[1]} setups"
        for pole, n in zip(poles, count, strict=True)
        if n < members.shape[1]
    ]


def _moving(poles: Complex, evidence: Sequence[ModeEvidence]) -> list[str]:
    found = [
        f"{in_hz(abs(pole) / (2 * np.pi))} ({100 * e.setup_shift:.2g} %)"
        for pole, e in zip(poles, evidence, strict=True)
        if e.setup_shift > MOVING
    ]
    if not found:
        return []
    return [
        f"frequencies differ between setups by more than their noise, as sensors' masses make them: {', '.join(found)}"
    ]
