"""Which designs a study is of: what varies, in which range or distribution, and the designs by number."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from hashlib import sha256
from math import isqrt, prod
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.expressions import Expression
from flexura.mechanism import HELD, Mechanism, Parameter
from flexura.modelfile import parse_override
from flexura.records import Record
from flexura.units import split_quantity

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


Range = tuple[float, float] | tuple[float, float, int]
Varied = str | Sequence["str | Variable"] | Mapping[str, "str | Range | ArrayLike"]
"""What varies, by name: text with units, a tuple (low, high) or (low, high, count), or a list or array of values."""

FORM = "NAME=LOW:HIGH[:COUNT][:log|:integer] or NAME=VALUE,VALUE is expected, with units, e.g. thickness=0.2mm:0.6mm:50"
_WORDS = ("log", "linear", "integer")
_COMMA = re.compile(r",(?![^(]*\))")


def variables(mechanism: Mechanism, vary: Varied, fixed: Iterable[str] = ()) -> tuple[Variable, ...]:
    """The variables that text or Python describes, in order.

    Text is `NAME=LOW:HIGH`, with a count, the word `log` or `integer` behind further colons, or a list `NAME=A,B,C`;
    a number without a unit has that of the next. In Python a tuple is a range, (low, high) or (low, high, count), and
    a list or an array is values, in SI. Raises OptionError for what cannot be read, unknown parameters, those named
    twice, those that follow from others, those that are `fixed` to a value, empty ranges, and values outside the bounds
    of a parameter.
    """
    found: list[Variable] = []
    for entry in _entries(vary):
        own = entry if isinstance(entry, Variable) else _read(mechanism, *entry)
        own = replace(own, unit=_checked(mechanism, own, fixed))
        if own.name in {other.name for other in found}:
            raise OptionError(f"{own.name} varies already; give it once")
        found.append(own)
    if not found:
        raise OptionError(f"nothing varies; {FORM}")
    return tuple(found)


def _entries(vary: Any) -> list[Variable | tuple[str, Any]]:
    """Variables, or names with what is given of them."""
    if isinstance(vary, Mapping):
        return list(vary.items())
    texts = [vary] if isinstance(vary, str | Variable) else vary
    if not isinstance(texts, Iterable) or any(not isinstance(own, str | Variable) for own in texts):
        raise OptionError(f"what varies is given by name, as {{'thickness': (2e-4, 6e-4)}}, or as text: {FORM}")
    return [own if isinstance(own, Variable) else _named(own) for own in texts]


def _named(text: str) -> tuple[str, str]:
    name, equals, rest = (part.strip() for part in text.partition("="))
    if not (name and equals and rest):
        raise OptionError(FORM)
    return name, rest


def _read(mechanism: Mechanism, name: str, given: Any) -> Variable:
    unit = _parameter(mechanism, name).unit
    if isinstance(given, str):
        return _of_text(mechanism, name, given, unit)
    if not isinstance(given, tuple):
        return Variable.of(name, [float(given)] if isinstance(given, int | float | np.number) else given, unit)
    if len(given) not in (2, 3) or any(not isinstance(own, int | float | np.number) for own in given):
        raise OptionError(f"{name}: a tuple is a range, (low, high) or (low, high, count); a list gives values")
    if len(given) == 3 and given[2] != round(given[2]):
        raise OptionError(f"{name}: the third number of a range is a count, not {given[2]:g}; a list gives values")
    count = int(given[2]) if len(given) == 3 else None
    return Variable(name, float(given[0]), float(given[1]), count=count, unit=unit)


def _of_text(mechanism: Mechanism, name: str, text: str, unit: str) -> Variable:
    parts = [part.strip() for part in text.split(":")]
    if len(parts) == 1:
        values = _with_units([part.strip() for part in _COMMA.split(text)])
        return Variable.of(name, [_value(mechanism, name, own) for own in values], unit)
    low, high = (_value(mechanism, name, own) for own in _with_units(parts[:2]))
    count, words = None, parts[2:]
    if words and re.fullmatch(r"[+-]?\d+", words[0]):
        count = int(words.pop(0))
    if any(word not in _WORDS for word in words) or len(set(words)) < len(words) or {"log", "linear"} <= set(words):
        raise OptionError(f"{name}: {':'.join(words)!r} is no count, nor one of {', '.join(_WORDS)}; {FORM}")
    kind = "integer" if "integer" in words else "continuous"
    return Variable(name, low, high, kind, count, "log" if "log" in words else "linear", unit=unit)


def _with_units(parts: list[str]) -> list[str]:
    """Texts of quantities, those without a unit with that of the next that has one."""
    found, unit = list[str](), ""
    for part in reversed(parts):
        if re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", part):
            found.append(f"{part} {unit}".strip())
        else:
            unit = split_quantity(part)[1] if re.match(r"[+-]?[.\d]", part) else ""
            found.append(part)
    return found[::-1]


def _value(mechanism: Mechanism, name: str, text: str) -> float:
    if not text:
        raise OptionError(f"{name}: a value is missing; {FORM}")
    try:
        return parse_override(mechanism, f"{name}={text}")[1]
    except OptionError as error:
        raise OptionError(f"{name}: {text!r}: {error}") from None


def _parameter(mechanism: Mechanism, name: str) -> Parameter:
    if name not in mechanism.parameters:
        close = get_close_matches(str(name), mechanism.parameters, n=1)
        known = ", ".join(mechanism.parameters) or "none"
        hint = f"did you mean {close[0]!r}?" if close else f"parameters: {known}"
        raise OptionError(f"{name!r} is not a parameter; {hint}")
    if mechanism.parameters[name].is_held:
        raise OptionError(f"{name} is {HELD}")
    return mechanism.parameters[name]


def _checked(mechanism: Mechanism, own: Variable, fixed: Iterable[str]) -> str:
    """The SI unit of the parameter of a variable. Raises OptionError where it cannot vary like that."""
    parameter = _parameter(mechanism, own.name)
    if isinstance(parameter.value, Expression):
        needs = ", ".join(sorted(parameter.value.names))
        raise OptionError(f"{own.name} = {parameter.value} follows from {needs}: vary {needs}, or give it a number")
    if own.name in fixed:
        raise OptionError(f"{own.name} has a value already, so it cannot vary; give one or the other")
    unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
    low, high = parameter.minimum, parameter.maximum
    if own.distribution is None and isinstance(low, float) and own.low < low:
        raise OptionError(f"{own.name}: {own.low:g}{unit} is below the minimum of the parameter, {low:g}{unit}")
    if own.distribution is None and isinstance(high, float) and own.high > high:
        raise OptionError(f"{own.name}: {own.high:g}{unit} is above the maximum of the parameter, {high:g}{unit}")
    return parameter.unit


Whole = NDArray[np.uint64]

BITS = 32
"""Digits of a Sobol' coordinate."""

MOST_DIMENSIONS = 21201
"""Coordinates for which direction numbers are known (Joe and Kuo 2008)."""

DIRECTIONS: tuple[tuple[int, tuple[int, ...]], ...] = (
    (1, (1,)),
    (3, (1,)),
    (7, (1, 3)),
    (11, (1, 3, 1)),
    (13, (1, 1, 1)),
    (19, (1, 1, 3, 3)),
    (25, (1, 3, 5, 13)),
    (37, (1, 1, 5, 5, 17)),
    (41, (1, 1, 5, 5, 5)),
    (47, (1, 1, 7, 11, 19)),
)
"""Primitive polynomials, by their bits, and the first direction numbers of the first axes (Joe and Kuo 2008)."""

ROUNDS = 12
_GOLDEN, _FIRST, _SECOND = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


def mixed(x: Whole) -> Whole:
    """Numbers of 64 bits that look random, by a bijection (Steele, Lea and Flood 2014, SplitMix64)."""
    x = (x ^ (x >> np.uint64(30))) * _FIRST
    x = (x ^ (x >> np.uint64(27))) * _SECOND
    return x ^ (x >> np.uint64(31))


def _stream(*key: int) -> np.uint64:
    """A number of 64 bits that a key of integers leads to."""
    found = np.zeros(1, dtype=np.uint64)
    for part in key:
        found = mixed(found + _GOLDEN + np.uint64(part % 2**64))
    return found[0]


def permuted(numbers: Whole, size: int, key: int, axis: int) -> Whole:
    """Where the numbers 0 ... size - 1 go in a permutation that a key and an axis name.

    A Feistel network over pairs (L, R) below a = ceil(sqrt(size)), with what leads out of 0 ... size - 1 led on until
    it is inside (Black and Rogaway 2002, "Ciphers with arbitrary finite domains", sections 3 and 4).
    """
    a = np.uint64(isqrt(size - 1) + 1)
    keys = [_stream(key, axis, step) for step in range(ROUNDS)]
    found, outside = numbers.astype(np.uint64), np.ones(len(numbers), dtype=bool)
    while outside.any():
        left, right = np.divmod(found[outside], a)
        for own in keys:
            left, right = right, (left + mixed(right + own) % a) % a
        found[outside] = left * a + right
        outside[outside] = found[outside] >= size
    return found


def latin_hypercube(start: int, stop: int, size: int, axes: int, seed: int) -> Array:
    """Points start ... stop - 1 (stop - start, axes) of a Latin hypercube of so many points (McKay, Beckman and Conover
    1979): every one of `size` equal intervals of each axis holds one, somewhere in it."""
    numbers = np.arange(start, stop, dtype=np.uint64)
    found = np.empty((stop - start, axes))
    for axis in range(axes):
        inside = mixed(numbers * _GOLDEN + _stream(seed, axis, -1)) >> np.uint64(12)
        found[:, axis] = (permuted(numbers, size, seed, axis) + (inside + 0.5) * 2.0**-52) / size
    return np.minimum(found, np.nextafter(1.0, 0.0))


def _directions(polynomial: int, first: tuple[int, ...]) -> list[int]:
    """The direction numbers of an axis, each a digit later than the one before (Bratley and Fox 1988)."""
    degree, found = polynomial.bit_length() - 1, list(first)
    for j in range(len(found), BITS):
        own = found[j - degree] if degree else 1
        for k in range(1, degree + 1):
            own ^= (polynomial >> (degree - k) & 1) * (found[j - k] << k)
        found.append(own)
    return [own << (BITS - 1 - j) for j, own in enumerate(found)]


@dataclass(frozen=True, eq=False)
class Sobol:
    """Points of a Sobol' sequence scrambled by a random linear matrix and a shift (Matousek 1998), as SciPy has it.

    Point k is the exclusive or of the `directions` (digits, axes) at the digits of its Gray code (Antonov and Saleev
    1979), and of the `shift` (axes,), so that any of the first 2^32 is found by itself. Those of fewer points are the
    first of those of more.
    """

    shift: Whole
    directions: Whole

    @classmethod
    def of(cls, size: int, axes: int, seed: int) -> Sobol:
        """So many points, those of SciPy's generator; for a few axes without it, which is slow to import."""
        digits, rng = (size - 1).bit_length(), np.random.default_rng(seed)
        if axes <= len(DIRECTIONS):
            return cls._scrambled(digits, axes, rng.spawn(1)[0])
        from scipy.stats import qmc

        sequence = qmc.Sobol(axes, scramble=True, bits=BITS, seed=rng)
        points = [sequence.random(1)]
        for digit in range(digits):  # numbers 2^(j + 1) - 1 have a Gray code of a single digit
            sequence.fast_forward(2 ** (digit + 1) - 1 - sequence.num_generated)
            points.append(sequence.random(1))
        found = (np.concatenate(points) * 2.0**BITS).astype(np.uint64)
        return cls(found[0], found[1:] ^ found[0])

    @classmethod
    def _scrambled(cls, digits: int, axes: int, rng: np.random.Generator) -> Sobol:
        """Direction numbers times random lower triangular matrices of bits, the highest bit first, and a shift."""
        weight = 2 ** np.arange(BITS, dtype=np.uint32)
        shift = rng.integers(2, size=(axes, BITS), dtype=np.uint32) @ weight
        matrix = np.tril(rng.integers(2, size=(axes, BITS, BITS), dtype=np.uint32))
        matrix[:, np.arange(BITS), np.arange(BITS)] = 1
        plain = np.array([_directions(*own) for own in DIRECTIONS[:axes]], dtype=np.uint32)[:, :digits]
        bits = plain[:, None, :] // weight[::-1, None] % 2
        directions = np.einsum("apd,p->da", matrix @ bits % 2, weight[::-1])
        return cls(shift.astype(np.uint64), directions.astype(np.uint64))

    def __call__(self, start: int, stop: int) -> Array:
        """Points start ... stop - 1 (stop - start, axes)."""
        numbers = np.arange(start, stop, dtype=np.uint64)
        gray = numbers ^ (numbers >> np.uint64(1))
        found = np.repeat(self.shift[None], len(numbers), axis=0)
        for digit, direction in enumerate(self.directions):
            found[((gray >> np.uint64(digit)) & np.uint64(1)).astype(bool)] ^= direction
        return np.asarray((found + 0.5) * 2.0**-BITS, dtype=float)


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

    def designs(self, start: int, stop: int) -> dict[str, NDArray[np.float64]]:
        """Values, SI, of the designs start ... stop - 1, (stop - start,) for every variable by name."""
        ...

    def describe(self) -> dict[str, Any]:
        """Plain data that tell them from every other set of designs."""
        ...


Sampling = Literal["grid", "list", "latin hypercube", "sobol"]
SAMPLINGS: tuple[Sampling, ...] = get_args(Sampling)

MOST = {"grid": 2**53, "list": 2**53, "latin hypercube": 2**53, "sobol": 2**BITS}
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
        if self.size > MOST[self.sampling]:
            counts = " x ".join(str(own.levels) for own in self.variables) if self.sampling == "grid" else "samples"
            hint = "" if self.sampling != "grid" else "; take fewer values each, or the sampling sobol with --samples"
            raise OptionError(
                f"{self.size:.4g} designs ({counts}) are more than the {MOST[self.sampling]:.3g} of a study{hint}"
            )
        if self.sampling == "sobol":
            object.__setattr__(self, "_sobol", Sobol.of(self.size, len(self.variables), int(self.seed)))

    def _check_values(self) -> None:
        if self.samples is not None:
            raise OptionError(f"a {self.sampling} takes every value; samples belong to sobol and latin hypercube")
        for own in self.variables:
            if own.distribution is not None:
                raise OptionError(f"{own.name} has a distribution: it takes the sampling sobol or latin hypercube")
            if self.sampling == "grid" and own.levels is None:
                raise OptionError(f"{own.name}: how many values does it take? write {own.name}=LOW:HIGH:COUNT")
        if self.sampling == "grid":
            self._refuse_repeated()
        lengths = {own.name: own.levels for own in self.variables}
        if self.sampling == "list" and (None in lengths.values() or len(set(lengths.values())) > 1):
            told = ", ".join(f"{name} has {count or 'a range'}" for name, count in lengths.items())
            raise OptionError(f"a list pairs values: every variable has as many: {told}")

    def _refuse_repeated(self) -> None:
        for own in self.variables:
            value, times = Counter(own.values.tolist()).most_common(1)[0] if len(own.values) else (0.0, 1)
            if times > 1:
                unit = f" {own.unit}" if own.unit not in ("", "1") else ""
                raise OptionError(f"{own.name}: {value:g}{unit} stands in the list {times} times; give it once")

    def _check_samples(self) -> None:
        if self.samples is None:
            raise OptionError(f"the sampling {self.sampling} takes a number of samples, e.g. samples=4096")
        if not isinstance(self.samples, int | np.integer) or self.samples < 1:
            raise OptionError(f"the number of samples is a whole number from 1, not {self.samples!r}")
        for own in self.variables:
            if own.count is not None:
                hint = f"write {own.name}=LOW:HIGH"
                raise OptionError(f"{own.name}: a count of values ({own.count}) belongs to a sweep over a grid; {hint}")
        self._refuse_repeated()
        if len(self.variables) > MOST_DIMENSIONS:
            raise OptionError(f"at most {MOST_DIMENSIONS} variables are sampled, not {len(self.variables)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that vary."""
        return tuple(own.name for own in self.variables)

    @property
    def size(self) -> int:
        """How many designs there are."""
        if self.samples is not None:
            return int(self.samples)
        levels = [own.levels or 0 for own in self.variables]
        return levels[0] if self.sampling == "list" else prod(levels)

    def designs(self, start: int, stop: int) -> dict[str, Array]:
        """Values, SI, of the designs start ... stop - 1, (stop - start,) for every variable by name."""
        if not 0 <= start <= stop <= self.size:
            raise OptionError(f"designs {start} to {stop} are asked for; there are {self.size}, counted from 0")
        if self.sampling == "grid":
            return self._of_grid(np.arange(start, stop, dtype=np.int64))
        if self.sampling == "list":
            numbers = np.arange(start, stop, dtype=np.int64)
            return {own.name: own.level(numbers) for own in self.variables}
        points = self.points(start, stop)
        return {own.name: own.at(points[:, axis]) for axis, own in enumerate(self.variables)}

    def points(self, start: int, stop: int) -> Array:
        """Samples start ... stop - 1 in the unit cube (stop - start, variables), between 0 and 1, ends left out."""
        if self._sobol is not None:
            return self._sobol(start, stop)
        return latin_hypercube(start, stop, self.size, len(self.variables), int(self.seed))

    def _of_grid(self, numbers: NDArray[np.int64]) -> dict[str, Array]:
        found: dict[str, Array] = {}
        for own in reversed(self.variables):
            numbers, place = np.divmod(numbers, own.levels or 1)
            found[own.name] = own.level(place)
        return {name: found[name] for name in self.names}

    def describe(self) -> dict[str, Any]:
        """Plain data that tell it from every other space; its first design speaks for the sequence that is sampled."""
        found: dict[str, Any] = {"sampling": self.sampling, "size": self.size}
        if self.samples is not None:
            found |= {"seed": int(self.seed), "first": self.points(0, 1)[0].tolist()}
        return found | {"variables": [own.describe() for own in self.variables]}
