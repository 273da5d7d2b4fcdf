"""What makes a mode trustworthy: how real its shape is, whether the data carry it, and how far it may be biased."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from flexura.arrays import Array, Complex
from flexura.linalg import leading, turned
from flexura.tables import in_hz
from flexura.testing.identification.residues import Fit
from flexura.testing.measurement import IdentifiedModes, MeasuredChannel, ModeEvidence, ResponseMatrix, responses

COLLINEAR = 0.999
"""Cosine between the directions of an input and an output at one node that are a driving point."""

ROTATIONS = ("rotation", "angular_velocity", "angular_acceleration")
"""Quantities whose partner in work is a moment."""

LEAST_DRIVEN = 0.05
"""A driving point scales a mode where it moves by more than this share of the largest entry of the shape."""

HALF_FREQUENCY, HALF_DAMPING = 0.005, 0.25
"""Relative spreads of frequency and of damping that halve the confidence in a mode."""


def phase(shapes: Complex) -> Array:
    """Angle (n,) of the line in the complex plane that each column is nearest to, rad (theory eq. I15)."""
    return np.angle((shapes**2).sum(axis=0)) / 2


def collinearity(shapes: Complex) -> Array:
    """Modal phase collinearity (n,): 1 for columns on a line through zero, 0 for those on a circle (theory eq. I16)."""
    return np.abs((shapes**2).sum(axis=0)) ** 2 / (np.abs(shapes) ** 2).sum(axis=0) ** 2


def phase_deviation(shapes: Complex) -> Array:
    """Mean phase deviation (n,) from that line, weighted by size, degrees (theory eq. I17)."""
    turned = shapes * np.exp(-1j * phase(shapes))
    angle = np.degrees(np.arctan2(np.abs(turned.imag), np.abs(turned.real)))
    return (np.abs(shapes) * angle).sum(axis=0) / np.abs(shapes).sum(axis=0)


def real_shapes(shapes: Complex) -> Array:
    """Real shapes (p, n) nearest to complex ones, the largest entry positive (theory eq. I15)."""
    return turned((shapes * np.exp(-1j * phase(shapes))).real)


class DrivingPoint(NamedTuple):
    """Positions of a force and of a motion along it at one place, and 1 or -1 where they look against each other."""

    output: int
    input: int
    sign: float


def driving_points(inputs: Sequence[MeasuredChannel], outputs: Sequence[MeasuredChannel]) -> list[DrivingPoint]:
    """Pairs of a force and a motion along it at one place."""
    points = []
    for i, out in enumerate(outputs):
        for j, into in enumerate(inputs):
            if None in (out.node, into.node, out.direction, into.direction) or out.location != into.location:
                continue
            along = float(np.dot(out.direction or (), into.direction or ()))
            works = into.quantity == ("moment" if out.quantity in ROTATIONS else "force")
            if works and abs(along) > COLLINEAR:
                points.append(DrivingPoint(i, j, float(np.sign(along))))
    return points


def finished(modes: IdentifiedModes, repeated: Sequence[Sequence[int]] = ()) -> IdentifiedModes:
    """Modes with repeated ones untangled, shapes scaled, how real these are, and a note on damping that is gone."""
    points = driving_points(modes.inputs, modes.outputs)
    shapes, participation = modes.shapes.copy("K"), modes.participation.copy("K")
    for group in map(list, repeated):
        poles = modes.poles[group]
        shapes[:, group], participation[:, group] = _untangled(poles, shapes[:, group], participation[:, group], points)
    scale = _of_largest_one if modes.output_only else partial(_scaled, points=points)
    shapes, participation, scaling = scale(modes.poles, shapes, participation)
    evidence = tuple(
        replace(e, modal_phase_collinearity=float(c), mean_phase_deviation_deg=float(d))
        for e, c, d in zip(modes.evidence, collinearity(shapes), phase_deviation(shapes), strict=True)
    )
    notes = modes.notes
    if negative := ", ".join(f"{abs(s) / (2 * np.pi):.5g}" for s in modes.poles if s.real >= 0):
        notes = (*notes, f"no damping is left at {negative} Hz once that of the exponential window is taken out")
    return replace(
        modes,
        shapes=shapes,
        real_shapes=real_shapes(shapes),
        participation=participation,
        evidence=evidence,
        notes=notes,
        scaling=scaling,
    )


def _of_largest_one(
    poles: Complex, shapes: Complex, participation: Complex
) -> tuple[Complex, Complex, tuple[str, ...]]:
    """Shapes towards the real axis with the largest entry of size one, as they are known of outputs alone."""
    largest = leading(np.abs(shapes), axis=0)[None]
    turn = np.exp(-1j * phase(shapes))
    sign = np.where((np.take_along_axis(shapes, largest, axis=0)[0] * turn).real < 0, -1.0, 1.0)
    factor = sign * turn / np.abs(np.take_along_axis(shapes, largest, axis=0)[0])
    return shapes * factor, participation / factor, ("not scaled",) * len(poles)


def _scaled(
    poles: Complex, shapes: Complex, participation: Complex, points: Sequence[DrivingPoint]
) -> tuple[Complex, Complex, tuple[str, ...]]:
    """Shapes and participation scaled to `unit modal mass` where a driving point moves, else to `unit participation`.

    With unit modal mass the residue at a driving point is shape^2 / (2 i Im s) (theory eq. I18). Shapes are turned
    towards the real axis, the largest entry positive.
    """
    factor = np.linalg.norm(participation, axis=0).astype(complex)
    has_unit_mass = np.zeros(len(factor), dtype=bool)
    for r, shape in enumerate(shapes.T):
        i, j, sign = max(points, key=lambda point: abs(shape[point.output]), default=DrivingPoint(0, 0, 0.0))
        if sign and abs(shape[i]) > LEAST_DRIVEN * np.abs(shape).max():
            factor[r] = np.sqrt(2j * poles[r].imag * sign * participation[j, r] / shape[i])
            has_unit_mass[r] = True
    left, right = shapes * factor, participation / factor
    turn = np.where(has_unit_mass, 1.0, np.exp(-1j * phase(left)))
    left, right = left * turn, right / turn
    sign = np.where(np.take_along_axis(left, leading(np.abs(left), axis=0)[None], axis=0)[0].real < 0, -1.0, 1.0)
    return left * sign, right * sign, tuple(f"unit {'modal mass' if has else 'participation'}" for has in has_unit_mass)


def _untangled(
    poles: Complex, shapes: Complex, participation: Complex, points: Sequence[DrivingPoint]
) -> tuple[Complex, Complex]:
    """Shapes (p, k) and participation (m, k) of k modes with one pole, as real as their residue allows.

    Any mixture of repeated modes is one of their shapes. The right singular vectors of the real residue are taken,
    turned so that both have unit modal mass where there are as many driving points (theory eq. I19).
    """
    residue = shapes @ participation.T
    real = (residue * np.exp(-1j * phase(residue.reshape(-1, 1)))).real
    right = np.linalg.svd(real)[2][: len(poles)].T
    left = residue @ right
    if len(points) >= len(poles):
        forced = np.array([[point.sign * row for row in right[point.input]] for point in points])
        moved = left[[point.output for point in points]]
        G = (np.linalg.pinv(2j * poles.imag.mean() * moved, rcond=1e-3) @ forced).real
        turn = np.linalg.eigh(G + G.T)[1]
        left, right = left @ turn, right @ turn
    return left, right.astype(complex)


def evidence_of(
    share: float, *, scatter: tuple[float, float], sigma: tuple[float, float], bias: tuple[float, float]
) -> ModeEvidence:
    """Evidence of a mode, its shape apart, from relative errors of frequency and of damping (theory eq. I14)."""
    f, z = (a**2 + b**2 for a, b in zip(scatter, sigma, strict=True))
    confidence = float(share / ((1 + f / HALF_FREQUENCY**2) * (1 + z / HALF_DAMPING**2)))
    return ModeEvidence(confidence, *scatter, 1.0, 0.0, *sigma, share, frequency_bias=bias[0], damping_bias=bias[1])


CARRIED, CARRIED_EACH = 30.0, 5.0
"""What a mode adds near its frequency, squared, is so many times the variance of a line of the misfit, and so many
times more for each response: a pole that follows noise gains 2 for each of its numbers, and some by being chosen."""

ROUND_OFF_OF_RESPONSES = 1e-12
"""What a mode adds near its frequency, squared, is also more than this share of the responses, squared: their round-off
where they are free of noise."""

STRUCTURED_MISFIT = 4.0
"""A misfit is more than white noise where its square exceeds what its second difference shows by so many of the
standard deviations, roughly, of that ratio."""

NEAR_MODE = 2.0
"""Lines of a mode lie within so many half-power half-widths."""

NEAREST_LINES = 9
"""So many lines nearest to a mode are its own where fewer lie that near."""

ALIKE_RESIDUES = 0.9
"""Modal assurance criterion of residues that are alike."""


@dataclass(frozen=True)
class _Near:
    """What a mode adds to the scaled responses (l, p, m) at its lines, which are at `s` (l,); those and the misfit."""

    pole: complex
    s: Complex
    part: Complex
    data: Complex
    misfit: Complex


def _near(matrix: ResponseMatrix, fit: Fit, k: int) -> _Near:
    """The lines of mode k."""
    pole = complex(fit.poles[k])
    apart = np.abs(matrix.s.imag - abs(pole.imag))
    at = np.flatnonzero(apart < NEAR_MODE * abs(pole.real))
    if len(at) < NEAREST_LINES:
        at = np.sort(np.argsort(apart, kind="stable")[:NEAREST_LINES])
    one = slice(k, k + 1)
    s, data = matrix.s[at], matrix.scaled[at]
    part = responses(s, fit.poles[one], fit.shapes[:, one], fit.participation[:, one], step=matrix.step)
    return _Near(pole, s, part * s[:, None, None] ** matrix.power, data, data - fit.synthesis[at])


def is_carried(matrix: ResponseMatrix, fit: Fit, k: int) -> bool:
    """Whether a mode adds more to the responses near its frequency than a pole that follows noise (theory eq. I24)."""
    near = _near(matrix, fit, k)
    added, whole = (float((np.abs(H) ** 2).sum()) for H in (near.part, near.data))
    noise = float((np.abs(near.misfit) ** 2).mean()) * (CARRIED + CARRIED_EACH * near.misfit[0].size)
    return added > max(noise, ROUND_OFF_OF_RESPONSES * whole)


def bias(matrix: ResponseMatrix, fit: Fit, k: int) -> tuple[float, float]:
    """How far frequency and damping ratio of a mode may be off by what is not noise, relative (theory eqs. I25, I26).

    By the part of the misfit that neighbouring lines share, and by the width of a line against that of the mode. Zero
    of half spectra, the noise of which neighbouring lines share, and the lines of which have no width.
    """
    if matrix.step:
        return 0.0, 0.0
    near = _near(matrix, fit, k)
    pole, left = near.pole, near.misfit
    uneven = float((np.abs(left[:-2] - 2 * left[1:-1] + left[2:]) ** 2).sum()) / 6 * len(left) / (len(left) - 2)
    square = float((np.abs(left) ** 2).sum())
    moved = 0.0
    if square > (1 + STRUCTURED_MISFIT / np.sqrt(left.size)) * uneven:
        slope = near.part / (near.s - pole)[:, None, None]
        moved = float(np.sqrt((square - uneven) / max(float((np.abs(slope) ** 2).sum()), 1e-300)))
    step = 2 * np.pi * float(np.median(np.diff(matrix.frequency_hz)))
    width = min((step / (2 * abs(pole.real))) ** 2 / 3, 1.0)
    ratio = abs(pole.real) / abs(pole)
    return max(moved / abs(pole), width * ratio), max(moved / abs(pole.real), width)


def close_pairs(matrix: ResponseMatrix, fit: Fit, repeated: list[list[int]]) -> list[str]:
    """Notes on modes that lines cannot tell apart, or that are alike within their width."""
    hz = np.abs(fit.poles) / (2 * np.pi)
    step = float(np.median(np.diff(matrix.frequency_hz)))
    alike = residue_mac(fit)
    notes = []
    for k in range(len(hz) - 1):
        apart, width = float(hz[k + 1] - hz[k]), float(np.abs(fit.poles[k : k + 2].real).mean() / np.pi)
        if any(k in group and k + 1 in group for group in repeated):
            continue
        if apart < step and not matrix.step:
            why = f"closer than the lines, which are {in_hz(step, 3)} apart"
        elif apart < width and alike[k, k + 1] > ALIKE_RESIDUES:
            why = "alike and closer than their half-power width"
        else:
            continue
        notes.append(f"modes at {in_hz(hz[k], 6)} and {in_hz(hz[k + 1], 6)} are {why}: they may be one")
    return notes


def residue_mac(fit: Fit) -> Array:
    """Modal assurance criterion (n, n) of the residues of modes, that of their shapes times that of participation."""
    left, right = (x / np.linalg.norm(x, axis=0) for x in (fit.shapes, fit.participation))
    return np.abs(left.conj().T @ left) ** 2 * np.abs(right.conj().T @ right) ** 2


PEAK_OVER_MEDIAN = 1e3
"""Square of a peak over the median of all lines from which it is no noise: 30 dB; the largest of 100 000 lines of noise
has 12 dB."""

LEAST_OF_WIDTH = 0.05
"""Part of the width of a peak that is taken for damping where a window has added more than there is."""


class LonePeak(NamedTuple):
    """The mode of a peak: its pole, rad/s, participation (m, 1), evidence, and what is said of it."""

    pole: complex
    participation: Complex
    evidence: ModeEvidence
    note: str

    @property
    def hz(self) -> float:
        """Its frequency, Hz."""
        return abs(self.pole) / (2 * np.pi)


def lone_peak(matrix: ResponseMatrix) -> LonePeak | None:
    """The mode of the largest peak of the responses; None where it is less than 30 dB above the median.

    Its frequency is the centre of the lines within half its power, its damping ratio half of their width over that
    (half-power method, D. J. Ewins, Modal Testing, 2000): the most that it may be, since lines and leakage widen it.
    """
    H, hz = matrix.scaled, matrix.frequency_hz
    power = (np.abs(H) ** 2).sum(axis=(1, 2))
    k, middle = int(np.argmax(power)), float(np.median(power))
    if not power[k] > PEAK_OVER_MEDIAN * middle or k in (0, len(hz) - 1):
        return None
    low = high = k
    while low > 0 and power[low - 1] > power[k] / 2:
        low -= 1
    while high < len(hz) - 1 and power[high + 1] > power[k] / 2:
        high += 1
    peak = slice(low, high + 1)
    centre = float(np.average(hz[peak], weights=power[peak]))
    width = (high - low + 1) * float(np.median(np.diff(hz)))
    decay = max(np.pi * width - float(matrix.s.real[0]), LEAST_OF_WIDTH * np.pi * width)
    size = 2 * np.pi * centre
    participation = np.linalg.svd(H[k])[2][:1].conj().T
    evidence = evidence_of(0.0, scatter=(0.0, 0.0), sigma=(0.0, 0.0), bias=(width / (2 * centre), 1.0))
    note = (
        f"no pole is stable over the orders: the mode at {in_hz(centre)} is that of a peak alone,"
        f" {10 * np.log10(power[k] / middle):.0f} dB above the median of the lines; its damping is the most that a peak"
        f" of {in_hz(width, 3)} allows: it has not decayed at the end of the record, or records differ; record longer"
    )
    return LonePeak(complex(-decay, np.sqrt(size**2 - decay**2)), participation, evidence, note)
