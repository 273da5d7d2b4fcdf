"""Step-by-step solution of M q'' + C q' + K q = B u in extended precision, exact for held and for linear inputs.

Stiffnesses that spread over ten decades leave a double-precision matrix exponential eight digits. `longdouble` adds
three or more where the machine has them.
"""

from __future__ import annotations

import numpy as np

Long = np.longdouble


def solved(A, b):
    """A^-1 b by Gaussian elimination with row pivoting, symmetrically scaled."""
    d = 1 / np.sqrt(np.abs(np.diagonal(A)).astype(Long))
    A, b = A.astype(Long) * d[:, None] * d, d[:, None] * b.astype(Long)
    for k in range(len(A)):
        p = k + int(np.abs(A[k:, k]).argmax())
        A[[k, p]], b[[k, p]] = A[[p, k]], b[[p, k]]
        factor = A[k + 1 :, k] / A[k, k]
        A[k + 1 :] -= factor[:, None] * A[k]
        b[k + 1 :] -= factor[:, None] * b[k]
    x = np.zeros_like(b)
    for k in range(len(A) - 1, -1, -1):
        x[k] = (b[k] - A[k, k + 1 :] @ x[k + 1 :]) / A[k, k]
    return d[:, None] * x


def exponential(A):
    """e^A by scaling, Taylor series and squaring."""
    squarings = max(0, int(np.ceil(np.log2(float(np.abs(A).sum(axis=1).max())))) + 2)
    A = A / Long(2) ** squarings
    term = total = np.eye(len(A), dtype=Long)
    for k in range(1, 22):
        term = term @ A / k
        total = total + term
    for _ in range(squarings):
        total = total @ total
    return total


def stepped(M, C, K, B, u, dt, hold, start=None, rate=None):
    """q, q', q'' (n, N) for inputs u (m, N) at 0, dt, ..., from a state (n,), (n,)."""
    n, m = len(K), B.shape[1]
    solution = solved(M, np.hstack([K, C, B]))
    stiff, lossy, push = solution[:, :n], solution[:, n : 2 * n], solution[:, 2 * n :]
    size = 1 / np.sqrt(np.abs(np.diagonal(M)).astype(Long))
    clock = np.sqrt(np.abs(stiff * size / size[:, None]).max())
    block = np.zeros((2 * n + 2 * m, 2 * n + 2 * m), dtype=Long)
    block[:n, n : 2 * n] = np.eye(n) * clock
    block[n : 2 * n, :n] = -stiff * size / size[:, None] / clock
    block[n : 2 * n, n : 2 * n] = -lossy * size / size[:, None]
    block[n : 2 * n, 2 * n : 2 * n + m] = push / size[:, None] / clock
    block[2 * n : 2 * n + m, 2 * n + m :] = np.eye(m) / Long(dt)
    E = exponential(block * Long(dt))
    P, constant, ramp = E[: 2 * n, : 2 * n], E[: 2 * n, 2 * n : 2 * n + m], E[: 2 * n, 2 * n + m :]
    u = np.asarray(u).astype(Long)
    forcing = constant @ u[:, :-1]
    if hold == "foh":
        forcing = forcing + ramp @ np.diff(u, axis=1)
    x = np.zeros((2 * n, u.shape[1]), dtype=Long)
    for at, state, scale in ((slice(0, n), start, size), (slice(n, 2 * n), rate, size * clock)):
        if state is not None:
            x[at, 0] = state / scale
    for k in range(u.shape[1] - 1):
        x[:, k + 1] = P @ x[:, k] + forcing[:, k]
    q, v = size[:, None] * x[:n], size[:, None] * clock * x[n:]
    return q, v, push @ u - stiff @ q - lossy @ v
