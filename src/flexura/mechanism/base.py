"""What every part of a description shares: frozen, exact about its keys, errors as ModelError."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, ValidationError
from pydantic_core import PydanticCustomError

from flexura.errors import ModelError, Problem
from flexura.mechanism.quantity import Length, Number, Scalar

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

if TYPE_CHECKING:
    _Meta = type(BaseModel)
else:

    class _Meta(type(BaseModel)):
        """Lets `Part(...)` in Python raise ModelError, and leaves nested validation to collect its errors."""

        def __call__(cls, *args: Any, **kwargs: Any) -> Any:
            try:
                return super().__call__(*args, **kwargs)
            except ValidationError as error:
                raise ModelError(problem_of(details) for details in error.errors(include_url=False)) from None


class Part(BaseModel, metaclass=_Meta):
    """Base of every part of a description."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True, use_attribute_docstrings=True)


def problem_of(details: ErrorDetails) -> Problem:
    """Translate one pydantic error into a Problem, in the words of a model file."""
    path = tuple(key for key in details["loc"] if not (isinstance(key, str) and key.startswith(_TAGS)))
    kind, context = details["type"], details.get("ctx", {})
    value = "" if kind == "missing" else _shorten(details["input"])
    rule, hint = details["msg"], str(context.get("hint", ""))
    if kind == "extra_forbidden":
        rule, value = "unknown key", ""
    elif kind == "missing":
        rule = "required, but missing"
    elif kind == "union_tag_not_found":
        rule, hint = f"needs a key {context.get('discriminator')} that says which kind it is", ""
    elif kind == "union_tag_invalid":
        rule = f"{context.get('discriminator')} is one of {context.get('expected_tags')}"
    elif kind in ("model_type", "model_attributes_type", "dict_type"):
        rule = "a mapping of keys to values is expected here"
    elif kind in ("tuple_type", "list_type"):
        rule = "a list is expected here"
    return Problem(path=path, value=value, rule=rule, hint=hint)


_TAGS = ("tag:", "function-", "tuple[", "nullable", "union[", "lax-or-strict")


def _shorten(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def refuse(rule: str, hint: str = "") -> PydanticCustomError:
    """Make the error that a validator of a part raises."""
    return PydanticCustomError("rule", "{rule}", {"rule": rule, "hint": hint})


_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def _axis_name(raw: Any) -> Any:
    if isinstance(raw, str):
        sign, name = (-1.0, raw[1:]) if raw[:1] == "-" else (1.0, raw.removeprefix("+"))
        if name not in _AXES:
            raise refuse("a direction is x, y, z, -x, -y, -z or a list of three numbers")
        return tuple(sign * c + 0.0 for c in _AXES[name])
    return raw


def _not_null(direction: tuple[Scalar, ...]) -> tuple[Scalar, ...]:
    if all(component == 0 for component in direction):
        raise refuse("a direction has at least one component that is not zero")
    return direction


def _valid_name(name: str) -> str:
    if not name.isidentifier():
        raise refuse(
            "a name starts with a letter and holds letters, digits and _",
            "dots and brackets are kept for paths such as branch1.top",
        )
    return name


Name = Annotated[str, AfterValidator(_valid_name)]
"""A name that the user gives to a part."""
Vector = tuple[Length, Length, Length]
"""A position or an arm, m."""
Direction = Annotated[tuple[Number, Number, Number], BeforeValidator(_axis_name), AfterValidator(_not_null)]
"""A direction; its length does not matter. In a file also `x`, `-z` and so on."""
ORIGIN: Vector = (0.0, 0.0, 0.0)
