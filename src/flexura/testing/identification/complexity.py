"""Complex shapes: how far they are from real ones, their scale, and what makes a mode trustworthy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexura.arrays import Array, Complex
from flexura.linalg import leading, turned
from flexura.testing.measurement import IdentifiedModes, MeasuredChannel, ModeEvidence, Poles

ALONG = 0.999
"""Cosine between the directions of an input and an output at one node that are a driving point."""

ROTATIONS = ("rotation", "angular_velocity", "angular_acceleration")
"""Quantities whose partner in work is a moment."""

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


def scaled(
    poles: Complex,
    shapes: Complex,
    participation: Complex,
    inputs: Sequence[MeasuredChannel],
    outputs: Sequence[MeasuredChannel],
) -> tuple[Complex, Complex, tuple[str, ...]]:
    """Shapes and participation scaled to `unit modal mass` where a driving point moves, else to `unit participation`.

    With unit modal mass the residue at a driving point is shape^2 / (2 i Im s) (theory eq. I18). Shapes are turned
    towards the real axis, the largest entry positive.
    """
    points = driving_points(inputs, outputs)
    factor = np.ones(shapes.shape[1], dtype=complex)
    how = ["unit participation"] * len(factor)
    for r in range(len(factor)):
        largest = np.abs(shapes[:, r]).max()
        i, j, sign = max(points, key=lambda at: abs(shapes[at[0], r]), default=(0, 0, 0))
        if sign and abs(shapes[i, r]) > 0.05 * largest:
            factor[r] = np.sqrt(2j * poles[r].imag * sign * participation[j, r] / shapes[i, r])
            how[r] = "unit modal mass"
        else:
            factor[r] = np.linalg.norm(participation[:, r])
    left, right = shapes * factor, participation / factor
    turn = np.where(np.array(how) == "unit modal mass", 1.0, np.exp(-1j * phase(left)))
    left, right = left * turn, right / turn
    sign = np.where(np.take_along_axis(left, leading(np.abs(left), axis=0)[None], axis=0)[0].real < 0, -1.0, 1.0)
    return left * sign, right * sign, tuple(how)


def untangled(
    poles: Complex,
    shapes: Complex,
    participation: Complex,
    group: Sequence[int],
    inputs: Sequence[MeasuredChannel],
    outputs: Sequence[MeasuredChannel],
) -> tuple[Complex, Complex]:
    """Shapes (p, k) and participation (m, k) of a group of modes with one pole, as real as their residue allows.

    Any mixture of repeated modes is one of their shapes. The right singular vectors of the real residue are taken,
    turned so that both have unit modal mass where there are as many driving points (theory eq. I19).
    """
    k = list(group)
    residue = shapes[:, k] @ participation[:, k].T
    real = (residue * np.exp(-1j * phase(residue.reshape(-1, 1)))).real
    right = np.linalg.svd(real)[2][: len(k)].T
    left = residue @ right
    points = driving_points(inputs, outputs)
    if len(points) >= len(k):
        at, of = [i for i, _, _ in points], [j for _, j, _ in points]
        sign = np.array([s for _, _, s in points])[:, None]
        G = (np.linalg.pinv(2j * poles[k].imag.mean() * left[at], rcond=1e-3) @ (sign * right[of])).real
        turn = np.linalg.eigh(G + G.T)[1]
        left, right = left @ turn, right @ turn
    return left, right.astype(complex)


def driving_points(
    inputs: Sequence[MeasuredChannel], outputs: Sequence[MeasuredChannel]
) -> list[tuple[int, int, float]]:
    """Pairs (output, input, sign) of a force and a motion along it at one place."""
    found = []
    for i, out in enumerate(outputs):
        for j, into in enumerate(inputs):
            if None in (out.node, into.node, out.direction, into.direction) or out.location != into.location:
                continue
            along = float(np.dot(out.direction or (), into.direction or ()))
            fits = into.quantity == ("moment" if out.quantity in ROTATIONS else "force")
            if fits and abs(along) > ALONG:
                found.append((i, j, float(np.sign(along))))
    return found


def confidence_of(
    share: float, frequency_scatter: float, damping_scatter: float, frequency_sigma: float, damping_sigma: float
) -> float:
    """Confidence in a mode, 0 to 1 (theory eq. I14)."""
    f = (frequency_scatter**2 + frequency_sigma**2) / HALF_FREQUENCY**2
    z = (damping_scatter**2 + damping_sigma**2) / HALF_DAMPING**2
    return float(share / ((1 + f) * (1 + z)))


def assembled(
    name: str,
    modes: tuple[Complex, Complex, Complex],
    channels: tuple[tuple[MeasuredChannel, ...], tuple[MeasuredChannel, ...]],
    evidence: Sequence[ModeEvidence],
    diagrams: tuple[Poles, ...],
    error: float,
    notes: tuple[str, ...],
    repeated: Sequence[Sequence[int]] = (),
) -> IdentifiedModes:
    """Poles, shapes and participation with shapes scaled, their complexity, and notes on doubtful damping.

    Groups of repeated modes are untangled.
    """
    poles, shapes, participation = modes
    for group in repeated:
        k = list(group)
        shapes[:, k], participation[:, k] = untangled(poles, shapes, participation, group, *channels)
    shapes, participation, how = scaled(poles, shapes, participation, *channels)
    mpc, mpd = collinearity(shapes), phase_deviation(shapes)
    full = [
        replace(e, modal_phase_collinearity=float(c), mean_phase_deviation_deg=float(d))
        for e, c, d in zip(evidence, mpc, mpd, strict=True)
    ]
    negative = [f"{abs(s) / (2 * np.pi):.5g}" for s in poles if s.real >= 0]
    if negative:
        listed = ", ".join(negative)
        notes = (*notes, f"no damping is left at {listed} Hz once that of the exponential window is taken out")
    real = real_shapes(shapes)
    return IdentifiedModes(
        name, poles, shapes, real, participation, *channels, tuple(full), diagrams, error, notes, how
    )
