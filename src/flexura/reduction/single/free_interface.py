"""Free-interface reduction of one substructure with residual flexibility (MacNeal 1971; Rubin 1975; theory eqs. R2-R5).

Rubin's basis holds elastic normal modes of the free substructure, the residual flexibility of the interface, and for a
substructure that floats its rigid motions, with inertia relief. In coordinates of interface displacements it spans
the constraint modes and, with the interface at rest, what is left of the normal modes and of inertia relief once their
interface displacement is taken off by constraint modes (Craig and Chang 1977). It is built that way here: no residual
is a difference of large numbers, static response is exact, and coordinates and assembly are those of Craig and Bampton.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from flexura.arrays import Array
from flexura.linalg import count_below, lowest, scaled, unit_scale
from flexura.reduction.single.craig_bampton import CraigBampton, ReducedPart

DEPENDENT = 1e-10
"""Relative size below which what a vector adds to the basis counts as round-off."""


def free_interface(modes: CraigBampton, count: int = 0, below_hz: float = 0.0) -> ReducedPart:
    """Reduce by elastic normal modes of the free substructure and residual flexibility of its interface (Rubin 1975).

    The lowest `count` modes are kept, and all below `below_hz` Hz if that is more. The interior coordinates are
    decoupled; `frequencies` are their Ritz values with the interface held. With neither, these are the constraint modes
    alone. Raises SolverError when the interior is singular.
    """
    inner = modes.interior
    if not len(inner) or not (count or below_hz):
        return modes.reduced(0)
    # freedoms without stiffness and mass, such as those of nodes that others only pass through, are no part of this
    own = np.flatnonzero((modes.K.diagonal() > 0) | (modes.M.diagonal() > 0))
    K, M = modes.K[own][:, own], modes.M[own][:, own]
    rigid = _rigid_count(modes)
    if below_hz:
        count = max(count, count_below(K, M, (2 * np.pi * below_hz) ** 2) - rigid)
    pairs = lowest(K, M, min(rigid + count, len(own)))
    shapes = np.zeros((modes.K.shape[0], len(pairs.values)))
    shapes[own] = np.where(np.isfinite(pairs.values), pairs.vectors, 0.0)
    at_rest = shapes[inner, rigid:] - modes.constraint_modes @ shapes[modes.boundary, rigid:]
    relief = modes.solve((modes.M @ shapes[:, :rigid])[inner]) if rigid else np.empty((len(inner), 0))
    return modes.reduced_by(_independent(modes, np.hstack([at_rest, relief])))


def _rigid_count(modes: CraigBampton) -> int:
    """Number of motions of the substructure that strain nothing: those of its condensed stiffness, and of freedoms that
    have mass alone."""
    part = modes.reduced(0)
    b = len(modes.boundary)
    stiff, mass = np.diagonal(part.K)[:b], np.diagonal(part.M)[:b]
    loose = stiff <= 0
    held = np.flatnonzero(~loose)
    own = part.K[np.ix_(held, held)]
    zeros = (la.eigvalsh(scaled(own, unit_scale(own))) < DEPENDENT).sum()
    return int(zeros + (loose & (mass > 0)).sum())


def _independent(modes: CraigBampton, vectors: Array) -> Array:
    """Interior vectors (i, k) of unit strain energy, without those that the others already span."""
    energy = np.einsum("ik,ik->k", vectors, modes.stiffness @ vectors)
    vectors = vectors[:, energy > 0] / np.sqrt(energy[energy > 0])
    gram = vectors.T @ (modes.stiffness @ vectors)
    values, Z = la.eigh((gram + gram.T) / 2)
    kept = values > DEPENDENT
    return vectors @ (Z[:, kept] / np.sqrt(values[kept]))
