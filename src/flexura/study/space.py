"""Which designs a study is of: what varies, in which range or distribution, and the designs by number.

Design k is a function of k, so that memory is flat for any number of them.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.expressions import Expression
from flexura.mechanism import HELD, Mechanism, Parameter, Range, bounds
from flexura.modelfile import parse_override
from flexura.records import Record
from flexura.units import split_quantity

Kind = Literal["continuous", "integer", "choice"]
Scale = Literal["linear", "log"]

MOST_VALUES_DESCRIBED = 1000
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
        if self.distribution is None and self.kind != "choice":
            for fault in self._faults():
                raise OptionError(f"{self.name}: {fault}")

    @classmethod
    def of(cls, name: str, values: Iterable[float], unit: str = "") -> Variable:
        """A choice among values, SI, which keep their order. Raises OptionError for none, and those not finite."""
        try:
            choice = np.array(values if isinstance(values, np.ndarray) else list(values), dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise OptionError(f"{name}: a list of numbers in SI is expected (found {values!r:.60})") from None
        if choice.ndim != 1 or not len(choice):
            raise OptionError(f"{name}: the values of a list have one axis and are at least one; not {choice.shape}")
        if not np.isfinite(choice).all():
            first = np.flatnonzero(~np.isfinite(choice))[0] + 1
            raise OptionError(f"{name}: values must be finite; value {first} is not")
        choice.flags.writeable = False
        return cls(name, float(choice.min()), float(choice.max()), "choice", values=choice, unit=unit)

    @classmethod
    def described(cls, mechanism: Mechanism, name: str, variation: Any, values: Mapping[str, float]) -> Variable:
        """The variable that a study of the description names, at values of all parameters; an end that is left out is
        the bound of the parameter. Raises OptionError where that has none."""

        def number(value: Any) -> float:
            return float(value.evaluate(values)) if isinstance(value, Expression) else float(value)

        parameter = mechanism.parameters[name]
        if not isinstance(variation, Range):
            return cls.of(name, map(number, variation), parameter.unit)
        low, high = (
            float(bound) if end is None else number(end)
            for end, bound in zip((variation.from_, variation.to), bounds(name, parameter, values), strict=True)
        )
        if not np.isfinite(low + high):
            raise OptionError(f"{name} has no minimum and maximum in the file; give its range both ends")
        if variation.integer:
            low, high = float(math.ceil(low)), float(math.floor(high))
        kind = "integer" if variation.integer else "continuous"
        return cls(name, low, high, kind, variation.steps, variation.scale, unit=parameter.unit)

    def _faults(self) -> Iterator[str]:
        """What is wrong with a range."""
        low, high, count = self.low, self.high, self.count
        ends = f"{low:g} to {high:g}" + (f" {self.unit}" if self.unit not in ("", "1") else "")
        if not np.isfinite([low, high]).all():
            yield f"both ends of a range must be finite (found {ends})"
        if low >= high:
            what = "is empty" if low == high else "runs backwards"
            yield f"the range from {ends} {what}; write LOW:HIGH, the lower one first"
        if not np.isfinite(high - low):
            yield f"the range from {ends} is too wide for double precision"
        if self.scale == "log" and low <= 0:
            yield f"equal ratios (log) need a range above zero (found {ends})"
        if self.kind == "integer":
            if low != round(low) or high != round(high):
                yield f"a range of integers goes from one to another (found {ends})"
            if max(abs(low), abs(high)) > 2**53:
                yield f"integers beyond 2^53 are not exact in double precision (found {ends})"
            if self.scale == "log":
                yield "integers are evenly spaced; give those in equal ratios as a list"
            if count is not None and count > 1 and (high - low) % (count - 1):
                yield f"{count} evenly spaced values from {ends} are not all integers"
        if count is not None and count < 2:
            yield f"a range takes at least 2 values on a grid, not {count}; a single one is a parameter to set"

    @property
    def levels(self) -> int | None:
        """How many values it takes on a grid; None for a range that does not say so."""
        if self.kind == "choice":
            return len(self.values)
        return int(self.high - self.low) + 1 if self.kind == "integer" and self.count is None else self.count

    def level(self, numbers: NDArray[np.int64]) -> Array:
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
        count = len(self.values) or int(self.high - self.low) + 1
        numbers = np.minimum((u * count).astype(np.int64), count - 1)
        return self.values[numbers] if self.kind == "choice" else np.asarray(self.low + numbers, dtype=float)

    def _between(self, part: Array) -> Array:
        if self.scale == "log":
            low, high = np.log(self.low), np.log(self.high)
            values = np.exp(low + (high - low) * part)
        else:
            values = self.low + (self.high - self.low) * part
        values = np.where(part == 0, self.low, np.where(part == 1, self.high, values))
        return np.asarray(np.clip(values, self.low, self.high), dtype=float)

    def describe(self) -> dict[str, Any]:
        """Plain data that tell it from every other variable."""
        data: dict[str, Any] = {"name": self.name, "unit": self.unit, "kind": self.kind}
        if self.distribution is not None:
            return data | {"distribution": self.distribution.describe()}
        if self.kind != "choice":
            return data | {"low": self.low, "high": self.high, "count": self.count, "scale": self.scale}
        if len(self.values) <= MOST_VALUES_DESCRIBED:
            return data | {"values": self.values.tolist()}
        return data | {"count": len(self.values), "sha256": sha256(self.values.astype("<f8").tobytes()).hexdigest()}


Varied = str | Sequence["str | Variable"] | Mapping[str, "str | tuple[float, ...] | ArrayLike"]
"""What varies, by name: text with units, a tuple (low, high) or (low, high, count), or a list or array of values."""

FORM = "NAME=LOW:HIGH[:COUNT][:log|:integer] or NAME=VALUE,VALUE is expected, with units, e.g. thickness=0.2mm:0.6mm:50"
_WORDS = ("log", "linear", "integer")
_COMMA = re.compile(r",(?![^(]*\))")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def variables(mechanism: Mechanism, vary: Varied, fixed: Iterable[str] = ()) -> tuple[Variable, ...]:
    """The variables that text or Python describes, in order.

    Text is `NAME=LOW:HIGH`, with a count, the word `log` or `integer` behind further colons, or a list `NAME=A,B,C`;
    a number without a unit has that of the next. In Python a tuple is a range, (low, high) or (low, high, count), and
    a list or an array is values, in SI. Raises OptionError for what cannot be read, unknown parameters, those named
    twice, those that follow from others, those that are `fixed` to a value, empty ranges, and values outside the bounds
    of a parameter.
    """
    read: dict[str, Variable] = {}
    for entry in _entries(vary):
        variable = entry if isinstance(entry, Variable) else _read(mechanism, *entry)
        variable = replace(variable, unit=_checked_unit(mechanism, variable, fixed))
        if variable.name in read:
            raise OptionError(f"{variable.name} varies already; give it once")
        read[variable.name] = variable
    if not read:
        raise OptionError(f"nothing varies; {FORM}")
    return tuple(read.values())


def _entries(vary: Any) -> Iterator[Variable | tuple[str, Any]]:
    """Variables, or names with what is given of them."""
    if isinstance(vary, Mapping):
        yield from vary.items()
        return
    entries = [vary] if isinstance(vary, str | Variable) else vary
    if not isinstance(entries, Iterable) or any(not isinstance(entry, str | Variable) for entry in entries):
        raise OptionError(f"what varies is given by name, as {{'thickness': (2e-4, 6e-4)}}, or as text: {FORM}")
    for entry in entries:
        if isinstance(entry, Variable):
            yield entry
            continue
        name, equals, rest = (part.strip() for part in entry.partition("="))
        if not (name and equals and rest):
            raise OptionError(FORM)
        yield name, rest


def _read(mechanism: Mechanism, name: str, given: Any) -> Variable:
    unit = _parameter(mechanism, name).unit
    if isinstance(given, str):
        return _of_text(mechanism, name, given, unit)
    if not isinstance(given, tuple):
        return Variable.of(name, [float(given)] if isinstance(given, int | float | np.number) else given, unit)
    if len(given) not in (2, 3) or any(not isinstance(number, int | float | np.number) for number in given):
        raise OptionError(f"{name}: a tuple is a range, (low, high) or (low, high, count); a list gives values")
    if len(given) == 3 and given[2] != round(given[2]):
        raise OptionError(f"{name}: the third number of a range is a count, not {given[2]:g}; a list gives values")
    count = int(given[2]) if len(given) == 3 else None
    return Variable(name, float(given[0]), float(given[1]), count=count, unit=unit)


def _of_text(mechanism: Mechanism, name: str, text: str, unit: str) -> Variable:
    def value(text: str) -> float:
        if not text:
            raise OptionError(f"{name}: a value is missing; {FORM}")
        try:
            return parse_override(mechanism, f"{name}={text}")[1]
        except OptionError as error:
            raise OptionError(f"{name}: {text!r}: {error}") from None

    parts = [part.strip() for part in text.split(":")]
    if len(parts) == 1:
        return Variable.of(name, [value(part) for part in with_units(_COMMA.split(text))], unit)
    low, high = (value(part) for part in with_units(parts[:2]))
    count, words = None, parts[2:]
    if words and re.fullmatch(r"[+-]?\d+", words[0]):
        count = int(words.pop(0))
    if any(word not in _WORDS for word in words) or len(set(words)) < len(words) or {"log", "linear"} <= set(words):
        raise OptionError(f"{name}: {':'.join(words)!r} is no count, nor one of {', '.join(_WORDS)}; {FORM}")
    kind = "integer" if "integer" in words else "continuous"
    return Variable(name, low, high, kind, count, "log" if "log" in words else "linear", unit=unit)


def with_units(parts: Sequence[str]) -> list[str]:
    """Texts of quantities, those without a unit with that of the next that has one."""
    quantities, unit = list[str](), ""
    for part in reversed([part.strip() for part in parts]):
        if _NUMBER.fullmatch(part):
            quantities.append(f"{part} {unit}".strip())
        else:
            unit = split_quantity(part)[1] if re.match(r"[+-]?[.\d]", part) else ""
            quantities.append(part)
    return quantities[::-1]


def _parameter(mechanism: Mechanism, name: str) -> Parameter:
    found = mechanism.parameter(name)
    if found.is_held:
        raise OptionError(f"{name} is {HELD}")
    return found


def _checked_unit(mechanism: Mechanism, variable: Variable, fixed: Iterable[str]) -> str:
    """The SI unit of the parameter of a variable. Raises OptionError where it cannot vary like that."""
    name, parameter = variable.name, _parameter(mechanism, variable.name)
    if isinstance(parameter.value, Expression):
        needs = ", ".join(sorted(parameter.value.names))
        raise OptionError(f"{name} = {parameter.value} follows from {needs}: vary {needs}, or give it a number")
    if name in fixed:
        raise OptionError(f"{name} has a value already, so it cannot vary; give one or the other")
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    low, high = parameter.minimum, parameter.maximum
    if variable.distribution is None and isinstance(low, float) and variable.low < low:
        raise OptionError(f"{name}: {variable.low:g}{unit} is below the minimum of the parameter, {low:g}{unit}")
    if variable.distribution is None and isinstance(high, float) and variable.high > high:
        raise OptionError(f"{name}: {variable.high:g}{unit} is above the maximum of the parameter, {high:g}{unit}")
    return parameter.unit


Words = NDArray[np.uint64]

SOBOL_BITS = 32
"""Digits of a Sobol' coordinate."""

MOST_DIMENSIONS = 21201
"""Coordinates for which direction numbers are known (Joe and Kuo 2008)."""


@dataclass(frozen=True, eq=False)
class Sobol:
    """Points of a Sobol' sequence scrambled by a random linear matrix and a shift (Matousek 1998), as SciPy has it.

    Point k is the exclusive or of the `directions` (digits, axes) at the digits of its Gray code (Antonov and Saleev
    1979), and of the `shift` (axes,), so that any of the first 2^32 is found by itself. Those of fewer points are the
    first of those of more. Coordinates lie between 0 and 1, ends left out.
    """

    shift: Words
    directions: Words

    @classmethod
    def of(cls, size: int, axes: int, seed: int) -> Sobol:
        """So many points of SciPy's generator: the Gray codes of the numbers 2^(j + 1) - 1 have a single digit."""
        from scipy.stats import qmc

        sequence = qmc.Sobol(axes, scramble=True, bits=SOBOL_BITS, seed=np.random.default_rng(seed))
        points = [sequence.random(1)]
        for digit in range((size - 1).bit_length()):
            sequence.fast_forward(2 ** (digit + 1) - 1 - sequence.num_generated)
            points.append(sequence.random(1))
        shift, *scrambled = (np.concatenate(points) * 2.0**SOBOL_BITS).astype(np.uint64)
        return cls(shift, np.array(scrambled, dtype=np.uint64).reshape(-1, axes) ^ shift)

    def __call__(self, start: int, stop: int) -> Array:
        """Points start ... stop - 1 (stop - start, axes)."""
        numbers = np.arange(start, stop, dtype=np.uint64)
        gray = numbers ^ (numbers >> np.uint64(1))
        points = np.repeat(self.shift[None], len(numbers), axis=0)
        for digit, direction in enumerate(self.directions):
            points[((gray >> np.uint64(digit)) & np.uint64(1)).astype(bool)] ^= direction
        return np.asarray((points + 0.5) * 2.0**-SOBOL_BITS, dtype=float)


FEISTEL_ROUNDS = 12
_GOLDEN, _FIRST, _SECOND = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


def _mixed(x: Words) -> Words:
    """Numbers of 64 bits that look random, by a bijection (Steele, Lea and Flood 2014, SplitMix64)."""
    x = (x ^ (x >> np.uint64(30))) * _FIRST
    x = (x ^ (x >> np.uint64(27))) * _SECOND
    return x ^ (x >> np.uint64(31))


def _hashed(*key: int) -> np.uint64:
    """A number of 64 bits that a key of integers leads to."""
    number = np.zeros(1, dtype=np.uint64)
    for part in key:
        number = _mixed(number + _GOLDEN + np.uint64(part % 2**64))
    return number[0]


def _permuted(numbers: Words, size: int, key: int, axis: int) -> Words:
    """Where the numbers 0 ... size - 1 go in a permutation that a key and an axis name.

    A Feistel network over pairs (L, R) below a = ceil(sqrt(size)), with what leads out of 0 ... size - 1 led on until
    it is inside (Black and Rogaway 2002, "Ciphers with arbitrary finite domains", sections 3 and 4).
    """
    a = np.uint64(math.isqrt(size - 1) + 1)
    keys = [_hashed(key, axis, step) for step in range(FEISTEL_ROUNDS)]
    permuted, outside = numbers.astype(np.uint64), np.ones(len(numbers), dtype=bool)
    while outside.any():
        left, right = np.divmod(permuted[outside], a)
        for round_key in keys:
            left, right = right, (left + _mixed(right + round_key) % a) % a
        permuted[outside] = left * a + right
        outside[outside] = permuted[outside] >= size
    return permuted


def latin_hypercube(start: int, stop: int, size: int, axes: int, *, seed: int) -> Array:
    """Points start ... stop - 1 (stop - start, axes) of a Latin hypercube of so many points (McKay, Beckman and Conover
    1979): every one of `size` equal intervals of each axis holds one, somewhere in it. `scipy.stats.qmc` has them all
    at once or not at all; here each is found by its number."""
    numbers = np.arange(start, stop, dtype=np.uint64)
    points = np.empty((stop - start, axes))
    for axis in range(axes):
        inside = _mixed(numbers * _GOLDEN + _hashed(seed, axis, -1)) >> np.uint64(12)
        points[:, axis] = (_permuted(numbers, size, seed, axis) + (inside + 0.5) * 2.0**-52) / size
    return np.minimum(points, np.nextafter(1.0, 0.0))


class Designs(Protocol):
    """Designs that are counted from 0, each a function of its number. Is pickled."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """What varies."""
        ...

    @property
    def size(self) -> int:
        """How many designs there are."""
        ...

    def designs(self, start: int, stop: int) -> dict[str, Array]:
        """Values, SI, of the designs start ... stop - 1, (stop - start,) for every variable by name."""
        ...

    def describe(self) -> dict[str, Any]:
        """Plain data that tell them from every other set of designs."""
        ...


Sampling = Literal["grid", "list", "latin hypercube", "sobol"]
SAMPLINGS: tuple[Sampling, ...] = get_args(Sampling)

MOST_DESIGNS = {"grid": 2**53, "list": 2**53, "latin hypercube": 2**53, "sobol": 2**SOBOL_BITS}
"""Designs that can be numbered."""


@dataclass(frozen=True, repr=False, eq=False)
class Space(Record):
    """The designs of a study: variables, and how they are sampled.

    `grid` is every value of each variable with every value of the others, the last varying fastest; `list` takes the
    values of all variables side by side; `latin hypercube` (McKay, Beckman and Conover 1979) and `sobol` (scrambled
    Sobol' points) take `samples` points that `seed` names. Points of a Latin hypercube are found by keyed bijections of
    their numbers, none is stored. Raises OptionError for variables that cannot be sampled so, and for more designs
    than can be numbered.
    """

    _shown = ("sampling", "size", "variables")

    variables: tuple[Variable, ...]
    sampling: Sampling = "grid"
    samples: int | None = None
    seed: int = 0
    _sobol: Sobol | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.sampling not in SAMPLINGS:
            raise OptionError(f"sampling is one of {', '.join(SAMPLINGS)}, not {self.sampling!r}")
        if not self.variables:
            raise OptionError("nothing varies: a study varies at least one parameter, e.g. thickness=0.2mm:0.6mm")
        if not isinstance(self.seed, int | np.integer) or self.seed < 0:
            raise OptionError(f"a seed is a whole number from 0, not {self.seed!r}")
        if self.sampling in ("grid", "list"):
            self._check_values()
        else:
            self._check_samples()
        if self.size > (most := MOST_DESIGNS[self.sampling]):
            is_grid = self.sampling == "grid"
            counts = " x ".join(str(variable.levels) for variable in self.variables) if is_grid else "samples"
            hint = "; take fewer values each, or the sampling sobol with --samples" if is_grid else ""
            raise OptionError(f"{self.size:.4g} designs ({counts}) are more than the {most:.3g} of a study{hint}")
        if self.sampling == "sobol":
            object.__setattr__(self, "_sobol", Sobol.of(self.size, len(self.variables), int(self.seed)))

    def _check_values(self) -> None:
        if self.samples is not None:
            raise OptionError(f"a {self.sampling} takes every value; samples belong to sobol and latin hypercube")
        for variable in self.variables:
            name = variable.name
            if variable.distribution is not None:
                raise OptionError(f"{name} has a distribution: it takes the sampling sobol or latin hypercube")
            if self.sampling == "grid" and variable.levels is None:
                raise OptionError(f"{name}: how many values does it take? write {name}=LOW:HIGH:COUNT")
        if self.sampling == "grid":
            self._refuse_repeated()
            return
        lengths = {variable.name: variable.levels for variable in self.variables}
        if None in lengths.values() or len(set(lengths.values())) > 1:
            listed = ", ".join(f"{name} has {count or 'a range'}" for name, count in lengths.items())
            raise OptionError(f"a list pairs values: every variable has as many: {listed}")

    def _check_samples(self) -> None:
        if self.samples is None:
            raise OptionError(f"the sampling {self.sampling} takes a number of samples, e.g. samples=4096")
        if not isinstance(self.samples, int | np.integer) or self.samples < 1:
            raise OptionError(f"the number of samples is a whole number from 1, not {self.samples!r}")
        for variable in self.variables:
            if variable.count is not None:
                raise OptionError(
                    f"{variable.name}: a count of values ({variable.count}) belongs to a sweep over a grid;"
                    f" write {variable.name}=LOW:HIGH"
                )
        self._refuse_repeated()
        if len(self.variables) > MOST_DIMENSIONS:
            raise OptionError(f"at most {MOST_DIMENSIONS} variables are sampled, not {len(self.variables)}")

    def _refuse_repeated(self) -> None:
        for variable in self.variables:
            for value, times in Counter(variable.values.tolist()).most_common(1):
                if times > 1:
                    unit = f" {variable.unit}" if variable.unit not in ("", "1") else ""
                    raise OptionError(
                        f"{variable.name}: {value:g}{unit} stands in the list {times} times; give it once"
                    )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(variable.name for variable in self.variables)

    @property
    def size(self) -> int:
        """How many designs there are."""
        if self.samples is not None:
            return int(self.samples)
        levels = [variable.levels or 0 for variable in self.variables]
        return levels[0] if self.sampling == "list" else math.prod(levels)

    def designs(self, start: int, stop: int) -> dict[str, Array]:
        """Values, SI, of the designs start ... stop - 1, (stop - start,) for every variable by name."""
        if not 0 <= start <= stop <= self.size:
            raise OptionError(f"designs {start} to {stop} are asked for; there are {self.size}, counted from 0")
        if self.sampling not in ("grid", "list"):
            points = self.points(start, stop)
            return {variable.name: variable.at(points[:, axis]) for axis, variable in enumerate(self.variables)}
        numbers = np.arange(start, stop, dtype=np.int64)
        if self.sampling == "list":
            return {variable.name: variable.level(numbers) for variable in self.variables}
        values: dict[str, Array] = {}
        for variable in reversed(self.variables):
            numbers, level = np.divmod(numbers, variable.levels or 1)
            values[variable.name] = variable.level(level)
        return {name: values[name] for name in self.names}

    def points(self, start: int, stop: int) -> Array:
        """Samples start ... stop - 1 in the unit cube (stop - start, variables), between 0 and 1, ends left out."""
        if self._sobol is not None:
            return self._sobol(start, stop)
        return latin_hypercube(start, stop, self.size, len(self.variables), seed=int(self.seed))

    def describe(self) -> dict[str, Any]:
        """Plain data that tell it from every other space; its first design speaks for the sequence that is sampled."""
        data: dict[str, Any] = {"sampling": self.sampling, "size": self.size}
        if self.samples is not None:
            data |= {"seed": int(self.seed), "first": self.points(0, 1)[0].tolist()}
        return data | {"variables": [variable.describe() for variable in self.variables]}
