"""The channels of a test: what each reads, in which unit, and where.

Described in a file beside the data, or by a mechanism with nodes of the same names.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from flexura.errors import ExpressionError, FlexuraError, OptionError
from flexura.expressions import Dimension
from flexura.full_order import plan_of
from flexura.mechanism import DOF_NAMES, Mechanism
from flexura.modelfile import parse, text_of
from flexura.motion import at_pose
from flexura.structure import UNITS, Channel, Design, Plan, Ports
from flexura.units import is_number, parse_quantity, parse_unit


@dataclass(frozen=True)
class MeasuredChannel(Channel):
    """A channel of a test: what it reads, and where.

    `direction` (3,) is a unit vector of the global axes that has the sign of the channel in it; `position` (3,), m.
    `node` is the node's name, or its number as text. Data are SI, in the unit of the quantity.
    """

    node: str | None = None
    direction: tuple[float, float, float] | None = None
    position: tuple[float, float, float] | None = None

    @property
    def location(self) -> tuple[str | None, tuple[float, ...] | None]:
        """Node and position, m, to a nanometre: where a channel is."""
        return self.node, None if self.position is None else tuple(round(x, 9) + 0.0 for x in self.position)


Trace = tuple[tuple[float, float, float], ...]
"""Points, m, that are joined by lines where a test is drawn."""

STANDARD_GRAVITY = 9.80665
"""m/s^2 in g, as accelerometers have it."""

FORCES = ("force", "moment")

_BY_UNIT = (
    *(*FORCES, "displacement", "velocity", "acceleration"),
    *("rotation", "angular_velocity", "angular_acceleration", "voltage", "stress"),
)
"""Quantities in the order in which a unit alone is taken for one of them."""
_GRAVITIES = {"g": 1.0, "gn": 1.0, "g_n": 1.0, "g0": 1.0, "gs": 1.0, "mg": 1e-3, "ug": 1e-6}
_WRITTEN = str.maketrans({"²": "^2", "³": "^3", "·": "*", "⋅": "*", "−": "-"})
_WORDS = {
    **dict.fromkeys(("newton", "newtons"), "N"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("inch", "inches", "in"), "in"),
    "lbf": "lbf",
    "kn": "kN",
    **{unit: unit for unit in ("mm", "cm", "rad", "ft", "deg")},
}
"""Units as other programs write them, in small letters."""

_POUNDS = ("lb", "lbs", "pound", "pounds", "lb-f", "lb_f")

FREQUENCIES = {
    **dict.fromkeys(("hz", "hertz", "cps", "c/s", "cycles/s", "cycles/sec"), 1.0),
    **dict.fromkeys(("khz", "kilohertz"), 1e3),
    **dict.fromkeys(("rad/s", "rad/sec", "radians/s", "radian/s", "radians/sec", "rads/s"), 1 / (2 * pi)),
    **dict.fromkeys(("rpm", "rev/min", "r/min", "1/min", "cpm"), 1 / 60),
}
"""Hz in units of frequency, in small letters. 1/s is none: it is Hz to one and rad/s to the next."""


def frequency_factor(label: str, what: str) -> float:
    """Hz in a unit of frequency such as Hz, kHz, rad/s or rpm. Raises OptionError, which names it, for any other."""
    factor = FREQUENCIES.get("".join(label.split()).lower())
    if factor is None:
        raise OptionError(f"{what}: frequencies are in Hz, kHz, rad/s or rpm, not in {label.strip()!r}")
    return factor


def dimension(unit: str) -> Dimension:
    """Dimension of a unit of `UNITS`."""
    return parse_unit(unit)[1]


def refuse_unknown(quantity: object, what: str) -> None:
    """Raise OptionError, which names the channel, for anything but a key of `UNITS`."""
    if not isinstance(quantity, str) or quantity not in UNITS:
        raise OptionError(f"{what}: there is no quantity {quantity!r}; quantities: {', '.join(UNITS)}")


def quantity_of(text: str, quantity: str | None = None, what: str = "channel") -> tuple[str, float]:
    """Quantity, a key of `UNITS`, and factor to SI of a channel with a unit such as `m/s^2`, `m/s²`, `g`, `N` or `um`.

    `quantity` is what the channel is said to be; without it the unit decides, and a pure angle is a rotation. An
    acceleration in g or mg is in standard gravities, a force in lb in lbf. Raises OptionError, which names the channel,
    for a text that is no unit and a unit of something else.
    """
    if quantity is not None:
        refuse_unknown(quantity, what)
    label = text.strip()
    gravity = _GRAVITIES.get(label.lower())
    if gravity is not None and (quantity == "acceleration" or (quantity is None and gravity == 1.0)):
        return "acceleration", gravity * STANDARD_GRAVITY
    written = "lbf" if quantity == "force" and label.lower() in _POUNDS else _canonical(label)
    try:
        factor, exponents = parse_unit(written)
    except ExpressionError as error:
        raise OptionError(f"{what}: {error}") from None
    if quantity is None:
        quantity = next((q for q in _BY_UNIT if dimension(UNITS[q]) == exponents), None)
        if quantity is None:
            raise OptionError(f"{what}: {label} is no unit of a force or a motion; units are, e.g., N, m/s^2, g, um")
    elif dimension(UNITS[quantity]) != exponents:
        raise OptionError(
            f"{what}: {label} is no unit of {quantity.replace('_', ' ')}, which is read in {UNITS[quantity]}"
        )
    return quantity, float(factor)


def _canonical(label: str) -> str:
    """A unit with the field's many spellings (m/s2, M/SEC^2, ms-2, meter/sec**2) as the reader of units has it."""
    text = label.translate(_WRITTEN).replace("**", "^")
    text = re.sub(r"^(m|mm|in|rad)[ .*]?s\^?-([12])$", r"\1/s^\2", text)
    text = re.sub(r"(?<=[A-Za-z])([234])\b", r"^\1", text)
    is_shouted = text.upper() == text and len(text) > 1

    def word(match: re.Match[str]) -> str:
        written = match[0]
        if is_shouted and written in ("M", "S"):
            return written.lower()
        return _WORDS.get(written.lower(), written)

    return re.sub(r"[A-Za-z]+", word, text)


def split_response(label: str, quantity: str | None = None) -> tuple[str, str] | None:
    """Units of response and force of a label such as `(m/s²)/N`, `g/N`, `(1/N)*(m/s^2)` or `1/kg`; None for others."""
    text = label.translate(_WRITTEN).strip()
    inverse = re.fullmatch(r"\(?\s*1\s*/\s*([^()]+?)\)?\s*\*\s*\(?([^()]+)\)?", text)
    motion, _, cause = (inverse[2], "", inverse[1]) if inverse is not None else text.rpartition("/")
    motion, cause = motion.strip() if inverse is None else motion, cause.strip("() ")
    if (inverse is not None or "/" in text) and _is_force(cause):
        return motion[1:].removesuffix(")") if motion.startswith("(") else motion, cause
    try:
        factor, exponents = parse_unit(_canonical(text))
    except ExpressionError:
        return None
    per_force = () if quantity is None else zip(dimension(UNITS[quantity]), dimension("N"), strict=True)
    if quantity is not None and factor == 1 and exponents == tuple(a - b for a, b in per_force):
        return UNITS[quantity], "N"
    return None


def _is_force(unit: str) -> bool:
    """Whether a unit is one of a force or a moment."""
    for quantity in FORCES:
        with suppress(OptionError):
            quantity_of(unit, quantity)
            return True
    return False


def split_heading(text: str, what: str) -> tuple[str, str]:
    """Name and unit of a heading `name [unit]`. Raises OptionError when it has no unit."""
    match = re.fullmatch(r"\s*(.*?\S)\s*\[([^\[\]]+)\]\s*", text)
    if match is None:
        raise OptionError(f"{what}: {text.strip()!r} has no unit; write it as `name [unit]`, e.g. p1.z [m/s^2]")
    return match[1], match[2]


AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
COLUMNS = "columns"
"""Key of a file of channels that lists the headings of a table of text."""

_KEYS = ("node", "direction", "position", "quantity", "unit", "force", "input", "full_scale", "sensitivity")


@dataclass(frozen=True)
class ChannelDescription:
    """What is known of a channel beside its data; None where nothing is. `is_input` says that it excites.

    `force` is the unit of the force of the same name, as a driving point has one beside its response. `full_scale` is
    what 1 stands for in data that are shares of it, a number and its unit. `sensitivity` is that of a sensor whose
    volts are the data: V per SI unit of a quantity, and that quantity.
    """

    node: str | None = None
    direction: tuple[float, float, float] | None = None
    position: tuple[float, float, float] | None = None
    quantity: str | None = None
    unit: str | None = None
    is_input: bool | None = None
    force: str | None = None
    full_scale: tuple[float, str] | None = None
    sensitivity: tuple[float, str] | None = None

    def unit_of(self, is_reference: bool) -> str | None:
        """Unit of the reference or of the response of this name, where it is known."""
        if is_reference and self.force is not None:
            return self.force
        return self.unit if self.force is not None or is_reference == (self.quantity in FORCES) else None


ChannelDescriptions = Mapping[str, ChannelDescription]


def axis(text: Any, what: str) -> tuple[float, float, float]:
    """Unit vector of `x`, `-z`, or of three numbers of any length. Raises OptionError for anything else."""
    if isinstance(text, str) and text.lstrip("+-") in AXES:
        sign = -1.0 if text.startswith("-") else 1.0
        x, y, z = (sign * v + 0.0 for v in AXES[text.lstrip("+-")])
        return x, y, z
    try:
        v = np.array([float(x) for x in text], dtype=float)
        length = float(np.linalg.norm(v))
    except (TypeError, ValueError):
        v, length = np.zeros(0), 0.0
    if v.shape != (3,) or not np.isfinite(length) or length == 0:
        raise OptionError(f"{what}: a direction is x, -y, ... or three numbers, not {text!r}")
    x, y, z = (float(x) for x in v / length)
    return x, y, z


def read_channel_descriptions(path: str | Path) -> dict[str, ChannelDescription]:
    """Read a file of channels (YAML): for every channel any of node, direction, position, quantity, unit, force,
    input.

    Raises ModelError for text that is no YAML and OptionError, with the line, for anything that is not expected.
    """
    file = Path(path)
    root = parse(text_of(file), str(file))
    table = root.value.get("channels", root)
    if table is root and _headings_of(root) is not None:
        table = replace(root, value={name: entry for name, entry in root.value.items() if name != COLUMNS})
    if not isinstance(table.value, dict):
        raise OptionError(f"{file}:{table.line}: a mapping of channel names is expected, e.g. p1.z: {{direction: z}}")
    return {
        name: _description(entry.plain(), f"{file}:{table.key_places[name][1]}: channel {name}")
        for name, entry in table.value.items()
    }


def read_columns(path: str | Path) -> tuple[str, ...]:
    """Headings of the columns of a table of text, by the list `columns` of a file of channels; none without it.

    Raises ModelError for text that is no YAML and OptionError for a list of anything but headings.
    """
    file = Path(path)
    listed = _headings_of(parse(text_of(file), str(file)))
    if listed is None:
        return ()
    headings = listed.plain()
    if not headings or not all(isinstance(heading, str) and heading.strip() for heading in headings):
        raise OptionError(f"{file}:{listed.line}: columns is a list of headings, - for those to leave out")
    return tuple(heading.strip() for heading in headings)


def _headings_of(root: Any) -> Any:
    """The list `columns` of a file; None without one: a mapping is a channel of that name."""
    listed = root.value.get(COLUMNS) if isinstance(root.value, dict) else None
    return listed if listed is not None and isinstance(listed.value, list) else None


def read_traces(path: str | Path, channels: Sequence[MeasuredChannel]) -> tuple[Trace, ...]:
    """The `traces` of a file of channels: lists of channels, of their nodes, or of further `nodes` with a position.

    Raises ModelError for text that is no YAML and OptionError, with the line, for what has no position.
    """
    file = Path(path)
    root = parse(text_of(file), str(file))
    known = {name: c.position for c in reversed(channels) for name in (c.name, c.node) if c.position is not None}
    if "channels" not in root.value:
        return ()
    unknown = next((key for key in root.value if key not in ("channels", "nodes", "traces", COLUMNS)), None)
    if unknown is not None:
        raise OptionError(
            f"{file}:{root.key_places[unknown][1]}: unknown key {unknown!r}; keys: channels, columns, nodes, traces"
        )
    plain = root.plain()
    nodes, lists = plain.get("nodes") or {}, plain.get("traces") or []
    if not isinstance(nodes, dict):
        raise OptionError(f"{file}:{root.key_places['nodes'][1]}: nodes is a mapping, e.g. {{corner: [0, 0, 62 mm]}}")
    for name, position in nodes.items():
        known[name] = _position(position, f"{file}: node {name}")
    traces: list[Trace] = []
    for names in lists if isinstance(lists, list) else [lists]:
        what = f"{file}:{root.key_places['traces'][1]}: traces"
        if not isinstance(names, list) or len(names) < 2:
            raise OptionError(f"{what}: lists of two names or more are expected, e.g. [[p1, p2], [p2, corner]]")
        missing = next((name for name in map(str, names) if name not in known), None)
        if missing is not None:
            raise OptionError(f"{what}: {missing!r} is no channel or node with a position")
        traces.append(tuple(known[str(name)] for name in names))
    return tuple(traces)


def _description(entry: Any, what: str) -> ChannelDescription:
    if not isinstance(entry, dict):
        raise OptionError(f"{what}: a mapping is expected, with any of {', '.join(_KEYS)}")
    unknown = next((key for key in entry if key not in _KEYS), None)
    if unknown is not None:
        raise OptionError(f"{what}: unknown key {unknown!r}; keys: {', '.join(_KEYS)}")
    if not isinstance(entry.get("input", False), bool):
        raise OptionError(f"{what}: input is true or false, not {entry['input']!r}")
    quantity, unit = entry.get("quantity"), entry.get("unit")
    if unit is not None:
        quantity = quantity_of(str(unit), quantity, what)[0]
    elif quantity is not None:
        refuse_unknown(quantity, what)
    node, direction, position, force = (entry.get(key) for key in ("node", "direction", "position", "force"))
    if force is not None and quantity_of(str(force), None, what)[0] not in FORCES:
        raise OptionError(f"{what}: {force} is no unit of a force or a moment")
    return ChannelDescription(
        None if node is None else str(node),
        None if direction is None else axis(direction, what),
        None if position is None else _position(position, what),
        quantity,
        None if unit is None else str(unit),
        entry.get("input"),
        None if force is None else str(force),
        None if "full_scale" not in entry else _full_scale(str(entry["full_scale"]), unit, what),
        None if "sensitivity" not in entry else _sensitivity(str(entry["sensitivity"]), what),
    )


_NUMBER = r"\s*(\d[\d.]*(?:e[+-]?\d+)?)\s*"


def _full_scale(text: str, unit: Any, what: str) -> tuple[float, str]:
    match = re.fullmatch(_NUMBER + r"([^\d\s].*)", text, re.IGNORECASE)
    if match is None or not is_number(match[1]) or float(match[1]) == 0 or unit is not None:
        raise OptionError(
            f"{what}: a full scale is a value with its unit, which it says alone, e.g. 50 g, not {text!r}"
        )
    quantity_of(match[2], None, what)
    return float(match[1]), match[2].strip()


def _sensitivity(text: str, what: str) -> tuple[float, str]:
    match = re.fullmatch(_NUMBER + r"([^/\s]*V)\s*/\s*(\S.*)", text, re.IGNORECASE)
    if match is None or not is_number(match[1]) or float(match[1]) == 0:
        raise OptionError(f"{what}: a sensitivity is volts per unit, e.g. 100 mV/g or 10 mV/(m/s^2), not {text!r}")
    quantity, size = quantity_of(match[3].strip("() "), None, what)
    return float(match[1]) * quantity_of(match[2], "voltage", what)[1] / size, quantity


def _position(raw: Any, what: str) -> tuple[float, float, float]:
    if not isinstance(raw, list) or len(raw) != 3:
        raise OptionError(f"{what}: a position is three lengths with their units, e.g. [40 mm, 0 mm, 62 mm]")
    lengths = []
    for text in raw:
        try:
            value, exponents = (0.0, None) if text == 0 else parse_quantity(str(text))
        except ExpressionError as error:
            raise OptionError(f"{what}: {error}") from None
        if exponents is not None and (exponents[0] != 1 or any(exponents[1:])):
            raise OptionError(f"{what}: {text!r} is no length; write it with its unit, e.g. 40 mm")
        lengths.append(value)
    x, y, z = lengths
    return x, y, z


def described_channels(mechanism: Mechanism | Plan, names: Sequence[str]) -> dict[str, ChannelDescription]:
    """ChannelDescriptions of the channels whose names are sensors, actuators or DOFs (`NODE.tz`) of a mechanism.

    Names that mean nothing there, and sensors between two nodes, have no entry. Raises ModelError for a mechanism that
    cannot be used.
    """
    plan = plan_of(mechanism)
    design = at_pose(Design.of(plan))
    ports = Ports(design)
    described: dict[str, ChannelDescription] = {}
    for name in names:
        node, _, dof = name.partition(":")[0].rpartition(".")
        try:
            if name in ports.sensors or name in ports.actuators:
                is_sensor = name in ports.sensors
                channel = (ports.outputs([name]) if is_sensor else ports.inputs([name]))[0].channel
                if channel.node is not None and channel.against is None:
                    place = (channel.node, channel.direction, channel.position)
                    described[name] = ChannelDescription(*place, quantity=channel.quantity)
            else:
                number = int(plan.topology.numbers([node])[0])
                x, y, z = design.geometry.positions[number].tolist()
                described[name] = ChannelDescription(node, axis("xyz"[DOF_NAMES.index(dof) % 3], name), (x, y, z))
        except (FlexuraError, ValueError, IndexError):
            continue
    return described


def with_description(channel: MeasuredChannel, described: ChannelDescription | None) -> MeasuredChannel:
    """A channel with its node, direction and position as described; what is not described stays as it is."""
    place = {name: getattr(described, name, None) for name in ("node", "direction", "position")}
    return replace(channel, **{name: value for name, value in place.items() if value is not None})
