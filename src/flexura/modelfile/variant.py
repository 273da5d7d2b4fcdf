"""A model file on top of another one, with other values of some parameters."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from flexura.errors import OptionError
from flexura.expressions import NUMBER
from flexura.mechanism import Mechanism, parameter_dimensions
from flexura.modelfile.extension import files_of
from flexura.modelfile.reader import VERSION
from flexura.units import format_quantity


class Changed(NamedTuple):
    """A new value of a parameter, SI, where it comes from, and a comment on its line."""

    value: float
    source: str
    comment: str = ""


def refuse_base(target: Path, base: Path) -> None:
    """Raise OptionError where `target` is the model file `base`, or one that this extends: nothing would be left."""
    for own in files_of(base):
        with suppress(OSError):
            if target.samefile(own):
                raise OptionError(f"{target} is the model file that is read, or one that it extends: give another name")


def variant_text(mechanism: Mechanism, name: str, base: Path, target: Path, changed: Mapping[str, Changed]) -> str:
    """The text of a model file `target` with a name of its own that extends `base`, the file of `mechanism`, with
    `changed` values of parameters; what `base` says of their bounds stays. Raises OptionError as `refuse_base`."""
    refuse_base(target, base)
    dimensions = parameter_dimensions(mechanism.parameters)
    above = Path(os.path.relpath(base.resolve(), target.resolve().parent)).as_posix()
    lines = [f"flexura: {VERSION}", f"extends: {_quoted(above)}", f"name: {_quoted(name)}", "", "parameters:"]
    for key, own in changed.items():
        number = format_quantity(own.value, dimensions[key] or NUMBER)
        comment = f"  # {own.comment}" if own.comment else ""
        lines.append(f"  {key}: {{value: {number}, source: {_quoted(own.source)}}}{comment}")
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
