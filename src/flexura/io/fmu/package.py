"""Functional mock-up units, FMI 2.0 and FMI 3.0: what stands in the archive, and where."""

from __future__ import annotations

import hashlib
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexura.analysis import ScheduledPlant
from flexura.compilers import PLATFORMS, build_library, platform_of, this_platform
from flexura.errors import OptionError
from flexura.files import scratch_folder, write_file
from flexura.io.fmu.description import build_description, description, model_identifier
from flexura.io.fmu.posed import posed_unit
from flexura.io.fmu.unit import Unit, linear_unit
from flexura.systems import StateSpace

_EPOCH = (1980, 1, 1, 0, 0, 0)


def write_fmu(
    model: StateSpace | ScheduledPlant,
    path: str | Path,
    binary: bool = True,
    platforms: Sequence[str] | None = None,
) -> Path:
    """Write an FMU of FMI 2.0 with its C sources and, unless `binary` is false, shared libraries for `platforms`, by
    default for this machine.

    Inputs and outputs are variables by the names and with the units of the channels, the states local ones; see
    `signal_names` for names that occur twice. Damping ratios of modes, payloads and gains of inputs are parameters. In
    co-simulation inputs are held over a step, and the step is exact (theory eqs. X1-X3): one exponential per diagonal
    block of A, worked out again only when the step size or a parameter changes. A discrete model makes its own steps,
    and is for co-simulation alone. A scheduled plant moves over its stroke, in co-simulation by steps of order 5 whose
    error is kept (theory eqs. X22-X24), and a step ends where it leaves the stroke. The same model makes the same file,
    byte for byte, with the same compiler.
    Raises OptionError for continuous models with dead time, names that clash, unknown platforms, a missing compiler,
    and a file that cannot be written.
    """
    return _write(model, path, binary, platforms, 2)


def write_fmi3(
    model: StateSpace | ScheduledPlant,
    path: str | Path,
    binary: bool = True,
    platforms: Sequence[str] | None = None,
) -> Path:
    """Write an FMU of FMI 3.0, in which a discrete model declares its sample clock, which may drive it in both kinds;
    otherwise as `write_fmu`."""
    return _write(model, path, binary, platforms, 3)


def _write(
    model: StateSpace | ScheduledPlant,
    path: str | Path,
    binary: bool,
    platforms: Sequence[str] | None,
    version: int,
) -> Path:
    unit = unit_of(model)
    if platforms is not None and (isinstance(platforms, str) or not binary or not platforms):
        raise OptionError("platforms are a list of names of what libraries are built for, and go with binary")
    names = list(dict.fromkeys(platforms or [this_platform()])) if binary else []
    places = {name: _binary_place(name, model_identifier(unit.name), version) for name in names}
    contents = fmu_contents(unit, version)
    texts = {name.split("/")[1]: content.decode() for name, content in contents.items() if "/" in name}
    for name, place in places.items():
        contents[place] = shared_library(texts, unit.compiled(version), name)
    return write_file(path, lambda file: _zip(file, contents))


def _binary_place(name: str, identifier: str, version: int) -> str:
    """Where the library for a platform stands in an FMU. Raises OptionError for platforms that have no place."""
    try:
        own = platform_of(name)
    except OptionError as error:
        raise OptionError(
            f"{error}. `binary=False` writes an FMU with sources alone, which tools can compile"
        ) from None
    folder = name if version == 3 else own.fmi2
    if folder is None:
        known = ", ".join(key for key, of in PLATFORMS.items() if of.fmi2)
        raise OptionError(f'FMI 2 has no name for {name}, only for {known}; FMI 3 has one: format="fmi3"')
    return f"binaries/{folder}/{identifier}{own.suffix}"


def shared_library(sources: Mapping[str, str], compiled: Sequence[str], name: str) -> bytes:
    """Sources compiled and linked for a platform."""
    with scratch_folder() as folder:
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        return build_library(folder, compiled, name).read_bytes()


def unit_of(model: StateSpace | ScheduledPlant) -> Unit:
    """What an FMU of a model has. Raises OptionError for models that none can stand for."""
    if isinstance(model, ScheduledPlant):
        return posed_unit(model)
    if model.tuning is not None and not np.array_equal(model.tuning.A, model.A):
        model = replace(model, tuning=None)  # its matrices were changed since, and ports are of others
    return linear_unit(model)


def fmu_contents(unit: Unit, version: int) -> dict[str, bytes]:
    """The files of an FMU without binaries, by their paths in it.

    The GUID, or token, is a digest of the model: it changes when a number, a name or a unit does.
    """
    whole = [description(unit, "", version), *unit.sources("", version).values()]
    token = f"{{{uuid.UUID(bytes=hashlib.sha256(''.join(whole).encode()).digest()[:16], version=5)}}}"
    text = {"modelDescription.xml": description(unit, token, version)}
    text |= {f"sources/{name}": content for name, content in unit.sources(token, version).items()}
    if version == 3:
        text["sources/buildDescription.xml"] = build_description(unit)
    return {name: content.encode() for name, content in text.items()}


def _zip(file: Path, contents: dict[str, bytes]) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, content)
