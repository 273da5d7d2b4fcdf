"""Commands and signals at inputs as text: each amount in a unit of its input."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any

from flexura.errors import ExpressionError, OptionError
from flexura.units import parse_quantity, parse_unit, split_quantity

Reader = Callable[[str], float]
"""Reads one number, perhaps with a unit, as SI. Raises OptionError or ExpressionError."""

# N*m/deg has the dimension of N*m and 1 Hz^2 that of 1 rad/s^2, and neither is the same number: what has no dimension,
# or only that of a rate, counts where angles do and by these names alone
_ANGLES = re.compile(r"[munµμ]?rad|deg|°|rev|turn|arcmin|arcsec|rpm")
_NAMES = re.compile(r"[A-Za-zµμ°%]+")


class CommandReader:
    """Reads what options such as `--actuator NAME=VALUE` say of the inputs of one mechanism.

    A value with a unit, as in `75 V` or `3 um`, must fit the input that is named, and every one that a wildcard stands
    for. Zero needs none.
    """

    def __init__(self, mechanism: Any, parameters: dict[str, float]) -> None:
        self._mechanism, self._parameters = mechanism, parameters

    def values(self, option: str, texts: Iterable[str] | None, *, impulse: bool = False) -> dict[str, float]:
        """Values by name of an option NAME=VALUE, SI; those of an `impulse` in the unit of the input times s.

        Raises OptionError for text that is none, units of another quantity and names that are given twice.
        """
        found: dict[str, float] = {}
        for text in texts or []:
            name, (value,) = self.amounts(option, text, "NAME=VALUE", impulse=impulse)
            if name in found:
                raise OptionError(f"{option} {text!r}: {name} has a value already; give one")
            found[name] = value
        return found

    def amounts(
        self,
        option: str,
        text: str,
        form: str,
        others: Sequence[Reader] = (),
        *,
        optional: bool = False,
        impulse: bool = False,
    ) -> tuple[str, list[float]]:
        """A name, its amount, and `others`, each with its own reader; all or none of these when `optional`.

        Raises OptionError for text that is not of the `form`, and for units of other quantities.
        """
        name, equals, rest = text.partition("=")
        first, *more = rest.split(",")
        if not equals or not (len(more) == len(others) or (optional and not more)):
            rule = "a value is a number with a unit of the input, as in 3 um"
            raise OptionError(f"{option} {text!r}: {form} is expected; {rule}")
        try:
            amount = self._amount(name, first, impulse)
            return name, [amount, *(read(part) for read, part in zip(others, more, strict=False))]
        except (ExpressionError, OptionError) as error:
            raise OptionError(f"{option} {text!r}: {error}") from None

    def _amount(self, name: str, text: str, impulse: bool) -> float:
        """An amount, SI, of which the unit is that of every input that the name stands for."""
        if re.match(r"\s*[+-]?(nan|inf)", text, re.IGNORECASE):
            raise OptionError("a number must be finite")
        value, exponents = parse_quantity(text)
        written = split_quantity(text)[1]
        if not written and not value:
            return value
        for placed in self._placement.inputs([name]):
            quantity, unit = placed.channel.quantity, placed.channel.unit
            unit = _times_second(unit) if impulse else unit
            if not written:
                raise OptionError(f"{text.strip()!r} has no unit; {placed.channel.name} takes {quantity} in {unit}")
            if exponents != parse_unit(unit)[1] or not _counts_as(written, unit):
                word = f"impulses of {quantity}" if impulse else quantity
                raise OptionError(
                    f"{written} is no unit of {placed.channel.name}, which takes {word} in {unit}; "
                    f"write it in {unit} or a unit of the same kind"
                )
        return value

    @cached_property
    def _placement(self) -> Any:
        """The inputs of the mechanism, found once and only when a unit is to be judged."""
        from flexura.structure import Design, plan_of
        from flexura.systems import Ports

        plan = plan_of(self._mechanism)
        plan.verify(self._parameters)
        return Ports(Design.of(plan, self._parameters))


def _times_second(unit: str) -> str:
    """The SI unit times s: `N*s`, or `m/s` of `m/s^2`."""
    return unit.removesuffix("^2") if unit.endswith("/s^2") else f"{unit}*s"


def _counts_as(written: str, unit: str) -> bool:
    """False for a unit of the right dimension that counts angles or cycles where `unit` does not."""
    rate = parse_unit("1/s")[1]
    bare = [name for name in _NAMES.findall(written) if not any(e := parse_unit(name)[1]) or e == rate]
    return all("rad" in unit and _ANGLES.fullmatch(name) for name in bare)
