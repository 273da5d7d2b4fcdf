"""Signals and numbers by the names of inputs, as arrays over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flexura.arrays import Array
from flexura.errors import OptionError
from flexura.tables import counted

Samples = ArrayLike | Callable[[Array], ArrayLike]


def by_name(names: list[str], given: Mapping[str, float]) -> Array:
    """Numbers (m,) of inputs, zero where none is given. Raises OptionError for what is no finite number."""
    values = np.zeros(len(names))
    for name, value in given.items():
        try:
            values[names.index(name)] = float(value)
        except (TypeError, ValueError):
            raise OptionError(f"{name}: a number is expected, not {value!r}") from None
    if not np.isfinite(values).all():
        raise OptionError("impulses and states to start from are finite numbers")
    return values


def sampled(inputs: Mapping[str, Samples], names: list[str], dt: float, duration: float | None) -> Array:
    """Samples (m, N) of all inputs. Raises OptionError where they do not fit."""
    lists = {name: _numbers(name, s) for name, s in inputs.items() if not callable(s)}
    if duration is not None and not (np.isfinite(duration) and duration > 0):
        raise OptionError(f"duration is a positive time in s, not {duration}")
    lengths = {name: s.shape for name, s in lists.items()}
    if any(len(shape) != 1 for shape in lengths.values()) or len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} has {'x'.join(map(str, shape))}" for name, shape in lengths.items())
        raise OptionError(f"signals are lists of samples of one length: {listed}")
    if not lists and duration is None:
        raise OptionError("a duration in s is needed: the inputs are functions of time")
    given = len(next(iter(lists.values()))) if lists else None
    count = round(duration / dt) + 1 if duration is not None else given or 0
    if given is not None and given < count:
        raise OptionError(
            f"the signals end after {counted(given, 'sample')}; {duration:g} s in steps of {dt:g} s need more"
        )
    if count < 2:
        raise OptionError("a time response has at least two samples: shorten dt or lengthen the signals")
    u, time = np.zeros((len(names), count)), dt * np.arange(count, dtype=float)
    for k, name in enumerate(names):
        signal = inputs.get(name)
        if signal is None:
            continue
        values = _numbers(name, signal(time)) if callable(signal) else lists[name][:count]
        if values.shape not in ((), time.shape):
            raise OptionError(f"the signal of {name} returns {count} values for as many times, not {values.shape}")
        u[k] = values
        if not np.isfinite(u[k]).all():
            first = int(np.flatnonzero(~np.isfinite(u[k]))[0])
            raise OptionError(f"the signal of {name} is not finite at sample {first}")
    return u


def _numbers(name: str, samples: Any) -> Array:
    try:
        return np.asarray(samples, dtype=float)
    except (TypeError, ValueError):
        raise OptionError(
            f"the signal of {name} is a list of numbers, or a function of time that returns one"
        ) from None
