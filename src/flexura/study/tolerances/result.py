"""What tolerances do to a mechanism: spreads, yields, worst cases, and which tolerance to tighten first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flexura.arrays import Array, Index
from flexura.errors import Diagnostic, OptionError
from flexura.results import Tabular
from flexura.study.questions import Margins
from flexura.study.requirements import OfThePart
from flexura.study.tolerances.nets import Estimate, SobolIndices, share_interval
from flexura.study.tolerances.worst_case import Extreme
from flexura.tables import Item, Line, Table, quantity


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
        *("model_error", "model_error_reason", "requirements"),
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
        known = [spread.text for spread in self.quantities]
        if text not in known:
            raise OptionError(f"{text!r} is no quantity of this study; known: {', '.join(known)}")
        return known.index(text)

    def influence(self, text: str) -> dict[str, float]:
        """What share of the variance of a quantity each tolerance answers for, the largest first.

        Total Sobol indices where they were asked for, otherwise shares by slopes; NaN where neither tells.
        """
        k = self._number(text)
        if self.indices is not None:
            shares = self.indices.total[:, k]
        else:
            of_sizes, tolerance = self.quantities[k].variance_share, np.array([size.tolerance for size in self.sizes])
            shares = np.array([of_sizes[tolerance == name].sum() for name in self.tolerances])
        order = np.argsort(-np.nan_to_num(shares, nan=-1.0), kind="stable")
        return {self.tolerances[j]: float(shares[j]) for j in order}

    @property
    def tighten_first(self) -> dict[str, str | None]:
        """By quantity, the tolerance that answers for most of its variance; None where nothing scatters."""
        ranked = {spread.text: next(iter(self.influence(spread.text).items())) for spread in self.quantities}
        return {text: name if np.isfinite(share) and share > 0 else None for text, (name, share) in ranked.items()}

    def histogram(self, text: str, bins: int | None = None) -> tuple[Array, Index]:
        """Edges (bins + 1,), SI, and samples between them (bins,) of a quantity; by the rule of Freedman and Diaconis
        (1981) where no number is given."""
        values = self._sorted(text)
        if not len(values):
            return np.zeros(0), np.zeros(0, dtype=np.intp)
        counts, edges = np.histogram(values, bins=bins or "fd")
        return edges, counts

    def yield_curve(self, text: str, points: int = 201) -> tuple[Array, Array]:
        """Limits (points,), SI, and the share (points,) of all parts of which a quantity is at least that much."""
        values = self._sorted(text)
        limits = np.linspace(values[0], values[-1], points) if len(values) else np.zeros(0)
        return limits, (len(values) - np.searchsorted(values, limits, side="left")) / self.samples

    def tornado(self, text: str) -> dict[str, tuple[float, float]]:
        """By size, what a quantity comes to, to first order, with this size alone at the ends of its tolerance, SI; the
        largest difference first."""
        spread = self.of(text)
        low, high, at = np.array([(size.low, size.high, size.nominal) for size in self.sizes]).T
        first, last = spread.nominal + spread.slope * (low - at), spread.nominal + spread.slope * (high - at)
        order = np.argsort(-np.nan_to_num(np.abs(last - first)), kind="stable")
        return {self.sizes[k].name: (float(first[k]), float(last[k])) for k in order}

    def yield_interval(self, text: str, limits: Array) -> tuple[Array, Array]:
        """Ends (n,) and (n,) of the intervals of the shares of all parts of which a quantity is at least limits (n,),
        SI (theory eqs. U3-U5)."""
        values = self.values[:, self._number(text)].reshape(self.scramblings, -1)
        shares = [share_interval(values >= limit, self.confidence) for limit in limits]
        return np.array([share.low for share in shares]), np.array([share.high for share in shares])

    def _sorted(self, text: str) -> Array:
        values = self.values[:, self._number(text)]
        return np.sort(values[np.isfinite(values)])

    def presentation(self) -> Iterator[Item]:
        """Yields, spreads, worst cases, and what each tolerance answers for."""
        for relation in self.yields:
            share = relation.share
            text = f"{relation.text}: {_percent(share.value)} of parts ({_percent(share.low)} to {_percent(share.high)}"
            text += f", by {share.method}); {relation.failing} of {self.samples} samples fail"
            text += "; the nominal design does, too" if relation.is_met_nominally is False else ""
            yield Line(text + ("; met in the worst case" if relation.is_met_at_worst else ""))
        spreads = self.quantities
        columns: dict[str, list[str]] = {
            "quantity": [spread.text for spread in spreads],
            "nominal": [quantity(spread.nominal, spread.unit) for spread in spreads],
            "mean": [_with_interval(spread.mean, spread.unit) for spread in spreads],
            "standard deviation": [quantity(spread.deviation, spread.unit, 3) for spread in spreads],
        }
        for k, share in enumerate(self.shares):
            cells = [_with_interval(spread.percentiles[k], spread.unit) for spread in spreads]
            columns[f"{100 * share:g} % are below"] = cells
        for end, further in (("low", "less"), ("high", "more")):
            worst = [(getattr(spread, f"worst_{end}"), spread.unit) for spread in spreads]
            # there may be a worse one beyond what is no corner of the tolerances
            cells = [quantity(at.value, unit) + ("" if at.is_vertex else f" or {further}") for at, unit in worst]
            columns[f"worst case, {end}"] = cells
        yield Table(columns, "quantities")
        yield Table(self._influences(), "tolerances")
        yield from self.margin_facts()

    def _influences(self) -> dict[str, list[Any]]:
        """A row for each tolerance: what share of each variance it answers for, with its interval."""
        of_each = [size.tolerance for size in self.sizes]
        columns: dict[str, list[Any]] = {
            "tolerance": list(self.tolerances),
            "sizes": list(map(of_each.count, self.tolerances)),
        }
        for k, text in enumerate(spread.text for spread in self.quantities):
            shares, cells = self.influence(text), []
            for g, name in enumerate(self.tolerances):
                off = "" if self.indices is None else f" ± {100 * self.indices.total_half[g, k]:.2g}"
                first = ", first" if self.tighten_first[text] == name and len(self.tolerances) > 1 else ""
                cells.append(f"{100 * shares[name]:.3g}{off} %{first}" if np.isfinite(shares[name]) else "")
            columns[f"of the variance of {text}"] = cells
        return columns

    def _title(self) -> str:
        count = f"{len(self.sizes)} independent sizes, {self.samples} samples"
        return f"{count}, intervals of {100 * self.confidence:g} %"

    def _columns(self) -> dict[str, Any]:
        """A row for each quantity, in the unit of its spread."""
        spreads = self.quantities
        columns: dict[str, Any] = {
            "quantity": [spread.text for spread in spreads],
            "unit": [spread.unit for spread in spreads],
            "nominal [SI]": [spread.nominal for spread in spreads],
            "mean [SI]": [spread.mean.value for spread in spreads],
            "standard deviation [SI]": [spread.deviation for spread in spreads],
            "linear deviation [SI]": [spread.linear_deviation for spread in spreads],
        }
        for k, share in enumerate(self.shares):
            for what, part in (("", "value"), (" lower", "low"), (" upper", "high")):
                heading = f"{100 * share:g} %{what} [SI]"
                columns[heading] = [getattr(spread.percentiles[k], part) for spread in spreads]
        columns["worst low [SI]"] = [spread.worst_low.value for spread in spreads]
        columns["worst high [SI]"] = [spread.worst_high.value for spread in spreads]
        return columns | {"tighten first": [self.tighten_first[spread.text] for spread in spreads]}


def _percent(share: float) -> str:
    """A share in per cent, with the digits that tell it from all and none."""
    off = min(share, 1 - share)
    return f"{100 * share:.{2 if off >= 1e-3 or off == 0 else 4}f} %"


def _with_interval(estimate: Estimate, unit: str) -> str:
    """A value, and how far its interval reaches."""
    value = quantity(estimate.value, unit)
    if not np.isfinite((estimate.low, estimate.high)).all():
        return f"{value}, no bound"
    return f"{value} ± {quantity(max(estimate.high - estimate.value, estimate.value - estimate.low), unit, 3)}"
