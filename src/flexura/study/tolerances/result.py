"""What tolerances do to a mechanism: spreads, yields, worst cases, and which tolerance to tighten first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.arrays import Array
from flexura.errors import Diagnostic, OptionError
from flexura.results import Tabular
from flexura.study.questions import Margins, OfThePart
from flexura.study.tolerances.nets import Estimate, SobolIndices, share_interval
from flexura.study.tolerances.worst_case import Extreme
from flexura.tables import Facts, Table, percent, quantity


@dataclass(frozen=True)
class ToleratedSize:
    """A size that scatters independently of all others: one copy's own, or one that all copies share, in SI."""

    name: str
    tolerance: str
    unit: str
    nominal: float
    low: float
    high: float
    mean: float
    deviation: float
    distribution: dict[str, Any]


@dataclass(frozen=True)
class QuantitySpread:
    """How one quantity scatters, SI: mean, standard deviation and percentiles of the samples, each with its interval.

    `smallest` and `largest` are the furthest samples, `worst_low` and `worst_high` what sizes within their tolerances
    may lead to. `slope` (d,) and `variance_share` (d,) are those of the sizes, `linear_deviation` what they make of
    the spread; NaN where there is none, for which `no_slope` has the words.
    """

    text: str
    unit: str
    nominal: float
    mean: Estimate
    deviation: float
    percentiles: tuple[Estimate, ...]
    smallest: float
    largest: float
    worst_low: Extreme
    worst_high: Extreme
    slope: Array
    variance_share: Array
    linear_deviation: float
    no_slope: str = ""


@dataclass(frozen=True)
class Yield:
    """The share of parts that meet a requirement, or all of them, with its interval, and what the nominal design and
    the worst case say of it; None where nothing can be said.

    Where one asked `quantity` is held against a number, that is the `limit`, SI.
    """

    text: str
    share: Estimate
    failing: int
    is_met_nominally: bool | None
    is_met_at_worst: bool | None
    quantity: str = ""
    limit: float | None = None


@dataclass(frozen=True, repr=False)
class Tolerance(OfThePart, Tabular):
    """How q quantities scatter with d independent sizes of g tolerances.

    `shares` are those of the percentiles, `correlation` (q, q) is between the quantities, `indices` are the Sobol
    indices of the tolerances. `samples` designs were drawn, of which `failed` have no value, for the `reasons` with
    their numbers; `values` (N, q) and `drawn` (N, d), left out of the plain data, are the samples themselves.
    `margins` are model errors at the nominal design.
    """

    _shown = ("name", "samples", "quantities", "yields")
    _told = (
        *("name", "sizes", "tolerances", "quantities", "shares", "confidence", "yields", "correlation", "indices"),
        *("samples", "scramblings", "seed", "failed", "reasons", "tighten_first"),
        *("model_error", "model_error_reason"),
    )

    name: str
    sizes: tuple[ToleratedSize, ...]
    tolerances: tuple[str, ...]
    quantities: tuple[QuantitySpread, ...]
    shares: tuple[float, ...]
    confidence: float
    yields: tuple[Yield, ...]
    correlation: Array
    indices: SobolIndices | None
    samples: int
    scramblings: int
    seed: int
    failed: int
    reasons: Mapping[str, int]
    values: Array = field(repr=False)
    drawn: Array = field(repr=False)
    warnings: tuple[Diagnostic, ...] = ()
    notes: tuple[str, ...] = ()
    margins: Margins | None = field(default=None, repr=False, compare=False)

    def of(self, text: str) -> QuantitySpread:
        """The spread of a quantity by its name. Raises OptionError for one that was not asked."""
        return self.quantities[self._number(text)]

    def _number(self, text: str) -> int:
        known = [own.text for own in self.quantities]
        if text not in known:
            raise OptionError(f"{text!r} is no quantity of this study; known: {', '.join(known)}")
        return known.index(text)

    def influence(self, text: str) -> dict[str, float]:
        """What share of the variance of a quantity each tolerance answers for, the largest first.

        Total Sobol indices where they were asked for, otherwise shares by slopes; NaN where neither tells.
        """
        k = self._number(text)
        if self.indices is not None:
            own = self.indices.total[:, k]
        else:
            share = self.quantities[k].variance_share
            of = np.array([size.tolerance for size in self.sizes])
            own = np.array([share[of == name].sum() for name in self.tolerances])
        order = np.argsort(-np.nan_to_num(own, nan=-1.0), kind="stable")
        return {self.tolerances[j]: float(own[j]) for j in order}

    @property
    def tighten_first(self) -> dict[str, str | None]:
        """By quantity, the tolerance that answers for most of its variance; None where nothing scatters."""
        ranked = {own.text: next(iter(self.influence(own.text).items())) for own in self.quantities}
        return {text: name if np.isfinite(share) and share > 0 else None for text, (name, share) in ranked.items()}

    def histogram(self, text: str, bins: int | None = None) -> tuple[Array, NDArray[np.intp]]:
        """Edges (bins + 1,), SI, and samples between them (bins,) of a quantity; by the rule of Freedman and Diaconis
        (1981) where no number is given."""
        own = self._sorted(text)
        if not len(own):
            return np.zeros(0), np.zeros(0, dtype=np.intp)
        counts, edges = np.histogram(own, bins=bins or "fd")
        return edges, counts

    def yield_curve(self, text: str, points: int = 201) -> tuple[Array, Array]:
        """Limits (points,), SI, and the share (points,) of all parts of which a quantity is at least that much."""
        own = self._sorted(text)
        limits = np.linspace(own[0], own[-1], points) if len(own) else np.zeros(0)
        return limits, (len(own) - np.searchsorted(own, limits, side="left")) / self.samples

    def tornado(self, text: str) -> dict[str, tuple[float, float]]:
        """By size, what a quantity comes to, to first order, with this size alone at the ends of its tolerance, SI; the
        largest difference first."""
        own = self.of(text)
        low, high, at = (np.array([getattr(s, what) for s in self.sizes]) for what in ("low", "high", "nominal"))
        first, last = own.nominal + own.slope * (low - at), own.nominal + own.slope * (high - at)
        order = np.argsort(-np.nan_to_num(np.abs(last - first)), kind="stable")
        return {self.sizes[k].name: (float(first[k]), float(last[k])) for k in order}

    def yield_interval(self, text: str, limits: Array) -> tuple[Array, Array]:
        """Ends (n,) and (n,) of the intervals of the shares of all parts of which a quantity is at least limits (n,),
        SI (theory eqs. U3-U5)."""
        own = self.values[:, self._number(text)].reshape(self.scramblings, -1)
        found = [share_interval(own >= limit, self.confidence) for limit in limits]
        return np.array([one.low for one in found]), np.array([one.high for one in found])

    def _sorted(self, text: str) -> Array:
        own = self.values[:, self._number(text)]
        return np.sort(own[np.isfinite(own)])

    def _view(self) -> Iterator[Facts | Table]:
        shown = {own.text: f"{percent(own.share.value, 4)} of parts" for own in self.yields}
        yield Facts({**shown, "samples": self.samples, "independent sizes": len(self.sizes)})
        rows = self.quantities
        yield Table(
            {
                "quantity": [own.text for own in rows],
                "nominal": [quantity(own.nominal, own.unit) for own in rows],
                "mean": [quantity(own.mean.value, own.unit) for own in rows],
                "standard deviation": [quantity(own.deviation, own.unit, 3) for own in rows],
                "worst case": [
                    f"{quantity(own.worst_low.value, own.unit)} to {quantity(own.worst_high.value, own.unit)}"
                    for own in rows
                ],
                "tighten first": [self.tighten_first[own.text] or "" for own in rows],
                **({} if self.margins is None else {"model error": [self.margins.texts[own.text] for own in rows]}),
            },
            "quantities",
        )

    def _columns(self) -> dict[str, Any]:
        """A row for each quantity, in the unit of its own."""
        rows = self.quantities
        found: dict[str, Any] = {
            "quantity": [own.text for own in rows],
            "unit": [own.unit for own in rows],
            "nominal [SI]": [own.nominal for own in rows],
            "mean [SI]": [own.mean.value for own in rows],
            "standard deviation [SI]": [own.deviation for own in rows],
            "linear deviation [SI]": [own.linear_deviation for own in rows],
        }
        for k, share in enumerate(self.shares):
            for what, part in (("", "value"), (" lower", "low"), (" upper", "high")):
                heading = f"{100 * share:g} %{what} [SI]"
                found[heading] = [getattr(own.percentiles[k], part) for own in rows]
        found["worst low [SI]"] = [own.worst_low.value for own in rows]
        found["worst high [SI]"] = [own.worst_high.value for own in rows]
        return found | {"tighten first": [self.tighten_first[own.text] for own in rows]}
