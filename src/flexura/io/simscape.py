"""Reduced elastic parts for the block Reduced Order Flexible Solid of Simscape Multibody."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexura.arrays import Array
from flexura.beam import rigid_arm
from flexura.errors import OptionError, SolverError
from flexura.full_order import assemble
from flexura.io.arrays import save_mat
from flexura.io.contents import model_error_notes
from flexura.linalg import lowest
from flexura.reduction import LowOrderModel, NestedModel, nested

STRAIN = 1e-9
"""Strain energy of a rigid motion over the sum of its terms' sizes beyond which it is not round-off."""

MASS = 1e-6
"""Relative difference from the mass of the full-order model beyond which nothing is written."""

_HELD = (
    "the part is held to ground or tied to it by springs, and a flexible body for Simscape floats: describe it without"
    " them, name what was held as interface, and hold those frames in Simscape"
)


def write_simscape(
    low: LowOrderModel | NestedModel,
    path: str | Path,
    frames: Sequence[str] | None = None,
    keep: int | None = None,
    damping_ratio: float = 0.0,
) -> Path:
    """Write `Origins` (f, 3), m, `K` and `M` (6f + a, 6f + a), SI, of a floating part as a MATLAB file.

    The `frames` are nodes of the low-order model, by default those whose static response is exact; all must be free, so
    reduce a description without ground. Rows are tx ty tz rx ry rz of every frame in the global axes, then `a`
    amplitudes of normal modes with the frames held (the lowest `keep`, default all). With a damping ratio also `C`,
    which gives each elastic mode of the free part that ratio and damps no rigid motion, C = M Phi diag(2 zeta omega)
    Phi' M. Also FrameName, CoordinateName and FrequencyHz, the elastic natural frequencies of the free part.

    What is written has been tested: six rigid motions strain nothing, and have the mass of the full-order model.
    Raises OptionError for parts that are held, for frames that are held or move as one body, and when the file cannot
    be written; SolverError when the test fails.
    """
    if not isinstance(low, LowOrderModel | NestedModel):
        raise OptionError(f"Simscape takes a model that `reduce` or `nested` has made, not a {type(low).__name__}")
    if not 0 <= damping_ratio < 1:
        raise OptionError(f"a damping ratio is between 0 and 1, not {damping_ratio}")
    if isinstance(low, NestedModel):
        if frames is not None or keep is not None:
            raise OptionError("a nested model has its frames and amplitudes already")
        floating = low
    else:
        if low.plan.topology.held.any() or any(
            len(spring.nodes) == 1 for floating in low.plan.parts.values() for spring in floating.springs.values()
        ):
            raise OptionError(_HELD)
        floating = nested(low, frames, keep=keep)
    model, names = floating.model, list(floating.names)
    K, M = np.asarray(model.K), np.asarray(model.M)
    x = model.positions[model.plan.topology.numbers(names)]
    K = _verified(floating, K, M, x)
    pairs = lowest(K, M, len(K))
    elastic = np.isfinite(pairs.values) & (np.arange(len(pairs.values)) >= 6)
    omega, shapes = np.sqrt(np.maximum(pairs.values[elastic], 0)), pairs.vectors[:, elastic]
    items = {
        "Name": model.plan.mechanism.name,
        "Origins": x,
        "K": K,
        "M": M,
        "FrameName": names,
        "CoordinateName": list(model.coordinate_names),
        "FrequencyHz": omega[:, None] / (2 * np.pi),
        "Notes": model_error_notes(model),
    }
    if damping_ratio:
        forces = M @ shapes
        C = forces * (2 * damping_ratio * omega) @ forces.T
        items["C"] = (C + C.T) / 2
    return save_mat(items, path)


def _verified(part: NestedModel, K: Array, M: Array, x: Array) -> Array:
    """K freed of the round-off by which rigid motions of the frames strain it.

    Raises OptionError when they strain it by more, and SolverError when they have not the mass and inertia of the
    full-order model.
    """
    R, centred = np.zeros((len(K), 6)), np.zeros((len(K), 6))
    R[: 6 * len(x)], centred[: 6 * len(x)] = (rigid_arm(p).reshape(-1, 6) for p in (x, x - x.mean(axis=0)))
    strained = np.abs(np.einsum("ik,ij,jk->k", centred, K, centred))
    size = np.einsum("ik,ij,jk->k", np.abs(centred), np.abs(K), np.abs(centred))
    if (strained > STRAIN * size).any():
        raise OptionError(_HELD)
    full = assemble(part.model.plan, part.model.parameters)
    motions = full.rigid_body_motions()
    expected = motions.T @ (full.M @ motions)
    rigid_mass = R.T @ M @ R
    scale = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    if (np.abs(rigid_mass - expected) > MASS * scale).any():
        raise SolverError("the rigid mass of the reduced part is not that of the full-order model: name other frames")
    scale = np.ones(len(K))
    scale[: 6 * len(x)] = np.tile([1.0, 1.0, 1.0, *3 * [1 / (np.ptp(x, axis=0).max() or 1.0)]], len(x))
    Q = np.linalg.qr(centred / scale[:, None])[0]
    K = K * scale * scale[:, None]
    K = K - Q @ (Q.T @ K)
    K = (K - (K @ Q) @ Q.T) / scale / scale[:, None]
    return (K + K.T) / 2
