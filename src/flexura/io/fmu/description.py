"""modelDescription.xml of a unit, for FMI 2.0 and FMI 3.0, and how FMI 3.0 says what to compile."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from flexura._version import __version__
from flexura.io.fmu.unit import Unit
from flexura.io.fmu.variables import Dependency, Variable, Variables

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
    "kg": {"kg": 1},
    "s": {"s": 1},
    "Pa": {"kg": 1, "m": -1, "s": -2},
}
"""Exponents of SI base units, by the units of channels."""

DISPLAY_UNITS = {"m": {"mm": 1e3, "um": 1e6}, "rad": {"mrad": 1e3, "urad": 1e6}}

_IDENTIFIER = r"[A-Za-z_]\w*(?:\[\d+\])?"
_STRUCTURED = re.compile(rf"{_IDENTIFIER}(?:\.{_IDENTIFIER})*", re.ASCII)


LOGS = ("logStatusWarning", "logStatusDiscard", "logStatusError")
"""The categories of what is logged."""


def model_identifier(name: str) -> str:
    """A name as a C identifier: that of the shared library."""
    text = re.sub(r"\W", "_", name, flags=re.ASCII)
    return text if re.match(r"[A-Za-z_]", text) else f"m_{text}"


def description(model: Unit, token: str, version: int) -> str:
    """The text of modelDescription.xml."""
    found = model.variables
    structured = all(_STRUCTURED.fullmatch(v.name) for v in found.variables if v.derivative_of is None)
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{version}.0",
            "modelName": model.name,
            "guid" if version == 2 else "instantiationToken": token,
            "description": "; ".join(model.notes) or "model of a compliant mechanism, SI units",
            "generationTool": f"flexura {__version__}",
            "variableNamingConvention": "structured" if structured else "flat",
            **({"numberOfEventIndicators": str(len(found.indicators))} if version == 2 else {}),
        },
    )
    _kinds(root, model, version)
    _units(root, found.variables)
    categories = ET.SubElement(root, "LogCategories")
    for name in LOGS:
        ET.SubElement(categories, "Category", name=name)
    if model.experiment is not None:
        stop, step = map(repr, model.experiment)
        ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime=stop, stepSize=step)
    parent = ET.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(found.variables if version == 2 else (*found.variables, *found.clocked)):
        if version == 2:
            _variable2(parent, reference, variable)
        else:
            _variable3(parent, reference, variable, found.clock)
    structure = ET.SubElement(root, "ModelStructure")
    (_structure2 if version == 2 else _structure3)(structure, found)
    return _text(root)


def build_description(model: Unit) -> str:
    """The text of sources/buildDescription.xml of FMI 3.0."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=model_identifier(model.name))
    files = ET.SubElement(build, "SourceFileSet", language="C99")
    for name in model.compiled(3):
        ET.SubElement(files, "SourceFile", name=name)
    return _text(root)


def _text(root: ET.Element) -> str:
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _kinds(root: ET.Element, model: Unit, version: int) -> None:
    """Model exchange, which models in steps are for where a clock drives them, in FMI 3, and co-simulation."""
    both = {"modelIdentifier": model_identifier(model.name)}
    state, derivative = ("FMUstate", "Derivative") if version == 2 else ("FMUState", "Derivatives")
    can = [f"canGetAndSet{state}", f"canSerialize{state}", f"providesDirectional{derivative}"]
    can += ["canNotUseMemoryManagementFunctions"] if version == 2 else []
    both |= dict.fromkeys(can, "true")
    steps = {} if version == 2 and model.dt is not None else {"canHandleVariableCommunicationStepSize": "true"}
    if version == 3 and model.dt is not None:
        steps |= {"fixedInternalStepSize": repr(float(model.dt)), "hasEventMode": "true"}
    exchange = dict(both)
    if version == 3 and model.variables.indicators:
        steps["mightReturnEarlyFromDoStep"] = exchange["needsCompletedIntegratorStep"] = "true"
    kinds = {} if version == 2 and model.dt is not None else {"ModelExchange": exchange}
    for kind, attributes in {**kinds, "CoSimulation": {**both, **steps}}.items():
        element = ET.SubElement(root, kind, attributes)
        if version == 2:
            files = ET.SubElement(element, "SourceFiles")
            for name in model.compiled(version):
                ET.SubElement(files, "File", name=name)


def _units(root: ET.Element, variables: Sequence[Variable]) -> None:
    used = {v.unit for v in variables}
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in [unit for unit in BASE_UNITS if unit in used]:
        unit = ET.SubElement(definitions, "Unit", name=name)
        ET.SubElement(unit, "BaseUnit", {base: str(k) for base, k in BASE_UNITS[name].items()})
        for shown, factor in DISPLAY_UNITS.get(name, {}).items():
            ET.SubElement(unit, "DisplayUnit", name=shown, factor=repr(factor))


def _numbers(variable: Variable) -> dict[str, str]:
    """Attributes of the type of a variable, but for what it is the derivative of."""
    named = {"unit": variable.unit, "start": variable.start, "nominal": variable.nominal, "min": variable.minimum}
    return {key: str(value) for key, value in named.items() if value is not None}


def _variable2(parent: ET.Element, reference: int, variable: Variable) -> None:
    own = {"name": variable.name, "valueReference": str(reference), "causality": variable.causality}
    own |= {"variability": variable.variability} | ({"initial": variable.initial} if variable.initial else {})
    of = {} if variable.derivative_of is None else {"derivative": str(variable.derivative_of + 1)}
    ET.SubElement(ET.SubElement(parent, "ScalarVariable", own), "Real", _numbers(variable) | of)


def _variable3(parent: ET.Element, reference: int, variable: Variable, clock: int | None) -> None:
    own = {"name": variable.name, "valueReference": str(reference), "causality": variable.causality}
    own |= {"variability": variable.variability} | ({"initial": variable.initial} if variable.initial else {})
    if variable.interval is not None:
        every = {"intervalVariability": "constant", "intervalDecimal": repr(float(variable.interval))}
        ET.SubElement(parent, "Clock", own | every)
        return
    of = {"derivative": variable.derivative_of, "previous": variable.previous}
    if clock is not None and (variable.causality in ("input", "output") or variable.previous is not None):
        of["clocks"] = clock
    own |= _numbers(variable) | {key: str(value) for key, value in of.items() if value is not None}
    ET.SubElement(parent, "Float64", own)


def _initial(unknowns: dict[int, list[Dependency]]) -> dict[int, list[Dependency]]:
    """Before the start tunable factors are not known yet."""
    kinds = {"tunable": "dependent"}
    return {k: [Dependency(d.reference, kinds.get(d.kind, d.kind)) for d in own] for k, own in unknowns.items()}


def _structure2(parent: ET.Element, found: Variables) -> None:
    """Outputs and derivatives with what they depend on, numbered from 1; parameters count at the start alone."""

    def running(unknowns: dict[int, list[Dependency]]) -> dict[int, list[Dependency]]:
        return {k: [d for d in own if d.reference < found.parameters] for k, own in unknowns.items()}

    rates = {} if found.clocked else found.rates
    groups = {"Outputs": running(found.outputs), "Derivatives": running(rates)}
    groups["InitialUnknowns"] = _initial({**found.outputs, **rates})
    for group, unknowns in groups.items():
        element = ET.SubElement(parent, group) if unknowns else parent
        for index, own in unknowns.items():
            ET.SubElement(element, "Unknown", {"index": str(index + 1), **_depends(own, 1)})


def _structure3(parent: ET.Element, found: Variables) -> None:
    """Outputs and derivatives, or next states, with what they depend on, by value references; clocked ones depend on
    their clock, and are known from its first tick on."""
    groups = {"Output": found.outputs, "ContinuousStateDerivative": found.rates}
    groups["InitialUnknown"] = _initial({**found.outputs, **found.rates})
    if found.clock is not None:
        tick = Dependency(found.clock, "dependent")
        groups = {"Output": found.outputs, "ClockedState": found.rates}
        groups = {group: {k: [*own, tick] for k, own in of.items()} for group, of in groups.items()}
    for group, unknowns in groups.items():
        for reference, own in unknowns.items():
            ET.SubElement(parent, group, {"valueReference": str(reference), **_depends(own, 0)})
    for reference in found.indicators:
        ET.SubElement(parent, "EventIndicator", valueReference=str(reference))


def _depends(own: list[Dependency], first: int) -> dict[str, str]:
    kinds = " ".join(d.kind for d in own)
    return {"dependencies": " ".join(str(d.reference + first) for d in own), "dependenciesKind": kinds}
