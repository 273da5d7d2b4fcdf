"""What the published cases share: straight beams, planes that decouple, and frequencies of both models."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.optimize import brentq

from flexura.full_order import assemble
from flexura.linalg import count_below, lowest
from flexura.mechanism import Link, Material, Mechanism
from flexura.reduction.low_order import reduce
from flexura.structure import FullOrderModel

XY = ("tx", "ty", "rz")
"""DOFs of the xy plane."""
EVERY_MODE = 1_000_000
"""Keeps all fixed-interface normal modes."""
HELD = {"pinned": ("tx", "ty", "tz", "rx"), "rolls": ("ty", "tz")}
"""DOFs held at the two ends of a simply supported beam along x."""


def straight(
    section: Any,
    material: Material,
    length: float,
    elements: int,
    ground: Any = None,
    theory: Any = None,
    **more: Any,
) -> Mechanism:
    """Describe a beam along x, from `a` at the origin to `b`."""
    beam = {"section": section, "elements": elements, "reference": "z"}
    return Mechanism(
        theory=theory or "euler_bernoulli",
        corrections="none",
        nodes={"a": (0.0, 0.0, 0.0), "b": (length, 0.0, 0.0)},
        materials={"metal": material},
        links={"beam": Link(nodes=("a", "b"), material="metal", **beam)},
        ground=ground or {},
        **more,
    )


def plane(model: FullOrderModel, dofs: Sequence[str]) -> tuple[Any, Any]:
    """Return K and M of one plane of a mechanism that lies in it; the other DOFs must not couple with it."""
    inside = np.array([name.rsplit(".", 1)[1] in dofs for name in model.dof_names])
    for matrix in (model.K, model.M):
        assert abs(matrix[inside][:, ~inside]).sum() <= 1e-9 * abs(matrix).max()
    return model.K[inside][:, inside], model.M[inside][:, inside]


def hertz(K: Any, M: Any, count: int, rigid: int = 0) -> np.ndarray:
    """Return the lowest `count` elastic frequencies, Hz, above so many rigid motions, which must come out as zero.

    An inertia count proves that none is missing.
    """
    values = lowest(K, M, rigid + count).values
    assert (values[:rigid] == 0).all() and values[rigid] > 0
    assert count_below(K, M, values[-1] * (1 - 1e-6)) < len(values)
    return np.sqrt(values[rigid:]) / (2 * np.pi)


def frequencies(mechanism: Mechanism, count: int, rigid: int = 0) -> np.ndarray:
    """Return the lowest `count` elastic frequencies, Hz, of the full model.

    The reduced model with every fixed-interface mode kept must have the same ones.
    """
    model, reduced = assemble(mechanism), reduce(mechanism, keep=EVERY_MODE)
    assert reduced.order == model.order
    full = hertz(model.K, model.M, count, rigid)
    np.testing.assert_allclose(hertz(reduced.K, reduced.M, count, rigid), full, rtol=1e-7)
    return full


def in_plane(mechanism: Mechanism, count: int, dofs: Sequence[str] = XY, rigid: int = 0) -> np.ndarray:
    """Return the lowest `count` elastic frequencies, Hz, of the full model in one plane."""
    return hertz(*plane(assemble(mechanism), dofs), count, rigid)


def last_decimal(values: Sequence[float], decimals: int, units: float = 0.5) -> np.ndarray:
    """Return half a unit (or so many) of the last printed decimal, relative to each value."""
    return units * 10.0**-decimals / np.abs(values)


def last_digit(values: Sequence[float], digits: int, units: float = 0.5) -> np.ndarray:
    """Return half a unit (or so many) of the last of the printed significant digits, relative to each value."""
    v = np.abs(np.asarray(values, dtype=float))
    return units * 10.0 ** (np.floor(np.log10(v)) - digits + 1) / v


def roots(function: Callable[[float], float], start: float, step: float, count: int) -> np.ndarray:
    """Return the first `count` zeros of a function above `start`, scanned in steps; poles are passed over."""
    found: list[float] = []
    x = start
    while len(found) < count:
        left, right = function(x), function(x + step)
        if left * right < 0:
            root = brentq(function, x, x + step, xtol=1e-13, rtol=1e-13)
            if abs(function(root)) <= min(abs(left), abs(right)):
                found.append(root)
        x += step
    return np.array(found)
