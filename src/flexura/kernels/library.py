"""The library of kernels, if there is one, and calls of what is in it."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    """A function of the library by its name, and what it takes: `a` for an array, or none, `n` a whole number, `x` a
    number.

    Arrays are of doubles, complex ones too, of 64-bit whole numbers or of truth values, row by row in memory; one that
    stays may be passed by its `address`, while it is kept.
    """

    def __init__(self, name: str, takes: str) -> None:
        self.name = name
        self._takes = [_TAKEN[kind] for kind in takes]

    @cached_property
    def bare(self) -> Callable[..., int]:
        """The function itself, which takes addresses of arrays that are kept."""
        found = getattr(_library(), self.name)
        found.argtypes, found.restype = self._takes, ctypes.c_int64
        return found

    def __call__(self, *arguments: Array | Complex | Index | NDArray[np.bool_] | bytes | float | None) -> int:
        """What the function returns, a whole number."""
        try:
            return self.bare(
                *[_memory(one) if type(one) is np.ndarray and one.itemsize in ITEMS else one for one in arguments]
            )
        except (TypeError, ctypes.ArgumentError):  # an array that may not be written to, or is refused
            return self.bare(*[address(one) if type(one) is np.ndarray else one for one in arguments])


_TAKEN = {"a": ctypes.c_void_p, "n": ctypes.c_int64, "x": ctypes.c_double}


class Struct:
    """A struct of C whose fields take 8 bytes each: whole numbers, and addresses of arrays and of other structs, which
    are kept with it. Kernels take its `address`."""

    def __init__(self, *fields: Array | Index | NDArray[np.bool_] | Struct | int) -> None:
        self._fields = fields
        own = [f.address if isinstance(f, Struct) else address(f) if isinstance(f, np.ndarray) else f for f in fields]
        self._own = np.array(own, dtype=np.int64)
        self.address: int = address(self._own)

    def __reduce__(self) -> tuple[type[Struct], tuple[Any, ...]]:
        return Struct, self._fields


_memory: Any = (ctypes.c_char * 0).from_buffer
"""The memory of an array as a kernel takes it; TypeError for what has gaps, or may not be written to."""

ITEMS = (1, 8, 16)
"""Bytes of truth values, numbers and complex numbers."""


def address(array: Array | Complex | Index | NDArray[np.bool_]) -> int:
    """Where an array lies in memory."""
    assert array.itemsize in ITEMS
    try:
        return ctypes.addressof(_memory(array))  # five times as quick as NumPy
    except TypeError:  # it may not be written to
        assert array.flags.c_contiguous
        return array.ctypes.data


def packed(*numbers: int) -> bytes:
    """Whole numbers as a kernel takes them together, where it takes an array."""
    return struct.pack(f"{len(numbers)}q", *numbers)


def scratch(lanes: int) -> Array:
    """Room for so many numbers of four designs, from the first line of the cache in it on."""
    return np.empty(4 * lanes + 8)
