"""Derivatives of natural frequencies alone, as searches and studies step along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array
from flexura.duals import slope_of
from flexura.errors import OptionError
from flexura.linalg import Eigenpairs, lowest_groups
from flexura.modal import REPEATED_EIGENVALUES
from flexura.sensitivity.eigenpairs import GUARD, clusters, whole_clusters
from flexura.sensitivity.energies import Pairs, energy_slopes
from flexura.sensitivity.variation import FullOrderFamily
from flexura.structure import Design, stiffness_and_mass


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


def frequency_slopes(design: Design, n: int) -> FrequencySlopes:
    """The `n` lowest natural frequencies of the full-order model of a design, made `with_slopes`, and their exact
    derivatives.

    Theory eqs. K1-K4. Raises OptionError for a pose that is described, and SolverError.
    """
    design.plan.refuse_pose("derivatives of frequencies")
    if n < 1:
        raise OptionError(f"the number of frequencies is at least 1, not {n}")
    pairs = _pairs(design.still, n)
    groups = clusters(pairs.values)
    forms = iter(_forms(design, pairs.vectors, Pairs.of(groups, pairs.values)).T)
    omega = np.sqrt(np.maximum(pairs.values, 0.0))
    slope = np.zeros((len(omega), len(slope_of(design.values))))
    repeated, directional = [], []
    for at in groups:
        w = omega[at].mean()
        space = np.array([next(forms) for _ in range(len(at) ** 2)]).reshape(len(at), len(at), -1)
        space = (space + space.swapaxes(0, 1)) / (8 * np.pi * w) if w else np.zeros(space.shape)
        smooth = np.flatnonzero(np.isfinite(space).all(axis=(0, 1)))
        slope[at] = np.nan
        slope[np.array(at)[:, None], smooth] = np.linalg.eigvalsh(np.moveaxis(space[..., smooth], -1, 0)).T
        if len(at) > 1:
            repeated.append(tuple(at))
            directional.append(space)
    kinks = tuple(np.flatnonzero(np.isnan(slope).any(axis=0)).tolist())
    return FrequencySlopes(omega / (2 * np.pi), slope, tuple(repeated), tuple(directional), kinks)


def _pairs(design: Design, n: int) -> Eigenpairs:
    """The `n` lowest pairs of a design without slopes, and further copies of the last."""
    (K, M), family = stiffness_and_mass(design), FullOrderFamily(design.plan)
    found = lowest_groups(K, M, n, GUARD, REPEATED_EIGENVALUES, lambda X: family.products_of(design, X)[0])
    return found or whole_clusters(K, M, n)


def _forms(design: Design, X: Array, pairs: Pairs) -> Array:
    """x_a' (K' - lambda M') x_b (P, q) for pairs of modes; by the energies of elements where nothing is loaded."""
    if not design.plan.is_loaded:
        return energy_slopes(design, X, pairs)
    a, b, value = pairs
    found = []
    for change in FullOrderFamily(design.plan).changes_of(design, X):
        own = (X[:, a] * (change.K[:, b] - value * change.M[:, b])).sum(axis=0)
        found.append(own if change.is_smooth else np.full(len(value), np.nan))
    return np.array(found)
