"""Writing a Mechanism as a model file that reads back to the same description."""

from __future__ import annotations

import io
import os
from pathlib import Path as FilePath
from typing import Any, Literal, get_origin

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.scalarstring import DoubleQuotedScalarString, LiteralScalarString

from flexura.errors import FlexuraError, OptionError
from flexura.mechanism import DOF_NAMES, Expression, Matrix, Mechanism, Parameter, Support
from flexura.mechanism.base import Part
from flexura.mechanism.quantity import Quantity
from flexura.modelfile.document import resolve
from flexura.modelfile.reader import VERSION
from flexura.modelfile.scalars import ScalarWriter

MAX_LINE = 100
_AXES = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}
_AXES |= {(-x, -y, -z): f"-{name}" for (x, y, z), name in _AXES.items()}
_DIRECTIONS = frozenset({"axis", "normal", "reference"})
_SINGLE = frozenset({"rotate", "pattern"})
_IN_BLOCKS = frozenset({"substructures", "description"})


def dumps(mechanism: Mechanism) -> str:
    """Text of a model file for the mechanism: `loads(dumps(m)) == m`.

    Defaults are left out, and quantities carry the customary unit in which they are exact. Raises ModelError when
    the unit of a parameter is neither given nor follows from where the parameter is used.
    """
    writer = _Writer(mechanism)
    document = CommentedMap({"flexura": VERSION})
    document.update(writer.part(mechanism))
    yaml = YAML()
    yaml.width = 10**6
    yaml.allow_unicode = True
    yaml.indent(mapping=2, sequence=4, offset=2)
    stream = io.StringIO()
    yaml.dump(document, stream)
    return stream.getvalue()


def save(mechanism: Mechanism, path: str | FilePath) -> None:
    """Write a model file in one step: what was there before stays until the new file is complete.

    Raises ModelError as `dumps` does, and OptionError when the file cannot be written.
    """
    text = dumps(mechanism)
    target = FilePath(path).resolve()
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        try:
            with temporary.open("x", encoding="utf-8", newline="\n") as stream:
                stream.write(text)
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)
    except (OSError, ValueError) as error:
        raise OptionError(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}") from None


class _Writer:
    """Turns parts into data for YAML: mappings in the order of their fields, defaults left out."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.scalars = ScalarWriter(mechanism)

    def part(self, part: Part) -> CommentedMap:
        result = CommentedMap()
        for name, field in type(part).model_fields.items():
            value = getattr(part, name)
            kind = get_origin(field.annotation) is Literal and name in ("type", "shape")
            if kind or field.is_required() or value != field.default:
                result[name] = self.value(name, value, part)
        return _tidy(result)
