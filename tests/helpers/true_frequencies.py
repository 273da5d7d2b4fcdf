"""Natural frequencies of a full-order model from LAPACK, refined in extended precision."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

ASSEMBLED = 1e-7
"""Relative error of frequencies from an assembled stiffness (theory, `Certificates`)."""


def true_frequencies(model, count=None) -> np.ndarray:
    """The natural frequencies of a full-order model, Hz, all or the lowest `count`."""
    K, M = model.K.toarray(), model.M.toarray()
    d = 1 / np.sqrt(K.diagonal() + 1e-300) if (K.diagonal() > 0).all() else np.ones(len(K))
    shift = 0.0
    if np.linalg.eigvalsh(K * d[:, None] * d).min() < 1e-13:
        shift = float(np.median(K.diagonal() / M.diagonal().clip(1e-12))) * 1e-6
    mu, y = la.eigh(M * d[:, None] * d, (K + shift * M) * d[:, None] * d)
    x = (d[:, None] * y).astype(np.longdouble)[:, ::-1][:, : min(int((mu > 1e-14 * mu.max()).sum()), count or len(mu))]
    wide_K, wide_M = model.K.astype(np.longdouble), model.M.astype(np.longdouble)
    values = np.einsum("ik,ik->k", x, wide_K @ x) / np.einsum("ik,ik->k", x, wide_M @ x)
    return np.sqrt(np.sort(np.maximum(values, 0).astype(float))) / (2 * np.pi)


def holds(proof, true) -> bool:
    """True when every interval of a certificate contains what it promises, and the count is right."""
    number = np.arange(len(proof.frequency_hz))
    own = true[number]
    # the reference has the digits that the assembled K has; `tests/proofs` counts with 80 digits
    lower, upper = proof.lower_hz * (1 - ASSEMBLED), proof.upper_hz * (1 + ASSEMBLED)
    indexed = (lower <= own) & (own <= upper)
    inside = ((lower[:, None] <= true) & (true <= upper[:, None])).any(axis=1)
    return bool(np.where(proof.is_indexed, indexed, inside).all()) and proof.count == int((true < proof.below_hz).sum())
