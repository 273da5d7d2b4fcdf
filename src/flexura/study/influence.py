"""What each parameter does to what is asked of one design, in per cent per per cent, by exact slopes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from flexura.arguments import verb
from flexura.arrays import Array, Bools
from flexura.derivatives import free_names
from flexura.errors import Diagnostic
from flexura.full_order import plan_of
from flexura.mechanism import HELD, Mechanism
from flexura.results import Tabular
from flexura.structure import Plan, one_design
from flexura.study.questions import Margins, Slopes, questions
from flexura.study.requirements import OfThePart
from flexura.tables import Item, Table, quantity


@dataclass(frozen=True, repr=False)
class Sensitivity(OfThePart, Tabular):
    """Slopes of q quantities in P parameters at one design.

    `value` (q,) and `nominal` (P,) are in the SI units `units` and `parameter_units`, `slope` (q, P) in the one per the
    other. Frequencies that coincide, `repeated` by their positions, have no slopes of their own, as they part: their
    `slope` is that of their mean, `lowest` and `highest` (q, P) are those of the frequencies that part most. Of all
    others the three are equal. `is_exact` (q,) says where slopes are no differences; without one it is NaN. `margins`
    are model errors.
    """

    _shown = ("name", "quantities", "parameters")
    _told = (
        *("name", "quantities", "units", "value", "parameters", "parameter_units", "nominal"),
        *("slope", "lowest", "highest", "relative", "repeated", "is_exact"),
        *("model_error", "model_error_reason"),
    )

    name: str
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    value: Array
    parameters: tuple[str, ...]
    parameter_units: tuple[str, ...]
    nominal: Array
    slope: Array
    lowest: Array
    highest: Array
    is_exact: Bools
    repeated: tuple[tuple[int, ...], ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    notes: tuple[str, ...] = ()
    margins: Margins | None = field(default=None, repr=False, compare=False)

    @property
    def relative(self) -> Array:
        """(p/y) dy/dp (q, P); NaN where the quantity or the parameter is zero (theory eq. U13)."""
        scale = np.where(self.value != 0, self.value, np.nan)[:, None]
        return self.slope * np.where(self.nominal != 0, self.nominal, np.nan) / scale

    def ranked(self, quantity: str) -> list[str]:
        """Parameters by how much a per cent of each does to a quantity, the most first, those that are zero last."""
        sizes = np.nan_to_num(np.abs(self.relative[self.quantities.index(quantity)]), nan=-1.0)
        return [self.parameters[k] for k in np.argsort(-sizes, kind="stable")]

    def presentation(self) -> Iterator[Item]:
        """What 1 % of each parameter, a row, does to each quantity, a column; its slope where one of both is zero."""
        values = zip(self.quantities, self.units, self.value.tolist(), strict=True)
        headings = [f"{text}\n{quantity(value, unit)}" for text, unit, value in values]
        parameters = zip(self.nominal.tolist(), self.parameter_units, strict=True)
        columns = {name: [self._change(k, p) for p in range(len(self.parameters))] for k, name in enumerate(headings)}
        is_now = [quantity(value, unit) for value, unit in parameters]
        yield Table({"parameter, by +1 %": self.parameters, "is": is_now, **columns}, "parameters")
        yield from self.margin_facts()

    def _change(self, k: int, p: int) -> str:
        """Per cent per per cent; the slope with its unit where one of both is zero; `none` where a warning says why."""
        value, at = float(self.value[k]), float(self.nominal[p])
        low, high = float(self.lowest[k, p]), float(self.highest[k, p])
        if not np.isfinite(low):
            return "none"
        unit, least = f"{self.units[k]} per {self.parameter_units[p]}", 0.0
        if value and at:
            low, high = sorted((low * at / value, high * at / value))
            unit, least = "%", 5e-7
        first, last = (f"{end + 0.0:+.3g}" if abs(end) > least else "0" for end in (low, high))
        return f"{first if first == last else f'{first} to {last}'} {unit}"

    def _columns(self) -> dict[str, Any]:
        """A row for each quantity and parameter."""
        q, P = self.slope.shape
        return {
            "quantity": np.repeat(self.quantities, P),
            "unit": np.repeat(self.units, P),
            "value [SI]": np.repeat(self.value, P),
            "parameter": np.tile(self.parameters, q),
            "parameter value [SI]": np.tile(self.nominal, q),
            "slope [SI]": self.slope.ravel(),
            "lowest slope [SI]": self.lowest.ravel(),
            "highest slope [SI]": self.highest.ravel(),
            "relative": self.relative.ravel(),
        }


@verb
def sensitivity(
    model: Mechanism | Plan,
    parameters: Mapping[str, float] | None = None,
    *,
    ask: str | Sequence[str],
    free: Sequence[str] | None = None,
) -> Sensitivity:
    """What each of the parameters `free` does to everything that is asked, in per cent per per cent.

    All parameters that are numbers are taken when none are named. A parameter that is zero has no per cent: its slope
    is told per unit. Raises ModelError, OptionError and SolverError.
    """
    plan = plan_of(model, parameters)
    chosen = free_names(plan, free)
    at = one_design(parameters)
    plan.verify(at)
    asked = questions(plan, ask)
    values = plan.parameter_values(at)
    slopes = asked.slopes(at, chosen)
    slope, lowest, highest = _ranges(slopes)
    held = [name for name, parameter in plan.mechanism.parameters.items() if parameter.is_held]
    result = Sensitivity(
        name=plan.mechanism.name,
        quantities=tuple(quantity.text for quantity in asked.quantities),
        units=tuple(quantity.unit for quantity in asked.quantities),
        value=np.asarray(slopes.value, dtype=float),
        parameters=chosen,
        parameter_units=tuple(plan.mechanism.parameters[name].unit for name in chosen),
        nominal=np.array([float(values[name]) for name in chosen]),
        slope=slope,
        lowest=lowest,
        highest=highest,
        is_exact=slopes.is_exact,
        repeated=slopes.repeated,
        margins=Margins(plan, at, asked.quantities),
    )
    left_out = [f"{', '.join(held)} left out: {HELD}"] if held and not free else []
    notes = (*_notes(result, slopes), *left_out, *asked.notes)
    return replace(result, warnings=tuple(_missing(result, slopes)), notes=notes)


def _missing(result: Sensitivity, slopes: Slopes) -> Iterator[Diagnostic]:
    """What has no value, or slopes that are missing; what lacks them for one reason is one warning."""
    reasons = dict[str, dict[str, int]]()
    for text, value, slope, why in zip(result.quantities, slopes.value, slopes.slope, slopes.reason, strict=True):
        missing = int(np.count_nonzero(~np.isfinite(slope)))
        if missing or not np.isfinite(value):
            reasons.setdefault(why.removeprefix(f"{text}: ") or "it is not finite", {})[text] = missing
    for why, counts in reasons.items():
        place = ", ".join(counts)
        yield Diagnostic("study", place, max(counts.values()), 0.0, "1", f"{place}: {why}")


def _ranges(slopes: Slopes) -> tuple[Array, Array, Array]:
    """Slopes, and the lowest and highest of frequencies that coincide (q, P)."""
    slope = np.array(slopes.slope, dtype=float)
    lowest, highest = slope.copy(), slope.copy()
    for group, matrices in zip(slopes.repeated, slopes.directional, strict=True):
        each = np.linalg.eigvalsh(np.moveaxis(matrices, -1, 0))
        rows = list(group)
        slope[rows], lowest[rows], highest[rows] = each.mean(axis=1), each[:, 0], each[:, -1]
    return slope, lowest, highest


def _notes(result: Sensitivity, slopes: Slopes) -> Iterator[str]:
    for group in slopes.repeated:
        listed = " and ".join(result.quantities[k] for k in group)
        yield f"{listed} coincide and part with most parameters: the slope is that of their mean, with its range"
    near = ", ".join(text for text, exact in zip(result.quantities, slopes.is_exact, strict=True) if not exact)
    if near:
        yield f"{near}: slopes by differences of fourth order, between designs nearby"
    for text, unit, value, least in zip(result.quantities, result.units, slopes.value, slopes.least, strict=True):
        if value == 0:
            below = f", below {quantity(float(least), unit, 2)} by round-off," if least else ""
            yield f"{text} is zero{below} and has no per cent: its slopes are per unit of the parameter"
    zero = [name for name, value in zip(result.parameters, result.nominal, strict=True) if value == 0]
    if zero:
        one, several = "is zero and has no per cent: its slopes are", "are zero, without per cent: slopes are"
        yield f"{', '.join(zero)} {one if len(zero) == 1 else several} per unit of the parameter"
