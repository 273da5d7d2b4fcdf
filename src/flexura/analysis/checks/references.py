"""Members whose reference axis lays their wide side into the motion that those beside them leave free."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import Diagnostic
from flexura.linalg import lowest
from flexura.mechanism import TOP, Mechanism, origin_of
from flexura.structure import Bars, FullOrderModel, assemble

FLAT = 3.0
"""Width over least thickness from which a member is a leaf, with a thin and a wide direction."""

LIKE = 0.2
"""Members are alike when lengths, widths and thicknesses differ by less than this share."""

ACROSS = 0.1
"""Cosine of the angle between thin directions up to which they stand across each other."""

WITHIN = 1.5
"""Two leaves whose planes meet within so many half widths of both are an angle or a cross, and meant so."""

SOFTER = 4.0
"""The least eigenvalue falls by more than this when a member is turned whose reference is in doubt."""

MOST_TURNED, MOST_ORDER = 8, 20_000
"""Members that are turned one after the other, and the order of models in which this is done."""


def reference_doubts(full: FullOrderModel, bars: Bars) -> list[Diagnostic]:
    """Leaves across those like them between the same two bodies, such that turned by 90 degrees they let these move.

    Two leaves of a guide have one thin direction, or thin directions that both stand across the axis of a pivot. Where
    the thin direction of one stands across that of another, the mechanism is solved with its reference turned by 90
    degrees; it is in doubt when the least eigenvalue of the elastic motions falls by more than SOFTER.
    """
    suspects = list(dict.fromkeys(_across(bars)))
    if not suspects or full.order > MOST_ORDER:
        return []
    before = _softest(full)
    found: dict[tuple[int, int], tuple[float, int, int]] = {}
    for i, j in suspects[:MOST_TURNED]:
        turned = _turned(full, bars, i)
        ratio = before / _softest(turned) if turned is not None else 0.0
        pair = (min(i, j), max(i, j))
        if ratio > max(SOFTER, found.get(pair, (0.0, 0, 0))[0]):
            found[pair] = (ratio, i, j)
    return [_doubt(bars, *own) for own in found.values()]


def _doubt(bars: Bars, ratio: float, i: int, j: int) -> Diagnostic:
    text = (
        f"its wide side stands in the motion that {bars.names[j]}, beside it, leaves free: turned by 90 degrees it"
        f" would make the mechanism {ratio:.2g} times softer in its lowest mode; is its `reference` meant so?"
    )
    return Diagnostic.about("reference", text, bars.names[i])


def _thin(bars: Bars) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Thin directions (n, 3), width and least thickness (n, 2), m, and whether a member is a leaf (n,)."""
    least = np.array([[loft.y[row].min(), loft.z[row].min()] for loft, row in _rows(bars)]).reshape(-1, 2)
    is_round = np.array([loft.is_round for loft, _ in _rows(bars)], dtype=bool)
    thin = np.argmin(least, axis=1)
    every = np.arange(len(least))
    sizes = np.column_stack([least[every, 1 - thin], least[every, thin]])
    return bars.axes[every, 1 + thin], 2 * sizes, ~is_round & (sizes[:, 0] > FLAT * sizes[:, 1])


def _rows(bars: Bars) -> Iterator[tuple]:
    return ((bars.lofts[g], int(r)) for g, r in zip(bars.group, bars.row, strict=True))


def _across(bars: Bars) -> Iterator[tuple[int, int]]:
    """Pairs of members, both ways round, whose thin directions stand across each other, by what is in doubt first."""
    if not bars.names:
        return
    thin, sizes, is_leaf = _thin(bars)
    between: dict[tuple[int, ...], list[int]] = {}
    for k in np.flatnonzero(is_leaf):
        own = tuple(sorted(bars.clusters[k].tolist()))
        if own[0] != own[1]:
            between.setdefault(own, []).append(int(k))
    measures = np.column_stack([bars.length, sizes])
    seen: set[tuple[str, str]] = set()
    for group in between.values():
        for a, i in enumerate(group):
            for j in group[a + 1 :]:
                labels = (bars.labels[i], bars.labels[j])
                if labels[0] == labels[1] or labels in seen or abs(thin[i] @ thin[j]) > ACROSS:
                    continue
                seen.add(labels)
                alike = (abs(measures[i] - measures[j]) <= LIKE * np.maximum(measures[i], measures[j])).all()
                if alike and not _meet(bars, thin, sizes, i, j):
                    yield from ((i, j), (j, i))


def _meet(bars: Bars, thin: Array, sizes: Array, i: int, j: int) -> bool:
    """Whether the line in which the planes of two leaves meet passes within both of them."""
    middle = [bars.origin[k] + bars.axes[k, 0] * bars.length[k] / 2 for k in (i, j)]
    line = np.cross(thin[i], thin[j])
    A = np.stack([thin[i], thin[j], line])
    at = np.linalg.solve(A, [thin[i] @ middle[0], thin[j] @ middle[1], line @ (middle[0] + middle[1]) / 2])
    for k, own in zip((i, j), middle, strict=True):
        wide = np.cross(thin[k], bars.axes[k, 0])
        # where the line is nearest to the leaf's middle, along its width
        slope = line @ wide
        near = at + (0.0 if abs(slope) < 0.5 else ((own - at) @ wide) / slope) * line
        if abs((near - own) @ wide) > WITHIN * sizes[k, 0] / 2:
            return False
    return True


def _softest(full: FullOrderModel) -> float:
    """The least eigenvalue, (rad/s)^2, above those of rigid motions."""
    values = lowest(full.K, full.M, min(8, full.order)).values
    finite = values[np.isfinite(values) & (values > 0)]
    return float(finite[0]) if len(finite) else np.inf


def _turned(full: FullOrderModel, bars: Bars, k: int) -> FullOrderModel | None:
    """The same mechanism with the reference of a member, in all copies of its part, turned by 90 degrees."""
    name, _, key = bars.labels[k].rpartition(".")
    mechanism = full.plan.mechanism
    prototype = mechanism if name == TOP else mechanism.substructures[origin_of(name)]
    row = list(full.plan.parts[name].members).index(key)
    side = full.geometry.parts[name].R[row, 1]
    kind = "flexures" if key in prototype.flexures else "links"
    members = getattr(prototype, kind)
    changed = members[key].model_copy(update={"reference": tuple(map(float, side))})
    own = prototype.model_copy(update={kind: {**members, key: changed}})
    if name != TOP:
        own = mechanism.replaced({"substructures": {**mechanism.substructures, name: own}})
    assert isinstance(own, Mechanism)
    return assemble(own, full.parameters)
