"""Derivatives of natural frequencies alone, as searches and studies step along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexura.errors import OptionError
from flexura.sensitivity.eigenpairs import moved_clusters, whole_clusters
from flexura.sensitivity.variation import FullOrderFamily
from flexura.structure import Plan

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrequencySlopes:
    """The lowest natural frequencies (n,), Hz, and their derivatives `slope` (n, P), Hz per SI unit, by P parameters.

    Where the last one is repeated all its copies are there. `repeated` has the positions of frequencies that coincide;
    for each such group `directional` is the matrix (m, m, P), Hz per SI unit, whose eigenvalues along a direction in
    the space of parameters are the derivatives of the m frequencies along it; their rows of `slope` are those along one
    parameter each, ascending. `kinks` are positions of parameters by which nothing has a derivative here: NaN.
    """

    frequency_hz: Array
    slope: Array
    repeated: tuple[tuple[int, ...], ...]
    directional: tuple[Array, ...]
    kinks: tuple[int, ...]


def frequency_slopes(plan: Plan, parameters: Mapping[str, float], names: Sequence[str], n: int) -> FrequencySlopes:
    """The `n` lowest natural frequencies of the full-order model of one design and their exact derivatives by `names`.

    Theory eqs. K1-K4. Raises OptionError as `Design.of` does and for a pose that is described, and SolverError.
    """
    plan.refuse_pose("derivatives of frequencies")
    if n < 1:
        raise OptionError(f"the number of frequencies is at least 1, not {n}")
    family = FullOrderFamily(plan)
    model = family.model(parameters)
    pairs = whole_clusters(model.K, model.M, n)
    changes = family.changes(parameters, names, pairs.vectors)
    omega = np.sqrt(np.maximum(pairs.values, 0.0))
    slope = np.zeros((len(omega), len(names)))
    repeated, directional = [], []
    for cluster in moved_clusters(model.K, model.M, pairs, changes, shapes=False):
        w = omega[cluster.at].mean()
        own = cluster.slope / (4 * np.pi * w) if w else np.zeros(cluster.slope.shape)
        slope[cluster.at] = np.linalg.eigvalsh(own).T
        if len(cluster.at) > 1:
            repeated.append(tuple(cluster.at))
            directional.append(np.moveaxis(own, 0, -1))
    kinks = tuple(p for p, change in enumerate(changes) if not change.is_smooth)
    slope[:, list(kinks)] = np.nan
    for own in directional:
        own[:, :, list(kinks)] = np.nan
    return FrequencySlopes(omega / (2 * np.pi), slope, tuple(repeated), tuple(directional), kinks)
