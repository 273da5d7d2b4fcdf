"""Points of the unit cube by number: design k of N without those before it, and without memory for all of them.

Both sequences are stratified and scrambled, and every coordinate lies between 0 and 1, ends left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isqrt

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array

Whole = NDArray[np.uint64]

BITS = 32
"""Digits of a Sobol' coordinate."""

MOST_DIMENSIONS = 21201
"""Coordinates for which direction numbers are known (Joe and Kuo 2008)."""

DIRECTIONS: tuple[tuple[int, tuple[int, ...]], ...] = (
    (1, (1,)),
    (3, (1,)),
    (7, (1, 3)),
    (11, (1, 3, 1)),
    (13, (1, 1, 1)),
    (19, (1, 1, 3, 3)),
    (25, (1, 3, 5, 13)),
    (37, (1, 1, 5, 5, 17)),
    (41, (1, 1, 5, 5, 5)),
    (47, (1, 1, 7, 11, 19)),
)
"""Primitive polynomials, by their bits, and the first direction numbers of the first axes (Joe and Kuo 2008)."""

ROUNDS = 12
_GOLDEN, _FIRST, _SECOND = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


def mixed(x: Whole) -> Whole:
    """Numbers of 64 bits that look random, by a bijection (Steele, Lea and Flood 2014, SplitMix64)."""
    x = (x ^ (x >> np.uint64(30))) * _FIRST
    x = (x ^ (x >> np.uint64(27))) * _SECOND
    return x ^ (x >> np.uint64(31))


def _stream(*key: int) -> np.uint64:
    """A number of 64 bits that a key of integers leads to."""
    found = np.zeros(1, dtype=np.uint64)
    for part in key:
        found = mixed(found + _GOLDEN + np.uint64(part % 2**64))
    return found[0]


def permuted(numbers: Whole, size: int, key: int, axis: int) -> Whole:
    """Where the numbers 0 ... size - 1 go in a permutation that a key and an axis name.

    A Feistel network over pairs (L, R) below a = ceil(sqrt(size)), with what leads out of 0 ... size - 1 led on until
    it is inside (Black and Rogaway 2002, "Ciphers with arbitrary finite domains", sections 3 and 4).
    """
    a = np.uint64(isqrt(size - 1) + 1)
    keys = [_stream(key, axis, step) for step in range(ROUNDS)]
    found, outside = numbers.astype(np.uint64), np.ones(len(numbers), dtype=bool)
    while outside.any():
        left, right = np.divmod(found[outside], a)
        for own in keys:
            left, right = right, (left + mixed(right + own) % a) % a
        found[outside] = left * a + right
        outside[outside] = found[outside] >= size
    return found


def latin_hypercube(start: int, stop: int, size: int, axes: int, seed: int) -> Array:
    """Points start ... stop - 1 (stop - start, axes) of a Latin hypercube of so many points (McKay, Beckman and Conover
    1979): every one of `size` equal intervals of each axis holds one, somewhere in it."""
    numbers = np.arange(start, stop, dtype=np.uint64)
    found = np.empty((stop - start, axes))
    for axis in range(axes):
        inside = mixed(numbers * _GOLDEN + _stream(seed, axis, -1)) >> np.uint64(12)
        found[:, axis] = (permuted(numbers, size, seed, axis) + (inside + 0.5) * 2.0**-52) / size
    return np.minimum(found, np.nextafter(1.0, 0.0))


def _directions(polynomial: int, first: tuple[int, ...]) -> list[int]:
    """The direction numbers of an axis, each a digit later than the one before (Bratley and Fox 1988)."""
    degree, found = polynomial.bit_length() - 1, list(first)
    for j in range(len(found), BITS):
        own = found[j - degree] if degree else 1
        for k in range(1, degree + 1):
            own ^= (polynomial >> (degree - k) & 1) * (found[j - k] << k)
        found.append(own)
    return [own << (BITS - 1 - j) for j, own in enumerate(found)]


@dataclass(frozen=True, eq=False)
class Sobol:
    """Points of a Sobol' sequence scrambled by a random linear matrix and a shift (Matousek 1998), as SciPy has it.

    Point k is the exclusive or of the `directions` (digits, axes) at the digits of its Gray code (Antonov and Saleev
    1979), and of the `shift` (axes,), so that any of the first 2^32 is found by itself. Those of fewer points are the
    first of those of more.
    """

    shift: Whole
    directions: Whole

    @classmethod
    def of(cls, size: int, axes: int, seed: int) -> Sobol:
        """So many points, those of SciPy's generator; for a few axes without it, which is slow to import."""
        digits, rng = (size - 1).bit_length(), np.random.default_rng(seed)
        if axes <= len(DIRECTIONS):
            return cls._scrambled(digits, axes, rng.spawn(1)[0])
        from scipy.stats import qmc

        sequence = qmc.Sobol(axes, scramble=True, bits=BITS, seed=rng)
        points = [sequence.random(1)]
        for digit in range(digits):  # numbers 2^(j + 1) - 1 have a Gray code of a single digit
            sequence.fast_forward(2 ** (digit + 1) - 1 - sequence.num_generated)
            points.append(sequence.random(1))
        found = (np.concatenate(points) * 2.0**BITS).astype(np.uint64)
        return cls(found[0], found[1:] ^ found[0])

    @classmethod
    def _scrambled(cls, digits: int, axes: int, rng: np.random.Generator) -> Sobol:
        """Direction numbers times random lower triangular matrices of bits, the highest bit first, and a shift."""
        weight = 2 ** np.arange(BITS, dtype=np.uint32)
        shift = rng.integers(2, size=(axes, BITS), dtype=np.uint32) @ weight
        matrix = np.tril(rng.integers(2, size=(axes, BITS, BITS), dtype=np.uint32))
        matrix[:, np.arange(BITS), np.arange(BITS)] = 1
        plain = np.array([_directions(*own) for own in DIRECTIONS[:axes]], dtype=np.uint32)[:, :digits]
        bits = plain[:, None, :] // weight[::-1, None] % 2
        directions = np.einsum("apd,p->da", matrix @ bits % 2, weight[::-1])
        return cls(shift.astype(np.uint64), directions.astype(np.uint64))

    def __call__(self, start: int, stop: int) -> Array:
        """Points start ... stop - 1 (stop - start, axes)."""
        numbers = np.arange(start, stop, dtype=np.uint64)
        gray = numbers ^ (numbers >> np.uint64(1))
        found = np.repeat(self.shift[None], len(numbers), axis=0)
        for digit, direction in enumerate(self.directions):
            found[((gray >> np.uint64(digit)) & np.uint64(1)).astype(bool)] ^= direction
        return np.asarray((found + 0.5) * 2.0**-BITS, dtype=float)
