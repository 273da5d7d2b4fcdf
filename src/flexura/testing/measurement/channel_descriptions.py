"""What the channels of a test are: from a file beside the data, or from a mechanism with nodes of the same names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flexura.errors import ExpressionError, FlexuraError, OptionError
from flexura.mechanism import DOF_NAMES, Mechanism
from flexura.modelfile import parse, text_of
from flexura.structure import Design, Plan, plan_of
from flexura.systems import Ports
from flexura.testing.measurement.channel_units import quantity_of, refuse_unknown
from flexura.testing.measurement.channels import MeasuredChannel
from flexura.units import parse_quantity

FORCES = ("force", "moment")
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_KEYS = ("node", "direction", "position", "quantity", "unit", "force", "input")


@dataclass(frozen=True)
class ChannelDescription:
    """What is known of a channel beside its data; None where nothing is. `is_input` says that it excites.

    `force` is the unit of the force of the same name, as a driving point has one beside its response.
    """

    node: str | None = None
    direction: tuple[float, float, float] | None = None
    position: tuple[float, float, float] | None = None
    quantity: str | None = None
    unit: str | None = None
    is_input: bool | None = None
    force: str | None = None

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
    if not isinstance(table.value, dict):
        raise OptionError(f"{file}:{table.line}: a mapping of channel names is expected, e.g. p1.z: {{direction: z}}")
    return {
        name: _description(entry.plain(), f"{file}:{table.key_places[name][1]}: channel {name}")
        for name, entry in table.value.items()
    }


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
    force = entry.get("force")
    if force is not None and quantity_of(str(force), None, what)[0] not in FORCES:
        raise OptionError(f"{what}: {force} is no unit of a force or a moment")
    return ChannelDescription(
        None if entry.get("node") is None else str(entry["node"]),
        None if entry.get("direction") is None else axis(entry["direction"], what),
        None if entry.get("position") is None else _position(entry["position"], what),
        quantity,
        None if unit is None else str(unit),
        entry.get("input"),
        None if force is None else str(force),
    )


def _position(raw: Any, what: str) -> tuple[float, float, float]:
    if not isinstance(raw, list) or len(raw) != 3:
        raise OptionError(f"{what}: a position is three lengths with their units, e.g. [40 mm, 0 mm, 62 mm]")
    found = []
    for text in raw:
        try:
            value, exponents = (0.0, None) if text == 0 else parse_quantity(str(text))
        except ExpressionError as error:
            raise OptionError(f"{what}: {error}") from None
        if exponents is not None and (exponents[0] != 1 or any(exponents[1:])):
            raise OptionError(f"{what}: {text!r} is no length; write it with its unit, e.g. 40 mm")
        found.append(value)
    x, y, z = found
    return x, y, z


def described_channels(mechanism: Mechanism | Plan, names: Sequence[str]) -> dict[str, ChannelDescription]:
    """ChannelDescriptions of the channels whose names are sensors, actuators or DOFs (`NODE.tz`) of a mechanism.

    Names that mean nothing there, and sensors between two nodes, have no entry. Raises ModelError for a mechanism that
    cannot be used.
    """
    plan = plan_of(mechanism)
    design = Design.of(plan)
    ports = Ports(design)
    found: dict[str, ChannelDescription] = {}
    for name in names:
        node, _, dof = name.partition(":")[0].rpartition(".")
        try:
            if name in ports.sensors or name in ports.actuators:
                is_sensor = name in ports.sensors
                channel = (ports.outputs([name]) if is_sensor else ports.inputs([name]))[0].channel
                if channel.node is not None and channel.against is None:
                    found[name] = ChannelDescription(
                        channel.node, channel.direction, channel.position, channel.quantity
                    )
            else:
                number = int(plan.topology.numbers([node])[0])
                x, y, z = design.geometry.positions[number].tolist()
                found[name] = ChannelDescription(node, axis("xyz"[DOF_NAMES.index(dof) % 3], name), (x, y, z))
        except (FlexuraError, ValueError, IndexError):
            continue
    return found


def with_description(channel: MeasuredChannel, described: ChannelDescription | None) -> MeasuredChannel:
    """A channel with its node, direction and position as described; what is not described stays as it is."""
    if described is None:
        return channel
    return replace(
        channel,
        node=described.node if described.node is not None else channel.node,
        direction=described.direction if described.direction is not None else channel.direction,
        position=described.position if described.position is not None else channel.position,
    )
