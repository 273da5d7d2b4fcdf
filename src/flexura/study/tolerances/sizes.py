"""Which sizes scatter: tolerances of parameters, and the copies of parts that each have their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.mechanism import Mechanism, Parameter, Spread, parameter_values, with_own_copies
from flexura.study.space import Variable, variables
from flexura.study.tolerances.distributions import Distribution, Normal
from flexura.study.tolerances.linear import Box
from flexura.study.tolerances.result import ToleratedSize
from flexura.study.tolerances.spreads import FORMS, distribution_of

Given = str | Spread
Vary = Mapping[str, Given] | Sequence[str] | str
"""Tolerances by parameter, or texts NAME=TOLERANCE."""


@dataclass(frozen=True)
class Sizes:
    """A mechanism whose copies have parameters of their own, the sizes that scatter and the positions of each
    tolerance's."""

    mechanism: Mechanism
    sizes: tuple[ToleratedSize, ...]
    variables: tuple[Variable, ...]
    tolerances: tuple[str, ...]
    groups: tuple[tuple[int, ...], ...]

    def box(self, drawn: Array) -> Box:
        """The range of all sizes, with samples (N, d) of them."""
        nominal, low, high = np.array([(size.nominal, size.low, size.high) for size in self.sizes]).T
        return Box(nominal, low, high, drawn)


def sizes_of(mechanism: Mechanism, fixed: Mapping[str, float], vary: Vary, each: bool | Sequence[str] = True) -> Sizes:
    """The sizes of tolerances about their values, with `fixed` parameters set; every copy of a part has its own where
    `each` names the parameter, or is true and a file does not say otherwise.

    Raises OptionError for text that is no tolerance, for parameters that are unknown, follow from others or are named
    twice, and for tolerances that go beyond their bounds.
    """
    given = _by_name(vary)
    own_each = [name for name, own in given.items() if not isinstance(own, Spread) or own.each]
    chosen = [each] if isinstance(each, str) else (own_each if each is True else list(each or ()))
    for name in chosen:
        if name not in given:
            raise OptionError(f"{name!r} has no tolerance for each copy to have its own; with one: {', '.join(given)}")
    values = parameter_values(mechanism, fixed)
    variables(mechanism, {name: [float(values.get(name, 0.0))] for name in given})
    copied, names = with_own_copies(mechanism, chosen) if chosen else (mechanism, {})
    nominal = {name: float(value) for name, value in parameter_values(copied, fixed).items()}
    sizes, groups, vary_each = list[ToleratedSize](), list[tuple[int, ...]](), list[Variable]()
    for name, text in given.items():
        copies = tuple(dict.fromkeys(names[name].values())) if name in names else (name,)
        groups.append(tuple(range(len(sizes), len(sizes) + len(copies))))
        unit = mechanism.parameters[name].unit
        for copy in copies:
            at = nominal[copy]
            own = distribution_of(mechanism, name, text, {**nominal, name: at})
            _check_bounds(copy, copied.parameters[copy], own)
            ends = (own.low, own.high, own.mean, own.deviation)
            sizes.append(ToleratedSize(copy, name, unit, at, *ends, own.describe()))
            vary_each.append(Variable(copy, own.low, own.high, unit=unit, distribution=own))
    return Sizes(_free(copied, sizes), tuple(sizes), tuple(vary_each), tuple(given), tuple(groups))


def _free(mechanism: Mechanism, sizes: Sequence[ToleratedSize]) -> Mechanism:
    """The mechanism with sizes that are numbers and follow from nothing, as they scatter by themselves."""
    known = mechanism.parameters
    own = {size.name: known[size.name].replaced({"value": size.nominal}) for size in sizes}
    return mechanism.replaced({"parameters": {**known, **own}})


def _check_bounds(name: str, parameter: Parameter, own: Distribution) -> None:
    """Refuse a tolerance that goes beyond the bounds of its parameter; tails of a normal distribution fail alone."""
    if isinstance(own, Normal) and not own.is_cut:
        return
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    for side, bound, end in (
        ("below the minimum", parameter.minimum, own.low),
        ("above the maximum", parameter.maximum, own.high),
    ):
        if isinstance(bound, float) and (end < bound if side.startswith("below") else end > bound):
            raise OptionError(f"{name}: the tolerance reaches {end:g}{unit}, {side} {bound:g}{unit} of the parameter")


def _by_name(vary: Vary) -> dict[str, Given]:
    if isinstance(vary, Mapping):
        found = dict(vary)
    else:
        found = dict[str, Given]()
        for text in [vary] if isinstance(vary, str) else vary:
            name, equals, own = (part.strip() for part in str(text).partition("="))
            if not (name and equals and own):
                raise OptionError(f"{text!r}: NAME=TOLERANCE is expected; {FORMS}")
            if name in found:
                raise OptionError(f"{name} has a tolerance already; give one")
            found[name] = own
    if not found:
        raise OptionError(f"no size has a tolerance; {FORMS}")
    return found
