"""Which keys a place in a model file may have."""

from __future__ import annotations

from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from flexura.errors import Path
from flexura.mechanism import Mechanism, Parameter, Part, Superelement, key_of, suggestion

_KINDS = ("type", "shape")
FILE_ONLY: dict[type[Part], tuple[str, ...]] = {Mechanism: ("flexura", "extends"), Superelement: ("units",)}
_NOT_IN_FILES: dict[type[Part], tuple[str, ...]] = {Parameter: ("unit",)}


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
