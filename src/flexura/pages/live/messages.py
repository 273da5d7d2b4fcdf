"""Messages of the page: JSON of bounded size in, JSON out."""

from __future__ import annotations

import json
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from flexura.errors import OptionError
from flexura.results import plain

LARGEST = 1 << 17
"""Bytes of the largest message that is read."""

MOST_MODES = 30

Finite = Annotated[float, Field(allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=200)]
Numbers = Annotated[dict[Name, Finite], Field(max_length=2000)]


class _Message(BaseModel):
    """What the page sends: nothing but the keys that are known, of exactly their types."""

    model_config: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


class Response(_Message):
    """The frequency response that is asked for; a damping ratio in place of the described damping."""

    input: Name
    output: Name
    low: Annotated[Finite, Field(gt=0)]
    high: Annotated[Finite, Field(gt=0)]
    damping: Annotated[Finite, Field(ge=0, lt=1)] | None = None


class Load(_Message):
    """What the stresses are of: the loads that are described, actuators at their limits, or a DOF that is moved by an
    `amplitude`, m or rad."""

    kind: Literal["described", "actuators", "move"]
    dof: Name = ""
    amplitude: Finite = 0.0


class Ask(_Message):
    """A design: the numbers of the sliders that differ from the file, in their units."""

    type: Literal["design"]
    serial: Annotated[int, Field(ge=0)]
    values: Numbers
    modes: Annotated[int, Field(ge=1, le=MOST_MODES)] = 6
    shown: int | None = None
    response: Response | None = None
    load: Load | None = None


class Save(_Message):
    """A file to be written beside the one that is open."""

    type: Literal["save"]
    file: Name
    values: Numbers
    overwrite: bool = False


_READER: TypeAdapter[Ask | Save] = TypeAdapter(Annotated[Ask | Save, Field(discriminator="type")])


def read_message(text: str) -> Ask | Save:
    """A message of the page. Raises OptionError for anything else."""
    try:
        return _READER.validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise OptionError(f"a message that is not understood: {where}: {first['msg']}") from None


def told(kind: str, **data: Any) -> str:
    """A message in JSON; numbers that are not finite are null."""
    return json.dumps({"type": kind, **plain(data)}, allow_nan=False, separators=(",", ":"))
