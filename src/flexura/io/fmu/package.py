"""Functional mock-up units: FMI 2.0, co-simulation and model exchange, of a continuous linear model.

modelDescription.xml of a linear model (FMI 2.0: co-simulation and model exchange).
"""

from __future__ import annotations

import hashlib
import re
import uuid
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from flexura._version import __version__
from flexura.files import write_file
from flexura.io.contents import Names, notes_of, signal_names
from flexura.io.fmu.code import (
    SOURCES,
    Array,
    binary_place,
    blocks_of,
    c_sources,
    nominals,
    pole_sizes,
    refuse_unfit,
    shared_library,
)
from flexura.structure import UNITS
from flexura.systems import StateSpace

BASE_UNITS: dict[str, dict[str, int]] = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "N*m": {"kg": 1, "m": 2, "s": -2},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s^2": {"m": 1, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "K": {"K": 1},
    "1": {},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s^2": {"rad": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
}
"""Exponents of SI base units, by the units of channels."""

DISPLAY_UNITS = {"m": {"mm": 1e3, "um": 1e6}, "rad": {"mrad": 1e3, "urad": 1e6}}

_IDENTIFIER = r"[A-Za-z_]\w*(?:\[\d+\])?"
_STRUCTURED = re.compile(rf"{_IDENTIFIER}(?:\.{_IDENTIFIER})*", re.ASCII)


def model_identifier(name: str) -> str:
    """A name as a C identifier: that of the shared library."""
    text = re.sub(r"\W", "_", name, flags=re.ASCII)
    return text if re.match(r"[A-Za-z_]", text) else f"m_{text}"


def description(model: StateSpace, guid: str, sources: Iterable[str]) -> str:
    """The text of modelDescription.xml.

    Value references number the inputs, the outputs, the states and their derivatives. Raises OptionError for names that
    clash.
    """
    names = signal_names(model)
    everything = [*names.inputs, *names.outputs, *names.states]
    structured = all(_STRUCTURED.fullmatch(name) for name in everything)
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.name,
        guid=guid,
        description="; ".join(notes_of(model)) or "linear model of a compliant mechanism, SI units",
        generationTool=f"flexura {__version__}",
        variableNamingConvention="structured" if structured else "flat",
        numberOfEventIndicators="0",
    )
    identifier = model_identifier(model.name)
    _kind(root, "ModelExchange", identifier, sources, {})
    _kind(root, "CoSimulation", identifier, sources, {"canHandleVariableCommunicationStepSize": "true"})
    _units(root, model)
    _experiment(root, model)
    _variables(ET.SubElement(root, "ModelVariables"), model, names)
    _structure(ET.SubElement(root, "ModelStructure"), model)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _kind(root: ET.Element, kind: str, identifier: str, sources: Iterable[str], more: dict[str, str]) -> None:
    can = ("canNotUseMemoryManagementFunctions", "canGetAndSetFMUstate", "canSerializeFMUstate")
    element = ET.SubElement(
        root,
        kind,
        {"modelIdentifier": identifier, **dict.fromkeys((*can, "providesDirectionalDerivative"), "true"), **more},
    )
    files = ET.SubElement(element, "SourceFiles")
    for name in sources:
        ET.SubElement(files, "File", name=name)


def _units(root: ET.Element, model: StateSpace) -> None:
    used = {channel.unit for channel in (*model.inputs, *model.outputs)}
    if not used:
        return
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in [unit for unit in dict.fromkeys(UNITS.values()) if unit in used]:
        unit = ET.SubElement(definitions, "Unit", name=name)
        ET.SubElement(unit, "BaseUnit", {base: str(k) for base, k in BASE_UNITS[name].items()})
        for shown, factor in DISPLAY_UNITS.get(name, {}).items():
            ET.SubElement(unit, "DisplayUnit", name=shown, factor=repr(factor))


def _experiment(root: ET.Element, model: StateSpace) -> None:
    """Ten periods of the slowest motion, in steps of a twentieth of that of the fastest."""
    speed = pole_sizes(model.A, blocks_of(model.A))
    speed = speed[speed > 0]
    if len(speed):
        stop, step = (float(f"{2 * np.pi * k:.1e}") for k in (10 / speed.min(), 0.05 / speed.max()))
        ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime=repr(stop), stepSize=repr(step))


def _variables(parent: ET.Element, model: StateSpace, names: Names) -> None:
    n, m, p = model.order, len(model.inputs), len(model.outputs)
    x, y = nominals(model, blocks_of(model.A))

    def add(name: str, reference: int, causality: str, initial: str | None, real: dict[str, Any]) -> None:
        attributes = {
            "name": name,
            "valueReference": str(reference),
            "causality": causality,
            "variability": "continuous",
        }
        scalar = ET.SubElement(
            parent, "ScalarVariable", attributes if initial is None else {**attributes, "initial": initial}
        )
        ET.SubElement(scalar, "Real", {key: str(value) for key, value in real.items()})

    for k, (name, channel) in enumerate(zip(names.inputs, model.inputs, strict=True)):
        add(name, k, "input", None, {"unit": channel.unit, "start": 0.0})
    for k, (name, channel) in enumerate(zip(names.outputs, model.outputs, strict=True)):
        add(name, m + k, "output", "calculated", {"unit": channel.unit, "nominal": y[k]})
    for k, name in enumerate(names.states):
        add(name, m + p + k, "local", "exact", {"start": 0.0, "nominal": x[k]})
    for k, name in enumerate(names.states):
        add(f"der({name})", m + p + n + k, "local", "calculated", {"derivative": m + p + k + 1})


def _structure(parent: ET.Element, model: StateSpace) -> None:
    """Outputs and derivatives with the states and inputs that they depend on, numbered from 1."""
    m, p, n = len(model.inputs), len(model.outputs), model.order
    outputs = [(m + i + 1, _dependencies(model.C[i], model.D[i], m, p)) for i in range(p)]
    derivatives = [(m + p + n + i + 1, _dependencies(model.A[i], model.B[i], m, p)) for i in range(n)]
    groups = (("Outputs", outputs), ("Derivatives", derivatives), ("InitialUnknowns", [*outputs, *derivatives]))
    for group, unknowns in groups:
        if unknowns:
            element = ET.SubElement(parent, group)
            for index, dependencies in unknowns:
                kinds = " ".join(["constant"] * len(dependencies))
                text = " ".join(map(str, dependencies))
                ET.SubElement(element, "Unknown", index=str(index), dependencies=text, dependenciesKind=kinds)


def _dependencies(of_states: Array, of_inputs: Array, m: int, p: int) -> list[int]:
    return [*(np.flatnonzero(of_inputs) + 1).tolist(), *(np.flatnonzero(of_states) + m + p + 1).tolist()]


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
