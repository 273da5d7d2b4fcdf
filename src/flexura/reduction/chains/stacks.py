"""Designs in stacks, and the names of those that cannot be."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexura.errors import ModelError, OptionError
from flexura.structure import DiscreteElement, Elements, Plan

STACK = 64
"""Designs evaluated together: enough to make Python's share small, few enough to stay in the cache."""


TINY = 1e-9
"""A coordinate, m, that is a little off zero."""

LARGEST_FREED = 31 << 20
"""Bytes just below the largest block that moves the thresholds of glibc's malloc."""


@cache
def keep_freed_memory() -> None:
    """Have the arrays of one stack reused for the next one: freeing a block of this size, which is never touched, tells
    glibc's malloc not to give smaller ones back to the system (mallopt(3), M_MMAP_THRESHOLD), from where they would
    come again page by page, at up to half the cost of a stack. Other libraries are not told anything."""
    np.empty(LARGEST_FREED, dtype=np.uint8)


class ImpossibleDesignError(OptionError):
    """A design of a stack, by its `number` there, has a stiffness or mass that is not positive and finite."""

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__("a stiffness or mass is not positive")


def stacks(designs: int) -> list[slice]:
    """So many designs cut into stacks, the memory for which is kept."""
    keep_freed_memory()
    return [slice(k, min(k + STACK, designs)) for k in range(0, designs, STACK)]


def independent_stacks(
    plan: Plan, parameters: Mapping[str, ArrayLike]
) -> Iterator[tuple[slice, NDArray[np.float64], dict[str, ArrayLike]]]:
    """Designs in stacks that are filled up to one size, so that each is worked out to the last bit the same whatever
    others stand beside it: which designs of all a stack begins with, and its values (k, s) and parameters.

    Where parameters may place nodes, there is a design behind a stack that was not asked for and stands a little off
    the others in all of these, so that designs of one geometry, or of one in some parts, are worked out like any other.
    """
    every, placing = np.atleast_2d(plan.values(parameters)), plan.placing(parameters)
    for used in stacks(len(every)):
        numbers = np.minimum(used.start + np.arange(STACK + bool(len(placing))), used.stop - 1)
        values = every[numbers]
        values[-1, placing] = np.where(values[-1, placing] == 0, TINY, values[-1, placing] * (1 + 1e-6))
        yield used, values, {name: np.ravel(v)[numbers] if np.ndim(v) else v for name, v in parameters.items()}


def refuse_impossible(elements: Elements, discrete_elements: Sequence[DiscreteElement], designs: int) -> None:
    """Raise ImpossibleDesignError for the first design with an element, of a beam or discrete, that is not positive
    and finite."""
    good = np.ones(designs, dtype=bool)
    for coefficients, basis, least in (
        (elements.flexibility_coefficients, elements.flexibility_basis, np.finfo(float).tiny),
        (elements.mass_coefficients, elements.mass_basis, 0.0),
    ):
        n = round(basis.shape[1] ** 0.5)
        found = coefficients[..., (basis[:, :: n + 1] != 0).any(axis=1)]
        good &= ((found >= least) & (found < np.inf)).all(axis=(-1, -2))
    for discrete in discrete_elements:
        for A in (discrete.K, discrete.M):
            if A is not None:
                found = np.einsum("...ii->...i", A)
                good &= ((found >= 0) & (found < np.inf)).all(axis=-1)
    if not good.all():
        raise ImpossibleDesignError(int(np.flatnonzero(~good)[0]))


def refuse_turned(plan: Plan, values: NDArray[np.float64], parameters: Mapping[str, ArrayLike]) -> None:
    """Raise OptionError for the first design of values (..., s) that has a size on the other side of zero than the
    default one, which breaks the description: a section's formula does not always see its sign."""
    for d in plan.turned(np.atleast_2d(values)):
        own = one_of(parameters, int(d))
        try:
            plan.verify(own)
        except ModelError as error:
            what = error.problems[0]
            text = f"{what.place}: {what.rule} (found {what.value})"
            raise OptionError(f"design {d} ({_said(own)}): {text}") from None


def named(error: ImpossibleDesignError, first: int, parameters: Mapping[str, ArrayLike]) -> OptionError:
    """The error with the design's number among all and its parameters."""
    number = first + error.number
    return OptionError(
        f"design {number} ({_said(one_of(parameters, number))}): {error}; a size has gone through zero;"
        " `check` with these parameters names it"
    )


def _said(parameters: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in parameters.items()) or "default parameters"


def some_of(parameters: Mapping[str, ArrayLike], own: slice) -> dict[str, ArrayLike]:
    """Parameters of some designs of many."""
    return {name: np.ravel(v)[own] if np.ndim(v) else v for name, v in parameters.items()}


def one_of(parameters: Mapping[str, ArrayLike], number: int) -> dict[str, float]:
    """Parameters of one design of many."""
    return {name: float(np.ravel(v)[number if np.ndim(v) else 0]) for name, v in parameters.items()}
