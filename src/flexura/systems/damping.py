"""Damping ratios of modes from the description."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from flexura.errors import ExpressionError, OptionError
from flexura.mechanism import Damping, evaluated, problems_of, validated

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DampingLaw:
    """Damping of a mechanism as a whole, in numbers.

    `ratio`, `bands` ((up to, Hz; ratio), ...) and `ratios` give modal damping ratios; `alpha`, 1/s, and `beta`, s, are
    the factors of Rayleigh damping; `loss_factor` is that of everything elastic without one of its own.
    """

    ratio: float = 0.0
    bands: tuple[tuple[float, float], ...] = ()
    ratios: tuple[float, ...] = ()
    alpha: float = 0.0
    beta: float = 0.0
    loss_factor: float = 0.0

    @property
    def is_modal(self) -> bool:
        """True when modal damping ratios are given."""
        return bool(self.ratio or self.bands or self.ratios)

    def modal_ratios(self, frequency_hz: Array) -> Array:
        """Damping ratios (r,) of modes with frequencies (r,), Hz, ascending, from the modal rules alone."""
        found = np.full(len(frequency_hz), self.ratio)
        for up_to, ratio in reversed(self.bands):
            found[frequency_hz <= up_to] = ratio
        n = min(len(self.ratios), len(found))
        found[:n] = self.ratios[:n]
        return found


def damping_law(
    described: Damping, values: Mapping[str, Any], replaced: Damping | float | Mapping[str, Any] | None
) -> DampingLaw:
    """Damping of a description at parameter values, or what replaces it: a ratio, a Damping or its keys.

    Raises OptionError for impossible numbers. Rayleigh damping follows from zeta = (alpha/omega + beta omega)/2 at its
    two frequencies (theory eq. T4).
    """
    damping = described
    if replaced is not None:
        damping = replaced if isinstance(replaced, Damping) else _validated(replaced)
    try:
        damping = _validated(evaluated(damping, dict(values)).model_dump())
    except ExpressionError as error:
        raise OptionError(f"damping: {error}") from None
    alpha = beta = 0.0
    if damping.rayleigh is not None:
        w = 2 * np.pi * np.array([float(f) for f in damping.rayleigh.frequencies])  # type: ignore[arg-type]
        zeta = np.array([float(z) for z in damping.rayleigh.ratios])  # type: ignore[arg-type]
        alpha, beta = (float(x) for x in np.linalg.solve(np.stack([1 / w, w], axis=1) / 2, zeta))
        if alpha < 0 or beta < 0:
            rule = "these ratios need a negative damping matrix: between the two frequencies damping would be negative"
            raise OptionError(f"rayleigh damping: {rule}; bring the ratios closer together")
    return DampingLaw(
        float(damping.ratio),  # type: ignore[arg-type]
        tuple((float(b.up_to), float(b.ratio)) for b in damping.bands),  # type: ignore[arg-type]
        tuple(float(z) for z in damping.ratios),  # type: ignore[arg-type]
        alpha,
        beta,
        float(damping.loss_factor or 0.0),  # type: ignore[arg-type]
    )


def _validated(raw: Any) -> Damping:
    """Damping from its keys or a ratio. Raises OptionError for what it cannot be."""
    try:
        return validated(Damping, raw)
    except ValidationError as error:
        problem = problems_of(error, raw)[0]
        where = "".join(f".{key}" for key in problem.path)
        raise OptionError(f"damping{where}: {problem.rule}, not {problem.value or raw}") from None
