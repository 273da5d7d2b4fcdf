"""Values between designs that are worked out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array


@dataclass(frozen=True)
class Way:
    """The way along which a variable is interpolated: by its logarithm where that is known."""

    low: float
    high: float
    by_logarithm: bool

    @staticmethod
    def of(low: float, high: float) -> Way:
        """The way between two values, by the logarithm where both are positive."""
        return Way(float(low), float(high), low > 0)

    def at(self, x: Array) -> Array:
        """How far (n,) values lie along it."""
        return np.log(x) if self.by_logarithm else x

    def values(self, part: Array) -> Array:
        """Values (n,) at parts of it."""
        own = self.low + (self.high - self.low) * part
        if self.by_logarithm:
            own = self.low * (self.high / self.low) ** part
        return np.clip(own, self.low, self.high)


@dataclass(frozen=True)
class Fit:
    """Values between `nodes` along each way: by a polynomial, of logarithms where they are positive, or straight."""

    ways: Sequence[Way]
    nodes: Sequence[Array]
    values: Array

    def at(self, x: Sequence[Array], is_smooth: bool = True) -> Array:
        """Values over a grid; straight, none beside nodes without an answer."""
        is_smooth &= bool(np.isfinite(self.values).all())
        by_logarithm = is_smooth and bool((self.values > 0).all())
        own = np.log(self.values) if by_logarithm else self.values
        for axis, (way, nodes, values) in enumerate(zip(self.ways, self.nodes, x, strict=True)):
            along, at = way.at(nodes), way.at(values)
            own = _polynomial(along, own, axis, at) if is_smooth else _straight(along, own, axis, at)
        return np.exp(own) if by_logarithm else own

    def off(self, probes: Sequence[Array], known: Array) -> float:
        """The largest difference from answers at probes (n,) along each way, relative to the answers; infinite where
        there is none."""
        grid = self.at(probes)
        found = grid[(np.arange(len(known)),) * len(probes)]
        size = np.abs(known) if (known > 0).all() else np.abs(known).max()
        with np.errstate(invalid="ignore"):
            worst = float(np.max(np.abs(found - known) / np.maximum(size, 1e-300)))
        return worst if np.isfinite(worst) and np.isfinite(self.values).all() else np.inf


def _polynomial(nodes: Array, values: Array, axis: int, at: Array) -> Array:
    """Values along an axis by Lagrange's polynomials."""
    apart = nodes[:, None] - nodes + np.eye(len(nodes))
    off = np.broadcast_to((at[:, None] - nodes)[:, None], (len(at), *apart.shape))
    share = np.prod(np.where(np.eye(len(nodes), dtype=bool), 1.0, off / apart), axis=-1)
    return np.moveaxis(np.moveaxis(values, axis, -1) @ share.T, -1, axis)


def _straight(nodes: Array, values: Array, axis: int, at: Array) -> Array:
    k = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    part, lines = (at - nodes[k]) / (nodes[k + 1] - nodes[k]), np.moveaxis(values, axis, -1)
    return np.moveaxis((1 - part) * lines[..., k] + part * lines[..., k + 1], -1, axis)
