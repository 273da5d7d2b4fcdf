"""Which keys a model file may have: its JSON Schema, for editors, and what stands in place of an unknown key."""

from __future__ import annotations

from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from flexura.errors import Path
from flexura.mechanism import (
    Composite,
    Disturbance,
    Mechanism,
    Parameter,
    Part,
    Superelement,
    key_of,
    suggestion,
)
from flexura.modelfile.document import VERSION

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_AXIS = {"enum": ["x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z"]}
_DIRECTIONS = {
    "Rotation": ("axis",),
    "CircularPattern": ("axis",),
    "MirrorPattern": ("normal",),
    "Cylinder": ("axis",),
    "CylinderPiece": ("axis",),
    "Link": ("reference",),
    "Flexure": ("reference",),
    "Diaphragm": ("normal", "reference"),
    "FlatSpring": ("normal", "reference"),
    "Stop": ("direction",),
    "Sheet": ("normal",),
    "Interface": ("normal",),
    "ForceActuator": ("direction",),
    "MomentActuator": ("direction",),
    "BaseMotion": ("direction",),
    "BaseRotation": ("direction",),
    "MotionSensor": ("direction",),
    "HammerPoint": ("direction",),
    "Accelerometer": ("direction",),
    "Disturbance": ("base",),
}
_SHORTHAND = {"anyOf": [{"type": "string"}, {"type": "number"}]}


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a model file: the description, and the shorthand that files allow."""
    result = Mechanism.model_json_schema()
    parts = result["$defs"]
    for part, keys in _DIRECTIONS.items():
        for key in keys:
            _also(parts[part]["properties"], key, _AXIS)
    for part in ("Instance", "SolidPart"):
        for key in ("rotate", "pattern"):
            _also(parts[part]["properties"], key, parts[part]["properties"][key]["items"])
    _also(result["properties"], "gravity", _AXIS)
    for key, axis in parts["Moved"]["properties"].items():
        _also(parts["Moved"]["properties"], key, next(a for a in axis["anyOf"] if a.get("type") == "array")["items"])
    superelement = parts["Superelement"]["properties"]
    superelement["units"] = {
        "type": "object",
        "properties": {key: {"type": "string"} for key in ("length", "mass", "time")},
        "additionalProperties": False,
        "description": "units in which the matrices are given; SI where left out",
    }
    disturbance = parts["Disturbance"]["properties"]
    parts["Density"] = {"type": "string"}
    parts["DensityTable"] = {"type": "array", "items": {"type": "array", "items": {"type": "string"}}}
    parts["GainValue"] = {"anyOf": [*_SHORTHAND["anyOf"], parts["GainValue"]]}
    disturbance["file"] = {"type": "string", "description": "CSV file of the table, with units in its headings"}
    del parts["Parameter"]["properties"]["unit"]
    _short_studies(parts)
    parts["Damping"] = {"anyOf": [*_SHORTHAND["anyOf"], parts["Damping"]]}
    parts["Support"] = {"anyOf": [{"const": "clamped"}, parts["Support"]]}
    parameters = result["properties"]["parameters"]
    parameters["additionalProperties"] = {"anyOf": [*_SHORTHAND["anyOf"], parameters["additionalProperties"]]}
    result["properties"]["flexura"] = {"const": VERSION, "description": "version of the file format"}
    for holder in (result, parts["Substructure"]):
        for entry in holder["properties"].values():
            if isinstance(entry.get("additionalProperties"), dict):
                entry["additionalProperties"] = {"anyOf": [{"type": "null"}, entry["additionalProperties"]]}
    about = "model file that this one is laid over: mappings are joined, null takes an entry out"
    result["properties"]["extends"] = {"type": "string", "description": about}
    return {"$schema": _DIALECT, **result, "title": "flexura model file"}


def _short_studies(parts: dict[str, Any]) -> None:
    """Let one question stand for a list of them, and text for a spread."""
    for part in ("SweepStudy", "OptimumStudy", "ToleranceStudy"):
        properties = parts[part]["properties"]
        for key in properties.keys() & {"ask", "require", "subject_to"}:
            _also(properties, key, properties[key]["items"])
    spreads = parts["ToleranceStudy"]["properties"]["vary"]
    spreads["additionalProperties"] = {"anyOf": [{"type": "string"}, spreads["additionalProperties"]]}
    _also(parts["Spread"]["properties"], "uniform", _SHORTHAND)


def _also(properties: dict[str, Any], key: str, alternative: dict[str, Any]) -> None:
    """Let a property have another form as well."""
    old = properties[key]
    about = {name: old.pop(name) for name in ("default", "description", "title") if name in old}
    properties[key] = {"anyOf": [alternative, *old.pop("anyOf", [old])], **about}


_KINDS = ("type", "shape")
FILE_ONLY: dict[type[Part], tuple[str, ...]] = {
    Mechanism: ("flexura", "extends"),
    Superelement: ("units",),
    Disturbance: ("file",),
}
_NOT_IN_FILES: dict[type[Part], tuple[str, ...]] = {Parameter: ("unit",), Composite: ("meshed",)}


def unknown_key_hint(path: Path, data: Any) -> str:
    """What may stand instead of the last key of `path`, an unknown one; empty when that cannot be told."""
    part = _part_at(path[:-1], data)
    if part is None:
        return ""
    allowed = [key_of(part, name) for name in part.model_fields if name not in _NOT_IN_FILES.get(part, ())]
    allowed += FILE_ONLY.get(part, ())
    close = suggestion(str(path[-1]), allowed, "keys")
    listed = f"allowed: {', '.join(allowed)}"
    return f"{close} {listed}" if close.startswith("did you mean") else listed


def _part_at(path: Path, data: Any) -> type[Part] | None:
    annotation: Any = Mechanism
    for key in path:
        annotation = _inside(_chosen(annotation, data), key)
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    part = _chosen(annotation, data)
    return part if isinstance(part, type) and issubclass(part, Part) else None


def _inside(annotation: Any, key: str | int) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, Part):
        fields = {key_of(annotation, name): field for name, field in annotation.model_fields.items()}
        return fields[str(key)].annotation if str(key) in fields else None
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is dict:
        return arguments[1]
    if origin is tuple:
        return arguments[0] if arguments[-1] is Ellipsis or not isinstance(key, int) else arguments[key]
    return None


def _chosen(annotation: Any, data: Any) -> Any:
    """The alternative of a union that the data are meant for."""
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) is tuple and isinstance(data, dict):
        return _chosen(get_args(annotation)[0], data)
    if get_origin(annotation) not in (Union, UnionType):
        return annotation
    options = [_chosen(option, data) for option in get_args(annotation)]
    if not isinstance(data, dict):
        return next((o for o in options if get_origin(o) is tuple), None)
    parts = [o for o in options if isinstance(o, type) and issubclass(o, Part)]
    return next((part for part in parts if len(parts) == 1 or _is_kind(part, data)), None)


def _is_kind(part: type[Part], data: dict[str, Any]) -> bool:
    for key in _KINDS:
        field = part.model_fields.get(key)
        if field is not None and get_origin(field.annotation) is Literal:
            return data.get(key) in get_args(field.annotation)
    return False
