"""Linear models as text that other programs read: functions of MATLAB and Octave, and models of Modelica."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.files import write_file
from flexura.io.contents import Names, notes_of, plain_name, refuse_clashes, signal_names
from flexura.systems import StateSpace

PER_LINE = 4
"""Numbers, or terms, on a line."""

_FUNCTION = re.compile(r"[A-Za-z]\w*", re.ASCII)

_RESERVED = frozenset(
    """
    algorithm and annotation block break class connect connector constant constrainedby der discrete each else elseif
    elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
    impure in initial inner input loop model not operator or outer output package parameter partial protected public
    pure record redeclare replaceable return stream then true type when while within time delay sample pre
    """.split()  # noqa: SIM905
)
"""Words of Modelica that are no names."""


def write_m(model: StateSpace, path: str | Path) -> Path:
    """Write a function of MATLAB or Octave, by the name of the file, that returns the model as `ss` with its names.

    Numbers read back to the same doubles. Octave takes no dead time. Raises OptionError for a file whose name is none
    of a function, for signals whose names clash, and for a file that cannot be written.
    """
    name = Path(path).stem
    if not _FUNCTION.fullmatch(name):
        raise OptionError(f"{name!r} is no name of a MATLAB function: letters, digits and underscores, a letter first")
    text = "\n".join(_m_lines(model, name, signal_names(model))) + "\n"
    return write_file(path, lambda file: file.write_text(text, encoding="utf-8", newline="\n"))


def _m_lines(model: StateSpace, name: str, names: Names) -> Iterator[str]:
    yield f"function sys = {name}()"
    yield f"% {model.name}, SI units"
    yield from (f"% {note}" for note in notes_of(model))
    for channels, known in ((model.inputs, names.inputs), (model.outputs, names.outputs)):
        for channel, own in zip(channels, known, strict=True):
            yield f"% {own}: {channel.quantity} [{channel.unit}]"
    for key in "ABCD":
        yield from _m_matrix(key, getattr(model, key))
    step = "" if model.dt is None else f", {float(model.dt)!r}"
    yield f"sys = ss(A, B, C, D{step});"
    for key, known in zip(("InputName", "OutputName", "StateName"), names, strict=True):
        quoted = ", ".join("'" + own.replace("'", "''") + "'" for own in known)
        yield f"sys.{key} = {{{quoted}}};"
    if model.delay:
        yield f"sys.InputDelay = {float(model.delay)!r} * ones({len(model.inputs)}, 1);"
    yield "end"


def _m_matrix(key: str, X: Array) -> Iterator[str]:
    """A matrix by its nonzeros, row by row."""
    yield f"{key} = zeros({X.shape[0]}, {X.shape[1]});"
    entries = [f"{key}({i + 1}, {j + 1}) = {float(X[i, j])!r};" for i, j in np.argwhere(X).tolist()]
    yield from (" ".join(entries[k : k + PER_LINE]) for k in range(0, len(entries), PER_LINE))


def write_modelica(model: StateSpace, path: str | Path) -> Path:
    """Write a block of Modelica, by the name of the file, with real inputs and outputs of its standard library.

    Inputs and outputs have their units, states start from rest; only what is not zero is written. Dead time is that of
    `delay`. Raises OptionError for discrete models, for a file whose name is none of a class, for signals whose names
    clash, and for a file that cannot be written.
    """
    if model.is_discrete:
        raise OptionError(
            f"Modelica takes a continuous model, and this one has steps of {model.dt} s: export the first"
        )
    name = Path(path).stem
    if not _FUNCTION.fullmatch(name) or name in _RESERVED:
        raise OptionError(f"{name!r} is no name of a Modelica class: letters, digits and underscores, a letter first")
    known = signal_names(model)
    inputs, outputs = ([_variable(own) for own in names] for names in (known.inputs, known.outputs))
    refuse_clashes([*inputs, *outputs, "x"], " once dots have become underscores")
    text = "\n".join(_modelica_lines(model, name, inputs, outputs)) + "\n"
    return write_file(path, lambda file: file.write_text(text, encoding="utf-8", newline="\n"))


def _variable(name: str) -> str:
    plain = plain_name(name)
    return f"{plain}_" if plain in _RESERVED else f"v_{plain}" if plain[0].isdigit() else plain


def _modelica_lines(model: StateSpace, name: str, inputs: list[str], outputs: list[str]) -> Iterator[str]:
    yield f'block {name} "{_quoted("; ".join([model.name, *notes_of(model)]))}"'
    for kind, names, channels in (("Input", inputs, model.inputs), ("Output", outputs, model.outputs)):
        for own, channel in zip(names, channels, strict=True):
            unit = channel.unit.replace("*", ".")
            comment = _quoted(f"{channel.quantity} of {channel.name}")
            yield f'  Modelica.Blocks.Interfaces.Real{kind} {own}(unit="{unit}") "{comment}";'
    if model.order:
        yield f'  Real x[{model.order}](each start = 0, each fixed = true) "states";'
    yield "equation"
    states = [f"x[{k + 1}]" for k in range(model.order)]
    late = [f"delay({own}, {float(model.delay)!r})" for own in inputs] if model.delay else inputs
    rows = [(f"der({own})", model.A[k], model.B[k]) for k, own in enumerate(states)]
    rows += [(own, model.C[k], model.D[k]) for k, own in enumerate(outputs)]
    for left, of_states, of_inputs in rows:
        terms = [(float(v), own) for v, own in zip([*of_states, *of_inputs], [*states, *late], strict=True) if v]
        yield f"  {left} = {_sum(terms)};"
    yield f"end {name};"


def _sum(terms: list[tuple[float, str]]) -> str:
    """A sum of products, broken into lines."""
    if not terms:
        return "0"
    texts = [f"{'-' if v < 0 else '+'} {abs(v)!r} * {own}" for v, own in terms]
    texts[0] = texts[0].removeprefix("+ ")
    return "\n    ".join(" ".join(texts[k : k + PER_LINE]) for k in range(0, len(texts), PER_LINE))


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')
