"""What the public verbs say of arguments of a wrong type, and of numbers that double precision cannot hold.

A call that succeeds costs nothing: types are held against the signature where a call has failed in Python's own words.
"""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from flexura.errors import FlexuraError, OptionError, SolverError

P = ParamSpec("P")
R = TypeVar("R")

_OF_PROGRAMS = (AttributeError, TypeError, LookupError, ValueError, OSError, AssertionError)


def verb(function: Callable[P, R]) -> Callable[P, R]:
    """A public function whose errors are FlexuraErrors: OptionError with the name of an argument of a wrong type.

    SolverError where numbers lie too far apart for double precision. Errors that neither explains stay as they are.
    """

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return function(*args, **kwargs)
        except FlexuraError:
            raise
        except (FloatingPointError, OverflowError, np.linalg.LinAlgError) as error:
            raise SolverError(f"{function.__name__}: numbers too far apart for double precision: {error}") from error
        except _OF_PROGRAMS as error:
            wrong = _wrong(function, args, kwargs)
            if wrong:
                raise OptionError(wrong) from error
            raise

    return call


def _wrong(function: Callable[..., Any], args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> str:
    """The first argument that does not fit the signature, in words; nothing where all may fit."""
    try:
        bound = inspect.signature(function).bind(*args, **kwargs)
    except TypeError:
        return ""  # arguments that are missing or unknown: Python's words name them
    for name, value in bound.arguments.items():
        if bound.signature.parameters[name].kind in (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD):
            continue
        text = str(function.__annotations__.get(name, "Any"))
        if not _fits(value, _hint(text, function)):
            shown = repr(value)
            shown = shown if len(shown) <= 60 else f"{shown[:57]}..."
            expected = text.replace(" | ", " or ")
            return f"{function.__name__}: `{name}` is {expected}, not {type(value).__name__} ({shown})"
    return ""


def _hint(text: str, function: Callable[..., Any]) -> Any:
    """The type that an annotation stands for; Any where that cannot be told."""
    if "ArrayLike" in text and "Mapping" not in text:
        return _Numbers | None if "None" in text else _Numbers
    holder: Any = types.SimpleNamespace(__annotations__={"it": text})
    known = getattr(function, "__globals__", {})
    try:
        return typing.get_type_hints(holder, known)["it"]
    except (NameError, TypeError, AttributeError, SyntaxError):
        return Any


class _Numbers:
    """Stands for what NumPy makes an array of numbers of."""


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value may be of a type; True where that cannot be told."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if hint is Any:
        return True
    if hint is None or hint is type(None):
        return value is None
    if origin in (typing.Union, types.UnionType):
        return any(_fits(value, one) for one in inner)
    if origin is typing.Literal:
        return value in inner if isinstance(value, str | int) else False
    if hint is _Numbers:
        return _is_numbers(value)
    if hint is float:
        return isinstance(value, int | float | np.number)
    if hint is int:
        return isinstance(value, int | np.integer)
    if isinstance(origin, type):
        fits = isinstance(value, origin) and not (isinstance(value, str) and issubclass(origin, Sequence))
        if fits and issubclass(origin, Sequence) and inner and origin is not tuple:
            return all(_fits(one, inner[0]) for one in value)
        return fits
    if isinstance(hint, type) and not getattr(hint, "_is_protocol", False):
        return isinstance(value, hint) or (hint is Path and isinstance(value, str))
    return True


def _is_numbers(value: Any) -> bool:
    try:
        return value is not None and np.asarray(value, dtype=complex).dtype.kind == "c"
    except (TypeError, ValueError):
        return False
