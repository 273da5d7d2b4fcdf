"""How far the described model may be from the part that is drawn: the second margin of every number.

Proven intervals say how near a number is to that of the description; whether the part is like the description is
physics: beams are not solids, roots and bodies give. Every assumption is a flexibility E that is left out or uncertain,
of which a share s, from measured errors, is to be added. A number that the forces f of the model make is changed by
s f'E f (theory eq. M1), so that each assumption is weighted by the energy that it holds of that very number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from flexura.analysis.elastic_bodies import Wrenches, loaded_solids, place_of
from flexura.analysis.internal_forces import force_changes
from flexura.analysis.measured_members import DIRECTIONS, MemberErrors, ratios_of, stiffness_errors
from flexura.beam import COUPLED_FLEXIBILITY_BASIS, combine, root_coefficients
from flexura.errors import SolverError
from flexura.mechanism import CORRECTIONS, Flexure, Link, evaluated
from flexura.reduction import chained, lowest_pairs
from flexura.structure import FullOrderModel

Array = NDArray[np.float64]
Interval = tuple[float, float]

ROOT_DRAWN = (-0.2, 0.2)
"""How far off, relative, the flexibility of a root is whose block is drawn."""

ROOT_NOT_DRAWN = (-1.0, 0.5)
"""The same of a block that is not: from a rigid one to an edge of it."""

ROOT_LEFT_OUT = (0.0, 1.2)
"""Share of a root's flexibility that a model without it lacks."""

BODY = (0.5, 1.2)
"""Share of the estimated flexibility of a body that it has."""

AT_NOTCH = 3.5
"""The most of it where notches end in the body, whose flanks lead their load into little of it."""

GROUND = (0.0, 1.2)
"""Share of the estimated flexibility that the ground has where no block, or no held face of it, is described."""

EVERYTHING = 1e30
"""Flexibility, J, of what is not known at all: beside it nothing else counts."""

UNCOVERED = 0.1
"""Part of the energy of a number in members without evidence from which its model error is not known."""

MORE = 8
"""Modes that are taken beside those that are asked for, to show how these change."""

MOST = 30_000
"""Coordinates up to which model errors of modes are worked out."""

COMPONENTS = ((0,), (3,), (2, 4), (1, 5))
"""Components of an element's deformation in each of DIRECTIONS."""


WARPING = CORRECTIONS.index("warping")

CLAMPED, CLAMPED_SLOPE = 500.564, 12.303
"""Of the first mode of a beam clamped at both ends, length 1: integrals of the second and of the first derivative
squared over that of the mode squared (R. D. Blevins, Formulas for Natural Frequency and Mode Shape, 1979)."""


@dataclass(frozen=True)
class Assumption:
    """What the description takes for granted, and how wrong that may be.

    `kind`: beam, root, body or ground; `place`: what it is about; `text`: what is assumed. `flexibility` (k, k), J, is
    that of the forces of k motions; `share`: the least and the most of it that is to be added, None where there is no
    evidence, for a `reason`. Assumptions of one `group` are wrong alike.
    """

    kind: str
    place: str
    text: str
    group: str
    flexibility: Array
    share: Interval | None
    reason: str = ""


@dataclass(frozen=True)
class Effect:
    """Where one assumption, the same of all `places`, alone puts the part's values: between 1 + `low` and 1 + `high`
    (n,) times the printed ones."""

    kind: str
    places: tuple[str, ...]
    text: str
    low: Array
    high: Array


@dataclass(frozen=True)
class Unknown:
    """Members without evidence: why, and the part (n,) of the energy of each number that they hold."""

    places: tuple[str, ...]
    reason: str
    share: Array


@dataclass(frozen=True)
class ModelError:
    """Where the part's values lie: between 1 + `low` and 1 + `high` (n,) times the printed ones, NaN where evidence is
    missing, for a `reason` (n,). `effects` are those of every assumption by itself, the largest first; `unknown` are
    members without evidence."""

    low: Array
    high: Array
    reason: tuple[str, ...]
    effects: tuple[Effect, ...]
    unknown: tuple[Unknown, ...] = ()

    @property
    def intervals(self) -> tuple[Interval | None, ...]:
        """Least and largest relative difference of each number; None where evidence is missing."""
        both = zip(self.low.tolist(), self.high.tolist(), strict=True)
        return tuple((low, high) if np.isfinite(low) and np.isfinite(high) else None for low, high in both)

    @property
    def texts(self) -> tuple[str, ...]:
        """The intervals in words, such as `-6.2 to +1.1 %`."""
        return tuple(interval_text(own) for own in self.intervals)


def interval_text(interval: Interval | None) -> str:
    """A model error in words."""
    if interval is None:
        return "no evidence"
    low, high = (100 * own for own in interval)
    digits = 1 if max(abs(low), abs(high)) < 9.95 else 0
    return f"{low:+.{digits}f} to {high:+.{digits}f} %"


def model_errors_of_modes(full: FullOrderModel, n: int) -> tuple[ModelError, Array]:
    """Model errors of the first `n` frequencies, and these, Hz. Errors of rigid motions, and all beyond MOST
    coordinates, are NaN."""
    nothing = np.full(n, np.nan)
    if full.order > MOST:
        return ModelError(nothing, nothing, (f"not worked out beyond {MOST} coordinates",) * n, ()), nothing
    apart = chained(full)
    pairs = lowest_pairs(apart, min(n + MORE, full.order))
    at = np.flatnonzero(pairs.values > 0)
    vectors = apart.recover(pairs.vectors[:, at])
    vectors = vectors / np.sqrt(np.einsum("ik,ik->k", vectors, full.M @ vectors))
    rigid = min(n, len(pairs.values) - len(at))
    found = frequency_errors(full, pairs.values[at], vectors, min(n - rigid, len(at)))
    still = nothing[:rigid]
    return ModelError(
        np.append(still, found.low),
        np.append(still, found.high),
        ("a rigid motion, whose frequency is zero",) * rigid + found.reason,
        tuple(replace(e, low=np.append(still, e.low), high=np.append(still, e.high)) for e in found.effects),
        tuple(replace(own, share=np.append(0 * still, own.share)) for own in found.unknown),
    ), np.sqrt(np.maximum(pairs.values, 0.0)) / (2 * np.pi)


def frequency_errors(full: FullOrderModel, squared: Array, states: Array, n: int) -> ModelError:
    """Model errors of the first `n` frequencies, from squared angular frequencies (k,) and M-orthonormal vectors
    (order, k) of the lowest elastic modes; the more there are, the better they show what bodies do (theory eq. M2,
    after S. Dunkerley, Phil. Trans. R. Soc. A 185 (1894) 279)."""
    scale = 1 / np.outer(squared, squared)

    def periods(flexibility: Array) -> Array:
        """1/omega^2 (n,) with a flexibility, in the order of shapes without it."""
        found, shapes = np.linalg.eigh(np.diag(1 / squared) + scale * flexibility)
        mode, number = linear_sum_assignment(-(shapes**2))
        order = np.empty(len(squared), dtype=np.intp)
        order[mode] = number
        return found[order][:n]

    return errors_of(full, states, periods, lambda x: 1 / np.sqrt(np.maximum(1 + x, 1e-3)) - 1)


def errors_of(
    full: FullOrderModel,
    states: Array,
    numbers: Callable[[Array], Array],
    value: Callable[[Array], Array] = lambda x: x,
) -> ModelError:
    """Model errors of n numbers that follow from the compliances between k load vectors (theory eq. M1).

    states: displacements (order, k) under these loads; numbers: the n numbers when a flexibility (k, k) is added to
    these compliances; value: what relative changes of them are of the numbers asked for. Assumptions of one group add,
    groups their squares; equal ones are taken at once, so that modes of equal frequencies are not told apart by them.
    """
    found, base = assumptions(full, states), numbers(np.zeros((states.shape[1],) * 2))
    n, size = len(base), np.where(base == 0, np.inf, base)

    def added(flexibility: Array) -> Array:
        return (numbers(flexibility) - base) / size

    alike: dict[tuple[str, str, str], list[Assumption]] = {}
    for own in found:
        by_itself = own.place if own.kind in ("body", "ground") else ""
        alike.setdefault((own.kind, own.reason or own.text, by_itself), []).append(own)
    middle, spread = np.zeros(n), {own.group: np.zeros(n) for own in found}
    effects, unknown = [], []
    for (kind, text, _), same in alike.items():
        places = tuple(dict.fromkeys(own.place for own in same))
        if same[0].share is None:
            part = np.abs(added(np.sum([own.flexibility for own in same], axis=0)))
            unknown.append(Unknown(places, text, np.minimum(part, 1.0)))
            continue
        pairs = [(own.share or (0.0, 0.0), own.flexibility) for own in same]
        low, high = (added(np.sum([share[k] * E for share, E in pairs], axis=0)) for k in (0, 1))
        middle += (low + high) / 2
        spread[same[0].group] += (high - low) / 2
        effects.append(Effect(kind, places, text, *np.sort([value(low), value(high)], axis=0)))
    half = np.sqrt(sum((own**2 for own in spread.values()), np.zeros(n)))
    ends = np.sort([value(middle - half), value(middle + half)], axis=0)
    without = sum((own.share for own in unknown), np.zeros(n))
    ends[:, without >= UNCOVERED] = np.nan
    most = [max(unknown, key=lambda own: own.share[k], default=None) for k in range(n)]
    reasons = tuple(own.reason if own and bad else "" for own, bad in zip(most, without >= UNCOVERED, strict=True))
    effects.sort(key=lambda own: -float(np.abs([own.low, own.high]).max(initial=0.0)))
    return ModelError(ends[0], ends[1], reasons, tuple(effects), tuple(unknown))


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
        _, _, nu, G = part.table.moduli(full.values)
        b, t = (own[:, 0].tolist() for own in part.table.end_sizes(full.values, full.geometry.parts[name].length))
        for m, (key, member) in enumerate(part.members.items()):
            own = slice(part.first[m], part.first[m + 1])
            length = float(full.geometry.parts[name].length[m])
            errors, kind, beam = _errors(full, name, m, evaluated(member, values), length, float(nu[m]))
            E = np.einsum("iecj,ieck->cjk", force[:, own], moved[:, own])
            parts: list[tuple[str, Array]] = list(
                zip(DIRECTIONS, (E[list(c)].sum(axis=0) for c in COMPONENTS), strict=True)
            )
            shares = [
                None if errors.reason else (float(x), float(y)) for x, y in zip(errors.low, errors.high, strict=True)
            ]
            if part.table.corrections.active[m, WARPING] and kind == "leaf":
                C, torque = full.matrices[name].elements.member_C[own, 3, 3], force[:, own, 3]
                uneven = torque - np.einsum("e,iej->ij", C / C.sum(), torque)[:, None]
                E = np.einsum("e,iej,iek->jk", C, uneven, uneven)
                parts[1] = (parts[1][0], parts[1][1] - E)
                parts.append(("uneven twist", E))
                shares.append((1 / _quicker(b[m], t[m], length, float(nu[m]), length / (C.sum() * G[m])) - 1, 0.0))
            for (direction, flexibility), share in zip(parts, shares, strict=True):
                text = f"{direction} of a {kind}, taken as a {beam}"
                group, E = f"{kind} {direction}", (flexibility + flexibility.T) / 2
                yield Assumption("beam", place_of(name, key), text, group, E, share, errors.reason if not share else "")


def _quicker(b: float, t: float, length: float, nu: float, J: float) -> float:
    """Squared frequency of the first twisting vibration of a strip that is held flat at both ends over that with a
    torsion constant J, m^4, that is meant for a torque of one size (V. Z. Vlasov, Thin-walled elastic beams, 1961;
    theory eq. M3)."""
    large, small = max(b, t), min(b, t)
    own = large * small**3 / 3 * (1 - 0.63 * small / large)
    decay = np.sqrt(24 * (1 - nu)) * length / large
    whole = CLAMPED_SLOPE + CLAMPED / decay**2
    if decay > 4:
        whole = min(whole, (np.pi / (1 - 2 / decay)) ** 2)
    return max(1.0, float(whole * own / (np.pi**2 * J)))


def _errors(
    full: FullOrderModel, name: str, m: int, member: Link | Flexure, length: float, nu: float
) -> tuple[MemberErrors, str, str]:
    """Measured errors of a member with its sizes as numbers, of what kind it is, and what it is taken as."""
    table = full.plan.parts[name].table
    if isinstance(member, Link) and isinstance(member.section, str):
        section = full.plan.layout.mechanism.sections[member.section]
        member = member.model_copy(update={"section": evaluated(section, full.plan.scoped_values(full.parameters))})
    corrected = bool(table.corrections.active[m, :-1].any())
    form = member.section if isinstance(member, Link) else member.profile
    errors = stiffness_errors(member, length, corrected, shears=bool(table.shear[m]), nu=nu)
    return errors, ratios_of(form, length)[0], "corrected beam" if corrected else "plain beam"


_ROOTS = ("joint with a block that is not drawn, taken as a large one", "joint with a block")


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
            share, text = (ROOT_DRAWN if drawn else ROOT_NOT_DRAWN), _ROOTS[drawn]
            if not is_in:
                share, text = ROOT_LEFT_OUT, "rigid joint, without the correction for roots"
            yield Assumption("root", place_of(name, key), text, "root" if drawn else "root not drawn", E, share)


def _solids(full: FullOrderModel, wrenches: Wrenches, values: Mapping[str, Any]) -> Iterator[Assumption]:
    """Bodies, and blocks of the ground."""
    for body in loaded_solids(full, wrenches, values):
        kind = "ground" if body.solid.held else "body"
        least, most = BODY if body.is_sure else GROUND
        ends = [full.plan.parts[name].members[key] for name, key in (end.member for end in body.ends)]
        if any(isinstance(member, Flexure) and member.profile.type == "notch" for member in ends):
            most = AT_NOTCH
        try:
            yield Assumption(kind, body.kind, body.text, kind, body.flexibility(), (least, most))
        except SolverError as error:
            all_of_it = EVERYTHING * np.eye(body.ends[0].wrench.shape[-1])
            yield Assumption(kind, body.kind, body.text, kind, all_of_it, None, str(error))
