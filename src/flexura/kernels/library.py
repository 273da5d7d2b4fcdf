"""The library of kernels, if there is one, and calls of what is in it."""

from __future__ import annotations

import ctypes
import platform
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, cached_property

import numpy as np

from flexura.arrays import Array, Complex, Index
from flexura.kernels.build import digest, library_path

_in_numpy = ContextVar("in_numpy", default=False)


@cache
def _library() -> ctypes.CDLL | None:
    """None where there is none, or one of other sources."""
    path = library_path()
    try:
        found = ctypes.CDLL(str(path))
        found.flexura_digest.restype = ctypes.c_char_p
        return found if found.flexura_digest().decode() == digest() else None
    except (OSError, AttributeError):
        return None


def is_compiled() -> bool:
    """Whether kernels are used."""
    return not _in_numpy.get() and _library() is not None


@contextmanager
def without() -> Iterator[None]:
    """Everything in NumPy, as where no library is there."""
    before = _in_numpy.set(True)
    try:
        yield
    finally:
        _in_numpy.reset(before)


class Kernel:
    """A function of the library by its name, and what it takes: `a` for an array, `n` a whole number, `x` a number.

    Arrays are of doubles, complex ones too, or of 64-bit whole numbers, row by row in memory; one that stays may be
    passed by its `address`, while it is kept.
    """

    def __init__(self, name: str, takes: str) -> None:
        self.name = name
        self._takes = [_TAKEN[kind] for kind in takes]

    @cached_property
    def _function(self) -> Callable[..., int]:
        found = getattr(_library(), self.name)
        found.argtypes, found.restype = self._takes, ctypes.c_int64
        return found

    def __call__(self, *arguments: Array | Complex | Index | bytes | float) -> int:
        """What the function returns, a whole number."""
        return self._function(*[address(given) if type(given) is np.ndarray else given for given in arguments])


_TAKEN = {"a": ctypes.c_void_p, "n": ctypes.c_int64, "x": ctypes.c_double}


def address(array: Array | Complex | Index) -> int:
    """Where an array lies in memory."""
    assert array.flags.c_contiguous and array.dtype.itemsize % 8 == 0
    return _read(id(array) + _BEFORE_DATA).value if _is_readable else array.ctypes.data


def packed(*numbers: int) -> bytes:
    """Whole numbers as a kernel takes them together, where it takes an array."""
    return struct.pack(f"{len(numbers)}q", *numbers)


def scratch(lanes: int) -> Array:
    """Room for so many numbers of four designs, from the first line of the cache in it on."""
    return np.empty(4 * lanes + 8)


_read = ctypes.c_size_t.from_address

_BEFORE_DATA = object.__basicsize__
"""Bytes of an array of NumPy before the pointer to its data, in CPython (numpy/ndarraytypes.h): reading that takes 0.1
us, where NumPy's own attribute takes one or more."""


def _is_layout_known() -> bool:
    tried = np.arange(4.0)
    known = platform.python_implementation() == "CPython"
    return known and all(_read(id(one) + _BEFORE_DATA).value == one.ctypes.data for one in (tried, tried[2:]))


_is_readable = _is_layout_known()
