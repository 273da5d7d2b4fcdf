"""Damping ratios of modes from the description."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from flexura.arrays import Array
from flexura.duals import Dual, moves, plain
from flexura.errors import ExpressionError, OptionError
from flexura.mechanism import Damping, evaluated, problems_of, validated


@dataclass(frozen=True)
class DampingLaw:
    """Damping of a mechanism as a whole, in numbers, which may have slopes.

    `ratio`, `bands` ((up to, Hz; ratio), ...) and `ratios` give modal damping ratios; `alpha`, 1/s, and `beta`, s, are
    the factors of Rayleigh damping; `loss_factor` is that of everything elastic without one of its own.
    """

    ratio: Any = 0.0
    bands: tuple[tuple[Any, Any], ...] = ()
    ratios: tuple[Any, ...] = ()
    alpha: Any = 0.0
    beta: Any = 0.0
    loss_factor: Any = 0.0

    @property
    def is_modal(self) -> bool:
        """True when modal damping ratios are given."""
        return bool(plain(self.ratio) or moves(self.ratio) or self.bands or self.ratios)

    def modal_ratios(self, frequency_hz: Array) -> Array:
        """Damping ratios (r,) of modes with frequencies (r,), Hz, ascending, from the modal rules alone."""
        known = np.stack([self.ratio, *(ratio for _, ratio in self.bands), *self.ratios])
        own = np.zeros(len(frequency_hz), dtype=np.intp)
        for number, (up_to, _) in reversed(list(enumerate(self.bands, 1))):
            own[frequency_hz <= plain(up_to)] = number
        n = min(len(self.ratios), len(own))
        own[:n] = 1 + len(self.bands) + np.arange(n)
        return known[own]


def damping_law(
    described: Damping, values: Mapping[str, Any], replaced: Damping | float | Mapping[str, Any] | None
) -> DampingLaw:
    """Damping of a description at parameter values, which may have slopes, or what replaces it: a ratio, a Damping or
    its keys.

    Raises OptionError for impossible numbers. Rayleigh damping follows from zeta = (alpha/omega + beta omega)/2 at its
    two frequencies (theory eq. T4).
    """
    damping = described
    if replaced is not None:
        damping = replaced if isinstance(replaced, Damping) else _validated(replaced)
    try:
        _validated(evaluated(damping, {name: plain(value) for name, value in values.items()}).model_dump())
        damping = evaluated(damping, dict(values))
    except ExpressionError as error:
        raise OptionError(f"damping: {error}") from None
    alpha: Any = 0.0
    beta: Any = 0.0
    if damping.rayleigh is not None:
        low, high = (2 * np.pi * _number(f) for f in damping.rayleigh.frequencies)
        at_low, at_high = map(_number, damping.rayleigh.ratios)
        wide = high**2 - low**2
        alpha = 2 * low * high * (at_low * high - at_high * low) / wide
        beta = 2 * (at_high * high - at_low * low) / wide
        if plain(alpha) < 0 or plain(beta) < 0:
            rule = "these ratios need a negative damping matrix: between the two frequencies damping would be negative"
            raise OptionError(f"rayleigh damping: {rule}; bring the ratios closer together")
    return DampingLaw(
        _number(damping.ratio),
        tuple((_number(b.up_to), _number(b.ratio)) for b in damping.bands),
        tuple(map(_number, damping.ratios)),
        alpha,
        beta,
        0.0 if damping.loss_factor is None else _number(damping.loss_factor),
    )


def _number(x: Any) -> Any:
    return x if isinstance(x, Dual) else float(x)


def _validated(raw: Any) -> Damping:
    """Damping from its keys or a ratio. Raises OptionError for what it cannot be."""
    try:
        return validated(Damping, raw)
    except ValidationError as error:
        problem = problems_of(error, raw)[0]
        where = "".join(f".{key}" for key in problem.path)
        raise OptionError(f"damping{where}: {problem.rule}, not {problem.value or raw}") from None
