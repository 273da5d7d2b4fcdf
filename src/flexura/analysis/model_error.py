"""How far the described model may be from the part that is drawn: the second margin of every number.

Proven intervals say how near a number is to that of the description; whether the part is like the description is
physics: beams are not solids, roots and bodies give. Every assumption is a flexibility E that is left out or uncertain,
of which a share s, from measured errors, is to be added. A number that the forces f of the model make is changed by
s f'E f (theory eq. M1), so that each assumption is weighted by the energy that it holds of that very number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from flexura.analysis.doubts import place_of
from flexura.analysis.elastic_bodies import Wrenches, loaded_solids
from flexura.analysis.internal_forces import force_changes
from flexura.analysis.measured_members import stiffness_errors
from flexura.beam import COUPLED_FLEXIBILITY_BASIS, combine, root_coefficients
from flexura.mechanism import evaluated
from flexura.structure import FullOrderModel

Array = NDArray[np.float64]
Interval = tuple[float, float]

ROOT_DRAWN = (-0.2, 0.2)
"""How far off, relative, the flexibility of a root is whose block is drawn."""

ROOT_NOT_DRAWN = (-1.0, 0.5)
"""The same of a block that is not: from a rigid one to an edge of it."""

ROOT_LEFT_OUT = (0.0, 1.2)
"""Share of a root's flexibility that a model without it lacks."""

BODY = (0.65, 1.35)
"""Share of the estimated flexibility of a body that it has."""

GROUND = (0.0, 1.35)
"""Share of the estimated flexibility that the ground has where no block, or no held face of it, is described."""

UNCOVERED = 0.1
"""Part of the energy of a number in members without evidence from which its model error is not known."""

COMPONENTS = {"stretch": (0,), "twist": (3,), "thickness bending": (2, 4), "width bending": (1, 5)}
"""Components of an element's deformation, by what they are called."""


@dataclass(frozen=True)
class Assumption:
    """What the description takes for granted, and how wrong that may be.

    `kind`: beam, root, body or ground; `place`: what it is about; `direction`: of which deformation, empty for all.
    `flexibility` (k, k), J, is that of the forces of k motions; `share`: the least and the most of it that is to be
    added, None where there is no evidence, for a `reason`. Assumptions of one `group` are wrong alike.
    """

    kind: str
    place: str
    direction: str
    group: str
    flexibility: Array
    share: Interval | None
    reason: str = ""


@dataclass(frozen=True)
class Effect:
    """Where one assumption alone puts the part's values: between 1 + `low` and 1 + `high` (n,) times the printed ones."""

    kind: str
    place: str
    direction: str
    low: Array
    high: Array


@dataclass(frozen=True)
class ModelError:
    """Where the part's values lie: between 1 + `low` and 1 + `high` (n,) times the printed ones, NaN where evidence is
    missing, for a `reason` (n,). `effects` are those of every assumption by itself."""

    low: Array
    high: Array
    reason: tuple[str, ...]
    effects: tuple[Effect, ...]

    @property
    def intervals(self) -> tuple[Interval | None, ...]:
        """Least and largest relative difference of each number; None where evidence is missing."""
        both = zip(self.low.tolist(), self.high.tolist(), strict=True)
        return tuple((low, high) if np.isfinite(low) and np.isfinite(high) else None for low, high in both)


def frequency_errors(full: FullOrderModel, squared: Array, states: Array, n: int) -> ModelError:
    """Model errors of the first `n` frequencies, from squared angular frequencies (k,) and M-orthonormal vectors
    (order, k) of the lowest elastic modes; the more there are, the better they show what bodies do (theory eq. M2, after
    S. Dunkerley, Phil. Trans. R. Soc. A 185 (1894) 279)."""
    scale = 1 / np.outer(squared, squared)

    def added(own: Assumption, share: float) -> Array:
        """Relative increase (n,) of 1/omega^2."""
        found, shapes = np.linalg.eigh(np.diag(1 / squared) + share * scale * own.flexibility)
        mode, number = linear_sum_assignment(-(shapes**2))
        order = np.empty(len(squared), dtype=np.intp)
        order[mode] = number
        return (found[order] * squared - 1)[:n]

    return _combined(assumptions(full, states), added, lambda x: 1 / np.sqrt(np.maximum(1 + x, 1e-3)) - 1)


def compliance_errors(full: FullOrderModel, states: Array, pairs: Sequence[tuple[int, int]], values: Array) -> ModelError:
    """Model errors of compliances (n,) between two of k load vectors each, from the displacements (order, k) under
    these loads (theory eq. M1)."""
    i, j = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    size = np.where(values == 0, np.inf, values)

    def added(own: Assumption, share: float) -> Array:
        return share * own.flexibility[i, j] / size

    return _combined(assumptions(full, states), added, lambda x: x)


def _combined(
    found: Sequence[Assumption], added: Callable[[Assumption, float], Array], value: Callable[[Array], Array]
) -> ModelError:
    """All assumptions together, by what each adds (n,) with a share: those of one group add, groups their squares."""
    covered = [(own, own.share) for own in found if own.share is not None]
    both = [(added(own, share[0]), added(own, share[1])) for own, share in covered]
    n = len(both[0][0]) if both else len(added(found[0], 0.0)) if found else 0
    middle, spread = np.zeros(n), {own.group: np.zeros(n) for own, _ in covered}
    for (own, _), (low, high) in zip(covered, both, strict=True):
        middle += (low + high) / 2
        spread[own.group] += (high - low) / 2
    half = np.sqrt(sum((own**2 for own in spread.values()), np.zeros(n)))
    ends = np.sort([value(middle - half), value(middle + half)], axis=0)
    without, reasons = np.zeros(n), [""] * n
    for own in (own for own in found if own.share is None):
        without += np.abs(added(own, 1.0))
        for k in np.flatnonzero(without >= UNCOVERED):
            reasons[k] = reasons[k] or f"{own.place}: {own.reason}"
    ends[:, without >= UNCOVERED] = np.nan
    effects = [
        Effect(own.kind, own.place, own.direction, *np.sort([value(low), value(high)], axis=0))
        for (own, _), (low, high) in zip(covered, both, strict=True)
    ]
    effects.sort(key=lambda own: -float(np.abs([own.low, own.high]).max(initial=0.0)))
    return ModelError(ends[0], ends[1], tuple(reasons), tuple(effects))


def assumptions(full: FullOrderModel, states: Array) -> list[Assumption]:
    """What may be wrong of a model for its displacements (order, k) in k motions."""
    wrenches = force_changes(full, states)
    values = full.plan.scoped_values(full.parameters)
    return [*_beams(full, wrenches, values), *_roots(full, wrenches), *_solids(full, wrenches, values)]


def _beams(full: FullOrderModel, wrenches: Wrenches, values: Mapping[str, Any]) -> Iterator[Assumption]:
    """Every member in every direction, with how far its stiffness was measured to be off."""
    for name, (_, force) in wrenches.items():
        part = full.plan.parts[name]
        moved = full.matrices[name].elements.member_C @ force
        for m, (key, member) in enumerate(part.members.items()):
            own = slice(part.first[m], part.first[m + 1])
            work = np.einsum("iecj,ieck->cjk", force[:, own], moved[:, own])
            corrected = bool(part.table.corrections.active[m, :-1].any())
            errors = stiffness_errors(evaluated(member, values), float(full.geometry.parts[name].length[m]), corrected)
            for k, (direction, components) in enumerate(COMPONENTS.items()):
                E = work[list(components)].sum(axis=0)
                share = None if errors.reason else (float(errors.low[k]), float(errors.high[k]))
                group = f"{errors.kind} {direction}"
                yield Assumption("beam", place_of(name, key), direction, group, (E + E.T) / 2, share, errors.reason)


def _roots(full: FullOrderModel, wrenches: Wrenches) -> Iterator[Assumption]:
    """Every elastic root, and those that are left out."""
    plan, first = full.plan, 0
    where: list[tuple[str, str, int]] = []
    for name, part in plan.parts.items():
        where += [(name, key, first) for key in part.members]
        first += len(part.connectivity)
    for roots, is_in in ((plan.roots, True), (plan.roots_left_out, False)):
        found = roots.of(full.values, full.geometry)
        for k in range(len(roots) if found else 0):
            elements, ends, flexibility = found  # type: ignore[misc]
            name, key, first = where[roots.members[k]]
            force = wrenches[name][ends[k]][:, elements[k] - first]
            C = combine(root_coefficients(flexibility[k], 0.0, int(ends[k])), COUPLED_FLEXIBILITY_BASIS, 6)
            E = np.einsum("icj,cd,idk->jk", force, C, force)
            drawn = bool(roots.is_known[k])
            share = (ROOT_DRAWN if drawn else ROOT_NOT_DRAWN) if is_in else ROOT_LEFT_OUT
            yield Assumption("root", place_of(name, key), "", "root" if drawn else "root not drawn", E, share)


def _solids(full: FullOrderModel, wrenches: Wrenches, values: Mapping[str, Any]) -> Iterator[Assumption]:
    """Bodies, and blocks of the ground."""
    for body in loaded_solids(full, wrenches, values):
        kind = "ground" if body.solid.held else "body"
        share = BODY if body.is_sure else GROUND
        yield Assumption(kind, body.kind, "", kind, body.flexibility(), share)
