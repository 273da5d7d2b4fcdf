"""What is done with a file in a fuzzed case: read it, and ask what comes next. All raise FlexuraError alone."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import flexura as fx
from flexura.errors import FlexuraError, ModelError
from flexura.io import read_measurement, write_measurement
from flexura.modelfile import dumps, load, loads
from flexura.sizes import size_limits
from flexura.testing.measurement.channels import read_channel_descriptions, read_columns
from flexura.units import parse_quantity, parse_unit

SMALL = {"nodes": 2_000, "elements": 2_000, "copies": 2_000, "file_bytes": 50_000_000, "model_values": 20_000}
"""Limits of size within which everything is quick."""

ELEMENT = "superelements: {p: {nodes: NODES, stiffness: {file: NAME}, mass: {file: NAME}}}\n"
ONE = "nodes: {a: [0, 0, 0]}\n" + ELEMENT.replace("NODES", "[a]")
TWO = "nodes: {a: [0, 0, 0], b: [9 mm, 0, 0]}\nground: {a: clamped}\n"
TWO += ELEMENT.replace("NODES", "[a, b], amplitudes: 2")
EXPRESSION = (
    "parameters: {t: 1 mm, n: 3, w: 2 mm}\nnodes: {a: [0, 0, 0], b: [EXPRESSION, 2 mm, 3 mm]}\n"
    "links: {l: {nodes: [a, b], section: {shape: circle, diameter: 1 mm}, material: silicon, reference: z}}\n"
    "ground: {a: clamped}\n"
)


def described(mechanism: Any) -> None:
    """What is asked of a description that could be read: it comes back from its text, and `check` looks at it."""
    assert loads(dumps(mechanism)) == mechanism
    fx.check(mechanism)


def model(file: Path) -> None:
    """A model file."""
    try:
        mechanism = load(file)
    except ModelError as error:
        assert error.problems and all(p.rule and len(str(p)) < 5_000 for p in error.problems)
        raise
    described(mechanism)


def matrix(file: Path) -> None:
    """A Matrix Market file, as the stiffness and mass of superelements with 6 and 14 DOFs."""
    any_of(*(lambda own=own: described(loads(own.replace("NAME", repr(str(file))))) for own in (ONE, TWO)))


def expression(file: Path) -> None:
    """A text as a quantity, a unit, and an expression of a model file."""
    text = file.read_bytes().decode("utf-8", "replace")
    quoted = '"' + "".join(c if c.isalnum() else f"\\U{ord(c):08x}" for c in text) + '"'
    any_of(
        lambda: parse_quantity(text),
        lambda: parse_unit(text),
        lambda: fx.describe.Expression.parse(text).evaluate({"t": np.array([1e-3, 0.0]), "n": 3.0, "w": -1.0}),
        lambda: described(loads(EXPRESSION.replace("EXPRESSION", quoted))),
    )


def measured(file: Path) -> None:
    """Measured data: read, written in every format, and turned into responses and modes."""
    found = read_measurement(file)
    for suffix in (".uff", ".npz", ".csv"):
        copy = file.with_name(f"copy{suffix}")
        refusal(lambda copy=copy: read_measurement(write_measurement(found, copy)))
    refusal(lambda: write_measurement(found, file.with_name("copy.h5")))
    frfs = list(found.frfs)
    if found.recordings:
        refusal(lambda: frfs.extend(fx.testing.estimate_frf(found)))
    refusal(lambda: fx.identify(frfs, order=12).to_dict())


def frequencies(file: Path) -> None:
    """A list of natural frequencies."""
    fx.testing.read_frequencies(file)


def signals(file: Path) -> None:
    """Signals for a time response."""
    fx.read_signals(file)


def channels(file: Path) -> None:
    """A file of channels."""
    read_channel_descriptions(file)
    read_columns(file)


def refusal(ask: Callable[[], object]) -> FlexuraError | None:
    """Ask for something that may be refused; the refusal where it is."""
    try:
        ask()
    except FlexuraError as error:
        assert str(error).strip(), "an error without a word"
        return error
    return None


def any_of(*asked: Callable[[], object]) -> None:
    """Ask for all; raises the last refusal where everything is refused."""
    found = [refusal(ask) for ask in asked]
    if all(found) and found[-1] is not None:
        raise found[-1]


READERS: dict[str, Callable[[Path], None]] = {
    own.__name__: own for own in (model, matrix, expression, measured, frequencies, signals, channels)
}
"""Readers by the name of the folder that holds their corpus."""


def read(kind: str, file: Path) -> str:
    """Read a file as a case: `read` or `refused`. Raises what is no FlexuraError."""
    with warnings.catch_warnings(), np.errstate(all="ignore"), size_limits(**SMALL):
        warnings.simplefilter("ignore")
        return "refused" if refusal(lambda: READERS[kind](file)) else "read"
