"""Which sizes scatter: tolerances of parameters, and the copies of parts that each have their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flexura.errors import OptionError
from flexura.mechanism import Mechanism, Parameter, Spread, with_own_copies
from flexura.study.space import Variable, variables
from flexura.study.tolerances.distributions import Distribution, Normal
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


def sizes_of(
    mechanism: Mechanism, nominal: Mapping[str, float], vary: Vary, each: bool | Sequence[str] = True
) -> Sizes:
    """The sizes of tolerances; every copy of a part has its own where `each` names the parameter, or is true and a file
    does not say otherwise.

    Raises OptionError for text that is no tolerance, for parameters that are unknown, follow from others or are named
    twice, and for tolerances that go beyond their bounds.
    """
    given = _by_name(vary)
    own_each = [name for name, own in given.items() if not isinstance(own, Spread) or own.each]
    chosen = [each] if isinstance(each, str) else (own_each if each is True else list(each or ()))
    for name in chosen:
        if name not in given:
            raise OptionError(f"{name!r} has no tolerance for each copy to have its own; with one: {', '.join(given)}")
    variables(mechanism, {name: [nominal.get(name, 0.0)] for name in given})
    found = {name: distribution_of(mechanism, name, own, nominal) for name, own in given.items()}
    for name, own in found.items():
        _check_bounds(name, mechanism.parameters[name], own)
    copied, names = with_own_copies(mechanism, chosen) if chosen else (mechanism, {})
    sizes, groups = list[ToleratedSize](), list[tuple[int, ...]]()
    for name, own in found.items():
        copies = tuple(dict.fromkeys(names[name].values())) if name in names else (name,)
        groups.append(tuple(range(len(sizes), len(sizes) + len(copies))))
        unit, at = mechanism.parameters[name].unit, nominal[name]
        numbers = (at, own.low, own.high, own.mean, own.deviation)
        sizes += [ToleratedSize(copy, name, unit, *numbers, own.describe()) for copy in copies]
    vary_each = [
        Variable(size.name, size.low, size.high, unit=size.unit, distribution=found[size.tolerance]) for size in sizes
    ]
    return Sizes(copied, tuple(sizes), tuple(vary_each), tuple(found), tuple(groups))


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
