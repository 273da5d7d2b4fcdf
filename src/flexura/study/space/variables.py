"""What varies in a study: a range, a list of values, or a distribution, each of one parameter."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.records import Record

Numbers = NDArray[np.int64]

Kind = Literal["continuous", "integer", "choice"]
Scale = Literal["linear", "log"]

TOLD = 1000
"""Values of a list that its description holds; of longer ones it holds their hash."""


class Distribution(Protocol):
    """How a parameter is distributed, by the inverse of its cumulative distribution function. Is pickled."""

    def quantile(self, u: Array) -> Array:
        """The values, SI, below which the parts `u` of all lie, 0 < u < 1."""
        ...

    def describe(self) -> dict[str, Any]:
        """Plain data that tell it from every other distribution."""
        ...


@dataclass(frozen=True, repr=False, eq=False)
class Variable(Record):
    """A parameter that varies, SI: `continuous` or `integer` from `low` to `high`, or a `choice` among `values`.

    On a grid a range takes `count` values, evenly spaced or, with the scale `log`, in equal ratios; integers take all
    when there is no count. With a `distribution` samples follow it, and `low` and `high` are what it ranges over,
    infinite perhaps. `unit` is the SI unit of the parameter. Raises OptionError for ranges that are empty.
    """

    _shown = ("name", "kind", "low", "high", "count")

    name: str
    low: float
    high: float
    kind: Kind = "continuous"
    count: int | None = None
    scale: Scale = "linear"
    values: Array = field(default_factory=lambda: np.empty(0))
    unit: str = ""
    distribution: Distribution | None = None

    def __post_init__(self) -> None:
        for complaint in self._complaints():
            raise OptionError(f"{self.name}: {complaint}")

    @classmethod
    def of(cls, name: str, values: Iterable[float], unit: str = "") -> Variable:
        """A choice among values, SI, which keep their order. Raises OptionError for none, and those not finite."""
        try:
            own = np.array(values if isinstance(values, np.ndarray) else list(values), dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise OptionError(f"{name}: a list of numbers in SI is expected (found {values!r:.60})") from None
        if own.ndim != 1 or not len(own):
            raise OptionError(f"{name}: the values of a list have one axis and are at least one; not {own.shape}")
        if not np.isfinite(own).all():
            raise OptionError(f"{name}: values must be finite; value {np.flatnonzero(~np.isfinite(own))[0] + 1} is not")
        own.flags.writeable = False
        return cls(name, float(own.min()), float(own.max()), "choice", values=own, unit=unit)

    def _complaints(self) -> Iterable[str]:
        shown = f"{self.low:g} to {self.high:g}" + (f" {self.unit}" if self.unit not in ("", "1") else "")
        if self.distribution is not None or self.kind == "choice":
            return
        if not np.isfinite([self.low, self.high]).all():
            yield f"both ends of a range must be finite (found {shown})"
        if self.low >= self.high:
            what = "is empty" if self.low == self.high else "runs backwards"
            yield f"the range from {shown} {what}; write LOW:HIGH, the lower one first"
        if not np.isfinite(self.high - self.low):
            yield f"the range from {shown} is too wide for double precision"
        if self.scale == "log" and self.low <= 0:
            yield f"equal ratios (log) need a range above zero (found {shown})"
        if self.kind == "integer":
            yield from self._integer_complaints(shown)
        if self.count is not None and self.count < 2:
            yield f"a range takes at least 2 values on a grid, not {self.count}; a single one is a parameter to set"

    def _integer_complaints(self, shown: str) -> Iterable[str]:
        if self.low != round(self.low) or self.high != round(self.high):
            yield f"a range of integers goes from one to another (found {shown})"
        if max(abs(self.low), abs(self.high)) > 2**53:
            yield f"integers beyond 2^53 are not exact in double precision (found {shown})"
        if self.scale == "log":
            yield "integers are evenly spaced; give those in equal ratios as a list"
        if self.count is not None and self.count > 1 and (self.high - self.low) % (self.count - 1):
            yield f"{self.count} evenly spaced values from {shown} are not all integers"

    @property
    def levels(self) -> int | None:
        """How many values it takes on a grid; None for a range that does not say so."""
        if self.kind == "choice":
            return len(self.values)
        return int(self.high - self.low) + 1 if self.kind == "integer" and self.count is None else self.count

    def level(self, numbers: Numbers) -> Array:
        """The values of these numbers on a grid, counted from zero."""
        if self.kind == "choice":
            return self.values[numbers]
        last = (self.levels or 2) - 1
        if self.kind == "integer":
            return np.asarray(self.low + numbers * ((self.high - self.low) // last), dtype=float)
        return self._between(numbers / last)

    def at(self, u: Array) -> Array:
        """The values at the parts `u` of all of them, 0 < u < 1."""
        if self.distribution is not None:
            return self.distribution.quantile(u)
        if self.kind == "continuous":
            return self._between(u)
        every = len(self.values) or int(self.high - self.low) + 1
        numbers = np.minimum((u * every).astype(np.int64), every - 1)
        return self.values[numbers] if self.kind == "choice" else np.asarray(self.low + numbers, dtype=float)

    def _between(self, part: Array) -> Array:
        if self.scale == "log":
            low, high = np.log(self.low), np.log(self.high)
            found = np.exp(low + (high - low) * part)
        else:
            found = self.low + (self.high - self.low) * part
        found = np.where(part == 0, self.low, np.where(part == 1, self.high, found))
        return np.asarray(np.clip(found, self.low, self.high), dtype=float)

    def describe(self) -> dict[str, Any]:
        """Plain data that tell it from every other variable."""
        found: dict[str, Any] = {"name": self.name, "unit": self.unit, "kind": self.kind}
        if self.distribution is not None:
            return found | {"distribution": self.distribution.describe()}
        if self.kind != "choice":
            return found | {"low": self.low, "high": self.high, "count": self.count, "scale": self.scale}
        if len(self.values) <= TOLD:
            return found | {"values": self.values.tolist()}
        return found | {"count": len(self.values), "sha256": sha256(self.values.astype("<f8").tobytes()).hexdigest()}
