"""Checks of inertia tensors, spring matrices and of joints that lie apart."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexura.errors import Path
from flexura.mechanism.checks.survey import Survey, prefix, shown
from flexura.mechanism.substructure import Substructure

RELATIVE = 1e-9
SINGULAR = 1e-12
JOINT_DISTANCE = 1e-9
"""Distance in m within which joined nodes are at one place, besides 1e-6 of the size of the mechanism."""


def check_bodies(survey: Survey) -> None:
    """Report inertia tensors and spring matrices that are impossible, and joints that gape."""
    for name, prototype in survey.layout.prototypes.items():
        path = prefix(name)
        for kind in ("bodies", "masses"):
            for key, part in getattr(prototype, kind).items():
                if part.inertia is not None:
                    _inertia(survey, (*path, kind, key, "inertia"), part.inertia)
        for key, spring in prototype.springs.items():
            if spring.matrix is not None:
                _stiffness(survey, (*path, "springs", key, "matrix"), np.array(spring.matrix))
        _joints(survey, name, prototype)


def _inertia(survey: Survey, path: Path, entries: tuple[float, ...]) -> None:
    if not np.isfinite(entries).all():
        return
    largest = max(map(abs, entries)) or 1.0
    xx, yy, zz, xy, xz, yz = (entry / largest for entry in (*entries, 0.0, 0.0, 0.0)[:6])
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    low, middle, high = (largest * np.linalg.eigvalsh(tensor)).tolist()
    moments = f"principal moments {shown(low)}, {shown(middle)}, {shown(high)} kg*m^2"
    if low <= SINGULAR * abs(high):
        survey.report(path, moments, "an inertia tensor is positive definite", _ORDER)
    elif low + middle < high * (1 - RELATIVE):
        rule = "no principal moment of inertia is larger than the sum of the other two"
        survey.report(path, moments, rule, _ORDER)


_ORDER = "the entries are Ixx, Iyy, Izz and then the tensor's Ixy, Ixz, Iyz (minus the products of inertia)"


def _stiffness(survey: Survey, path: Path, K: NDArray[np.float64]) -> None:
    if not np.isfinite(K).all():
        return
    scale = np.sqrt(np.abs(np.diag(K)))
    unit = np.outer(scale, scale)
    i, j = np.unravel_index(np.argmax(np.abs(K - K.T) - RELATIVE * unit), K.shape)
    if abs(K[i, j] - K[j, i]) > RELATIVE * max(unit[i, j], abs(K[i, j])):
        rule = f"the matrix of a spring is symmetric; entries ({i + 1}, {j + 1}) and ({j + 1}, {i + 1}) differ"
        survey.report(path, f"{K[i, j]:g} and {K[j, i]:g}", rule)
        return
    scaled = np.divide(K, unit, out=np.zeros((6, 6)), where=unit > 0)
    impossible = np.diag(K).min() < 0 or K[unit == 0].any()
    if impossible or np.linalg.eigvalsh(scaled).min() < -RELATIVE:
        hint = "no motion of the spring may release energy"
        survey.report(path, "", "the matrix of a spring has no negative eigenvalue", hint)


def _joints(survey: Survey, name: str, prototype: Substructure) -> None:
    positions = survey.positions[name]
    for i, (a, b) in enumerate(prototype.joints):
        if a in positions and b in positions:
            distance = math.dist(positions[a], positions[b])
            if distance > JOINT_DISTANCE + 1e-6 * survey.size:
                survey.report(
                    (*prefix(name), "joints", i),
                    f"{a}, {b}",
                    f"joined nodes are at one place; these are {shown(distance * 1e3)} mm apart",
                    "a rigid body carries nodes on arms: let one carry both",
                )
