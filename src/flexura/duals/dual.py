"""Arrays with their slopes by parameters: forward-mode differentiation of whatever is worked out with NumPy."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexura.duals import arrays
from flexura.duals.elementwise import OF_VALUES, RULES, Pair, Rule, padded

ALL = slice(None)
_STEPS = frozenset({slice, type(None), type(Ellipsis)})


def real(x: Any) -> NDArray[np.float64]:
    """An array of floats from whatever is like one; what has NumPy's functions itself, as `Dual` does, as it is."""
    if isinstance(x, np.ndarray) or not hasattr(x, "__array_function__"):
        return np.asarray(x, dtype=np.float64)
    return x


def plain(x: Any) -> Any:
    """The values of numbers with slopes; anything else as it is."""
    while isinstance(x, Dual):
        x = x.value
    return x


def without_slopes(data: Any) -> Any:
    """Arrays, lists, tuples and dataclasses of such with values alone."""
    if isinstance(data, Dual):
        return plain(data)
    if isinstance(data, list):
        return [without_slopes(part) for part in data]
    if isinstance(data, tuple):
        own = [without_slopes(part) for part in data]
        return type(data)(*own) if hasattr(data, "_fields") else tuple(own)
    if is_dataclass(data) and not isinstance(data, type):
        return replace(data, **{f.name: without_slopes(getattr(data, f.name)) for f in fields(data)})
    return data


def moves(x: Any) -> bool:
    """Whether any slope of something is not zero."""
    return isinstance(x, Dual) and (bool(np.any(plain(x.slope))) or moves(x.slope) or moves(x.value))


def slope_of(x: Any) -> NDArray[np.float64]:
    """The slopes (P, ...) of numbers that have some."""
    return x.slope


def with_slopes_of(*sources: Any) -> Any:
    """The first of some numbers and arrays that implements NumPy's functions itself, as `Dual` does; None without."""
    return next((x for x in sources if not isinstance(x, np.ndarray) and hasattr(x, "__array_function__")), None)


def zeros(shape: tuple[int, ...], *sources: Any) -> Any:
    """Zeros, into which numbers can be put that are worked out of some others."""
    like = with_slopes_of(*sources)
    return np.zeros(shape) if like is None else np.zeros(shape, like=like)


class Dual:
    """An array (...) with its slopes (P, ...) by P parameters; NumPy's functions give results that have theirs.

    What is read of values alone (comparisons, signs, positions of the greatest) comes as plain arrays. Where a function
    has no derivative, at |0|, the root of 0 or the greater of equal numbers with other slopes, the slope is NaN; an
    entry whose slopes are zero counts as a constant. Raises TypeError where slopes would be lost: functions without a
    rule here, conversion to plain arrays or floats, assignment into plain arrays.
    """

    __slots__ = ("slope", "value")

    def __init__(self, value: Any, slope: Any) -> None:
        self.value: Any = value
        self.slope: Any = slope
        if np.shape(slope)[1:] != np.shape(value):
            raise TypeError(f"slopes {np.shape(slope)} are not those of values {np.shape(value)}")

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the value."""
        return np.shape(self.value)

    @property
    def ndim(self) -> int:
        """Number of axes of the value."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """Number of entries of the value."""
        return int(np.size(self.value))

    @property
    def T(self) -> Dual:
        """With axes in reverse order."""
        return self.transpose()

    def __len__(self) -> int:
        return len(self.value)

    def __iter__(self) -> Iterator[Dual]:
        return (self[k] for k in range(len(self)))

    def __repr__(self) -> str:
        return f"Dual({self.value!r}, slopes by {len(self.slope)} parameters)"

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError("slopes would be lost: a number with slopes does not go into a plain array")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if method == "__call__" and not options:
            if rule := RULES.get(ufunc):
                return _with_slopes(rule, inputs)
            if ufunc is np.matmul:
                return _with_slopes(arrays.matmul, inputs)
            if ufunc in OF_VALUES:
                return ufunc(*(x.value if isinstance(x, Dual) else x for x in inputs))
        if method == "reduce" and ufunc in _REDUCED:
            return _REDUCED[ufunc](*inputs, **{k: v for k, v in options.items() if k in ("axis", "keepdims")})
        if method == "at" and ufunc is np.add and isinstance(inputs[0], Dual):
            return _add_at(*inputs)
        raise TypeError(f"{ufunc.__name__} ({method}) has no rule for slopes")

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        del types
        if func in _NEW:
            return _constant(func, self, *args, **kwargs)
        if func in _FUNCTIONS:
            return _FUNCTIONS[func](*args, **kwargs)
        raise TypeError(f"{func.__name__} has no rule for slopes")

    def __getitem__(self, at: Any) -> Dual:
        if not isinstance(at, tuple):
            return _dual(self.value[at], self.slope[ALL, at])
        if _in_place(at):
            return _dual(self.value[at], self.slope[(ALL, *at)])
        return Dual(self.value[at], _last_first(_first_last(self.slope)[_open_ended(at)]))

    def __setitem__(self, at: Any, new: Any) -> None:
        at = at if isinstance(at, tuple) else (at,)
        if all(isinstance(k, slice | int) or k is Ellipsis for k in at):
            self.value[at] = new.value if isinstance(new, Dual) else new
            view = self.slope[(ALL, *at)]
            view[...] = padded(new.slope, view.ndim - 1) if isinstance(new, Dual) else 0.0
            return
        slope = _first_last(self.slope)
        if isinstance(new, Dual):
            self.value[at] = new.value
            slope[_open_ended(at)] = _first_last(new.slope)
        else:
            self.value[at] = new
            slope[_open_ended(at)] = 0.0

    def copy(self) -> Dual:
        """With memory of its own."""
        return Dual(self.value.copy(), self.slope.copy())

    def reshape(self, *shape: Any) -> Dual:
        """In another shape."""
        return Dual(*arrays.reshape(Pair(self.value, self.slope), shape[0] if len(shape) == 1 else shape))

    def ravel(self) -> Dual:
        """In a row."""
        return self.reshape(-1)

    def transpose(self, axes: tuple[int, ...] | None = None) -> Dual:
        """With axes in another order, reversed when none are given."""
        return Dual(*arrays.transpose(Pair(self.value, self.slope), axes))

    def astype(self, _: Any) -> Dual:
        """Itself: slopes are those of floats."""
        return self

    def round(self, digits: int = 0) -> Any:
        """Values rounded, a plain array."""
        return np.round(self.value, digits)

    def sum(self, axis: Any = None, keepdims: bool = False) -> Dual:
        """Sums along axes."""
        return np.sum(self, axis=axis, keepdims=keepdims)  # type: ignore[call-overload, no-any-return]

    def mean(self, axis: Any = None, keepdims: bool = False) -> Dual:
        """Means along axes."""
        return np.mean(self, axis=axis, keepdims=keepdims)  # type: ignore[call-overload, no-any-return]

    def max(self, axis: int | None = None, keepdims: bool = False) -> Dual:
        """The greatest along an axis."""
        return np.max(self, axis=axis, keepdims=keepdims)  # type: ignore[call-overload, no-any-return]

    def min(self, axis: int | None = None, keepdims: bool = False) -> Dual:
        """The smallest along an axis."""
        return np.min(self, axis=axis, keepdims=keepdims)  # type: ignore[call-overload, no-any-return]

    def any(self, axis: Any = None) -> Any:
        """Where entries are not zero or do not stay zero, a plain array."""
        return np.any((np.asarray(self.value) != 0) | (self.slope != 0).any(axis=0), axis=axis)

    def _in_place(self, changed: Dual) -> Dual:
        self[...] = changed
        return self


def _operators() -> None:
    """Give `Dual` the operators of arrays."""
    signs: dict[str, Any] = {
        "add": np.add, "sub": np.subtract, "mul": np.multiply, "truediv": np.divide, "pow": np.power,
        "matmul": np.matmul,
    }  # fmt: skip
    for name, ufunc in signs.items():
        rule: Any = arrays.matmul if ufunc is np.matmul else RULES[ufunc]
        setattr(Dual, f"__{name}__", lambda a, b, f=rule: _dual(*f(a, b if type(b) is Dual else _pair(b))))
        setattr(Dual, f"__r{name}__", lambda a, b, f=rule: _dual(*f(_pair(b), a)))
        setattr(Dual, f"__i{name}__", lambda a, b, f=rule: a._in_place(_dual(*f(a, _pair(b)))))
    for name in ("lt", "le", "gt", "ge", "eq", "ne"):
        compare = getattr(operator, name)
        setattr(Dual, f"__{name}__", lambda a, b, f=compare: f(a.value, b.value if isinstance(b, Dual) else b))
    for name, ufunc in {"neg": np.negative, "pos": np.positive, "abs": np.absolute}.items():
        setattr(Dual, f"__{name}__", lambda a, f=ufunc: f(a))


def _dual(value: Any, slope: Any) -> Dual:
    """A number with slopes whose shapes are known to fit."""
    dual = Dual.__new__(Dual)
    dual.value, dual.slope = value, slope
    return dual


def _in_place(at: tuple[Any, ...]) -> bool:
    """Whether an index leaves the axes of what it picks where they were: slices and integers, or slices and one
    array."""
    arrays = integers = 0
    for k in at:
        if type(k) not in _STEPS:
            if isinstance(k, int | np.integer):
                integers += 1
            else:
                arrays += 1
    return not arrays or (arrays == 1 and not integers)


def _open_ended(at: tuple[Any, ...]) -> tuple[Any, ...]:
    """An index of values (...) as an index of slopes (..., P)."""
    return (*at, ALL) if any(k is Ellipsis for k in at) else (*at, Ellipsis)


def _first_last(slope: Any) -> Any:
    return slope.transpose((*range(1, slope.ndim), 0))


def _last_first(slope: Any) -> Any:
    return slope.transpose((slope.ndim - 1, *range(slope.ndim - 1)))


def _pair(x: Any) -> Pair:
    if type(x) is np.ndarray or type(x) is float:
        return Pair(x, None)
    if isinstance(x, Dual):
        return Pair(x.value, x.slope)
    return Pair(x if np.isscalar(x) or hasattr(x, "__array_function__") else np.asarray(x), None)


def _with_slopes(rule: Rule, inputs: Any) -> Dual:
    return _dual(*rule(*[x if type(x) is Dual else _pair(x) for x in inputs]))


def _first(rule: Callable[..., Pair]) -> Callable[..., Dual]:
    """A function whose first argument alone has slopes."""
    return lambda x, *args, **options: Dual(*rule(_pair(x), *args, **options))


def _every(rule: Callable[..., Pair]) -> Callable[..., Dual]:
    """A function whose arguments all may have slopes."""
    return lambda *args, **options: Dual(*rule(*map(_pair, args), **options))


def _joined(rule: Callable[..., Pair]) -> Callable[..., Dual]:
    """A function of a sequence."""
    return lambda xs, *args, **options: Dual(*rule([_pair(x) for x in xs], *args, **options))


def _of_value(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of values alone."""
    return lambda x, *args, **options: function(x.value if isinstance(x, Dual) else x, *args, **options)


def _constant(make: Callable[..., Any], like: Dual, shape: Any, *rest: Any, **options: Any) -> Dual:
    """A constant of a shape, for slopes to be put in, by as many parameters as `like` has."""
    shape = (shape,) if isinstance(shape, int | np.integer) else tuple(shape)
    inner: Any = {"like": like.value} if isinstance(like.value, Dual) else {}
    return Dual(make(shape, *rest, **options, **inner), np.zeros((len(like.slope), *shape), **inner))


def _constant_like(make: Callable[..., Any]) -> Callable[..., Dual]:
    return lambda x, *rest: _constant(make, x, x.shape, *rest)


def _where(condition: Any, *choices: Any) -> Any:
    condition = condition.value if isinstance(condition, Dual) else condition
    if not choices:
        return np.where(condition)
    return Dual(*arrays.where(condition, *map(_pair, choices)))


def _einsum(subscripts: str, *operands: Any) -> Dual:
    return Dual(*arrays.einsum(subscripts, *map(_pair, operands)))


def _clip(x: Any, low: Any, high: Any) -> Any:
    return np.minimum(np.maximum(x, low), high)


def _broadcast_arrays(*arrays: Any) -> tuple[Any, ...]:
    shape = np.broadcast_shapes(*(np.shape(a) for a in arrays))
    return tuple(np.broadcast_to(a, shape) for a in arrays)


def _copyto(target: Dual, source: Any) -> None:
    target[...] = source


def _add_at(target: Dual, at: Any, new: Any) -> None:
    at = at if isinstance(at, tuple) else (at,)
    added = _pair(new)
    np.add.at(target.value, at, added.value)
    if added.slope is not None:
        shape = np.shape(target.value[at])
        np.add.at(_first_last(target.slope), _open_ended(at), _first_last(padded(added.slope, len(shape))))


_REDUCED: dict[Any, Any] = {
    np.add: _first(arrays.along(np.sum)),
    np.multiply: _first(arrays.prod),
    np.maximum: _first(arrays.extreme(np.argmax)),
    np.minimum: _first(arrays.extreme(np.argmin)),
}

_NEW: frozenset[Any] = frozenset({np.empty, np.zeros, np.ones, np.full})

_FUNCTIONS: dict[Any, Any] = {
    np.bincount: lambda at, weights, minlength=0: Dual(*arrays.bincount(at, _pair(weights), minlength)),
    np.ascontiguousarray: _first(arrays.contiguous),
    **{
        f: _of_value(f)
        for f in (np.shape, np.ndim, np.size, np.argmin, np.argmax, np.argsort, np.round, np.iscomplexobj)
    },
    np.empty_like: _constant_like(np.empty),
    np.zeros_like: _constant_like(np.zeros),
    np.ones_like: _constant_like(np.ones),
    np.full_like: _constant_like(np.full),
    **{f: _first(arrays.along(f)) for f in (np.sum, np.mean)},
    **{f: _first(arrays.accumulated(f)) for f in (np.cumsum, np.diff, np.flip, np.roll)},
    np.prod: _first(arrays.prod),
    np.cumprod: _first(arrays.cumprod),
    np.max: _REDUCED[np.maximum],
    np.min: _REDUCED[np.minimum],
    np.where: _where,
    np.clip: _clip,
    np.copyto: _copyto,
    np.copy: lambda x: x.copy(),
    np.concatenate: _joined(arrays.concatenate),
    np.stack: _joined(arrays.stack),
    np.vstack: _joined(arrays.vstack),
    np.hstack: _joined(arrays.hstack),
    np.column_stack: _joined(arrays.column_stack),
    np.broadcast_to: _first(arrays.broadcast_to),
    np.broadcast_arrays: _broadcast_arrays,
    np.reshape: _first(arrays.reshape),
    np.ravel: lambda x: x.reshape(-1),
    np.transpose: _first(arrays.transpose),
    np.swapaxes: _first(arrays.swapaxes),
    np.moveaxis: _first(arrays.moveaxis),
    np.expand_dims: _first(arrays.expand_dims),
    np.squeeze: _first(arrays.squeeze),
    np.take: _first(arrays.take),
    np.tile: _first(arrays.tile),
    np.repeat: _first(arrays.repeat),
    np.diagonal: _first(arrays.diagonal),
    np.diag: _first(arrays.diag),
    np.einsum: _einsum,
    np.dot: _every(arrays.matmul),
    np.outer: _every(arrays.outer),
    np.cross: _every(arrays.cross),
    np.linalg.inv: _first(arrays.inv),
    np.linalg.solve: _every(arrays.solve),
    np.linalg.det: _first(arrays.det),
    np.linalg.norm: _first(arrays.norm),
}
_operators()
