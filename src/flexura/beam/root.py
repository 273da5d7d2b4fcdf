"""Elastic roots: what a member and the thicker block that it ends in give together beyond each with a rigid face.

The rotation of a cantilever's root on a half plane is known since W. J. O'Donnell, J. Appl. Mech. 27 (1960) 461. Blocks
that are not large, leaves off their middle and the other directions have no closed forms: `roots.csv` holds solid
finite elements of them (benchmarks/roots.py), between which is interpolated here.
"""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexura.beam._columns import FloatArray, Real, columns

FAR = 12.0
"""Distance from the middle of the leaf to the block's faces, over the thickness, from which it counts as far."""

WIDTHS = (0.7, 40.0)
"""Least and largest width over thickness that is known."""

RATIOS = (0.2, 0.4)
"""Least and largest Poisson's ratio that is known."""

_HALF = 0.7
"""Distance of a face from the leaf, over its thickness, that lies in the middle of the scale."""

_GROUPS = ((7, 6, 5, 9, 8, 0), (4, 3, 2, 11, 10, 1))
"""Entries of the two planes in the order of `_factor`: ry, w, u and rz, v, rx."""

_POWERS = np.array([1, 1, 1, 2, 3, 1, 1, 1, 1, 1, 1, 2])
"""Powers of width over thickness in the unit of every entry."""

_LENGTHS = np.array([1, 3, 1, 2, 3, 1, 2, 3, 1, 2, 2, 3])
"""Powers of the thickness in the unit of every entry."""

NONE = 1e-9
"""What keeps a root that does not give regular, without units."""

LEAF = (6.0, 0.4)
"""Length of the leaves of the table: over their thickness, or over their width where that is more."""

_MIRRORED = np.array([1.0, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1])
"""Signs of a joint upside down."""


class _Fit(NamedTuple):
    """Coefficients (terms, 12) of factors of the flexibility, and the number of powers of each of the four scales."""

    coefficients: NDArray[np.float64]
    counts: tuple[int, ...]


def root_flexibility(E: Real, nu: Real, b: Real, t: Real, L: Real, up: Real, down: Real) -> FloatArray:
    """Return the flexibility of the elastic root of a leaf, beyond leaf and block with rigid faces (theory eq. F21).

    It is interpolated between roots of solid elements as products of factors, so that no load does negative work.
    What lies outside of them counts as at their edge: `FAR`, `WIDTHS` and `RATIOS`. The twist of a wide leaf warps its
    root the more the longer it is, up to its width: as the warping of a strip of length L (theory eq. F24).

    E: Pa; nu: -; b, t, L: width, thickness and length of the leaf, m, the block as wide; up, down: how far the block
    reaches beyond its faces along z and against it, m; all (...). Returns (..., 12), x leading from the block into the
    leaf: u_u, rx_rx, v_v, v_rz, rz_rz, w_w, w_ry, ry_ry, u_w, u_ry, v_rx, rx_rz in m/N, 1/N and 1/(N m). Raises
    nothing.
    """
    fit = _fitted()
    width = np.minimum(np.maximum(b / t, WIDTHS[0]), WIDTHS[1])
    nu = np.minimum(np.maximum(nu, RATIOS[0]), RATIOS[1])
    scales = (
        nu,
        np.log(width),
        *(_scale(np.minimum(np.maximum(beyond / t, 0.0), FAR - 0.5)) for beyond in (up, down)),
    )
    terms = columns(1.0)
    for scale, count in zip(scales, fit.counts, strict=True):
        powers = [0.0 * scale + 1.0]
        for _ in range(count - 1):
            powers.append(powers[-1] * scale)
        terms = terms[..., :, None] * columns(*powers)[..., None, :]
        terms = terms.reshape(*terms.shape[:-2], -1)
    factors = terms @ fit.coefficients
    entries: list[Real] = [0.0] * 12
    for first, group in zip((0, 6), _GROUPS, strict=True):
        a, c, d, e, f, g = np.moveaxis(factors[..., first : first + 6], -1, 0)
        own = (a * a + NONE, a * c, c * c + d * d + NONE, a * e, c * e + d * f, e * e + f * f + g * g + NONE)
        for place, value in zip(group, own, strict=True):
            entries[place] = value
    _warp(entries, 1.0 / _twisted(entries, width, _warping(nu, b, L)))
    unit = columns(*(E * width ** int(w) * t ** int(n) for w, n in zip(_POWERS, _LENGTHS, strict=True)))
    return columns(*entries) / unit


def _warping(nu: Real, b: Real, L: Real) -> Real:
    """Share of its full effect that warping of the root has on the twist of a strip of length L (theory eq. F24)."""
    share = np.tanh(np.sqrt(24 * (1 - nu)) * L / (2 * b))
    return share * share


def _twisted(entries: list[Real], width: Real, share: Real, back: bool = False) -> Real:
    """Twist of the root of a long strip over that where warping has a share of its effect, from entries without units
    of the former, or `back` from those of the latter; all but what shifts the strip's parts across is warping."""
    shift = 12 * entries[5] / width**2
    if back:
        return (shift + (entries[1] - shift) / share) / entries[1]
    return entries[1] / (shift + (entries[1] - shift) * share)


def _warp(entries: list[Real], factor: Real) -> None:
    """Let the root twist so many times as far, and what is coupled with it by the root of that."""
    entries[1] = entries[1] * factor
    entries[10], entries[11] = (entries[k] * np.sqrt(factor) for k in (10, 11))


def _scale(beyond: Real) -> Real:
    """From 0, flush with a face of the block, to 1, infinitely far."""
    return beyond / (beyond + _HALF)


@cache
def _fitted() -> _Fit:
    """The polynomials that go through all rows of the table."""
    with files("flexura.beam").joinpath("roots.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = list(rows[0])[4:]
    known = {}
    for row in rows:
        nu, width, up, down = (float(row[key]) for key in ("nu", "width", "up", "down"))
        C = np.array([float(row[name]) for name in names]) * width**_POWERS
        L = max(LEAF[0], LEAF[1] * width)
        entries = list(C)
        _warp(entries, _twisted(entries, width, _warping(nu, width, L), back=True))
        known[nu, width, up, down] = _factors(np.array(entries))
        known[nu, width, down, up] = _factors(np.array(entries) * _MIRRORED)
    axes = [sorted({key[k] for key in known}) for k in range(4)]
    table = np.zeros([*map(len, axes), 12])
    for at in np.ndindex(table.shape[:-1]):
        table[at] = known.get(
            tuple(axis[k] for axis, k in zip(axes, at, strict=True)), 0.0
        )  # flush on both sides: none
    beside = [[float(_scale(beyond)) for beyond in axis] for axis in axes[2:]]
    scales = (axes[0], np.log(axes[1]).tolist(), *beside)
    for axis, points in enumerate(scales):
        inverse = np.linalg.inv(np.vander(points, increasing=True))
        table = np.moveaxis(np.tensordot(inverse, table, axes=(1, axis)), 0, axis)
    return _Fit(table.reshape(-1, 12), table.shape[:-1])


def _factors(C: FloatArray) -> FloatArray:
    """The entries (12,) of Cholesky factors of both planes, of the flexibility (12,) without units."""
    found = []
    for qq, wq, ww, uq, uw, uu in (C[list(group)] for group in _GROUPS):
        a = np.sqrt(max(qq, 0.0))
        c, e = (wq / a, uq / a) if a else (0.0, 0.0)
        d = np.sqrt(max(ww - c * c, 0.0))
        f = (uw - c * e) / d if d else 0.0
        found += [a, c, d, e, f, np.sqrt(max(uu - e * e - f * f, 0.0))]
    return np.array(found)
