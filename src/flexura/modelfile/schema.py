"""The JSON Schema of model files, for editors."""

from __future__ import annotations

from typing import Any

from flexura.mechanism import Mechanism
from flexura.modelfile.reader import VERSION

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_AXIS = {"enum": ["x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z"]}
_DIRECTIONS = {
    "Rotation": ("axis",),
    "CircularPattern": ("axis",),
    "MirrorPattern": ("normal",),
    "Cylinder": ("axis",),
    "Link": ("reference",),
    "Flexure": ("reference",),
    "ForceActuator": ("direction",),
    "MomentActuator": ("direction",),
    "BaseMotion": ("direction",),
    "BaseRotation": ("direction",),
    "MotionSensor": ("direction",),
    "HammerPoint": ("direction",),
    "Accelerometer": ("direction",),
}
_SHORTHAND = {"anyOf": [{"type": "string"}, {"type": "number"}]}


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a model file: the description, and the shorthand that files allow."""
    result = Mechanism.model_json_schema()
    parts = result["$defs"]
    for part, keys in _DIRECTIONS.items():
        for key in keys:
            _also(parts[part]["properties"], key, _AXIS)
    for key in ("rotate", "pattern"):
        _also(parts["Instance"]["properties"], key, parts["Instance"]["properties"][key]["items"])
    _also(result["properties"], "gravity", _AXIS)
    for key, own in parts["Moved"]["properties"].items():
        _also(parts["Moved"]["properties"], key, next(a for a in own["anyOf"] if a.get("type") == "array")["items"])
    superelement = parts["Superelement"]["properties"]
    superelement["units"] = {
        "type": "object",
        "properties": {key: {"type": "string"} for key in ("length", "mass", "time")},
        "additionalProperties": False,
        "description": "units in which the matrices are given; SI where left out",
    }
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
        own = parts[part]["properties"]
        for key in own.keys() & {"ask", "require", "subject_to"}:
            _also(own, key, own[key]["items"])
    spreads = parts["ToleranceStudy"]["properties"]["vary"]
    spreads["additionalProperties"] = {"anyOf": [{"type": "string"}, spreads["additionalProperties"]]}
    _also(parts["Spread"]["properties"], "uniform", _SHORTHAND)


def _also(properties: dict[str, Any], key: str, alternative: dict[str, Any]) -> None:
    """Let a property have another form as well."""
    old = properties[key]
    about = {name: old.pop(name) for name in ("default", "description", "title") if name in old}
    properties[key] = {"anyOf": [alternative, *old.pop("anyOf", [old])], **about}
