"""How alike two sets of shapes, or two frequency responses, are: pure functions of arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arguments import verb
from flexura.arrays import Array, Complex
from flexura.errors import OptionError
from flexura.linalg import inverse_roots, scaled

IMPROVED_MAC = 0.02
"""A channel without which the mean MAC of the pairs is higher by more than this is not trusted."""

DEPENDENT_SHAPES = 1e-8
"""Singular values below this, relative to the largest, are taken as zero: the sensors do not see that direction."""


@verb
def mac(a: ArrayLike, b: ArrayLike, *, weight: Any = None) -> Array:
    """Modal assurance criterion (n, k) of shapes a (p, n) and b (p, k), real or complex, between 0 and 1.

    |a^H W b|^2 / ((a^H W a)(b^H W b)) (Allemang and Brown 1982; theory eq. Q3); W (p, p) is symmetric and positive
    semidefinite, dense or sparse, the identity when left out: with a mass matrix shapes are compared by their kinetic
    energy. A shape that is zero at all sensors has the value 0. Raises OptionError
    for arrays that do not fit together or are not finite.
    """
    x, y = _shapes(a, b)
    Wx, Wy = _weighted(weight, x), _weighted(weight, y)
    sizes = np.outer(np.einsum("ij,ij->j", x.conj(), Wx).real, np.einsum("ij,ij->j", y.conj(), Wy).real)
    return _share(np.abs(x.conj().T @ Wy) ** 2, sizes)


def space_mac(shapes: ArrayLike, space: ArrayLike, weight: Any = None) -> Array:
    """Share (n,) of each of the shapes (p, n) that lies in the span of `space` (p, k), between 0 and 1.

    |Q^H W x|^2 / (x^H W x) with a basis Q of the span, Q^H W Q = I (theory eq. Q4): the square of the cosine of the
    angle between shape and space, and for k = 1 the modal assurance criterion. W as in `mac`. Raises OptionError as
    `mac` does.
    """
    x, y = _shapes(shapes, space)
    Q, Wx = _basis(y, weight), _weighted(weight, x)
    size = np.einsum("ij,ij->j", x.conj(), Wx).real
    return _share((np.abs(Q.conj().T @ Wx) ** 2).sum(axis=0), size)


def in_space(shapes: ArrayLike, space: ArrayLike, used: NDArray[np.bool_] | None = None) -> Complex:
    """The nearest to each of the shapes (p, n) within the span of `space` (p, k), judged at the `used` (p,) sensors."""
    x, y = _shapes(shapes, space)
    at = slice(None) if used is None else used
    return np.asarray(y @ np.linalg.lstsq(y[at], x[at], rcond=DEPENDENT_SHAPES)[0], dtype=complex)


@verb
def comac(a: ArrayLike, b: ArrayLike) -> Array:
    """Coordinate modal assurance criterion (p,) of paired shapes a, b (p, n), between 0 and 1 at every sensor.

    (sum_r |a_ir b_ir|)^2 / (sum_r |a_ir|^2 sum_r |b_ir|^2) (Lieven and Ewins 1988; theory eq. Q5). It knows neither
    signs nor a gain of the channel. A sensor at which either set is zero has the value 0. Raises OptionError as `mac`
    does.
    """
    x, y = (np.abs(s) for s in _paired(a, b))
    return _share((x * y).sum(axis=1) ** 2, (x**2).sum(axis=1) * (y**2).sum(axis=1))


def trusted_channels(a: ArrayLike, b: ArrayLike) -> NDArray[np.bool_]:
    """Which channels (p,) agree in paired shapes a, b (p, n).

    The channel whose leaving out raises the mean MAC of the pairs most is left out, until none raises it by more than
    0.02 or a third of them is gone. Raises OptionError as `mac` does.
    """
    x, y = _paired(a, b)
    trusted: NDArray[np.bool_] = np.ones(len(x), dtype=np.bool_)
    for _ in range(len(x) // 3):
        a, b = (np.where(trusted[:, None], s, 0) for s in (x, y))
        xx, yy, xy = np.abs(a) ** 2, np.abs(b) ** 2, b.conj() * a
        total = xx.sum(axis=0), yy.sum(axis=0), xy.sum(axis=0)
        mean = _mean_mac(*total)
        without = np.where(trusted, _mean_mac(total[0] - xx, total[1] - yy, total[2] - xy), -np.inf)
        worst = int(np.argmax(without))
        if without[worst] <= mean + IMPROVED_MAC:
            break
        trusted[worst] = False
    return trusted


def _mean_mac(xx: Array, yy: Array, xy: Complex) -> Array:
    """Mean over the last axis of |xy|^2 / (xx yy)."""
    size = xx * yy
    return np.divide(np.abs(xy) ** 2, size, out=np.zeros_like(size), where=size > 0).mean(axis=-1)


def channel_gain(a: ArrayLike, b: ArrayLike) -> Array:
    """Gain (p,) with which each channel of `a` reads what `b` has there, over paired shapes a, b (p, n).

    Each pair is scaled by what the other channels say, those that disagree left out (`trusted_channels`), so that a
    wrong channel neither hides itself nor blames others; a gain of -1 is a sensor mounted the wrong way round, one of
    9.81 a unit of g (theory eq. Q6). Channels that read nothing have the gain nan. Raises OptionError as `mac` does.
    """
    x, y = _paired(a, b)
    trusted = trusted_channels(x, y)[:, None]
    cross, power = (np.where(trusted, part, 0) for part in (y.conj() * x, np.abs(y) ** 2))
    others, others_power = cross.sum(axis=0) - cross, power.sum(axis=0) - power
    expected = y * np.divide(others, others_power, out=np.zeros_like(cross), where=others_power > 0)
    size = (np.abs(expected) ** 2).sum(axis=1)
    product = (expected.conj() * x).sum(axis=1).real
    return np.divide(product, size, out=np.full(len(size), np.nan), where=size > 0)


@verb
def frac(H: ArrayLike, G: ArrayLike) -> Array:
    """Frequency response assurance criterion (p, m) of H and G (f, p, m), between 0 and 1 for every pair of channels.

    |sum_f H conj(G)|^2 / (sum_f |H|^2 sum_f |G|^2) (Heylen and Lammens 1996; theory eq. Q7). It knows no scale, and a
    small shift of a sharp resonance makes it small. Raises OptionError as `mac` does.
    """
    x, y = np.asarray(H), np.asarray(G)
    if x.shape != y.shape or x.ndim != 3:
        raise OptionError(f"two frequency responses are of one shape (f, p, m), not {x.shape} and {y.shape}")
    _refuse_infinite(x, y)
    return _share(np.abs((x * y.conj()).sum(axis=0)) ** 2, (np.abs(x) ** 2).sum(axis=0) * (np.abs(y) ** 2).sum(axis=0))


def orthogonality(a: ArrayLike, b: ArrayLike, mass: ArrayLike) -> Array:
    """a^H M b (n, k), every shape of a (p, n) and b (p, k) scaled to one by M (p, p): magnitudes (theory eq. Q12).

    For b = a this is the test's own orthogonality, the identity where its shapes are those of a structure with this
    mass; with the shapes of the model for b it is the cross-orthogonality. Raises OptionError as `mac` does.
    """
    return np.sqrt(mac(a, b, weight=mass))


def _share(part: Array, whole: Array) -> Array:
    """part / whole between 0 and 1; 0 of nothing."""
    return np.clip(np.divide(part, whole, out=np.zeros_like(whole), where=whole > 0), 0.0, 1.0)


def _shapes(a: ArrayLike, b: ArrayLike) -> tuple[NDArray, NDArray]:
    x, y = np.asarray(a), np.asarray(b)
    if x.ndim != 2 or y.ndim != 2 or len(x) != len(y):
        raise OptionError(f"shapes are arrays (sensors, modes) over the same sensors, not {x.shape} and {y.shape}")
    _refuse_infinite(x, y)
    return x, y


def _paired(a: ArrayLike, b: ArrayLike) -> tuple[NDArray, NDArray]:
    x, y = _shapes(a, b)
    if x.shape != y.shape:
        raise OptionError(f"paired shapes come in equal numbers, not {x.shape[1]} and {y.shape[1]}")
    return x, y


def _refuse_infinite(*arrays: NDArray) -> None:
    if not all(np.isfinite(x).all() for x in arrays):
        raise OptionError("there are values that are not finite: leave out the channels or modes that have them")


def _weighted(weight: Any, shapes: NDArray) -> NDArray:
    """W X, for W dense, sparse, a list of rows, or None for the identity."""
    if weight is None:
        return shapes
    return (weight if hasattr(weight, "shape") else np.asarray(weight)) @ shapes


def _basis(space: NDArray, weight: Any) -> NDArray:
    """Basis Q (p, rank) of the span of the columns with Q^H W Q = I."""
    if weight is None:
        size = np.linalg.norm(space, axis=0)
        U, s, _ = np.linalg.svd(space[:, size > 0] / size[size > 0], full_matrices=False)
        return U[:, s > DEPENDENT_SHAPES * s.max(initial=0.0)]
    gram = space.conj().T @ _weighted(weight, space)
    scale = inverse_roots(gram.diagonal())
    values, turn = np.linalg.eigh(scaled(gram, scale))
    seen = values > DEPENDENT_SHAPES * values.max(initial=0.0)
    return space @ (scale[:, None] * turn[:, seen] / np.sqrt(values[seen]))


def largest_motion(modes: Array, reach: float) -> Array:
    """Largest displacement (k,), m, of any node in modes (n_nodes, 6, k), rotations times `reach`, m."""
    move, turn = (np.sqrt((modes[:, part] ** 2).sum(axis=1)).max(axis=0) for part in (slice(0, 3), slice(3, 6)))
    return np.maximum(move, reach * turn)
