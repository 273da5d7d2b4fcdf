"""What options say as text, in SI: amounts with units, frequencies and bands, loads, poses, commands of inputs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import Any, NamedTuple

from flexura.errors import ExpressionError, OptionError
from flexura.units import parse_quantity, parse_unit, split_quantity

Reader = Callable[[str], float]
"""Reads one number, perhaps with a unit, as SI. Raises OptionError or ExpressionError."""


class Kind(NamedTuple):
    """What a number is, in words, an SI unit of its kind, and an example."""

    words: str
    unit: str
    example: str

    @property
    def expected(self) -> str:
        """What is expected of a text."""
        return f"{self.words} with its unit is expected, e.g. {self.example}"


POSED = {
    "displacement": Kind("a quantity", "m", "carriage.y=5mm"),
    "rotation": Kind("a quantity", "rad", "platform.rz=10deg"),
    "expansion": Kind("a quantity", "m", "piezo=10um"),
    "voltage": Kind("a quantity", "V", "piezo=75V"),
    "temperature": Kind("a quantity", "K", "warm=20K"),
    "force": Kind("a quantity", "N", "coil=2N"),
    "moment": Kind("a quantity", "N*m", "motor=10mN*m"),
}
"""What describes a pose, by its quantity."""

_WORDS = {"s": "a time", "m": "a length"}


@contextmanager
def named(option: str, text: str) -> Iterator[None]:
    """Let errors about the text of an option say which option it is, and what it was given."""
    try:
        yield
    except (ExpressionError, OptionError) as error:
        raise OptionError(f"{option} {text!r}: {error}") from None


def add_once(values: dict[str, Any], name: str, value: Any, rule: str = "has a value already; give one") -> None:
    """Set a value by its name. Raises OptionError where it has one."""
    if name in values:
        raise OptionError(f"{name} {rule}")
    values[name] = value


def prescribed_of(mechanism: Any, texts: list[str]) -> dict[str, float]:
    """Displacements and commands of actuators by name, SI. Raises OptionError for text that is none, and for what is
    named twice."""
    from flexura.mechanism import Layout, command_of, is_rotation

    layout = Layout(mechanism)
    values: dict[str, float] = {}
    for text in texts:
        name, equals, number = text.partition("=")
        name = name.strip()
        command = next(map(command_of, layout.commanded(name).values()), None)
        kind = POSED[command or ("rotation" if is_rotation(name) else "displacement")]
        with named("--at", text):
            if not equals or not name:
                raise OptionError(f"NODE.AXIS=VALUE or ACTUATOR=VALUE is expected, with its unit, e.g. {kind.example}")
            add_once(values, name, None)
        with named("--at", number):
            values[name] = _amount(number, kind)
    return values


def length_of(text: str, option: str) -> float:
    """A positive length, m. Raises OptionError when it is none."""
    with named(option, text):
        value = _amount(text, Kind("a length", "m", "'10 mm'"))
        if not value > 0:
            raise OptionError("a length is positive")
    return value


def gravity_of(text: str | None) -> list[float] | None:
    """An acceleration (3,), m/s^2; None where it is not given. Raises OptionError when it is none."""
    if text is None:
        return None
    kind = Kind("an acceleration", "m/s^2", "'0,0,-9.81 m/s^2'")
    with named("--gravity", text):
        parts = text.split(",")
        if len(parts) != 3:
            raise OptionError(f"X,Y,Z with a unit is expected, e.g. {kind.example}, 3 numbers; {len(parts)} found")
        return _amounts(parts, [kind] * 3)


def loads_of(texts: list[str] | None, option: str = "--load") -> dict[str, list[float]]:
    """Loads (6,) by node, N and N m. Raises OptionError for text that is none, and for nodes that are named twice."""
    example = "'table=0,0,-5 N'"
    kinds = [Kind("a force", "N", example)] * 3 + [Kind("a moment", "N*m", example)] * 3
    loads: dict[str, list[float]] = {}
    for text in texts or []:
        node, equals, numbers = text.partition("=")
        with named(option, text):
            parts = numbers.split(",")
            if not equals or not node.strip() or len(parts) not in (3, 6):
                form = "NODE=FX,FY,FZ or NODE=FX,FY,FZ,MX,MY,MZ"
                raise OptionError(f"{form} is expected, with units, e.g. {example} or 'table=0,0,-5 N,0,0,1 N*m'")
            add_once(loads, node, [], "has a load already; give one")
            force = _amounts(parts, kinds[: len(parts)])
        loads[node] = force + [0.0] * (6 - len(force))
    return loads


def points_of(texts: list[str] | None) -> dict[str, list[float]]:
    """Positions (3,) by name, m. Raises OptionError for text that is none, and for points that are named twice."""
    kind = Kind("a length", "m", "'tip=40,0,62 mm'")
    points: dict[str, list[float]] = {}
    for text in texts or []:
        name, equals, numbers = text.partition("=")
        with named("--point", text):
            parts = numbers.split(",")
            if not equals or not name.strip() or len(parts) != 3:
                raise OptionError(f"NAME=X,Y,Z is expected, with a unit, e.g. {kind.example}")
            add_once(points, name.strip(), _amounts(parts, [kind] * 3), "has a position already; give one")
    return points


def shares_of(option: str, texts: list[str] | None) -> dict[str, float]:
    """Ratios by name. Raises OptionError for text that is none, and for what is named twice."""
    shares: dict[str, float] = {}
    for text in texts or []:
        name, _, ratio = text.partition("=")
        with named(option, text):
            try:
                add_once(shares, name.strip(), float(ratio))
            except ValueError:
                raise OptionError("NAME=RATIO is expected, e.g. frame=0.01") from None
    return shares


def mounts_of(texts: list[str] | None) -> dict[str, list[float]]:
    """Tolerances (2,) or (6,) of mounts by node, m and rad. Raises OptionError for text that is none, and for nodes
    that are named twice."""
    example = "'leaf1.foot=0.1 mm,1 mrad'"
    kinds = {
        count: [Kind("a length", "m", example)] * (count // 2) + [Kind("an angle", "rad", example)] * (count // 2)
        for count in (2, 6)
    }
    mounts: dict[str, list[float]] = {}
    for text in texts or []:
        node, equals, numbers = text.partition("=")
        with named("--mount", text):
            parts = numbers.split(",")
            if not equals or not node.strip() or len(parts) not in kinds:
                raise OptionError(f"NODE=LENGTH,ANGLE or NODE=X,Y,Z,RX,RY,RZ is expected, with units, e.g. {example}")
            add_once(mounts, node.strip(), [], "has tolerances already; give them once")
            mounts[node.strip()] = _amounts(parts, kinds[len(parts)])
    return mounts


def _amounts(parts: Sequence[str], kinds: Sequence[Kind], read: Callable[[str, Kind], float] | None = None) -> Any:
    """Numbers in SI, each with a unit of its kind, or without one with that of the next that has one; 0 needs none.

    Raises OptionError for anything else.
    """
    numbers, unit = list[float](), ""
    for part, kind in zip(reversed(parts), reversed(kinds), strict=True):
        with _explained(kind, part):
            written = split_quantity(part)[1]
        unit = written or unit
        numbers.append((read or _amount)(part if written else f"{part} {unit}".strip(), kind))
    return numbers[::-1]


def _amount(text: str, kind: Kind) -> float:
    """A finite number with a unit of its kind, in SI; 0 needs none. Raises OptionError for anything else."""
    with _explained(kind, text):
        (value, exponents), written = parse_quantity(text), split_quantity(text)[1]
    if not written and value:
        raise OptionError(f"{text.strip()!r} has no unit; {kind.expected}")
    if written and exponents != parse_unit(kind.unit)[1]:
        noun = kind.words.split()[-1]
        raise OptionError(
            f"{text.strip()!r} is no {noun}; {kind.words} in {kind.unit} is expected, e.g. {kind.example}"
        )
    return value


@contextmanager
def _explained(kind: Kind, text: str) -> Iterator[None]:
    """Let what cannot be read say what is expected."""
    if re.match(r"\s*[+-]?(nan|inf)", text, re.IGNORECASE):
        raise OptionError(f"a number must be finite; {kind.expected}")
    try:
        yield
    except ExpressionError as error:
        raise OptionError(f"{error.rule}; {kind.expected}") from None


def _frequency(text: str, kind: Kind) -> float:
    value, unit = _amount(text, kind), split_quantity(text)[1]
    if unit and not re.fullmatch(r"[mkMG]?Hz", unit):
        raise OptionError(f"{text.strip()!r} is no frequency; it is written in Hz or kHz")
    return value


def hertz_of(text: str) -> float:
    """A frequency such as `20 Hz` or `1.5 kHz`, Hz. Raises OptionError for anything else, rad/s among it."""
    return _frequency(text, Kind("a positive frequency", "Hz", "20 Hz"))


def _frequencies(text: str, example: str) -> list[float]:
    """Frequencies separated by commas, Hz; those without a unit have that of the next. Raises OptionError."""
    parts = text.split(",")
    return _amounts(parts, [Kind("a positive frequency", "Hz", example)] * len(parts), _frequency)


def limit_of(option: str, text: str | None) -> float | None:
    """A frequency up to which something holds, Hz; None where it is not given. Raises OptionError when it is none."""
    if text is None:
        return None
    with named(option, text):
        value = hertz_of(text)
        if value < 0:
            raise OptionError("a positive frequency is expected, in Hz or kHz")
    return value


def band_of(text: str | None) -> tuple[float, float] | None:
    """A band of frequencies, Hz; None where it is not given. Raises OptionError when it is none."""
    if text is None:
        return None
    with named("--band", text):
        frequencies = _frequencies(text, "'5,200 Hz'")
        if len(frequencies) != 2:
            raise OptionError("FROM,TO with a unit is expected, e.g. '5,200 Hz' or '5 Hz,0.2 kHz'")
        low, high = frequencies
        if not 0 <= low < high:
            raise OptionError("this band is empty: a band goes from a lower frequency, at least 0, to a higher one")
    return low, high


_AT_ORDER = r"@\s*(\d{1,4})(?![\d.])"
"""A model order behind a frequency."""


def selected(text: str | None) -> list[float | tuple[float, int]] | None:
    """Frequencies, Hz, each alone or with the model order behind @; None where they are not given. Raises OptionError
    for anything else."""
    if text is None:
        return None
    with named("--select", text):
        orders = [re.search(_AT_ORDER, part) for part in text.split(",")]
        frequencies = _frequencies(re.sub(_AT_ORDER, "", text), "'12.1,40 Hz', or '12.1@24,40@30 Hz'")
        return [hz if order is None else (hz, int(order[1])) for hz, order in zip(frequencies, orders, strict=True)]


def quantity_of(option: str, text: str, unit: str, example: str) -> float:
    """A number with a unit that has the dimension of `unit`, SI. Raises OptionError for anything else."""
    with named(option, text):
        return _amount(text, Kind(_WORDS.get(unit, "a quantity"), unit, example))


def time_of(option: str, text: str | None, example: str) -> float | None:
    """A time, s; None where it is not given. Raises OptionError when it is none."""
    return None if text is None else quantity_of(option, text, "s", example)


def seconds_of(text: str) -> float:
    """A time such as `10 s` or `5 min`, s. Raises OptionError when it is none."""
    return _amount(text, Kind("a time", "s", "10 s or 5 min"))


def names_of(text: str | None) -> list[str] | None:
    """Names separated by commas; None where they are not given."""
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]


Range = float | tuple[float, float]


def moves_of(texts: Iterable[str]) -> dict[str, Range]:
    """What moves, by name, in SI. Raises OptionError for text that is no range, and for what is named twice."""
    from flexura.mechanism import UNITS, is_rotation

    examples = {"m": "carriage.y=-20mm:20mm", "rad": "platform.rz=0:15deg"}
    moves: dict[str, Range] = {}
    for text in texts:
        name, equals, numbers = text.partition("=")
        name, ends = name.strip(), numbers.split(":")
        unit = UNITS[is_rotation(name)]
        with named("--move", text):
            if not equals or not name or len(ends) > 2 or not all(end.strip() for end in ends):
                form = "NODE.AXIS=FROM:TO or NODE.AXIS=TO"
                raise OptionError(f"{form} is expected, with units, e.g. {examples[unit]}")
            add_once(moves, name, 0.0, "moves already; give one range")
        values = [quantity_of("--move", end, unit, examples[unit]) for end in ends]
        moves[name] = values[0] if len(values) == 1 else (values[0], values[1])
    return moves


def from_to(
    option: str, texts: Iterable[str] | None, values_of: Callable[[list[str]], Mapping[str, Any]]
) -> dict[str, Any]:
    """Values by name of NAME=VALUE, or both ends of NAME=FROM:TO, of which FROM has the unit of TO where it has none.

    Raises OptionError for what is named twice.
    """
    values: dict[str, Any] = {}
    for text in texts or []:
        name, _, amounts = text.partition("=")
        ends = amounts.split(":") if amounts.count(":") == 1 else [amounts]
        if len(ends) == 2 and "," not in ends[0] and not split_quantity(ends[0])[1]:
            ends[0] += f" {split_quantity(ends[1])[1]}"
        first, *last = (values_of([f"{name}={end}"]) for end in ends)
        with named(option, text):
            for key, value in first.items():
                add_once(values, key, (value, last[0][key]) if last else value)
    return values


def gravities_of(text: str | None) -> Any:
    """Gravity (3,), or from one to another (2, 3), m/s^2; None where it is not given."""
    if text is None:
        return None
    ends = [gravity_of(end) for end in text.split(":")]
    return ends[0] if len(ends) == 1 else ends


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

    def values(
        self, option: str, texts: Iterable[str] | None, *, impulse: bool = False, output: bool = False
    ) -> dict[str, float]:
        """Values by name of an option NAME=VALUE, SI; those of an `impulse` in the unit of the input times s, and with
        `output` those of outputs.

        Raises OptionError for text that is none, units of another quantity and names that are given twice.
        """
        values: dict[str, float] = {}
        for text in texts or []:
            name, (value,) = self.amounts(option, text, "NAME=VALUE", impulse=impulse, output=output)
            with named(option, text):
                add_once(values, name, value)
        return values

    def amounts(
        self,
        option: str,
        text: str,
        form: str,
        others: Sequence[Reader] = (),
        *,
        optional: bool = False,
        impulse: bool = False,
        output: bool = False,
    ) -> tuple[str, list[float]]:
        """A name, its amount, and `others`, each with its own reader; all or none of these when `optional`.

        Raises OptionError for text that is not of the `form`, and for units of other quantities.
        """
        name, equals, rest = text.partition("=")
        first, *more = rest.split(",")
        with named(option, text):
            if not equals or not (len(more) == len(others) or (optional and not more)):
                raise OptionError(f"{form} is expected; a value is a number with a unit of the input, as in 3 um")
            amount = self._amount(name, first, impulse, output)
            return name, [amount, *(read(part) for read, part in zip(others, more, strict=False))]

    def _amount(self, name: str, text: str, impulse: bool, output: bool) -> float:
        """An amount, SI, of which the unit is that of every input, or output, that the name stands for."""
        if re.match(r"\s*[+-]?(nan|inf)", text, re.IGNORECASE):
            raise OptionError("a number must be finite")
        value, exponents = parse_quantity(text)
        written = split_quantity(text)[1]
        if not written and not value:
            return value
        for channel in self._channels(name, output):
            quantity, unit = channel.quantity, channel.unit
            unit = _times_second(unit) if impulse else unit
            if not written:
                raise OptionError(f"{text.strip()!r} has no unit; {channel.name} takes {quantity} in {unit}")
            if exponents != parse_unit(unit)[1] or not _counts_as(written, unit):
                word = f"impulses of {quantity}" if impulse else quantity
                raise OptionError(
                    f"{written} is no unit of {channel.name}, which takes {word} in {unit}; "
                    f"write it in {unit} or a unit of the same kind"
                )
        return value

    def _channels(self, name: str, output: bool) -> list[Any]:
        """What a name stands for; references and noises of controllers are in the unit of their sensor, commands in
        that of their actuator."""
        from flexura.analysis import OF_CONTROLLERS, each_loop

        loop, _, end = name.rpartition(".")
        if f".{end}" in OF_CONTROLLERS:
            loops = each_loop(self._mechanism.controllers, self._ports.plan)
            if loop in loops and output == (end == "command"):
                own = loops[loop]
                output = not output
                name = own.sensor if output else own.actuator
        return [placed.channel for placed in (self._ports.outputs([name]) if output else self._ports.inputs([name]))]

    @cached_property
    def _ports(self) -> Any:
        """The inputs of the mechanism, worked out once and only when a unit is to be judged."""
        from flexura.full_order import plan_of
        from flexura.motion import at_pose
        from flexura.structure import Design, Ports

        plan = plan_of(self._mechanism)
        plan.verify(self._parameters)
        return Ports(at_pose(Design.of(plan, self._parameters)))


def _times_second(unit: str) -> str:
    """The SI unit times s: `N*s`, or `m/s` of `m/s^2`."""
    return unit.removesuffix("^2") if unit.endswith("/s^2") else f"{unit}*s"


def _counts_as(written: str, unit: str) -> bool:
    """False for a unit of the right dimension that counts angles or cycles where `unit` does not."""
    rate = parse_unit("1/s")[1]
    bare = [name for name in _NAMES.findall(written) if not any(e := parse_unit(name)[1]) or e == rate]
    return all("rad" in unit and _ANGLES.fullmatch(name) for name in bare)
