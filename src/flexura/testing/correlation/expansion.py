"""From sensors to the whole mechanism and back: SEREP expansion, and mass matrices over the sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.errors import OptionError, SolverError
from flexura.linalg import is_definite, scaled, unit_scale
from flexura.reduction import stored_flexibility
from flexura.structure import FullOrderModel

ReducedMass = Literal["serep", "guyan"]

DEPENDENT = 1e-8
"""Singular values below this, relative to the largest, are taken as zero."""


@dataclass(frozen=True)
class Expansion:
    """Test shapes as a sum of model shapes: coefficients (k, n).

    `error` (n,) is the part of each test shape at the sensors that no sum of the model's shapes has, relative; where
    there are no more sensors than model shapes it is zero and proves nothing. `condition` is the condition number of
    the model's shapes, each of length one, at the sensors.
    """

    coefficients: Array
    error: Array
    condition: float
    sensors: int

    @property
    def is_determined(self) -> bool:
        """True where sensors outnumber the shapes and tell them apart."""
        return self.sensors >= len(self.coefficients) and self.condition < 1 / DEPENDENT


def serep(test_shapes: ArrayLike, model_shapes: ArrayLike) -> Expansion:
    """Expand test shapes (p, n) in model shapes (p, k) at the sensors by least squares: SEREP.

    O'Callahan, Avitabile and Riemer (1989); theory eq. Q9. The whole mechanism follows with the model's shapes there
    times the coefficients. Raises OptionError for arrays that do not fit together.
    """
    x, y = np.asarray(test_shapes, dtype=float), np.asarray(model_shapes, dtype=float)
    if x.ndim != 2 or y.ndim != 2 or len(x) != len(y):
        raise OptionError(f"shapes are arrays (sensors, modes) over the same sensors, not {x.shape} and {y.shape}")
    size = np.linalg.norm(y, axis=0)
    size[size == 0] = 1.0
    s = np.linalg.svd(y / size, compute_uv=False)
    c = np.linalg.lstsq(y / size, x, rcond=DEPENDENT)[0] / size[:, None]
    length = np.linalg.norm(x, axis=0)
    error = np.linalg.norm(x - y @ c, axis=0) / np.where(length > 0, length, 1.0)
    low = s[-1] if len(s) and len(x) >= y.shape[1] else 0.0
    condition = float(s[0] / low) if low > 0 else np.inf if len(s) else 1.0
    return Expansion(c, error, condition, len(x))


def sensor_mass(
    model: FullOrderModel, rows: ArrayLike, shapes: ArrayLike | None = None, method: ReducedMass = "serep"
) -> Array:
    """Mass matrix (p, p) over the readings of sensors, `rows` (p, n) of the DOFs: the test-analysis model.

    serep: Phi^+T Phi^+ of mass-normalised model shapes (n, k), exact for these and blind to everything else (Kammer
    1987; theory eq. Q10). guyan: T^T M T with the displacements T of least strain energy that have the readings
    (Guyan 1965; theory eq. Q11), which needs no modes. Raises OptionError for another method, and SolverError for
    guyan of a mechanism that can move freely.
    """
    B = np.asarray(rows, dtype=float)
    if method not in get_args(ReducedMass):
        raise OptionError(f"the reduced mass is {' or '.join(get_args(ReducedMass))}, not {method!r}")
    if method == "serep":
        if shapes is None:
            raise OptionError("a reduced mass by SEREP needs the model's shapes")
        P = np.linalg.pinv(B @ np.asarray(shapes, dtype=float), rcond=DEPENDENT)
        return P.T @ P
    if not is_definite(model.K):
        raise SolverError("static reduction to the sensors needs a mechanism that is held; take serep")
    X = stored_flexibility(model.K, model.M, 0.0)(B.T)
    F = B @ X
    d = unit_scale(F)
    F = scaled(F, d)
    T = X @ (d[:, None] * np.linalg.pinv((F + F.T) / 2, rcond=DEPENDENT, hermitian=True) * d)
    mass = T.T @ (model.M @ T)
    return (mass + mass.T) / 2
