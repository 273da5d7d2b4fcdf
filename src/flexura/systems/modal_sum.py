"""Sums over modes: the response of many inputs and outputs at many frequencies (theory eq. T10)."""

from __future__ import annotations

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.kernels import Kernel, is_compiled

CACHED_FREQUENCIES = 512
"""Frequencies that are summed at a time, so that their arrays stay in the processor's cache."""

_compiled = Kernel("modal_sum", "anaaanananaaa")


def modal_sum(w: Array, square: Array, damping: Array, loss: Array, C: Array, B: Array) -> Complex:
    """Sum over modes of c_r b_r / (omega_r^2 - w^2 + i (w d_r + l_r sgn w)), (f, p, m), at frequencies w (f,), rad/s,
    from `square` omega^2, `damping` d and `loss` l (r,), C (p, r) and B (r, m)."""
    p, m = len(C), B.shape[1]
    residues = (C.T[:, :, None] * B[:, None, :]).reshape(len(B), p * m)
    both: Index = np.arange(p * m, dtype=np.intp)
    if p == m and np.array_equal(C.T, B):
        square_of = both.reshape(p, p)
        both = np.minimum(square_of, square_of.T).ravel()
    if is_compiled():
        return _by_kernel(w, square, damping, loss, residues, both).reshape(len(w), p, m)
    H: Complex = np.empty((len(w), p * m), dtype=complex)
    for start in range(0, len(w), CACHED_FREQUENCIES):
        chunk = slice(start, start + CACHED_FREQUENCIES)
        stiff = square - w[chunk, None] ** 2
        lossy = w[chunk, None] * damping + np.sign(w[chunk, None]) * loss
        with np.errstate(divide="ignore", invalid="ignore"):
            size = stiff * stiff
            size += lossy * lossy
            np.divide(1.0, size, out=size)
            np.multiply(stiff, size, out=stiff)
            np.multiply(lossy, size, out=lossy)
            H[chunk].real, H[chunk].imag = stiff @ residues, -(lossy @ residues)
    return H.reshape(len(w), p, m)


def _by_kernel(w: Array, square: Array, damping: Array, loss: Array, residues: Array, both: Index) -> Complex:
    """The same (f, p m) of residues (r, p m), where those numbered alike in `both` (p m,) are equal."""
    kept, places = np.unique(both, return_inverse=True)
    columns = -(-len(kept) // 4) * 4
    padded = np.zeros((len(square), columns))
    padded[:, : len(kept)] = residues.take(kept, axis=1)
    H: Complex = np.empty((len(w), len(both)), dtype=complex)
    sums, last = np.empty(8 * columns), np.empty(4)
    own = (np.ascontiguousarray(given, dtype=float) for given in (square, damping, loss))
    _compiled(
        np.ascontiguousarray(w, dtype=float),
        len(w),
        *own,
        len(square),
        padded,
        columns,
        places,
        len(both),
        sums,
        last,
        H,
    )
    return H
