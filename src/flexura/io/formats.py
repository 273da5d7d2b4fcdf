"""The table of file formats, and `export`: one call for all of them, chosen by the suffix of the file or by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from typing import Any

from flexura.analysis import Modes, Observer, ScheduledPlant, Shaper
from flexura.arguments import verb
from flexura.errors import OptionError
from flexura.io.archives import read_hdf5, read_npz, write_measured_hdf5, write_measured_npz
from flexura.io.arrays import write_hdf5, write_mat, write_matrix_market, write_npz
from flexura.io.c_code import write_c
from flexura.io.contents import Response
from flexura.io.fmu import write_fmi3, write_fmu
from flexura.io.matlab import read_mat
from flexura.io.meshes import write_vtu
from flexura.io.records import read_tdms, read_wav
from flexura.io.simscape import write_simscape
from flexura.io.tables import read_csv, write_csv
from flexura.io.texts import write_m, write_modelica
from flexura.io.uff import read_uff, write_results_uff, write_uff
from flexura.lazy import plugins
from flexura.mechanism import Damping
from flexura.reduction import LowOrderModel, NestedModel
from flexura.structure import FullOrderModel
from flexura.systems import SinglePrecision, StateSpace
from flexura.testing.measurement import Measurement

STATE_SPACE, STEPS, OBSERVER, SHAPER, RESPONSE, MODES, LOW, FULL = (
    "state space",
    "state space in float32",
    "observer",
    "shaper",
    "frequency response",
    "modes",
    "low-order model",
    "full-order model",
)
SCHEDULED = "scheduled plant"


@dataclass(frozen=True)
class MeasuredFormat:
    """What reads and writes measured data: `read(path, descriptions)`, where it can with `repeated=...`, and
    `write(measurement, path)`, where it can with `binary=...`, None of what is only read; such files go by
    `more_suffixes` too."""

    read: Callable[..., Measurement]
    write: Callable[..., None] | None = None
    more_suffixes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A file format: its suffixes, what it takes (`state space`, `state space in float32`, `observer`, `shaper`,
    `frequency response`, `modes`, `low-order model`, `full-order model`, `scheduled plant`; first what the shell
    writes where nothing is said), what a file in it is, `write(result, path, **options)`, which returns the paths, and
    what reads and writes measured data in it."""

    suffixes: tuple[str, ...]
    takes: tuple[str, ...]
    text: str
    write: Callable[..., Path | list[Path]] | None = None
    measured: MeasuredFormat | None = None

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the options of `write`."""
        return () if self.write is None else tuple(signature(self.write).parameters)[2:]


_ARRAYS = (STATE_SPACE, RESPONSE, LOW, FULL, SCHEDULED)

FORMATS = {
    "fmu": Format((".fmu",), (STATE_SPACE, SCHEDULED), "FMI 2.0 co-simulation and model exchange", write_fmu),
    "fmi3": Format((), (STATE_SPACE, SCHEDULED), "FMI 3.0 co-simulation and model exchange", write_fmi3),
    "mat": Format((".mat",), _ARRAYS, "MATLAB", write_mat, MeasuredFormat(read_mat)),
    "m": Format((".m",), (STATE_SPACE,), "function of MATLAB and Octave that returns an `ss`", write_m),
    "modelica": Format((".mo",), (STATE_SPACE,), "block of Modelica", write_modelica),
    "c": Format((".c",), (STATE_SPACE, STEPS, OBSERVER, SHAPER), "C99 in float32 for microcontrollers", write_c),
    "simscape": Format(
        (), (LOW,), "MATLAB file for Reduced Order Flexible Solid of Simscape Multibody", write_simscape
    ),
    "npz": Format((".npz",), _ARRAYS, "NumPy archive", write_npz, MeasuredFormat(read_npz, write_measured_npz)),
    "hdf5": Format(
        (".h5", ".hdf5"), _ARRAYS, "HDF5", write_hdf5, MeasuredFormat(read_hdf5, write_measured_hdf5, (".hdf",))
    ),
    "matrix-market": Format((".mtx",), (FULL, LOW), "Matrix Market files and a table of DOFs", write_matrix_market),
    "vtu": Format((".vtu",), (MODES, FULL), "VTK mesh of lines with mode shapes", write_vtu),
    "uff": Format(
        (".uff", ".unv"),
        (MODES, RESPONSE),
        "universal file, datasets 15, 55, 58, 82, 151, 164",
        write_results_uff,
        MeasuredFormat(read_uff, write_uff, (".uf", ".58", ".bunv")),
    ),
    "csv": Format((".csv",), (), "measured record or responses", None, MeasuredFormat(read_csv, write_csv, (".txt",))),
    "tdms": Format((".tdms",), (), "measured records of LabVIEW", None, MeasuredFormat(read_tdms)),
    "wav": Format((".wav",), (), "measured record, in shares of full scales", None, MeasuredFormat(read_wav)),
}
"""All formats by name: the one place that lists them."""


def formats() -> dict[str, Format]:
    """These, and those of plug-ins."""
    return {**FORMATS, **plugins("formats")}


def _exported() -> dict[str, Format]:
    return {name: known for name, known in formats().items() if known.write is not None}


@verb
def export(
    result: Any,
    path: str | Path,
    *,
    format: str | None = None,
    damping: Damping | float | Mapping[str, Any] | None = None,
    damping_ratio: float | None = None,
    frames: Sequence[str] | None = None,
    keep: int | None = None,
    amplitude: float | None = None,
    geometry: Modes | FullOrderModel | None = None,
    binary: bool | None = None,
    platforms: Sequence[str] | None = None,
) -> list[Path]:
    """Write a model or a result for another program; the `format` is that of the suffix by default.

    `result` is a state space, an observer, a shaper, a frequency response, modes, a scheduled plant, or a low- or
    full-order model;
    `FORMATS` says which format takes which, and which of these: `damping` as in `system`, which makes C of a model
    (npz, hdf5, mat, matrix-market); `damping_ratio` of all modes, `frames` by name and `keep` modes with these held
    (simscape); the largest displacement `amplitude`, m or rad, of each shape (vtu); `geometry`, modes or a model that
    the nodes of a response are those of (uff); `binary`, libraries beside the sources, for `platforms` such as
    x86_64-windows (fmu, fmi3). Every file appears complete or not at all. Returns the paths. Raises OptionError for
    unknown formats, objects that the format does not take, options that it has not and files that cannot be written.
    """
    name = format_of(path, format)
    exported = _exported()
    chosen = exported[name]
    if isinstance(result, list | tuple) and name != "uff":
        raise OptionError(f"{name} takes one thing, not several; several go into a universal file (uff)")
    kind = kind_of(result)
    if kind not in chosen.takes:
        others = [other for other, one in exported.items() if kind in one.takes]
        hint = f"; formats that do: {', '.join(others)}" if others else ""
        raise OptionError(f"{name} takes a {' or a '.join(chosen.takes)}, not a {kind}{hint}")
    named = {
        "damping": damping,
        "damping_ratio": damping_ratio,
        "frames": frames,
        "keep": keep,
        "amplitude": amplitude,
        "geometry": geometry,
        "binary": binary,
        "platforms": platforms,
    }
    options = {name: value for name, value in named.items() if value is not None}
    unknown = sorted(set(options) - set(chosen.options))
    if unknown:
        known = ", ".join(chosen.options) or "none"
        raise OptionError(f"{name} has no option {unknown[0]!r}; its options: {known}")
    written = chosen.write(result, path, **options) if chosen.write else []
    return written if isinstance(written, list) else [written]


def format_of(path: str | Path, format: str | None = None) -> str:
    """The name of the format. Raises OptionError for names and suffixes that are none."""
    exported = _exported()
    if format is not None:
        if format not in exported:
            raise OptionError(f"there is no format {format!r}; formats: {', '.join(exported)}")
        return format
    suffix = Path(path).suffix.lower()
    for name, known_format in exported.items():
        if suffix in known_format.suffixes:
            return name
    known = ", ".join(
        f"{suffix} ({name})" for name, known_format in exported.items() for suffix in known_format.suffixes
    )
    raise OptionError(f"{suffix or 'no suffix'} is no known format; name one with `format`, or take one of {known}")


def kind_of(what: Any) -> str:
    """What a thing is, in the words of `Format.takes`; a list is what its first entry is."""
    if isinstance(what, list | tuple) and what:
        return kind_of(what[0])
    if isinstance(what, StateSpace):
        return STATE_SPACE
    if isinstance(what, SinglePrecision):
        return STEPS
    if isinstance(what, Observer | Shaper):
        return OBSERVER if isinstance(what, Observer) else SHAPER
    if isinstance(what, ScheduledPlant):
        return SCHEDULED
    if isinstance(what, Modes):
        return MODES
    if isinstance(what, FullOrderModel):
        return FULL
    if isinstance(what, LowOrderModel | NestedModel):
        return LOW
    model = getattr(what, "model", None)
    if isinstance(model, FullOrderModel | LowOrderModel) and hasattr(what, "C"):
        return kind_of(model)
    return RESPONSE if isinstance(what, Response) else type(what).__name__
