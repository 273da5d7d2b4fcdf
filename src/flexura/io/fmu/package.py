"""Functional mock-up units: FMI 2.0, co-simulation and model exchange, of a continuous linear model."""

from __future__ import annotations

import hashlib
import uuid
import zipfile
from pathlib import Path

from flexura.files import write_file
from flexura.io.fmu.code import SOURCES, binary_place, c_sources, shared_library
from flexura.io.fmu.description import description, model_identifier
from flexura.io.linear import refuse_unfit
from flexura.systems import StateSpace

_EPOCH = (1980, 1, 1, 0, 0, 0)


def write_fmu(model: StateSpace, path: str | Path, binary: bool = True) -> Path:
    """Write an FMU with its C sources and, unless `binary` is false, a shared library for this machine.

    Inputs and outputs are variables by the names and with the units of the channels, the states local ones; see
    `signal_names` for names that occur twice. In co-simulation inputs are held over a step, and the step is exact
    (theory eqs. X1-X3): one exponential per diagonal block of A, worked out again only when the step size changes. The
    same model makes the same file, byte for byte, with the same compiler.
    Raises OptionError for discrete models, models with dead time, names that clash, a missing C compiler, and a file
    that cannot be written.
    """
    refuse_unfit(model)
    identifier = model_identifier(model.name)
    contents = fmu_contents(model)
    if binary:
        place = binary_place(identifier)
        contents[place] = shared_library({k.split("/")[1]: v.decode() for k, v in contents.items() if "/" in k})
    return write_file(path, lambda file: _zip(file, contents))


def fmu_contents(model: StateSpace) -> dict[str, bytes]:
    """The files of an FMU without binaries, by their paths in it.

    The GUID is a digest of the model: it changes when a number, a name or a unit does.
    """
    digest = hashlib.sha256("".join([description(model, "", SOURCES), *c_sources(model, "").values()]).encode())
    guid = f"{{{uuid.UUID(bytes=digest.digest()[:16], version=5)}}}"
    sources = c_sources(model, guid)
    text = {"modelDescription.xml": description(model, guid, SOURCES)}
    text |= {f"sources/{name}": content for name, content in sources.items()}
    return {name: content.encode() for name, content in text.items()}


def _zip(file: Path, contents: dict[str, bytes]) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, content)
