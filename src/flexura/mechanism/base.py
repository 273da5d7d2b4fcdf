"""What every part of a description shares: frozen, exact about its keys, errors as ModelError."""

from __future__ import annotations

import ast
import inspect
import json
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from textwrap import dedent
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NoReturn, Self, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, GetJsonSchemaHandler, ValidationError
from pydantic_core import PydanticCustomError

from flexura.errors import ModelError, Path, Problem, did_you_mean
from flexura.expressions import Expression
from flexura.mechanism.quantity import Length, Number, Scalar

if TYPE_CHECKING:
    from pydantic_core import CoreSchema, ErrorDetails

if TYPE_CHECKING:
    _Meta = type(BaseModel)
else:

    class _Meta(type(BaseModel)):
        """Lets `Part(...)` in Python raise ModelError, and leaves nested validation to collect its errors."""

        def __call__(cls, *args: Any, **kwargs: Any) -> Any:
            if args:
                fields = ", ".join(f"{name}=..." for name in cls.model_fields if name not in ("type", "shape"))
                raise ModelError([Problem((cls.__name__,), _shorten(args[0]), "takes keywords alone", fields)])
            try:
                return super().__call__(**kwargs)
            except ValidationError as error:
                raise ModelError(_of_part(cls, error, kwargs)) from None


AnyPart = TypeVar("AnyPart", bound="Part")


class Part(BaseModel, metaclass=_Meta):
    """Base of every part of a description."""

    # built when first used, and all at once: what a mechanism needs is built with it
    model_config: ClassVar[ConfigDict] = ConfigDict(
        frozen=True, extra="forbid", arbitrary_types_allowed=True, defer_build=True, populate_by_name=True
    )

    @classmethod
    def model_validate(cls, obj: Any, **how: Any) -> Self:
        """A part from keys and values. Raises ModelError listing every problem."""
        try:
            return super().model_validate(obj, **how)
        except ValidationError as error:
            raise ModelError(_of_part(cls, error, obj)) from None

    @classmethod
    def model_validate_json(cls, json_data: str | bytes | bytearray, **how: Any) -> Self:
        """A part from JSON text. Raises ModelError listing every problem."""
        try:
            return super().model_validate_json(json_data, **how)
        except ValidationError as error:
            raise ModelError(_of_part(cls, error, _plain(json_data))) from None

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> dict[str, Any]:
        """The schema with what stands below the fields in the source as their descriptions."""
        found = handler(schema)
        properties = handler.resolve_ref_schema(found).get("properties", {})
        for name, text in _described(cls).items():
            if (key := key_of(cls, name)) in properties:
                properties[key]["description"] = text
        return found

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """The same part with some values replaced, which are validated as those of a new one are.

        Raises ModelError listing every problem.
        """
        if not update:
            return super().model_copy(deep=deep)
        return type(self)(**{**{key: getattr(self, key) for key in self.model_fields_set}, **update})

    def replaced(self, update: Mapping[str, Any]) -> Self:
        """The same part with some values replaced by such as are known to be valid."""
        return super().model_copy(update=update)

    def __setattr__(self, name: str, value: Any) -> None:
        self._refuse_change(name)

    def __delattr__(self, name: str) -> None:
        self._refuse_change(name)

    def _refuse_change(self, name: str) -> NoReturn:
        hint = f"a changed copy: part.model_copy(update={{{name!r}: ...}})"
        raise ModelError([Problem((type(self).__name__, name), "", "a description does not change", hint)])


def key_of(kind: type[Part], field: str) -> str:
    """The key by which a file calls a field: that of `from_` is `from`, which is a word of Python."""
    return kind.model_fields[field].alias or field if field in kind.model_fields else field


def entry_of(part: Part, key: str) -> Any:
    """What a part has at a key. Raises AttributeError where there is no such key."""
    fields = {key_of(type(part), field): field for field in type(part).model_fields}
    return getattr(part, fields.get(key, key))


def _described(kind: type[Part]) -> dict[str, str]:
    """The strings below the fields of a part and of what it is made from, by name of the field."""
    found: dict[str, str] = {}
    for base in reversed([parent for parent in kind.__mro__ if issubclass(parent, Part)]):
        (tree,) = ast.parse(dedent(inspect.getsource(base))).body
        body = tree.body if isinstance(tree, ast.ClassDef) else []
        for field, after in pairwise(body):
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(after, ast.Expr):
                text = after.value.value if isinstance(after.value, ast.Constant) else None
                if isinstance(text, str):
                    found[field.target.id] = inspect.cleandoc(text)
    return found


def validated(kind: type[AnyPart], data: Any, context: Any = None) -> AnyPart:
    """A part from keys and values. Raises pydantic's ValidationError, which `problems_of` translates."""
    return kind.__pydantic_validator__.validate_python(data, context=context)


def _plain(text: str | bytes | bytearray) -> Any:
    """The data of JSON text as far as it can be read."""
    with suppress(ValueError):
        return json.loads(text)
    return {}


def _of_part(kind: type[Part], error: ValidationError, data: Any) -> list[Problem]:
    """Problems of one part made in Python: those of the part as a whole are called by its kind."""
    found = []
    for problem in problems_of(error, data):
        path, hint = problem.path, problem.hint
        if problem.rule == UNKNOWN_KEY and len(path) == 1:
            allowed = f"allowed: {', '.join(kind.model_fields)}"
            hint = did_you_mean(str(path[0]), kind.model_fields, allowed, quoted=False)
        whole = not path and kind.__name__ != "Mechanism"
        found.append(replace(problem, path=(kind.__name__,) if whole else path, hint=hint))
    return found


def problems_of(error: ValidationError, data: Any) -> list[Problem]:
    """Translate pydantic's errors about `data` into Problems, without the noise of unions and repetitions."""
    errors = error.errors(include_url=False)
    locations = {details["loc"] for details in errors}
    problems: dict[Problem, None] = {}
    missing: dict[Path, int] = {}
    for details in errors:
        where, kind = details["loc"], details["type"]
        in_union = any(isinstance(key, str) and key.startswith("tuple[") for key in where)
        if kind == "string_type" and where[-1:] == ("str",):
            if any(other[: len(where) - 1] == where[:-1] and other != where for other in locations):
                continue
        elif in_union and (kind == "too_long" or (kind == "missing" and isinstance(where[-1], int))):
            continue
        elif kind == "missing" and isinstance(where[-1], int):
            missing[where[:-1]] = max(where[-1] + 1, missing.get(where[:-1], 0))
            continue
        problems[problem_of(details, data)] = None
    for where, count in missing.items():
        problems[Problem(path_in(data, where), "", f"a list of {count} entries is expected here")] = None
    return list(problems)


def problem_of(details: ErrorDetails, data: Any) -> Problem:
    """Translate one of pydantic's errors about `data`."""
    kind, context = details["type"], details.get("ctx", {})
    path = path_in(data, details["loc"], missing=kind == "missing")
    value = "" if kind in ("missing", "extra_forbidden") else _shorten(context.get("tag", details["input"]))
    template = _RULES.get(kind)
    fields = {**context, "discriminator": str(context.get("discriminator", "")).strip("'")}
    rule = details["msg"] if template is None else template.format_map(fields)
    return Problem(path=path, value=value, rule=rule, hint=str(context.get("hint", "")))


UNKNOWN_KEY = "unknown key"
_RULES = {
    "rule": "{rule}",
    "quantity": "{rule}",
    "extra_forbidden": UNKNOWN_KEY,
    "missing": "required, but missing",
    "union_tag_not_found": "needs a key {discriminator} that says which kind it is",
    "union_tag_invalid": "{discriminator} is one of {expected_tags}",
    "model_type": "a mapping of keys to values is expected here",
    "model_attributes_type": "a mapping of keys to values is expected here",
    "dict_type": "a mapping of keys to values is expected here",
    "tuple_type": "a list is expected here",
    "list_type": "a list is expected here",
    "too_long": "a list of at most {max_length} entries is expected here",
    "too_short": "a list of at least {min_length} entries is expected here",
    "string_type": "text is expected here",
    "string_too_short": "text is expected here",
    "string_too_long": "text of at most {max_length} characters is expected here",
    "float_type": "a number is expected here",
    "finite_number": "a finite number is expected here",
    "int_type": "a whole number is expected here",
    "int_from_float": "a whole number is expected here",
    "greater_than_equal": "at least {ge} is expected here",
    "less_than_equal": "at most {le:g} is expected here",
    "literal_error": "one of {expected} is expected here",
}
"""What to say of pydantic's errors, with the fields of their context."""


def path_in(data: Any, location: Path, missing: bool = False) -> Path:
    """The keys of pydantic's location that occur in the data: it also names the kinds of a union.

    With `missing`, the last key is one that the data lack.
    """
    path: list[str | int] = []
    for key in location[:-1] if missing else location:
        if isinstance(data, str):
            continue
        try:
            data = entry_of(data, str(key)) if isinstance(data, Part) else data[key]
        except (KeyError, IndexError, TypeError, AttributeError):
            continue
        path.append(key)
    return (*path, location[-1]) if missing else tuple(path)


def _shorten(value: Any) -> str:
    if isinstance(value, dict):
        return ""
    text = str(value) if isinstance(value, Expression) else repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def refuse(rule: str, hint: str = "") -> PydanticCustomError:
    """Make the error that a validator of a part raises."""
    return PydanticCustomError("rule", "{rule}", {"rule": rule, "hint": hint})


_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def axis_direction(text: str) -> tuple[float, float, float]:
    """Unit vector of `x`, `-z` and so on; refuses other text as validators of parts do."""
    sign, name = (-1.0, text[1:]) if text[:1] == "-" else (1.0, text.removeprefix("+"))
    if name not in _AXES:
        raise refuse("a direction is x, y, z, -x, -y, -z or a list of three numbers")
    x, y, z = (sign * c + 0.0 for c in _AXES[name])
    return x, y, z


def _axis_name(raw: Any) -> Any:
    return axis_direction(raw) if isinstance(raw, str) else raw


def _not_null(direction: tuple[Scalar, ...]) -> tuple[Scalar, ...]:
    if all(component == 0 for component in direction):
        raise refuse("all components are zero: a direction has at least one component that is not zero")
    return direction


CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")
"""Characters that XML 1.0 forbids: null and the like."""

LONGEST_NAME = 60
"""Characters of a name, which becomes part of names of files and of channels."""

LONGEST_TITLE = 300
"""Characters of a title."""


def _valid_name(name: str) -> str:
    if len(name) > LONGEST_NAME:
        raise refuse(f"a name has at most {LONGEST_NAME} characters, this one has {len(name)}")
    if not name.isidentifier():
        raise refuse(
            "a name starts with a letter and holds letters, digits and _",
            "dots and brackets are kept for paths such as branch1.top",
        )
    return name


def _valid_title(title: str) -> str:
    if len(title) > LONGEST_TITLE:
        raise refuse(f"a title has at most {LONGEST_TITLE} characters, this one has {len(title)}", "see `description`")
    return _valid_text(title)


def _valid_text(text: str) -> str:
    if CONTROL.search(text) or any("\ud800" <= c <= "\udfff" for c in text):
        raise refuse("text holds a control character or half of a surrogate pair", "remove it")
    return text


Title = Annotated[str, AfterValidator(_valid_title)]
"""What something is called in pictures, tables and files."""
Text = Annotated[str, AfterValidator(_valid_text)]
"""Text of any length."""
Name = Annotated[str, AfterValidator(_valid_name)]
"""A name that the user gives to a part."""
Vector = tuple[Length, Length, Length]
"""A position or an arm, m."""
Direction = Annotated[tuple[Number, Number, Number], BeforeValidator(_axis_name), AfterValidator(_not_null)]
"""A direction; its length does not matter. In a file also `x`, `-z` and so on."""
ORIGIN: Vector = (0.0, 0.0, 0.0)
