"""Arrays of 40 digits that NumPy's functions accept, for differences of code with steps far below round-off."""

from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal, localcontext

import mpmath
import numpy as np


@contextmanager
def forty_digits() -> Iterator[None]:
    """Numbers of 40 digits; what is not finite goes on as it does in double precision."""
    with localcontext() as context, mpmath.workdps(42), np.errstate(all="ignore"):
        context.prec, context.traps = 40, dict.fromkeys(context.traps, False)
        yield


def _each(function):
    return np.vectorize(function, otypes=[object])


def _decimal(x):
    """A number of mpmath."""
    if not mpmath.isfinite(x):
        return Decimal(float(x))
    sign, mantissa, exponent, _ = x._mpf_
    return (-1) ** sign * int(mantissa) * Decimal(2) ** exponent


def _by_mpmath(function):
    return lambda *given: _decimal(function(*(mpmath.mpf(str(x)) for x in given)))


_FUNCTIONS = {
    np.sqrt: Decimal.sqrt,
    np.exp: Decimal.exp,
    np.log: Decimal.ln,
} | {
    of: _by_mpmath(function)
    for of, function in {
        np.expm1: mpmath.expm1,
        np.sin: mpmath.sin,
        np.cos: mpmath.cos,
        np.tan: mpmath.tan,
        np.tanh: mpmath.tanh,
        np.arctanh: mpmath.atanh,
        np.arctan2: mpmath.atan2,
        np.hypot: mpmath.hypot,
        np.arcsin: mpmath.asin,
        np.arccos: mpmath.acos,
        np.arctan: mpmath.atan,
    }.items()
}
_TRUTHS = {np.isfinite: Decimal.is_finite, np.isnan: Decimal.is_nan}
_COMPARED = {np.greater, np.greater_equal, np.less, np.less_equal, np.equal, np.not_equal}
_PLAIN = {np.shape, np.ndim, np.size, np.argmin, np.argmax}


def exact(x):
    """An object array of numbers of 40 digits."""
    x = np.asarray(x)
    if x.dtype == object:
        return x
    out = np.empty(x.size, dtype=object)
    out[:] = [Decimal(v) for v in x.ravel().astype(float).tolist()]
    return out.reshape(x.shape)


class Precise(np.lib.mixins.NDArrayOperatorsMixin):
    """An array of 40 digits."""

    def __init__(self, a):
        self.a = exact(a)

    shape = property(lambda self: self.a.shape)
    ndim = property(lambda self: self.a.ndim)
    size = property(lambda self: self.a.size)
    T = property(lambda self: Precise(self.a.T))

    def __len__(self):
        return len(self.a)

    def __iter__(self):
        return (Precise(x) for x in self.a)

    def __getitem__(self, at):
        return Precise(self.a[at])

    def __setitem__(self, at, new):
        self.a[at] = new.a if isinstance(new, Precise) else exact(new)

    def __array__(self, *_, **__):
        return self.a.astype(float)  # 16 digits, which no difference with a small step survives

    def tobytes(self):
        return repr(self.a.tolist()).encode()

    def reshape(self, *shape):
        return Precise(self.a.reshape(*shape))

    def ravel(self):
        return Precise(self.a.ravel())

    def sum(self, axis=None, keepdims=False):
        return Precise(self.a.sum(axis=axis, keepdims=keepdims))

    def mean(self, axis=None):
        return Precise(self.a.mean(axis=axis))

    def min(self, axis=None, keepdims=False):
        return Precise(self.a.min(axis=axis, keepdims=keepdims))

    def round(self):
        return np.round(self.a.astype(float))

    def diagonal(self):
        return np.ones(self.shape[:-1])  # asked for to scale matrices before they are inverted; 40 digits need none

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        inputs = [x.a if isinstance(x, Precise) else x for x in inputs]
        if method == "at":
            return np.add.at(inputs[0], inputs[1], exact(inputs[2]))
        if method == "reduce":
            return Precise(ufunc.reduce(inputs[0], **{k: v for k, v in options.items() if k in ("axis", "keepdims")}))
        assert method == "__call__", method
        if ufunc in _TRUTHS:
            return _each(_TRUTHS[ufunc])(inputs[0]).astype(bool)
        if ufunc in _FUNCTIONS:
            return Precise(_each(_FUNCTIONS[ufunc])(*map(exact, inputs)))
        if ufunc is np.sign:
            return np.sign(exact(inputs[0]).astype(float))
        if ufunc in _COMPARED:
            return np.asarray(ufunc(*map(exact, inputs))).astype(bool)
        return Precise(ufunc(*map(exact, inputs)))

    def __array_function__(self, func, types, args, kwargs):
        if func in (np.empty, np.zeros, np.ones, np.full):
            fill = {np.full: args[-1], np.ones: 1.0}.get(func, 0.0)
            shape = args[0]
            return Precise(np.full(shape, Decimal(fill), dtype=object))
        args = [_bare(x) for x in args]
        if func in (np.zeros_like, np.ones_like):
            return Precise(func(args[0].astype(float)))
        if func in _PLAIN:
            return func(*args, **kwargs)
        if func is np.linalg.norm:
            found = _each(Decimal.sqrt)(
                (args[0] * args[0]).sum(axis=kwargs["axis"], keepdims=kwargs.get("keepdims", False))
            )
        elif func is np.linalg.inv:
            found = _inverse(args[0])
        elif func is np.linalg.det:
            return np.linalg.det(args[0].astype(float))
        elif func is np.einsum:
            found = np.einsum(args[0], *map(exact, args[1:]))
        elif func is np.where:
            found = np.where(args[0], *map(exact, args[1:]))
        else:
            found = func(*args, **kwargs)
        if isinstance(found, (list, tuple)):
            return type(found)(Precise(x) for x in found)
        return Precise(found)


def _bare(x):
    if isinstance(x, (list, tuple)):
        return [exact(_bare(y)) for y in x] if any(isinstance(y, Precise) for y in x) else x
    return x.a if isinstance(x, Precise) else x


def _inverse(A):
    """A^-1 (..., n, n) by elimination in the order of columns, which positive definite matrices allow."""
    n = A.shape[-1]
    A, X = A.copy(), np.broadcast_to(exact(np.eye(n)), A.shape).copy()
    for k in range(n):
        pivot = A[..., k, k, None].copy()
        A[..., k, :], X[..., k, :] = A[..., k, :] / pivot, X[..., k, :] / pivot
        factor = A[..., :, k, None].copy()
        factor[..., k, :] = Decimal(0)
        A, X = A - factor * A[..., k, None, :], X - factor * X[..., k, None, :]
    return X
