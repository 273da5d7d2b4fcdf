"""MATLAB files of state spaces, second-order models and frequency responses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from flexura.files import write_file
from flexura.io.contents import contents
from flexura.io.names import signal_names
from flexura.systems import StateSpace

_MATLAB_NAMES = {
    "dt": "Ts",
    "delay": "InputDelay",
    "name": "Name",
    "notes": "Notes",
    "kind": "Kind",
    "frequency_hz": "FrequencyHz",
    "response": "ResponseData",
    "input_names": "InputName",
    "output_names": "OutputName",
    "state_names": "StateName",
    "input_units": "InputUnit",
    "output_units": "OutputUnit",
    "input_quantities": "InputQuantity",
    "output_quantities": "OutputQuantity",
    "coordinate_names": "CoordinateName",
}


def write_mat(what: Any, path: str | Path, damping: Any | None = None) -> Path:
    """Write a MATLAB file (version 5) with the names that `ss` and `frd` use for their properties.

    State space: A, B, C, D, Ts (0 when continuous), InputDelay in s, and names and units as cell arrays of columns,
    names that occur twice with their quantity behind them. Frequency response: ResponseData (p, m, f) at FrequencyHz.
    Second-order model: K, M, C and CoordinateName. Raises OptionError for things that have no arrays, and when the file
    cannot be written.
    """
    items = contents(what, damping)
    if isinstance(what, StateSpace):
        names = signal_names(what)
        items |= {"input_names": list(names.inputs), "output_names": list(names.outputs)}
        items["delay"] = np.full((len(what.inputs), 1), what.delay if what.dt is None else 0.0)
    if "response" in items:
        items["response"] = items["response"].transpose(1, 2, 0)
        items["frequency_hz"] = items["frequency_hz"][:, None]
    return save_mat({_MATLAB_NAMES.get(name, name): value for name, value in items.items()}, path)


def save_mat(items: dict[str, Any], path: str | Path) -> Path:
    """Write arrays, numbers, texts and lists of texts (as cell columns) as variables of a MATLAB file."""
    from scipy.io import savemat

    variables = {name: _cell(value) if isinstance(value, list) else value for name, value in items.items()}

    def write(file: Path) -> None:
        savemat(str(file), variables, appendmat=False, long_field_names=True, do_compression=True)

    return write_file(path, write)


def _cell(texts: list[str]) -> Any:
    cell = np.empty((len(texts), 1), dtype=object)
    cell[:, 0] = texts
    return cell
