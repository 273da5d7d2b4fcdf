"""Arithmetic with some 32 digits on pairs of doubles, and inertia counts of banded matrices with 80.

Sums and products without error are those of Knuth (1969, sec. 4.2.2) and Dekker (1971).
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal, localcontext

import numpy as np

SPLIT = 134217729.0


def _two_sum(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _two_product(a, b):
    p = a * b
    ta, tb = SPLIT * a, SPLIT * b
    ah, bh = ta - (ta - a), tb - (tb - b)
    al, bl = a - ah, b - bh
    return p, al * bl - (((p - ah * bh) - al * bh) - ah * bl)


@dataclass
class Pairs:
    """An array of numbers hi + lo."""

    hi: np.ndarray
    lo: np.ndarray

    @staticmethod
    def of(a) -> Pairs:
        a = np.asarray(a, dtype=float)
        return Pairs(a, np.zeros_like(a))

    def __getitem__(self, at) -> Pairs:
        return Pairs(self.hi[at], self.lo[at])

    def __setitem__(self, at, value: Pairs) -> None:
        self.hi[at], self.lo[at] = value.hi, value.lo

    def __neg__(self) -> Pairs:
        return Pairs(-self.hi, -self.lo)

    def __add__(self, other: Pairs) -> Pairs:
        s, e = _two_sum(self.hi, other.hi)
        t, f = _two_sum(self.lo, other.lo)
        s, e = _two_sum(s, e + t)
        return Pairs(*_two_sum(s, e + f))

    def __sub__(self, other: Pairs) -> Pairs:
        return self + (-other)

    def __mul__(self, other: Pairs) -> Pairs:
        p, e = _two_product(self.hi, other.hi)
        return Pairs(*_two_sum(p, e + (self.hi * other.lo + self.lo * other.hi)))

    def __truediv__(self, other: Pairs) -> Pairs:
        q = Pairs.of(self.hi / other.hi)
        for _ in range(2):
            q = q + Pairs.of((self - q * other).hi / other.hi)
        return q

    @property
    def T(self) -> Pairs:
        return Pairs(np.swapaxes(self.hi, -1, -2), np.swapaxes(self.lo, -1, -2))

    def __matmul__(self, other: Pairs) -> Pairs:
        total = None
        for k in range(self.hi.shape[-1]):
            term = self[..., :, k, None] * other[..., None, k, :]
            total = term if total is None else total + term
        return total


def negative_pivots(A: Pairs, digits: int = 80) -> int:
    """Negative eigenvalues of a symmetric A (n, w + 1) by diagonals: A[i, d] stands at row i, column i + d.

    L D L' without interchanges in decimal numbers of so many digits, with which small pivots do no harm.
    """
    with localcontext() as context:
        context.prec = digits
        none = Decimal(0)
        rows = [
            [Decimal(hi) + Decimal(lo) if hi else none for hi, lo in zip(own, rest, strict=True)]
            for own, rest in zip(A.hi.tolist(), A.lo.tolist(), strict=True)
        ]
        n, width, count = len(rows), len(rows[0]), 0
        for k, row in enumerate(rows):
            pivot = row[0] or Decimal(10) ** -digits
            count += pivot < 0
            last = min(width, n - k)
            for i in range(1, last):
                if row[i]:
                    factor, below = row[i] / pivot, rows[k + i]
                    for j in range(i, last):
                        if row[j]:
                            below[j - i] -= factor * row[j]
    return count
